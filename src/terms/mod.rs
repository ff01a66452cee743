//! Energy terms of a body besides springs and elements. A term has a few nodes and follows one law.
//!
//! The forces on a tile are summed over all terms with a node in it; a term of two tiles is evaluated in both. So no
//! buffers are needed, tiles can be computed in any order, and results do not depend on the number of threads.
//!
//! Each law is implemented in `f64`, for energies, the exact solvers and all else. For axial terms `axial_terms`
//! computes the forces in SIMD-friendly `f32` loops from the same stored numbers.

mod anchor_springs;
mod axial_terms;
mod bending;
mod fibers;
mod limit;
mod maxwell_springs;
mod nonlinear;
mod pieces;
mod plastic_springs;
mod stencil_term;
mod stencils;

use std::fmt::Debug;
use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering};

use glam::{DMat3, DVec3};

use crate::base::{Result, StateHasher, memory};
use crate::codec::{Reader, Saved, Writer, saved, shape_with};
use crate::def::{BodyDefinition, NodalStiffness, RelaxationStep, Spring, Viscosity};
use crate::simd::ChosenKernel;
use crate::soa::{FrequencyBound, NodalMasses, NodeOrder, Region, Scale, TileForces, Vectors, View, tile_count};
use crate::springs::{SpringChange, Springs, spring_rates};
use crate::threads::Team;
use anchor_springs::AnchorSprings;
use bending::Hinges;
use fibers::Fibers;
use limit::StrainLimit;
use maxwell_springs::MaxwellSprings;
use nonlinear::NonlinearSprings;
pub(crate) use pieces::TermPieces;
use plastic_springs::PlasticSprings;
use stencils::{StencilLaw, Stencils};

/// The negative derivatives of the force on each of a term's first four nodes by the position of each, N/m.
pub(crate) type TangentBlocks = [[DMat3; 4]; 4];

/// An event for terms with internal variables.
#[derive(Clone, Copy, Debug)]
pub(crate) enum HistoryEvent {
    /// A step begins: the committed state is restored.
    Restore,
    /// The step in progress becomes the committed state.
    Commit,
    /// An implicit equation is solved for the end of a step of this length, s.
    Predict(f64),
    /// The nodes have moved.
    Advance,
}

/// The terms of a body that follow one law.
pub(crate) trait Term: Debug + Send + Sync {
    /// Writes the law's tag and its terms.
    fn save(&self, to: &mut Writer);

    /// Adds the forces on the nodes of a tile, N. Returns the largest ratio of stiffness to the stiffness that the rate
    /// bounds assume, at least 1.
    fn add_forces(
        &self,
        kernel: ChosenKernel,
        tile_and_nodes: (usize, Range<usize>),
        positions: View,
        forces: &mut TileForces,
    ) -> f64;

    /// Adds the first-order changes of the forces on the nodes of a tile, N, with a positive semidefinite tangent.
    fn add_force_changes(
        &self,
        kernel: ChosenKernel,
        tile_and_nodes: (usize, Range<usize>),
        vectors: [View; 2],
        changes: &mut TileForces,
    );

    /// The energy of the terms whose first tile is this one, J.
    fn energy(&self, tile: usize, at: &dyn Fn(usize) -> DVec3) -> f64;

    /// Calls `f` with each node of each term and the force on it, N.
    fn visit_forces(&self, at: &dyn Fn(usize) -> DVec3, f: &mut dyn FnMut(usize, DVec3));

    /// Calls `f` with the energy change of each term for these displacements, J, computed without cancellation.
    fn visit_changes(&self, at: &dyn Fn(usize) -> DVec3, displacement: &dyn Fn(usize) -> DVec3, f: &mut dyn FnMut(f64));

    /// Calls `f` with the nodes and blocks of each term: the exact second derivatives or a positive semidefinite
    /// approximation.
    fn visit_blocks(&self, at: &dyn Fn(usize) -> DVec3, is_exact: bool, f: &mut dyn FnMut(&[u32], &TangentBlocks));

    /// Calls `f` with the nodes and stiffness of each term, including terms of stiffness 0.
    fn visit_nodes(&self, f: &mut dyn FnMut(&[u32], f32));

    /// The largest ratio of stiffness with nodes at `positions` to the stiffness that the rate bounds assume, at
    /// least 1.
    fn stiffening(&self, positions: &Vectors) -> f64;

    /// Adds a bound of the squared frequencies at each node, 1/s².
    fn add_rates(&self, masses: &NodalMasses, rates: &mut [f32]);

    /// Calls `f` with the nodal stiffness of each term at each node, N/m. Nodes that are not free do not move.
    fn visit_nodal_stiffness(&self, masses: &NodalMasses, f: &mut dyn FnMut(usize, f32));

    /// Removes the terms with an edge between two nodes. Returns their number.
    fn remove_edge(&mut self, a: u32, b: u32) -> usize;

    /// Takes the new stiffness and rest length of a spring.
    fn set_spring(&mut self, _change: &SpringChange) {}

    /// Reserves memory for the terms of `added_nodes` more nodes.
    fn reserve_nodes(&mut self, node_count: usize, added_nodes: usize) -> Result<()>;

    /// Computes the terms after a cut, in a body with then `node_count` nodes, and reserves memory for them. Until
    /// [`Self::apply_cut`] or [`Self::discard_cut`], `visit_nodes` includes the new terms.
    fn prepare_cut(&mut self, pieces: &TermPieces, node_count: usize) -> Result<()>;

    /// Applies the prepared cut.
    fn apply_cut(&mut self);

    /// Discards the prepared cut.
    fn discard_cut(&mut self);

    /// Returns an error if scaling gives a number that is not finite. Terms of springs are scaled with the springs.
    fn check_scale(&self, region: &Region, scale: Scale) -> Result<()>;

    /// Scales the terms with all nodes in a region, after a successful check. Returns their number.
    fn scale(&mut self, region: &Region, scale: Scale) -> usize;

    /// Sets the origin that node positions are relative to.
    fn move_origin(&mut self, _origin: DVec3) {}

    /// True if a term anchors this node to the world.
    fn anchors(&self, _node: usize) -> bool {
        false
    }

    /// True if the terms have internal variables.
    fn has_history(&self) -> bool;

    fn apply_event(&mut self, event: HistoryEvent);

    /// Advances the internal variables to `positions` by this relaxation.
    fn advance(&mut self, kernel: ChosenKernel, positions: View, relaxation: RelaxationStep, team: &Team);

    /// Hashes the state that can change.
    fn hash(&self, hasher: &mut StateHasher);
}

impl Saved for Box<dyn Term> {
    const SHAPE: u64 = {
        let shape = 0;
        let shape = shape_with(shape, Stencils::<AnchorSprings, 1>::SHAPE);
        let shape = shape_with(shape, Stencils::<MaxwellSprings, 2>::SHAPE);
        let shape = shape_with(shape, Stencils::<StrainLimit, 2>::SHAPE);
        let shape = shape_with(shape, Stencils::<PlasticSprings, 2>::SHAPE);
        let shape = shape_with(shape, Stencils::<Hinges, 4>::SHAPE);
        let shape = shape_with(shape, Stencils::<NonlinearSprings, 2>::SHAPE);
        shape_with(shape, Stencils::<Fibers, 4>::SHAPE)
    };
    const LEAST: usize = 1;

    fn save(&self, to: &mut Writer) {
        Term::save(&**self, to);
    }

    fn load(from: &mut Reader) -> Result<Self> {
        let [law] = from.take_array()?;
        Ok(match law {
            AnchorSprings::SAVED_AS => memory::boxed(Stencils::<AnchorSprings, 1>::load(from)?)?,
            MaxwellSprings::SAVED_AS => memory::boxed(Stencils::<MaxwellSprings, 2>::load(from)?)?,
            StrainLimit::SAVED_AS => memory::boxed(Stencils::<StrainLimit, 2>::load(from)?)?,
            PlasticSprings::SAVED_AS => memory::boxed(Stencils::<PlasticSprings, 2>::load(from)?)?,
            Hinges::SAVED_AS => memory::boxed(Stencils::<Hinges, 4>::load(from)?)?,
            NonlinearSprings::SAVED_AS => memory::boxed(Stencils::<NonlinearSprings, 2>::load(from)?)?,
            Fibers::SAVED_AS => memory::boxed(Stencils::<Fibers, 4>::load(from)?)?,
            _ => return Err(from.refusal("no law of terms")),
        })
    }
}

/// All terms of a body.
#[derive(Debug)]
pub(crate) struct Terms {
    laws: Vec<Box<dyn Term>>,
    /// True if any node is anchored to the world.
    pub anchors_any: bool,
    /// The viscosity of the springs, if they have Maxwell branches.
    viscosity: Viscosity,
    kernel: ChosenKernel,
    /// Working memory with a number per node.
    sums: Vec<f32>,
    /// The frequency bound of the terms, including the springs that were passed.
    rates: FrequencyBound,
    rates_valid: bool,
    /// The ratio of the terms' stiffness to the one that the bound assumes, from the last force evaluation. It is
    /// stored as the bits of an `f32` of at least 1; their order is that of the numbers.
    stiffening: AtomicU32,
    /// That ratio at the current state.
    committed_stiffening: f32,
}

saved! { Terms { laws, anchors_any, viscosity, kernel, sums, rates, rates_valid, stiffening, committed_stiffening } }

impl Terms {
    /// Creates the terms of a definition for its `springs`. `None`: there are no terms.
    pub fn new(
        kernel: ChosenKernel,
        definition: &BodyDefinition,
        springs: &[Spring],
        order: &NodeOrder,
    ) -> Result<Option<Box<Self>>> {
        let candidates = [
            anchor_springs::new(definition, order)?,
            maxwell_springs::new(definition, springs, order)?,
            limit::new(definition, springs, order)?,
            plastic_springs::new(definition, springs, order)?,
            bending::new(definition, order)?,
            nonlinear::new(definition, springs, order)?,
            fibers::new(definition, order)?,
        ];
        let laws = memory::collected_within(candidates.len(), candidates.into_iter().flatten())?;
        if laws.is_empty() {
            return Ok(None);
        }
        let mut nodes = 0..definition.positions.len();
        Ok(Some(memory::boxed(Self {
            viscosity: if definition.viscosity.stiffening().is_some() && !springs.is_empty() {
                definition.viscosity
            } else {
                // A dashpot alone is damping along the springs.
                Viscosity::default()
            },
            kernel,
            anchors_any: nodes.any(|node| laws.iter().any(|law| law.anchors(node))),
            laws,
            sums: memory::filled(0.0, definition.positions.len())?,
            rates: FrequencyBound::ZERO,
            rates_valid: false,
            stiffening: AtomicU32::new(1.0_f32.to_bits()),
            committed_stiffening: 1.0,
        })?))
    }

    /// The terms of each law.
    pub fn laws(&self) -> impl Iterator<Item = &dyn Term> {
        self.laws.iter().map(|law| &**law)
    }

    /// The terms of each law, mutable.
    pub fn laws_mut(&mut self) -> impl Iterator<Item = &mut Box<dyn Term>> {
        self.laws.iter_mut()
    }

    /// Adds the forces on the nodes of a tile, N.
    pub fn add_forces(&self, tile: usize, nodes: Range<usize>, positions: View, forces: &mut TileForces) {
        for law in &self.laws {
            let stiffening = law.add_forces(self.kernel, (tile, nodes.clone()), positions, forces) as f32;
            if stiffening > 1.0 {
                self.stiffening.fetch_max(stiffening.to_bits(), Ordering::Relaxed);
            }
        }
    }

    /// Adds the changes of the forces on the nodes of a tile, N. `vectors` are the positions and displacements of
    /// nodes.
    pub fn add_force_changes(&self, tile: usize, nodes: Range<usize>, vectors: [View; 2], changes: &mut TileForces) {
        for law in &self.laws {
            law.add_force_changes(self.kernel, (tile, nodes.clone()), vectors, changes);
        }
    }

    /// The energy of the terms whose first tile is this one, J.
    pub fn energy_of_tile(&self, tile: usize, at: &dyn Fn(usize) -> DVec3) -> f64 {
        self.laws.iter().map(|law| law.energy(tile, at)).sum()
    }

    /// The energy of all terms, J.
    pub fn energy(&self, at: &dyn Fn(usize) -> DVec3) -> f64 {
        (0..tile_count(self.sums.len()))
            .map(|tile| self.energy_of_tile(tile, at))
            .sum()
    }

    /// Reserves memory for this total number of nodes.
    pub fn reserve_nodes(&mut self, count: usize) -> Result<()> {
        let old_count = self.sums.len();
        memory::reserve(&mut self.sums, count)?;
        let added_nodes = count.saturating_sub(old_count);
        self.laws
            .iter_mut()
            .try_for_each(|law| law.reserve_nodes(old_count, added_nodes))
    }

    /// Computes the terms after a cut, in a body with then `node_count` nodes, and reserves memory for them.
    pub fn prepare_cut(&mut self, pieces: &TermPieces, node_count: usize) -> Result<()> {
        memory::reserve(&mut self.sums, node_count)?;
        self.laws
            .iter_mut()
            .try_for_each(|law| law.prepare_cut(pieces, node_count))
    }

    /// Applies the prepared cut in a body with now `node_count` nodes.
    pub fn apply_cut(&mut self, node_count: usize) {
        self.sums.resize(node_count, 0.0);
        self.laws.iter_mut().for_each(|law| law.apply_cut());
        self.forget_rates();
    }

    /// Scales the terms with all nodes in a region, after a successful check. Returns their number.
    pub fn scale(&mut self, region: &Region, scale: Scale) -> usize {
        let count = self.laws.iter_mut().map(|law| law.scale(region, scale)).sum();
        if scale.stiffness == 0.0 && self.anchors_any {
            let laws = &self.laws;
            self.anchors_any = (0..self.sums.len()).any(|node| laws.iter().any(|law| law.anchors(node)));
        }
        count
    }

    /// Invalidates the frequency bound after masses, pins or springs have changed.
    pub fn forget_rates(&mut self) {
        self.rates_valid = false;
    }

    /// Updates the frequency bound for these masses and springs. Terms add stiffness to the springs.
    pub fn find_rates(&mut self, springs: &dyn Springs, masses: &NodalMasses) {
        if self.rates_valid {
            return;
        }
        self.sums.fill(0.0);
        for law in &self.laws {
            if masses.are_scaled {
                law.visit_nodal_stiffness(masses, &mut |node, stiffness| {
                    self.sums[node] += stiffness * masses.inverse(node);
                });
            } else {
                law.add_rates(masses, &mut self.sums);
            }
        }
        let mut max_rates = FrequencyBound::ZERO;
        for (node, &sum) in self.sums.iter().enumerate() {
            let spring_bound = spring_rates(node, springs, masses).unwrap_or(FrequencyBound::ZERO);
            max_rates.omega_sq = max_rates.omega_sq.max(sum + spring_bound.omega_sq);
            max_rates.damping_rate = max_rates.damping_rate.max(spring_bound.damping_rate);
        }
        self.rates = max_rates;
        self.rates_valid = true;
    }

    /// Adds the nodal stiffness of free nodes.
    pub fn add_to(&self, masses: &NodalMasses, all: &mut [NodalStiffness]) {
        for law in &self.laws {
            law.visit_nodal_stiffness(masses, &mut |node, stiffness| all[node].add(stiffness, self.viscosity));
        }
    }

    /// Resets the stiffness ratio before a force evaluation at other positions.
    pub fn reset_stiffening(&mut self) {
        *self.stiffening.get_mut() = 1.0_f32.to_bits();
    }

    /// Computes the stiffness ratio with nodes at `positions` and makes it the current one.
    pub fn commit_stiffening_at(&mut self, positions: &Vectors) {
        let stiffest = self.laws.iter().map(|law| law.stiffening(positions));
        let stiffest = stiffest.fold(1.0, f64::max) as f32;
        *self.stiffening.get_mut() = stiffest.to_bits();
        self.committed_stiffening = stiffest;
    }

    /// Makes the stiffness ratio of the last force evaluation the current one.
    pub fn commit_stiffening(&mut self) {
        self.committed_stiffening = f32::from_bits(*self.stiffening.get_mut());
    }

    /// The frequency bound at the current state if `at_committed`, otherwise at the last force evaluation.
    pub fn rates(&self, at_committed: bool) -> FrequencyBound {
        let latest = || f32::from_bits(self.stiffening.load(Ordering::Relaxed));
        let stiffening = if at_committed {
            self.committed_stiffening
        } else {
            latest()
        };
        let rates = FrequencyBound {
            omega_sq: self.rates.omega_sq * stiffening,
            ..self.rates
        };
        if self.viscosity.is_none() {
            rates
        } else {
            self.viscosity.rates(rates)
        }
    }

    /// Advances the internal variables to `positions` by this relaxation.
    pub fn advance(&mut self, positions: &Vectors, relaxation: impl Fn(Viscosity) -> RelaxationStep, team: &Team) {
        let (kernel, relaxation) = (self.kernel, relaxation(self.viscosity));
        for law in &mut self.laws {
            law.advance(kernel, positions.view(), relaxation, team);
        }
    }
}
