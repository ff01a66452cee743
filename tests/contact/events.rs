//! Contact of bodies with each other begins and ends, each once.

use glam::Vec3;
use sinew::mesh::Mesh;
use sinew::{BodyContact, BodyDefinition, BodyId, Error, Sleep, Solver, Values, World, WorldDefinition};

/// A block of 4 cm that meets others, with its middle here.
fn block(world: &mut World, at: Vec3, speed: f32, solver: Solver, sleep: Sleep) -> BodyId {
    let mesh = Mesh::block([0.04; 3], [3; 3]).expect("a block");
    let positions: Vec<Vec3> = mesh.positions.iter().map(|&place| place + at).collect();
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

/// The events of a step, the lower body first.
fn events(world: &World, bodies: [BodyId; 2]) -> Vec<bool> {
    let changes = world.body_contact_changes().map(|change| {
        assert_eq!(change.bodies, bodies);
        change.has_begun
    });
    changes.collect()
}

#[test]
fn blocks_that_bounce_begin_to_touch_once_and_cease_once() {
    for solvers in [
        [Solver::Verlet; 2],
        [Solver::Implicit; 2],
        [Solver::Verlet, Solver::Implicit],
    ] {
        let mut world = world(0.0);
        let places = [Vec3::new(-0.03, 0.0, 0.0), Vec3::new(0.03, 0.002, 0.001)];
        let bodies = [0, 1].map(|side| {
            let speed = [0.5, -0.5][side];
            block(&mut world, places[side], speed, solvers[side], Sleep::default())
        });
        let (mut touch, mut seen) = (false, Vec::new());
        for step in 0..200 {
            world.step(1e-3).expect("a step");
            let events = events(&world, bodies);
            for &has_begun in &events {
                assert_ne!(has_begun, touch, "{solvers:?}, step {step}");
                touch = has_begun;
            }
            let contacts = world.tissue_contacts(bodies[0]).expect("a body");
            let others = contacts.filter(|contact| contact.body == bodies[1]).count();
            assert!(touch || others == 0, "{solvers:?}, step {step}: what presses touches");
            seen.extend(events);
            // A world that was saved tells the same.
            if touch && step % 7 == 0 {
                let loaded = World::load(&world.save().expect("bytes"), 1, None).expect("a world");
                let both = [&world, &loaded].map(|world| world.body_contact_changes().collect::<Vec<_>>());
                assert_eq!(both[0], both[1]);
            }
        }
        assert_eq!(
            (seen.first(), seen.last(), seen.len() % 2),
            (Some(&true), Some(&false), 0)
        );
        assert!(seen.len() <= 4, "{solvers:?}: {} events of a bounce", seen.len());
    }
}

#[test]
fn a_block_that_rests_goes_on_touching_also_where_it_sleeps() {
    let sleep = Sleep { speed: 5e-3, time: 0.1 };
    for solver in [Solver::Verlet, Solver::Implicit] {
        let mut world = world(-10.0);
        let bodies = [0.0, 0.0402].map(|y| block(&mut world, Vec3::new(0.1 * y, y, 0.0), 0.0, solver, sleep));
        let lower = world.body_mut(bodies[0]).expect("a body");
        let ground: Vec<u32> = (0..lower.node_count() as u32)
            .filter(|&node| lower.positions()[node as usize].y < -0.019)
            .collect();
        ground.iter().for_each(|&node| lower.pin(node).expect("a node"));
        let mut seen = Vec::new();
        for _ in 0..300 {
            world.step(5e-3).expect("a step");
            seen.extend(events(&world, bodies));
        }
        assert!(
            bodies
                .iter()
                .all(|&id| world.body(id).expect("a body").awake_share() == 0.0),
            "{solver:?}"
        );
        assert_eq!(world.tissue_contacts(bodies[0]).expect("a body").count(), 0, "asleep");
        let sum = seen
            .iter()
            .map(|&has_begun| if has_begun { 1 } else { -1 })
            .sum::<i32>();
        assert_eq!(sum, 1, "{solver:?}: {seen:?}");

        // A step that is refused tells nothing new, and with what is destroyed nothing ceases.
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
fn a_block_that_is_lifted_off_ceases_to_touch() {
    let mut world = world(0.0);
    let bodies = [0.0, 0.0402].map(|y| block(&mut world, Vec3::Y * y, 0.0, Solver::Verlet, Sleep::default()));
    let push = |world: &mut World, speed: f32| {
        let upper = world.body_mut(bodies[1]).expect("a body");
        let velocities = vec![Vec3::Y * speed; upper.node_count()];
        upper.set_velocities(&velocities).expect("velocities");
    };
    let mut seen = Vec::new();
    for step in 0..120 {
        if step % 40 == 0 {
            push(&mut world, if step == 40 { 0.3 } else { -0.1 });
        }
        world.step(1e-3).expect("a step");
        seen.extend(events(&world, bodies));
    }
    assert_eq!(seen.first(), Some(&true));
    assert!(seen.contains(&false));
    for pair in seen.windows(2) {
        assert_ne!(pair[0], pair[1]);
    }
}
