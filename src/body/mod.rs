//! Bodies: nodes with mass, joined by springs or finite elements.

mod blade;
#[cfg(test)]
mod bound_tests;
mod change_log;
mod components;
mod cut;
mod cut_masses;
mod cut_springs;
mod cut_state;
mod edit;
mod energy;
mod frames;
mod hash;
mod mass_shares;
mod material_point;
mod node_order;
mod origin;
mod pin_sets;
mod properties;
mod query_tree;
mod readback;
mod region;
mod settings;
mod solver_choice;
mod spring_params;
mod strain_monitor;
mod stroke;
mod substep_limit;
mod surface;
mod tear;
mod tear_queue;
mod tear_solid;
mod tear_strength;

use glam::{DVec3, Vec3};

#[cfg(doc)]
use crate::base::Error;
use crate::def::{BodyDefinition, EnclosedReport, Energy, SolverChoice, SolverReport, Storage, StorageReport};
use crate::geometry::Aabb;
use crate::simd::ChosenKernel;
use crate::soa::{NodeOrder, tile_nodes};
pub(crate) use blade::TissuePoint;
pub use change_log::{NewNodeSource, NewRimEdge, TopologyChanges};
pub use cut::CutReport;
use cut_state::CutState;
pub use spring_params::SpringState;
pub(crate) use tear::TearOutcome;

use crate::base::{BodyId, Result, ensure, memory};
use crate::codec::saved;
use crate::contact::{Contact, Contacts, ToolCapacity, ToolPath};
use crate::cutting::CutMaterial;
use crate::forces::Forces;
use crate::material::DerivedProperties;
use crate::nodes::vector;
use crate::readers::Shown;
use crate::slots::Slots;
use crate::solver::{
    Changed, CoarseStep, CutProperties, IntegratorState, RestStateDefinition, RestStateReport, System, Systems,
    rest_state,
};
use crate::threads::Team;
pub use components::Pieces;
pub(crate) use material_point::MaterialPoint;
use node_order::{order_for_springs, order_for_tetrahedra};
use origin::shift_towards;
use query_tree::QueryTree;
use readback::Readback;
pub(crate) use stroke::BladeStroke;
use surface::surface_of;
use tear_queue::TearQueue;

/// Bodies with at most this many nodes keep the caller's order. The search for a faster order takes longer than the
/// rest of their creation.
const MAX_UNSORTED_NODES: usize = 32;

/// Soft tissue: nodes with mass, joined by springs or finite elements, with an optional surface.
///
/// All coordinates and indices are the caller's.
///
/// ```
#[doc = include_str!("../doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// # let body = world.create_body(&cloth)?;
/// world.body_mut(body)?.pin(0)?;
/// world.step(1.0 / 60.0)?;
/// let body = world.body(body)?;
/// assert_eq!(body.positions()[0], mesh.positions[0]);
/// assert!(body.positions()[12].y < mesh.positions[12].y);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Debug)]
pub struct Body {
    system: System,
    /// Present if the body can be cut.
    cut_state: Option<Box<CutState>>,
    /// Present if the body can tear.
    tear_queue: Option<Box<TearQueue>>,
    /// One bit per node, in the caller's order: set for corners of the surface. Empty until a spring is removed.
    surface_corners: Vec<u64>,
    readback: Readback,
    /// Present if the body has readers.
    frames: Option<Box<Shown>>,
    query_tree: QueryTree,
    /// The solver and the reason for its choice.
    solver_choice: SolverChoice,
    /// Data of the caller, which the library does not read.
    user_data: usize,
}

saved! { Body {
    system, cut_state, tear_queue, surface_corners, readback, solver_choice
} leaves { user_data: 0, frames: None, query_tree: QueryTree::default() } where Self::is_valid }

impl Systems for Slots<Body> {
    fn at(&self, index: usize) -> Option<&System> {
        self.at(index).map(|body| &body.system)
    }

    fn at_mut(&mut self, index: usize) -> Option<&mut System> {
        self.at_mut(index).map(|body| &mut body.system)
    }
}

/// Properties of a world that its bodies depend on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BodyContext {
    pub tolerance: bool,
    /// `None` if there is no contact.
    pub tools: Option<ToolCapacity>,
    pub kernel: ChosenKernel,
    pub steps: StepSettings,
}

/// Length and substeps of the steps that a body is created for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StepSettings {
    /// Length of a step, s.
    pub length: f32,
    /// Number of substeps; 0 if stability determines it.
    pub substeps: u32,
    pub max_substeps: u32,
}

impl Body {
    /// Creates a body from a definition whose solver is not AUTO.
    fn with_solver(definition: &BodyDefinition, context: BodyContext) -> Result<Self> {
        definition.check()?;
        let from_material = definition
            .material
            .as_ref()
            .map(|material| DerivedProperties::derive(material, definition));
        let from_material = from_material.transpose()?;
        let definition = &from_material
            .as_ref()
            .map_or(*definition, |from_material| from_material.complete(definition));
        let node_count = definition.positions.len();
        let mut springs = definition.resolved_springs()?;
        let law = from_material.as_ref().and_then(|from_material| from_material.law);
        let order = match definition.storage {
            Storage::Packed if node_count <= MAX_UNSORTED_NODES => NodeOrder::default(),
            Storage::Packed if springs.is_empty() && law.is_some() => {
                order_for_tetrahedra(definition.positions, definition.tetrahedra)?
            }
            Storage::Packed => order_for_springs(definition.positions, &springs, definition.rounding())?,
            _ => NodeOrder::default(),
        };
        if springs.is_empty() {
            // Without springs, volume terms alone can be viscous, but not plastic. Where tetrahedra are elements, edges
            // have no springs.
            for (name, value, is_used) in [
                (
                    "retardation_time",
                    definition.viscosity.retardation_time,
                    law.is_some() || definition.volume_stiffness > 0.0,
                ),
                ("yield_strain", definition.yielding.strain, law.is_some()),
                ("stiffness", definition.stiffnesses.uniform(), law.is_none()),
                ("spring_damping", definition.spring_dampings.uniform(), law.is_none()),
            ] {
                ensure!(
                    value <= 0.0 || is_used,
                    "{name} is {value}, and the body has no springs, nor elements that use it"
                );
            }
        }
        let mut surface = surface_of(definition)?;
        let cut_state = CutState::new(definition, &springs, &surface, &order)?;
        if let Some(cut_state) = cut_state.as_ref().filter(|_| definition.triangles.is_empty()) {
            // The same triangles, in the order in which cuts number them.
            cut_state.copy_surface(&mut surface)?;
        }
        let forces = Forces::new(context.kernel, definition, law, &mut springs, &surface, &order)?;
        let tear_queue = TearQueue::new(definition, &springs, law.is_some(), &order)?;
        let mut system = System::new(definition, context.kernel, order, forces, surface)?;
        system.coarse = context.tolerance.then(|| CoarseStep::new(node_count)).transpose()?;
        system.cut_properties = cut_state.as_ref().map(|cut_state| CutProperties {
            toughness: definition.toughness,
            is_solid: matches!(cut_state.material, CutMaterial::Solid(_)),
        });
        let mut body = Self {
            system,
            cut_state,
            tear_queue,
            surface_corners: Vec::new(),
            readback: Readback::new(node_count)?,
            frames: None,
            query_tree: QueryTree::default(),
            solver_choice: SolverChoice::given(definition.solver),
            user_data: 0,
        };
        body.set_node_positions(definition.positions);
        body.system.create_solver(definition)?;
        if let Some(tools) = context.tools {
            body.make_contacts(tools)?;
        }
        body.system.enable_sleep(definition.sleep)?;
        if definition.spare_nodes > 0 {
            body.reserve_nodes(definition.spare_nodes as usize)?;
        }
        Ok(body)
    }

    /// True if the published lists have an entry for each node.
    fn is_valid(&self) -> bool {
        self.readback.is_valid(self.node_count())
    }

    /// The part of the body that solvers and contact work on.
    pub(crate) fn system(&self) -> &System {
        &self.system
    }

    pub(crate) fn system_mut(&mut self) -> &mut System {
        &mut self.system
    }

    /// The number of nodes.
    pub fn node_count(&self) -> usize {
        self.system.node_count()
    }

    /// The mass of a node, kg. It is 0 for a node that is permanently pinned, or bound to others.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: there is no such node.
    pub fn node_mass(&self, node: u32) -> Result<f32> {
        self.check_node(&"node", node)?;
        Ok(self.system.masses[self.system.order.own(node) as usize])
    }

    /// The triangles of the render surface: those of the definition, or the outer faces of its tetrahedra or cells.
    /// Outer faces of tetrahedra face outward, whatever their orientation in the definition.
    pub fn surface(&self) -> &[[u32; 3]] {
        &self.system.surface
    }

    /// True if the surface is closed. Only a closed surface has an inside from which tools and other tissue are pushed
    /// out. [`remove_spring`](Self::remove_spring) opens the surface when it removes one of its edges. An open surface
    /// collides from either side.
    pub fn is_closed(&self) -> bool {
        // Out of memory: the surface counts as open.
        !self.system.is_cut_open && crate::mesh::is_closed(&self.system.surface).unwrap_or(false)
    }

    /// The two nodes of each spring, the lower one first. Each spring occurs once.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub fn spring_pairs(&self) -> Result<Vec<[u32; 2]>> {
        let mut pairs = memory::reserved(self.system.forces.springs.spring_count())?;
        for node in 0..self.node_count() as u32 {
            let own = self.system.order.own(node) as usize;
            self.system.forces.springs.visit(own, &mut |link| {
                let neighbor = self.system.order.caller(link.neighbor);
                if neighbor > node {
                    pairs.push([node, neighbor]);
                }
            });
        }
        Ok(pairs)
    }

    /// The energy at the time of the positions.
    pub fn energy(&self, gravity: Vec3) -> Energy {
        Energy::of(self, gravity)
    }

    /// The memory that the springs take.
    pub fn storage_report(&self) -> StorageReport {
        let (bytes_used, bytes_reserved) = self.system.forces.springs.bytes();
        StorageReport {
            node_count: self.node_count(),
            spring_count: self.system.forces.springs.spring_count(),
            bytes_used,
            bytes_reserved,
        }
    }

    /// The volume and the pressure of the cavities.
    pub fn enclosed(&self) -> EnclosedReport {
        let positions = self.system.state.positions();
        self.system.forces.report_cavities(positions)
    }

    /// The solver's report of the last step.
    pub fn solver_report(&self) -> SolverReport {
        self.system.solver_report()
    }

    pub(crate) fn make_contacts(&mut self, tools: ToolCapacity) -> Result<()> {
        match &mut self.system.contacts {
            Some(contacts) => contacts.reserve(tools)?,
            None => {
                let surface = self.system.order.own_triangles(&self.system.surface)?;
                let contacts = Contacts::new(self.system.state.positions(), &surface, &self.system.contact, tools)?;
                self.system.contacts = Some(memory::boxed(contacts)?);
            }
        }
        if self.cut_state.is_some() {
            // The search structures for edges are allocated now, not with the first cut.
            return self.reserve_surface(0, 0, 0);
        }
        self.system.reserve_holds()
    }

    /// The contacts with the tool in this slot after the last step.
    pub(crate) fn contacts_with(&self, slot: usize, body: BodyId) -> impl Iterator<Item = Contact> {
        let contacts = self.system.contacts.iter();
        let touches = contacts.flat_map(move |contacts| contacts.touches(slot));
        touches.map(move |touch| Contact {
            normal: touch.normal,
            force: touch.force,
            ..self.contact_at(body, touch.nodes, touch.weights)
        })
    }

    /// A contact at a point between nodes, given by their internal indices, without a force.
    pub(crate) fn contact_at(&self, body: BodyId, nodes: [u32; 3], weights: [f32; 3]) -> Contact {
        let nodes = nodes.map(|node| self.system.order.caller(node));
        let positions = nodes.map(|node| self.readback.positions()[node as usize].as_dvec3());
        let point = (0..3).map(|corner| positions[corner] * f64::from(weights[corner]));
        Contact {
            body,
            nodes,
            weights,
            point: point.sum::<DVec3>().as_vec3(),
            normal: Vec3::ZERO,
            force: Vec3::ZERO,
        }
    }

    /// The velocity of a point of the surface, m/s. It is that of the end of the last step, or of up to half a substep
    /// earlier.
    pub(crate) fn velocity_at(&self, contact: &Contact) -> Vec3 {
        let velocities = self.system.state.velocities();
        let velocity_of = |node: u32| {
            let own = self.system.order.own(node) as usize;
            vector(self.system.bindings.as_ref(), velocities, own)
        };
        (0..3)
            .map(|corner| velocity_of(contact.nodes[corner]) * contact.weights[corner])
            .sum()
    }

    /// The effective mass for an impulse at a point of the surface, kg, without the coupling of its nodes. 0 if all are
    /// held.
    pub(crate) fn effective_mass_at(&self, contact: &Contact) -> f64 {
        let own = |corner: usize| self.system.order.own(contact.nodes[corner]);
        let inverse_mass = |node: u32, weight: f32| match f64::from(self.system.masses[node as usize]) {
            0.0 => 0.0,
            mass => f64::from(weight).powi(2) / mass,
        };
        let bound = |node: u32| self.system.bindings.as_ref().and_then(|bindings| bindings.get(node));
        let corner_inverse_mass = |corner: usize| {
            let weight = contact.weights[corner];
            match bound(own(corner)) {
                Some(bound) => bound
                    .weighted_nodes()
                    .map(|(node, part)| inverse_mass(node, weight * part))
                    .sum(),
                None => inverse_mass(own(corner), weight),
            }
        };
        let inverse_mass: f64 = (0..3).map(corner_inverse_mass).sum();
        if inverse_mass > 0.0 { 1.0 / inverse_mass } else { 0.0 }
    }

    /// The origin of the local coordinates.
    pub(crate) fn origin(&self) -> DVec3 {
        self.system.origin
    }

    /// Sets the positions of all nodes, in the caller's coordinates.
    fn set_node_positions(&mut self, positions: &[Vec3]) {
        self.system.origin = shift_towards(Aabb::of(positions.iter().copied()));
        self.system.forces.move_origin(self.system.origin);
        let local = self.system.state.positions_mut();
        for (node, position) in (0..).zip(positions) {
            let own = self.system.order.own(node) as usize;
            local.set(own, (position.as_dvec3() - self.system.origin).as_vec3());
        }
        self.system.update_bound_points();
        self.query_tree.mark_outdated();
        let (kernel, local) = (self.system.kernel, self.system.state.positions());
        for (tile, bounds) in self.system.boxes.iter_mut().enumerate() {
            *bounds = kernel.ranges(local.slices(tile_nodes(tile, local.len()))).into();
        }
        self.readback.positions_mut().copy_from_slice(positions);
        for bound in self.system.bindings.iter().flat_map(|bindings| bindings.iter()) {
            let bound_position = local.get(bound.node as usize).as_dvec3() + self.system.origin;
            self.readback.positions_mut()[self.system.order.caller(bound.node) as usize] = bound_position.as_vec3();
        }
        self.publish_frame(&Team::alone());
        self.system.reattach_in_place();
        self.system.forces.commit_relaxed(self.system.state.positions());
        self.system.changed(Changed::Positions);
    }

    /// Moves the body to its static equilibrium.
    pub(crate) fn rest_state(&mut self, gravity: Vec3, definition: &RestStateDefinition) -> Result<RestStateReport> {
        let report = rest_state(&mut self.system, gravity, definition)?;
        self.publish(&Team::alone());
        self.update_origin();
        Ok(report)
    }

    /// Commits the step in progress, of `substeps` substeps and `dt` seconds.
    pub(crate) fn commit(&mut self, step: (u32, f32), carry: IntegratorState, tools: &[ToolPath], team: &Team) {
        self.system.commit(step, carry, tools);
        self.publish(team);
        self.update_origin();
    }

    /// Moves the origin of the local coordinates towards the body.
    fn update_origin(&mut self) {
        let bounds = self.system.local_bounds();
        let shift = shift_towards(bounds);
        if shift == DVec3::ZERO {
            return;
        }
        self.system.origin += shift;
        self.system.forces.move_origin(self.system.origin);
        self.system.changed(Changed::Origin);
        let positions = self.system.state.positions_mut();
        for node in 0..positions.len() {
            positions.set(node, (positions.get(node).as_dvec3() - shift).as_vec3());
        }
        // Exact, as for the nodes: the sides of boxes are coordinates of nodes.
        for bounds in &mut self.system.boxes {
            *bounds = bounds.moved(-shift);
        }
    }
}
