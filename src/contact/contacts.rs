//! The contacts of one body with all tools, found and resolved in every substep.
//!
//! A contact acts on velocities by an impulse that never pulls. With it, the body ends the substep clear of the tool
//! (speculative contact; sequential impulses, Catto 2005). There is no penalty energy, so contact neither shortens the
//! substep nor returns energy. The impulses are the force on the tool.

use glam::{DVec3, Vec3};

use super::augmented_lagrangian::ContactMultipliers;
use super::candidates::Candidates;
use super::constraint::Constraint;
use super::contact_input::{ContactInput, SubSlice};
use super::corner_weights::FeatureNodes;
use super::dynamic_tools::{DynamicTool, DynamicTools};
use super::features::Features;
use super::node_contacts::NodeContacts;
use super::path::ToolPath;
use super::pgs::ContactRows;
use super::report::ToolContact;
use super::rigid::RigidState;
use super::sweep_control::SWEEPS;
use super::tool::ToolCapacity;
use crate::base::{Result, Stage, Stopwatch, memory};
use crate::codec::saved;
use crate::def::{BodyContact, CollisionFilter};
use crate::geometry::Aabb;
use crate::soa::Vectors;

/// Minimum and maximum number of contacts that are solved together. Contacts beyond the reserved number are solved once
/// each.
const BATCH_CAPACITY: std::ops::RangeInclusive<usize> = 256..=1 << 16;

/// Maximum number of contacts that take part in a solved equation.
const MAX_EQUATION_CONTACTS: usize = 1 << 12;

/// Maximum number of sweeps in each of several slices. The next slice finds contacts that have not converged.
const SWEEPS_PER_SLICE: u32 = 16;

/// Impulse and angular impulse of a body on a tool in the current step, N s and N m s.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ToolLoad {
    pub impulse: DVec3,
    pub angular_impulse: DVec3,
    /// Bound on the error of the force that the step's equations cause, N.
    pub force_error: f64,
}

saved! { ToolLoad { impulse, angular_impulse, force_error } }

impl ToolLoad {
    /// Adds an impulse that acts at `arm` from the tool's position.
    pub(super) fn add(&mut self, impulse: DVec3, arm: Vec3) {
        self.impulse += impulse;
        self.angular_impulse += arm.as_dvec3().cross(impulse);
    }

    /// The load added since `before`.
    pub(super) fn since(&self, before: &Self) -> Self {
        Self {
            impulse: self.impulse - before.impulse,
            angular_impulse: self.angular_impulse - before.angular_impulse,
            ..*self
        }
    }
}

/// The contacts of one body. They exist only in worlds with tools.
#[derive(Debug)]
pub(crate) struct Contacts {
    /// Contact thickness: distance that tools keep from the surface, m.
    pub thickness: f32,
    /// The tools that the body collides with.
    pub filter: CollisionFilter,
    pub(super) features: Features,
    pub(super) candidates: Candidates,
    pub(super) constraints: Vec<Constraint>,
    pub(super) nodes: NodeContacts,
    /// Nodes that may touch a rounded tool within a slice, or that a mesh has to be queried for.
    pub(super) deferred_nodes: Vec<u32>,
    pub(super) contact_rows: ContactRows,
    /// Maximum number of contacts that are solved together.
    pub(super) batch_capacity: usize,
    /// Multipliers of the first constraints, which a solved equation includes.
    pub multipliers: ContactMultipliers,
    /// Load on each tool, by the tool's index in the step.
    pub(super) loads: Vec<ToolLoad>,
    /// Duration by which a contact's last impulse is divided to obtain its force, s.
    impulse_duration: f32,
    /// Duration of the slice for which contacts were last found, s.
    pub(super) slice_duration: f32,
    /// Contacts of the last committed step, in the order of tools.
    touches: Vec<ToolContact>,
    /// Contacts with pinned tissue in the current step, in the order of tools.
    pub(super) pinned_touches: Vec<ToolContact>,
    /// Contacts with pinned tissue in the last committed step.
    pub(super) last_pinned_touches: Vec<ToolContact>,
    /// Surface nodes that are free or have a free neighbor, one bit per node. Filled on demand.
    pub(super) free_node_marks: Vec<u64>,
    /// By a tool's slot in the world: true if it touched the body in the last committed step, and in the one before.
    pub(super) touched: Vec<[bool; 2]>,
    /// Bounding box of all velocities that contacts caused in this substep.
    pub(super) velocity_bounds: Aabb,
    /// True if the last step that was begun has been committed.
    is_committed: bool,
    /// Nodes attached to tools, each with its tool's slot in the world, sorted.
    pub(super) attached_nodes: Vec<(u32, usize)>,
    /// Features that a change of the surface adds.
    pub(super) new_features: Vec<u32>,
    /// Copies of the dynamic tools.
    pub(super) dynamic_tools: DynamicTools,
}

saved! { Contacts {
    thickness, filter, features, candidates, constraints, nodes, deferred_nodes, contact_rows, batch_capacity,
    multipliers, loads, impulse_duration, slice_duration, touches, pinned_touches, last_pinned_touches, free_node_marks,
    touched, velocity_bounds, is_committed, attached_nodes, new_features,
} leaves { dynamic_tools: DynamicTools::default() } }

impl Contacts {
    /// Creates the contacts of a body with these positions and this surface in a world with these tools.
    pub fn new(positions: &Vectors, surface: &[[u32; 3]], contact: &BodyContact, tools: ToolCapacity) -> Result<Self> {
        let features = Features::new(positions.len(), surface, |node| positions.get(node))?;
        let mut contacts = Self {
            thickness: contact.thickness,
            filter: contact.filter,
            candidates: Candidates::new(&features)?,
            constraints: Vec::new(),
            nodes: NodeContacts::default(),
            deferred_nodes: Vec::new(),
            contact_rows: ContactRows::default(),
            batch_capacity: 0,
            multipliers: ContactMultipliers::default(),
            features,
            loads: Vec::new(),
            impulse_duration: 0.0,
            slice_duration: 0.0,
            touches: Vec::new(),
            pinned_touches: Vec::new(),
            last_pinned_touches: Vec::new(),
            free_node_marks: Vec::new(),
            touched: Vec::new(),
            velocity_bounds: Aabb::EMPTY,
            is_committed: true,
            attached_nodes: Vec::new(),
            new_features: Vec::new(),
            dynamic_tools: DynamicTools::default(),
        };
        contacts.reserve(tools)?;
        Ok(contacts)
    }

    /// Reserves memory for these tools.
    pub fn reserve(&mut self, capacity: ToolCapacity) -> Result<()> {
        let tools = capacity.count;
        self.dynamic_tools.reserve_paths(tools)?;
        self.loads.try_reserve(tools.saturating_sub(self.loads.len()))?;
        self.reserve_contacts(self.features.count(), tools)?;
        memory::reserve(&mut self.pinned_touches, tools)?;
        memory::reserve(&mut self.last_pinned_touches, tools)?;
        self.touched.try_reserve(tools.saturating_sub(self.touched.len()))?;
        self.touched.resize(tools.max(self.touched.len()), [false; 2]);
        if capacity.has_meshes {
            self.candidates.reserve_meshes(&self.features)?;
        }
        self.candidates.reserve(tools)
    }

    /// Reserves memory for `tools` tools, of which `dynamic` are rigid bodies.
    pub fn reserve_dynamic(&mut self, tools: usize, dynamic: usize) -> Result<()> {
        self.contact_rows.reserve_dynamic_tools(dynamic, self.batch_capacity)?;
        self.dynamic_tools.reserve(tools, dynamic)
    }

    /// True if a tool of the step is dynamic.
    pub fn has_dynamic(&self) -> bool {
        !self.dynamic_tools.paths.is_empty()
    }

    /// The state of a dynamic tool at the end of a step of `dt` seconds, as this body moved it. `None` if the body did
    /// not touch it.
    pub fn dynamic_end(&self, index: usize, dt: f32) -> Option<RigidState> {
        let is_pressed = self.loads[index].impulse != DVec3::ZERO;
        is_pressed.then(|| self.dynamic_tools.end(index, dt)).flatten()
    }

    /// Reserves memory for the contacts of `features` features with `tools` tools.
    pub(super) fn reserve_contacts(&mut self, features: usize, tools: usize) -> Result<()> {
        let batch_capacity = features.saturating_mul(tools);
        let batch_capacity = batch_capacity.clamp(*BATCH_CAPACITY.start(), *BATCH_CAPACITY.end());
        self.constraints
            .try_reserve(batch_capacity.saturating_sub(self.constraints.len()))?;
        self.contact_rows.reserve(batch_capacity)?;
        self.nodes.reserve(batch_capacity)?;
        memory::reserve(&mut self.free_node_marks, features.div_ceil(64))?;
        memory::reserve(&mut self.deferred_nodes, self.features.node_count as usize)?;
        self.touches
            .try_reserve(batch_capacity.saturating_sub(self.touches.len()))?;
        self.batch_capacity = batch_capacity;
        Ok(())
    }

    /// Begins a step, or begins it again.
    pub fn begin(&mut self, (tools, dynamic): (&[ToolPath], &[DynamicTool]), origin: DVec3) {
        self.dynamic_tools.begin(tools, dynamic);
        self.loads.clear();
        self.loads.resize(tools.len(), ToolLoad::default());
        // A repeated step starts from the previous node positions.
        let is_covered = self.candidates.covers(tools, self.filter, origin) && !self.has_oversized_list(tools);
        if !(self.is_committed && is_covered) {
            self.candidates.invalidate();
        }
        self.is_committed = false;
        self.pinned_touches.clear();
        self.multipliers.begin_step();
    }

    /// Reserves memory for contacts within equations. Returns their number.
    pub fn reserve_holds(&mut self) -> Result<usize> {
        let count = self.batch_capacity.min(MAX_EQUATION_CONTACTS);
        self.multipliers.reserve(count)?;
        Ok(count)
    }

    /// Makes the last step that was begun current.
    pub fn commit(&mut self, tools: &[ToolPath]) {
        self.is_committed = true;
        self.multipliers.commit();
        self.touches.clear();
        for pair in &mut self.touched {
            *pair = [false, pair[0]];
        }
        for (index, (tool, load)) in tools.iter().zip(&self.loads).enumerate() {
            if let Some(pair) = self.touched.get_mut(tool.slot) {
                pair[0] = load.impulse != DVec3::ZERO;
            }
            let force = |impulse: Vec3| (-impulse / self.impulse_duration).clamp(Vec3::MIN, Vec3::MAX);
            let features = self.constraints.iter().filter(|constraint| constraint.tool == index);
            let features = features.map(|constraint| ToolContact {
                slot: tool.slot,
                nodes: constraint.feature.three_nodes(),
                weights: constraint.weights,
                normal: constraint.normal,
                force: force(constraint.total_impulse()),
            });
            let nodes = self.nodes.iter().filter(|contact| contact.tool == index);
            let nodes = nodes.map(|contact| ToolContact {
                slot: tool.slot,
                nodes: [contact.node; 3],
                weights: [1.0, 0.0, 0.0],
                normal: contact.normal,
                force: force(contact.total_impulse()),
            });
            let pinned = self
                .pinned_touches
                .iter()
                .filter(|touch| touch.slot == tool.slot)
                .copied();
            let reports = nodes.chain(features).chain(pinned);
            let reports = reports.filter(|touch| touch.force != Vec3::ZERO);
            let free_capacity = self.touches.capacity() - self.touches.len();
            self.touches.extend(reports.take(free_capacity));
        }
        std::mem::swap(&mut self.pinned_touches, &mut self.last_pinned_touches);
        self.pinned_touches.clear();
    }

    /// Discards the last step that was begun. The body keeps its touching state, but no contact reports a force.
    pub fn keep_previous(&mut self) {
        self.touches.clear();
        self.commit_asleep();
    }

    /// Ends a step in which the body was asleep. The touching state does not change.
    pub fn commit_asleep(&mut self) {
        for pair in &mut self.touched {
            *pair = [pair[0]; 2];
        }
    }

    /// The contacts with the tool in this slot of the world in the last committed step.
    pub fn touches(&self, slot: usize) -> impl Iterator<Item = &ToolContact> {
        self.touches.iter().filter(move |touch| touch.slot == slot)
    }

    /// True if the tool in this slot touched the body in the last committed step, and in the one before.
    pub fn touched(&self, slot: usize) -> [bool; 2] {
        self.touched.get(slot).copied().unwrap_or_default()
    }

    /// Sets the collision filter of the body.
    pub fn set_filter(&mut self, filter: CollisionFilter) {
        self.filter = filter;
        self.invalidate_candidates();
    }

    /// Sets the contact thickness of the body, m.
    pub fn set_thickness(&mut self, thickness: f32) {
        self.thickness = thickness;
        self.invalidate_candidates();
    }

    /// Invalidates the candidate list: tools were added, nodes were moved from outside, or the origin changed.
    pub fn invalidate_candidates(&mut self) {
        self.candidates.invalidate();
    }

    /// Adds a tool without load at `index` of the step. Its memory is [reserved](Self::reserve).
    pub fn add_tool(&mut self, index: usize) {
        if index <= self.loads.len() {
            self.loads.insert(index, ToolLoad::default());
        }
    }

    /// Removes the tool in `slot` of the world and at `index` of the step. The loads on other tools stay valid while
    /// the body sleeps.
    pub fn forget_tool(&mut self, slot: usize, index: usize) {
        if index < self.loads.len() {
            self.loads.remove(index);
        }
        self.candidates.remove_tool(slot);
        self.multipliers.remove_tool(slot);
        self.touches.retain(|touch| touch.slot != slot);
        self.last_pinned_touches.retain(|touch| touch.slot != slot);
        if let Some(pair) = self.touched.get_mut(slot) {
            *pair = [false; 2];
        }
    }

    /// Reserves memory for `count` more attached nodes.
    pub fn reserve_attached(&mut self, count: usize) -> Result<()> {
        Ok(self.attached_nodes.try_reserve(count)?)
    }

    /// Adds sorted nodes that tools are attached to. These tools no longer touch them. The memory is reserved.
    pub fn attach_nodes(&mut self, added: &[(u32, usize)]) {
        memory::merge(&mut self.attached_nodes, added, |&entry| entry);
    }

    /// Removes attached nodes for which `stays` is false.
    pub fn retain_attached(&mut self, stays: impl Fn(u32) -> bool) {
        self.attached_nodes.retain(|&(node, _)| stays(node));
    }

    /// Stores the multipliers of a solved equation as the warm start of the next.
    pub fn store_warm_starts(&mut self, tools: &[ToolPath]) {
        self.multipliers
            .update_warm_starts(&self.constraints, |index| tools[index].slot);
    }

    /// Visits each node with a contact impulse and the contact's normal. With friction the normal is `None`: all of the
    /// motion is affected. If the motion is smooth, contacts that the last equation had too are skipped.
    pub fn visit_touched(&self, is_smooth: bool, mut visit: impl FnMut(usize, Option<Vec3>)) {
        for (index, constraint) in self.constraints.iter().enumerate() {
            if constraint.total_impulse() != Vec3::ZERO && !(is_smooth && self.multipliers.was_active(index)) {
                for &node in constraint.nodes() {
                    visit(node as usize, (constraint.friction == 0.0).then_some(constraint.normal));
                }
            }
        }
        for contact in self
            .nodes
            .iter()
            .filter(|contact| contact.total_impulse() != Vec3::ZERO)
        {
            visit(
                contact.node as usize,
                (contact.friction == 0.0).then_some(contact.normal),
            );
        }
    }

    /// Sum of the contact impulses in excess of the multipliers of the substep's equation, and sum of all contact
    /// impulses, N s.
    pub fn excess_impulse(&self, substep: f64) -> [f64; 2] {
        self.excess_impulses(substep)
            .fold([0.0; 2], |[excess, all], (_, more, total)| [excess + more, all + total])
    }

    /// The excess and the total impulse of each contact, N s, with the tool's index in the step.
    pub(super) fn excess_impulses(&self, substep: f64) -> impl Iterator<Item = (usize, f64, f64)> {
        let from_constraints = self.constraints.iter().enumerate().map(move |(index, constraint)| {
            let total = constraint.total_impulse().as_dvec3();
            let in_equation = if index < self.multipliers.len() {
                self.multipliers.force(index) * substep
            } else {
                DVec3::ZERO
            };
            (constraint.tool, (total - in_equation).length(), total.length())
        });
        let from_nodes = self.nodes.iter().map(|contact| {
            let total = contact.total_impulse().as_dvec3().length();
            (contact.tool, total, total)
        });
        from_constraints.chain(from_nodes)
    }

    /// Averages the loads on tools over a long substep: the forces at its end, from its equation, and those at its
    /// start, from the last equation.
    pub fn average_loads(&mut self, tools: &[ToolPath], substep: f64) {
        self.multipliers.visit_warm_starts(|slot, force, arm| {
            if let Some(index) = tools.iter().position(|tool| tool.slot == slot) {
                self.loads[index].add(force * (0.5 * substep), arm);
            }
        });
        for (index, constraint) in self.constraints.iter().enumerate().take(self.multipliers.len()) {
            self.loads[constraint.tool].add(self.multipliers.force(index) * (0.5 * substep), constraint.arm);
        }
    }

    /// The work of tools on the body since the step of `dt` seconds began, J.
    pub fn work_of_tools(&self, tools: &[ToolPath], dt: f32) -> f64 {
        let tools = tools.iter().zip(&self.loads).enumerate();
        let moving = tools.filter(|(_, (tool, _))| tool.moves());
        let work = moving.map(|(index, (tool, load))| match self.dynamic_tools.received(index) {
            Some(received) => -received,
            // If tissue hits a tool faster than the tool moves, the rest of the energy is lost.
            None => {
                let [displacement, rotation] = tool.travel();
                -(load.impulse.dot(displacement) + load.angular_impulse.dot(rotation)) / f64::from(dt)
            }
        });
        work.sum()
    }

    /// The speed of the fastest kinematic tool that has touched the body in a step of `dt` seconds, m/s.
    pub fn fastest_touching(&self, tools: &[ToolPath], dt: f32) -> f32 {
        let tools = tools.iter().zip(&self.loads).enumerate();
        let touching = tools
            .filter(|(index, (_, load))| load.impulse != DVec3::ZERO && self.dynamic_tools.received(*index).is_none());
        touching.fold(0.0, |fastest: f32, (_, (tool, _))| fastest.max(tool.speed(dt)))
    }

    /// The load on each tool of the step.
    pub fn loads(&self) -> &[ToolLoad] {
        &self.loads
    }

    /// Bounding box of all velocities, from the box of velocities before contact.
    pub fn velocities(&self, before: Aabb) -> Aabb {
        before.and(&self.velocity_bounds)
    }

    /// Finds the contacts that the substep's equation includes: all that may touch at these velocities, or whose gap is
    /// within the slack. `stiffness_of` returns the stiffness of a node, N/m. Returns false if something moves too far
    /// for a prediction. That never happens in a short substep in which slow tools already press the body.
    pub fn predict_contacts(
        &mut self,
        mut input: ContactInput,
        is_long: bool,
        stiffness_of: impl Fn(usize) -> f32,
    ) -> bool {
        self.multipliers.clear();
        self.clear_contacts();
        if input.tools.is_empty() {
            return true;
        }
        self.find_candidates(&input);
        if self.candidates.near().is_empty() {
            return true;
        }
        // Nodes of pressed tissue that became fast, as in stiff tissue, are still pressed.
        let stays_pressed = !is_long && self.multipliers.had_active() && !self.has_fast_tool(&input);
        if !stays_pressed && self.needed_slices(&input) > 1 {
            return false;
        }
        let slice = SubSlice::ahead(&input);
        let (start, end) = (input.start, input.end);
        self.find(&mut input, &slice, [start, end]);
        self.constraints.truncate(MAX_EQUATION_CONTACTS);
        let displacement = |node: usize| input.velocities.get(node) * input.substep;
        let slot = |index: usize| input.tools[index].slot;
        let conditions = (input.substep, input.bindings, &*input.pins);
        self.multipliers
            .begin(&self.constraints, slot, conditions, stiffness_of, displacement);
        true
    }

    /// Discards the multipliers of an equation that is about to be accepted if nodes move too far for its contacts.
    pub fn discard_uncertain_contacts(&mut self, input: &ContactInput) {
        self.find_candidates(input);
        if self.needed_slices(input) > 1 {
            self.multipliers.clear();
        }
    }

    /// Applies the impulses that keep the body out of the tools, and moves the nodes that they touch.
    pub fn resolve(&mut self, mut input: ContactInput) {
        self.velocity_bounds = Aabb::EMPTY;
        if input.tools.is_empty() {
            return;
        }
        let mut paths = std::mem::take(&mut self.dynamic_tools.paths);
        let (dt, kick) = (input.dt, (input.drifts, input.mobility.half));
        if !paths.is_empty() {
            let ends = [input.start, input.end];
            self.dynamic_tools.extrapolate_paths(&mut paths, ends, dt, kick);
            if !self.candidates.covers(&paths, self.filter, input.origin) {
                self.candidates.invalidate();
            }
        }
        let slices = self.prepare_slices(&input.with_paths(&paths));
        for index in 0..slices {
            let slice_fraction = |index: u32| f64::from(index) / f64::from(slices);
            let slice = SubSlice {
                time_left: input.substep * (1.0 - slice_fraction(index)) as f32,
                duration: input.substep / slices as f32,
                is_first: index == 0,
                sweeps: if slices == 1 { SWEEPS } else { SWEEPS_PER_SLICE },
                is_predictive: false,
            };
            let step_fraction = |fraction: f64| (input.start + (input.end - input.start) * fraction).min(1.0);
            let ends = [
                step_fraction(slice_fraction(index)),
                step_fraction(slice_fraction(index + 1)),
            ];
            if !paths.is_empty() && slices > 1 {
                self.dynamic_tools.extrapolate_paths(&mut paths, ends, dt, kick);
            }
            self.contact_rows.dynamic_tools.clear();
            self.dynamic_tools
                .visit_solver_tools(|tool| self.contact_rows.dynamic_tools.push(tool));
            let mut input = input.with_paths(&paths);
            if self.multipliers.is_empty() {
                self.clear_contacts();
            } else {
                self.adopt_solution(&input);
            }
            self.find(&mut input, &slice, ends);
            let watch = Stopwatch::start(input.profile);
            self.solve(&mut input, &slice);
            watch.stop(input.profile, Stage::ContactSolver);
            self.dynamic_tools
                .advance(&self.loads, ends[1], &self.contact_rows.dynamic_tools);
        }
        self.dynamic_tools.paths = paths;
        if slices > 0 && self.velocity_bounds != Aabb::EMPTY {
            let fastest = self.velocity_bounds.magnitudes().length();
            self.candidates.spend_slack(input.substep * fastest);
        }
    }

    /// Finds the candidates and returns the number of slices of the substep; 0 if no tool is near.
    fn prepare_slices(&mut self, input: &ContactInput) -> u32 {
        self.find_candidates(input);
        if self.candidates.near().is_empty() && self.multipliers.is_empty() {
            self.clear_contacts();
            return 0;
        }
        let slices = if input.drifts && self.multipliers.is_empty() {
            self.needed_slices(input)
        } else {
            1
        };
        self.impulse_duration = input.kick_duration() / slices as f32;
        self.slice_duration = input.substep / slices as f32;
        slices
    }

    /// Updates the constraints in a solved equation to its solution.
    fn adopt_solution(&mut self, input: &ContactInput) {
        for (index, constraint) in self.constraints.iter_mut().enumerate() {
            let (gap, force, open) = self.multipliers.gap_state(index);
            let impulses = (
                force as f32 * input.substep,
                self.multipliers.friction_force(index).as_vec3() * input.substep,
            );
            let feature_nodes = FeatureNodes::new(constraint.feature, input.bindings);
            let response = (&feature_nodes, &input.mobility, input.held_axes(&feature_nodes));
            *constraint = constraint.solved(
                &gap,
                impulses,
                (if force > 0.0 { 0.0 } else { open as f32 }, input.substep),
                input.velocities,
                response,
            );
            if self.multipliers.has_friction(index) {
                // The equation includes the friction. Applying its remainder here would stop light nodes that slip.
                constraint.friction = 0.0;
            }
        }
    }

    fn clear_contacts(&mut self) {
        self.constraints.clear();
        self.nodes.clear();
    }
}
