//! Blades against moving tissue, and blades that rotate far in a step.
#![allow(clippy::unwrap_used)]

use std::f32::consts::PI;

use crate::support::kept::kept;
use crate::support::stroke::blade_at;
use glam::{DVec3, Quat, Vec3, vec3};
use sinew::{BodyDefinition, BodyId, Solver, Values, World, WorldDefinition};

/// A square sheet of 1 kg/m² in the plane z = 0, from the origin, with this side (m) and this number of cells per side.
const SIZE: f32 = 0.1;
const CELLS: usize = 20;

fn sheet(toughness: f32, velocity: Vec3, solver: Solver, is_held: bool) -> (World, BodyId) {
    let side = SIZE / CELLS as f32;
    let mut positions = Vec::new();
    let mut masses = Vec::new();
    for y in 0..=CELLS {
        for x in 0..=CELLS {
            let is_border = x == 0 || y == 0 || x == CELLS || y == CELLS;
            let offset = if is_border {
                0.0
            } else {
                0.15 * ((7 * x + 5 * y) as f32).sin()
            };
            positions.push(side * vec3(x as f32 + offset, y as f32 - offset, 0.0));
            masses.push(if is_held && is_border { 0.0 } else { side * side });
        }
    }
    let at = |x: usize, y: usize| (y * (CELLS + 1) + x) as u32;
    let cells = (0..CELLS).flat_map(|y| (0..CELLS).map(move |x| (x, y)));
    let triangles: Vec<[u32; 3]> = cells
        .flat_map(|(x, y)| {
            let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x, y + 1), at(x + 1, y + 1)];
            [[a, b, d], [a, d, c]]
        })
        .collect();
    let mut world = World::new(WorldDefinition {
        gravity: Vec3::ZERO,
        ..Default::default()
    })
    .unwrap();
    let body = world
        .create_body(&BodyDefinition {
            positions: &positions,
            masses: Values::Each(&masses),
            triangles: &triangles,
            stiffnesses: Values::Uniform(100.0),
            spare_nodes: 4000,
            toughness,
            solver,
            mass_scaling: 0.0,
            ..Default::default()
        })
        .unwrap();
    let velocities = vec![velocity; positions.len()];
    world.body_mut(body).unwrap().set_velocities(&velocities).unwrap();
    (world, body)
}

const UPRIGHT: [Vec3; 2] = [vec3(0.0, 0.0, -0.02), vec3(0.0, 0.0, 0.02)];

#[test]
fn tissue_that_moves_onto_a_resting_blade_is_cut() {
    for (toughness, solver, dt) in [
        (0.0, Solver::Verlet, 1e-3),
        (0.0, Solver::Verlet, 8e-3),
        (0.0, Solver::Implicit, 1e-3),
        (0.005, Solver::Verlet, 0.5e-3),
        (0.005, Solver::Implicit, 0.5e-3),
    ] {
        let (mut world, body) = sheet(toughness, vec3(-1.0, 0.1, 0.0), solver, false);
        let knife = blade_at(&mut world, 500.0, vec3(-0.012, 0.048, 0.0), UPRIGHT);
        let (mut length, mut impulse, mut work) = (0.0, DVec3::ZERO, 0.0);
        let before = kept(&world, body);
        for _ in 0..(0.17 / dt) as usize {
            world.step(dt).unwrap();
            let report = world.blade_report(knife).unwrap();
            assert_eq!(report.refused, None);
            length += report.length;
            impulse -= report.force.as_dvec3() * f64::from(dt);
            work += report.work;
        }
        let after = kept(&world, body);
        let lost = before.energy - after.energy;
        let gained = after.momentum - before.momentum;
        let cut_work = f64::from(toughness) * length;
        let case = format!(
            "{toughness} J/m, {solver:?}, {dt} s: {length} m cut; {lost:.2e} J lost, {cut_work:.2e} spent, {work:.1e} work; {gained:?}, {impulse:?}"
        );
        assert_eq!(world.body(body).unwrap().pieces().unwrap().count, 2, "{case}");
        assert!((length / 0.1005 - 1.0).abs() < 0.04, "{case}");
        assert!(gained.distance(impulse) <= 1e-5 * before.momentum.length(), "{case}");
        assert!(work.abs() < 1e-9, "{case}");
        assert!(lost >= 0.95 * cut_work - 1e-6 * before.energy, "{case}");
    }
}

#[test]
fn a_sheet_that_rests_on_a_blade_is_not_cut() {
    let (mut world, body) = sheet(0.0, Vec3::ZERO, Solver::Verlet, false);
    let knife = blade_at(&mut world, 500.0, vec3(-0.001, 0.048, 0.0), UPRIGHT);
    for _ in 0..20 {
        world.step(1e-3).unwrap();
    }
    // Tissue slides freely along the edge.
    world.set_blade_pose(knife, vec3(0.03, 0.048, 0.0), None).unwrap();
    world.step(1e-3).unwrap();
    let cut = world.blade_report(knife).unwrap().length;
    assert!((cut / 0.03 - 1.0).abs() < 0.05, "{cut} m");
    let velocities = vec![0.5 * Vec3::Z; world.body(body).unwrap().velocities().len()];
    world.body_mut(body).unwrap().set_velocities(&velocities).unwrap();
    let version = world.body(body).unwrap().topology_version();
    for _ in 0..30 {
        world.step(1e-3).unwrap();
    }
    assert_eq!(world.body(body).unwrap().topology_version(), version);
}

#[test]
fn a_blade_that_turns_far_in_a_step_cuts_an_arc() {
    for toughness in [0.0, 0.002] {
        let (mut world, body) = sheet(toughness, Vec3::ZERO, Solver::Verlet, true);
        let count = world.body(body).unwrap().surface().len();
        let (centre, radius) = (vec3(0.051, 0.049, 0.0), 0.03);
        let edge = UPRIGHT.map(|end| end + radius * Vec3::X);
        let knife = blade_at(&mut world, 500.0, centre, edge);
        let mut length = 0.0;
        for step in 1..=2 {
            let turn = Quat::from_rotation_z(step as f32 * 0.7 * PI);
            world.set_blade_pose(knife, centre, Some(turn)).unwrap();
            world.step(1e-2).unwrap();
            length += world.blade_report(knife).unwrap().length;
        }
        assert_eq!(world.blade_report(knife).unwrap().refused, None);
        let arc_length = f64::from(radius * 1.4 * PI);
        // Toughness keeps the cut slightly behind the blade.
        assert!(
            length > 0.85 * arc_length && length < 1.03 * arc_length,
            "{toughness}: {length} of {arc_length} m"
        );
        let cut_body = world.body(body).unwrap();
        assert!(cut_body.surface().len() > count);
        let changes = cut_body.changes_since(0).unwrap();
        let rim: Vec<u32> = changes.rim.iter().flat_map(|edge| edge.nodes).collect();
        assert!(!rim.is_empty());
        if toughness == 0.0 {
            for point in rim {
                let offset = (cut_body.positions()[point as usize].distance(centre) - radius).abs();
                // The tolerance covers the deviation of an arc from the chord of half a radian, and snapping.
                assert!(offset < 0.0013, "{offset} m off the arc");
            }
        }
    }
}

#[test]
fn blades_that_meet_in_the_same_step_leave_no_bridge() {
    for toughness in [0.0, 0.001] {
        for steps in [30, 100, 240] {
            for is_head_on in [false, true] {
                let (mut world, body) = sheet(toughness, Vec3::ZERO, Solver::Verlet, true);
                let middle = vec3(0.0512, 0.0487, 0.0);
                let paths = if is_head_on {
                    // Along one line, to the middle.
                    [[vec3(-0.02, 0.0487, 0.0), middle], [vec3(0.1224, 0.0487, 0.0), middle]]
                } else {
                    [[-1.0, 1.0], [-1.0, 1.0]]
                        .map(|ends| ends.map(|end| end * vec3(0.065, 0.006, 0.0)))
                        .map(|ends| ends.map(|end| middle + end))
                };
                let paths = if is_head_on {
                    paths
                } else {
                    let turn = Quat::from_rotation_z(0.5 * PI);
                    [paths[0], paths[1].map(|end| middle + turn * (end - middle))]
                };
                let knives = paths.map(|[start, _]| blade_at(&mut world, 500.0, start, UPRIGHT));
                for step in 1..=steps {
                    for (&knife, [start, end]) in knives.iter().zip(&paths) {
                        let position = start.lerp(*end, step as f32 / steps as f32);
                        world.set_blade_pose(knife, position, None).unwrap();
                    }
                    world.step(2e-3).unwrap();
                    for knife in knives {
                        assert_eq!(world.blade_report(knife).unwrap().refused, None);
                    }
                }
                let pieces = world.body(body).unwrap().pieces().unwrap().count;
                let case = format!("{toughness} J/m, {steps} steps, head on {is_head_on}");
                if !is_head_on {
                    assert_eq!(pieces, 4, "{case}");
                } else if toughness == 0.0 {
                    assert_eq!(pieces, 2, "{case}");
                }
            }
        }
    }
}
