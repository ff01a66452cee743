//! Numbers at the limits of `f32`, and inputs that must have no effect.

use glam::Vec3;
use sinew::mesh::Mesh;
use sinew::{
    Anchor, BodyContact, BodyDefinition, Error, Pose, Shape, Solver, ToolDefinition, Values, World, WorldDefinition,
};

fn world() -> World {
    World::new(WorldDefinition::default()).expect("a world")
}

#[test]
fn springs_beyond_the_range_allow_no_step() {
    let positions = [Vec3::ZERO, Vec3::X * 5.0, Vec3::Y];
    for stiffness in [1e36, 3e38] {
        let mut world = world();
        let definition = BodyDefinition {
            positions: &positions,
            springs: Some(&[[0, 1]]),
            rest_lengths: Some(&[1.0]),
            masses: Values::Uniform(1e-3),
            stiffnesses: Values::Uniform(stiffness),
            solver: Solver::Verlet,
            ..BodyDefinition::default()
        };
        let body = world.create_body(&definition).expect("a body");
        let hash = world.state_hash();
        assert!(matches!(world.step(0.01), Err(Error::Unstable { .. })));
        assert_eq!(world.state_hash(), hash);
        assert_eq!(world.body(body).expect("a body").positions(), &positions);
    }
}

#[test]
fn a_distant_tool_leaves_a_moving_cloth_bitwise_identical() {
    let mesh = Mesh::cloth([0.2, 0.2], [9, 9]).expect("a cloth");
    let moved = |with_tool: bool| {
        let mut world = world();
        let definition = BodyDefinition {
            masses: Values::Uniform(1e-3),
            stiffnesses: Values::Uniform(200.0),
            ..BodyDefinition::of(&mesh)
        };
        let cloth = world.create_body(&definition).expect("a cloth");
        if with_tool {
            let pose = Pose {
                position: Vec3::X * 1000.0,
                ..Pose::IDENTITY
            };
            let ball = ToolDefinition {
                pose,
                ..ToolDefinition::new(Shape::Sphere { radius: 0.1 })
            };
            world.create_tool(&ball).expect("a ball");
        }
        let velocities: Vec<Vec3> = mesh
            .positions
            .iter()
            .map(|p| Vec3::new(1.0, 8.0 * p.x, 5.0 * p.z))
            .collect();
        let body = world.body_mut(cloth).expect("a cloth");
        body.set_velocities(&velocities).expect("velocities");
        body.pin(0).expect("a node");
        for _ in 0..60 {
            world.step(1.0 / 60.0).expect("a step");
        }
        world.body(cloth).expect("a cloth").positions().to_vec()
    };
    assert_eq!(moved(true), moved(false));
}

#[test]
fn a_force_on_a_pinned_node_has_no_effect_even_after_release() {
    let mut world = world();
    let definition = BodyDefinition {
        positions: &[Vec3::ZERO],
        masses: Values::Uniform(1e-3),
        ..BodyDefinition::default()
    };
    let id = world.create_body(&definition).expect("a body");
    world.set_gravity(Vec3::ZERO).expect("gravity");
    let body = world.body_mut(id).expect("a body");
    body.pin(0).expect("a node");
    body.apply_force(0, Vec3::X).expect("a force");
    body.unpin(0).expect("a node");
    world.step(0.01).expect("a step");
    assert_eq!(world.body(id).expect("a body").positions(), &[Vec3::ZERO]);
}

/// A step near a tool or body is cut into substeps of 1 ms or 0.25 ms. The number of substeps is bounded, whatever the
/// caller requests.
#[test]
fn a_step_near_a_tool_takes_a_bounded_number_of_substeps() {
    a_step_near_a_tool_takes_a_bounded_number_of_substeps_of(Solver::Implicit);
}

#[test]
#[ignore = "long"]
fn a_step_near_a_tool_takes_a_bounded_number_of_substeps_with_newton() {
    a_step_near_a_tool_takes_a_bounded_number_of_substeps_of(Solver::Newton);
}

fn a_step_near_a_tool_takes_a_bounded_number_of_substeps_of(solver: Solver) {
    let mesh = Mesh::cloth([0.1, 0.1], [2, 2]).expect("a cloth");
    let cloth = |with_bodies| BodyDefinition {
        masses: Values::Uniform(1e-3),
        stiffnesses: Values::Uniform(20.0),
        node_dampings: Values::Uniform(1e-2),
        contact: BodyContact {
            with_bodies,
            ..BodyContact::default()
        },
        solver,
        ..BodyDefinition::of(&mesh)
    };
    let hang = |world: &mut World, with_bodies| {
        let body = world.create_body(&cloth(with_bodies)).expect("a cloth");
        for corner in [0, 2, 6, 8] {
            world.body_mut(body).expect("a cloth").pin(corner).expect("a pin");
        }
        body
    };
    let [mut near_tissue, mut near_a_tool, mut attached] = [(); 3].map(|()| world());
    hang(&mut near_tissue, true);
    hang(&mut near_tissue, true);
    hang(&mut near_a_tool, false);
    near_a_tool
        .create_tool(&ToolDefinition::new(Shape::Sphere { radius: 0.02 }))
        .expect("a ball");
    let [body, other] = [(); 2].map(|()| hang(&mut attached, false));
    let anchors = [1, 3, 4].map(Anchor::Node);
    { attached.attach_to_body(body, &anchors, other, &anchors, f32::INFINITY) }.expect("cloths that are attached");
    for (mut world, longest) in [(near_tissue, 4.096), (near_a_tool, 4.096), (attached, 1.024)] {
        for _ in 0..2 {
            world.step(0.01).expect("a short step");
            let hash = world.state_hash();
            for dt in [1.01 * longest, 1e5, f32::MAX] {
                let refused = world.step(dt);
                assert!(
                    matches!(refused, Err(Error::Unstable { .. })),
                    "{solver:?}, {dt} s: {refused:?}"
                );
            }
            assert_eq!(world.state_hash(), hash, "{solver:?}");
            let report = world.step(0.99 * longest).expect("a long step");
            assert!(
                (4000..=4096).contains(&report.substeps),
                "{solver:?}: {}",
                report.substeps
            );
        }
    }
}
