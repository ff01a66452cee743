//! Mapping between the caller's node order and the internal one.

use super::PerNode;
use std::ops::Range;

use crate::base::{Result, memory};
use crate::codec::saved;

/// Permutation of nodes, for bodies that reorder them.
///
/// The interface uses the caller's number of a node. Internally a node has the body's own number, its index in every
/// list.
#[derive(Debug, Default)]
pub(crate) struct NodeOrder {
    /// The body's own number for each of the caller's; empty if they are equal.
    own: Vec<u32>,
    /// The inverse permutation.
    caller: Vec<u32>,
}

saved! { NodeOrder { own, caller } }

impl PerNode for NodeOrder {
    fn reserve_nodes(&mut self, node_count: usize) -> Result<()> {
        if self.is_identity() {
            return Ok(());
        }
        memory::reserve(&mut self.own, node_count)?;
        memory::reserve(&mut self.caller, node_count)
    }

    fn grow(&mut self, node_count: usize) {
        if !self.is_identity() {
            let added = self.own.len() as u32..node_count as u32;
            self.own.extend(added.clone());
            self.caller.extend(added);
        }
    }
}

impl NodeOrder {
    /// True if nodes are in the caller's order.
    pub fn is_identity(&self) -> bool {
        self.own.is_empty()
    }

    /// Creates the order in which node i has the caller's number `caller[i]`.
    pub fn new(caller: Vec<u32>) -> Result<Self> {
        let mut own = memory::filled(0, caller.len())?;
        for (index, &number) in (0..).zip(&caller) {
            own[number as usize] = index;
        }
        Ok(Self { own, caller })
    }

    /// True if the permutation is valid for this number of nodes.
    pub fn is_sound(&self, count: usize) -> bool {
        let is_inverse = |(index, &number): (usize, &u32)| self.own.get(number as usize) == Some(&(index as u32));
        self.own.len() == self.caller.len()
            && (self.is_identity() || self.own.len() == count && self.caller.iter().enumerate().all(is_inverse))
    }

    /// Converts the caller's number to the body's own.
    #[inline]
    pub fn own(&self, caller: u32) -> u32 {
        self.own.get(caller as usize).map_or(caller, |&own| own)
    }

    /// Own numbers of a range of the caller's, if they differ.
    pub fn own_range(&self, callers: Range<usize>) -> &[u32] {
        &self.own[callers]
    }

    /// Converts the body's own number to the caller's.
    #[inline]
    pub fn caller(&self, own: u32) -> u32 {
        self.caller.get(own as usize).map_or(own, |&caller| caller)
    }

    /// Converts the corners of triangles to the body's own numbers.
    pub fn own_triangles(&self, triangles: &[[u32; 3]]) -> Result<Vec<[u32; 3]>> {
        memory::collected(triangles.iter().map(|corners| corners.map(|corner| self.own(corner))))
    }
}
