//! Which bodies take a step together, and in how many substeps.

use glam::{DVec3, FloatExt, Vec3};

use super::DeformableContact;
use super::islands::Reach;
use super::link::Key;
use super::meet_each_other;
use super::skin::Skin;
use crate::geometry::Bounds;
use crate::nodes::parts;
use crate::solver::{System, Systems};

/// It is foreseen that a body becomes so many times as fast in a step; where it is faster, the step is taken again.
pub(super) const FASTER: f32 = 2.0;

/// How far bodies come against each other in a substep, as a part of the short edges.
const TRAVEL: f32 = 0.5;

/// The longest substep in which a body of IMPLICIT follows what contacts give after its equation, times the frequency that the pressed nodes would
/// have if all others were held. With 2.2, bodies of 60 kPa press each other 3 % too weakly; with 4.9, those of 250 kPa 8 %, and energy is gained.
const FOLLOWED: f32 = 1.0;

/// How much further than they can come bodies count as near, as a part of their extents.
const MARGIN: f32 = 0.005;

impl DeformableContact {
    /// Finds out which bodies take the next step of `dt` seconds together: those that may come near each other, those that are attached,
    /// and by themselves those that meet themselves.
    pub fn plan(&mut self, bodies: &impl Systems, dt: f32) {
        self.islands.part(|place| {
            let meets_itself = |body: &System| body.meets_tissue() && body.contact.with_itself;
            bodies.at(place).is_some_and(meets_itself)
        });
        for [first, second] in self.bonds.bodies() {
            self.islands.join(first, second);
        }
        let common = self.common_velocity(bodies);
        let origin = self.origin(bodies);
        let reaches = meeting(&self.skins, bodies).map(|(place, body)| {
            let margin = body.contact.thickness + MARGIN * body.extent();
            let bounds = body.local_bounds().moved(body.origin - origin).extended(margin);
            Reach::new(place, bounds, &velocities(body), common, FASTER * dt)
        });
        let are_near = |one: &Reach, other: &Reach| {
            let both = [one, other].map(|reach| bodies.at(reach.place as usize));
            let [Some(first), Some(second)] = both else {
                return false;
            };
            let travel = FASTER * dt * relative_speed(first, second);
            meet_each_other(first, second) && one.bounds.extended(travel).overlaps(&other.bounds)
        };
        self.islands.join_near(reaches, are_near);
        self.islands.settle();
    }

    /// Has bodies go together that came near each other in a step that was tried, and were not known to: whether there are such.
    pub fn plan_again(&mut self, bodies: &impl Systems, dt: f32) -> bool {
        let origin = self.origin(bodies);
        let common = self.common_velocity(bodies) * dt;
        let reaches = meeting(&self.skins, bodies).map(|(place, body)| Reach {
            place: place as u32,
            bounds: swept(body, common).moved(body.origin - origin),
            travel: 0.0,
        });
        let are_near = |one: &Reach, other: &Reach| {
            let both = [one, other].map(|reach| bodies.at(reach.place as usize));
            matches!(both, [Some(first), Some(second)] if meet_each_other(first, second))
        };
        let is_changed = self.islands.join_near(reaches, are_near);
        self.islands.settle();
        is_changed
    }

    /// The mean of the velocities in the middle of what bodies have, m/s.
    fn common_velocity(&self, bodies: &impl Systems) -> Vec3 {
        let middles = meeting(&self.skins, bodies).map(|(_, body)| {
            let all = velocities(body);
            0.5 * (all.min + all.max)
        });
        let (count, sum) = middles.fold((0, Vec3::ZERO), |(count, sum), middle| (count + 1, sum + middle));
        sum / (count.max(1) as f32)
    }

    /// Where the coordinates begin in which bodies are compared.
    fn origin(&self, bodies: &impl Systems) -> DVec3 {
        meeting(&self.skins, bodies)
            .next()
            .map_or(DVec3::ZERO, |(_, body)| body.origin)
    }

    /// Whether all bodies of an island sleep: then nothing of it changes.
    pub fn is_asleep(&self, island: usize, bodies: &impl Systems) -> bool {
        are_asleep(self.islands.members(island), bodies)
    }

    /// Whether all bodies of an island have been at rest for long enough, and may sleep: what is attached does not.
    pub fn is_at_rest(&self, island: usize, bodies: &impl Systems) -> bool {
        let members = self.islands.members(island);
        let mut bound = self.bonds.bodies().flatten();
        members
            .iter()
            .all(|&place| bodies.at(place as usize).is_some_and(System::is_at_rest))
            && !bound.any(|place| members.contains(&(place as u32)))
    }

    /// In how many substeps bodies of an island come no further against each other in one, or parts of one that meets itself, than what they are
    /// made of is small.
    pub fn substeps_wished(&self, island: usize, bodies: &impl Systems, dt: f32) -> u32 {
        let short = |place: usize| self.skins.get(place)?.as_ref().map(|skin| skin.short);
        let wished = |[a, b]: [usize; 2]| {
            let speed = relative_speed(bodies.at(a)?, bodies.at(b)?);
            Some(dt * speed / (TRAVEL * short(a)?.min(short(b)?)))
        };
        let members = self.islands.members(island).iter().map(|&place| place as usize);
        let meets_itself = |place: &usize| bodies.at(*place).is_some_and(|body| body.contact.with_itself);
        let of_one = members.filter(meets_itself).map(|place| [place; 2]);
        let all = of_one.chain(self.islands.pairs(island)).filter_map(wished);
        let wished = all.fold(1.0, f32::max).ceil().min(1e6) as u32;
        let settled = self.pushes.settled(self.islands.members(island));
        let settled = settled.map(|(sides, impulse)| (sides, impulse, 0.0));
        wished.max(self.substeps_pressed(island, bodies, dt, settled))
    }

    /// The same as the contacts of the substep in progress press.
    pub fn substeps_pressed_now(&self, island: usize, bodies: &impl Systems, dt: f32) -> u32 {
        let pressing = self.links.iter().filter(|link| link.presses());
        let all = pressing.map(|link| (link.key(), link.impulses().0, link.fresh_share()));
        self.substeps_pressed(island, bodies, dt, all)
    }

    /// In how many substeps the forces within bodies follow these contacts, of which each gives so much after the equations of implicit ones, N s, and
    /// such a part of that afresh: by the mean, as nodes of slivers bear little. What goes on the softer side follows; a blow stretches the stiffer one.
    fn substeps_pressed(
        &self,
        island: usize,
        bodies: &impl Systems,
        dt: f32,
        pressing: impl Iterator<Item = (Key, f32, f32)>,
    ) -> u32 {
        let members = self.islands.members(island);
        let solution = |&place: &u32| bodies.at(place as usize)?.integrator.solution();
        if members.iter().find_map(solution).is_none() {
            return 0;
        }
        let rates = pressing.filter_map(|(sides, impulse, fresh)| {
            let of_side = |(place, nodes): (usize, [u32; 3])| bodies.at(place).and_then(|body| rate(body, nodes));
            let [a, b] = sides.map(of_side);
            let (low, high) = match (a, b) {
                (Some(a), Some(b)) => (a.min(b), a.max(b)),
                (one, other) => [one.or(other)?; 2].into(),
            };
            let rate = (low * low).lerp(high * high, fresh * fresh).sqrt();
            Some([impulse * rate, impulse])
        });
        let [all, impulse] = rates.fold([0.0; 2], |sums, more| [sums[0] + more[0], sums[1] + more[1]]);
        let substeps = if impulse > 0.0 {
            dt / FOLLOWED * (all / impulse)
        } else {
            0.0
        };
        substeps.ceil().min(1e6) as u32
    }

    /// The speed of the fastest node of an island, m/s, as far as velocities are kept, after a step in this gravity.
    pub fn fastest(&self, island: usize, bodies: &impl Systems, gravity: Vec3, dt: f32) -> f32 {
        let members = self.islands.members(island).iter();
        let members = members.filter_map(|&place| bodies.at(place as usize));
        let speeds = members.map(|body| {
            let all = velocities(body);
            all.magnitudes().length() + dt * body.pull(gravity).length()
        });
        speeds.fold(0.0, f32::max)
    }
}

/// How fast these nodes would swing if all others were held, 1/s; `None` where nothing moves them.
fn rate(body: &System, nodes: [u32; 3]) -> Option<f32> {
    let [mut stiffness, mut mass] = [0.0; 2];
    for (node, _) in nodes.into_iter().flat_map(|node| parts(body.bindings.as_ref(), node)) {
        if body.inverse_masses[node as usize] > 0.0 {
            stiffness += body.forces.stiffness_at(node as usize, 0.0);
            mass += body.masses[node as usize];
        }
    }
    (mass > 0.0).then(|| (stiffness / mass).sqrt())
}

/// Whether the bodies at all these places sleep.
pub(super) fn are_asleep(places: &[u32], bodies: &impl Systems) -> bool {
    let mut places = places.iter();
    places.all(|&place| bodies.at(place as usize).is_some_and(System::is_asleep))
}

/// The bodies that meet tissue, with their places in the world.
fn meeting<'a, B: Systems>(
    skins: &'a [Option<Skin>],
    bodies: &'a B,
) -> impl Iterator<Item = (usize, &'a System)> + use<'a, B> {
    let with_skin = skins.iter().enumerate().filter(|(_, skin)| skin.is_some());
    with_skin.filter_map(|(place, _)| Some((place, bodies.at(place)?)))
}

/// A box about the velocities of a body, m/s, as far as that is kept.
fn velocities(body: &System) -> Bounds {
    let velocities = body.carry.gravity.velocities;
    if velocities.min.is_finite() && velocities.max.is_finite() {
        velocities
    } else {
        Bounds {
            min: Vec3::ZERO,
            max: Vec3::ZERO,
        }
    }
}

/// No node of a body is faster against one of another, or of the same, m/s, as far as their velocities are kept.
fn relative_speed(first: &System, second: &System) -> f32 {
    let [a, b] = [first, second].map(velocities);
    (a.max - b.min).abs().max((b.max - a.min).abs()).length()
}

/// A box about a body as a step that was tried begins, and as it ends beside the displacement that all bodies have in common, and what keeps off it,
/// in its own coordinates.
fn swept(body: &System, common: Vec3) -> Bounds {
    let ends = body.state.newest().0.iter().map(|position| position - common);
    Bounds::of(body.state.positions().iter().chain(ends)).extended(body.contact.thickness + 1e-3 * body.extent())
}
