//! NEWTON: the equations of IMPLICIT, solved to the last digits that count, in `f64`; and states of rest.
//!
//! A step is where a function of all ways is smallest (`equation.rs`): what a step of IMPLICIT is too, up to the hundredth part
//! that it leaves. It is found downhill (`descent.rs`) by Newton's method with all second derivatives, by conjugate gradients with
//! an incomplete factor of the matrix (`gradient.rs`, `factor.rs`), and is done when a correction is short in metres, not when
//! a residual is small. A state of rest is where the function without inertia is smallest.
//!
//! What rounds positions to `f32` at the end of a step is kept and belongs to the next.

mod descent;
mod equation;
mod factor;
mod gradient;
mod matrix;
mod network;
mod rest;
mod step;

pub(crate) use rest::rest_state;
pub use rest::{RestStateDefinition, RestStateReport};
pub(super) use step::Aimed;

use crate::base::{Result, StateHasher, memory};
use crate::codec::saved;
use crate::forces::Forces;
use crate::soa::Vectors;
use descent::Descent;
use step::exact;

/// What a body that is moved by NEWTON has beside what IMPLICIT needs.
#[derive(Debug)]
pub(crate) struct Newton {
    descent: Descent,
    /// What positions lack to be those that were found, m: of the current state and of the step in progress.
    remainders: [Vectors; 2],
    /// For the energy of elements.
    growths: Vec<f64>,
}

saved! { Newton { descent, remainders, growths } }

impl Newton {
    /// For a body that these forces move.
    pub fn new(forces: &Forces) -> Result<Self> {
        let node_count = forces.springs.node_count();
        Ok(Self {
            descent: Descent::new(forces)?,
            remainders: [Vectors::zeros(node_count)?, Vectors::zeros(node_count)?],
            growths: memory::filled(0.0, forces.ring_count())?,
        })
    }

    /// The same for the nodes that these forces have now, with room for so many springs more; positions keep what they lack.
    pub fn roomier(&self, forces: &Forces, more: usize) -> Result<Self> {
        let mut roomier = Self::new(forces)?;
        roomier.make_room(forces.springs.spring_count() + more)?;
        for (vectors, before) in roomier.remainders.iter_mut().zip(&self.remainders) {
            for (node, vector) in before.iter().enumerate() {
                vectors.set(node, vector);
            }
        }
        Ok(roomier)
    }

    /// A new node lacks what another does.
    pub fn copy_remainder(&mut self, place: usize, source: usize, node: usize) {
        let remainders = &mut self.remainders[place];
        remainders.set(node, remainders.get(source));
    }

    /// Makes room for so many springs in all, so that a step needs no memory.
    pub fn make_room(&mut self, spring_count: usize) -> Result<()> {
        self.descent.make_room(spring_count)
    }

    /// Positions are exactly what they are.
    pub fn forget_remainders(&mut self, place: usize) {
        self.remainders[place].clear();
    }

    /// The energy of these forces, J, with nodes at these positions and what they lack; and the work that a constant pressure has done.
    pub fn elastic(&mut self, forces: &Forces, positions: &Vectors, place: usize) -> [f64; 2] {
        let remainders = &self.remainders[place];
        let at = |node: usize| exact(positions.get(node), remainders.get(node));
        forces.exact_energy(at, &mut self.growths)
    }

    /// What the next step depends on.
    pub fn hash(&self, place: usize, hasher: &mut StateHasher) {
        hasher.write_vectors(self.remainders[place].iter());
    }
}
