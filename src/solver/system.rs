//! What moves of a body: its nodes, what acts on them, and what its solver keeps from step to step.

use glam::{BVec3, DVec3, Vec3};

use super::early::Early;
use super::energy_account::EnergyAccount;
use super::energy_sums::TileSums;
use super::grasp::Grasps;
use super::integrator::{self, Integrator};
use super::kick::Survey;
use super::leapfrog::Leapfrog;
use super::mass_scaling::{Heavier, MassScaling};
use super::pace::Pace;
use super::sleep::Sleeper;
use super::watched::Watched;
use super::{Carry, Changed, CoarseStep, GravityKicks, Stability, close};
use crate::base::{Result, memory};
use crate::codec::saved;
use crate::contact::{Contacts, ToolPath};
use crate::def::{BodyContact, BodyDefinition, Solver, Values};
use crate::forces::Forces;
use crate::geometry::Bounds;
use crate::nodes::{Bindings, NodeDamping, Pins, State};
use crate::simd::ChosenKernel;
use crate::soa::{Masses, NodeOrder, Vectors, per_node, tile_count};
use crate::threads::Team;

/// How a body is cut.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MayBeCut {
    /// What it takes to cut it, J/m, of solids J/m².
    pub toughness: f32,
    /// Whether it is cut as a solid.
    pub is_solid: bool,
}

saved! { MayBeCut { toughness, is_solid } }

/// A body as solvers and contact see it, in its own numbers and coordinates.
#[derive(Debug)]
pub(crate) struct System {
    /// The numbers of nodes inside are its own, but in `surface`.
    pub order: NodeOrder,
    pub forces: Forces,
    pub kernel: ChosenKernel,
    /// kg, 0 for nodes that are pinned for good.
    pub masses: Vec<f32>,
    /// 1/kg, with what mass scaling adds; 0 for nodes that are pinned.
    pub inverse_masses: Vec<f32>,
    /// That of every node that is not pinned, where they all have the same.
    pub uniform_inverse_mass: Option<f32>,
    pub damping: Option<NodeDamping>,
    pub watched: Watched,
    /// For bodies that some added mass lets take longer substeps.
    pub scaling: Option<Box<MassScaling>>,
    pub pins: Pins,
    /// What a substep found in each tile.
    pub surveys: Vec<Survey>,
    /// What was added up of each tile when its energy was compared last.
    pub tile_sums: Vec<TileSums>,
    /// The box about the nodes of each tile when they were last published or put, in its own coordinates as they are now.
    pub boxes: Vec<Bounds>,
    /// The triangles that are drawn and touched, in the caller's numbers.
    pub surface: Vec<[u32; 3]>,
    pub state: State,
    /// Where the coordinates of the state begin.
    pub origin: DVec3,
    /// Velocities at the time of the positions, for bodies whose springs have damping.
    pub predicted_velocities: Option<Vectors>,
    pub integrator: Box<dyn Integrator>,
    /// Forces from outside for the next step, N; kept from the first force on.
    pub applied: Option<Vectors>,
    /// Velocities from before the last half kick of a step, of the last one and of the one that is tried; for bodies that may press others.
    pub early: Option<[Early; 2]>,
    pub contacts: Option<Box<Contacts>>,
    pub contact: BodyContact,
    /// Points of its surface without mass; kept only by bodies that may be cut.
    pub bindings: Option<Bindings>,
    /// How many nodes there is room for; 0: for those that there are.
    pub node_room: usize,
    /// Whether an edge of its surface was taken away.
    pub is_cut_open: bool,
    /// What tools hold of it.
    pub grasps: Option<Box<Grasps>>,
    pub carry: Carry,
    /// Whether the state's forces belong to its positions and velocities.
    pub forces_current: bool,
    /// Whether `applied` holds anything.
    pub forces_applied: bool,
    /// Kept only in worlds with a tolerance.
    pub coarse: Option<CoarseStep>,
    /// For bodies that sleep.
    pub sleeper: Option<Box<Sleeper>>,
    /// For bodies that may be cut.
    pub may_be_cut: Option<MayBeCut>,
    /// The part of the world's gravity that acts on it.
    pub gravity_scale: f32,
    /// Acts on all nodes beside gravity, m/s².
    pub acceleration: Vec3,
}

saved! { System {
    order, forces, kernel, masses, inverse_masses, uniform_inverse_mass, damping, watched, scaling, pins, surveys,
    tile_sums, boxes, surface, state, origin, predicted_velocities, integrator, applied, early, contacts, contact,
    bindings, node_room, is_cut_open, grasps, carry, forces_current, forces_applied, coarse, sleeper, may_be_cut,
    gravity_scale, acceleration,
} where Self::is_sound }

per_node! { System {
    order, forces, masses, inverse_masses, damping, state, predicted_velocities, integrator, applied, early, coarse,
    sleeper,
} tiles { surveys, tile_sums, boxes } }

impl System {
    /// Of a definition, in this order, with these forces and the surface in the caller's numbers. Its nodes have no positions yet, and nothing
    /// is kept for a solver.
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
            // What is held for good has no rate.
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
            watched: Watched::new(node_count)?,
            scaling: None,
            pins,
            surveys: memory::filled(Survey::NOTHING, tile_count(node_count))?,
            tile_sums: memory::filled(TileSums::default(), tile_count(node_count))?,
            boxes: memory::filled(Bounds::EMPTY, tile_count(node_count))?,
            surface,
            state: State::new(node_count, definition.solver == Solver::Verlet)?,
            origin: DVec3::ZERO,
            integrator: Box::new(Leapfrog),
            applied: None,
            early: None,
            contacts: None,
            contact: definition.contact,
            bindings: None,
            node_room: 0,
            is_cut_open: false,
            grasps: None,
            carry: Carry {
                stability: Stability::UNKNOWN,
                gravity: GravityKicks::new(Bounds::of([Vec3::ZERO].into_iter())),
                closing: None,
                masses_for: 0.0,
                energy: EnergyAccount::UNKNOWN,
                pace: Pace::UNKNOWN,
            },
            forces_current: false,
            forces_applied: false,
            sleeper: None,
            may_be_cut: None,
            gravity_scale: 1.0,
            acceleration: Vec3::ZERO,
        })
    }

    /// Makes what its solver keeps, for nodes that are in their places.
    pub fn make_solver(&mut self, definition: &BodyDefinition) -> Result<()> {
        let positions = self.state.positions();
        self.integrator = integrator::make(definition, positions, &mut self.forces)?;
        if self.integrator.is_limited_by_stability() && definition.mass_scaling > 0.0 {
            let (uniform, damping) = (self.uniform_inverse_mass, self.damping.as_ref());
            let (forces, masses) = (&self.forces, self.masses());
            let beside = forces.carried_beside_springs(positions, &masses)?;
            let room = if forces.has_elements() {
                self.node_count() + definition.spare_nodes as usize
            } else {
                0
            };
            let (springs, part) = (&*forces.springs, definition.mass_scaling);
            let scaling = MassScaling::new(springs, &beside, &self.masses, uniform, damping, room, part)?;
            self.scaling = scaling.map(memory::boxed).transpose()?;
        }
        Ok(())
    }

    /// How many nodes it has.
    pub fn node_count(&self) -> usize {
        self.masses.len()
    }

    /// The caller's number of one of its own nodes.
    pub fn callers(&self, own: usize) -> usize {
        self.order.caller(own as u32) as usize
    }

    /// The masses as the caller gave them.
    pub fn masses(&self) -> Masses<'_> {
        Masses::new(&self.masses, &self.inverse_masses)
    }

    /// Finds the nodes that set the longest stable substep.
    pub fn watch(&mut self) {
        let masses = Masses::new(&self.masses, &self.inverse_masses);
        self.watched.gather(&*self.forces.springs, masses);
    }

    /// The axes along which anything holds it in its place.
    pub fn held_axes(&self) -> BVec3 {
        if self.forces.beside.holds_any() {
            return BVec3::TRUE;
        }
        self.pins.iter().fold(BVec3::FALSE, |axes, pin| axes | pin.axes)
    }

    /// The longest substep that elements, terms and cavities allow with the nodes as they are, s; infinity where there are none.
    pub fn limit_beside_springs(&mut self, team: &Team) -> f32 {
        let masses = Masses {
            masses: &self.masses,
            inverse_masses: &self.inverse_masses,
            are_heavier: self.scaling.as_ref().is_some_and(|scaling| scaling.step() > 0.0),
        };
        let positions = self.state.positions();
        self.forces
            .limit_beside_springs(positions, &masses, self.forces_current, team)
    }

    /// What cuts left of how elements were deformed fades, over so many seconds.
    pub fn fade(&mut self, time: f32, team: &Team) {
        if self.forces.fade(time, self.state.positions(), team) {
            self.changed(Changed::RestShape);
        }
    }

    /// The longest stable substep with the nodes at these positions.
    pub fn estimate(&self, positions: &Vectors) -> Stability {
        Stability::estimate(&*self.forces.springs, self.masses(), positions, &self.watched)
    }

    /// Makes the nodes that need it heavy enough for substeps of `step` seconds; 0: masses as they are.
    pub fn use_masses_for(&mut self, step: f32) {
        if self.scaling.as_ref().is_some_and(|scaling| scaling.step() != step) {
            self.scale_masses(step);
        }
    }

    /// The same, after springs or pins have changed too.
    pub fn scale_masses(&mut self, step: f32) {
        let is_free = self.held_axes() == BVec3::FALSE;
        if let Some(scaling) = &mut self.scaling {
            let differ = step > 0.0 || scaling.step() > 0.0;
            let heavier = Heavier {
                masses: &self.masses,
                inverse_masses: &mut self.inverse_masses,
                uniform_inverse_mass: &mut self.uniform_inverse_mass,
                damping: self.damping.as_mut(),
            };
            scaling.apply(step, heavier, is_free);
            if differ {
                self.forces.forget_rates();
            }
        }
    }

    /// What pulls at all of its mass in a world of this gravity, m/s².
    pub fn pull(&self, gravity: Vec3) -> Vec3 {
        gravity * self.gravity_scale + self.acceleration
    }

    /// The gravity that pulls a node with its mass as it is, given that of the body, m/s².
    pub fn gravity_at(&self, node: usize, gravity: Vec3) -> Vec3 {
        match self.weight_share() {
            None => gravity * (self.masses[node] * self.inverse_masses[node]),
            Some(share) => gravity * share,
        }
    }

    /// What part of all mass gravity pulls at, where mass was added to a body that nothing holds.
    pub fn weight_share(&self) -> Option<f32> {
        self.scaling.as_ref()?.weight_share()
    }

    /// Makes room for contacts within equations, where it has such.
    pub fn reserve_holds(&mut self) -> Result<()> {
        if let Some(contacts) = &mut self.contacts {
            self.integrator.reserve_contacts(contacts)?;
            if self.node_room > 0 {
                self.integrator.reserve_nodes(self.node_room)?;
            }
        }
        Ok(())
    }

    /// The box about its nodes, in its own coordinates.
    pub fn local_bounds(&self) -> Bounds {
        self.boxes.iter().fold(Bounds::EMPTY, Bounds::and)
    }

    /// How far it reaches along an axis, m.
    pub fn extent(&self) -> f32 {
        let bounds = self.local_bounds();
        (bounds.max - bounds.min).max_element()
    }

    /// Prepares again what an attempted step that is not committed has changed.
    pub fn put_back(&mut self) {
        self.sleep_again();
        self.integrator.put_back();
        self.forces.recall();
        if self.scaling.as_ref().is_some_and(|scaling| scaling.has_changed()) {
            // Nodes that were listed for the step alone are as heavy as they were.
            self.scale_masses(0.0);
            self.scaling.iter_mut().for_each(|scaling| scaling.unsettle());
            self.scale_masses(self.carry.masses_for);
        }
        self.use_masses_for(self.carry.masses_for);
        if let (Some(damping), Some(closing)) = (&mut self.damping, &self.carry.closing) {
            damping.prepare(closing.substep);
        }
    }

    /// Leaves the current state as it is, without the step that was attempted.
    pub fn stay(&mut self) {
        self.put_back();
        self.clear_pending();
        if let Some(contacts) = &mut self.contacts {
            contacts.stay();
        }
    }

    /// Forgets the forces and the ways of pins that were meant for the last step.
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

    /// Makes what is known of the longest stable substep true again after springs of these nodes, given in order, have come or
    /// changed.
    pub fn see_stability_of(&mut self, nodes: &[u32]) {
        let stability = self.carry.stability;
        let masses = Masses::new(&self.masses, &self.inverse_masses);
        let positions = self.state.positions();
        self.carry.stability = stability.changed(nodes, &*self.forces.springs, masses, positions, &mut self.watched);
    }

    /// Sees that other springs may ask for other masses of these nodes.
    pub fn scale_for_springs(&mut self, nodes: &[u32]) {
        if self.carry.masses_for > 0.0 {
            // What closes the step is made with the masses that it was taken with.
            close(self);
        }
        if let Some(scaling) = &mut self.scaling {
            let rates = self.damping.as_ref().map(|damping| damping.rates());
            for &node in nodes {
                scaling.change(node, &*self.forces.springs, &self.masses, rates);
            }
        }
        self.scale_masses(self.carry.masses_for);
    }

    /// Gives a node another velocity, m/s: the energy account is told of what that puts in.
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

    /// Puts the nodes at rest at these places, in its own coordinates and numbers, where this holds its pins.
    pub fn rest_at(&mut self, place: impl Fn(usize) -> Vec3, held: impl Fn(usize) -> Vec3) {
        close(self);
        for node in 0..self.node_count() {
            if self.inverse_masses[node] > 0.0 {
                self.state.positions_mut().set(node, place(node));
            }
        }
        self.state.velocities_mut().clear();
        self.carry.gravity = GravityKicks::new(Bounds::of([Vec3::ZERO].into_iter()));
        for pin in self.pins.iter_mut() {
            pin.force = pin.held(held(pin.node as usize));
        }
        self.rest_grasps();
        self.follow_nodes();
        self.forces.relax(self.state.positions());
        self.changed(Changed::Positions);
    }

    /// Makes the step in progress, of `substeps` substeps and `dt` seconds, the current state.
    pub fn commit(&mut self, (substeps, dt): (u32, f32), carry: Carry, tools: &[ToolPath]) {
        self.state.commit();
        self.carry = carry;
        self.forces_current = carry.closing.is_none() && self.integrator.takes_half_kicks();
        self.forces.settle();
        self.forces.keep();
        if let Some(scaling) = &mut self.scaling {
            scaling.settle(dt);
        }
        self.integrator.commit();
        if let Some(early) = &mut self.early {
            early.swap(0, 1);
        }
        for pin in self.pins.iter_mut() {
            pin.force = pin.held((pin.force_sum / f64::from(substeps)).as_vec3());
            pin.closing_share = carry.closing.map_or(0.0, |_| 0.5 / substeps as f32);
        }
        self.commit_grasps(substeps);
        if let Some(contacts) = &mut self.contacts {
            contacts.commit(tools);
        }
        self.clear_pending();
        self.follow_nodes();
    }
}

/// The systems of bodies, by the places of these in a world.
pub(crate) trait Systems {
    fn at(&self, place: usize) -> Option<&System>;
    fn at_mut(&mut self, place: usize) -> Option<&mut System>;
}
