//! Which springs tear after a step, the most loaded first.

use super::bearing::{Bearing, sorted};
use super::stretch::StretchBound;
use crate::base::{Result, memory};
use crate::codec::saved;
use crate::cutting::Changes;
use crate::def::{BodyDefinition, Spring, TearReport, Tearing, Withheld};
use crate::simd::ChosenKernel;
use crate::soa::{NodeOrder, Vectors};
use crate::springs::{Link, Rewiring, SpringChange};
use crate::threads::Team;

/// A spring beyond its limits.
#[derive(Clone, Copy, Debug)]
struct Beyond {
    /// Its stretch as a multiple of the most that it may have.
    load: f32,
    callers: [u32; 2],
    nodes: [u32; 2],
}

saved! { Beyond { load, callers, nodes } }

/// The springs of a body that tears, and those beyond their limits after the last step.
#[derive(Debug)]
pub(crate) struct Tears {
    asked: Tearing,
    pub(super) bearing: Bearing,
    stretch: StretchBound,
    /// The most loaded first.
    beyond: Vec<Beyond>,
    /// How many of them have had their turn.
    seen: usize,
    /// Tears that were tried in this step.
    tried: u32,
    /// Nodes about the tears of this step.
    torn: Vec<u32>,
    pub(super) report: TearReport,
}

saved! { Tears { asked, bearing, stretch, beyond, seen, tried, torn, report } }

impl Tears {
    /// With springs in the body's own numbers; `None`: the body is not to tear. Of tetrahedra that are elements edges without a spring tear too.
    pub fn new(
        definition: &BodyDefinition,
        springs: &[Spring],
        has_elements: bool,
        order: &NodeOrder,
    ) -> Result<Option<Box<Self>>> {
        let asked = definition.tearing;
        if asked.most_per_step == 0 {
            return Ok(None);
        }
        let mut all = memory::copied(springs)?;
        if has_elements {
            add_edges(definition, &mut all, order)?;
        }
        let springs = &all[..];
        let node_count = definition.positions.len();
        let room = node_count + definition.spare_nodes as usize;
        let mut tears = Self {
            asked,
            bearing: Bearing::new(springs, [asked.strain, asked.force], node_count, room)?,
            stretch: StretchBound::new(node_count, room)?,
            beyond: Vec::new(),
            seen: 0,
            tried: 0,
            torn: Vec::new(),
            report: TearReport::default(),
        };
        tears.reserve(0)?;
        Ok(Some(memory::boxed(tears)?))
    }

    /// Whether there are limits for the spring or edge between two nodes.
    pub fn watches(&self, nodes: [u32; 2]) -> bool {
        self.bearing.has(nodes)
    }

    /// A tear that would part a piece with less area is not to be made, m²; of solids with less volume, m³.
    pub fn smallest_piece(&self) -> f64 {
        f64::from(self.asked.smallest_piece)
    }

    /// Makes room for so many more springs.
    pub fn reserve(&mut self, springs: usize) -> Result<()> {
        self.bearing.reserve(springs)?;
        self.stretch.reserve(self.bearing.springs().len() + springs)
    }

    /// Nodes have come, for which there is room, up to so many in all.
    pub fn grow(&mut self, node_count: usize) {
        self.bearing.grow(node_count);
        self.stretch.grow(node_count);
    }

    /// The limits of a spring: see [`Bearing::limits`].
    pub fn limits(&self, nodes: [u32; 2]) -> [f32; 2] {
        self.bearing.limits(nodes)
    }

    /// Gives a spring limits: see [`Bearing::set`].
    pub fn set(&mut self, nodes: [u32; 2], limits: [Option<f32>; 2], link: &Link) {
        self.bearing.set(nodes, limits, link);
        self.stretch.forget();
    }

    /// A spring is no more.
    pub fn remove(&mut self, nodes: [u32; 2]) {
        self.bearing.remove(nodes);
        self.stretch.forget();
    }

    /// Springs have other stiffnesses or rest lengths; limits stay.
    pub fn change(&mut self, changes: &[SpringChange]) {
        self.bearing.change(changes);
        self.stretch.forget();
    }

    /// A cut has changed springs: see [`Bearing::follow`].
    pub fn follow(&mut self, changes: &Changes, rewiring: &Rewiring, order: &NodeOrder) {
        self.bearing.follow(changes, rewiring, order);
        self.stretch.forget();
    }

    /// Finds the springs beyond their limits that may be torn with this version of the topology, given what each is like. Without memory for all
    /// of them some wait for the next step.
    pub fn begin(
        &mut self,
        positions: &Vectors,
        version: u64,
        order: &NodeOrder,
        link: impl Fn([u32; 2]) -> Option<Link>,
        team: (ChosenKernel, &Team),
    ) {
        self.beyond.clear();
        self.torn.clear();
        (self.seen, self.tried) = (0, 0);
        self.report = TearReport::default();
        let springs = self.bearing.springs();
        self.stretch.look(springs, positions, team);
        for (at, spring) in self.stretch.found(springs) {
            let [a, b] = spring.nodes.map(|node| positions.get(node as usize));
            if a.distance_squared(b) <= spring.longest_squared {
                continue;
            }
            if let Some(why) = self.bearing.withheld(at, version) {
                self.report.withhold(why);
                continue;
            }
            let rest = link(spring.nodes).map_or(0.0, |link| link.rest_length);
            let beyond = Beyond {
                load: (a.distance(b) - rest) / (spring.longest_squared.sqrt() - rest),
                callers: sorted(spring.nodes.map(|node| order.caller(node))),
                nodes: spring.nodes,
            };
            if memory::push(&mut self.beyond, beyond).is_err() {
                self.report.waiting += 1;
            }
        }
        self.beyond
            .sort_unstable_by(|a, b| b.load.total_cmp(&a.load).then(a.callers.cmp(&b.callers)));
    }

    /// The next spring that is to tear.
    pub fn next(&mut self) -> Option<[u32; 2]> {
        while let Some(&Beyond { nodes, .. }) = self.beyond.get(self.seen) {
            self.seen += 1;
            if !self.bearing.has(nodes) {
                continue;
            }
            let is_beside = nodes.iter().any(|node| self.torn.contains(node));
            let most = self.asked.most_per_step;
            // As many again may be tried in vain.
            if is_beside || self.report.tears >= most || self.tried >= most.saturating_mul(2) {
                self.report.waiting += 1;
                continue;
            }
            self.tried += 1;
            return Some(nodes);
        }
        None
    }

    /// A tear was made, through cells of these nodes.
    pub fn made(&mut self, pieces_parted: u32, nodes: impl Iterator<Item = u32>) {
        self.report.tears += 1;
        self.report.pieces_parted += pieces_parted;
        for node in nodes {
            // Out of memory: another tear may come beside it.
            let _ = memory::push(&mut self.torn, node);
        }
    }

    /// A spring was not torn.
    pub fn withhold(&mut self, nodes: [u32; 2], why: Withheld, version: u64) {
        self.report.withhold(why);
        self.bearing.withhold(nodes, why, version);
    }
}

/// Adds the edges of tetrahedra along which there is no spring, as springs without stiffness.
fn add_edges(definition: &BodyDefinition, springs: &mut Vec<Spring>, order: &NodeOrder) -> Result<()> {
    let rest = definition.rest_positions.unwrap_or(definition.positions);
    let mut known = memory::collected(springs.iter().map(|spring| sorted(spring.nodes)))?;
    known.sort_unstable();
    for edge in crate::mesh::edges(&[], definition.tetrahedra)? {
        let nodes = sorted(edge.map(|node| order.own(node)));
        if known.binary_search(&nodes).is_ok() {
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
