//! IMPLICIT with few iterations near a tool: a frame is one equation with contacts and friction in it. It takes at most
//! a few times its budget, and the tool gets the same force as with VERLET.

use glam::Vec3;
use sinew::{BodyDefinition, Material, Model, Pose, Shape, Solver, ToolDefinition};

use crate::support::held_block::{CELL, ELEMENTS, TOP, held_block_with};
use crate::support::solid::ball;

const RADIUS: f32 = 0.02;
const FRAME: f32 = 1.0 / 60.0;
const DEPTH: f32 = 0.003;
const ASIDE: f32 = 0.004;
const BUDGET: u32 = 16;
/// Frames of each phase: pressing, dragging sideways, rest.
const LEG: usize = 20;

/// The measured values of one frame.
struct Sample {
    /// N
    force: Vec3,
    products: u32,
}

/// Returns the force on a tool that is pressed into a block, dragged sideways, and then stays there.
fn drag(solver: Solver, model: Model, shape: Shape, friction: f32) -> Vec<Sample> {
    let (mut world, body, _) = held_block_with(|definition, _| BodyDefinition {
        material: Some(Material {
            model,
            poisson_ratio: if model == Model::Springs { 0.25 } else { 0.3 },
            ..ELEMENTS
        }),
        solver,
        iterations: if solver == Solver::Implicit { BUDGET } else { 0 },
        ..definition
    });
    // Off the symmetry axis of the mesh.
    let at = |aside: f32, depth: f32| Vec3::new(0.3 * CELL + aside, TOP + RADIUS - depth, 0.1 * CELL);
    let tool = world
        .create_tool(&ToolDefinition {
            friction,
            pose: Pose {
                position: at(0.0, -5e-4),
                ..Pose::IDENTITY
            },
            ..ToolDefinition::new(shape)
        })
        .expect("a tool");
    (1..=3 * LEG)
        .map(|frame| {
            let [pressed, dragged] = [frame, frame.saturating_sub(LEG)].map(|frame| frame.min(LEG) as f32 / LEG as f32);
            let depth = (DEPTH + 5e-4) * pressed - 5e-4;
            world.set_pose(tool, at(ASIDE * dragged, depth), None).expect("a pose");
            let step = world.step(FRAME).expect("a step");
            assert_eq!(step.bodies_restored, 0);
            Sample {
                force: world.wrench(tool).expect("a tool").0,
                products: world.body(body).expect("the body").solver_report().iterations,
            }
        })
        .collect()
}

#[test]
fn a_tool_gets_the_right_force_with_few_iterations() {
    a_tool_gets_the_right_force_with_few_iterations_of(&[(true, Model::Tetrahedra, 0.3)]);
}

#[test]
#[ignore = "long"]
fn a_tool_gets_the_right_force_with_few_iterations_in_the_other_cases() {
    a_tool_gets_the_right_force_with_few_iterations_of(&[
        (false, Model::Springs, 0.0),
        (false, Model::Springs, 0.3),
        (false, Model::Tetrahedra, 0.3),
    ]);
}

fn a_tool_gets_the_right_force_with_few_iterations_of(cases: &[(bool, Model, f32)]) {
    let round = ball(RADIUS, 2);
    let mesh = Shape::Mesh {
        positions: &round.positions,
        triangles: &round.triangles,
    };
    let sphere = Shape::Sphere { radius: RADIUS };
    let mut failures = Vec::new();
    for &(is_mesh, model, friction) in cases {
        let (name, shape) = if is_mesh { ("mesh", mesh) } else { ("sphere", sphere) };
        let right = drag(Solver::Verlet, model, shape, friction);
        let found = drag(Solver::Implicit, model, shape, friction);
        let largest = right.iter().map(|felt| felt.force.length()).fold(0.0, f32::max);
        assert!(largest > 0.2, "{name}: force too small to measure, {largest} N");
        let mut sums = [0.0; 2];
        for (frame, (found, right)) in found.iter().zip(&right).enumerate() {
            let error = (found.force - right.force).length() / largest;
            sums = [sums[0] + error, sums[1] + found.products as f32];
            // Where the tool suddenly moves sideways, more nodes change between sticking and slipping than in the frame
            // before.
            if error > 0.06 || found.products > 9 * BUDGET {
                failures.push(format!(
                    "{name}, {model:?}, friction {friction}, frame {frame}: {} N, {} N is right, {} products",
                    found.force, right.force, found.products
                ));
            }
        }
        let [error, products] = sums.map(|sum| sum / found.len() as f32);
        if error > 0.012 || products > 3.0 * BUDGET as f32 {
            failures.push(format!(
                "{name}, {model:?}, friction {friction}: off by {error} of the largest force, {products} products a frame"
            ));
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
