//! A step allocates nothing on any of its threads. Alone in its program: everything that is asked for is counted.
#![allow(unsafe_code)]

#[path = "support/counting.rs"]
mod counting;

use std::sync::atomic::{AtomicU64, Ordering};

use counting::Counting;
use sinew::mesh::Mesh;
use sinew::{BodyDefinition, Error, Values, World, WorldDefinition};

static ASKED: AtomicU64 = AtomicU64::new(0);

/// What all threads ask for.
fn count() {
    ASKED.fetch_add(1, Ordering::Relaxed);
}

#[global_allocator]
static ALLOCATOR: Counting = Counting(count);

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
            positions: &mesh.positions,
            triangles: &mesh.triangles,
            masses: Values::Uniform(1e-3),
            stiffnesses: Values::Uniform(20.0),
            ..BodyDefinition::default()
        };
        let cloth = world.create_body(&cloth).expect("a body");
        world.body_mut(cloth).and_then(|body| body.pin(0)).expect("a node");
    }
    // What a thread asks for when it begins is no step's.
    std::thread::sleep(std::time::Duration::from_millis(100));
    for step in 0..20 {
        assert_eq!(asked(|| drop(world.step(0.01))), 0, "step {step}");
        // Awake, and asleep.
        std::thread::sleep(std::time::Duration::from_micros(100 * (step % 4)));
    }
    let refused = asked(|| assert!(matches!(world.step(1e6), Err(Error::Unstable { .. }))));
    assert_eq!(refused, 0);
}
