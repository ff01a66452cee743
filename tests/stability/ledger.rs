//! The upper bound of a body's energy: the energy put in, plus the provable gain of its integrator.
//!
//! **VERLET.** With velocities at the time of the positions, a substep h changes the kinetic energy by exactly
//! `(F0 + F1)/2 . dx + h²/8 (Q1 - Q0)`, with Q the sum of `F²/m` over the free nodes and dx straight. So the shadow
//! energy `E - h²/8 Q` changes by the work of pins and external forces, and by
//!
//! `T = sum over the springs of (U1 - U0) + (F0 + F1)/2 . dx`,
//!
//! the error of the trapezoidal rule for the work of the springs along dx. A spring's energy is
//! `k/2 (L² - 2 L0 L + L0²)`. The first part is quadratic in the positions and has no error. The error comes from
//! `-k L0 L` as the spring *rotates*: at most `k L0 |dx|/2` times the change of the cosine between spring and dx, of
//! third order in h, and zero in a linear body. This is all that undamped leapfrog can gain while h is stable, in any
//! arithmetic. It is not small for compressed springs: their transverse stiffness `k (1 - L0/L)` is unbounded as nodes
//! pass through each other.
//!
//! The ledger adds up T in `f64` over every substep, and demands `E <= E0 - h²/8 Q0 + work + sum of T + h²/8 Q`. The
//! spring forces of a stable substep satisfy `h²/8 Q <= c U`, `c < 1` (c = (h omega)²/4), so that this bounds the
//! energy itself: without work and rotation by `E0 / (1 - (h omega)²/4)`. Both are checked at the end of every step.
//! The second check uses the current state, so it also checks the library's limit. Nodal damping only dissipates: to
//! first order in `s = gamma h / m` it changes the energy by `-(2 - (h omega)²/2) s m v²`.
//!
//! **IMPLICIT, NEWTON.** Implicit Euler adds no energy where the springs are convex. BDF2, started with an Euler step,
//! conserves `|y_n|² + |2 y_n - y_(n-1)|²` (G-stability, Dahlquist 1978), at most `2 |y_0|²` initially: the energy is
//! at most twice the energy put in.
//!
//! The rounding of `f32` adds up as a random walk with steps of 2^-23 of the energies that nearly cancel.

use glam::{DVec3, Vec3};
use sinew::{Body, Solver, StepReport};

use super::setup::{Stop, at_most};
use crate::support::reference::Reference;

/// External actions on a body in a step.
#[derive(Clone, Debug, Default)]
pub struct ExternalActions {
    /// Moved pins and their targets (m).
    pub moves: Vec<(usize, Vec3)>,
    /// Nodes, and the force on each (N).
    pub pushes: Vec<(usize, Vec3)>,
}

/// The state of a body at the end of a step.
#[derive(Clone, Debug)]
pub struct State {
    pub positions: Vec<DVec3>,
    pub velocities: Vec<DVec3>,
    pub kinetic: f64,
    pub elastic: f64,
    pub gravitational: f64,
}

impl State {
    pub fn of(body: &Body, gravity: Vec3) -> Self {
        let energy = body.energy(gravity);
        Self {
            positions: body.positions().iter().map(|p| p.as_dvec3()).collect(),
            velocities: body.velocities().iter().map(|v| v.as_dvec3()).collect(),
            kinetic: energy.kinetic,
            elastic: energy.elastic,
            gravitational: energy.gravitational,
        }
    }

    pub fn energy(&self) -> f64 {
        self.kinetic + self.elastic + self.gravitational
    }

    pub fn is_finite(&self) -> bool {
        self.energy().is_finite()
            && self.positions.iter().all(|p| p.is_finite())
            && self.velocities.iter().all(|v| v.is_finite())
    }
}

#[derive(Clone, Debug)]
pub struct Ledger {
    solver: Solver,
    /// The body in `f64`; pinned nodes have no mass.
    pub model: Reference,
    first: State,
    /// The energy put in, minus `term` (J).
    shadow: f64,
    /// h²/8 Q at the end of the last step (J).
    term: f64,
    /// The forces and the elastic energy at the model's positions.
    forces: Vec<DVec3>,
    elastic: f64,
    /// The positive external work (J).
    work: f64,
    rotation_terms: f64,
    substeps: f64,
    /// The energies that nearly cancel (J).
    cancelling: f64,
    /// The largest (h omega)²/4 of any state.
    largest_stability_ratio: f64,
    /// The largest energy (J).
    largest_energy: f64,
}

impl Ledger {
    pub fn new(solver: Solver, model: Reference, first: State) -> Self {
        Self {
            solver,
            model,
            shadow: first.energy(),
            largest_energy: first.kinetic + first.elastic,
            first,
            term: 0.0,
            forces: Vec::new(),
            elastic: 0.0,
            work: 0.0,
            rotation_terms: 0.0,
            substeps: 0.0,
            cancelling: 0.0,
            largest_stability_ratio: 0.0,
        }
    }

    /// Restarts with the current energy.
    pub fn restart(&mut self, now: State) {
        *self = Self::new(self.solver, self.model.clone(), now);
    }

    /// Begins a step of VERLET in substeps of this length.
    pub fn begin_step(&mut self, before: &State, done: &ExternalActions, substep: f64) {
        self.model.positions.clone_from(&before.positions);
        self.model.applied.fill(DVec3::ZERO);
        for &(node, force) in &done.pushes {
            self.model.applied[node] += force.as_dvec3();
        }
        self.forces = self.model.forces();
        self.elastic = self.model.elastic();
        self.shadow += self.term - self.shadow_term(substep);
    }

    /// Adds a substep that led to these positions.
    pub fn take_substep(&mut self, positions: &[Vec3]) {
        let from: Vec<DVec3> = self.model.positions.clone();
        for (to, position) in self.model.positions.iter_mut().zip(positions) {
            *to = position.as_dvec3();
        }
        let (forces, elastic) = (self.model.forces(), self.model.elastic());
        let mut rotation_terms = elastic - self.elastic;
        for (node, from) in from.iter().enumerate() {
            let spring_forces = 0.5 * (self.forces[node] + forces[node]) - self.model.applied[node];
            rotation_terms += spring_forces.dot(self.model.positions[node] - *from);
        }
        self.rotation_terms += rotation_terms;
        self.shadow += rotation_terms;
        (self.forces, self.elastic) = (forces, elastic);
    }

    /// Checks that the step led to no more energy than allowed.
    pub fn end_step(
        &mut self,
        body: &Body,
        before: &State,
        after: &State,
        done: &ExternalActions,
        dt: f32,
        report: &StepReport,
    ) -> Result<(), Stop> {
        let displacement = |node: usize| after.positions[node] - before.positions[node];
        let force = |node: usize| body.pin_force(node as u32).expect("a pin").as_dvec3();
        let led = done.moves.iter().map(|&(node, _)| force(node).dot(displacement(node)));
        let pushed = done
            .pushes
            .iter()
            .map(|&(node, force)| force.as_dvec3().dot(displacement(node)));
        let work: f64 = led.chain(pushed).sum();
        self.largest_energy = self.largest_energy.max(after.kinetic + after.elastic);
        self.substeps += f64::from(report.substeps.max(1));
        let cancelling = after.kinetic + after.gravitational.abs() + work.abs() + self.cancelling_energies(after);
        self.cancelling = self.cancelling.max(cancelling);
        let rounding = self.cancelling * self.substeps.sqrt() * 2.0_f64.powi(-23);
        if self.solver != Solver::Verlet {
            self.work += work.max(0.0);
            let fallen = self.first.gravitational - after.gravitational;
            let put_in = self.first.kinetic + self.first.elastic + self.work + fallen;
            return at_most("energy, J", after.kinetic + after.elastic, 2.0 * put_in + rounding);
        }
        let substep = f64::from(dt) / f64::from(report.substeps);
        self.shadow += work;
        self.model.positions.clone_from(&after.positions);
        self.term = self.shadow_term(substep);
        at_most("energy, J", after.energy(), self.shadow + self.term + rounding)?;
        // With springs alone, whatever the external forces.
        self.model.applied.fill(DVec3::ZERO);
        let gravity = std::mem::take(&mut self.model.gravity);
        let springs = self.shadow_term(substep);
        self.model.gravity = gravity;
        if springs > rounding {
            self.largest_stability_ratio = self.largest_stability_ratio.max(springs / after.elastic);
        }
        at_most(
            "(h omega)²/4 times elastic energy, J",
            springs,
            after.elastic + rounding,
        )
    }

    /// Returns the results as figures.
    pub fn figures(&self) -> String {
        let first = self.first.kinetic + self.first.elastic;
        let mut figures = format!("E {:.2e} to {:.2e} J", first, self.largest_energy);
        if self.solver == Solver::Verlet {
            figures += &format!(
                ", turning {:.1e}, (h omega)²/4 {:.2}",
                self.rotation_terms, self.largest_stability_ratio
            );
        }
        figures
    }

    /// Returns the energies whose small differences are the spring energies (J): those of lengths that nearly cancel,
    /// and of positions rounded by their distance from the origin.
    fn cancelling_energies(&self, state: &State) -> f64 {
        let sum = |sum, &([a, b], stiffness, rest_length): &([u32; 2], f64, f64)| {
            let length = state.positions[a as usize].distance(state.positions[b as usize]);
            let reach = [a, b].map(|node| state.positions[node as usize].abs().max_element());
            sum + stiffness * (length + rest_length) * (length + rest_length + reach[0].max(reach[1]))
        };
        self.model.springs.iter().fold(0.0, sum)
    }

    /// Returns h²/8 Q, with Q the sum of F²/m.
    fn shadow_term(&self, substep: f64) -> f64 {
        let accelerations = self.model.accelerations();
        let squares = accelerations.iter().zip(&self.model.masses);
        substep * substep / 8.0 * squares.map(|(a, mass)| mass * a.length_squared()).sum::<f64>()
    }
}
