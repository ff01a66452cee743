//! The nodes that set the longest stable substep: a few percent of a mesh with slivers.
//!
//! The largest possible stiffness of a node's springs does not depend on positions. The nodes with the largest values
//! are found once. An estimate visits them in descending order until no other node can matter.

use crate::base::{Result, memory};
use crate::codec::saved;
use crate::soa::NodalMasses;
use crate::springs::{Springs, spring_rates};

/// The inverse of the fraction of critical nodes.
const NODES_PER_CRITICAL: usize = 16;

/// A node and its longest stable substep at all positions, s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CriticalNode {
    pub limit: f32,
    pub node: u32,
}

saved! { CriticalNode { limit, node } }

impl CriticalNode {
    fn order(&self, other: &Self) -> std::cmp::Ordering {
        let limits = self.limit.total_cmp(&other.limit);
        limits.then(self.node.cmp(&other.node))
    }
}

/// The nodes of a body that may become unstable first.
#[derive(Debug)]
pub(crate) struct CriticalNodes {
    /// Sorted by limit. The capacity is twice the number of critical nodes.
    candidates: Vec<CriticalNode>,
    max: usize,
    /// A lower bound of the limit of all other nodes, s.
    other_limit: f32,
}

saved! { CriticalNodes { candidates, max, other_limit } }

impl CriticalNodes {
    /// Reserves memory for the critical nodes of a body. The list is empty.
    pub fn new(node_count: usize) -> Result<Self> {
        let max = node_count.div_ceil(NODES_PER_CRITICAL);
        Ok(Self {
            candidates: memory::reserved(2 * max)?,
            max,
            other_limit: f32::INFINITY,
        })
    }

    pub(super) fn candidates(&self) -> &[CriticalNode] {
        &self.candidates
    }

    /// The longest substep that is stable at all positions, s.
    pub fn limit(&self) -> f32 {
        // Springs of the first node may have become softer than those of others.
        let first = self.candidates.first();
        first.map_or(self.other_limit, |first| first.limit.min(self.other_limit))
    }

    /// A lower bound of the limit of nodes that are not critical, s.
    pub(super) fn other_limit(&self) -> f32 {
        self.other_limit
    }

    /// Finds the critical nodes after masses or pins have changed.
    pub fn find(&mut self, springs: &dyn Springs, masses: NodalMasses) {
        self.candidates.clear();
        self.other_limit = f32::INFINITY;
        for node in 0..masses.masses.len() {
            if let Some(rates) = spring_rates(node, springs, &masses) {
                let limit = rates.limit();
                if limit < self.other_limit {
                    self.add(node as u32, limit);
                }
            }
        }
        self.truncate();
        self.candidates.sort_unstable_by(CriticalNode::order);
    }

    /// Truncates the list to its maximum length.
    fn truncate(&mut self) {
        if self.candidates.len() > self.max {
            self.candidates.select_nth_unstable_by(self.max, CriticalNode::order);
            self.other_limit = self.candidates[self.max].limit;
            self.candidates.truncate(self.max);
        }
    }

    /// Updates nodes whose springs have changed. `nodes` are sorted.
    pub(super) fn update(&mut self, nodes: &[u32], springs: &dyn Springs, masses: NodalMasses) {
        self.candidates
            .retain(|candidate| nodes.binary_search(&candidate.node).is_err());
        for &node in nodes {
            if let Some(rates) = spring_rates(node as usize, springs, &masses) {
                let limit = rates.limit();
                if limit <= self.other_limit {
                    self.add(node, limit);
                }
            }
        }
        self.truncate();
        self.candidates.sort_unstable_by(CriticalNode::order);
    }

    /// Inserts nodes whose springs or masses have changed in one pass, in any order. Earlier entries of these nodes
    /// remain and may make the limit shorter than necessary.
    pub(super) fn merge(&mut self, mut changed: Vec<CriticalNode>) {
        changed.retain(|candidate| candidate.limit < self.other_limit);
        changed.sort_unstable_by(CriticalNode::order);
        if let Some(next) = changed.get(self.max) {
            self.other_limit = self.other_limit.min(next.limit);
            changed.truncate(self.max);
        }
        let room = 2 * self.max - changed.len();
        if self.candidates.len() > room {
            self.other_limit = self.other_limit.min(self.candidates[room].limit);
            self.candidates.truncate(room);
        }
        memory::merge(&mut self.candidates, &changed, |candidate| {
            // Limits are positive, so their bits are in the same order.
            (candidate.limit.to_bits(), candidate.node)
        });
        if self.candidates.len() > self.max {
            self.other_limit = self.other_limit.min(self.candidates[self.max].limit);
            self.candidates.truncate(self.max);
        }
    }

    /// Adds a node that is not in the list.
    fn add(&mut self, node: u32, limit: f32) {
        self.candidates.push(CriticalNode { limit, node });
        if self.candidates.len() == 2 * self.max {
            self.truncate();
        }
    }

    /// Inserts or replaces a free node if its limit is short enough.
    pub(super) fn insert(&mut self, node: u32, limit: f32) {
        self.candidates.retain(|candidate| candidate.node != node);
        if self.candidates.len() == self.max
            && let Some(last) = self.candidates.pop_if(|last| limit < last.limit)
        {
            self.other_limit = self.other_limit.min(last.limit);
        }
        if self.candidates.len() < self.max {
            let candidate = CriticalNode { limit, node };
            let index = self.candidates.partition_point(|other| other.order(&candidate).is_lt());
            self.candidates.insert(index, candidate);
        } else {
            self.other_limit = self.other_limit.min(limit);
        }
    }

    /// The values that the next step depends on.
    pub fn floats(&self) -> impl Iterator<Item = f32> {
        let limits = self.candidates.iter().map(|candidate| candidate.limit);
        limits.chain([self.other_limit])
    }
}
