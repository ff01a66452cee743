//! One depth-buffer rasteriser, for pictures and for contact in image space.
//!
//! The core turns triangles and lines into [`Fragment`]s: [`View::triangle`] and [`View::line`] project and clip,
//! [`rasterise_triangle`] and [`rasterise_line`] decide which pixels are covered, and a closure receives each of them with
//! its depth, its barycentric weights and the side that is seen. It knows nothing of buffers, colours or light.
//! [`traverse_line`] gives all pixels that a line passes through.
//!
//! On top of it, [`Scene::draw`] makes pictures: the nearest triangle of each sample is found first, then each pixel is
//! shaded once, with a shadow map and ambient occlusion that are drawn with the same core.

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
