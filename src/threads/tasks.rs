//! The threads of a caller's job system.

use std::cell::UnsafeCell;
use std::ffi::c_void;
use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;

use super::board::{Board, Patience};
use super::team::Team;
use crate::base::Result;

/// Runs tasks on the threads of a job system: calls the task once for every index below the count, on any threads, in
/// any order, even one after another; returns when all of them have.
type Run = dyn Fn(u32, &(dyn Fn(u32) + Sync)) + Sync;

/// A task as C sees it: its data, and its index.
type CTask = unsafe extern "C" fn(task_data: *mut c_void, index: u32);

/// As C gives it: a context, the task with its data, and how often it is to be called.
type CRun = unsafe extern "C" fn(context: *mut c_void, task: Option<CTask>, task_data: *mut c_void, count: u32);

/// A job system of the caller's, whose threads a world steps with instead of its own.
///
/// Tasks of one step help each other where they run at the same time, and each takes until the step ends: a job system
/// should not be asked for more tasks than it has threads that are free.
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

// SAFETY: the context is handed to `run` and used for nothing else; `from_c` demands that this may happen on any thread.
unsafe impl Send for RunTasks {}
// SAFETY: as above.
unsafe impl Sync for RunTasks {}

impl RunTasks {
    /// A function that calls the task it is given once for every index below the count, on any threads, in any order,
    /// even one after another, and returns when all of them have.
    pub fn new(run: &'static Run) -> Self {
        Self(JobSystem::Rust(run))
    }

    /// The same in C: `run(context, task, task_data, count)` calls `task(task_data, index)`.
    ///
    /// # Safety
    /// As long as a world uses it, `run` may be called with `context` from any thread that steps the world; it calls
    /// `task` with the data it was given, not after it has returned, and does not return before these calls have.
    pub unsafe fn from_c(run: CRun, context: *mut c_void) -> Self {
        Self(JobSystem::C { run, context })
    }

    fn run(self, count: u32, task: &(dyn Fn(u32) + Sync)) {
        match self.0 {
            JobSystem::Rust(run) => run(count, task),
            JobSystem::C { run, context } => {
                let data = (&raw const task).cast_mut().cast();
                // SAFETY: `from_c` was promised that this call is fine, and that `task` is not used after it.
                unsafe { run(context, Some(run_c_task), data, count) }
            }
        }
    }
}

/// # Safety
/// `data` points to a task that may be called; it does not panic.
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
                    context: its,
                },
            ) => std::ptr::fn_addr_eq(run, other) && context == its,
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

/// A job system and what its threads meet at.
pub(super) struct Tasks {
    run_tasks: RunTasks,
    board: Board,
}

impl Tasks {
    /// `count` tasks.
    pub fn new(run_tasks: RunTasks, count: usize) -> Result<Self> {
        let board = Board::new(count)?;
        Ok(Self { run_tasks, board })
    }

    pub fn count(&self) -> usize {
        self.board.count()
    }

    /// The first task to begin leads, those that begin before it ends follow, and later ones have nothing to do: no task
    /// waits for one that may never begin. Where none begins, this thread leads.
    pub fn lead<R: Send>(&mut self, lead: impl FnOnce(&Team) -> R + Send) -> R {
        let step = TaskStep {
            board: &self.board,
            begun: AtomicUsize::new(0),
            ended: AtomicBool::new(false),
            lead: UnsafeCell::new(Some(lead)),
            result: UnsafeCell::new(None),
        };
        self.run_tasks.run(self.board.count() as u32, &|_| step.task());
        match (step.result.into_inner(), step.lead.into_inner()) {
            (Some(result), _) => result.unwrap_or_else(|panic| resume_unwind(panic)),
            (None, Some(lead)) => lead(&Team::alone()),
            (None, None) => panic!("run_tasks returned before its tasks did"),
        }
    }
}

/// A step that tasks take together.
struct TaskStep<'a, F, R> {
    board: &'a Board,
    /// How many tasks have begun.
    begun: AtomicUsize,
    ended: AtomicBool,
    /// Both are used by the first task, and when all have returned.
    lead: UnsafeCell<Option<F>>,
    result: UnsafeCell<Option<thread::Result<R>>>,
}

// SAFETY: the cells are used by one task alone, and what is in them may go to its thread.
unsafe impl<F: Send, R: Send> Sync for TaskStep<'_, F, R> {}

impl<F: FnOnce(&Team) -> R, R> TaskStep<'_, F, R> {
    /// Does not panic.
    fn task(&self) {
        match self.begun.fetch_add(1, Ordering::Relaxed) {
            0 => self.lead(),
            seat if seat < self.board.count() => self.follow(seat),
            // Called more often than it was asked to be.
            _ => {}
        }
    }

    fn lead(&self) {
        // SAFETY: the first task alone comes here.
        if let Some(lead) = unsafe { &mut *self.lead.get() }.take() {
            // SAFETY: nobody else makes one: the board is borrowed mutably by `Tasks::lead`, which made one step of it.
            let team = unsafe { Team::of(self.board, None) };
            let result = catch_unwind(AssertUnwindSafe(|| lead(&team)));
            // SAFETY: the first task alone comes here.
            unsafe { *self.result.get() = Some(result) };
        }
        self.ended.store(true, Ordering::Release);
    }

    fn follow(&self, seat: usize) {
        let mut seen = None;
        let mut patience = Patience::new();
        while !self.ended.load(Ordering::Acquire) {
            let generation = self.board.generation(seat);
            if seen != Some(generation) {
                seen = Some(generation);
                self.board.follow(seat);
                patience = Patience::new();
            } else if patience.ends() {
                thread::yield_now();
            }
        }
    }
}
