//! What can be drawn: checked once, so that a detection need not.

use crate::error::{Error, Result};

/// What is said of an occluder that is none.
pub(super) const OPEN: &str =
    "the surface is not closed: an occluder must be, with each edge as often in one direction as in the other";

/// Refuses what cannot be drawn.
pub(super) fn check(node_count: usize, triangles: &[[u32; 3]]) -> Result<()> {
    if triangles.is_empty() {
        return Err(Error::invalid("triangles: the surface has none"));
    }
    if triangles.len() >= 1 << 31 {
        return Err(Error::Unsupported(format!(
            "{} triangles: image space takes fewer than 2^31",
            triangles.len()
        )));
    }
    for (index, triangle) in triangles.iter().enumerate() {
        if let Some(node) = triangle.iter().find(|&&node| node as usize >= node_count) {
            return Err(Error::invalid(format!(
                "triangle {index} names node {node}; there are {node_count}"
            )));
        }
    }
    Ok(())
}
