//! Contact between deformable bodies, and self-contact.
//!
//! Bodies that are near each other take their substeps together (`coupled_step.rs`). In each substep, impulses with
//! friction stop nodes that would come too close on their straight paths, as in contact with tools. Contacts only push,
//! store nothing and do not shorten the substep. The solver uses sequential impulses (Catto 2005) on pairs of nodes
//! with faces and of edges with edges (Bridson, Fedkiw, Anderson 2002). Both sides get equal and opposite impulses at
//! the same point, so momentum is conserved.

mod attachments;
mod body_broad_phase;
mod candidate_pairs;
mod clearances;
mod collision_surface;
mod contact_reports;
mod coupled_step;
mod crossing;
mod edge_curvature;
mod images;
mod interpenetrating_pairs;
mod narrow_phase;
mod pair_contact;
mod plan;
mod search;
mod sleep_groups;
mod topology_change;
mod touching_pairs;
mod tunneling;
mod warm_start;
mod wound;

pub(crate) use self::attachments::{AttachmentPoint, LinearPath, PointAttachments, SutureThread, are_one, distance};
use self::body_broad_phase::Islands;
use self::candidate_pairs::CandidatePairs;
use self::clearances::Clearances;
pub(crate) use self::collision_surface::CollisionSurface;
use self::contact_reports::ContactReports;
pub(crate) use self::coupled_step::CoupledGroup;
use self::interpenetrating_pairs::InterpenetratingPairs;
use self::pair_contact::PairContact;
use self::sleep_groups::SleepGroups;
pub(crate) use self::topology_change::{NewCollisionSurface, PreparedSurfaceChange};
use self::touching_pairs::TouchingPairs;
use self::warm_start::{WarmStartCache, apply_warm_start};

use glam::Vec3A;

use crate::base::{Count, Result, Stage, Stopwatch, memory};
use crate::codec::saved;
use crate::contact::Contacts;
use crate::contact::sweep_control::{PgsLimits, PgsPass, sweep_until_converged};
use crate::geometry::Aabb;
use crate::solver::{SubstepSpan, System, Systems};

/// Maximum number of contact searches in a substep. Impulses deflect nodes, so the search is repeated.
const MAX_SEARCHES: u32 = 16;

/// Solver effort of a substep. Sweeps begin with the impulses of the last substep, and the next substep corrects the
/// remaining error.
const LIMITS: PgsLimits = PgsLimits {
    sweeps: 32,
    tolerance: 2.5e-4,
    defers_slow_tail: true,
};

/// Maximum speed of the position correction of one contact, as a fraction of the smaller body's extent, 1/s. The bodies
/// keep about this speed, so it bounds the energy that they gain.
const CORRECTION_SPEED: f32 = 0.3;

/// Maximum number of retries in a substep, and their solver effort, for contacts whose sides would pass each other. The
/// effort is higher because errors between nearly parallel sides converge slowly.
const MAX_TUNNELING_RETRIES: u32 = 8;
const RETRY_LIMITS: PgsLimits = PgsLimits {
    sweeps: 512,
    defers_slow_tail: false,
    ..LIMITS
};

/// Passes of the position correction over all contacts. Each contact uses the positions that earlier contacts have
/// corrected.
const CORRECTION_PASSES: u32 = 4;

/// Maximum number of simulation nodes that move three corners, each bound to at most four nodes.
const MAX_MOVERS: usize = 12;

/// Capacity for contacts, per node, edge and face of the surfaces.
const CONTACTS_PER_FEATURE: usize = 1;

/// Contacts between deformable bodies. It exists only in worlds with bodies that enable them.
#[derive(Debug, Default)]
pub(crate) struct DeformableContact {
    pub islands: Islands,
    /// Collision surfaces, by body index.
    surfaces: Vec<Option<CollisionSurface>>,
    /// Reduced thicknesses, by body index, of bodies that collide with others.
    clearances: Vec<Option<Clearances>>,
    /// Open surfaces that were created through each other.
    interpenetrating_pairs: InterpenetratingPairs,
    pair_contacts: Vec<PairContact>,
    /// Duration of the substep of these contacts, s.
    duration: f32,
    /// Indices of contacts of earlier searches, sorted by their sides.
    contact_order: Vec<u32>,
    /// Impulses of earlier substeps.
    pub warm_start: WarmStartCache,
    /// Contacts as reported to the caller.
    pub contact_reports: ContactReports,
    /// Pairs of bodies in contact.
    pub touching_pairs: TouchingPairs,
    /// Features that are near each other.
    candidate_pairs: CandidatePairs,
    /// Groups of bodies that fell asleep together.
    pub sleep_groups: SleepGroups,
    /// Attachments between points of bodies.
    pub attachments: PointAttachments,
}

saved! { DeformableContact {
    islands, surfaces, clearances, interpenetrating_pairs, pair_contacts, duration, contact_order, warm_start,
    contact_reports, touching_pairs, candidate_pairs, sleep_groups, attachments,
} }

impl DeformableContact {
    /// Adds a body with contact, and reserves the memory that it needs.
    pub fn add_body(&mut self, body_index: usize, body: &System) -> Result<()> {
        let mut surface = CollisionSurface::new(body)?;
        self.add_images(&mut surface)?;
        self.islands.reserve_body(body_index)?;
        self.sleep_groups.reserve_body(body_index)?;
        self.interpenetrating_pairs
            .reserve(self.surfaces.iter().flatten().count())?;
        let added_room = CONTACTS_PER_FEATURE * surface.feature_capacity;
        let contact_room = self.contact_capacity() + added_room;
        self.pair_contacts
            .try_reserve(contact_room.saturating_sub(self.pair_contacts.len()))?;
        self.contact_order
            .try_reserve(contact_room.saturating_sub(self.contact_order.len()))?;
        self.warm_start.reserve(contact_room)?;
        self.contact_reports.reserve(contact_room)?;
        self.touching_pairs.reserve(contact_room)?;
        let mut features = [0; 2];
        for surface in self.surfaces.iter().flatten().chain([&surface]) {
            let feature_count = surface.nodes.capacity() + surface.edges.capacity();
            features[0] += if surface.collides_with_bodies { feature_count } else { 0 };
            features[1] += if surface.initial_positions.is_some() {
                feature_count
            } else {
                0
            };
        }
        let lists = self.islands.pair_capacity() + self.surfaces.len() + 1;
        self.candidate_pairs.reserve(lists, features)?;
        let spare = body.spare_nodes();
        let new_clearances = || Clearances::new(surface.nodes.len() + spare, surface.edges.len() + 3 * spare);
        let clearances = body.contact.with_bodies.then(new_clearances).transpose()?;
        while self.surfaces.len() <= body_index {
            memory::push(&mut self.surfaces, None)?;
        }
        while self.clearances.len() <= body_index {
            memory::push(&mut self.clearances, None)?;
        }
        self.clearances[body_index] = clearances;
        self.surfaces[body_index] = Some(surface);
        Ok(())
    }

    /// Reserves memory for `count` attachments between these bodies.
    pub fn reserve_attachments(&mut self, body_indices: [usize; 2], count: usize) -> Result<()> {
        for body_index in body_indices {
            self.islands.reserve_body(body_index)?;
        }
        self.attachments.reserve(count)
    }

    /// Creates images of a new surface, and of surfaces that it can collide with, if one of each pair uses images.
    fn add_images(&mut self, surface: &mut CollisionSurface) -> Result<()> {
        for other in self.surfaces.iter_mut().flatten() {
            if surface.collides_with_bodies
                && other.collides_with_bodies
                && (surface.wants_images || other.wants_images)
            {
                other.add_images()?;
                surface.add_images()?;
            }
        }
        // The first surface of a world also needs its images here, so that an invalid resolution is refused.
        if surface.wants_images {
            surface.add_images()?;
        }
        Ok(())
    }

    /// Returns the collision surface of a body, if it has contact.
    pub fn surface_mut(&mut self, body_index: usize) -> Option<&mut CollisionSurface> {
        self.surfaces.get_mut(body_index)?.as_mut()
    }

    /// Removes a body that was destroyed.
    pub fn remove_body(&mut self, bodies: &mut impl Systems, body_index: usize) {
        self.attachments.remove_body(bodies, body_index);
        for other in self.sleep_groups.others(body_index) {
            if let Some(body) = bodies.at_mut(other) {
                body.wake();
            }
        }
        self.sleep_groups.remove(body_index);
        self.touching_pairs.remove_body(body_index);
        self.remove_surface(body_index);
    }

    /// Removes the surface of a body whose contact is turned off. Its attachments stay.
    pub fn remove_surface(&mut self, body_index: usize) {
        self.interpenetrating_pairs.remove_body(body_index);
        self.warm_start.remove_body(body_index);
        self.contact_reports.remove_body(body_index);
        if let Some(surface) = self.surfaces.get_mut(body_index) {
            *surface = None;
        }
        if let Some(clearances) = self.clearances.get_mut(body_index) {
            *clearances = None;
        }
    }

    fn contact_capacity(&self) -> usize {
        let all_surfaces = self.surfaces.iter().flatten();
        all_surfaces
            .map(|surface| CONTACTS_PER_FEATURE * surface.feature_capacity)
            .sum()
    }

    /// Returns the bounds of all velocities of a body. `before` are the bounds before the contacts of a substep.
    pub fn velocity_bounds(&self, body_index: usize, before: Aabb) -> Aabb {
        let before = self.attachments.velocity_bounds(body_index, before);
        match self.surfaces.get(body_index) {
            Some(Some(surface)) => before.and(&surface.velocity_bounds),
            _ => before,
        }
    }

    /// Finds and solves the contacts of an island in a substep.
    pub fn resolve_contacts(&mut self, island: usize, bodies: &mut impl Systems, span: &SubstepSpan) {
        let watch = Stopwatch::start(span.profile);
        if span.begins {
            let members = self.islands.members(island);
            // Attachments pull points together that contacts push apart, so the impulses of both would grow from step
            // to step.
            let are_attached = members
                .iter()
                .any(|&body_index| self.attachments.has_body(body_index as usize));
            self.warm_start.begin_island(members, !are_attached);
            self.candidate_pairs.reset();
            self.touching_pairs.begin_island(members);
        } else {
            self.warm_start.store(&self.pair_contacts);
            self.touching_pairs.record(&self.pair_contacts);
        }
        // The last span of a step is a half kick, which only VERLET has.
        if !span.drifts {
            self.contact_reports
                .record(&self.pair_contacts, self.duration, |body_indices| {
                    !any_takes_half_kicks(bodies, body_indices)
                });
            let members = self.islands.members(island).iter();
            if !any_takes_half_kicks(bodies, members.map(|&body_index| body_index as usize)) {
                return;
            }
        } else if span.begins {
            self.contact_reports.begin_island(self.islands.members(island));
        }
        self.duration = span.duration;
        self.pair_contacts.clear();
        for &body_index in self.islands.members(island) {
            let body_index = body_index as usize;
            if let (Some(Some(surface)), Some(body)) = (self.surfaces.get_mut(body_index), bodies.at_mut(body_index))
                && span.concerns(body)
            {
                body.release_pressed(span.duration);
                surface.begin_substep(body, span.duration, span.begins);
            }
        }
        self.candidate_pairs
            .advance_motion(self.islands.searches(island), &self.surfaces, true);
        self.attachments.begin_substep(bodies, &self.surfaces, span);
        self.draw_images(island, bodies, span);
        watch.stop(span.profile, Stage::BroadPhase);
        let watch = Stopwatch::start(span.profile);
        self.solve_and_apply(island, bodies, span);
        if !span.drifts {
            self.contact_reports
                .record(&self.pair_contacts, 0.5 * self.duration, |body_indices| {
                    any_takes_half_kicks(bodies, body_indices)
                });
        }
        watch.stop(span.profile, Stage::ContactSolver);
        if let Some(profile) = span.profile {
            profile.count(Count::TissueContacts, self.pair_contacts.len());
        }
    }

    fn solve_and_apply(&mut self, island: usize, bodies: &mut impl Systems, span: &SubstepSpan) {
        let has_solved = self.solve_contacts(island, bodies, span);
        for &body_index in self.islands.members(island) {
            let body_index = body_index as usize;
            if let (Some(Some(surface)), Some(body)) = (self.surfaces.get_mut(body_index), bodies.at_mut(body_index))
                && span.concerns(body)
            {
                surface.record_velocity_changes(body);
            }
        }
        for contact in &self.pair_contacts {
            for (index, (side, sign)) in contact.sides.iter().zip([1.0, -1.0]).enumerate() {
                if let (Some(surface), Some(body)) = (&mut self.surfaces[side.body], bodies.at_mut(side.body)) {
                    for (node, weight) in contact.movers(index) {
                        let node = node as usize;
                        let velocity = surface.velocities[node].into();
                        surface.velocity_bounds = surface.velocity_bounds.with(velocity);
                        let impulse = contact.total_impulse() * (sign * weight);
                        body.set_mean_velocity(node, velocity, impulse, span);
                        if span.drifts {
                            body.record_contact_impulse(node as u32, impulse);
                        }
                    }
                }
            }
        }
        if has_solved {
            self.apply_tool_contacts(island, bodies, span);
        }
        self.attachments.apply_impulses(bodies, &self.surfaces, span);
        if span.drifts {
            self.correct_penetration(bodies, span.duration);
            self.attachments.correct_positions(bodies, span.duration);
            for &body_index in self.islands.members(island) {
                if let Some(body) = bodies.at_mut(body_index as usize)
                    && let Some(contacts) = body.contacts.as_ref().filter(|contacts| contacts.may_touch())
                {
                    contacts.push_nodes_out(body.state.substep().next_positions);
                }
            }
        }
    }

    /// Stores the impulses of an island at the end of its step.
    pub fn end_island(&mut self) {
        self.warm_start.store(&self.pair_contacts);
        self.touching_pairs.record(&self.pair_contacts);
        self.warm_start.end_island();
    }

    /// Reports the current velocities of VERLET bodies that press implicit ones, before their last half kick. Contact
    /// does not stop that half kick.
    pub fn show_early_velocities(&self, bodies: &mut impl Systems) {
        for contact in self.pair_contacts.iter().filter(|contact| contact.is_pressing()) {
            let body_indices = contact.sides.map(|side| side.body);
            let take_half_kicks = body_indices.map(|body_index| takes_half_kicks(bodies, body_index));
            for index in 0..2 {
                if take_half_kicks[index]
                    && !take_half_kicks[1 - index]
                    && let Some(body) = bodies.at_mut(body_indices[index])
                {
                    body.publish_pre_kick_velocities();
                }
            }
        }
    }

    /// Applies the impulses of tool contacts that were solved together with deformable contacts, to nodes and tools.
    fn apply_tool_contacts(&mut self, island: usize, bodies: &mut impl Systems, span: &SubstepSpan) {
        let members = self.islands.members(island);
        for_each_tool_contact(members, &mut self.surfaces, bodies, span, |surface, body, contacts| {
            let CollisionSurface {
                velocities,
                velocity_bounds,
                ..
            } = surface;
            contacts.end_sweeps(velocities, |node, impulse| {
                let velocity = velocities[node].into();
                *velocity_bounds = velocity_bounds.with(velocity);
                body.set_mean_velocity(node, velocity, impulse, span);
            });
        });
    }

    /// Finds contacts and solves them together with tool contacts, until the solution leads to no new ones. Returns
    /// true if any were solved.
    fn solve_contacts(&mut self, island: usize, bodies: &mut impl Systems, span: &SubstepSpan) -> bool {
        let mut first_change = None;
        let mut has_begun = false;
        let (mut retries, mut retry_limits) = (0, RETRY_LIMITS);
        for _ in 0..MAX_SEARCHES {
            let known_count = self.pair_contacts.len();
            let (mut needs_search, mut is_retry) = (true, false);
            if has_begun {
                self.update_motions(island, bodies, span);
                is_retry = retries < MAX_TUNNELING_RETRIES && retry_limits.sweeps > 0 && self.prevent_tunneling(span);
                retries += u32::from(is_retry);
                needs_search = !self.is_search_complete(island, bodies, span);
            }
            if needs_search {
                let watch = Stopwatch::start(span.profile);
                self.find_contacts(island, bodies, span, has_begun);
                watch.stop(span.profile, Stage::NarrowPhase);
                watch.subtract_from(span.profile, Stage::ContactSolver);
            }
            if self.pair_contacts.len() == known_count && !is_retry && (has_begun || !self.attachments.any_active()) {
                break;
            }
            let Self {
                pair_contacts,
                surfaces,
                attachments,
                islands,
                warm_start,
                ..
            } = self;
            let members = islands.members(island);
            if !has_begun {
                // Tool contacts continue from their impulses in the substep.
                for_each_tool_contact(members, surfaces, bodies, span, |surface, body, contacts| {
                    contacts.begin_sweeps(|node| surface.velocities[node] = body.mean_velocity(node).into());
                });
            }
            has_begun = true;
            attachments.soften_threads(pair_contacts, span);
            let warm_started = apply_warm_start(&mut pair_contacts[known_count..], warm_start.max_fraction(), surfaces);
            if warm_started > 0.0 {
                first_change =
                    Some(first_change.map_or(warm_started, |first_change: f32| first_change.max(warm_started)));
            }
            let limits = if is_retry { retry_limits } else { LIMITS };
            first_change = Some(sweep_until_converged(limits, first_change, |sweep| {
                retry_limits.sweeps -= u32::from(is_retry);
                let pair_contacts = pair_contacts
                    .iter_mut()
                    .filter(|contact| sweep == PgsPass::All || contact.is_pressing());
                let velocity_changes = pair_contacts.map(|contact| contact.solve(surfaces));
                let mut largest_change = velocity_changes
                    .fold(0.0, f32::max)
                    .max(attachments.solve_sweep(surfaces, span));
                for_each_tool_contact(members, surfaces, bodies, span, |surface, _, contacts| {
                    largest_change = largest_change.max(contacts.sweep(&mut surface.velocities, sweep));
                });
                largest_change
            }));
        }
        has_begun
    }

    /// Updates bound points and predicted motions after impulses changed the velocities of nodes.
    fn update_motions(&mut self, island: usize, bodies: &impl Systems, span: &SubstepSpan) {
        for &body_index in self.islands.members(island) {
            let body_index = body_index as usize;
            if let (Some(Some(surface)), Some(body)) = (self.surfaces.get_mut(body_index), bodies.at(body_index))
                && span.concerns(body)
            {
                surface.update_motion(body, span.duration);
            }
        }
        self.candidate_pairs
            .advance_motion(self.islands.searches(island), &self.surfaces, false);
    }

    /// Corrects penetration at the start of the substep without changing velocities. No node moves past a neighboring
    /// contact.
    fn correct_penetration(&mut self, bodies: &mut impl Systems, duration: f32) {
        let Self {
            pair_contacts,
            surfaces,
            ..
        } = self;
        if pair_contacts.iter().all(|contact| contact.depth <= 0.0) {
            return;
        }
        // Predicted velocities are no longer needed, so the same memory holds the displacements of nodes.
        for contact in pair_contacts.iter() {
            for (body_index, node) in contact.all_movers() {
                if let Some(surface) = &mut surfaces[body_index] {
                    surface.predicted_velocities[node] = Vec3A::ZERO;
                }
            }
        }
        for _ in 0..CORRECTION_PASSES {
            for contact in pair_contacts.iter_mut() {
                let extents = contact
                    .sides
                    .map(|side| surfaces[side.body].as_ref().map_or(0.0, |surface| surface.extent));
                let max_displacement = CORRECTION_SPEED * extents[0].min(extents[1]) * duration;
                contact.correct_penetration(max_displacement, duration, surfaces);
            }
        }
        for (body_index, node) in pair_contacts.iter().flat_map(PairContact::all_movers) {
            if let (Some(surface), Some(body)) = (&mut surfaces[body_index], bodies.at_mut(body_index)) {
                let displacement = std::mem::take(&mut surface.predicted_velocities[node]);
                if displacement != Vec3A::ZERO {
                    body.displace_node(node, displacement.into());
                }
            }
        }
    }
}

/// True if a body takes half kicks.
fn takes_half_kicks(bodies: &impl Systems, body_index: usize) -> bool {
    bodies
        .at(body_index)
        .is_none_or(|body| body.integrator.takes_half_kicks())
}

/// True if any of these bodies takes half kicks.
fn any_takes_half_kicks(bodies: &impl Systems, body_indices: impl IntoIterator<Item = usize>) -> bool {
    body_indices
        .into_iter()
        .any(|body_index| takes_half_kicks(bodies, body_index))
}

/// Calls `f` with the body, surface and tool contacts of each body that tools press, or may press after deformable
/// contacts move it.
fn for_each_tool_contact(
    members: &[u32],
    surfaces: &mut [Option<CollisionSurface>],
    bodies: &mut impl Systems,
    span: &SubstepSpan,
    mut f: impl FnMut(&mut CollisionSurface, &mut System, &mut Contacts),
) {
    for &body_index in members {
        let body_index = body_index as usize;
        if let (Some(Some(surface)), Some(body)) = (surfaces.get_mut(body_index), bodies.at_mut(body_index))
            && span.concerns(body)
            // `f` does not access the contacts through the body.
            && let Some(mut contacts) = body.contacts.take_if(|contacts| contacts.may_touch())
        {
            f(surface, body, &mut contacts);
            body.contacts = Some(contacts);
        }
    }
}

/// True if an attachment joins simulation nodes that move these corners of two surfaces.
fn share_attachment(
    attachments: &PointAttachments,
    bodies: &impl Systems,
    body_indices: [usize; 2],
    corners: [&[u32]; 2],
) -> bool {
    let mut mover_nodes = [[0; MAX_MOVERS]; 2];
    let mut counts = [0; 2];
    for side in 0..2 {
        let body = bodies.at(body_indices[side]);
        let all = corners[side]
            .iter()
            .flat_map(|&corner| body.into_iter().flat_map(move |body| body.movers(corner)));
        for (to, (node, _)) in mover_nodes[side].iter_mut().zip(all) {
            *to = node;
            counts[side] += 1;
        }
    }
    attachments.join_nodes(body_indices, [0, 1].map(|side| &mover_nodes[side][..counts[side]]))
}

fn can_collide(first: &System, second: &System) -> bool {
    let (a, b) = (&first.contact, &second.contact);
    a.with_bodies && b.with_bodies && a.filter.meets(b.filter)
}
