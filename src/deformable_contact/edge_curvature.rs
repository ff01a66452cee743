//! Curvature of a surface at its edges. Where a surface is nearly flat, contact at its corners suffices, and edges need
//! none.

use glam::Vec3;

use super::collision_surface::NONE;
use crate::base::{Result, memory};
use crate::codec::saved;

/// Maximum penetration between flat edges, as a fraction of the contact distance.
const MAX_PENETRATION: f32 = 0.25;

/// Normals of the faces around a corner.
#[derive(Clone, Copy, Debug, Default)]
struct CornerNormals {
    /// Sum of the unit normals.
    normals: Vec3,
    faces: u16,
    edges: u16,
}

saved! { CornerNormals { normals, faces, edges } }

impl CornerNormals {
    /// Returns the RMS angle between the normals and their mean, rad; infinity at the border of an open surface, which
    /// has more edges than faces.
    fn normal_spread(&self) -> f32 {
        if self.faces == 0 || self.faces != self.edges {
            return f32::INFINITY;
        }
        let deficit = 1.0 - self.normals.length() / f32::from(self.faces);
        (2.0 * deficit.max(0.0)).sqrt()
    }
}

/// Curvature at an edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct EdgeCurvature {
    /// Larger normal spread of the two ends, rad; infinity at a border or if unknown.
    normal_spread: f32,
    /// Length, m, and its inverse, 1/m.
    length: f32,
    inverse_length: f32,
}

saved! { EdgeCurvature { normal_spread, length, inverse_length } }

impl EdgeCurvature {
    pub const UNKNOWN: Self = Self {
        normal_spread: f32::INFINITY,
        length: 0.0,
        inverse_length: 0.0,
    };
    const FLAT: Self = Self {
        normal_spread: 0.0,
        ..Self::UNKNOWN
    };

    /// Returns how far another edge can penetrate between corners before one of its ends touches the surface, m. It
    /// turns about this edge, or reaches further if it is longer.
    fn penetration(&self, other: &Self) -> f32 {
        0.5 * self.normal_spread * other.length * (other.length * self.inverse_length).max(1.0)
    }

    /// True if contact at corners keeps two surfaces `radius` apart near these edges, m, up to a fraction of
    /// it.
    pub fn is_flat_against(&self, other: &Self, radius: f32) -> bool {
        let max_penetration = MAX_PENETRATION * radius;
        self.penetration(other) <= max_penetration || other.penetration(self) <= max_penetration
    }
}

/// Curvature at the edges of a surface.
#[derive(Debug)]
pub(super) struct EdgeCurvatures {
    corner_normals: Vec<CornerNormals>,
    curvatures: Vec<EdgeCurvature>,
}

saved! { EdgeCurvatures { corner_normals, curvatures } }

impl EdgeCurvatures {
    /// Creates an empty measurement with capacity for this number of nodes and edges.
    pub fn new(nodes: usize, edges: usize) -> Result<Self> {
        let mut edge_curvatures = Self {
            corner_normals: Vec::new(),
            curvatures: Vec::new(),
        };
        edge_curvatures.reserve(nodes, edges)?;
        Ok(edge_curvatures)
    }

    /// Reserves memory for this number of nodes and edges.
    pub fn reserve(&mut self, nodes: usize, edges: usize) -> Result<()> {
        memory::reserve(&mut self.corner_normals, nodes)?;
        memory::reserve(&mut self.curvatures, edges)
    }

    /// Clears the measurement.
    pub fn clear(&mut self) {
        self.curvatures.clear();
    }

    /// Measures a surface with this number of nodes at these positions. The largest curvature since the last
    /// [`Self::clear`] counts. Without capacity nothing counts as flat.
    pub fn measure(
        &mut self,
        nodes: usize,
        triangles: &[[u32; 3]],
        edges: &[[u32; 2]],
        position_of: impl Fn(u32) -> Vec3,
    ) {
        let Self {
            corner_normals,
            curvatures,
        } = self;
        if corner_normals.capacity() < nodes || curvatures.capacity() < edges.len() {
            return;
        }
        corner_normals.clear();
        corner_normals.resize(nodes, CornerNormals::default());
        for triangle in triangles {
            let [a, b, c] = triangle.map(&position_of);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            for &node in triangle {
                let corner = &mut corner_normals[node as usize];
                corner.normals += normal;
                corner.faces = corner.faces.saturating_add(1);
            }
        }
        for &node in edges.iter().filter(|edge| edge[0] != NONE).flatten() {
            let corner = &mut corner_normals[node as usize];
            corner.edges = corner.edges.saturating_add(1);
        }
        curvatures.resize(edges.len(), EdgeCurvature::FLAT);
        for (curvature, edge) in curvatures.iter_mut().zip(edges) {
            if edge[0] == NONE {
                *curvature = EdgeCurvature::UNKNOWN;
                continue;
            }
            let [a, b] = edge.map(|node| corner_normals[node as usize].normal_spread());
            let length = position_of(edge[0]).distance(position_of(edge[1]));
            *curvature = EdgeCurvature {
                normal_spread: curvature.normal_spread.max(a).max(b),
                length,
                inverse_length: 1.0 / length.max(f32::MIN_POSITIVE),
            };
        }
    }

    /// Returns the curvature at an edge.
    pub fn get(&self, edge: usize) -> EdgeCurvature {
        self.curvatures.get(edge).copied().unwrap_or(EdgeCurvature::UNKNOWN)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Mesh, edges};

    fn measure_mesh(positions: &[Vec3], triangles: &[[u32; 3]]) -> (Vec<[u32; 2]>, EdgeCurvatures) {
        let edges = edges(triangles, &[]).expect("memory");
        let mut edge_curvatures = EdgeCurvatures::new(positions.len(), edges.len()).expect("memory");
        edge_curvatures.measure(positions.len(), triangles, &edges, |node| positions[node as usize]);
        (edges, edge_curvatures)
    }

    #[test]
    fn a_plane_is_flat_except_at_its_border() {
        let cloth = Mesh::cloth([0.3, 0.2], [6, 4]).expect("a cloth");
        let (edges, edge_curvatures) = measure_mesh(&cloth.positions, &cloth.triangles);
        let at_border = |node: u32| {
            let position = cloth.positions[node as usize];
            position.x.abs() > 0.149 || position.z.abs() > 0.099
        };
        let inner = (0..edges.len()).find(|&edge| edges[edge].iter().all(|&node| !at_border(node)));
        let inner = edge_curvatures.get(inner.expect("an inner edge"));
        for (index, edge) in edges.iter().enumerate() {
            let ridge = edge_curvatures.get(index);
            if edge.iter().any(|&node| at_border(node)) {
                assert_eq!(ridge.normal_spread, f32::INFINITY, "{edge:?}");
                assert!(!ridge.is_flat_against(&ridge, 1.0), "{edge:?}");
            } else {
                assert!(ridge.is_flat_against(&ridge, 1e-4), "{edge:?}: {ridge:?}");
            }
            assert!(ridge.is_flat_against(&inner, 1e-4), "{edge:?}: {ridge:?}");
        }
        assert_eq!(edge_curvatures.get(edges.len()).normal_spread, f32::INFINITY);
    }

    #[test]
    fn an_edge_across_a_fold_penetrates_by_the_height_of_the_fold() {
        // The middle row is the fold: faces on both sides are inclined by this angle.
        let angle = 0.2_f32;
        let cloth = Mesh::cloth([0.4; 2], [4; 2]).expect("a cloth");
        let positions: Vec<Vec3> = cloth
            .positions
            .iter()
            .map(|position| Vec3::new(position.x, -position.z.abs() * angle.sin(), position.z * angle.cos()))
            .collect();
        let (edges, edge_curvatures) = measure_mesh(&positions, &cloth.triangles);
        let inner = |node: u32| positions[node as usize].x.abs() < 0.11 && cloth.positions[node as usize].z == 0.0;
        let mut count = 0;
        for (index, edge) in edges.iter().enumerate() {
            if edge.iter().all(|&node| inner(node)) {
                // All normals deviate from their mean by that angle, with three faces on either side. An edge of 0.1 m
                // across the fold has its ends this high above the faces.
                let height = 0.05 * angle;
                let curvature = edge_curvatures.get(index);
                let let_in = curvature.penetration(&curvature);
                assert!((let_in / height - 1.0).abs() < 0.01, "{edge:?}: {let_in} m of {height}");
                let longer = EdgeCurvature {
                    length: 0.2,
                    inverse_length: 5.0,
                    ..curvature
                };
                assert!((curvature.penetration(&longer) / let_in - 4.0).abs() < 0.01);
                count += 1;
            }
        }
        assert_eq!(count, 2);
    }

    #[test]
    fn a_sheet_with_inconsistent_orientation_is_not_flat() {
        let cloth = Mesh::cloth([0.4; 2], [4; 2]).expect("a cloth");
        let mut triangles = cloth.triangles.clone();
        triangles.iter_mut().step_by(2).for_each(|triangle| triangle.swap(0, 1));
        let (edges, edge_curvatures) = measure_mesh(&cloth.positions, &triangles);
        assert!((0..edges.len()).all(|edge| edge_curvatures.get(edge).normal_spread > 0.5));
    }

    #[test]
    fn a_surface_that_bends_between_measurements_is_not_flat() {
        let cloth = Mesh::cloth([0.4; 2], [4; 2]).expect("a cloth");
        let edges = edges(&cloth.triangles, &[]).expect("memory");
        let middle = (0..)
            .zip(&cloth.positions)
            .find(|(_, position)| position.length() < 1e-6);
        let (middle, _) = middle.expect("a node in the middle");
        let turn_after = |bends: &[f32]| {
            let mut edge_curvatures = EdgeCurvatures::new(cloth.positions.len(), edges.len()).expect("memory");
            for &bend in bends {
                let position_of = |node: u32| {
                    cloth.positions[node as usize] + if node == middle { bend * Vec3::Y } else { Vec3::ZERO }
                };
                edge_curvatures.measure(cloth.positions.len(), &cloth.triangles, &edges, position_of);
            }
            let edge = edges
                .iter()
                .position(|edge| edge.contains(&middle))
                .expect("an edge there");
            edge_curvatures.get(edge).normal_spread
        };
        assert!(turn_after(&[0.0]) < 1e-3);
        let bent = turn_after(&[0.02]);
        assert!(bent > 0.1, "{bent}");
        assert_eq!(turn_after(&[0.02, 0.0]), bent);
        assert_eq!(turn_after(&[0.0, 0.02]), bent);
    }
}
