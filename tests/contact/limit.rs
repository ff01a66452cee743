//! A tool with a force limit presses with no more than the limit, and with no less while it cannot reach its pose.

use crate::support::hanging::nodes_at;
use glam::Vec3;
use sinew::mesh::Mesh;
use sinew::{BodyDefinition, Pose, Shape, Solver, ToolDefinition, Values, World, WorldDefinition};

const LIMIT: f32 = 0.25;
const RADIUS: f32 = 0.02;
const DEPTH: f32 = 0.01;

/// Moves a tool into a block at this speed, then holds its target for 0.3 s. Returns the largest excess over the limit,
/// the largest shortfall in the last 0.2 s, both relative to the limit, and the depth reached (m).
fn press(solver: Solver, speed: f32, dt: f32, drag: f32) -> (f32, f32, f32) {
    let size = [0.06, 0.04, 0.06];
    let mesh = Mesh::block(size, [6, 4, 6]).expect("a block");
    let mut world = World::new(WorldDefinition {
        gravity: Vec3::ZERO,
        ..Default::default()
    })
    .expect("a world");
    let node_mass = 1000.0 * size.iter().product::<f32>() / mesh.positions.len() as f32;
    let block = world
        .create_body(&BodyDefinition {
            masses: Values::Uniform(node_mass),
            node_dampings: Values::Uniform(drag * node_mass),
            stiffnesses: Values::Uniform(100.0),
            solver,
            ..BodyDefinition::of(&mesh)
        })
        .expect("a body");
    let below = nodes_at(&mesh, |position| position.y < -0.0199);
    crate::support::tissue::pin_all(&mut world, block, &below);
    let start = Vec3::new(0.001, 0.0201 + RADIUS, 0.002);
    let tool = world
        .create_tool(&ToolDefinition {
            force_limit: LIMIT,
            pose: Pose {
                position: start,
                ..Pose::IDENTITY
            },
            ..ToolDefinition::new(Shape::Sphere { radius: RADIUS })
        })
        .expect("a tool");
    let moving = (DEPTH / (speed * dt)).ceil() as usize;
    let holding = (0.3 / dt) as usize;
    let (mut over, mut under) = (f32::NEG_INFINITY, f32::NEG_INFINITY);
    for frame in 1..=moving + holding {
        let depth = (speed * dt * frame as f32).min(DEPTH);
        world.set_pose(tool, start - Vec3::Y * depth, None).expect("a pose");
        world.step(dt).expect("a step");
        let excess = world.wrench(tool).expect("a tool").0.length() / LIMIT - 1.0;
        over = over.max(excess);
        if frame > moving + holding / 3 {
            under = under.max(-excess);
        }
    }
    (over, under, start.y - world.pose(tool).expect("a tool").position.y)
}

#[test]
fn a_force_limit_holds_while_the_tool_moves_and_rests() {
    check_a_force_limit_holds_while_the_tool_moves_and_rests(&[
        (Solver::Verlet, 0.01, 0.01, 100.0),
        (Solver::Verlet, 0.05, 1.0 / 60.0, 5.0),
        (Solver::Verlet, 0.3, 1.0 / 60.0, 100.0),
    ]);
}

#[test]
#[ignore = "long"]
fn a_force_limit_holds_while_the_tool_moves_and_rests_in_the_other_cases() {
    check_a_force_limit_holds_while_the_tool_moves_and_rests(&[
        (Solver::Verlet, 0.05, 1e-3, 100.0),
        (Solver::Implicit, 0.05, 1.0 / 60.0, 100.0),
    ]);
}

fn check_a_force_limit_holds_while_the_tool_moves_and_rests(cases: &[(Solver, f32, f32, f32)]) {
    for &(solver, speed, dt, drag) in cases {
        let case = format!("{solver:?}, {speed} m/s, {dt} s, drag {drag}");
        let (over, under, depth) = press(solver, speed, dt, drag);
        assert!(over < 0.01, "{case}: exceeded by {over}");
        assert!(under < 0.03, "{case}: short by {under}");
        assert!((2e-4..5e-3).contains(&depth), "{case}: {depth} m deep");
    }
}
