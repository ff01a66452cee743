//! The contacts of one body with all tools, found and resolved in every substep.
//!
//! A contact acts on velocities: an impulse, never pulling, by which the body ends the substep clear of the tool (a
//! speculative contact; sequential impulses, Catto 2005). Nothing is stored as a penalty, so that contact neither
//! shortens the substep nor gives energy back, and the impulses are the tool's force.

use glam::{BVec3, DVec3, Vec3, Vec3A};

use super::candidates::{Candidates, met, zone_bit};
use super::constraint::Constraint;
use super::driven::{Driven, DynamicTool};
use super::features::{Feature, Features};
use super::holds::Holds;
use super::impulses::{SWEEPS, pushed_out};
use super::meet::{ContactGeometry, meet_mesh, meet_plane, meet_rounded};
use super::node_contacts::{NodeContact, NodeContacts, NodeLook};
use super::path::{Motion, Solid, ToolPath};
use super::press::{Presses, solve_alone};
use super::press_nodes::{PressNodes, PressingSolid};
use super::report::Touch;
use super::rigid::RigidMotion;
use super::supports::{MOST, Supports};
use super::sweep::Corners;
use crate::base::{Count, Profile, Result, Stage, Stopwatch, memory};
use crate::codec::saved;
use crate::def::{BodyContact, CollisionFilter};
use crate::geometry::Bounds;
use crate::nodes::{Bindings, Mobility, Pins};
use crate::simd::ChosenKernel;
use crate::soa::Vectors;

/// Contacts that are solved together: room for so many at least and at most. What is beyond is solved once each.
const TOGETHER: std::ops::RangeInclusive<usize> = 256..=1 << 16;

/// So many of them at most are part of a solved equation.
const HELD: usize = 1 << 12;

/// A substep is cut into at most so many slices.
const SLICES: u32 = 512;

/// How far a tool and the body may move against each other in a slice, as a part of the tool's radius.
const SLICE_TRAVEL: f32 = 0.5;

/// Sweeps over the contacts of each of several slices at most: what is left is found again in the next.
const SWEEPS_OF_A_SLICE: u32 = 16;

/// What a tool received from a body in the step in progress, N s and N m s.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Load {
    pub impulse: DVec3,
    pub angular_impulse: DVec3,
}

saved!(Load {
    impulse,
    angular_impulse
});

impl Load {
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
    undecided: Vec<u32>,
    pub(super) presses: Presses,
    /// How many of them are solved together.
    together: usize,
    /// The first of them, which a solved equation has seen.
    pub holds: Holds,
    /// By the place of a tool among those of the step.
    pub(super) loads: Vec<Load>,
    /// What a contact's last impulse stands for, s.
    pressed_for: f32,
    /// How long the slice was that contacts were found for last, s.
    pub(super) found_for: f32,
    /// What the last step that became current left, in the order of tools.
    touches: Vec<Touch>,
    /// By a tool's place in the world: whether it touched in the last step that became current, and in the one before.
    pub(super) touched: Vec<[bool; 2]>,
    /// The box of all velocities that contacts gave in this substep.
    given: Bounds,
    /// Whether the step that was begun last became current.
    committed: bool,
    /// Nodes that tools hold, each with its tool's place among those of the world, in order.
    held: Vec<(u32, usize)>,
    /// Features that a change of the surface brings.
    pub(super) fresh: Vec<u32>,
    /// Tools that are rigid bodies.
    pub(super) driven: Driven,
}

saved!(Contacts {
    thickness,
    filter,
    features,
    candidates,
    constraints,
    nodes,
    undecided,
    presses,
    together,
    holds,
    loads,
    pressed_for,
    found_for,
    touches,
    touched,
    given,
    committed,
    held,
    fresh
} leaves { driven: Driven::default() });

/// One substep of a body near tools.
pub(crate) struct Meeting<'a> {
    pub kernel: ChosenKernel,
    pub tools: &'a [ToolPath],
    /// Where the body's coordinates begin.
    pub origin: DVec3,
    /// The step, s.
    pub dt: f32,
    /// Fractions of the step at which the substep starts and ends.
    pub start: f64,
    pub end: f64,
    /// s
    pub substep: f32,
    /// Whether positions change: not with the last half kick of a step.
    pub drifts: bool,
    /// Contacts that are open by less count, m.
    pub slack: f32,
    /// How fast nodes of bodies are that take the substep together with this one, m/s: what those do to it is found after this, and then
    /// tools act [again](Contacts::sweep).
    pub neighbor_speed: Option<f32>,
    /// What tools keep off the surface, m.
    pub thickness: f32,
    /// No node is faster, m/s.
    pub fastest: f32,
    pub mobility: Mobility<'a>,
    pub positions: &'a Vectors,
    pub velocities: &'a mut Vectors,
    pub next_positions: &'a mut Vectors,
    pub pins: &'a mut Pins,
    /// Corners that are bound to nodes: their own vectors are not read.
    pub bindings: Option<&'a Bindings>,
    /// Where the stages are timed, if they are.
    pub profile: Option<&'a Profile>,
}

/// A part of a substep in which no tool moves further against the body than half its radius. Springs act once in a substep,
/// contact in each slice: a tip that goes far takes along what it meets, however far that is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slice {
    /// Seconds from its start to the end of the substep.
    remains: f32,
    /// s
    pub duration: f32,
    first: bool,
    sweeps: u32,
    /// Whether contacts are only looked for.
    foresees: bool,
}

impl Contacts {
    /// For a body with nodes in these places and this surface, of which this is asked, in a world with `tools` tools.
    pub fn new(positions: &Vectors, surface: &[[u32; 3]], contact: &BodyContact, tools: usize) -> Result<Self> {
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

    /// Makes room for `tools` tools, at so many places in the world.
    pub fn reserve(&mut self, tools: usize) -> Result<()> {
        self.driven.reserve_ways(tools)?;
        self.loads.try_reserve(tools.saturating_sub(self.loads.len()))?;
        self.reserve_together(self.features.count(), tools)?;
        self.touched.try_reserve(tools.saturating_sub(self.touched.len()))?;
        self.touched.resize(tools.max(self.touched.len()), [false; 2]);
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
    pub fn dynamic_end(&self, index: usize, dt: f32) -> Option<RigidMotion> {
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
        memory::reserve(&mut self.undecided, self.features.node_count as usize)?;
        self.touches.try_reserve(together.saturating_sub(self.touches.len()))?;
        self.together = together;
        Ok(())
    }

    /// Starts a step over.
    pub fn begin(&mut self, (tools, dynamic): (&[ToolPath], &[DynamicTool]), origin: DVec3) {
        self.driven.begin(tools, dynamic);
        self.loads.clear();
        self.loads.resize(tools.len(), Load::default());
        // A step that is begun again goes back to where its nodes were.
        if !self.committed || !self.candidates.covers(tools, self.filter, origin) {
            self.candidates.invalidate();
        }
        self.committed = false;
        self.holds.begin_step();
    }

    /// Makes room for contacts within equations, where the body has such, and if `drags` for their friction: for how many.
    pub fn reserve_holds(&mut self, drags: bool) -> Result<usize> {
        let count = self.together.min(HELD);
        self.holds.reserve(count, drags)?;
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
            let features = features.map(|constraint| {
                let nodes = constraint.feature.nodes();
                Touch {
                    slot: tool.slot,
                    nodes: [0, 1, 2].map(|corner| nodes[corner.min(nodes.len() - 1)]),
                    weights: constraint.weights,
                    normal: constraint.normal,
                    force: force(constraint.given()),
                }
            });
            let nodes = self.nodes.iter().filter(|contact| contact.tool == place);
            let nodes = nodes.map(|contact| Touch {
                slot: tool.slot,
                nodes: [contact.node; 3],
                weights: [1.0, 0.0, 0.0],
                normal: contact.normal,
                force: force(contact.given()),
            });
            let pressing = nodes.chain(features).filter(|touch| touch.force != Vec3::ZERO);
            let room = self.touches.capacity() - self.touches.len();
            self.touches.extend(pressing.take(room));
        }
    }

    /// The step that was begun last is not taken: the body is where it was, and touches what it touched, but nothing pressed it.
    pub fn stay(&mut self) {
        self.touches.clear();
        for pair in &mut self.touched {
            *pair = [pair[0]; 2];
        }
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

    /// Other tools may meet the body than those that what is near was gathered for.
    pub fn look_again(&mut self) {
        self.candidates.invalidate();
    }

    /// There is a tool more, this many in order: it has pressed nothing yet. There is [room](Self::reserve) for it.
    pub fn add_tool(&mut self, index: usize) {
        if index <= self.loads.len() {
            self.loads.insert(index, Load::default());
        }
    }

    /// A tool at this place in the world is gone, this many in order: what the others pressed counts as long as the body sleeps.
    pub fn forget_tool(&mut self, slot: usize, index: usize) {
        if index < self.loads.len() {
            self.loads.remove(index);
        }
        // Another may come to its place.
        self.look_again();
        self.holds.forget_tool(slot);
        self.touches.retain(|touch| touch.slot != slot);
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

    /// Whether the tool in this place holds a node of the feature. What it holds may lie within it, and edges and faces from there
    /// on pass its surface: so it does not touch those either.
    fn is_held(&self, feature: Feature, slot: usize, bindings: Option<&Bindings>) -> bool {
        let held = |&node: &u32| self.held.binary_search(&(node, slot)).is_ok();
        !self.held.is_empty() && Supports::of(feature, bindings).nodes().iter().any(held)
    }

    /// An equation with the contacts that were foreseen has been solved: its holds are what the next begins with.
    pub fn remember(&mut self, tools: &[ToolPath]) {
        self.holds.remember(&self.constraints, |place| tools[place].slot);
    }

    /// Forgets what was near: nodes were moved from outside, or their coordinates begin elsewhere.
    pub fn forget(&mut self) {
        self.candidates.invalidate();
    }

    /// Whether no tool can come near within `duration` seconds, where no node is faster than `fastest`, m/s.
    pub fn stay_far(&self, tools: &[ToolPath], dt: f32, duration: f32, fastest: f32) -> bool {
        let travel = duration * (fastest + self.tool_speed(tools, dt));
        self.loads.is_empty() || self.candidates.near().is_empty() && self.candidates.lasts_for(travel)
    }

    /// A substep without tools near has been taken: whether the list of what is near is still good.
    pub fn pass_far(&mut self, tools: &[ToolPath], dt: f32, substep: f32, fastest: f32) -> bool {
        let travel = substep * (fastest + self.tool_speed(tools, dt));
        self.loads.is_empty() || self.candidates.spend(travel)
    }

    /// The speed of the fastest tool that the body meets, m/s.
    fn tool_speed(&self, tools: &[ToolPath], dt: f32) -> f32 {
        met(tools, self.filter).map(|tool| tool.speed(dt)).fold(0.0, f32::max)
    }

    /// Whether no tool was near in the last substep.
    pub fn are_far(&self) -> bool {
        self.loads.is_empty() || self.candidates.near().is_empty()
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
        let (mut beyond, mut all) = (0.0, 0.0);
        for (index, constraint) in self.constraints.iter().enumerate() {
            let given = constraint.given().as_dvec3();
            let held = if index < self.holds.len() {
                self.holds.force(index) * substep
            } else {
                DVec3::ZERO
            };
            beyond += (given - held).length();
            all += given.length();
        }
        let of_nodes: f64 = self
            .nodes
            .iter()
            .map(|contact| contact.given().as_dvec3().length())
            .sum();
        [beyond + of_nodes, all + of_nodes]
    }

    /// Makes what tools received in a long substep of so many seconds the mean over it: an equation knows the forces at its end, and those at
    /// its start are those of the last.
    pub fn average_loads(&mut self, tools: &[ToolPath], substep: f64) {
        let Self {
            holds,
            constraints,
            loads,
            ..
        } = self;
        holds.show_last(|slot, force, arm| {
            if let Some(place) = tools.iter().position(|tool| tool.slot == slot) {
                loads[place].add(force * (0.5 * substep), arm);
            }
        });
        for (index, constraint) in constraints.iter().enumerate().take(holds.len()) {
            loads[constraint.tool].add(holds.force(index) * (0.5 * substep), constraint.arm);
        }
    }

    /// What each tool of the step received.
    pub fn loads(&self) -> &[Load] {
        &self.loads
    }

    /// The box of all velocities, given that of those before the contacts.
    pub fn velocities(&self, before: Bounds) -> Bounds {
        Bounds {
            min: before.min.min(self.given.min),
            max: before.max.max(self.given.max),
        }
    }

    /// Finds the contacts that the equation of the substep is to know of: all that may touch with these velocities, or are open by
    /// no more than the slack. `stiffness_of` tells how stiff a node is, N/m; `drags`: friction belongs to the equation too.
    /// `false`: something goes too far to tell.
    pub fn foresee(&mut self, mut meeting: Meeting, drags: bool, stiffness_of: impl Fn(usize) -> f32) -> bool {
        self.holds.clear();
        self.clear_contacts();
        if meeting.tools.is_empty() {
            return true;
        }
        self.find_candidates(&meeting);
        if self.candidates.near().is_empty() {
            return true;
        }
        if self.needed_slices(&meeting) > 1 {
            return false;
        }
        let slice = Slice::ahead(&meeting);
        let (start, end) = (meeting.start, meeting.end);
        self.find(&mut meeting, &slice, [start, end]);
        self.constraints.truncate(HELD);
        let way = |node: usize| meeting.velocities.get(node) * meeting.substep;
        let slot = |place: usize| meeting.tools[place].slot;
        let over = (meeting.substep, meeting.bindings, drags);
        self.holds.begin(&self.constraints, slot, over, stiffness_of, way);
        true
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

    /// Adds the contacts of a slice between these fractions of the step.
    fn find(&mut self, meeting: &mut Meeting, slice: &Slice, ends: [f64; 2]) {
        let watch = Stopwatch::start(meeting.profile);
        self.find_among_candidates(meeting, slice, ends);
        watch.stop(meeting.profile, Stage::NarrowPhase);
        if let Some(profile) = meeting.profile {
            profile.count(Count::ToolContacts, self.constraints.len() + self.nodes.len());
        }
    }

    fn find_among_candidates(&mut self, meeting: &mut Meeting, slice: &Slice, [start, end]: [f64; 2]) {
        // Contacts that an equation is to know of, or has seen, are constraints all of them.
        let node_by_node = !slice.foresees && self.holds.is_empty();
        let count = self.candidates.near().len();
        let all = self.candidates.masks.iter().fold(0, |all, mask| all | mask);
        let is_alone = meeting.bindings.is_none()
            && meeting.neighbor_speed.is_none()
            && all.count_ones() == 1
            && all.leading_zeros() > 0
            && self
                .candidates
                .near()
                .last()
                .is_some_and(|&last| last < self.features.node_count);
        let mut zone = 0;
        for (place, tool) in meeting.tools.iter().enumerate() {
            if !tool.filter.meets(self.filter) {
                continue;
            }
            let bit = zone_bit(zone);
            zone += 1;
            let yields = self.driven.place(place);
            // An equation cannot move a tool.
            if all & bit == 0 || slice.foresees && yields.is_some() {
                continue;
            }
            let motion = tool.motion(start, end, meeting.dt, meeting.origin);
            let room = motion.room(meeting, slice);
            let nodes = if node_by_node && yields.is_none() {
                self.find_nodes(meeting, slice, (place, &motion), (bit, is_alone))
            } else {
                0
            };
            // Points that are bound to nodes are left.
            let first = if meeting.bindings.is_none() { nodes } else { 0 };
            if let Some(room) = room.as_ref().filter(|_| first < count) {
                self.candidates.see_corners(room, |corner| meeting.way(slice, corner));
            }
            for candidate in first..count {
                if self.candidates.masks[candidate] & bit == 0 {
                    continue;
                }
                let index = self.candidates.near()[candidate];
                let is_bound = || meeting.bindings.is_some_and(|bindings| bindings.get(index).is_some());
                if candidate < nodes && !is_bound() {
                    continue;
                }
                let Some(feature) = self.features.get(index) else {
                    continue;
                };
                if room.is_none() {
                    self.touch_plane(meeting, slice, (place, &motion), feature);
                } else if let Some(corners) = self.candidates.corners(feature) {
                    self.touch(meeting, slice, (place, &motion), (feature, &corners));
                }
            }
        }
    }

    /// Adds the contacts of nodes with a tool, but for points that are bound to nodes: how many of the candidates are either.
    fn find_nodes(
        &mut self,
        meeting: &mut Meeting,
        slice: &Slice,
        (tool, motion): (usize, &Motion),
        (bit, is_alone): (u32, bool),
    ) -> usize {
        let near = self.candidates.near();
        let count = near.partition_point(|&index| index < self.features.node_count);
        let look = NodeLook::new(meeting, slice, motion, meeting.tools[tool].slot);
        let is_even = is_alone && meeting.is_even(slice) && self.held.is_empty();
        let is_pressed = is_even && self.press_nodes(meeting, (tool, motion), &look, count);
        let left = if is_pressed { self.undecided.len() } else { count };
        for place in 0..left {
            let (node, candidate) = match self.undecided.get(place).filter(|_| is_pressed) {
                Some(&node) => (node, count),
                None if self.candidates.masks[place] & bit == 0 => continue,
                None => (self.candidates.near()[place], place),
            };
            if meeting.bindings.is_some_and(|bindings| bindings.get(node).is_some()) {
                continue;
            }
            let plane = self.candidates.planes.get_mut(candidate);
            let Some(geometry) = look.meet(meeting, slice, node as usize, plane) else {
                continue;
            };
            if self.is_held(Feature::node(node), look.slot, meeting.bindings) {
                continue;
            }
            let Some(mut contact) = NodeContact::new(meeting, slice, (node, tool), &geometry, motion.friction) else {
                continue;
            };
            // What another tool gives may bring it nearer.
            if is_alone && contact.is_idle(meeting.velocities) {
                continue;
            }
            if !self.nodes.push(contact) {
                contact.solve_alone(meeting.velocities);
                self.settle_node(meeting, slice, &contact);
            }
        }
        count
    }

    /// Gives the impulses of a round tool or a mesh to the nodes that it touches, in closed form; nodes whose motion has to be swept are left to be
    /// looked at. `false`: it is neither.
    fn press_nodes(
        &mut self,
        meeting: &mut Meeting,
        (tool, motion): (usize, &Motion),
        look: &NodeLook,
        count: usize,
    ) -> bool {
        let solid = match (motion.from, motion.to) {
            (Solid::Rounded { .. }, _) => PressingSolid::Round {
                segment: look.segment,
                spin: motion.spin,
            },
            (Solid::Mesh(from), Solid::Mesh(to)) => {
                for (&node, plane) in self.candidates.near[..count].iter().zip(&mut self.candidates.planes) {
                    look.refresh(meeting, meeting.positions.get(node as usize), plane);
                }
                let Some(planes) = self.candidates.planes.get(..count) else {
                    return false;
                };
                PressingSolid::Mesh {
                    planes,
                    slot: look.slot as u32,
                    from,
                    to,
                    flat: look.flat(),
                }
            }
            _ => return false,
        };
        self.undecided.clear();
        let pressed = meeting.kernel.run(PressNodes {
            nodes: &self.candidates.near[..count],
            positions: meeting.positions.axes(),
            velocities: meeting.velocities.axes_mut(),
            next_positions: meeting.next_positions.axes_mut(),
            inverse_masses: meeting.mobility.inverse_masses,
            damping: meeting.mobility.damping,
            substep: meeting.substep,
            solid,
            thickness: meeting.thickness,
            closing: look.closing,
            centre: motion.centre,
            friction: motion.friction,
            undecided: &mut self.undecided,
        });
        let load = &mut self.loads[tool];
        load.impulse += pressed.impulse;
        load.angular_impulse += pressed.angular_impulse;
        self.given = self.given.and(&pressed.velocities);
        true
    }

    /// How many slices a substep needs. Only tools whose way comes near the body count: what is far changes nothing.
    fn needed_slices(&self, meeting: &Meeting) -> u32 {
        let mut slices = 1.0_f32;
        for tool in met(meeting.tools, self.filter) {
            let Some(sweep) = tool.sweep(meeting.origin) else {
                continue;
            };
            let travel = (tool.speed(meeting.dt) + meeting.fastest) * meeting.substep;
            let wanted = (travel / (sweep.thickness * SLICE_TRAVEL)).ceil();
            if wanted <= slices {
                continue;
            }
            let reached = meeting.bounds().extended(meeting.fastest * meeting.substep);
            if reached.overlaps(&sweep.bounds) {
                let travel = self.closing_speed(meeting, tool) * meeting.substep;
                slices = slices.max((travel / (sweep.thickness * SLICE_TRAVEL)).ceil().min(wanted));
            }
        }
        (slices as u32).clamp(1, SLICES)
    }

    /// How fast what is near moves against the tool at most, m/s.
    fn closing_speed(&self, meeting: &Meeting, tool: &ToolPath) -> f32 {
        let motion = tool.motion(meeting.start, meeting.end, meeting.dt, meeting.origin);
        let speeds = self
            .candidates
            .corner_nodes()
            .map(|node| (meeting.vector(meeting.velocities, node) - motion.velocity).length());
        // Turning counts by the tool's furthest point: an arc is taken for its chord.
        let turning = (tool.speed(meeting.dt) - motion.velocity.length()).max(0.0);
        speeds.fold(turning, |fastest, speed| fastest.max(speed + turning))
    }

    fn find_candidates(&mut self, meeting: &Meeting) {
        let watch = Stopwatch::start(meeting.profile);
        self.gather_candidates(meeting);
        watch.stop(meeting.profile, Stage::BroadPhase);
        if let Some(profile) = meeting.profile {
            profile.count(Count::Candidates, self.candidates.near().len());
        }
    }

    fn gather_candidates(&mut self, meeting: &Meeting) {
        let tools = met(meeting.tools, self.filter);
        let tool_speed = self.tool_speed(meeting.tools, meeting.dt);
        let fastest = meeting.fastest.max(meeting.neighbor_speed.unwrap_or(0.0));
        let travel = meeting.substep * (fastest + tool_speed);
        if self.candidates.spend(travel) || self.candidates.renew(meeting.positions, travel) {
            return;
        }
        let bounds = meeting.bounds();
        // Good for the rest of the step, where that is no more than a part of the body.
        let size = (bounds.max - bounds.min).length();
        let left = ((1.0 - meeting.start) / (meeting.end - meeting.start).max(1e-9)) as f32;
        let slack = (left.max(8.0) * travel)
            .min(0.05 * size)
            .max(8.0 * travel)
            .max(0.02 * size);
        self.candidates.gather(
            &self.features,
            (meeting.positions, meeting.bindings),
            tools,
            meeting.origin,
            [meeting.substep * tool_speed + meeting.slack + meeting.thickness, slack],
        );
        self.candidates.spend(travel);
    }

    /// Adds the contact of one feature with a plane.
    fn touch_plane(
        &mut self,
        meeting: &mut Meeting,
        slice: &Slice,
        (tool, motion): (usize, &Motion),
        feature: Feature,
    ) {
        if let &[node] = feature.nodes()
            && !self.is_known(slice, (tool, feature, 0))
            && !self.is_held(feature, meeting.tools[tool].slot, meeting.bindings)
        {
            let found = meet_plane(meeting, slice, motion, node as usize);
            self.add(meeting, slice, (tool, motion.friction), (feature, 0), found);
        }
    }

    /// Adds the contact of one feature with a tool of any other shape.
    fn touch(
        &mut self,
        meeting: &mut Meeting,
        slice: &Slice,
        (tool, motion): (usize, &Motion),
        (feature, corners): (Feature, &Corners),
    ) {
        if self.is_held(feature, meeting.tools[tool].slot, meeting.bindings) {
            return;
        }
        let of_tool = (tool, motion.friction);
        if let (Solid::Mesh(from), Solid::Mesh(to)) = (motion.from, motion.to) {
            if !self.is_known(slice, (tool, feature, 0)) {
                let found = meet_mesh(meeting, slice, motion, (feature, corners), [&from, &to]);
                self.add(meeting, slice, of_tool, (feature, 0), found);
            }
            return;
        }
        let segment = motion.segment(meeting.drifts);
        let has_tips = corners.count == 3 && !segment.is_point();
        for tip in 0..1 + u8::from(has_tips) {
            if self.is_known(slice, (tool, feature, tip)) {
                continue;
            }
            let met = if has_tips { segment.end(tip.into()) } else { segment };
            let found = meet_rounded(meeting, slice, motion, corners, &met);
            self.add(meeting, slice, of_tool, (feature, tip), found);
        }
    }

    /// Whether the equation that was solved has seen how this tool's tip meets the feature.
    fn is_known(&self, slice: &Slice, met: (usize, Feature, u8)) -> bool {
        !slice.foresees && self.holds.know(met)
    }

    fn add(
        &mut self,
        meeting: &mut Meeting,
        slice: &Slice,
        (tool, friction): (usize, f32),
        (feature, tip): (Feature, u8),
        found: Option<ContactGeometry>,
    ) {
        let yielding = self
            .driven
            .place(tool)
            .map(|place| (place, &self.presses.yielding[place]));
        let found = found.and_then(|geometry| {
            let recoil = yielding.map_or([0.0; 2], |(_, tool)| {
                let arm = Vec3A::from(geometry.arm) - tool.center;
                [tool.answer(arm, geometry.normal.into()), tool.largest_answer(arm)]
            });
            meeting.constraint(slice, feature, &geometry, friction, recoil)
        });
        let Some(mut constraint) = found else {
            return;
        };
        (constraint.tool, constraint.tip) = (tool, tip);
        constraint.yielding = yielding.map_or(u32::MAX, |(place, _)| place as u32);
        if self.constraints.len() < self.together {
            self.constraints.push(constraint);
        } else if !slice.foresees {
            solve_alone(&mut constraint, meeting.velocities, &mut self.presses.yielding);
            self.settle(meeting, slice, &constraint, true);
        }
    }

    fn solve(&mut self, meeting: &mut Meeting, slice: &Slice) {
        if self.constraints.is_empty() {
            self.solve_nodes(meeting, slice);
            return;
        }
        // Edges and faces share nodes: all contacts are solved together.
        for index in 0..self.nodes.len() {
            let contact = *self.nodes.get(index);
            let geometry = contact.geometry(meeting);
            self.add(
                meeting,
                slice,
                (contact.tool, contact.friction),
                (Feature::node(contact.node), 0),
                Some(geometry),
            );
        }
        self.nodes.clear();
        let first = self
            .presses
            .solve(&mut self.constraints, meeting.velocities, slice.sweeps);
        // Where nothing was given beside what an equation found the nodes are where that has put them.
        let moves = first > 0.0 || self.holds.is_empty();
        for index in 0..self.constraints.len() {
            let constraint = self.constraints[index];
            self.settle(meeting, slice, &constraint, moves);
        }
        if meeting.drifts {
            for constraint in &self.constraints {
                if constraint.depth > 0.0 {
                    let way = pushed_out(meeting.substep) * constraint.depth;
                    constraint.push_out(meeting.next_positions, way);
                    if let Some(tool) = self.presses.yielding.get_mut(constraint.yielding as usize) {
                        constraint.push_back(tool, way);
                    }
                }
            }
            // What an equation that was not solved to the end has let in.
            for index in 0..self.holds.len() {
                let lacks = self.holds.lacks(index, |node| meeting.next_positions.get(node));
                if lacks > 0.0 {
                    self.constraints[index].push_out(meeting.next_positions, lacks as f32);
                }
            }
        }
    }

    /// Solves contacts of nodes alone, each node by itself.
    fn solve_nodes(&mut self, meeting: &mut Meeting, slice: &Slice) {
        self.nodes.solve(meeting.velocities, slice.sweeps);
        for index in 0..self.nodes.len() {
            let contact = *self.nodes.get(index);
            self.settle_node(meeting, slice, &contact);
        }
        if meeting.drifts {
            for contact in self.nodes.iter().filter(|contact| contact.depth > 0.0) {
                contact.push_out(meeting.next_positions, pushed_out(meeting.substep) * contact.depth);
            }
        }
    }

    /// Adds what the contact of a node gave to its tool's load, and moves the node.
    fn settle_node(&mut self, meeting: &mut Meeting, slice: &Slice, contact: &NodeContact) {
        if contact.given() == Vec3::ZERO {
            return;
        }
        let received = -contact.given().as_dvec3();
        self.loads[contact.tool].add(received, contact.arm);
        let node = contact.node as usize;
        if let Some(pin) = meeting.pins.get_mut(contact.node) {
            pin.force_sum += received / f64::from(meeting.substep);
        }
        let velocity = meeting.velocities.get(node);
        self.given = self.given.with(velocity);
        if meeting.drifts {
            let held = meeting.pins.partial_axes_of(contact.node);
            let led = meeting.next_positions.get(node);
            let moved = contact.start + velocity * slice.remains;
            meeting.next_positions.set(node, Vec3::select(held, led, moved));
        }
    }

    /// Adds what a contact gave to its tool's load, and moves its nodes.
    fn settle(&mut self, meeting: &mut Meeting, slice: &Slice, constraint: &Constraint, moves: bool) {
        let received = -constraint.given().as_dvec3();
        self.loads[constraint.tool].add(received, constraint.arm);
        let supports = constraint.starts.iter().zip(constraint.shares);
        for (&node, (&start, share)) in constraint.nodes().iter().zip(supports) {
            if let Some(pin) = meeting.pins.get_mut(node) {
                pin.force_sum += received * f64::from(share / meeting.substep);
                if !pin.is_partial() {
                    continue;
                }
            }
            let velocity = meeting.velocities.get(node as usize);
            self.given = self.given.with(velocity);
            if meeting.drifts && moves {
                let held = meeting.pins.partial_axes_of(node);
                let led = meeting.next_positions.get(node as usize);
                let moved = start + velocity * slice.remains;
                meeting
                    .next_positions
                    .set(node as usize, Vec3::select(held, led, moved));
            }
        }
    }
}

impl Slice {
    /// The whole substep, looked at before it is taken.
    fn ahead(meeting: &Meeting) -> Self {
        Self {
            remains: meeting.substep,
            duration: meeting.substep,
            first: true,
            sweeps: SWEEPS,
            foresees: true,
        }
    }
}

impl Meeting<'_> {
    /// The same with tools on these ways; without any those that it has.
    fn along<'a>(&'a mut self, paths: &'a [ToolPath]) -> Meeting<'a> {
        Meeting {
            tools: if paths.is_empty() { self.tools } else { paths },
            velocities: self.velocities,
            next_positions: self.next_positions,
            pins: self.pins,
            ..*self
        }
    }

    /// Whether the slice is the whole of a substep in which every node moves by its mass alone: none is held along some axes, asleep, or bound to others.
    fn is_even(&self, slice: &Slice) -> bool {
        let is_whole = slice.first && slice.duration == self.substep && self.drifts && !self.mobility.half;
        is_whole && !self.pins.have_partial() && self.mobility.asleep.is_none() && self.bindings.is_none()
    }

    /// The axes along which nodes of a feature are held that are free along others.
    pub(super) fn held_axes(&self, supports: &Supports) -> [BVec3; MOST] {
        let mut held = [BVec3::FALSE; MOST];
        for (held, &node) in held.iter_mut().zip(supports.nodes()) {
            *held = self.pins.partial_axes_of(node);
        }
        held
    }

    /// What the kick that was given stands for, s.
    fn kick(&self) -> f32 {
        if self.mobility.half {
            0.5 * self.substep
        } else {
            self.substep
        }
    }

    /// Where a corner is when the slice begins.
    pub(super) fn position(&self, slice: &Slice, corner: usize) -> Vec3 {
        if slice.first {
            self.vector(self.positions, corner)
        } else {
            self.vector(self.next_positions, corner) - self.vector(self.velocities, corner) * slice.remains
        }
    }

    /// Where a corner is when the slice begins, and how far it goes in it if nothing touches it; with the last half kick of a step it has come
    /// to its end, and what is not touched there is a matter of the next.
    pub(super) fn way(&self, slice: &Slice, corner: usize) -> (Vec3, Vec3) {
        let step = if self.drifts {
            self.vector(self.velocities, corner) * slice.duration
        } else {
            Vec3::ZERO
        };
        (self.position(slice, corner), step)
    }

    /// That of these vectors which a corner has: its own, or what its nodes make of theirs.
    #[inline]
    pub(super) fn vector(&self, vectors: &Vectors, corner: usize) -> Vec3 {
        match self.bindings {
            None => vectors.get(corner),
            Some(bindings) => bindings.vector(vectors, corner),
        }
    }

    /// The box of all nodes, in which bound points are.
    fn bounds(&self) -> Bounds {
        let Some(bindings) = self.bindings else {
            return Bounds::of(self.positions.iter());
        };
        let nodes = (0..).zip(self.positions.iter());
        Bounds::of(
            nodes
                .filter(|&(node, _)| bindings.get(node).is_none())
                .map(|(_, place)| place),
        )
    }
}
