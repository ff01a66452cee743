//! Tetrahedra as finite elements: forces that no spring can give, of any Young's modulus and Poisson's ratio.
//!
//! Tetrahedra lie in *parts*, some two thousand each, that any thread may work on: a part adds up forces on its own copies of its nodes,
//! and the tiles of nodes then add up the copies, in the order of parts. So nothing is worked out twice, and results are the same for
//! any number of threads.

mod cut;
mod forces;
mod law;
mod laws;
mod offsets;
mod parts;
mod past;
mod rates;
mod rings;
mod scale;
mod set;
mod tetrahedra;

use glam::{DMat3, DVec3};

use crate::base::{Result, StateHasher, memory};
use crate::codec::saved;
use crate::def::{RelaxationStep, Viscosity, Yielding};
use crate::simd::{ChosenKernel, Record};
use crate::soa::{PerNode, Vectors};
use crate::threads::{Items, Team};
pub(crate) use cut::PieceOfElement;
pub(crate) use forces::Shares;
pub(crate) use law::{Deformed, Law, Load, Rest};
use offsets::Offsets;
use parts::{Copies, FemPart};
use past::Memory;
pub(crate) use rates::LEAST_SHEAR;
use rings::{Pressures, Rings};

/// The tetrahedra of a body that are elements.
#[derive(Debug)]
pub(crate) struct Elements {
    law: Law,
    count: usize,
    parts: Vec<FemPart>,
    /// Of bodies that may be cut.
    cells: Option<Box<cut::Cells>>,
    /// Where the copies of each part's nodes begin.
    starts: Vec<usize>,
    copies: Copies,
    forces: Sums,
    /// Where volume is kept by rings.
    rings: Option<Rings>,
    /// Where they are viscous.
    memory: Option<Box<Memory>>,
    /// A bound on the squares of frequencies where the forces were last worked out, and at the current state, 1/s².
    highest: f32,
    settled: f32,
    /// The highest rate of damping of the springs at their nodes, 1/s.
    most_damped: f32,
    /// What the bounds at rest leave out, because it does not grow with how elements are deformed, 1/s².
    of_springs: f32,
    /// About how stiff the elements at each node are together, N/m.
    stiffnesses: Vec<f32>,
    /// Room for a number per node.
    carried: Vec<f32>,
    /// Whether the bounds at rest are those of the masses and springs there are.
    rates_known: bool,
    /// Of rings that a cut has parted.
    offsets: Offsets,
}

saved! { Elements {
    law, count, parts, cells, starts, copies, forces, rings, memory, highest, settled, most_damped, of_springs,
    stiffnesses, carried, rates_known, offsets,
} }

/// Sums of a kind on all copies of nodes.
#[derive(Debug)]
pub(crate) struct Sums {
    positions: Vec<Record>,
    /// Ways of nodes, where sums are made of them.
    ways: Vec<Record>,
    sums: Vec<Record>,
    of_parts: Vec<f64>,
    /// Of no nodes where each tetrahedron keeps its own volume.
    pressures: Pressures,
}

saved! { Sums { positions, ways, sums, of_parts, pressures } }

impl Sums {
    fn new(copies: usize, parts: usize, with_ways: bool, ring_count: usize) -> Result<Self> {
        let records = |count| memory::filled(Record::default(), count);
        Ok(Self {
            positions: records(copies)?,
            ways: records(if with_ways { copies } else { 0 })?,
            sums: records(copies)?,
            of_parts: memory::filled(0.0, parts)?,
            pressures: Pressures::new(ring_count)?,
        })
    }

    /// Makes room for more copies and parts, and for rings of so many nodes in all, or none.
    fn reserve(&mut self, copies: usize, parts: usize, ring_count: usize) -> Result<()> {
        self.pressures.reserve_nodes(ring_count)?;
        if !self.ways.is_empty() {
            self.ways.try_reserve(copies)?;
        }
        for records in [&mut self.positions, &mut self.sums] {
            records.try_reserve(copies)?;
        }
        Ok(self.of_parts.try_reserve(parts)?)
    }

    /// Makes room for the rings of so many nodes in all, where there are any.
    pub fn reserve_rings(&mut self, node_count: usize) -> Result<()> {
        if self.pressures.of_nodes.is_empty() {
            return Ok(());
        }
        self.pressures.reserve_nodes(node_count)
    }

    /// Becomes one of so many copies and parts, for which there is room.
    fn grow(&mut self, copies: usize, parts: usize) {
        if !self.ways.is_empty() {
            self.ways.resize(copies, Record::default());
        }
        self.positions.resize(copies, Record::default());
        self.sums.resize(copies, Record::default());
        self.of_parts.resize(parts, 0.0);
    }
}

/// What is shown the nodes of a tetrahedron, the gradients of their functions, and how it is deformed.
pub(crate) type SeeDeformed<'a> = dyn FnMut([u32; 4], &[DVec3; 4], &Deformed) + 'a;

impl Elements {
    /// Tetrahedra of nodes that are here at rest, in the body's own numbers.
    pub fn new(
        law: Law,
        (viscosity, yielding): (Viscosity, Yielding),
        tetrahedra: &[[u32; 4]],
        rest: impl Fn(u32) -> DVec3,
        node_count: usize,
    ) -> Result<Self> {
        let parts = parts::split(tetrahedra, &rest)?;
        let mut starts = memory::reserved(parts.len() + 1)?;
        let mut count = 0;
        for part in &parts {
            starts.push(count);
            count += part.nodes.len();
        }
        let ring_count = if law.rings { node_count } else { 0 };
        let mut elements = Self {
            law,
            cells: None,
            count: tetrahedra.len(),
            memory: Memory::new(law, viscosity, yielding, &parts, ring_count)?,
            copies: Copies::new(&parts, node_count)?,
            forces: Sums::new(count, parts.len(), false, ring_count)?,
            rings: law.rings.then(|| rings::of(&parts, node_count)).transpose()?,
            parts,
            starts,
            stiffnesses: memory::filled(0.0, node_count)?,
            carried: memory::filled(0.0, node_count)?,
            highest: f32::INFINITY,
            settled: f32::INFINITY,
            most_damped: 0.0,
            of_springs: 0.0,
            rates_known: false,
            offsets: Offsets::default(),
        };
        elements.find_stiffnesses();
        Ok(elements)
    }

    /// Room for sums that are made of ways.
    pub fn room_for_changes(&self) -> Result<Sums> {
        let ring_count = self.ring_count_of(self.stiffnesses.len());
        Sums::new(self.forces.sums.len(), self.parts.len(), true, ring_count)
    }

    /// Takes away the tetrahedra that have an edge between two nodes: how many.
    pub fn remove_edge(&mut self, a: u32, b: u32) -> usize {
        let mut removed = 0;
        for part in &mut self.parts {
            removed += part.remove_edge(a, b, |node, share| {
                if let Some(rings) = &mut self.rings {
                    let volume = &mut rings.volumes[node as usize];
                    let left = (*volume - share).max(0.0);
                    self.offsets.scale(node, left / *volume);
                    *volume = left;
                }
            });
        }
        self.rates_known &= removed == 0;
        removed
    }

    /// Shows each tetrahedron's nodes and the way it is at rest.
    pub fn visit(&self, see: &mut dyn FnMut([u32; 4], &Rest)) {
        for part in &self.parts {
            part.visit(&mut |corners, rest, _| see(corners, rest));
        }
    }

    /// The same with the load on it.
    pub fn visit_loaded(&self, see: &mut dyn FnMut([u32; 4], &Rest, Load)) {
        let memory = self.memory.as_deref();
        for (index, part) in self.parts.iter().enumerate() {
            part.visit(&mut |corners, rest, place| {
                let load = memory.map_or(Load::NONE, |memory| memory.load(index, place));
                see(corners, rest, load);
            });
        }
    }

    /// Shows each tetrahedron's nodes, the gradients of their functions and how it is deformed with nodes at `positions`; what rings do
    /// is shown as if each tetrahedron kept this part of it by itself.
    pub fn visit_deformed(&self, positions: &Vectors, part_of_rings: f32, see: &mut SeeDeformed) {
        let mut law = self.stiffened();
        if law.rings {
            law.rings = false;
            law.kappa *= part_of_rings;
        }
        self.visit_loaded(&mut |corners, rest, load| {
            let [a, b, c, d] = corners.map(|node| positions.get(node as usize).as_dvec3());
            let deformed = Deformed::new(law, rest, DMat3::from_cols(b - a, c - a, d - a));
            see(corners, &rest.gradients(), &deformed.loaded(load));
        });
    }

    /// How many numbers [`Self::exact_energy`] needs once there are so many nodes.
    pub fn ring_count_of(&self, node_count: usize) -> usize {
        if self.rings.is_some() { node_count } else { 0 }
    }

    /// Whether rings may ever have loads.
    pub fn may_load_rings(&self) -> bool {
        self.remember() || self.cells.is_some()
    }

    /// About how stiff the elements at a node are together, as they were made, N/m.
    pub fn stiffness_of(&self, node: usize) -> f32 {
        self.stiffnesses[node]
    }

    /// How many there are at most.
    pub fn count(&self) -> usize {
        self.count
    }

    /// A quarter of the volume of the tetrahedra about a node at rest, m³, where volume is kept by rings.
    pub fn ring_volume(&self, node: usize) -> Option<f64> {
        let volume = self.rings.as_ref()?.volumes.get(node)?;
        Some(f64::from(*volume))
    }

    /// The law of all of them in the equation that is being solved.
    pub fn stiffened(&self) -> Law {
        self.memory
            .as_ref()
            .map_or(self.law, |memory| memory.stiffened(self.law))
    }

    /// The load on the ring of a node, Pa: what is remembered, and what its offset makes of the pressure.
    pub fn load_of_ring(&self, node: usize) -> f64 {
        let memory = self.memory.as_ref();
        let remembered = memory.map_or(0.0, |memory| memory.load_of_ring(node));
        match self.ring_volume(node) {
            Some(volume) if volume > 0.0 => {
                remembered - f64::from(self.stiffened().kappa) * self.offsets.of(node) / volume
            }
            _ => remembered,
        }
    }

    /// Whether they remember anything.
    pub fn remember(&self) -> bool {
        self.memory.is_some()
    }

    /// A step begins, from what is current.
    pub fn recall(&mut self) {
        self.offsets.recall();
        if let Some(memory) = &mut self.memory {
            memory.recall();
        }
    }

    /// The step in progress is the current state.
    pub fn keep(&mut self) {
        self.offsets.keep();
        if let Some(memory) = &mut self.memory {
            memory.keep();
        }
    }

    /// An equation is to be solved for the end of so many seconds.
    pub fn foresee(&mut self, time: f64) {
        if let Some(memory) = &mut self.memory {
            memory.foresee(time);
        }
    }

    /// Nodes have come to `positions` along the course that the viscosity leads to.
    pub fn age(
        &mut self,
        kernel: ChosenKernel,
        positions: &[Record],
        course: impl Fn(Viscosity) -> RelaxationStep,
        team: &Team,
    ) {
        let Some(memory) = &self.memory else {
            return;
        };
        let course = course(memory.viscosity);
        if self.rings.is_some() {
            self.find_pressures(kernel, positions, false, team);
        }
        self.find_stresses(kernel, positions, team);
        if let Some(memory) = &mut self.memory {
            memory.gain = 0.0;
            let bounds = memory.bounds.filter(|_| course.yields);
            team.pass(memory.parts.len(), Items::new(&mut memory.parts), |_, part| {
                part.age(kernel, course, bounds);
            });
            memory.rings.age(course, &self.forces.pressures.of_nodes);
        }
    }

    /// Whether any would yield with nodes at these positions.
    pub fn yield_at(&self, position: impl Fn(usize) -> DVec3) -> bool {
        let Some((memory, bounds)) = self.memory.as_deref().and_then(|memory| Some((memory, memory.bounds?))) else {
            return false;
        };
        let mut any = false;
        for (index, part) in self.parts.iter().enumerate() {
            part.visit(&mut |corners, rest, place| {
                let [a, b, c, d] = corners.map(|node| position(node as usize));
                let deformed = Deformed::new(self.law, rest, DMat3::from_cols(b - a, c - a, d - a));
                any |= memory.parts[index].yields(bounds, place, deformed.elastic());
            });
        }
        any
    }

    /// What may change of them.
    pub fn hash(&self, hasher: &mut StateHasher) {
        for group in self.parts.iter().flat_map(|part| part.groups.as_slice()) {
            hasher.write_floats(&group.volumes);
            hasher.write_floats(group.inverse.as_flattened());
        }
        if let Some(memory) = &self.memory {
            memory.hash(hasher);
        }
        self.offsets.hash(hasher);
    }
}
