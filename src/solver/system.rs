//! The simulated part of a body: nodes, forces, and data that the solver keeps between steps.

use glam::{BVec3, DVec3, Vec3};

use super::critical_nodes::CriticalNodes;
use super::energy_account::EnergyAccount;
use super::energy_sums::TileSums;
use super::integrator::{self, Integrator};
use super::kick::TileStats;
use super::leapfrog::Leapfrog;
use super::mass_scaling::{MassScaleTarget, MassScaling, masses_in_use};
use super::pre_kick_velocities::PreKickVelocities;
use super::sleep::SleepState;
use super::substep_history::SubstepHistory;
use super::tool_attachments::ToolAttachments;
use super::{Changed, CoarseStep, GravityKicks, IntegratorState, Stability, flush_half_kick};
use crate::base::{Result, memory};
use crate::codec::saved;
use crate::contact::{Contacts, ToolPath};
use crate::def::{BodyContact, BodyDefinition, Solver, Values};
use crate::forces::Forces;
use crate::geometry::Aabb;
use crate::nodes::{Bindings, NodeDamping, Pins, State};
use crate::simd::ChosenKernel;
use crate::soa::{NodalMasses, NodeOrder, Vectors, per_node, tile_count};
use crate::threads::Team;

/// The cutting properties of a body.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CutProperties {
    /// The toughness (J/m, for solids J/m²).
    pub toughness: f32,
    /// True for a solid.
    pub is_solid: bool,
}

saved! { CutProperties { toughness, is_solid } }

/// A body for solvers and contact, in its own numbering and coordinates.
#[derive(Debug)]
pub(crate) struct System {
    /// The node order. All indices are the body's own, except those in `surface`.
    pub order: NodeOrder,
    pub forces: Forces,
    pub kernel: ChosenKernel,
    /// Masses, kg; 0 for permanently pinned nodes.
    pub masses: Vec<f32>,
    /// Inverse masses with added mass, 1/kg; 0 for pinned nodes.
    pub inverse_masses: Vec<f32>,
    /// The common inverse mass of all free nodes, if there is one.
    pub uniform_inverse_mass: Option<f32>,
    pub damping: Option<NodeDamping>,
    pub critical_nodes: CriticalNodes,
    /// Present if added mass can lengthen substeps.
    pub scaling: Option<Box<MassScaling>>,
    pub pins: Pins,
    /// Statistics of each tile in the last substep.
    pub tile_stats: Vec<TileStats>,
    /// Energy sums of each tile at the last comparison.
    pub tile_sums: Vec<TileSums>,
    /// Bounding box of each tile in current body coordinates, at the last publication or change of positions.
    pub boxes: Vec<Aabb>,
    /// Triangles of the render and collision surface, in the caller's numbering.
    pub surface: Vec<[u32; 3]>,
    pub state: State,
    /// The origin of the body coordinates.
    pub origin: DVec3,
    /// Velocities at the time of the positions, for springs with damping.
    pub predicted_velocities: Option<Vectors>,
    pub integrator: Box<dyn Integrator>,
    /// Applied forces for the next step, N. Allocated with the first force.
    pub applied: Option<Vectors>,
    /// Velocities before the last half kick, of the committed and the attempted step. Present if the body may press
    /// other bodies.
    pub pre_kick_velocities: Option<[PreKickVelocities; 2]>,
    pub contacts: Option<Box<Contacts>>,
    pub contact: BodyContact,
    /// Bound surface points. Present if the body can be cut.
    pub bindings: Option<Bindings>,
    /// The node capacity; 0 for the present number of nodes.
    pub node_capacity: usize,
    /// True if an edge of the surface was removed.
    pub is_cut_open: bool,
    /// Nodes that are attached to tools.
    pub tool_attachments: Option<Box<ToolAttachments>>,
    pub carry: IntegratorState,
    /// True if the stored forces belong to the current positions and velocities.
    pub forces_current: bool,
    /// True if `applied` contains forces.
    pub forces_applied: bool,
    /// Present in worlds with a tolerance.
    pub coarse: Option<CoarseStep>,
    /// Present if the body can sleep.
    pub sleep_state: Option<Box<SleepState>>,
    /// Present if the body can be cut.
    pub cut_properties: Option<CutProperties>,
    /// The factor of the world's gravity.
    pub gravity_scale: f32,
    /// Acceleration of all nodes in addition to gravity, m/s².
    pub acceleration: Vec3,
}

saved! { System {
    order, forces, kernel, masses, inverse_masses, uniform_inverse_mass, damping, critical_nodes, scaling, pins,
    tile_stats, tile_sums, boxes, surface, state, origin, predicted_velocities, integrator, applied,
    pre_kick_velocities, contacts, contact, bindings, node_capacity, is_cut_open, tool_attachments, carry, forces_current,
    forces_applied, coarse, sleep_state, cut_properties, gravity_scale, acceleration,
} where Self::is_sound }

per_node! { System {
    order, forces, masses, inverse_masses, damping, state, predicted_velocities, integrator, applied,
    pre_kick_velocities, coarse, sleep_state,
} tiles { tile_stats, tile_sums, boxes } }

impl System {
    /// Creates a body from a definition. Nodes do not have positions yet, and there is no solver data. `surface` is in
    /// the caller's numbering.
    pub fn new(
        definition: &BodyDefinition,
        kernel: ChosenKernel,
        order: NodeOrder,
        forces: Forces,
        surface: Vec<[u32; 3]>,
    ) -> Result<Self> {
        let node_count = definition.positions.len();
        let mut pins = Pins::default();
        let mut masses = memory::reserved(node_count)?;
        let mut inverse_masses = memory::reserved(node_count)?;
        for node in 0..node_count as u32 {
            let mass = definition.masses.get(order.caller(node) as usize);
            masses.push(mass);
            inverse_masses.push(if mass > 0.0 { 1.0 / mass } else { 0.0 });
            if mass == 0.0 {
                pins.hold(node, BVec3::TRUE)?;
            }
        }
        let damping = if definition.node_dampings.all_zero() && definition.damping_rate == 0.0 {
            None
        } else {
            let mut rates = memory::reserved(node_count)?;
            let damping = |node: usize| definition.node_dampings.get(order.caller(node as u32) as usize);
            // A permanently pinned node has no rate.
            rates.extend((0..node_count).map(|node| {
                let own = if inverse_masses[node] > 0.0 {
                    definition.damping_rate
                } else {
                    0.0
                };
                damping(node) * inverse_masses[node] + own
            }));
            Some(NodeDamping::new(rates)?)
        };
        Ok(Self {
            order,
            predicted_velocities: forces
                .springs
                .damped()
                .then(|| Vectors::zeros(node_count))
                .transpose()?,
            coarse: None,
            forces,
            kernel,
            uniform_inverse_mass: match definition.masses {
                Values::Uniform(mass) => Some(1.0 / mass),
                Values::Each(_) => None,
            },
            masses,
            inverse_masses,
            damping,
            critical_nodes: CriticalNodes::new(node_count)?,
            scaling: None,
            pins,
            tile_stats: memory::filled(TileStats::EMPTY, tile_count(node_count))?,
            tile_sums: memory::filled(TileSums::default(), tile_count(node_count))?,
            boxes: memory::filled(Aabb::EMPTY, tile_count(node_count))?,
            surface,
            state: State::new(node_count, definition.solver == Solver::Verlet)?,
            origin: DVec3::ZERO,
            integrator: Box::new(Leapfrog),
            applied: None,
            pre_kick_velocities: None,
            contacts: None,
            contact: definition.contact,
            bindings: None,
            node_capacity: 0,
            is_cut_open: false,
            tool_attachments: None,
            carry: IntegratorState {
                stability: Stability::UNKNOWN,
                gravity: GravityKicks::new(Aabb::of([Vec3::ZERO].into_iter())),
                deferred_kick: None,
                scaling_substep: 0.0,
                energy: EnergyAccount::UNKNOWN,
                substep_history: SubstepHistory::UNKNOWN,
            },
            forces_current: false,
            forces_applied: false,
            sleep_state: None,
            cut_properties: None,
            gravity_scale: 1.0,
            acceleration: Vec3::ZERO,
        })
    }

    /// Creates the solver data. Positions must be set.
    pub fn create_solver(&mut self, definition: &BodyDefinition) -> Result<()> {
        let positions = self.state.positions();
        self.integrator = integrator::create(definition, positions, &mut self.forces)?;
        if self.integrator.is_limited_by_stability() && definition.mass_scaling > 0.0 {
            let (uniform, damping) = (self.uniform_inverse_mass, self.damping.as_ref());
            let (forces, masses) = (&self.forces, self.masses());
            let non_spring = forces.non_spring_nodal_stiffness(positions, &masses)?;
            let room = if forces.has_elements() {
                self.node_count() + definition.spare_nodes as usize
            } else {
                0
            };
            let (springs, fraction) = (&*forces.springs, definition.mass_scaling);
            let scaling = MassScaling::new(springs, &non_spring, &self.masses, uniform, damping, room, fraction)?;
            self.scaling = scaling.map(memory::boxed).transpose()?;
        }
        Ok(())
    }

    /// The number of nodes.
    pub fn node_count(&self) -> usize {
        self.masses.len()
    }

    /// The caller's index of one of its own nodes.
    pub fn caller_index(&self, own: usize) -> usize {
        self.order.caller(own as u32) as usize
    }

    /// The masses without added mass.
    pub fn masses(&self) -> NodalMasses<'_> {
        NodalMasses::new(&self.masses, &self.inverse_masses)
    }

    /// Finds the nodes that set the longest stable substep.
    pub fn find_critical_nodes(&mut self) {
        let masses = NodalMasses::new(&self.masses, &self.inverse_masses);
        self.critical_nodes.find(&*self.forces.springs, masses);
    }

    /// The axes along which something constrains the body.
    pub fn held_axes(&self) -> BVec3 {
        if self.forces.auxiliary.holds_any() {
            return BVec3::TRUE;
        }
        self.pins.iter().fold(BVec3::FALSE, |axes, pin| axes | pin.axes)
    }

    /// The longest stable substep of elements, terms and cavities at the current positions, s. Infinity if there are
    /// none.
    pub fn non_spring_dt_limit(&mut self, team: &Team) -> f32 {
        let masses = masses_in_use(&self.masses, &self.inverse_masses, self.scaling.as_deref());
        let positions = self.state.positions();
        self.forces
            .non_spring_dt_limit(positions, &masses, self.forces_current, team)
    }

    /// Tightens the bound of elements, at the newest positions of the step in progress or at the current state. Returns
    /// the longest stable substep of all forces but springs, or `None` if that is already known.
    pub fn tightened_dt_limit(&mut self, is_in_progress: bool, team: &Team) -> Option<f32> {
        let masses = masses_in_use(&self.masses, &self.inverse_masses, self.scaling.as_deref());
        let positions = if is_in_progress {
            self.state.newest().0
        } else {
            self.state.positions()
        };
        self.forces.tightened_dt_limit(positions, &masses, team)
    }

    /// Fades residual strain of elements after cuts, over `time` seconds.
    pub fn fade(&mut self, time: f32, team: &Team) {
        if self.forces.decay_offsets(time, self.state.positions(), team) {
            self.changed(Changed::RestShape);
        }
    }

    /// Estimates the longest stable substep at these positions.
    pub fn estimate(&self, positions: &Vectors) -> Stability {
        Stability::estimate(&*self.forces.springs, self.masses(), positions, &self.critical_nodes)
    }

    /// Adds the mass that substeps of `step` seconds require; 0 removes the added mass. Does nothing if `step` has not
    /// changed.
    pub fn scale_masses_for(&mut self, step: f32) {
        if self.scaling.as_ref().is_some_and(|scaling| scaling.step() != step) {
            self.scale_masses(step);
        }
    }

    /// Adds the mass that substeps of `step` seconds require, after springs or pins have changed too.
    pub fn scale_masses(&mut self, step: f32) {
        let is_free = self.held_axes() == BVec3::FALSE;
        if let Some(scaling) = &mut self.scaling {
            let differ = step > 0.0 || scaling.step() > 0.0;
            let target = MassScaleTarget {
                masses: &self.masses,
                inverse_masses: &mut self.inverse_masses,
                uniform_inverse_mass: &mut self.uniform_inverse_mass,
                damping: self.damping.as_mut(),
            };
            scaling.apply(step, target, is_free);
            if differ {
                self.forces.forget_rates();
            }
        }
    }

    /// The acceleration that acts on all mass of the body, for the world's gravity, m/s².
    pub fn body_acceleration(&self, gravity: Vec3) -> Vec3 {
        gravity * self.gravity_scale + self.acceleration
    }

    /// The acceleration of a node by gravity on its unscaled mass, m/s². `gravity` is that of the body.
    pub fn gravity_at(&self, node: usize, gravity: Vec3) -> Vec3 {
        match self.weight_share() {
            None => gravity * (self.masses[node] * self.inverse_masses[node]),
            Some(share) => gravity * share,
        }
    }

    /// The fraction of the scaled mass that gravity acts on, if the body is unconstrained and mass was added.
    pub fn weight_share(&self) -> Option<f32> {
        self.scaling.as_ref()?.weight_share()
    }

    /// Reserves memory for contacts within equations, if the integrator solves them.
    pub fn reserve_holds(&mut self) -> Result<()> {
        if let Some(contacts) = &mut self.contacts {
            self.integrator.reserve_contacts(contacts)?;
            if self.node_capacity > 0 {
                self.integrator.reserve_nodes(self.node_capacity)?;
            }
        }
        Ok(())
    }

    /// The bounding box of its nodes in body coordinates.
    pub fn local_bounds(&self) -> Aabb {
        self.boxes.iter().fold(Aabb::EMPTY, Aabb::and)
    }

    /// The largest side of the bounding box, m.
    pub fn extent(&self) -> f32 {
        let bounds = self.local_bounds();
        (bounds.max - bounds.min).max_element()
    }

    /// Rolls back an attempted step.
    pub fn rollback(&mut self) {
        self.restore_sleep();
        self.integrator.rollback();
        self.forces.restore();
        self.forces.rollback_bounds();
        if self.scaling.as_ref().is_some_and(|scaling| scaling.has_changed()) {
            // Nodes that were added to the list during the step lose their added mass.
            self.scale_masses(0.0);
            self.scaling.iter_mut().for_each(|scaling| scaling.rollback());
            self.scale_masses(self.carry.scaling_substep);
        }
        self.scale_masses_for(self.carry.scaling_substep);
        if let (Some(damping), Some(deferred_kick)) = (&mut self.damping, &self.carry.deferred_kick) {
            damping.prepare(deferred_kick.substep);
        }
    }

    /// Keeps the current state and discards the attempted step and its input.
    pub fn keep_previous(&mut self) {
        self.rollback();
        self.clear_pending();
        if let Some(contacts) = &mut self.contacts {
            contacts.keep_previous();
        }
    }

    /// Discards the applied forces and pin targets of the last step.
    pub fn clear_pending(&mut self) {
        for pin in self.pins.iter_mut() {
            pin.target = None;
        }
        if self.forces_applied
            && let Some(applied) = &mut self.applied
        {
            applied.clear();
        }
        self.forces_applied = false;
    }

    /// Updates the longest stable substep after springs of these nodes were added or changed. `nodes` are sorted.
    pub fn update_stability(&mut self, nodes: &[u32]) {
        let stability = self.carry.stability;
        let masses = NodalMasses::new(&self.masses, &self.inverse_masses);
        let positions = self.state.positions();
        self.carry.stability = stability.changed(
            nodes,
            &*self.forces.springs,
            masses,
            positions,
            &mut self.critical_nodes,
        );
    }

    /// Updates added masses after springs of these nodes have changed.
    pub fn update_added_masses(&mut self, nodes: &[u32]) {
        if self.carry.scaling_substep > 0.0 {
            // The deferred half kick must use the masses of its step.
            flush_half_kick(self);
        }
        if let Some(scaling) = &mut self.scaling {
            let rates = self.damping.as_ref().map(|damping| damping.rates());
            for &node in nodes {
                scaling.change(node, &*self.forces.springs, &self.masses, rates);
            }
        }
        self.scale_masses(self.carry.scaling_substep);
    }

    /// Sets the velocity of a node (m/s) and updates the energy account.
    pub fn set_velocity(&mut self, node: usize, velocity: Vec3) {
        let velocities = self.state.velocities_mut();
        let change = velocity.as_dvec3().length_squared() - velocities.get(node).as_dvec3().length_squared();
        velocities.set(node, velocity);
        let inverse_mass = f64::from(self.inverse_masses[node]);
        if inverse_mass > 0.0 {
            self.carry.energy.gain(0.5 * change / inverse_mass);
        }
        self.changed(Changed::Velocity);
    }

    /// Places the nodes at rest at `position`, in body coordinates and own numbering. `held` returns the reaction of a
    /// pin.
    pub fn set_at_rest(&mut self, position: impl Fn(usize) -> Vec3, held: impl Fn(usize) -> Vec3) {
        flush_half_kick(self);
        for node in 0..self.node_count() {
            if self.inverse_masses[node] > 0.0 {
                self.state.positions_mut().set(node, position(node));
            }
        }
        self.state.velocities_mut().clear();
        self.carry.gravity = GravityKicks::new(Aabb::of([Vec3::ZERO].into_iter()));
        for pin in self.pins.iter_mut() {
            pin.force = pin.held(held(pin.node as usize));
        }
        self.rest_attachments();
        self.update_bound_points();
        self.forces.commit_relaxed(self.state.positions());
        self.changed(Changed::Positions);
    }

    /// Commits the attempted step of `substeps` substeps and `dt` seconds.
    pub fn commit(&mut self, (substeps, dt): (u32, f32), carry: IntegratorState, tools: &[ToolPath]) {
        self.state.commit();
        self.carry = carry;
        self.forces_current = carry.deferred_kick.is_none() && self.integrator.takes_half_kicks();
        self.forces.commit_bounds();
        self.forces.commit();
        if let Some(scaling) = &mut self.scaling {
            scaling.commit(dt);
        }
        self.integrator.commit();
        if let Some(pre_kick_velocities) = &mut self.pre_kick_velocities {
            pre_kick_velocities.swap(0, 1);
        }
        for pin in self.pins.iter_mut() {
            pin.force = pin.held((pin.force_sum / f64::from(substeps)).as_vec3());
            pin.deferred_share = carry.deferred_kick.map_or(0.0, |_| 0.5 / substeps as f32);
        }
        self.commit_attachments(substeps);
        if let Some(contacts) = &mut self.contacts {
            contacts.commit(tools);
        }
        self.clear_pending();
        self.update_bound_points();
    }
}

/// Access to bodies by their index in the world.
pub(crate) trait Systems {
    fn at(&self, index: usize) -> Option<&System>;
    fn at_mut(&mut self, index: usize) -> Option<&mut System>;
}
