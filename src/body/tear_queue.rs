//! The queue of springs that tear after a step, the most loaded first.

use super::strain_monitor::StrainMonitor;
use super::tear_strength::{TearStrength, sorted};
use crate::base::{Result, memory};
use crate::codec::saved;
use crate::cutting::Changes;
use crate::def::{BodyDefinition, Spring, TearRefusal, TearReport, Tearing};
use crate::simd::ChosenKernel;
use crate::soa::{NodeOrder, Vectors};
use crate::springs::{Link, Rewiring, SpringChange};
use crate::threads::Team;

/// A spring beyond its limits.
#[derive(Clone, Copy, Debug)]
struct OverloadedSpring {
    /// The elongation divided by its maximum.
    load: f32,
    callers: [u32; 2],
    nodes: [u32; 2],
}

saved! { OverloadedSpring { load, callers, nodes } }

/// The tear limits of a body, and the queue of springs beyond their limits after the last step.
#[derive(Debug)]
pub(crate) struct TearQueue {
    tearing: Tearing,
    pub(super) strength: TearStrength,
    monitor: StrainMonitor,
    /// Sorted by load, the highest first.
    overloaded: Vec<OverloadedSpring>,
    /// The number of entries that have been processed.
    processed: usize,
    /// The number of tears that were attempted in this step.
    attempts: u32,
    /// Nodes next to the tears of this step.
    torn_nodes: Vec<u32>,
    pub(super) report: TearReport,
}

saved! { TearQueue { tearing, strength, monitor, overloaded, processed, attempts, torn_nodes, report } }

impl TearQueue {
    /// Creates the queue from springs in internal indices; `None` if the body cannot tear. Edges of elements without a
    /// spring tear too.
    pub fn new(
        definition: &BodyDefinition,
        springs: &[Spring],
        has_elements: bool,
        order: &NodeOrder,
    ) -> Result<Option<Box<Self>>> {
        let tearing = definition.tearing;
        if tearing.most_per_step == 0 {
            return Ok(None);
        }
        let mut all = memory::copied(springs)?;
        if has_elements {
            add_edges(definition, &mut all, order)?;
        }
        let springs = &all[..];
        let node_count = definition.positions.len();
        let room = node_count + definition.spare_nodes as usize;
        let mut tear_queue = Self {
            tearing,
            strength: TearStrength::new(springs, [tearing.strain, tearing.force], node_count, room)?,
            monitor: StrainMonitor::new(node_count, room)?,
            overloaded: Vec::new(),
            processed: 0,
            attempts: 0,
            torn_nodes: Vec::new(),
            report: TearReport::default(),
        };
        tear_queue.reserve(0)?;
        Ok(Some(memory::boxed(tear_queue)?))
    }

    /// True if there are limits for the spring or edge between two nodes.
    pub fn has_limits(&self, nodes: [u32; 2]) -> bool {
        self.strength.has(nodes)
    }

    /// The minimum fragment size: the area, m², for solids the volume, m³, below which no tear separates a fragment.
    pub fn smallest_piece(&self) -> f64 {
        f64::from(self.tearing.smallest_piece)
    }

    /// Reserves space for this many more springs.
    pub fn reserve(&mut self, springs: usize) -> Result<()> {
        self.strength.reserve(springs)?;
        self.monitor.reserve(self.strength.springs().len() + springs)
    }

    /// Extends the lists to this many nodes, for which space is reserved.
    pub fn resize_nodes(&mut self, node_count: usize) {
        self.strength.resize_nodes(node_count);
        self.monitor.resize_nodes(node_count);
    }

    /// The limits of a spring: see [`TearStrength::limits`].
    pub fn limits(&self, nodes: [u32; 2]) -> [f32; 2] {
        self.strength.limits(nodes)
    }

    /// Sets the limits of a spring: see [`TearStrength::set`].
    pub fn set(&mut self, nodes: [u32; 2], limits: [Option<f32>; 2], link: &Link) {
        self.strength.set(nodes, limits, link);
        self.monitor.forget();
    }

    /// Removes a spring.
    pub fn remove(&mut self, nodes: [u32; 2]) {
        self.strength.remove(nodes);
        self.monitor.forget();
    }

    /// Follows changes of stiffnesses or rest lengths. The limits stay.
    pub fn update_springs(&mut self, changes: &[SpringChange]) {
        self.strength.update_springs(changes);
        self.monitor.forget();
    }

    /// Follows a cut: see [`TearStrength::apply_cut`].
    pub fn apply_cut(&mut self, changes: &Changes, rewiring: &Rewiring, order: &NodeOrder) {
        self.strength.apply_cut(changes, rewiring, order);
        self.monitor.forget();
    }

    /// Finds the springs beyond their limits that can tear with this topology version. `link` returns the link of a
    /// spring. If memory is short, some springs wait for the next step.
    pub fn collect_overloaded(
        &mut self,
        positions: &Vectors,
        version: u64,
        order: &NodeOrder,
        link: impl Fn([u32; 2]) -> Option<Link>,
        team: (ChosenKernel, &Team),
    ) {
        self.overloaded.clear();
        self.torn_nodes.clear();
        (self.processed, self.attempts) = (0, 0);
        self.report = TearReport::default();
        let springs = self.strength.springs();
        self.monitor.update(springs, positions, team);
        for (index, spring) in self.monitor.candidates(springs) {
            let [a, b] = spring.nodes.map(|node| positions.get(node as usize));
            if a.distance_squared(b) <= spring.longest_squared {
                continue;
            }
            if let Some(reason) = self.strength.refusal(index, version) {
                self.report.count_refusal(reason);
                continue;
            }
            let rest_length = link(spring.nodes).map_or(0.0, |link| link.rest_length);
            let overloaded = OverloadedSpring {
                load: (a.distance(b) - rest_length) / (spring.longest_squared.sqrt() - rest_length),
                callers: sorted(spring.nodes.map(|node| order.caller(node))),
                nodes: spring.nodes,
            };
            if memory::push(&mut self.overloaded, overloaded).is_err() {
                self.report.waiting += 1;
            }
        }
        self.overloaded
            .sort_unstable_by(|a, b| b.load.total_cmp(&a.load).then(a.callers.cmp(&b.callers)));
    }

    /// The next spring to tear.
    pub fn next(&mut self) -> Option<[u32; 2]> {
        while let Some(&OverloadedSpring { nodes, .. }) = self.overloaded.get(self.processed) {
            self.processed += 1;
            if !self.strength.has(nodes) {
                continue;
            }
            let is_next_to_tear = nodes.iter().any(|node| self.torn_nodes.contains(node));
            let max_tears = self.tearing.most_per_step;
            // The same number of attempts again may fail.
            if is_next_to_tear || self.report.tears >= max_tears || self.attempts >= max_tears.saturating_mul(2) {
                self.report.waiting += 1;
                continue;
            }
            self.attempts += 1;
            return Some(nodes);
        }
        None
    }

    /// Records a tear through cells with these nodes.
    pub fn record_tear(&mut self, pieces_parted: u32, nodes: impl Iterator<Item = u32>) {
        self.report.tears += 1;
        self.report.pieces_parted += pieces_parted;
        for node in nodes {
            // Out of memory: a second tear can occur next to this one.
            let _ = memory::push(&mut self.torn_nodes, node);
        }
    }

    /// Records that a spring was not torn.
    pub fn refuse(&mut self, nodes: [u32; 2], reason: TearRefusal, version: u64) {
        self.report.count_refusal(reason);
        self.strength.refuse(nodes, reason, version);
    }
}

/// Adds the edges of tetrahedra without a spring, as springs without stiffness.
fn add_edges(definition: &BodyDefinition, springs: &mut Vec<Spring>, order: &NodeOrder) -> Result<()> {
    let rest = definition.rest_positions.unwrap_or(definition.positions);
    let mut existing = memory::collected(springs.iter().map(|spring| sorted(spring.nodes)))?;
    existing.sort_unstable();
    for edge in crate::mesh::edges(&[], definition.tetrahedra)? {
        let nodes = sorted(edge.map(|node| order.own(node)));
        if existing.binary_search(&nodes).is_ok() {
            continue;
        }
        let [a, b] = edge.map(|node| rest[node as usize]);
        let spring = Spring {
            nodes,
            stiffness: 0.0,
            rest_length: a.distance(b),
            damping: 0.0,
        };
        memory::push(springs, spring)?;
    }
    Ok(())
}
