//! IMPLICIT pressed at the speed of a hand, 0.1 m/s, in frames of 1/60 s: its forces agree with VERLET, and its
//! equations are solved within their budget however many contacts form and open.

use crate::support::held_block::{CELL, TOP, held_block};
use crate::support::solid::ball;
use glam::Vec3;
use sinew::{Pose, Shape, Solver, ToolDefinition};

const RADIUS: f32 = 0.04;
const FRAME: f32 = 1.0 / 60.0;
const SPEED: f32 = 0.1;
const DEPTH: f32 = 0.006;

/// The measured values of one frame.
struct Sample {
    /// N
    force: f64,
    products: u32,
    converged: bool,
}

/// Returns the forces on a ball that is pressed into a block and stays there.
fn press(solver: Solver, elements: bool, shape: Shape) -> Vec<Sample> {
    let (mut world, body, _) = held_block(elements, solver);
    // Off the symmetry axis of the mesh, and slightly above the block.
    let at = |depth: f32| Vec3::new(0.3 * CELL, TOP + RADIUS - depth, 0.1 * CELL);
    let tool = world
        .create_tool(&ToolDefinition {
            pose: Pose {
                position: at(-1e-3),
                ..Pose::IDENTITY
            },
            ..ToolDefinition::new(shape)
        })
        .expect("a tool");
    let coming = ((DEPTH + 1e-3) / (SPEED * FRAME)).ceil() as usize;
    (1..=coming + 5)
        .map(|frame| {
            let depth = (SPEED * FRAME * frame as f32 - 1e-3).min(DEPTH);
            world.set_pose(tool, at(depth), None).expect("a pose");
            world.step(FRAME).expect("a step");
            let report = world.body(body).expect("the body").solver_report();
            Sample {
                force: f64::from(world.wrench(tool).expect("a tool").0.y),
                products: report.iterations,
                converged: report.has_converged,
            }
        })
        .collect()
}

#[test]
fn a_tool_pressed_by_hand_gets_the_right_force() {
    a_tool_pressed_by_hand_gets_the_right_force_of(&[(true, true)]);
}

#[test]
#[ignore = "long"]
fn a_tool_pressed_by_hand_gets_the_right_force_in_the_other_cases() {
    a_tool_pressed_by_hand_gets_the_right_force_of(&[(false, false), (true, false)]);
}

fn a_tool_pressed_by_hand_gets_the_right_force_of(cases: &[(bool, bool)]) {
    let round = ball(RADIUS, 3);
    let mesh = Shape::Mesh {
        positions: &round.positions,
        triangles: &round.triangles,
    };
    let mut failures = Vec::new();
    let sphere = Shape::Sphere { radius: RADIUS };
    for &(is_mesh, elements) in cases {
        let (name, shape) = if is_mesh { ("mesh", mesh) } else { ("sphere", sphere) };
        let case = format!("{name}, elements {elements}");
        let right = press(Solver::Verlet, elements, shape);
        let found = press(Solver::Implicit, elements, shape);
        let largest = right.iter().map(|felt| felt.force).fold(0.0, f64::max);
        assert!(largest > 0.5, "{case}: force too small to measure, {largest} N");
        for (frame, (found, right)) in found.iter().zip(&right).enumerate() {
            // Substeps of 1 ms have order 1.
            let error = (found.force - right.force).abs() / largest;
            if error > 0.02 || !found.converged || found.products > 700 {
                failures.push(format!(
                    "{case}, frame {frame}: {} N, {} N is right, {} products, solved: {}",
                    found.force, right.force, found.products, found.converged
                ));
            }
        }
    }
    assert!(failures.is_empty(), "{}:\n{}", failures.len(), failures.join("\n"));
}
