//! Nodes that meet a tool one by one: a round tool, the same as a mesh, and what happens between nodes.

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

/// A cloth that is held at its rim, and this tool above its middle.
fn above(cells: u32, shape: Shape, friction: f32) -> (World, BodyId, ToolId) {
    let mut world = world(Vec3::ZERO);
    let cloth = TISSUE.put(&mut world, &square(SIZE, cells));
    pin_all(&mut world, cloth, &rim(cells));
    let tool = tool(&mut world, shape, friction, Vec3::Y * RADIUS, Quat::IDENTITY);
    (world, cloth, tool)
}

/// Presses the tool `depth` into the cloth within half a second, moves it `aside`, and waits: the force on it.
fn press(world: &mut World, tool: ToolId, depth: f32, aside: f32, mut look: impl FnMut(&World)) -> Vec3 {
    for frame in 1..=90 {
        let [down, along] = [frame, frame - 30].map(|frame| (frame as f32 / 30.0).clamp(0.0, 1.0));
        let place = Vec3::new(aside * along, RADIUS - depth * down, 0.0);
        world.set_pose(tool, place, None).expect("a pose");
        world.step(FRAME).expect("a step");
        look(world);
    }
    world.wrench(tool).expect("a tool").0
}

/// A chord of length l within a ball of radius R sags by l² / 8R, a triangle by no more than l² / 6R; the cloth may stretch by a third on the way.
#[test]
fn between_nodes_a_cloth_is_no_deeper_than_a_chord_of_the_ball() {
    between_nodes_a_cloth_is_no_deeper_than_a_chord_of_the_ball_of(&[20, 40]);
}

#[test]
#[ignore = "long"]
fn between_nodes_a_cloth_is_no_deeper_than_a_chord_of_the_ball_with_more_cells() {
    between_nodes_a_cloth_is_no_deeper_than_a_chord_of_the_ball_of(&[60]);
}

fn between_nodes_a_cloth_is_no_deeper_than_a_chord_of_the_ball_of(sizes: &[u32]) {
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
        assert!(middles > 0.0, "{cells}: nothing lay on the ball");
    }
}

/// A ball of triangles lies within the round one by a chord of its edges: the same press but for that.
#[test]
fn a_mesh_of_a_ball_presses_as_the_ball_does() {
    a_mesh_of_a_ball_presses_as_the_ball_does_of(0.4, 0.03);
}

#[test]
#[ignore = "long"]
fn a_mesh_of_a_ball_presses_as_the_ball_does_without_friction() {
    a_mesh_of_a_ball_presses_as_the_ball_does_of(0.0, 0.0);
}

fn a_mesh_of_a_ball_presses_as_the_ball_does_of(friction: f32, aside: f32) {
    let mesh = ball(RADIUS, 4);
    let (mut world, _, round) = above(40, Shape::Sphere { radius: RADIUS }, friction);
    let exact = press(&mut world, round, 0.03, aside, |_| ());
    let shape = Shape::Mesh {
        positions: &mesh.positions,
        triangles: &mesh.triangles,
    };
    let (mut world, _, meshed) = above(40, shape, friction);
    let found = press(&mut world, meshed, 0.03, aside, |_| ());
    assert!(exact.y > 0.1, "nothing to be measured: {exact}");
    assert!(
        found.distance(exact) < 0.02 * exact.length(),
        "friction {friction}: {found} N by the mesh, {exact} N by the ball"
    );
}

/// What two tools give to nodes that they share is found together: pressed from both sides, each feels what the other does.
#[test]
fn balls_on_both_sides_of_a_cloth_feel_each_other() {
    let (mut world, cloth, upper) = above(40, Shape::Sphere { radius: RADIUS }, 0.3);
    let lower = tool(
        &mut world,
        Shape::Sphere { radius: RADIUS },
        0.3,
        Vec3::NEG_Y * RADIUS,
        Quat::IDENTITY,
    );
    for frame in 1..=60 {
        let way = 0.002 * (frame as f32 / 30.0).min(1.0);
        world
            .set_pose(upper, Vec3::Y * (RADIUS + 0.001 - way), None)
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

/// A cloth is stretched to several times its length under a ball, and the ball becomes small beside its edges: they take part as soon as they are long.
#[test]
fn a_cloth_that_is_stretched_lets_no_ball_through() {
    a_cloth_that_is_stretched_lets_no_ball_through_of(20, 3.0);
}

#[test]
#[ignore = "long"]
fn a_cloth_that_is_stretched_lets_no_ball_through_of_more_cells() {
    a_cloth_that_is_stretched_lets_no_ball_through_of(40, 4.0);
}

fn a_cloth_that_is_stretched_lets_no_ball_through_of(cells: u32, times: f32) {
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
        let place = start - Vec3::Y * (0.2 * frame as f32 / 150.0);
        world.set_pose(ball, place, None).expect("a pose");
        world.step(FRAME).expect("a step");
        if frame % 20 == 0 {
            let force = world.wrench(ball).expect("a ball").0.y;
            assert!(
                force > before,
                "{cells} cells: {force} N after {before} N: it went through"
            );
            before = force;
        }
    }
}
