//! Isosurface stuffing (Labelle and Shewchuk 2007): fills the inside of a surface with well-shaped tetrahedra.
//!
//! A body-centered cubic lattice of tetrahedra covers the body. Lattice nodes close to the surface are moved onto it.
//! Tetrahedra that the surface still cuts are clipped, and the part inside is divided again. No piece becomes very
//! thin, because close nodes have been moved.

use std::collections::HashMap;

use glam::{DVec3, IVec3};

use super::tetrahedron_volume;
use crate::Result;
use crate::base::memory;

/// The fraction of an edge's length within which a lattice node moves to the surface, for the long edges, along the
/// axes, and the short ones, to cube centers. Labelle and Shewchuk prove 10.7 degrees for 0.25 and 0.412. On the shape
/// of [`Mesh::organ`](super::Mesh::organ) those give 10.6 degrees, and the values here are better.
const LONG_EDGE_THRESHOLD: f64 = 0.3;
const SHORT_EDGE_THRESHOLD: f64 = 0.38;

/// The mean edge length of the lattice relative to the cubes' side: eight short and six long edges at each node.
const MEAN_EDGE: f64 = 0.923_3;

/// A body-centered cubic lattice: the corners of a grid of cubes, followed by the centers of the cubes.
pub(super) struct Lattice {
    /// The lowest corner of the grid.
    origin: DVec3,
    /// The side length of a cube.
    side: f64,
    /// The number of cubes along each axis.
    cubes: IVec3,
}

/// A node of the lattice: a corner of the grid or the center of a cube.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct Site {
    pub is_center: bool,
    pub cell: IVec3,
}

impl Lattice {
    /// Creates the lattice with mean edge length `spacing` that extends at least one cube beyond a box on every side.
    /// `None` if `u32` cannot count its nodes.
    pub fn around([low, high]: [DVec3; 2], spacing: f64) -> Option<Lattice> {
        let side = spacing / MEAN_EDGE;
        let cubes = ((high - low) / side).ceil() + 3.0;
        // Corners and centers.
        let nodes = 2.0 * (cubes.x + 1.0) * (cubes.y + 1.0) * (cubes.z + 1.0);
        (nodes < f64::from(u32::MAX)).then_some(Lattice {
            origin: (low + high - cubes * side) / 2.0,
            side,
            cubes: cubes.as_ivec3(),
        })
    }

    /// The side length of a cube.
    pub fn side(&self) -> f64 {
        self.side
    }

    /// The number of nodes along each axis: corners, or cube centers.
    pub fn size(&self, is_center: bool) -> IVec3 {
        if is_center { self.cubes } else { self.cubes + 1 }
    }

    fn corner_count(&self) -> usize {
        let corners = (self.cubes + 1).as_u64vec3();
        (corners.x * corners.y * corners.z) as usize
    }

    pub fn node_count(&self) -> usize {
        let cubes = self.cubes.as_u64vec3();
        self.corner_count() + (cubes.x * cubes.y * cubes.z) as usize
    }

    /// The index of a node, or `None` outside of the lattice.
    pub fn node(&self, site: Site) -> Option<usize> {
        let size = self.size(site.is_center);
        if site.cell.cmplt(IVec3::ZERO).any() || site.cell.cmpge(size).any() {
            return None;
        }
        let [x, y, z] = site.cell.as_u64vec3().to_array();
        let [row, rows, _] = size.as_u64vec3().to_array();
        let first = if site.is_center { self.corner_count() } else { 0 };
        Some(first + (x + row * (y + rows * z)) as usize)
    }

    pub fn site(&self, node: usize) -> Site {
        let is_center = node >= self.corner_count();
        let size = self.size(is_center);
        let [row, rows, _] = size.as_u64vec3().to_array();
        let index = if is_center { node - self.corner_count() } else { node } as u64;
        let (x, y, z) = (index % row, index / row % rows, index / row / rows);
        Site {
            is_center,
            cell: IVec3::new(x as i32, y as i32, z as i32),
        }
    }

    pub fn position(&self, site: Site) -> DVec3 {
        let offset = if site.is_center { 0.5 } else { 0.0 };
        self.origin + (site.cell.as_dvec3() + offset) * self.side
    }

    /// The nodes that share an edge with a node, and whether the edge is a long one.
    fn neighbors(&self, site: Site) -> impl Iterator<Item = (usize, bool)> {
        let long = [IVec3::X, IVec3::Y, IVec3::Z, IVec3::NEG_X, IVec3::NEG_Y, IVec3::NEG_Z]
            .map(|step| (site.cell + step, site.is_center, true));
        // The center of a cube has the indices of the cube's lowest corner.
        let sign = if site.is_center { 1 } else { -1 };
        let short = std::array::from_fn::<_, 8, _>(|i| {
            let step = IVec3::new(i as i32 & 1, i as i32 >> 1 & 1, i as i32 >> 2);
            (site.cell + sign * step, !site.is_center, false)
        });
        long.into_iter()
            .chain(short)
            .filter_map(|(cell, is_center, long)| Some((self.node(Site { is_center, cell })?, long)))
    }
}

/// The state of filling a body.
pub(super) struct IsosurfaceStuffing<'a> {
    lattice: &'a Lattice,
    /// For each lattice node 1 if it is inside the surface, 0 on it, -1 outside.
    sides: Vec<i8>,
    /// Returns the point where the surface crosses the segment between an inner and an outer position.
    surface: &'a dyn Fn(DVec3, DVec3) -> DVec3,
    /// The positions of moved nodes.
    moved: HashMap<usize, DVec3>,
    /// The mesh indices of lattice nodes, and of cut points by the cut edge.
    node_indices: HashMap<usize, u32>,
    cut_indices: HashMap<(usize, usize), u32>,
    positions: Vec<DVec3>,
    tetrahedra: Vec<[u32; 4]>,
}

impl<'a> IsosurfaceStuffing<'a> {
    pub fn new(lattice: &'a Lattice, sides: Vec<i8>, surface: &'a dyn Fn(DVec3, DVec3) -> DVec3) -> Self {
        Self {
            lattice,
            sides,
            surface,
            moved: HashMap::new(),
            node_indices: HashMap::new(),
            cut_indices: HashMap::new(),
            positions: Vec::new(),
            tetrahedra: Vec::new(),
        }
    }

    /// Returns the nodes and the tetrahedra, all with positive volume.
    pub fn fill(mut self) -> Result<(Vec<DVec3>, Vec<[u32; 4]>)> {
        self.snap_to_surface()?;
        // Every tetrahedron contains the long edge between the centers of two cubes that share a face, and one of the
        // face's four edges.
        for node in self.lattice.corner_count()..self.lattice.node_count() {
            let center = self.lattice.site(node);
            for (step, right, up) in [
                (IVec3::X, IVec3::Y, IVec3::Z),
                (IVec3::Y, IVec3::Z, IVec3::X),
                (IVec3::Z, IVec3::X, IVec3::Y),
            ] {
                let next = Site {
                    is_center: true,
                    cell: center.cell + step,
                };
                let Some(next) = self.lattice.node(next) else {
                    continue;
                };
                let face = [step, step + right, step + right + up, step + up].map(|corner| {
                    self.lattice.node(Site {
                        is_center: false,
                        cell: center.cell + corner,
                    })
                });
                for i in 0..4 {
                    if let (Some(a), Some(b)) = (face[i], face[(i + 1) % 4]) {
                        self.add_clipped([node, next, a, b])?;
                    }
                }
            }
        }
        Ok((self.positions, self.tetrahedra))
    }

    /// Moves each node that is close to the surface onto it, along the edge with the nearest crossing.
    fn snap_to_surface(&mut self) -> Result<()> {
        for node in 0..self.sides.len() {
            let site = self.lattice.site(node);
            let position = self.lattice.position(site);
            let mut nearest: Option<(f64, DVec3)> = None;
            for (other, long) in self.lattice.neighbors(site) {
                if self.sides[node] * self.sides[other] < 0 {
                    let cut = self.cut(node, other);
                    let other_position = self.lattice.position(self.lattice.site(other));
                    let fraction = cut.distance(position) / other_position.distance(position);
                    let threshold = if long {
                        LONG_EDGE_THRESHOLD
                    } else {
                        SHORT_EDGE_THRESHOLD
                    };
                    let distance = cut.distance(position);
                    if fraction < threshold && nearest.is_none_or(|(least, _)| distance < least) {
                        nearest = Some((distance, cut));
                    }
                }
            }
            if let Some((_, position)) = nearest {
                self.sides[node] = 0;
                self.moved.try_reserve(1)?;
                self.moved.insert(node, position);
            }
        }
        Ok(())
    }

    /// The point where the surface crosses the edge between two nodes on different sides, neither of them moved.
    fn cut(&self, a: usize, b: usize) -> DVec3 {
        let (inner, outer) = if self.sides[a] > 0 { (a, b) } else { (b, a) };
        let position_of = |node: usize| self.lattice.position(self.lattice.site(node));
        (self.surface)(position_of(inner), position_of(outer))
    }

    /// The mesh index of a lattice node.
    fn node_index(&mut self, node: usize) -> Result<u32> {
        if let Some(&node_index) = self.node_indices.get(&node) {
            return Ok(node_index);
        }
        let position = match self.moved.get(&node) {
            Some(&position) => position,
            None => self.lattice.position(self.lattice.site(node)),
        };
        self.node_indices.try_reserve(1)?;
        let node_index = self.positions.len() as u32;
        self.node_indices.insert(node, node_index);
        memory::push(&mut self.positions, position)?;
        Ok(node_index)
    }

    /// The mesh index of the cut point between an inner and an outer node.
    fn cut_index(&mut self, inner: usize, outer: usize) -> Result<u32> {
        if let Some(&node_index) = self.cut_indices.get(&(inner, outer)) {
            return Ok(node_index);
        }
        let position = self.cut(inner, outer);
        self.cut_indices.try_reserve(1)?;
        let node_index = self.positions.len() as u32;
        self.cut_indices.insert((inner, outer), node_index);
        memory::push(&mut self.positions, position)?;
        Ok(node_index)
    }

    /// Adds the part of a lattice tetrahedron that is inside the body.
    fn add_clipped(&mut self, mut nodes: [usize; 4]) -> Result<()> {
        // Sorted: inside, on the surface, outside.
        nodes.sort_by_key(|&node| -self.sides[node]);
        let [p, q, r, s] = nodes;
        match nodes.map(|node| self.sides[node]) {
            [..=0, _, _, _] => Ok(()),
            [_, _, _, 0 | 1] => {
                let corners = [
                    self.node_index(p)?,
                    self.node_index(q)?,
                    self.node_index(r)?,
                    self.node_index(s)?,
                ];
                self.add(corners)
            }
            // One node inside: a smaller tetrahedron at it.
            [_, ..=0, _, _] => {
                let mut corners = [self.node_index(p)?; 4];
                for (corner, &node) in corners.iter_mut().zip(&nodes).skip(1) {
                    *corner = if self.sides[node] == 0 {
                        self.node_index(node)?
                    } else {
                        self.cut_index(p, node)?
                    };
                }
                self.add(corners)
            }
            // Two nodes inside, one on the surface: a pyramid on the clipped face.
            [_, _, 0, _] => {
                let (top, p_cut, q_cut) = (self.node_index(r)?, self.cut_index(p, s)?, self.cut_index(q, s)?);
                let (p_index, q_index) = (self.node_index(p)?, self.node_index(q)?);
                if self.takes_diagonal(p, q, s) {
                    self.add([top, p_index, q_index, p_cut])?;
                    self.add([top, q_index, p_cut, q_cut])
                } else {
                    self.add([top, p_index, q_index, q_cut])?;
                    self.add([top, p_index, p_cut, q_cut])
                }
            }
            // Two nodes inside, two outside: a wedge along the inner edge.
            [_, _, ..=-1, _] => {
                let near_triangle = [self.node_index(p)?, self.cut_index(p, r)?, self.cut_index(p, s)?];
                let far_triangle = [self.node_index(q)?, self.cut_index(q, r)?, self.cut_index(q, s)?];
                let position_of = |node_index: u32| self.positions[node_index as usize];
                // The cut quadrilateral belongs to this tetrahedron alone, so its shorter diagonal is used.
                let one_first = position_of(near_triangle[1]).distance(position_of(far_triangle[2]))
                    <= position_of(near_triangle[2]).distance(position_of(far_triangle[1]));
                let order = match (self.takes_diagonal(q, p, r), self.takes_diagonal(q, p, s), one_first) {
                    (true, false, _) => [2, 0, 1],
                    (false, true, _) => [1, 0, 2],
                    (true, true, true) => [0, 1, 2],
                    (true, true, false) => [0, 2, 1],
                    (false, false, true) => [1, 2, 0],
                    (false, false, false) => [2, 1, 0],
                };
                self.add_prism(order.map(|i| near_triangle[i]), order.map(|i| far_triangle[i]))
            }
            // Three nodes inside: the tetrahedron without its tip.
            [_, _, _, _] => {
                let mut sides = [p, q, r];
                sides.sort_by(|&a, &b| self.takes_diagonal(a, b, s).cmp(&self.takes_diagonal(b, a, s)));
                let [p, q, r] = sides;
                let near_triangle = [self.node_index(p)?, self.node_index(q)?, self.node_index(r)?];
                let far_triangle = [self.cut_index(p, s)?, self.cut_index(q, s)?, self.cut_index(r, s)?];
                self.add_prism(near_triangle, far_triangle)
            }
        }
    }

    /// Adds a triangular prism. The diagonal of each side runs from the near corner of the earlier edge to the far
    /// corner of the later.
    fn add_prism(&mut self, near_corners: [u32; 3], far_corners: [u32; 3]) -> Result<()> {
        self.add([near_corners[0], near_corners[1], near_corners[2], far_corners[2]])?;
        self.add([near_corners[0], near_corners[1], far_corners[1], far_corners[2]])?;
        self.add([near_corners[0], far_corners[0], far_corners[1], far_corners[2]])
    }

    /// The choice of diagonal on a face whose edges from the inner nodes `a` and `b` to `outer` are cut: true if the
    /// cut point on the edge from `a` is joined to `b`. Both tetrahedra at the face agree. The order of the three
    /// edges at a tip is total, so that the rest can be divided.
    fn takes_diagonal(&self, a: usize, b: usize, outer: usize) -> bool {
        self.rank(a, outer) > self.rank(b, outer)
    }

    /// Short edges before long ones, then by the index of the inner node.
    fn rank(&self, inner: usize, outer: usize) -> (bool, usize) {
        let short = self.lattice.site(inner).is_center != self.lattice.site(outer).is_center;
        (short, inner)
    }

    /// Adds a tetrahedron, oriented such that its volume is positive.
    fn add(&mut self, mut tetrahedron: [u32; 4]) -> Result<()> {
        let corners = tetrahedron.map(|node_index| self.positions[node_index as usize]);
        if tetrahedron_volume(corners) < 0.0 {
            tetrahedron.swap(2, 3);
        }
        memory::push(&mut self.tetrahedra, tetrahedron)
    }
}
