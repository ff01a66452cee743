//! Soft tissue for programs that already have a loop.
#![warn(missing_docs)]

mod error;
pub mod mesh;
pub mod raster;
mod world;

pub use error::{Error, Result};
