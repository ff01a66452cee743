//! Assigns the index of a node to a vertex at it. Only one vertex may have it, or separate parts of the render mesh
//! would share an index.

use crate::base::{Result, memory};

/// Nodes whose indices a cut may assign: new ones, and those that a vertex has left.
pub(crate) struct FreeIndices(Vec<(u32, bool)>);

impl FreeIndices {
    /// `released` can be in any order.
    pub fn new(released: impl Iterator<Item = u32>, new: std::ops::Range<u32>) -> Result<Self> {
        let mut free = memory::gathered(released.chain(new).map(|node| (node, true)))?;
        memory::sort_once(&mut free);
        Ok(Self(free))
    }

    /// True if the index of a node was free. It is then taken.
    pub fn take(&mut self, node: u32) -> bool {
        let index = self.0.binary_search_by_key(&node, |&(node, _)| node);
        index.is_ok_and(|index| std::mem::replace(&mut self.0[index].1, false))
    }
}
