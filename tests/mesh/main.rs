//! Meshes and pictures.

#[path = "../support/mod.rs"]
mod support;

mod files;
mod filled;
mod picture_values;
mod raster;
mod shapes;
