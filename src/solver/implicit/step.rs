//! One substep of IMPLICIT, one solved equation: prediction, solution, and update of velocities and history.

use glam::Vec3;

use super::energy::EnergyBefore;
use super::node_kernels::{
    AddScaled, FinishMotion, PositionDefect, PredictPositions, PredictVelocities, UpdateRemainders,
};
use super::{Implicit, PreconditionerStats, SubstepOutcome};
use crate::base::{Stage, Stopwatch};
use crate::codec::saved;
use crate::soa::{Records, Vectors, WriteRecords, copy_axes, tile_count, tile_nodes};
use crate::solver::System;
use crate::solver::kick::{TileStats, tile_stats};
use crate::solver::newton::{Newton, StepProblem};
use crate::solver::step_request::StepRequest;
use crate::springs::Tangent;
use crate::threads::{Items, Team};

/// Largest ratio of a step to the last at which the second-order formula is used. The formula is stable up to 2.41.
const MAX_STEP_RATIO: f64 = 2.0;

/// Maximum number of multiplier updates of contacts per equation. After that the multipliers are fixed, so that the
/// rest is a minimization.
pub(super) const MAX_MULTIPLIER_UPDATES: u32 = 20;

/// Coefficients of the integration formula of a step.
#[derive(Clone, Copy, Debug)]
pub(super) struct StepFormula {
    /// t, s.
    pub(super) time: f64,
    /// c, the weight of the last displacement and of the last velocity change.
    pub carried: f64,
}

saved! { StepFormula { time, carried } }

impl StepFormula {
    pub(super) fn new(order: u32, step: f64, last_step: f64) -> Self {
        let ratio = if last_step > 0.0 { step / last_step } else { 0.0 };
        if order == 1 || ratio == 0.0 || ratio > MAX_STEP_RATIO {
            Self {
                time: step,
                carried: 0.0,
            }
        } else {
            let carried = ratio * ratio / (1.0 + 2.0 * ratio);
            Self {
                time: step * (1.0 + ratio) / (1.0 + 2.0 * ratio),
                carried,
            }
        }
    }
}

/// One substep with its equation.
#[derive(Clone, Copy)]
pub(super) struct Substep<'a> {
    pub request: &'a StepRequest<'a>,
    /// Length, s.
    pub step: f64,
    /// Start and end, as fractions of the requested step.
    pub start: f64,
    pub end: f64,
    pub is_first: bool,
    /// Number of equations left in the step, including this one.
    pub(super) equations: u32,
    /// True if the substep is accepted even if contacts were not predicted well.
    pub(super) is_forced: bool,
    pub(super) formula: StepFormula,
    pub team: &'a Team<'a>,
}

impl Substep<'_> {
    /// Takes the substep. If the second-order formula gains energy, the substep is repeated with first order. As a last
    /// resort, or if the budget of matrix products is used up, the gain is removed from the velocities. Then tools stop
    /// nodes that would enter them.
    pub(super) fn step_with_fallbacks(
        self,
        body: &mut System,
        implicit: &mut Implicit,
        is_last_resort: bool,
    ) -> SubstepOutcome {
        let watch = Stopwatch::start(self.request.profile);
        let before = self.energy_before(body, implicit);
        let report = implicit.report;
        let mut outcome = self.try_formula(body, implicit, before);
        if matches!(outcome, SubstepOutcome::EnergyGained | SubstepOutcome::NotFinite)
            && self.can_retry_first_order(implicit)
        {
            (implicit.report.error, implicit.report.has_converged) = (report.error, report.has_converged);
            outcome = self.first_order().try_formula(body, implicit, before);
        }
        if outcome == SubstepOutcome::EnergyGained && (is_last_resort || implicit.budget_left == 0) {
            self.slow_down(body, implicit, before);
            outcome = SubstepOutcome::Accepted;
        }
        if outcome == SubstepOutcome::Accepted {
            outcome = self.resolve_contacts(body, implicit, before, is_last_resort);
        }
        if outcome == SubstepOutcome::Accepted {
            if let Some(contacts) = &mut body.contacts {
                contacts.store_warm_starts(self.request.tools);
            }
            let next = body.state.next_positions();
            body.forces.advance(self.step, next, self.team);
            if body.forces.has_history() {
                // Forces with internal variables have dissipated stored energy.
                implicit.solution.invalidate_energy();
            }
        }
        watch.stop(self.request.profile, Stage::Solver);
        outcome
    }

    /// True if the step can be repeated with implicit Euler and was not yet. A later substep cannot, because its
    /// initial data are overwritten; then the whole step is repeated.
    pub(super) fn can_retry_first_order(&self, implicit: &Implicit) -> bool {
        self.formula.carried != 0.0 && self.is_first && implicit.budget_left > 0
    }

    /// Returns the same substep with implicit Euler.
    pub(super) fn first_order(&self) -> Self {
        Self {
            formula: StepFormula::new(1, self.step, 0.0),
            ..*self
        }
    }

    fn try_formula(&self, body: &mut System, implicit: &mut Implicit, before: EnergyBefore) -> SubstepOutcome {
        body.forces.predict(self.step);
        match self.with_predicted_contacts(body, implicit) {
            Some(substep) => substep.solve_formula(body, implicit, before),
            None => SubstepOutcome::NearContact,
        }
    }

    fn solve_formula(&self, body: &mut System, implicit: &mut Implicit, before: EnergyBefore) -> SubstepOutcome {
        if let Some(mut newton) = implicit.newton.take() {
            self.predict_velocities(body, implicit);
            self.solve_newton(body, implicit, &mut newton);
            implicit.newton = Some(newton);
        } else {
            self.prepare(body, implicit);
            self.predict_velocities(body, implicit);
            implicit.changes = std::mem::take(&mut body.forces.changes);
            let is_finite = self.minimize(body, implicit);
            body.forces.changes = std::mem::take(&mut implicit.changes);
            if !is_finite {
                return SubstepOutcome::NotFinite;
            }
        }
        if self.finish(body, implicit) {
            self.check_energy(body, implicit, before)
        } else {
            SubstepOutcome::NotFinite
        }
    }

    /// t of the formula, s.
    pub(super) fn time(&self) -> f64 {
        self.formula.time
    }

    /// c of the formula.
    pub(super) fn carried(&self) -> f64 {
        self.formula.carried
    }

    /// Tangent of the springs for this substep.
    pub(super) fn tangent(&self) -> Tangent {
        Tangent {
            floor: 0.0,
            rate: (1.0 / self.formula.time) as f32,
        }
    }

    /// Updates inertia and preconditioner for this substep.
    fn prepare(&self, body: &System, implicit: &mut Implicit) {
        /// Viscous stiffness depends on the step. The preconditioner is kept while t changes by less than this factor.
        const SIMILAR: f32 = 2.0;
        let time = self.formula.time as f32;
        let is_similar = (implicit.inertia_dt / SIMILAR..=implicit.inertia_dt * SIMILAR).contains(&time);
        implicit.is_stale |= !is_similar && body.forces.has_history();
        let positions = body.state.newest().0;
        if implicit.is_stale {
            let (forces, tangent) = (&body.forces, self.tangent());
            implicit.blocks.assemble(forces, positions, tangent, self.team);
            implicit
                .coarse
                .assemble(forces, &body.inverse_masses, &body.pins, positions, tangent);
            for pin in body.pins.partial() {
                implicit.blocks.decouple_axes(pin.node as usize, pin.axes);
            }
        }
        if time != implicit.inertia_dt || implicit.is_stale {
            let per_mass = 1.0 / (self.formula.time * self.formula.time);
            for (node, inertia) in implicit.inertia.iter_mut().enumerate() {
                let rate = body
                    .damping
                    .as_ref()
                    .map_or(0.0, |damping| f64::from(damping.rates()[node]));
                let mass = f64::from(body.masses[node]);
                let per_mass = per_mass + rate / self.formula.time;
                *inertia = if body.inverse_masses[node] > 0.0 {
                    (mass * per_mass) as f32
                } else {
                    0.0
                };
            }
            implicit.total_inertia = implicit.inertia.iter().map(|&inertia| f64::from(inertia)).sum();
            implicit.blocks.invert(&implicit.inertia, self.team);
            implicit.coarse.invert(&implicit.inertia, &body.pins);
            implicit.roundoff = implicit.blocks.roundoff(&implicit.inertia);
            implicit.inertia_dt = time;
        }
        if implicit.is_stale {
            implicit.is_stale = false;
            implicit.preconditioner_stats = PreconditionerStats::NONE;
            implicit.ritz.assume(1.0);
        }
    }

    /// Sets the velocities to their force-free prediction w and starts from s = 0. The last s would be a better start
    /// for smooth motion, but a far worse one where stiff springs rotate.
    fn predict_velocities(&self, body: &mut System, implicit: &mut Implicit) {
        let node_count = body.node_count();
        let state = body.state.substep();
        let first = self.is_first.then_some(state.first_velocities);
        let velocity_changes = &implicit.solution.last(self.is_first).velocity_changes;
        let carried = self.formula.carried as f32;
        implicit.force_displacements.clear();
        let written = (state.velocities.tiles_mut(), body.pins.tiles_mut());
        let (kernel, dt) = (body.kernel, self.request.dt);
        self.team
            .pass(tile_count(node_count), written, |tile, (mut velocities, pins)| {
                let nodes = tile_nodes(tile, node_count);
                if let Some(first) = first {
                    copy_axes(&mut velocities, first.slices(nodes.clone()));
                }
                kernel.run(AddScaled {
                    factor: carried,
                    from: velocity_changes.slices(nodes.clone()),
                    to: velocities.each_mut().map(|axis| &mut **axis),
                });
                for pin in pins {
                    let index = pin.node as usize - nodes.start;
                    pin.write_held(&mut velocities, index, pin.travel / dt);
                }
            });
    }

    /// Sets the next positions to x + y + s.
    pub(super) fn update_positions(&self, body: &mut System, implicit: &Implicit) {
        let node_count = body.node_count();
        let state = body.state.substep();
        let history = implicit.solution.last(self.is_first);
        let time = self.formula.time as f32;
        let carried = self.formula.carried as f32;
        let (positions, velocities) = (state.positions, &*state.velocities);
        let predicted = body.predicted_velocities.as_mut().map(Vectors::tiles_mut);
        let records = body.forces.records.as_mut().map(Records::tiles_mut);
        let written = (
            state.next_positions.tiles_mut(),
            predicted,
            body.pins.tiles_mut(),
            records,
        );
        let (kernel, end) = (body.kernel, self.end);
        self.team.pass(
            tile_count(node_count),
            written,
            |tile, (mut next, predicted, pins, records)| {
                let nodes = tile_nodes(tile, node_count);
                kernel.run(PredictPositions {
                    carried,
                    time,
                    positions: positions.slices(nodes.clone()),
                    velocities: velocities.slices(nodes.clone()),
                    displacements: history.displacements.slices(nodes.clone()),
                    force_displacements: implicit.force_displacements.slices(nodes.clone()),
                    remainders: history.remainders.slices(nodes.clone()),
                    next: &mut next,
                });
                if let Some(mut predicted) = predicted {
                    kernel.run(PredictVelocities {
                        time,
                        velocities: velocities.slices(nodes.clone()),
                        force_displacements: implicit.force_displacements.slices(nodes.clone()),
                        predicted: &mut predicted,
                    });
                }
                for pin in pins {
                    pin.write_held(&mut next, pin.node as usize - nodes.start, pin.position_at(end));
                }
                if let Some(records) = records {
                    let axes = next.each_ref().map(|axis| &**axis);
                    kernel.run(WriteRecords { axes, records });
                }
            },
        );
    }

    /// Writes the rounding errors of the next positions, relative to x + y + s, to the search direction.
    pub(super) fn find_position_defects(&self, body: &System, implicit: &mut Implicit) {
        let node_count = body.node_count();
        let (positions, velocities) = body.state.newest();
        let next = body.state.next_positions();
        let (history, force_displacements) = (implicit.solution.last(self.is_first), &implicit.force_displacements);
        let time = self.formula.time as f32;
        let carried = self.formula.carried as f32;
        let records = implicit.changes.records.as_mut().map(Records::tiles_mut);
        let written = (implicit.search_directions.tiles_mut(), records);
        let kernel = body.kernel;
        self.team
            .pass(tile_count(node_count), written, |tile, (mut defects, records)| {
                let nodes = tile_nodes(tile, node_count);
                kernel.run(PositionDefect {
                    carried,
                    time,
                    positions: positions.slices(nodes.clone()),
                    velocities: velocities.slices(nodes.clone()),
                    displacements: history.displacements.slices(nodes.clone()),
                    force_displacements: force_displacements.slices(nodes.clone()),
                    remainders: history.remainders.slices(nodes.clone()),
                    next: next.slices(nodes.clone()),
                    defects: &mut defects,
                });
                for pin in body.pins.of_tile(tile) {
                    pin.write_held(&mut defects, pin.node as usize - nodes.start, Vec3::ZERO);
                }
                if let Some(records) = records {
                    let axes = defects.each_ref().map(|axis| &**axis);
                    kernel.run(WriteRecords { axes, records });
                }
            });
    }

    /// Product budget of this equation: an equal share of the remaining budget, at least 1.
    pub(super) fn budget(&self, implicit: &Implicit) -> u32 {
        (implicit.budget_left / self.equations).max(1)
    }

    /// Solves the equation with NEWTON to its full accuracy.
    fn solve_newton(&self, body: &mut System, implicit: &mut Implicit, newton: &mut Newton) {
        /// Allowed constraint error of contacts, relative to their contribution.
        const CONTACTS: f64 = 1e-4;
        for multipliers in 0..=MAX_MULTIPLIER_UPDATES {
            self.solve_newton_once(body, implicit, newton);
            let Some(contacts) = &mut body.contacts else {
                break;
            };
            let displacement = |node: usize| implicit.force_displacements.get(node).as_dvec3();
            if multipliers == MAX_MULTIPLIER_UPDATES || contacts.multipliers.multiplier_error(displacement) <= CONTACTS
            {
                break;
            }
            contacts.multipliers.update_multipliers(displacement, |_, _| ());
        }
    }

    /// Solves the equation with NEWTON for fixed multipliers of contacts.
    fn solve_newton_once(&self, body: &mut System, implicit: &mut Implicit, newton: &mut Newton) {
        let (from, to) = (
            implicit.solution.history_index(self.is_first),
            1 - implicit.solution.current_index,
        );
        let problem = StepProblem {
            time: self.formula.time,
            carried: self.formula.carried,
            gravity: self.request.gravity,
            end: self.end,
            displacements: &implicit.solution.last(self.is_first).displacements,
            contact_forces: implicit.solution.next().active_contact_forces(),
            from,
            to,
            budget: self.budget(implicit),
            accuracy: f64::from(implicit.accuracy),
            tolerance: f64::from(self.request.tolerance),
        };
        let result = newton.solve(body, &problem, &mut implicit.force_displacements);
        implicit.budget_left = implicit.budget_left.saturating_sub(result.products);
        let report = &mut implicit.report;
        report.iterations += result.products;
        report.solves += result.iterations;
        report.error = report.error.max(result.error as f32);
        report.has_converged &= result.converged;
    }

    /// Computes velocities and history from the solution. Returns true if all values are finite.
    fn finish(&self, body: &mut System, implicit: &mut Implicit) -> bool {
        implicit.last_formula = self.formula;
        implicit.solution.substep_duration = self.step as f32;
        let node_count = body.node_count();
        let rotation = self.angular_momentum_correction(body, implicit);
        let (kernel, dt, duration_fraction) = (body.kernel, self.request.dt, (self.end - self.start) as f32);
        let time = self.formula.time as f32;
        let carried = self.formula.carried as f32;
        let [current, next] = implicit.solution.current_and_next();
        let from = self.is_first.then_some(&*current);
        next.step = self.step as f32;
        let state = body.state.substep();
        let (starts, positions) = (state.positions, &*state.next_positions);
        let force_displacements = &implicit.force_displacements;
        let is_exact = implicit.newton.is_some();
        let before = self.is_first.then_some(state.first_velocities);
        let written = (
            state.velocities.tiles_mut(),
            next.displacements.tiles_mut(),
            next.velocity_changes.tiles_mut(),
            (!is_exact).then(|| next.remainders.tiles_mut()),
            body.pins.tiles_mut(),
            Items::new(&mut body.tile_stats),
        );
        self.team.pass(
            tile_count(node_count),
            written,
            |tile, (mut velocities, mut displacements, mut velocity_changes, remainders, pins, survey)| {
                let nodes = tile_nodes(tile, node_count);
                if let Some(from) = from {
                    copy_axes(&mut displacements, from.displacements.slices(nodes.clone()));
                    copy_axes(&mut velocity_changes, from.velocity_changes.slices(nodes.clone()));
                }
                kernel.run(FinishMotion {
                    carried,
                    time,
                    force_displacements: force_displacements.slices(nodes.clone()),
                    before: before.map(|before| before.slices(nodes.clone())),
                    velocities: &mut velocities,
                    displacements: &mut displacements,
                    velocity_changes: &mut velocity_changes,
                });
                if let Some(rotation) = &rotation {
                    rotation.add(positions.slices(nodes.clone()), &mut velocities, &mut velocity_changes);
                }
                if let Some(mut remainders) = remainders {
                    if let Some(from) = from {
                        copy_axes(&mut remainders, from.remainders.slices(nodes.clone()));
                    }
                    kernel.run(UpdateRemainders {
                        displacements: displacements.each_ref().map(|axis| &**axis),
                        starts: starts.slices(nodes.clone()),
                        ends: positions.slices(nodes.clone()),
                        remainders: &mut remainders,
                    });
                    for pin in &*pins {
                        pin.write_held(&mut remainders, pin.node as usize - nodes.start, Vec3::ZERO);
                    }
                }
                for pin in pins {
                    let index = pin.node as usize - nodes.start;
                    pin.write_held(&mut velocities, index, pin.travel / dt);
                    pin.write_held(&mut displacements, index, pin.travel * duration_fraction);
                    pin.write_held(&mut velocity_changes, index, Vec3::ZERO);
                }
                let velocities = velocities.map(|axis| &*axis);
                *survey = tile_stats(kernel, velocities, Some(positions.slices(nodes)));
            },
        );
        body.tile_stats
            .iter()
            .copied()
            .fold(TileStats::EMPTY, TileStats::merge)
            .finite
    }
}
