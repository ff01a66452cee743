//! What the stages of a step took, for whoever asks for it.

use super::World;
use crate::base::{Count, Profile, Result, Stage, Stopwatch, check_clock, memory};
use crate::solver::Outcome;

/// Times and counts of the last step, whether it was taken or refused.
///
/// Times are in seconds. `step` is the time of the whole step. The other times are sums over the threads that took part, so several threads
/// can exceed `step` together; with one thread the sum of the stages is less than `step`. What is left is checks and choices of substeps.
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
    /// Bodies of [`Solver::Verlet`](crate::Solver::Verlet): forces, velocities and positions, in one pass over the nodes.
    pub forces: f64,
    /// Bodies of [`Solver::Implicit`](crate::Solver::Implicit) and [`Solver::Newton`](crate::Solver::Newton): their equations, with the forces.
    pub solver: f64,
    /// The search for what is near a tool or other tissue.
    pub broad_phase: f64,
    /// The search for contacts among what is near.
    pub narrow_phase: f64,
    /// Impulses of contacts, attachments and sutures.
    pub contact_solver: f64,
    /// Taking over the new state, sleep, and what readers and haptic handles see.
    pub publish: f64,
    /// Blades and tears.
    pub cutting: f64,
    /// Bodies that were stepped.
    pub bodies: u64,
    /// Bodies that slept as a whole.
    pub sleeping_bodies: u64,
    /// How often the step was tried: more than once where a tool presses harder than its limit.
    pub tries: u64,
    /// Substeps of the step that was taken, summed over the bodies.
    pub substeps: u64,
    /// Products of a matrix and a vector, of the bodies of the solvers that have one.
    pub iterations: u64,
    /// Nodes, edges and faces near tools, summed over all substeps that were tried.
    pub candidates: u64,
    /// Contacts with tools, summed likewise.
    pub tool_contacts: u64,
    /// Contacts of tissue with tissue, summed likewise.
    pub tissue_contacts: u64,
}

impl World {
    /// Times and counts the stages of each step from the next one on, or no longer. A step that is not profiled reads no clock.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`](crate::Error::OutOfMemory); [`Error::Unsupported`](crate::Error::Unsupported): the platform has no clock.
    pub fn set_profiling(&mut self, on: bool) -> Result<()> {
        if !on {
            self.profile = None;
        } else if self.profile.is_none() {
            check_clock("enabled is 1")?;
            self.profile = Some(memory::boxed(Profile::default())?);
        }
        Ok(())
    }

    /// What the last step took; zeros before the first, `None` where steps are not profiled.
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

    /// A step begins.
    pub(super) fn begin_profile(&self) -> Stopwatch {
        if let Some(profile) = &self.profile {
            profile.begin();
        }
        Stopwatch::start(self.profile.as_deref())
    }

    /// Counts what became of the bodies in a step that was taken.
    pub(super) fn count_outcomes(&self) {
        let Some(profile) = &self.profile else { return };
        for (place, body) in self.bodies.iter() {
            match self.outcomes[place] {
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
