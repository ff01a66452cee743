//! Where memory runs out, a cut is refused, and nothing has changed.
#![allow(unsafe_code, clippy::unwrap_used)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

#[path = "cutting/sheet.rs"]
mod sheet;

use glam::{Vec3, vec2, vec3};
use sheet::{Body, unstructured, wavy};
use sinew::cutting::{Limits, Sweep};
use sinew::{BodyDefinition, Error, Shape, Solver, Storage, ToolDefinition, Values, World, WorldDefinition};

thread_local! {
    /// How many more times this thread gets memory; none: as often as it likes.
    static LEFT: Cell<Option<usize>> = const { Cell::new(None) };
}

struct Scarce;

fn is_refused() -> bool {
    LEFT.with(|left| match left.get() {
        Some(0) => true,
        Some(more) => {
            left.set(Some(more - 1));
            false
        }
        None => false,
    })
}

// SAFETY: it is the system's allocator, or has no memory.
unsafe impl GlobalAlloc for Scarce {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as the caller vouches.
        if is_refused() {
            std::ptr::null_mut()
        } else {
            // SAFETY: the same contract.
            unsafe { System.alloc(layout) }
        }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        // SAFETY: as the caller vouches.
        unsafe { System.dealloc(at, layout) }
    }
}

#[global_allocator]
static SCARCE: Scarce = Scarce;

#[test]
fn a_cut_without_memory_changes_nothing() {
    let mut body = Body::new(unstructured(8, 3), wavy);
    body.cut(vec2(-1.0, 4.2), vec2(9.0, 3.7));
    let sweep = body.sweep(vec2(2.0, 6.6), vec2(5.1, -1.0));
    let near = body.surface.near(&sweep, &body.positions).unwrap();
    let before = format!(
        "{:?} {:?} {:?}",
        body.surface.cells(),
        body.surface.triangles(),
        body.surface.vertices()
    );
    for times in 0.. {
        LEFT.with(|left| left.set(Some(times)));
        let answer = body.surface.cut(&sweep, &body.positions, &near, Limits::NONE);
        LEFT.with(|left| left.set(None));
        match answer {
            Ok(changes) => {
                assert!(times > 100, "it needs memory {times} times");
                body.apply(&changes);
                assert_eq!(body.check(), 3);
                return;
            }
            Err(error) => assert_eq!(error, Error::OutOfMemory),
        }
        let after = format!(
            "{:?} {:?} {:?}",
            body.surface.cells(),
            body.surface.triangles(),
            body.surface.vertices()
        );
        assert_eq!(before, after);
    }
}

#[test]
fn a_body_that_cannot_be_cut_for_lack_of_memory_stays_as_it_was() {
    let (rest, cells) = unstructured(8, 3);
    for (solver, storage) in [
        (Solver::Verlet, Storage::Packed),
        (Solver::Verlet, Storage::Efficient),
        (Solver::Implicit, Storage::DynamicBulk),
        (Solver::Newton, Storage::FastLink),
    ] {
        let mut world = World::new(WorldDefinition::default()).unwrap();
        let definition = BodyDefinition {
            positions: &rest,
            masses: Values::Uniform(1.0),
            triangles: &cells,
            stiffnesses: Values::Uniform(100.0),
            springs_per_node: if storage == Storage::FastLink { 20 } else { 0 },
            spare_nodes: 200,
            solver,
            storage,
            ..Default::default()
        };
        let body = world.create_body(&definition).unwrap();
        let mut tool = ToolDefinition::new(Shape::Sphere { radius: 1.0 });
        tool.pose.position = 1.5 * Vec3::Z;
        world.create_tool(&tool).unwrap();
        world.step(1e-3).unwrap();
        let blade = |x: f32, y: f32| [vec3(x, y, -9.0), vec3(x, y, 9.0)];
        let sweep = Sweep {
            start: blade(2.0, 6.6),
            end: blade(5.1, -1.0),
        };
        let before = world.state_hash();
        for times in 0.. {
            LEFT.with(|left| left.set(Some(times)));
            let answer = world.cut(body, &sweep);
            LEFT.with(|left| left.set(None));
            match answer {
                Ok(report) => {
                    assert!(times > 100, "it needs memory {times} times");
                    assert!(report.new_nodes > 0);
                    break;
                }
                Err(error) => assert_eq!(error, Error::OutOfMemory),
            }
            assert_eq!(
                world.state_hash(),
                before,
                "{solver:?}, {storage:?}: without memory after {times} times"
            );
            assert_eq!(world.body(body).unwrap().changes_since(0).unwrap().version, 0);
        }
        // A step of what was cut needs none.
        world.step(1e-3).unwrap();
        LEFT.with(|left| left.set(Some(0)));
        let steps = (0..20).try_for_each(|_| world.step(1e-3).map(|_| ()));
        LEFT.with(|left| left.set(None));
        steps.unwrap();
        assert!(
            world
                .body(body)
                .unwrap()
                .positions()
                .iter()
                .all(|place| place.is_finite())
        );
    }
}
