//! Tissue against tissue, and with itself.
//!
//! Bodies that are near each other take their substeps together (`solver/lockstep.rs`). In each, what would come too close on the straight ways of
//! the nodes is stopped by impulses, with friction, as against a tool: never a pull, nothing stored, nothing that shortens the substep
//! (sequential impulses, Catto 2005, on the pairs of Bridson, Fedkiw, Anderson 2002: nodes with faces, edges with edges). Both sides get the same
//! impulse, with opposite signs, in the same place: no momentum is made.

mod bonds;
mod change;
mod crossing;
mod groups;
mod images;
mod link;
mod nearby;
mod search;
mod skin;
mod wound;

pub(crate) use self::bonds::{Bonds, Bound, Lead, Thread, are_one, distance};
pub(crate) use self::change::{SkinChange, SurfaceToBe};
use self::groups::Groups;
use self::link::Link;
use self::link::Side;
use self::search::{Party, Search};
pub(crate) use self::skin::Skin;
use glam::Vec3;

use crate::base::{Result, memory};
use crate::body::Body;
use crate::codec::saved;
use crate::contact::impulses::{PUSHED_OUT, SWEEPS, Sweep, relax};
use crate::geometry::Bounds;
use crate::ids::Slots;

/// How often what meets is searched for: impulses lead nodes elsewhere.
const SEARCHES: u32 = 16;

/// What keeps off a surface without thickness, as a part of its short edges: in `f32` something must.
const LEAST_THICKNESS: f32 = 1e-3;

/// It is foreseen that a body becomes so many times as fast in a step; where it is faster, the step is taken again.
const FASTER: f32 = 2.0;

/// How far bodies come against each other in a substep, as a part of the short edges.
const TRAVEL: f32 = 0.5;

/// What moves three corners, each of them bound to four nodes at most.
const MOST_MOVERS: usize = 12;

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
    groups: Groups,
    /// By a body's place in the world.
    skins: Vec<Option<Skin>>,
    links: Vec<Link>,
    /// The contacts of earlier searches in the order of their sides.
    known: Vec<u32>,
    /// What is attached.
    pub bonds: Bonds,
}

saved!(Tissue {
    groups,
    skins,
    links,
    known,
    bonds
});

impl Tissue {
    /// Makes room for a body at this place in the world, which meets tissue.
    pub fn join(&mut self, place: usize, body: &Body) -> Result<()> {
        let mut skin = Skin::new(body)?;
        self.add_images(&mut skin)?;
        self.groups.make_place(place)?;
        let more = ROOM * skin.room;
        let room = self.room() + more;
        self.links.try_reserve(room.saturating_sub(self.links.len()))?;
        self.known.try_reserve(room.saturating_sub(self.known.len()))?;
        while self.skins.len() <= place {
            memory::push(&mut self.skins, None)?;
        }
        self.skins[place] = Some(skin);
        Ok(())
    }

    /// Makes room for so many attachments between the bodies at these places.
    pub fn reserve_bonds(&mut self, places: [usize; 2], count: usize) -> Result<()> {
        for place in places {
            self.groups.make_place(place)?;
        }
        self.bonds.reserve(count)
    }

    /// Has a new surface, and those that it may meet, be found in images where one of two asks for that.
    fn add_images(&mut self, skin: &mut Skin) -> Result<()> {
        for other in self.skins.iter_mut().flatten() {
            if skin.meets_bodies && other.meets_bodies && (skin.asks_for_images || other.asks_for_images) {
                other.add_images()?;
                skin.add_images()?;
            }
        }
        // The first of its world too is refused what it asks for.
        if skin.asks_for_images {
            skin.add_images()?;
        }
        Ok(())
    }

    /// The skin of the body at this place, if it meets tissue.
    pub fn skin_mut(&mut self, place: usize) -> Option<&mut Skin> {
        self.skins.get_mut(place)?.as_mut()
    }

    /// A body is gone.
    pub fn leave(&mut self, bodies: &mut Slots<Body>, place: usize) {
        self.bonds.leave(bodies, place);
        if let Some(skin) = self.skins.get_mut(place) {
            *skin = None;
        }
    }

    fn room(&self) -> usize {
        let of_skins = self.skins.iter().flatten();
        of_skins.map(|skin| ROOM * skin.room).sum()
    }

    /// Finds out which bodies take the next step of `dt` seconds together: those that may come near each other, those that are attached,
    /// and by themselves those that meet themselves.
    pub fn plan(&mut self, bodies: &Slots<Body>, dt: f32) {
        self.groups.part(|place| {
            let meets_itself = |body: &Body| body.meets_tissue() && body.contact.with_itself;
            bodies.at(place).is_some_and(meets_itself)
        });
        for [first, second] in self.bonds.bodies() {
            self.groups.join(first, second);
        }
        self.join_those(bodies, |first, second| reach(first, dt).overlaps(&reach(second, dt)));
    }

    /// Has bodies go together that came near each other in a step that was tried, and did not go together: whether there are such.
    pub fn plan_again(&mut self, bodies: &Slots<Body>) -> bool {
        self.join_those(bodies, |first, second| swept(first).overlaps(&swept(second)))
    }

    /// Joins the groups of bodies that meet each other and are near, as this tells: whether that changed any.
    fn join_those(&mut self, bodies: &Slots<Body>, are_near: impl Fn(&Body, &Body) -> bool) -> bool {
        let mut changed = false;
        for a in 0..self.skins.len() {
            for b in 0..a {
                let has_skin = |place: usize| self.skins[place].is_some();
                if !(has_skin(a) && has_skin(b)) || self.groups.are_one(a, b) {
                    continue;
                }
                if let (Some(first), Some(second)) = (bodies.at(a), bodies.at(b))
                    && meet_each_other(first, second)
                    && are_near(first, second)
                {
                    self.groups.join(a, b);
                    changed = true;
                }
            }
        }
        changed
    }

    /// How many groups there may be: their numbers are below.
    pub fn groups(&self) -> usize {
        self.groups.count()
    }

    /// The group of bodies that the one at a place takes its substeps together with.
    pub fn group(&self, place: usize) -> Option<usize> {
        self.groups.of(place)
    }

    /// Finds the edges of bodies that go together that pass through tissue when a step begins, or as one that was tried ends: how many
    /// there are.
    pub fn find_crossings(&mut self, bodies: &Slots<Body>, at_end: bool) -> u32 {
        let mut count = 0_u32;
        for (place, skin) in self.skins.iter_mut().enumerate() {
            if let (Some(skin), Some(body)) = (skin, bodies.at(place))
                && self.groups.of(place).is_some()
            {
                skin.stand(body, at_end);
            }
        }
        for a in 0..self.skins.len() {
            // It is written to while others are read.
            let Some(mut first) = self.skins[a].take() else {
                continue;
            };
            let mut pierces = std::mem::take(&mut first.pierces);
            pierces.fill(false);
            if let (Some(body), true) = (bodies.at(a), self.groups.of(a).is_some()) {
                let join = |b: usize, edge: &[u32], triangle: &[u32]| {
                    !self.bonds.are_none() && join_movers(&self.bonds, bodies, [a, b], [edge, triangle])
                };
                if body.contact.with_itself {
                    let are_joined = |edge: &[u32], triangle: &[u32]| {
                        edge.iter().any(|node| triangle.contains(node)) || join(a, edge, triangle)
                    };
                    count = count.saturating_add(crossing::mark(&first, &first, are_joined, &mut pierces));
                }
                for (b, second) in self.skins.iter().enumerate() {
                    if let (Some(second), Some(other)) = (second, bodies.at(b))
                        && self.groups.are_one(a, b)
                        && meet_each_other(body, other)
                    {
                        let are_joined = |edge: &[u32], triangle: &[u32]| join(b, edge, triangle);
                        count = count.saturating_add(crossing::mark(&first, second, are_joined, &mut pierces));
                    }
                }
            }
            first.pierces = pierces;
            self.skins[a] = Some(first);
        }
        count
    }

    /// In how many substeps bodies of a group come no further against each other in one than what they are made of is small.
    pub fn substeps_wished(&self, group: usize, bodies: &Slots<Body>, dt: f32) -> u32 {
        let members = self.skins.iter().enumerate().filter_map(|(place, skin)| {
            let skin = skin.as_ref().filter(|_| self.groups.of(place) == Some(group))?;
            Some((skin.short, speed(bodies.at(place)?)))
        });
        let (shortest, speeds) = members.fold((f32::INFINITY, 0.0), |(least, sum), (shortest, speed)| {
            (shortest.min(least), sum + speed)
        });
        let wished = (dt * speeds / (TRAVEL * shortest)).ceil();
        wished.clamp(1.0, 1e6) as u32
    }

    /// The box of all velocities of a body, given that of those before the contacts of a substep.
    pub fn velocities(&self, place: usize, before: Bounds) -> Bounds {
        let before = self.bonds.velocities(place, before);
        match self.skins.get(place) {
            Some(Some(skin)) => before.and(&skin.given),
            _ => before,
        }
    }

    /// Stops what meets in a substep of the bodies of a group.
    pub fn meet(&mut self, group: usize, bodies: &mut Slots<Body>, moment: &Moment) {
        self.links.clear();
        for (place, skin) in self.skins.iter_mut().enumerate() {
            if let (Some(skin), Some(body)) = (skin, bodies.at_mut(place))
                && self.groups.of(place) == Some(group)
                && moment.concerns(body)
            {
                skin.follow(body, moment.duration);
            }
        }
        self.bonds.follow(bodies, &self.skins, moment);
        self.draw(group, bodies, moment);
        self.solve(group, bodies, moment);
        for link in &self.links {
            for (index, (side, sign)) in link.sides.iter().zip([1.0, -1.0]).enumerate() {
                if let (Some(skin), Some(body)) = (&mut self.skins[side.body], bodies.at_mut(side.body)) {
                    for (node, part) in link.movers(index) {
                        let node = node as usize;
                        let velocity = skin.velocities.get(node);
                        skin.given = skin.given.with(velocity);
                        body.nudge(node, velocity, link.given() * (sign * part), moment);
                    }
                }
            }
        }
        self.bonds.give(bodies, &self.skins, moment);
        if moment.drifts {
            self.part(bodies, moment.duration, Body::part_substep);
            self.bonds.part(bodies, moment.duration);
        }
    }

    /// Draws what of each surface is near others that it is found by in images, as the substep begins.
    fn draw(&mut self, group: usize, bodies: &Slots<Body>, moment: &Moment) {
        for a in 0..self.skins.len() {
            // It is written to while others are read.
            let Some(mut first) = self.skins[a].take() else {
                continue;
            };
            if let Some(body) = bodies.at(a)
                && first.images.is_some()
                && self.groups.of(a) == Some(group)
                && moment.concerns(body)
            {
                let mut part = Bounds::EMPTY;
                for (b, other) in self.skins.iter().enumerate() {
                    if let (Some(other), Some(other_body)) = (other, bodies.at(b))
                        && self.groups.of(b) == Some(group)
                        && moment.concerns(other_body)
                        && meet_in_images(&first, other)
                    {
                        let parties = [(a, &first), (b, other)].map(|(place, skin)| Party { place, skin });
                        if let Some(radius) = radius(&parties[0], &parties[1], [body, other_body]) {
                            part = part.and(&near(&first, other, radius));
                        }
                    }
                }
                first.draw(&part);
            }
            self.skins[a] = Some(first);
        }
    }

    /// Finds contacts and gives their impulses, until they lead to no others.
    fn solve(&mut self, group: usize, bodies: &Slots<Body>, moment: &Moment) {
        let mut first = None;
        for _ in 0..SEARCHES {
            let known = self.links.len();
            if first.is_some() {
                self.go_on(group, bodies, moment);
            }
            self.find(group, bodies, moment);
            if self.links.len() == known && (first.is_some() || !self.bonds.act()) {
                break;
            }
            let Self {
                links, skins, bonds, ..
            } = self;
            first = Some(relax(SWEEPS, first, |sweep| {
                let links = links.iter_mut().filter(|link| sweep == Sweep::All || link.presses());
                let changes = links.map(|link| link.solve(skins));
                changes.fold(0.0, f32::max).max(bonds.sweep(skins, moment))
            }));
        }
    }

    /// Has what impulses did to nodes be seen in what is bound to them.
    fn go_on(&mut self, group: usize, bodies: &Slots<Body>, moment: &Moment) {
        for (place, skin) in self.skins.iter_mut().enumerate() {
            if let (Some(skin), Some(body)) = (skin, bodies.at(place))
                && self.groups.of(place) == Some(group)
                && moment.concerns(body)
            {
                skin.go_on(body, moment.duration);
            }
        }
    }

    /// Moves what began too close apart.
    fn part(&self, bodies: &mut Slots<Body>, duration: f32, part: impl Fn(&mut Body, usize, Vec3)) {
        for link in self.links.iter().filter(|link| link.depth > 0.0) {
            for (place, node, way) in link.parting(PUSHED_OUT, duration) {
                if let Some(body) = bodies.at_mut(place) {
                    part(body, node, way);
                }
            }
        }
    }

    /// Adds the contacts that are not known yet, of those that meet.
    fn find(&mut self, group: usize, bodies: &Slots<Body>, moment: &Moment) {
        let Self {
            skins,
            links,
            known,
            bonds,
            groups,
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
                    .filter(|_| is_looked_at && [groups.of(a), groups.of(b)] == [Some(group); 2])
                else {
                    continue;
                };
                let friction = body_a.contact.friction.max(body_b.contact.friction);
                let search = Search {
                    parties: [first, second],
                    dt: moment.duration,
                    radius,
                    in_images: a != b && meet_in_images(first.skin, skin),
                };
                search.run(|touch| {
                    let sides = touch.sides.map(|side| side.key());
                    let is_known = known
                        .binary_search_by_key(&sides, |&link| key(&links[link as usize]))
                        .is_ok();
                    if is_known || links.len() == links.capacity() || are_joined(bonds, bodies, &touch.sides) {
                        return;
                    }
                    let of_sides = touch.sides.map(|side| if side.body == a { body_a } else { body_b });
                    if let Some(mut link) = Link::new(touch.sides, touch.normal, of_sides) {
                        link.friction = friction;
                        link.is_parted = touch.is_parted;
                        link.allow_gap(touch.gap, moment.duration);
                        links.push(link);
                    }
                });
            }
        }
    }
}

/// Whether a bond makes one point of nodes of both sides.
fn are_joined(bonds: &Bonds, bodies: &Slots<Body>, sides: &[Side; 2]) -> bool {
    let [a, b] = sides;
    !bonds.are_none() && join_movers(bonds, bodies, [a.body, b.body], [&a.nodes, &b.nodes])
}

/// The same of corners of surfaces: what those are bound to counts.
fn join_movers(bonds: &Bonds, bodies: &Slots<Body>, places: [usize; 2], corners: [&[u32]; 2]) -> bool {
    let mut movers = [[0; MOST_MOVERS]; 2];
    let mut counts = [0; 2];
    for side in 0..2 {
        let body = bodies.at(places[side]);
        let all = corners[side]
            .iter()
            .flat_map(|&corner| body.into_iter().flat_map(move |body| body.movers(corner)));
        for (to, (node, _)) in movers[side].iter_mut().zip(all) {
            *to = node;
            counts[side] += 1;
        }
    }
    bonds.join(places, [0, 1].map(|side| &movers[side][..counts[side]]))
}

/// How far two bodies, or one with itself, keep apart, m; `None` where they do not meet.
fn radius(first: &Party, second: &Party, bodies: [&Body; 2]) -> Option<f32> {
    let [a, b] = bodies.map(|body| &body.contact);
    if first.place == second.place {
        return first.skin.radius_with_itself(a);
    }
    let shortest = first.skin.short.min(second.skin.short);
    let apart = (a.thickness + b.thickness).max(LEAST_THICKNESS * shortest);
    meet_each_other(bodies[0], bodies[1]).then_some(apart)
}

/// Whether two bodies that meet are found in images.
fn meet_in_images(first: &Skin, second: &Skin) -> bool {
    first.asks_for_images || second.asks_for_images
}

/// A box about what of a surface another may meet that it keeps `radius` away from.
fn near(skin: &Skin, other: &Skin, radius: f32) -> Bounds {
    let margin = radius + skin.short + FASTER * (skin.travel + other.travel);
    let shift = search::shift(other, skin);
    let (own, others) = (skin.forest.bounds(), other.forest.bounds());
    Bounds {
        min: (others.min + shift - margin).max(own.min),
        max: (others.max + shift + margin).min(own.max),
    }
}

fn meet_each_other(first: &Body, second: &Body) -> bool {
    let (a, b) = (&first.contact, &second.contact);
    a.with_bodies && b.with_bodies && a.filter.meets(b.filter)
}

/// A box about what a body may touch in a step of `dt` seconds, in the caller's coordinates.
fn reach(body: &Body, dt: f32) -> Bounds {
    let way = FASTER * speed(body) * dt;
    let bounds = body.local_bounds();
    let origin = body.origin.as_vec3();
    Bounds {
        min: bounds.min + origin,
        max: bounds.max + origin,
    }
    .extended(way + 2.0 * body.contact.thickness + 0.01 * body.extent())
}

/// No node of a body is faster, m/s, as far as that is kept.
fn speed(body: &Body) -> f32 {
    let velocities = body.carry.gravity.velocities;
    let fastest = velocities.min.abs().max(velocities.max.abs()).length();
    if fastest.is_finite() { fastest } else { 0.0 }
}

/// A box about a body as a step that was tried begins and as it ends, and what keeps off it, in the caller's coordinates.
fn swept(body: &Body) -> Bounds {
    let origin = body.origin.as_vec3();
    let both = body.state.positions().iter().chain(body.state.newest().0.iter());
    Bounds::of(both.map(|position| position + origin)).extended(body.contact.thickness + 1e-3 * body.extent())
}
