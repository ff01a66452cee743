//! The automatic choice of a solver, and the error message of a refused step.

use glam::{Quat, Vec3};
use sinew::mesh::Mesh;
use sinew::{
    Anchor, BodyDefinition, ChoiceReason, Error, LimitKind, Solver, StepLimit, Values, World, WorldDefinition,
};

use crate::support::bodies::{FREE, Parts, Scene};
use crate::support::organ::of_elements;

/// Two masses of `mass` kg whose spring has the longest stable substep `limit` (s): 2 / omega, with omega^2 = 2 k / m.
fn pair(limit: f32) -> Parts {
    let mass = 0.01;
    Parts::chain(2, Vec3::X, mass, 0.5 * mass * (2.0 / limit).powi(2))
}

fn with_solver(parts: &Parts, world: WorldDefinition, solver: Solver) -> Scene {
    Scene::with(parts, world, |definition| BodyDefinition { solver, ..definition })
}

fn automatic(parts: &Parts) -> Scene {
    with_solver(parts, FREE, Solver::Auto)
}

#[test]
fn few_substeps_choose_verlet_and_many_choose_implicit() {
    for (limit, solver, reason) in [
        (1e-3, Solver::Verlet, ChoiceReason::FewSubsteps),
        (2e-4, Solver::Verlet, ChoiceReason::FewSubsteps),
        (1e-4, Solver::Implicit, ChoiceReason::ManySubsteps),
        (1e-6, Solver::Implicit, ChoiceReason::ManySubsteps),
    ] {
        let mut scene = automatic(&pair(limit));
        let choice = scene.body().solver_choice();
        assert_eq!((choice.solver, choice.reason), (solver, reason), "{limit} s");
        assert_eq!(choice.step, 1.0 / 60.0);
        // VERLET uses 0.8 of the limit, or 0.9 where the bound holds for all positions.
        let needed = |part: f32| choice.step / (part * limit);
        assert!(
            (needed(0.9) * 0.99..needed(0.8) * 1.01 + 1.0).contains(&(choice.substeps as f32)),
            "{choice:?}"
        );
        scene.step(1.0 / 60.0);
    }
    assert_eq!(BodyDefinition::default().solver, Solver::Auto);
    let given = with_solver(&pair(1e-6), FREE, Solver::Verlet).body().solver_choice();
    assert_eq!(
        (given.solver, given.reason, given.substeps),
        (Solver::Verlet, ChoiceReason::Given, 0)
    );
}

#[test]
fn the_choice_follows_the_step_length_of_the_world() {
    let parts = pair(5e-5);
    let mut scene = automatic(&pair(1e-3));
    scene.run(1e-3, 10);
    let definition = BodyDefinition {
        solver: Solver::Auto,
        ..parts.definition()
    };
    let id = scene.world.create_body(&definition).expect("a body");
    let choice = scene.world.body(id).expect("the body").solver_choice();
    assert_eq!(choice.solver, Solver::Verlet, "{choice:?}");
    assert!((choice.step / 1e-3 - 1.0).abs() < 1e-6);
    // With fixed substeps the caller has chosen them for VERLET.
    let world = WorldDefinition { substeps: 10, ..FREE };
    let fixed = with_solver(&parts, world, Solver::Auto);
    assert_eq!(fixed.body().solver_choice().solver, Solver::Verlet);
}

#[test]
fn an_automatic_body_moves_as_with_the_chosen_solver() {
    let gravity = WorldDefinition {
        gravity: Vec3::Y * -9.81,
        ..FREE
    };
    for stiffness in [50.0, 1e5] {
        let mut parts = Parts::block([4, 3, 2], 0.02, 1e-3, stiffness);
        parts.masses[0] = 0.0;
        parts.node_dampings.fill(1e-3);
        let mut scene = with_solver(&parts, gravity, Solver::Auto);
        let solver = scene.body().solver_choice().solver;
        assert_eq!(solver == Solver::Implicit, stiffness == 1e5);
        let mut named = with_solver(&parts, gravity, solver);
        let bytes = scene.world.save().expect("a snapshot");
        let mut loaded = World::load(&bytes, 1, None).expect("a world");
        assert_eq!(
            loaded.body(scene.id).expect("the body").solver_choice(),
            scene.body().solver_choice()
        );
        for _ in 0..20 {
            scene.step(1.0 / 60.0);
            named.step(1.0 / 60.0);
            loaded.step(1.0 / 60.0).expect("a step");
        }
        assert_eq!(scene.world.state_hash(), named.world.state_hash(), "{stiffness} N/m");
        assert_eq!(scene.world.state_hash(), loaded.state_hash(), "{stiffness} N/m");
    }
}

fn refused(world: &mut World) -> (StepLimit, String) {
    let before = world.state_hash();
    let error = world.step(1.0 / 60.0).expect_err("a step that is too long");
    assert_eq!(world.state_hash(), before);
    let Error::Unstable { report, .. } = &error else {
        panic!("{error}")
    };
    (report.limit.expect("what limits it"), error.to_string())
}

#[test]
fn an_unstable_step_names_the_spring_and_the_remedy() {
    let mut parts = Parts::chain(10, Vec3::X * 0.1, 0.01, 10.0);
    parts.stiffnesses[6] = 1e5;
    let few = WorldDefinition {
        max_substeps: 5,
        ..FREE
    };
    let mut scene = Scene::with(&parts, few, |definition| BodyDefinition {
        mass_scaling: 0.0,
        ..definition
    });
    let other = scene.world.create_body(&pair(1.0).definition()).expect("a body");
    let (limit, message) = refused(&mut scene.world);
    assert!(limit.body == scene.id && limit.body != other);
    let mut nodes = limit.of.nodes().to_vec();
    nodes.sort_unstable();
    assert_eq!((limit.of.kind, nodes), (LimitKind::Spring, vec![6, 7]));
    for word in [
        "body {1, ",
        "springs of nodes",
        "AUTO",
        "IMPLICIT",
        "mass_scaling",
        "max_substeps",
    ] {
        assert!(message.contains(word), "{message}");
    }
    // The number of substeps that the message names is enough.
    scene.world.set_substeps(0, limit.needed + 1).expect("substeps");
    assert!(scene.world.step(1.0 / 60.0).expect("a step").limit.is_none());
}

/// Attached bodies take as many substeps as the stiffest of them needs; the message names that body and the number.
#[test]
fn an_unstable_step_names_the_stiffest_attached_body() {
    let few = WorldDefinition {
        max_substeps: 5,
        ..FREE
    };
    let soft = Parts::chain(4, Vec3::X * 0.1, 0.01, 10.0);
    let stiff = Parts::chain(4, Vec3::X * 0.1, 0.01, 1e5).moved(Quat::IDENTITY, Vec3::Y * 0.01);
    fn unscaled(definition: BodyDefinition) -> BodyDefinition {
        BodyDefinition {
            mass_scaling: 0.0,
            ..definition
        }
    }
    let mut scene = Scene::with(&soft, few, unscaled);
    let other = scene.world.create_body(&unscaled(stiff.definition())).expect("a body");
    let (alone, _) = refused(&mut scene.world);
    let ends = [Anchor::Node(0)];
    let attached = scene.world.attach_to_body(scene.id, &ends, other, &ends, 0.0);
    attached.expect("an attachment");
    let (limit, _) = refused(&mut scene.world);
    assert_eq!((alone.body, limit.body), (other, other));
    assert_eq!(limit.needed, alone.needed);
    scene.world.set_substeps(0, limit.needed).expect("substeps");
    scene.world.step(1.0 / 60.0).expect("a step");
}

#[test]
fn the_message_suggests_no_solver_that_is_already_set() {
    let mut parts = Parts::chain(10, Vec3::X * 0.1, 0.01, 10.0);
    parts.stiffnesses[6] = 1e6;
    let mut world = World::new(WorldDefinition {
        max_substeps: 100,
        ..FREE
    })
    .expect("a world");
    // After a step this short VERLET needs few substeps.
    world.step(1e-4).expect("a step");
    let definition = BodyDefinition {
        solver: Solver::Auto,
        mass_scaling: 0.0,
        ..parts.definition()
    };
    let body = world.create_body(&definition).expect("a body");
    assert_eq!(world.body(body).expect("it").solver_choice().solver, Solver::Verlet);
    let (limit, message) = refused(&mut world);
    assert!(
        limit.is_chosen && message.contains("IMPLICIT") && !message.contains("AUTO"),
        "{message}"
    );
}

#[test]
fn an_unstable_step_names_the_element_or_the_term() {
    let mut mesh = Mesh::block([0.08, 0.04, 0.04], [4, 2, 2]).expect("a mesh");
    // Moving a corner inward makes flat tetrahedra.
    let far = mesh.positions.iter().map(|position| position.dot(Vec3::ONE));
    let corner = far.enumerate().max_by(|a, b| a.1.total_cmp(&b.1)).expect("a node").0;
    mesh.positions[corner] -= Vec3::splat(0.012);
    let elements = BodyDefinition {
        solver: Solver::Verlet,
        mass_scaling: 0.0,
        ..of_elements(&mesh, [1e5, 0.3, 1000.0])
    };
    let few = WorldDefinition {
        max_substeps: 5,
        ..FREE
    };
    let mut world = World::new(few).expect("a world");
    world.create_body(&elements).expect("a body");
    let (limit, message) = refused(&mut world);
    assert_eq!(limit.of.kind, LimitKind::Element, "{message}");
    let mut named = limit.of.nodes;
    named.sort_unstable();
    let is_named = |corners: &[u32; 4]| {
        let mut corners = *corners;
        corners.sort_unstable();
        corners == named
    };
    assert!(mesh.tetrahedra.iter().any(is_named), "{message}");
    // One of the tetrahedra at the corner.
    assert!(named.contains(&(corner as u32)), "{message}");

    let parts = Parts::chain(4, Vec3::X, 0.01, 1.0);
    let mut scene = Scene::with(&parts, few, |definition| BodyDefinition {
        home_stiffnesses: Values::Each(&[0.0, 0.0, 1e6, 0.0]),
        mass_scaling: 0.0,
        ..definition
    });
    let (limit, message) = refused(&mut scene.world);
    assert_eq!(
        (limit.of.kind, limit.of.nodes()),
        (LimitKind::Term, &[2][..]),
        "{message}"
    );
}
