//! Which parts of two surfaces overlap, and by how much, without a world.

/// By exact tests of points, edges and triangles.
pub mod exact {
    pub use crate::contact::exact_overlap::{EdgeInside, Exact, Overlap, PointInside};
}
