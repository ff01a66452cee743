//! Terms of a body's energy beside those of springs and elements: each is of a few nodes, and follows one law.
//!
//! A tile's forces are made of all terms that have one of its nodes; what belongs to two tiles is worked out in each of them. So there
//! are no buffers, any thread may take any tile, and results are the same for any number of threads.
//!
//! Each law is written once in `f64`, for energies, for exact solvers and for the rest. Where it is one of strings, `strings` has the
//! forces once more, side by side in `f32`; of the same stored numbers.

mod arms;
mod bending;
mod fibres;
mod home;
mod limit;
mod nonlinear;
mod parting;
mod set;
mod stencil_term;
mod stencils;
mod strings;

use std::fmt::Debug;
use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering};

use glam::{DMat3, DVec3};

use crate::base::{Result, StateHasher, memory};
use crate::codec::{Reader, Saved, Writer, saved, shape_with};
use crate::def::{BodyDefinition, Carried, RelaxationStep, Spring, Viscosity};
use crate::simd::ChosenKernel;
use crate::soa::{Masses, NodeOrder, Rates, Region, Scale, TileForces, Vectors, View, tile_count};
use crate::springs::{SpringChange, Springs, rates_anywhere};
use crate::threads::Team;
use arms::Arms;
use bending::Hinges;
use fibres::Fibres;
use home::Home;
use limit::Limit;
use nonlinear::Stiffening;
pub(crate) use parting::Parting;
use set::Sets;
use stencils::{StencilLaw, Stencils};

/// How much the force on one node of a term lessens with the place of another, N/m, for its first nodes.
pub(crate) type TangentBlocks = [[DMat3; 4]; 4];

/// What is done to terms that remember.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Event {
    /// A step begins, from what is current.
    Recall,
    /// The step in progress is the current state.
    Keep,
    /// An equation is to be solved for the end of so many seconds.
    Foresee(f64),
    /// Nodes have come to other places.
    Age,
}

/// The terms of a body that follow one law.
pub(crate) trait Term: Debug + Send + Sync {
    /// Writes which law it is, and its terms.
    fn save(&self, to: &mut Writer);

    /// Adds the forces on the nodes of a tile, N: by how much they are stiffer than their rates say, 1: not at all.
    fn add_forces(
        &self,
        kernel: ChosenKernel,
        of: (usize, Range<usize>),
        positions: View,
        forces: &mut TileForces,
    ) -> f64;

    /// Adds how the forces on the nodes of a tile change, N, in the first order; nothing is pushed sideways.
    fn add_changes(&self, kernel: ChosenKernel, of: (usize, Range<usize>), places: [View; 2], changes: &mut TileForces);

    /// The energy of the terms that begin in a tile, J.
    fn energy(&self, tile: usize, at: &dyn Fn(usize) -> DVec3) -> f64;

    /// Shows the force on each node of each term, N.
    fn show_forces(&self, at: &dyn Fn(usize) -> DVec3, see: &mut dyn FnMut(usize, DVec3));

    /// Shows how the energy of each term changes where nodes go so much further, J, to the last digits.
    fn show_changes(&self, at: &dyn Fn(usize) -> DVec3, more: &dyn Fn(usize) -> DVec3, see: &mut dyn FnMut(f64));

    /// Shows each term's nodes and blocks: all second derivatives, or what is positive semidefinite of them.
    fn show_blocks(&self, at: &dyn Fn(usize) -> DVec3, is_exact: bool, see: &mut dyn FnMut(&[u32], &TangentBlocks));

    /// Shows the nodes of each term and how stiff it is, those of no stiffness too.
    fn show_nodes(&self, see: &mut dyn FnMut(&[u32], f32));

    /// By how much the stiffest is stiffer with nodes at `positions` than its rate says, 1: not at all.
    fn stiffening(&self, positions: &Vectors) -> f64;

    /// Adds what bounds the squares of frequencies to each node, 1/s².
    fn add_rates(&self, masses: &Masses, rates: &mut [f32]);

    /// Shows what each node carries of each term, N/m, where those that are not free go no way.
    fn show_carried(&self, masses: &Masses, see: &mut dyn FnMut(usize, f32));

    /// Takes away what has an edge between two nodes: how many terms.
    fn remove_edge(&mut self, a: u32, b: u32) -> usize;

    /// The spring between two nodes has another stiffness and rest length.
    fn set_spring(&mut self, _change: &SpringChange) {}

    /// Makes room for the parts that so many more nodes bring, beside so many.
    fn reserve_nodes(&mut self, node_count: usize, more: usize) -> Result<()>;

    /// Finds what a cut leaves, in a body of so many nodes then, and makes room for it; until [`Self::take_parts`] or
    /// [`Self::forget_parts`] what it adds is shown among its nodes.
    fn prepare_parts(&mut self, parting: &Parting, node_count: usize) -> Result<()>;

    /// Becomes what a cut leaves.
    fn take_parts(&mut self);

    /// There is no cut.
    fn forget_parts(&mut self);

    /// Refuses to scale what would have a number that is none. Terms of springs go with those.
    fn check_scale(&self, region: &Region, scale: Scale) -> Result<()>;

    /// Scales the terms with all nodes in a region, which must not be refused: how many.
    fn scale(&mut self, region: &Region, scale: Scale) -> usize;

    /// Nodes are given from here on.
    fn move_origin(&mut self, _origin: DVec3) {}

    /// Whether they hold a node against the world.
    fn holds(&self, _node: usize) -> bool {
        false
    }

    /// Whether they remember anything.
    fn remembers(&self) -> bool;

    fn pass(&mut self, moment: Event);

    /// Nodes have come to `positions`, and what is viscous along this course.
    fn age(&mut self, kernel: ChosenKernel, positions: View, course: RelaxationStep, team: &Team);

    /// What may change of them.
    fn hash(&self, hasher: &mut StateHasher);
}

impl Saved for Box<dyn Term> {
    const SHAPE: u64 = {
        let shape = 0;
        let shape = shape_with(shape, Stencils::<Home, 1>::SHAPE);
        let shape = shape_with(shape, Stencils::<Arms, 2>::SHAPE);
        let shape = shape_with(shape, Stencils::<Limit, 2>::SHAPE);
        let shape = shape_with(shape, Stencils::<Sets, 2>::SHAPE);
        let shape = shape_with(shape, Stencils::<Hinges, 4>::SHAPE);
        let shape = shape_with(shape, Stencils::<Stiffening, 2>::SHAPE);
        shape_with(shape, Stencils::<Fibres, 4>::SHAPE)
    };
    const LEAST: usize = 1;

    fn save(&self, to: &mut Writer) {
        Term::save(&**self, to);
    }

    fn load(from: &mut Reader) -> Result<Self> {
        let [law] = from.take_array()?;
        Ok(match law {
            Home::SAVED_AS => memory::boxed(Stencils::<Home, 1>::load(from)?)?,
            Arms::SAVED_AS => memory::boxed(Stencils::<Arms, 2>::load(from)?)?,
            Limit::SAVED_AS => memory::boxed(Stencils::<Limit, 2>::load(from)?)?,
            Sets::SAVED_AS => memory::boxed(Stencils::<Sets, 2>::load(from)?)?,
            Hinges::SAVED_AS => memory::boxed(Stencils::<Hinges, 4>::load(from)?)?,
            Stiffening::SAVED_AS => memory::boxed(Stencils::<Stiffening, 2>::load(from)?)?,
            Fibres::SAVED_AS => memory::boxed(Stencils::<Fibres, 4>::load(from)?)?,
            _ => return Err(from.refusal("no law of terms")),
        })
    }
}

/// All terms of a body.
#[derive(Debug)]
pub(crate) struct Terms {
    laws: Vec<Box<dyn Term>>,
    /// Whether any node is held against the world.
    pub holds_any: bool,
    /// Of the springs, where they have arms.
    viscosity: Viscosity,
    kernel: ChosenKernel,
    /// Room for a number per node.
    sums: Vec<f32>,
    /// What bounds their frequencies, with that of the springs where they were given.
    rates: Rates,
    rates_known: bool,
    /// By how much terms are stiffer than that, where forces were last worked out: the bits of an `f32` from 1 on, whose order is
    /// that of the numbers.
    stiffening: AtomicU32,
    /// The same at the current state.
    settled: f32,
}

saved! { Terms { laws, holds_any, viscosity, kernel, sums, rates, rates_known, stiffening, settled } }

impl Terms {
    /// Those that a definition asks for; `springs` are its springs. `None`: it asks for none.
    pub fn new(
        kernel: ChosenKernel,
        definition: &BodyDefinition,
        springs: &[Spring],
        order: &NodeOrder,
    ) -> Result<Option<Box<Self>>> {
        let made = [
            home::new(definition, order)?,
            arms::new(definition, springs, order)?,
            limit::new(definition, springs, order)?,
            set::new(definition, springs, order)?,
            bending::new(definition, order)?,
            nonlinear::new(definition, springs, order)?,
            fibres::new(definition, order)?,
        ];
        let laws = memory::collected_within(made.len(), made.into_iter().flatten())?;
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
            holds_any: nodes.any(|node| laws.iter().any(|law| law.holds(node))),
            laws,
            sums: memory::filled(0.0, definition.positions.len())?,
            rates: Rates::ZERO,
            rates_known: false,
            stiffening: AtomicU32::new(1.0_f32.to_bits()),
            settled: 1.0,
        })?))
    }

    /// Those of each law.
    pub fn laws(&self) -> impl Iterator<Item = &dyn Term> {
        self.laws.iter().map(|law| &**law)
    }

    /// The same, to be changed.
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

    /// Adds how the forces on the nodes of a tile change with nodes at the first of `places` that go the ways of the second, N.
    pub fn add_changes(&self, tile: usize, nodes: Range<usize>, places: [View; 2], changes: &mut TileForces) {
        for law in &self.laws {
            law.add_changes(self.kernel, (tile, nodes.clone()), places, changes);
        }
    }

    /// The energy of the terms that begin in a tile, J.
    pub fn energy_of_tile(&self, tile: usize, at: &dyn Fn(usize) -> DVec3) -> f64 {
        self.laws.iter().map(|law| law.energy(tile, at)).sum()
    }

    /// The energy of all, J.
    pub fn energy(&self, at: &dyn Fn(usize) -> DVec3) -> f64 {
        (0..tile_count(self.sums.len()))
            .map(|tile| self.energy_of_tile(tile, at))
            .sum()
    }

    /// Makes room for so many nodes in all.
    pub fn reserve_nodes(&mut self, count: usize) -> Result<()> {
        let known = self.sums.len();
        memory::reserve(&mut self.sums, count)?;
        let more = count.saturating_sub(known);
        self.laws.iter_mut().try_for_each(|law| law.reserve_nodes(known, more))
    }

    /// Finds what a cut leaves, in a body of so many nodes then, and makes room for it.
    pub fn prepare_parts(&mut self, parting: &Parting, node_count: usize) -> Result<()> {
        memory::reserve(&mut self.sums, node_count)?;
        self.laws
            .iter_mut()
            .try_for_each(|law| law.prepare_parts(parting, node_count))
    }

    /// They are what a cut leaves, in a body of so many nodes.
    pub fn take_parts(&mut self, node_count: usize) {
        self.sums.resize(node_count, 0.0);
        self.laws.iter_mut().for_each(|law| law.take_parts());
        self.forget_rates();
    }

    /// Scales the terms with all nodes in a region, which must not be refused: how many.
    pub fn scale(&mut self, region: &Region, scale: Scale) -> usize {
        let count = self.laws.iter_mut().map(|law| law.scale(region, scale)).sum();
        if scale.stiffness == 0.0 && self.holds_any {
            let laws = &self.laws;
            self.holds_any = (0..self.sums.len()).any(|node| laws.iter().any(|law| law.holds(node)));
        }
        count
    }

    /// Masses, pins or springs have changed.
    pub fn forget_rates(&mut self) {
        self.rates_known = false;
    }

    /// Makes the bound on frequencies that of these masses and springs, which some terms make stiffer.
    pub fn find_rates(&mut self, springs: &dyn Springs, masses: &Masses) {
        if self.rates_known {
            return;
        }
        self.sums.fill(0.0);
        for law in &self.laws {
            if masses.are_heavier {
                law.show_carried(masses, &mut |node, stiffness| {
                    self.sums[node] += stiffness * masses.inverse(node);
                });
            } else {
                law.add_rates(masses, &mut self.sums);
            }
        }
        let mut most = Rates::ZERO;
        for (node, &sum) in self.sums.iter().enumerate() {
            let of_springs = rates_anywhere(node, springs, masses).unwrap_or(Rates::ZERO);
            most.stiffest = most.stiffest.max(sum + of_springs.stiffest);
            most.most_damped = most.most_damped.max(of_springs.most_damped);
        }
        self.rates = most;
        self.rates_known = true;
    }

    /// Adds what the nodes that are free carry.
    pub fn add_to(&self, masses: &Masses, all: &mut [Carried]) {
        for law in &self.laws {
            law.show_carried(masses, &mut |node, stiffness| all[node].add(stiffness, self.viscosity));
        }
    }

    /// Forces are about to be worked out for other positions.
    pub fn begin(&mut self) {
        *self.stiffening.get_mut() = 1.0_f32.to_bits();
    }

    /// Makes what bounds frequencies that of nodes at `positions`, which is the current state.
    pub fn settle_at(&mut self, positions: &Vectors) {
        let stiffest = self.laws.iter().map(|law| law.stiffening(positions));
        let stiffest = stiffest.fold(1.0, f64::max) as f32;
        *self.stiffening.get_mut() = stiffest.to_bits();
        self.settled = stiffest;
    }

    /// Where forces were worked out last is the current state.
    pub fn settle(&mut self) {
        self.settled = f32::from_bits(*self.stiffening.get_mut());
    }

    /// What bounds frequencies with the nodes at the current state, where `is_settled`, or where forces were last worked out.
    pub fn rates(&self, is_settled: bool) -> Rates {
        let newest = || f32::from_bits(self.stiffening.load(Ordering::Relaxed));
        let stiffening = if is_settled { self.settled } else { newest() };
        let rates = Rates {
            stiffest: self.rates.stiffest * stiffening,
            ..self.rates
        };
        if self.viscosity.is_none() {
            rates
        } else {
            self.viscosity.rates(rates)
        }
    }

    /// Nodes have come to `positions`, and what is viscous along this course.
    pub fn age(&mut self, positions: &Vectors, course: impl Fn(Viscosity) -> RelaxationStep, team: &Team) {
        let (kernel, course) = (self.kernel, course(self.viscosity));
        for law in &mut self.laws {
            law.age(kernel, positions.view(), course, team);
        }
    }
}
