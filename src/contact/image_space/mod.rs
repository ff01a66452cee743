//! Contact detection in image space (CInDeR; Halic et al., section 2.1): rays are cast through the pixels of a
//! parallel view.
//!
//! [`ImageSpace`] compares two bodies: [`Form::Counted`] by the original method, [`Form::Intervals`] without losing
//! edges. [`LayeredImage`] is a rigid solid drawn once, which features of tissue are tested against.
//! [`DeformableImages`] is tissue that is drawn again in each substep.

mod deformable_images;
mod depth_buffer;
mod detector;
mod distance_transform;
mod edge_tracing;
mod feature_search;
mod intervals;
mod layered_image;
mod layers;
mod overlap;
mod projection;
mod rasterize;
mod surface;
mod volume;

#[cfg(test)]
mod tests;

pub(crate) use deformable_images::DeformableImages;
pub use detector::{Form, ImageSpace, ImageSpaceDefinition, Views};
pub use layered_image::LayeredImage;
pub use overlap::{EdgeInside, Inside, Overlap, PointInside};
pub use surface::{Placed, Surface};
