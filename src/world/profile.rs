//! The times of the stages of a step.

use super::World;
use crate::base::{Count, Profile, Result, Stage, Stopwatch, check_clock, memory};
use crate::solver::Outcome;

/// Times and counts of the last step, whether it was taken or refused.
///
/// Times are in seconds. `step` is the time of the whole step. The other times are sums over the threads that took
/// part, so several threads can exceed `step` together; with one thread the sum of the stages is less than `step`. The
/// rest is checks and the choice of substeps.
///
/// ```
#[doc = include_str!("../doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// # world.create_body(&cloth)?;
/// world.set_profiling(true)?;
/// world.step(1.0 / 60.0)?;
/// let profile = world.profile().expect("profiling is on");
/// assert_eq!(profile.bodies, 1);
/// assert!(profile.step > 0.0);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StepProfile {
    /// The whole step.
    pub step: f64,
    /// Targets and paths of tools and blades.
    pub plan: f64,
    /// Bodies of [`Solver::Verlet`](crate::Solver::Verlet): forces, velocities and positions, in one pass over the
    /// nodes.
    pub forces: f64,
    /// Bodies of [`Solver::Implicit`](crate::Solver::Implicit) and [`Solver::Newton`](crate::Solver::Newton): their
    /// equations, with the forces.
    pub solver: f64,
    /// The search for features near a tool or near another surface.
    pub broad_phase: f64,
    /// The search for contacts among those features.
    pub narrow_phase: f64,
    /// Impulses of contacts, attachments and sutures.
    pub contact_solver: f64,
    /// Committing the new state, sleep, and publishing to readers and haptic handles.
    pub publish: f64,
    /// Blades and tears.
    pub cutting: f64,
    /// Bodies that were stepped.
    pub bodies: u64,
    /// Bodies that slept as a whole.
    pub sleeping_bodies: u64,
    /// The attempts of the step: more than one if a tool exceeds its force limit.
    pub tries: u64,
    /// Substeps of the step that was taken, summed over the bodies.
    pub substeps: u64,
    /// Matrix-vector products of implicit solvers, summed over the bodies.
    pub iterations: u64,
    /// Nodes, edges and faces near tools, summed over all attempted substeps.
    pub candidates: u64,
    /// Contacts with tools, summed over all attempted substeps.
    pub tool_contacts: u64,
    /// Contacts of bodies with bodies, summed over all attempted substeps.
    pub tissue_contacts: u64,
}

impl World {
    /// Turns profiling of steps on or off, from the next step on. Without profiling a step reads no clock.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`](crate::Error::OutOfMemory); [`Error::Unsupported`](crate::Error::Unsupported): the
    /// platform has no clock.
    pub fn set_profiling(&mut self, on: bool) -> Result<()> {
        if !on {
            self.profile = None;
        } else if self.profile.is_none() {
            check_clock("enabled is 1")?;
            self.profile = Some(memory::boxed(Profile::default())?);
        }
        Ok(())
    }

    /// The profile of the last step; zeros before the first, `None` without profiling.
    pub fn profile(&self) -> Option<StepProfile> {
        let profile = self.profile.as_deref()?;
        let seconds = |stage| profile.seconds(stage);
        let counted = |count| profile.counted(count);
        Some(StepProfile {
            step: seconds(Stage::Step),
            plan: seconds(Stage::Plan),
            forces: seconds(Stage::Forces),
            solver: seconds(Stage::Solver),
            broad_phase: seconds(Stage::BroadPhase),
            narrow_phase: seconds(Stage::NarrowPhase),
            contact_solver: seconds(Stage::ContactSolver),
            publish: seconds(Stage::Publish),
            cutting: seconds(Stage::Cutting),
            bodies: counted(Count::Bodies),
            sleeping_bodies: counted(Count::Sleeping),
            tries: counted(Count::Tries),
            substeps: counted(Count::Substeps),
            iterations: counted(Count::Products),
            candidates: counted(Count::Candidates),
            tool_contacts: counted(Count::ToolContacts),
            tissue_contacts: counted(Count::TissueContacts),
        })
    }

    /// Clears the profile and starts the time of a step.
    pub(super) fn begin_profile(&self) -> Stopwatch {
        if let Some(profile) = &self.profile {
            profile.begin();
        }
        Stopwatch::start(self.profile.as_deref())
    }

    /// Counts the outcomes of the bodies after a step.
    pub(super) fn count_outcomes(&self) {
        let Some(profile) = &self.profile else { return };
        for (slot, body) in self.bodies.iter() {
            match self.outcomes[slot] {
                Some(Outcome::Asleep) => profile.count(Count::Sleeping, 1),
                Some(Outcome::Done { substeps, .. }) => {
                    profile.count(Count::Bodies, 1);
                    profile.count(Count::Substeps, substeps as usize);
                    profile.count(Count::Products, body.solver_report().iterations as usize);
                }
                _ => profile.count(Count::Bodies, 1),
            }
        }
    }
}
