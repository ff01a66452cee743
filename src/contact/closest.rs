//! The result of a distance query between a feature and a solid, common to all detectors.

use glam::Vec3;

/// The closest point of a node, edge or face to a solid.
///
/// Each feature reports contacts in its interior. If an edge or face is closest at its border, `inside` is false and a
/// smaller feature reports the contact. A feature that penetrates the solid reports its deepest point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Closest {
    /// Barycentric weights of the feature's point.
    pub weights: [f32; 3],
    /// Distance from the solid's surface, m; negative inside.
    pub distance: f32,
    /// Unit normal, away from the solid.
    pub normal: Vec3,
    /// True if the feature's point lies in its interior. At its border a smaller feature touches instead.
    pub inside: bool,
}
