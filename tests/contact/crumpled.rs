//! Thin sheets that meet themselves as they crumple.

use glam::{DVec3, Vec3};
use sinew::mesh::Mesh;
use sinew::{BodyContact, BodyDefinition, Shape, Solver, ToolDefinition, Values, World, WorldDefinition};

use crate::support::bodies::Random;
use crate::support::crossings::crossings;

/// Of a cell, m.
const CELL: f32 = 0.01;
const CELLS: u32 = 8;

/// A sheet in slight folds falls upright onto the ground, faster at its top: a thickness of 0 still keeps its layers apart.
#[test]
fn a_sheet_without_thickness_does_not_pass_itself() {
    nothing_passes(Solver::Verlet, 0.0, &[0.5], 15);
}

/// What is flat as a step begins is not after a fraction of it.
#[test]
fn a_sheet_that_crumples_within_a_step_does_not_pass_itself() {
    nothing_passes(Solver::Verlet, 1e-3, &[8.0], 4);
    nothing_passes(Solver::Implicit, 1e-3, &[8.0], 4);
}

#[test]
#[ignore = "long"]
fn a_sheet_without_thickness_does_not_pass_itself_with_implicit() {
    nothing_passes(Solver::Implicit, 0.0, &[0.1, 0.5], 15);
}

#[test]
#[ignore = "long"]
fn a_sheet_that_crumples_within_a_step_does_not_pass_itself_at_other_speeds() {
    for (thickness, speed) in [(5e-4, 4.0), (2e-3, 15.0), (2e-3, 30.0)] {
        nothing_passes(Solver::Verlet, thickness, &[speed], 4);
        nothing_passes(Solver::Implicit, thickness, &[speed], 4);
    }
}

fn nothing_passes(solver: Solver, thickness: f32, speeds: &[f32], frames: u32) {
    for &speed in speeds {
        let mut world = World::new(WorldDefinition::default()).expect("a world");
        let ground = ToolDefinition {
            friction: 0.3,
            ..ToolDefinition::new(Shape::Plane)
        };
        world.create_tool(&ground).expect("the ground");
        let size = CELL * CELLS as f32;
        let mut mesh = Mesh::cloth([size; 2], [CELLS; 2]).expect("a cloth");
        let middle = 0.5 * size + 0.02;
        for place in &mut mesh.positions {
            *place = Vec3::new(place.z, place.x + middle, 0.004 * (60.0 * place.x).sin());
        }
        let mass = 5e-5;
        let body = world
            .create_body(&BodyDefinition {
                masses: Values::Uniform(mass),
                stiffnesses: Values::Uniform(30.0),
                node_dampings: Values::Uniform(2.0 * mass),
                solver,
                contact: BodyContact {
                    with_itself: true,
                    thickness,
                    friction: 0.2,
                    ..BodyContact::default()
                },
                ..BodyDefinition::of(&mesh)
            })
            .expect("a sheet");
        let mut random = Random::new(5);
        let velocities: Vec<Vec3> = mesh
            .positions
            .iter()
            .map(|place| {
                let aside = 0.1 * random.signed();
                Vec3::new(-10.0 * place.x, -1.0 - 5.0 * (place.y - middle), aside) * speed
            })
            .collect();
        let body_mut = world.body_mut(body).expect("the sheet");
        body_mut.set_velocities(&velocities).expect("velocities");
        let (mut is_folded, near) = (false, f64::from(0.3 * CELL + 3.0 * thickness));
        for frame in 0..frames {
            let report = world.step(1.0 / 60.0).expect("a step");
            let what = format!("{solver:?}, {speed} m/s, frame {frame}");
            let places: Vec<DVec3> = world
                .body(body)
                .expect("the sheet")
                .positions()
                .iter()
                .map(|place| place.as_dvec3())
                .collect();
            assert_eq!(crossings(&places, &mesh.triangles, &mesh.triangles), 0, "{what}");
            assert_eq!(report.crossings, 0, "{what}");
            // Corners that were two cells apart or more have come together.
            is_folded |= (0..places.len()).any(|a| {
                let apart = |b: usize| mesh.positions[a].distance(mesh.positions[b]) > 2.0 * CELL;
                (0..a).any(|b| places[a].distance(places[b]) < near && apart(b))
            });
        }
        assert!(is_folded, "{solver:?}, {speed} m/s: nothing met");
    }
}
