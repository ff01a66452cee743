//! Tissue against tissue, and with itself. Both sides of a contact get the same impulse, with opposite signs, in the same place: no momentum
//! is made.
//!
//! VERLET bodies that are near each other take their substeps together (`solver/lockstep.rs`). In each, what would come too close is
//! stopped by impulses on velocities, with friction, as against a tool: never a pull, nothing stored, nothing that shortens the substep.
//!
//! A step of IMPLICIT is an equation of one body. There each body goes as it would alone, with the forces that contacts of the last step
//! gave, all through the step. What meets on the straight ways from where nodes were to where they came is stopped by impulses that change the
//! mean velocities of the step and so where it ends (Bridson, Fedkiw, Anderson 2002); what an impulse was over the step's length is the
//! force of the next. At rest the impulses vanish and the forces hold the weight.

mod link;
mod search;
mod skin;

use glam::Vec3;

use self::link::{Carried, Link, Side};
use self::search::{Party, Search, shift};
use self::skin::Skin;
use crate::body::{Body, Bounds};
use crate::diagnostics::StateHasher;
use crate::error::Result;
use crate::memory;
use crate::slots::Slots;

/// Sweeps over the contacts at most, after each search.
const SWEEPS: u32 = 128;

/// The sweeps end when the last changed velocities by less than this part of what the first did.
const CONVERGED: f32 = 1e-5;

/// How often what meets is searched for: impulses lead nodes elsewhere.
const SEARCHES: u32 = 4;

/// The part of what is too close that comes apart in a step.
const PARTED: f32 = 0.2;

/// What keeps off a surface without thickness, as a part of its shortest edge: in `f32` something must.
const LEAST_THICKNESS: f32 = 1e-3;

/// With itself a surface keeps off no further than this part of its shortest edge, or neighbours would meet.
const WITH_ITSELF: f32 = 0.5;

/// Contacts that there is room for, for each node, edge and face of the surfaces.
const ROOM: usize = 1;

/// What of a step is looked at.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moment {
    /// Of the substep or step, s.
    pub duration: f32,
    /// Whether positions change: not with the last half kick of a step.
    pub drifts: bool,
}

/// Contacts of tissue with tissue; kept only in worlds with bodies that ask for them.
#[derive(Debug, Default)]
pub(crate) struct Tissue {
    /// By a body's place in the world.
    skins: Vec<Option<Skin>>,
    links: Vec<Link>,
    /// Of the last step that became current, in the order of their sides.
    carried: Vec<Carried>,
    /// Which of them the step that is tried has found again.
    found: Vec<bool>,
    /// The contacts of earlier searches in the order of their sides.
    known: Vec<u32>,
    /// What was in place of the forces that are carried over, while a step is tried: body, node, force.
    before: Vec<(usize, u32, Vec3)>,
    /// By a body's place: whether forces acted on it before.
    were_applied: Vec<bool>,
}

impl Tissue {
    /// Makes room for a body at this place in the world.
    pub fn join(&mut self, place: usize, body: &mut Body) -> Result<()> {
        if !body.meets_tissue() {
            return Ok(());
        }
        let skin = Skin::new(body)?;
        body.make_room_for_forces()?;
        let more = ROOM * (skin.nodes.len() + skin.edges.len() + skin.triangles.len());
        let room = self.room() + more;
        self.links.try_reserve(room.saturating_sub(self.links.len()))?;
        self.carried.try_reserve(room.saturating_sub(self.carried.len()))?;
        self.found.try_reserve(room.saturating_sub(self.found.len()))?;
        self.known.try_reserve(room.saturating_sub(self.known.len()))?;
        self.before.try_reserve((6 * room).saturating_sub(self.before.len()))?;
        while self.skins.len() <= place {
            memory::push(&mut self.skins, None)?;
            self.were_applied.try_reserve(self.skins.len())?;
        }
        self.skins[place] = Some(skin);
        Ok(())
    }

    /// A body is gone.
    pub fn leave(&mut self, place: usize) {
        if let Some(skin) = self.skins.get_mut(place) {
            *skin = None;
        }
        self.forget(place);
    }

    /// Forgets the contacts of a body: its nodes have been put elsewhere.
    pub fn forget(&mut self, place: usize) {
        self.carried
            .retain(|carried| carried.sides.iter().all(|side| side.body != place));
    }

    fn room(&self) -> usize {
        let of = |skin: &Skin| ROOM * (skin.nodes.len() + skin.edges.len() + skin.triangles.len());
        self.skins.iter().flatten().map(of).sum()
    }

    /// Adds the forces of the last step's contacts to those that act on the bodies in the step to be tried.
    pub fn lend(&mut self, bodies: &mut Slots<Body>) {
        self.before.clear();
        self.were_applied.clear();
        let were_applied = (0..self.skins.len()).map(|place| bodies.at(place).is_some_and(|body| body.forces_applied));
        self.were_applied.extend(were_applied);
        for carried in &self.carried {
            for (side, sign) in carried.sides.iter().zip([1.0, -1.0]) {
                let Some(body) = bodies.at_mut(side.body) else {
                    continue;
                };
                for (node, weight) in side.used() {
                    let before = body.push_node(node, carried.force * (weight * sign));
                    self.before.push((side.body, node as u32, before));
                }
            }
        }
    }

    /// Takes them back.
    pub fn take_back(&mut self, bodies: &mut Slots<Body>) {
        while let Some((place, node, before)) = self.before.pop() {
            if let Some(body) = bodies.at_mut(place) {
                body.set_push(node as usize, before);
                body.forces_applied = self.were_applied[place];
            }
        }
    }

    /// Finds out which bodies take the next step of `dt` seconds together: those of VERLET that may come near each other, and those that
    /// meet themselves.
    pub fn plan(&mut self, bodies: &Slots<Body>, dt: f32) {
        for place in 0..self.skins.len() {
            let is_near = self.skins[place].as_ref().is_some_and(|skin| {
                let Some(body) = bodies.at(place).filter(|_| skin.is_explicit) else {
                    return false;
                };
                body.contact.with_itself
                    || self.others(place).any(|other| {
                        let Some(other) = bodies.at(other) else { return false };
                        meet_each_other(body, other) && reach(body, dt, 2.0).overlaps(&reach(other, dt, 2.0))
                    })
            });
            if let Some(skin) = &mut self.skins[place] {
                skin.goes_together = is_near;
            }
        }
    }

    /// Has bodies go together that went alone in a step that was tried, and came near each other: whether there are such.
    pub fn plan_again(&mut self, bodies: &Slots<Body>) -> bool {
        let mut found = false;
        for place in 0..self.skins.len() {
            let Some(body) = bodies.at(place) else { continue };
            let met = self.skins[place].as_ref().is_some_and(|skin| {
                skin.is_explicit
                    && !skin.goes_together
                    && self.others(place).any(|other| {
                        let Some(other) = bodies.at(other) else { return false };
                        meet_each_other(body, other) && swept(body).overlaps(&swept(other))
                    })
            });
            if let Some(skin) = self.skins[place].as_mut().filter(|_| met) {
                skin.goes_together = true;
                found = true;
            }
        }

        found
    }

    /// The other bodies of VERLET.
    fn others(&self, place: usize) -> impl Iterator<Item = usize> + '_ {
        let explicit = |skin: &Option<Skin>| skin.as_ref().is_some_and(|skin| skin.is_explicit);
        let places = self.skins.iter().enumerate().filter(move |(_, skin)| explicit(skin));
        places.map(|(other, _)| other).filter(move |&other| other != place)
    }

    /// Whether the body at a place takes its substeps together with others.
    pub fn goes_together(&self, place: usize) -> bool {
        let skin = self.skins.get(place).and_then(Option::as_ref);
        skin.is_some_and(|skin| skin.goes_together)
    }

    /// The box of all velocities of a body, given that of those before the contacts of a substep.
    pub fn velocities(&self, place: usize, before: Bounds) -> Bounds {
        match self.skins.get(place) {
            Some(Some(skin)) => before.and(&skin.given),
            _ => before,
        }
    }

    /// Stops what meets in a substep of bodies that go together.
    pub fn meet_together(&mut self, bodies: &mut Slots<Body>, moment: &Moment) {
        self.links.clear();
        self.found.clear();
        for (place, skin) in self.skins.iter_mut().enumerate() {
            if let (Some(skin), Some(body)) = (skin, bodies.at_mut(place))
                && skin.goes_together
            {
                skin.follow_substep(body, moment.duration);
            }
        }
        let meets = |first: &Skin, second: &Skin| first.goes_together && second.goes_together;
        self.solve(bodies, moment.duration, meets, |_| ());
        for link in &self.links {
            for (side, sign) in link.sides.iter().zip([1.0, -1.0]) {
                if let (Some(skin), Some(body)) = (&mut self.skins[side.body], bodies.at_mut(side.body)) {
                    for (node, weight) in side.used() {
                        let velocity = skin.velocities.get(node);
                        skin.given = skin.given.with(velocity);
                        body.nudge(node, velocity, link.given() * (sign * weight), moment);
                    }
                }
            }
        }
        if moment.drifts {
            self.part(bodies, Body::part_substep);
        }
    }

    /// Stops what meets in a step of `dt` seconds that bodies have tried, those that `has_tried` tells, unless both went together.
    pub fn meet(&mut self, bodies: &mut Slots<Body>, dt: f32, has_tried: impl Fn(usize) -> bool) {
        self.links.clear();
        self.found.clear();
        self.found.resize(self.carried.len(), false);
        if self.skins.iter().flatten().all(|skin| skin.is_explicit) {
            return;
        }
        for (place, skin) in self.skins.iter_mut().enumerate() {
            if let (Some(skin), Some(body)) = (skin, bodies.at(place)) {
                skin.follow_step(body, dt);
            }
        }
        let meets = |first: &Skin, second: &Skin| !(first.is_explicit && second.is_explicit);
        let places_tried =
            |links: &mut Vec<Link>| links.retain(|link| link.sides.iter().all(|side| has_tried(side.body)));
        self.solve(bodies, dt, meets, places_tried);
        if self.links.is_empty() {
            return;
        }
        for (place, skin) in self.skins.iter().enumerate() {
            if let (Some(skin), Some(body), true) = (skin, bodies.at_mut(place), has_tried(place)) {
                body.deflect(&skin.nodes, &skin.velocities, dt);
            }
        }
        self.part(bodies, Body::part);
    }

    /// Finds contacts and gives their impulses, until they lead to no others.
    fn solve(
        &mut self,
        bodies: &Slots<Body>,
        duration: f32,
        meets: impl Fn(&Skin, &Skin) -> bool,
        sift: impl Fn(&mut Vec<Link>),
    ) {
        let mut first = 0.0_f32;
        for search in 0..SEARCHES {
            let known = self.links.len();
            self.find(bodies, duration, &meets);
            if search == 0 {
                self.go_on(bodies, duration);
            }
            sift(&mut self.links);
            if self.links.len() == known {
                break;
            }
            for sweep in 0..SWEEPS {
                let changes = self.links.iter_mut().map(|link| link.solve(&mut self.skins));
                let largest = changes.fold(0.0, f32::max);
                if search == 0 && sweep == 0 {
                    first = largest;
                }
                if !(largest > CONVERGED * first) {
                    break;
                }
            }
        }
    }

    /// Moves what began too close apart.
    fn part(&self, bodies: &mut Slots<Body>, part: impl Fn(&mut Body, usize, Vec3)) {
        for link in self.links.iter().filter(|link| link.depth > 0.0) {
            for (place, node, way) in link.parting(PARTED) {
                if let Some(body) = bodies.at_mut(place) {
                    part(body, node, way);
                }
            }
        }
    }

    /// What the step that was tried did goes on in the next.
    pub fn commit(&mut self, dt: f32) {
        self.carried.clear();
        let is_carried = |link: &&Link| {
            let is_implicit = |side: &Side| matches!(&self.skins[side.body], Some(skin) if !skin.is_explicit);
            link.sides.iter().all(is_implicit)
        };
        for link in self.links.iter().filter(is_carried) {
            let force = link.given() / dt;
            if force != Vec3::ZERO && force.is_finite() {
                self.carried.push(Carried {
                    sides: link.sides,
                    normal: link.normal,
                    force,
                });
            }
        }
        self.carried
            .sort_unstable_by_key(|carried| carried.sides.map(|side| side.key()));
    }

    /// Adds the contacts that are not known yet, of those that meet.
    fn find(&mut self, bodies: &Slots<Body>, duration: f32, meets: &impl Fn(&Skin, &Skin) -> bool) {
        let Self {
            skins,
            links,
            carried,
            found,
            known,
            ..
        } = self;
        let key = |link: &Link| link.sides.map(|side| side.key());
        known.clear();
        known.extend(0..links.len() as u32);
        known.sort_unstable_by_key(|&link| key(&links[link as usize]));
        for (a, of_a) in skins.iter().enumerate() {
            let (Some(skin), Some(body_a)) = (of_a, bodies.at(a)) else {
                continue;
            };
            let first = Party { place: a, skin };
            for (b, of_b) in skins.iter().enumerate().skip(a) {
                let (Some(skin), Some(body_b)) = (of_b, bodies.at(b)) else {
                    continue;
                };
                let second = Party { place: b, skin };
                let Some(radius) = radius(&first, &second, [body_a, body_b]).filter(|_| meets(first.skin, skin)) else {
                    continue;
                };
                let friction = body_a.contact.friction.max(body_b.contact.friction);
                let search = Search {
                    parties: [first, second],
                    dt: duration,
                    radius,
                };
                search.run(|touch| {
                    let sides = touch.sides.map(|side| side.key());
                    let is_known = known
                        .binary_search_by_key(&sides, |&link| key(&links[link as usize]))
                        .is_ok();
                    if is_known || links.len() == links.capacity() {
                        return;
                    }
                    let of_sides = touch.sides.map(|side| if side.body == a { body_a } else { body_b });
                    if let Some(mut link) = Link::new(touch.sides, touch.normal, of_sides) {
                        link.friction = friction;
                        link.allow_gap(touch.gap, duration);
                        if let Some(index) = going_on(carried, found, &touch.sides) {
                            found[index] = true;
                            link.has_given(carried[index].force * duration);
                        }
                        links.push(link);
                    }
                });
            }
        }
    }

    /// Contacts of the last step that were not found again have acted all the same: what was too much is taken back.
    fn go_on(&mut self, bodies: &Slots<Body>, duration: f32) {
        for (carried, _) in self.carried.iter().zip(&self.found).filter(|(_, is_found)| !**is_found) {
            let [a, b] = carried.sides.map(|side| side.body);
            let (Some(Some(first)), Some(Some(second))) = (self.skins.get(a), self.skins.get(b)) else {
                continue;
            };
            let [Some(of_first), Some(of_second)] = [a, b].map(|place| bodies.at(place)) else {
                continue;
            };
            if self.links.len() == self.links.capacity() {
                return;
            }
            let at = |skin: &Skin, side: &Side| side.weighted(|node| skin.starts.get(node));
            let apart = at(first, &carried.sides[0]) + shift(first, second) - at(second, &carried.sides[1]);
            if let Some(mut link) = Link::new(carried.sides, carried.normal, [of_first, of_second]) {
                link.allow_gap(apart.dot(carried.normal).max(0.0), duration);
                link.friction = of_first.contact.friction.max(of_second.contact.friction);
                link.has_given(carried.force * duration);
                self.links.push(link);
            }
        }
    }

    /// Adds the bits that the next step depends on.
    pub fn hash_state(&self, hasher: &mut StateHasher) {
        for carried in &self.carried {
            for side in &carried.sides {
                hasher.write_u64(side.body as u64);
                side.nodes.iter().for_each(|&node| hasher.write_u64(u64::from(node)));
                hasher.write_floats(&side.weights);
            }
            hasher.write_floats(&carried.force.to_array());
            hasher.write_floats(&carried.normal.to_array());
        }
    }
}

/// Which contact of the last step goes on in one of these sides: of the first with the same body, wherever it touches that now.
fn going_on(carried: &[Carried], found: &[bool], sides: &[Side; 2]) -> Option<usize> {
    let key = sides[0].key();
    let first = carried.partition_point(|carried| carried.sides[0].key() < key);
    let same = carried[first..].iter().zip(&found[first..]);
    same.take_while(|(carried, _)| carried.sides[0].key() == key)
        .position(|(carried, found)| carried.sides[1].body == sides[1].body && !found)
        .map(|place| first + place)
}

/// How far two bodies, or one with itself, keep apart, m; `None` where they do not meet.
fn radius(first: &Party, second: &Party, bodies: [&Body; 2]) -> Option<f32> {
    let [a, b] = bodies.map(|body| &body.contact);
    let shortest = first.skin.shortest.min(second.skin.shortest);
    let apart = (a.thickness + b.thickness).max(LEAST_THICKNESS * shortest);
    if first.place == second.place {
        return a.with_itself.then_some(apart.min(WITH_ITSELF * shortest));
    }
    meet_each_other(bodies[0], bodies[1]).then_some(apart)
}

fn meet_each_other(first: &Body, second: &Body) -> bool {
    let (a, b) = (&first.contact, &second.contact);
    a.with_bodies && b.with_bodies && a.filter.meets(b.filter)
}

/// A box about what a body may touch in a step of `dt` seconds if it becomes no more than so many times as fast, in the caller's coordinates.
fn reach(body: &Body, dt: f32, faster: f32) -> Bounds {
    let velocities = body.carry.gravity.velocities;
    let fastest = velocities.min.abs().max(velocities.max.abs()).length();
    let way = if fastest.is_finite() {
        faster * fastest * dt
    } else {
        0.0
    };
    let bounds = body.bounds();
    let origin = body.origin.as_vec3();
    Bounds {
        min: bounds.min + origin,
        max: bounds.max + origin,
    }
    .extended(way + 2.0 * body.contact.thickness + 0.01 * body.extent())
}

/// A box about a body as a step that was tried begins and as it ends, and what keeps off it, in the caller's coordinates.
fn swept(body: &Body) -> Bounds {
    let origin = body.origin.as_vec3();
    let both = body.state.positions().iter().chain(body.state.newest().0.iter());
    Bounds::of(both.map(|position| position + origin)).extended(body.contact.thickness + 1e-3 * body.extent())
}
