//! Coulomb friction: it holds below its limit, slides at the limit, and never exceeds it.

use crate::support::tissue::*;
use glam::{DVec3, Quat, Vec3};
use sinew::mesh::Mesh;
use sinew::{BodyDefinition, Material, Model, Shape, Solver};

const DOWN: Vec3 = Vec3::new(0.0, -9.81, 0.0);

#[test]
fn the_force_stays_within_the_friction_cone() {
    // The normal of a plane is constant, so the cone applies to the total force.
    let mut random = Random::new(2);
    for friction in [0.05_f32, 0.3, 1.0] {
        let mut world = world(DOWN);
        let plane = tool(&mut world, Shape::Plane, friction, Vec3::ZERO, Quat::IDENTITY);
        let cloth = Tissue::VISCOUS.put(&mut world, &moved(square(0.2, 8), Vec3::Y * 0.002));
        let mut slipped = false;
        for step in 0..200 {
            let offset = Vec3::new(
                random.between(-0.01, 0.01),
                random.between(-0.002, 0.002),
                random.between(-0.01, 0.01),
            );
            let pose = world.pose(plane).expect("a tool");
            world.set_pose(plane, pose.position + offset, None).expect("a pose");
            world.step(0.01).expect("a step");
            let force = world.wrench(plane).expect("a tool").0.as_dvec3();
            let pressed = -force.y;
            let dragged = DVec3::new(force.x, 0.0, force.z).length();
            let limit = f64::from(friction) * pressed;
            assert!(pressed >= 0.0, "step {step}: the plane pulls: {force}");
            assert!(
                dragged <= limit * (1.0 + 1e-5),
                "friction {friction}, step {step}: {dragged} N above {limit}"
            );
            slipped |= dragged > 0.999 * limit && limit > 0.0;
        }
        assert!(
            slipped || friction > 0.9,
            "friction {friction}: the limit was never reached"
        );
        assert!(all_finite(body(&world, cloth)));
    }
}

/// Returns how far the middle of a cloth on a smooth plane follows a ball that presses on it and moves by `path`, with
/// the ball's mean force and torque.
fn dragged(friction: f32, path: Vec3, spin: Vec3) -> (DVec3, DVec3, DVec3) {
    let mut world = world(DOWN);
    tool(&mut world, Shape::Plane, 0.0, Vec3::ZERO, Quat::IDENTITY);
    let cloth = Tissue::CALM.put(&mut world, &square(0.2, 16));
    let radius = 0.02;
    // Between a node, an edge and a face, and deep enough to squeeze the cloth against the plane.
    let start = Vec3::new(0.004, radius - 0.0002, 0.003);
    let ball = tool(&mut world, Shape::Sphere { radius }, friction, start, Quat::IDENTITY);
    for _ in 0..50 {
        world.step(0.005).expect("a step");
    }
    let before = centre(body(&world, cloth));
    let (mut force, mut torque) = (DVec3::ZERO, DVec3::ZERO);
    for step in 1..=200 {
        let part = step as f32 / 200.0;
        let rotation = Quat::from_scaled_axis(spin * part);
        world
            .set_pose(ball, start + path * part, Some(rotation))
            .expect("a pose");
        world.step(0.005).expect("a step");
        let wrench = world.wrench(ball).expect("a tool");
        force += wrench.0.as_dvec3() / 200.0;
        torque += wrench.1.as_dvec3() / 200.0;
    }
    (centre(body(&world, cloth)) - before, force, torque)
}

#[test]
fn a_moving_ball_drags_the_cloth_only_by_friction() {
    let path = Vec3::new(0.05, 0.0, 0.02);
    let (followed, _, _) = dragged(5.0, path, Vec3::ZERO);
    // The cloth sticks at the few nodes under the ball, and the rest follows.
    let part = followed.dot(path.as_dvec3()) / path.as_dvec3().length_squared();
    assert!((0.5..1.02).contains(&part), "{followed} of {path}");
    let (stayed, _, _) = dragged(0.0, path, Vec3::ZERO);
    assert!(
        stayed.length() < 0.1 * followed.length(),
        "{stayed} without friction, {followed} with friction"
    );
}

/// Returns the mean force and torque on a ball that spins while pressed into a cloth with a pinned border.
fn spin_on_cloth(friction: f32) -> (DVec3, DVec3) {
    let mut world = world(Vec3::ZERO);
    let cloth = Tissue::CALM.put(&mut world, &square(0.2, 12));
    pin_all(&mut world, cloth, &rim(12));
    let start = Vec3::new(0.004, 0.021, 0.003);
    let ball = tool(
        &mut world,
        Shape::Sphere { radius: 0.02 },
        friction,
        start,
        Quat::IDENTITY,
    );
    let (mut force, mut torque) = (DVec3::ZERO, DVec3::ZERO);
    for step in 1..=300_u16 {
        let position = start - Vec3::Y * 0.03 * (f32::from(step) / 100.0).min(1.0);
        let rotation = Quat::from_rotation_z(0.1 * f32::from(step.saturating_sub(100)));
        world.set_pose(ball, position, Some(rotation)).expect("a pose");
        world.step(0.005).expect("a step");
        if step > 200 {
            let wrench = world.wrench(ball).expect("a tool");
            force += wrench.0.as_dvec3() / 100.0;
            torque += wrench.1.as_dvec3() / 100.0;
        }
    }
    (force, torque)
}

#[test]
fn a_spinning_ball_drags_sideways() {
    // When it rotates about +z, its lowest point moves along +x, and the cloth pulls it back.
    let friction = 0.3;
    let (force, torque) = spin_on_cloth(friction);
    assert!(force.y > 0.05, "{force}");
    assert!(force.x < -0.5 * f64::from(friction) * force.y, "{force}");
    // All of the contact slips, so friction acts at its limit: at most mu times the normal force, with the radius as
    // lever arm. The normal forces point to the middle, so their magnitudes add up to more than the upward force, here
    // by less than half.
    let least = 0.02 * f64::from(friction) * force.y;
    assert!(
        (0.8..1.5).contains(&(-torque.z / least)),
        "torque {torque}, at least about {least}"
    );
    let (_, smooth) = spin_on_cloth(0.0);
    assert!(smooth.length() < 1e-4 * least, "{smooth}");
}

/// Presses a tool 6 mm into stiff tissue off its middle. Returns the force at rest (N), and the largest energy beyond
/// the tool's work (J).
fn pressed(solver: Solver, shape: Shape, friction: f32) -> (f64, f64) {
    const FRAME: f32 = 1.0 / 60.0;
    const SIZE: [f32; 3] = [0.05, 0.025, 0.025];
    let mut world = world(Vec3::ZERO);
    let mesh = Mesh::block(SIZE, [6, 3, 3]).expect("a block");
    let definition = BodyDefinition {
        material: Some(Material {
            model: Model::Tetrahedra,
            young_modulus: 2.5e5,
            poisson_ratio: 0.3,
            density: 1000.0,
            ..Default::default()
        }),
        damping_rate: 3.0,
        solver,
        ..BodyDefinition::of(&mesh)
    };
    let body = world.create_body(&definition).expect("a body");
    for (node, position) in (0..).zip(&mesh.positions) {
        if position.y < -0.49 * SIZE[1] {
            world.body_mut(body).expect("a body").pin(node).expect("a pin");
        }
    }
    let start = Vec3::new(0.0025, 0.5 * SIZE[1] + 0.003, 0.001);
    let tool = tool(&mut world, shape, friction, start, Quat::IDENTITY);
    let (mut work, mut gain, mut force) = (0.0, 0.0_f64, 0.0);
    for frame in 1..=18 {
        let path = Vec3::new(0.0, -0.006 / 12.0, 0.0);
        let position = start + path * frame.min(12) as f32;
        let before = world.pose(tool).expect("a tool").position;
        world.set_pose(tool, position, None).expect("a pose");
        world.step(FRAME).expect("a step");
        force = f64::from(world.wrench(tool).expect("a tool").0.y);
        work -= force * f64::from(position.y - before.y);
        let energy = world.body(body).expect("a body").energy(Vec3::ZERO);
        gain = gain.max(energy.kinetic + energy.elastic - work);
    }
    (force, gain)
}

/// Friction is as strong with solved equations, although stiff tissue holds their nodes.
#[test]
fn implicit_solvers_press_stiff_tissue_as_verlet_does() {
    let half_extents = Vec3::new(0.004, 0.003, 0.004);
    for (shape, friction) in [
        (Shape::Sphere { radius: 0.003 }, 0.3),
        (Shape::Box { half_extents }, 0.3),
    ] {
        let (expected, _) = pressed(Solver::Verlet, shape, friction);
        for solver in [Solver::Implicit, Solver::Newton] {
            let case = format!("{solver:?}, {shape:?}, friction {friction}");
            let (force, gain) = pressed(solver, shape, friction);
            assert!((force / expected - 1.0).abs() < 0.08, "{case}: {force} N of {expected}");
            assert!(gain < 0.03 * 0.006 * expected, "{case}: {gain} J");
        }
    }
}
