//! The contacts of one body with all tools, found and resolved in every substep.
//!
//! A contact acts on velocities: an impulse, never pulling, by which the body ends the substep clear of the tool (a
//! speculative contact; sequential impulses, Catto 2005). Nothing is stored as a penalty, so that contact neither
//! shortens the substep nor gives energy back, and the impulses are the tool's force.

use glam::{DVec3, Vec3};

use super::candidates::Candidates;
use super::constraint::Constraint;
use super::driven::{Driven, DynamicTool};
use super::features::Features;
use super::holds::Holds;
use super::impulses::SWEEPS;
use super::meeting::{Meeting, Slice};
use super::node_contacts::NodeContacts;
use super::path::ToolPath;
use super::press::Presses;
use super::report::Touch;
use super::rigid::RigidState;
use super::supports::Supports;
use super::tool::ToolPlaces;
use crate::base::{Result, Stage, Stopwatch, memory};
use crate::codec::saved;
use crate::def::{BodyContact, CollisionFilter};
use crate::geometry::Bounds;
use crate::soa::Vectors;

/// Contacts that are solved together: room for so many at least and at most. What is beyond is solved once each.
const TOGETHER: std::ops::RangeInclusive<usize> = 256..=1 << 16;

/// So many of them at most are part of a solved equation.
const HELD: usize = 1 << 12;

/// Sweeps over the contacts of each of several slices at most: what is left is found again in the next.
const SWEEPS_OF_A_SLICE: u32 = 16;

/// What a tool received from a body in the step in progress, N s and N m s.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ToolLoad {
    pub impulse: DVec3,
    pub angular_impulse: DVec3,
    /// By how much, at most, an equation of the step has the force on it off, N.
    pub force_error: f64,
}

saved! { ToolLoad { impulse, angular_impulse, force_error } }

impl ToolLoad {
    /// Adds an impulse at this place, from the tool's position.
    pub(super) fn add(&mut self, impulse: DVec3, arm: Vec3) {
        self.impulse += impulse;
        self.angular_impulse += arm.as_dvec3().cross(impulse);
    }

    /// What it has more than it had before.
    pub(super) fn since(&self, before: &Self) -> Self {
        Self {
            impulse: self.impulse - before.impulse,
            angular_impulse: self.angular_impulse - before.angular_impulse,
            ..*self
        }
    }
}

/// The contacts of one body; kept only in worlds that have tools.
#[derive(Debug)]
pub(crate) struct Contacts {
    /// What tools keep off the surface, m.
    pub thickness: f32,
    /// Which tools it meets.
    pub filter: CollisionFilter,
    pub(super) features: Features,
    pub(super) candidates: Candidates,
    pub(super) constraints: Vec<Constraint>,
    pub(super) nodes: NodeContacts,
    /// Nodes that may touch a round tool within a slice.
    pub(super) undecided: Vec<u32>,
    pub(super) presses: Presses,
    /// How many of them are solved together.
    pub(super) together: usize,
    /// The first of them, which a solved equation has seen.
    pub holds: Holds,
    /// By the place of a tool among those of the step.
    pub(super) loads: Vec<ToolLoad>,
    /// What a contact's last impulse stands for, s.
    pressed_for: f32,
    /// How long the slice was that contacts were found for last, s.
    pub(super) found_for: f32,
    /// What the last step that became current left, in the order of tools.
    touches: Vec<Touch>,
    /// What is pinned pressed in the step in progress, in the order of tools.
    pub(super) pinned: Vec<Touch>,
    /// The same of the last step that became current.
    pub(super) pinned_before: Vec<Touch>,
    /// Nodes of the surface that are free, or have such a neighbour, a bit for each, where that was asked for.
    pub(super) yielding_nodes: Vec<u64>,
    /// By a tool's place in the world: whether it touched in the last step that became current, and in the one before.
    pub(super) touched: Vec<[bool; 2]>,
    /// The box of all velocities that contacts gave in this substep.
    pub(super) given: Bounds,
    /// Whether the step that was begun last became current.
    committed: bool,
    /// Nodes that tools hold, each with its tool's place among those of the world, in order.
    pub(super) held: Vec<(u32, usize)>,
    /// Features that a change of the surface brings.
    pub(super) fresh: Vec<u32>,
    /// Tools that are rigid bodies.
    pub(super) driven: Driven,
}

saved! { Contacts {
    thickness, filter, features, candidates, constraints, nodes, undecided, presses, together, holds, loads,
    pressed_for, found_for, touches, pinned, pinned_before, yielding_nodes, touched, given, committed, held, fresh,
} leaves { driven: Driven::default() } }

impl Contacts {
    /// For a body with nodes in these places and this surface, of which this is asked, in a world with these tools.
    pub fn new(positions: &Vectors, surface: &[[u32; 3]], contact: &BodyContact, tools: ToolPlaces) -> Result<Self> {
        let features = Features::new(positions.len(), surface, |node| positions.get(node))?;
        let mut contacts = Self {
            thickness: contact.thickness,
            filter: contact.filter,
            candidates: Candidates::new(&features)?,
            constraints: Vec::new(),
            nodes: NodeContacts::default(),
            undecided: Vec::new(),
            presses: Presses::default(),
            together: 0,
            holds: Holds::default(),
            features,
            loads: Vec::new(),
            pressed_for: 0.0,
            found_for: 0.0,
            touches: Vec::new(),
            pinned: Vec::new(),
            pinned_before: Vec::new(),
            yielding_nodes: Vec::new(),
            touched: Vec::new(),
            given: Bounds::EMPTY,
            committed: true,
            held: Vec::new(),
            fresh: Vec::new(),
            driven: Driven::default(),
        };
        contacts.reserve(tools)?;
        Ok(contacts)
    }

    /// Makes room for these tools.
    pub fn reserve(&mut self, places: ToolPlaces) -> Result<()> {
        let tools = places.count;
        self.driven.reserve_ways(tools)?;
        self.loads.try_reserve(tools.saturating_sub(self.loads.len()))?;
        self.reserve_together(self.features.count(), tools)?;
        memory::reserve(&mut self.pinned, tools)?;
        memory::reserve(&mut self.pinned_before, tools)?;
        self.touched.try_reserve(tools.saturating_sub(self.touched.len()))?;
        self.touched.resize(tools.max(self.touched.len()), [false; 2]);
        if places.has_meshes {
            self.candidates.reserve_meshes(&self.features)?;
        }
        self.candidates.reserve(tools)
    }

    /// Makes room for so many tools, of which so many are rigid bodies.
    pub fn reserve_dynamic(&mut self, tools: usize, dynamic: usize) -> Result<()> {
        self.presses.reserve_yielding(dynamic, self.together)?;
        self.driven.reserve(tools, dynamic)
    }

    /// Whether tools of the step are rigid bodies.
    pub fn has_dynamic(&self) -> bool {
        !self.driven.paths.is_empty()
    }

    /// Where a dynamic tool is at the end of a step of `dt` seconds, as the body moved it; `None`: the body did not press it.
    pub fn dynamic_end(&self, index: usize, dt: f32) -> Option<RigidState> {
        let is_pressed = self.loads[index].impulse != DVec3::ZERO;
        is_pressed.then(|| self.driven.end(index, dt)).flatten()
    }

    /// The energy that contact gave a dynamic tool in the step, J; `None`: the tool is led.
    pub fn received(&self, index: usize) -> Option<f64> {
        self.driven.received(index)
    }

    /// Makes room for what so many features and tools may have in common.
    pub(super) fn reserve_together(&mut self, features: usize, tools: usize) -> Result<()> {
        let together = features.saturating_mul(tools);
        let together = together.clamp(*TOGETHER.start(), *TOGETHER.end());
        self.constraints
            .try_reserve(together.saturating_sub(self.constraints.len()))?;
        self.presses.reserve(together)?;
        self.nodes.reserve(together)?;
        memory::reserve(&mut self.yielding_nodes, features.div_ceil(64))?;
        memory::reserve(&mut self.undecided, self.features.node_count as usize)?;
        self.touches.try_reserve(together.saturating_sub(self.touches.len()))?;
        self.together = together;
        Ok(())
    }

    /// Starts a step over.
    pub fn begin(&mut self, (tools, dynamic): (&[ToolPath], &[DynamicTool]), origin: DVec3) {
        self.driven.begin(tools, dynamic);
        self.loads.clear();
        self.loads.resize(tools.len(), ToolLoad::default());
        // A step that is begun again goes back to where its nodes were.
        let is_covered = self.candidates.covers(tools, self.filter, origin) && !self.are_listed_too_far(tools);
        if !(self.committed && is_covered) {
            self.candidates.invalidate();
        }
        self.committed = false;
        self.pinned.clear();
        self.holds.begin_step();
    }

    /// Makes room for contacts within equations, where the body has such: for how many.
    pub fn reserve_holds(&mut self) -> Result<usize> {
        let count = self.together.min(HELD);
        self.holds.reserve(count)?;
        Ok(count)
    }

    /// The step that was begun last is current now.
    pub fn commit(&mut self, tools: &[ToolPath]) {
        self.committed = true;
        self.holds.settle();
        self.touches.clear();
        for pair in &mut self.touched {
            *pair = [false, pair[0]];
        }
        for (place, (tool, load)) in tools.iter().zip(&self.loads).enumerate() {
            if let Some(pair) = self.touched.get_mut(tool.slot) {
                pair[0] = load.impulse != DVec3::ZERO;
            }
            let force = |given: Vec3| (-given / self.pressed_for).clamp(Vec3::MIN, Vec3::MAX);
            let features = self.constraints.iter().filter(|constraint| constraint.tool == place);
            let features = features.map(|constraint| Touch {
                slot: tool.slot,
                nodes: constraint.feature.three_nodes(),
                weights: constraint.weights,
                normal: constraint.normal,
                force: force(constraint.given()),
            });
            let nodes = self.nodes.iter().filter(|contact| contact.tool == place);
            let nodes = nodes.map(|contact| Touch {
                slot: tool.slot,
                nodes: [contact.node; 3],
                weights: [1.0, 0.0, 0.0],
                normal: contact.normal,
                force: force(contact.given()),
            });
            let pinned = self.pinned.iter().filter(|touch| touch.slot == tool.slot).copied();
            let pressing = nodes.chain(features).chain(pinned);
            let pressing = pressing.filter(|touch| touch.force != Vec3::ZERO);
            let room = self.touches.capacity() - self.touches.len();
            self.touches.extend(pressing.take(room));
        }
        std::mem::swap(&mut self.pinned, &mut self.pinned_before);
        self.pinned.clear();
    }

    /// The step that was begun last is not taken: the body is where it was, and touches what it touched, but nothing pressed it.
    pub fn stay(&mut self) {
        self.touches.clear();
        self.sleep_on();
    }

    /// The step is over in which the body was asleep: it touches what it touched.
    pub fn sleep_on(&mut self) {
        for pair in &mut self.touched {
            *pair = [pair[0]; 2];
        }
    }

    /// What the last step that became current left of contacts with a tool at this place in the world.
    pub fn touches(&self, slot: usize) -> impl Iterator<Item = &Touch> {
        self.touches.iter().filter(move |touch| touch.slot == slot)
    }

    /// Whether the tool at this place touched in the last step that became current, and in the one before.
    pub fn touched(&self, slot: usize) -> [bool; 2] {
        self.touched.get(slot).copied().unwrap_or_default()
    }

    /// Has the body meet what this filter says.
    pub fn set_filter(&mut self, filter: CollisionFilter) {
        self.filter = filter;
        self.look_again();
    }

    /// Has tools keep this far off the body, m.
    pub fn set_thickness(&mut self, thickness: f32) {
        self.thickness = thickness;
        self.look_again();
    }

    /// Forgets what was near: other tools may meet the body, nodes were moved from outside, or their coordinates begin elsewhere.
    pub fn look_again(&mut self) {
        self.candidates.invalidate();
    }

    /// There is a tool more, this many in order: it has pressed nothing yet. There is [room](Self::reserve) for it.
    pub fn add_tool(&mut self, index: usize) {
        if index <= self.loads.len() {
            self.loads.insert(index, ToolLoad::default());
        }
    }

    /// A tool at this place in the world is gone, this many in order: what the others pressed counts as long as the body sleeps.
    pub fn forget_tool(&mut self, slot: usize, index: usize) {
        if index < self.loads.len() {
            self.loads.remove(index);
        }
        self.candidates.forget_tool(slot);
        self.holds.forget_tool(slot);
        self.touches.retain(|touch| touch.slot != slot);
        self.pinned_before.retain(|touch| touch.slot != slot);
        if let Some(pair) = self.touched.get_mut(slot) {
            *pair = [false; 2];
        }
    }

    /// Makes room for so many nodes more that tools hold.
    pub fn reserve_held(&mut self, count: usize) -> Result<()> {
        Ok(self.held.try_reserve(count)?)
    }

    /// Tools hold these nodes too, which are in order, and do not touch them any more; there is room for them.
    pub fn hold(&mut self, held: &[(u32, usize)]) {
        memory::merge(&mut self.held, held, |&held| held);
    }

    /// Nodes that are not to stay are held no longer.
    pub fn retain_held(&mut self, stays: impl Fn(u32) -> bool) {
        self.held.retain(|&(node, _)| stays(node));
    }

    /// An equation with the contacts that were foreseen has been solved: its holds are what the next begins with.
    pub fn remember(&mut self, tools: &[ToolPath]) {
        self.holds.remember(&self.constraints, |place| tools[place].slot);
    }

    /// Shows each node that a tool gave something to, and along what normal; with friction `None`: all of its motion. Where motion is
    /// smooth those are left out that had it in the last equation too.
    pub fn show_touched(&self, is_smooth: bool, mut see: impl FnMut(usize, Option<Vec3>)) {
        for (index, constraint) in self.constraints.iter().enumerate() {
            if constraint.given() != Vec3::ZERO && !(is_smooth && self.holds.lasts(index)) {
                for &node in constraint.nodes() {
                    see(node as usize, (constraint.friction == 0.0).then_some(constraint.normal));
                }
            }
        }
        for contact in self.nodes.iter().filter(|contact| contact.given() != Vec3::ZERO) {
            see(
                contact.node as usize,
                (contact.friction == 0.0).then_some(contact.normal),
            );
        }
    }

    /// What contacts gave beside what the equation of a substep of so many seconds had them do, and what they gave in all, N s.
    pub fn beyond_holds(&self, substep: f64) -> [f64; 2] {
        self.given_beyond(substep)
            .fold([0.0; 2], |[beyond, all], (_, more, given)| [beyond + more, all + given])
    }

    /// The same of each contact, with the tool's place in the step.
    pub(super) fn given_beyond(&self, substep: f64) -> impl Iterator<Item = (usize, f64, f64)> {
        let of_features = self.constraints.iter().enumerate().map(move |(index, constraint)| {
            let given = constraint.given().as_dvec3();
            let held = if index < self.holds.len() {
                self.holds.force(index) * substep
            } else {
                DVec3::ZERO
            };
            (constraint.tool, (given - held).length(), given.length())
        });
        let of_nodes = self.nodes.iter().map(|contact| {
            let given = contact.given().as_dvec3().length();
            (contact.tool, given, given)
        });
        of_features.chain(of_nodes)
    }

    /// Makes what tools received in a long substep of so many seconds the mean over it: an equation knows the forces at its end, and those at
    /// its start are those of the last.
    pub fn average_loads(&mut self, tools: &[ToolPath], substep: f64) {
        self.holds.show_last(|slot, force, arm| {
            if let Some(place) = tools.iter().position(|tool| tool.slot == slot) {
                self.loads[place].add(force * (0.5 * substep), arm);
            }
        });
        for (index, constraint) in self.constraints.iter().enumerate().take(self.holds.len()) {
            self.loads[constraint.tool].add(self.holds.force(index) * (0.5 * substep), constraint.arm);
        }
    }

    /// What each tool of the step received.
    pub fn loads(&self) -> &[ToolLoad] {
        &self.loads
    }

    /// The box of all velocities, given that of those before the contacts.
    pub fn velocities(&self, before: Bounds) -> Bounds {
        before.and(&self.given)
    }

    /// Finds the contacts that the equation of the substep is to know of: all that may touch with these velocities, or are open by
    /// no more than the slack. `stiffness_of` tells how stiff a node is, N/m. `false`: something goes too far to tell. That is never so in a short
    /// substep where slow tools press the body already.
    pub fn foresee(&mut self, mut meeting: Meeting, is_long: bool, stiffness_of: impl Fn(usize) -> f32) -> bool {
        self.holds.clear();
        self.clear_contacts();
        if meeting.tools.is_empty() {
            return true;
        }
        self.find_candidates(&meeting);
        if self.candidates.near().is_empty() {
            return true;
        }
        // Nodes of pressed tissue that have become fast, as those of stiff tissue do, are still pressed.
        let goes_on = !is_long && self.holds.have_pressed() && !self.has_fast_tool(&meeting);
        if !goes_on && self.needed_slices(&meeting) > 1 {
            return false;
        }
        let slice = Slice::ahead(&meeting);
        let (start, end) = (meeting.start, meeting.end);
        self.find(&mut meeting, &slice, [start, end]);
        self.constraints.truncate(HELD);
        let way = |node: usize| meeting.velocities.get(node) * meeting.substep;
        let slot = |place: usize| meeting.tools[place].slot;
        let over = (meeting.substep, meeting.bindings, &*meeting.pins);
        self.holds.begin(&self.constraints, slot, over, stiffness_of, way);
        true
    }

    /// Forgets the contacts of an equation that is to stand, where nodes go further than those can tell.
    pub fn forgo_holds(&mut self, meeting: &Meeting) {
        self.find_candidates(meeting);
        if self.needed_slices(meeting) > 1 {
            self.holds.clear();
        }
    }

    /// Gives the impulses that keep the body out of the tools, and moves what they touch.
    pub fn resolve(&mut self, mut meeting: Meeting) {
        self.given = Bounds::EMPTY;
        if meeting.tools.is_empty() {
            return;
        }
        let mut paths = std::mem::take(&mut self.driven.paths);
        let (dt, kick) = (meeting.dt, (meeting.drifts, meeting.mobility.half));
        if !paths.is_empty() {
            let ends = [meeting.start, meeting.end];
            self.driven.look_ahead(&mut paths, ends, dt, kick);
            if !self.candidates.covers(&paths, self.filter, meeting.origin) {
                self.candidates.invalidate();
            }
        }
        let slices = self.begin_slices(&meeting.along(&paths));
        for index in 0..slices {
            let part = |index: u32| f64::from(index) / f64::from(slices);
            let slice = Slice {
                remains: meeting.substep * (1.0 - part(index)) as f32,
                duration: meeting.substep / slices as f32,
                first: index == 0,
                sweeps: if slices == 1 { SWEEPS } else { SWEEPS_OF_A_SLICE },
                foresees: false,
            };
            let fraction = |part: f64| (meeting.start + (meeting.end - meeting.start) * part).min(1.0);
            let ends = [fraction(part(index)), fraction(part(index + 1))];
            if !paths.is_empty() && slices > 1 {
                self.driven.look_ahead(&mut paths, ends, dt, kick);
            }
            self.presses.yielding.clear();
            self.driven.show_yielding(|tool| self.presses.yielding.push(tool));
            let mut meeting = meeting.along(&paths);
            if self.holds.is_empty() {
                self.clear_contacts();
            } else {
                self.take_up(&meeting);
            }
            self.find(&mut meeting, &slice, ends);
            let watch = Stopwatch::start(meeting.profile);
            self.solve(&mut meeting, &slice);
            watch.stop(meeting.profile, Stage::ContactSolver);
            self.driven.arrive(&self.loads, ends[1], &self.presses.yielding);
        }
        self.driven.paths = paths;
        if slices > 0 && self.given != Bounds::EMPTY {
            let fastest = self.given.magnitudes().length();
            self.candidates.spend(meeting.substep * fastest);
        }
    }

    /// In how many slices a substep is taken; 0: nothing is near.
    fn begin_slices(&mut self, meeting: &Meeting) -> u32 {
        self.find_candidates(meeting);
        if self.candidates.near().is_empty() && self.holds.is_empty() {
            self.clear_contacts();
            return 0;
        }
        let slices = if meeting.drifts && self.holds.is_empty() {
            self.needed_slices(meeting)
        } else {
            1
        };
        self.pressed_for = meeting.kick() / slices as f32;
        self.found_for = meeting.substep / slices as f32;
        slices
    }

    /// Makes the contacts that a solved equation has seen what it found.
    fn take_up(&mut self, meeting: &Meeting) {
        for (index, constraint) in self.constraints.iter_mut().enumerate() {
            let (meets, force, open) = self.holds.found(index);
            let given = (
                force as f32 * meeting.substep,
                self.holds.drag(index).as_vec3() * meeting.substep,
            );
            let supports = Supports::of(constraint.feature, meeting.bindings);
            let answering = (&supports, &meeting.mobility, meeting.held_axes(&supports));
            *constraint = constraint.after(
                &meets,
                given,
                (if force > 0.0 { 0.0 } else { open as f32 }, meeting.substep),
                meeting.velocities,
                answering,
            );
            if self.holds.drags(index) {
                // What is left of it would stop light nodes that slip: the equation knows better.
                constraint.friction = 0.0;
            }
        }
    }

    fn clear_contacts(&mut self) {
        self.constraints.clear();
        self.nodes.clear();
    }
}
