//! Tissue against tissue, and with itself.
//!
//! Bodies that are near each other take their substeps together (`lockstep.rs`). In each, what would come too close on the straight ways of
//! the nodes is stopped by impulses, with friction, as against a tool: never a pull, nothing stored, nothing that shortens the substep
//! (sequential impulses, Catto 2005, on the pairs of Bridson, Fedkiw, Anderson 2002: nodes with faces, edges with edges). Both sides get the same
//! impulse, with opposite signs, in the same place: no momentum is made.

mod bonds;
mod change;
mod clearances;
mod crossing;
mod entangled;
mod flatness;
mod groups;
mod images;
mod islands;
mod link;
mod lockstep;
mod nearby;
mod pairs;
mod search;
mod skin;
mod warm_start;
mod wound;

pub(crate) use self::bonds::{Bonds, Bound, Lead, Thread, are_one, distance};
pub(crate) use self::change::{SkinChange, SurfaceToBe};
use self::clearances::Clearances;
use self::entangled::Entangled;
use self::groups::Groups;
use self::islands::{Islands, Reach};
use self::link::{Link, Side};
pub(crate) use self::lockstep::{CoupledBody, CoupledGroup};
use self::pairs::Pairs;
use self::search::{Measure, Party, Search};
pub(crate) use self::skin::Skin;
use self::warm_start::{Pushes, give_again};
use glam::{DVec3, Vec3};

use crate::base::{Count, Result, Stage, Stopwatch, memory};
use crate::codec::saved;
use crate::contact::Contacts;
use crate::contact::impulses::{Effort, PUSHED_OUT, Sweep, relax};
use crate::geometry::Bounds;
use crate::solver::{Span, System, Systems};

/// How often what meets is searched for: impulses lead nodes elsewhere.
const SEARCHES: u32 = 16;

/// Contacts of tissue begin with the impulses of the last substep, and the next one corrects what few sweeps leave.
const EFFORT: Effort = Effort {
    sweeps: 32,
    converged: 2.5e-4,
    goes_on_later: true,
};

/// An edge meets so many edges at most. With the closest alone, an edge that lies across several would be held up by each in turn, and tremble.
const EDGES: usize = 4;

/// What keeps off a surface without thickness, as a part of its short edges: in `f32` something must.
const LEAST_THICKNESS: f32 = 1e-3;

/// It is foreseen that a body becomes so many times as fast in a step; where it is faster, the step is taken again.
const FASTER: f32 = 2.0;

/// How far bodies come against each other in a substep, as a part of the short edges.
const TRAVEL: f32 = 0.5;

/// How fast one contact moves what began too close apart at most, as a part of the smaller body's extent, 1/s. The bodies keep about this speed, so
/// it bounds the energy that they gain.
const PARTING_SPEED: f32 = 0.3;

/// How much further than they can come bodies count as near, as a part of their extents.
const MARGIN: f32 = 0.005;

/// What moves three corners, each of them bound to four nodes at most.
const MOST_MOVERS: usize = 12;

/// Contacts that there is room for, for each node, edge and face of the surfaces.
const ROOM: usize = 1;

/// Contacts of tissue with tissue; kept only in worlds with bodies that ask for them.
#[derive(Debug, Default)]
pub(crate) struct Tissue {
    pub islands: Islands,
    /// By a body's place in the world.
    skins: Vec<Option<Skin>>,
    /// Likewise, of bodies that meet others.
    clearances: Vec<Option<Clearances>>,
    /// Bodies that were made through each other.
    entangled: Entangled,
    links: Vec<Link>,
    /// The contacts of earlier searches in the order of their sides.
    known: Vec<u32>,
    /// What contacts gave before.
    pub pushes: Pushes,
    /// What bodies are near each other with.
    pairs: Pairs,
    /// Bodies that fell asleep together.
    pub groups: Groups,
    /// What is attached.
    pub bonds: Bonds,
}

saved!(Tissue {
    islands,
    skins,
    clearances,
    entangled,
    links,
    known,
    pushes,
    pairs,
    groups,
    bonds
});

impl Tissue {
    /// Makes room for a body at this place in the world, which meets tissue.
    pub fn join(&mut self, place: usize, body: &System) -> Result<()> {
        let mut skin = Skin::new(body)?;
        self.add_images(&mut skin)?;
        self.islands.make_place(place)?;
        self.groups.make_place(place)?;
        self.entangled.reserve(self.skins.iter().flatten().count())?;
        let more = ROOM * skin.room;
        let room = self.room() + more;
        self.links.try_reserve(room.saturating_sub(self.links.len()))?;
        self.known.try_reserve(room.saturating_sub(self.known.len()))?;
        self.pushes.reserve(room)?;
        let features = |skin: &Skin| skin.nodes.capacity() + skin.edges.capacity();
        let known = self.skins.iter().flatten().map(features).sum::<usize>();
        self.pairs.reserve(known + features(&skin), self.islands.room())?;
        let spare = body.spare_nodes();
        let clearances = if body.contact.with_bodies {
            Some(Clearances::new(skin.nodes.len() + spare, skin.edges.len() + 3 * spare)?)
        } else {
            None
        };
        while self.skins.len() <= place {
            memory::push(&mut self.skins, None)?;
        }
        while self.clearances.len() <= place {
            memory::push(&mut self.clearances, None)?;
        }
        self.clearances[place] = clearances;
        self.skins[place] = Some(skin);
        Ok(())
    }

    /// Makes room for so many attachments between the bodies at these places.
    pub fn reserve_bonds(&mut self, places: [usize; 2], count: usize) -> Result<()> {
        for place in places {
            self.islands.make_place(place)?;
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
    pub fn leave(&mut self, bodies: &mut impl Systems, place: usize) {
        self.bonds.leave(bodies, place);
        for other in self.groups.others(place) {
            if let Some(body) = bodies.at_mut(other) {
                body.wake();
            }
        }
        self.groups.leave(place);
        self.shed(place);
    }

    /// A body meets no tissue any more; what is attached of it stays so.
    pub fn shed(&mut self, place: usize) {
        self.entangled.leave(place);
        self.pushes.leave(place);
        if let Some(skin) = self.skins.get_mut(place) {
            *skin = None;
        }
        if let Some(clearances) = self.clearances.get_mut(place) {
            *clearances = None;
        }
    }

    fn room(&self) -> usize {
        let of_skins = self.skins.iter().flatten();
        of_skins.map(|skin| ROOM * skin.room).sum()
    }

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

    /// Finds the edges of bodies that go together that pass through tissue when a step begins, or as one that was tried ends: how many
    /// there are.
    pub fn find_crossings(&mut self, bodies: &impl Systems, at_end: bool) -> u32 {
        let mut count = 0_u32;
        let islands = std::mem::take(&mut self.islands);
        for island in 0..islands.count() {
            let members = islands.members(island).iter().map(|&place| place as usize);
            if are_asleep(islands.members(island), bodies) {
                let skins = members.filter_map(|place| self.skins.get(place)?.as_ref());
                count = skins.fold(count, |count, skin| count.saturating_add(skin.crossings));
                continue;
            }
            for place in members.clone() {
                if let (Some(Some(skin)), Some(body)) = (self.skins.get_mut(place), bodies.at(place)) {
                    skin.stand(body, at_end);
                    skin.pierces.fill(false);
                    skin.crossings = 0;
                }
            }
            for a in members {
                if bodies.at(a).is_some_and(|body| body.contact.with_itself) {
                    count = count.saturating_add(self.mark_crossings(bodies, [a; 2]));
                }
            }
            for [a, b] in islands.pairs(island) {
                if let (Some(first), Some(second)) = (bodies.at(a), bodies.at(b))
                    && meet_each_other(first, second)
                {
                    let of_pair = [[a, b], [b, a]].map(|pair| self.mark_crossings(bodies, pair));
                    count = of_pair.into_iter().fold(count, u32::saturating_add);
                    if !at_end {
                        self.entangle([a, b], of_pair != [0; 2]);
                    }
                }
            }
        }
        self.islands = islands;
        count
    }

    /// Has two open surfaces that were made through each other let go, and those that no longer cross keep each other off again, from as near as
    /// they are.
    fn entangle(&mut self, pair: [usize; 2], cross: bool) {
        let [Some(Some(first)), Some(Some(second))] = pair.map(|place| self.skins.get(place)) else {
            return;
        };
        let Ok([Some(kept_a), Some(kept_b)]) = self.clearances.get_disjoint_mut(pair) else {
            return;
        };
        if !cross {
            if self.entangled.remove(pair) {
                (kept_a.is_new, kept_b.is_new) = (true, true);
            }
            return;
        }
        let are_open = !first.is_closed && !second.is_closed;
        if are_open && (kept_a.is_new || kept_b.is_new) {
            // Surfaces that lie flush on each other cross by rounding.
            let depth = first.least_thickness().min(second.least_thickness());
            if crossing::is_deep(first, second, depth) || crossing::is_deep(second, first, depth) {
                self.entangled.add(pair);
            }
        }
    }

    /// Marks the edges of the first of two bodies, or of one, that pass through triangles of the second: how many there are.
    fn mark_crossings(&mut self, bodies: &impl Systems, [a, b]: [usize; 2]) -> u32 {
        // It is written to while both are read.
        let Some(Some(first)) = self.skins.get_mut(a) else {
            return 0;
        };
        let mut pierces = std::mem::take(&mut first.pierces);
        let mut count = 0;
        if let (Some(Some(first)), Some(Some(second))) = (self.skins.get(a), self.skins.get(b)) {
            let are_joined = |edge: &[u32], triangle: &[u32]| {
                a == b && edge.iter().any(|node| triangle.contains(node))
                    || !self.bonds.are_none() && join_movers(&self.bonds, bodies, [a, b], [edge, triangle])
            };
            count = crossing::mark(first, second, are_joined, &mut pierces);
        }
        if let Some(Some(first)) = self.skins.get_mut(a) {
            first.pierces = pierces;
            first.crossings = first.crossings.saturating_add(count);
        }
        count
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
        all.fold(1.0, f32::max).ceil().min(1e6) as u32
    }

    /// The box of all velocities of a body, given that of those before the contacts of a substep.
    pub fn velocities(&self, place: usize, before: Bounds) -> Bounds {
        let before = self.bonds.velocities(place, before);
        match self.skins.get(place) {
            Some(Some(skin)) => before.and(&skin.given),
            _ => before,
        }
    }

    /// Stops what meets in a substep of the bodies of an island.
    pub fn meet(&mut self, island: usize, bodies: &mut impl Systems, moment: &Span) {
        let watch = Stopwatch::start(moment.profile);
        if moment.begins {
            let members = self.islands.members(island);
            // Attached points are drawn together where contacts part them: what these gave would grow from step to step.
            let are_attached = members.iter().any(|&place| self.bonds.concern(place as usize));
            self.pushes.begin_island(members, !are_attached);
            self.pairs.forget();
        } else {
            self.pushes.keep(&self.links);
        }
        self.links.clear();
        for &place in self.islands.members(island) {
            let place = place as usize;
            if let (Some(Some(skin)), Some(body)) = (self.skins.get_mut(place), bodies.at_mut(place))
                && moment.concerns(body)
            {
                body.release_pressed(moment.duration);
                skin.follow(body, moment.duration, moment.begins);
            }
        }
        self.pairs.advance(self.islands.pairs(island), &self.skins);
        self.bonds.follow(bodies, &self.skins, moment);
        self.draw(island, bodies, moment);
        watch.stop(moment.profile, Stage::BroadPhase);
        let watch = Stopwatch::start(moment.profile);
        self.stop_what_meets(island, bodies, moment);
        watch.stop(moment.profile, Stage::ContactSolver);
        if let Some(profile) = moment.profile {
            profile.count(Count::TissueContacts, self.links.len());
        }
    }

    fn stop_what_meets(&mut self, island: usize, bodies: &mut impl Systems, moment: &Span) {
        let have_acted = self.solve(island, bodies, moment);
        for &place in self.islands.members(island) {
            let place = place as usize;
            if let (Some(Some(skin)), Some(body)) = (self.skins.get_mut(place), bodies.at_mut(place))
                && moment.concerns(body)
            {
                skin.remember(body);
            }
        }
        for link in &self.links {
            for (index, (side, sign)) in link.sides.iter().zip([1.0, -1.0]).enumerate() {
                if let (Some(skin), Some(body)) = (&mut self.skins[side.body], bodies.at_mut(side.body)) {
                    for (node, part) in link.movers(index) {
                        let node = node as usize;
                        let velocity = skin.velocities.get(node);
                        skin.given = skin.given.with(velocity);
                        let impulse = link.given() * (sign * part);
                        body.nudge(node, velocity, impulse, moment);
                        if moment.drifts {
                            body.press(node as u32, impulse);
                        }
                    }
                }
            }
        }
        if have_acted {
            self.end_with_tools(island, bodies, moment);
        }
        self.bonds.give(bodies, &self.skins, moment);
        if moment.drifts {
            self.part(bodies, moment.duration);
            self.bonds.part(bodies, moment.duration);
            for &place in self.islands.members(island) {
                if let Some(body) = bodies.at_mut(place as usize)
                    && let Some(contacts) = body.contacts.as_ref().filter(|contacts| contacts.may_press())
                {
                    contacts.keep_out(body.state.substep().next_positions);
                }
            }
        }
    }

    /// The bodies of an island have ended their step, of which this was the last moment.
    pub fn end_island(&mut self) {
        self.pushes.keep(&self.links);
        self.pushes.end_island();
    }

    /// Has VERLET bodies that press implicit ones be seen as fast as they are now, before their last half kick: nothing stops that.
    pub fn show_early(&self, bodies: &mut impl Systems) {
        for link in self.links.iter().filter(|link| link.presses()) {
            let places = link.sides.map(|side| side.body);
            let are_explicit = places.map(|place| bodies.at(place).is_none_or(System::is_explicit));
            for index in 0..2 {
                if are_explicit[index]
                    && !are_explicit[1 - index]
                    && let Some(body) = bodies.at_mut(places[index])
                {
                    body.show_early();
                }
            }
        }
    }

    /// The speed of the fastest node of an island, m/s, as far as velocities are kept, after gravity has given as much as this, m/s.
    pub fn fastest(&self, island: usize, bodies: &impl Systems, fall: f32) -> f32 {
        let members = self.islands.members(island).iter();
        let members = members.filter_map(|&place| bodies.at(place as usize));
        let speeds = members.map(|body| {
            let all = velocities(body);
            all.magnitudes().length() + fall * body.gravity_scale.abs()
        });
        speeds.fold(0.0, f32::max)
    }

    /// Gives nodes and tools what contacts with tools have done beside those of tissue.
    fn end_with_tools(&mut self, island: usize, bodies: &mut impl Systems, moment: &Span) {
        let members = self.islands.members(island);
        each_pressed(members, &mut self.skins, bodies, moment, |skin, body, contacts| {
            let Skin { velocities, given, .. } = skin;
            contacts.end_sweeps(velocities, |node, impulse| {
                let velocity = velocities.get(node);
                *given = given.with(velocity);
                body.nudge(node, velocity, impulse, moment);
            });
        });
    }

    /// Draws what of each surface is near others that it is found by in images, as the substep begins.
    fn draw(&mut self, island: usize, bodies: &impl Systems, moment: &Span) {
        for member in 0..self.islands.members(island).len() {
            let a = self.islands.members(island)[member] as usize;
            // It is written to while others are read.
            let Some(mut first) = self.skins.get_mut(a).and_then(Option::take) else {
                continue;
            };
            if let Some(body) = bodies.at(a)
                && first.images.is_some()
                && moment.concerns(body)
            {
                let mut part = Bounds::EMPTY;
                for &b in self.islands.members(island) {
                    let b = b as usize;
                    if let (Some(Some(other)), Some(other_body)) = (self.skins.get(b), bodies.at(b))
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

    /// Finds contacts and gives their impulses, with those of tools, until they lead to no others: whether there were any.
    fn solve(&mut self, island: usize, bodies: &mut impl Systems, moment: &Span) -> bool {
        let mut first = None;
        let mut has_begun = false;
        for _ in 0..SEARCHES {
            let known = self.links.len();
            if has_begun {
                self.go_on(island, bodies, moment);
                if self.has_foreseen(island, bodies, moment) {
                    break;
                }
            }
            let watch = Stopwatch::start(moment.profile);
            self.find(island, bodies, moment, has_begun);
            watch.stop(moment.profile, Stage::NarrowPhase);
            watch.take_off(moment.profile, Stage::ContactSolver);
            if self.links.len() == known && (has_begun || !self.bonds.act()) {
                break;
            }
            let Self {
                links,
                skins,
                bonds,
                islands,
                pushes,
                ..
            } = self;
            let members = islands.members(island);
            if !has_begun {
                // Contacts with tools go on from what they have done in the substep.
                each_pressed(members, skins, bodies, moment, |skin, body, contacts| {
                    contacts.begin_sweeps(|node| skin.velocities.set(node, body.mean_velocity(node)));
                });
            }
            has_begun = true;
            bonds.loosen(links, moment);
            let recalled = give_again(&mut links[known..], pushes.most(), skins);
            if recalled > 0.0 {
                first = Some(first.map_or(recalled, |first: f32| first.max(recalled)));
            }
            first = Some(relax(EFFORT, first, |sweep| {
                let links = links.iter_mut().filter(|link| sweep == Sweep::All || link.presses());
                let changes = links.map(|link| link.solve(skins));
                let mut changed = changes.fold(0.0, f32::max).max(bonds.sweep(skins, moment));
                each_pressed(members, skins, bodies, moment, |skin, _, contacts| {
                    changed = changed.max(contacts.sweep(&mut skin.velocities, sweep));
                });
                changed
            }));
        }
        has_begun
    }

    /// Has what impulses did to nodes be seen in what is bound to them.
    fn go_on(&mut self, island: usize, bodies: &impl Systems, moment: &Span) {
        for &place in self.islands.members(island) {
            let place = place as usize;
            if let (Some(Some(skin)), Some(body)) = (self.skins.get_mut(place), bodies.at(place))
                && moment.concerns(body)
            {
                skin.go_on(body, moment.duration);
            }
        }
    }

    /// Whether what may meet where impulses have led nodes was found before they acted.
    fn has_foreseen(&self, island: usize, bodies: &impl Systems, moment: &Span) -> bool {
        let of_one = self.islands.members(island).iter().map(|&place| [place as usize; 2]);
        let mut all = of_one.chain(self.islands.pairs(island));
        all.all(|pair| {
            let search = Self::search((&self.skins, &self.entangled), pair, bodies, moment);
            search.is_none_or(|search| search.has_foreseen())
        })
    }

    /// Moves what began too close apart, without giving it speed.
    fn part(&self, bodies: &mut impl Systems, duration: f32) {
        for link in self.links.iter().filter(|link| link.depth > 0.0) {
            let extents = link
                .sides
                .map(|side| self.skins[side.body].as_ref().map_or(0.0, |skin| skin.extent));
            let most = PARTING_SPEED * extents[0].min(extents[1]) * duration;
            for (place, node, displacement) in link.parting(most.min(PUSHED_OUT * link.depth), duration) {
                if let Some(body) = bodies.at_mut(place) {
                    body.part_substep(node, displacement);
                }
            }
        }
    }

    /// The search of one of the near pairs of bodies, or of one body, in a substep, if they meet then.
    fn search<'a>(
        (skins, entangled): (&'a [Option<Skin>], &Entangled),
        [a, b]: [usize; 2],
        bodies: &impl Systems,
        moment: &Span,
    ) -> Option<Search<'a>> {
        let party = |place: usize| {
            let skin = skins.get(place)?.as_ref()?;
            Some(Party { place, skin })
        };
        let both = [bodies.at(a)?, bodies.at(b)?];
        let (mut first, mut second) = (party(a)?, party(b)?);
        let radius = radius(&first, &second, both)?;
        // Each edge of the first meets one edge of the second: of a long edge across short ones, that would be one of many.
        if second.skin.short < first.skin.short {
            std::mem::swap(&mut first, &mut second);
        }
        let is_looked_at = both.into_iter().all(|body| moment.concerns(body));
        let [own, others] = [first.skin, second.skin];
        (is_looked_at && !entangled.has([a, b])).then(|| Search {
            parties: [first, second],
            dt: moment.duration,
            radius,
            ahead: own.ahead().min(others.ahead()),
            motion: own.spread + others.spread + (own.drift - others.drift).length() * moment.duration,
            in_images: a != b && meet_in_images(own, others),
            measures: Measure::Nothing,
        })
    }

    /// The same of a pair that is not found in images.
    fn search_by_distance<'a>(
        skins: (&'a [Option<Skin>], &Entangled),
        pair: [usize; 2],
        bodies: &impl Systems,
        moment: &Span,
    ) -> Option<Search<'a>> {
        Self::search(skins, pair, bodies, moment).filter(|search| !search.in_images)
    }

    /// Has what is near be known of the pairs of an island, or trees be where surfaces are.
    fn know_pairs(&mut self, island: usize, bodies: &impl Systems, moment: &Span) {
        let Self {
            skins,
            entangled,
            pairs,
            islands,
            ..
        } = self;
        let mut all = islands.pairs(island).enumerate();
        let holds = all.all(|(number, pair)| {
            let search = Self::search_by_distance((skins, entangled), pair, bodies, moment);
            search.is_none_or(|search| pairs.holds(number, &search))
        });
        if holds {
            return;
        }
        for &place in islands.members(island) {
            if let Some(Some(skin)) = skins.get_mut(place as usize) {
                skin.fit();
            }
        }
        if pairs.can_be_found() {
            pairs.begin();
            let added = islands.pairs(island).try_for_each(|pair| {
                let search = Self::search_by_distance((skins, entangled), pair, bodies, moment);
                pairs.add(search.as_ref())
            });
            if added.is_none() {
                pairs.fail();
            }
        }
    }

    /// Adds the contacts that are not known yet, of those that meet; again in the same substep: where impulses have led further than was looked.
    fn find(&mut self, island: usize, bodies: &impl Systems, moment: &Span, again: bool) {
        let measures = moment.begins && !again;
        self.know_pairs(island, bodies, moment);
        let Self {
            skins,
            clearances,
            entangled,
            links,
            known,
            pushes,
            pairs,
            bonds,
            islands,
            ..
        } = self;
        let key = Link::key;
        known.clear();
        known.extend(0..links.len() as u32);
        known.sort_unstable_by_key(|&link| key(&links[link as usize]));
        let of_one = islands.members(island).iter().map(|&place| (None, [place as usize; 2]));
        let of_two = islands.pairs(island).enumerate();
        for (number, [a, b]) in of_one.chain(of_two.map(|(number, pair)| (Some(number), pair))) {
            let Some(mut search) = Self::search((skins, entangled), [a, b], bodies, moment) else {
                continue;
            };
            if again && search.has_foreseen() {
                continue;
            }
            let [a, b] = search.parties.map(|party| party.place);
            let (Some(body_a), Some(body_b)) = (bodies.at(a), bodies.at(b)) else {
                continue;
            };
            let friction = body_a.contact.friction.max(body_b.contact.friction);
            let number = number.filter(|_| !search.in_images);
            // A place is lent to neither where it is its own partner.
            let mut none = [None, None];
            let [kept_a, kept_b] = match clearances.get_disjoint_mut([a, b]) {
                Ok(both) => both,
                Err(_) => none.each_mut(),
            };
            if measures && [&*kept_a, &*kept_b].into_iter().flatten().any(|kept| kept.is_new) {
                search.measures = Measure::Reductions;
                let known = number.and_then(|number| pairs.of(number));
                search.run([&mut *kept_a, &mut *kept_b], known, |_| {});
            }
            search.measures = if measures { Measure::Distances } else { Measure::Nothing };
            let near = number.and_then(|number| pairs.of(number));
            search.run([kept_a, kept_b], near, |touch| {
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
                    pushes.recall(&mut link);
                    links.push(link);
                }
            });
        }
        if measures {
            for &place in islands.members(island) {
                if let Some(Some(kept)) = clearances.get_mut(place as usize) {
                    let skin = skins.get(place as usize).and_then(Option::as_ref);
                    kept.settle(skin.map_or(&[], |skin| &skin.pierces));
                }
            }
        }
    }
}

/// Does something with each of these bodies that tools press, or may press as tissue moves it, its skin and its contacts with tools.
fn each_pressed(
    members: &[u32],
    skins: &mut [Option<Skin>],
    bodies: &mut impl Systems,
    moment: &Span,
    mut act: impl FnMut(&mut Skin, &mut System, &mut Contacts),
) {
    for &place in members {
        let place = place as usize;
        if let (Some(Some(skin)), Some(body)) = (skins.get_mut(place), bodies.at_mut(place))
            && moment.concerns(body)
            // What is done with the body changes nothing of these.
            && let Some(mut contacts) = body.contacts.take_if(|contacts| contacts.may_press())
        {
            act(skin, body, &mut contacts);
            body.contacts = Some(contacts);
        }
    }
}

/// Whether a bond makes one point of nodes of both sides.
fn are_joined(bonds: &Bonds, bodies: &impl Systems, sides: &[Side; 2]) -> bool {
    let [a, b] = sides;
    !bonds.are_none() && join_movers(bonds, bodies, [a.body, b.body], [&a.nodes, &b.nodes])
}

/// The same of corners of surfaces: what those are bound to counts.
fn join_movers(bonds: &Bonds, bodies: &impl Systems, places: [usize; 2], corners: [&[u32]; 2]) -> bool {
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

/// Whether the bodies at all these places sleep.
fn are_asleep(places: &[u32], bodies: &impl Systems) -> bool {
    let mut places = places.iter();
    places.all(|&place| bodies.at(place as usize).is_some_and(System::is_asleep))
}

/// How far two bodies, or one with itself, keep apart, m; `None` where they do not meet.
fn radius(first: &Party, second: &Party, bodies: [&System; 2]) -> Option<f32> {
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

fn meet_each_other(first: &System, second: &System) -> bool {
    let (a, b) = (&first.contact, &second.contact);
    a.with_bodies && b.with_bodies && a.filter.meets(b.filter)
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
