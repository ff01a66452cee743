//! Steps of bounded work, and of bounded time.
//!
//! A unit of work is one substep of every body of VERLET, or one product with the matrix of every body of IMPLICIT or NEWTON: about one
//! pass over all springs and elements either way. Where explicit substeps do not suffice for the time that a step is to go on, it goes on for
//! as long as they do, and the rest is carried to the next step. An equation is solved as far as its products go; what is left of it acts as a force in
//! the next step. Every such step is a step like any other, so that contact, energy and finiteness hold as in those.
//!
//! A clock decides how much work a step may do and nothing else: with the same work it does the same, on any machine.

use std::time::Instant;

use super::World;
use crate::base::{Error, Result, StepReport, above_zero, check_clock, ensure};

/// How often a step is tried over a shorter time, because its motion needs shorter substeps than were known.
const TRIES: u32 = 16;

/// The part of the longest stable substep that is counted on.
const USED: f64 = 0.79;

/// The work of the first step whose time is bounded, and by how much it may grow from one to the next.
const FIRST_WORK: u32 = 8;
const GROWTH: u32 = 4;

/// The part of the time that work is planned for.
const PLANNED: f64 = 0.7;

/// The pace is the second slowest of so many steps: one that something else on the machine held up is no measure of the next.
const STEPS: usize = 8;

/// What a step of bounded work did.
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
    /// What the step did.
    pub step: StepReport,
    /// The units of work that were allowed: [`World::step_with_budget`] with as many does the same.
    pub work: u32,
    /// Those that the step that was taken has done, by the body that did most. IMPLICIT may do twice as many as are allowed where something first
    /// comes near a tool, and one for each millisecond in a grasp and near other tissue.
    pub work_done: u32,
    /// How long the world lags behind the sum of the steps, s.
    pub lag: f64,
    /// How far nodes may be from where the equations of the step have them, m: root mean square by mass, the largest of all bodies, 0 for those of
    /// VERLET. [`World::force_error`] tells what that means for a tool.
    pub error: f32,
}

/// How fast this machine has worked lately. It decides nothing but how much work is allowed.
#[derive(Debug, Default)]
pub(super) struct WorkPace {
    /// How long a unit of work took in each of the last steps, s; 0: not known.
    units: [f64; STEPS],
    next: usize,
    last_work: u32,
}

impl WorkPace {
    /// How much work fits into so many seconds.
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
    /// Steps everything by `dt` seconds and what earlier steps of this kind have left, as far as `work` units of work go; see
    /// [`BudgetReport::work`]. Tools, pins and blades go all of their way, and forces act for as long as is simulated.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: `dt` or `work` is out of its range. [`Error::Unsupported`]: the world has fixed substeps or a tolerance.
    /// [`Error::Unstable`]: as [`World::step`]; nothing has moved then, and nothing is added to what is left.
    pub fn step_with_budget(&mut self, dt: f32, work: u32) -> Result<BudgetReport> {
        above_zero("dt", dt)?;
        ensure!(work != 0, "work is 0: must be at least 1");
        if self.definition.substeps > 0 || self.definition.tolerance > 0.0 {
            return Err(Error::Unsupported(
                "a step with a budget takes as many substeps as it may: the world has fixed substeps or a tolerance"
                    .into(),
            ));
        }
        let owed = self.lag + f64::from(dt);
        let fits = |stable_substep: f32| USED * f64::from(stable_substep) * f64::from(work);
        let mut length = owed.min(fits(self.known_substep()));
        let mut tried = 0;
        let (step, length) = loop {
            // In whole where it fits: what is left is exactly nothing then.
            let taken = if length < owed { length as f32 } else { owed as f32 };
            match self.step_of(taken, work) {
                Ok(report) => break (report, if length < owed { f64::from(taken) } else { owed }),
                Err(Error::Unstable { report, .. }) if tried < TRIES => {
                    tried += 1;
                    length = (0.9 * length).min(fits(report.stable_substep));
                }
                Err(error) => return Err(error),
            }
        };
        self.lag = (owed - length).max(0.0);
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

    /// The same with as much work as fits into `seconds`, by what the last steps took: the report tells how much that was.
    ///
    /// Plan for a part of a frame. Work is measured in passes over all forces, not in time: a step may be late where the machine becomes
    /// slower from one step to the next, or where it first meets a tool.
    ///
    /// # Errors
    /// As [`World::step_with_budget`]; [`Error::InvalidArgument`]: `seconds` is out of its range; [`Error::Unsupported`]: the platform has no clock.
    pub fn step_within(&mut self, dt: f32, seconds: f64) -> Result<BudgetReport> {
        above_zero("seconds", seconds)?;
        check_clock("step_within")?;
        let work = self.pace.work(seconds);
        let start = Instant::now();
        let report = self.step_with_budget(dt, work)?;
        self.pace.note(start.elapsed().as_secs_f64(), &report);
        Ok(report)
    }

    /// How long the world lags behind what steps with a budget were to simulate, s.
    pub fn lag(&self) -> f64 {
        self.lag
    }

    /// Gives up what steps with a budget have left: that time is not simulated, and the next step covers its own alone.
    pub fn drop_lag(&mut self) {
        self.lag = 0.0;
    }

    /// Steps by `dt` seconds with so much work.
    pub(super) fn step_of(&mut self, dt: f32, work: u32) -> Result<StepReport> {
        self.work = work;
        let result = self.step(dt);
        self.work = u32::MAX;
        result
    }

    /// The longest explicit substep that is known to be stable and to keep the energy, s; infinity where nothing is known.
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
