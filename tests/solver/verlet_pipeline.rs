//! A large body takes several substeps in one pass, tile by tile. The results are bitwise identical to single substeps.

use std::ops::Range;

use crate::support::bodies::{FREE, Parts, Random, Scene};
use glam::Vec3;
use sinew::WorldDefinition;

/// A sheet of `side` x `side` nodes, joined to all eight neighbors, with some long springs, pins and different masses.
fn sheet(side: usize, long_springs: usize, damping: f32, random: &mut Random) -> Parts {
    let node = |row: usize, column: usize| row * side + column;
    let position = |index: usize| Vec3::new((index % side) as f32, 0.0, (index / side) as f32) * 0.01;
    let mut parts = Parts::nodes((0..side * side).map(position).collect(), 1e-3);
    for row in 0..side {
        for column in 0..side {
            let mut join = |r: usize, c: usize| {
                if r < side && c < side {
                    parts.join(node(row, column), node(r, c), 10.0);
                }
            };
            join(row, column + 1);
            join(row + 1, column);
            join(row + 1, column + 1);
            join(row + 1, column.wrapping_sub(1));
        }
    }
    for _ in 0..long_springs {
        let a = random.below(side * side - 4000);
        parts.join(a, a + 3000 + random.below(1000), 0.01);
    }
    for index in 0..side * side {
        parts.node_dampings[index] = damping * (1.0 + random.signed());
        parts.masses[index] = match random.below(100) {
            0 => 0.0,
            _ => 1e-3 * (1.0 + 0.1 * random.signed()),
        };
    }
    parts
}

fn world(substeps: u32, thread_count: u32) -> WorldDefinition {
    WorldDefinition {
        substeps,
        thread_count,
        ..FREE
    }
}

/// A scene in motion.
fn moving(parts: &Parts, definition: WorldDefinition) -> Scene {
    let mut random = Random::new(80);
    let velocities: Vec<Vec3> = parts.positions.iter().map(|_| 0.2 * random.vector()).collect();
    let mut scene = Scene::new(parts, definition);
    scene.body_mut().set_velocities(&velocities).expect("velocities");
    scene
}

#[test]
fn many_substeps_agree_with_as_many_steps() {
    many_substeps_agree_with_as_many_steps_of(0..1);
}

#[test]
#[ignore = "long"]
fn many_substeps_agree_with_as_many_steps_in_the_other_cases() {
    many_substeps_agree_with_as_many_steps_of(1..3);
}

fn many_substeps_agree_with_as_many_steps_of(cases: Range<usize>) {
    const H: f32 = 1.0 / 4096.0;
    for (side, long_springs, damping) in [(200, 30, 0.0), (230, 0, 0.0), (230, 0, 1e-4)]
        .into_iter()
        .take(cases.end)
        .skip(cases.start)
    {
        let parts = sheet(side, long_springs, damping, &mut Random::new(81));
        let mut one_by_one = moving(&parts, world(1, 1));
        let steps = [16, 1, 2, 3, 40, 21];
        let mut ends = Vec::new();
        for substeps in steps {
            one_by_one.run(H, substeps);
            ends.push((one_by_one.positions(), one_by_one.velocities()));
        }
        for threads in [1, 2, 3] {
            for (substeps, (positions, velocities)) in [16, 40].into_iter().zip([&ends[0], &ends[4]]) {
                let mut scene = moving(&parts, world(substeps, threads));
                if substeps == 40 {
                    // The same number of substeps before.
                    scene = moving(&parts, world(62, threads));
                    scene.step(62.0 * H);
                } else {
                    scene.step(substeps as f32 * H);
                }
                let named = format!("{side} x {side}, damping {damping}, {substeps} substeps, {threads} threads");
                assert_eq!(&scene.positions(), positions, "{named}");
                assert_eq!(&scene.velocities(), velocities, "{named}");
            }
        }
    }
}

#[test]
fn a_distant_tool_leaves_a_large_body_bitwise_identical() {
    let parts = sheet(230, 0, 1e-4, &mut Random::new(82));
    let run = |tool: Option<Vec3>| {
        let mut scene = moving(&parts, world(40, 2));
        if let Some(position) = tool {
            let shape = sinew::Shape::Sphere { radius: 0.1 };
            let pose = sinew::Pose {
                position,
                ..sinew::Pose::IDENTITY
            };
            let definition = sinew::ToolDefinition {
                pose,
                ..sinew::ToolDefinition::new(shape)
            };
            scene.world.create_tool(&definition).expect("a tool");
        }
        for _ in 0..3 {
            scene.step(40.0 / 4096.0);
        }
        (scene.positions(), scene.velocities())
    };
    let alone = run(None);
    for position in [Vec3::Y * 50.0, Vec3::new(1.0, 0.5, 1.0)] {
        assert_eq!(run(Some(position)), alone, "{position}");
    }
}
