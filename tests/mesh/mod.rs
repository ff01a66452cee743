//! Meshes and rendered images.

mod files;
mod filled;
mod picture_values;
mod raster;
mod shapes;
