//! A surface that can be cut: cells of material, triangles of the render mesh, and vertices that are bound to nodes.

use glam::{DVec3, Vec3};

use super::cell_complex::{
    Cell, CellComplex, NONE, Node, SNAP, Simplex, cell_complex, insert_corners, nodes_without_cells, rest_positions_of,
    weighted_mean,
};
use super::cell_copies::piece_count;
use super::tracked::Tracked;
use crate::base::{Error, Result, ensure, memory};
use crate::codec::saved;

/// A simulated triangle.
///
/// ```
#[doc = include_str!("../doctest/cut_sheet.txt")]
/// # let near = sheet.near(&across, &mesh.positions)?;
/// # sheet.cut(&across, &mesh.positions, &near, Limits::NONE)?;
/// let area: f64 = sheet.cells().iter().map(|cell| cell.area).sum();
/// // A cut takes nothing away.
/// assert!((area - 0.01).abs() < 1e-8);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceCell {
    /// The nodes.
    pub nodes: [u32; 3],
    /// The area of the material in the rest shape, m²: that of the render triangles in the cell.
    pub area: f64,
    /// The snapping distance in the rest shape, m.
    pub snap: f64,
    /// The first render triangle in the cell.
    pub(crate) first: u32,
    /// For each node the next corner at the node. Corner k of cell c has the index 3 c + k.
    pub(crate) next: [u32; 3],
}

saved! { SurfaceCell { nodes, area, snap, first, next } }

/// A triangle of the render mesh.
///
/// ```
#[doc = include_str!("../doctest/cut_sheet.txt")]
/// # let near = sheet.near(&across, &mesh.positions)?;
/// # let changes = sheet.cut(&across, &mesh.positions, &near, Limits::NONE)?;
/// let rim = sheet.triangles().iter().flat_map(|triangle| triangle.rim).filter(|&is_rim| is_rim);
/// assert_eq!(rim.count(), changes.rim.len());
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceTriangle {
    /// The vertices.
    pub corners: [u32; 3],
    /// The cell that contains the triangle.
    pub cell: u32,
    /// For each side, from each corner to the next, true if it was cut.
    pub rim: [bool; 3],
    /// The triangle across the side from each corner to the next.
    pub(crate) neighbors: [u32; 3],
    /// The next triangle of the same cell.
    pub(crate) next: u32,
}

saved! { SurfaceTriangle { corners, cell, rim, neighbors, next } }

/// A vertex of the render mesh.
///
/// ```
/// # use glam::Vec3;
/// # use sinew::{cutting::CutSurface, mesh::Mesh};
/// # let mesh = Mesh::cloth([0.1, 0.1], [4, 4])?;
/// # let sheet = CutSurface::new(&mesh.positions, &mesh.triangles)?;
/// // As long as nothing is cut, each vertex is at a node.
/// for vertex in sheet.vertices() {
///     let parts = vertex.nodes.iter().zip(vertex.weights);
///     let place: Vec3 = parts.map(|(&node, weight)| weight as f32 * mesh.positions[node as usize]).sum();
///     assert_eq!(place, mesh.positions[vertex.point as usize]);
/// }
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceVertex {
    /// The nodes that it is bound to. Unused entries repeat the first one with weight 0.
    pub nodes: [u32; 3],
    /// The weights of the nodes. They are at least 0 and add up to 1.
    pub weights: [f64; 3],
    /// The index among nodes, which no other vertex has: that of the node at this vertex, or a separate one.
    pub point: u32,
    /// One of the triangles around it.
    pub(crate) around: u32,
}

saved! { SurfaceVertex { nodes, weights, point, around } }

/// A surface that can be cut.
///
/// ```
/// # use glam::vec3;
/// # use sinew::cutting::{CutSurface, Limits, Sweep};
/// # use sinew::mesh::Mesh;
/// # let mesh = Mesh::cloth([0.1, 0.1], [4, 4])?;
/// # let edge = |z| [vec3(0.003, -0.01, z), vec3(0.003, 0.01, z)];
/// # let across = Sweep { start: edge(-0.06), end: edge(0.06) };
/// let mut sheet = CutSurface::new(&mesh.positions, &mesh.triangles)?;
/// let near = sheet.near(&across, &mesh.positions)?;
/// sheet.cut(&across, &mesh.positions, &near, Limits::NONE)?;
/// assert_eq!(sheet.piece_count()?, 2);
/// sheet.undo();
/// assert_eq!(sheet.piece_count()?, 1);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct CutSurface {
    pub(crate) nodes: Tracked<Node>,
    pub(crate) cells: Tracked<SurfaceCell>,
    pub(crate) triangles: Tracked<SurfaceTriangle>,
    pub(crate) vertices: Tracked<SurfaceVertex>,
}

saved! { CutSurface { nodes, cells, triangles, vertices } }

cell_complex!(CutSurface, 3, SurfaceCell { area }, triangles, SurfaceTriangle, {
    const EDGES: &'static [[usize; 2]] = &[[0, 1], [1, 2], [2, 0]];
    const SIDES: [&'static [usize]; 3] = [&[0, 1], &[1, 2], &[2, 0]];

    fn material_fraction(&self, triangle: u32) -> f64 {
        self.part_of_cell(triangle)
    }

    fn move_simplex(&mut self, triangle: u32, cell: u32, next: u32) -> Result<()> {
        self.triangles
            .edit(triangle, |triangle| (triangle.cell, triangle.next) = (cell, next))
    }
});

impl CutSurface {
    /// Creates a surface from the rest positions of its nodes, m, and from cells with three nodes each. The render mesh
    /// starts as the cells, with a vertex for each node.
    ///
    /// Positions must be finite, nodes known, and areas positive. The surface must be a consistently oriented
    /// 2-manifold: at most two cells at an edge, and one fan of cells at a node.
    pub fn new(rest: &[Vec3], cells: &[[u32; 3]]) -> Result<Self> {
        ensure!(
            rest.len().max(cells.len()) < (NONE / 3) as usize,
            "more than 2^32 / 3 nodes or cells"
        );
        let mut nodes = nodes_without_cells(rest)?;
        let mut vertices = memory::collected((0..rest.len() as u32).map(|node| SurfaceVertex {
            nodes: [node; 3],
            weights: [1.0, 0.0, 0.0],
            point: node,
            around: NONE,
        }))?;
        let mut surface_cells = memory::reserved(cells.len())?;
        let mut triangles = memory::reserved(cells.len())?;
        for (number, &corners) in cells.iter().enumerate() {
            let positions = rest_positions_of(number, corners, rest)?;
            let area = area_of(positions);
            ensure!(area > 0.0, "cell {number} of nodes {corners:?} has no area");
            let shortest = (0..3)
                .map(|k| positions[k].distance(positions[(k + 1) % 3]))
                .fold(f64::INFINITY, f64::min);
            for node in corners {
                vertices[node as usize].around = number as u32;
            }
            surface_cells.push(SurfaceCell {
                nodes: corners,
                area,
                snap: SNAP * shortest,
                first: number as u32,
                next: insert_corners(&mut nodes, number, corners),
            });
            triangles.push(SurfaceTriangle {
                corners,
                cell: number as u32,
                rim: [false; 3],
                neighbors: [NONE; 3],
                next: NONE,
            });
        }
        join_neighbors(&mut triangles)?;
        let surface = Self {
            nodes: Tracked::new(nodes),
            cells: Tracked::new(surface_cells),
            triangles: Tracked::new(triangles),
            vertices: Tracked::new(vertices),
        };
        surface.check_fans()?;
        Ok(surface)
    }

    /// Reserves space for this many more nodes, and for everything else that cuts with these nodes usually need. Cuts
    /// then need not reallocate.
    pub fn reserve(&mut self, nodes: u32) -> Result<()> {
        let nodes = nodes as usize;
        self.nodes.reserve(nodes)?;
        self.cells.reserve(2 * nodes)?;
        self.triangles.reserve(4 * nodes)?;
        self.vertices.reserve(4 * nodes)
    }

    /// The vertices of the render mesh. Cuts never remove one.
    pub fn vertices(&self) -> &[SurfaceVertex] {
        self.vertices.values()
    }

    /// The rest position of a point of a cell, given by weights of its corners.
    pub(crate) fn rest_position_in(&self, cell: u32, weights: [f64; 3]) -> DVec3 {
        let nodes = self.cells[cell].nodes;
        (0..3).map(|k| weights[k] * self.nodes[nodes[k]].rest.as_dvec3()).sum()
    }

    /// The area of a triangle as a fraction of its whole cell.
    pub fn part_of_cell(&self, triangle: u32) -> f64 {
        let SurfaceTriangle { corners, cell, .. } = self.triangles[triangle];
        signed_area_fraction(corners.map(|corner| self.weights_in(corner, cell)))
    }

    /// The number of connected components of the render mesh. All triangles are visited.
    pub fn piece_count(&self) -> Result<u32> {
        piece_count(self.triangles().iter().map(|triangle| triangle.neighbors))
    }

    /// A third of the material of the cells at a node, m².
    pub fn area_at(&self, node: u32) -> f64 {
        self.cells_at(node).map(|cell| self.cells[cell].area / 3.0).sum()
    }

    /// The area of a triangle in the rest shape.
    pub(crate) fn rest_area(&self, triangle: u32) -> f64 {
        area_of(self.triangles[triangle].corners.map(|corner| self.rest_place(corner)))
    }

    /// The shortest edge of a cell at a vertex in the rest shape, m.
    pub(crate) fn size_at(&self, vertex: u32) -> f64 {
        self.cells[self.triangles[self.vertices[vertex].around].cell].snap / SNAP
    }

    /// The triangles around a vertex, counterclockwise, each with the corner index of the vertex. An open fan starts
    /// with its first triangle.
    pub(crate) fn ring(&self, vertex: u32, ring: &mut Vec<(u32, usize)>) -> Result<()> {
        ring.clear();
        let start = self.vertices[vertex].around;
        let mut triangle = start;
        while triangle != NONE {
            let corner = self.corner(triangle, vertex);
            memory::push(ring, (triangle, corner))?;
            triangle = self.triangles[triangle].neighbors[(corner + 2) % 3];
            if triangle == start {
                return Ok(());
            }
        }
        // The fan is open: the triangles before its start are missing.
        let count = ring.len();
        let mut triangle = self.triangles[start].neighbors[ring[0].1];
        while triangle != NONE {
            let corner = self.corner(triangle, vertex);
            memory::push(ring, (triangle, corner))?;
            triangle = self.triangles[triangle].neighbors[corner];
        }
        ring[count..].reverse();
        ring.rotate_left(count);
        Ok(())
    }

    /// The corner index of a vertex in a triangle.
    pub(crate) fn corner(&self, triangle: u32, vertex: u32) -> usize {
        let corners = self.triangles[triangle].corners;
        (0..2).find(|&k| corners[k] == vertex).unwrap_or(2)
    }

    fn check_fans(&self) -> Result<()> {
        let mut counts = memory::filled(0, self.vertices.values().len())?;
        for corner in self.triangles.values().iter().flat_map(|triangle| triangle.corners) {
            counts[corner as usize] += 1;
        }
        let mut ring = Vec::new();
        for (vertex, &count) in counts.iter().enumerate().filter(|&(_, &count)| count > 0) {
            self.ring(vertex as u32, &mut ring)?;
            ensure!(
                ring.len() == count,
                "node {vertex} has {count} cells, of which {} hang together by edges",
                ring.len()
            );
        }
        Ok(())
    }
}

/// Finds the neighbors of each triangle.
fn join_neighbors(triangles: &mut [SurfaceTriangle]) -> Result<()> {
    let mut sides = memory::reserved(3 * triangles.len())?;
    for (number, triangle) in triangles.iter().enumerate() {
        for k in 0..3 {
            let (from, to) = (triangle.corners[k], triangle.corners[(k + 1) % 3]);
            sides.push((from.min(to), from.max(to), from > to, number as u32, k));
        }
    }
    sides.sort_unstable();
    for at_edge in sides.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        let (low, high, ..) = at_edge[0];
        match *at_edge {
            [_] => {}
            [(.., false, a, side_a), (.., true, b, side_b)] => {
                triangles[a as usize].neighbors[side_a] = b;
                triangles[b as usize].neighbors[side_b] = a;
            }
            [(.., a, _), (.., b, _)] => {
                return Err(Error::invalid(format!(
                    "cells {a} and {b} run along the edge of nodes {low} and {high} in the same direction"
                )));
            }
            _ => {
                return Err(Error::invalid(format!(
                    "{} cells have the edge of nodes {low} and {high}",
                    at_edge.len()
                )));
            }
        }
    }
    Ok(())
}

/// The area of a triangle.
pub(crate) fn area_of([a, b, c]: [DVec3; 3]) -> f64 {
    0.5 * (b - a).cross(c - a).length()
}

/// The signed area of a triangle whose corners are given by weights of another one, as a fraction of that one. It is
/// above 0 if both have the same orientation.
pub(crate) fn signed_area_fraction([a, b, c]: [[f64; 3]; 3]) -> f64 {
    (b[1] - a[1]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[1] - a[1])
}
