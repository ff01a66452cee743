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
use crate::elements::Elements;
use crate::enclosed::Enclosed;
use crate::soa::Vectors;
use crate::springs::Springs;
use crate::terms::Terms;
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

saved!(Newton {
    descent,
    remainders,
    growths
});

impl Newton {
    /// For a body as it is.
    pub fn new(
        node_count: usize,
        springs: &dyn Springs,
        elements: Option<&Elements>,
        beside: (Option<&Terms>, Option<&Enclosed>),
    ) -> Result<Self> {
        Ok(Self {
            descent: Descent::new(node_count, springs, elements, beside)?,
            remainders: [Vectors::zeros(node_count)?, Vectors::zeros(node_count)?],
            growths: memory::filled(0.0, elements.map_or(0, |elements| elements.ring_count_of(node_count)))?,
        })
    }

    /// The same for the nodes that these springs have now, with room for so many springs more; positions keep what they lack.
    pub fn roomier(
        &self,
        springs: &dyn Springs,
        more: usize,
        elements: Option<&Elements>,
        beside: (Option<&Terms>, Option<&Enclosed>),
    ) -> Result<Self> {
        let mut roomier = Self::new(springs.node_count(), springs, elements, beside)?;
        roomier.make_room(springs.spring_count() + more)?;
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

    /// The energy of springs, elements, terms and cavities, J, with nodes at these positions and what they lack; and the work that a
    /// constant pressure has done.
    pub fn elastic(
        &mut self,
        springs: &dyn Springs,
        elements: Option<&Elements>,
        (terms, enclosed): (Option<&Terms>, Option<&Enclosed>),
        positions: &Vectors,
        place: usize,
    ) -> [f64; 2] {
        let exact = |node: usize| exact(positions.get(node), self.remainders[place].get(node));
        let mut sum = 0.0;
        for node in 0..positions.len() {
            let position = exact(node);
            springs.visit(node, &mut |link| {
                let neighbour = link.neighbour as usize;
                if neighbour < node {
                    let stretch = position.distance(exact(neighbour)) - f64::from(link.rest_length);
                    sum += 0.5 * f64::from(link.stiffness) * stretch * stretch;
                }
            });
        }
        if let Some(elements) = elements {
            let remainders = &self.remainders[place];
            let position = |node: usize| step::exact(positions.get(node), remainders.get(node));
            sum += elements.exact_energy(position, &mut self.growths);
        }
        if let Some(terms) = terms {
            let remainders = &self.remainders[place];
            sum += terms.energy(&|node| step::exact(positions.get(node), remainders.get(node)));
        }
        let mut work = 0.0;
        if let Some(enclosed) = enclosed {
            let remainders = &self.remainders[place];
            let [stored, done] = enclosed.energy(&|node| step::exact(positions.get(node), remainders.get(node)));
            sum += stored;
            work = done;
        }
        [sum, work]
    }

    /// What the next step depends on.
    pub fn hash(&self, place: usize, hasher: &mut StateHasher) {
        for vector in self.remainders[place].iter() {
            hasher.write_floats(&vector.to_array());
        }
    }
}
