//! Recordings are replayed exactly, and a difference is found at its step.

use std::fs;
use std::ops::Range;
use std::path::PathBuf;

use glam::Vec3;
use sinew::mesh::Mesh;
use sinew::{
    BodyDefinition, Error, HapticDefinition, Pose, ReplayReport, Shape, Solver, ToolDefinition, Values, World,
    WorldDefinition,
};

use super::acts::Caller;
use super::world;

fn path(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}.recording"))
}

/// A cloth that hangs by two of its corners.
fn hanging() -> World {
    let mut world = World::new(WorldDefinition::default()).expect("a world");
    let mesh = Mesh::cloth([0.1; 2], [6, 6]).expect("a cloth");
    let body = world
        .create_body(&BodyDefinition {
            masses: Values::Uniform(1e-4),
            stiffnesses: Values::Uniform(20.0),
            node_dampings: Values::Uniform(1e-4),
            ..BodyDefinition::of(&mesh)
        })
        .expect("a body");
    for node in [0, 6] {
        world.body_mut(body).and_then(|body| body.pin(node)).expect("a pin");
    }
    world
}

/// Returns the positions of each step's `dt` and hash in the file of a recording.
fn frames(bytes: &[u8]) -> Vec<[usize; 2]> {
    let mut frames = Vec::new();
    let mut at = 12;
    while at < bytes.len() {
        let length = u64::from_le_bytes(bytes[at + 17..at + 25].try_into().expect("8 bytes"));
        let end = at + 25 + length as usize;
        frames.push([at + 1, end + 2]);
        at = end + 10;
    }
    frames
}

#[test]
fn random_calls_are_replayed_with_the_recorded_hashes() {
    random_calls_are_replayed_times(10..11, 2);
}

#[test]
#[ignore = "long"]
fn random_calls_are_replayed_eight_more_times_with_the_recorded_hashes() {
    random_calls_are_replayed_times(10..12, 8);
}

fn random_calls_are_replayed_times(seeds: Range<u64>, replays: u32) {
    let mut recorded = 0;
    for seed in seeds.clone() {
        let path = path(&format!("calls_{seed}_{replays}"));
        let mut caller = Caller::new(seed);
        let mut worlds = vec![world(1)];
        for step in 0..16 {
            for _ in 0..3 {
                caller.act(&mut worlds);
            }
            if step == 3 {
                worlds[0].start_recording(&path).expect("a file");
            }
            caller.step(&mut worlds);
        }
        let steps = worlds[0].stop_recording().expect("a recording");
        let expected = ReplayReport {
            steps,
            difference: None,
            is_cut_short: false,
        };
        // A replay has the same states for another number of threads, any number of times. `fuzz/run replays` runs many
        // more.
        for replay in 0..replays {
            let report = World::replay(&path, 1 + replay % 2).expect("a replay");
            assert_eq!(report, expected, "seed {seed}, replay {replay}");
        }
        recorded += steps;
        fs::remove_file(&path).expect("the file");
    }
    assert_eq!(recorded, seeds.count() as u64 * 13);
}

#[test]
fn a_recording_changes_no_state() {
    let path = path("same");
    let (mut plain, mut recorded) = (hanging(), hanging());
    recorded.start_recording(&path).expect("a file");
    for _ in 0..10 {
        plain.step(2e-3).expect("a step");
        recorded.step(2e-3).expect("a step");
        assert_eq!(plain.state_hash(), recorded.state_hash());
    }
    assert_eq!(recorded.stop_recording(), Ok(10));
    fs::remove_file(&path).expect("the file");
}

#[test]
fn steps_with_a_work_budget_are_replayed() {
    let path = path("bounded");
    let mut world = hanging();
    world.start_recording(&path).expect("a file");
    let mut lags = 0;
    for work in [1, 2, 3, 50, 1, 7] {
        let report = world.step_with_budget(8e-3, work).expect("a step");
        lags += u32::from(report.lag > 0.0);
    }
    assert!(lags > 1, "some steps end early by their work budget");
    let steps = world.stop_recording().expect("a recording");
    let report = World::replay(&path, 1).expect("a replay");
    assert_eq!((report.steps, report.difference), (steps, None));
    fs::remove_file(&path).expect("the file");
}

#[test]
fn calls_between_steps_of_an_implicit_body_are_replayed() {
    let path = path("solved");
    let mut world = World::new(WorldDefinition::default()).expect("a world");
    let mesh = Mesh::cloth([0.1; 2], [6, 6]).expect("a cloth");
    world
        .create_body(&BodyDefinition {
            masses: Values::Uniform(1e-4),
            stiffnesses: Values::Uniform(20.0),
            solver: Solver::Implicit,
            ..BodyDefinition::of(&mesh)
        })
        .expect("a body");
    world.start_recording(&path).expect("a file");
    for (work, y) in [(3, -9.0), (5, -1.0), (2, -3.0)] {
        world.set_gravity(Vec3::new(0.0, y, 0.0)).expect("a gravity");
        world.step_with_budget(0.01, work).expect("a step");
        world.step(0.01).expect("a step");
    }
    let steps = world.stop_recording().expect("a recording");
    let report = World::replay(&path, 1).expect("a replay");
    assert_eq!((report.steps, report.difference), (steps, None));
    fs::remove_file(&path).expect("the file");
}

#[test]
fn a_planted_difference_is_found_at_its_step() {
    let path = path("planted");
    let mut world = hanging();
    world.start_recording(&path).expect("a file");
    for _ in 0..20 {
        world.step(2e-3).expect("a step");
    }
    world.stop_recording().expect("a recording");
    let good = fs::read(&path).expect("the file");
    let frames = frames(&good);
    assert_eq!(frames.len(), 20);
    for step in [1, 7, 20] {
        let [dt, hash] = frames[step - 1];
        // The recorded state hash, and a step whose last bit differs.
        for at in [hash, dt] {
            let mut bytes = good.clone();
            bytes[at] ^= 1;
            fs::write(&path, &bytes).expect("a file");
            let report = World::replay(&path, 1).expect("a replay");
            let found = report.difference.expect("a difference");
            assert_eq!((report.steps, found.step), (step as u64 - 1, step as u64));
            assert_ne!(found.recorded, found.replayed);
        }
    }
    fs::remove_file(&path).expect("the file");
}

#[test]
fn a_truncated_file_is_replayed_up_to_its_end() {
    let path = path("short");
    let mut world = hanging();
    world.start_recording(&path).expect("a file");
    for _ in 0..3 {
        world.step(2e-3).expect("a step");
    }
    world.stop_recording().expect("a recording");
    let good = fs::read(&path).expect("the file");
    let ends: Vec<usize> = frames(&good).iter().map(|[_, hash]| hash + 8).collect();
    let cuts = (12..good.len()).step_by(good.len() / 40);
    for length in cuts.chain(ends.iter().flat_map(|end| [end - 1, *end])) {
        fs::write(&path, &good[..length]).expect("a file");
        let report = World::replay(&path, 1).expect("a replay");
        let whole = ends.iter().filter(|&&end| end <= length).count() as u64;
        assert_eq!((report.steps, report.difference), (whole, None), "{length} bytes");
        assert_eq!(
            report.is_cut_short,
            length != 12 && !ends.contains(&length),
            "{length} bytes"
        );
    }
    for (bytes, is_fine) in [
        (&good[..4], false),
        (&b"something else"[..], false),
        (&good[..12], true),
    ] {
        fs::write(&path, bytes).expect("a file");
        assert_eq!(World::replay(&path, 1).is_ok(), is_fine);
    }
    fs::remove_file(&path).expect("the file");
    assert!(matches!(World::replay(&path, 1), Err(Error::Io(_))));
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_ends_the_recording_and_not_the_step() {
    let mut world = hanging();
    let mut plain = hanging();
    world.start_recording(&PathBuf::from("/dev/full")).expect("a file");
    for _ in 0..3 {
        world.step(2e-3).expect("a step");
        plain.step(2e-3).expect("a step");
    }
    assert_eq!(world.state_hash(), plain.state_hash());
    let ended = world.stop_recording();
    assert!(
        matches!(&ended, Err(Error::Io(message)) if message.contains("after 0 steps")),
        "{ended:?}"
    );
    assert!(matches!(world.stop_recording(), Err(Error::InvalidArgument(_))));
}

#[test]
fn a_recording_without_steps_is_valid() {
    let path = path("empty");
    let mut world = hanging();
    world.start_recording(&path).expect("a file");
    assert_eq!(world.stop_recording(), Ok(0));
    assert_eq!(World::replay(&path, 1), Ok(ReplayReport::default()));
    fs::remove_file(&path).expect("the file");
    assert!(matches!(
        world.start_recording(&path.join("no_such_folder")),
        Err(Error::Io(_))
    ));
}

#[test]
fn motion_of_a_haptic_handle_is_replayed() {
    let path = path("led");
    let mut world = hanging();
    let mut ball = ToolDefinition::new(Shape::Sphere { radius: 0.01 });
    ball.pose.position = Vec3::new(0.0, 0.03, 0.0);
    let tool = world.create_tool(&ball).expect("a tool");
    let mut handle = world.create_haptic(&HapticDefinition::new(tool)).expect("a handle");
    world.start_recording(&path).expect("a file");
    for step in 0..20 {
        let device = Pose {
            position: Vec3::new(0.0, 0.03 - 1.5e-3 * step as f32, 0.0),
            ..Pose::IDENTITY
        };
        handle.tick(device, None, None, 1e-3).expect("a tick");
        world.step(2e-3).expect("a step");
    }
    assert_eq!(world.stop_recording(), Ok(20));
    assert!(world.pose(tool).expect("a tool").position.y < 0.02, "it was led");
    let report = World::replay(&path, 1).expect("a replay");
    assert_eq!((report.steps, report.difference), (20, None));
    fs::remove_file(&path).expect("the file");
}
