//! Ticks, steps and frames, each on its own thread.

use std::sync::atomic::{AtomicU32, Ordering};
use std::thread;

use super::bench::*;
use glam::{Quat, Vec3, vec3};
use sinew::{Pose, Solver};

/// The ticks per step, and the number of ticks that the hand may be ahead.
const EVERY: u32 = 16;
const AHEAD: u32 = 24;
const TICKS: u32 = 480;
const STEP: f32 = EVERY as f32 * TICK;

#[test]
fn a_concurrent_haptic_session_can_be_replayed() {
    let Bench {
        mut world,
        body,
        tool,
        mut handle,
        ..
    } = Bench::new(Solver::Implicit, 0);
    let mut reader = world.create_reader(body).unwrap();
    let (ticked, stepped) = (AtomicU32::new(0), AtomicU32::new(0));
    let wait_for = |count: &AtomicU32, least: u32| {
        let mut patience = 50_000_000;
        while count.load(Ordering::Relaxed) < least {
            thread::yield_now();
            patience -= 1;
            assert!(patience > 0, "another thread has failed");
        }
    };
    let targets: Vec<Pose> = thread::scope(|scope| {
        scope.spawn(|| {
            let (mut version, mut largest) = (0, 0.0_f32);
            for tick in 1..=TICKS {
                wait_for(&stepped, tick.saturating_sub(AHEAD) / EVERY);
                let t = tick as f32 * TICK;
                let pose = Pose {
                    position: vec3(0.01 * (2.0 * t).sin(), RADIUS - 4e-3 * (5.0 * t).sin(), 0.0),
                    orientation: Quat::from_rotation_x(3.0 * t),
                };
                let result = handle.tick(pose, None, None, TICK).unwrap();
                assert!(result.version >= version, "{} after {version}", result.version);
                version = result.version;
                largest = largest.max(result.force.length());
                handle.contacts(|contact| assert!((contact.normal.length() - 1.0).abs() < 1e-4, "{contact:?}"));
                ticked.store(tick, Ordering::Relaxed);
            }
            assert!(version > 0 && largest > 0.01, "{version} steps, {largest} N");
        });
        scope.spawn(|| {
            let mut version = 0;
            while ticked.load(Ordering::Relaxed) < TICKS {
                let frame = reader.read();
                assert!(frame.version >= version);
                version = frame.version;
                assert!(frame.positions.iter().all(|node| node.is_finite()));
                thread::yield_now();
            }
        });
        let targets = (0..TICKS / EVERY).map(|step| {
            wait_for(&ticked, step * EVERY);
            world.step(STEP).unwrap();
            stepped.store(step + 1, Ordering::Relaxed);
            world.tool_target(tool).unwrap()
        });
        targets.collect()
    });
    assert!(
        targets
            .iter()
            .any(|pose| pose.orientation.angle_between(Quat::IDENTITY) > 0.1)
    );
    let Bench {
        world: mut replayed,
        tool,
        handle,
        ..
    } = Bench::new(Solver::Implicit, 0);
    drop(handle);
    for pose in targets {
        replayed.set_pose(tool, pose.position, Some(pose.orientation)).unwrap();
        replayed.step(STEP).unwrap();
    }
    assert_eq!(replayed.state_hash(), world.state_hash());
    assert_ne!(replayed.wrench(tool).unwrap().0, Vec3::ZERO);
}
