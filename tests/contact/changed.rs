//! Contact settings of tools and bodies that change between steps. From the next step on, they act as if set at
//! creation.

use crate::support::tissue::*;
use glam::Vec3;
use sinew::{BodyId, CollisionFilter, Error, Shape, Solver, ToolDefinition, ToolId, World};

const NOTHING: CollisionFilter = CollisionFilter { category: 1, mask: 0 };

/// Creates a cloth that is pinned at its border, and a tool.
fn scene(solver: Solver, definition: &ToolDefinition) -> (World, BodyId, ToolId) {
    let calm = Tissue {
        mass: 0.02,
        stiffness: 100.0,
        drag: 20.0,
        spring_damping: 0.01,
    };
    let mut world = world(Vec3::ZERO);
    let cloth = calm.put_for(solver, &mut world, &square(0.1, 8));
    pin_all(&mut world, cloth, &rim(8));
    let tool = world.create_tool(definition).expect("a tool");
    (world, cloth, tool)
}

/// Presses the ball onto the cloth and along it, in `steps` steps from step `begun` on.
fn press(world: &mut World, tool: ToolId, first_step: u32, steps: u32) {
    for step in first_step..first_step + steps {
        let distance = step as f32 * 1e-4;
        let position = Vec3::new(distance, 0.01 - distance, 0.0);
        world.set_pose(tool, position, None).expect("a pose");
        world.step(1e-3).expect("a step");
    }
}

fn ball() -> ToolDefinition<'static> {
    ToolDefinition {
        pose: sinew::Pose {
            position: Vec3::Y * 0.01,
            ..sinew::Pose::IDENTITY
        },
        ..ToolDefinition::new(Shape::Sphere { radius: 0.01 })
    }
}

#[test]
fn settings_changed_before_the_first_step_act_as_if_set_at_creation() {
    for solver in [Solver::Verlet, Solver::Implicit] {
        let configured = ToolDefinition {
            friction: 0.7,
            force_limit: 0.02,
            ..ball()
        };
        let (mut first, _, tool) = scene(solver, &configured);
        press(&mut first, tool, 0, 40);
        let (mut plain, _, tool) = scene(solver, &ball());
        press(&mut plain, tool, 0, 40);
        let (mut changed, cloth, tool) = scene(
            solver,
            &ToolDefinition {
                filter: NOTHING,
                ..ball()
            },
        );
        changed
            .body_mut(cloth)
            .expect("the cloth")
            .set_collision_filter(NOTHING);
        changed.set_friction(tool, 0.7).expect("a friction");
        changed.set_force_limit(tool, 0.02).expect("a limit");
        changed
            .set_collision_filter(tool, CollisionFilter::ALL)
            .expect("a filter");
        let cloth = changed.body_mut(cloth).expect("the cloth");
        cloth.set_collision_filter(CollisionFilter::ALL);
        press(&mut changed, tool, 0, 40);
        assert_eq!(changed.state_hash(), first.state_hash(), "{solver:?}");
        assert_ne!(changed.state_hash(), plain.state_hash(), "{solver:?}");
    }
}

#[test]
fn contact_ends_when_filtered_out_and_returns_afterwards() {
    for solver in [Solver::Verlet, Solver::Implicit] {
        for of_tool in [true, false] {
            let (mut world, cloth, tool) = scene(solver, &ball());
            let set_filter = |world: &mut World, filter: CollisionFilter| {
                if of_tool {
                    world.set_collision_filter(tool, filter).expect("a filter");
                } else {
                    world.body_mut(cloth).expect("the cloth").set_collision_filter(filter);
                }
            };
            let pressed = |world: &World| world.wrench(tool).expect("the tool").0.y;
            let changes = |world: &World| {
                world
                    .contact_changes()
                    .map(|change| change.has_begun)
                    .collect::<Vec<_>>()
            };
            press(&mut world, tool, 0, 30);
            assert!(pressed(&world) > 1e-3);
            set_filter(&mut world, NOTHING);
            press(&mut world, tool, 30, 1);
            assert_eq!((pressed(&world), changes(&world)), (0.0, vec![false]));
            press(&mut world, tool, 31, 9);
            assert_eq!((pressed(&world), changes(&world)), (0.0, vec![]));
            set_filter(&mut world, CollisionFilter::ALL);
            press(&mut world, tool, 40, 1);
            assert_eq!(changes(&world), [true], "{solver:?}, of the tool: {of_tool}");
            // Nodes inside the ball by then are pushed out, and the force matches that of uninterrupted contact.
            press(&mut world, tool, 41, 60);
            let (mut other, cloth_there, tool_there) = scene(solver, &ball());
            press(&mut other, tool_there, 0, 101);
            let force = other.wrench(tool_there).expect("the tool").0.y;
            assert!(
                (pressed(&world) - force).abs() < 0.1 * force,
                "{solver:?}, of the tool: {of_tool}: {} instead of {force} N",
                pressed(&world)
            );
            let [deepest, other_deepest] = [(&world, cloth), (&other, cloth_there)].map(|(world, cloth)| {
                let heights = body(world, cloth).positions().iter().map(|p| p.y);
                heights.fold(f32::INFINITY, f32::min)
            });
            assert!(
                (deepest - other_deepest).abs() < 5e-4,
                "{solver:?}: {deepest} instead of {other_deepest}"
            );
        }
    }
}

#[test]
fn invalid_coefficients_and_limits_are_refused_and_change_nothing() {
    let (mut world, _, tool) = scene(Solver::Verlet, &ball());
    let before = world.state_hash();
    for wrong in [-1.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let refused = world.set_friction(tool, wrong);
        assert!(
            matches!(&refused, Err(Error::InvalidArgument(message)) if message.contains("friction") && message.contains(&wrong.to_string())),
            "{refused:?}"
        );
        if wrong != f32::INFINITY {
            let refused = world.set_force_limit(tool, wrong);
            assert!(
                matches!(&refused, Err(Error::InvalidArgument(message)) if message.contains("force_limit")),
                "{refused:?}"
            );
        }
    }
    assert_eq!(world.state_hash(), before);
    world.set_force_limit(tool, f32::INFINITY).expect("no limit");
    world.destroy_tool(tool).expect("the tool");
    let stale = [
        world.set_friction(tool, 0.5),
        world.set_force_limit(tool, 1.0),
        world.set_collision_filter(tool, NOTHING),
    ];
    assert!(
        stale.iter().all(|result| matches!(result, Err(Error::StaleId(_)))),
        "{stale:?}"
    );
}
