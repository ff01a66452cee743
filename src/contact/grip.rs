//! Friction within an equation that is solved: how the nodes that tools press are dragged along with the tools' surfaces.
//!
//! Node by node, since edges and faces that share nodes could not tell what each of them does. What friction may do at most goes by what
//! pressed the node when that was last asked (Tresca's law in place of Coulomb's, a fixed point; Kikuchi, Oden 1988, chapter 10): then there
//! is a convex function to minimise, which Coulomb's cone has not. An augmented Lagrangian, as [contacts](super::holds) are.

use std::ops::Range;

use glam::{DMat3, DVec3, Vec3};

use crate::base::{Result, StateHasher, memory, outer};
use crate::codec::saved;

/// A node sticks where friction does less than this part of what it may.
const STICKING: f64 = 0.99;

/// Friction of one tool at one node.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct NodeFriction {
    pub node: u32,
    /// The tool's place among those of the step, and in the world.
    pub tool: usize,
    pub slot: usize,
    pub friction: f64,
    /// Away from the tool, of unit length.
    pub normal: DVec3,
    /// How far the node slips along the surface without a push, m.
    pub slip: DVec3,
    /// N/m
    pub stiffness: f64,
    /// What part of its force becomes its multiplier.
    pub kept: f64,
    /// What it does where nothing slips, N, and what at most.
    pub multiplier: DVec3,
    pub most: f64,
    /// Whether it may do more: where nothing slipped before, the first solution takes it for one that holds on.
    pub holds_on: bool,
    /// What presses the node, N.
    pub pressed: f64,
    pub drag: Drag,
}

saved! { NodeFriction {
    node, tool, slot, friction, normal, slip, stiffness, kept, multiplier, most, holds_on, pressed, drag,
} }

/// What it does with the node where it was last.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Drag {
    /// On the tissue, N.
    force: DVec3,
    /// How it falls as the node slips, N/m.
    stiffness: DMat3,
    /// m
    slip: DVec3,
}

saved! { Drag { force, stiffness, slip } }

/// What friction did at the end of a step: the next begins with it.
#[derive(Clone, Copy, Debug)]
struct Dragged {
    /// The tool's place in the world.
    slot: usize,
    node: u32,
    /// N
    force: DVec3,
    /// Whether that was less than it may do.
    sticks: bool,
}

saved! { Dragged { slot, node, force, sticks } }

/// The friction of a body with all tools in the equation in progress.
#[derive(Debug, Default)]
pub(super) struct Grips {
    /// In the order of nodes and tools.
    grips: Vec<NodeFriction>,
    /// What it did before the equation in progress, and before the step; both in the order of tools and nodes.
    last: Vec<Dragged>,
    settled: Vec<Dragged>,
}

saved! { Grips { grips, last, settled } }

impl Grips {
    /// Makes room for so many.
    pub fn reserve(&mut self, count: usize) -> Result<()> {
        memory::reserve(&mut self.grips, count)?;
        memory::reserve(&mut self.last, count)?;
        memory::reserve(&mut self.settled, count)
    }

    pub fn begin_step(&mut self) {
        self.last.clone_from(&self.settled);
    }

    pub fn settle(&mut self) {
        self.settled.clone_from(&self.last);
    }

    pub fn forget(&mut self) {
        self.settled.clear();
    }

    pub fn forget_tool(&mut self, slot: usize) {
        for dragged in [&mut self.last, &mut self.settled] {
            dragged.retain(|dragged| dragged.slot != slot);
        }
    }

    pub fn hash(&self, hasher: &mut StateHasher) {
        for dragged in &self.settled {
            hasher.write_u64(dragged.slot as u64);
            hasher.write_u64(dragged.node.into());
            hasher.write_doubles(&dragged.force.to_array());
            hasher.write_u64(dragged.sticks.into());
        }
    }

    /// What friction does now is what the next equation begins with.
    pub fn remember(&mut self) {
        self.last.clear();
        let acting = self.grips.iter().filter(|grip| grip.drag.force != DVec3::ZERO);
        self.last.extend(acting.map(|grip| Dragged {
            slot: grip.slot,
            node: grip.node,
            force: grip.drag.force,
            sticks: grip.drag.force.length() < STICKING * grip.most,
        }));
        self.last.sort_unstable_by_key(Dragged::key);
    }

    pub fn clear(&mut self) {
        self.grips.clear();
    }

    /// Adds `part` of one with the normal and the slip of its contact to that of the same node and tool, which is new as long as there is
    /// room: `pressed` is the sum of the parts until [`Grips::begin`].
    pub fn add(&mut self, part: f64, grip: NodeFriction) {
        let place = self.grips.partition_point(|known| known.key() < grip.key());
        let is_known = self.grips.get(place).is_some_and(|known| known.key() == grip.key());
        if !is_known {
            if self.grips.len() == self.grips.capacity() {
                return;
            }
            let none = NodeFriction {
                normal: DVec3::ZERO,
                slip: DVec3::ZERO,
                ..grip
            };
            self.grips.insert(place, none);
        }
        let known = &mut self.grips[place];
        known.normal += grip.normal * part;
        known.slip += grip.slip * part;
        known.pressed += part;
        known.kept = known.kept.min(grip.kept);
    }

    /// Makes each the mean of what was added, and has it begin with what it did last.
    pub fn begin(&mut self) {
        for grip in &mut self.grips {
            grip.slip /= grip.pressed;
            grip.normal = grip.normal.normalize_or_zero();
            grip.pressed = 0.0;
            let key = (grip.slot, grip.node);
            if let Ok(place) = self.last.binary_search_by_key(&key, Dragged::key) {
                let last = self.last[place];
                grip.multiplier = grip.across(last.force) * grip.kept;
                grip.holds_on = last.sticks;
            }
        }
    }

    /// Where that of a node and a tool is.
    pub fn place(&self, node: u32, tool: usize) -> Option<usize> {
        self.grips.binary_search_by_key(&(node, tool), NodeFriction::key).ok()
    }

    /// Nothing presses any node.
    pub fn lift(&mut self) {
        self.grips.iter_mut().for_each(|grip| grip.pressed = 0.0);
    }

    /// Something presses the node of this one by so much more, N.
    pub fn press(&mut self, place: usize, force: f64) {
        self.grips[place].pressed += force;
    }

    /// From now on friction does at most what goes with what presses each node.
    pub fn limit(&mut self) {
        for grip in &mut self.grips {
            grip.most = grip.friction * grip.pressed;
        }
    }

    /// From now on none does more than it may.
    pub fn let_go(&mut self) {
        self.grips.iter_mut().for_each(|grip| grip.holds_on = false);
    }

    /// Finds out what each does with these pushes of the nodes, m.
    pub fn drag(&mut self, push_of: impl Fn(usize) -> DVec3) {
        for grip in &mut self.grips {
            grip.drag = grip.answer(push_of(grip.node as usize));
        }
    }

    /// How much more they would do with better multipliers and limits, N.
    pub fn missing(&self, push_of: impl Fn(usize) -> DVec3) -> f64 {
        let missing = |grip: &NodeFriction| {
            let better = grip.better().answer(push_of(grip.node as usize));
            (better.force - grip.drag.force).length()
        };
        self.grips.iter().map(missing).sum()
    }

    /// What they do becomes their multiplier, and what they may do follows from what presses the nodes: shows each node what is added there, N.
    pub fn improve(&mut self, push_of: impl Fn(usize) -> DVec3, mut add: impl FnMut(usize, DVec3)) {
        for grip in &mut self.grips {
            let before = grip.drag.force;
            *grip = grip.better();
            grip.drag = grip.answer(push_of(grip.node as usize));
            add(grip.node as usize, grip.drag.force - before);
        }
    }

    /// Shows each node what acts on it with these pushes, N.
    pub fn show_forces(&self, push_of: impl Fn(usize) -> DVec3, mut add: impl FnMut(usize, DVec3)) {
        for grip in &self.grips {
            let node = grip.node as usize;
            add(node, grip.answer(push_of(node)).force);
        }
    }

    /// Shows each node the product of their stiffness with the vectors.
    pub fn show_products(&self, vector_of: impl Fn(usize) -> DVec3, mut add: impl FnMut(usize, DVec3)) {
        for grip in &self.grips {
            let node = grip.node as usize;
            add(node, grip.drag.stiffness * vector_of(node));
        }
    }

    /// Shows by how much the energy of each changes where the pushes grow by these vectors, J.
    pub fn show_changes(
        &self,
        push_of: impl Fn(usize) -> DVec3,
        vector_of: impl Fn(usize) -> DVec3,
        mut add: impl FnMut(f64),
    ) {
        for grip in self.grips.iter().filter(|grip| grip.most > 0.0) {
            let (push, more) = (push_of(grip.node as usize), vector_of(grip.node as usize));
            add(grip.change(push, more));
        }
    }

    /// The force on the tissue of this one for each N that presses its node.
    pub fn per_force(&self, place: usize) -> DVec3 {
        let grip = &self.grips[place];
        if grip.pressed > 0.0 {
            grip.drag.force / grip.pressed
        } else {
            DVec3::ZERO
        }
    }

    /// Adds what acts on these nodes.
    pub fn add_forces(&self, nodes: &Range<usize>, to: &mut [&mut [f32]; 3]) {
        for grip in self.of(nodes) {
            add(to, grip.node as usize - nodes.start, grip.drag.force.as_vec3());
        }
    }

    /// Adds the product of their stiffness with `vector_of` each node to those of these nodes: the product of both.
    pub fn add_products(
        &self,
        nodes: &Range<usize>,
        vector_of: impl Fn(usize) -> Vec3,
        to: &mut [&mut [f32]; 3],
    ) -> f64 {
        let mut sum = 0.0;
        for grip in self.of(nodes) {
            let vector = vector_of(grip.node as usize);
            let product = (grip.drag.stiffness * vector.as_dvec3()).as_vec3();
            add(to, grip.node as usize - nodes.start, product);
            sum += f64::from(product.dot(vector));
        }
        sum
    }

    /// Their stiffness at a node.
    pub fn stiffness(&self, node: u32) -> DMat3 {
        let node = node as usize;
        let stiffnesses = self.of(&(node..node + 1)).iter().map(|grip| grip.drag.stiffness);
        stiffnesses.fold(DMat3::ZERO, |sum, stiffness| sum + stiffness)
    }

    /// What they do on the nodes' ways, J: none does more than on the way of its tool.
    pub fn work(&self, way_of: impl Fn(usize) -> DVec3) -> f64 {
        let work = |grip: &NodeFriction| {
            let Drag { force, slip, .. } = grip.drag;
            (way_of(grip.node as usize) - slip).dot(force) + slip.dot(force).min(0.0)
        };
        self.grips.iter().map(work).sum()
    }

    fn of(&self, nodes: &Range<usize>) -> &[NodeFriction] {
        let place = |node: usize| self.grips.partition_point(|grip| (grip.node as usize) < node);
        if self.grips.is_empty() {
            return &[];
        }
        &self.grips[place(nodes.start)..place(nodes.end)]
    }
}

impl Dragged {
    fn key(&self) -> (usize, u32) {
        (self.slot, self.node)
    }
}

impl NodeFriction {
    fn key(&self) -> (u32, usize) {
        (self.node, self.tool)
    }

    fn across(&self, vector: DVec3) -> DVec3 {
        vector - self.normal * vector.dot(self.normal)
    }

    fn better(&self) -> Self {
        Self {
            multiplier: self.drag.force * self.kept,
            most: self.friction * self.pressed,
            ..*self
        }
    }

    /// What it would do with so much slip if it could do any amount, N, and whether it can do that.
    fn wanted(&self, slip: DVec3) -> (DVec3, bool) {
        let wanted = self.multiplier - slip * self.stiffness;
        (wanted, self.holds_on || wanted.length() <= self.most)
    }

    /// By how much its energy changes where the node is pushed so far, m, and then by `more`, J: as a product with the way while it goes on sticking
    /// or slipping, so that nothing small is found as a difference of what is large.
    fn change(&self, push: DVec3, more: DVec3) -> f64 {
        let (slip, more) = (self.across(self.slip + push), self.across(more));
        let [(before, stuck), (after, sticks)] = [slip, slip + more].map(|slip| self.wanted(slip));
        let along = -more.dot(before + after);
        match (stuck, sticks) {
            (true, true) => 0.5 * along,
            (false, false) => self.most * along / (before.length() + after.length()),
            _ => {
                let energy = |wanted: DVec3, sticks: bool| {
                    let size = wanted.length();
                    let twice = if sticks {
                        size * size
                    } else {
                        self.most * (2.0 * size - self.most)
                    };
                    0.5 * twice / self.stiffness
                };
                energy(after, sticks) - energy(before, stuck)
            }
        }
    }

    /// With the node pushed so far, m.
    fn answer(&self, push: DVec3) -> Drag {
        let slip = self.across(self.slip + push);
        if self.most == 0.0 {
            return Drag {
                slip,
                ..Drag::default()
            };
        }
        let along = |direction: DVec3| outer(direction, direction);
        let (wanted, sticks) = self.wanted(slip);
        let across = DMat3::IDENTITY - along(self.normal);
        if sticks {
            return Drag {
                force: wanted,
                stiffness: across * self.stiffness,
                slip,
            };
        }
        let size = wanted.length();
        let part = self.most / size;
        Drag {
            force: wanted * part,
            stiffness: (across - along(wanted / size)) * (self.stiffness * part),
            slip,
        }
    }
}

pub(super) fn add(to: &mut [&mut [f32]; 3], place: usize, vector: Vec3) {
    for (axis, value) in to.iter_mut().zip(vector.to_array()) {
        axis[place] += value;
    }
}
