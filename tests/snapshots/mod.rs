//! A world to bytes and back: it goes on as if nothing had been, and what is no world is refused.
#![allow(clippy::expect_used)]

mod acts;
mod features;
mod recording;
mod refused;

use std::collections::BTreeMap;
use std::ops::Range;

use acts::Caller;
use sinew::{World, WorldDefinition};

/// Of which a step soon ends.
fn world(threads: u32) -> World {
    World::new(WorldDefinition {
        thread_count: threads,
        max_substeps: 40,
        ..WorldDefinition::default()
    })
    .expect("a world")
}

#[test]
fn a_world_that_was_saved_goes_on_to_the_bit_whatever_is_done() {
    go_on_to_the_bit(12..14);
}

#[test]
#[ignore = "long"]
fn a_world_that_was_saved_goes_on_to_the_bit_when_everything_was_done() {
    // Some others tangle bodies up, which takes long.
    let done = go_on_to_the_bit(10..25);
    // What is not done is not known to go on.
    for (what, count) in &done {
        assert!(*count > 0 || *what == "a plain body", "{what}: never");
    }
}

/// With callers of these seeds; how often each did what.
fn go_on_to_the_bit(seeds: Range<u64>) -> BTreeMap<&'static str, usize> {
    let mut done: BTreeMap<&str, usize> = BTreeMap::new();
    for seed in seeds {
        let mut caller = Caller::new(seed);
        let mut worlds = vec![world(1)];
        for step in 0..30 {
            for _ in 0..3 {
                caller.act(&mut worlds);
            }
            // Also in the middle of what is done between two steps.
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
