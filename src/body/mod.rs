//! A body: nodes with mass, joined by springs.

mod bearing;
mod blade;
#[cfg(test)]
mod bound_tests;
mod change_log;
mod choice;
mod coarse;
mod cut;
mod cut_masses;
mod cut_shares;
mod cut_springs;
mod cuttable;
mod edit;
mod energy;
mod grasp;
mod grow;
mod hash;
mod limit;
mod material_point;
mod order;
mod origin;
mod past;
mod pieces;
mod published;
mod query_tree;
mod region;
mod relief;
mod settings;
mod several;
mod shown;
mod sleep;
mod sound;
mod stretch;
mod stroke;
mod surface;
mod tear;
mod tear_solid;
mod tears;
mod tissue;
mod tune;
mod whole;

use glam::{BVec3, DVec3, Vec3};

use crate::def::{
    BodyContact, BodyDefinition, Carried, EnclosedReport, Energy, Solver, SolverChoice, SolverReport, Storage,
    StorageReport, Values,
};
use crate::geometry::Bounds;
use crate::simd::ChosenKernel;
use crate::soa::{Masses, NodeOrder, Rates, Records, Vectors, tile_count, tile_nodes};
pub(crate) use blade::HoldAt;
pub use change_log::{NewNodeSource, NewRimEdge, TopologyChanges};
pub(crate) use coarse::CoarseStep;
pub use cut::CutReport;
use cuttable::Cuttable;
pub(crate) use grasp::{Grasps, Grip, Lapse};
pub(crate) use tear::Torn;
pub use tune::SpringState;

use crate::base::{Error, Result, memory};
use crate::codec::saved;
use crate::contact::{Contact, Contacts, ToolPath};
use crate::elements::{Elements, Law};
use crate::enclosed::Enclosed;
use crate::ids::BodyId;
use crate::material::Made;
use crate::nodes::{Bindings, NodeDamping, Pins, State};
use crate::readers::Shown;
use crate::solver::{
    Carry, EnergyAccount, GravityKicks, Heavier, Implicit, MassScaling, Pace, Stability, Sums, Survey, Watched, close,
    write_records,
};
use crate::springs::{Springs, store};
use crate::terms::Terms;
use crate::threads::Team;
pub(crate) use material_point::MaterialPoint;
use order::{order_for_springs, order_for_tetrahedra};
use origin::shift_towards;
pub use pieces::Pieces;
use published::Published;
use query_tree::QueryTree;
pub(crate) use sleep::Sleeper;
pub(crate) use stroke::Stroke;
use tears::Tears;

/// A body of so many nodes or fewer keeps the caller's order: the search for the fastest one takes longer than all else that makes the body.
const FEW_NODES: usize = 32;

/// Soft tissue: nodes with mass, joined by springs, with a surface where it has one.
///
/// Coordinates and indices are the caller's throughout.
#[derive(Debug)]
pub struct Body {
    /// The numbers of nodes inside are its own, but in `surface` and what is published.
    order: NodeOrder,
    pub(crate) springs: Box<dyn Springs>,
    /// For bodies whose tetrahedra are more than edges.
    pub(crate) elements: Option<Box<Elements>>,
    /// What a definition asks for beside springs and elements.
    pub(crate) terms: Option<Box<Terms>>,
    /// For bodies whose surface encloses what keeps its volume or its pressure.
    pub(crate) enclosed: Option<Box<Enclosed>>,
    pub(crate) kernel: ChosenKernel,
    /// kg, 0 for nodes that are pinned for good.
    pub(crate) masses: Vec<f32>,
    /// 1/kg, with what mass scaling adds; 0 for nodes that are pinned.
    pub(crate) inverse_masses: Vec<f32>,
    /// That of every node that is not pinned, where they all have the same.
    pub(crate) uniform_inverse_mass: Option<f32>,
    pub(crate) damping: Option<NodeDamping>,
    pub(crate) watched: Watched,
    /// For bodies that some added mass lets take longer substeps.
    pub(crate) scaling: Option<Box<MassScaling>>,
    pub(crate) pins: Pins,
    /// What a substep found in each tile.
    pub(crate) surveys: Vec<Survey>,
    /// What was added up of each tile when its energy was compared last.
    pub(crate) tile_sums: Vec<Sums>,
    /// The box about the nodes of each tile when they were last published or put, in its own coordinates as they are now.
    boxes: Vec<Bounds>,
    surface: Vec<[u32; 3]>,
    pub(crate) state: State,
    /// The positions that forces are made of, for springs that gather them.
    pub(crate) records: Option<Records>,
    /// Where the coordinates of the state begin.
    pub(crate) origin: DVec3,
    /// Velocities at the time of the positions, for bodies whose springs have damping.
    pub(crate) predicted_velocities: Option<Vectors>,
    /// For bodies that are moved implicitly.
    pub(crate) implicit: Option<Box<Implicit>>,
    /// Forces from outside for the next step, N; kept from the first force on.
    pub(crate) applied: Option<Vectors>,
    pub(crate) contacts: Option<Box<Contacts>>,
    pub(crate) contact: BodyContact,
    /// Points of its surface without mass; kept only by bodies that may be cut.
    pub(crate) bindings: Option<Bindings>,
    /// For bodies that may be cut.
    cuttable: Option<Box<Cuttable>>,
    /// For bodies that tear.
    tears: Option<Box<Tears>>,
    /// How many nodes there is room for; 0: for those that there are.
    node_room: usize,
    /// Whether an edge of its surface was taken away.
    pub(crate) is_cut_open: bool,
    /// A bit for each node that the surface has, in the caller's numbers; empty before a spring is removed.
    corners: Vec<u64>,
    /// What tools hold of it.
    pub(crate) grasps: Option<Box<Grasps>>,
    pub(crate) carry: Carry,
    /// Whether the state's forces belong to its positions and velocities.
    pub(crate) forces_current: bool,
    /// Whether `applied` holds anything.
    pub(crate) forces_applied: bool,
    /// Kept only in worlds with a tolerance.
    pub(crate) coarse: Option<CoarseStep>,
    published: Published,
    /// For bodies that have readers.
    shown: Option<Box<Shown>>,
    query_tree: QueryTree,
    /// For bodies that sleep.
    pub(crate) sleeper: Option<Box<Sleeper>>,
    /// The part of the world's gravity that acts on it.
    pub(crate) gravity_scale: f32,
    /// Its solver, and why.
    choice: SolverChoice,
    /// What the caller keeps with it.
    user_data: usize,
}

saved!(Body { order, springs, elements, terms, enclosed, kernel, masses, inverse_masses, uniform_inverse_mass, damping, watched, scaling, pins, surveys, tile_sums, boxes, surface, state, records, origin, predicted_velocities, implicit, applied, contacts, contact, bindings, cuttable, tears, node_room, is_cut_open, corners, grasps, carry, forces_current, forces_applied, coarse, published, sleeper, gravity_scale, choice } leaves { user_data: 0, shown: None, query_tree: QueryTree::default() } where Self::is_sound);

/// What a world asks of its bodies.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Needs {
    pub tolerance: bool,
    /// 0: no contacts.
    pub tools: usize,
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
        let of_volume = (definition.volume_stiffness > 0.0).then(|| Law::of_volume(definition.volume_stiffness));
        let elements = match law.or(of_volume) {
            Some(law) => Some(memory::boxed(elements_of(law, definition, &order)?)?),
            None => None,
        };
        let terms = Terms::new(needs.kernel, definition, &springs, &order)?;
        if springs.is_empty() {
            // Volume alone is viscous, and does not yield. Edges are springs, but where tetrahedra are elements.
            for (name, value, is_used) in [
                (
                    "retardation_time",
                    definition.viscosity.retardation_time,
                    elements.is_some(),
                ),
                ("yield_strain", definition.yielding.strain, law.is_some()),
                ("stiffness", definition.stiffnesses.uniform(), law.is_none()),
                ("spring_damping", definition.spring_dampings.uniform(), law.is_none()),
            ] {
                if value > 0.0 && !is_used {
                    return Err(Error::invalid(format!(
                        "{name} is {value}, and the body has no springs, nor elements that use it"
                    )));
                }
            }
        }
        let mut surface = match (definition.triangles, definition.tetrahedra) {
            ([], []) => crate::mesh::cell_boundary(definition.cells)?,
            ([], tetrahedra) => crate::mesh::boundary(tetrahedra)?,
            (triangles, _) => memory::copied(triangles)?,
        };
        let cuttable = Cuttable::new(definition, &springs, &surface, &order)?;
        if let Some(cuttable) = cuttable.as_ref().filter(|_| definition.triangles.is_empty()) {
            // Outward however tetrahedra are turned.
            cuttable.take_surface(&mut surface)?;
        }
        for spring in &mut springs {
            spring.nodes = spring.nodes.map(|node| order.own(node));
        }
        let tears = Tears::new(definition, &springs, law.is_some(), &order)?;
        let springs = store(needs.kernel, definition, &springs)?;
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
        let damping = if definition.node_dampings.all_zero() {
            None
        } else {
            let mut rates = memory::reserved(node_count)?;
            let damping = |node: usize| definition.node_dampings.get(order.caller(node as u32) as usize);
            rates.extend((0..node_count).map(|node| damping(node) * inverse_masses[node]));
            Some(NodeDamping::new(rates)?)
        };
        let enclosed = Enclosed::new(definition, &surface, &order)?;
        let mut body = Self {
            order,
            predicted_velocities: springs.damped().then(|| Vectors::zeros(node_count)).transpose()?,
            records: (springs.gathers() || elements.is_some() || terms.is_some())
                .then(|| Records::zeros(node_count))
                .transpose()?,
            elements,
            terms,
            enclosed,
            coarse: needs.tolerance.then(|| CoarseStep::new(node_count)).transpose()?,
            springs,
            kernel: needs.kernel,
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
            tile_sums: memory::filled(Sums::default(), tile_count(node_count))?,
            boxes: memory::filled(Bounds::EMPTY, tile_count(node_count))?,
            surface,
            state: State::new(node_count, definition.solver == Solver::Verlet)?,
            origin: DVec3::ZERO,
            implicit: None,
            applied: None,
            contacts: None,
            contact: definition.contact,
            bindings: None,
            cuttable,
            tears,
            node_room: 0,
            is_cut_open: false,
            corners: Vec::new(),
            grasps: None,
            carry: Carry {
                stability: Stability::UNKNOWN,
                gravity: GravityKicks::new(Bounds {
                    min: Vec3::ZERO,
                    max: Vec3::ZERO,
                }),
                closing: None,
                masses_for: 0.0,
                energy: EnergyAccount::UNKNOWN,
                pace: Pace::UNKNOWN,
            },
            forces_current: false,
            forces_applied: false,
            published: Published::new(node_count)?,
            shown: None,
            query_tree: QueryTree::default(),
            sleeper: None,
            gravity_scale: 1.0,
            choice: SolverChoice::given(definition.solver),
            user_data: 0,
        };
        body.place(definition.positions);
        let BodyDefinition {
            order,
            iterations,
            accuracy,
            sleep,
            ..
        } = *definition;
        let positions = body.state.positions();
        let gathers = body.records.is_some();
        body.implicit = match definition.solver {
            Solver::Verlet | Solver::Auto => None,
            Solver::Implicit => Some(memory::boxed(Implicit::new(
                positions, gathers, order, iterations, accuracy,
            )?)?),
            Solver::Newton => {
                let (springs, elements) = (&*body.springs, body.elements.as_deref());
                let beside = (body.terms.as_deref(), body.enclosed.as_deref());
                let implicit = Implicit::exact(positions, springs, elements, beside, [order, iterations], accuracy)?;
                Some(memory::boxed(implicit)?)
            }
        };
        if let (Some(implicit), Some(elements)) = (&mut body.implicit, &body.elements) {
            implicit.join(elements)?;
        }
        if let (Some(implicit), Some(enclosed)) = (&mut body.implicit, &body.enclosed) {
            implicit.enclose(enclosed)?;
        }
        if definition.solver == Solver::Verlet && definition.mass_scaling > 0.0 {
            let (uniform, damping) = (body.uniform_inverse_mass, body.damping.as_ref());
            let beside = body.carried_beside_springs()?;
            let (springs, part) = (&*body.springs, definition.mass_scaling);
            let room = body.node_count() + definition.spare_nodes as usize;
            let room = body.elements.as_ref().map_or(0, |_| room);
            let scaling = MassScaling::new(springs, &beside, &body.masses, uniform, damping, room, part)?;
            body.scaling = scaling.map(memory::boxed).transpose()?;
        }
        if needs.tools > 0 {
            body.make_contacts(needs.tools)?;
        }
        body.make_sleeper(sleep)?;
        if definition.spare_nodes > 0 {
            body.reserve_nodes(definition.spare_nodes as usize)?;
        }
        Ok(body)
    }

    /// How many nodes it has.
    pub fn node_count(&self) -> usize {
        self.masses.len()
    }

    /// The mass of a node, kg: 0 of one that is pinned for good, or bound to others.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: there is no such node.
    pub fn node_mass(&self, node: u32) -> Result<f32> {
        self.check_node(&"node", node)?;
        Ok(self.masses[self.order.own(node) as usize])
    }

    /// The triangles that are drawn and touched, outward: those of its definition, or the boundary of its tetrahedra
    /// or cells.
    pub fn surface(&self) -> &[[u32; 3]] {
        &self.surface
    }

    /// Whether the surface encloses something: whether others can be found within it, and are led out. It does not where it is not closed, and no
    /// more once [`remove_spring`](Self::remove_spring) has taken away an edge of it; then what comes near it from either side meets it, and
    /// nothing is within it.
    pub fn is_closed(&self) -> bool {
        // Out of memory: nothing is known to be within.
        !self.is_cut_open && crate::mesh::is_closed(&self.surface).unwrap_or(false)
    }

    /// The two nodes of each spring, each once, the lower first.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub fn spring_pairs(&self) -> Result<Vec<[u32; 2]>> {
        let mut pairs = memory::reserved(self.springs.spring_count())?;
        for node in 0..self.node_count() as u32 {
            let own = self.order.own(node) as usize;
            self.springs.visit(own, &mut |link| {
                let neighbour = self.order.caller(link.neighbour);
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

    /// The caller's number of one of its own nodes.
    pub(crate) fn callers(&self, own: usize) -> usize {
        self.order.caller(own as u32) as usize
    }

    /// How much memory its springs take.
    pub fn storage_report(&self) -> StorageReport {
        let (bytes_used, bytes_reserved) = self.springs.bytes();
        StorageReport {
            node_count: self.node_count(),
            spring_count: self.springs.spring_count(),
            bytes_used,
            bytes_reserved,
        }
    }

    /// What its surface encloses, and the pressure there.
    pub fn enclosed(&self) -> EnclosedReport {
        let positions = self.state.positions();
        let report = |enclosed: &Enclosed| enclosed.report(&|node| positions.get(node).as_dvec3());
        self.enclosed.as_deref().map(report).unwrap_or_default()
    }

    /// How its solver took the last step.
    pub fn solver_report(&self) -> SolverReport {
        let report = self.implicit.as_ref().map(|implicit| implicit.told);
        SolverReport {
            added_mass: self.scaling.as_ref().map_or(0.0, |scaling| scaling.added_mass()),
            ..report.unwrap_or_default()
        }
    }

    /// The masses as the caller gave them.
    pub(crate) fn masses(&self) -> Masses<'_> {
        Masses {
            masses: &self.masses,
            inverse_masses: &self.inverse_masses,
            are_heavier: false,
        }
    }

    /// Finds the nodes that set the longest stable substep.
    pub(crate) fn watch(&mut self) {
        let masses = Masses {
            masses: &self.masses,
            inverse_masses: &self.inverse_masses,
            are_heavier: false,
        };
        self.watched.gather(&*self.springs, masses);
    }

    /// The axes along which anything holds it in its place.
    pub(crate) fn held_axes(&self) -> BVec3 {
        if self.terms.as_ref().is_some_and(|terms| terms.hold_any()) {
            return BVec3::TRUE;
        }
        self.pins.iter().fold(BVec3::FALSE, |axes, pin| axes | pin.axes)
    }

    /// Whether forces are made of more than springs.
    pub(crate) fn has_more_than_springs(&self) -> bool {
        self.elements.is_some() || self.terms.is_some() || self.enclosed.is_some()
    }

    /// What each node carries of elements, terms and what is enclosed; of no nodes where there are none.
    fn carried_beside_springs(&self) -> Result<Vec<Carried>> {
        if !self.has_more_than_springs() {
            return Ok(Vec::new());
        }
        let mut carried = memory::filled(Carried::default(), self.node_count())?;
        let masses = self.masses();
        if let Some(elements) = &self.elements {
            elements.add_to(&masses, &mut carried);
        }
        if let Some(terms) = &self.terms {
            terms.add_to(&masses, &mut carried);
        }
        if let Some(enclosed) = &self.enclosed {
            enclosed.add_to(self.state.positions(), &masses, &mut carried)?;
        }
        Ok(carried)
    }

    /// The longest substep that elements, terms and what is enclosed allow with the nodes as they are, s; infinity where there are none.
    pub(crate) fn limit_beside_springs(&mut self, team: &Team) -> f32 {
        let masses = Masses {
            masses: &self.masses,
            inverse_masses: &self.inverse_masses,
            are_heavier: self.scaling.as_ref().is_some_and(|scaling| scaling.step() > 0.0),
        };
        let mut rates = Rates::ZERO;
        if let Some(elements) = &mut self.elements {
            let known = elements.find_rates(&*self.springs, &masses) && self.forces_current;
            if let Some(records) = self.records.as_mut().filter(|_| !known) {
                write_records(self.kernel, self.state.positions(), records, team);
                elements.find_forces(self.kernel, records.as_slice(), team);
                elements.settle();
            }
            rates = elements.settled_rates();
        }
        if let Some(terms) = &mut self.terms {
            terms.find_rates(&*self.springs, &masses);
            if !self.forces_current {
                terms.settle_at(self.state.positions());
            }
            rates = rates.and(terms.settled_rates());
        }
        if let Some(enclosed) = &mut self.enclosed {
            let springs = (self.elements.is_none() && self.terms.is_none()).then_some(&*self.springs);
            if !(enclosed.find_rates(springs, &masses) && self.forces_current) {
                enclosed.find_forces(self.state.positions(), team);
                enclosed.settle();
            }
            rates = rates.and(enclosed.settled_rates());
        }
        rates.limit()
    }

    /// The same with the nodes where forces were last worked out.
    pub(crate) fn newest_limit_beside_springs(&self) -> f32 {
        let of_elements = self.elements.as_ref().map_or(Rates::ZERO, |elements| elements.rates());
        let of_terms = self.terms.as_ref().map_or(Rates::ZERO, |terms| terms.rates());
        let of_enclosed = self.enclosed.as_ref().map_or(Rates::ZERO, |enclosed| enclosed.rates());
        of_elements.and(of_terms).and(of_enclosed).limit()
    }

    /// The longest stable substep with the nodes at these positions.
    pub(crate) fn estimate(&self, positions: &Vectors) -> Stability {
        Stability::estimate(&*self.springs, self.masses(), positions, &self.watched)
    }

    /// Makes the nodes that need it heavy enough for substeps of `step` seconds; 0: masses as they are.
    pub(crate) fn use_masses_for(&mut self, step: f32) {
        if self.scaling.as_ref().is_some_and(|scaling| scaling.step() != step) {
            self.scale_masses(step);
        }
    }

    /// The same, after springs or pins have changed too.
    pub(crate) fn scale_masses(&mut self, step: f32) {
        if let Some(scaling) = &mut self.scaling {
            let differ = step > 0.0 || scaling.step() > 0.0;
            let heavier = Heavier {
                masses: &self.masses,
                inverse_masses: &mut self.inverse_masses,
                uniform_inverse_mass: &mut self.uniform_inverse_mass,
                damping: self.damping.as_mut(),
            };
            scaling.apply(step, heavier);
            if differ {
                self.forget_rates();
            }
        }
    }

    pub(crate) fn make_contacts(&mut self, tools: usize) -> Result<()> {
        match &mut self.contacts {
            Some(contacts) => contacts.reserve(tools)?,
            None => {
                let surface = self.order.own_triangles(&self.surface)?;
                let contacts = Contacts::new(self.state.positions(), &surface, &self.contact, tools)?;
                self.contacts = Some(memory::boxed(contacts)?);
            }
        }
        if self.cuttable.is_some() {
            // What finds edges is made now, not with the first cut.
            return self.reserve_surface(0, 0, 0);
        }
        self.reserve_holds()
    }

    /// Makes room for contacts within equations, where it has such.
    fn reserve_holds(&mut self) -> Result<()> {
        if let (Some(contacts), Some(implicit)) = (&mut self.contacts, &mut self.implicit) {
            implicit.reserve_contacts(contacts.reserve_holds(implicit.has_small_budget())?)?;
            if self.node_room > 0 {
                implicit.reserve_nodes(self.node_room)?;
            }
        }
        Ok(())
    }

    /// What the last step left of contacts with the tool at this place.
    pub(crate) fn contacts_with(&self, slot: usize, body: BodyId) -> impl Iterator<Item = Contact> {
        let touches = self.contacts.iter().flat_map(move |contacts| contacts.touches(slot));
        touches.map(move |touch| {
            let nodes = touch.nodes.map(|node| self.order.caller(node));
            let places = nodes.map(|node| self.published.positions()[node as usize].as_dvec3());
            let point = (0..3).map(|corner| places[corner] * f64::from(touch.weights[corner]));
            Contact {
                body,
                nodes,
                weights: touch.weights,
                point: point.sum::<DVec3>().as_vec3(),
                normal: touch.normal,
                force: touch.force,
            }
        })
    }

    /// How fast a point of its surface moves, m/s: about as the last step ended, up to half a substep before.
    pub(crate) fn velocity_at(&self, contact: &Contact) -> Vec3 {
        let velocities = self.state.velocities();
        let of = |node: u32| {
            let own = self.order.own(node);
            self.bindings.as_ref().map_or_else(
                || velocities.get(own as usize),
                |bindings| bindings.vector(velocities, own as usize),
            )
        };
        (0..3)
            .map(|corner| of(contact.nodes[corner]) * contact.weights[corner])
            .sum()
    }

    /// The mass that an impulse at a point of its surface moves, kg, where its nodes are free from each other; 0 where none can move.
    pub(crate) fn mass_at(&self, contact: &Contact) -> f64 {
        let own = |corner: usize| self.order.own(contact.nodes[corner]);
        let answer = |node: u32, weight: f32| match f64::from(self.masses[node as usize]) {
            0.0 => 0.0,
            mass => f64::from(weight).powi(2) / mass,
        };
        let bound = |node: u32| self.bindings.as_ref().and_then(|bindings| bindings.get(node));
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

    /// The box about its nodes, in its own coordinates.
    pub(crate) fn local_bounds(&self) -> Bounds {
        self.boxes.iter().fold(Bounds::EMPTY, Bounds::and)
    }

    /// Where its own coordinates begin.
    pub(crate) fn origin(&self) -> DVec3 {
        self.origin
    }

    /// How far it reaches along an axis, m.
    pub(crate) fn extent(&self) -> f32 {
        let bounds = self.boxes.iter().fold(Bounds::EMPTY, Bounds::and);
        (bounds.max - bounds.min).max_element()
    }

    /// Puts the nodes at rest at these places, in its own coordinates and numbers, where this holds its pins.
    pub(crate) fn rest_at(&mut self, place: impl Fn(usize) -> Vec3, held: impl Fn(usize) -> Vec3) {
        close(self);
        for node in 0..self.node_count() {
            if self.inverse_masses[node] > 0.0 {
                self.state.positions_mut().set(node, place(node));
            }
        }
        self.state.velocities_mut().clear();
        self.carry.gravity = GravityKicks::new(Bounds {
            min: Vec3::ZERO,
            max: Vec3::ZERO,
        });
        for pin in self.pins.iter_mut() {
            pin.force = pin.held(held(pin.node as usize));
        }
        self.rest_grasps();
        self.follow_nodes();
        self.relax();
        self.forget_motion();
        self.publish(&Team::alone());
        self.follow();
    }

    /// Nothing is known any more of where the nodes were.
    fn forget_motion(&mut self) {
        self.wake();
        self.forces_current = false;
        self.carry.stability = Stability::UNKNOWN;
        self.carry.forget();
        self.state.forget_remainders();
        if let Some(implicit) = &mut self.implicit {
            implicit.forget_history();
            implicit.forget_matrix();
        }
        if let Some(contacts) = &mut self.contacts {
            contacts.forget();
            contacts.holds.forget();
        }
    }

    /// Puts the nodes at these places, in the caller's coordinates.
    fn place(&mut self, positions: &[Vec3]) {
        self.origin = shift_towards(Bounds::of(positions.iter().copied()));
        if let Some(terms) = &mut self.terms {
            terms.move_origin(self.origin);
        }
        let local = self.state.positions_mut();
        for (node, position) in (0..).zip(positions) {
            let own = self.order.own(node) as usize;
            local.set(own, (position.as_dvec3() - self.origin).as_vec3());
        }
        self.follow_nodes();
        self.query_tree.outdate();
        let (kernel, local) = (self.kernel, self.state.positions());
        for (tile, bounds) in self.boxes.iter_mut().enumerate() {
            *bounds = kernel.ranges(local.slices(tile_nodes(tile, local.len()))).into();
        }
        self.published.positions_mut().copy_from_slice(positions);
        for bound in self.bindings.iter().flat_map(|bindings| bindings.iter()) {
            let place = local.get(bound.node as usize).as_dvec3() + self.origin;
            self.published.positions_mut()[self.order.caller(bound.node) as usize] = place.as_vec3();
        }
        self.show(&Team::alone());
        self.grasp_anew();
        self.relax();
        self.forget_motion();
    }

    /// Makes the step in progress, of `substeps` substeps and `dt` seconds, the current state.
    pub(crate) fn commit(&mut self, (substeps, dt): (u32, f32), carry: Carry, tools: &[ToolPath], team: &Team) {
        self.state.commit();
        self.carry = carry;
        self.forces_current = carry.closing.is_none() && self.implicit.is_none();
        if let Some(elements) = &mut self.elements {
            elements.settle();
        }
        if let Some(terms) = &mut self.terms {
            terms.settle();
        }
        if let Some(enclosed) = &mut self.enclosed {
            enclosed.settle();
        }
        self.keep();
        if let Some(scaling) = &mut self.scaling {
            scaling.settle(dt);
        }
        if let Some(implicit) = &mut self.implicit {
            implicit.commit();
        }
        self.published.commit();
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
        self.publish(team);
        self.follow();
    }

    /// Prepares again what an attempted step that is not committed has changed.
    pub(crate) fn put_back(&mut self) {
        self.sleep_again();
        if let Some(implicit) = &mut self.implicit {
            implicit.put_back();
        }
        self.recall();
        if self.scaling.as_mut().is_some_and(|scaling| scaling.unsettle()) {
            self.scale_masses(self.carry.masses_for);
        }
        self.use_masses_for(self.carry.masses_for);
        if let (Some(damping), Some(closing)) = (&mut self.damping, &self.carry.closing) {
            damping.prepare(closing.substep);
        }
    }

    /// Leaves the current state as it is, without the step that was attempted.
    pub(crate) fn stay(&mut self) {
        self.put_back();
        self.clear_pending();
        if let Some(contacts) = &mut self.contacts {
            contacts.stay();
        }
    }

    /// Forgets the forces and the ways of pins that were meant for the last step.
    fn clear_pending(&mut self) {
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

    /// Moves the origin of its coordinates after it.
    fn follow(&mut self) {
        let bounds = self.boxes.iter().fold(Bounds::EMPTY, Bounds::and);
        let shift = shift_towards(bounds);
        if shift == DVec3::ZERO {
            return;
        }
        self.origin += shift;
        if let Some(terms) = &mut self.terms {
            terms.move_origin(self.origin);
        }
        self.wake();
        let positions = self.state.positions_mut();
        for node in 0..positions.len() {
            positions.set(node, (positions.get(node).as_dvec3() - shift).as_vec3());
        }
        // Exact, as for the nodes: their sides are coordinates of nodes.
        for bounds in &mut self.boxes {
            *bounds = bounds.moved(-shift);
        }
        if let Some(contacts) = &mut self.contacts {
            contacts.forget();
        }
    }
}

/// The tetrahedra of a definition as elements, in the body's own numbers.
fn elements_of(law: Law, definition: &BodyDefinition, order: &NodeOrder) -> Result<Elements> {
    let mut tetrahedra = memory::reserved(definition.tetrahedra.len())?;
    tetrahedra.extend(
        definition
            .tetrahedra
            .iter()
            .map(|corners| corners.map(|corner| order.own(corner))),
    );
    let rest = definition.rest_positions.unwrap_or(definition.positions);
    let at_rest = |own: u32| rest[order.caller(own) as usize].as_dvec3();
    let node_count = definition.positions.len();
    let past = (definition.viscosity, definition.yielding);
    let mut elements = Elements::new(law, past, &tetrahedra, at_rest, node_count)?;
    if definition.spare_nodes > 0 {
        elements.follow_cells(&tetrahedra)?;
    }
    Ok(elements)
}
