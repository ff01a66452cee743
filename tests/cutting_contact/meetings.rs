//! Contact of cut bodies with other tissue: weight is carried, and momentum and energy are conserved.

use glam::{DVec3, Vec3, Vec3Swizzles, vec3};
use sinew::{BodyContact, BodyDefinition, Detection, Solver, Tearing, Values};

use super::scene::*;
use crate::support::hanging::nodes_at;
use crate::support::tissue::pin_all;

/// A sheet is held at one end above another sheet, in the same body or another. It is cut off there, falls, and rests
/// on the lower sheet.
#[test]
fn a_cut_off_sheet_is_carried_by_the_sheet_below() {
    check_a_cut_off_sheet_is_carried_by_the_sheet_below(&[(Solver::Verlet, true, Detection::Exact)]);
}

#[test]
#[ignore = "long"]
fn a_cut_off_sheet_is_carried_by_the_sheet_below_in_the_other_cases() {
    check_a_cut_off_sheet_is_carried_by_the_sheet_below(&[
        (Solver::Verlet, false, Detection::ImageSpace),
        (Solver::Implicit, false, Detection::Exact),
    ]);
}

fn check_a_cut_off_sheet_is_carried_by_the_sheet_below(cases: &[(Solver, bool, Detection)]) {
    for &(solver, as_one, detection) in cases {
        let case = format!("{solver:?}, one body: {as_one}, {detection:?}");
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
            .for_each(|position| *position += vec3(0.002, 0.005, 0.003));
        let rim = nodes_at(&lower, |position| position.x.abs().max(position.z.abs()) > 0.0399);
        let end = nodes_at(&upper, |position| position.x < -0.015);
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
        assert_eq!(report.pieces_parted, 1, "{case}");
        for step in 0..300 {
            assert_eq!(world.step(2e-3).unwrap().crossings, 0, "{case}, step {step}");
        }
        let pin_forces = [0, 1].map(|side| pin_force(&world, bodies[side], &rims[side]).y);
        let weight = 2.0 * 9.81 * f64::from(matter.mass);
        assert!(
            ((pin_forces[0] + pin_forces[1]) / weight - 1.0).abs() < 0.01,
            "{case}: {pin_forces:?} of {weight} N"
        );
        // Most of the upper sheet was cut off.
        assert!(pin_forces[1] < 0.25 * weight, "{case}: {pin_forces:?} of {weight} N");
    }
}

/// Two blocks with wounds collide.
#[test]
fn cut_bodies_that_collide_conserve_momentum() {
    check_cut_bodies_that_collide_conserve_momentum(Solver::Verlet, Detection::ImageSpace);
}

#[test]
#[ignore = "long"]
fn cut_bodies_that_collide_conserve_momentum_with_newton() {
    check_cut_bodies_that_collide_conserve_momentum(Solver::Newton, Detection::Exact);
}

fn check_cut_bodies_that_collide_conserve_momentum(solver: Solver, detection: Detection) {
    let case = format!("{solver:?}, {detection:?}");
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
            .for_each(|position| *position += vec3(0.0215, 0.004, 0.003) * side);
        let id = Matter {
            solver,
            contact,
            damping: 0.02,
            ..Matter::BLOCK
        }
        .put(&mut world, &mesh);
        let velocities = vec![vec3(-0.4 * side, 0.0, 0.0); mesh.positions.len()];
        world.body_mut(id).unwrap().set_velocities(&velocities).unwrap();
        // A cut into the face that hits the other block.
        let (x, y, z) = (0.0215 * side, 0.004 * side, 0.003 * side);
        let cut = sweep(vec3(-0.02 * side, y, z), vec3(x, y, z), 0.1 * Vec3::Z);
        assert!(world.cut(id, &cut).unwrap().area > 2e-4, "{case}");
        id
    });
    let before = kept(&world, &bodies);
    let left_momentum = kept(&world, &bodies[..1]).momentum;
    for step in 0..80 {
        let report = world.step(1e-3).unwrap();
        assert_eq!(report.crossings, 0, "{case}, step {step}");
        let now = kept(&world, &bodies);
        assert!(
            now.energy < 1.001 * before.energy,
            "{case}, step {step}: {} J",
            now.energy
        );
    }
    let after = kept(&world, &bodies);
    let size = left_momentum.length();
    let error = after.momentum.distance(before.momentum) / size;
    assert!(error < 1e-5, "{case}: momentum off by {error}");
    let final_momentum = kept(&world, &bodies[..1]).momentum;
    assert!(
        final_momentum.x < -0.2 * size,
        "{case}: {final_momentum} after {left_momentum}"
    );
    // No corner of one block lies in the other.
    for [of, other] in [[0, 1], [1, 0]] {
        let around = triangles(world.body(bodies[other]).unwrap());
        let positions: Vec<DVec3> = triangles(world.body(bodies[of]).unwrap()).concat();
        assert!(
            positions.iter().all(|&position| winding(&around, position) < 0.5),
            "{case}"
        );
    }
}

/// A block with self-contact that rotates in flight is cut through, crosswise.
#[test]
fn a_cut_in_motion_conserves_mass_momentum_and_energy() {
    check_a_cut_in_motion_conserves_mass_momentum_and_energy(&[(3000.0, Solver::Verlet)]);
}

#[test]
#[ignore = "long"]
fn a_cut_in_motion_conserves_mass_momentum_and_energy_in_the_other_cases() {
    check_a_cut_in_motion_conserves_mass_momentum_and_energy(&[(0.0, Solver::Verlet), (3000.0, Solver::Newton)]);
}

fn check_a_cut_in_motion_conserves_mass_momentum_and_energy(cases: &[(f32, Solver)]) {
    for &(young, solver) in cases {
        let case = format!("{young} Pa, {solver:?}");
        let mut world = world(Vec3::ZERO, 1);
        let mesh = block();
        let matter = Matter {
            young,
            solver,
            contact: SELF_CONTACT,
            ..Matter::BLOCK
        };
        let body = matter.put(&mut world, &mesh);
        let spin = vec3(3.0, 2.0, 5.0);
        let velocities: Vec<Vec3> = mesh
            .positions
            .iter()
            .map(|&position| vec3(0.3, -0.2, 0.1) + spin.cross(position) + 40.0 * position.yzx() * position.x)
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
            let positions = world.body(body).unwrap().positions().to_vec();
            let report = world.cut(body, &sweep(at + from, at + to, 0.1 * Vec3::Z)).unwrap();
            assert!(report.pieces_parted >= 1, "{case}: {report:?}");
            let after = kept(&world, &[body]);
            assert_eq!(
                positions,
                world.body(body).unwrap().positions()[..positions.len()],
                "{case}"
            );
            assert!((after.mass / before.mass - 1.0).abs() < 1e-6, "{case}: mass");
            assert!(
                after.momentum.distance(before.momentum) < 1e-6 * size,
                "{case}: momentum"
            );
            let error = after.spin.distance(before.spin);
            assert!(error < 1e-6 * before.spin.length().max(0.1 * size), "{case}: {error}");
            let gained = (after.energy / before.energy - 1.0).abs();
            assert!(gained < 1e-6, "{case}: energy {gained}");
        }
        for step in 0..40 {
            world.step(1e-3).unwrap();
            let now = kept(&world, &[body]);
            assert!(
                now.energy < 1.002 * first.energy,
                "{case}, step {step}: {} J",
                now.energy
            );
        }
        let error = kept(&world, &[body]).momentum.distance(first.momentum) / size;
        assert!(error < 1e-5, "{case}: momentum off by {error}");
        assert_eq!(overlapping(world.body(body).unwrap(), 2e-4), 0, "{case}");
    }
}

#[test]
fn results_are_identical_for_any_number_of_threads() {
    let [one, three] = [1, 3].map(|threads| {
        let mut world = world(DOWN, threads);
        let contact = BodyContact {
            with_bodies: true,
            ..SELF_CONTACT
        };
        let bodies = [0.0, 0.0415].map(|height: f32| {
            let mut mesh = sinew::mesh::Mesh::block([0.08, 0.04, 0.08], [9, 5, 9]).unwrap();
            mesh.positions
                .iter_mut()
                .for_each(|position| *position += height * Vec3::Y);
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
        // The blocks did collide.
        let pushed = kept(&world, &bodies[..1]).momentum.y - low;
        assert!(pushed < -1.2 * 0.5 * 9.81 * 8e-3, "{pushed}");
        world.state_hash()
    });
    assert_eq!(one, three);
}

/// A sheet with self-contact is torn in its plane, and no part of it passes through another.
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
            contact: SELF_CONTACT,
            ..Default::default()
        })
        .unwrap();
    let ends = [-1.0, 1.0].map(|end: f32| nodes_at(&mesh, |position| position.x * end > 0.0299));
    ends.iter().for_each(|nodes| pin_all(&mut world, body, nodes));
    for step in 1..=60 {
        for (nodes, end) in ends.iter().zip([-1.0, 1.0]) {
            for &node in nodes {
                let position = mesh.positions[node as usize] + end * step as f32 * 2e-4 * Vec3::X;
                world.body_mut(body).unwrap().move_pin(node, position).unwrap();
            }
        }
        assert_eq!(world.step(2e-3).unwrap().crossings, 0, "step {step}");
    }
    let cut_body = world.body(body).unwrap();
    assert!(cut_body.topology_version() > 5);
    assert!(cut_body.positions().iter().all(|position| position.y.abs() < 1e-6));
}
