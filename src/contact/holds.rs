//! Contacts within an equation that is solved: what springs do against a tool belongs to it, or a step would let them push
//! tissue into the tool first and only then have it stopped, with too small a force.
//!
//! An augmented Lagrangian (Hestenes 1969, Powell 1969): each contact pushes with a multiplier and a stiffness, and never pulls;
//! what it has come to do becomes its multiplier. As long as multipliers stay there is a convex function to minimise.
//! [Friction](super::grip) belongs to it too: an impulse after the equation would move nodes of stiff tissue back against hardly any force. What is
//! left of a penetration is a matter of contact's own impulses.

use std::ops::Range;

use glam::{DVec3, Vec3};

use super::constraint::Constraint;
use super::features::Feature;
use super::gauge::Meets;
use super::grip::{Grips, NodeFriction, add};
use super::hold::{Answer, Hold};
use super::supports::{MOST, Supports};
use crate::base::{Result, StateHasher};
use crate::codec::saved;
use crate::nodes::{Bindings, Pins};

/// How much stiffer a contact is than its nodes: the more, the faster its multiplier is found, and the worse what lies between.
pub(super) const STIFFER: f32 = 3.0;

/// So many nodes have friction in an equation at most; beyond that it acts after it.
const GRIPPED: usize = 1024;

/// The part of a node in a hold.
#[derive(Clone, Copy, Debug)]
struct Share {
    node: u32,
    hold: u32,
    /// Which of its nodes it is.
    place: usize,
}

saved! { Share { node, hold, place } }

/// What a contact did at the end of a step: where it is found again the next begins with it.
#[derive(Clone, Copy, Debug)]
struct Push {
    /// The tool's place in the world.
    slot: usize,
    feature: Feature,
    tip: u8,
    /// N
    force: f64,
    /// What friction does, N.
    drag: DVec3,
    /// Away from the tool.
    normal: Vec3,
    /// From the tool's position, m.
    arm: Vec3,
}

saved! { Push { slot, feature, tip, force, drag, normal, arm } }

/// The contacts of a body with all tools in the equation in progress.
#[derive(Debug, Default)]
pub(crate) struct Holds {
    holds: Vec<Hold>,
    /// In the order of nodes.
    shares: Vec<Share>,
    /// The tool, the feature and the tip of each, in their order.
    order: Vec<(usize, Feature, u8)>,
    /// What contacts did before the equation in progress, and before the step; both in the order of tools, features and tips.
    last: Vec<Push>,
    settled: Vec<Push>,
    grips: Grips,
}

saved! { Holds { holds, shares, order, last, settled, grips } }

impl Holds {
    /// Makes room for so many contacts, and for the friction of their nodes.
    pub fn reserve(&mut self, count: usize) -> Result<()> {
        self.holds.try_reserve(count.saturating_sub(self.holds.len()))?;
        let shares = MOST * count;
        self.shares.try_reserve(shares.saturating_sub(self.shares.len()))?;
        self.order.try_reserve(count.saturating_sub(self.order.len()))?;
        for pushes in [&mut self.last, &mut self.settled] {
            pushes.try_reserve(count.saturating_sub(pushes.len()))?;
        }
        self.grips.reserve(count.min(GRIPPED))
    }

    /// Begins a step anew.
    pub fn begin_step(&mut self) {
        self.clear();
        self.last.clone_from(&self.settled);
        self.grips.begin_step();
    }

    /// What contacts do now is what the next equation begins with: of these.
    pub(super) fn remember(&mut self, constraints: &[Constraint], slot_of: impl Fn(usize) -> usize) {
        self.grips.remember();
        self.last.clear();
        for (index, (hold, constraint)) in self.holds.iter().zip(constraints).enumerate() {
            if hold.answer.force > 0.0 {
                let feature = constraint.feature.part(hold.answer.meets.weights);
                let is_whole = feature.nodes().len() == constraint.feature.nodes().len();
                self.last.push(Push {
                    slot: slot_of(constraint.tool),
                    feature,
                    tip: if is_whole { constraint.tip } else { 0 },
                    force: hold.answer.force,
                    drag: self.drag(index),
                    normal: hold.answer.meets.normal.as_vec3(),
                    arm: constraint.arm,
                });
            }
        }
        // At its border a feature is met as a smaller one is, and leaves to that what it did. By force too: sums depend on the order.
        self.last
            .sort_unstable_by(|a, b| a.key().cmp(&b.key()).then(a.force.total_cmp(&b.force)));
        self.last.dedup_by(|again, first| {
            let is_same = again.key() == first.key();
            if is_same {
                first.force += again.force;
                first.drag += again.drag;
            }
            is_same
        });
    }

    /// Shows what acted on each tool at the end of the last equation: its place in the world, the force, N, and where, m from its position.
    pub(super) fn show_last(&self, mut see: impl FnMut(usize, DVec3, Vec3)) {
        for push in &self.last {
            see(push.slot, -(push.normal.as_dvec3() * push.force + push.drag), push.arm);
        }
    }

    /// The step that was begun last is current now.
    pub fn settle(&mut self) {
        self.settled.clone_from(&self.last);
        self.grips.settle();
    }

    /// Nothing is known any more of what contacts did.
    pub fn forget(&mut self) {
        self.settled.clear();
        self.grips.forget();
    }

    /// A tool at this place in the world is gone.
    pub fn forget_tool(&mut self, slot: usize) {
        for pushes in [&mut self.last, &mut self.settled] {
            pushes.retain(|push| push.slot != slot);
        }
        self.grips.forget_tool(slot);
    }

    /// What the next step depends on.
    pub fn hash(&self, hasher: &mut StateHasher) {
        for push in &self.settled {
            hasher.write_u64(push.slot as u64);
            push.feature
                .nodes()
                .iter()
                .for_each(|&node| hasher.write_u64(node.into()));
            hasher.write_u64(push.tip.into());
            hasher.write_doubles(&[push.force]);
            hasher.write_doubles(&push.drag.to_array());
            hasher.write_floats(&push.normal.to_array());
            hasher.write_floats(&push.arm.to_array());
        }
        self.grips.hash(hasher);
    }

    pub fn is_empty(&self) -> bool {
        self.holds.is_empty()
    }

    pub fn len(&self) -> usize {
        self.holds.len()
    }

    pub fn clear(&mut self) {
        self.holds.clear();
        self.shares.clear();
        self.order.clear();
        self.grips.clear();
    }

    /// Begins anew with these contacts over `duration` seconds, of nodes that are as stiff as `stiffness_of` tells, N/m; infinite
    /// where they are held. Without a push each node goes the way of `way_of`.
    pub(super) fn begin(
        &mut self,
        constraints: &[Constraint],
        slot_of: impl Fn(usize) -> usize,
        (duration, bindings, pins): (f32, Option<&Bindings>, &Pins),
        stiffness_of: impl Fn(usize) -> f32,
        way_of: impl Fn(usize) -> Vec3,
    ) {
        self.clear();
        for constraint in constraints {
            let supports = Supports::of(constraint.feature, bindings);
            let mut hold = Hold {
                nodes: [0; MOST],
                count: supports.nodes().len(),
                corner_count: constraint.feature.nodes().len(),
                ties: supports.ties,
                free: [DVec3::ZERO; 3],
                gauge: constraint.gauge(duration),
                least: -f64::from(constraint.depth.max(0.0)),
                stiffness: 0.0,
                multiplier: 0.0,
                kept: f64::from(1.0 - constraint.give),
                holds_on: false,
                lasts: false,
                answer: Answer::default(),
                pushed: false,
                grips: [None; MOST],
            };
            let mut softness = 0.0;
            let mut free = [DVec3::ZERO; MOST];
            for (place, &node) in supports.nodes().iter().enumerate() {
                let share = constraint.shares[place];
                let (stiffness, way) = (stiffness_of(node as usize), way_of(node as usize));
                hold.nodes[place] = node;
                free[place] = constraint.starts[place].as_dvec3() + way.as_dvec3();
                softness += share * share / stiffness;
                // What is wedged in between a tool and the axes that hold a node would be dragged without bound.
                let drags = constraint.friction > 0.0 && share > 0.0 && stiffness.is_finite();
                if drags && !pins.partial_axes_of(node).any() {
                    let grip = NodeFriction {
                        node,
                        tool: constraint.tool,
                        slot: slot_of(constraint.tool),
                        friction: constraint.friction.into(),
                        normal: constraint.normal.as_dvec3(),
                        slip: (way - constraint.surface_velocity * duration).as_dvec3(),
                        stiffness: f64::from(STIFFER * constraint.firmness * stiffness),
                        kept: hold.kept,
                        ..NodeFriction::default()
                    };
                    self.grips.add(share.into(), grip);
                }
                self.shares.push(Share {
                    node,
                    hold: self.holds.len() as u32,
                    place,
                });
            }
            hold.free = hold.corners(free);
            let stiffness = STIFFER * constraint.firmness / softness;
            if stiffness.is_finite() {
                hold.stiffness = f64::from(stiffness);
            }
            let key = (slot_of(constraint.tool), constraint.feature, constraint.tip);
            if let Ok(place) = self.last.binary_search_by_key(&key, Push::key) {
                hold.multiplier = hold.kept * self.last[place].force;
                hold.holds_on = true;
                hold.lasts = true;
            }
            self.holds.push(hold);
        }
        self.grips.begin();
        for (hold, constraint) in self.holds.iter_mut().zip(constraints) {
            let of_nodes = hold.grips.iter_mut().zip(&hold.nodes).zip(constraint.shares);
            for ((grip, &node), share) in of_nodes.take(hold.count) {
                *grip = self.grips.place(node, constraint.tool);
                if let Some(place) = *grip {
                    self.grips.press(place, hold.multiplier * f64::from(share));
                }
            }
        }
        self.grips.limit();
        self.shares.sort_unstable_by_key(|share| (share.node, share.hold));
        self.order.extend(
            constraints
                .iter()
                .map(|constraint| (constraint.tool, constraint.feature, constraint.tip)),
        );
        self.order.sort_unstable();
    }

    /// Finds out what each contact does with these pushes of the nodes, m.
    pub fn press(&mut self, push_of: impl Fn(usize) -> DVec3) {
        for hold in &mut self.holds {
            hold.answer = hold.answer_to(&push_of);
        }
        self.press_grips();
        self.grips.drag(push_of);
    }

    /// Has friction know what presses each node.
    fn press_grips(&mut self) {
        self.grips.lift();
        for hold in &self.holds {
            for (grip, share) in hold.grips.iter().zip(hold.answer.shares) {
                if let &Some(place) = grip {
                    self.grips.press(place, hold.answer.force.max(0.0) * share);
                }
            }
        }
    }

    /// From now on no contact pulls.
    pub fn let_go(&mut self) {
        self.grips.let_go();
        for hold in &mut self.holds {
            hold.holds_on = false;
            if hold.answer.force < 0.0 {
                hold.answer.force = 0.0;
                hold.answer.stiffness = [[0.0; MOST]; MOST];
            }
        }
    }

    /// How much more the contacts would do with better multipliers, as a part of what they do.
    pub fn missing(&self, push_of: impl Fn(usize) -> DVec3) -> f64 {
        let (mut missing, mut all) = (0.0, 0.0);
        for hold in &self.holds {
            missing += hold.missing(&push_of).abs();
            all += hold.answer.force;
        }
        missing += self.grips.missing(push_of);
        if missing > 0.0 { missing / all } else { 0.0 }
    }

    /// What the contacts do becomes their multiplier, with which they do more where something is missing: shows each node what
    /// is added there, N.
    pub fn improve(&mut self, push_of: impl Fn(usize) -> DVec3, mut add: impl FnMut(usize, DVec3)) {
        for hold in &mut self.holds {
            let before = hold.answer.force;
            hold.multiplier = hold.kept * before;
            hold.answer = hold.answer_to(&push_of);
            hold.share_out(&hold.answer, hold.answer.force - before, &mut add);
        }
        self.press_grips();
        self.grips.improve(push_of, add);
    }

    /// What the residuals lack of balance along the contacts' normals, as a part of what those do.
    pub fn imbalance(&self, residual_of: impl Fn(usize) -> DVec3) -> f64 {
        let pressed = || self.holds.iter().filter(|hold| hold.answer.force != 0.0);
        let off: f64 = pressed().map(|hold| hold.weighted(&residual_of).abs()).sum();
        let all: f64 = pressed().map(|hold| hold.answer.force).sum();
        if all > 0.0 { off / all } else { 0.0 }
    }

    /// Whether others push than when this was last asked: then the equation is another one.
    pub fn have_changed(&mut self) -> bool {
        let mut changed = false;
        for hold in &mut self.holds {
            let pushes = hold.answer.force != 0.0;
            changed |= pushes != hold.pushed;
            hold.pushed = pushes;
        }
        changed
    }

    /// Whether contact number `index` is one of the equation that pushed in the last one too.
    pub(super) fn lasts(&self, index: usize) -> bool {
        self.holds.get(index).is_some_and(|hold| hold.lasts)
    }

    /// The contacts that push, with their numbers.
    pub(super) fn pressing(&self) -> impl Iterator<Item = (usize, &Hold)> {
        self.holds
            .iter()
            .enumerate()
            .filter(|(_, hold)| hold.answer.force > 0.0)
    }

    /// Whether one pushed at the end of the last equation.
    pub(super) fn have_pressed(&self) -> bool {
        !self.last.is_empty()
    }

    /// Whether a contact pushes.
    pub fn are_pressed(&self) -> bool {
        self.holds.iter().any(|hold| hold.answer.force != 0.0)
    }

    /// Shows each node what acts on it with these pushes, N.
    pub fn show_forces(&self, push_of: impl Fn(usize) -> DVec3, mut add: impl FnMut(usize, DVec3)) {
        for hold in &self.holds {
            let answer = hold.answer_to(&push_of);
            hold.share_out(&answer, answer.force, &mut add);
        }
        self.grips.show_forces(push_of, add);
    }

    /// Shows each node the product of the contacts' stiffness with the vectors.
    pub fn show_products(&self, vector_of: impl Fn(usize) -> DVec3, mut add: impl FnMut(usize, DVec3)) {
        for hold in self.holds.iter().filter(|hold| hold.answer.force != 0.0) {
            let products = hold.products(&vector_of);
            for (&node, product) in hold.nodes.iter().zip(products).take(hold.count) {
                add(node as usize, hold.answer.meets.normal * product);
            }
        }
        self.grips.show_products(vector_of, add);
    }

    /// Shows by how much the energy of each contact changes where the pushes grow by these vectors, J.
    pub fn show_changes(
        &self,
        push_of: impl Fn(usize) -> DVec3,
        vector_of: impl Fn(usize) -> DVec3,
        mut add: impl FnMut(f64),
    ) {
        for hold in &self.holds {
            let before = hold.answer_to(&push_of);
            let after = hold.answer_to(|node| push_of(node) + vector_of(node));
            // Where it pushes all along, nothing small is found as a difference of what is large.
            let growth = if before.force.min(after.force) > 0.0 {
                let ways = hold.corner_vectors(&vector_of);
                -hold.stiffness
                    * hold
                        .gauge
                        .opening(&before.meets, &after.meets, &ways[..hold.corner_count])
            } else {
                after.force - before.force
            };
            if growth != 0.0 {
                add(0.5 * growth * (before.force + after.force) / hold.stiffness);
            }
        }
        self.grips.show_changes(push_of, vector_of, add);
    }

    /// Shows each node that is pressed, with the diagonal block of its contacts' stiffness: xx, yy, zz, yz, zx, xy.
    pub fn show_blocks(&self, mut see: impl FnMut(usize, [f64; 6])) {
        for shares in self.shares.chunk_by(|a, b| a.node == b.node) {
            let mut block = [0.0; 6];
            for share in shares {
                let answer = &self.holds[share.hold as usize].answer;
                let n = answer.meets.normal;
                let more = n * answer.stiffness[share.place][share.place];
                let entries = [
                    more.x * n.x,
                    more.y * n.y,
                    more.z * n.z,
                    more.y * n.z,
                    more.z * n.x,
                    more.x * n.y,
                ];
                for (entry, more) in block.iter_mut().zip(entries) {
                    *entry += more;
                }
            }
            let [x, y, z] = self.grips.stiffness(shares[0].node).to_cols_array_2d();
            for (entry, more) in block.iter_mut().zip([x[0], y[1], z[2], y[2], z[0], x[1]]) {
                *entry += more;
            }
            if block[0] + block[1] + block[2] > 0.0 {
                see(shares[0].node as usize, block);
            }
        }
    }

    /// Adds what acts on these nodes with the nodes where they were last.
    pub fn add_forces(&self, nodes: &Range<usize>, to: &mut [&mut [f32]; 3]) {
        for share in self.shares_of(nodes) {
            let answer = &self.holds[share.hold as usize].answer;
            let force = answer.meets.normal * (answer.force * answer.shares[share.place]);
            add(to, share.node as usize - nodes.start, force.as_vec3());
        }
        self.grips.add_forces(nodes, to);
    }

    /// Adds the product of the contacts' stiffness with `vector_of` each node to those of these nodes: the product of both.
    pub fn add_products(
        &self,
        nodes: &Range<usize>,
        vector_of: impl Fn(usize) -> Vec3,
        to: &mut [&mut [f32]; 3],
    ) -> f64 {
        let mut sum = self.grips.add_products(nodes, &vector_of, to);
        for share in self.shares_of(nodes) {
            let hold = &self.holds[share.hold as usize];
            if hold.answer.force != 0.0 {
                let products = hold.products(|node| vector_of(node).as_dvec3());
                let product = (hold.answer.meets.normal * products[share.place]).as_vec3();
                add(to, share.node as usize - nodes.start, product);
                sum += f64::from(product.dot(vector_of(share.node as usize)));
            }
        }
        sum
    }

    /// What the contacts do on the nodes' ways, J: none does more than on the way of its tool, or what an equation that was not
    /// solved has them push would pass for energy put in.
    pub fn work(&self, way_of: impl Fn(usize) -> Vec3) -> f64 {
        let way_of = |node: usize| way_of(node).as_dvec3();
        let work = |hold: &Hold| {
            let beyond = (hold.answer.meets.gap - hold.least).max(0.0);
            hold.answer.force * (hold.weighted(way_of) - beyond)
        };
        let pressed = self.holds.iter().filter(|hold| hold.answer.force > 0.0);
        pressed.map(work).sum::<f64>() + self.grips.work(way_of)
    }

    /// How contact number `index` meets its tool with the nodes where they were last, what it does, N, and how far it is open, m.
    pub(super) fn found(&self, index: usize) -> (Meets, f64, f64) {
        let Hold { answer, least, .. } = &self.holds[index];
        (answer.meets, answer.force, answer.meets.gap - least)
    }

    /// What contact number `index` does to the tissue with its friction, N.
    pub(super) fn force(&self, index: usize) -> DVec3 {
        let Answer { meets, force, .. } = &self.holds[index].answer;
        meets.normal * *force + self.drag(index)
    }

    /// What friction of contact number `index` does: what that of its nodes does, as far as it presses them, N.
    pub(super) fn drag(&self, index: usize) -> DVec3 {
        let hold = &self.holds[index];
        let of_nodes = hold.grips.iter().zip(hold.answer.shares);
        let force = hold.answer.force.max(0.0);
        let drags =
            of_nodes.filter_map(|(grip, share)| grip.map(|place| self.grips.per_force(place) * (force * share)));
        drags.sum()
    }

    /// Whether friction of contact number `index` belongs to the equation.
    pub(super) fn drags(&self, index: usize) -> bool {
        self.holds[index].grips.iter().any(Option::is_some)
    }

    /// How much deeper than it may be contact number `index` is with its nodes at these positions, m; 0 where it does not push, or gives
    /// way.
    pub(super) fn lacks(&self, index: usize, position_of: impl Fn(usize) -> Vec3) -> f64 {
        let hold = &self.holds[index];
        if hold.answer.force <= 0.0 || hold.kept < 1.0 {
            return 0.0;
        }
        let corners = hold.corner_vectors(|node| position_of(node).as_dvec3());
        let meets = hold.gauge.meet(&corners[..hold.corner_count]);
        (hold.least - meets.gap).max(0.0)
    }

    /// Whether a feature is among the contacts with this tool of the step, and this tip of it.
    pub(super) fn know(&self, met: (usize, Feature, u8)) -> bool {
        self.order.binary_search(&met).is_ok()
    }

    fn shares_of(&self, nodes: &Range<usize>) -> &[Share] {
        let place = |node: usize| self.shares.partition_point(|share| (share.node as usize) < node);
        &self.shares[place(nodes.start)..place(nodes.end)]
    }
}

impl Push {
    fn key(&self) -> (usize, Feature, u8) {
        (self.slot, self.feature, self.tip)
    }
}
