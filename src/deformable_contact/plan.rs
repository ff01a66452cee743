//! Islands of bodies that take a step together, and their number of substeps.

use glam::{DVec3, FloatExt, Vec3};

use super::DeformableContact;
use super::body_broad_phase::SweptBody;
use super::can_collide;
use super::collision_surface::CollisionSurface;
use super::pair_contact::ContactKey;
use crate::geometry::Aabb;
use crate::nodes::weighted_nodes;
use crate::solver::{System, Systems};

/// Assumed maximum factor by which a body becomes faster in a step. If it becomes faster, the step is repeated.
pub(super) const SPEED_MARGIN: f32 = 2.0;

/// Maximum relative displacement in a substep, as a fraction of the short edges.
const MAX_TRAVEL: f32 = 0.5;

/// Maximum product of an IMPLICIT substep and the frequency of pressed nodes with all others fixed. With 2.2, bodies of
/// 60 kPa press each other 3 % too weakly; with 4.9, those of 250 kPa 8 %, and energy grows.
const MAX_PHASE: f32 = 1.0;

/// Additional distance at which bodies count as near, as a fraction of their extents.
const BROAD_PHASE_MARGIN: f32 = 0.005;

impl DeformableContact {
    /// Builds the islands of the next step of `dt` seconds: bodies that may come near each other, attached bodies, and
    /// single bodies with self-contact.
    pub fn plan(&mut self, bodies: &impl Systems, dt: f32) {
        self.islands.reset(|body_index| {
            let has_self_contact = |body: &System| body.collides_with_tissue() && body.contact.with_itself;
            bodies.at(body_index).is_some_and(has_self_contact)
        });
        for [first, second] in self.attachments.bodies() {
            self.islands.merge(first, second);
        }
        let common_velocity = self.common_velocity(bodies);
        let origin = self.origin(bodies);
        let swept_bodies = colliding_bodies(&self.surfaces, bodies).map(|(body_index, body)| {
            let margin = body.contact.thickness + BROAD_PHASE_MARGIN * body.extent();
            let bounds = body.local_bounds().moved(body.origin - origin).extended(margin);
            SweptBody::new(
                body_index,
                bounds,
                &velocity_bounds(body),
                common_velocity,
                SPEED_MARGIN * dt,
            )
        });
        let are_near = |first_body: &SweptBody, second_body: &SweptBody| {
            let both = [first_body, second_body].map(|swept_body| bodies.at(swept_body.body_index as usize));
            let [Some(first), Some(second)] = both else {
                return false;
            };
            let travel = SPEED_MARGIN * dt * relative_speed(first, second);
            can_collide(first, second) && first_body.bounds.extended(travel).overlaps(&second_body.bounds)
        };
        self.islands.merge_near(swept_bodies, are_near);
        self.islands.sort();
    }

    /// Merges islands of bodies that came near each other in an attempted step unexpectedly. Returns true if there are
    /// any.
    pub fn replan(&mut self, bodies: &impl Systems, dt: f32) -> bool {
        let origin = self.origin(bodies);
        let common_displacement = self.common_velocity(bodies) * dt;
        let swept_bodies = colliding_bodies(&self.surfaces, bodies).map(|(body_index, body)| SweptBody {
            body_index: body_index as u32,
            bounds: swept(body, common_displacement).moved(body.origin - origin),
            travel: 0.0,
        });
        let are_near = |first_body: &SweptBody, second_body: &SweptBody| {
            let both = [first_body, second_body].map(|swept_body| bodies.at(swept_body.body_index as usize));
            matches!(both, [Some(first), Some(second)] if can_collide(first, second))
        };
        let is_changed = self.islands.merge_near(swept_bodies, are_near);
        self.islands.sort();
        is_changed
    }

    /// Returns the mean of the centers of the bodies' velocity bounds, m/s.
    fn common_velocity(&self, bodies: &impl Systems) -> Vec3 {
        let centers = colliding_bodies(&self.surfaces, bodies).map(|(_, body)| {
            let bounds = velocity_bounds(body);
            0.5 * (bounds.min + bounds.max)
        });
        let (count, sum) = centers.fold((0, Vec3::ZERO), |(count, sum), center| (count + 1, sum + center));
        sum / (count.max(1) as f32)
    }

    /// Returns the origin of the coordinates in which bodies are compared.
    fn origin(&self, bodies: &impl Systems) -> DVec3 {
        colliding_bodies(&self.surfaces, bodies)
            .next()
            .map_or(DVec3::ZERO, |(_, body)| body.origin)
    }

    /// True if all bodies of an island sleep, so that nothing changes.
    pub fn is_asleep(&self, island: usize, bodies: &impl Systems) -> bool {
        are_asleep(self.islands.members(island), bodies)
    }

    /// True if all bodies of an island are at rest and may sleep. Attached bodies do not sleep.
    pub fn is_at_rest(&self, island: usize, bodies: &impl Systems) -> bool {
        let members = self.islands.members(island);
        let mut attached_bodies = self.attachments.bodies().flatten();
        members
            .iter()
            .all(|&body_index| bodies.at(body_index as usize).is_some_and(System::is_at_rest))
            && !attached_bodies.any(|body_index| members.contains(&(body_index as u32)))
    }

    /// Returns the number of substeps for which relative displacements in an island stay below a fraction of a short
    /// edge.
    pub fn wanted_substeps(&self, island: usize, bodies: &impl Systems, dt: f32) -> u32 {
        let short_edge = |body_index: usize| {
            self.surfaces
                .get(body_index)?
                .as_ref()
                .map(|surface| surface.short_edge)
        };
        let wanted = |[a, b]: [usize; 2]| {
            let speed = relative_speed(bodies.at(a)?, bodies.at(b)?);
            Some(dt * speed / (MAX_TRAVEL * short_edge(a)?.min(short_edge(b)?)))
        };
        let members = self
            .islands
            .members(island)
            .iter()
            .map(|&body_index| body_index as usize);
        let has_self_contact = |body_index: &usize| bodies.at(*body_index).is_some_and(|body| body.contact.with_itself);
        let self_pairs = members.filter(has_self_contact).map(|body_index| [body_index; 2]);
        let all = self_pairs.chain(self.islands.pairs(island)).filter_map(wanted);
        let wanted = all.fold(1.0, f32::max).ceil().min(1e6) as u32;
        let committed_contacts = self.warm_start.committed(self.islands.members(island));
        let committed_contacts = committed_contacts.map(|(sides, impulse)| (sides, impulse, 0.0));
        wanted.max(self.substeps_for_contacts(island, bodies, dt, committed_contacts))
    }

    /// Returns the number of substeps for the contacts of the substep in progress.
    pub fn substeps_for_current_contacts(&self, island: usize, bodies: &impl Systems, dt: f32) -> u32 {
        let pressing = self.pair_contacts.iter().filter(|contact| contact.is_pressing());
        let all = pressing.map(|contact| (contact.key(), contact.impulses().0, contact.new_fraction()));
        self.substeps_for_contacts(island, bodies, dt, all)
    }

    /// Returns the number of substeps in which internal forces follow these contacts. Each has a normal impulse that is
    /// applied after implicit solves, N s, and the fraction of it that is new. Frequencies are averaged, because nodes
    /// of slivers carry little load. A sustained load follows the softer side; an impact stretches the stiffer one.
    fn substeps_for_contacts(
        &self,
        island: usize,
        bodies: &impl Systems,
        dt: f32,
        pressing: impl Iterator<Item = (ContactKey, f32, f32)>,
    ) -> u32 {
        let members = self.islands.members(island);
        let solution = |&body_index: &u32| bodies.at(body_index as usize)?.integrator.solution();
        if members.iter().find_map(solution).is_none() {
            return 0;
        }
        let weighted_frequencies = pressing.filter_map(|(sides, impulse, new_fraction)| {
            let frequency_of_side = |(body_index, nodes): (usize, [u32; 3])| {
                bodies.at(body_index).and_then(|body| local_frequency(body, nodes))
            };
            let [a, b] = sides.map(frequency_of_side);
            let (low, high) = match (a, b) {
                (Some(a), Some(b)) => (a.min(b), a.max(b)),
                (first, other) => [first.or(other)?; 2].into(),
            };
            let local_frequency = (low * low).lerp(high * high, new_fraction * new_fraction).sqrt();
            Some([impulse * local_frequency, impulse])
        });
        let [sum, impulse] =
            weighted_frequencies.fold([0.0; 2], |sums, added| [sums[0] + added[0], sums[1] + added[1]]);
        let substeps = if impulse > 0.0 {
            dt / MAX_PHASE * (sum / impulse)
        } else {
            0.0
        };
        substeps.ceil().min(1e6) as u32
    }

    /// Returns the speed of the fastest node of an island after a step with this gravity, m/s, as far as velocities are
    /// tracked.
    pub fn max_speed(&self, island: usize, bodies: &impl Systems, gravity: Vec3, dt: f32) -> f32 {
        let members = self.islands.members(island).iter();
        let members = members.filter_map(|&body_index| bodies.at(body_index as usize));
        let speeds = members.map(|body| {
            let bounds = velocity_bounds(body);
            bounds.magnitudes().length() + dt * body.body_acceleration(gravity).length()
        });
        speeds.fold(0.0, f32::max)
    }
}

/// Returns the natural frequency of these nodes with all others fixed, 1/s; `None` if they cannot move.
fn local_frequency(body: &System, nodes: [u32; 3]) -> Option<f32> {
    let [mut stiffness, mut mass] = [0.0; 2];
    for (node, _) in nodes
        .into_iter()
        .flat_map(|node| weighted_nodes(body.bindings.as_ref(), node))
    {
        if body.inverse_masses[node as usize] > 0.0 {
            stiffness += body.forces.stiffness_at(node as usize, 0.0);
            mass += body.masses[node as usize];
        }
    }
    (mass > 0.0).then(|| (stiffness / mass).sqrt())
}

/// True if all these bodies sleep.
pub(super) fn are_asleep(body_indices: &[u32], bodies: &impl Systems) -> bool {
    let mut body_indices = body_indices.iter();
    body_indices.all(|&body_index| bodies.at(body_index as usize).is_some_and(System::is_asleep))
}

/// Returns bodies with contact, and their indices.
fn colliding_bodies<'a, B: Systems>(
    surfaces: &'a [Option<CollisionSurface>],
    bodies: &'a B,
) -> impl Iterator<Item = (usize, &'a System)> + use<'a, B> {
    let with_surface = surfaces.iter().enumerate().filter(|(_, surface)| surface.is_some());
    with_surface.filter_map(|(body_index, _)| Some((body_index, bodies.at(body_index)?)))
}

/// Returns the bounds of a body's velocities, m/s, or 0 if they are not tracked.
fn velocity_bounds(body: &System) -> Aabb {
    let bounds = body.carry.gravity.velocities;
    if bounds.min.is_finite() && bounds.max.is_finite() {
        bounds
    } else {
        Aabb {
            min: Vec3::ZERO,
            max: Vec3::ZERO,
        }
    }
}

/// Returns an upper bound of the relative speed of nodes of two bodies, or of one body, m/s.
fn relative_speed(first: &System, second: &System) -> f32 {
    let [a, b] = [first, second].map(velocity_bounds);
    (a.max - b.min).abs().max((b.max - a.min).abs()).length()
}

/// Returns the bounds of a body over an attempted step, minus a common displacement, plus its contact distance, in its
/// own coordinates.
fn swept(body: &System, common_displacement: Vec3) -> Aabb {
    let ends = body
        .state
        .newest()
        .0
        .iter()
        .map(|position| position - common_displacement);
    Aabb::of(body.state.positions().iter().chain(ends)).extended(body.contact.thickness + 1e-3 * body.extent())
}
