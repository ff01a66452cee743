//! Geometry without reference to bodies: bounding boxes, triangle trees, closest points and exact predicates.

mod bounds;
pub(crate) mod bvh;
pub(crate) mod forest;
pub(crate) mod nearest;
mod normals;
pub(crate) mod predicates;
pub(crate) mod rotation;

pub(crate) use bounds::Aabb;
pub(crate) use forest::Forest;
pub(crate) use normals::vertex_normals;
