//! Node contacts of round tools: comparison with a mesh of the same shape, and penetration between nodes.

use crate::support::solid::ball;
use crate::support::tissue::*;
use glam::{Quat, Vec3};
use sinew::{BodyId, Shape, ToolId, World};

const FRAME: f32 = 1.0 / 60.0;
const SIZE: f32 = 0.2;
const RADIUS: f32 = 0.03;
const TISSUE: Tissue = Tissue {
    mass: 0.1,
    stiffness: 100.0,
    drag: 4.0,
    spring_damping: 0.0,
};

/// Creates a cloth that is pinned at its border, and a tool above its middle.
fn above(cells: u32, shape: Shape, friction: f32) -> (World, BodyId, ToolId) {
    let mut world = world(Vec3::ZERO);
    let cloth = TISSUE.put(&mut world, &square(SIZE, cells));
    pin_all(&mut world, cloth, &rim(cells));
    let tool = tool(&mut world, shape, friction, Vec3::Y * RADIUS, Quat::IDENTITY);
    (world, cloth, tool)
}

/// Presses the tool `depth` into the cloth within half a second, moves it `aside`, and waits. Returns the force on it.
fn press(world: &mut World, tool: ToolId, depth: f32, aside: f32, mut visit: impl FnMut(&World)) -> Vec3 {
    for frame in 1..=90 {
        let [down, along] = [frame, frame - 30].map(|frame| (frame as f32 / 30.0).clamp(0.0, 1.0));
        let position = Vec3::new(aside * along, RADIUS - depth * down, 0.0);
        world.set_pose(tool, position, None).expect("a pose");
        world.step(FRAME).expect("a step");
        visit(world);
    }
    world.wrench(tool).expect("a tool").0
}

/// A chord of length l within a ball of radius R sags by l² / 8R, a triangle by at most l² / 6R. The cloth may stretch
/// by a third.
#[test]
fn a_cloth_between_nodes_is_no_deeper_than_a_chord_of_the_ball() {
    check_a_cloth_between_nodes_is_no_deeper_than_a_chord_of_the_ball(&[20, 40]);
}

#[test]
#[ignore = "long"]
fn a_cloth_between_nodes_is_no_deeper_than_a_chord_of_the_ball_with_more_cells() {
    check_a_cloth_between_nodes_is_no_deeper_than_a_chord_of_the_ball(&[60]);
}

fn check_a_cloth_between_nodes_is_no_deeper_than_a_chord_of_the_ball(sizes: &[u32]) {
    for &cells in sizes {
        let shape = Shape::Sphere { radius: RADIUS };
        let (mut world, cloth, ball) = above(cells, shape, 0.0);
        let triangles = square(SIZE, cells).triangles;
        let diagonal = std::f32::consts::SQRT_2 * SIZE / cells as f32 * (4.0 / 3.0);
        let mut deepest = [f32::MIN; 2];
        press(&mut world, ball, 0.03, 0.0, |world| {
            let pose = world.pose(ball).expect("a ball");
            let positions = body(world, cloth).positions();
            let depth = |point: Vec3| RADIUS - point.distance(pose.position);
            for &node in positions {
                deepest[0] = deepest[0].max(depth(node));
            }
            for corners in &triangles {
                let middle = corners.map(|node| positions[node as usize]).iter().sum::<Vec3>() / 3.0;
                deepest[1] = deepest[1].max(depth(middle));
            }
        });
        let [nodes, middles] = deepest;
        assert!(nodes < 1e-4 * RADIUS, "{cells}: nodes {nodes} m deep");
        let sag = diagonal * diagonal / (6.0 * RADIUS);
        assert!(
            middles < sag,
            "{cells}: middles of faces {middles} m deep, {sag} allowed"
        );
        assert!(middles > 0.0, "{cells}: no face touched the ball");
    }
}

/// A ball of triangles lies within the round ball by the sag of its edges. Apart from that, both press the same.
#[test]
fn a_mesh_of_a_ball_presses_like_the_ball() {
    check_a_mesh_of_a_ball_presses_like_the_ball(0.4, 0.03);
}

#[test]
#[ignore = "long"]
fn a_mesh_of_a_ball_presses_like_the_ball_without_friction() {
    check_a_mesh_of_a_ball_presses_like_the_ball(0.0, 0.0);
}

fn check_a_mesh_of_a_ball_presses_like_the_ball(friction: f32, aside: f32) {
    let mesh = ball(RADIUS, 4);
    let (mut world, _, round) = above(40, Shape::Sphere { radius: RADIUS }, friction);
    let exact = press(&mut world, round, 0.03, aside, |_| ());
    let shape = Shape::Mesh {
        positions: &mesh.positions,
        triangles: &mesh.triangles,
    };
    let (mut world, _, meshed) = above(40, shape, friction);
    let measured = press(&mut world, meshed, 0.03, aside, |_| ());
    assert!(exact.y > 0.1, "no force to measure: {exact}");
    assert!(
        measured.distance(exact) < 0.02 * exact.length(),
        "friction {friction}: {measured} N by the mesh, {exact} N by the ball"
    );
}

/// Contacts of two tools with shared nodes are solved together. When they press from both sides, the forces balance.
#[test]
fn balls_on_both_sides_of_a_cloth_balance_each_other() {
    let (mut world, cloth, upper) = above(40, Shape::Sphere { radius: RADIUS }, 0.3);
    let lower = tool(
        &mut world,
        Shape::Sphere { radius: RADIUS },
        0.3,
        Vec3::NEG_Y * RADIUS,
        Quat::IDENTITY,
    );
    for frame in 1..=60 {
        let displacement = 0.002 * (frame as f32 / 30.0).min(1.0);
        world
            .set_pose(upper, Vec3::Y * (RADIUS + 0.001 - displacement), None)
            .expect("a pose");
        world
            .set_pose(lower, Vec3::NEG_Y * (RADIUS + 0.001), None)
            .expect("a pose");
        world.step(FRAME).expect("a step");
    }
    let [up, down] = [upper, lower].map(|tool| world.wrench(tool).expect("a tool").0);
    let carried = pin_forces(&world, cloth, &rim(40)).as_vec3();
    let sum = up + down;
    assert!(
        sum.distance(carried) < 0.02 * up.length() + 1e-4,
        "{up} and {down} N on the balls, {carried} N on the rim"
    );
}

/// A cloth is stretched to several times its length under a ball, so that the ball becomes small relative to its edges.
/// Edges join contact detection as soon as they are long.
#[test]
fn a_ball_does_not_pass_through_a_stretched_cloth() {
    check_a_ball_does_not_pass_through_a_stretched_cloth(20, 3.0);
}

#[test]
#[ignore = "long"]
fn a_ball_does_not_pass_through_a_stretched_cloth_of_more_cells() {
    check_a_ball_does_not_pass_through_a_stretched_cloth(40, 4.0);
}

fn check_a_ball_does_not_pass_through_a_stretched_cloth(cells: u32, times: f32) {
    let edge = SIZE / cells as f32;
    let radius = times * edge;
    let mut world = world(Vec3::ZERO);
    let soft = Tissue {
        stiffness: 20.0,
        ..TISSUE
    };
    let cloth = soft.put(&mut world, &square(SIZE, cells));
    pin_all(&mut world, cloth, &rim(cells));
    let start = Vec3::new(edge / 2.0, radius + 0.002, edge / 2.0);
    let ball = tool(&mut world, Shape::Sphere { radius }, 0.0, start, Quat::IDENTITY);
    let mut before = 0.0;
    for frame in 1..=120 {
        let position = start - Vec3::Y * (0.2 * frame as f32 / 150.0);
        world.set_pose(ball, position, None).expect("a pose");
        world.step(FRAME).expect("a step");
        if frame % 20 == 0 {
            let force = world.wrench(ball).expect("a ball").0.y;
            assert!(
                force > before,
                "{cells} cells: {force} N after {before} N: it passed through"
            );
            before = force;
        }
    }
}
