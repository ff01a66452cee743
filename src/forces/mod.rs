//! The internal forces of a body: springs, elements, terms and cavities. Only this module sums them.

mod auxiliary;
mod bounds;
mod changes;
mod history;
mod topology;

use std::ops::Range;

use glam::{DVec3, Vec3};

use crate::base::{Result, StateHasher, memory};
use crate::cavities::{self, Cavities};
use crate::codec::saved;
use crate::def::{BodyDefinition, EnclosedReport, Spring};
use crate::elements::{self, ElasticLaw, Elements};
use crate::simd::ChosenKernel;
use crate::soa::{NodeOrder, Records, TileForces, Vectors, View, WriteRecords, tile_count, tile_nodes};
use crate::springs::{DirectionInput, ForceInput, Link, Springs, pull, store};
use crate::terms::Terms;
use crate::threads::Team;
pub(crate) use auxiliary::AuxiliaryForces;
pub(crate) use changes::ForceChanges;
pub(crate) use topology::ForcePieces;

/// All forces between the nodes of a body.
#[derive(Debug)]
pub(crate) struct Forces {
    pub springs: Box<dyn Springs>,
    /// For bodies whose tetrahedra are finite elements.
    elements: Option<Box<Elements>>,
    /// Terms and cavities.
    pub auxiliary: AuxiliaryForces,
    kernel: ChosenKernel,
    /// The positions as records, for elements, terms, and springs that gather them.
    pub records: Option<Records>,
    /// Memory for force changes, used by implicit solvers.
    pub changes: ForceChanges,
}

saved! { Forces { springs, elements, auxiliary, kernel, records, changes } }

/// The sum of all forces, or of all force changes, tile by tile.
#[derive(Clone, Copy)]
pub(crate) struct ForceSum<'a> {
    pub springs: &'a dyn Springs,
    elements: Option<elements::ElementForces<'a>>,
    terms: Option<&'a Terms>,
    cavities: Option<cavities::PressureForces<'a>>,
}

impl ForceSum<'_> {
    /// Writes the forces on the nodes of a tile, N.
    pub fn write(&self, tile: usize, nodes: Range<usize>, input: &ForceInput, forces: &mut TileForces) {
        self.springs.forces(tile, input, forces);
        if let Some(elements) = &self.elements {
            elements.add(tile, forces);
        }
        if let Some(terms) = self.terms {
            terms.add_forces(tile, nodes, input.positions, forces);
        }
        if let Some(cavities) = &self.cavities {
            cavities.add(tile, forces);
        }
    }

    /// Writes the first-order changes of the forces on the nodes of a tile, N: the tangent times the displacements.
    pub fn write_changes(&self, tile: usize, nodes: Range<usize>, input: &DirectionInput, changes: &mut TileForces) {
        self.springs.force_changes(tile, input, changes);
        if let Some(elements) = &self.elements {
            elements.add(tile, changes);
        }
        if let Some(terms) = self.terms {
            terms.add_force_changes(tile, nodes, [input.positions, input.displacements], changes);
        }
        if let Some(cavities) = &self.cavities {
            cavities.add(tile, changes);
        }
    }
}

impl Forces {
    /// Creates the forces of a definition. The surface and `springs` are in the caller's node numbering; `springs` is
    /// changed to the body's.
    pub fn new(
        kernel: ChosenKernel,
        definition: &BodyDefinition,
        law: Option<ElasticLaw>,
        springs: &mut [Spring],
        surface: &[[u32; 3]],
        order: &NodeOrder,
    ) -> Result<Self> {
        let volume_law =
            (definition.volume_stiffness > 0.0).then(|| ElasticLaw::volume_only(definition.volume_stiffness));
        let elements = law.or(volume_law).map(|law| create_elements(law, definition, order));
        let elements = elements.transpose()?.map(memory::boxed).transpose()?;
        let terms = Terms::new(kernel, definition, springs, order)?;
        let cavities = Cavities::new(definition, surface, order)?;
        for spring in &mut *springs {
            spring.nodes = spring.nodes.map(|node| order.own(node));
        }
        let springs = store(kernel, definition, springs)?;
        let has_records = springs.prefers_records() || elements.is_some() || terms.is_some();
        let records = has_records.then(|| Records::zeros(definition.positions.len()));
        Ok(Self {
            springs,
            elements,
            auxiliary: AuxiliaryForces { terms, cavities },
            kernel,
            records: records.transpose()?,
            changes: ForceChanges::default(),
        })
    }

    /// True if there are forces besides springs.
    pub fn has_non_spring_forces(&self) -> bool {
        self.elements.is_some() || self.auxiliary.is_any()
    }

    /// True if there are elements.
    pub fn has_elements(&self) -> bool {
        self.elements.is_some()
    }

    /// The elements, if there are any.
    pub fn elements(&self) -> Option<&Elements> {
        self.elements.as_deref()
    }

    /// The elements, mutable.
    pub fn elements_mut(&mut self) -> Option<&mut Elements> {
        self.elements.as_deref_mut()
    }

    /// `positions` with the records that forces gather from.
    pub fn view<'a>(&'a self, positions: &'a Vectors) -> View<'a> {
        positions.view().with_records(self.records.as_ref())
    }

    /// Updates the records of positions, if forces gather them.
    pub fn write_records(&mut self, positions: &Vectors, team: &Team) {
        self.write_awake_records(positions, |_| false, team);
    }

    /// Updates the records of positions except those of sleeping tiles, which are up to date.
    pub fn write_awake_records(&mut self, positions: &Vectors, is_asleep: impl Fn(usize) -> bool + Sync, team: &Team) {
        let (kernel, node_count) = (self.kernel, positions.len());
        let Some(records) = &mut self.records else {
            return;
        };
        team.pass(tile_count(node_count), records.tiles_mut(), |tile, records| {
            if is_asleep(tile) {
                return;
            }
            let axes = positions.slices(tile_nodes(tile, node_count));
            kernel.run(WriteRecords { axes, records });
        });
    }

    /// Computes the forces at `positions` that are not computed tile by tile. Records must be up to date.
    pub fn compute(&mut self, positions: &Vectors, team: &Team) {
        if let (Some(elements), Some(records)) = (&mut self.elements, &self.records) {
            elements.find_forces(self.kernel, records.as_slice(), team);
        }
        self.auxiliary
            .terms
            .iter_mut()
            .for_each(|terms| terms.reset_stiffening());
        let cavities = self.auxiliary.cavities.iter_mut();
        cavities.for_each(|cavities| cavities.find_forces(positions, team));
    }

    /// The sum of the forces that were computed last.
    pub fn sum(&self) -> ForceSum<'_> {
        ForceSum {
            springs: &*self.springs,
            elements: self.elements().map(|elements| elements.node_forces(None)),
            terms: self.auxiliary.terms.as_deref(),
            cavities: self
                .auxiliary
                .cavities
                .as_ref()
                .map(|cavities| cavities.node_forces(None)),
        }
    }

    /// Adds the spring forces on a node at `positions`, without damping, N.
    pub fn add_spring_forces(&self, node: usize, positions: &Vectors, force: &mut Vec3) {
        let here = positions.get(node);
        self.springs.visit(node, &mut |link| {
            *force += pull(node, &link, positions.get(link.neighbor as usize) - here, None);
        });
    }

    /// The energy of springs and terms that belongs to a tile, J.
    pub fn energy_of_tile(&self, tile: usize, nodes: Range<usize>, positions: View) -> f64 {
        let spring_energy = self.springs.half_energy(nodes, positions);
        let term_energy = |terms: &Terms| terms.energy_of_tile(tile, &|node| positions.get(node).as_dvec3());
        self.auxiliary
            .terms
            .as_deref()
            .map_or(spring_energy, |terms| spring_energy + term_energy(terms))
    }

    /// The energy at `positions`, J, and the work of constant pressures, J. `of_tiles` is the sum of the tiles'
    /// energies. Records must be up to date.
    pub fn energy(&mut self, tile_energy: f64, positions: &Vectors, team: &Team) -> [f64; 2] {
        let element_energy = match (&mut self.elements, &self.records) {
            (Some(elements), Some(records)) => elements.energy(self.kernel, records.as_slice(), team),
            _ => 0.0,
        };
        let [cavity_energy, work] = self
            .auxiliary
            .energy_of_cavities(&|node| positions.get(node).as_dvec3());
        [tile_energy + element_energy + cavity_energy, work]
    }

    /// The energy at these positions and the work of constant pressures, J, in `f64`. `growths` is working memory of
    /// [`Self::ring_count`] numbers.
    pub fn exact_energy(&self, at: impl Fn(usize) -> DVec3, scratch: &mut [f64]) -> [f64; 2] {
        let mut sum = 0.0;
        for node in 0..self.springs.node_count() {
            let position = at(node);
            self.springs.visit(node, &mut |link| {
                let neighbor = link.neighbor as usize;
                if neighbor < node {
                    let stretch = position.distance(at(neighbor)) - f64::from(link.rest_length);
                    sum += 0.5 * f64::from(link.stiffness) * stretch * stretch;
                }
            });
        }
        if let Some(elements) = &self.elements {
            sum += elements.exact_energy(&at, scratch);
        }
        let [term_energy, stored, work] = self.auxiliary.energy(&at);
        [sum + term_energy + stored, work]
    }

    /// The number of values that [`Self::exact_energy`] needs.
    pub fn ring_count(&self) -> usize {
        let node_count = self.springs.node_count();
        self.elements()
            .map_or(0, |elements| elements.pressure_count_of(node_count))
    }

    /// Approximates the stiffness of springs and elements at a node, plus `stiffness`, N/m.
    pub fn stiffness_at(&self, node: usize, mut stiffness: f32) -> f32 {
        self.springs.visit(node, &mut |link| stiffness += link.stiffness);
        stiffness + self.elements().map_or(0.0, |elements| elements.stiffness_of(node))
    }

    /// Calls `f` with the pairs of nodes that springs and elements join. Those of springs occur once.
    pub fn visit_joined(&self, f: &mut dyn FnMut(u32, u32)) {
        for node in 0..self.springs.node_count() {
            self.springs.visit(node, &mut |link| {
                if link.neighbor > node as u32 {
                    f(node as u32, link.neighbor);
                }
            });
        }
        let mut visit_pairs = |[a, b, c, d]: [u32; 4]| {
            let pairs = [[a, b], [a, c], [a, d], [b, c], [b, d], [c, d]];
            pairs.into_iter().for_each(|[a, b]| f(a, b));
        };
        let elements = self.elements.iter();
        elements.for_each(|elements| elements.visit(&mut |corners, _| visit_pairs(corners)));
    }

    /// Sets the origin that node positions are relative to.
    pub fn move_origin(&mut self, origin: DVec3) {
        self.auxiliary.laws_mut().for_each(|law| law.move_origin(origin));
    }

    /// Reports the cavities with nodes at `positions`.
    pub fn report_cavities(&self, positions: &Vectors) -> EnclosedReport {
        let report = |cavities: &Cavities| cavities.report(&|node| positions.get(node).as_dvec3());
        self.auxiliary.cavities.as_deref().map(report).unwrap_or_default()
    }

    /// The pressure of cavities at their rest volumes, Pa; 0 without cavities.
    pub fn pressure(&self) -> f32 {
        let cavities = self.auxiliary.cavities.as_ref();
        cavities.map_or(0.0, |cavities| cavities.pressure())
    }

    /// Sets the pressure of cavities at their rest volumes, Pa. Returns true if there are cavities.
    pub fn set_pressure(&mut self, pressure: f32) -> bool {
        let cavities = self.auxiliary.cavities.as_mut();
        cavities.map(|cavities| cavities.set_pressure(pressure)).is_some()
    }

    /// Hashes all state that a step depends on.
    pub fn hash(&self, hasher: &mut StateHasher) {
        for node in 0..self.springs.node_count() {
            self.springs.visit(node, &mut |link| {
                hasher.write_u64(u64::from(link.neighbor));
                hasher.write_floats(&[link.stiffness, link.rest_length, link.damping]);
            });
        }
        self.elements.iter().for_each(|elements| elements.hash(hasher));
        self.auxiliary.laws().for_each(|law| law.hash(hasher));
        self.auxiliary
            .cavities
            .iter()
            .for_each(|cavities| cavities.hash(hasher));
    }

    /// True if springs and records that were read from bytes match this number of nodes.
    pub fn are_sound(&self, node_count: usize) -> bool {
        let mut are_sound = self.springs.node_count() == node_count;
        are_sound &= self
            .records
            .as_ref()
            .is_none_or(|records| records.as_slice().len() == node_count);
        let mut f = |link: Link| are_sound &= (link.neighbor as usize) < node_count;
        (0..node_count.min(self.springs.node_count())).for_each(|node| self.springs.visit(node, &mut f));
        are_sound
    }
}

/// Creates the elements of a definition, in the body's node numbering.
fn create_elements(law: ElasticLaw, definition: &BodyDefinition, order: &NodeOrder) -> Result<Elements> {
    let tetrahedra = memory::collected(
        definition
            .tetrahedra
            .iter()
            .map(|corners| corners.map(|corner| order.own(corner))),
    )?;
    let rest = definition.rest_positions.unwrap_or(definition.positions);
    let at_rest = |own: u32| rest[order.caller(own) as usize].as_dvec3();
    let node_count = definition.positions.len();
    let history = (definition.viscosity, definition.yielding);
    let mut elements = Elements::new(law, history, &tetrahedra, at_rest, node_count)?;
    if definition.spare_nodes > 0 {
        elements.follow_cells(&tetrahedra)?;
    }
    Ok(elements)
}
