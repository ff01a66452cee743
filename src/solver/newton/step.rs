//! A step of NEWTON: sets up the equation from the body and writes the solution back.

use glam::{DVec3, Vec3};

use super::Newton;
use super::descent::{DescentGoal, DescentReport};
use crate::soa::Vectors;
use crate::solver::System;

/// Maximum number of linear solves per step.
const ITERATIONS: u32 = 300;

/// Rounding errors of a position, in `f64` and when stored in `f32`, as fractions of the body's extent.
const ROUNDING: f64 = 1e-12;
const STORAGE_ROUNDING: f64 = 6e-8;

/// Input of a step whose velocities are at their force-free prediction.
pub(in crate::solver) struct StepProblem<'a> {
    /// t, s.
    pub time: f64,
    /// c, the weight of the last displacements.
    pub carried: f64,
    pub gravity: Vec3,
    /// End of the substep, as a fraction of the requested step.
    pub end: f64,
    /// Displacement of each node in the last step, m.
    pub displacements: &'a Vectors,
    /// Contact forces by other tissue, N.
    pub contact_forces: Option<&'a Vectors>,
    /// Indices of the remainders for the current and for the next positions.
    pub from: usize,
    pub to: usize,
    pub budget: u32,
    pub accuracy: f64,
    /// Allowed error of positions, m; 0: none.
    pub tolerance: f64,
}

impl Newton {
    /// Solves the equation, starting from these force displacements. Writes the positions at the end of the step and
    /// the final force displacements.
    pub(in crate::solver) fn solve(
        &mut self,
        body: &mut System,
        problem: &StepProblem,
        force_displacements: &mut Vectors,
    ) -> DescentReport {
        self.descent.sparsity.update(&body.forces);
        self.descent.sparsity.non_spring = std::mem::take(&mut body.forces.auxiliary);
        self.set_up(body, problem, force_displacements);
        self.descent.equation.pins = std::mem::take(&mut body.pins);
        if let Some(contacts) = &mut body.contacts {
            self.descent.equation.multipliers = std::mem::take(&mut contacts.multipliers);
        }
        let extent = self.descent.equation.extent();
        let rate = 1.0 / problem.time;
        let report = self.descent.run(&DescentGoal {
            absolute: (ROUNDING * extent).max(0.1 * problem.tolerance),
            relative: problem.accuracy,
            rounding: STORAGE_ROUNDING * extent,
            iterations: ITERATIONS,
            budget: problem.budget,
            shift: 0.0,
            least_shift: 0.0,
            next_shift: rate * rate,
        });
        self.descent.update_residuals();
        self.descent.equation.update_contacts();
        body.forces.auxiliary = std::mem::take(&mut self.descent.sparsity.non_spring);
        body.pins = std::mem::take(&mut self.descent.equation.pins);
        if let Some(contacts) = &mut body.contacts {
            contacts.multipliers = std::mem::take(&mut self.descent.equation.multipliers);
        }
        self.write_back(body, problem, force_displacements);
        report
    }

    fn set_up(&mut self, body: &mut System, problem: &StepProblem, force_displacements: &Vectors) {
        let equation = &mut self.descent.equation;
        let rate = 1.0 / problem.time;
        let gravity = problem.gravity.as_dvec3();
        let applied = body.applied.as_ref().filter(|_| body.forces_applied);
        let dampings = body.damping.as_ref().map(|damping| damping.rates());
        let state = body.state.substep();
        equation.rate = if body.forces.springs.damped() { rate } else { 0.0 };
        for node in 0..body.masses.len() {
            let velocity = state.velocities.get(node).as_dvec3();
            let mass = f64::from(body.masses[node]);
            equation.predicted_velocities[node] = velocity;
            equation.loads[node] = gravity * mass;
            equation.displacements[node] = DVec3::ZERO;
            equation.masses[node] = 0.0;
            equation.inertia[node] = 0.0;
            if body.inverse_masses[node] == 0.0 {
                continue;
            }
            let damping = dampings.map_or(0.0, |rates| f64::from(rates[node])) * mass;
            let position = state.positions.get(node);
            let start = exact_position(position, self.remainders[problem.from].get(node));
            equation.predicted_positions[node] =
                start + problem.displacements.get(node).as_dvec3() * problem.carried + velocity * problem.time;
            equation.displacements[node] = force_displacements.get(node).as_dvec3();
            equation.masses[node] = mass;
            equation.inertia[node] = (mass * rate + damping) * rate;
            equation.loads[node] -= velocity * damping;
            for applied in applied.into_iter().chain(problem.contact_forces) {
                equation.loads[node] += applied.get(node).as_dvec3();
            }
        }
        for pin in body.pins.iter() {
            let node = pin.node as usize;
            equation.predicted_positions[node] = DVec3::select(
                pin.axes,
                pin.position_at(problem.end).as_dvec3(),
                equation.predicted_positions[node],
            );
            // Pin reactions exclude damping along held axes.
            let weight = gravity * f64::from(body.masses[node]);
            equation.loads[node] = DVec3::select(pin.axes, weight, equation.loads[node]);
        }
    }

    fn write_back(&mut self, body: &mut System, problem: &StepProblem, force_displacements: &mut Vectors) {
        let equation = &self.descent.equation;
        let next_positions = body.state.substep().next_positions;
        let remainders = &mut self.remainders[problem.to];
        for node in 0..next_positions.len() {
            let exact = equation.position(node);
            let position = exact.as_vec3();
            next_positions.set(node, position);
            remainders.set(node, (exact - position.as_dvec3()).as_vec3());
            force_displacements.set(node, equation.displacements[node].as_vec3());
        }
        for pin in body.pins.iter_mut() {
            pin.reaction = -self.descent.residuals[pin.node as usize].as_vec3();
        }
    }
}

/// Returns a position plus its remainder. If the position was changed since, the remainder is ignored.
pub(super) fn exact_position(position: Vec3, remainder: Vec3) -> DVec3 {
    let exact = position.as_dvec3() + remainder.as_dvec3();
    if exact.as_vec3() == position {
        exact
    } else {
        position.as_dvec3()
    }
}
