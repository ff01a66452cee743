//! Surfaces that enclose a solid, checked once.

use glam::{DVec3, Vec3};

use super::{check_indices, tetrahedron_volume};
use crate::base::{DisjointSets, ensure, memory};
use crate::geometry::Bounds;
use crate::geometry::predicates::{crosses, solid_angle};
use crate::geometry::tree::Tree;
use crate::{Error, Result};

/// A triangle lies along a line where it is lower than this part of its longest side: about what rounding makes of it.
const FLAT: f64 = 1e-6;

/// Triangles cross where they pass through each other by more than this part of the largest coordinate: about what rounding makes of them.
const CROSSING: f64 = 1e-6;

/// Rounds of turning edges, at most: of a row of flat triangles along one edge, each round parts one.
const ROUNDS: usize = 100;

/// No node lies further from the origin, m: squares of distances stay finite in `f32`.
pub(crate) const FURTHEST: f32 = 1e9;

/// So many triangles of a part are tried for one that no other part touches.
const TRIES: usize = 16;

/// The surface of a solid: triangles that enclose a volume, face outward and do not cross each other.
///
/// Parts that lie apart, touch, or are hollow (an outer surface and an inner one that faces into the hole) are one solid.
///
/// ```
/// use sinew::mesh::{ClosedSurface, Mesh};
/// let block = Mesh::block([0.1, 0.1, 0.1], [2, 2, 2])?;
/// let surface = ClosedSurface::new(&block.positions, &block.surface()?)?;
/// assert!((surface.volume() - 1e-3).abs() < 1e-9);
/// // A sheet encloses nothing.
/// let sheet = Mesh::cloth([0.1, 0.1], [2, 2])?;
/// assert!(ClosedSurface::new(&sheet.positions, &sheet.triangles).is_err());
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct ClosedSurface {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    volume: f64,
}

impl ClosedSurface {
    /// Checks that `triangles` (three node indices each, outward by the right-hand rule) over `positions` (metres) enclose a solid.
    ///
    /// Nodes at exactly the same place count as one, as in STL files, where each triangle brings its own corners: triangles then name
    /// the first of them. A triangle that lies along a line, lower than 1e-6 of its longest side, closes a gap where nodes lie on the edge
    /// of a neighbour; it takes a part of that neighbour, so that both have an area.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`], naming triangles and nodes, where there are no triangles; an index is that of no node; a position is
    /// not finite or further than 1e9 m from the origin; a triangle repeats a place, or lies along a line and has no neighbour to take a
    /// part of; an edge is not gone along as often in one direction as in the other, so that the surface is open; the surface, or a part of
    /// it, is inside out; two triangles pass through each other, by more than 1e-6 of the largest coordinate. [`Error::OutOfMemory`].
    pub fn new(positions: &[Vec3], triangles: &[[u32; 3]]) -> Result<Self> {
        ensure!(!triangles.is_empty(), "no triangles: they enclose nothing");
        check_indices("triangle", triangles, positions.len())?;
        ensure!(
            triangles.len() <= (u32::MAX / 4) as usize,
            "{} triangles: at most {} are possible",
            triangles.len(),
            u32::MAX / 4
        );
        for (node, position) in positions.iter().enumerate() {
            ensure!(
                position.abs().max_element() <= FURTHEST && position.is_finite(),
                "the position of node {node} is {position}: must be finite and within {FURTHEST:e} m of the origin"
            );
        }
        let mut surface = Self {
            positions: memory::copied(positions)?,
            triangles: memory::copied(triangles)?,
            volume: 0.0,
        };
        surface.weld()?;
        surface.check_corners()?;
        let parts = surface.parts()?;
        surface.part_flat_triangles()?;
        surface.check_volume()?;
        // Of parts that cross, neither lies within the other.
        surface.check_crossings()?;
        surface.check_parts(parts)?;
        Ok(surface)
    }

    /// The same of what may cross itself, and have triangles without an area: it is closed, and encloses something.
    pub(super) fn loose(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Result<Self> {
        let mut surface = Self {
            positions,
            triangles,
            volume: 0.0,
        };
        surface.parts()?;
        surface.check_volume()?;
        Ok(surface)
    }

    /// Where each node is, as given.
    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    /// The triangles in the order given; of nodes at the same place they name the first, and what lay along a line has taken a part of its
    /// neighbour.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// What it encloses, m³.
    pub fn volume(&self) -> f64 {
        self.volume
    }

    fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.triangles[triangle].map(|node| self.positions[node as usize])
    }

    /// Names nodes at the same place by the first of them.
    fn weld(&mut self) -> Result<()> {
        let positions = &self.positions;
        let mut order: Vec<u32> = memory::collected(0..positions.len() as u32)?;
        // Adding 0 makes one of the two zeros.
        let place = |node: u32| (positions[node as usize] + 0.0).to_array().map(f32::to_bits);
        order.sort_unstable_by_key(|&node| (place(node), node));
        let mut first_at: Vec<u32> = memory::filled(0, positions.len())?;
        for same in order.chunk_by(|&a, &b| place(a) == place(b)) {
            for &node in same {
                first_at[node as usize] = same[0];
            }
        }
        for triangle in &mut self.triangles {
            *triangle = triangle.map(|node| first_at[node as usize]);
        }
        Ok(())
    }

    fn check_corners(&self) -> Result<()> {
        for (index, &[a, b, c]) in self.triangles.iter().enumerate() {
            ensure!(
                a != b && b != c && c != a,
                "triangle {index} has no area: nodes {a}, {b} and {c}, counted once where they are at the same place"
            );
        }
        Ok(())
    }

    fn is_flat(&self, triangle: usize) -> bool {
        relative_height(self.corners(triangle)) <= FLAT
    }

    /// Turns edges until no triangle is flat: the longest of each, so that it parts its neighbour there. Where the lower of the two would become no
    /// higher, the neighbour's longest edge is turned first (longest-edge paths: Rivara 1997). Refused where this does not help.
    fn part_flat_triangles(&mut self) -> Result<()> {
        let mut sides: Vec<(u64, u32, u32)> = Vec::new();
        let mut touched: Vec<bool> = Vec::new();
        for round in 0..=ROUNDS {
            let Some(first) = (0..self.triangles.len()).find(|&index| self.is_flat(index)) else {
                return Ok(());
            };
            if round == ROUNDS {
                let [a, b, c] = self.triangles[first];
                return Err(Error::invalid(format!(
                    "triangle {first} has no area: nodes {a}, {b} and {c} lie along a line"
                )));
            }
            sides.clear();
            sides.try_reserve(3 * self.triangles.len())?;
            for (index, triangle) in (0_u32..).zip(&self.triangles) {
                for (side, ends) in (0_u32..).zip(super::TRIANGLE_EDGES) {
                    sides.push((super::pack(triangle, ends), index, side));
                }
            }
            sides.sort_unstable();
            touched.clear();
            touched.try_reserve(self.triangles.len())?;
            touched.resize(self.triangles.len(), false);
            for flat in first..self.triangles.len() {
                if self.is_flat(flat) {
                    self.turn_edge_beside(flat, &sides, &mut touched);
                }
            }
        }
        Ok(())
    }

    /// Turns the longest edge of a flat triangle, or a longer one that leads on from there. `sides` has the edges of all triangles in order, as they were
    /// when none was `touched`.
    fn turn_edge_beside(&mut self, flat: usize, sides: &[(u64, u32, u32)], touched: &mut [bool]) {
        let mut triangle = flat;
        let mut length = 0.0;
        loop {
            let (side, squared) = longest_side(self.corners(triangle));
            let edge = super::pack(&self.triangles[triangle], super::TRIANGLE_EDGES[side]);
            let start = sides.partition_point(|other| other.0 < edge);
            let mut others = sides[start..].iter().take_while(|other| other.0 == edge);
            let (Some(one), Some(two), None) = (others.next(), others.next(), others.next()) else {
                return;
            };
            let &(_, neighbour, across) = if one.1 as usize == triangle { two } else { one };
            let neighbour = neighbour as usize;
            if squared <= length || touched[triangle] || touched[neighbour] {
                return;
            }
            let turn = |triangle: [u32; 3], by: usize| [0, 1, 2].map(|corner| triangle[(corner + by) % 3]);
            // From `c` to `a` along the edge, and in the neighbour back.
            let [c, a, b] = turn(self.triangles[triangle], side);
            let [_, _, d] = turn(self.triangles[neighbour], across as usize);
            let turned = [[a, b, d], [b, c, d]];
            let parting = (u64::from(b.min(d)) << 32) | u64::from(b.max(d));
            let is_there = sides.binary_search_by_key(&parting, |other| other.0).is_ok();
            let height = |nodes: [u32; 3]| relative_height(nodes.map(|node| self.positions[node as usize]));
            let least = |both: [[u32; 3]; 2]| height(both[0]).min(height(both[1]));
            let now = least([self.triangles[triangle], self.triangles[neighbour]]);
            if b != d && !is_there && least(turned) > now {
                [self.triangles[triangle], self.triangles[neighbour]] = turned;
                (touched[triangle], touched[neighbour]) = (true, true);
                return;
            }
            (triangle, length) = (neighbour, squared);
        }
    }

    /// For each triangle the first of those that are joined to it by edges; refused where an edge is open.
    fn parts(&self) -> Result<Vec<u32>> {
        let mut sides: Vec<(u64, u32, bool)> = memory::reserved(3 * self.triangles.len())?;
        for (index, triangle) in (0_u32..).zip(&self.triangles) {
            for ends in super::TRIANGLE_EDGES {
                let ahead = triangle[ends[0]] < triangle[ends[1]];
                sides.push((super::pack(triangle, ends), index, ahead));
            }
        }
        sides.sort_unstable();
        let mut parts = DisjointSets::new(self.triangles.len())?;
        for same in sides.chunk_by(|a, b| a.0 == b.0) {
            let ahead = same.iter().filter(|side| side.2).count();
            let back = same.len() - ahead;
            if ahead != back {
                let [low, high] = super::unpack(same[0].0);
                let (from, to) = if ahead > back { (low, high) } else { (high, low) };
                let more = same.iter().find(|side| side.2 == (ahead > back));
                let triangle = more.map_or(same[0].1, |side| side.1);
                return Err(Error::invalid(format!(
                    "the surface is not closed: triangle {triangle} goes along the edge from node {from} to node {to} as {} do, and {} \
                     the other way",
                    ahead.max(back),
                    ahead.min(back)
                )));
            }
            for pair in same.windows(2) {
                parts.unite(pair[0].1 as usize, pair[1].1 as usize);
            }
        }
        Ok(parts.into_lowest())
    }

    /// What some triangles enclose, m³: seen from a point of theirs, so that a solid far away loses no digits.
    fn enclosed(&self, triangles: impl Iterator<Item = usize>) -> f64 {
        let mut apex = None;
        let mut volume = 0.0;
        for index in triangles {
            let [a, b, c] = self.corners(index).map(|corner| corner.as_dvec3());
            volume += tetrahedron_volume([*apex.get_or_insert(a), a, b, c]);
        }
        volume
    }

    fn check_volume(&mut self) -> Result<()> {
        self.volume = self.enclosed(0..self.triangles.len());
        ensure!(
            self.volume > 0.0,
            "the surface encloses {:e} m³: its triangles face inward, or enclose nothing",
            self.volume
        );
        Ok(())
    }

    /// Refuses parts that are inside out: those that face outward lie outside of all others, those that face inward within one.
    fn check_parts(&self, parts: Vec<u32>) -> Result<()> {
        let mut order: Vec<u32> = memory::collected(0..parts.len() as u32)?;
        order.sort_unstable_by_key(|&triangle| (parts[triangle as usize], triangle));
        let same = |a: &u32, b: &u32| parts[*a as usize] == parts[*b as usize];
        if order.chunk_by(same).nth(1).is_none() {
            return Ok(());
        }
        let mut boxes = Vec::new();
        for part in order.chunk_by(same) {
            let points = part.iter().flat_map(|&triangle| self.corners(triangle as usize));
            memory::push(&mut boxes, Bounds::of(points))?;
        }
        for (index, part) in order.chunk_by(same).enumerate() {
            // How often the others wind about a point of it: the clearest of some, as parts may touch.
            let mut winding = 0.0;
            let mut doubt = f64::INFINITY;
            for &triangle in part.iter().step_by(part.len().div_ceil(TRIES)) {
                let corners = self.corners(triangle as usize);
                let point = corners.iter().map(|corner| corner.as_dvec3()).sum::<DVec3>() / 3.0;
                let here = Bounds::of(std::iter::once(point.as_vec3()));
                let mut angle = 0.0;
                for (other, others) in order.chunk_by(same).enumerate() {
                    if other != index && boxes[other].overlaps(&here) {
                        angle += others
                            .iter()
                            .map(|&triangle| {
                                solid_angle(point, self.corners(triangle as usize).map(|corner| corner.as_dvec3()))
                            })
                            .sum::<f64>();
                    }
                }
                let found = angle / (4.0 * std::f64::consts::PI);
                if (found - found.round()).abs() < doubt {
                    doubt = (found - found.round()).abs();
                    winding = found.round();
                }
                if doubt < 1e-3 {
                    break;
                }
            }
            let volume = self.enclosed(part.iter().map(|&triangle| triangle as usize));
            let asked = if volume > 0.0 { 0.0 } else { 1.0 };
            // Where it touches others wherever it was tried, nothing is known.
            if winding != asked && doubt < 0.1 {
                return Err(Error::invalid(if volume > 0.0 {
                    format!(
                        "the part of the surface with triangle {} faces outward and lies within another part: leave it out, or turn \
                         its triangles where it is a hole",
                        part[0]
                    )
                } else {
                    format!(
                        "the part of the surface with triangle {} is inside out: its triangles face inward and no part lies around it",
                        part[0]
                    )
                }));
            }
        }
        Ok(())
    }

    fn check_crossings(&self) -> Result<()> {
        let tree = Tree::new(self.triangles.len(), |triangle| self.corners(triangle as usize))?;
        let bounds = tree.bounds();
        let depth = CROSSING * f64::from(bounds.magnitudes().max_element());
        for (index, nodes) in self.triangles.iter().enumerate() {
            let corners = self.corners(index);
            let bounds = Bounds::of(corners.into_iter());
            let mut crossed = None;
            tree.near(&bounds, 0.0, |place| {
                let other = tree.triangle(place) as usize;
                if other > index
                    && crossed.is_none()
                    && (pierces(nodes, corners, &self.triangles[other], self.corners(other), depth)
                        || pierces(&self.triangles[other], self.corners(other), nodes, corners, depth))
                {
                    crossed = Some(other);
                }
                0.0
            });
            if let Some(other) = crossed {
                return Err(Error::invalid(format!(
                    "triangles {index} and {other} pass through each other: the surface crosses itself"
                )));
            }
        }
        Ok(())
    }
}

/// The number of a triangle's longest side, and the square of its length.
fn longest_side(corners: [Vec3; 3]) -> (usize, f64) {
    let mut longest = (0, 0.0);
    for side in 0..3 {
        let squared = corners[side]
            .as_dvec3()
            .distance_squared(corners[(side + 1) % 3].as_dvec3());
        if squared > longest.1 {
            longest = (side, squared);
        }
    }
    longest
}

/// A triangle's height over its longest side, as a part of that; 0 of a point.
fn relative_height(corners: [Vec3; 3]) -> f64 {
    let [a, b, c] = corners.map(|corner| corner.as_dvec3());
    ((b - a).cross(c - a).length() / longest_side(corners).1).max(0.0)
}

/// Whether an edge of the first triangle passes through the second, with which it shares no node.
fn pierces(nodes: &[u32; 3], corners: [Vec3; 3], others: &[u32; 3], triangle: [Vec3; 3], depth: f64) -> bool {
    super::TRIANGLE_EDGES.iter().any(|ends| {
        ends.iter().all(|&end| !others.contains(&nodes[end]))
            && crosses(corners[ends[0]], corners[ends[1]], triangle, depth)
    })
}
