//! Tools that move far in one step, and fast bodies: nothing passes through.

use crate::support::tissue::*;
use glam::{Quat, Vec3};
use sinew::{BodyDefinition, Shape, Values, World};

const SIZE: f32 = 0.2;
const RADIUS: f32 = 0.005;
const TISSUE: Tissue = Tissue {
    mass: 0.02,
    stiffness: 30.0,
    drag: 20.0,
    spring_damping: 0.01,
};

/// Target points on a cloth with cells of size 1: a node, edges along and across, the middle of a face, other points.
const AIMS: [Vec3; 6] = [
    Vec3::new(0.0, 0.0, 0.0),
    Vec3::new(0.5, 0.0, 0.0),
    Vec3::new(1.0, 0.0, 0.5),
    Vec3::new(0.5, 0.0, 0.5),
    Vec3::new(0.35, 0.0, 0.3),
    Vec3::new(1.62, 0.0, -2.17),
];

/// Moves a tip to the other side of a cloth in one step. Returns an error message on failure.
fn put_through(
    substeps: u32,
    dt: f32,
    cells: u32,
    shape: Shape,
    (from, to): (Vec3, Vec3),
    orientation: Quat,
) -> Result<(), String> {
    let mesh = square(SIZE, cells);
    let mut world = world_of(Vec3::ZERO, substeps);
    let cloth = TISSUE.put(&mut world, &mesh);
    pin_all(&mut world, cloth, &rim(cells));
    let tip = tool(&mut world, shape, 0.0, from, orientation);
    world.step(dt).map_err(|error| error.to_string())?;
    world.set_pose(tip, to, None).expect("a pose");
    for step in 0..16 {
        let report = world.step(dt).map_err(|error| format!("step {step}: {error}"))?;
        if report.bodies_restored > 0 {
            return Err(format!("step {step}: restored"));
        }
        let beyond = winding(body(&world, cloth), &mesh, to.as_dvec3());
        let depth = if step % 5 == 0 {
            penetration_of(&world, cloth, shape, tip)
        } else {
            0.0
        };
        if (beyond.abs() - 1.0).abs() > 0.01 {
            return Err(format!("step {step}: passed through, winding {beyond}, {depth} m deep"));
        }
        // Half the tip is the limit for a jump, and a millimeter afterwards. The edge of a box cuts slightly deeper (at
        // most 1.08 mm).
        let settled = if matches!(shape, Shape::Box { .. }) {
            0.0015
        } else {
            0.001
        };
        let allowed = if dt * (step as f32) < 0.1 {
            0.5 * f64::from(RADIUS)
        } else {
            settled
        };
        if depth > allowed {
            return Err(format!("step {step}: {depth} m deep"));
        }
    }
    Ok(())
}

fn put_through_everywhere(
    cases: &[(u32, f32)],
    substeps: impl Fn(f32, u32) -> u32,
    shape: Shape,
    orientation: Quat,
    reach: f32,
) {
    let mut failures = Vec::new();
    let mut count = 0;
    let mut random = Random::new(5);
    for &(cells, dt) in cases {
        let spacing = SIZE / cells as f32;
        for aim in AIMS {
            for (above, below, slant) in [
                (0.001, 0.02, random.vector() * Vec3::new(0.8, 0.0, 0.8)),
                (0.06, 0.04, Vec3::ZERO),
                (0.03, 0.03, random.vector() * Vec3::new(0.8, 0.0, 0.8)),
            ] {
                // The height above the cloth is exact for any slant of the path.
                let direction = Vec3::Y + slant;
                let from = aim * spacing + direction * (RADIUS + above) + Vec3::Y * reach;
                let to = aim * spacing - direction * (RADIUS + below) - Vec3::Y * reach;
                count += 1;
                let substeps = substeps(dt, cells);
                if let Err(how) = put_through(substeps, dt, cells, shape, (from, to), orientation) {
                    failures.push(format!(
                        "{substeps} substeps, dt {dt}, {cells} cells, {from} to {to}: {how}"
                    ));
                }
            }
        }
    }
    assert!(
        failures.is_empty(),
        "{} of {count}:\n{}",
        failures.len(),
        failures.join("\n")
    );
}

#[test]
fn a_tip_carries_the_cloth_with_it() {
    check_a_tip_carries_the_cloth_with_it(&[(8, 1.0 / 60.0), (16, 1.0 / 30.0)]);
}

#[test]
#[ignore = "long"]
fn a_tip_carries_the_cloth_with_it_in_the_other_cases() {
    check_a_tip_carries_the_cloth_with_it(&[(8, 0.002), (8, 1.0 / 30.0), (16, 0.002), (16, 1.0 / 60.0)]);
}

fn check_a_tip_carries_the_cloth_with_it(cases: &[(u32, f32)]) {
    put_through_everywhere(cases, |_, _| 0, Shape::Sphere { radius: RADIUS }, Quat::IDENTITY, 0.0);
}

#[test]
fn a_tip_carries_the_cloth_with_it_in_few_substeps() {
    check_a_tip_carries_the_cloth_with_it_in_few_substeps(&[(8, 1.0 / 60.0)]);
}

#[test]
#[ignore = "long"]
fn a_tip_carries_the_cloth_with_it_in_few_substeps_in_the_other_cases() {
    check_a_tip_carries_the_cloth_with_it_in_few_substeps(&[
        (8, 0.002),
        (8, 1.0 / 30.0),
        (16, 0.002),
        (16, 1.0 / 60.0),
        (16, 1.0 / 30.0),
    ]);
}

fn check_a_tip_carries_the_cloth_with_it_in_few_substeps(cases: &[(u32, f32)]) {
    // As few substeps as the springs allow.
    let substeps = |dt: f32, cells: u32| (dt * cells as f32 / 0.0064).ceil() as u32;
    put_through_everywhere(cases, substeps, Shape::Sphere { radius: RADIUS }, Quat::IDENTITY, 0.0);
}

#[test]
fn an_instrument_carries_the_cloth_with_it() {
    check_an_instrument_carries_the_cloth_with_it(&[(8, 1.0 / 60.0)]);
}

#[test]
#[ignore = "long"]
fn an_instrument_carries_the_cloth_with_it_in_the_other_cases() {
    check_an_instrument_carries_the_cloth_with_it(&[(8, 0.002), (8, 1.0 / 30.0)]);
}

fn check_an_instrument_carries_the_cloth_with_it(cases: &[(u32, f32)]) {
    let shape = Shape::Capsule {
        radius: RADIUS,
        half_length: 0.03,
    };
    put_through_everywhere(cases, |_, _| 0, shape, Quat::IDENTITY, 0.03);
    let lying = Quat::from_rotation_y(0.4) * Quat::from_rotation_z(1.5);
    put_through_everywhere(cases, |_, _| 0, shape, lying, 0.003);
}

#[test]
fn a_resting_tip_jumps_aside_and_down() {
    // The tip already touches a node, an edge or a face when it moves.
    let mut failures = Vec::new();
    let mut random = Random::new(9);
    let mut count = 0;
    for substeps in [0, 20] {
        for aim in AIMS {
            for _ in 0..6 {
                let from = aim * SIZE / 10.0 + Vec3::Y * (RADIUS + 1e-6);
                let to = from
                    + Vec3::new(
                        random.between(-0.03, 0.03),
                        random.between(-0.06, -0.02),
                        random.between(-0.03, 0.03),
                    );
                count += 1;
                let shape = Shape::Sphere { radius: RADIUS };
                if let Err(how) = put_through(substeps, 0.01, 10, shape, (from, to), Quat::IDENTITY) {
                    failures.push(format!("{substeps} substeps, {from} to {to}: {how}"));
                }
            }
        }
    }
    assert!(
        failures.is_empty(),
        "{} of {count}:\n{}",
        failures.len(),
        failures.join("\n")
    );
}

/// Creates a body of one node with a velocity.
fn bullet(world: &mut World, position: Vec3, velocity: Vec3) -> sinew::BodyId {
    let id = world
        .create_body(&BodyDefinition {
            positions: &[position],
            masses: Values::Uniform(0.001),
            ..Default::default()
        })
        .expect("a body");
    world
        .body_mut(id)
        .expect("a body")
        .set_velocities(&[velocity])
        .expect("velocities");
    id
}

#[test]
fn a_fast_node_does_not_pass_a_thin_capsule() {
    let mut random = Random::new(3);
    for _ in 0..500 {
        let substeps = [0, 1, 3][random.below(3)];
        let dt = [0.001, 1.0 / 60.0, 1.0 / 30.0][random.below(3)];
        let mut world = world_of(Vec3::ZERO, substeps);
        let shape = Shape::Capsule {
            radius: 0.001,
            half_length: 0.1,
        };
        let along = random.direction();
        let lying = Quat::from_rotation_arc(Vec3::Y, along);
        let needle = tool(&mut world, shape, 0.0, Vec3::ZERO, lying);
        // Aimed at a point of the axis, across it, with an offset of less than 0.7 of the radius.
        let side = along.any_orthonormal_vector();
        let across = along.cross(side);
        let target = along * random.between(-0.09, 0.09) + across * random.between(-0.0007, 0.0007);
        let speed = random.between(1.0, 200.0);
        let start = target + side * random.between(0.002, 0.5);
        let node = bullet(&mut world, start, -side * speed);
        let mut touched = false;
        for step in 0..40 {
            world.step(dt).expect("a step");
            let position = body(&world, node).positions()[0];
            touched |= world.wrench(needle).expect("a tool").0 != Vec3::ZERO;
            let depth = penetration_of(&world, node, shape, needle);
            assert!(
                depth < 1e-5,
                "{depth} m deep, dt {dt}, step {step}, {speed} m/s from {start}"
            );
            // The node may slide around the capsule, but never pass straight through.
            if position.dot(side) < 0.0 {
                assert!(touched, "through at step {step}, dt {dt}, {speed} m/s from {start}");
            }
        }
        let flown = f64::from(dt) * 40.0 * f64::from(speed);
        assert!(
            touched || flown < f64::from(start.dot(side)),
            "not touched, dt {dt}, {speed} m/s from {start}"
        );
    }
}

#[test]
fn a_rotating_capsule_sweeps_nodes_in_its_path() {
    // Nodes at rest in the sector that a capsule sweeps are carried to its other side.
    let mut failures = Vec::new();
    let mut count = 0;
    for substeps in [0, 1, 4, 30] {
        for turn in [0.1_f32, 1.0, 1.57, 3.1] {
            for (radius, half_length) in [(0.005, 0.1), (0.002, 0.2)] {
                for distance in [0.3, 0.6, 0.95] {
                    for part in [0.25, 0.5, 0.85] {
                        let mut world = world_of(Vec3::ZERO, substeps);
                        let lying = |angle: f32| Quat::from_rotation_z(angle - 1.570_796_4);
                        let shape = Shape::Capsule { radius, half_length };
                        let arm = tool(&mut world, shape, 0.0, Vec3::ZERO, lying(0.0));
                        let angle = turn * part;
                        let start = Quat::from_rotation_z(angle) * (Vec3::X * half_length * distance);
                        // Outside the capsule at the beginning, and inside the swept sector.
                        if start.y < 2.0 * radius {
                            continue;
                        }
                        let node = bullet(&mut world, start, Vec3::ZERO);
                        world.set_pose(arm, Vec3::ZERO, Some(lying(turn))).expect("a pose");
                        world.step(1.0 / 60.0).expect("a step");
                        let force = world.wrench(arm).expect("a tool").0;
                        count += 1;
                        let depth = penetration_of(&world, node, shape, arm);
                        if force == Vec3::ZERO || depth > 0.001 {
                            failures.push(format!(
                                "{substeps} substeps, {turn} rad, {shape:?}, at {distance}, {part}: {depth} m deep, {force}"
                            ));
                        }
                    }
                }
            }
        }
    }
    assert!(
        failures.is_empty(),
        "{} of {count}:\n{}",
        failures.len(),
        failures.join("\n")
    );
}

#[test]
fn a_box_on_a_corner_carries_the_cloth_with_it() {
    a_box_carries_the_cloth_with_it(&[(8, 1.0 / 60.0)], true);
}

#[test]
#[ignore = "long"]
fn a_box_carries_the_cloth_with_it_in_the_other_cases() {
    a_box_carries_the_cloth_with_it(&[(8, 0.002), (8, 1.0 / 30.0)], true);
    a_box_carries_the_cloth_with_it(&[(8, 0.002), (8, 1.0 / 60.0), (8, 1.0 / 30.0)], false);
}

fn a_box_carries_the_cloth_with_it(cases: &[(u32, f32)], on_a_corner: bool) {
    let half_extents = Vec3::new(0.01, 0.005, 0.015);
    let (orientation, reach) = if on_a_corner {
        (Quat::from_rotation_x(0.7) * Quat::from_rotation_z(0.6), 0.015)
    } else {
        (Quat::IDENTITY, 0.0)
    };
    put_through_everywhere(cases, |_, _| 0, Shape::Box { half_extents }, orientation, reach);
}
