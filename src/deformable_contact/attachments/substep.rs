//! Substeps of attachments.

use glam::{DVec3, Vec3};

use super::super::collision_surface::CollisionSurface;
use super::super::pair_contact::PairContact;
use super::{AttachmentCorner, AttachmentNode, CLOSING_SPEED, PointAttachment, PointAttachments};
use crate::solver::{SubstepSpan, System, Systems};

/// Time constant with which gaps close, s, and the maximum fraction of a gap that closes in a substep.
const CLOSING_TIME: f64 = 0.02;
const MAX_CLOSED_FRACTION: f64 = 0.2;

/// Tolerance of the correction, as a fraction of it, that ends the iterations before `POSITION_SWEEPS`.
const GAP_TOLERANCE: f64 = 0.2;

/// Minimum gap whose closing counts as work, as a fraction of the smaller body's extent.
const MIN_OPEN_GAP: f64 = 1e-4;

/// Maximum number of sweeps of the position correction.
const POSITION_SWEEPS: u32 = 8;

/// Longest substep with an implicit solver, s. It is independent of the load: the error of the position is proportional
/// to its square, so a change would cause a jolt.
const MAX_EQUATION_SUBSTEP: f64 = 0.25e-3;

/// Relative rounding error of a step of 1 ms in `f32`.
const STEP_ROUNDING: f64 = 1e-3;

/// Relative difference of velocities that counts as equal.
const VELOCITY_ROUNDING: f32 = 2e-7;

impl PointAttachments {
    /// Begins the step of a group of bodies, which may be attempted several times. It ends with
    /// [`Self::remove_predicted_forces`].
    pub fn begin_group(&mut self, bodies: &mut impl Systems, is_in_group: impl Fn(usize) -> bool) {
        for attached_node in &mut self.attached_nodes {
            attached_node.is_stepping = is_in_group(attached_node.body);
            if let Some(body) = bodies.at_mut(attached_node.body).filter(|_| attached_node.is_stepping) {
                body.attach();
                attached_node.has_external_force = body.forces_applied;
                attached_node.external_force = match &body.applied {
                    Some(applied) if body.forces_applied => applied.get(attached_node.node as usize),
                    _ => Vec3::ZERO,
                };
            }
        }
        for attachment in &mut self.attachments {
            let solution = |corner: AttachmentCorner| bodies.at(corner.body)?.integrator.solution();
            attachment.has_equation = attachment.used_corners().any(|corner| solution(corner).is_some());
            attachment.is_stepping = attachment.used_corners().all(|corner| is_in_group(corner.body));
        }
    }

    /// Begins an attempt of the step of `dt` seconds from the current state.
    pub fn begin_step(&mut self, dt: f32) {
        self.is_first_substep = true;
        for attachment in self.attachments.iter_mut().filter(|attachment| attachment.is_stepping) {
            attachment.substep_force = attachment.predicted_force;
            (attachment.total_impulse, attachment.work) = (DVec3::ZERO, 0.0);
            if let Some(thread) = &mut attachment.thread {
                thread.begin(dt);
            }
        }
    }

    /// Returns the minimum number of substeps of a step of `dt` seconds.
    pub fn min_substeps(&self, dt: f32) -> u32 {
        if self
            .attachments
            .iter()
            .any(|attachment| attachment.is_stepping && attachment.has_equation)
        {
            (f64::from(dt) / MAX_EQUATION_SUBSTEP - STEP_ROUNDING)
                .ceil()
                .clamp(1.0, f64::from(u32::MAX / 4)) as u32
        } else {
            1
        }
    }

    /// Returns the work of the group's attachments in the step, and the energy stored in threads at its end, J. Returns
    /// `None` if it is unknown because a thread shortens, follows a path or is softened.
    pub(in crate::deformable_contact) fn energy(&self) -> Option<[f64; 2]> {
        let mut sums = [0.0; 2];
        for attachment in self.attachments.iter().filter(|attachment| attachment.is_stepping) {
            let stored = attachment.thread.as_ref().map_or(Some(0.0), |thread| {
                let distance = attachment.offset(&self.attached_nodes).length();
                thread.is_elastic().then(|| thread.energy(distance))
            });
            sums = [sums[0] + attachment.work, sums[1] + stored?];
        }
        Some(sums)
    }

    /// Applies the predicted forces to the bodies.
    pub fn apply_predicted_forces(&mut self, bodies: &mut impl Systems) {
        self.attached_nodes
            .iter_mut()
            .for_each(|attached_node| attached_node.impulse = Vec3::ZERO);
        let Self {
            attachments,
            attached_nodes,
            ..
        } = self;
        for attachment in attachments
            .iter()
            .filter(|attachment| attachment.is_stepping && !attachment.has_equation)
        {
            for corner in attachment.used_corners() {
                attached_nodes[corner.attached_node].impulse += attachment.substep_force * corner.weight;
            }
        }
        for attached_node in attached_nodes.iter().filter(|attached_node| attached_node.is_stepping) {
            if let Some(body) = bodies.at_mut(attached_node.body) {
                let free_axes = Vec3::select(
                    body.inverse_mass_along_axes(attached_node.node).cmpgt(Vec3::ZERO),
                    Vec3::ONE,
                    Vec3::ZERO,
                );
                let force =
                    (attached_node.external_force + attached_node.impulse * free_axes).clamp(Vec3::MIN, Vec3::MAX);
                body.set_applied_force(attached_node.node as usize, force);
            }
        }
    }

    /// Removes the predicted forces, so that only forces of the caller remain.
    pub fn remove_predicted_forces(&self, bodies: &mut impl Systems) {
        for attached_node in self
            .attached_nodes
            .iter()
            .filter(|attached_node| attached_node.is_stepping)
        {
            if let Some(body) = bodies.at_mut(attached_node.body) {
                body.set_applied_force(attached_node.node as usize, attached_node.external_force);
                body.forces_applied = attached_node.has_external_force;
            }
        }
    }

    /// Begins a substep. Call it after the collision surfaces have begun theirs.
    pub(in crate::deformable_contact) fn begin_substep(
        &mut self,
        bodies: &mut impl Systems,
        surfaces: &[Option<CollisionSurface>],
        span: &SubstepSpan,
    ) {
        for attached_node in self
            .attached_nodes
            .iter_mut()
            .filter(|attached_node| attached_node.is_stepping)
        {
            let Some(body) = bodies.at_mut(attached_node.body) else {
                continue;
            };
            let surface = surfaces.get(attached_node.body).and_then(Option::as_ref);
            attached_node.is_on_surface =
                span.concerns(body) && surface.is_some_and(|surface| surface.contains(attached_node.node));
            attached_node.velocity = body.mean_velocity(attached_node.node as usize);
            attached_node.inverse_mass =
                body.inverse_mass_along_axes(attached_node.node) * body.damping_factor(attached_node.node, span);
            attached_node.position = body.state.newest().0.get(attached_node.node as usize).as_dvec3() + body.origin;
            attached_node.correction = DVec3::ZERO;
        }
        for attachment in &mut self.attachments {
            attachment.is_active = attachment.is_stepping && (span.drifts || !attachment.has_equation);
            if !attachment.is_active {
                continue;
            }
            attachment.impulse = Vec3::ZERO;
            let corners = attachment.used_corners();
            let inverse_mass_sum: Vec3 = corners
                .map(|corner| self.attached_nodes[corner.attached_node].inverse_mass * (corner.weight * corner.weight))
                .sum();
            attachment.effective_mass =
                Vec3::select(inverse_mass_sum.cmpgt(Vec3::ZERO), inverse_mass_sum.recip(), Vec3::ZERO);
            if attachment.thread.is_some() {
                let (offset, duration) = (
                    attachment.offset(&self.attached_nodes),
                    attachment.duration(span, self.is_first_substep),
                );
                let [velocity, _] = attachment.velocity(&self.attached_nodes, surfaces);
                if let Some(thread) = &mut attachment.thread {
                    thread.begin_substep(offset, velocity.as_dvec3(), inverse_mass_sum.as_dvec3(), duration, span);
                }
            }
        }
    }

    /// Softens the threads between bodies that these contacts push apart.
    pub(in crate::deformable_contact) fn soften_threads(&mut self, pair_contacts: &[PairContact], span: &SubstepSpan) {
        for attachment in self.attachments.iter_mut().filter(|attachment| attachment.is_active) {
            let [a, b] = attachment.points.map(|point| point.body);
            if let Some(thread) = &mut attachment.thread {
                let mut pairs = pair_contacts.iter().map(|contact| contact.sides.map(|side| side.body));
                if pairs.any(|pair| pair == [a, b] || pair == [b, a]) {
                    thread.soften(span);
                }
            }
        }
    }

    /// Solves each attachment once by Gauss-Seidel. Both points get equal velocities, or those that the thread
    /// requires. Returns the largest change of relative velocity, m/s.
    pub(in crate::deformable_contact) fn solve_sweep(
        &mut self,
        surfaces: &mut [Option<CollisionSurface>],
        span: &SubstepSpan,
    ) -> f32 {
        let mut max_change = 0.0_f32;
        for attachment in self.attachments.iter_mut().filter(|attachment| attachment.is_active) {
            let [velocity, magnitude] = attachment.velocity(&self.attached_nodes, surfaces);
            let (impulse_change, velocity_change) = match &attachment.thread {
                None => {
                    let is_significant = velocity.abs().cmpgt(magnitude * VELOCITY_ROUNDING)
                        & attachment.effective_mass.cmpgt(Vec3::ZERO);
                    let velocity_change = Vec3::select(is_significant, velocity, Vec3::ZERO);
                    (-velocity_change * attachment.effective_mass, velocity_change)
                }
                Some(thread) => {
                    let previous_total = attachment.substep_force * attachment.duration(span, self.is_first_substep)
                        + attachment.impulse;
                    let total = thread.impulse(velocity.as_dvec3(), previous_total.as_dvec3());
                    let impulse_change = total.as_vec3().clamp(Vec3::MIN, Vec3::MAX) - previous_total;
                    let inverse_mass = attachment.effective_mass.recip();
                    let velocity_change = impulse_change * inverse_mass;
                    let rounding_limit = magnitude.max(previous_total.abs() * inverse_mass) * VELOCITY_ROUNDING;
                    let is_significant =
                        attachment.effective_mass.cmpgt(Vec3::ZERO) & velocity_change.abs().cmpgt(rounding_limit);
                    (
                        impulse_change,
                        Vec3::select(is_significant, velocity_change, Vec3::ZERO),
                    )
                }
            };
            if impulse_change == Vec3::ZERO {
                continue;
            }
            attachment.impulse += impulse_change;
            for corner in attachment.used_corners() {
                self.attached_nodes[corner.attached_node].add_impulse(impulse_change * corner.weight, surfaces);
            }
            max_change = max_change.max(velocity_change.length());
        }
        max_change
    }

    /// Applies the impulses to the bodies, and predicts the same force for the next substep.
    pub(in crate::deformable_contact) fn apply_impulses(
        &mut self,
        bodies: &mut impl Systems,
        surfaces: &[Option<CollisionSurface>],
        span: &SubstepSpan,
    ) {
        self.attached_nodes
            .iter_mut()
            .for_each(|attached_node| attached_node.impulse = Vec3::ZERO);
        for attachment in self.attachments.iter_mut().filter(|attachment| attachment.is_active) {
            let duration = attachment.duration(span, self.is_first_substep);
            let total = attachment.substep_force * duration + attachment.impulse;
            if !attachment.has_equation {
                attachment.substep_force += attachment.impulse / duration;
            }
            for corner in attachment.used_corners() {
                self.attached_nodes[corner.attached_node].impulse += total * corner.weight;
            }
            attachment.total_impulse += total.as_dvec3();
            if let Some(thread) = &mut attachment.thread {
                thread.end_substep(span);
            }
        }
        for attached_node in self
            .attached_nodes
            .iter_mut()
            .filter(|attached_node| attached_node.is_stepping)
        {
            if let Some(body) = bodies.at_mut(attached_node.body)
                && span.concerns(body)
            {
                attached_node.velocity = attached_node.velocity(surfaces);
                body.set_attached_velocity(
                    attached_node.node as usize,
                    attached_node.velocity,
                    attached_node.impulse,
                    span,
                );
            }
        }
        self.is_first_substep = false;
    }

    /// Closes gaps at the end of a substep of `duration` seconds without changing velocities.
    pub(in crate::deformable_contact) fn correct_positions(&mut self, bodies: &mut impl Systems, duration: f32) {
        let Self {
            attachments,
            attached_nodes,
            ..
        } = self;
        for attached_node in attached_nodes
            .iter_mut()
            .filter(|attached_node| attached_node.is_stepping)
        {
            if let Some(body) = bodies.at(attached_node.body) {
                let position = body.state.next_positions().get(attached_node.node as usize);
                attached_node.position = position.as_dvec3() + body.origin;
                attached_node.correction = DVec3::ZERO;
            }
        }
        let duration = f64::from(duration);
        let closed_fraction = (duration / CLOSING_TIME).min(MAX_CLOSED_FRACTION);
        let is_rigid = |attachment: &PointAttachment| attachment.is_stepping && attachment.thread.is_none();
        for attachment in attachments.iter_mut().filter(|attachment| is_rigid(attachment)) {
            let offset = attachment.offset(attached_nodes);
            let correction_step = (offset * closed_fraction).clamp_length_max(CLOSING_SPEED * duration);
            attachment.target_gap = offset - correction_step;
            // Gaps that are due to rounding do no work.
            let extents = attachment
                .points
                .iter()
                .filter_map(|point| bodies.at(point.body))
                .map(System::extent);
            if offset.length() > MIN_OPEN_GAP * f64::from(extents.fold(f32::INFINITY, f32::min)) {
                attachment.work -= attachment.substep_force.as_dvec3().dot(correction_step);
            }
            attachment.gap_tolerance = GAP_TOLERANCE * correction_step.abs().max_element();
        }
        for _ in 0..POSITION_SWEEPS {
            let mut is_done = true;
            for attachment in attachments.iter().filter(|attachment| is_rigid(attachment)) {
                let error = attachment.offset(attached_nodes) - attachment.target_gap;
                is_done &= error.abs().max_element() <= attachment.gap_tolerance;
                let error = error * attachment.effective_mass.as_dvec3();
                for corner in attachment.used_corners() {
                    let attached_node = &mut attached_nodes[corner.attached_node];
                    attached_node.correction -=
                        error * (attached_node.inverse_mass.as_dvec3() * f64::from(corner.weight));
                }
            }
            if is_done {
                break;
            }
        }
        for attached_node in attached_nodes {
            if attached_node.is_stepping
                && attached_node.correction != DVec3::ZERO
                && let Some(body) = bodies.at_mut(attached_node.body)
            {
                body.displace_node(attached_node.node as usize, attached_node.correction.as_vec3());
            }
        }
    }
}

impl PointAttachment {
    /// Returns the offset between the points at the positions of the attached nodes, m.
    fn offset(&self, attached_nodes: &[AttachmentNode]) -> DVec3 {
        let position_of = |attached_node: &AttachmentNode| attached_node.position + attached_node.correction;
        let contributions = self
            .used_corners()
            .map(|corner| position_of(&attached_nodes[corner.attached_node]) * f64::from(corner.weight));
        contributions.sum()
    }

    /// Returns the relative velocity of the first point, and the largest contribution of a corner along each axis, m/s.
    fn velocity(&self, attached_nodes: &[AttachmentNode], surfaces: &[Option<CollisionSurface>]) -> [Vec3; 2] {
        let (mut velocity, mut magnitude) = (Vec3::ZERO, Vec3::ZERO);
        for corner in self.used_corners() {
            let contribution = attached_nodes[corner.attached_node].velocity(surfaces) * corner.weight;
            velocity += contribution;
            magnitude = magnitude.max(contribution.abs());
        }
        [velocity, magnitude]
    }

    /// Returns how long forces act in this span, s.
    fn duration(&self, span: &SubstepSpan, is_first_substep: bool) -> f32 {
        let is_half_kick = !self.has_equation && (is_first_substep || !span.drifts);
        if is_half_kick {
            0.5 * span.duration
        } else {
            span.duration
        }
    }
}

impl AttachmentNode {
    fn velocity(&self, surfaces: &[Option<CollisionSurface>]) -> Vec3 {
        match surfaces.get(self.body) {
            Some(Some(surface)) if self.is_on_surface => surface.velocities[self.node as usize].into(),
            _ => self.velocity,
        }
    }

    fn add_impulse(&mut self, impulse: Vec3, surfaces: &mut [Option<CollisionSurface>]) {
        let velocity = self.velocity(surfaces) + impulse * self.inverse_mass;
        match surfaces.get_mut(self.body) {
            Some(Some(surface)) if self.is_on_surface => surface.velocities[self.node as usize] = velocity.into(),
            _ => self.velocity = velocity,
        }
    }
}
