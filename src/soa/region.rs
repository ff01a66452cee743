//! Some nodes of a body, and what is to be done with what lies between them.

use super::TILE;
use crate::base::memory;

/// Some nodes, in the body's own numbers.
#[derive(Debug)]
pub(crate) struct Region {
    /// In order, each once.
    nodes: Vec<u32>,
}

/// By what a region is scaled.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scale {
    /// At least 0.
    pub stiffness: f32,
    /// Above 0.
    pub length: f32,
}

impl Region {
    pub fn of(mut nodes: Vec<u32>) -> Self {
        memory::sort_once(&mut nodes);
        Self { nodes }
    }

    /// In order.
    pub fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    pub fn has(&self, node: u32) -> bool {
        self.nodes.binary_search(&node).is_ok()
    }

    pub fn has_all(&self, nodes: &[u32]) -> bool {
        nodes.iter().all(|&node| self.has(node))
    }

    /// The tiles that have one of its nodes, in order.
    pub fn tiles(&self) -> impl Iterator<Item = usize> {
        let same_tile = |a: &u32, b: &u32| *a as usize / TILE == *b as usize / TILE;
        self.nodes.chunk_by(same_tile).map(|nodes| nodes[0] as usize / TILE)
    }
}
