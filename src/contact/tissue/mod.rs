//! Tissue against tissue, and with itself: a stage of the step between what bodies try alone and what becomes of it.
//!
//! Each body first goes as it would alone, with the forces that the contacts of the last step gave, all through the step. What meets on
//! the straight ways from where nodes were to where they came is stopped by impulses between both sides, with friction, as against a
//! tool; they change the mean velocities of the step and so where it ends (Bridson, Fedkiw, Anderson 2002). What an impulse was over the
//! step's length is the force of the next: at rest the impulses vanish and the forces hold the weight, however long a step is. Both
//! sides get the same, with opposite signs, in the same place: no momentum is made.

mod link;
mod search;
mod skin;

use glam::Vec3;

use self::link::{Carried, Link, Side};
use self::search::{Party, Search, shift};
use self::skin::Skin;
use crate::body::Body;
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

    /// Stops what meets in a step of `dt` seconds that bodies have tried, those that `has_tried` tells.
    pub fn meet(&mut self, bodies: &mut Slots<Body>, dt: f32, has_tried: impl Fn(usize) -> bool) {
        self.links.clear();
        self.found.clear();
        self.found.resize(self.carried.len(), false);
        for (place, skin) in self.skins.iter_mut().enumerate() {
            if let (Some(skin), Some(body)) = (skin, bodies.at(place)) {
                skin.follow(body, dt);
            }
        }
        let mut first = 0.0_f32;
        for search in 0..SEARCHES {
            let known = self.links.len();
            self.find(bodies, dt, &has_tried);
            if search == 0 {
                self.go_on(bodies, dt, &has_tried);
            }
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
        if self.links.is_empty() {
            return;
        }
        for (place, skin) in self.skins.iter().enumerate() {
            if let (Some(skin), Some(body), true) = (skin, bodies.at_mut(place), has_tried(place)) {
                body.deflect(&skin.nodes, &skin.means, dt);
            }
        }
        for link in self.links.iter().filter(|link| link.depth > 0.0) {
            for (place, node, way) in link.parting(PARTED) {
                if let Some(body) = bodies.at_mut(place) {
                    body.part(node, way);
                }
            }
        }
    }

    /// What the step that was tried did goes on in the next.
    pub fn commit(&mut self, dt: f32) {
        self.carried.clear();
        for link in &self.links {
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

    /// Adds the contacts that are not known yet.
    fn find(&mut self, bodies: &Slots<Body>, dt: f32, has_tried: &impl Fn(usize) -> bool) {
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
            let (Some(skin), Some(body), true) = (of_a, bodies.at(a), has_tried(a)) else {
                continue;
            };
            let first = Party { place: a, skin, body };
            for (b, of_b) in skins.iter().enumerate().skip(a) {
                let (Some(skin), Some(body), true) = (of_b, bodies.at(b), has_tried(b)) else {
                    continue;
                };
                let second = Party { place: b, skin, body };
                let Some(radius) = radius(&first, &second) else {
                    continue;
                };
                let friction = first.body.contact.friction.max(second.body.contact.friction);
                let search = Search {
                    parties: [first, second],
                    dt,
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
                    let of_sides = touch
                        .sides
                        .map(|side| if side.body == a { first.body } else { second.body });
                    if let Some(mut link) = Link::new(touch.sides, touch.normal, of_sides) {
                        link.friction = friction;
                        link.allow_gap(touch.gap, dt);
                        if let Some(index) = going_on(carried, found, &touch.sides) {
                            found[index] = true;
                            link.has_given(carried[index].force * dt);
                        }
                        links.push(link);
                    }
                });
            }
        }
    }

    /// Contacts of the last step that were not found again have acted all the same: what was too much is taken back.
    fn go_on(&mut self, bodies: &Slots<Body>, dt: f32, has_tried: &impl Fn(usize) -> bool) {
        for (carried, is_found) in self.carried.iter().zip(&self.found) {
            let places = carried.sides.map(|side| side.body);
            let [Some(first), Some(second)] = places.map(|place| bodies.at(place)) else {
                continue;
            };
            if *is_found || !places.into_iter().all(has_tried) || self.links.len() == self.links.capacity() {
                continue;
            }
            let at = |body: &Body, side: &Side| side.weighted(|node| body.state.positions().get(node));
            let apart = at(first, &carried.sides[0]) + shift(first, second) - at(second, &carried.sides[1]);
            if let Some(mut link) = Link::new(carried.sides, carried.normal, [first, second]) {
                link.allow_gap(apart.dot(carried.normal).max(0.0), dt);
                link.friction = first.contact.friction.max(second.contact.friction);
                link.has_given(carried.force * dt);
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
fn radius(first: &Party, second: &Party) -> Option<f32> {
    let (a, b) = (&first.body.contact, &second.body.contact);
    let shortest = first.skin.shortest.min(second.skin.shortest);
    let apart = (a.thickness + b.thickness).max(LEAST_THICKNESS * shortest);
    if first.place == second.place {
        return a.with_itself.then_some(apart.min(WITH_ITSELF * shortest));
    }
    (a.with_bodies && b.with_bodies && a.filter.meets(b.filter)).then_some(apart)
}
