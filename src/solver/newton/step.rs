//! A step of NEWTON: the equation made of the body, and the state made of its solution.

use glam::{DVec3, Vec3};

use super::Newton;
use super::descent::{DescentReport, Goal};
use crate::soa::Vectors;
use crate::solver::System;

/// Linearised equations solved in a step at most.
const ITERATIONS: u32 = 300;

/// What rounding in `f64` may make of a position, and what storing it in `f32` does, as parts of the body's extent.
const ROUNDING: f64 = 1e-12;
const STORED: f64 = 6e-8;

/// A step whose velocities are where they would be without forces.
pub(in crate::solver) struct Aimed<'a> {
    /// t, s.
    pub time: f64,
    /// c: the part of the last ways that goes on.
    pub carried: f64,
    pub gravity: Vec3,
    /// Where the substep ends, as a fraction of the step asked for.
    pub end: f64,
    /// How far each node went in the last step.
    pub ways: &'a Vectors,
    /// What other tissue presses with, N.
    pub pressed: Option<&'a Vectors>,
    /// Which remainders belong to the positions now, and to those at the end.
    pub from: usize,
    pub to: usize,
    pub budget: u32,
    pub accuracy: f64,
    /// m; 0: none.
    pub tolerance: f64,
}

impl Newton {
    /// Solves the step's equation, from these pushes on; leaves the positions at its end and the pushes that lead
    /// there.
    pub(in crate::solver) fn solve(&mut self, body: &mut System, aimed: &Aimed, pushes: &mut Vectors) -> DescentReport {
        self.descent.network.read(&body.forces);
        self.descent.network.beside = std::mem::take(&mut body.forces.beside);
        self.set_up(body, aimed, pushes);
        self.descent.equation.pins = std::mem::take(&mut body.pins);
        if let Some(contacts) = &mut body.contacts {
            self.descent.equation.holds = std::mem::take(&mut contacts.holds);
        }
        let extent = self.descent.equation.extent();
        let rate = 1.0 / aimed.time;
        let found = self.descent.run(&Goal {
            absolute: (ROUNDING * extent).max(0.1 * aimed.tolerance),
            relative: aimed.accuracy,
            rounding: STORED * extent,
            iterations: ITERATIONS,
            budget: aimed.budget,
            shift: 0.0,
            least_shift: 0.0,
            next_shift: rate * rate,
        });
        self.descent.weigh();
        self.descent.equation.press();
        body.forces.beside = std::mem::take(&mut self.descent.network.beside);
        body.pins = std::mem::take(&mut self.descent.equation.pins);
        if let Some(contacts) = &mut body.contacts {
            contacts.holds = std::mem::take(&mut self.descent.equation.holds);
        }
        self.take_over(body, aimed, pushes);
        found
    }

    fn set_up(&mut self, body: &mut System, aimed: &Aimed, pushes: &Vectors) {
        let equation = &mut self.descent.equation;
        let rate = 1.0 / aimed.time;
        let gravity = aimed.gravity.as_dvec3();
        let applied = body.applied.as_ref().filter(|_| body.forces_applied);
        let dampings = body.damping.as_ref().map(|damping| damping.rates());
        let state = body.state.substep();
        equation.rate = if body.forces.springs.damped() { rate } else { 0.0 };
        for node in 0..body.masses.len() {
            let velocity = state.velocities.get(node).as_dvec3();
            let mass = f64::from(body.masses[node]);
            equation.drifts[node] = velocity;
            equation.loads[node] = gravity * mass;
            equation.ways[node] = DVec3::ZERO;
            equation.masses[node] = 0.0;
            equation.inertia[node] = 0.0;
            if body.inverse_masses[node] == 0.0 {
                continue;
            }
            let damping = dampings.map_or(0.0, |rates| f64::from(rates[node])) * mass;
            let position = state.positions.get(node);
            let exact = exact(position, self.remainders[aimed.from].get(node));
            equation.anchors[node] = exact + aimed.ways.get(node).as_dvec3() * aimed.carried + velocity * aimed.time;
            equation.ways[node] = pushes.get(node).as_dvec3();
            equation.masses[node] = mass;
            equation.inertia[node] = (mass * rate + damping) * rate;
            equation.loads[node] -= velocity * damping;
            for applied in applied.into_iter().chain(aimed.pressed) {
                equation.loads[node] += applied.get(node).as_dvec3();
            }
        }
        for pin in body.pins.iter() {
            let node = pin.node as usize;
            equation.anchors[node] = DVec3::select(pin.axes, pin.place(aimed.end).as_dvec3(), equation.anchors[node]);
            // What holds it is told without what damping does along these axes.
            let weight = gravity * f64::from(body.masses[node]);
            equation.loads[node] = DVec3::select(pin.axes, weight, equation.loads[node]);
        }
    }

    fn take_over(&mut self, body: &mut System, aimed: &Aimed, pushes: &mut Vectors) {
        let equation = &self.descent.equation;
        let next_positions = body.state.substep().next_positions;
        let remainders = &mut self.remainders[aimed.to];
        for node in 0..next_positions.len() {
            let exact = equation.position(node);
            let position = exact.as_vec3();
            next_positions.set(node, position);
            remainders.set(node, (exact - position.as_dvec3()).as_vec3());
            pushes.set(node, equation.ways[node].as_vec3());
        }
        for pin in body.pins.iter_mut() {
            pin.solved = -self.descent.residuals[pin.node as usize].as_vec3();
        }
    }
}

/// A position with what it lacks, unless it has been put elsewhere since.
pub(super) fn exact(position: Vec3, remainder: Vec3) -> DVec3 {
    let exact = position.as_dvec3() + remainder.as_dvec3();
    if exact.as_vec3() == position {
        exact
    } else {
        position.as_dvec3()
    }
}
