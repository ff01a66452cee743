//! Steps with a work budget or a time limit.
//!
//! A unit of work is one substep of every VERLET body, or one matrix-vector product of every IMPLICIT or NEWTON body:
//! about one pass over all springs and elements. If the budget does not cover the explicit substeps of the whole step,
//! the step simulates a shorter time and carries the rest to the next step. An implicit equation is solved as far as
//! the budget allows; its residual acts as a force in the next step. Such a step has all guarantees of an ordinary one:
//! contact, energy and finiteness.
//!
//! The clock decides only how much work a step may do. With the same work the result is the same on any machine.

use std::time::Instant;

use super::World;
use crate::base::{Error, Result, StepReport, above_zero, check_clock, ensure};

/// How often a step is retried over a shorter time because its motion needs shorter substeps than foreseen.
const TRIES: u32 = 16;

/// The fraction of the longest stable substep that is planned for.
const USED: f64 = 0.79;

/// The work of the first step with a time limit, and the largest factor from one step to the next.
const FIRST_WORK: u32 = 8;
const GROWTH: u32 = 4;

/// The fraction of the time limit that is planned for.
const PLANNED: f64 = 0.7;

/// The pace is the second slowest of this many steps, so that one step delayed by other programs does not count.
const STEPS: usize = 8;

/// The result of a step with a work budget.
///
/// ```
#[doc = include_str!("../doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// # world.create_body(&BodyDefinition { solver: Solver::Implicit, ..cloth })?;
/// let report = world.step_with_budget(1.0 / 60.0, 1000)?;
/// assert!(report.work_done <= report.work);
/// assert_eq!(report.lag, world.lag());
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BudgetReport {
    /// The report of the step.
    pub step: StepReport,
    /// The allowed units of work. [`World::step_with_budget`] with this number repeats the step exactly.
    pub work: u32,
    /// The units of work done by the body that did most. IMPLICIT can do twice the allowed work when a body first
    /// comes near a tool, and one unit for each millisecond in a grasp or near other tissue.
    pub work_done: u32,
    /// The time that requested steps have not simulated yet, s.
    pub lag: f64,
    /// A bound on the position error of unsolved equations, m: mass-weighted root mean square of the worst body, 0 for
    /// VERLET. [`World::force_error`] is the matching error of the force on a tool.
    pub error: f32,
}

/// The recent speed of this machine. It decides only how much work is allowed.
#[derive(Debug, Default)]
pub(super) struct WorkPace {
    /// The time of a unit of work in each of the last steps, s; 0 if unknown.
    units: [f64; STEPS],
    next: usize,
    last_work: u32,
}

impl WorkPace {
    /// The work that fits into `seconds`.
    fn work(&self, seconds: f64) -> u32 {
        let mut units = self.units;
        units.sort_unstable_by(f64::total_cmp);
        let unit = units[STEPS - 2];
        if unit == 0.0 {
            return FIRST_WORK;
        }
        let fits = (PLANNED * seconds / unit).min(f64::from(u32::MAX - 1)) as u32;
        fits.clamp(1, self.last_work.max(FIRST_WORK).saturating_mul(GROWTH))
    }

    fn note(&mut self, seconds: f64, report: &BudgetReport) {
        self.units[self.next] = seconds / f64::from(report.work_done.max(1));
        self.next = (self.next + 1) % STEPS;
        self.last_work = report.work;
    }
}

impl World {
    /// Steps the world by `dt` seconds plus the lag of earlier steps, as far as `work` units of work allow; see
    /// [`BudgetReport::work`]. Tools, pins and blades complete their motion; applied forces act for the simulated time.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: `dt` or `work` is out of range. [`Error::Unsupported`]: the world has fixed substeps
    /// or a tolerance. [`Error::Unstable`]: as [`World::step`]; nothing has moved then, and the lag stays as it was.
    pub fn step_with_budget(&mut self, dt: f32, work: u32) -> Result<BudgetReport> {
        above_zero("dt", dt)?;
        ensure!(work != 0, "work is 0: must be at least 1");
        if self.definition.substeps > 0 || self.definition.tolerance > 0.0 {
            return Err(Error::Unsupported(
                "a step with a budget takes as many substeps as it may: the world has fixed substeps or a tolerance"
                    .into(),
            ));
        }
        let requested = self.lag + f64::from(dt);
        let fits = |stable_substep: f32| USED * f64::from(stable_substep) * f64::from(work);
        let mut length = requested.min(fits(self.known_substep()));
        let mut tried = 0;
        let (step, length) = loop {
            // If the whole time fits, the remaining lag is exactly 0.
            let duration = if length < requested {
                length as f32
            } else {
                requested as f32
            };
            match self.step_of(duration, work) {
                Ok(report) => {
                    break (
                        report,
                        if length < requested {
                            f64::from(duration)
                        } else {
                            requested
                        },
                    );
                }
                Err(Error::Unstable { report, .. }) if tried < TRIES => {
                    tried += 1;
                    length = (0.9 * length).min(fits(report.stable_substep));
                }
                Err(error) => return Err(error),
            }
        };
        self.lag = (requested - length).max(0.0);
        let reports = self.bodies.iter().map(|(_, body)| body.solver_report());
        let (products, error) = reports.fold((0, 0.0_f32), |(products, error), report| {
            (report.iterations.max(products), report.error.max(error))
        });
        Ok(BudgetReport {
            step,
            work,
            work_done: products.max(step.substeps),
            lag: self.lag,
            error,
        })
    }

    /// Steps as [`World::step_with_budget`] does, with the work that fits into `seconds` at the pace of the last steps.
    /// The report has this work.
    ///
    /// Plan for a part of a frame. Work is measured in passes over all forces, not in time. A step can be late if the
    /// machine becomes slower, or when a body first touches a tool.
    ///
    /// # Errors
    /// As [`World::step_with_budget`]. [`Error::InvalidArgument`]: `seconds` is out of range. [`Error::Unsupported`]:
    /// the platform has no clock.
    pub fn step_within(&mut self, dt: f32, seconds: f64) -> Result<BudgetReport> {
        above_zero("seconds", seconds)?;
        check_clock("step_within")?;
        let work = self.pace.work(seconds);
        let start = Instant::now();
        let report = self.step_with_budget(dt, work)?;
        self.pace.note(start.elapsed().as_secs_f64(), &report);
        Ok(report)
    }

    /// The time that steps with a budget have not simulated yet, s.
    pub fn lag(&self) -> f64 {
        self.lag
    }

    /// Discards the lag of steps with a budget: the next step simulates only its own time.
    pub fn drop_lag(&mut self) {
        self.lag = 0.0;
    }

    /// Steps by `dt` seconds with at most `work` units of work.
    pub(super) fn step_of(&mut self, dt: f32, work: u32) -> Result<StepReport> {
        self.work = work;
        let result = self.step(dt);
        self.work = u32::MAX;
        result
    }

    /// The longest explicit substep known to be stable and to conserve energy, s; infinity if none is known.
    fn known_substep(&self) -> f32 {
        let explicit = self
            .bodies
            .iter()
            .filter(|(_, body)| body.system().integrator.is_limited_by_stability());
        let known = explicit.filter_map(|(_, body)| {
            let system = body.system();
            Some(system.carry.limit_by_energy(system.newest_limit(&system.carry)?))
        });
        known.fold(f32::INFINITY, f32::min)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_late_step_does_not_slow_those_after_it_down() {
        let mut world = World::new(crate::WorldDefinition::default()).expect("a world");
        let mut report = world.step_with_budget(0.01, 100).expect("a step");
        let mut pace = WorkPace::default();
        let mut step = |pace: &mut WorkPace, unit: f64| {
            let work = pace.work(1e-2);
            (report.work, report.work_done) = (work, work);
            pace.note(unit * f64::from(work), &report);
            work
        };
        assert_eq!(step(&mut pace, 1e-5), FIRST_WORK);
        for _ in 0..10 {
            step(&mut pace, 1e-5);
        }
        let fits = (PLANNED * 1e-2 / 1e-5) as u32;
        assert_eq!(step(&mut pace, 1e-3), fits);
        for _ in 0..10 {
            assert_eq!(step(&mut pace, 1e-5), fits);
        }
        // A machine that has become slower is another matter.
        step(&mut pace, 1e-4);
        step(&mut pace, 1e-4);
        assert!(step(&mut pace, 1e-4) <= fits / 10 + 1);
    }
}
