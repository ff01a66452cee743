//! A world: the bodies and tools that are stepped together.

mod attachments;
mod blade;
mod blade_advance;
mod blade_coupling;
mod blade_resistance;
mod blades;
mod bodies;
mod budget;
mod dynamic;
mod getters;
mod haptics;
mod profile;
mod proxy_motion;
mod readers;
mod recording;
mod rest;
mod settings;
mod snapshot;
mod step;
mod sutures;
mod tear;
mod tools;

use glam::Vec3;

#[cfg(doc)]
use crate::base::Error;
use crate::base::{AttachmentId, Profile, Result, StateHasher, WorldTag, ensure, not_negative};
use crate::body::Body;
use crate::contact::{DynamicTool, Tool, ToolPath};
use crate::def::finite_vector;
use crate::deformable_contact::DeformableContact;
use crate::readers::Clock;
use crate::simd::{ChosenKernel, Kernel};
use crate::slots::Slots;
use crate::solver::{CoupledBody, Outcome};
use crate::threads::{RunTasks, Threads};
use attachments::Attachment;
use blade::Blade;
pub use blade::{BladeDefinition, BladeReport};
pub use budget::BudgetReport;
use budget::WorkPace;
pub use profile::StepProfile;
use recording::Recorder;
pub use recording::{ReplayDifference, ReplayReport};
pub use sutures::{SutureDefinition, SutureReport};

/// The assumed step length before the first step, s.
const FRAME: f32 = 1.0 / 60.0;

/// The definition of a world.
///
/// ```
/// # use glam::Vec3;
/// # use sinew::*;
/// let definition = WorldDefinition { gravity: 1.62 * Vec3::NEG_Y, thread_count: 2, ..WorldDefinition::default() };
/// let world = World::new(definition)?;
/// assert_eq!(world.gravity().y, -1.62);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorldDefinition {
    /// The acceleration of gravity, m/s².
    pub gravity: Vec3,
    /// The number of threads, at most 256. 1 uses the caller's thread only, 0 one thread per core. The result is the
    /// same for any number.
    pub thread_count: u32,
    /// The number of substeps per step; 0 for as many as stability needs. [`Solver::Implicit`](crate::Solver::Implicit)
    /// and [`Solver::Newton`](crate::Solver::Newton) take more: at most 1 ms near a tool and 0.25 ms when attached to a
    /// body. They also divide a substep that gains energy, up to 4096 substeps per step.
    pub substeps: u32,
    /// The largest number of substeps, at least 1. A step that needs more is [`Error::Unstable`]. The additional
    /// substeps of implicit solvers are limited to 4096 instead: that is 4 s near a tool, or 1 s attached to a body.
    pub max_substeps: u32,
    /// The largest position error of a single step, m; 0 turns the error control off. It requires `substeps` 0.
    pub tolerance: f32,
    /// The SIMD level of the kernels.
    pub kernel: Kernel,
    /// The caller's job system, used instead of the world's own threads. It gets up to `thread_count` tasks per step.
    pub tasks: Option<RunTasks>,
}

impl Default for WorldDefinition {
    /// Earth's gravity along -y, one thread, up to 1000 substeps as stability needs, no tolerance.
    fn default() -> Self {
        Self {
            gravity: Vec3::new(0.0, -9.81, 0.0),
            thread_count: 1,
            substeps: 0,
            max_substeps: 1000,
            tolerance: 0.0,
            kernel: Kernel::Best,
            tasks: None,
        }
    }
}

/// Bodies and tools that are stepped together.
///
/// ```
#[doc = include_str!("doctest/cloth.txt")]
/// let mut world = World::new(WorldDefinition::default())?;
/// let body = world.create_body(&cloth)?;
/// for _ in 0..6 {
///     world.step(1.0 / 60.0)?;
/// }
/// // After 0.1 s of free fall.
/// assert!((world.body(body)?.positions()[0].y + 0.049).abs() < 1e-3);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Debug)]
pub struct World {
    definition: WorldDefinition,
    /// The tag of its ids.
    tag: WorldTag,
    kernel: ChosenKernel,
    threads: Threads,
    bodies: Slots<Body>,
    tools: Slots<Tool>,
    /// The paths of the tools in the current step.
    paths: Vec<ToolPath>,
    /// The dynamic tools in the current step.
    dynamic: Vec<DynamicTool>,
    /// Deformable contact and attachments between bodies; `None` while no body uses them.
    pub(crate) deformable_contact: Option<Box<DeformableContact>>,
    /// The step state of coupled bodies, by slot; empty while no body can be coupled.
    coupled: Vec<Option<CoupledBody>>,
    /// The outcome of the current step for each body, by slot.
    outcomes: Vec<Option<Outcome>>,
    /// The attachments to tools and between bodies.
    attachments: Slots<Attachment>,
    /// The attachments that broke in the last step.
    slipped: Vec<AttachmentId>,
    blades: Slots<Blade>,
    /// The number of blade holds ever created.
    holds_made: u32,
    /// The tools moved by haptic devices.
    haptics: Vec<haptics::HapticLink>,
    /// The number and duration of the steps taken.
    clock: Clock,
    /// The work budget of the current step.
    work: u32,
    /// The time that steps with a budget have not simulated yet, s.
    lag: f64,
    /// The recent speed of this machine.
    pace: WorkPace,
    /// The user data.
    user_data: usize,
    /// The profile of the last step; `None` without profiling.
    profile: Option<Box<Profile>>,
    /// The recorder, while steps are recorded.
    recorder: Option<Box<Recorder>>,
}

impl World {
    /// An empty world.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: a number is out of range. [`Error::Unsupported`]: the processor does not support the
    /// SIMD level, or the system cannot start so many threads.
    pub fn new(definition: WorldDefinition) -> Result<Self> {
        Self::with_tag(definition, WorldTag::next())
    }

    fn with_tag(definition: WorldDefinition, tag: WorldTag) -> Result<Self> {
        finite_vector("gravity", definition.gravity)?;
        not_negative("tolerance", definition.tolerance)?;
        ensure!(definition.max_substeps != 0, "max_substeps is 0: must be at least 1");
        Ok(Self {
            kernel: definition.kernel.choose()?,
            threads: match definition.tasks {
                Some(tasks) => Threads::with_tasks(tasks, definition.thread_count)?,
                None => Threads::new(definition.thread_count)?,
            },
            definition,
            tag,
            bodies: Slots::new("body", tag),
            tools: Slots::new("tool", tag),
            paths: Vec::new(),
            dynamic: Vec::new(),
            deformable_contact: None,
            coupled: Vec::new(),
            outcomes: Vec::new(),
            attachments: Slots::new("attachment", tag),
            slipped: Vec::new(),
            blades: Slots::new("blade", tag),
            holds_made: 0,
            haptics: Vec::new(),
            clock: Clock::default(),
            work: u32::MAX,
            lag: 0.0,
            pace: WorkPace::default(),
            user_data: 0,
            profile: None,
            recorder: None,
        })
    }

    /// The acceleration of gravity, m/s².
    pub fn gravity(&self) -> Vec3 {
        self.definition.gravity
    }

    /// Sets the acceleration of gravity, m/s², from the next step on.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: `gravity` is not finite.
    pub fn set_gravity(&mut self, gravity: Vec3) -> Result<()> {
        finite_vector("gravity", gravity)?;
        if std::mem::replace(&mut self.definition.gravity, gravity) == gravity {
            return Ok(());
        }
        self.bodies.iter_mut().for_each(|(_, body)| body.wake());
        Ok(())
    }

    /// A hash of all state that the next step depends on. Compare it within one version of the library.
    pub fn state_hash(&self) -> u64 {
        let definition = &self.definition;
        let mut hasher = StateHasher::new();
        hasher.write_floats(&definition.gravity.to_array());
        hasher.write_floats(&[definition.tolerance]);
        for count in [definition.substeps, definition.max_substeps] {
            hasher.write_u64(u64::from(count));
        }
        if self.lag > 0.0 {
            hasher.write_u64(self.lag.to_bits());
        }
        for (slot, body) in self.bodies.iter() {
            hasher.write_u64(slot as u64);
            body.hash_state(&mut hasher);
        }
        for (slot, tool) in self.tools.iter() {
            hasher.write_u64(slot as u64);
            tool.hash_state(&mut hasher);
        }
        if let Some(deformable_contact) = &self.deformable_contact {
            deformable_contact.attachments.hash(&mut hasher);
            deformable_contact.warm_start.hash(&mut hasher);
        }
        for (slot, blade) in self.blades.iter() {
            hasher.write_u64(slot as u64);
            blade.hash(&mut hasher);
        }
        hasher.finish()
    }
}

/// Reserves room for the body in this slot to be coupled to others.
fn reserve_coupling(coupled: &mut Vec<Option<CoupledBody>>, slot: usize) -> Result<()> {
    coupled.try_reserve((slot + 1).saturating_sub(coupled.len()))?;
    coupled.resize((slot + 1).max(coupled.len()), None);
    Ok(())
}
