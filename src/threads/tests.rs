use std::ffi::c_void;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};

use super::jobs::Task;
use super::{Each, JobSystem, Ragged, Team, Threads, Tiles};

/// A fixed generator.
fn random(seed: &mut u64, below: usize) -> usize {
    *seed = seed
        .wrapping_mul(6_364_136_223_846_793_005)
        .wrapping_add(1_442_695_040_888_963_407);
    (*seed >> 33) as usize % below
}

/// Passes of random sizes, over all kinds of parts: each entry of each is met once.
fn check_passes(team: &Team, passes: usize) {
    let mut seed = 1;
    for _ in 0..passes {
        let tile = 1 + random(&mut seed, 9);
        let tiles = random(&mut seed, 70);
        let mut numbers = vec![0_u32; (tiles * tile).saturating_sub(random(&mut seed, tile))];
        let mut each = vec![0_usize; tiles];
        let mut starts: Vec<u32> = (0..tiles / 2).map(|_| random(&mut seed, 30) as u32).collect();
        starts.sort_unstable();
        let mut ragged = vec![0_usize; 30];
        let data = (
            Tiles::new(&mut numbers, tile),
            Each::new(&mut each),
            Ragged::new(&mut ragged, &starts),
        );
        team.pass(tiles, data, |tile, (numbers, each, ragged)| {
            numbers.iter_mut().for_each(|number| *number += 1);
            *each += tile + 1;
            ragged.iter_mut().for_each(|entry| *entry += tile + 1);
        });
        assert!(numbers.iter().all(|&number| number == 1));
        assert!(each.iter().enumerate().all(|(tile, &entry)| entry == tile + 1));
        let mut expected = vec![0; 30];
        for tile in 0..tiles {
            let start = |tile: usize| starts.get(tile).map_or(30, |&start| start as usize);
            expected[start(tile)..start(tile + 1)].fill(tile + 1);
        }
        assert_eq!(ragged, expected);
    }
}

#[test]
fn every_tile_is_worked_on_once() {
    check_passes(&Team::alone(), 100);
    for count in 1..=5 {
        let mut threads = Threads::new(count, None).expect("threads");
        for _ in 0..20 {
            threads.lead(|team| check_passes(team, 50));
            std::thread::sleep(std::time::Duration::from_micros(100));
        }
    }
}

#[test]
fn a_panic_is_passed_on_and_the_threads_go_on() {
    let mut threads = Threads::new(3, None).expect("threads");
    for spoilt in 0..20 {
        let caught = catch_unwind(AssertUnwindSafe(|| {
            threads.lead(|team| {
                let mut numbers = [0; 20];
                team.pass(20, Each::new(&mut numbers), |tile, _| {
                    if tile == spoilt {
                        std::panic::resume_unwind(Box::new("spoilt"));
                    }
                });
            });
        }));
        let payload = caught.expect_err("a panic");
        assert_eq!(payload.downcast_ref::<&str>(), Some(&"spoilt"));
        threads.lead(|team| check_passes(team, 5));
    }
}

/// How the job system at hand runs tasks.
#[derive(Clone, Copy)]
enum Manner {
    InOrder,
    Backwards,
    SideBySide,
    Never,
}

unsafe extern "C" fn run_tasks(context: *mut c_void, task: Task, task_data: *mut c_void, count: u32) {
    // SAFETY: the context is a manner; tasks are run as they ask for.
    let run = |index: u32, data: usize| unsafe { task(data as *mut c_void, index) };
    let data = task_data as usize;
    // SAFETY: the context is a manner.
    match unsafe { *context.cast::<Manner>() } {
        Manner::InOrder => (0..count).for_each(|index| run(index, data)),
        Manner::Backwards => (0..count).rev().for_each(|index| run(index, data)),
        Manner::SideBySide => std::thread::scope(|scope| {
            for index in 0..count {
                scope.spawn(move || run(index, data));
            }
        }),
        Manner::Never => {}
    }
}

#[test]
fn any_job_system_will_do() {
    for mut manner in [Manner::InOrder, Manner::Backwards, Manner::SideBySide, Manner::Never] {
        // SAFETY: the context outlives the threads.
        let jobs = unsafe { JobSystem::new(run_tasks, (&raw mut manner).cast()) };
        let mut threads = Threads::new(4, Some(jobs)).expect("threads");
        let led = AtomicUsize::new(0);
        for _ in 0..20 {
            threads.lead(|team| {
                led.fetch_add(1, Ordering::Relaxed);
                check_passes(team, 20);
            });
        }
        assert_eq!(led.into_inner(), 20);
    }
}

#[test]
fn too_many_threads_are_refused() {
    let error = Threads::new(257, None).expect_err("too many");
    assert!(error.to_string().contains("thread_count is 257"), "{error}");
}
