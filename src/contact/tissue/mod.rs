//! Tissue against tissue, and with itself.
//!
//! Bodies that are near each other take their substeps together (`solver/lockstep.rs`). In each, what would come too close on the straight ways of
//! the nodes is stopped by impulses, with friction, as against a tool: never a pull, nothing stored, nothing that shortens the substep
//! (sequential impulses, Catto 2005, on the pairs of Bridson, Fedkiw, Anderson 2002: nodes with faces, edges with edges). Both sides get the same
//! impulse, with opposite signs, in the same place: no momentum is made.

mod bonds;
mod link;
mod search;
mod skin;

pub(crate) use self::bonds::{Bonds, Corner};
use self::link::Link;
use self::search::{Party, Search};
use self::skin::Skin;
use glam::Vec3;

use crate::body::{Body, Bounds};
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

impl Moment {
    /// Whether a body has a part in it: that which closes a step is VERLET's.
    fn concerns(&self, body: &Body) -> bool {
        self.drifts || body.implicit.is_none()
    }
}

/// Contacts of tissue with tissue; kept only in worlds with bodies that ask for them.
#[derive(Debug, Default)]
pub(crate) struct Tissue {
    /// By a body's place in the world.
    skins: Vec<Option<Skin>>,
    links: Vec<Link>,
    /// The contacts of earlier searches in the order of their sides.
    known: Vec<u32>,
    /// What is attached.
    pub bonds: Bonds,
}

impl Tissue {
    /// Makes room for a body at this place in the world.
    pub fn join(&mut self, place: usize, body: &mut Body) -> Result<()> {
        if !body.meets_tissue() {
            return Ok(());
        }
        let skin = Skin::new(body)?;
        let more = ROOM * (skin.nodes.len() + skin.edges.len() + skin.triangles.len());
        let room = self.room() + more;
        self.links.try_reserve(room.saturating_sub(self.links.len()))?;
        self.known.try_reserve(room.saturating_sub(self.known.len()))?;
        while self.skins.len() <= place {
            memory::push(&mut self.skins, None)?;
        }
        self.skins[place] = Some(skin);
        Ok(())
    }

    /// A body is gone.
    pub fn leave(&mut self, bodies: &mut Slots<Body>, place: usize) {
        self.bonds.leave(bodies, place);
        if let Some(skin) = self.skins.get_mut(place) {
            *skin = None;
        }
    }

    fn room(&self) -> usize {
        let of = |skin: &Skin| ROOM * (skin.nodes.len() + skin.edges.len() + skin.triangles.len());
        self.skins.iter().flatten().map(of).sum()
    }

    /// Finds out which bodies take the next step of `dt` seconds together: those that may come near each other, and those that meet
    /// themselves.
    pub fn plan(&mut self, bodies: &Slots<Body>, dt: f32) {
        for place in 0..self.skins.len() {
            let is_near = self.skins[place].as_ref().is_some_and(|_| {
                let Some(body) = bodies.at(place) else {
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
                !skin.goes_together
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

    /// The other bodies that meet tissue.
    fn others(&self, place: usize) -> impl Iterator<Item = usize> + '_ {
        let places = self.skins.iter().enumerate().filter(|(_, skin)| skin.is_some());
        places.map(|(other, _)| other).filter(move |&other| other != place)
    }

    /// Whether the body at a place takes its substeps together with others.
    pub fn goes_together(&self, place: usize) -> bool {
        let skin = self.skins.get(place).and_then(Option::as_ref);
        skin.is_some_and(|skin| skin.goes_together) || self.bonds.concern(place)
    }

    /// The box of all velocities of a body, given that of those before the contacts of a substep.
    pub fn velocities(&self, place: usize, before: Bounds) -> Bounds {
        let before = self.bonds.velocities(place, before);
        match self.skins.get(place) {
            Some(Some(skin)) => before.and(&skin.given),
            _ => before,
        }
    }

    /// Stops what meets in a substep of bodies that go together.
    pub fn meet_together(&mut self, bodies: &mut Slots<Body>, moment: &Moment) {
        self.links.clear();
        for (place, skin) in self.skins.iter_mut().enumerate() {
            if let (Some(skin), Some(body)) = (skin, bodies.at_mut(place))
                && skin.goes_together
                && moment.concerns(body)
            {
                skin.follow(body, moment.duration);
            }
        }
        self.bonds.follow(bodies, &self.skins, moment);
        self.solve(bodies, moment);
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
        self.bonds.give(bodies, &self.skins, moment);
        if moment.drifts {
            self.part(bodies, Body::part_substep);
            self.bonds.part(bodies, moment.duration);
        }
    }

    /// Finds contacts and gives their impulses, until they lead to no others.
    fn solve(&mut self, bodies: &Slots<Body>, moment: &Moment) {
        let mut first = 0.0_f32;
        for search in 0..SEARCHES {
            let known = self.links.len();
            self.find(bodies, moment);
            if self.links.len() == known && (search > 0 || self.bonds.is_empty()) {
                break;
            }
            for sweep in 0..SWEEPS {
                let changes = self.links.iter_mut().map(|link| link.solve(&mut self.skins));
                let largest = changes.fold(0.0, f32::max).max(self.bonds.sweep(&mut self.skins));
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

    /// Adds the contacts that are not known yet, of those that meet.
    fn find(&mut self, bodies: &Slots<Body>, moment: &Moment) {
        let Self {
            skins,
            links,
            known,
            bonds,
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
                let is_looked_at = moment.concerns(body_a) && moment.concerns(body_b);
                let Some(radius) = radius(&first, &second, [body_a, body_b])
                    .filter(|_| is_looked_at && first.skin.goes_together && skin.goes_together)
                else {
                    continue;
                };
                let friction = body_a.contact.friction.max(body_b.contact.friction);
                let search = Search {
                    parties: [first, second],
                    dt: moment.duration,
                    radius,
                };
                search.run(|touch| {
                    let sides = touch.sides.map(|side| side.key());
                    let is_known = known
                        .binary_search_by_key(&sides, |&link| key(&links[link as usize]))
                        .is_ok();
                    if is_known || links.len() == links.capacity() || bonds.join(&touch.sides) {
                        return;
                    }
                    let of_sides = touch.sides.map(|side| if side.body == a { body_a } else { body_b });
                    if let Some(mut link) = Link::new(touch.sides, touch.normal, of_sides) {
                        link.friction = friction;
                        link.allow_gap(touch.gap, moment.duration);
                        links.push(link);
                    }
                });
            }
        }
    }
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
    let bounds = body.local_bounds();
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
