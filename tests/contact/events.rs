//! Contact events between bodies: each contact begins once and ends once.

use glam::Vec3;
use sinew::mesh::Mesh;
use sinew::{BodyContact, BodyDefinition, BodyId, Error, Sleep, Solver, Values, World, WorldDefinition};

/// Creates a block of 4 cm with its center at `at`. It collides with other bodies and with itself.
fn block(world: &mut World, at: Vec3, speed: f32, solver: Solver, sleep: Sleep) -> BodyId {
    let mesh = Mesh::block([0.04; 3], [3; 3]).expect("a block");
    let positions: Vec<Vec3> = mesh.positions.iter().map(|&position| position + at).collect();
    let body = world
        .create_body(&BodyDefinition {
            positions: &positions,
            tetrahedra: &mesh.tetrahedra,
            triangles: &mesh.triangles,
            masses: Values::Uniform(1e-3),
            stiffnesses: Values::Uniform(300.0),
            node_dampings: Values::Uniform(if speed == 0.0 { 0.02 } else { 0.0 }),
            contact: BodyContact {
                thickness: 5e-4,
                with_bodies: true,
                with_itself: true,
                ..BodyContact::NOTHING
            },
            solver,
            sleep,
            ..BodyDefinition::default()
        })
        .expect("a body");
    let velocities = vec![Vec3::X * speed; positions.len()];
    let it = world.body_mut(body).expect("a body");
    it.set_velocities(&velocities).expect("velocities");
    body
}

fn world(gravity: f32) -> World {
    World::new(WorldDefinition {
        gravity: Vec3::Y * gravity,
        ..WorldDefinition::default()
    })
    .expect("a world")
}

/// Returns the events of a step; `bodies` has the lower id first.
fn events(world: &World, bodies: [BodyId; 2]) -> Vec<bool> {
    let changes = world.body_contact_changes().map(|change| {
        assert_eq!(change.bodies, bodies);
        change.has_begun
    });
    changes.collect()
}

#[test]
fn bouncing_blocks_begin_and_end_contact_once() {
    for solvers in [
        [Solver::Verlet; 2],
        [Solver::Implicit; 2],
        [Solver::Verlet, Solver::Implicit],
    ] {
        let mut world = world(0.0);
        let positions = [Vec3::new(-0.03, 0.0, 0.0), Vec3::new(0.03, 0.002, 0.001)];
        let bodies = [0, 1].map(|side| {
            let speed = [0.5, -0.5][side];
            block(&mut world, positions[side], speed, solvers[side], Sleep::default())
        });
        let (mut in_contact, mut all_events) = (false, Vec::new());
        for step in 0..200 {
            world.step(1e-3).expect("a step");
            let events = events(&world, bodies);
            for &has_begun in &events {
                assert_ne!(has_begun, in_contact, "{solvers:?}, step {step}");
                in_contact = has_begun;
            }
            let contacts = world.tissue_contacts(bodies[0]).expect("a body");
            let others = contacts.filter(|contact| contact.body == bodies[1]).count();
            assert!(
                in_contact || others == 0,
                "{solvers:?}, step {step}: what presses touches"
            );
            all_events.extend(events);
            // A saved world returns the same events.
            if in_contact && step % 7 == 0 {
                let loaded = World::load(&world.save().expect("bytes"), 1, None).expect("a world");
                let both = [&world, &loaded].map(|world| world.body_contact_changes().collect::<Vec<_>>());
                assert_eq!(both[0], both[1]);
            }
        }
        assert_eq!(
            (all_events.first(), all_events.last(), all_events.len() % 2),
            (Some(&true), Some(&false), 0)
        );
        assert!(
            all_events.len() <= 4,
            "{solvers:?}: {} events of a bounce",
            all_events.len()
        );
    }
}

#[test]
fn a_resting_block_stays_in_contact_while_asleep() {
    let sleep = Sleep { speed: 5e-3, time: 0.1 };
    for solver in [Solver::Verlet, Solver::Implicit] {
        let mut world = world(-10.0);
        let bodies = [0.0, 0.0402].map(|y| block(&mut world, Vec3::new(0.1 * y, y, 0.0), 0.0, solver, sleep));
        let lower = world.body_mut(bodies[0]).expect("a body");
        let ground: Vec<u32> = (0..lower.node_count() as u32)
            .filter(|&node| lower.positions()[node as usize].y < -0.019)
            .collect();
        ground.iter().for_each(|&node| lower.pin(node).expect("a node"));
        let mut all_events = Vec::new();
        for _ in 0..300 {
            world.step(5e-3).expect("a step");
            all_events.extend(events(&world, bodies));
        }
        assert!(
            bodies
                .iter()
                .all(|&id| world.body(id).expect("a body").awake_share() == 0.0),
            "{solver:?}"
        );
        assert_eq!(world.tissue_contacts(bodies[0]).expect("a body").count(), 0, "asleep");
        let sum = all_events
            .iter()
            .map(|&has_begun| if has_begun { 1 } else { -1 })
            .sum::<i32>();
        assert_eq!(sum, 1, "{solver:?}: {all_events:?}");

        // A refused step returns no new events. Destroying a body produces no end events.
        world.body_mut(bodies[1]).expect("a body").wake();
        world.set_substeps(1, 1).expect("substeps");
        if solver == Solver::Verlet {
            assert!(matches!(world.step(0.5), Err(Error::Unstable { .. })));
            assert_eq!(events(&world, bodies), []);
        }
        world.set_substeps(0, 1000).expect("substeps");
        world.destroy_body(bodies[1]).expect("a body");
        world.step(5e-3).expect("a step");
        assert_eq!(world.body_contact_changes().count(), 0);
    }
}

#[test]
fn lifting_a_block_ends_its_contact() {
    let mut world = world(0.0);
    let bodies = [0.0, 0.0402].map(|y| block(&mut world, Vec3::Y * y, 0.0, Solver::Verlet, Sleep::default()));
    let push = |world: &mut World, speed: f32| {
        let upper = world.body_mut(bodies[1]).expect("a body");
        let velocities = vec![Vec3::Y * speed; upper.node_count()];
        upper.set_velocities(&velocities).expect("velocities");
    };
    let mut all_events = Vec::new();
    for step in 0..120 {
        if step % 40 == 0 {
            push(&mut world, if step == 40 { 0.3 } else { -0.1 });
        }
        world.step(1e-3).expect("a step");
        all_events.extend(events(&world, bodies));
    }
    assert_eq!(all_events.first(), Some(&true));
    assert!(all_events.contains(&false));
    for pair in all_events.windows(2) {
        assert_ne!(pair[0], pair[1]);
    }
}
