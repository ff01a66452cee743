//! Contact in image space (CInDeR; Halic et al., section 2.1): virtual rays are cast through the pixels of a parallel view.

mod covered;
mod layered_image;
mod layers;
mod projection;
mod surface;
mod walk;

#[cfg(test)]
mod tests;

pub use layered_image::LayeredImage;
