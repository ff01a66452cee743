//! The protocol of the measuring process and a contender's process, line by line.
//!
//! A contender is started with a thread count and the cloth as arguments. It builds the cloth and sends [`Hello`]. It
//! answers `steps <count>` with [`Steps`] and `report` with [`Report`], each a line of JSON, and exits when its input
//! ends. Each contender has a separate process, so that its memory can be measured and no heap is shared.

use serde::{Deserialize, Serialize};

/// The first line of a contender.
#[derive(Debug, Serialize, Deserialize)]
pub struct Hello {
    /// Name and version of the engine.
    pub version: Option<String>,
    /// The reason that it cannot be measured, if any.
    pub refused: Option<String>,
}

/// The time of each step.
#[derive(Debug, Serialize, Deserialize)]
pub struct Steps {
    /// Times of the steps, in order [ms].
    pub milliseconds: Vec<f64>,
}

/// The current state of the cloth, and its memory. Values that are not finite are omitted.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Report {
    /// Resident memory beyond that before the cloth was built, after some steps [bytes].
    pub body_bytes: Option<u64>,
    /// Peak resident memory of the whole process [bytes].
    pub peak_bytes: Option<u64>,
    /// See [`crate::cloth::Shape`].
    pub mean_stretch: Option<f64>,
    /// See [`crate::cloth::Shape`].
    pub max_stretch: Option<f64>,
    /// See [`crate::cloth::Shape`].
    pub mean_height: Option<f64>,
}
