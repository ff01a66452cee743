//! Bodies that are created flush with each other, with overlapping contact thicknesses.

use crate::support::tissue::*;
use glam::Vec3;
use sinew::material::{Material, Model};
use sinew::mesh::Mesh;
use sinew::{Anchor, BodyContact, BodyDefinition, BodyId, Solver, Values, Viscosity, World};

const SIDE: f32 = 0.8;
const MASS: f32 = 2.7;

/// Creates two cubes side by side. The second overlaps the first by `overlap` (m).
fn cubes(world: &mut World, solver: Solver, overlap: f32) -> ([BodyId; 2], Mesh) {
    let mesh = Mesh::block([SIDE; 3], [2; 3]).expect("a block");
    let ids = [0.0, SIDE - overlap].map(|x| {
        let mesh = moved(mesh.clone(), Vec3::new(x, 0.0, 0.0));
        let definition = BodyDefinition {
            positions: &mesh.positions,
            tetrahedra: &mesh.tetrahedra,
            masses: Values::Uniform(MASS / mesh.positions.len() as f32),
            material: Some(Material {
                model: Model::Tetrahedra,
                young_modulus: 5e4,
                poisson_ratio: 0.3,
                ..Material::default()
            }),
            viscosity: Viscosity {
                retardation_time: if solver == Solver::Verlet { 2e-4 } else { 4e-3 },
                relaxation_time: 0.0,
            },
            solver,
            contact: BodyContact {
                thickness: 0.05,
                friction: 0.5,
                with_bodies: true,
                ..BodyContact::NOTHING
            },
            ..Default::default()
        };
        world.create_body(&definition).expect("a body")
    });
    (ids, mesh)
}

fn energy(world: &World, ids: [BodyId; 2]) -> f64 {
    ids.iter().map(|&id| total_energy(world, id)).sum()
}

#[test]
fn flush_cubes_gain_no_energy_when_one_moves_into_the_other() {
    check_flush_cubes_gain_no_energy_when_one_moves_into_the_other(Solver::Verlet);
}

#[test]
#[ignore = "long"]
fn flush_cubes_gain_no_energy_when_one_moves_into_the_other_implicit() {
    check_flush_cubes_gain_no_energy_when_one_moves_into_the_other(Solver::Implicit);
}

fn check_flush_cubes_gain_no_energy_when_one_moves_into_the_other(solver: Solver) {
    for are_attached in [false, true] {
        let case = format!("{solver:?}, attached: {are_attached}");
        let mut world = world(Vec3::ZERO);
        let (ids, mesh) = cubes(&mut world, solver, 0.0);
        if are_attached {
            let [left, right] = [-0.5, 0.5].map(|side| {
                let middle = Vec3::new(side * SIDE, 0.0, 0.0);
                let node = mesh.positions.iter().position(|p| p.distance(middle) < 1e-3);
                Anchor::Node(node.expect("a node") as u32)
            });
            world
                .attach_to_body(ids[0], &[right], ids[1], &[left], 0.0)
                .expect("an attachment");
        }
        let speed = 1.5 / MASS;
        let velocities = vec![Vec3::new(speed, 0.0, 0.0); mesh.positions.len()];
        let moving = world.body_mut(ids[0]).expect("a body");
        moving.set_velocities(&velocities).expect("velocities");
        let start = energy(&world, ids);
        for index in 0..120 {
            world.step(1.0 / 60.0).expect("a step");
            let now = energy(&world, ids);
            assert!(now <= start * (1.0 + 1e-3), "{case}, step {index}: {now} J of {start}");
        }
        let node_mass = MASS / mesh.positions.len() as f32;
        let momentum: glam::DVec3 = ids.iter().map(|&id| momentum(body(&world, id), node_mass)).sum();
        let error = (momentum - glam::DVec3::new(1.5, 0.0, 0.0)).length();
        assert!(error < 1e-4, "{case}: momentum {momentum}");
    }
}

#[test]
fn nearly_flush_cubes_separate_no_faster_than_documented() {
    for solver in [Solver::Verlet, Solver::Implicit] {
        let mut world = world(Vec3::ZERO);
        let (ids, _) = cubes(&mut world, solver, 2e-5);
        // Bodies that start too close are moved apart by at most 0.3 of their extent per second.
        let bound = 2.0 * 0.5 * f64::from(MASS * (0.3 * SIDE).powi(2));
        for index in 0..60 {
            world.step(1.0 / 60.0).expect("a step");
            let now = energy(&world, ids);
            assert!(now <= bound, "{solver:?}, step {index}: {now} J of {bound}");
        }
    }
}
