//! Self-contact of thin sheets that crumple.

use glam::{DVec3, Vec3};
use sinew::mesh::Mesh;
use sinew::{BodyContact, BodyDefinition, Shape, Solver, ToolDefinition, Values, World, WorldDefinition};

use crate::support::bodies::Random;
use crate::support::crossings::crossings;

/// The size of a cell (m).
const CELL: f32 = 0.01;
const CELLS: u32 = 8;

/// A slightly folded sheet falls upright onto the ground, its top faster. A thickness of 0 still keeps its layers
/// apart.
#[test]
fn a_sheet_without_thickness_does_not_pass_through_itself() {
    assert_no_crossings(Solver::Verlet, 0.0, &[0.5], 15);
}

/// The sheet is flat when a step begins, and folded after a fraction of the step.
#[test]
fn a_sheet_that_crumples_within_a_step_does_not_pass_through_itself() {
    assert_no_crossings(Solver::Verlet, 1e-3, &[8.0], 4);
    assert_no_crossings(Solver::Implicit, 1e-3, &[8.0], 4);
}

#[test]
#[ignore = "long"]
fn a_sheet_without_thickness_does_not_pass_through_itself_with_implicit() {
    assert_no_crossings(Solver::Implicit, 0.0, &[0.1, 0.5], 15);
}

#[test]
#[ignore = "long"]
fn a_sheet_that_crumples_within_a_step_does_not_pass_through_itself_at_other_speeds() {
    for (thickness, speed) in [(5e-4, 4.0), (2e-3, 15.0), (2e-3, 30.0)] {
        assert_no_crossings(Solver::Verlet, thickness, &[speed], 4);
        assert_no_crossings(Solver::Implicit, thickness, &[speed], 4);
    }
}

fn assert_no_crossings(solver: Solver, thickness: f32, speeds: &[f32], frames: u32) {
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
        for position in &mut mesh.positions {
            *position = Vec3::new(position.z, position.x + middle, 0.004 * (60.0 * position.x).sin());
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
            .map(|position| {
                let sideways = 0.1 * random.signed();
                Vec3::new(-10.0 * position.x, -1.0 - 5.0 * (position.y - middle), sideways) * speed
            })
            .collect();
        let body_mut = world.body_mut(body).expect("the sheet");
        body_mut.set_velocities(&velocities).expect("velocities");
        let (mut is_folded, near) = (false, f64::from(0.3 * CELL + 3.0 * thickness));
        for frame in 0..frames {
            let report = world.step(1.0 / 60.0).expect("a step");
            let case = format!("{solver:?}, {speed} m/s, frame {frame}");
            let positions: Vec<DVec3> = world
                .body(body)
                .expect("the sheet")
                .positions()
                .iter()
                .map(|position| position.as_dvec3())
                .collect();
            assert_eq!(crossings(&positions, &mesh.triangles, &mesh.triangles), 0, "{case}");
            assert_eq!(report.crossings, 0, "{case}");
            // Nodes that were more than two cells apart have come together.
            is_folded |= (0..positions.len()).any(|a| {
                let were_apart = |b: usize| mesh.positions[a].distance(mesh.positions[b]) > 2.0 * CELL;
                (0..a).any(|b| positions[a].distance(positions[b]) < near && were_apart(b))
            });
        }
        assert!(is_folded, "{solver:?}, {speed} m/s: no parts came into contact");
    }
}
