//! Contact in image space (CInDeR; Halic et al., section 2.1): virtual rays are cast through the pixels of a parallel view.
//!
//! [`ImageSpace`] compares two bodies as they are: [`Form::Counted`] as the method was described, [`Form::Intervals`] so that
//! no edge is lost. [`LayeredImage`] is a rigid solid drawn once, that features of tissue are compared with; [`Drawn`] is tissue, drawn
//! anew in each substep.

mod counted;
mod covered;
mod detector;
mod draw;
mod drawn;
mod intervals;
mod layered_image;
mod layers;
mod overlap;
mod projection;
mod surface;
mod traced;
mod volume;
mod walk;

#[cfg(test)]
mod tests;

pub use detector::{Form, ImageSpace, ImageSpaceDefinition, Views};
pub(crate) use drawn::Drawn;
pub use layered_image::LayeredImage;
pub use overlap::{EdgeInside, Inside, Overlap, PointInside};
pub use surface::{Placed, Surface};
