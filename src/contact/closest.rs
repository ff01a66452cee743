//! The question that every way of finding contact with a solid answers.

use glam::Vec3;

/// The closest that a node, edge or face comes to a solid.
///
/// Nodes, edges and faces each answer for what is between their ends: an edge or a face that is closest at its border says so, and a smaller
/// feature is met there instead. One that reaches into the solid answers with its deepest point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Closest {
    /// The feature's point, as weights of its corners.
    pub weights: [f32; 3],
    /// From the solid's surface to it, m; below 0 inside.
    pub distance: f32,
    /// Away from the solid, of unit length.
    pub normal: Vec3,
    /// Whether the feature's point lies within it, and not at its border, where a smaller feature is met instead.
    pub inside: bool,
}
