//! A depth-buffer rasterizer, for images and for image-space contact.
//!
//! The core turns triangles and lines into [`Fragment`]s. [`View::triangle`] and [`View::line`] project and clip.
//! [`rasterise_triangle`] and [`rasterise_line`] determine the covered pixels. A closure receives each pixel with its
//! depth, barycentric weights and visible side. The core has no buffers, colors or lights. [`traverse_line`] visits
//! all pixels that a line passes through.
//!
//! [`Scene::draw`] renders images with the core: it finds the nearest triangle of each sample, then shades each pixel
//! once. Shadow map and ambient occlusion are rendered with the same core.

mod camera;
mod fragment;
mod geometry;
mod line;
mod occlusion;
mod picture;
mod png;
mod scale;
mod scene;
mod shade;
mod shadow;
mod tessellate;
mod traverse;
mod triangle;
mod view;

pub use camera::Camera;
pub use fragment::{Fragment, GUARD, PixelVertex, Window};
pub use line::rasterise_line;
pub use picture::Image;
pub use scale::{ColourScale, Coloured, Colours};
pub use scene::{Lines, Look, Scene, Shape, Surface};
pub use traverse::traverse_line;
pub use triangle::rasterise_triangle;
pub use view::View;
