//! Times and counts of the stages of a step.

use glam::{Quat, Vec3};
use sinew::mesh::Mesh;
use sinew::{
    BodyContact, BodyDefinition, Material, Pose, Shape, Sleep, Solver, StepProfile, ToolDefinition, ToolId, Values,
    World, WorldDefinition,
};

const DT: f32 = 2e-3;

/// A slab that a ball is pressed into.
fn pressed(solver: Solver, thread_count: u32) -> (World, ToolId) {
    let mesh = Mesh::block([0.1, 0.02, 0.1], [10, 2, 10]).expect("a block");
    let mut world = World::new(WorldDefinition {
        thread_count,
        ..WorldDefinition::default()
    })
    .expect("a world");
    let body = world
        .create_body(&BodyDefinition {
            material: Some(Material {
                young_modulus: 5000.0,
                poisson_ratio: 0.25,
                density: 1000.0,
                ..Material::default()
            }),
            node_dampings: Values::Uniform(5e-3),
            solver,
            ..BodyDefinition::of(&mesh)
        })
        .expect("a body");
    let low = mesh.positions.iter().fold(f32::INFINITY, |low, place| low.min(place.y));
    for (node, place) in mesh.positions.iter().enumerate() {
        if place.y < low + 1e-4 {
            world
                .body_mut(body)
                .and_then(|body| body.pin(node as u32))
                .expect("a pin");
        }
    }
    let high = -low;
    let ball = world
        .create_tool(&ToolDefinition {
            pose: Pose {
                position: Vec3::Y * (high + 0.012),
                orientation: Quat::IDENTITY,
            },
            ..ToolDefinition::new(Shape::Sphere { radius: 0.01 })
        })
        .expect("a tool");
    (world, ball)
}

/// Presses the ball in; returns the profile of the last step and the state hash.
fn press(world: &mut World, ball: ToolId) -> (Option<StepProfile>, u64) {
    for step in 0..5 {
        let height = 0.022 - 1e-3 * (step + 1) as f32;
        world.set_pose(ball, Vec3::Y * height, None).expect("a pose");
        world.step(DT).expect("a step");
    }
    (world.profile(), world.state_hash())
}

/// Returns all times within a step.
fn stages(profile: &StepProfile) -> [f64; 8] {
    let it = profile;
    [
        it.plan,
        it.forces,
        it.solver,
        it.broad_phase,
        it.narrow_phase,
        it.contact_solver,
        it.publish,
        it.cutting,
    ]
}

#[test]
fn an_unprofiled_world_has_no_profile_and_the_same_states() {
    for solver in [Solver::Verlet, Solver::Implicit] {
        let (mut plain, ball) = pressed(solver, 1);
        let (none, expected) = press(&mut plain, ball);
        assert_eq!(none, None);
        let (mut profiled, ball) = pressed(solver, 1);
        profiled.set_profiling(true).expect("room");
        let (some, hash) = press(&mut profiled, ball);
        assert!(some.is_some());
        assert_eq!(hash, expected, "{solver:?}");
        profiled.set_profiling(false).expect("nothing is needed");
        assert_eq!(profiled.profile(), None);
    }
}

#[test]
fn stages_of_one_thread_are_parts_of_the_step() {
    for solver in [Solver::Verlet, Solver::Implicit, Solver::Newton] {
        let (mut world, ball) = pressed(solver, 1);
        world.set_profiling(true).expect("room");
        assert_eq!(world.profile(), Some(StepProfile::default()), "before the first step");
        let (profile, _) = press(&mut world, ball);
        let profile = profile.expect("a profile");
        let parts = stages(&profile);
        assert!(parts.iter().all(|part| *part >= 0.0), "{solver:?}: {profile:?}");
        assert!(parts.iter().sum::<f64>() <= profile.step, "{solver:?}: {profile:?}");
        // One of the two solvers steps each body.
        let [mine, other] = match solver {
            Solver::Verlet => [profile.forces, profile.solver],
            _ => [profile.solver, profile.forces],
        };
        assert!(mine > 0.0 && other == 0.0, "{solver:?}: {profile:?}");
        assert!(profile.broad_phase > 0.0 && profile.narrow_phase > 0.0 && profile.contact_solver > 0.0);
        assert!(profile.publish > 0.0);
    }
}

#[test]
fn counts_are_those_of_the_reports() {
    for solver in [Solver::Verlet, Solver::Implicit] {
        for threads in [1, 2] {
            let (mut world, ball) = pressed(solver, threads);
            world.set_profiling(true).expect("room");
            press(&mut world, ball);
            world.set_pose(ball, Vec3::Y * 0.0165, None).expect("a pose");
            let report = world.step(DT).expect("a step");
            let profile = world.profile().expect("a profile");
            assert_eq!(profile.bodies, 1);
            assert_eq!(profile.sleeping_bodies, 0);
            assert_eq!(profile.substeps, u64::from(report.substeps));
            assert_eq!(profile.tries, 1);
            assert_eq!(profile.iterations > 0, solver != Solver::Verlet);
            let touches = world.contacts(ball).expect("a tool").count() as u64;
            assert!(profile.tool_contacts >= touches.max(1), "{profile:?}");
            assert!(profile.candidates >= profile.tool_contacts / 2, "{profile:?}");
            assert_eq!(profile.tissue_contacts, 0);
        }
    }
}

#[test]
fn a_tool_beyond_its_force_limit_repeats_the_step() {
    let (mut world, ball) = pressed(Solver::Verlet, 1);
    world.set_force_limit(ball, 1e-3).expect("a limit");
    world.set_profiling(true).expect("room");
    let (profile, _) = press(&mut world, ball);
    assert!(profile.expect("a profile").tries > 1);
}

#[test]
fn a_refused_step_is_profiled_too() {
    let (mut world, ball) = pressed(Solver::Verlet, 1);
    world.set_profiling(true).expect("room");
    press(&mut world, ball);
    world.step(1e6).expect_err("more substeps than are allowed");
    let profile = world.profile().expect("a profile");
    assert!(
        profile.step > 0.0 && profile.bodies == 0 && profile.publish == 0.0,
        "{profile:?}"
    );
}

#[test]
fn sleeping_and_colliding_tissue_is_counted() {
    let mesh = Mesh::block([0.02; 3], [3; 3]).expect("a block");
    let mut world = World::new(WorldDefinition {
        gravity: Vec3::ZERO,
        ..WorldDefinition::default()
    })
    .expect("a world");
    let at = |by: f32| -> Vec<Vec3> { mesh.positions.iter().map(|position| *position + Vec3::X * by).collect() };
    let cubes = [at(0.0), at(0.0205), at(0.5)];
    for (index, positions) in cubes.iter().enumerate() {
        let mut velocity = Vec3::ZERO;
        let definition = BodyDefinition {
            positions,
            tetrahedra: &mesh.tetrahedra,
            masses: Values::Uniform(1e-4),
            stiffnesses: Values::Uniform(50.0),
            contact: BodyContact {
                with_bodies: index < 2,
                thickness: 1e-3,
                ..BodyContact::default()
            },
            sleep: Sleep {
                speed: if index == 2 { 1e-3 } else { 0.0 },
                time: 0.01,
            },
            ..BodyDefinition::default()
        };
        let body = world.create_body(&definition).expect("a body");
        if index == 0 {
            velocity.x = 0.1;
        }
        let body = world.body_mut(body).expect("a body");
        body.set_velocities(&vec![velocity; positions.len()])
            .expect("velocities");
    }
    world.set_profiling(true).expect("room");
    let (mut met, mut asleep) = (0, 0);
    for _ in 0..20 {
        world.step(DT).expect("a step");
        let profile = world.profile().expect("a profile");
        assert_eq!(profile.bodies + profile.sleeping_bodies, 3);
        met = met.max(profile.tissue_contacts);
        asleep = asleep.max(profile.sleeping_bodies);
    }
    assert!(met > 0 && asleep == 1, "{met} contacts, {asleep} asleep");
}
