//! Readers: other threads get a body's state after whole steps, concurrently with calls on the world.

use std::sync::Barrier;
use std::thread;

use glam::{Vec3, vec3};
use sinew::cutting::Sweep;
use sinew::mesh::Mesh;
use sinew::{
    BodyDefinition, BodyId, BodyReader, Error, Frame, RestStateDefinition, Solver, Storage, Tearing, Values, World,
    WorldDefinition,
};

/// Creates a cloth of squares of 1 cm that hangs by a corner.
fn cloth(cells: u32, thread_count: u32) -> (World, BodyId) {
    let side = 0.01 * cells as f32;
    let mesh = Mesh::cloth([side, side], [cells, cells]).expect("a cloth");
    hanging(
        &BodyDefinition {
            positions: &mesh.positions,
            triangles: &mesh.triangles,
            ..BodyDefinition::default()
        },
        thread_count,
    )
}

fn hanging(definition: &BodyDefinition, thread_count: u32) -> (World, BodyId) {
    let world = WorldDefinition {
        thread_count,
        ..WorldDefinition::default()
    };
    let mut world = World::new(world).expect("a world");
    let definition = BodyDefinition {
        masses: Values::Uniform(1e-4),
        stiffnesses: Values::Uniform(20.0),
        node_dampings: Values::Uniform(1e-4),
        ..*definition
    };
    let body = world.create_body(&definition).expect("a body");
    world.body_mut(body).and_then(|body| body.pin(0)).expect("a node");
    (world, body)
}

/// Returns true if a frame equals the current state of a body.
fn is_current(frame: &Frame, world: &World, body: BodyId) -> bool {
    let body = world.body(body).expect("a body");
    frame.positions == body.positions()
        && frame.triangles == body.surface()
        && frame.topology_version == body.topology_version()
}

/// Reads until the body is destroyed, and calls `check` at least twice per frame, sometimes after a delay. Returns the
/// last step.
fn read_to_the_end(mut reader: BodyReader, start: &Barrier, check: impl Fn(&Frame)) -> u64 {
    let first = reader.read();
    assert!(first.is_new && !first.is_over);
    check(&first);
    let (mut version, mut step, mut time) = (first.version, first.step, first.time);
    start.wait();
    loop {
        let frame = reader.read();
        check(&frame);
        if frame.is_new {
            assert!(frame.version > version, "{} after {version}", frame.version);
            assert!(frame.step >= step && frame.time >= time, "{} after {step}", frame.step);
        } else {
            assert_eq!((frame.version, frame.step, frame.time), (version, step, time));
        }
        (version, step, time) = (frame.version, frame.step, frame.time);
        if version % 3 == 0 {
            thread::yield_now();
            check(&frame);
        }
        if frame.is_over {
            return step;
        }
    }
}

#[test]
fn every_frame_belongs_to_a_whole_step() {
    for (cells, thread_count, steps) in [(30, 1, 500), (99, 2, 60)] {
        let (mut world, body) = cloth(cells, thread_count);
        let positions = |world: &World| world.body(body).expect("a body").positions().to_vec();
        let mut trajectory = vec![positions(&world)];
        for _ in 0..steps {
            world.step(1e-3).expect("a step");
            trajectory.push(positions(&world));
        }
        assert!(
            trajectory.windows(2).all(|pair| pair[0] != pair[1]),
            "each step moves it"
        );

        let (mut world, body) = cloth(cells, thread_count);
        let readers: Vec<_> = (0..3).map(|_| world.create_reader(body).expect("a reader")).collect();
        let start = Barrier::new(4);
        thread::scope(|scope| {
            let (trajectory, start) = (&trajectory, &start);
            let reading: Vec<_> = readers
                .into_iter()
                .map(|reader| {
                    scope.spawn(move || {
                        read_to_the_end(reader, start, |frame| {
                            assert!(
                                frame.positions == trajectory[frame.step as usize],
                                "torn at step {}",
                                frame.step
                            );
                            assert!((frame.time - 1e-3 * frame.step as f64).abs() < 1e-6);
                        })
                    })
                })
                .collect();
            start.wait();
            for _ in 0..steps {
                world.step(1e-3).expect("a step");
            }
            drop(world);
            for reading in reading {
                assert_eq!(reading.join().expect("a reader"), steps);
            }
        });
    }
}

#[test]
fn a_reader_changes_no_result() {
    let [mut read, mut alone] = [(), ()].map(|()| cloth(12, 1));
    let mut reader = read.0.create_reader(read.1).expect("a reader");
    for _ in 0..20 {
        for (world, _) in [&mut read, &mut alone] {
            world.step(2e-3).expect("a step");
        }
        assert!(reader.read().is_new);
    }
    assert_eq!(read.0.state_hash(), alone.0.state_hash());
}

#[test]
fn a_version_changes_when_positions_do() {
    for storage in [Storage::Packed, Storage::Efficient] {
        let mesh = Mesh::cloth([0.1, 0.1], [10, 10]).expect("a cloth");
        let definition = BodyDefinition {
            positions: &mesh.positions,
            triangles: &mesh.triangles,
            storage,
            ..BodyDefinition::default()
        };
        let (mut world, body) = hanging(&definition, 1);
        world.step(1e-3).expect("a step");
        let mut reader = world.create_reader(body).expect("a reader");
        let first = reader.read();
        assert!(first.is_new && !first.is_over && is_current(&first, &world, body));
        assert_eq!(first.step, 1);
        assert_eq!(first.time, f64::from(1e-3_f32));
        let mut version = first.version;
        let mut changed = |reader: &mut BodyReader, world: &World, is_expected: bool, case: &str| {
            let frame = reader.read();
            assert_eq!(frame.is_new, is_expected, "{case}");
            assert_eq!(frame.version > version, is_expected, "{case}");
            assert!(is_current(&frame, world, body), "{case}");
            version = frame.version;
            let (step, repeated) = (frame.step, reader.read());
            assert!(!repeated.is_new && repeated.version == version && repeated.step == step);
            step
        };
        changed(&mut reader, &world, false, "nothing");
        world.step(1e-3).expect("a step");
        assert_eq!(changed(&mut reader, &world, true, "a step"), 2);
        assert!(world.step(f32::NAN).is_err());
        changed(&mut reader, &world, false, "a step that is refused");

        let moved: Vec<_> = mesh.positions.iter().map(|position| *position + Vec3::Y).collect();
        let set = |world: &mut World, new_positions: &[Vec3]| {
            world.body_mut(body).and_then(|body| body.set_positions(new_positions))
        };
        set(&mut world, &moved).expect("places");
        assert_eq!(changed(&mut reader, &world, true, "set_positions"), 2);
        assert!(set(&mut world, &moved[1..]).is_err());
        changed(&mut reader, &world, false, "set_positions that is refused");
        world
            .rest_state(body, &RestStateDefinition::default())
            .expect("a state of rest");
        changed(&mut reader, &world, true, "rest_state");

        // A body that would overflow is rolled back, so it did not move.
        let fast = vec![Vec3::splat(1e30); moved.len()];
        world
            .body_mut(body)
            .and_then(|body| body.set_velocities(&fast))
            .expect("velocities");
        let report = world.step(1e-4).expect("a step");
        assert_eq!(report.bodies_restored, 1);
        changed(&mut reader, &world, false, "a step that is put back");
        set(&mut world, &moved).expect("places");
        assert_eq!(changed(&mut reader, &world, true, "set_positions after it"), 3);
    }
}

#[test]
fn a_refused_step_publishes_no_frame() {
    let mesh = Mesh::cloth([0.1, 0.1], [10, 10]).expect("a cloth");
    let definition = WorldDefinition {
        max_substeps: 1,
        ..WorldDefinition::default()
    };
    let mut world = World::new(definition).expect("a world");
    let body = BodyDefinition {
        positions: &mesh.positions,
        triangles: &mesh.triangles,
        masses: Values::Uniform(1e-4),
        stiffnesses: Values::Uniform(1e3),
        solver: Solver::Verlet,
        ..BodyDefinition::default()
    };
    let body = world.create_body(&body).expect("a body");
    let mut reader = world.create_reader(body).expect("a reader");
    let version = reader.read().version;
    assert!(matches!(world.step(0.1), Err(Error::Unstable { .. })));
    let frame = reader.read();
    assert_eq!((frame.version, frame.step, frame.is_new), (version, 0, false));
    world.step(1e-6).expect("a step");
    let frame = reader.read();
    assert_eq!((frame.step, frame.is_new), (1, true));
}

#[test]
fn a_reader_outlives_its_body_and_its_world() {
    for world_ends in [false, true] {
        let (mut world, body) = cloth(5, 1);
        let [mut old, mut new] = [(), ()].map(|()| world.create_reader(body).expect("a reader"));
        old.read();
        world.step(1e-3).expect("a step");
        let last = world.body(body).expect("a body").positions().to_vec();
        let surface = world.body(body).expect("a body").surface().to_vec();
        if world_ends {
            drop(world);
        } else {
            world.destroy_body(body).expect("a body");
            assert!(matches!(world.create_reader(body), Err(Error::StaleId(_))));
        }
        for reader in [&mut old, &mut new] {
            for is_new in [true, false] {
                let frame = reader.read();
                assert_eq!((frame.is_new, frame.is_over, frame.step), (is_new, true, 1));
                assert!(frame.positions == last && frame.triangles == surface);
            }
        }
        thread::spawn(|| drop(old)).join().expect("its end elsewhere");
        assert_eq!(new.read().positions, last);
    }
}

#[test]
fn readers_can_be_added_and_dropped() {
    let (mut world, body) = cloth(3, 1);
    let mut readers: Vec<_> = (0..126).map(|_| world.create_reader(body).expect("a reader")).collect();
    match world.create_reader(body) {
        Err(Error::Capacity(why)) => assert!(why.contains("126 readers"), "{why}"),
        other => panic!("{other:?}"),
    }
    // Each reader holds its own frame.
    for (step, reader) in (0..).zip(&mut readers) {
        assert_eq!(reader.read().step, step);
        world.step(1e-3).expect("a step");
    }
    for (step, reader) in readers.iter_mut().enumerate().rev() {
        let frame = reader.read();
        assert_eq!((frame.step, frame.is_new), (126, true), "of {step}");
        assert!(is_current(&frame, &world, body));
    }
    // The body moves while there are no readers. A new reader gets its current state.
    thread::spawn(|| drop(readers)).join().expect("their end");
    world.step(1e-3).expect("a step");
    let mut reader = world.create_reader(body).expect("a reader");
    let frame = reader.read();
    assert!(frame.is_new && frame.step == 127 && is_current(&frame, &world, body));
}

/// Creates a cuttable cloth or organ.
fn soft(is_solid: bool) -> (World, BodyId) {
    let mesh = match is_solid {
        true => Mesh::organ(0.1, 0.012).expect("an organ"),
        false => Mesh::cloth([0.1, 0.1], [14, 14]).expect("a cloth"),
    };
    hanging(
        &BodyDefinition {
            positions: &mesh.positions,
            triangles: &mesh.triangles,
            tetrahedra: &mesh.tetrahedra,
            spare_nodes: 3000,
            ..BodyDefinition::default()
        },
        1,
    )
}

/// Cuts from alternate sides and takes steps after each cut. Calls `see` after each cut and each step.
fn cut_and_step(world: &mut World, body: BodyId, mut visit: impl FnMut(&World)) {
    for cut in 0..12 {
        let positions = world.body(body).expect("a body").positions();
        let centre = positions.iter().sum::<Vec3>() / positions.len() as f32;
        let x = 0.04 * (cut as f32 / 6.0 - 0.9);
        let sign = if cut % 2 == 0 { 1.0 } else { -1.0 };
        let edge = |z: f32| [vec3(x, -0.3, sign * z), vec3(x, 0.3, sign * z)].map(|position| centre + position);
        let sweep = Sweep {
            start: edge(0.2),
            end: edge(0.01),
        };
        world.cut(body, &sweep).expect("a cut");
        visit(world);
        for _ in 0..5 {
            world.step(5e-4).expect("a step");
            visit(world);
        }
    }
}

#[test]
fn a_body_can_be_cut_while_it_is_read() {
    for is_solid in [false, true] {
        // For each topology version, the node count and the triangles; for each frame, the positions.
        let (mut world, body) = soft(is_solid);
        let mut own = world.create_reader(body).expect("a reader");
        let first = own.read();
        assert!(is_current(&first, &world, body));
        let mut topologies = vec![(first.positions.len(), first.triangles.to_vec())];
        let mut frames = vec![((first.topology_version, first.step), first.positions.to_vec())];
        cut_and_step(&mut world, body, |world| {
            let frame = own.read();
            assert!(frame.is_new && is_current(&frame, world, body));
            if frame.topology_version as usize == topologies.len() {
                topologies.push((frame.positions.len(), frame.triangles.to_vec()));
            }
            assert_eq!(frame.topology_version as usize, topologies.len() - 1);
            frames.push(((frame.topology_version, frame.step), frame.positions.to_vec()));
        });
        assert!(topologies.len() > 10, "{} versions", topologies.len());
        drop(world);

        let (mut world, body) = soft(is_solid);
        let readers = [(), ()].map(|()| world.create_reader(body).expect("a reader"));
        let start = Barrier::new(3);
        thread::scope(|scope| {
            let (topologies, frames, start) = (&topologies, &frames, &start);
            let reading = readers.map(|reader| {
                scope.spawn(move || {
                    read_to_the_end(reader, start, |frame| {
                        let (count, triangles) = &topologies[frame.topology_version as usize];
                        assert_eq!(frame.positions.len(), *count);
                        assert!(frame.triangles == triangles);
                        let matches_frame =
                            |(of, _): &&((u64, u64), Vec<Vec3>)| *of == (frame.topology_version, frame.step);
                        let (_, positions) = frames.iter().find(matches_frame).expect("a frame that there was");
                        assert!(frame.positions == positions);
                    })
                })
            });
            start.wait();
            cut_and_step(&mut world, body, |_| ());
            drop(world);
            for reading in reading {
                assert_eq!(reading.join().expect("a reader"), 60);
            }
        });
    }
}

#[test]
fn tears_are_published_with_their_step() {
    let mesh = Mesh::cloth([0.1, 0.1], [12, 12]).expect("a cloth");
    let taut: Vec<_> = mesh.positions.iter().map(|position| 1.3 * *position).collect();
    let definition = BodyDefinition {
        positions: &taut,
        rest_positions: Some(&mesh.positions),
        triangles: &mesh.triangles,
        spare_nodes: 500,
        tearing: Tearing {
            strain: 0.2,
            most_per_step: 3,
            ..Tearing::default()
        },
        ..BodyDefinition::default()
    };
    let (mut world, body) = hanging(&definition, 1);
    let mut reader = world.create_reader(body).expect("a reader");
    reader.read();
    for step in 1..10 {
        world.step(1e-4).expect("a step");
        let frame = reader.read();
        assert!(
            frame.is_new && frame.step == step && is_current(&frame, &world, body),
            "step {step}"
        );
    }
    assert!(world.body(body).expect("a body").topology_version() > 5, "it tears");
}
