//! What each spring of a body bears before it tears.

use super::stretch::WatchedSpring;
use crate::base::{Result, StateHasher, memory};
use crate::codec::saved;
use crate::cutting::Changes;
use crate::def::{Spring, Withheld};
use crate::soa::NodeOrder;
use crate::springs::{Link, Rewiring, SpringChange};

/// No spring.
const NONE: u32 = u32::MAX;

#[derive(Clone, Copy, Debug)]
struct BearingLimits {
    strain: f32,
    force: f32,
    /// The next spring of the same lower node.
    next: u32,
    /// Since which version of the topology.
    withheld: Option<(u32, Withheld)>,
}

saved! { BearingLimits { strain, force, next, withheld } }

/// Springs with limits, in the body's own numbers.
#[derive(Debug)]
pub(super) struct Bearing {
    /// Each with its limits at the same place.
    springs: Vec<WatchedSpring>,
    limits: Vec<BearingLimits>,
    /// Of each node the first spring that it is the lower one of.
    first: Vec<u32>,
}

saved! { Bearing { springs, limits, first } }

impl Bearing {
    /// All springs with the same limits, strain and force; with room for so many nodes.
    pub fn new(springs: &[Spring], limits: [f32; 2], node_count: usize, room: usize) -> Result<Self> {
        let mut first = memory::reserved(room)?;
        first.resize(node_count, NONE);
        let mut all = Self {
            springs: memory::reserved(springs.len())?,
            limits: memory::reserved(springs.len())?,
            first,
        };
        // In the order of their nodes, which is that of their places in memory.
        let mut order = memory::collected(0..springs.len() as u32)?;
        order.sort_unstable_by_key(|&at| sorted(springs[at as usize].nodes));
        for at in order {
            let spring = springs[at as usize];
            all.add(sorted(spring.nodes), limits, &Link::ends(&spring)[0]);
        }
        Ok(all)
    }

    pub fn springs(&self) -> &[WatchedSpring] {
        &self.springs
    }

    /// Whether a spring has limits.
    pub fn has(&self, nodes: [u32; 2]) -> bool {
        self.find(nodes).is_some()
    }

    /// Why the spring at a place was not torn with this version of the topology.
    pub fn withheld(&self, at: usize, version: u64) -> Option<Withheld> {
        let withheld = self.limits[at].withheld?;
        (withheld.0 == version as u32).then_some(withheld.1)
    }

    /// A spring was not torn.
    pub fn withhold(&mut self, nodes: [u32; 2], why: Withheld, version: u64) {
        if let Some(at) = self.find(nodes) {
            self.limits[at].withheld = Some((version as u32, why));
        }
    }

    /// Makes room for so many more springs.
    pub fn reserve(&mut self, springs: usize) -> Result<()> {
        self.springs.try_reserve(springs)?;
        Ok(self.limits.try_reserve(springs)?)
    }

    /// Nodes have come, for which there is room, up to so many in all.
    pub fn grow(&mut self, node_count: usize) {
        self.first.resize(node_count, NONE);
    }

    /// The limits of a spring, strain and force; 0: none.
    pub fn limits(&self, nodes: [u32; 2]) -> [f32; 2] {
        self.find(nodes)
            .map_or([0.0; 2], |at| [self.limits[at].strain, self.limits[at].force])
    }

    /// Gives a spring its limits, strain and force, for which there is room if it has none yet.
    pub fn set(&mut self, nodes: [u32; 2], [strain, force]: [Option<f32>; 2], link: &Link) {
        match self.find(nodes) {
            Some(at) => {
                let limits = &mut self.limits[at];
                limits.strain = strain.unwrap_or(limits.strain);
                limits.force = force.unwrap_or(limits.force);
                limits.withheld = None;
                self.springs[at].longest_squared = longest_squared(limits, link);
            }
            None => self.add(sorted(nodes), [strain, force].map(|limit| limit.unwrap_or(0.0)), link),
        }
    }

    /// A spring is no more.
    pub fn remove(&mut self, nodes: [u32; 2]) {
        let Some(at) = self.find(nodes) else {
            return;
        };
        self.rename(at, self.limits[at].next);
        let last = self.springs.len() - 1;
        if at < last {
            self.rename(last, at as u32);
        }
        self.springs.swap_remove(at);
        self.limits.swap_remove(at);
    }

    /// Springs have other stiffnesses or rest lengths; limits stay.
    pub fn change(&mut self, changes: &[SpringChange]) {
        for change in changes {
            if let Some(at) = self.find([change.node, change.after.neighbour]) {
                self.springs[at].longest_squared = longest_squared(&self.limits[at], &change.after);
            }
        }
    }

    /// A cut has changed springs: each part of one bears its part. There is room for those that are new.
    pub fn follow(&mut self, changes: &Changes, rewiring: &Rewiring, order: &NodeOrder) {
        let own = |nodes: [u32; 2]| nodes.map(|node| order.own(node));
        for piece in changes.springs.iter().filter(|piece| piece.nodes != piece.source) {
            if let Some(at) = self.find(own(piece.source)) {
                let (spring, limits) = (self.springs[at], self.limits[at]);
                // As long as the whole.
                self.link(
                    WatchedSpring {
                        nodes: sorted(own(piece.nodes)),
                        ..spring
                    },
                    BearingLimits {
                        force: (f64::from(limits.force) * piece.part) as f32,
                        withheld: None,
                        ..limits
                    },
                );
            }
        }
        for spring in &rewiring.removed {
            self.remove(spring.nodes);
        }
        // Edges without a spring are removed by their names alone.
        for &nodes in &changes.removed_springs {
            self.remove(own(nodes));
        }
        for SpringChange { node, before, after } in &rewiring.changed {
            if let Some(at) = self.find([*node, after.neighbour])
                && before.stiffness > 0.0
            {
                self.limits[at].force *= after.stiffness / before.stiffness;
            }
        }
    }

    pub fn hash(&self, hasher: &mut StateHasher) {
        for (spring, limits) in self.springs.iter().zip(&self.limits) {
            let [a, b] = spring.nodes;
            hasher.write_u64(u64::from(a) << 32 | u64::from(b));
            hasher.write_floats(&[spring.longest_squared, limits.strain, limits.force]);
            let withheld = limits
                .withheld
                .map_or(0, |(since, why)| u64::from(since) << 2 | (1 + why as u64));
            hasher.write_u64(withheld);
        }
    }

    fn add(&mut self, nodes: [u32; 2], [strain, force]: [f32; 2], link: &Link) {
        let limits = BearingLimits {
            strain,
            force,
            next: NONE,
            withheld: None,
        };
        let longest_squared = longest_squared(&limits, link);
        self.link(WatchedSpring { nodes, longest_squared }, limits);
    }

    /// Appends a spring, for which there is room.
    fn link(&mut self, spring: WatchedSpring, limits: BearingLimits) {
        let number = self.springs.len() as u32;
        let next = std::mem::replace(&mut self.first[spring.nodes[0] as usize], number);
        self.springs.push(spring);
        self.limits.push(BearingLimits { next, ..limits });
    }

    /// The place of a spring.
    fn find(&self, nodes: [u32; 2]) -> Option<usize> {
        let nodes = sorted(nodes);
        let mut at = self.first[nodes[0] as usize];
        while at != NONE {
            if self.springs[at as usize].nodes == nodes {
                return Some(at as usize);
            }
            at = self.limits[at as usize].next;
        }
        None
    }

    /// What named the spring at a place names another.
    fn rename(&mut self, at: usize, to: u32) {
        let mut name = &mut self.first[self.springs[at].nodes[0] as usize];
        while *name != at as u32 {
            let before = *name as usize;
            name = &mut self.limits[before].next;
        }
        *name = to;
    }
}

pub(super) fn sorted([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// The square of the longest that a spring may be, m²; infinity: any length.
fn longest_squared(limits: &BearingLimits, link: &Link) -> f32 {
    let [rest, stiffness] = [link.rest_length, link.stiffness].map(f64::from);
    let mut longest = f64::INFINITY;
    if limits.strain > 0.0 && rest > 0.0 {
        longest = rest * (1.0 + f64::from(limits.strain));
    }
    if limits.force > 0.0 && stiffness > 0.0 {
        longest = longest.min(rest + f64::from(limits.force) / stiffness);
    }
    (longest * longest) as f32
}
