//! What the measuring process and a contender's process say to each other, a line at a time.
//!
//! A contender is started with a thread count and the cloth as arguments, builds it, and says [`Hello`]. Then it answers
//! `steps <count>` with [`Steps`] and `report` with [`Report`], each a line of JSON, and ends where its input ends.
//! Each contender has a process of its own: what it holds in memory can then be told, and nobody runs on another's heap.

use serde::{Deserialize, Serialize};

/// The first line of a contender.
#[derive(Debug, Serialize, Deserialize)]
pub struct Hello {
    /// Which version of what.
    pub version: Option<String>,
    /// Why it cannot be measured, where it cannot.
    pub refused: Option<String>,
}

/// The time of each step.
#[derive(Debug, Serialize, Deserialize)]
pub struct Steps {
    /// One for each step, in order.
    pub milliseconds: Vec<f64>,
}

/// The cloth as it is now, and the memory it takes. What is not finite is not there.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Report {
    /// Resident bytes beyond those before the cloth was built, after some steps.
    pub body_bytes: Option<u64>,
    /// The most bytes the whole process has had resident.
    pub peak_bytes: Option<u64>,
    /// See [`crate::cloth::Shape`].
    pub mean_stretch: Option<f64>,
    /// See [`crate::cloth::Shape`].
    pub max_stretch: Option<f64>,
    /// See [`crate::cloth::Shape`].
    pub mean_height: Option<f64>,
}
