//! Trees over a body's surface for queries. The first query builds them, and the first query after nodes moved refits
//! them.

use std::sync::{Mutex, OnceLock, PoisonError};

use glam::Vec3;

use super::Body;
use crate::base::{Result, memory};
use crate::geometry::Forest;

/// The trees, or nothing before the first query. A step only marks them as outdated: it does not wait, refit or
/// allocate.
#[derive(Debug, Default)]
pub(super) struct QueryTree {
    /// Trees that fit the published positions.
    current: OnceLock<Box<Forest>>,
    /// Trees that must be refitted. Only queries lock it: one of them refits the trees, and others wait.
    outdated: Mutex<Option<Box<Forest>>>,
}

impl QueryTree {
    /// Marks the trees as outdated. Call it when published positions or the surface change.
    pub fn mark_outdated(&mut self) {
        if let Some(trees) = self.current.take() {
            *self.outdated.get_mut().unwrap_or_else(PoisonError::into_inner) = Some(trees);
        }
    }
}

impl Body {
    /// The trees over the published surface.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub(crate) fn query_tree(&self) -> Result<&Forest> {
        let QueryTree { current, outdated } = &self.query_tree;
        if let Some(trees) = current.get() {
            return Ok(trees);
        }
        let mut outdated = outdated.lock().unwrap_or_else(PoisonError::into_inner);
        // Another thread can be first.
        if let Some(trees) = current.get() {
            return Ok(trees);
        }
        let (surface, positions) = (self.surface(), self.positions());
        let corners = |triangle: u32| -> [Vec3; 3] { surface[triangle as usize].map(|node| positions[node as usize]) };
        let trees = match outdated.take() {
            Some(mut trees) => {
                // Triangles are changed and added, never removed.
                let added = surface.len() - trees.triangle_count();
                if let Some(more) = trees.build_added(added, corners)? {
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
