//! The sides of a wound: they part freely, and come to rest against each other when they are pressed together.

use glam::{Vec3, vec3};
use sinew::{BodyContact, Solver};

use super::scene::*;
use crate::support::hanging::nodes_at;
use crate::support::tissue::pin_all;

/// Depths below this are none, m: a hundredth of a cell.
const DEPTH: f64 = 1e-4;

const ENDS: [f32; 2] = [-1.0, 1.0];

const SHUT: Matter = Matter {
    drag: 20.0,
    damping: 0.05,
    contact: MEETS_ITSELF,
    ..Matter::BLOCK
};

/// A block that is held at both ends, cut across by this sweep's ends, and then pressed together by 3 mm: how many corners lie within others
/// on the way, and what force it takes in the end, N.
fn press(matter: Matter, cut: Option<[Vec3; 2]>) -> (usize, f64) {
    let mut world = world(Vec3::ZERO, 1);
    let mesh = block();
    let body = matter.put(&mut world, &mesh);
    let ends = ENDS.map(|end| nodes_at(&mesh, |place| place.x * end > 0.0199));
    ends.iter().for_each(|nodes| pin_all(&mut world, body, nodes));
    if let Some([from, to]) = cut {
        let report = world.cut(body, &sweep(from, to, 0.1 * Vec3::Z)).unwrap();
        assert!(report.area > 4e-4, "{report:?}");
    }
    let mut within = 0;
    for step in 1..=60 {
        let part = (step as f32 / 30.0).min(1.0);
        for (nodes, end) in ends.iter().zip(ENDS) {
            for &node in nodes {
                let place = mesh.positions[node as usize] - end * part * 0.0015 * Vec3::X;
                world.body_mut(body).unwrap().move_pin(node, place).unwrap();
            }
        }
        let report = world.step(4e-3).unwrap();
        assert_eq!(report.bodies_restored, 0);
        if step % 10 == 0 {
            within = within.max(overlapping(world.body(body).unwrap(), DEPTH));
        }
    }
    (within, pin_force(&world, body, &ends[0]).x)
}

#[test]
fn a_wound_that_is_pressed_shut_bears_as_if_it_were_none() {
    a_wound_that_is_pressed_shut_bears_as_if_it_were_none_of(&[
        (0.0, Solver::Verlet, 1, 0.1),
        (4000.0, Solver::Implicit, 1, 0.05),
    ]);
}

#[test]
#[ignore = "long"]
fn a_wound_that_is_pressed_shut_bears_as_if_it_were_none_in_the_other_cases() {
    a_wound_that_is_pressed_shut_bears_as_if_it_were_none_of(&[
        (4000.0, Solver::Verlet, 0, 0.01),
        (0.0, Solver::Newton, 0, 0.15),
    ]);
}

fn a_wound_that_is_pressed_shut_bears_as_if_it_were_none_of(cases: &[(f32, Solver, usize, f64)]) {
    // Through it, and half through, slanted.
    let cuts = [
        [vec3(0.003, -0.03, 0.0), vec3(0.003, 0.03, 0.0)],
        [vec3(0.004, -0.002, 0.0), vec3(-0.001, 0.03, 0.0)],
    ];
    for &(young, solver, cut, near) in cases {
        let cut = cuts[cut];
        let what = format!("{young} Pa, {solver:?}, from {}", cut[0]);
        let matter = Matter { young, solver, ..SHUT };
        let blind = Matter {
            contact: BodyContact::NOTHING,
            ..matter
        };
        let (_, whole) = press(blind, None);
        let (within, force) = press(matter, Some(cut));
        assert_eq!(within, 0, "{what}");
        let off = (force / whole - 1.0).abs();
        assert!(off < near, "{what}: {force} of {whole} N");
        if solver == Solver::Verlet {
            // Without contact they do go through each other.
            let (within, force) = press(blind, Some(cut));
            assert!(within > 10 && force < 0.95 * whole, "{what}: {within}, {force} N");
        }
    }
}

/// A block or a sheet that is stretched and cut half through gapes as if it met nothing.
#[test]
fn what_is_stretched_parts_freely() {
    for is_sheet in [false, true] {
        for solver in [Solver::Verlet, Solver::Newton] {
            let [meets, blind] = [MEETS_ITSELF, BodyContact::NOTHING].map(|contact| {
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
                    .map(|&place| place * vec3(1.2, 1.0, 1.0))
                    .collect();
                world.body_mut(body).unwrap().set_positions(&stretched).unwrap();
                let far = mesh.positions.iter().map(|place| place.x).fold(0.0, f32::max);
                pin_all(&mut world, body, &nodes_at(&mesh, |place| place.x.abs() > 0.99 * far));
                let across = if is_sheet { Vec3::Z } else { Vec3::Y };
                let middle = 0.003 * Vec3::X;
                let cut = sweep(middle + 0.001 * across, middle + 0.1 * across, 0.1 * along);
                assert!(world.cut(body, &cut).unwrap().new_nodes > 0);
                for _ in 0..20 {
                    assert_eq!(world.step(1e-3).unwrap().crossings, 0);
                }
                world.body(body).unwrap().positions().to_vec()
            });
            let off = meets
                .iter()
                .zip(&blind)
                .map(|(a, b)| a.distance(*b))
                .fold(0.0, f32::max);
            // Of what they gape.
            let gape = meets.iter().skip(sheet(6).positions.len().max(27)).map(|place| place.x);
            assert!(gape.clone().fold(0.0, f32::max) > 0.005, "{is_sheet}, {solver:?}");
            assert!(off < 2e-5, "sheet: {is_sheet}, {solver:?}: {off} m");
        }
    }
}

/// A block at rest, of which nothing pulls, is cut in two, and both halves once more by a slanted cut: the pieces stay where they are.
#[test]
fn cuts_push_no_pieces_apart() {
    cuts_push_no_pieces_apart_of(&[(4000.0, Solver::Verlet), (0.0, Solver::Implicit)]);
}

#[test]
#[ignore = "long"]
fn cuts_push_no_pieces_apart_in_the_other_cases() {
    cuts_push_no_pieces_apart_of(&[
        (0.0, Solver::Verlet),
        (4000.0, Solver::Implicit),
        (4000.0, Solver::Newton),
    ]);
}

fn cuts_push_no_pieces_apart_of(cases: &[(f32, Solver)]) {
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
        let places = world.body(body).unwrap().positions();
        let gone = mesh.positions.iter().zip(places).map(|(rest, at)| rest.distance(*at));
        let gone = gone.fold(0.0, f32::max);
        let velocities = world.body(body).unwrap().velocities().iter();
        let speed = velocities.map(|velocity| velocity.length()).fold(0.0, f32::max);
        // Rounding alone: some 1e-9 m and 1e-6 m/s.
        assert!(
            gone < 3e-8 && speed < 1e-5,
            "{young} Pa, {solver:?}: {gone:e} m, {speed:e} m/s"
        );
    }
}

/// The upper half of a block that is held at its foot stays on the lower one, and weighs on it.
#[test]
#[ignore = "long"]
fn what_is_cut_off_lies_on_the_rest() {
    for (young, solver) in [(20e3, Solver::Verlet), (0.0, Solver::Implicit)] {
        let what = format!("{young} Pa, {solver:?}");
        let matter = Matter {
            young,
            solver,
            stiffness: 200.0,
            ..SHUT
        };
        let mut world = world(DOWN, 1);
        let mesh = block();
        let body = matter.put(&mut world, &mesh);
        let foot = nodes_at(&mesh, |place| place.y < -0.0149);
        pin_all(&mut world, body, &foot);
        let cut = sweep(vec3(-0.1, 0.0062, 0.0), vec3(0.1, 0.0062, 0.0), 0.1 * Vec3::Z);
        assert_eq!(world.cut(body, &cut).unwrap().pieces_parted, 1);
        for step in 0..150 {
            world.step(4e-3).unwrap();
            if step % 25 == 0 {
                assert_eq!(overlapping(world.body(body).unwrap(), DEPTH), 0, "{what}, step {step}");
            }
        }
        let weight = 9.81 * f64::from(matter.mass);
        let held = pin_force(&world, body, &foot).y;
        assert!((held / weight - 1.0).abs() < 0.01, "{what}: {held} of {weight} N");
        let sunk = body_height(&world, body, &mesh);
        assert!(sunk < 1.5e-3, "{what}: {sunk} m");
    }
}

/// How far the nodes of the top have sunk at most.
fn body_height(world: &sinew::World, body: sinew::BodyId, mesh: &sinew::mesh::Mesh) -> f32 {
    let places = world.body(body).unwrap().positions();
    let top = nodes_at(mesh, |place| place.y > 0.0149);
    let sunk = top
        .iter()
        .map(|&node| mesh.positions[node as usize].y - places[node as usize].y);
    sunk.fold(0.0, f32::max)
}
