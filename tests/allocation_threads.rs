//! A step allocates nothing on any of its threads. Alone in its program: everything that is asked for is counted.
#![allow(unsafe_code)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicU64, Ordering};

use glam::Vec3;
use sinew::mesh::Mesh;
use sinew::{
    BodyContact, BodyDefinition, Error, Material, Model, Shape, Sleep, Solver, ToolDefinition, Values, World,
    WorldDefinition,
};

static ASKED: AtomicU64 = AtomicU64::new(0);

/// The system's allocator; it counts what all threads ask of it.
struct Counting;

// SAFETY: every call goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ASKED.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the same contract.
        unsafe { System.alloc(layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        ASKED.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the same contract.
        unsafe { System.realloc(pointer, layout, size) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        ASKED.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the same contract.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn asked(call: impl FnOnce()) -> u64 {
    let before = ASKED.load(Ordering::Relaxed);
    call();
    ASKED.load(Ordering::Relaxed) - before
}

#[test]
fn a_step_on_two_threads_allocates_nothing() {
    assert!(
        asked(|| drop(std::thread::spawn(|| vec![1_u8; 100]).join())) >= 2,
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
        assert_eq!(asked(|| drop(world.step(0.01))), 0, "step {step}");
        // Awake, and asleep.
        std::thread::sleep(std::time::Duration::from_micros(100 * (step % 4)));
    }
    let refused = asked(|| assert!(matches!(world.step(1e6), Err(Error::Unstable { .. }))));
    assert_eq!(refused, 0);
    // Small ones are there sooner than a thread begins, large ones share their work.
    fresh_worlds_allocate_nothing([2, 2, 2], 40);
    fresh_worlds_allocate_nothing([14, 8, 14], 1);
}

/// Worlds of all sorts, each stepped as soon as it is there: no thread of theirs is still about to begin.
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
    let meeting = |definition| BodyDefinition {
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
        meeting(springs),
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
                let place = Vec3::Y * (0.031 - 1e-3 * step as f32);
                world.set_pose(ball, place, None).expect("a pose");
                let asked = asked(|| assert!(world.step(4e-3).is_ok()));
                assert_eq!(asked, 0, "step {step} of body {kind}, round {round}");
                // Queries keep what they take; a step gives nothing of it back.
                world.nearest_point(place, 1.0).expect("a point");
            }
        }
    }
}
