//! Snapshots of a world: a restored world continues bitwise identically, and invalid bytes are refused.
#![allow(clippy::expect_used)]

mod acts;
mod features;
mod recording;
mod refused;

use std::collections::BTreeMap;
use std::ops::Range;

use acts::Caller;
use sinew::{World, WorldDefinition};

/// A world whose steps end soon.
fn world(threads: u32) -> World {
    World::new(WorldDefinition {
        thread_count: threads,
        max_substeps: 40,
        ..WorldDefinition::default()
    })
    .expect("a world")
}

#[test]
fn a_saved_world_continues_bitwise_under_any_action() {
    check_bitwise_continuation(12..14);
}

#[test]
#[ignore = "long"]
fn a_saved_world_continues_bitwise_after_every_action() {
    // Some other seeds entangle bodies, which takes long.
    let done = check_bitwise_continuation(10..25);
    // Every action must have occurred, else its continuation is untested.
    for (what, count) in &done {
        assert!(*count > 0 || *what == "a plain body", "{what}: never");
    }
}

/// Runs callers with these seeds; returns how often each action succeeded.
fn check_bitwise_continuation(seeds: Range<u64>) -> BTreeMap<&'static str, usize> {
    let mut done: BTreeMap<&str, usize> = BTreeMap::new();
    for seed in seeds {
        let mut caller = Caller::new(seed);
        let mut worlds = vec![world(1)];
        for step in 0..30 {
            for _ in 0..3 {
                caller.act(&mut worlds);
            }
            // Also between the actions of two steps.
            if [6, 14, 23].contains(&step) {
                let bytes = worlds[0].save().expect("bytes");
                for twin in &worlds {
                    assert!(twin.save().expect("bytes") == bytes, "seed {seed}, step {step}");
                }
                worlds.truncate(1);
                for threads in [1, 2] {
                    let twin = World::load(&bytes, threads, None).expect("a world");
                    assert!(twin.save().expect("bytes") == bytes, "seed {seed}, step {step}");
                    worlds.push(twin);
                }
                for _ in 0..2 {
                    caller.act(&mut worlds);
                }
            }
            caller.step(&mut worlds);
        }
        for (what, count) in caller.done {
            *done.entry(what).or_default() += count;
        }
    }
    done
}
