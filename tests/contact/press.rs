//! Spheres and capsules pressed into a cloth that is pinned at its border: the force on the tool equals the force on
//! the border.

use crate::support::organ::of_elements;
use crate::support::tissue::*;
use glam::{Quat, Vec3};
use sinew::mesh::Mesh;
use sinew::{BodyDefinition, Shape, Solver};

const DOWN: Vec3 = Vec3::new(0.0, -9.81, 0.0);
const SIZE: f32 = 0.2;
const TISSUE: Tissue = Tissue {
    mass: 0.05,
    stiffness: 30.0,
    drag: 8.0,
    spring_damping: 0.02,
};

/// Presses a tool into a cloth of `cells` by `depth` over half a second, then holds it, and checks penetration and
/// forces.
fn press(dt: f32, cells: u32, shape: Shape, radius: f32, orientation: Quat, offset: Vec3, depth: f32) {
    let case = format!("dt {dt}, {cells} cells, {shape:?}, aside {offset}");
    let mesh = square(SIZE, cells);
    let mut world = world(DOWN);
    let cloth = TISSUE.put(&mut world, &mesh);
    let pins = rim(cells);
    pin_all(&mut world, cloth, &pins);
    // The cloth sags before contact.
    for _ in 0..(0.5 / dt) as u32 {
        world.step(dt).expect("a step");
    }
    let start = offset + Vec3::Y * (radius + 0.001);
    let tip = tool(&mut world, shape, 0.0, start, orientation);
    let press_steps = (0.5 / dt) as u32;
    let mut deepest = f64::NEG_INFINITY;
    for step in 1..=press_steps {
        let displacement = depth * step as f32 / press_steps as f32;
        world
            .set_pose(tip, start - Vec3::Y * displacement, None)
            .expect("a pose");
        world.step(dt).expect("a step");
        deepest = deepest.max(penetration_of(&world, cloth, shape, tip));
    }
    for step in 0..(2.0 / dt) as u32 {
        world.step(dt).expect("a step");
        if step % 10 == 0 {
            deepest = deepest.max(penetration_of(&world, cloth, shape, tip));
        }
    }
    assert!(deepest < 0.001, "{case}: {deepest} m deep");
    assert!(kinetic(&world, cloth) < 1e-9, "{case}: J {}", kinetic(&world, cloth));

    // At rest, the forces on the tool, the border and the weight balance.
    let (force, torque) = world.wrench(tip).expect("a tool");
    let mass = f64::from(TISSUE.node_mass(&mesh));
    let weight = DOWN.as_dvec3() * mass * mesh.positions.len() as f64;
    let carried = pin_forces(&world, cloth, &pins) + weight;
    let error = force.as_dvec3().distance(carried);
    assert!(carried.y > 0.02, "{case}: no force to measure: {carried}");
    assert!(
        error < 0.02 * carried.length(),
        "{case}: {force} on the tool, {carried} carried"
    );
    let pose = world.pose(tip).expect("a tool").position.as_dvec3();
    let middle = centre(body(&world, cloth));
    let moment = pin_moments(&world, cloth, &pins, pose) + (middle - pose).cross(weight);
    let error = torque.as_dvec3().distance(moment);
    assert!(
        error < 0.02 * carried.length() * f64::from(SIZE) / 2.0,
        "{case}: torque {torque} on the tool, {moment} carried"
    );
    // A ball without friction has no torque about its center.
    if let Shape::Sphere { .. } = shape {
        let error = f64::from(torque.length());
        assert!(
            error < 1e-4 * carried.length() * f64::from(radius),
            "{case}: torque {torque}"
        );
    }
    // The tool leaves, and its wrench is exactly zero.
    world.set_pose(tip, start + Vec3::Y * 0.2, None).expect("a pose");
    world.step(dt).expect("a step");
    world.step(dt).expect("a step");
    let (force, torque) = world.wrench(tip).expect("a tool");
    assert_eq!(
        (force, torque),
        (Vec3::ZERO, Vec3::ZERO),
        "{case}: force after contact has ended"
    );
}

#[test]
fn the_force_on_spheres_equals_the_force_on_the_border() {
    check_the_force_on_spheres_equals_the_force_on_the_border(&[(1.0 / 60.0, 20), (1.0 / 30.0, 8)]);
}

#[test]
#[ignore = "long"]
fn the_force_on_spheres_equals_the_force_on_the_border_in_the_other_cases() {
    check_the_force_on_spheres_equals_the_force_on_the_border(&[
        (0.001, 8),
        (0.001, 20),
        (1.0 / 60.0, 8),
        (1.0 / 30.0, 20),
    ]);
}

fn check_the_force_on_spheres_equals_the_force_on_the_border(cases: &[(f32, u32)]) {
    for &(dt, cells) in cases {
        let radius = 0.02;
        let offset = Vec3::new(0.013, 0.0, 0.021);
        press(
            dt,
            cells,
            Shape::Sphere { radius },
            radius,
            Quat::IDENTITY,
            offset,
            0.05,
        );
    }
}

#[test]
fn spheres_smaller_than_the_mesh_do_not_slip_through() {
    check_spheres_smaller_than_the_mesh_do_not_slip_through(&[1.0 / 60.0]);
}

#[test]
#[ignore = "long"]
fn spheres_smaller_than_the_mesh_do_not_slip_through_in_other_steps() {
    check_spheres_smaller_than_the_mesh_do_not_slip_through(&[0.002, 1.0 / 30.0]);
}

fn check_spheres_smaller_than_the_mesh_do_not_slip_through(steps: &[f32]) {
    // On a face, an edge, a node, and another point. Such a sphere meets only faces and edges.
    let spacing = SIZE / 10.0;
    let targets = [
        Vec3::new(0.3, 0.0, 0.15),
        Vec3::new(0.5, 0.0, 0.0),
        Vec3::new(0.5, 0.0, 0.5),
        Vec3::new(0.0, 0.0, 0.0),
        Vec3::new(0.0, 0.0, 0.37),
        Vec3::new(-1.71, 0.0, 2.23),
    ];
    for &dt in steps {
        for target in targets {
            for radius in [0.002, 0.006] {
                press(
                    dt,
                    10,
                    Shape::Sphere { radius },
                    radius,
                    Quat::IDENTITY,
                    target * spacing,
                    0.03,
                );
            }
        }
    }
}

#[test]
fn capsules_rest_in_the_cloth() {
    check_capsules_rest_in_the_cloth(&[(1.0 / 60.0, 16, 0.5), (1.0 / 60.0, 9, 1.1)]);
}

#[test]
#[ignore = "long"]
fn capsules_rest_in_the_cloth_in_the_other_cases() {
    check_capsules_rest_in_the_cloth(&[(0.001, 16, 0.0), (1.0 / 30.0, 20, 0.3)]);
}

fn check_capsules_rest_in_the_cloth(cases: &[(f32, u32, f32)]) {
    for &(dt, cells, angle) in cases {
        for (radius, half_length) in [(0.01, 0.04), (0.004, 0.05)] {
            let lying = Quat::from_rotation_y(angle) * Quat::from_rotation_z(std::f32::consts::FRAC_PI_2);
            let shape = Shape::Capsule { radius, half_length };
            press(dt, cells, shape, radius, lying, Vec3::new(0.011, 0.0, -0.007), 0.03);
        }
    }
}

#[test]
fn the_force_on_a_box_on_a_block_matches_theory_at_rest() {
    assert_force_at_rest_matches_theory(2);
}

#[test]
#[ignore = "long"]
fn the_force_on_a_box_on_a_fine_block_matches_theory_at_rest() {
    assert_force_at_rest_matches_theory(3);
}

/// The strain is uniform, which elements of any size represent exactly.
fn assert_force_at_rest_matches_theory(cells: u32) {
    const SIDE: f32 = 0.04;
    const STRAIN: f32 = 2e-3;
    let mesh = Mesh::block([SIDE; 3], [cells; 3]).expect("a block");
    let definition = BodyDefinition {
        solver: Solver::Newton,
        ..of_elements(&mesh, [5000.0, 0.3, 1000.0])
    };
    let mut world = world(Vec3::ZERO);
    let block = world.create_body(&definition).expect("a body");
    // The block is free to widen: pinned along y at its lower side, and along x and z at one side each.
    for (node, rest) in (0..).zip(&mesh.positions) {
        let pinned_axes = rest.to_array().map(|at| at < -0.499 * SIDE);
        if pinned_axes.contains(&true) {
            world
                .body_mut(block)
                .expect("the body")
                .pin_axes(node, pinned_axes)
                .expect("a node");
        }
    }
    let half_extents = Vec3::new(0.05, 0.01, 0.06);
    let above = Vec3::Y * (0.5 * SIDE + 0.01);
    let tip = tool(
        &mut world,
        Shape::Box { half_extents },
        0.0,
        above + Vec3::Y * 1e-4,
        Quat::IDENTITY,
    );
    world
        .set_pose(tip, above - Vec3::Y * STRAIN * SIDE, None)
        .expect("a pose");
    for _ in 0..50 {
        world.step(0.1).expect("a step");
    }
    let (force, torque) = world.wrench(tip).expect("a tool");
    let expected = 5000.0 * STRAIN * SIDE * SIDE;
    assert!((force.y / expected - 1.0).abs() < 0.01, "{force}, {expected} of theory");
    assert!(force.x.abs() + force.z.abs() < 1e-3 * expected, "{force}");
    assert!(torque.length() < 1e-2 * expected * SIDE, "{torque}");
}

#[test]
fn a_standing_capsule_is_a_sphere_at_its_tip() {
    let shape = Shape::Capsule {
        radius: 0.005,
        half_length: 0.05,
    };
    for dt in [0.002, 1.0 / 60.0] {
        press(dt, 12, shape, 0.055, Quat::IDENTITY, Vec3::new(0.004, 0.0, 0.001), 0.03);
    }
}

#[test]
fn pin_forces_include_the_tool_forces_on_pinned_nodes() {
    // All nodes but the middle one are pinned. The ball lies on edges and faces between it and the others.
    let mut world = world(Vec3::ZERO);
    let cloth = TISSUE.put(&mut world, &square(0.1, 2));
    let pins = rim(2);
    pin_all(&mut world, cloth, &pins);
    let ball = sphere(&mut world, 0.01, Vec3::new(0.03, 0.011, 0.004));
    for step in 1..=600 {
        let down = 0.011 - 0.02 * (step as f32 / 200.0).min(1.0);
        world
            .set_pose(ball, Vec3::new(0.03, down, 0.004), None)
            .expect("a pose");
        world.step(0.005).expect("a step");
    }
    let force = world.wrench(ball).expect("a tool").0.as_dvec3();
    let carried = pin_forces(&world, cloth, &pins);
    assert!(kinetic(&world, cloth) < 1e-10);
    assert!(force.length() > 0.01, "no force to measure: {force}");
    assert!(
        force.distance(carried) < 0.02 * force.length(),
        "{force} on the tool, {carried} carried"
    );
}
