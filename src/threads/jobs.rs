//! The caller's own job system, in place of threads of ours.

use std::cell::Cell;
use std::ffi::c_void;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, Ordering};

use super::Team;
use super::crew::{Crew, wait};

/// A task to be run: `task(task_data, index)`.
pub type Task = unsafe extern "C" fn(task_data: *mut c_void, index: u32);

/// Runs `task(task_data, index)` once for every index below `count`, on any threads and in any order, one after another if
/// need be, and returns when all have returned.
pub type RunTasks = unsafe extern "C" fn(context: *mut c_void, task: Task, task_data: *mut c_void, count: u32);

/// A job system that steps run on.
#[derive(Clone, Copy, Debug)]
pub struct JobSystem {
    run_tasks: RunTasks,
    context: *mut c_void,
}

// SAFETY: `JobSystem::new` asks for a function that any thread may call with its context.
unsafe impl Send for JobSystem {}
// SAFETY: the same.
unsafe impl Sync for JobSystem {}

impl PartialEq for JobSystem {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::fn_addr_eq(self.run_tasks, other.run_tasks) && self.context == other.context
    }
}

impl JobSystem {
    /// The job system that `run_tasks` hands tasks to; `context` is handed to it each time.
    ///
    /// # Safety
    /// `run_tasks` does what [`RunTasks`] says, with this context and from any thread that steps a world, as long as a world
    /// has it.
    pub unsafe fn new(run_tasks: RunTasks, context: *mut c_void) -> Self {
        Self { run_tasks, context }
    }

    /// Runs `work` in the first of `count` tasks that begins; those that begin while it runs share its passes.
    pub(super) fn lead<R: Send>(&self, crew: &Crew, count: u32, work: impl FnOnce(&Team) -> R + Send) -> R {
        let work = Cell::new(Some(work));
        let result = Cell::new(None);
        let run = || {
            if let Some(work) = work.take() {
                let team = Team {
                    crew: Some(crew),
                    workers: &[],
                    called: Cell::new(false),
                };
                result.set(Some(catch_unwind(AssertUnwindSafe(|| work(&team)))));
            }
        };
        let step = Step {
            crew,
            run: &run,
            begun: AtomicBool::new(false),
            ended: AtomicBool::new(false),
        };
        // SAFETY: by the promise to `JobSystem::new` all tasks have returned when it does, so that nobody looks at the
        // step afterwards.
        unsafe { (self.run_tasks)(self.context, take_task, (&raw const step).cast_mut().cast(), count) };
        // A job system that ran no task at all.
        step.take();
        match result.into_inner() {
            Some(Ok(result)) => result,
            Some(Err(payload)) => resume_unwind(payload),
            // `run` is called by the first task, or just now.
            None => unreachable!("a step that nobody took"),
        }
    }
}

/// A step that is handed out as tasks.
struct Step<'a> {
    crew: &'a Crew,
    /// The leader's work, which may go to another thread; only the first task calls it.
    run: &'a dyn Fn(),
    begun: AtomicBool,
    ended: AtomicBool,
}

impl Step<'_> {
    fn take(&self) {
        if !self.begun.swap(true, Ordering::AcqRel) {
            (self.run)();
            self.ended.store(true, Ordering::Release);
            return;
        }
        let mut looks = 0;
        while !self.ended.load(Ordering::Acquire) {
            if !self.crew.help() {
                wait(&mut looks);
            }
        }
    }
}

/// What the job system runs.
///
/// # Safety
/// `task_data` is a [`Step`] that is there until this returns.
unsafe extern "C" fn take_task(task_data: *mut c_void, _: u32) {
    // SAFETY: the same contract.
    unsafe { &*task_data.cast::<Step>() }.take();
}
