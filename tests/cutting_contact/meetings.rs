//! What is cut and other tissue: it is carried, thrown back, and nothing is made or lost.

use glam::{DVec3, Vec3, Vec3Swizzles, vec3};
use sinew::{BodyContact, BodyDefinition, Detection, Solver, Tearing, Values};

use super::scene::*;
use crate::support::hanging::nodes_at;
use crate::support::tissue::pin_all;

/// A sheet that is held at one end above another, in two bodies or in one, is cut off there, falls and lies on the lower one.
#[test]
fn a_sheet_that_is_cut_off_is_carried_by_what_it_falls_on() {
    a_sheet_that_is_cut_off_is_carried_by_what_it_falls_on_of(&[(Solver::Verlet, true, Detection::Exact)]);
}

#[test]
#[ignore = "long"]
fn a_sheet_that_is_cut_off_is_carried_by_what_it_falls_on_in_the_other_cases() {
    a_sheet_that_is_cut_off_is_carried_by_what_it_falls_on_of(&[
        (Solver::Verlet, false, Detection::ImageSpace),
        (Solver::Implicit, false, Detection::Exact),
    ]);
}

fn a_sheet_that_is_cut_off_is_carried_by_what_it_falls_on_of(cases: &[(Solver, bool, Detection)]) {
    for &(solver, as_one, detection) in cases {
        let what = format!("{solver:?}, one body: {as_one}, {detection:?}");
        let mut world = world(DOWN, 1);
        let contact = BodyContact {
            thickness: 5e-4,
            friction: 0.5,
            with_bodies: !as_one,
            with_itself: as_one,
            detection,
            ..BodyContact::NOTHING
        };
        let matter = Matter {
            solver,
            contact,
            drag: 12.0,
            damping: 5e-3,
            ..Matter::SHEET
        };
        let lower = sheet(8);
        let mut upper = sheet(6);
        upper
            .positions
            .iter_mut()
            .for_each(|place| *place += vec3(0.002, 0.005, 0.003));
        let rim = nodes_at(&lower, |place| place.x.abs().max(place.z.abs()) > 0.0399);
        let end = nodes_at(&upper, |place| place.x < -0.015);
        let count = lower.positions.len() as u32;
        let (bodies, rims) = if as_one {
            let mut both = lower.clone();
            both.positions.extend(&upper.positions);
            let shifted = upper
                .triangles
                .iter()
                .map(|corners| corners.map(|corner| corner + count));
            both.triangles.extend(shifted);
            let mass = 2.0 * matter.mass;
            let id = Matter { mass, ..matter }.put(&mut world, &both);
            let end: Vec<u32> = end.iter().map(|node| node + count).collect();
            (vec![id; 2], [rim, end])
        } else {
            (
                vec![matter.put(&mut world, &lower), matter.put(&mut world, &upper)],
                [rim, end],
            )
        };
        for (&id, nodes) in bodies.iter().zip(&rims) {
            pin_all(&mut world, id, nodes);
        }
        let at = vec3(-0.013, 0.005, 0.0);
        let cut = sweep(at - 0.1 * Vec3::Z, at + 0.1 * Vec3::Z, 0.003 * Vec3::Y);
        let report = world.cut(bodies[1], &cut).unwrap();
        assert_eq!(report.pieces_parted, 1, "{what}");
        for step in 0..300 {
            assert_eq!(world.step(2e-3).unwrap().crossings, 0, "{what}, step {step}");
        }
        let held = [0, 1].map(|side| pin_force(&world, bodies[side], &rims[side]).y);
        let weight = 2.0 * 9.81 * f64::from(matter.mass);
        assert!(
            ((held[0] + held[1]) / weight - 1.0).abs() < 0.01,
            "{what}: {held:?} of {weight} N"
        );
        // What was cut off is most of the upper one.
        assert!(held[1] < 0.25 * weight, "{what}: {held:?} of {weight} N");
    }
}

/// Two blocks with wounds meet.
#[test]
fn cut_bodies_that_meet_keep_their_momentum() {
    cut_bodies_that_meet_keep_their_momentum_of(Solver::Verlet, Detection::ImageSpace);
}

#[test]
#[ignore = "long"]
fn cut_bodies_that_meet_keep_their_momentum_with_newton() {
    cut_bodies_that_meet_keep_their_momentum_of(Solver::Newton, Detection::Exact);
}

fn cut_bodies_that_meet_keep_their_momentum_of(solver: Solver, detection: Detection) {
    let what = format!("{solver:?}, {detection:?}");
    let mut world = world(Vec3::ZERO, 1);
    let contact = BodyContact {
        thickness: 5e-4,
        with_bodies: true,
        with_itself: true,
        detection,
        ..BodyContact::NOTHING
    };
    let bodies = [-1.0, 1.0].map(|side: f32| {
        let mut mesh = block();
        mesh.positions
            .iter_mut()
            .for_each(|place| *place += vec3(0.0215, 0.004, 0.003) * side);
        let id = Matter {
            solver,
            contact,
            damping: 0.02,
            ..Matter::BLOCK
        }
        .put(&mut world, &mesh);
        let velocities = vec![vec3(-0.4 * side, 0.0, 0.0); mesh.positions.len()];
        world.body_mut(id).unwrap().set_velocities(&velocities).unwrap();
        // Into the face that is to meet the other.
        let (x, y, z) = (0.0215 * side, 0.004 * side, 0.003 * side);
        let cut = sweep(vec3(-0.02 * side, y, z), vec3(x, y, z), 0.1 * Vec3::Z);
        assert!(world.cut(id, &cut).unwrap().area > 2e-4, "{what}");
        id
    });
    let before = kept(&world, &bodies);
    let of_left = kept(&world, &bodies[..1]).momentum;
    for step in 0..80 {
        let report = world.step(1e-3).unwrap();
        assert_eq!(report.crossings, 0, "{what}, step {step}");
        let now = kept(&world, &bodies);
        assert!(
            now.energy < 1.001 * before.energy,
            "{what}, step {step}: {} J",
            now.energy
        );
    }
    let after = kept(&world, &bodies);
    let size = of_left.length();
    let off = after.momentum.distance(before.momentum) / size;
    assert!(off < 1e-5, "{what}: momentum off by {off}");
    let turned = kept(&world, &bodies[..1]).momentum;
    assert!(turned.x < -0.2 * size, "{what}: {turned} after {of_left}");
    // No corner of one lies in the other.
    for [of, other] in [[0, 1], [1, 0]] {
        let around = triangles(world.body(bodies[other]).unwrap());
        let places: Vec<DVec3> = triangles(world.body(bodies[of]).unwrap()).concat();
        assert!(places.iter().all(|&place| winding(&around, place) < 0.5), "{what}");
    }
}

/// A block that meets itself and turns in flight is cut through, crosswise.
#[test]
fn a_cut_in_motion_makes_and_loses_nothing() {
    a_cut_in_motion_makes_and_loses_nothing_of(&[(3000.0, Solver::Verlet)]);
}

#[test]
#[ignore = "long"]
fn a_cut_in_motion_makes_and_loses_nothing_in_the_other_cases() {
    a_cut_in_motion_makes_and_loses_nothing_of(&[(0.0, Solver::Verlet), (3000.0, Solver::Newton)]);
}

fn a_cut_in_motion_makes_and_loses_nothing_of(cases: &[(f32, Solver)]) {
    for &(young, solver) in cases {
        let what = format!("{young} Pa, {solver:?}");
        let mut world = world(Vec3::ZERO, 1);
        let mesh = block();
        let matter = Matter {
            young,
            solver,
            contact: MEETS_ITSELF,
            ..Matter::BLOCK
        };
        let body = matter.put(&mut world, &mesh);
        let spin = vec3(3.0, 2.0, 5.0);
        let velocities: Vec<Vec3> = mesh
            .positions
            .iter()
            .map(|&place| vec3(0.3, -0.2, 0.1) + spin.cross(place) + 40.0 * place.yzx() * place.x)
            .collect();
        world.body_mut(body).unwrap().set_velocities(&velocities).unwrap();
        let first = kept(&world, &[body]);
        let size = first.momentum.length();
        for (from, to) in [
            (vec3(0.1, 0.001, 0.0), vec3(-0.1, -0.001, 0.0)),
            (vec3(0.002, 0.1, 0.0), vec3(0.001, -0.1, 0.0)),
        ] {
            for _ in 0..5 {
                world.step(1e-3).unwrap();
            }
            let at = (world
                .body(body)
                .unwrap()
                .positions()
                .iter()
                .take(mesh.positions.len())
                .sum::<Vec3>())
                / mesh.positions.len() as f32;
            let before = kept(&world, &[body]);
            let places = world.body(body).unwrap().positions().to_vec();
            let report = world.cut(body, &sweep(at + from, at + to, 0.1 * Vec3::Z)).unwrap();
            assert!(report.pieces_parted >= 1, "{what}: {report:?}");
            let after = kept(&world, &[body]);
            assert_eq!(places, world.body(body).unwrap().positions()[..places.len()], "{what}");
            assert!((after.mass / before.mass - 1.0).abs() < 1e-6, "{what}: mass");
            assert!(
                after.momentum.distance(before.momentum) < 1e-6 * size,
                "{what}: momentum"
            );
            let off = after.spin.distance(before.spin);
            assert!(off < 1e-6 * before.spin.length().max(0.1 * size), "{what}: {off}");
            let gained = (after.energy / before.energy - 1.0).abs();
            assert!(gained < 1e-6, "{what}: energy {gained}");
        }
        for step in 0..40 {
            world.step(1e-3).unwrap();
            let now = kept(&world, &[body]);
            assert!(
                now.energy < 1.002 * first.energy,
                "{what}, step {step}: {} J",
                now.energy
            );
        }
        let off = kept(&world, &[body]).momentum.distance(first.momentum) / size;
        assert!(off < 1e-5, "{what}: momentum off by {off}");
        assert_eq!(overlapping(world.body(body).unwrap(), 2e-4), 0, "{what}");
    }
}

#[test]
fn threads_make_no_difference() {
    let [one, three] = [1, 3].map(|threads| {
        let mut world = world(DOWN, threads);
        let contact = BodyContact {
            with_bodies: true,
            ..MEETS_ITSELF
        };
        let bodies = [0.0, 0.0415].map(|height: f32| {
            let mut mesh = sinew::mesh::Mesh::block([0.08, 0.04, 0.08], [9, 5, 9]).unwrap();
            mesh.positions.iter_mut().for_each(|place| *place += height * Vec3::Y);
            Matter {
                contact,
                mass: 0.5,
                ..Matter::BLOCK
            }
            .put(&mut world, &mesh)
        });
        for (index, id) in bodies.into_iter().enumerate() {
            let x = 0.003 + 0.01 * index as f32;
            let cut = sweep(vec3(x, 0.1, 0.0), vec3(x, 0.0415 * index as f32, 0.0), 0.1 * Vec3::Z);
            assert!(world.cut(id, &cut).unwrap().new_nodes > 0);
        }
        let velocities = vec![-0.5 * Vec3::Y; world.body(bodies[1]).unwrap().positions().len()];
        world.body_mut(bodies[1]).unwrap().set_velocities(&velocities).unwrap();
        let low = kept(&world, &bodies[..1]).momentum.y;
        for _ in 0..8 {
            world.step(1e-3).unwrap();
        }
        // They did meet.
        let pushed = kept(&world, &bodies[..1]).momentum.y - low;
        assert!(pushed < -1.2 * 0.5 * 9.81 * 8e-3, "{pushed}");
        world.state_hash()
    });
    assert_eq!(one, three);
}

/// A sheet that meets itself is torn, in its plane, and no part of it passes through another.
#[test]
fn a_sheet_that_tears_stays_in_its_plane() {
    let mut world = world(Vec3::ZERO, 1);
    let mesh = sheet(6);
    let mass = 0.01 / mesh.positions.len() as f32;
    let body = world
        .create_body(&BodyDefinition {
            positions: &mesh.positions,
            masses: Values::Uniform(mass),
            node_dampings: Values::Uniform(20.0 * mass),
            triangles: &mesh.triangles,
            stiffnesses: Values::Uniform(20.0),
            spare_nodes: 500,
            tearing: Tearing {
                strain: 0.2,
                most_per_step: 4,
                ..Default::default()
            },
            contact: MEETS_ITSELF,
            ..Default::default()
        })
        .unwrap();
    let ends = [-1.0, 1.0].map(|end: f32| nodes_at(&mesh, |place| place.x * end > 0.0299));
    ends.iter().for_each(|nodes| pin_all(&mut world, body, nodes));
    for step in 1..=60 {
        for (nodes, end) in ends.iter().zip([-1.0, 1.0]) {
            for &node in nodes {
                let place = mesh.positions[node as usize] + end * step as f32 * 2e-4 * Vec3::X;
                world.body_mut(body).unwrap().move_pin(node, place).unwrap();
            }
        }
        assert_eq!(world.step(2e-3).unwrap().crossings, 0, "step {step}");
    }
    let it = world.body(body).unwrap();
    assert!(it.topology_version() > 5);
    assert!(it.positions().iter().all(|place| place.y.abs() < 1e-6));
}
