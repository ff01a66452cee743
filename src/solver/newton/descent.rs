//! Newton's method downhill: second derivatives, a line search, and inertia that holds the nodes back where the function is far
//! from what its derivatives promise, and fades where it is not.

use glam::DVec3;

use super::equation::{Equation, Tangent};
use super::factor;
use super::gradient::{Gradient, dot, longest};
use super::matrix::Matrix;
use super::network::Network;
use crate::base::{Result, memory};
use crate::codec::saved;
use crate::forces::Forces;

/// What may be missing of the solution of each linearised equation.
const PART: f64 = 0.01;

/// The part of what the slope promises that a way must bring (Armijo 1966).
const ENOUGH: f64 = 1e-4;

/// Where a way brings more than this part of what was promised, the function bends less than the matrix says: it is worth
/// going on.
const MORE: f64 = 1.3;

/// What rounding makes of a sum, as a part of its terms.
const ROUNDING: f64 = 1e-13;

/// Everything a descent needs, made beforehand.
#[derive(Debug)]
pub(super) struct Descent {
    pub network: Network,
    pub equation: Equation,
    /// What acts on each node, held ones too, N.
    pub residuals: Vec<DVec3>,
    pub gradient: Gradient,
    matrix: Matrix,
    factor: Matrix,
}

saved! { Descent { network, equation, residuals, gradient, matrix, factor } }

/// When a descent is done.
#[derive(Clone, Copy, Debug)]
pub(super) struct Goal {
    /// Corrections as short as this need none after them, m.
    pub absolute: f64,
    /// Or as short as this part of the longest way.
    pub relative: f64,
    /// Corrections as short as this that become no shorter are what rounding makes, m.
    pub rounding: f64,
    /// The most linearised equations, and products in all.
    pub iterations: u32,
    pub budget: u32,
    /// Inertia that is added at first, at least, and as soon as it is needed, 1/s².
    pub shift: f64,
    pub least_shift: f64,
    pub next_shift: f64,
}

/// How a descent ended.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::solver) struct DescentReport {
    pub iterations: u32,
    pub products: u32,
    /// The longest way of the last correction, m.
    pub error: f64,
    pub converged: bool,
}

impl Descent {
    /// Of a body that these forces move.
    pub fn new(forces: &Forces) -> Result<Self> {
        let node_count = forces.springs.node_count();
        let network = Network::new(forces)?;
        let pair_count = network.pair_count();
        Ok(Self {
            equation: Equation::new(node_count, network.ring_count(), network.member_count())?,
            residuals: memory::filled(DVec3::ZERO, node_count)?,
            gradient: Gradient::new(node_count, network.ring_count())?,
            matrix: Matrix::new(node_count, pair_count)?,
            factor: Matrix::new(node_count, pair_count)?,
            network,
        })
    }

    /// Makes room for so many springs in all.
    pub fn make_room(&mut self, spring_count: usize) -> Result<()> {
        let pair_count = self.network.make_room(spring_count)?;
        self.matrix.make_room(pair_count)?;
        self.factor.make_room(pair_count)
    }

    /// Writes what acts on each node.
    pub fn weigh(&mut self) {
        self.equation.residuals(&self.network, &mut self.residuals);
    }

    /// Goes down until the goal is reached.
    pub fn run(&mut self, goal: &Goal) -> DescentReport {
        let mut found = DescentReport {
            error: f64::INFINITY,
            ..DescentReport::default()
        };
        let mut shift = goal.shift;
        let mut vain = 0;
        let mut farthest = 0.0_f64;
        while found.iterations < goal.iterations && found.products < goal.budget {
            found.iterations += 1;
            self.weigh();
            if self.correct(Tangent::Exact, shift, goal, &mut found) {
                // First along the direction that bends down, then by a matrix that has none.
                let length = longest(&self.gradient.corrections);
                self.slide(if found.error.is_finite() { found.error } else { length });
                self.weigh();
                self.correct(Tangent::Clamped, shift, goal, &mut found);
            }
            let promised = dot(&self.residuals, &self.gradient.corrections);
            let size = longest(&self.gradient.corrections);
            if !(promised > 0.0 && size.is_finite()) {
                // Nothing is left to be corrected, or nothing can be said.
                found.converged = size == 0.0;
                found.error = size;
                break;
            }
            self.equation.holds.let_go();
            let (gone, gain) = self.go(promised);
            let used = shift;
            farthest = farthest.max(longest(&self.equation.ways));
            if gain > 0.75 && gone >= 1.0 {
                shift *= 0.1;
            } else if gain < 0.25 || gone < 0.5 {
                shift = (4.0 * shift).max(goal.next_shift);
            }
            if shift < goal.least_shift.max(1e-3 * goal.next_shift) {
                shift = goal.least_shift;
            }
            vain = if gone > 0.0 && size < 0.5 * found.error {
                0
            } else {
                vain + 1
            };
            found.error = size * gone.max(1.0);
            let held_back = shift.min(used) * self.inertia_of_correction();
            let is_short = found.error <= goal.absolute.max(goal.relative * farthest);
            // So short, what the function changes by is rounding too, and may lead nowhere.
            let is_nothing = size <= goal.absolute;
            let is_noise = size <= goal.rounding && vain >= 3;
            if (is_short && gone >= 1.0 || is_nothing || is_noise) && held_back <= 0.1 * promised {
                found.converged = true;
                break;
            }
        }
        found
    }

    /// Finds a direction in which the function bends down, where it is level, and goes some way along it: whether there is
    /// one.
    pub fn leave_saddle(&mut self, shift: f64, length: f64, found: &mut DescentReport, budget: u32) -> bool {
        self.equation
            .assemble(&self.network, Tangent::Factor, shift, &mut self.factor);
        factor::factorise(&mut self.factor, &self.network);
        self.equation
            .assemble(&self.network, Tangent::Exact, shift, &mut self.matrix);
        let equation = &self.equation;
        // Numbers that look random, so that no direction is at right angles to them.
        let mut seed = 1_u64;
        let mut number = || {
            seed = seed
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) as f64 / f64::from(1_u32 << 30) - 1.0
        };
        let right = |node: usize| {
            let vector = DVec3::new(number(), number(), number());
            equation.free_part(node, vector)
        };
        let solved = self.gradient.solve(
            &self.network,
            equation,
            [&self.matrix, &self.factor],
            right,
            1e-3,
            budget,
        );
        found.products += solved.products;
        if !solved.is_negative {
            return false;
        }
        self.slide(length)
    }

    /// Goes along the direction that was found to bend down, `length` m at first, and on as long as the function falls; whether it
    /// did.
    fn slide(&mut self, length: f64) -> bool {
        let searches = &self.gradient.searches;
        let change = |part: f64| self.equation.change(&self.network, searches, part)[0];
        let first = length / longest(searches);
        let mut part = if change(first) <= change(-first) { first } else { -first };
        let mut lowest = change(part);
        for _ in 0..30 {
            let is_falling = lowest < 0.0;
            let next = if is_falling { 2.0 * part } else { 0.5 * part };
            let change = change(next);
            if is_falling && !(change < lowest) {
                break;
            }
            (part, lowest) = (next, change);
        }
        if !(lowest < 0.0) {
            return false;
        }
        for (way, search) in self.equation.ways.iter_mut().zip(searches) {
            *way += *search * part;
        }
        true
    }

    /// Solves the linearised equation; whether its matrix was found indefinite.
    fn correct(&mut self, tangent: Tangent, shift: f64, goal: &Goal, found: &mut DescentReport) -> bool {
        self.equation.press();
        self.equation
            .assemble(&self.network, Tangent::Factor, shift, &mut self.factor);
        factor::factorise(&mut self.factor, &self.network);
        self.equation.assemble(&self.network, tangent, shift, &mut self.matrix);
        let (equation, residuals) = (&self.equation, &self.residuals);
        let right = |node: usize| equation.free_part(node, residuals[node]);
        let budget = goal.budget.saturating_sub(found.products);
        let solved = self.gradient.solve(
            &self.network,
            equation,
            [&self.matrix, &self.factor],
            right,
            PART,
            budget,
        );
        found.products += solved.products;
        solved.is_negative
    }

    /// Goes along the correction as far as the function falls enough: what part of it, and what that brought as a part of what
    /// was promised.
    fn go(&mut self, promised: f64) -> (f64, f64) {
        let corrections = &self.gradient.corrections;
        let mut part = 1.0;
        for _ in 0..50 {
            let [change, terms] = self.equation.change(&self.network, corrections, part);
            let is_noise = change.abs() <= ROUNDING * terms;
            if change <= -ENOUGH * part * promised || is_noise {
                let gain = if is_noise {
                    1.0
                } else {
                    -change / (part * (1.0 - 0.5 * part) * promised)
                };
                if gain > MORE && part == 1.0 {
                    part = self.go_on(change);
                }
                for (way, correction) in self.equation.ways.iter_mut().zip(corrections) {
                    *way += *correction * part;
                }
                return (part, gain);
            }
            // Where a parabola through what is known is lowest.
            let lowest = 0.5 * part * promised / (promised + change / part);
            part = if lowest.is_finite() {
                lowest.clamp(0.1 * part, 0.5 * part)
            } else {
                0.1 * part
            };
        }
        (0.0, 0.0)
    }

    /// How far along the correction the function goes on falling, in powers of two.
    fn go_on(&self, change: f64) -> f64 {
        let (mut part, mut lowest) = (1.0, change);
        for _ in 0..30 {
            let [change, _] = self
                .equation
                .change(&self.network, &self.gradient.corrections, 2.0 * part);
            if !(change < lowest) {
                break;
            }
            (part, lowest) = (2.0 * part, change);
        }
        part
    }

    fn inertia_of_correction(&self) -> f64 {
        let corrections = self.gradient.corrections.iter().zip(&self.equation.masses);
        corrections
            .map(|(correction, mass)| mass * correction.length_squared())
            .sum()
    }
}
