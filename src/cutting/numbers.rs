//! Which vertex has the number of the node that it is at: one alone, or what is drawn would hang together there by numbers where it does not.

use crate::base::{Result, memory};

/// The nodes whose numbers may be taken in a cut: those that it has made, and those that a vertex has left.
pub(crate) struct FreeNodes(Vec<(u32, bool)>);

impl FreeNodes {
    /// `left` in any order, and the new ones.
    pub fn new(left: impl Iterator<Item = u32>, new: std::ops::Range<u32>) -> Result<Self> {
        let mut free = memory::gathered(left.chain(new).map(|node| (node, true)))?;
        memory::sort_once(&mut free);
        Ok(Self(free))
    }

    /// Whether the number of a node may be taken, which it may not from then on.
    pub fn take(&mut self, node: u32) -> bool {
        let place = self.0.binary_search_by_key(&node, |&(node, _)| node);
        place.is_ok_and(|place| std::mem::replace(&mut self.0[place].1, false))
    }
}
