//! A tick, and a step of one thread, call nothing that may block: RTSan ends the program at a blocking call.
//!
//! `RUSTC_BOOTSTRAP=1 RUSTFLAGS="-Zsanitizer=realtime --cfg realtime" cargo test --target x86_64-unknown-linux-gnu
//! --test sanitizers`
#![allow(unsafe_code)]

use glam::Vec3;
use sinew::mesh::Mesh;
use sinew::{BodyDefinition, HapticDefinition, Pose, Shape, Solver, ToolDefinition, Values, World, WorldDefinition};

unsafe extern "C" {
    fn __rtsan_realtime_enter();
    fn __rtsan_realtime_exit();
}

/// Calls a function that must not block.
fn nonblocking<T>(call: impl FnOnce() -> T) -> T {
    // SAFETY: they count, for this thread, in the sanitizer that the program is built with.
    unsafe { __rtsan_realtime_enter() };
    let result = call();
    // SAFETY: as above.
    unsafe { __rtsan_realtime_exit() };
    result
}

#[test]
fn a_hand_and_its_world_never_block() {
    let mesh = Mesh::block([0.1, 0.04, 0.1], [10, 4, 10]).expect("a block");
    for solver in [Solver::Verlet, Solver::Implicit] {
        let mut world = World::new(WorldDefinition::default()).expect("a world");
        let masses: Vec<f32> = mesh
            .positions
            .iter()
            .map(|place| if place.y < -0.019 { 0.0 } else { 6e-4 })
            .collect();
        let block = BodyDefinition {
            masses: Values::Each(&masses),
            stiffnesses: Values::Uniform(20.0),
            node_dampings: Values::Uniform(0.02),
            solver,
            ..BodyDefinition::of(&mesh)
        };
        let body = world.create_body(&block).expect("a body");
        let mut pose = Pose {
            position: Vec3::new(0.0, 0.035, 0.0),
            ..Pose::IDENTITY
        };
        let ball = ToolDefinition {
            pose,
            ..ToolDefinition::new(Shape::Sphere { radius: 0.01 })
        };
        let tool = world.create_tool(&ball).expect("a tool");
        let mut handle = world.create_haptic(&HapticDefinition::new(tool)).expect("a handle");
        let mut reader = world.create_reader(body).expect("a reader");
        let mut felt = 0.0_f32;
        for tick in 0..400 {
            pose.position.y -= 4e-5;
            let result = nonblocking(|| handle.tick(pose, None, None, 1e-3)).expect("a tick");
            felt = felt.max(result.force.y);
            if tick % 4 == 3 {
                nonblocking(|| world.step(4e-3)).expect("a step");
                assert!(nonblocking(|| reader.read().is_new));
            }
        }
        assert!(felt > 0.01, "{felt}");
    }
}

/// Checks the sanitizer itself: this test must fail.
#[test]
#[ignore = "ends the program"]
fn an_allocation_is_found() {
    nonblocking(|| drop(std::hint::black_box(vec![1_u8; 100])));
}
