//! IMPLICIT: solves one nonlinear equation per step and is stable at any step length.
//!
//! A step of length h advances the positions x and velocities v: `v1 = w + t a(x1, v1)` and `x1 = x + y + s`, with
//! `s = t² a`. Implicit Euler (order 1) has t = h, w = v and y = h v. The second backward difference formula (order 2;
//! Curtiss, Hirschfelder 1952) uses the step before, of length h', and q = h/h':
//! `t = h (1 + q)/(1 + 2q)`, `w = v + c (v - v')`, `y = c (x - x') + t w`, `c = q²/(1 + 2q)`.
//! Both solve `M s / t² = f(x + y + s)`. They differ only in y, w and t.
//!
//! The unknown is s, the displacement that forces cause in the step, not the position. The velocity is w + s/t, so no
//! small quantity is computed as a difference of large ones.

mod blocks;
mod coarse_space;
mod conjugate_gradient;
mod contact;
mod contact_forces;
mod energy;
mod error_bound;
mod iterations;
mod node_kernels;
mod rigid_modes;
mod solution;
mod step;
mod subdivision;

pub(crate) use solution::Solution;

use crate::base::{Result, StateHasher, memory};
use crate::codec::{Saved, Writer, saved};
use crate::contact::Contacts;
use crate::def::{BodyDefinition, MAX_ITERATIONS, Solver, SolverReport};
use crate::forces::{ForceChanges, Forces};
use crate::geometry::Aabb;
use crate::soa::{PerNode, Vectors, tile_count};
use crate::solver::System;
use crate::solver::changed::Cached;
use crate::solver::integrator::{CoupledBody, CoupledStep, IMPLICIT, Integrator};
use crate::solver::newton::Newton;
use crate::solver::step_request::{StepRequest, StepStart};
use crate::solver::substep_count::StepPlan;
use crate::solver::verlet::{Stepped, SubstepTooLong, begin};
use crate::threads::Team;
use blocks::{Blocks, RoundoffBound};
use coarse_space::CoarseSpace;
use conjugate_gradient::PartialSums;
use contact_forces::ContactForces;
use error_bound::RitzBounds;
use solution::History;
use step::StepFormula;
use subdivision::{contact_substeps, solve_substep};

/// From this many substeps on, an energy gain is removed from the velocities instead of subdividing the step further.
const DAMP_FROM_SUBSTEPS: u32 = 256;

/// Rounding error of a coordinate, as a fraction of the body's extent.
const ROUNDING: f64 = 1e-7;

/// Result of a substep.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum SubstepOutcome {
    Accepted,
    /// The energy grew by more than the external work.
    EnergyGained,
    /// A tool is so near that the step needs shorter substeps.
    NearContact,
    NotFinite,
}

/// Statistics of the preconditioner from previous steps.
#[derive(Clone, Copy, Debug, PartialEq)]
struct PreconditionerStats {
    /// Smallest eigenvalue of the preconditioned matrix.
    smallest: f64,
    /// Products of the first solve with the current preconditioner.
    initial_products: u32,
    /// True if the preconditioner has degraded so far that it must be rebuilt.
    is_worn: bool,
}

saved! { PreconditionerStats { smallest, initial_products, is_worn } }

/// Data that an implicitly integrated body needs beside its state.
#[derive(Debug)]
pub(crate) struct Implicit {
    /// Order of the formula, 1 or 2.
    order: u32,
    /// Maximum number of matrix-vector products per requested equation, and the number left for the step in progress.
    budget: u32,
    budget_left: u32,
    /// Limit of products for the step in progress, set by the caller of the step.
    work_limit: u32,
    /// Relative error allowed in the solution of a step.
    accuracy: f32,
    solution: Solution,
    /// Formula of the last solved equation.
    last_formula: StepFormula,
    /// s, the displacement that forces cause in the step, m.
    force_displacements: Vectors,
    /// Mean velocities over the substep, for contact with tools, m/s.
    mean_velocities: Option<Vectors>,
    // The fields from here to `ritz` have no nodes if the solver is NEWTON.
    /// Correction of s from one linear solve, m.
    corrections: Vectors,
    residuals: Vectors,
    search_directions: Vectors,
    /// Scratch data for force differences, borrowed from the body during a solve.
    changes: ForceChanges,
    /// The matrix times the search direction, and the preconditioned residual.
    products: Vectors,
    preconditioned: Vectors,
    /// M / t² and damping per node, N/m. It is 0 for a pinned node.
    inertia: Vec<f32>,
    /// Sum of `inertia`.
    total_inertia: f64,
    /// Roundoff bound for coordinate errors of 1 m.
    roundoff: RoundoffBound,
    /// The t for which `inertia` was computed, s. It is 0 if `inertia` is out of date.
    inertia_dt: f32,
    blocks: Blocks,
    coarse: CoarseSpace,
    /// Nodes in contact with tools, and their regular values of the coarse functions.
    stiffened_nodes: Vec<(u32, [f32; 4])>,
    /// Loads on the clusters from each tile.
    loads: Vec<f32>,
    tile_sums: Vec<PartialSums>,
    ritz: RitzBounds,
    /// True if the preconditioner is out of date and must be rebuilt before use.
    is_stale: bool,
    /// `is_stale` before the step in progress.
    was_stale: bool,
    /// Statistics of the step in progress, and of the current state.
    preconditioner_stats: PreconditionerStats,
    committed_stats: PreconditionerStats,
    /// The NEWTON solver, if the body uses it.
    newton: Option<Box<Newton>>,
    /// A NEWTON solver with capacity for a pending cut.
    newton_after_cut: Option<Box<Newton>>,
    /// Report of the step in progress, and of the last committed step.
    report: SolverReport,
    last_report: SolverReport,
}

saved! { Implicit {
    order, budget, budget_left, accuracy, solution, last_formula, force_displacements, mean_velocities, corrections,
    residuals, search_directions, products, preconditioned, inertia, total_inertia, roundoff, inertia_dt, blocks,
    coarse, stiffened_nodes, loads, tile_sums, ritz, is_stale, was_stale, preconditioner_stats, committed_stats, newton, report,
    last_report } leaves { work_limit: u32::MAX, changes: ForceChanges::default(), newton_after_cut: None,
} where Self::has_valid_budget }

impl PreconditionerStats {
    const NONE: Self = Self {
        smallest: 1.0,
        initial_products: 0,
        is_worn: false,
    };
}

impl Implicit {
    /// True if the iteration limit is one that a definition may have.
    fn has_valid_budget(&self) -> bool {
        self.budget <= MAX_ITERATIONS
    }

    /// Creates the solver for nodes at these positions. A definition value of 0 selects the default.
    pub fn new(definition: &BodyDefinition, positions: &Vectors, forces: &mut Forces) -> Result<Self> {
        let node_count = positions.len();
        let is_exact = definition.solver == Solver::Newton;
        let (accuracy, budget) = if is_exact {
            // Tight, but far above rounding. The budget suffices for bodies of a million nodes.
            (1e-6, 100_000)
        } else {
            // A fraction of the discretization error of a useful step. The budget exceeds what any interactive body
            // needs.
            (0.01, 1000)
        };
        let no_nodes = Vectors::zeros(0)?;
        let solved = if is_exact { &no_nodes } else { positions };
        let newton = is_exact.then(|| memory::boxed(Newton::new(forces)?)).transpose()?;
        if !is_exact {
            forces.make_room_for_changes()?;
        }
        let solved_count = solved.len();
        let vectors = || Vectors::zeros(solved_count);
        let coarse = CoarseSpace::new(solved)?;
        let or = |given: u32, default| if given == 0 { default } else { given };
        let given = definition.accuracy;
        Ok(Self {
            order: or(definition.order, 2),
            budget: or(definition.iterations, budget),
            budget_left: 0,
            work_limit: u32::MAX,
            accuracy: if given > 0.0 { given } else { accuracy },
            solution: Solution::new(node_count, solved_count)?,
            last_formula: StepFormula::new(1, 0.0, 0.0),
            force_displacements: Vectors::zeros(node_count)?,
            mean_velocities: None,
            corrections: vectors()?,
            residuals: vectors()?,
            search_directions: vectors()?,
            changes: ForceChanges::default(),
            products: vectors()?,
            preconditioned: vectors()?,
            inertia: memory::filled(0.0, solved_count)?,
            total_inertia: 0.0,
            roundoff: RoundoffBound::default(),
            inertia_dt: 0.0,
            blocks: Blocks::new(solved_count)?,
            loads: memory::filled(0.0, coarse.size() * tile_count(solved_count))?,
            coarse,
            stiffened_nodes: Vec::new(),
            tile_sums: memory::filled(PartialSums::default(), tile_count(solved_count))?,
            ritz: RitzBounds::new(solved_count)?,
            is_stale: true,
            was_stale: true,
            preconditioner_stats: PreconditionerStats::NONE,
            committed_stats: PreconditionerStats::NONE,
            newton,
            newton_after_cut: None,
            report: SolverReport::BEFORE,
            last_report: SolverReport::default(),
        })
    }

    /// Returns all arrays with one entry per node. NEWTON has only histories, force displacements and mean velocities.
    fn per_node_mut(&mut self) -> impl Iterator<Item = &mut dyn PerNode> {
        let is_exact = self.newton.is_some();
        let all: [&mut dyn PerNode; 10] = [
            &mut self.force_displacements,
            &mut self.mean_velocities,
            &mut self.corrections,
            &mut self.residuals,
            &mut self.search_directions,
            &mut self.products,
            &mut self.preconditioned,
            &mut self.inertia,
            &mut self.blocks,
            &mut self.coarse,
        ];
        let histories = self.solution.histories.iter_mut();
        let histories = histories.flat_map(move |history| history.vectors_mut(is_exact));
        let histories = histories.map(|vectors| vectors as &mut dyn PerNode);
        histories.chain(all.into_iter().take(if is_exact { 2 } else { 10 }))
    }

    /// Restarts the step from the current state.
    fn restart(&mut self) {
        (self.report.error, self.report.has_converged) = (0.0, true);
        self.preconditioner_stats = self.committed_stats;
        self.ritz.assume(self.committed_stats.smallest);
    }

    /// Returns the roundoff bound for a body of this extent, m.
    fn roundoff(&self, extent: f32) -> RoundoffBound {
        let square = (ROUNDING * f64::from(extent)).powi(2);
        RoundoffBound {
            error: square * self.roundoff.error,
            residual_sq: square * self.roundoff.residual_sq,
            energy: square * self.roundoff.energy,
        }
    }

    /// Records the number of products of a solve and detects a degraded preconditioner.
    fn record_products(&mut self, products: u32) {
        let initial = &mut self.preconditioner_stats.initial_products;
        if *initial == 0 {
            *initial = products;
        } else if products > 2 * *initial + 8 {
            self.preconditioner_stats.is_worn = true;
        }
    }
}

impl Integrator for Implicit {
    fn step(&mut self, body: &mut System, request: &StepRequest, restart: Option<StepStart>, team: &Team) -> Stepped {
        self.work_limit = request.work;
        let start = restart.unwrap_or_else(|| StepStart::new(body.carry, request.substeps.max(1)));
        self.run(body, request, start, team)
    }

    fn plan_step(&mut self, body: &mut System, request: &StepRequest, _team: &Team) -> StepPlan {
        StepPlan {
            start: body.carry,
            substeps: contact_substeps(request.dt).max(request.substeps),
            scaling_substep: 0.0,
        }
    }

    fn begin(&mut self, body: &mut System, _walk: &mut CoupledBody, step: &CoupledStep) -> Stepped<()> {
        begin(body, &step.request.for_body(body));
        self.report = SolverReport::BEFORE;
        self.work_limit = step.request.work;
        self.budget_left = self.budget.min(self.work_limit);
        self.reserve_budget(step.substeps);
        self.restart();
        Ok(())
    }

    fn substep(&mut self, body: &mut System, _walk: &mut CoupledBody, step: &CoupledStep, index: u32) -> Stepped<()> {
        let request = &step.request.for_body(body);
        // The step may have no more substeps to try.
        let is_last_resort = step.is_last || step.substeps >= DAMP_FROM_SUBSTEPS;
        let index_and_count = [index, step.substeps];
        match solve_substep(body, self, request, index_and_count, [is_last_resort, false], step.team) {
            SubstepOutcome::Accepted => Ok(()),
            _ => Err(SubstepTooLong {
                stable_substep: 0.25 * step.substep(),
            }),
        }
    }

    fn end(&mut self, body: &mut System, _walk: &mut CoupledBody, _step: &CoupledStep, _given: Aabb) -> Stepped<()> {
        self.solution.restart_after_deflection();
        body.state.advance();
        Ok(())
    }

    fn solution(&self) -> Option<&Solution> {
        Some(&self.solution)
    }

    fn solution_mut(&mut self) -> Option<&mut Solution> {
        Some(&mut self.solution)
    }

    fn rollback(&mut self) {
        self.is_stale = self.was_stale;
    }

    fn commit(&mut self) {
        self.solution.current_index = 1 - self.solution.current_index;
        self.last_report = self.report;
        self.committed_stats = self.preconditioner_stats;
        self.committed_stats.smallest = self.ritz.last_smallest();
        self.is_stale |= self.committed_stats.is_worn;
        self.was_stale = self.is_stale;
    }

    fn forget(&mut self, cached: Cached) {
        let history = self.solution.current_mut();
        match cached {
            Cached::Energy | Cached::EquationEnergy => history.energy = None,
            Cached::Preconditioner => (self.is_stale, self.was_stale) = (true, true),
            Cached::History => {
                (history.step, history.energy) = (0.0, None);
                history.remainders.clear();
                history.contact_forces.iter_mut().for_each(ContactForces::forget);
                if let Some(newton) = &mut self.newton {
                    newton.forget_remainders(self.solution.current_index);
                }
            }
            _ => {}
        }
    }

    fn last_report(&self) -> SolverReport {
        self.last_report
    }

    fn hash(&self, hasher: &mut StateHasher) {
        let history = self.solution.current();
        let History {
            displacements,
            velocity_changes,
            remainders,
            step,
            energy,
            credit,
            contact_credit,
            contact_forces: _,
        } = history;
        for vectors in [displacements, velocity_changes, remainders] {
            hasher.write_vectors(vectors.iter());
        }
        hasher.write_floats(&[*step, self.accuracy]);
        let [energy, magnitude] = energy.map_or([f64::NAN; 2], |total| [total.energy, total.magnitude]);
        hasher.write_doubles(&[energy, magnitude, *credit, *contact_credit]);
        hasher.write_vectors(history.active_contact_forces().into_iter().flat_map(Vectors::iter));
        hasher.write_u64(u64::from(self.order) << 32 | u64::from(self.budget));
        if let Some(newton) = &self.newton {
            newton.hash(self.solution.current_index, hasher);
        }
        hasher.write_u64(u64::from(self.is_stale));
        if !self.is_stale {
            hasher.write_u64(self.committed_stats.smallest.to_bits());
            hasher.write_u64(u64::from(self.committed_stats.initial_products));
            self.blocks.hash(hasher);
            self.coarse.hash(hasher);
        }
    }

    fn save(&self, to: &mut Writer) {
        to.write(&[IMPLICIT]);
        Saved::save(self, to);
    }

    fn reserve_springs(&mut self, count: usize) -> Result<()> {
        self.newton.as_mut().map_or(Ok(()), |newton| newton.reserve(count))
    }

    fn reserve_contacts(&mut self, contacts: &mut Contacts) -> Result<()> {
        let count = contacts.reserve_holds()?;
        if self.mean_velocities.is_none() {
            self.mean_velocities = Some(Vectors::zeros(self.force_displacements.len())?);
        }
        // A contact acts on up to four nodes.
        let nodes = (4 * count).min(self.inertia.len());
        Ok(self.stiffened_nodes.try_reserve(nodes)?)
    }

    fn prepare_cut(&mut self, forces: &Forces, more: usize) -> Result<()> {
        let enlarge = |newton: &Newton| memory::boxed(newton.enlarged(forces, more)?);
        self.newton_after_cut = self.newton.as_deref().map(enlarge).transpose()?;
        Ok(())
    }

    fn copy_motion(&mut self, source: usize, node: usize) {
        let history = self.solution.current_mut();
        for vectors in [
            &mut history.displacements,
            &mut history.velocity_changes,
            &mut history.remainders,
        ] {
            if node < vectors.len() {
                vectors.set(node, vectors.get(source));
            }
        }
        if let Some(newton) = &mut self.newton {
            newton.copy_remainder(self.solution.current_index, source, node);
        }
    }
}

impl PerNode for Implicit {
    fn reserve_nodes(&mut self, count: usize) -> Result<()> {
        self.per_node_mut().try_for_each(|it| it.reserve_nodes(count))?;
        if self.newton.is_some() {
            return Ok(());
        }
        self.ritz.reserve(count)?;
        memory::reserve(&mut self.loads, self.coarse.size() * tile_count(count))?;
        memory::reserve(&mut self.tile_sums, tile_count(count))
    }

    fn grow(&mut self, count: usize) {
        if let Some(newton_after_cut) = self.newton_after_cut.take() {
            self.newton = Some(newton_after_cut);
        }
        self.per_node_mut().for_each(|it| it.grow(count));
        self.inertia_dt = 0.0;
        if self.newton.is_some() {
            return;
        }
        self.loads.resize(self.coarse.size() * tile_count(count), 0.0);
        self.tile_sums.resize(tile_count(count), PartialSums::default());
    }
}
