//! Tetrahedral finite elements, for any Young's modulus and Poisson's ratio.
//!
//! Tetrahedra are grouped into *parts* of up to [`parts::PART_SIZE`] elements; any thread may process a part. A part
//! adds up forces on its own copies of its nodes. The tiles of nodes then add up the copies in the order of the parts.
//! No force is computed twice, and results do not depend on the number of threads.

mod cut;
mod deformed_rates;
mod forces;
mod history;
mod law;
mod laws;
mod nodal_pressure;
mod parts;
mod plasticity;
mod pressure_offset;
mod rates;
mod scale;
mod tetrahedra;

use glam::{DMat3, DVec3};

use crate::base::{Result, StateHasher, memory};
use crate::codec::saved;
use crate::def::{RelaxationStep, Viscosity, Yielding};
use crate::simd::{ChosenKernel, Record};
use crate::soa::{PerNode, Vectors};
use crate::threads::{Items, Team};
pub(crate) use cut::ElementPiece;
use deformed_rates::DeformedRates;
pub(crate) use forces::ElementForces;
use history::ElementHistory;
pub(crate) use law::{DeformedTet, ElasticLaw, RestTet, TetStress};
use nodal_pressure::{NodalPressures, NodalVolumes};
use parts::{FemPart, NodeCopies};
use pressure_offset::PressureOffsets;
pub(crate) use rates::LEAST_SHEAR;
use tetrahedra::TangentMatrix;

/// The finite elements of a body.
#[derive(Debug)]
pub(crate) struct Elements {
    law: ElasticLaw,
    count: usize,
    parts: Vec<FemPart>,
    /// Where each tetrahedron is stored, for bodies that can be cut.
    cells: Option<Box<cut::CellIndices>>,
    /// The index of the first node copy of each part.
    starts: Vec<usize>,
    copies: NodeCopies,
    forces: Sums,
    /// The nodal volumes, with average nodal pressure.
    nodal_volumes: Option<NodalVolumes>,
    /// The history variables, with viscosity or plasticity.
    history: Option<Box<ElementHistory>>,
    /// A bound on the squared angular frequency at the last computed forces, and at the current state, 1/s².
    rate_bound: f32,
    committed_rate_bound: f32,
    /// The highest damping rate of the springs at the nodes of the elements, 1/s.
    damping_rate: f32,
    /// The share of the springs in the bound, which does not grow with the deformation of the elements, 1/s².
    spring_rate: f32,
    /// The approximate stiffness of the elements at each node, N/m.
    stiffnesses: Vec<f32>,
    /// The bound at rest of each node, without `spring_rate`, 1/s².
    node_rates: Vec<f32>,
    /// The highest bound at rest, without `spring_rate`, 1/s².
    max_rest_rate: f32,
    /// True if the bounds at rest match the current masses and springs.
    rates_known: bool,
    /// Tight bounds, for explicit solvers only.
    deformed_rates: Option<Box<DeformedRates>>,
    /// The volume offsets of nodes that a cut has duplicated.
    pressure_offsets: PressureOffsets,
}

saved! { Elements {
    law, count, parts, cells, starts, copies, forces, nodal_volumes, history, rate_bound, committed_rate_bound,
    damping_rate, spring_rate, stiffnesses, node_rates, max_rest_rate, rates_known, deformed_rates, pressure_offsets,
} }

/// Per-node sums over the tetrahedra of each part, one entry for each node copy.
#[derive(Debug)]
pub(crate) struct Sums {
    positions: Vec<Record>,
    /// Displacements of the nodes, for force differentials only.
    displacements: Vec<Record>,
    sums: Vec<Record>,
    part_totals: Vec<f64>,
    /// Empty without average nodal pressure.
    pressures: NodalPressures,
    /// The tangent of each part, for force differentials only. Empty with average nodal pressure, and `None` for parts
    /// that a cut has added.
    matrices: Vec<Option<TangentMatrix>>,
    /// True while the matrices hold the tangent of the equation that is being solved.
    are_assembled: bool,
}

saved! { Sums { positions, displacements, sums, part_totals, pressures, matrices } leaves { are_assembled: false } }

impl Sums {
    fn new(copies: usize, parts: usize, with_displacements: bool, pressure_count: usize) -> Result<Self> {
        let records = |count| memory::filled(Record::default(), count);
        Ok(Self {
            positions: records(copies)?,
            displacements: records(if with_displacements { copies } else { 0 })?,
            sums: records(copies)?,
            part_totals: memory::filled(0.0, parts)?,
            pressures: NodalPressures::new(pressure_count)?,
            matrices: Vec::new(),
            are_assembled: false,
        })
    }

    /// Reserves memory for additional copies and parts, and for nodal pressures of `pressure_count` nodes in all.
    fn reserve(&mut self, copies: usize, parts: usize, pressure_count: usize) -> Result<()> {
        self.pressures.reserve_nodes(pressure_count)?;
        if !self.displacements.is_empty() {
            self.displacements.try_reserve(copies)?;
        }
        for records in [&mut self.positions, &mut self.sums] {
            records.try_reserve(copies)?;
        }
        if !self.matrices.is_empty() {
            self.matrices.try_reserve(parts)?;
        }
        Ok(self.part_totals.try_reserve(parts)?)
    }

    /// Reserves memory for the pressures of `node_count` nodes in all, if there are nodal pressures.
    pub fn reserve_pressures(&mut self, node_count: usize) -> Result<()> {
        if self.pressures.at_nodes.is_empty() {
            return Ok(());
        }
        self.pressures.reserve_nodes(node_count)
    }

    /// Resizes to these numbers of copies and parts, within the reserved memory.
    fn grow(&mut self, copies: usize, parts: usize) {
        if !self.displacements.is_empty() {
            self.displacements.resize(copies, Record::default());
        }
        self.positions.resize(copies, Record::default());
        self.sums.resize(copies, Record::default());
        self.part_totals.resize(parts, 0.0);
        if !self.matrices.is_empty() {
            self.matrices.resize_with(parts, || None);
        }
    }

    /// Computes the following products from the tetrahedra.
    pub fn discard_tangent(&mut self) {
        self.are_assembled = false;
    }
}

/// A callback for the nodes of a tetrahedron, the gradients of its shape functions, and its deformation.
pub(crate) type VisitDeformed<'a> = dyn FnMut([u32; 4], &[DVec3; 4], &DeformedTet) + 'a;

impl Elements {
    /// Creates the elements of tetrahedra with rest positions `rest`; nodes have the body's internal indices.
    pub fn new(
        law: ElasticLaw,
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
        let pressure_count = if law.nodal_pressure { node_count } else { 0 };
        let mut elements = Self {
            law,
            cells: None,
            count: tetrahedra.len(),
            history: ElementHistory::new(law, viscosity, yielding, &parts, pressure_count)?,
            copies: NodeCopies::new(&parts, node_count)?,
            forces: Sums::new(count, parts.len(), false, pressure_count)?,
            nodal_volumes: law
                .nodal_pressure
                .then(|| nodal_pressure::nodal_volumes(&parts, node_count))
                .transpose()?,
            parts,
            starts,
            stiffnesses: memory::filled(0.0, node_count)?,
            node_rates: memory::filled(0.0, node_count)?,
            rate_bound: f32::INFINITY,
            committed_rate_bound: f32::INFINITY,
            damping_rate: 0.0,
            spring_rate: 0.0,
            max_rest_rate: 0.0,
            rates_known: false,
            deformed_rates: None,
            pressure_offsets: PressureOffsets::default(),
        };
        elements.find_stiffnesses();
        Ok(elements)
    }

    /// Allocates sums for force differentials.
    pub fn new_differentials(&self) -> Result<Sums> {
        let pressure_count = self.pressure_count_of(self.stiffnesses.len());
        let mut sums = Sums::new(self.forces.sums.len(), self.parts.len(), true, pressure_count)?;
        if self.nodal_volumes.is_none() {
            sums.matrices = memory::try_collected(self.parts.iter().map(FemPart::new_matrix))?;
        }
        Ok(sums)
    }

    /// Removes the tetrahedra that contain the edge between two nodes. Returns their number.
    pub fn remove_edge(&mut self, a: u32, b: u32) -> usize {
        let mut removed = 0;
        for part in &mut self.parts {
            removed += part.remove_edge(a, b, |node, share| {
                if let Some(nodal_volumes) = &mut self.nodal_volumes {
                    let volume = &mut nodal_volumes.volumes[node as usize];
                    let left = (*volume - share).max(0.0);
                    self.pressure_offsets.scale(node, left / *volume);
                    *volume = left;
                }
            });
        }
        self.rates_known &= removed == 0;
        removed
    }

    /// Calls `f` with each tetrahedron's nodes and rest shape.
    pub fn visit(&self, f: &mut dyn FnMut([u32; 4], &RestTet)) {
        for part in &self.parts {
            part.visit(&mut |corners, rest, _| f(corners, rest));
        }
    }

    /// Calls `f` with each tetrahedron's nodes, rest shape and extra stress.
    pub fn visit_with_extra_stress(&self, f: &mut dyn FnMut([u32; 4], &RestTet, TetStress)) {
        let history = self.history.as_deref();
        for (index, part) in self.parts.iter().enumerate() {
            part.visit(&mut |corners, rest, lane_index| {
                let extra = history.map_or(TetStress::ZERO, |history| history.extra_stress(index, lane_index));
                f(corners, rest, extra);
            });
        }
    }

    /// Calls `f` with each tetrahedron's nodes, shape function gradients and deformation, with nodes at `positions`.
    /// With average nodal pressure, each tetrahedron instead resists its own volume change with the fraction
    /// `kappa_factor` of kappa.
    pub fn visit_deformed(&self, positions: &Vectors, kappa_factor: f32, f: &mut VisitDeformed) {
        let mut law = self.stiffened();
        if law.nodal_pressure {
            law.nodal_pressure = false;
            law.kappa *= kappa_factor;
        }
        self.visit_with_extra_stress(&mut |corners, rest, extra| {
            let [a, b, c, d] = corners.map(|node| positions.get(node as usize).as_dvec3());
            let deformed = DeformedTet::new(law, rest, DMat3::from_cols(b - a, c - a, d - a));
            f(corners, &rest.gradients(), &deformed.with_extra_stress(extra));
        });
    }

    /// The number of volume changes that [`Self::exact_energy`] needs for `node_count` nodes.
    pub fn pressure_count_of(&self, node_count: usize) -> usize {
        if self.nodal_volumes.is_some() { node_count } else { 0 }
    }

    /// True if nodal pressures can ever have an extra part, from history or pressure offsets.
    pub fn may_have_extra_pressure(&self) -> bool {
        self.has_history() || self.cells.is_some()
    }

    /// The approximate stiffness of the elements at a node, from their creation, N/m.
    pub fn stiffness_of(&self, node: usize) -> f32 {
        self.stiffnesses[node]
    }

    /// An upper bound on the number of tetrahedra.
    pub fn count(&self) -> usize {
        self.count
    }

    /// The nodal volume at rest, a quarter of the volume of the tetrahedra around the node, m³. `None` without average
    /// nodal pressure.
    pub fn nodal_volume(&self, node: usize) -> Option<f64> {
        let volume = self.nodal_volumes.as_ref()?.volumes.get(node)?;
        Some(f64::from(*volume))
    }

    /// The law of all elements in the equation that is being solved; viscosity scales it by 1 plus the gain.
    pub fn stiffened(&self) -> ElasticLaw {
        self.history
            .as_ref()
            .map_or(self.law, |history| history.stiffened(self.law))
    }

    /// The extra pressure of a node, from its history and its volume offset, Pa.
    pub fn extra_pressure(&self, node: usize) -> f64 {
        let history = self.history.as_ref();
        let history_pressure = history.map_or(0.0, |history| history.extra_pressure(node));
        match self.nodal_volume(node) {
            Some(volume) if volume > 0.0 => {
                history_pressure - f64::from(self.stiffened().kappa) * self.pressure_offsets.at(node) / volume
            }
            _ => history_pressure,
        }
    }

    /// True if the elements have history variables.
    pub fn has_history(&self) -> bool {
        self.history.is_some()
    }

    /// Resets the history to the current state, at the beginning of a step.
    pub fn restore(&mut self) {
        self.pressure_offsets.restore();
        if let Some(history) = &mut self.history {
            history.restore();
        }
    }

    /// Makes the history of the step in progress current.
    pub fn commit(&mut self) {
        self.pressure_offsets.commit();
        if let Some(history) = &mut self.history {
            history.commit();
        }
    }

    /// Predicts the history at the end of `time` seconds, for the equation to be solved.
    pub fn predict(&mut self, time: f64) {
        if let Some(history) = &mut self.history {
            history.predict(time);
        }
    }

    /// Advances the history to nodes at `positions`, by the relaxation step that `relaxation` returns for the
    /// viscosity.
    pub fn advance(
        &mut self,
        kernel: ChosenKernel,
        positions: &[Record],
        relaxation: impl Fn(Viscosity) -> RelaxationStep,
        team: &Team,
    ) {
        let Some(history) = &self.history else {
            return;
        };
        let relaxation = relaxation(history.viscosity);
        if self.nodal_volumes.is_some() {
            self.find_pressures(kernel, positions, false, team);
        }
        self.find_stresses(kernel, positions, team);
        if let Some(history) = &mut self.history {
            history.gain = 0.0;
            let yield_limits = history.yield_limits.filter(|_| relaxation.yields);
            team.pass(history.parts.len(), Items::new(&mut history.parts), |_, part| {
                part.advance(kernel, relaxation, yield_limits);
            });
            history.nodal.advance(relaxation, &self.forces.pressures.at_nodes);
        }
    }

    /// True if any tetrahedron would yield with nodes at these positions.
    pub fn yield_at(&self, position: impl Fn(usize) -> DVec3) -> bool {
        let Some((history, yield_limits)) = self
            .history
            .as_deref()
            .and_then(|history| Some((history, history.yield_limits?)))
        else {
            return false;
        };
        let mut yields = false;
        for (index, part) in self.parts.iter().enumerate() {
            part.visit(&mut |corners, rest, lane_index| {
                let [a, b, c, d] = corners.map(|node| position(node as usize));
                let deformed = DeformedTet::new(self.law, rest, DMat3::from_cols(b - a, c - a, d - a));
                yields |= history.parts[index].yields(yield_limits, lane_index, deformed.elastic());
            });
        }
        yields
    }

    /// Hashes the state that can change.
    pub fn hash(&self, hasher: &mut StateHasher) {
        for group in self.parts.iter().flat_map(|part| part.groups.as_slice()) {
            hasher.write_floats(&group.volumes);
            hasher.write_floats(group.inverse.as_flattened());
        }
        if let Some(history) = &self.history {
            history.hash(hasher);
        }
        self.pressure_offsets.hash(hasher);
        hasher.write_floats(&[self.least_rate()]);
    }
}
