//! The time of a VERLET step, as springs per second. A step here is one substep and visits each spring once.
#![allow(clippy::print_stderr)]

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::Vec3;
use sinew::mesh::Mesh;
use sinew::{
    BodyDefinition, HapticDefinition, Pose, Shape, Sleep, Storage, ToolDefinition, Values, World, WorldDefinition,
};

/// Stable for every body here.
const SUBSTEP: f32 = 1e-4;

/// A sheet of `side` x `side` nodes with springs to all 8 neighbors.
fn grid(side: u32) -> (Vec<Vec3>, Vec<[u32; 2]>) {
    let spacing = 1.0 / side as f32;
    let mut positions = Vec::new();
    let mut springs = Vec::new();
    for row in 0..side {
        for column in 0..side {
            let node = row * side + column;
            positions.push(Vec3::new(column as f32 * spacing, 0.0, row as f32 * spacing));
            let (right, below) = (column + 1 < side, row + 1 < side);
            if right {
                springs.push([node, node + 1]);
            }
            if below {
                springs.push([node, node + side]);
            }
            if right && below {
                springs.push([node, node + side + 1]);
                springs.push([node + 1, node + side]);
            }
        }
    }
    (positions, springs)
}

/// A body of these springs, pinned at its first node.
fn definition<'a>(positions: &'a [Vec3], springs: &'a [[u32; 2]]) -> BodyDefinition<'a> {
    BodyDefinition {
        positions,
        springs: Some(springs),
        masses: Values::Uniform(1e-4),
        stiffnesses: Values::Uniform(10.0),
        ..BodyDefinition::default()
    }
}

fn world() -> World {
    let definition = WorldDefinition {
        substeps: 1,
        ..WorldDefinition::default()
    };
    World::new(definition).expect("a valid definition")
}

/// Steps a world with only this body.
fn measure(
    group: &mut criterion::BenchmarkGroup<'_, criterion::measurement::WallTime>,
    name: BenchmarkId,
    body: &BodyDefinition,
) {
    measure_in(world(), group, name, body);
}

/// Steps this empty world with this body.
fn measure_in(
    mut world: World,
    group: &mut criterion::BenchmarkGroup<'_, criterion::measurement::WallTime>,
    name: BenchmarkId,
    body: &BodyDefinition,
) {
    let id = world.create_body(body).expect("a valid body");
    world.body_mut(id).and_then(|body| body.pin(0)).expect("a node");
    let springs = world.body(id).expect("a live body").storage_report().spring_count;
    group.throughput(Throughput::Elements(springs as u64));
    group.bench_function(name, |bencher| {
        bencher.iter(|| world.step(black_box(SUBSTEP)).expect("a stable step"));
    });
}

/// The influence of a body's size and kind.
fn sizes(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("verlet");
    group.sample_size(20);
    for side in [32, 100, 316, 1000] {
        let (positions, springs) = grid(side);
        let nodes = side * side;
        measure(
            &mut group,
            BenchmarkId::new("grid", nodes),
            &definition(&positions, &springs),
        );
    }
    let organ = Mesh::organ(0.25, 0.006).expect("an organ");
    let springs = organ.edges().expect("its edges");
    let nodes = organ.positions.len();
    measure(
        &mut group,
        BenchmarkId::new("organ", nodes),
        &definition(&organ.positions, &springs),
    );
    group.finish();
}

/// The cost of each feature; the first row is a body without features.
fn features(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("features");
    group.sample_size(20);
    let (positions, springs) = grid(100);
    let plain = definition(&positions, &springs);
    measure(&mut group, BenchmarkId::new("none", 10_000), &plain);
    let node_damping = BodyDefinition {
        node_dampings: Values::Uniform(1e-4),
        ..plain
    };
    measure(&mut group, BenchmarkId::new("node damping", 10_000), &node_damping);
    let spring_damping = BodyDefinition {
        spring_dampings: Values::Uniform(1e-3),
        ..plain
    };
    measure(&mut group, BenchmarkId::new("spring damping", 10_000), &spring_damping);
    // Neither body needs added mass.
    for (name, mass_scaling) in [("substeps chosen", 0.0), ("mass scaling, not needed", 0.001)] {
        let world = World::new(WorldDefinition::default()).expect("a valid definition");
        let body = BodyDefinition { mass_scaling, ..plain };
        measure_in(world, &mut group, BenchmarkId::new(name, 10_000), &body);
    }
    group.finish();
}

/// A step of a resting body: sleeping disabled, asleep, and asleep except near a moving ball.
fn sleep(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("sleep");
    group.sample_size(20);
    for side in [100_u32, 316, 1000] {
        let (positions, springs) = grid(side);
        let nodes = side * side;
        for (name, speed, pressed) in [
            ("awake", 0.0, false),
            ("may sleep", 1e-9, false),
            ("asleep", 1e-3, false),
            ("pressed", 1e-3, true),
        ] {
            let definition = BodyDefinition {
                sleep: Sleep {
                    speed,
                    time: 2.0 * SUBSTEP,
                },
                // Damping confines the ball's motion to its neighborhood.
                node_dampings: Values::Uniform(0.5),
                ..definition(&positions, &springs)
            };
            let mut world = world();
            world.set_gravity(Vec3::ZERO).expect("no gravity");
            let id = world.create_body(&definition).expect("a body");
            let node = nodes / 2 + side / 2;
            for _ in 0..4 {
                world.step(SUBSTEP).expect("a step");
            }
            group.bench_function(BenchmarkId::new(name, nodes), |bencher| {
                bencher.iter(|| {
                    if pressed {
                        let body = world.body_mut(id).expect("a body");
                        body.apply_force(node, Vec3::Y * 1e-3).expect("a force");
                    }
                    world.step(black_box(SUBSTEP)).expect("a stable step")
                });
            });
        }
    }
    group.finish();
}

/// The cost of readers for a step: none, one, and one that was destroyed.
fn readers(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("readers");
    group.sample_size(20);
    for side in [100, 316] {
        let (positions, springs) = grid(side);
        let nodes = side * side;
        for (name, is_kept) in [("never", None), ("one", Some(true)), ("one that is gone", Some(false))] {
            let mut world = world();
            let id = world.create_body(&definition(&positions, &springs)).expect("a body");
            world.body_mut(id).and_then(|body| body.pin(0)).expect("a node");
            let mut reader = is_kept.map(|_| world.create_reader(id).expect("a reader"));
            if is_kept == Some(false) {
                reader = None;
            }
            group.bench_function(BenchmarkId::new(name, nodes), |bencher| {
                bencher.iter(|| world.step(black_box(SUBSTEP)).expect("a stable step"));
            });
            drop(reader);
        }
        let mut world = world();
        let id = world.create_body(&definition(&positions, &springs)).expect("a body");
        let mut reader = world.create_reader(id).expect("a reader");
        group.bench_function(BenchmarkId::new("a read", nodes), |bencher| {
            bencher.iter(|| black_box(reader.read().version));
        });
    }
    group.finish();
}

/// The cost of each storage: a sheet of 10K nodes.
fn storages(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("storages");
    group.sample_size(20);
    let (positions, springs) = grid(100);
    for storage in [
        Storage::Packed,
        Storage::FastLink,
        Storage::DynamicBulk,
        Storage::Efficient,
    ] {
        let body = BodyDefinition {
            storage,
            ..definition(&positions, &springs)
        };
        match world().create_body(&body) {
            Ok(_) => measure(&mut group, BenchmarkId::new(format!("{storage:?}"), 10_000), &body),
            Err(error) => eprintln!("NOT OFFERED: {error}"),
        }
    }
    group.finish();
}

/// The cost of a tool: far away, near, and pressed into a cloth.
fn tools(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("tools");
    group.sample_size(20);
    let mesh = Mesh::cloth([1.0, 1.0], [99, 99]).expect("a cloth");
    let masses: Vec<f32> = mesh
        .positions
        .iter()
        .map(|position| {
            if position.x.abs().max(position.z.abs()) > 0.499 {
                0.0
            } else {
                1e-4
            }
        })
        .collect();
    for (name, height) in [
        ("none", None),
        ("far away", Some(10.0)),
        ("near", Some(0.055)),
        ("pressed in", Some(0.02)),
    ] {
        let mut world = world();
        let body = BodyDefinition {
            masses: Values::Each(&masses),
            stiffnesses: Values::Uniform(10.0),
            node_dampings: Values::Uniform(1e-3),
            ..BodyDefinition::of(&mesh)
        };
        let id = world.create_body(&body).expect("a valid body");
        world.set_gravity(Vec3::ZERO).expect("a finite vector");
        if let Some(height) = height {
            let tool = ToolDefinition {
                pose: Pose {
                    position: Vec3::new(0.0, height, 0.0),
                    ..Pose::IDENTITY
                },
                ..ToolDefinition::new(Shape::Sphere { radius: 0.05 })
            };
            world.create_tool(&tool).expect("a valid tool");
        }
        let springs = world.body(id).expect("a live body").storage_report().spring_count;
        group.throughput(Throughput::Elements(springs as u64));
        group.bench_function(name, |bencher| {
            bencher.iter(|| world.step(black_box(SUBSTEP)).expect("a stable step"));
        });
    }
    group.finish();
}

/// The cost of haptics: a step with a handle and without, and a tick, each in contact.
fn haptics(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("haptics");
    group.sample_size(20);
    let mesh = Mesh::cloth([0.1, 0.1], [30, 30]).expect("a cloth");
    let is_border = |position: &Vec3| position.x.abs().max(position.z.abs()) > 0.0499;
    let node_mass = |position: &Vec3| if is_border(position) { 0.0 } else { 1e-5 };
    let masses: Vec<f32> = mesh.positions.iter().map(node_mass).collect();
    for is_led in [false, true] {
        // As many substeps as necessary: a step lasts as long as a tick.
        let mut world = World::new(WorldDefinition::default()).expect("a valid definition");
        let body = BodyDefinition {
            masses: Values::Each(&masses),
            stiffnesses: Values::Uniform(10.0),
            node_dampings: Values::Uniform(1e-3),
            ..BodyDefinition::of(&mesh)
        };
        world.create_body(&body).expect("a valid body");
        world.set_gravity(Vec3::ZERO).expect("a finite vector");
        let pose = Pose {
            position: Vec3::new(0.0, 0.005, 0.0),
            ..Pose::IDENTITY
        };
        let ball = ToolDefinition {
            pose,
            ..ToolDefinition::new(Shape::Sphere { radius: 0.01 })
        };
        let tool = world.create_tool(&ball).expect("a valid tool");
        let handle = is_led.then(|| world.create_haptic(&HapticDefinition::new(tool)).expect("a handle"));
        let name = if is_led {
            "a step with a handle"
        } else {
            "a step without"
        };
        group.bench_function(name, |bencher| {
            bencher.iter(|| world.step(black_box(1e-3)).expect("a stable step"));
        });
        if let Some(mut handle) = handle {
            group.bench_function("a tick", |bencher| {
                bencher.iter(|| {
                    let tick = handle.tick(black_box(pose), Some(Vec3::ZERO), None, 1e-3);
                    tick.expect("a pose").force
                });
            });
        }
    }
    group.finish();
}

criterion_group!(benches, sizes, features, sleep, readers, storages, tools, haptics);
criterion_main!(benches);
