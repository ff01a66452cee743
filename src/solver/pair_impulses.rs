//! Applies contact and attachment impulses of other tissue to an attempted step of a body.

use glam::{BVec3, Vec3};

use super::deferred_half_kick::flush_half_kick;
use super::{Changed, System};
use crate::base::{Profile, Result};
use crate::nodes::{Bindings, weighted_nodes};

/// The interval that impulses act in.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SubstepSpan<'a> {
    /// The length of the substep or step, s.
    pub duration: f32,
    /// True if positions change. False for the closing half kick of a step.
    pub drifts: bool,
    /// True at the beginning of a step.
    pub begins: bool,
    /// Collects the times of stages, if present.
    pub profile: Option<&'a Profile>,
}

impl SubstepSpan<'_> {
    /// True if a body takes part. Only VERLET has a closing half kick.
    pub fn concerns(&self, body: &System) -> bool {
        self.drifts || body.integrator.takes_half_kicks()
    }
}

impl System {
    /// True if it collides with other bodies or itself and has a surface.
    pub fn collides_with_tissue(&self) -> bool {
        (self.contact.with_bodies || self.contact.with_itself) && !self.surface.is_empty()
    }

    /// The surface in its own numbering.
    pub fn own_surface(&self) -> Result<Vec<[u32; 3]>> {
        self.order.own_triangles(&self.surface)
    }

    /// The number of nodes that can be added without allocation.
    pub fn spare_nodes(&self) -> usize {
        self.node_capacity.saturating_sub(self.node_count())
    }

    /// The nodes that move one of its own nodes, with weights: the node itself if it is not bound.
    pub fn movers(&self, own: u32) -> impl Iterator<Item = (u32, f32)> + use<> {
        weighted_nodes(self.bindings.as_ref(), own)
    }

    /// Adds the constrained part of an impulse (N s) to the node's pin. Returns the constrained axes, or `None` if the
    /// node cannot move.
    fn apply_to_pin(&mut self, node: usize, impulse: Vec3, span: &SubstepSpan) -> Option<BVec3> {
        let constrained = self.pins.axes_of(node as u32);
        if let Some(pin) = self.pins.get_mut(node as u32) {
            pin.force_sum -= pin.held(impulse).as_dvec3() / f64::from(span.duration);
        }
        (self.inverse_masses[node] > 0.0).then_some(constrained)
    }

    /// Sets the mean velocity of a node in a substep (m/s) after an `impulse`, N s. The constrained part of the
    /// impulse goes to the pin.
    pub fn set_mean_velocity(&mut self, node: usize, velocity: Vec3, impulse: Vec3, span: &SubstepSpan) {
        let Some(constrained) = self.apply_to_pin(node, impulse, span) else {
            return;
        };
        let state = self.state.substep();
        let old = state.velocities.get(node);
        let new = match self.integrator.solution_mut() {
            None => velocity,
            Some(solution) => {
                old + solution
                    .set_mean_velocity(node, Vec3::select(constrained, solution.mean_velocity(node), velocity))
            }
        };
        state.velocities.set(node, Vec3::select(constrained, old, new));
        if span.drifts {
            let prescribed = state.next_positions.get(node);
            let moved = state.positions.get(node) + velocity * span.duration;
            state
                .next_positions
                .set(node, Vec3::select(constrained, prescribed, moved));
        }
    }

    /// Reserves memory for forces on attached nodes.
    pub fn reserve_tissue_attachments(&mut self) -> Result<()> {
        if self.applied.is_none() {
            self.applied = Some(self.zeros()?);
        }
        Ok(())
    }

    /// Marks the body as attached in the step in progress.
    pub fn attach(&mut self) {
        if let Some(solution) = self.integrator.solution_mut() {
            solution.is_attached = true;
        }
    }

    /// Discards the history of the last step when the body becomes attached.
    pub fn begin_tissue_attachments(&mut self) {
        flush_half_kick(self);
        self.changed(Changed::Trajectory);
    }

    /// Discards the history of the last step when the body is no longer attached.
    pub fn end_tissue_attachments(&mut self) {
        if let Some(solution) = self.integrator.solution_mut() {
            solution.is_attached = false;
        }
        self.changed(Changed::Trajectory);
    }

    /// The nodes that move a node of the caller, in its own numbering, with weights: the node itself if it is not
    /// bound.
    pub fn weighted_nodes_of(&self, node: u32) -> impl Iterator<Item = (u32, f32)> {
        weighted_nodes(self.bindings.as_ref(), self.order.own(node))
    }

    /// The inverse mass of a node along each axis; 0 along constrained axes, 1/kg.
    pub fn inverse_mass_along_axes(&self, node: u32) -> Vec3 {
        let constrained = self.pins.axes_of(node);
        Vec3::select(constrained, Vec3::ZERO, Vec3::splat(self.inverse_masses[node as usize]))
    }

    /// The fraction of an impulse's velocity change that remains after damping. The impulse is thus that of the
    /// equivalent undamped force.
    pub fn damping_factor(&self, node: u32, span: &SubstepSpan) -> f32 {
        match (self.integrator.solution(), &self.damping) {
            (Some(_), Some(damping)) => 1.0 / (1.0 + damping.rates()[node as usize] * span.duration),
            // A kick of VERLET scales the force by (1 - exp(-x)) / x = 1 / (1 + x / 2) to first order in x.
            (None, Some(damping)) => 1.0 / (1.0 + 0.5 * damping.rates()[node as usize] * span.duration),
            _ => 1.0,
        }
    }

    /// The mean velocity of a node in a substep, m/s.
    pub fn mean_velocity(&mut self, node: usize) -> Vec3 {
        match self.integrator.solution() {
            None => self.state.substep().velocities.get(node),
            Some(solution) => solution.mean_velocity(node),
        }
    }

    /// Returns the bindings of its points, and a function from a node to its position at the start of a substep and its
    /// mean velocity, m/s.
    pub fn motion(&mut self) -> (Option<&Bindings>, impl Fn(usize) -> (Vec3, Vec3)) {
        let (state, solution) = (self.state.substep(), self.integrator.solution());
        let motion_of = move |node| {
            let mean = solution.map_or_else(|| state.velocities.get(node), |solution| solution.mean_velocity(node));
            (state.positions.get(node), mean)
        };
        (self.bindings.as_ref(), motion_of)
    }

    /// Replaces the applied force on a node, N.
    pub fn set_applied_force(&mut self, node: usize, force: Vec3) {
        if let Some(applied) = &mut self.applied {
            applied.set(node, force);
            self.forces_applied = true;
        }
    }

    /// Sets the mean velocity of an attached node in a substep (m/s) after a total `impulse`, N s. The constrained
    /// part of the impulse goes to the pin.
    pub fn set_attached_velocity(&mut self, node: usize, velocity: Vec3, impulse: Vec3, span: &SubstepSpan) {
        let Some(constrained) = self.apply_to_pin(node, impulse, span) else {
            return;
        };
        let change = Vec3::select(constrained, Vec3::ZERO, velocity - self.mean_velocity(node));
        if change == Vec3::ZERO {
            return;
        }
        if let Some(solution) = self.integrator.solution_mut() {
            solution.add_mean_velocity(node, change, span.duration);
        }
        let state = self.state.substep();
        state.velocities.set(node, state.velocities.get(node) + change);
        if span.drifts {
            let displacement = change * span.duration;
            state
                .next_positions
                .set(node, state.next_positions.get(node) + displacement);
        }
    }

    /// Reserves memory for the history of contacts with other tissue.
    pub fn reserve_contact_history(&mut self) -> Result<()> {
        if self.integrator.solution().is_none() {
            return self.reserve_pre_kick_velocities();
        }
        let none = [self.zeros()?, self.zeros()?];
        if let Some(solution) = self.integrator.solution_mut() {
            solution.enable_contact_forces(none);
        }
        Ok(())
    }

    /// Removes the velocity changes of the predicted contact forces from an implicit body, before contacts are solved.
    pub fn release_pressed(&mut self, duration: f32) {
        let Some(solution) = self.integrator.solution_mut() else {
            return;
        };
        let state = self.state.substep();
        let rates = self.damping.as_ref().map(|damping| damping.rates());
        solution.remove_contact_forces(&self.inverse_masses, rates, |node, change| {
            state.velocities.set(node, state.velocities.get(node) - change);
            let position = state.next_positions.get(node) - change * duration;
            state.next_positions.set(node, position);
        });
    }

    /// Passes a contact impulse on a node to the next equation of an implicit body, N s.
    pub fn record_contact_impulse(&mut self, node: u32, impulse: Vec3) {
        let free = self.inverse_mass_along_axes(node).cmpgt(Vec3::ZERO);
        if let Some(solution) = self.integrator.solution_mut() {
            let impulse = Vec3::select(free, impulse, Vec3::ZERO);
            let rates = self.damping.as_ref().map(|damping| damping.rates());
            solution.add_contact_impulse(node as usize, impulse, rates);
        }
    }

    /// Displaces a node at the end of a substep without changing its velocity.
    pub fn displace_node(&mut self, node: usize, displacement: Vec3) {
        let next_positions = self.state.substep().next_positions;
        let position = next_positions.get(node) + displacement;
        next_positions.set(node, position);
        if let Some(solution) = self.integrator.solution_mut() {
            solution.invalidate_energy();
        }
    }
}
