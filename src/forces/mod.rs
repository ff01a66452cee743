//! What acts within a body: springs, elements, terms and cavities. Here alone they are added up.

mod beside;
mod bounds;
mod changes;
mod history;
mod topology;

use std::ops::Range;

use glam::{DVec3, Vec3};

use crate::base::{Result, StateHasher, memory};
use crate::cavities::{self, Enclosed};
use crate::codec::saved;
use crate::def::{BodyDefinition, EnclosedReport, Spring};
use crate::elements::{self, Elements, Law};
use crate::simd::ChosenKernel;
use crate::soa::{NodeOrder, Records, TileForces, Vectors, View, WriteRecords, tile_count, tile_nodes};
use crate::springs::{Course, Link, Motion, Springs, pull, store};
use crate::terms::Terms;
use crate::threads::Team;
pub(crate) use beside::Beside;
pub(crate) use changes::Changes;
pub(crate) use topology::Parts;

/// All that acts between the nodes of a body.
#[derive(Debug)]
pub(crate) struct Forces {
    pub springs: Box<dyn Springs>,
    /// For bodies whose tetrahedra are more than edges.
    elements: Option<Box<Elements>>,
    /// What a definition asks for beside springs and elements.
    pub beside: Beside,
    kernel: ChosenKernel,
    /// The positions that forces are made of, for springs that gather them, elements and terms.
    pub records: Option<Records>,
    /// For solvers of equations: room for how forces change.
    pub changes: Changes,
}

saved! { Forces { springs, elements, beside, kernel, records, changes } }

/// The sum of all that acts on nodes, tile by tile: of forces, or of how these change.
#[derive(Clone, Copy)]
pub(crate) struct Sum<'a> {
    pub springs: &'a dyn Springs,
    elements: Option<elements::Shares<'a>>,
    terms: Option<&'a Terms>,
    cavities: Option<cavities::PressureShares<'a>>,
}

impl Sum<'_> {
    /// Writes the forces on the nodes of a tile, N.
    pub fn write(&self, tile: usize, nodes: Range<usize>, motion: &Motion, forces: &mut TileForces) {
        self.springs.forces(tile, motion, forces);
        if let Some(elements) = &self.elements {
            elements.add(tile, forces);
        }
        if let Some(terms) = self.terms {
            terms.add_forces(tile, nodes, motion.positions, forces);
        }
        if let Some(cavities) = &self.cavities {
            cavities.add(tile, forces);
        }
    }

    /// Writes how the forces on the nodes of a tile change, N, in the first order: their tangent times the ways of nodes.
    pub fn write_changes(&self, tile: usize, nodes: Range<usize>, course: &Course, changes: &mut TileForces) {
        self.springs.changes(tile, course, changes);
        if let Some(elements) = &self.elements {
            elements.add(tile, changes);
        }
        if let Some(terms) = self.terms {
            terms.add_changes(tile, nodes, [course.positions, course.ways], changes);
        }
        if let Some(cavities) = &self.cavities {
            cavities.add(tile, changes);
        }
    }
}

impl Forces {
    /// What a definition asks for of a body with this surface, both in the caller's numbers, as are `springs`, which become its own.
    /// `law` is that of its elements.
    pub fn new(
        kernel: ChosenKernel,
        definition: &BodyDefinition,
        law: Option<Law>,
        springs: &mut [Spring],
        surface: &[[u32; 3]],
        order: &NodeOrder,
    ) -> Result<Self> {
        let of_volume = (definition.volume_stiffness > 0.0).then(|| Law::of_volume(definition.volume_stiffness));
        let elements = law.or(of_volume).map(|law| elements_of(law, definition, order));
        let elements = elements.transpose()?.map(memory::boxed).transpose()?;
        let terms = Terms::new(kernel, definition, springs, order)?;
        let cavities = Enclosed::new(definition, surface, order)?;
        for spring in &mut *springs {
            spring.nodes = spring.nodes.map(|node| order.own(node));
        }
        let springs = store(kernel, definition, springs)?;
        let has_records = springs.gathers() || elements.is_some() || terms.is_some();
        let records = has_records.then(|| Records::zeros(definition.positions.len()));
        Ok(Self {
            springs,
            elements,
            beside: Beside { terms, cavities },
            kernel,
            records: records.transpose()?,
            changes: Changes::default(),
        })
    }

    /// Whether there is more than springs.
    pub fn are_more_than_springs(&self) -> bool {
        self.elements.is_some() || self.beside.is_any()
    }

    /// Whether there are elements.
    pub fn has_elements(&self) -> bool {
        self.elements.is_some()
    }

    /// The elements, where there are any.
    pub fn elements(&self) -> Option<&Elements> {
        self.elements.as_deref()
    }

    /// The same, to be changed.
    pub fn elements_mut(&mut self) -> Option<&mut Elements> {
        self.elements.as_deref_mut()
    }

    /// `positions`, with what forces gather of them.
    pub fn view<'a>(&'a self, positions: &'a Vectors) -> View<'a> {
        positions.view().with_records(self.records.as_ref())
    }

    /// Makes records of positions, where forces gather them.
    pub fn write_records(&mut self, positions: &Vectors, team: &Team) {
        self.write_awake_records(positions, |_| false, team);
    }

    /// The same but of tiles that sleep, which have theirs.
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

    /// Works out what is not made tile by tile of the forces with nodes at `positions`, of which there are records.
    pub fn find(&mut self, positions: &Vectors, team: &Team) {
        if let (Some(elements), Some(records)) = (&mut self.elements, &self.records) {
            elements.find_forces(self.kernel, records.as_slice(), team);
        }
        self.beside.terms.iter_mut().for_each(|terms| terms.begin());
        let cavities = self.beside.cavities.iter_mut();
        cavities.for_each(|cavities| cavities.find_forces(positions, team));
    }

    /// What adds up the forces that were worked out last.
    pub fn sum(&self) -> Sum<'_> {
        Sum {
            springs: &*self.springs,
            elements: self.elements().map(|elements| elements.shares(None)),
            terms: self.beside.terms.as_deref(),
            cavities: self.beside.cavities.as_ref().map(|cavities| cavities.shares(None)),
        }
    }

    /// Adds what springs do to a node with nodes at `positions`, but for their damping, N.
    pub fn add_spring_forces(&self, node: usize, positions: &Vectors, force: &mut Vec3) {
        let here = positions.get(node);
        self.springs.visit(node, &mut |link| {
            *force += pull(node, &link, positions.get(link.neighbour as usize) - here, None);
        });
    }

    /// The energy of springs and terms that belongs to a tile, J.
    pub fn energy_of_tile(&self, tile: usize, nodes: Range<usize>, positions: View) -> f64 {
        let of_springs = self.springs.half_energy(nodes, positions);
        let of_terms = |terms: &Terms| terms.energy_of_tile(tile, &|node| positions.get(node).as_dvec3());
        self.beside
            .terms
            .as_deref()
            .map_or(of_springs, |terms| of_springs + of_terms(terms))
    }

    /// The energy with nodes at `positions`, of which there are records, J, given that of all tiles; and the work that a constant
    /// pressure has done.
    pub fn energy(&mut self, of_tiles: f64, positions: &Vectors, team: &Team) -> [f64; 2] {
        let of_elements = match (&mut self.elements, &self.records) {
            (Some(elements), Some(records)) => elements.energy(self.kernel, records.as_slice(), team),
            _ => 0.0,
        };
        let [of_cavities, work] = self.beside.energy_of_cavities(&|node| positions.get(node).as_dvec3());
        [of_tiles + of_elements + of_cavities, work]
    }

    /// The same of nodes at these places, worked out in `f64`; `growths` has a number for each ring, for its use.
    pub fn exact_energy(&self, at: impl Fn(usize) -> DVec3, growths: &mut [f64]) -> [f64; 2] {
        let mut sum = 0.0;
        for node in 0..self.springs.node_count() {
            let position = at(node);
            self.springs.visit(node, &mut |link| {
                let neighbour = link.neighbour as usize;
                if neighbour < node {
                    let stretch = position.distance(at(neighbour)) - f64::from(link.rest_length);
                    sum += 0.5 * f64::from(link.stiffness) * stretch * stretch;
                }
            });
        }
        if let Some(elements) = &self.elements {
            sum += elements.exact_energy(&at, growths);
        }
        let [of_terms, stored, work] = self.beside.energy(&at);
        [sum + of_terms + stored, work]
    }

    /// How many numbers [`Self::exact_energy`] needs.
    pub fn ring_count(&self) -> usize {
        let node_count = self.springs.node_count();
        self.elements().map_or(0, |elements| elements.ring_count_of(node_count))
    }

    /// About how stiff springs and elements at a node are together, and `stiffness`, N/m.
    pub fn stiffness_at(&self, node: usize, mut stiffness: f32) -> f32 {
        self.springs.visit(node, &mut |link| stiffness += link.stiffness);
        stiffness + self.elements().map_or(0.0, |elements| elements.stiffness_of(node))
    }

    /// Shows the pairs of nodes that springs and elements join, those of springs once.
    pub fn show_joined(&self, see: &mut dyn FnMut(u32, u32)) {
        for node in 0..self.springs.node_count() {
            self.springs.visit(node, &mut |link| {
                if link.neighbour > node as u32 {
                    see(node as u32, link.neighbour);
                }
            });
        }
        let mut show = |[a, b, c, d]: [u32; 4]| {
            let pairs = [[a, b], [a, c], [a, d], [b, c], [b, d], [c, d]];
            pairs.into_iter().for_each(|[a, b]| see(a, b));
        };
        let elements = self.elements.iter();
        elements.for_each(|elements| elements.visit(&mut |corners, _| show(corners)));
    }

    /// Nodes are given from here on.
    pub fn move_origin(&mut self, origin: DVec3) {
        self.beside.laws_mut().for_each(|law| law.move_origin(origin));
    }

    /// What cavities there are, with nodes at `positions`.
    pub fn report_cavities(&self, positions: &Vectors) -> EnclosedReport {
        let report = |cavities: &Enclosed| cavities.report(&|node| positions.get(node).as_dvec3());
        self.beside.cavities.as_deref().map(report).unwrap_or_default()
    }

    /// The pressure of cavities at their volumes at rest, Pa; 0 without cavities.
    pub fn pressure(&self) -> f32 {
        let cavities = self.beside.cavities.as_ref();
        cavities.map_or(0.0, |cavities| cavities.pressure())
    }

    /// Makes this that pressure: whether there are cavities.
    pub fn set_pressure(&mut self, pressure: f32) -> bool {
        let cavities = self.beside.cavities.as_mut();
        cavities.map(|cavities| cavities.set_pressure(pressure)).is_some()
    }

    /// All that a step depends on.
    pub fn hash(&self, hasher: &mut StateHasher) {
        for node in 0..self.springs.node_count() {
            self.springs.visit(node, &mut |link| {
                hasher.write_u64(u64::from(link.neighbour));
                hasher.write_floats(&[link.stiffness, link.rest_length, link.damping]);
            });
        }
        self.elements.iter().for_each(|elements| elements.hash(hasher));
        self.beside.laws().for_each(|law| law.hash(hasher));
        self.beside.cavities.iter().for_each(|cavities| cavities.hash(hasher));
    }

    /// Whether springs and records, as they were read from bytes, are those of so many nodes.
    pub fn are_sound(&self, node_count: usize) -> bool {
        let mut are_sound = self.springs.node_count() == node_count;
        are_sound &= self
            .records
            .as_ref()
            .is_none_or(|records| records.as_slice().len() == node_count);
        let mut see = |link: Link| are_sound &= (link.neighbour as usize) < node_count;
        (0..node_count.min(self.springs.node_count())).for_each(|node| self.springs.visit(node, &mut see));
        are_sound
    }
}

/// The tetrahedra of a definition as elements, in the body's own numbers.
fn elements_of(law: Law, definition: &BodyDefinition, order: &NodeOrder) -> Result<Elements> {
    let tetrahedra = memory::collected(
        definition
            .tetrahedra
            .iter()
            .map(|corners| corners.map(|corner| order.own(corner))),
    )?;
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
