//! Boxes, trees of triangles, closest points and exact questions about them; nothing of bodies.

mod bounds;
pub(crate) mod forest;
pub(crate) mod nearest;
mod normals;
pub(crate) mod predicates;
pub(crate) mod rotation;
pub(crate) mod tree;

pub(crate) use bounds::Bounds;
pub(crate) use forest::Forest;
pub(crate) use normals::vertex_normals;
