//! Parallel passes on the caller's job system.

use std::cell::UnsafeCell;
use std::ffi::c_void;
use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;

use super::dispatcher::{Dispatcher, SpinWait};
use super::team::Team;
use crate::base::Result;

/// Runs tasks on a job system. It calls the task once for every index below the count, on any threads and in any order,
/// even sequentially, and returns after all calls have returned.
type Run = dyn Fn(u32, &(dyn Fn(u32) + Sync)) + Sync;

/// A task in C: its data and its index.
type CTask = unsafe extern "C" fn(task_data: *mut c_void, index: u32);

/// A job system in C: a context, the task with its data, and the number of calls.
type CRun = unsafe extern "C" fn(context: *mut c_void, task: Option<CTask>, task_data: *mut c_void, count: u32);

/// The caller's job system. A world can use its threads instead of own ones.
///
/// The tasks of a step help each other while they run at the same time, and each lasts until the step ends. Therefore
/// the number of tasks should not exceed the number of free threads.
///
/// ```
/// # use sinew::{mesh::Mesh, *};
/// fn run(count: u32, task: &(dyn Fn(u32) + Sync)) {
///     std::thread::scope(|scope| (0..count).for_each(|index| drop(scope.spawn(move || task(index)))));
/// }
/// let tasks = Some(RunTasks::new(&run));
/// let mut world = World::new(WorldDefinition { thread_count: 2, tasks, ..WorldDefinition::default() })?;
/// # let mesh = Mesh::cloth([0.1, 0.1], [4, 4])?;
/// # let (masses, stiffnesses) = (Values::Uniform(1e-4), Values::Uniform(20.0));
/// # let cloth = BodyDefinition { masses, stiffnesses, ..BodyDefinition::of(&mesh) };
/// # let body = world.create_body(&cloth)?;
/// world.step(1.0 / 60.0)?;
/// assert!(world.body(body)?.bounds()[1].y < 0.0);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy)]
pub struct RunTasks(JobSystem);

#[derive(Clone, Copy)]
enum JobSystem {
    Rust(&'static Run),
    C { run: CRun, context: *mut c_void },
}

// SAFETY: the context is only passed to `run`, which may be called on any thread by the contract of `from_c`.
unsafe impl Send for RunTasks {}
// SAFETY: the same contract.
unsafe impl Sync for RunTasks {}

impl RunTasks {
    /// Uses a function that calls the given task once for every index below the count. The calls may run on any threads
    /// and in any order, even sequentially. The function must return after all calls have returned.
    pub fn new(run: &'static Run) -> Self {
        Self(JobSystem::Rust(run))
    }

    /// Uses a C function: `run(context, task, task_data, count)` calls `task(task_data, index)` for every index.
    ///
    /// # Safety
    /// While a world uses it, `run` must be callable with `context` from any thread that steps the world. It must pass
    /// the given data to `task`, must not call `task` after it has returned, and must not return before these calls
    /// have.
    pub unsafe fn from_c(run: CRun, context: *mut c_void) -> Self {
        Self(JobSystem::C { run, context })
    }

    fn run(self, count: u32, task: &(dyn Fn(u32) + Sync)) {
        match self.0 {
            JobSystem::Rust(run) => run(count, task),
            JobSystem::C { run, context } => {
                let data = (&raw const task).cast_mut().cast();
                // SAFETY: the contract of `from_c` allows this call, and `task` is not used after it.
                unsafe { run(context, Some(run_c_task), data, count) }
            }
        }
    }
}

/// # Safety
/// `data` must point to a task that may be called and does not panic.
unsafe extern "C" fn run_c_task(data: *mut c_void, index: u32) {
    // SAFETY: the same contract.
    let task = unsafe { *data.cast::<&(dyn Fn(u32) + Sync)>() };
    task(index);
}

impl PartialEq for RunTasks {
    fn eq(&self, other: &Self) -> bool {
        match (self.0, other.0) {
            (JobSystem::Rust(run), JobSystem::Rust(other)) => std::ptr::addr_eq(run, other),
            (
                JobSystem::C { run, context },
                JobSystem::C {
                    run: other,
                    context: other_context,
                },
            ) => std::ptr::fn_addr_eq(run, other) && context == other_context,
            _ => false,
        }
    }
}

impl fmt::Debug for RunTasks {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self.0 {
            JobSystem::Rust(_) => "RunTasks(Rust)",
            JobSystem::C { .. } => "RunTasks(C)",
        })
    }
}

/// A job system and the state that its tasks share.
pub(super) struct Tasks {
    run_tasks: RunTasks,
    dispatcher: Dispatcher,
}

impl Tasks {
    /// Creates a dispatcher for `count` tasks.
    pub fn new(run_tasks: RunTasks, count: usize) -> Result<Self> {
        let dispatcher = Dispatcher::new(count)?;
        Ok(Self { run_tasks, dispatcher })
    }

    pub fn count(&self) -> usize {
        self.dispatcher.count()
    }

    /// The first task to start leads. Tasks that start before it ends follow, and later ones do nothing, so no task
    /// waits for one that may never start. If no task starts, this thread leads.
    pub fn lead<R: Send>(&mut self, lead: impl FnOnce(&Team) -> R + Send) -> R {
        let step = TaskStep {
            dispatcher: &self.dispatcher,
            started: AtomicUsize::new(0),
            is_over: AtomicBool::new(false),
            lead: UnsafeCell::new(Some(lead)),
            result: UnsafeCell::new(None),
        };
        self.run_tasks.run(self.dispatcher.count() as u32, &|_| step.task());
        match (step.result.into_inner(), step.lead.into_inner()) {
            (Some(result), _) => result.unwrap_or_else(|panic| resume_unwind(panic)),
            (None, Some(lead)) => lead(&Team::alone()),
            (None, None) => panic!("run_tasks returned before its tasks did"),
        }
    }
}

/// A step that is executed by tasks.
struct TaskStep<'a, F, R> {
    dispatcher: &'a Dispatcher,
    /// Number of tasks that have started.
    started: AtomicUsize,
    is_over: AtomicBool,
    /// `lead` and `result` are used by the first task, and after all tasks have returned.
    lead: UnsafeCell<Option<F>>,
    result: UnsafeCell<Option<thread::Result<R>>>,
}

// SAFETY: only one task uses the cells, and their contents are Send.
unsafe impl<F: Send, R: Send> Sync for TaskStep<'_, F, R> {}

impl<F: FnOnce(&Team) -> R, R> TaskStep<'_, F, R> {
    /// Does not panic.
    fn task(&self) {
        match self.started.fetch_add(1, Ordering::Relaxed) {
            0 => self.lead(),
            thread_index if thread_index < self.dispatcher.count() => self.follow(thread_index),
            // The job system made more calls than requested.
            _ => {}
        }
    }

    fn lead(&self) {
        // SAFETY: only the first task calls this function.
        if let Some(lead) = unsafe { &mut *self.lead.get() }.take() {
            // SAFETY: no other team exists. `Tasks::lead` borrows the dispatcher mutably and creates one step with it.
            let team = unsafe { Team::with_dispatcher(self.dispatcher, None) };
            let result = catch_unwind(AssertUnwindSafe(|| lead(&team)));
            // SAFETY: only the first task calls this function.
            unsafe { *self.result.get() = Some(result) };
        }
        self.is_over.store(true, Ordering::Release);
    }

    fn follow(&self, thread_index: usize) {
        let mut last_generation = None;
        let mut wait = SpinWait::new();
        while !self.is_over.load(Ordering::Acquire) {
            let generation = self.dispatcher.generation(thread_index);
            if last_generation != Some(generation) {
                last_generation = Some(generation);
                self.dispatcher.follow(thread_index);
                wait = SpinWait::new();
            } else if wait.is_over() {
                thread::yield_now();
            }
        }
    }
}
