//! The nodes that set the longest stable substep: of a mesh with slivers, a few in a hundred.
//!
//! How stiff the springs of a node can be together wherever it goes does not change as it moves. So those that can be
//! stiffest are found once, and an estimate looks at them from the stiffest on until no other can matter.

use crate::base::{Result, memory};
use crate::codec::saved;
use crate::soa::Masses;
use crate::springs::{Springs, rates_anywhere};

/// One node in so many is watched.
const SHARE: usize = 16;

/// A node, and the longest substep that is stable for it wherever it and its neighbours are, s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Candidate {
    pub limit: f32,
    pub node: u32,
}

saved! { Candidate { limit, node } }

impl Candidate {
    fn before(&self, other: &Self) -> std::cmp::Ordering {
        let limits = self.limit.total_cmp(&other.limit);
        limits.then(self.node.cmp(&other.node))
    }
}

/// The nodes of a body that come first if one of them becomes unstable.
#[derive(Debug)]
pub(crate) struct Watched {
    /// Those with the shortest limits first. There is room for twice as many as are watched.
    candidates: Vec<Candidate>,
    most: usize,
    /// What the limit of any other node is at least, s.
    others: f32,
}

saved! { Watched { candidates, most, others } }

impl Watched {
    /// Room for the watched nodes of a body; none are yet.
    pub fn new(node_count: usize) -> Result<Self> {
        let most = node_count.div_ceil(SHARE);
        Ok(Self {
            candidates: memory::reserved(2 * most)?,
            most,
            others: f32::INFINITY,
        })
    }

    pub(super) fn candidates(&self) -> &[Candidate] {
        &self.candidates
    }

    /// The longest substep that is stable for all nodes wherever they are, s.
    pub fn limit(&self) -> f32 {
        // Springs of the first may have become softer than those of others.
        let first = self.candidates.first();
        first.map_or(self.others, |first| first.limit.min(self.others))
    }

    /// What the limit of any node that is not watched is at least, s.
    pub(super) fn limit_of_others(&self) -> f32 {
        self.others
    }

    /// Finds the nodes to be watched, after masses or pins have changed.
    pub fn gather(&mut self, springs: &dyn Springs, masses: Masses) {
        self.candidates.clear();
        self.others = f32::INFINITY;
        for node in 0..masses.masses.len() {
            if let Some(rates) = rates_anywhere(node, springs, &masses) {
                let limit = rates.limit();
                if limit < self.others {
                    self.take(node as u32, limit);
                }
            }
        }
        self.keep_first();
        self.candidates.sort_unstable_by(Candidate::before);
    }

    /// Keeps as many as are watched.
    fn keep_first(&mut self) {
        if self.candidates.len() > self.most {
            self.candidates.select_nth_unstable_by(self.most, Candidate::before);
            self.others = self.candidates[self.most].limit;
            self.candidates.truncate(self.most);
        }
    }

    /// Sees that the springs of these nodes have changed, given in order.
    pub(super) fn renew(&mut self, nodes: &[u32], springs: &dyn Springs, masses: Masses) {
        self.candidates
            .retain(|candidate| nodes.binary_search(&candidate.node).is_err());
        for &node in nodes {
            if let Some(rates) = rates_anywhere(node as usize, springs, &masses) {
                let limit = rates.limit();
                if limit <= self.others {
                    self.take(node, limit);
                }
            }
        }
        self.keep_first();
        self.candidates.sort_unstable_by(Candidate::before);
    }

    /// Takes in nodes whose springs or masses have changed, in any order, in one walk: what was known of one stays too, and may make the limit shorter
    /// than it is.
    pub(super) fn take_all(&mut self, mut changed: Vec<Candidate>) {
        changed.retain(|candidate| candidate.limit < self.others);
        changed.sort_unstable_by(Candidate::before);
        if let Some(next) = changed.get(self.most) {
            self.others = self.others.min(next.limit);
            changed.truncate(self.most);
        }
        let room = 2 * self.most - changed.len();
        if self.candidates.len() > room {
            self.others = self.others.min(self.candidates[room].limit);
            self.candidates.truncate(room);
        }
        memory::merge(&mut self.candidates, &changed, |candidate| {
            // Limits are above 0: their bits are in their order.
            (candidate.limit.to_bits(), candidate.node)
        });
        if self.candidates.len() > self.most {
            self.others = self.others.min(self.candidates[self.most].limit);
            self.candidates.truncate(self.most);
        }
    }

    /// Takes in a node that is not here.
    fn take(&mut self, node: u32, limit: f32) {
        self.candidates.push(Candidate { limit, node });
        if self.candidates.len() == 2 * self.most {
            self.keep_first();
        }
    }

    /// Has a node that is not pinned among them, with this limit, if it belongs there.
    pub(super) fn insert(&mut self, node: u32, limit: f32) {
        self.candidates.retain(|candidate| candidate.node != node);
        if self.candidates.len() == self.most
            && let Some(last) = self.candidates.pop_if(|last| limit < last.limit)
        {
            self.others = self.others.min(last.limit);
        }
        if self.candidates.len() < self.most {
            let candidate = Candidate { limit, node };
            let place = self
                .candidates
                .partition_point(|other| other.before(&candidate).is_lt());
            self.candidates.insert(place, candidate);
        } else {
            self.others = self.others.min(limit);
        }
    }

    /// What the next step depends on.
    pub fn floats(&self) -> impl Iterator<Item = f32> {
        let limits = self.candidates.iter().map(|candidate| candidate.limit);
        limits.chain([self.others])
    }
}
