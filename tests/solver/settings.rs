//! Settings that change between steps act as if the body had been created with them; invalid settings change nothing.

use glam::Vec3;
use sinew::{
    BodyContact, BodyDefinition, BodyId, BodySettings, Error, Shape, Sleep, Solver, ToolDefinition, Values, World,
    WorldDefinition,
};

use crate::support::bodies::{FREE, Parts, Scene};
use crate::support::scene::SOLVERS;

const DT: f32 = 0.01;

/// Changes settings of a body.
fn set(world: &mut World, id: BodyId, change: impl FnOnce(&mut BodySettings)) -> sinew::Result<()> {
    let mut settings = world.body(id)?.settings();
    change(&mut settings);
    world.set_body_settings(id, settings)
}

#[test]
fn new_damping_slows_by_its_law() {
    // One free node: v' = -c/m v, so v(t) = v0 exp(-c t / m), which VERLET solves exactly.
    let (mass, damping, time) = (0.02_f32, 0.1_f32, 0.5_f64);
    let mut scene = Scene::new(&Parts::nodes(vec![Vec3::ZERO], mass), FREE);
    scene.body_mut().set_velocities(&[Vec3::X]).expect("a velocity");
    scene.run(DT, 10);
    assert_eq!(scene.velocities()[0].x, 1.0);
    scene.body_mut().set_node_damping(damping).expect("damping");
    assert!((scene.body().node_damping(0).expect("a node") / damping - 1.0).abs() < 1e-6);
    scene.run(DT, (time / f64::from(DT)) as usize);
    let expected = (-f64::from(damping / mass) * time).exp();
    let error = (scene.velocities()[0].x / expected - 1.0).abs();
    assert!(error < 1e-5, "{error}");
    scene.body_mut().set_node_damping(0.0).expect("damping");
    let before = scene.velocities()[0].x;
    scene.run(DT, 10);
    assert!((scene.velocities()[0].x / before - 1.0).abs() < 1e-6);
    for bad in [-1.0, f32::NAN, f32::INFINITY] {
        let refused = scene.body_mut().set_node_damping(bad);
        assert!(matches!(refused, Err(Error::InvalidArgument(_))), "{refused:?}");
    }
    assert!(scene.body().node_damping(1).is_err());
}

#[test]
fn a_block_damped_later_moves_as_one_created_damped() {
    let mut parts = Parts::block([4, 3, 3], 0.02, 1e-3, 100.0);
    // A node so light that mass scaling affects it.
    parts.masses[20] = 1e-5;
    let mut damped = parts.clone();
    damped.node_dampings.fill(1e-3);
    for solver in SOLVERS {
        let with = |parts: &Parts| Scene::with(parts, FREE, |definition| BodyDefinition { solver, ..definition });
        let (mut scene, mut made) = (with(&parts), with(&damped));
        scene.body_mut().set_node_damping(1e-3).expect("damping");
        for scene in [&mut scene, &mut made] {
            let speed = |node: usize| Vec3::X * (node % 3) as f32;
            let velocities: Vec<Vec3> = (0..parts.positions.len()).map(speed).collect();
            scene.body_mut().set_velocities(&velocities).expect("velocities");
            scene.run(DT, 20);
        }
        assert_eq!(scene.world.state_hash(), made.world.state_hash(), "{solver:?}");
    }
}

/// Sheets of one triangle each, one above the other; the upper one falls.
fn sheets(contact: BodyContact) -> (World, BodyId) {
    let mut world = World::new(WorldDefinition {
        gravity: Vec3::Y * -10.0,
        ..FREE
    })
    .expect("a world");
    let below = [
        Vec3::new(-1.0, 0.0, -1.0),
        Vec3::new(0.0, 0.0, 2.0),
        Vec3::new(1.0, 0.0, -1.0),
    ];
    let above = below.map(|position| 0.2 * position + Vec3::Y * 0.02);
    let mut upper = None;
    for (positions, mass) in [(below, 0.0), (above, 0.01)] {
        let masses = [mass; 3];
        upper = Some(
            world
                .create_body(&BodyDefinition {
                    positions: &positions,
                    triangles: &[[0, 1, 2]],
                    masses: Values::Each(&masses),
                    stiffnesses: Values::Uniform(100.0),
                    contact: if mass > 0.0 {
                        contact
                    } else {
                        BodyContact {
                            with_bodies: true,
                            ..BodyContact::NOTHING
                        }
                    },
                    solver: Solver::Verlet,
                    ..BodyDefinition::default()
                })
                .expect("a body"),
        );
    }
    (world, upper.expect("a body"))
}

#[test]
fn body_contact_takes_effect_when_enabled() {
    let height = |world: &World, id| world.body(id).expect("the body").positions()[0].y;
    let (mut world, id) = sheets(BodyContact::NOTHING);
    // It would fall 5 cm in 0.1 s, through the other sheet.
    let mut twin = World::load(&world.save().expect("a snapshot"), 1, None).expect("a world");
    set(&mut world, id, |it| it.with_bodies = true).expect("flags");
    assert!(world.body(id).expect("the body").settings().with_bodies);
    for _ in 0..20 {
        world.step(DT).expect("a step");
        twin.step(DT).expect("a step");
    }
    assert!(height(&twin, id) < -0.1, "{}", height(&twin, id));
    assert!(height(&world, id).abs() < 0.01, "{}", height(&world, id));
    // Then contact is disabled again.
    set(&mut world, id, |it| it.with_bodies = false).expect("flags");
    for _ in 0..20 {
        world.step(DT).expect("a step");
    }
    assert!(height(&world, id) < -0.1, "{}", height(&world, id));
}

#[test]
fn new_thickness_is_kept_off_tools_and_tissue() {
    let (mut world, id) = sheets(BodyContact {
        with_bodies: true,
        ..BodyContact::NOTHING
    });
    let rest = |world: &mut World| {
        (0..200).for_each(|_| assert!(world.step(DT).is_ok()));
        let positions = world.body(id).expect("the body").positions();
        positions
            .iter()
            .fold(f32::INFINITY, |low, position| low.min(position.y))
    };
    assert!(rest(&mut world) < 1e-3);
    set(&mut world, id, |it| it.thickness = 5e-3).expect("a thickness");
    let height = rest(&mut world);
    assert!((height / 5e-3 - 1.0).abs() < 0.1, "{height} m above the sheet");

    let parts = Parts::nodes(vec![Vec3::Y * 0.02], 0.01);
    let mut scene = Scene::new(
        &parts,
        WorldDefinition {
            gravity: Vec3::Y * -10.0,
            ..FREE
        },
    );
    scene
        .world
        .create_tool(&ToolDefinition::new(Shape::Plane))
        .expect("a plane");
    scene.run(DT, 50);
    assert!(scene.positions()[0].y.abs() < 1e-5);
    set(&mut scene.world, scene.id, |it| it.thickness = 0.01).expect("a thickness");
    scene.run(DT, 50);
    assert!(
        (scene.positions()[0].y / 0.01 - 1.0).abs() < 0.01,
        "{}",
        scene.positions()[0].y
    );
    let settings = scene.body().settings();
    for bad in [-1.0, f32::NAN, 2e9] {
        let refused = set(&mut scene.world, scene.id, |it| it.thickness = bad);
        assert!(matches!(refused, Err(Error::InvalidArgument(_))), "{refused:?}");
        assert!(set(&mut scene.world, scene.id, |it| it.friction = bad.min(-1.0)).is_err());
    }
    assert_eq!(scene.body().settings(), settings);
}

#[test]
fn a_body_sleeps_once_sleep_is_enabled() {
    let mut parts = Parts::chain(4, Vec3::Y * -0.01, 1e-3, 50.0);
    parts.masses[0] = 0.0;
    parts.node_dampings.fill(0.02);
    let mut scene = Scene::new(
        &parts,
        WorldDefinition {
            gravity: Vec3::Y * -10.0,
            ..FREE
        },
    );
    scene.run(DT, 200);
    assert_eq!(scene.body().awake_share(), 1.0);
    let sleep = Sleep { speed: 1e-3, time: 0.1 };
    set(&mut scene.world, scene.id, |it| it.sleep = sleep).expect("sleep");
    assert_eq!(scene.body().settings().sleep, sleep);
    scene.run(DT, 30);
    assert_eq!(scene.body().awake_share(), 0.0);
    set(&mut scene.world, scene.id, |it| it.sleep.speed = 0.0).expect("sleep");
    scene.run(DT, 30);
    assert_eq!(scene.body().awake_share(), 1.0);
    for (speed, time) in [(-1.0, 0.5), (f32::NAN, 0.5), (1.0, 0.0), (1.0, f32::INFINITY)] {
        assert!(set(&mut scene.world, scene.id, |it| it.sleep = Sleep { speed, time }).is_err());
    }
}

#[test]
fn new_substeps_are_taken() {
    let parts = Parts::chain(3, Vec3::X, 0.01, 1.0);
    let mut scene = Scene::new(&parts, FREE);
    scene.world.set_substeps(7, 10).expect("substeps");
    assert_eq!((scene.world.substeps(), scene.step(DT).substeps), ([7, 10], 7));
    scene.world.set_substeps(0, 10).expect("substeps");
    assert_eq!(scene.step(DT).substeps, 1);
    assert!(scene.world.set_substeps(0, 0).is_err());
    assert_eq!(scene.world.substeps(), [0, 10]);
    // With a tolerance the number of substeps follows the tolerance.
    let strict = WorldDefinition {
        substeps: 1,
        tolerance: 1e-7,
        ..FREE
    };
    let mut scene = Scene::new(&parts, strict);
    let pulled = [Vec3::ZERO, Vec3::X * 1.5, Vec3::X * 2.0];
    scene.body_mut().set_positions(&pulled).expect("positions");
    assert_eq!(scene.step(DT).error_estimate, 0.0);
    scene.world.set_substeps(0, 1000).expect("substeps");
    let report = scene.step(DT);
    assert!(
        report.substeps > 1 && report.error_estimate > 0.0 && report.error_estimate <= 1e-7,
        "{report:?}"
    );
}
