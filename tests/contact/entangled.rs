//! Sheets that pass through each other when they are created.

use crate::support::hanging::nodes_at;
use crate::support::tissue::*;
use glam::Vec3;
use sinew::mesh::Mesh;
use sinew::{BodyContact, BodyDefinition, BodyId, Solver, Values, World};

const SIZE: [f32; 2] = [0.2, 0.04];
const CELLS: [u32; 2] = [10, 2];
const CELL: f32 = 0.02;

/// Creates a ribbon along the x axis that is pinned at its ends, and an upright ribbon that passes through it.
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
fn a_ribbon_created_through_another_falls_freely() {
    const GRAVITY: f32 = 9.81;
    for (thickness_ratio, solver) in [
        (0.0, Solver::Verlet),
        (0.1, Solver::Verlet),
        (0.2, Solver::Verlet),
        (0.2, Solver::Implicit),
    ] {
        let mut world = world(Vec3::new(0.0, -GRAVITY, 0.0));
        let [held, falling] = ribbons(&mut world, thickness_ratio * CELL, solver);
        let start = middle(&world, falling).y;
        let report = world.step(1e-3).expect("a step");
        assert!(report.crossings > 0, "the ribbons must cross");
        assert!(
            [Some(held), Some(falling)].contains(&report.crossing_body),
            "{report:?}"
        );
        let mut crossings = 0;
        for _ in 0..499 {
            crossings = world.step(1e-3).expect("a step").crossings;
        }
        assert_eq!(crossings, 0, "{solver:?}, thickness {thickness_ratio}");
        let fallen = start - middle(&world, falling).y;
        let free = 0.5 * GRAVITY * 0.5 * 0.5;
        assert!(
            (fallen - free).abs() < 0.01 * free,
            "{solver:?}, thickness {thickness_ratio}: fell {fallen} m of {free}"
        );
    }
}

#[test]
fn ribbons_collide_again_after_they_have_separated() {
    for thickness_ratio in [0.1, 0.2] {
        let mut world = world(Vec3::ZERO);
        let [_, thrown] = ribbons(&mut world, thickness_ratio * CELL, Solver::Verlet);
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
        assert!(
            highest(&world) < -0.01,
            "the ribbon must have separated: {}",
            highest(&world)
        );
        throw(&mut world, 1.0);
        // This is enough to pass completely if nothing were in the way.
        for _ in 0..300 {
            assert_eq!(
                world.step(1e-3).expect("a step").crossings,
                0,
                "thickness {thickness_ratio}"
            );
        }
        assert!(
            middle(&world, thrown).y < 0.0,
            "thickness {thickness_ratio}: it passed through"
        );
    }
}
