//! Tear limits of each spring of a body.

use super::strain_monitor::WatchedSpring;
use crate::base::{Result, StateHasher, memory};
use crate::codec::saved;
use crate::cutting::Changes;
use crate::def::{Spring, TearRefusal};
use crate::soa::NodeOrder;
use crate::springs::{Link, Rewiring, SpringChange};

/// The end of a list.
const NONE: u32 = u32::MAX;

#[derive(Clone, Copy, Debug)]
struct StrengthLimits {
    strain: f32,
    force: f32,
    /// The next spring with the same lower node.
    next: u32,
    /// The topology version at which a tear of this spring was refused, and the reason.
    refusal: Option<(u32, TearRefusal)>,
}

saved! { StrengthLimits { strain, force, next, refusal } }

/// Springs with tear limits, in internal indices.
#[derive(Debug)]
pub(super) struct TearStrength {
    /// Parallel to `limits`.
    springs: Vec<WatchedSpring>,
    limits: Vec<StrengthLimits>,
    /// For each node, the first spring whose lower node it is.
    first: Vec<u32>,
}

saved! { TearStrength { springs, limits, first } }

impl TearStrength {
    /// Gives all springs the same limits: strain and force. Reserves space for `room` nodes.
    pub fn new(springs: &[Spring], limits: [f32; 2], node_count: usize, room: usize) -> Result<Self> {
        let mut first = memory::reserved(room)?;
        first.resize(node_count, NONE);
        let mut all = Self {
            springs: memory::reserved(springs.len())?,
            limits: memory::reserved(springs.len())?,
            first,
        };
        // Sorted by nodes, which is their order in memory.
        let mut order = memory::collected(0..springs.len() as u32)?;
        order.sort_unstable_by_key(|&index| sorted(springs[index as usize].nodes));
        for index in order {
            let spring = springs[index as usize];
            all.add(sorted(spring.nodes), limits, &Link::ends(&spring)[0]);
        }
        Ok(all)
    }

    pub fn springs(&self) -> &[WatchedSpring] {
        &self.springs
    }

    /// True if a spring has limits.
    pub fn has(&self, nodes: [u32; 2]) -> bool {
        self.find(nodes).is_some()
    }

    /// The reason why the spring at an index was not torn, if it was tried with this topology version.
    pub fn refusal(&self, index: usize, version: u64) -> Option<TearRefusal> {
        let refusal = self.limits[index].refusal?;
        (refusal.0 == version as u32).then_some(refusal.1)
    }

    /// Records that a spring was not torn.
    pub fn refuse(&mut self, nodes: [u32; 2], reason: TearRefusal, version: u64) {
        if let Some(index) = self.find(nodes) {
            self.limits[index].refusal = Some((version as u32, reason));
        }
    }

    /// Reserves space for this many more springs.
    pub fn reserve(&mut self, springs: usize) -> Result<()> {
        self.springs.try_reserve(springs)?;
        Ok(self.limits.try_reserve(springs)?)
    }

    /// Extends the list to this many nodes, for which space is reserved.
    pub fn resize_nodes(&mut self, node_count: usize) {
        self.first.resize(node_count, NONE);
    }

    /// The limits of a spring: strain and force. 0 means no limit.
    pub fn limits(&self, nodes: [u32; 2]) -> [f32; 2] {
        self.find(nodes)
            .map_or([0.0; 2], |index| [self.limits[index].strain, self.limits[index].force])
    }

    /// Sets the limits of a spring: strain and force. Space is reserved if it has none yet.
    pub fn set(&mut self, nodes: [u32; 2], [strain, force]: [Option<f32>; 2], link: &Link) {
        match self.find(nodes) {
            Some(index) => {
                let limits = &mut self.limits[index];
                limits.strain = strain.unwrap_or(limits.strain);
                limits.force = force.unwrap_or(limits.force);
                limits.refusal = None;
                self.springs[index].longest_squared = longest_squared(limits, link);
            }
            None => self.add(sorted(nodes), [strain, force].map(|limit| limit.unwrap_or(0.0)), link),
        }
    }

    /// Removes a spring.
    pub fn remove(&mut self, nodes: [u32; 2]) {
        let Some(index) = self.find(nodes) else {
            return;
        };
        self.relink(index, self.limits[index].next);
        let last = self.springs.len() - 1;
        if index < last {
            self.relink(last, index as u32);
        }
        self.springs.swap_remove(index);
        self.limits.swap_remove(index);
    }

    /// Recomputes the longest lengths after changes of stiffnesses or rest lengths. The limits stay.
    pub fn update_springs(&mut self, changes: &[SpringChange]) {
        for change in changes {
            if let Some(index) = self.find([change.node, change.after.neighbor]) {
                self.springs[index].longest_squared = longest_squared(&self.limits[index], &change.after);
            }
        }
    }

    /// Follows a cut: each part of a spring bears its part of the force. Space for the new springs is reserved.
    pub fn apply_cut(&mut self, changes: &Changes, rewiring: &Rewiring, order: &NodeOrder) {
        let own = |nodes: [u32; 2]| nodes.map(|node| order.own(node));
        for piece in changes.springs.iter().filter(|piece| piece.nodes != piece.source) {
            if let Some(index) = self.find(own(piece.source)) {
                let (spring, limits) = (self.springs[index], self.limits[index]);
                // The maximum length is that of the whole spring.
                self.insert(
                    WatchedSpring {
                        nodes: sorted(own(piece.nodes)),
                        ..spring
                    },
                    StrengthLimits {
                        force: (f64::from(limits.force) * piece.part) as f32,
                        refusal: None,
                        ..limits
                    },
                );
            }
        }
        for spring in &rewiring.removed {
            self.remove(spring.nodes);
        }
        // Edges without a spring are identified by their nodes alone.
        for &nodes in &changes.removed_springs {
            self.remove(own(nodes));
        }
        for SpringChange { node, before, after } in &rewiring.changed {
            if let Some(index) = self.find([*node, after.neighbor])
                && before.stiffness > 0.0
            {
                self.limits[index].force *= after.stiffness / before.stiffness;
            }
        }
    }

    pub fn hash(&self, hasher: &mut StateHasher) {
        for (spring, limits) in self.springs.iter().zip(&self.limits) {
            let [a, b] = spring.nodes;
            hasher.write_u64(u64::from(a) << 32 | u64::from(b));
            hasher.write_floats(&[spring.longest_squared, limits.strain, limits.force]);
            let refusal = limits
                .refusal
                .map_or(0, |(since, reason)| u64::from(since) << 2 | (1 + reason as u64));
            hasher.write_u64(refusal);
        }
    }

    fn add(&mut self, nodes: [u32; 2], [strain, force]: [f32; 2], link: &Link) {
        let limits = StrengthLimits {
            strain,
            force,
            next: NONE,
            refusal: None,
        };
        let longest_squared = longest_squared(&limits, link);
        self.insert(WatchedSpring { nodes, longest_squared }, limits);
    }

    /// Appends a spring, for which space is reserved.
    fn insert(&mut self, spring: WatchedSpring, limits: StrengthLimits) {
        let index = self.springs.len() as u32;
        let next = std::mem::replace(&mut self.first[spring.nodes[0] as usize], index);
        self.springs.push(spring);
        self.limits.push(StrengthLimits { next, ..limits });
    }

    /// The index of a spring.
    fn find(&self, nodes: [u32; 2]) -> Option<usize> {
        let nodes = sorted(nodes);
        let mut index = self.first[nodes[0] as usize];
        while index != NONE {
            if self.springs[index as usize].nodes == nodes {
                return Some(index as usize);
            }
            index = self.limits[index as usize].next;
        }
        None
    }

    /// Replaces the list entry that refers to the spring at an index.
    fn relink(&mut self, index: usize, to: u32) {
        let mut name = &mut self.first[self.springs[index].nodes[0] as usize];
        while *name != index as u32 {
            let before = *name as usize;
            name = &mut self.limits[before].next;
        }
        *name = to;
    }
}

pub(super) fn sorted([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// The square of the maximum length of a spring, m²; infinity without limits.
fn longest_squared(limits: &StrengthLimits, link: &Link) -> f32 {
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
