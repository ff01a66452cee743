//! Closed surfaces of solids, validated on creation.

use glam::{DVec3, Vec3};

use super::{check_indices, tetrahedron_volume};
use crate::base::{DisjointSets, ensure, memory};
use crate::geometry::Aabb;
use crate::geometry::bvh::Bvh;
use crate::geometry::predicates::{crosses, solid_angle};
use crate::{Error, Result};

/// A triangle is degenerate if its height is below this fraction of its longest side, which is about its rounding
/// error.
const FLAT: f64 = 1e-6;

/// Triangles intersect if they pass through each other by more than this fraction of the largest coordinate, about its
/// rounding error.
const CROSSING: f64 = 1e-6;

/// The most passes of edge flips. In a row of flat triangles along one edge, each pass removes one.
const MAX_PASSES: usize = 100;

/// The largest distance of a node from the origin, m. It keeps squared distances finite in `f32`.
pub(crate) const MAX_COORDINATE: f32 = 1e9;

/// The most triangles of a component that are sampled to find one that touches no other component.
const MAX_SAMPLES: usize = 16;

/// The surface of a solid: triangles that enclose a volume, face outward and do not intersect each other.
///
/// Components that are separate, touch, or are hollow form one solid. A hollow component has an outer surface and an
/// inner one that faces into the hole.
///
/// ```
/// use sinew::mesh::{ClosedSurface, Mesh};
/// let block = Mesh::block([0.1, 0.1, 0.1], [2, 2, 2])?;
/// let surface = ClosedSurface::new(&block.positions, &block.surface()?)?;
/// assert!((surface.volume() - 1e-3).abs() < 1e-9);
/// // A sheet encloses no volume.
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
    /// Checks that `triangles` enclose a solid. Each has three node indices, outward by the right-hand rule;
    /// `positions` are in meters.
    ///
    /// Nodes at exactly equal positions count as one, because in STL files each triangle has its own corners.
    /// Triangles then refer to the first of them. A degenerate triangle, lower than 1e-6 of its longest side, closes a
    /// gap between nodes on the edge of a neighbor. It receives a part of that neighbor by edge flips, so that both
    /// have an area.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`], with the indices of triangles and nodes, in these cases: there are no triangles; an
    /// index is out of range; a position is not finite or further than 1e9 m from the origin; a triangle has two
    /// corners at one position, or is degenerate and no flip helps; the surface is open, that is, an edge is used more
    /// often in one direction than in the other; the surface or a component is inverted; two triangles intersect by
    /// more than 1e-6 of the largest coordinate. [`Error::OutOfMemory`].
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
                position.abs().max_element() <= MAX_COORDINATE && position.is_finite(),
                "the position of node {node} is {position}: must be finite and within {MAX_COORDINATE:e} m of the origin"
            );
        }
        let mut surface = Self {
            positions: memory::copied(positions)?,
            triangles: memory::copied(triangles)?,
            volume: 0.0,
        };
        surface.weld()?;
        surface.check_corners()?;
        let components = surface.components()?;
        surface.flip_flat_triangles()?;
        surface.check_volume()?;
        // Components that intersect cannot contain each other.
        surface.check_crossings()?;
        surface.check_components(components)?;
        Ok(surface)
    }

    /// Creates a closed surface that may intersect itself and may have degenerate triangles. It must enclose a
    /// positive volume.
    pub(super) fn allowing_intersections(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Result<Self> {
        let mut surface = Self {
            positions,
            triangles,
            volume: 0.0,
        };
        surface.components()?;
        surface.check_volume()?;
        Ok(surface)
    }

    /// The position of each node, as given, m.
    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    /// The triangles in the given order. Nodes at equal positions are replaced by the first of them, and degenerate
    /// triangles have received a part of a neighbor.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The enclosed volume, m³.
    pub fn volume(&self) -> f64 {
        self.volume
    }

    fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.triangles[triangle].map(|node| self.positions[node as usize])
    }

    /// Replaces nodes at equal positions by the first of them.
    fn weld(&mut self) -> Result<()> {
        let positions = &self.positions;
        let mut order: Vec<u32> = memory::collected(0..positions.len() as u32)?;
        // Adding 0 turns negative zeros into positive ones.
        let bits = |node: u32| (positions[node as usize] + 0.0).to_array().map(f32::to_bits);
        order.sort_unstable_by_key(|&node| (bits(node), node));
        let mut first_of: Vec<u32> = memory::filled(0, positions.len())?;
        for group in order.chunk_by(|&a, &b| bits(a) == bits(b)) {
            for &node in group {
                first_of[node as usize] = group[0];
            }
        }
        for triangle in &mut self.triangles {
            *triangle = triangle.map(|node| first_of[node as usize]);
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

    /// Flips the longest edge of each degenerate triangle until none is left. If a flip would not increase the smaller
    /// of the two heights, the neighbor's longest edge is flipped first (longest-edge paths: Rivara 1997). Returns an
    /// error if this does not succeed.
    fn flip_flat_triangles(&mut self) -> Result<()> {
        let mut sides: Vec<(u64, u32, u32)> = Vec::new();
        let mut modified: Vec<bool> = Vec::new();
        for pass in 0..=MAX_PASSES {
            let Some(first) = (0..self.triangles.len()).find(|&index| self.is_flat(index)) else {
                return Ok(());
            };
            if pass == MAX_PASSES {
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
            modified.clear();
            modified.try_reserve(self.triangles.len())?;
            modified.resize(self.triangles.len(), false);
            for flat in first..self.triangles.len() {
                if self.is_flat(flat) {
                    self.flip_edge_near(flat, &sides, &mut modified);
                }
            }
        }
        Ok(())
    }

    /// Flips the longest edge of a degenerate triangle, or the first possible one on its longest-edge path. `sides`
    /// has the edges of all triangles in order, from before the first flip of the pass.
    fn flip_edge_near(&mut self, flat: usize, sides: &[(u64, u32, u32)], modified: &mut [bool]) {
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
            let &(_, neighbor, neighbor_side) = if one.1 as usize == triangle { two } else { one };
            let neighbor = neighbor as usize;
            if squared <= length || modified[triangle] || modified[neighbor] {
                return;
            }
            let rotate = |triangle: [u32; 3], by: usize| [0, 1, 2].map(|corner| triangle[(corner + by) % 3]);
            // The triangle runs from `c` to `a` along the edge, and the neighbor back.
            let [c, a, b] = rotate(self.triangles[triangle], side);
            let [_, _, d] = rotate(self.triangles[neighbor], neighbor_side as usize);
            let flipped = [[a, b, d], [b, c, d]];
            let new_edge = super::pack(&flipped[0], [1, 2]);
            let exists = sides.binary_search_by_key(&new_edge, |other| other.0).is_ok();
            let height = |nodes: [u32; 3]| relative_height(nodes.map(|node| self.positions[node as usize]));
            let min_height = |pair: [[u32; 3]; 2]| height(pair[0]).min(height(pair[1]));
            let current = min_height([self.triangles[triangle], self.triangles[neighbor]]);
            if b != d && !exists && min_height(flipped) > current {
                [self.triangles[triangle], self.triangles[neighbor]] = flipped;
                (modified[triangle], modified[neighbor]) = (true, true);
                return;
            }
            (triangle, length) = (neighbor, squared);
        }
    }

    /// The connected component of each triangle, as its lowest triangle. Returns an error if an edge is open.
    fn components(&self) -> Result<Vec<u32>> {
        let mut sides: Vec<(u64, u32, bool)> = memory::reserved(3 * self.triangles.len())?;
        for (index, triangle) in (0_u32..).zip(&self.triangles) {
            for ends in super::TRIANGLE_EDGES {
                let forward = triangle[ends[0]] < triangle[ends[1]];
                sides.push((super::pack(triangle, ends), index, forward));
            }
        }
        sides.sort_unstable();
        let mut components = DisjointSets::new(self.triangles.len())?;
        for group in sides.chunk_by(|a, b| a.0 == b.0) {
            let forward = group.iter().filter(|side| side.2).count();
            let backward = group.len() - forward;
            if forward != backward {
                let [low, high] = super::unpack(group[0].0);
                let (from, to) = if forward > backward { (low, high) } else { (high, low) };
                let excess = group.iter().find(|side| side.2 == (forward > backward));
                let triangle = excess.map_or(group[0].1, |side| side.1);
                return Err(Error::invalid(format!(
                    "the surface is not closed: triangle {triangle} goes along the edge from node {from} to node {to} as {} do, and {} \
                     the other way",
                    forward.max(backward),
                    forward.min(backward)
                )));
            }
            for pair in group.windows(2) {
                components.unite(pair[0].1 as usize, pair[1].1 as usize);
            }
        }
        Ok(components.into_lowest())
    }

    /// The volume enclosed by these triangles, m³. The apex is one of their points, so that a distant solid loses no
    /// digits.
    fn enclosed_volume(&self, triangles: impl Iterator<Item = usize>) -> f64 {
        let mut apex = None;
        let mut volume = 0.0;
        for index in triangles {
            let [a, b, c] = self.corners(index).map(|corner| corner.as_dvec3());
            volume += tetrahedron_volume([*apex.get_or_insert(a), a, b, c]);
        }
        volume
    }

    fn check_volume(&mut self) -> Result<()> {
        self.volume = self.enclosed_volume(0..self.triangles.len());
        ensure!(
            self.volume > 0.0,
            "the surface encloses {:e} m³: its triangles face inward, or enclose nothing",
            self.volume
        );
        Ok(())
    }

    /// Returns an error for inverted components. A component that faces outward must be outside of all others, one
    /// that faces inward must be within one.
    fn check_components(&self, components: Vec<u32>) -> Result<()> {
        let mut order: Vec<u32> = memory::collected(0..components.len() as u32)?;
        order.sort_unstable_by_key(|&triangle| (components[triangle as usize], triangle));
        let same_component = |a: &u32, b: &u32| components[*a as usize] == components[*b as usize];
        if order.chunk_by(same_component).nth(1).is_none() {
            return Ok(());
        }
        let mut boxes = Vec::new();
        for component in order.chunk_by(same_component) {
            let points = component.iter().flat_map(|&triangle| self.corners(triangle as usize));
            memory::push(&mut boxes, Aabb::of(points))?;
        }
        for (index, component) in order.chunk_by(same_component).enumerate() {
            // The winding number of the other components around a point of this one: the most reliable of several
            // samples.
            let mut winding = 0.0;
            let mut ambiguity = f64::INFINITY;
            for &triangle in component.iter().step_by(component.len().div_ceil(MAX_SAMPLES)) {
                let corners = self.corners(triangle as usize);
                let point = corners.iter().map(|corner| corner.as_dvec3()).sum::<DVec3>() / 3.0;
                let here = Aabb::of(std::iter::once(point.as_vec3()));
                let mut angle = 0.0;
                for (other, others) in order.chunk_by(same_component).enumerate() {
                    if other != index && boxes[other].overlaps(&here) {
                        angle += others
                            .iter()
                            .map(|&triangle| {
                                solid_angle(point, self.corners(triangle as usize).map(|corner| corner.as_dvec3()))
                            })
                            .sum::<f64>();
                    }
                }
                let sample_winding = angle / (4.0 * std::f64::consts::PI);
                if (sample_winding - sample_winding.round()).abs() < ambiguity {
                    ambiguity = (sample_winding - sample_winding.round()).abs();
                    winding = sample_winding.round();
                }
                if ambiguity < 1e-3 {
                    break;
                }
            }
            let volume = self.enclosed_volume(component.iter().map(|&triangle| triangle as usize));
            let expected = if volume > 0.0 { 0.0 } else { 1.0 };
            // If all samples touch other components, the winding is unknown.
            if winding != expected && ambiguity < 0.1 {
                return Err(Error::invalid(if volume > 0.0 {
                    format!(
                        "the part of the surface with triangle {} faces outward and lies within another part: leave it out, or turn \
                         its triangles where it is a hole",
                        component[0]
                    )
                } else {
                    format!(
                        "the part of the surface with triangle {} is inside out: its triangles face inward and no part lies around it",
                        component[0]
                    )
                }));
            }
        }
        Ok(())
    }

    fn check_crossings(&self) -> Result<()> {
        let tree = Bvh::new(self.triangles.len(), |triangle| self.corners(triangle as usize))?;
        let bounds = tree.bounds();
        let depth = CROSSING * f64::from(bounds.magnitudes().max_element());
        for (index, nodes) in self.triangles.iter().enumerate() {
            let corners = self.corners(index);
            let bounds = Aabb::of(corners.into_iter());
            let mut crossed = None;
            tree.near(&bounds, 0.0, |slot| {
                let other = tree.triangle(slot) as usize;
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

/// The index of a triangle's longest side, and its squared length.
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

/// A triangle's height above its longest side, relative to that side; 0 if all corners coincide.
fn relative_height(corners: [Vec3; 3]) -> f64 {
    let [a, b, c] = corners.map(|corner| corner.as_dvec3());
    ((b - a).cross(c - a).length() / longest_side(corners).1).max(0.0)
}

/// True if an edge of the first triangle passes through the second, counting only edges that share no node with it.
fn pierces(nodes: &[u32; 3], corners: [Vec3; 3], others: &[u32; 3], triangle: [Vec3; 3], depth: f64) -> bool {
    super::TRIANGLE_EDGES.iter().any(|ends| {
        ends.iter().all(|&end| !others.contains(&nodes[end]))
            && crosses(corners[ends[0]], corners[ends[1]], triangle, depth)
    })
}
