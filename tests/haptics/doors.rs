//! Refused calls, the end of haptic handles, and reproducibility.

use super::bench::*;
use glam::{DVec3, Quat, Vec3, dvec3, vec3};
use sinew::{Error, HapticDefinition, Pose, Shape, Solver, ToolDefinition};

const TOP: f64 = RADIUS as f64;

#[test]
fn a_tool_with_a_haptic_handle_refuses_other_poses() {
    let mut bench = Bench::new(Solver::Verlet, 16);
    let refused = |error: Error| matches!(&error, Error::InvalidArgument(message) if message.contains("haptic handle"));
    assert!(refused(bench.world.set_pose(bench.tool, Vec3::ZERO, None).unwrap_err()));
    let definition = HapticDefinition::new(bench.tool);
    assert!(refused(bench.world.create_haptic(&definition).unwrap_err()));
    let Bench {
        mut world,
        tool,
        mut handle,
        ..
    } = bench;
    assert!(!handle.is_over());
    // Dropping the handle discards its last pose.
    handle.tick(Pose::IDENTITY, None, None, TICK).unwrap();
    drop(handle);
    world.set_pose(tool, vec3(0.0, 0.1, 0.0), None).unwrap();
    world.step(0.01).unwrap();
    assert_eq!(world.pose(tool).unwrap().position, vec3(0.0, 0.1, 0.0));
    world.create_haptic(&definition).unwrap();
}

#[test]
fn values_out_of_range_are_refused_by_name() {
    let mut bench = Bench::new(Solver::Verlet, 16);
    let tool = bench
        .world
        .create_tool(&ToolDefinition::new(Shape::Sphere { radius: RADIUS }))
        .unwrap();
    let good = HapticDefinition::new(tool);
    type Change = fn(&mut HapticDefinition);
    let cases: [(&str, Change); 10] = [
        ("stiffness", |definition| definition.stiffness = 0.0),
        ("angular_stiffness", |definition| definition.angular_stiffness = -1.0),
        ("angular_stiffness", |definition| definition.angular_stiffness = 1e-30),
        ("damping_ratio", |definition| definition.damping_ratio = f32::NAN),
        ("device_mass", |definition| definition.device_mass = f32::INFINITY),
        ("force_limit", |definition| definition.force_limit = -3.0),
        ("torque_limit", |definition| definition.torque_limit = -0.5),
        ("force_rate_limit", |definition| definition.force_rate_limit = f32::NAN),
        ("stale_after", |definition| definition.stale_after = 0.0),
        ("ramp", |definition| definition.ramp = -1.0),
    ];
    for (name, change) in cases {
        let mut bad = good;
        change(&mut bad);
        match bench.world.create_haptic(&bad) {
            Err(Error::InvalidArgument(message)) => assert!(message.starts_with(name), "{name}: {message}"),
            other => panic!("{name}: {other:?}"),
        }
    }
    bench.world.destroy_tool(tool).unwrap();
    assert!(matches!(bench.world.create_haptic(&good), Err(Error::StaleId(_))));
}

#[test]
fn a_refused_tick_changes_nothing() {
    let pose = |x: f32| Pose {
        position: vec3(0.0, RADIUS - 0.004 + x, 0.0),
        orientation: Quat::IDENTITY,
    };
    let mut benches = [0, 1].map(|_| Bench::new(Solver::Verlet, 16));
    for bench in &mut benches {
        bench.follow(0.5, |t| dvec3(0.0, TOP - 0.01 * t.min(0.4), 0.0));
    }
    let [tried, other] = &mut benches;
    let none = Quat::from_xyzw(0.0, 0.0, 0.0, 0.0);
    let invalid_pose = Pose {
        orientation: none,
        ..pose(0.0)
    };
    for (pose, velocity, spin, dt, name) in [
        (pose(f32::NAN), Vec3::ZERO, Vec3::ZERO, TICK, "position"),
        (invalid_pose, Vec3::ZERO, Vec3::ZERO, TICK, "orientation"),
        (pose(0.0), Vec3::NAN, Vec3::ZERO, TICK, "velocity"),
        (pose(0.0), Vec3::ZERO, Vec3::INFINITY, TICK, "angular_velocity"),
        (pose(0.0), Vec3::ZERO, Vec3::ZERO, 0.0, "dt"),
        (pose(0.0), Vec3::ZERO, Vec3::ZERO, 2.0, "dt"),
    ] {
        match tried.handle.tick(pose, Some(velocity), Some(spin), dt) {
            Err(Error::InvalidArgument(message)) => assert!(message.starts_with(name), "{name}: {message}"),
            other => panic!("{name}: {other:?}"),
        }
    }
    for bench in [&mut *tried, &mut *other] {
        bench.follow(0.1, |t| dvec3(0.0, TOP - 0.004 - 0.01 * t, 0.0));
    }
    let [a, b] = [tried, other].map(|bench| {
        (
            bench.tick(dvec3(0.0, TOP, 0.0), dvec3(0.0, 0.1, 0.0)).tick,
            bench.world.state_hash(),
        )
    });
    assert_eq!(a, b);
}

#[test]
fn the_force_fades_out_after_tool_or_world_is_destroyed() {
    for with_world in [false, true] {
        let mut bench = Bench::new(Solver::Verlet, 16);
        bench.follow(0.5, |t| dvec3(0.0, TOP - 0.01 * t.min(0.4), 0.0));
        let Bench {
            mut world,
            tool,
            mut handle,
            ..
        } = bench;
        world.destroy_tool(tool).unwrap();
        let remaining_world = (!with_world).then_some(world);
        assert!(handle.is_over());
        let pose = Pose {
            position: vec3(0.0, RADIUS - 0.004, 0.0),
            orientation: Quat::IDENTITY,
        };
        let mut last = handle.tick(pose, None, None, TICK).unwrap();
        assert!(last.force.y > 0.1);
        for _ in 0..500 {
            last = handle.tick(pose, None, None, TICK).unwrap();
        }
        assert_eq!(last.force, Vec3::ZERO);
        drop(remaining_world);
    }
}

#[test]
fn a_haptic_session_can_be_replayed() {
    let path = |t: f64| dvec3(0.01 * t, TOP + 0.002 - 0.006 * (7.0 * t).sin(), 0.003 * t);
    let mut bench = Bench::new(Solver::Implicit, 16);
    let mut targets = Vec::new();
    let mut t = 0.0;
    for tick in 1..=800 {
        t += f64::from(TICK);
        bench.tick(path(t), DVec3::ZERO);
        if tick % 16 == 0 {
            targets.push(bench.world.tool_target(bench.tool).unwrap());
        }
    }
    let hash = bench.world.state_hash();
    let Bench {
        mut world,
        tool,
        handle,
        ..
    } = Bench::new(Solver::Implicit, 16);
    drop(handle);
    for pose in targets {
        world.set_pose(tool, pose.position, Some(pose.orientation)).unwrap();
        world.step(16.0 * TICK).unwrap();
    }
    assert_eq!(world.state_hash(), hash);
}

#[test]
fn any_device_input_returns_finite_results() {
    assert_finite_results(30);
}

#[test]
#[ignore = "long"]
fn any_long_device_input_returns_finite_results() {
    assert_finite_results(700);
}

/// Steps take longer the more the tissue is distorted.
fn assert_finite_results(rounds: u32) {
    let mut state = 3_u64;
    let mut unit = || {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 40) as f32 / (1 << 24) as f32
    };
    let mut bench = Bench::new(Solver::Verlet, 0);
    for round in 0..rounds {
        // Mostly near the tissue, sometimes anywhere, at any speed and after any time.
        let is_wild = round % 7 == 0;
        let size = if is_wild { 1e9 * unit() } else { 0.02 };
        let mut vector = |size: f32| size * (2.0 * vec3(unit(), unit(), unit()) - Vec3::ONE);
        let position = vector(size) + RADIUS * Vec3::Y;
        let (velocity, spin) = (vector(if is_wild { f32::MAX } else { 1.0 }), vector(10.0));
        let rotation = Quat::from_scaled_axis(vector(3.0));
        let dt = if is_wild { 10f32.powf(-30.0 * unit()) } else { 1e-3 };
        let pose = Pose {
            position,
            orientation: rotation,
        };
        let has_velocities = round % 3 > 0;
        let tick = bench
            .handle
            .tick(
                pose,
                has_velocities.then_some(velocity),
                has_velocities.then_some(spin),
                dt,
            )
            .unwrap();
        assert!(tick.force.is_finite() && tick.torque.is_finite(), "{round}: {tick:?}");
        assert!(
            tick.proxy.position.is_finite() && tick.proxy.orientation.is_finite(),
            "{round}: {tick:?}"
        );
        assert!(tick.lost.is_finite() && tick.gain.is_finite(), "{round}: {tick:?}");
        if round % 20 == 0 {
            // Tissue that a tool passed through at any speed can need more substeps than allowed.
            let stepped = bench.world.step(1e-3 + 0.02 * unit());
            assert!(
                matches!(stepped, Ok(_) | Err(Error::Unstable { .. })),
                "{round}: {stepped:?}"
            );
            let tissue = bench.world.body(bench.body).unwrap();
            assert!(tissue.positions().iter().all(|node| node.is_finite()), "{round}");
        }
    }
}
