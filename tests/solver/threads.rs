//! Results are bitwise identical for any number of threads and for the host's job system.

use std::thread;

use glam::Vec3;
use sinew::mesh::Mesh;
use sinew::{BodyDefinition, BodyId, Error, Pose, RunTasks, Shape, ToolDefinition, Values, World, WorldDefinition};

use crate::support::bodies::without_ids;

type Task<'a> = &'a (dyn Fn(u32) + Sync);
type System = &'static (dyn for<'a> Fn(u32, Task<'a>) + Sync);

fn in_reverse(count: u32, task: Task) {
    (0..count).rev().for_each(task);
}

fn on_threads(count: u32, task: Task) {
    thread::scope(|scope| {
        for index in 0..count {
            scope.spawn(move || task(index));
        }
    });
}

fn never(_count: u32, _task: Task) {}

/// A job system that must not be called.
fn must_not_be_called(count: u32, _task: Task) {
    panic!("{count} tasks for a world too small for tasks");
}

fn threads(thread_count: u32) -> WorldDefinition {
    WorldDefinition {
        thread_count,
        ..WorldDefinition::default()
    }
}

fn tasks(thread_count: u32, run: &'static (dyn Fn(u32, Task) + Sync)) -> WorldDefinition {
    WorldDefinition {
        tasks: Some(RunTasks::new(run)),
        ..threads(thread_count)
    }
}

/// Adds a cloth with this many quads per side, held at a corner.
fn add_cloth(world: &mut World, quads: u32) -> BodyId {
    let mesh = Mesh::cloth([0.3, 0.3], [quads, quads]).expect("a cloth");
    let definition = BodyDefinition {
        masses: Values::Uniform(1e-3),
        stiffnesses: Values::Uniform(20.0),
        spring_dampings: Values::Uniform(1e-3),
        ..BodyDefinition::of(&mesh)
    };
    let body = world.create_body(&definition).expect("a body");
    world.body_mut(body).and_then(|body| body.pin(0)).expect("a node");
    body
}

/// Two large cloths and five small ones, one of which is removed, over a ball.
fn scene(definition: WorldDefinition) -> World {
    let mut world = World::new(definition).expect("a world");
    for quads in [7, 95, 20, 31, 99, 3, 40] {
        let body = add_cloth(&mut world, quads);
        if quads == 31 {
            world.destroy_body(body).expect("it lives");
        }
    }
    let ball = ToolDefinition {
        pose: Pose {
            position: Vec3::new(0.02, -0.025, 0.01),
            ..Pose::IDENTITY
        },
        friction: 0.3,
        ..ToolDefinition::new(Shape::Sphere { radius: 0.02 })
    };
    world.create_tool(&ball).expect("a tool");
    world
}

/// Returns the observable state of a world after a few steps.
fn moved(definition: WorldDefinition) -> (u64, Vec<Vec<Vec3>>, String) {
    let mut world = scene(definition);
    let mut reports = String::new();
    for _ in 0..6 {
        reports += &format!("{:?}", world.step(0.01).map(without_ids));
    }
    let positions = world.bodies().map(|body| body.positions().to_vec()).collect();
    (world.state_hash(), positions, reports)
}

#[test]
fn any_number_of_threads_is_bitwise_identical() {
    let alone = moved(threads(1));
    let sizes = alone.1.iter().map(Vec::len);
    assert_eq!(sizes.clone().filter(|&size| size >= 8192).count(), 2);
    assert_eq!(sizes.count(), 6);
    let start: Vec<Vec<Vec3>> = scene(threads(1))
        .bodies()
        .map(|body| body.positions().to_vec())
        .collect();
    for (moved, start) in alone.1.iter().zip(&start) {
        assert!(moved.iter().zip(start).skip(1).all(|(moved, start)| moved != start));
    }
    for count in [0, 2, 3, 5] {
        assert!(moved(threads(count)) == alone, "{count} threads");
    }
    let systems: [(&str, System); 3] = [
        ("in reverse", &in_reverse),
        ("on threads", &on_threads),
        ("never", &never),
    ];
    for (name, run) in systems {
        assert!(moved(tasks(3, run)) == alone, "tasks {name}");
    }
}

#[test]
fn a_refused_step_is_reported_with_any_threads() {
    for definition in [threads(1), threads(2), tasks(2, &on_threads), tasks(2, &never)] {
        let mut world = scene(definition);
        let hash = world.state_hash();
        assert!(matches!(world.step(1e6), Err(Error::Unstable { .. })), "{definition:?}");
        assert_eq!(world.state_hash(), hash);
        world.step(0.01).expect("a step");
    }
}

#[test]
fn a_job_system_gets_only_large_tasks() {
    let mut small = World::new(tasks(4, &must_not_be_called)).expect("a world");
    small.step(0.01).expect("nothing to do");
    add_cloth(&mut small, 20);
    small.step(0.01).expect("one small body");
    add_cloth(&mut small, 3);
    small.step(0.01).expect("two small bodies");
    let mut alone = scene(tasks(1, &must_not_be_called));
    alone.step(0.01).expect("one thread");
}

#[test]
fn too_many_threads_are_refused_by_name() {
    for definition in [threads(257), tasks(257, &never)] {
        match World::new(definition) {
            Err(Error::InvalidArgument(message)) => assert!(message.contains("thread_count is 257"), "{message}"),
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn worlds_are_send_and_sync() {
    fn is_send_and_sync<T: Send + Sync>(_: &T) {}
    let mut world = scene(threads(2));
    is_send_and_sync(&world);
    world.step(0.01).expect("a step");
    let world = thread::spawn(move || {
        world.step(0.01).expect("a step on another thread");
        world
    });
    let world = world.join().expect("no panic");
    let mut alone = scene(threads(1));
    for _ in 0..2 {
        alone.step(0.01).expect("a step");
    }
    assert_eq!(world.state_hash(), alone.state_hash());
}
