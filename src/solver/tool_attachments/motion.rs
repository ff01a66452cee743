//! The motion of nodes that are attached to tools during a step, and the reactions on the tools.

use glam::{DVec3, Vec3};

use super::{AttachedNode, ToolAttachments};
use crate::codec::saved;
use crate::contact::{ToolFrame, ToolPath};
use crate::nodes::Pin;
use crate::soa::Vectors;
use crate::solver::System;

/// The motion of an attached node in the step in progress.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct HeldMotion {
    offset: DVec3,
    /// The distance between the node and its position in the tool frame at the start of the step, m. It is zero unless
    /// the body was rolled back.
    gap: DVec3,
    /// The velocity of the node and its change in the last substep, m/s.
    velocity: Vec3,
    velocity_change: Vec3,
    /// The part of the pin's force sum that is already accounted for.
    pin_sum: DVec3,
    /// Sums over substeps (N, N m).
    pub force_sum: DVec3,
    pub torque_sum: DVec3,
}

saved! { HeldMotion { offset, gap, velocity, velocity_change, pin_sum, force_sum, torque_sum } }

/// The interval for which a substep computes reactions.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ReactionInterval {
    /// The time that the forces acted (s), and the fraction of the last velocity change that continues without them.
    pub time: f64,
    pub carried: f64,
    /// The time of the forces as a fraction of the step.
    pub at: f64,
    /// The fraction of a substep that the nodes moved.
    pub moved: f64,
    /// True if the forces act at the next positions.
    pub is_next: bool,
}

impl AttachedNode {
    /// The position of the node at a `fraction` of the step, in body coordinates. `frame` is the tool frame at that
    /// time.
    fn position_at(&self, frame: &ToolFrame, fraction: f64) -> DVec3 {
        frame.local_to_body(self.motion.offset) + self.motion.gap * (1.0 - fraction)
    }
}

/// Tool frames at `N` instants of a step. Consecutive nodes of one tool share them.
struct FrameCache<'a, const N: usize> {
    tools: &'a [ToolPath],
    fractions: [f64; N],
    origin: DVec3,
    last: Option<(usize, [ToolFrame; N])>,
}

impl<'a, const N: usize> FrameCache<'a, N> {
    fn new(tools: &'a [ToolPath], fractions: [f64; N], origin: DVec3) -> Self {
        Self {
            tools,
            fractions,
            origin,
            last: None,
        }
    }

    /// The frames of the tool with index `slot`.
    fn of(&mut self, slot: usize) -> Option<[ToolFrame; N]> {
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

/// The nodes of attachments.
fn attached_nodes(attachments: &mut Option<Box<ToolAttachments>>) -> impl Iterator<Item = &mut AttachedNode> {
    attachments.iter_mut().flat_map(|attachments| &mut attachments.nodes)
}

impl System {
    /// Keeps attached nodes attached at their new positions after positions were set.
    pub(crate) fn reattach_in_place(&mut self) {
        for attached in attached_nodes(&mut self.tool_attachments) {
            attached.offset = None;
        }
    }

    /// Starts a step from the current state.
    pub(crate) fn begin_attachments(&mut self, tools: &[ToolPath]) {
        let state = &self.state;
        let mut frames = FrameCache::new(tools, [0.0], self.origin);
        for attached in attached_nodes(&mut self.tool_attachments) {
            let Some([frame]) = frames.of(attached.tool) else {
                continue;
            };
            let node = attached.node as usize;
            let position = state.positions().get(node).as_dvec3();
            let offset = attached.offset.unwrap_or_else(|| frame.body_to_local(position));
            attached.motion = HeldMotion {
                offset,
                gap: position - frame.local_to_body(offset),
                velocity: state.velocities().get(node),
                velocity_change: attached.velocity_change,
                ..HeldMotion::default()
            };
        }
    }

    /// Moves the attached nodes with their tools between two fractions of the step. A tool that rotates moves them
    /// along chords of its path.
    pub(crate) fn drive_attachments(&mut self, tools: &[ToolPath], [start, end]: [f64; 2]) {
        let mut frames = FrameCache::new(tools, [start, end], self.origin);
        for attached in self
            .tool_attachments
            .iter()
            .flat_map(|tool_attachments| &tool_attachments.nodes)
        {
            let (Some([first, last]), Some(pin)) = (frames.of(attached.tool), self.pins.get_mut(attached.node)) else {
                continue;
            };
            let target = attached.position_at(&last, end);
            let travel = (target - attached.position_at(&first, start)) / (end - start);
            pin.travel = travel.as_vec3();
            pin.goal = (target + travel * (1.0 - end)).as_vec3();
        }
    }

    /// Accumulates the reactions of attached nodes after a substep that is not current yet.
    pub(crate) fn accumulate_reactions(&mut self, tools: &[ToolPath], interval: ReactionInterval) {
        let rates = self.damping.as_ref().map(|damping| damping.rates());
        let state = self.state.substep();
        let positions = if interval.is_next {
            state.next_positions
        } else {
            state.positions
        };
        let mut frames = FrameCache::new(tools, [interval.at], self.origin);
        for attached in attached_nodes(&mut self.tool_attachments) {
            let (Some([frame]), Some(pin)) = (frames.of(attached.tool), self.pins.get(attached.node)) else {
                continue;
            };
            let node = attached.node as usize;
            let arm = positions.get(node).as_dvec3() - frame.center;
            let mass = f64::from(self.masses[node]);
            let drag = rates.map_or(0.0, |rates| f64::from(rates[node])) * mass * interval.moved;
            attached
                .motion
                .add_reaction(pin, state.velocities, [mass, drag], &interval, arm);
        }
    }

    /// Adds pair-contact impulses on attached nodes to the tool's wrench, after the reactions of the last substep.
    pub(crate) fn accumulate_pair_reactions(&mut self, tools: &[ToolPath]) {
        let positions = self.state.newest().0;
        let mut frames = FrameCache::new(tools, [1.0], self.origin);
        for attached in attached_nodes(&mut self.tool_attachments) {
            let (Some([frame]), Some(pin)) = (frames.of(attached.tool), self.pins.get(attached.node)) else {
                continue;
            };
            let force = pin.force_sum - attached.motion.pin_sum;
            let arm = positions.get(attached.node as usize).as_dvec3() - frame.center;
            attached.motion.force_sum += force;
            attached.motion.torque_sum += arm.cross(force);
            attached.motion.pin_sum = pin.force_sum;
        }
    }

    /// Makes the step in progress the current state.
    pub(crate) fn commit_attachments(&mut self, substeps: u32) {
        for attached in attached_nodes(&mut self.tool_attachments) {
            let mean = |sum: DVec3| (sum / f64::from(substeps)).as_vec3();
            attached.force = mean(attached.motion.force_sum);
            attached.torque = mean(attached.motion.torque_sum);
            attached.velocity_change = attached.motion.velocity_change;
            attached.offset = Some(attached.motion.offset);
        }
        if let Some(tool_attachments) = &mut self.tool_attachments {
            tool_attachments.distribute_forces();
        }
    }

    /// Sets the forces of attached nodes at rest from the reactions of their pins.
    pub(crate) fn rest_attachments(&mut self) {
        let pins = &self.pins;
        for attached in attached_nodes(&mut self.tool_attachments) {
            attached.force = pins.get(attached.node).map_or(Vec3::ZERO, |pin| pin.force);
            attached.velocity_change = Vec3::ZERO;
        }
        if let Some(tool_attachments) = &mut self.tool_attachments {
            tool_attachments.distribute_forces();
        }
    }
}

impl HeldMotion {
    /// Adds the reaction of a pinned node with this mass (kg), drag (N s/m) and lever arm, m.
    fn add_reaction(
        &mut self,
        pin: &Pin,
        velocities: &Vectors,
        [mass, drag]: [f64; 2],
        interval: &ReactionInterval,
        arm: DVec3,
    ) {
        let velocity = velocities.get(pin.node as usize);
        let velocity_change = velocity - self.velocity;
        let without_force = self.velocity_change.as_dvec3() * interval.carried;
        let mut force = pin.force_sum - self.pin_sum;
        force += (velocity_change.as_dvec3() - without_force) * (mass / interval.time) + velocity.as_dvec3() * drag;
        self.force_sum += force;
        self.torque_sum += arm.cross(force);
        self.pin_sum = pin.force_sum;
        self.velocity = velocity;
        self.velocity_change = velocity_change;
    }
}
