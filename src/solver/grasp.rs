//! What tools hold of a body: nodes that a tool leads as if they were part of it, and what that takes. A point of the surface is
//! held by the corners of its triangle, and a corner that is bound to nodes by those.
//!
//! A node that is held is a pin, so every solver holds it exactly. What holds it is all that acts on the tool in return: what
//! pins tell, and what it takes to move the node's own mass, and to move it against what damps it.

use std::fmt::Display;

use glam::{DVec3, Vec3};

use super::closing::close;
use super::{Changed, System};
use crate::base::{Error, Result, SlotId, StateHasher, ensure, memory};
use crate::codec::saved;
use crate::contact::{Frame, ToolPath};
use crate::nodes::{Pin, Pins};
use crate::soa::Vectors;

/// A part of a body that a tool holds: a node, or the corners of a triangle about a point on it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Grasp {
    /// Its name among the world's attachments.
    pub id: SlotId,
    /// The holder's place among the world's tools.
    tool: usize,
    nodes: [u32; MOST],
    /// Its part in what holds each node, beside those of other grasps; 0 for nodes that it does not hold.
    weights: [f32; MOST],
    /// The mean force over a step with which the tool just holds it, N.
    limit: f32,
    /// What the tool did to the tissue, mean over the last step, N.
    pub force: Vec3,
}

saved! { Grasp { id, tool, nodes, weights, limit, force } }

/// So many nodes a grasp holds at most: the corners of a triangle are bound to nodes of one cell.
const MOST: usize = 4;

/// A node that a tool holds.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HeldNode {
    node: u32,
    /// The holder's place among the world's tools.
    pub tool: usize,
    /// The sum of the weights of the grasps that hold it, in parts: exact, whatever comes and goes.
    parts: u64,
    /// Where it is in the tool's own axes, from its position, m; `None`: where it is when the next step begins.
    offset: Option<DVec3>,
    /// What the tool did to it, mean over the last step: N, and N m about the tool's position.
    pub force: Vec3,
    pub torque: Vec3,
    /// How much faster it was led in the last step than before it, m/s.
    gain: Vec3,
    course: HeldMotion,
}

saved! { HeldNode { node, tool, parts, offset, force, torque, gain, course } }

/// Weights are added up in so many parts of 1.
const PARTS: f64 = (1_u64 << 40) as f64;

/// A weight above 0 in parts, at least one.
fn parts(weight: f32) -> u64 {
    ((f64::from(weight) * PARTS) as u64).max(1)
}

/// What is to be held: corners, of which one may have a weight of 0 and then is left free.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Grip {
    pub corners: [u32; 3],
    pub weights: [f32; 3],
}

/// The step in progress of a held node.
#[derive(Clone, Copy, Debug, Default)]
struct HeldMotion {
    offset: DVec3,
    /// How far the node is from where the tool has it when the step begins, m; nothing, but for a body that was put back.
    gap: DVec3,
    /// The velocity of the node and what that gained in the last substep, m/s.
    velocity: Vec3,
    gain: Vec3,
    /// What is known already of what holds the pin.
    pin_sum: DVec3,
    /// Sums over substeps, N and N m.
    force_sum: DVec3,
    torque_sum: DVec3,
}

saved! { HeldMotion { offset, gap, velocity, gain, pin_sum, force_sum, torque_sum } }

/// What a substep made of forces.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lapse {
    /// How long they acted, s, and what part of the last gain went on without them.
    pub time: f64,
    pub carried: f64,
    /// The fraction of the step at which they acted.
    pub at: f64,
    /// What part of a substep nodes moved.
    pub moved: f64,
    /// Whether they acted with the nodes where they are next.
    pub is_next: bool,
}

/// All that tools hold of a body.
#[derive(Debug, Default)]
pub(crate) struct Grasps {
    /// In the order of their names.
    grasps: Vec<Grasp>,
    /// In their order.
    nodes: Vec<HeldNode>,
}

saved! { Grasps { grasps, nodes } }

impl Grip {
    /// A node by itself.
    pub fn of_node(node: u32) -> Self {
        Self {
            corners: [node; 3],
            weights: [1.0, 0.0, 0.0],
        }
    }

    /// The corners that are held, with their weights.
    fn held(self) -> impl Iterator<Item = (u32, f32)> {
        let corners = self.corners.into_iter().zip(self.weights);
        corners.filter(|(_, weight)| *weight > 0.0)
    }
}

impl Grasps {
    /// The grasps of this name.
    pub fn get(&self, id: SlotId) -> Option<&Grasp> {
        let place = self.grasps.binary_search_by_key(&id, |grasp| grasp.id);
        place.ok().map(|place| &self.grasps[place])
    }

    /// Whether what is to be told of them is finite.
    pub fn sums_fit(&self, fits: impl Fn(DVec3) -> bool) -> bool {
        let fit = |course: &HeldMotion| fits(course.force_sum) && fits(course.torque_sum);
        self.nodes.iter().all(|held| fit(&held.course))
    }

    pub fn hash(&self, hasher: &mut StateHasher) {
        for held in &self.nodes {
            hasher.write_u64(u64::from(held.node) << 32 | held.tool as u64);
            hasher.write_u64(u64::from(held.offset.is_some()));
            hasher.write_doubles(&held.offset.unwrap_or_default().to_array());
            hasher.write_floats(&held.gain.to_array());
        }
        for grasp in &self.grasps {
            grasp.nodes.iter().for_each(|&node| hasher.write_u64(node.into()));
            hasher.write_floats(&grasp.weights);
            hasher.write_floats(&[grasp.limit]);
        }
    }

    fn place_of(&self, node: u32) -> std::result::Result<usize, usize> {
        self.nodes.binary_search_by_key(&node, |held| held.node)
    }

    /// The nodes that are held, in the body's own numbers, each with its holder's place among the world's tools.
    pub fn held_nodes(&self) -> impl Iterator<Item = (usize, usize)> {
        self.nodes.iter().map(|held| (held.node as usize, held.tool))
    }

    fn get_held(&self, node: u32) -> Option<&HeldNode> {
        self.place_of(node).ok().map(|place| &self.nodes[place])
    }

    /// What each grasp has of what holds its corners.
    fn share_forces(&mut self) {
        let Self { grasps, nodes } = self;
        for grasp in grasps {
            grasp.force = Vec3::ZERO;
            for (node, weight) in grasp.held() {
                if let Ok(place) = nodes.binary_search_by_key(&node, |held| held.node) {
                    let share = parts(weight) as f64 / nodes[place].parts as f64;
                    grasp.force += nodes[place].force * share as f32;
                }
            }
        }
    }
}

impl Grasp {
    /// The nodes that are held, with their weights.
    fn held(&self) -> impl Iterator<Item = (u32, f32)> + use<> {
        let nodes = self.nodes.into_iter().zip(self.weights);
        nodes.filter(|(_, weight)| *weight > 0.0)
    }
}

impl HeldNode {
    /// Where a tool with these axes after this fraction of the step has it, in the body's coordinates.
    fn place(&self, frame: &Frame, fraction: f64) -> DVec3 {
        frame.carried(self.course.offset) + self.course.gap * (1.0 - fraction)
    }
}

/// The axes of tools at one or two instants of a step, worked out once where one tool holds many nodes.
struct Frames<'a, const N: usize> {
    tools: &'a [ToolPath],
    fractions: [f64; N],
    origin: DVec3,
    last: Option<(usize, [Frame; N])>,
}

impl<'a, const N: usize> Frames<'a, N> {
    fn new(tools: &'a [ToolPath], fractions: [f64; N], origin: DVec3) -> Self {
        Self {
            tools,
            fractions,
            origin,
            last: None,
        }
    }

    /// Those of the tool in this place.
    fn of(&mut self, slot: usize) -> Option<[Frame; N]> {
        match self.last {
            Some((last, frames)) if last == slot => Some(frames),
            _ => {
                let index = self.tools.binary_search_by_key(&slot, |path| path.slot).ok()?;
                let frame = |fraction| self.tools[index].frame_at(fraction, self.origin);
                let frames = self.fractions.map(frame);
                self.last = Some((slot, frames));
                Some(frames)
            }
        }
    }
}

impl System {
    /// The nodes that tools hold.
    pub(crate) fn held_nodes(&self) -> impl Iterator<Item = &HeldNode> {
        self.grasps.iter().flat_map(|grasps| &grasps.nodes)
    }

    /// What holds the nodes of the tool in this place in a step of so many substeps that was tried: mean force and torque, N and N m.
    pub(crate) fn pull_of(&self, tool: usize, substeps: u32) -> [DVec3; 2] {
        let held = self.held_nodes().filter(|held| held.tool == tool);
        let sums = held.map(|held| [held.course.force_sum, held.course.torque_sum]);
        let sum = sums.fold([DVec3::ZERO; 2], |all, one| [all[0] + one[0], all[1] + one[1]]);
        sum.map(|sum| sum / f64::from(substeps))
    }

    /// Whether the tool at this place holds anything of it.
    pub(crate) fn is_held_by(&self, tool: usize) -> bool {
        self.held_nodes().any(|held| held.tool == tool)
    }

    /// Whether a tool holds anything of it.
    pub(crate) fn is_grasped(&self) -> bool {
        self.held_nodes().next().is_some()
    }

    /// Whether the tool in this place can hold a node, which is there.
    pub(crate) fn check_graspable(&self, name: &dyn Display, node: u32, tool: usize) -> Result<()> {
        let own = self.order.own(node);
        match self.bindings.as_ref().and_then(|bindings| bindings.get(own)) {
            Some(bound) => bound.parts().try_for_each(|(node, _)| {
                let name = format_args!("{name} is bound to a node that");
                self.check_node_graspable(&name, node, tool)
            }),
            None => self.check_node_graspable(name, own, tool),
        }
    }

    fn check_node_graspable(&self, name: &dyn Display, own: u32, tool: usize) -> Result<()> {
        let node = self.order.caller(own);
        match self.grasps.as_ref().and_then(|grasps| grasps.get_held(own)) {
            Some(held) if held.tool == tool => Ok(()),
            Some(_) => Err(Error::invalid(format!("{name} is {node}: another tool holds it"))),
            None if self.pins.get(own).is_some() => Err(Error::invalid(format!(
                "{name} is {node}: it is pinned, and stays where its pin leads it"
            ))),
            None => Ok(()),
        }
    }

    /// Refuses a node that a tool holds.
    pub(crate) fn check_not_held(&self, name: &dyn Display, node: u32) -> Result<()> {
        ensure!(
            !self.is_held_by_tool(self.order.own(node)),
            "{name} is {node}: a tool holds it"
        );
        Ok(())
    }

    /// Whether a tool holds one of its own nodes.
    pub(crate) fn is_held_by_tool(&self, own: u32) -> bool {
        self.grasps.as_ref().is_some_and(|grasps| grasps.place_of(own).is_ok())
    }

    /// Makes room for so many grasps more.
    pub(crate) fn reserve_grasps(&mut self, count: usize) -> Result<()> {
        let nodes = count.saturating_mul(MOST).min(self.masses.len());
        self.pins.reserve(nodes, self.masses.len())?;
        if let Some(contacts) = &mut self.contacts {
            contacts.reserve_held(nodes)?;
        }
        if let Some(grasps) = &mut self.grasps {
            grasps.grasps.try_reserve(count)?;
            grasps.nodes.try_reserve(nodes)?;
            return Ok(());
        }
        let grasps = Grasps {
            grasps: memory::reserved(count)?,
            nodes: memory::reserved(nodes)?,
        };
        self.grasps = Some(memory::boxed(grasps)?);
        Ok(())
    }

    /// Keeps nothing for grasps where there are none.
    pub(crate) fn drop_room_for_grasps(&mut self) {
        self.grasps.take_if(|grasps| grasps.grasps.is_empty());
    }

    /// Has the tool in this place hold these, for which there is room and whose nodes can be held, under these names.
    pub(crate) fn grasp(
        &mut self,
        tool: usize,
        grips: impl ExactSizeIterator<Item = (SlotId, Grip)>,
        limit: f32,
    ) -> Result<()> {
        let mut more = memory::reserved(grips.len())?;
        let mut nodes = memory::reserved(MOST * grips.len())?;
        for (id, grip) in grips {
            let (held, weights) = self.supports(grip);
            let grasp = Grasp {
                id,
                tool,
                nodes: held,
                weights,
                limit: if limit > 0.0 { limit } else { f32::INFINITY },
                force: Vec3::ZERO,
            };
            nodes.extend(grasp.held().map(|(node, _)| node));
            more.push(grasp);
        }
        let Some(grasps) = &mut self.grasps else {
            return Ok(());
        };
        more.sort_unstable_by_key(|grasp| grasp.id);
        memory::sort_once(&mut nodes);
        nodes.retain(|&node| grasps.place_of(node).is_err());
        let mut held = memory::reserved(nodes.len())?;
        let untouched = memory::collected(nodes.iter().map(|&node| (node, tool)))?;
        let pins = Pins::of(&nodes)?;
        // From here on nothing fails.
        close(self);
        // Damping is to be that of masses as they are.
        self.scale_masses(0.0);
        self.pins.hold_all(&pins);
        for &node in &nodes {
            let gain = self
                .integrator
                .solution()
                .map(|solution| solution.gain_of(node as usize));
            held.push(HeldNode {
                node,
                tool,
                parts: 0,
                offset: None,
                force: Vec3::ZERO,
                torque: Vec3::ZERO,
                gain: gain.unwrap_or_default(),
                course: HeldMotion::default(),
            });
            self.inverse_masses[node as usize] = 0.0;
            if let Some(applied) = &mut self.applied {
                applied.set(node as usize, Vec3::ZERO);
            }
        }
        if let Some(contacts) = &mut self.contacts {
            contacts.hold(&untouched);
        }
        if let Some(grasps) = &mut self.grasps {
            memory::merge(&mut grasps.nodes, &held, |held| held.node);
            for (node, weight) in more.iter().flat_map(Grasp::held) {
                if let Ok(place) = grasps.place_of(node) {
                    grasps.nodes[place].parts += parts(weight);
                }
            }
            memory::merge(&mut grasps.grasps, &more, |grasp| grasp.id);
        }
        self.forget_held();
        Ok(())
    }

    /// The nodes, in the body's own numbers, that hold what a grip holds, with their parts in it.
    fn supports(&self, grip: Grip) -> ([u32; MOST], [f32; MOST]) {
        let own = |corner: u32| self.order.own(corner);
        let Some(bindings) = &self.bindings else {
            let [a, b, c] = grip.corners.map(own);
            let [of_a, of_b, of_c] = grip.weights;
            return ([a, b, c, a], [of_a, of_b, of_c, 0.0]);
        };
        let (mut nodes, mut weights) = ([own(grip.corners[0]); MOST], [0.0; MOST]);
        let mut count = 0;
        for (corner, weight) in grip.held() {
            for (node, part) in bindings.parts(own(corner)) {
                let known = nodes[..count].iter().position(|&known| known == node);
                let place = known.unwrap_or(count.min(MOST - 1));
                count = count.max(place + 1);
                nodes[place] = node;
                weights[place] += weight * part;
            }
        }
        (nodes, weights)
    }

    /// Ends a grasp.
    pub(crate) fn let_go(&mut self, id: SlotId) {
        self.let_go_where(|grasp| grasp.id == id, |_| ());
        self.drop_room_for_grasps();
    }

    /// Ends all grasps of the tool in this place.
    pub(crate) fn let_go_of(&mut self, tool: usize) {
        self.let_go_where(|grasp| grasp.tool == tool, |_| ());
        self.drop_room_for_grasps();
    }

    /// Ends the grasps whose limit the last step went beyond, and shows them. Needs no memory.
    pub(crate) fn slip(&mut self, see: impl FnMut(SlotId)) {
        self.let_go_where(|grasp| grasp.force.length() > grasp.limit, see);
    }

    fn let_go_where(&mut self, ends: impl Fn(&Grasp) -> bool, mut see: impl FnMut(SlotId)) {
        if !self.grasps.iter().flat_map(|grasps| &grasps.grasps).any(&ends) {
            return;
        }
        close(self);
        let Some(grasps) = &mut self.grasps else {
            return;
        };
        let (pins, contacts) = (&mut self.pins, &mut self.contacts);
        let (masses, inverse_masses) = (&self.masses, &mut self.inverse_masses);
        let Grasps { grasps, nodes } = &mut **grasps;
        grasps.retain(|grasp| {
            let stays = !ends(grasp);
            if !stays {
                for (node, weight) in grasp.held() {
                    if let Ok(place) = nodes.binary_search_by_key(&node, |held| held.node) {
                        nodes[place].parts -= parts(weight);
                    }
                }
                see(grasp.id);
            }
            stays
        });
        let is_let_go = |node: u32| {
            let place = nodes.binary_search_by_key(&node, |held| held.node);
            place.is_ok_and(|place| nodes[place].parts == 0)
        };
        pins.retain(|node| !is_let_go(node));
        if let Some(contacts) = contacts {
            contacts.retain_held(|node| !is_let_go(node));
        }
        nodes.retain(|held| {
            let stays = held.parts > 0;
            if !stays {
                inverse_masses[held.node as usize] = 1.0 / masses[held.node as usize];
            }
            stays
        });
        self.forget_held();
    }

    /// Other nodes are held now.
    fn forget_held(&mut self) {
        self.scale_masses(self.carry.masses_for);
        self.changed(Changed::Masses);
    }

    /// Nodes were put elsewhere: tools hold them there.
    pub(crate) fn grasp_anew(&mut self) {
        for held in self.grasps.iter_mut().flat_map(|grasps| &mut grasps.nodes) {
            held.offset = None;
        }
    }

    /// Begins a step over, from what is current.
    pub(crate) fn begin_grasps(&mut self, tools: &[ToolPath]) {
        let state = &self.state;
        let mut frames = Frames::new(tools, [0.0], self.origin);
        for held in self.grasps.iter_mut().flat_map(|grasps| &mut grasps.nodes) {
            let Some([frame]) = frames.of(held.tool) else {
                continue;
            };
            let node = held.node as usize;
            let position = state.positions().get(node).as_dvec3();
            let offset = held.offset.unwrap_or_else(|| frame.offset(position));
            held.course = HeldMotion {
                offset,
                gap: position - frame.carried(offset),
                velocity: state.velocities().get(node),
                gain: held.gain,
                ..HeldMotion::default()
            };
        }
    }

    /// Has the tools lead what they hold between these fractions of the step: from point to point of the way of a tool that turns.
    pub(crate) fn lead_grasps(&mut self, tools: &[ToolPath], [start, end]: [f64; 2]) {
        let mut frames = Frames::new(tools, [start, end], self.origin);
        for held in self.grasps.iter().flat_map(|grasps| &grasps.nodes) {
            let (Some([first, last]), Some(pin)) = (frames.of(held.tool), self.pins.get_mut(held.node)) else {
                continue;
            };
            let there = held.place(&last, end);
            let travel = (there - held.place(&first, start)) / (end - start);
            pin.travel = travel.as_vec3();
            pin.goal = (there + travel * (1.0 - end)).as_vec3();
        }
    }

    /// Adds up what holds what tools hold, after a substep that is not current yet.
    pub(crate) fn feel_grasps(&mut self, tools: &[ToolPath], lapse: Lapse) {
        let rates = self.damping.as_ref().map(|damping| damping.rates());
        let state = self.state.substep();
        let positions = if lapse.is_next {
            state.next_positions
        } else {
            state.positions
        };
        let mut frames = Frames::new(tools, [lapse.at], self.origin);
        for held in self.grasps.iter_mut().flat_map(|grasps| &mut grasps.nodes) {
            let (Some([frame]), Some(pin)) = (frames.of(held.tool), self.pins.get(held.node)) else {
                continue;
            };
            let node = held.node as usize;
            let arm = positions.get(node).as_dvec3() - frame.centre;
            let mass = f64::from(self.masses[node]);
            let drag = rates.map_or(0.0, |rates| f64::from(rates[node])) * mass * lapse.moved;
            held.course.feel(pin, state.velocities, [mass, drag], &lapse, arm);
        }
    }

    /// Adds what other tissue did to held nodes in the last substep, after that was felt.
    pub(crate) fn feel_what_grasps_handed_on(&mut self, tools: &[ToolPath]) {
        let positions = self.state.newest().0;
        let mut frames = Frames::new(tools, [1.0], self.origin);
        for held in self.grasps.iter_mut().flat_map(|grasps| &mut grasps.nodes) {
            let (Some([frame]), Some(pin)) = (frames.of(held.tool), self.pins.get(held.node)) else {
                continue;
            };
            let force = pin.force_sum - held.course.pin_sum;
            let arm = positions.get(held.node as usize).as_dvec3() - frame.centre;
            held.course.force_sum += force;
            held.course.torque_sum += arm.cross(force);
            held.course.pin_sum = pin.force_sum;
        }
    }

    /// The step in progress, of so many substeps, is the current state.
    pub(crate) fn commit_grasps(&mut self, substeps: u32) {
        for held in self.grasps.iter_mut().flat_map(|grasps| &mut grasps.nodes) {
            let mean = |sum: DVec3| (sum / f64::from(substeps)).as_vec3();
            held.force = mean(held.course.force_sum);
            held.torque = mean(held.course.torque_sum);
            held.gain = held.course.gain;
            held.offset = Some(held.course.offset);
        }
        if let Some(grasps) = &mut self.grasps {
            grasps.share_forces();
        }
    }

    /// What is held is at rest, as its pins tell.
    pub(crate) fn rest_grasps(&mut self) {
        let pins = &self.pins;
        for held in self.grasps.iter_mut().flat_map(|grasps| &mut grasps.nodes) {
            held.force = pins.get(held.node).map_or(Vec3::ZERO, |pin| pin.force);
            held.gain = Vec3::ZERO;
        }
        if let Some(grasps) = &mut self.grasps {
            grasps.share_forces();
        }
    }
}

impl HeldMotion {
    /// Adds what held the node of this pin, with its mass, kg, and what damps it, N s/m, at the end of this arm, m.
    fn feel(&mut self, pin: &Pin, velocities: &Vectors, [mass, drag]: [f64; 2], lapse: &Lapse, arm: DVec3) {
        let velocity = velocities.get(pin.node as usize);
        let gain = velocity - self.velocity;
        let without_force = self.gain.as_dvec3() * lapse.carried;
        let mut force = pin.force_sum - self.pin_sum;
        force += (gain.as_dvec3() - without_force) * (mass / lapse.time) + velocity.as_dvec3() * drag;
        self.force_sum += force;
        self.torque_sum += arm.cross(force);
        self.pin_sum = pin.force_sum;
        self.velocity = velocity;
        self.gain = gain;
    }
}
