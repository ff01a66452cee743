//! The order in which a body keeps its nodes, and the caller's.

use super::PerNode;
use std::ops::Range;

use crate::base::{Result, memory};
use crate::codec::saved;

/// Where each node is kept, for bodies that do not keep them in the caller's order.
///
/// A node is called by the caller's number at the door, and by its own number, its place in every list of the body, inside.
#[derive(Debug, Default)]
pub(crate) struct NodeOrder {
    /// For each of the caller's numbers the body's own; empty where they are the same.
    own: Vec<u32>,
    /// The reverse.
    caller: Vec<u32>,
}

saved! { NodeOrder { own, caller } }

impl PerNode for NodeOrder {
    fn reserve_nodes(&mut self, node_count: usize) -> Result<()> {
        if self.is_callers() {
            return Ok(());
        }
        memory::reserve(&mut self.own, node_count)?;
        memory::reserve(&mut self.caller, node_count)
    }

    fn grow(&mut self, node_count: usize) {
        if !self.is_callers() {
            let more = self.own.len() as u32..node_count as u32;
            self.own.extend(more.clone());
            self.caller.extend(more);
        }
    }
}

impl NodeOrder {
    /// Whether nodes are kept in the caller's order.
    pub fn is_callers(&self) -> bool {
        self.own.is_empty()
    }

    /// The order in which the caller's number `caller[i]` is kept at place i.
    pub fn new(caller: Vec<u32>) -> Result<Self> {
        let mut own = memory::filled(0, caller.len())?;
        for (place, &number) in (0..).zip(&caller) {
            own[number as usize] = place;
        }
        Ok(Self { own, caller })
    }

    /// Whether each number of so many nodes has its place.
    pub fn is_sound(&self, count: usize) -> bool {
        let is_back = |(place, &number): (usize, &u32)| self.own.get(number as usize) == Some(&(place as u32));
        self.own.len() == self.caller.len()
            && (self.is_callers() || self.own.len() == count && self.caller.iter().enumerate().all(is_back))
    }

    /// The body's own number of one of the caller's.
    #[inline]
    pub fn own(&self, caller: u32) -> u32 {
        self.own.get(caller as usize).map_or(caller, |&own| own)
    }

    /// The body's own numbers of some of the caller's, where they are not the same.
    pub fn owns(&self, callers: Range<usize>) -> &[u32] {
        &self.own[callers]
    }

    /// The caller's number of one of the body's own.
    #[inline]
    pub fn caller(&self, own: u32) -> u32 {
        self.caller.get(own as usize).map_or(own, |&caller| caller)
    }

    /// The body's own numbers of the corners of triangles.
    pub fn own_triangles(&self, triangles: &[[u32; 3]]) -> Result<Vec<[u32; 3]>> {
        memory::collected(triangles.iter().map(|corners| corners.map(|corner| self.own(corner))))
    }
}
