//! Every tile is processed once, for any number of helpers.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicU32, AtomicUsize, Ordering};
use std::thread;
use std::time::Duration;

use super::split::Split;
use super::*;
use crate::base::Error;
use crate::random::Random;

type Task<'a> = &'a (dyn Fn(u32) + Sync);
type TestJobs = &'static (dyn for<'a> Fn(u32, Task<'a>) + Sync);

fn in_order(count: u32, task: Task) {
    (0..count).for_each(task);
}

fn in_reverse(count: u32, task: Task) {
    (0..count).rev().for_each(task);
}

fn on_threads(count: u32, task: Task) {
    thread::scope(|scope| {
        for index in 0..count {
            scope.spawn(move || task(index));
        }
    });
}

/// Runs two tasks at a time.
fn on_two_threads(count: u32, task: Task) {
    let next = AtomicU32::new(0);
    thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    if index >= count {
                        break;
                    }
                    task(index);
                }
            });
        }
    });
}

fn never(_count: u32, _task: Task) {}

fn too_often(count: u32, task: Task) {
    for _ in 0..3 {
        on_threads(count, task);
    }
}

fn all_threads() -> Vec<Threads> {
    let workers = (1..=5).map(|count| Threads::new(count).expect("threads"));
    let systems: [TestJobs; 6] = [&in_order, &in_reverse, &on_threads, &on_two_threads, &never, &too_often];
    let tasks = systems.map(|run| Threads::with_tasks(RunTasks::new(run), 3).expect("room"));
    workers.chain(tasks).collect()
}

#[test]
fn every_tile_runs_once_per_pass_with_its_own_part() {
    for mut threads in all_threads() {
        let name = format!("{threads:?}");
        let mut random = Random(7);
        for _ in 0..20 {
            let passes: Vec<usize> = (0..20).map(|_| random.below(40)).collect();
            let length = 1 + random.below(9);
            let results: Vec<Vec<usize>> = threads.lead(|team| {
                let run = |&tiles: &usize| {
                    let mut values = vec![0; tiles * length];
                    let mut runs = vec![0; tiles];
                    let data = (Tiles::new(&mut values, length), Items::new(&mut runs));
                    team.pass(tiles, data, |tile, (part, runs)| {
                        assert_eq!(part.len(), length);
                        part.iter_mut().for_each(|value| *value += tile + 1);
                        *runs += 1;
                    });
                    assert_eq!(runs, vec![1; tiles], "{name}");
                    values
                };
                passes.iter().map(run).collect()
            });
            for (values, tiles) in results.iter().zip(&passes) {
                let expected: Vec<usize> = (0..tiles * length).map(|value| value / length + 1).collect();
                assert_eq!(*values, expected, "{name}");
            }
        }
    }
}

#[test]
fn a_pass_sees_the_writes_of_the_previous_pass() {
    for mut threads in all_threads() {
        let name = format!("{threads:?}");
        const TILES: usize = 7;
        let mut values = [[0_u64; TILES]; 2];
        threads.lead(|team| {
            for round in 0..200 {
                let [old, new] = &mut values;
                let old = &*old;
                team.pass(TILES, Items::new(new), |tile, value| {
                    *value = old[tile] + old[(tile + 1) % TILES] + round;
                    *value %= 1_000_003;
                });
                values.swap(0, 1);
            }
        });
        let mut expected = [0_u64; TILES];
        for round in 0..200 {
            let old = expected;
            for tile in 0..TILES {
                expected[tile] = (old[tile] + old[(tile + 1) % TILES] + round) % 1_000_003;
            }
        }
        assert_eq!(values[0], expected, "{name}");
    }
}

#[test]
fn sleeping_workers_wake_up() {
    let mut threads = Threads::new(3).expect("threads");
    for round in 0..20 {
        let met = AtomicUsize::new(0);
        threads.lead(|team| {
            // Each tile waits for the others, so all three threads must take part. A worker that falls asleep while a
            // pass begins is woken by the next one.
            while met.load(Ordering::Relaxed) < 3 {
                met.store(0, Ordering::Relaxed);
                team.pass(3, (), |_, ()| {
                    met.fetch_add(1, Ordering::Relaxed);
                    let mut patience = 1000;
                    while met.load(Ordering::Relaxed) < 3 && patience > 0 {
                        thread::sleep(Duration::from_micros(20));
                        patience -= 1;
                    }
                });
            }
        });
        thread::sleep(Duration::from_micros(100 * (round % 4)));
    }
}

#[test]
fn a_panic_reaches_the_leader_and_the_threads_survive() {
    for mut threads in all_threads() {
        let name = format!("{threads:?}");
        for bad in 0..12 {
            let running = AtomicUsize::new(0);
            let caught = catch_unwind(AssertUnwindSafe(|| {
                threads.lead(|team| {
                    let caught = catch_unwind(AssertUnwindSafe(|| {
                        team.pass(12, (), |tile, ()| {
                            running.fetch_add(1, Ordering::Relaxed);
                            let stop = tile == bad;
                            running.fetch_sub(1, Ordering::Relaxed);
                            assert!(!stop, "tile {tile}");
                        });
                    }));
                    assert_eq!(running.load(Ordering::Relaxed), 0, "{name}: quiet by now");
                    let panic = caught.expect_err("a tile panicked");
                    assert_eq!(panic.downcast_ref::<String>(), Some(&format!("tile {bad}")), "{name}");
                    std::panic::resume_unwind(panic);
                });
            }));
            let panic = caught.expect_err("the leader panicked");
            assert_eq!(panic.downcast_ref::<String>(), Some(&format!("tile {bad}")), "{name}");
            let mut runs = [0; 12];
            threads.lead(|team| team.pass(12, Items::new(&mut runs), |_, runs| *runs += 1));
            assert_eq!(runs, [1; 12], "{name}");
        }
    }
}

#[test]
fn the_result_of_the_leader_is_returned() {
    for mut threads in all_threads() {
        assert_eq!(threads.lead(|_| "once".to_owned()), "once");
    }
    let mut threads = Threads::new(3).expect("threads");
    assert_eq!((threads.lead(|team| team.count()), threads.count()), (3, 3));
    let mut nobody = Threads::with_tasks(RunTasks::new(&never), 3).expect("room");
    assert_eq!((nobody.lead(|team| team.count()), nobody.count()), (1, 3));
}

#[test]
fn data_must_have_one_part_per_tile() {
    let team = Team::alone();
    let mut values = [0; 10];
    let mut refused = |tiles, length| {
        let pass = || team.pass(tiles, Tiles::new(&mut values, length), |_, _| {});
        catch_unwind(AssertUnwindSafe(pass)).is_err()
    };
    assert!(!refused(10, 1) && !refused(4, 3) && !refused(1, 100));
    assert!(refused(9, 1) && refused(11, 1) && refused(3, 3) && refused(0, 3) && refused(2, 100));
    let fits = |data: &dyn Fn(&mut [i32], usize) -> bool, tiles| data(&mut [0; 10], tiles);
    let items = |values: &mut [i32], tiles: usize| Items::new(values).fits(tiles);
    assert!(fits(&items, 10) && !fits(&items, 9) && !fits(&items, 11));
    let ragged = |values: &mut [i32], tiles: usize| Ragged::new(values, &[0, 4, 4, 10]).fits(tiles);
    // Tiles beyond the last start have empty pieces.
    assert!(fits(&ragged, 4) && !fits(&ragged, 3) && fits(&ragged, 5));
    let pair = |values: &mut [i32], tiles: usize| ((), Some(Items::new(values)), None::<()>).fits(tiles);
    assert!(fits(&pair, 10) && !fits(&pair, 9));
    for starts in [&[0, 5, 4][..], &[0, 11]] {
        let cut = || assert!(Ragged::new(&mut [0; 10], starts).fits(10));
        assert!(catch_unwind(cut).is_err(), "{starts:?}");
    }
}

#[test]
fn parts_cover_the_documented_ranges() {
    let mut threads = Threads::new(2).expect("threads");
    let mut ragged: Vec<usize> = vec![9; 12];
    let mut short = [[0_usize; 2]; 3];
    let mut columns: [Vec<usize>; 3] = std::array::from_fn(|_| vec![0; 7]);
    let starts = [2, 3, 3, 9];
    threads.lead(|team| {
        team.pass(4, Ragged::new(&mut ragged, &starts), |tile, part| part.fill(tile));
        let [a, b, c] = &mut columns;
        let columns = [a, b, c].map(|column| Tiles::new(column, 3));
        let data = (columns, Some(Items::new(&mut short)), None::<Items<u8>>);
        team.pass(3, data, |tile, (columns, short, none)| {
            assert!(none.is_none());
            for (axis, column) in columns.into_iter().enumerate() {
                column.fill(10 * axis + tile);
            }
            if let Some(short) = short {
                *short = [tile, tile + 1];
            }
        });
    });
    assert_eq!(ragged, [9, 9, 0, 2, 2, 2, 2, 2, 2, 3, 3, 3]);
    assert_eq!(short, [[0, 1], [1, 2], [2, 3]]);
    for (axis, column) in columns.iter().enumerate() {
        let expected: Vec<usize> = [0, 0, 0, 1, 1, 1, 2].iter().map(|tile| 10 * axis + tile).collect();
        assert_eq!(*column, expected);
    }
}

#[test]
fn too_many_threads_are_refused() {
    let cores = thread::available_parallelism().map_or(1, usize::from).min(256);
    assert_eq!(Threads::new(0).expect("threads").count(), cores);
    let run = RunTasks::new(&in_order);
    assert_eq!(Threads::with_tasks(run, 256).expect("room").count(), 256);
    for refused in [Threads::new(257), Threads::with_tasks(run, 257), Threads::new(u32::MAX)] {
        match refused {
            Err(Error::InvalidArgument(message)) => assert!(message.contains("thread_count"), "{message}"),
            other => panic!("{other:?}"),
        }
    }
}
