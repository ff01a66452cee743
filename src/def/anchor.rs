//! Where something is attached to a body.

use crate::codec::{saved, saved_enum};

/// A point of a body's surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Which triangle of [`Body::surface`](crate::Body::surface).
    pub triangle: u32,
    /// The parts of its corners in the point: at least 0, and 1 in sum.
    pub weights: [f32; 3],
}

saved! { SurfacePoint { triangle, weights } }

/// Where a body is attached to a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Anchor {
    /// A node, of the surface or not.
    Node(u32),
    /// A point of the surface.
    Point(SurfacePoint),
}

saved_enum!(Anchor { 0 => Node(it), 1 => Point(it) });
