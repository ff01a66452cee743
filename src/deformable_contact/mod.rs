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
mod narrow_phase;
mod pairs;
mod passing;
mod plan;
mod search;
mod skin;
mod touches;
mod touching;
mod warm_start;
mod wound;

pub(crate) use self::bonds::{BondPoint, Bonds, Lead, Thread, are_one, distance};
pub(crate) use self::change::{SkinChange, SurfaceToBe};
use self::clearances::Clearances;
use self::entangled::Entangled;
use self::groups::Groups;
use self::islands::Islands;
use self::link::Link;
pub(crate) use self::lockstep::CoupledGroup;
use self::pairs::Pairs;
pub(crate) use self::skin::Skin;
use self::touches::Touches;
use self::touching::TouchingPairs;
use self::warm_start::{Pushes, give_again};

use glam::Vec3A;

use crate::base::{Count, Result, Stage, Stopwatch, memory};
use crate::codec::saved;
use crate::contact::Contacts;
use crate::contact::impulses::{Effort, Sweep, relax};
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

/// How fast one contact moves what began too close apart at most, as a part of the smaller body's extent, 1/s. The bodies keep about this speed, so
/// it bounds the energy that they gain.
const PARTING_SPEED: f32 = 0.3;

/// Contacts whose sides would pass each other are solved again, so often and with so many sweeps in a substep: between sides that nearly face each
/// other what is missing travels slowly.
const LACKS: u32 = 8;
const EFFORT_AGAIN: Effort = Effort {
    sweeps: 512,
    goes_on_later: false,
    ..EFFORT
};

/// So many times contacts part their sides in turn: each knows where those before it have moved them.
const PARTINGS: u32 = 4;

/// What moves three corners, each of them bound to four nodes at most.
const MOST_MOVERS: usize = 12;

/// Contacts that there is room for, for each node, edge and face of the surfaces.
const ROOM: usize = 1;

/// Contacts of tissue with tissue; kept only in worlds with bodies that ask for them.
#[derive(Debug, Default)]
pub(crate) struct DeformableContact {
    pub islands: Islands,
    /// By a body's place in the world.
    skins: Vec<Option<Skin>>,
    /// Likewise, of bodies that meet others.
    clearances: Vec<Option<Clearances>>,
    /// Bodies that were made through each other.
    entangled: Entangled,
    links: Vec<Link>,
    /// How long the substep of these was, s.
    duration: f32,
    /// The contacts of earlier searches in the order of their sides.
    known: Vec<u32>,
    /// What contacts gave before.
    pub pushes: Pushes,
    /// Where bodies press each other.
    pub touches: Touches,
    /// Which bodies do.
    pub touching: TouchingPairs,
    /// What bodies are near each other with.
    pairs: Pairs,
    /// Bodies that fell asleep together.
    pub groups: Groups,
    /// What is attached.
    pub bonds: Bonds,
}

saved! { DeformableContact { islands, skins, clearances, entangled, links, duration, known, pushes, touches, touching, pairs, groups, bonds } }

impl DeformableContact {
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
        self.touches.reserve(room)?;
        self.touching.reserve(room)?;
        let mut features = [0; 2];
        for skin in self.skins.iter().flatten().chain([&skin]) {
            let own = skin.nodes.capacity() + skin.edges.capacity();
            features[0] += if skin.meets_bodies { own } else { 0 };
            features[1] += if skin.firsts.is_some() { own } else { 0 };
        }
        let lists = self.islands.room() + self.skins.len() + 1;
        self.pairs.reserve(lists, features)?;
        let spare = body.spare_nodes();
        let of_corners_and_edges = || Clearances::new(skin.nodes.len() + spare, skin.edges.len() + 3 * spare);
        let clearances = body.contact.with_bodies.then(of_corners_and_edges).transpose()?;
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
        self.touching.leave(place);
        self.shed(place);
    }

    /// A body meets no tissue any more; what is attached of it stays so.
    pub fn shed(&mut self, place: usize) {
        self.entangled.leave(place);
        self.pushes.leave(place);
        self.touches.leave(place);
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
            self.touching.begin_island(members);
        } else {
            self.pushes.keep(&self.links);
            self.touching.note(&self.links);
        }
        // What closes a step is half a kick, of VERLET alone.
        if !moment.drifts {
            self.touches.note(&self.links, self.duration, |places| {
                !any_takes_half_kicks(bodies, places)
            });
            let members = self.islands.members(island).iter();
            if !any_takes_half_kicks(bodies, members.map(|&place| place as usize)) {
                return;
            }
        } else if moment.begins {
            self.touches.begin_island(self.islands.members(island));
        }
        self.duration = moment.duration;
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
        self.pairs.advance(self.islands.searches(island), &self.skins, true);
        self.bonds.follow(bodies, &self.skins, moment);
        self.draw(island, bodies, moment);
        watch.stop(moment.profile, Stage::BroadPhase);
        let watch = Stopwatch::start(moment.profile);
        self.stop_what_meets(island, bodies, moment);
        if !moment.drifts {
            self.touches.note(&self.links, 0.5 * self.duration, |places| {
                any_takes_half_kicks(bodies, places)
            });
        }
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
                        let velocity = skin.velocities[node].into();
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
        self.touching.note(&self.links);
        self.pushes.end_island();
    }

    /// Has VERLET bodies that press implicit ones be seen as fast as they are now, before their last half kick: nothing stops that.
    pub fn show_early(&self, bodies: &mut impl Systems) {
        for link in self.links.iter().filter(|link| link.presses()) {
            let places = link.sides.map(|side| side.body);
            let take_half_kicks = places.map(|place| takes_half_kicks(bodies, place));
            for index in 0..2 {
                if take_half_kicks[index]
                    && !take_half_kicks[1 - index]
                    && let Some(body) = bodies.at_mut(places[index])
                {
                    body.show_early();
                }
            }
        }
    }

    /// Gives nodes and tools what contacts with tools have done beside those of tissue.
    fn end_with_tools(&mut self, island: usize, bodies: &mut impl Systems, moment: &Span) {
        let members = self.islands.members(island);
        each_pressed(members, &mut self.skins, bodies, moment, |skin, body, contacts| {
            let Skin { velocities, given, .. } = skin;
            contacts.end_sweeps(velocities, |node, impulse| {
                let velocity = velocities[node].into();
                *given = given.with(velocity);
                body.nudge(node, velocity, impulse, moment);
            });
        });
    }

    /// Finds contacts and gives their impulses, with those of tools, until they lead to no others: whether there were any.
    fn solve(&mut self, island: usize, bodies: &mut impl Systems, moment: &Span) -> bool {
        let mut first = None;
        let mut has_begun = false;
        let (mut lacks, mut again) = (0, EFFORT_AGAIN);
        for _ in 0..SEARCHES {
            let known = self.links.len();
            let (mut searches, mut lack) = (true, false);
            if has_begun {
                self.go_on(island, bodies, moment);
                lack = lacks < LACKS && again.sweeps > 0 && self.hold_sides(moment);
                lacks += u32::from(lack);
                searches = !self.has_foreseen(island, bodies, moment);
            }
            if searches {
                let watch = Stopwatch::start(moment.profile);
                self.find(island, bodies, moment, has_begun);
                watch.stop(moment.profile, Stage::NarrowPhase);
                watch.take_off(moment.profile, Stage::ContactSolver);
            }
            if self.links.len() == known && !lack && (has_begun || !self.bonds.act()) {
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
                    contacts.begin_sweeps(|node| skin.velocities[node] = body.mean_velocity(node).into());
                });
            }
            has_begun = true;
            bonds.loosen(links, moment);
            let recalled = give_again(&mut links[known..], pushes.most(), skins);
            if recalled > 0.0 {
                first = Some(first.map_or(recalled, |first: f32| first.max(recalled)));
            }
            let effort = if lack { again } else { EFFORT };
            first = Some(relax(effort, first, |sweep| {
                again.sweeps -= u32::from(lack);
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
        self.pairs.advance(self.islands.searches(island), &self.skins, false);
    }

    /// Moves what began too close apart, without giving it speed, and nothing past what is beside it.
    fn part(&mut self, bodies: &mut impl Systems, duration: f32) {
        let Self { links, skins, .. } = self;
        if links.iter().all(|link| link.depth <= 0.0) {
            return;
        }
        // What was expected is known by now: the nodes' ways take its place.
        for link in links.iter() {
            for (place, node) in link.all_movers() {
                if let Some(skin) = &mut skins[place] {
                    skin.expected[node] = Vec3A::ZERO;
                }
            }
        }
        for _ in 0..PARTINGS {
            for link in links.iter_mut() {
                let extents = link
                    .sides
                    .map(|side| skins[side.body].as_ref().map_or(0.0, |skin| skin.extent));
                let most = PARTING_SPEED * extents[0].min(extents[1]) * duration;
                link.part(most, duration, skins);
            }
        }
        for (place, node) in links.iter().flat_map(Link::all_movers) {
            if let (Some(skin), Some(body)) = (&mut skins[place], bodies.at_mut(place)) {
                let way = std::mem::take(&mut skin.expected[node]);
                if way != Vec3A::ZERO {
                    body.part_substep(node, way.into());
                }
            }
        }
    }
}

/// Whether the body at this place takes half kicks.
fn takes_half_kicks(bodies: &impl Systems, place: usize) -> bool {
    bodies.at(place).is_none_or(|body| body.integrator.takes_half_kicks())
}

/// Whether one of the bodies at these places does.
fn any_takes_half_kicks(bodies: &impl Systems, places: impl IntoIterator<Item = usize>) -> bool {
    places.into_iter().any(|place| takes_half_kicks(bodies, place))
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

fn meet_each_other(first: &System, second: &System) -> bool {
    let (a, b) = (&first.contact, &second.contact);
    a.with_bodies && b.with_bodies && a.filter.meets(b.filter)
}
