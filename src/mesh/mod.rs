//! Meshes: topology, shapes, files.

mod topology;

pub use topology::{boundary, edges, is_closed};

use glam::Vec3;

/// Nodes joined by triangles, tetrahedra or both. Positions in metres; triangles outward by the right-hand rule.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Where each node is, in metres.
    pub positions: Vec<Vec3>,
    /// Three node indices each.
    pub triangles: Vec<[u32; 3]>,
    /// Four node indices each.
    pub tetrahedra: Vec<[u32; 4]>,
}
