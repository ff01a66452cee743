//! A step allocates nothing on any of its threads. A separate program, because the allocator counts every call.
#![allow(unsafe_code)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicU64, Ordering};

use glam::Vec3;
use sinew::mesh::Mesh;
use sinew::{
    BodyContact, BodyDefinition, Error, Material, Model, Shape, Sleep, Solver, ToolDefinition, Values, World,
    WorldDefinition,
};

static CALLS: AtomicU64 = AtomicU64::new(0);

/// The system allocator with a count of all threads' calls.
struct Counting;

// SAFETY: every call goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        CALLS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the same contract.
        unsafe { System.alloc(layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        CALLS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the same contract.
        unsafe { System.realloc(pointer, layout, size) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        CALLS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the same contract.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn allocator_calls(call: impl FnOnce()) -> u64 {
    let before = CALLS.load(Ordering::Relaxed);
    call();
    CALLS.load(Ordering::Relaxed) - before
}

#[test]
fn a_step_on_two_threads_allocates_nothing() {
    assert!(
        allocator_calls(|| drop(std::thread::spawn(|| vec![1_u8; 100]).join())) >= 2,
        "it counts"
    );
    let definition = WorldDefinition {
        thread_count: 2,
        ..WorldDefinition::default()
    };
    let mut world = World::new(definition).expect("a world");
    for quads in [30, 100, 40] {
        let mesh = Mesh::cloth([0.3, 0.3], [quads, quads]).expect("a cloth");
        let cloth = BodyDefinition {
            masses: Values::Uniform(1e-3),
            stiffnesses: Values::Uniform(20.0),
            ..BodyDefinition::of(&mesh)
        };
        let cloth = world.create_body(&cloth).expect("a body");
        world.body_mut(cloth).and_then(|body| body.pin(0)).expect("a node");
    }
    for step in 0..20 {
        assert_eq!(allocator_calls(|| drop(world.step(0.01))), 0, "step {step}");
        // Threads are awake in some steps and asleep in others.
        std::thread::sleep(std::time::Duration::from_micros(100 * (step % 4)));
    }
    let refused = allocator_calls(|| assert!(matches!(world.step(1e6), Err(Error::Unstable { .. }))));
    assert_eq!(refused, 0);
    // Small worlds are ready before their threads have started; large worlds distribute their work.
    fresh_worlds_allocate_nothing([2, 2, 2], 40);
    fresh_worlds_allocate_nothing([14, 8, 14], 1);
}

/// Steps worlds of all kinds immediately after creation, possibly while their threads are still starting.
fn fresh_worlds_allocate_nothing(cells: [u32; 3], rounds: u32) {
    let block = Mesh::block([0.06, 0.04, 0.06], cells).expect("a block");
    let springs = BodyDefinition {
        masses: Values::Uniform(1e-4),
        stiffnesses: Values::Uniform(50.0),
        spring_dampings: Values::Uniform(1e-3),
        ..BodyDefinition::of(&block)
    };
    let elements = BodyDefinition {
        material: Some(Material {
            model: Model::Tetrahedra,
            young_modulus: 5000.0,
            poisson_ratio: 0.3,
            ..Material::default()
        }),
        stiffnesses: Values::Uniform(0.0),
        spring_dampings: Values::Uniform(0.0),
        ..springs
    };
    let implicit = |definition| BodyDefinition {
        solver: Solver::Implicit,
        ..definition
    };
    let colliding = |definition| BodyDefinition {
        contact: BodyContact {
            with_bodies: true,
            with_itself: true,
            ..BodyContact::default()
        },
        ..definition
    };
    let sleeping = |definition| BodyDefinition {
        sleep: Sleep {
            speed: 10.0,
            time: 1e-2,
        },
        ..definition
    };
    let bodies = [
        springs,
        elements,
        implicit(springs),
        implicit(elements),
        colliding(springs),
        sleeping(elements),
    ];
    for round in 0..rounds {
        for (kind, body) in bodies.iter().enumerate() {
            let definition = WorldDefinition {
                thread_count: 2,
                ..WorldDefinition::default()
            };
            let mut world = World::new(definition).expect("a world");
            world.create_body(body).expect("a body");
            let mut ball = ToolDefinition::new(Shape::Sphere { radius: 0.01 });
            ball.pose.position = Vec3::Y * 0.032;
            let ball = world.create_tool(&ball).expect("a tool");
            for step in 0..4 {
                let position = Vec3::Y * (0.031 - 1e-3 * step as f32);
                world.set_pose(ball, position, None).expect("a pose");
                let allocator_calls = allocator_calls(|| assert!(world.step(4e-3).is_ok()));
                assert_eq!(allocator_calls, 0, "step {step} of body {kind}, round {round}");
                // Queries keep their memory, and a step frees none of it.
                world.nearest_point(position, 1.0).expect("a point");
            }
        }
    }
}
