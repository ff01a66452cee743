//! The sides of a wound separate freely, and rest against each other when they are pressed together.

use glam::{Vec3, vec3};
use sinew::{BodyContact, Solver};

use super::scene::*;
use crate::support::hanging::nodes_at;
use crate::support::tissue::pin_all;

/// Smaller depths count as none (m): a hundredth of a cell.
const DEPTH: f64 = 1e-4;

const ENDS: [f32; 2] = [-1.0, 1.0];

const SHUT: Matter = Matter {
    drag: 20.0,
    damping: 0.05,
    contact: SELF_CONTACT,
    ..Matter::BLOCK
};

/// Holds a block at both ends, cuts it across from one point to another, and compresses it by 3 mm. Returns the largest
/// number of overlapping corners, and the final force (N).
fn press(matter: Matter, cut: Option<[Vec3; 2]>) -> (usize, f64) {
    let mut world = world(Vec3::ZERO, 1);
    let mesh = block();
    let body = matter.put(&mut world, &mesh);
    let ends = ENDS.map(|end| nodes_at(&mesh, |position| position.x * end > 0.0199));
    ends.iter().for_each(|nodes| pin_all(&mut world, body, nodes));
    if let Some([from, to]) = cut {
        let report = world.cut(body, &sweep(from, to, 0.1 * Vec3::Z)).unwrap();
        assert!(report.area > 4e-4, "{report:?}");
    }
    let mut overlaps = 0;
    for step in 1..=60 {
        let fraction = (step as f32 / 30.0).min(1.0);
        for (nodes, end) in ends.iter().zip(ENDS) {
            for &node in nodes {
                let position = mesh.positions[node as usize] - end * fraction * 0.0015 * Vec3::X;
                world.body_mut(body).unwrap().move_pin(node, position).unwrap();
            }
        }
        let report = world.step(4e-3).unwrap();
        assert_eq!(report.bodies_restored, 0);
        if step % 10 == 0 {
            overlaps = overlaps.max(overlapping(world.body(body).unwrap(), DEPTH));
        }
    }
    (overlaps, pin_force(&world, body, &ends[0]).x)
}

#[test]
fn a_wound_pressed_shut_carries_load_like_uncut_tissue() {
    check_a_wound_pressed_shut_carries_load_like_uncut_tissue(&[
        (0.0, Solver::Verlet, 1, 0.1),
        (4000.0, Solver::Implicit, 1, 0.05),
    ]);
}

#[test]
#[ignore = "long"]
fn a_wound_pressed_shut_carries_load_like_uncut_tissue_in_the_other_cases() {
    check_a_wound_pressed_shut_carries_load_like_uncut_tissue(&[
        (4000.0, Solver::Verlet, 0, 0.01),
        (0.0, Solver::Newton, 0, 0.15),
    ]);
}

fn check_a_wound_pressed_shut_carries_load_like_uncut_tissue(cases: &[(f32, Solver, usize, f64)]) {
    // One cut passes through the block, one is slanted and passes half through.
    let cuts = [
        [vec3(0.003, -0.03, 0.0), vec3(0.003, 0.03, 0.0)],
        [vec3(0.004, -0.002, 0.0), vec3(-0.001, 0.03, 0.0)],
    ];
    for &(young, solver, cut, near) in cases {
        let cut = cuts[cut];
        let case = format!("{young} Pa, {solver:?}, from {}", cut[0]);
        let matter = Matter { young, solver, ..SHUT };
        let blind = Matter {
            contact: BodyContact::NOTHING,
            ..matter
        };
        let (_, uncut_force) = press(blind, None);
        let (overlaps, force) = press(matter, Some(cut));
        assert_eq!(overlaps, 0, "{case}");
        let error = (force / uncut_force - 1.0).abs();
        assert!(error < near, "{case}: {force} of {uncut_force} N");
        if solver == Solver::Verlet {
            // Without contact, the sides pass through each other.
            let (overlaps, force) = press(blind, Some(cut));
            assert!(
                overlaps > 10 && force < 0.95 * uncut_force,
                "{case}: {overlaps}, {force} N"
            );
        }
    }
}

/// A block or a sheet that is stretched and cut half through opens as it does without contact.
#[test]
fn stretched_tissue_opens_freely_when_cut() {
    for is_sheet in [false, true] {
        for solver in [Solver::Verlet, Solver::Newton] {
            let [colliding, blind] = [SELF_CONTACT, BodyContact::NOTHING].map(|contact| {
                let mut world = world_of(Vec3::ZERO, 1, 4);
                let (mesh, matter, along) = if is_sheet {
                    (sheet(6), Matter::SHEET, Vec3::Y)
                } else {
                    (block(), Matter::BLOCK, Vec3::Z)
                };
                let matter = Matter {
                    solver,
                    contact,
                    damping: 0.05,
                    ..matter
                };
                let body = matter.put(&mut world, &mesh);
                let stretched: Vec<Vec3> = mesh
                    .positions
                    .iter()
                    .map(|&position| position * vec3(1.2, 1.0, 1.0))
                    .collect();
                world.body_mut(body).unwrap().set_positions(&stretched).unwrap();
                let half_length = mesh.positions.iter().map(|position| position.x).fold(0.0, f32::max);
                pin_all(
                    &mut world,
                    body,
                    &nodes_at(&mesh, |position| position.x.abs() > 0.99 * half_length),
                );
                let across = if is_sheet { Vec3::Z } else { Vec3::Y };
                let middle = 0.003 * Vec3::X;
                let cut = sweep(middle + 0.001 * across, middle + 0.1 * across, 0.1 * along);
                assert!(world.cut(body, &cut).unwrap().new_nodes > 0);
                for _ in 0..20 {
                    assert_eq!(world.step(1e-3).unwrap().crossings, 0);
                }
                world.body(body).unwrap().positions().to_vec()
            });
            let error = colliding
                .iter()
                .zip(&blind)
                .map(|(a, b)| a.distance(*b))
                .fold(0.0, f32::max);
            // The difference is relative to the opening of the wound.
            let gape = colliding
                .iter()
                .skip(sheet(6).positions.len().max(27))
                .map(|position| position.x);
            assert!(gape.clone().fold(0.0, f32::max) > 0.005, "{is_sheet}, {solver:?}");
            assert!(error < 2e-5, "sheet: {is_sheet}, {solver:?}: {error} m");
        }
    }
}

/// A block at rest without stress is cut in two, and both halves again by a slanted cut. The pieces do not move.
#[test]
fn cuts_push_no_pieces_apart() {
    check_cuts_push_no_pieces_apart(&[(4000.0, Solver::Verlet), (0.0, Solver::Implicit)]);
}

#[test]
#[ignore = "long"]
fn cuts_push_no_pieces_apart_in_the_other_cases() {
    check_cuts_push_no_pieces_apart(&[
        (0.0, Solver::Verlet),
        (4000.0, Solver::Implicit),
        (4000.0, Solver::Newton),
    ]);
}

fn check_cuts_push_no_pieces_apart(cases: &[(f32, Solver)]) {
    for &(young, solver) in cases {
        let matter = Matter { young, solver, ..SHUT };
        let mut world = world(Vec3::ZERO, 1);
        let mesh = block();
        let body = matter.put(&mut world, &mesh);
        world.step(4e-3).unwrap();
        let cuts = [
            [vec3(0.003, -0.03, 0.0), vec3(0.003, 0.03, 0.0)],
            [vec3(-0.03, -0.008, 0.0), vec3(0.03, 0.009, 0.0)],
        ];
        for [from, to] in cuts {
            let report = world.cut(body, &sweep(from, to, 0.1 * Vec3::Z)).unwrap();
            assert!(report.pieces_parted > 0, "{report:?}");
            for _ in 0..4 {
                world.step(4e-3).unwrap();
            }
        }
        let positions = world.body(body).unwrap().positions();
        let displacement = mesh
            .positions
            .iter()
            .zip(positions)
            .map(|(rest, at)| rest.distance(*at));
        let displacement = displacement.fold(0.0, f32::max);
        let velocities = world.body(body).unwrap().velocities().iter();
        let speed = velocities.map(|velocity| velocity.length()).fold(0.0, f32::max);
        // Only rounding: about 1e-9 m and 1e-6 m/s.
        assert!(
            displacement < 3e-8 && speed < 1e-5,
            "{young} Pa, {solver:?}: {displacement:e} m, {speed:e} m/s"
        );
    }
}

/// The upper half of a block that is held at its foot stays on the lower half and loads it with its weight.
#[test]
#[ignore = "long"]
fn a_cut_off_piece_rests_on_the_remaining_body() {
    for (young, solver) in [(20e3, Solver::Verlet), (0.0, Solver::Implicit)] {
        let case = format!("{young} Pa, {solver:?}");
        let matter = Matter {
            young,
            solver,
            stiffness: 200.0,
            ..SHUT
        };
        let mut world = world(DOWN, 1);
        let mesh = block();
        let body = matter.put(&mut world, &mesh);
        let foot = nodes_at(&mesh, |position| position.y < -0.0149);
        pin_all(&mut world, body, &foot);
        let cut = sweep(vec3(-0.1, 0.0062, 0.0), vec3(0.1, 0.0062, 0.0), 0.1 * Vec3::Z);
        assert_eq!(world.cut(body, &cut).unwrap().pieces_parted, 1);
        for step in 0..150 {
            world.step(4e-3).unwrap();
            if step % 25 == 0 {
                assert_eq!(overlapping(world.body(body).unwrap(), DEPTH), 0, "{case}, step {step}");
            }
        }
        let weight = 9.81 * f64::from(matter.mass);
        let pin_force_y = pin_force(&world, body, &foot).y;
        assert!(
            (pin_force_y / weight - 1.0).abs() < 0.01,
            "{case}: {pin_force_y} of {weight} N"
        );
        let sunk = sinking_depth(&world, body, &mesh);
        assert!(sunk < 1.5e-3, "{case}: {sunk} m");
    }
}

/// Returns the largest distance by which nodes of the top have sunk.
fn sinking_depth(world: &sinew::World, body: sinew::BodyId, mesh: &sinew::mesh::Mesh) -> f32 {
    let positions = world.body(body).unwrap().positions();
    let top = nodes_at(mesh, |position| position.y > 0.0149);
    let sunk = top
        .iter()
        .map(|&node| mesh.positions[node as usize].y - positions[node as usize].y);
    sunk.fold(0.0, f32::max)
}
