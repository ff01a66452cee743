//! Results are the same to the bit, however many threads share a step, and whoever's they are.

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

/// Nobody may ask for this.
fn unwanted(count: u32, _task: Task) {
    panic!("{count} tasks for a world that is not worth them");
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

/// A cloth with so many quads a side, held at a corner.
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

/// Two large cloths and five small ones, of which one is gone again, over a ball.
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

/// What is seen of a world after a few steps.
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
fn any_number_of_threads_gives_the_same_bits() {
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
fn a_step_that_is_refused_says_so_whoever_takes_it() {
    for definition in [threads(1), threads(2), tasks(2, &on_threads), tasks(2, &never)] {
        let mut world = scene(definition);
        let hash = world.state_hash();
        assert!(matches!(world.step(1e6), Err(Error::Unstable { .. })), "{definition:?}");
        assert_eq!(world.state_hash(), hash);
        world.step(0.01).expect("a step");
    }
}

#[test]
fn a_job_system_is_asked_for_what_is_worth_it_alone() {
    let mut small = World::new(tasks(4, &unwanted)).expect("a world");
    small.step(0.01).expect("nothing to do");
    add_cloth(&mut small, 20);
    small.step(0.01).expect("one small body");
    add_cloth(&mut small, 3);
    small.step(0.01).expect("two small bodies");
    let mut alone = scene(tasks(1, &unwanted));
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
fn worlds_may_go_to_other_threads_and_be_looked_at_by_several() {
    fn may<T: Send + Sync>(_: &T) {}
    let mut world = scene(threads(2));
    may(&world);
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
