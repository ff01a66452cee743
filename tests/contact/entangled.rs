//! Sheets that were made through each other.

use crate::support::hanging::nodes_at;
use crate::support::tissue::*;
use glam::Vec3;
use sinew::mesh::Mesh;
use sinew::{BodyContact, BodyDefinition, BodyId, Solver, Values, World};

const SIZE: [f32; 2] = [0.2, 0.04];
const CELLS: [u32; 2] = [10, 2];
const CELL: f32 = 0.02;

/// A ribbon along the x axis, held at its ends, and one that stands upright in it.
fn ribbons(world: &mut World, thickness: f32, solver: Solver) -> [BodyId; 2] {
    let lying = Mesh::cloth(SIZE, CELLS).expect("a ribbon");
    let mut standing = lying.clone();
    for p in &mut standing.positions {
        *p = Vec3::new(0.006, p.x + 0.003, p.z + 0.001);
    }
    let ids = [&lying, &standing].map(|mesh| {
        let definition = BodyDefinition {
            positions: &mesh.positions,
            triangles: &mesh.triangles,
            masses: Values::Uniform(3e-4),
            stiffnesses: Values::Uniform(40.0),
            spring_dampings: Values::Uniform(0.02),
            solver,
            contact: BodyContact {
                thickness,
                friction: 0.5,
                with_bodies: true,
                ..BodyContact::NOTHING
            },
            ..Default::default()
        };
        world.create_body(&definition).expect("a body")
    });
    pin_all(world, ids[0], &nodes_at(&lying, |p| p.x.abs() > 0.099));
    ids
}

fn middle(world: &World, id: BodyId) -> Vec3 {
    let positions = body(world, id).positions();
    positions.iter().sum::<Vec3>() / positions.len() as f32
}

#[test]
fn a_ribbon_that_was_made_through_another_falls_freely() {
    const GRAVITY: f32 = 9.81;
    for (part, solver) in [
        (0.0, Solver::Verlet),
        (0.1, Solver::Verlet),
        (0.2, Solver::Verlet),
        (0.2, Solver::Implicit),
    ] {
        let mut world = world(Vec3::new(0.0, -GRAVITY, 0.0));
        let [held, falling] = ribbons(&mut world, part * CELL, solver);
        let start = middle(&world, falling).y;
        let report = world.step(1e-3).expect("a step");
        assert!(report.crossings > 0, "they were to cross");
        assert!(
            [Some(held), Some(falling)].contains(&report.crossing_body),
            "{report:?}"
        );
        let mut crossings = 0;
        for _ in 0..499 {
            crossings = world.step(1e-3).expect("a step").crossings;
        }
        assert_eq!(crossings, 0, "{solver:?}, thickness {part}");
        let way = start - middle(&world, falling).y;
        let free = 0.5 * GRAVITY * 0.5 * 0.5;
        assert!(
            (way - free).abs() < 0.01 * free,
            "{solver:?}, thickness {part}: fell {way} m of {free}"
        );
    }
}

#[test]
fn ribbons_that_have_come_out_of_each_other_keep_each_other_off_again() {
    for part in [0.1, 0.2] {
        let mut world = world(Vec3::ZERO);
        let [_, thrown] = ribbons(&mut world, part * CELL, Solver::Verlet);
        let throw = |world: &mut World, speed: f32| {
            let velocities = vec![Vec3::new(0.0, speed, 0.0); body(world, thrown).node_count()];
            let thrown = world.body_mut(thrown).expect("a body");
            thrown.set_velocities(&velocities).expect("velocities");
        };
        throw(&mut world, -1.0);
        for _ in 0..130 {
            world.step(1e-3).expect("a step");
        }
        let highest = |world: &World| {
            let positions = body(world, thrown).positions();
            positions.iter().fold(f32::NEG_INFINITY, |highest, p| highest.max(p.y))
        };
        assert!(highest(&world) < -0.01, "it was to be out: {}", highest(&world));
        throw(&mut world, 1.0);
        // Far enough to pass as a whole, were nothing there.
        for _ in 0..300 {
            assert_eq!(world.step(1e-3).expect("a step").crossings, 0, "thickness {part}");
        }
        assert!(middle(&world, thrown).y < 0.0, "thickness {part}: it passed");
    }
}
