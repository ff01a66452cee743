//! Trees over a body's surface for queries: built by the first, and refitted by the first after its nodes have moved.

use std::sync::{Mutex, OnceLock, PoisonError};

use glam::Vec3;

use super::Body;
use crate::base::{Result, memory};
use crate::geometry::Forest;

/// Nothing while nobody asks. A step only marks it as outdated: it neither waits, refits nor allocates.
#[derive(Debug, Default)]
pub(super) struct QueryTree {
    /// Fitted to the published positions.
    current: OnceLock<Box<Forest>>,
    /// As it was before they changed. Locked by queries alone: one of them refits it, and others wait for that.
    outdated: Mutex<Option<Box<Forest>>>,
}

impl QueryTree {
    /// To be called when published positions or the surface change.
    pub fn outdate(&mut self) {
        if let Some(trees) = self.current.take() {
            *self.outdated.get_mut().unwrap_or_else(PoisonError::into_inner) = Some(trees);
        }
    }
}

impl Body {
    /// Trees over its surface as it is published.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub(crate) fn query_tree(&self) -> Result<&Forest> {
        let QueryTree { current, outdated } = &self.query_tree;
        if let Some(trees) = current.get() {
            return Ok(trees);
        }
        let mut outdated = outdated.lock().unwrap_or_else(PoisonError::into_inner);
        // Another thread may have been first.
        if let Some(trees) = current.get() {
            return Ok(trees);
        }
        let (surface, positions) = (self.surface(), self.positions());
        let corners = |triangle: u32| -> [Vec3; 3] { surface[triangle as usize].map(|node| positions[node as usize]) };
        let trees = match outdated.take() {
            Some(mut trees) => {
                // Triangles are changed and added, never taken away.
                let added = surface.len() - trees.triangle_count();
                if let Some(more) = trees.with_more(added, corners)? {
                    trees.add(more);
                }
                trees.refit(corners);
                trees
            }
            None => memory::boxed(Forest::new(surface.len(), corners)?)?,
        };
        Ok(current.get_or_init(|| trees))
    }
}
