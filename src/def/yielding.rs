//! Yielding: what is deformed beyond a strain stays so.

use crate::base::{Error, Result, not_negative};

/// From which strain on springs, and tetrahedra that are elements, take a set: they are at rest elsewhere from then on (perfect
/// plasticity).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Yielding {
    /// Of a spring, or a rod of tetrahedra, that is stretched or pressed; at least 0; 0: none.
    pub strain: f32,
    /// The largest part of its length by which it may become longer or shorter for good, above 0 and below 1; beyond that it is elastic
    /// again.
    pub largest: f32,
}

impl Default for Yielding {
    /// None; a half at most.
    fn default() -> Self {
        Self {
            strain: 0.0,
            largest: 0.5,
        }
    }
}

impl Yielding {
    pub(crate) fn check(&self) -> Result<()> {
        not_negative("yield_strain", self.strain)?;
        if self.strain > 0.0 && !(self.largest > 0.0 && self.largest < 1.0) {
            return Err(Error::invalid(format!(
                "largest_set is {}: must be above 0 and below 1",
                self.largest
            )));
        }
        Ok(())
    }

    pub(crate) fn is_none(&self) -> bool {
        self.strain == 0.0
    }
}
