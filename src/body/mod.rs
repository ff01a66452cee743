//! A body: nodes with mass, joined by springs.

mod bearing;
mod blade;
#[cfg(test)]
mod bound_tests;
mod change_log;
mod choice;
mod cut;
mod cut_masses;
mod cut_shares;
mod cut_springs;
mod cuttable;
mod edit;
mod energy;
mod hash;
mod limit;
mod material_point;
mod order;
mod origin;
mod pieces;
mod published;
mod query_tree;
mod region;
mod settings;
mod several;
mod shown;
mod stretch;
mod stroke;
mod surface;
mod tear;
mod tear_solid;
mod tears;
mod tune;
mod whole;

use glam::{DVec3, Vec3};

#[cfg(doc)]
use crate::base::Error;
use crate::def::{BodyDefinition, EnclosedReport, Energy, SolverChoice, SolverReport, Storage, StorageReport};
use crate::geometry::Bounds;
use crate::simd::ChosenKernel;
use crate::soa::{NodeOrder, tile_nodes};
pub(crate) use blade::HoldAt;
pub use change_log::{NewNodeSource, NewRimEdge, TopologyChanges};
pub use cut::CutReport;
use cuttable::Cuttable;
pub(crate) use tear::Torn;
pub use tune::SpringState;

use crate::base::{BodyId, Result, ensure, memory};
use crate::codec::saved;
use crate::contact::{Contact, Contacts, ToolPath, ToolPlaces};
use crate::cutting::CutMaterial;
use crate::forces::Forces;
use crate::material::Made;
use crate::nodes::vector;
use crate::readers::Shown;
use crate::slots::Slots;
use crate::solver::{
    Carry, Changed, CoarseStep, MayBeCut, RestStateDefinition, RestStateReport, System, Systems, rest_state,
};
use crate::threads::Team;
pub(crate) use material_point::MaterialPoint;
use order::{order_for_springs, order_for_tetrahedra};
use origin::shift_towards;
pub use pieces::Pieces;
use published::Published;
use query_tree::QueryTree;
pub(crate) use stroke::Stroke;
use surface::surface_of;
use tears::Tears;

/// A body of so many nodes or fewer keeps the caller's order: the search for the fastest one takes longer than all else that makes the body.
const FEW_NODES: usize = 32;

/// Soft tissue: nodes with mass, joined by springs, with a surface where it has one.
///
/// Coordinates and indices are the caller's throughout.
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
    /// For bodies that may be cut.
    cuttable: Option<Box<Cuttable>>,
    /// For bodies that tear.
    tears: Option<Box<Tears>>,
    /// A bit for each node that the surface has, in the caller's numbers; empty before a spring is removed.
    corners: Vec<u64>,
    published: Published,
    /// For bodies that have readers.
    shown: Option<Box<Shown>>,
    query_tree: QueryTree,
    /// Its solver, and why.
    choice: SolverChoice,
    /// What the caller keeps with it.
    user_data: usize,
}

saved! { Body {
    system, cuttable, tears, corners, published, choice
} leaves { user_data: 0, shown: None, query_tree: QueryTree::default() } where Self::is_sound }

impl Systems for Slots<Body> {
    fn at(&self, place: usize) -> Option<&System> {
        self.at(place).map(|body| &body.system)
    }

    fn at_mut(&mut self, place: usize) -> Option<&mut System> {
        self.at_mut(place).map(|body| &mut body.system)
    }
}

/// What a world asks of its bodies.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Needs {
    pub tolerance: bool,
    /// None: no contacts.
    pub tools: Option<ToolPlaces>,
    pub kernel: ChosenKernel,
    pub steps: Steps,
}

/// The steps that a body is made for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Steps {
    /// How long they are, s.
    pub length: f32,
    /// 0: as many substeps as stability needs.
    pub substeps: u32,
    pub max_substeps: u32,
}

impl Body {
    /// Of a definition that names a solver.
    fn with_solver(definition: &BodyDefinition, needs: Needs) -> Result<Self> {
        definition.check()?;
        let made = definition
            .material
            .as_ref()
            .map(|material| Made::of(material, definition));
        let made = made.transpose()?;
        let definition = &made.as_ref().map_or(*definition, |made| made.complete(definition));
        let node_count = definition.positions.len();
        let mut springs = definition.resolved_springs()?;
        let law = made.as_ref().and_then(|made| made.law);
        let order = match definition.storage {
            Storage::Packed if node_count <= FEW_NODES => NodeOrder::default(),
            Storage::Packed if springs.is_empty() && law.is_some() => {
                order_for_tetrahedra(definition.positions, definition.tetrahedra)?
            }
            Storage::Packed => order_for_springs(definition.positions, &springs, definition.rounding())?,
            _ => NodeOrder::default(),
        };
        if springs.is_empty() {
            // Volume alone is viscous, and does not yield. Edges are springs, but where tetrahedra are elements.
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
        let cuttable = Cuttable::new(definition, &springs, &surface, &order)?;
        if let Some(cuttable) = cuttable.as_ref().filter(|_| definition.triangles.is_empty()) {
            // The same triangles in the order in which cuts number them.
            cuttable.take_surface(&mut surface)?;
        }
        let forces = Forces::new(needs.kernel, definition, law, &mut springs, &surface, &order)?;
        let tears = Tears::new(definition, &springs, law.is_some(), &order)?;
        let mut system = System::new(definition, needs.kernel, order, forces, surface)?;
        system.coarse = needs.tolerance.then(|| CoarseStep::new(node_count)).transpose()?;
        system.may_be_cut = cuttable.as_ref().map(|cuttable| MayBeCut {
            toughness: definition.toughness,
            is_solid: matches!(cuttable.material, CutMaterial::Solid(_)),
        });
        let mut body = Self {
            system,
            cuttable,
            tears,
            corners: Vec::new(),
            published: Published::new(node_count)?,
            shown: None,
            query_tree: QueryTree::default(),
            choice: SolverChoice::given(definition.solver),
            user_data: 0,
        };
        body.place(definition.positions);
        body.system.make_solver(definition)?;
        if let Some(tools) = needs.tools {
            body.make_contacts(tools)?;
        }
        body.system.make_sleeper(definition.sleep)?;
        if definition.spare_nodes > 0 {
            body.reserve_nodes(definition.spare_nodes as usize)?;
        }
        Ok(body)
    }

    /// Whether what it has of each node is there for all of them.
    fn is_sound(&self) -> bool {
        self.published.is_sound(self.node_count())
    }

    /// What moves of it, as solvers and contact see it.
    pub(crate) fn system(&self) -> &System {
        &self.system
    }

    pub(crate) fn system_mut(&mut self) -> &mut System {
        &mut self.system
    }

    /// How many nodes it has.
    pub fn node_count(&self) -> usize {
        self.system.node_count()
    }

    /// The mass of a node, kg: 0 of one that is pinned for good, or bound to others.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: there is no such node.
    pub fn node_mass(&self, node: u32) -> Result<f32> {
        self.check_node(&"node", node)?;
        Ok(self.system.masses[self.system.order.own(node) as usize])
    }

    /// The triangles that are drawn and touched: those of its definition, or the outer faces of its tetrahedra or cells. Outer faces of
    /// tetrahedra face outward, however the definition has them.
    pub fn surface(&self) -> &[[u32; 3]] {
        &self.system.surface
    }

    /// Whether the surface encloses something: whether others can be found within it, and are led out. It does not where it is not closed, and no
    /// more once [`remove_spring`](Self::remove_spring) has taken away an edge of it; then what comes near it from either side meets it, and
    /// nothing is within it.
    pub fn is_closed(&self) -> bool {
        // Out of memory: nothing is known to be within.
        !self.system.is_cut_open && crate::mesh::is_closed(&self.system.surface).unwrap_or(false)
    }

    /// The two nodes of each spring, each once, the lower first.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub fn spring_pairs(&self) -> Result<Vec<[u32; 2]>> {
        let mut pairs = memory::reserved(self.system.forces.springs.spring_count())?;
        for node in 0..self.node_count() as u32 {
            let own = self.system.order.own(node) as usize;
            self.system.forces.springs.visit(own, &mut |link| {
                let neighbour = self.system.order.caller(link.neighbour);
                if neighbour > node {
                    pairs.push([node, neighbour]);
                }
            });
        }
        Ok(pairs)
    }

    /// Its energy at the time of the positions.
    pub fn energy(&self, gravity: Vec3) -> Energy {
        Energy::of(self, gravity)
    }

    /// How much memory its springs take.
    pub fn storage_report(&self) -> StorageReport {
        let (bytes_used, bytes_reserved) = self.system.forces.springs.bytes();
        StorageReport {
            node_count: self.node_count(),
            spring_count: self.system.forces.springs.spring_count(),
            bytes_used,
            bytes_reserved,
        }
    }

    /// What its surface encloses, and the pressure there.
    pub fn enclosed(&self) -> EnclosedReport {
        let positions = self.system.state.positions();
        self.system.forces.report_cavities(positions)
    }

    /// How its solver took the last step.
    pub fn solver_report(&self) -> SolverReport {
        self.system.solver_report()
    }

    pub(crate) fn make_contacts(&mut self, tools: ToolPlaces) -> Result<()> {
        match &mut self.system.contacts {
            Some(contacts) => contacts.reserve(tools)?,
            None => {
                let surface = self.system.order.own_triangles(&self.system.surface)?;
                let contacts = Contacts::new(self.system.state.positions(), &surface, &self.system.contact, tools)?;
                self.system.contacts = Some(memory::boxed(contacts)?);
            }
        }
        if self.cuttable.is_some() {
            // What finds edges is made now, not with the first cut.
            return self.reserve_surface(0, 0, 0);
        }
        self.system.reserve_holds()
    }

    /// What the last step left of contacts with the tool at this place.
    pub(crate) fn contacts_with(&self, slot: usize, body: BodyId) -> impl Iterator<Item = Contact> {
        let contacts = self.system.contacts.iter();
        let touches = contacts.flat_map(move |contacts| contacts.touches(slot));
        touches.map(move |touch| Contact {
            normal: touch.normal,
            force: touch.force,
            ..self.contact_at(body, touch.nodes, touch.weights)
        })
    }

    /// A contact at a point of nodes in its own numbers, without a force.
    pub(crate) fn contact_at(&self, body: BodyId, nodes: [u32; 3], weights: [f32; 3]) -> Contact {
        let nodes = nodes.map(|node| self.system.order.caller(node));
        let places = nodes.map(|node| self.published.positions()[node as usize].as_dvec3());
        let point = (0..3).map(|corner| places[corner] * f64::from(weights[corner]));
        Contact {
            body,
            nodes,
            weights,
            point: point.sum::<DVec3>().as_vec3(),
            normal: Vec3::ZERO,
            force: Vec3::ZERO,
        }
    }

    /// How fast a point of its surface moves, m/s: about as the last step ended, up to half a substep before.
    pub(crate) fn velocity_at(&self, contact: &Contact) -> Vec3 {
        let velocities = self.system.state.velocities();
        let of = |node: u32| {
            let own = self.system.order.own(node) as usize;
            vector(self.system.bindings.as_ref(), velocities, own)
        };
        (0..3)
            .map(|corner| of(contact.nodes[corner]) * contact.weights[corner])
            .sum()
    }

    /// The mass that an impulse at a point of its surface moves, kg, where its nodes are free from each other; 0 where none can move.
    pub(crate) fn mass_at(&self, contact: &Contact) -> f64 {
        let own = |corner: usize| self.system.order.own(contact.nodes[corner]);
        let answer = |node: u32, weight: f32| match f64::from(self.system.masses[node as usize]) {
            0.0 => 0.0,
            mass => f64::from(weight).powi(2) / mass,
        };
        let bound = |node: u32| self.system.bindings.as_ref().and_then(|bindings| bindings.get(node));
        let of = |corner: usize| {
            let weight = contact.weights[corner];
            match bound(own(corner)) {
                Some(bound) => bound.parts().map(|(node, part)| answer(node, weight * part)).sum(),
                None => answer(own(corner), weight),
            }
        };
        let answer: f64 = (0..3).map(of).sum();
        if answer > 0.0 { 1.0 / answer } else { 0.0 }
    }

    /// Where its own coordinates begin.
    pub(crate) fn origin(&self) -> DVec3 {
        self.system.origin
    }

    /// Puts the nodes at these places, in the caller's coordinates.
    fn place(&mut self, positions: &[Vec3]) {
        self.system.origin = shift_towards(Bounds::of(positions.iter().copied()));
        self.system.forces.move_origin(self.system.origin);
        let local = self.system.state.positions_mut();
        for (node, position) in (0..).zip(positions) {
            let own = self.system.order.own(node) as usize;
            local.set(own, (position.as_dvec3() - self.system.origin).as_vec3());
        }
        self.system.follow_nodes();
        self.query_tree.outdate();
        let (kernel, local) = (self.system.kernel, self.system.state.positions());
        for (tile, bounds) in self.system.boxes.iter_mut().enumerate() {
            *bounds = kernel.ranges(local.slices(tile_nodes(tile, local.len()))).into();
        }
        self.published.positions_mut().copy_from_slice(positions);
        for bound in self.system.bindings.iter().flat_map(|bindings| bindings.iter()) {
            let place = local.get(bound.node as usize).as_dvec3() + self.system.origin;
            self.published.positions_mut()[self.system.order.caller(bound.node) as usize] = place.as_vec3();
        }
        self.show(&Team::alone());
        self.system.grasp_anew();
        self.system.forces.relax(self.system.state.positions());
        self.system.changed(Changed::Positions);
    }

    /// Moves it to where it is at rest.
    pub(crate) fn rest_state(&mut self, gravity: Vec3, definition: &RestStateDefinition) -> Result<RestStateReport> {
        let report = rest_state(&mut self.system, gravity, definition)?;
        self.publish(&Team::alone());
        self.follow();
        Ok(report)
    }

    /// Makes the step in progress, of `substeps` substeps and `dt` seconds, the current state.
    pub(crate) fn commit(&mut self, step: (u32, f32), carry: Carry, tools: &[ToolPath], team: &Team) {
        self.system.commit(step, carry, tools);
        self.publish(team);
        self.follow();
    }

    /// Moves the origin of its coordinates after it.
    fn follow(&mut self) {
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
        // Exact, as for the nodes: their sides are coordinates of nodes.
        for bounds in &mut self.system.boxes {
            *bounds = bounds.moved(-shift);
        }
    }
}
