//! What must hold of values that were read, before anybody relies on it.

use crate::error::{Error, Result};

/// Refuses bytes of which something does not hold.
pub(crate) fn ensure(holds: bool, what: &str) -> Result<()> {
    if holds {
        return Ok(());
    }
    Err(Error::invalid(format!("bytes are no world: {what}")))
}
