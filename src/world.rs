//! A world: bodies and tools that are stepped together.

mod approach;
mod attachments;
mod blade;
mod blades;
mod bodies;
mod budget;
mod dynamic;
mod getters;
mod haptics;
mod holds;
mod profile;
mod push;
mod readers;
mod recording;
mod resistance;
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

/// How long the steps of a world are taken to be before the first, s.
const FRAME: f32 = 1.0 / 60.0;

/// How a world steps.
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
    /// m/s².
    pub gravity: Vec3,
    /// 1: the caller's thread alone; 0: one per core; at most 256. What comes of a step is the same for any number.
    pub thread_count: u32,
    /// 0: as many as stability needs; n: exactly n per step, but for bodies of [`Solver::Implicit`](crate::Solver::Implicit) and
    /// [`Solver::Newton`](crate::Solver::Newton) near a tool, whose substeps are of 1 ms at most there, or attached to a body, of 0.25 ms,
    /// and where a substep of theirs gains energy: then they are cut again, to 4096 in all.
    pub substeps: u32,
    /// A step that needs more is [`Error::Unstable`]; at least 1. What is cut as above may be 4096 parts whatever this is, and one that would
    /// take more of them, 4 s near a tool or 1 s attached to a body, is [`Error::Unstable`] too.
    pub max_substeps: u32,
    /// Metres; 0: off; above 0, with `substeps` 0: a step's own position error stays below it.
    pub tolerance: f32,
    /// The instructions that springs and nodes are worked on with.
    pub kernel: Kernel,
    /// A job system whose threads are used instead of the world's own: it is given up to `thread_count` tasks a step.
    pub tasks: Option<RunTasks>,
}

impl Default for WorldDefinition {
    /// Earth's gravity along -y, one thread, as many substeps as stability needs up to 1000, no tolerance.
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
    /// That of its ids.
    tag: WorldTag,
    kernel: ChosenKernel,
    threads: Threads,
    bodies: Slots<Body>,
    tools: Slots<Tool>,
    /// The ways of the tools in the step in progress.
    paths: Vec<ToolPath>,
    /// Those of them that are rigid bodies.
    dynamic: Vec<DynamicTool>,
    /// Contacts of tissue with tissue, where bodies ask for them.
    pub(crate) tissue: Option<Box<DeformableContact>>,
    /// The bodies that take their substeps together, by their places; none where none can.
    walks: Vec<Option<CoupledBody>>,
    /// How the step in progress ended for each body, at its place.
    outcomes: Vec<Option<Outcome>>,
    /// What tools hold.
    attachments: Slots<Attachment>,
    /// What of that ended with the last step.
    slipped: Vec<AttachmentId>,
    blades: Slots<Blade>,
    /// How many threads to blades there ever were.
    holds_made: u32,
    /// Tools that devices lead.
    haptics: Vec<haptics::HapticLink>,
    /// The steps that were taken.
    clock: Clock,
    /// The most substeps of the step in progress, whatever the definition allows.
    work: u32,
    /// What steps with a budget have not simulated yet, s.
    lag: f64,
    /// How fast this machine works.
    pace: WorkPace,
    /// What the caller keeps with it.
    user_data: usize,
    /// What the stages of the last step took, where that is asked for.
    profile: Option<Box<Profile>>,
    /// Where steps are recorded, if they are.
    recorder: Option<Box<Recorder>>,
}

impl World {
    /// An empty world.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: a number is out of its range. [`Error::Unsupported`]: the processor does not offer the
    /// kernel, or the system not so many threads.
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
                Some(tasks) => Threads::of_tasks(tasks, definition.thread_count)?,
                None => Threads::new(definition.thread_count)?,
            },
            definition,
            tag,
            bodies: Slots::new("body", tag),
            tools: Slots::new("tool", tag),
            paths: Vec::new(),
            dynamic: Vec::new(),
            tissue: None,
            walks: Vec::new(),
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

    /// The acceleration of everything, m/s².
    pub fn gravity(&self) -> Vec3 {
        self.definition.gravity
    }

    /// Gives everything this acceleration, m/s², from the next step on.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: it is not finite.
    pub fn set_gravity(&mut self, gravity: Vec3) -> Result<()> {
        finite_vector("gravity", gravity)?;
        if std::mem::replace(&mut self.definition.gravity, gravity) == gravity {
            return Ok(());
        }
        self.bodies.iter_mut().for_each(|(_, body)| body.wake());
        Ok(())
    }

    /// A hash over everything that the next step depends on; to be compared within one version.
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
        for (place, body) in self.bodies.iter() {
            hasher.write_u64(place as u64);
            body.hash_state(&mut hasher);
        }
        for (place, tool) in self.tools.iter() {
            hasher.write_u64(place as u64);
            tool.hash_state(&mut hasher);
        }
        if let Some(tissue) = &self.tissue {
            tissue.bonds.hash(&mut hasher);
            tissue.pushes.hash(&mut hasher);
        }
        for (place, blade) in self.blades.iter() {
            hasher.write_u64(place as u64);
            blade.hash(&mut hasher);
        }
        hasher.finish()
    }
}

/// Makes room for the body at this place to take its substeps together with others.
fn make_walks(walks: &mut Vec<Option<CoupledBody>>, place: usize) -> Result<()> {
    walks.try_reserve((place + 1).saturating_sub(walks.len()))?;
    walks.resize((place + 1).max(walks.len()), None);
    Ok(())
}
