//! Subsets of a body's nodes, and scale factors for the springs and elements between them.

use super::TILE;
use crate::base::memory;

/// Set of nodes, by the body's own numbers.
#[derive(Debug)]
pub(crate) struct Region {
    /// Sorted, without duplicates.
    nodes: Vec<u32>,
}

/// Scale factors of a region.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scale {
    /// At least 0.
    pub stiffness: f32,
    /// Greater than 0.
    pub length: f32,
}

impl Region {
    pub fn from_nodes(mut nodes: Vec<u32>) -> Self {
        memory::sort_once(&mut nodes);
        Self { nodes }
    }

    /// The nodes, sorted.
    pub fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    pub fn has(&self, node: u32) -> bool {
        self.nodes.binary_search(&node).is_ok()
    }

    pub fn has_all(&self, nodes: &[u32]) -> bool {
        nodes.iter().all(|&node| self.has(node))
    }

    /// Tiles that contain nodes of the region, sorted.
    pub fn tiles(&self) -> impl Iterator<Item = usize> {
        let same_tile = |a: &u32, b: &u32| *a as usize / TILE == *b as usize / TILE;
        self.nodes.chunk_by(same_tile).map(|nodes| nodes[0] as usize / TILE)
    }
}
