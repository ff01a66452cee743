//! NEWTON: solves the equations of IMPLICIT in `f64` to near rounding accuracy, and finds static equilibria.
//!
//! A step minimizes a function of all displacements (`equation.rs`). IMPLICIT minimizes the same function to about one
//! percent. The minimization (`descent.rs`) is Newton's method with all second derivatives. Its linear solver is a
//! conjugate gradient with an incomplete Cholesky factor (`conjugate_gradient.rs`, `incomplete_cholesky.rs`). It
//! converges when a correction is short in meters, not when a residual is small. A static equilibrium minimizes the
//! function without inertia.
//!
//! Positions are rounded to `f32` at the end of a step. The remainders are stored for the next step.

mod conjugate_gradient;
mod descent;
mod equation;
mod incomplete_cholesky;
mod matrix;
mod rest_state;
mod sparsity;
mod step;

pub(crate) use rest_state::rest_state;
pub use rest_state::{RestStateDefinition, RestStateReport};
pub(super) use step::StepProblem;

use crate::base::{Result, StateHasher, memory};
use crate::codec::saved;
use crate::forces::Forces;
use crate::soa::Vectors;
use descent::Descent;
use step::exact_position;

/// Data that NEWTON needs beside those of IMPLICIT.
#[derive(Debug)]
pub(crate) struct Newton {
    descent: Descent,
    /// Exact minus stored positions, m: of the current state and of the step in progress.
    remainders: [Vectors; 2],
    /// Scratch space for the energy of elements.
    volume_changes: Vec<f64>,
}

saved! { Newton { descent, remainders, volume_changes } }

impl Newton {
    /// Creates the solver for a body with these forces.
    pub fn new(forces: &Forces) -> Result<Self> {
        let node_count = forces.springs.node_count();
        Ok(Self {
            descent: Descent::new(forces)?,
            remainders: [Vectors::zeros(node_count)?, Vectors::zeros(node_count)?],
            volume_changes: memory::filled(0.0, forces.ring_count())?,
        })
    }

    /// Creates a solver for the current nodes of these forces, with capacity for `more` springs. It copies the
    /// remainders.
    pub fn enlarged(&self, forces: &Forces, more: usize) -> Result<Self> {
        let mut enlarged = Self::new(forces)?;
        enlarged.reserve(forces.springs.spring_count() + more)?;
        for (vectors, before) in enlarged.remainders.iter_mut().zip(&self.remainders) {
            for (node, vector) in before.iter().enumerate() {
                vectors.set(node, vector);
            }
        }
        Ok(enlarged)
    }

    /// Copies the remainder of `source` to a new node.
    pub fn copy_remainder(&mut self, slot: usize, source: usize, node: usize) {
        let remainders = &mut self.remainders[slot];
        remainders.set(node, remainders.get(source));
    }

    /// Reserves capacity for this number of springs, so that a step does not allocate.
    pub fn reserve(&mut self, spring_count: usize) -> Result<()> {
        self.descent.reserve(spring_count)
    }

    /// Clears the remainders: the stored positions are exact.
    pub fn forget_remainders(&mut self, slot: usize) {
        self.remainders[slot].clear();
    }

    /// Returns the stored energy at these positions plus remainders, and the work of constant pressures, J.
    pub fn elastic(&mut self, forces: &Forces, positions: &Vectors, slot: usize) -> [f64; 2] {
        let remainders = &self.remainders[slot];
        let position = |node: usize| exact_position(positions.get(node), remainders.get(node));
        forces.exact_energy(position, &mut self.volume_changes)
    }

    /// Hashes the data that the next step depends on.
    pub fn hash(&self, slot: usize, hasher: &mut StateHasher) {
        hasher.write_vectors(self.remainders[slot].iter());
    }
}
