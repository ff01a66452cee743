//! Contact of an implicit body with tools. Predicted contacts are part of the equation; nodes that would still enter a
//! tool are stopped afterwards.
//!
//! Springs do not react to an unpredicted contact before the next step. Therefore steps near tools are short, or are
//! repeated if much was not predicted.

use glam::Vec3;

use super::energy::EnergyBefore;
use super::step::Substep;
use super::subdivision::contact_substeps;
use super::{Implicit, SubstepOutcome};
use crate::base::{Stage, Stopwatch};
use crate::contact::{ContactInput, Contacts};
use crate::geometry::Aabb;
use crate::nodes::Mobility;
use crate::soa::{Vectors, tile_count, tile_nodes};
use crate::solver::System;
use crate::solver::kick::tile_stats;
use crate::solver::step_request::StepRequest;

/// Longest step near a tool, s.
pub(super) const MAX_CONTACT_STEP: f64 = 1e-3;

/// Shorter substeps are not divided further because contact has added energy, s.
const MIN_CONTACT_STEP: f64 = MAX_CONTACT_STEP / 16.0;

/// Budget below which short substeps would have too few products each to be solved.
const SMALL_BUDGET: u32 = 256;

/// Fixed cost of a substep, in products.
pub(super) const SUBSTEP_OVERHEAD: u32 = 10;

/// True if a step longer than `MAX_CONTACT_STEP` may be tried. Nodes that come near during it may end a few micrometers
/// inside. Thus a sufficient budget is used for short substeps, unless the caller allows less work than those take.
pub(super) fn may_be_long(body: &System, implicit: &Implicit, request: &StepRequest) -> bool {
    let is_alone = request.dynamic.is_empty() && request.neighbor_speed.is_none() && body.bindings.is_none();
    let is_bounded = || implicit.newton.is_none() && implicit.is_bounded();
    let too_little_work = SUBSTEP_OVERHEAD.saturating_mul(contact_substeps(request.dt));
    let is_short_of_work = implicit.has_small_budget() || is_bounded() && implicit.work_limit < too_little_work;
    is_short_of_work && !implicit.solution.is_attached && is_alone && body.contacts.is_some()
}

/// Largest gap of a contact in the equation, as a fraction of the body's extent.
const SLACK: f32 = 0.002;

/// `SLACK` for a long step. Unpredicted nodes are stopped along straight paths and may end slightly inside.
const LONG_SLACK: f32 = 0.01;

/// True if a tool was near at the last query.
pub(super) fn is_near(body: &System) -> bool {
    body.contacts
        .as_ref()
        .is_some_and(|contacts| !contacts.is_clear_of_tools())
}

impl Substep<'_> {
    /// Finds the contacts for the equation. Contact forces begin and end within a step, so a step with contacts uses
    /// first order. Returns `None` if the contacts moved too far for a long step.
    pub(super) fn with_predicted_contacts(&self, body: &mut System, implicit: &mut Implicit) -> Option<Self> {
        if !is_near(body) || self.is_long() && !may_be_long(body, implicit, self.request) {
            if let Some(contacts) = &mut body.contacts {
                contacts.multipliers.clear();
            }
            return Some(*self);
        }
        let Some(mean_velocities) = &mut implicit.mean_velocities else {
            return Some(*self);
        };
        let state = body.state.substep();
        let velocities = if self.is_first {
            state.first_velocities
        } else {
            &*state.velocities
        };
        mean_velocities.copy_from(velocities);
        let carried = self.carried() as f32;
        if carried != 0.0 && self.is_long() {
            // Velocities equivalent to the displacements of the second-order formula without forces.
            let history = implicit.solution.last(self.is_first);
            let [fraction, rate] = [self.time() / self.step, 1.0 / self.step].map(|factor| factor as f32);
            let history_axes = history
                .displacements
                .axes()
                .into_iter()
                .zip(history.velocity_changes.axes());
            for (mean_velocities, (displacements, velocity_changes)) in
                mean_velocities.axes_mut().into_iter().zip(history_axes)
            {
                for (mean, (displacement, change)) in mean_velocities
                    .iter_mut()
                    .zip(displacements.iter().zip(velocity_changes))
                {
                    *mean = carried * rate * displacement + fraction * (*mean + carried * change);
                }
            }
        }
        for pin in body.pins.iter() {
            pin.set_held(mean_velocities, pin.travel / self.request.dt);
        }
        let per_mass = 1.0 / (self.step * self.step);
        let is_long = self.is_long();
        let mut are_predicted = true;
        self.with_contacts(body, mean_velocities, |contacts, contact_input, stiffness_of| {
            let inverse_masses = contact_input.mobility.inverse_masses;
            are_predicted = contacts.predict_contacts(contact_input, is_long, |node| {
                if inverse_masses[node] == 0.0 {
                    return f32::INFINITY;
                }
                stiffness_of(node, per_mass)
            });
        });
        // The impulse of a dynamic tool does not persist, either.
        let needs_first_order = |contacts: &Contacts| !contacts.multipliers.is_empty() || contacts.has_dynamic();
        if self.is_long() {
            return (are_predicted || self.is_forced).then_some(*self);
        }
        if body.contacts.as_deref().is_some_and(needs_first_order) {
            Some(self.first_order())
        } else {
            Some(*self)
        }
    }

    /// True if the equation of a long substep contained enough of the contact forces, so that tissue reacted to them
    /// throughout.
    fn is_predicted(&self, contacts: &Contacts, force_displacements: &Vectors, residuals: &Vectors) -> bool {
        /// Allowed impulse after the equation, and allowed error of contacts in it, relative to their contribution.
        const MAX_LATE_IMPULSE: f64 = 0.05;
        const MAX_CONTACT_ERROR: f64 = 0.2;
        let displacement = |node: usize| force_displacements.get(node).as_dvec3();
        let residual = |node: usize| residuals.get(node).as_dvec3();
        let [late_impulse, total] = contacts.excess_impulse(self.step);
        late_impulse <= MAX_LATE_IMPULSE * total
            && contacts.multipliers.multiplier_error(displacement) <= MAX_CONTACT_ERROR
            && contacts.multipliers.imbalance(residual) <= MAX_CONTACT_ERROR
    }

    /// True if the substep is longer than contacts may ignore.
    pub(super) fn is_long(&self) -> bool {
        self.step > MAX_CONTACT_STEP
    }

    /// True if contact forces balance the nodes to the requested accuracy. A long step also requires their multipliers
    /// to be accurate up to this fraction.
    pub(super) fn is_balanced(&self, body: &System, implicit: &Implicit, tolerance: f64) -> bool {
        let Some(contacts) = body
            .contacts
            .as_deref()
            .filter(|contacts| !contacts.multipliers.is_empty())
        else {
            return true;
        };
        let residual = |node: usize| implicit.residuals.get(node).as_dvec3();
        let displacement = |node: usize| implicit.force_displacements.get(node).as_dvec3();
        contacts.multipliers.imbalance(residual) <= f64::from(implicit.accuracy)
            && !(self.is_long() && contacts.multipliers.multiplier_error(displacement) > tolerance)
    }

    /// Computes bounds of the tool force errors for this squared error of the solution in the norm of the matrix, J.
    pub(super) fn bound_tool_forces(&self, body: &mut System, implicit: &Implicit, error_sq: f64) {
        let per_mass = (1.0 / (self.step * self.step)) as f32;
        let (forces, masses) = (&body.forces, &body.masses);
        let tool_attachments = body.tool_attachments.as_deref();
        let stiffness_held = |slot: usize| {
            let held = tool_attachments
                .into_iter()
                .flat_map(|tool_attachments| tool_attachments.attached_nodes());
            let held = held.filter(|(_, tool)| *tool == slot);
            held.map(|(node, _)| f64::from(forces.stiffness_at(node, masses[node] * per_mass)))
                .sum()
        };
        let displacement = |node: usize| implicit.force_displacements.get(node).as_dvec3();
        if let Some(contacts) = &mut body.contacts {
            contacts.bound_force_errors(self.request.tools, error_sq, displacement, stiffness_held);
        }
    }

    /// Adds the contact stiffness to the preconditioner's diagonal blocks. The coarse space does not contain it, so the
    /// nodes in contact are excluded from it.
    pub(super) fn add_contact_stiffness(&self, body: &System, implicit: &mut Implicit) {
        implicit.remove_contact_stiffness();
        let Some(contacts) = &body.contacts else {
            return;
        };
        contacts.multipliers.visit_blocks(|node, block| {
            if implicit.stiffened_nodes.len() < implicit.stiffened_nodes.capacity() {
                implicit
                    .stiffened_nodes
                    .push((node as u32, implicit.coarse.function_values(node)));
                implicit.coarse.set_function_values(node, [0.0; 4]);
                implicit
                    .blocks
                    .invert_one(node, implicit.inertia[node], block.map(|entry| entry as f32));
            }
        });
    }

    /// Calls `act` with the contacts of `body` for nodes with these velocities. `act` also receives the stiffness at a
    /// node with this inertia per mass, 1/s², in N/m.
    fn with_contacts(
        &self,
        body: &mut System,
        velocities: &mut Vectors,
        act: impl FnOnce(&mut Contacts, ContactInput, &dyn Fn(usize, f64) -> f32),
    ) {
        let profile = self.request.profile;
        let watch = Stopwatch::start(profile);
        let neighbor_speed = self.request.neighbor_speed;
        let slack_fraction = if self.is_long() { LONG_SLACK } else { SLACK };
        let slack = slack_fraction * body.extent() + self.step as f32 * neighbor_speed.unwrap_or(0.0);
        let Some(contacts) = &mut body.contacts else {
            return;
        };
        let node_count = velocities.len();
        let bounds = (0..tile_count(node_count))
            .map(|tile| tile_stats(body.kernel, velocities.slices(tile_nodes(tile, node_count)), None).velocities)
            .fold(Aabb::EMPTY, |bounds, other| bounds.and(&other));
        let state = body.state.substep();
        let contact_input = ContactInput {
            kernel: body.kernel,
            tools: self.request.tools,
            origin: body.origin,
            dt: self.request.dt,
            start: self.start,
            end: self.end,
            substep: self.step as f32,
            drifts: true,
            slack,
            neighbor_speed,
            thickness: contacts.thickness,
            fastest: bounds.magnitudes().length(),
            mobility: Mobility {
                inverse_masses: &body.inverse_masses,
                damping: None,
                substep: self.step as f32,
                half: false,
                asleep: None,
            },
            positions: state.positions,
            velocities,
            next_positions: state.next_positions,
            pins: &mut body.pins,
            bindings: body.bindings.as_ref(),
            profile,
        };
        let (forces, masses) = (&body.forces, &body.masses);
        act(contacts, contact_input, &|node, per_mass| {
            forces.stiffness_at(node, (f64::from(masses[node]) * per_mass) as f32)
        });
        watch.subtract_from(profile, Stage::Solver);
    }

    /// Stops nodes that would enter a tool. If the equation has foreseen no contact, the substep is refused if that adds
    /// energy, except as a last resort.
    pub(super) fn resolve_contacts(
        &self,
        body: &mut System,
        implicit: &mut Implicit,
        before: EnergyBefore,
        is_last_resort: bool,
    ) -> SubstepOutcome {
        let may_accept_long = may_be_long(body, implicit, self.request);
        let was_foreseen = body
            .contacts
            .as_ref()
            .is_some_and(|contacts| !contacts.multipliers.is_empty());
        let Some(mean_velocities) = &mut implicit.mean_velocities else {
            return SubstepOutcome::Accepted;
        };
        let (per_step, step) = ((1.0 / self.step) as f32, self.step as f32);
        scaled(&implicit.solution.next().displacements, per_step, mean_velocities);
        let may_drop_holds = self.is_forced && self.is_long();
        self.with_contacts(body, mean_velocities, |contacts, contact_input, _| {
            if may_drop_holds {
                contacts.discard_uncertain_contacts(&contact_input);
            }
            contacts.resolve(contact_input);
        });
        let Some(contacts) = &body.contacts else {
            return SubstepOutcome::Accepted;
        };
        if contacts.is_clear_of_tools() {
            return SubstepOutcome::Accepted;
        }
        let is_predicted =
            || may_accept_long && self.is_predicted(contacts, &implicit.force_displacements, &implicit.residuals);
        if self.is_long() && !self.is_forced && !is_predicted() {
            return SubstepOutcome::NearContact;
        }
        let history = implicit.solution.next_mut();
        let axes = body
            .state
            .substep()
            .velocities
            .axes_mut()
            .into_iter()
            .zip(history.displacements.axes_mut())
            .zip(mean_velocities.axes());
        for ((velocities, displacements), mean_velocities) in axes {
            for ((velocity, displacement), mean) in velocities.iter_mut().zip(displacements).zip(mean_velocities) {
                let velocity_change = mean - *displacement * per_step;
                if velocity_change != 0.0 {
                    *velocity += velocity_change;
                    *displacement = mean * step;
                }
            }
        }
        // A velocity change by a tool is not extrapolated, unless the tool also acted before: then the motion is
        // smooth.
        let is_smooth = self.is_long() && implicit.last_formula.carried != 0.0;
        let state = body.state.substep();
        contacts.visit_touched(is_smooth, |node, normal| {
            let along = |vector: Vec3| normal.map_or(vector, |normal| vector.project_onto_normalized(normal));
            let change = history.velocity_changes.get(node);
            history.velocity_changes.set(node, change - along(change));
            if is_smooth {
                // A stopped node moves with the tool; second order would make it rebound.
                let velocity = state.velocities.get(node);
                let correction = history.displacements.get(node) * per_step - velocity;
                state.velocities.set(node, velocity + along(correction));
            }
        });
        for pin in body.pins.partial() {
            pin.set_held(&mut history.velocity_changes, Vec3::ZERO);
        }
        // In a long substep the loads on moving tools are means of its ends, so that their work is not known.
        let (tools, dt) = (self.request.tools, self.request.dt);
        let is_work_known = !self.is_long() || contacts.fastest_touching(tools, dt) == 0.0;
        let is_work_known = is_work_known && !body.has_tool_attachments();
        if !is_work_known || was_foreseen {
            history.energy = None;
        } else if self.has_contact_gain(body, implicit, before) && !is_last_resort && self.step > MIN_CONTACT_STEP {
            return SubstepOutcome::EnergyGained;
        }
        if self.is_long()
            && let Some(contacts) = &mut body.contacts
        {
            contacts.average_loads(self.request.tools, self.step);
            contacts.add_errors_beyond_equation(self.step);
        }
        if body.state.next_is_finite() {
            SubstepOutcome::Accepted
        } else {
            SubstepOutcome::NotFinite
        }
    }
}

impl Implicit {
    /// True if the body takes long steps near tools with any work limit.
    fn has_small_budget(&self) -> bool {
        self.newton.is_none() && self.budget < SMALL_BUDGET
    }

    /// True if the caller allows less work than the definition.
    pub(super) fn is_bounded(&self) -> bool {
        self.work_limit < self.budget
    }

    /// Restores the preconditioner without contacts.
    pub(super) fn remove_contact_stiffness(&mut self) {
        while let Some((node, values)) = self.stiffened_nodes.pop() {
            let node = node as usize;
            self.coarse.set_function_values(node, values);
            self.blocks.invert_one(node, self.inertia[node], [0.0; 6]);
        }
    }
}

fn scaled(from: &Vectors, factor: f32, to: &mut Vectors) {
    for (to, from) in to.axes_mut().into_iter().zip(from.axes()) {
        for (to, from) in to.iter_mut().zip(from) {
            *to = from * factor;
        }
    }
}
