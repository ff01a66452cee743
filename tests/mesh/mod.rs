//! Meshes and pictures.

mod files;
mod filled;
mod picture_values;
mod raster;
mod shapes;
