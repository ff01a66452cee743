//! How much energy a body may have: what was put in, and what its integrator can be shown to add.
//!
//! **VERLET.** With velocities at the time of the positions, a substep h changes the kinetic energy by exactly
//! `(F0 + F1)/2 . dx + h²/8 (Q1 - Q0)`, Q being the sum of `F²/m` over the free nodes and dx straight. So the shadow
//! energy `E - h²/8 Q` changes by the work of pins and forces from outside, and by
//!
//! `T = sum over the springs of (U1 - U0) + (F0 + F1)/2 . dx`,
//!
//! the error of the trapezoidal rule for the work of the springs along dx. Of a spring's energy `k/2 (L² - 2 L0 L + L0²)`
//! the first part is quadratic in the positions and leaves no error; what is left is `-k L0 L` as the spring *turns*: at
//! most `k L0 |dx|/2` times the change of the cosine between spring and dx, of third order in h, and nothing in a
//! linear body. This is all that undamped leapfrog can gain while h is stable, in any arithmetic. It is not small where
//! springs are pressed: they push sideways, `k (1 - L0/L)`, without bound as nodes pass through each other.
//!
//! The ledger adds up T in `f64` over every substep, and demands `E <= E0 - h²/8 Q0 + work + sum of T + h²/8 Q`. The
//! spring forces of a stable substep satisfy `h²/8 Q <= c U`, `c < 1` (c = (h omega)²/4), so that this bounds the energy
//! itself: without work and turning by `E0 / (1 - (h omega)²/4)`. Both are checked at the end of every step, the second at
//! the state as it is, which makes it a check of the library's limit too. Damping of nodes only takes: to first order in
//! `s = gamma h / m` its share of the change is `-(2 - (h omega)²/2) s m v²`.
//!
//! **IMPLICIT, NEWTON.** Implicit Euler gives nothing where the springs are convex; BDF2 begun with it holds
//! `|y_n|² + |2 y_n - y_(n-1)|²` (G-stability, Dahlquist 1978), which begins with at most `2 |y_0|²`: the energy is at
//! most twice what was put in.
//!
//! What `f32` rounds away adds up as a random walk of steps of 2^-23 of the energies that nearly cancel.

use glam::{DVec3, Vec3};
use sinew::{Body, Solver, StepReport};

use super::setup::{Stop, at_most};
use crate::support::reference::Reference;

/// What happened to a body from outside in a step.
#[derive(Clone, Debug, Default)]
pub struct Done {
    /// Pinned nodes, and where each was led, m.
    pub moves: Vec<(usize, Vec3)>,
    /// Nodes, and the force on each, N.
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
    /// What was put in, less `term`, J.
    shadow: f64,
    /// h²/8 Q at the end of the last step, J.
    term: f64,
    /// The forces and the elastic energy at the model's positions.
    forces: Vec<DVec3>,
    elastic: f64,
    /// The positive work from outside, J.
    worked: f64,
    turned: f64,
    substeps: f64,
    /// The energies that nearly cancel, J.
    cancelling: f64,
    /// The highest (h omega)²/4 that a state showed.
    steepest: f64,
    /// The highest energy, J.
    highest: f64,
}

impl Ledger {
    pub fn new(solver: Solver, model: Reference, first: State) -> Self {
        Self {
            solver,
            model,
            shadow: first.energy(),
            highest: first.kinetic + first.elastic,
            first,
            term: 0.0,
            forces: Vec::new(),
            elastic: 0.0,
            worked: 0.0,
            turned: 0.0,
            substeps: 0.0,
            cancelling: 0.0,
            steepest: 0.0,
        }
    }

    /// Begins anew with what is there now.
    pub fn restart(&mut self, now: State) {
        *self = Self::new(self.solver, self.model.clone(), now);
    }

    /// Begins a step of VERLET that is taken in substeps of this length.
    pub fn begin_step(&mut self, before: &State, done: &Done, substep: f64) {
        self.model.positions.clone_from(&before.positions);
        self.model.applied.fill(DVec3::ZERO);
        for &(node, force) in &done.pushes {
            self.model.applied[node] += force.as_dvec3();
        }
        self.forces = self.model.forces();
        self.elastic = self.model.elastic();
        self.shadow += self.term - self.term_of(substep);
    }

    /// Takes in a substep that led to these positions.
    pub fn take_substep(&mut self, positions: &[Vec3]) {
        let from: Vec<DVec3> = self.model.positions.clone();
        for (to, position) in self.model.positions.iter_mut().zip(positions) {
            *to = position.as_dvec3();
        }
        let (forces, elastic) = (self.model.forces(), self.model.elastic());
        let mut turned = elastic - self.elastic;
        for (node, from) in from.iter().enumerate() {
            let spring_forces = 0.5 * (self.forces[node] + forces[node]) - self.model.applied[node];
            turned += spring_forces.dot(self.model.positions[node] - *from);
        }
        self.turned += turned;
        self.shadow += turned;
        (self.forces, self.elastic) = (forces, elastic);
    }

    /// Whether the step led to no more energy than it may.
    pub fn end_step(
        &mut self,
        body: &Body,
        before: &State,
        after: &State,
        done: &Done,
        dt: f32,
        report: &StepReport,
    ) -> Result<(), Stop> {
        let way = |node: usize| after.positions[node] - before.positions[node];
        let force = |node: usize| body.pin_force(node as u32).expect("a pin").as_dvec3();
        let led = done.moves.iter().map(|&(node, _)| force(node).dot(way(node)));
        let pushed = done.pushes.iter().map(|&(node, force)| force.as_dvec3().dot(way(node)));
        let work: f64 = led.chain(pushed).sum();
        self.highest = self.highest.max(after.kinetic + after.elastic);
        self.substeps += f64::from(report.substeps.max(1));
        let cancelling = after.kinetic + after.gravitational.abs() + work.abs() + self.stretchable(after);
        self.cancelling = self.cancelling.max(cancelling);
        let rounding = self.cancelling * self.substeps.sqrt() * 2.0_f64.powi(-23);
        if self.solver != Solver::Verlet {
            self.worked += work.max(0.0);
            let fallen = self.first.gravitational - after.gravitational;
            let put_in = self.first.kinetic + self.first.elastic + self.worked + fallen;
            return at_most("energy, J", after.kinetic + after.elastic, 2.0 * put_in + rounding);
        }
        let substep = f64::from(dt) / f64::from(report.substeps);
        self.shadow += work;
        self.model.positions.clone_from(&after.positions);
        self.term = self.term_of(substep);
        at_most("energy, J", after.energy(), self.shadow + self.term + rounding)?;
        // With springs alone, whatever acts from outside.
        self.model.applied.fill(DVec3::ZERO);
        let gravity = std::mem::take(&mut self.model.gravity);
        let springs = self.term_of(substep);
        self.model.gravity = gravity;
        if springs > rounding {
            self.steepest = self.steepest.max(springs / after.elastic);
        }
        at_most(
            "(h omega)²/4 times elastic energy, J",
            springs,
            after.elastic + rounding,
        )
    }

    /// What came of it, in figures.
    pub fn figures(&self) -> String {
        let first = self.first.kinetic + self.first.elastic;
        let mut figures = format!("E {:.2e} to {:.2e} J", first, self.highest);
        if self.solver == Solver::Verlet {
            figures += &format!(", turning {:.1e}, (h omega)²/4 {:.2}", self.turned, self.steepest);
        }
        figures
    }

    /// What the springs' energies are the small differences of, J: those of lengths that nearly cancel, and of positions
    /// that are known as well as their distance from the origin allows.
    fn stretchable(&self, state: &State) -> f64 {
        let sum = |sum, &([a, b], stiffness, rest_length): &([u32; 2], f64, f64)| {
            let length = state.positions[a as usize].distance(state.positions[b as usize]);
            let reach = [a, b].map(|node| state.positions[node as usize].abs().max_element());
            sum + stiffness * (length + rest_length) * (length + rest_length + reach[0].max(reach[1]))
        };
        self.model.springs.iter().fold(0.0, sum)
    }

    /// h²/8 Q, Q being the sum of F²/m.
    fn term_of(&self, substep: f64) -> f64 {
        let accelerations = self.model.accelerations();
        let squares = accelerations.iter().zip(&self.model.masses);
        substep * substep / 8.0 * squares.map(|(a, mass)| mass * a.length_squared()).sum::<f64>()
    }
}
