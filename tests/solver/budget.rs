//! Steps with a work budget: work is bounded, no time is lost, energy does not grow, and equal work gives bitwise
//! identical results.

use glam::Vec3;
use sinew::{BodyDefinition, Error, Pose, Shape, Solver, ToolDefinition, World, WorldDefinition};

use crate::support::bodies::{FREE, Parts, Scene, without_ids};

const DT: f32 = 1.0 / 60.0;

const EARTH: WorldDefinition = WorldDefinition {
    gravity: Vec3::new(0.0, -9.81, 0.0),
    ..FREE
};

/// A block held at a corner, whose explicit steps take tens of substeps.
fn block() -> Parts {
    let mut parts = Parts::block([6, 3, 3], 0.02, 1e-3, 2000.0);
    parts.masses[0] = 0.0;
    parts.node_dampings.fill(1e-4);
    parts
}

fn scene(solver: Solver, threads: u32) -> Scene {
    let world = WorldDefinition {
        thread_count: threads,
        ..EARTH
    };
    Scene::with(&block(), world, |definition| BodyDefinition { solver, ..definition })
}

#[test]
fn a_sufficient_budget_changes_nothing() {
    for solver in [Solver::Verlet, Solver::Implicit] {
        let (mut plain, mut budgeted) = (scene(solver, 1), scene(solver, 1));
        for _ in 0..20 {
            let report = plain.step(DT);
            let done = budgeted.world.step_with_budget(DT, 1_000_000).expect("a step");
            assert_eq!((without_ids(done.step), done.lag), (report, 0.0));
        }
        assert_eq!(plain.world.state_hash(), budgeted.world.state_hash(), "{solver:?}");
    }
}

#[test]
fn explicit_work_is_bounded_and_the_lag_is_caught_up() {
    let mut scene = scene(Solver::Verlet, 1);
    let needed = scene.step(DT).substeps;
    assert!(needed > 20, "{needed}");
    let energy = scene.energy();
    let kinetic = |scene: &Scene| scene.body().energy(scene.world.gravity()).kinetic;
    let mut most = kinetic(&scene);
    for step in 1..=30 {
        let done = scene.world.step_with_budget(DT, 7).expect("a step");
        assert!(done.work_done <= 7 && done.work == 7, "{done:?}");
        assert_eq!((done.error, done.step.bodies_restored), (0.0, 0));
        assert!(done.lag > 0.0 && done.lag < f64::from(DT) * f64::from(step), "{done:?}");
        most = most.max(kinetic(&scene));
        // Leapfrog's energy oscillates by a fraction of the moving energy; it does not drift.
        assert!(
            scene.energy() <= energy + 0.02 * most,
            "{} J of {energy} J",
            scene.energy()
        );
    }
    assert!(scene.world.lag() > 10.0 * f64::from(DT), "{} s", scene.world.lag());
    // No time is lost: the world catches up with all of it.
    let mut steps = 31;
    while scene.world.lag() > 0.0 && steps < 60 {
        scene.world.step_with_budget(DT, 1_000_000).expect("a step");
        steps += 1;
        let accounted_time = scene.world.time() + scene.world.lag();
        assert!((accounted_time / (f64::from(steps) * f64::from(DT)) - 1.0).abs() < 1e-6);
    }
    assert_eq!(scene.world.lag(), 0.0);
}

/// A lag that is dropped is never caught up with, and nothing else changes.
#[test]
fn a_dropped_lag_is_not_caught_up() {
    let mut scene = scene(Solver::Verlet, 1);
    while scene.world.lag() < 5.0 * f64::from(DT) {
        scene.world.step_with_budget(DT, 7).expect("a step");
    }
    let mut plain = World::load(&scene.world.save().expect("a snapshot"), 1, None).expect("a world");
    scene.world.drop_lag();
    let time = scene.world.time();
    scene.world.step_with_budget(DT, 1_000_000).expect("a step");
    plain.step(DT).expect("a step");
    assert_eq!(scene.world.lag(), 0.0);
    assert!((scene.world.time() - time - f64::from(DT)).abs() < 1e-12);
    assert!(plain.lag() >= 5.0 * f64::from(DT), "a step without a budget keeps it");
    plain.drop_lag();
    assert_eq!(scene.world.state_hash(), plain.state_hash());
}

#[test]
fn a_partly_solved_equation_gains_no_energy_and_reports_its_error() {
    let mut scene = scene(Solver::Implicit, 1);
    let energy = scene.energy();
    let mut largest = 0.0_f32;
    for _ in 0..60 {
        let done = scene.world.step_with_budget(DT, 3).expect("a step");
        // An equation takes at least one product, whatever budget is left.
        assert!(done.work_done <= 12 && done.lag == 0.0, "{done:?}");
        assert!(scene.is_finite() && done.step.bodies_restored == 0);
        assert!(
            scene.energy() <= energy + 1e-4 * energy.abs(),
            "{} J of {energy} J",
            scene.energy()
        );
        largest = largest.max(done.error);
    }
    let mut solved = self::scene(Solver::Implicit, 1);
    let done = solved.world.step_with_budget(DT, 1000).expect("a step");
    assert!(
        largest > 10.0 * done.error && done.error > 0.0,
        "{largest} m, {} m",
        done.error
    );
}

#[test]
fn recorded_work_is_replayed_bitwise() {
    for solver in [Solver::Verlet, Solver::Implicit] {
        let mut timed = scene(solver, 1);
        let works: Vec<u32> = (0..12)
            .map(|step| {
                let seconds = [1e-5, 1e-3, 1.0][step % 3];
                timed.world.step_within(DT, seconds).expect("a step").work
            })
            .collect();
        let mut replayed = scene(solver, 2);
        for (step, work) in works.into_iter().enumerate() {
            if step == 6 {
                let bytes = replayed.world.save().expect("a snapshot");
                replayed.world = World::load(&bytes, 1, None).expect("a world");
            }
            replayed.world.step_with_budget(DT, work).expect("a step");
        }
        assert_eq!(timed.world.state_hash(), replayed.world.state_hash(), "{solver:?}");
        assert_eq!(timed.world.lag(), replayed.world.lag());
    }
}

#[test]
fn contact_holds_with_any_budget() {
    for solver in [Solver::Verlet, Solver::Implicit] {
        let mut parts = block();
        parts.masses[0] = parts.masses[1];
        let lowest = parts
            .positions
            .iter()
            .fold(f32::INFINITY, |low, position| low.min(position.y));
        parts
            .positions
            .iter_mut()
            .for_each(|position| position.y += 0.01 - lowest);
        let mut scene = Scene::with(&parts, EARTH, |definition| BodyDefinition { solver, ..definition });
        scene
            .world
            .create_tool(&ToolDefinition::new(Shape::Plane))
            .expect("a plane");
        let mut nearest = f64::INFINITY;
        for _ in 0..60 {
            scene.world.step_with_budget(DT, 10).expect("a step");
            let lowest = scene
                .positions()
                .iter()
                .fold(f64::INFINITY, |low, position| low.min(position.y));
            assert!(lowest > -1e-6, "{solver:?}: {lowest} m");
            nearest = nearest.min(lowest);
        }
        assert!(nearest < 1e-3, "{solver:?}: it has landed, {nearest} m");
    }
}

/// Compares each step with the same step with more work: their forces differ by no more than the sum of the reported
/// errors.
#[test]
fn work_beside_a_tool_is_bounded_and_its_force_is_within_its_error() {
    const RADIUS: f32 = 0.02;
    /// The maximum number of products spent on one equation.
    const MOST: u32 = 39;
    let (mut compared, mut covered) = (0, 0);
    for work in [3, 6, 12] {
        let mut parts = block();
        let highest = parts.positions.iter().fold(Vec3::MIN, |high, place| high.max(*place));
        for (mass, place) in parts.masses.iter_mut().zip(&parts.positions) {
            *mass = if place.y < 0.001 { 0.0 } else { 1e-3 };
        }
        let mut scene = Scene::with(&parts, EARTH, |definition| BodyDefinition {
            solver: Solver::Implicit,
            ..definition
        });
        let above = Vec3::new(0.5 * highest.x, highest.y + RADIUS + 1e-3, 0.5 * highest.z);
        let at = |position| Pose {
            position,
            ..Pose::IDENTITY
        };
        let ball = scene
            .world
            .create_tool(&ToolDefinition {
                pose: at(above),
                ..ToolDefinition::new(Shape::Sphere { radius: RADIUS })
            })
            .expect("a ball");
        for frame in 1..=60 {
            let place = above - Vec3::Y * 0.009 * (frame as f32 / 40.0).min(1.0);
            let saved = scene.world.save().expect("a snapshot");
            scene.world.set_pose(ball, place, None).expect("a pose");
            let done = scene.world.step_with_budget(DT, work).expect("a step");
            // A first approach of a tool solves the equation again, and friction may take one product more.
            assert!(done.work_done <= 2 * work + 2 && done.step.substeps == 1, "{done:?}");
            assert!(scene.is_finite() && done.step.bodies_restored == 0 && done.lag == 0.0);
            let nearest = scene.positions().iter().fold(f64::INFINITY, |near, node| {
                near.min((*node - place.as_dvec3()).length() - f64::from(RADIUS))
            });
            assert!(nearest > -5e-4, "work {work}, frame {frame}: {nearest} m");
            let mut solved = World::load(&saved, 1, None).expect("a world");
            solved.set_pose(ball, place, None).expect("a pose");
            solved.step_with_budget(DT, MOST).expect("a step");
            let force = |world: &World| world.wrench(ball).expect("the ball").0;
            let off = force(&scene.world).distance(force(&solved));
            let error = |world: &World| world.force_error(ball).expect("the ball");
            compared += 1;
            covered += u32::from(off <= error(&scene.world) + error(&solved));
        }
    }
    assert!(
        f64::from(covered) >= 0.99 * f64::from(compared),
        "{covered} of {compared}"
    );
}

#[test]
fn invalid_budgets_are_refused() {
    let mut scene = scene(Solver::Verlet, 1);
    let before = scene.world.state_hash();
    let world = &mut scene.world;
    for (refused, word) in [
        (world.step_with_budget(DT, 0), "work is 0"),
        (world.step_with_budget(f32::NAN, 5), "dt is NaN"),
        (world.step_within(DT, 0.0), "seconds is 0"),
        (world.step_within(DT, f64::INFINITY), "seconds is inf"),
        (world.step_within(-1.0, 1.0), "dt is -1"),
    ] {
        let Err(Error::InvalidArgument(message)) = refused else {
            panic!("{refused:?}")
        };
        assert!(message.contains(word), "{message}");
    }
    world.set_substeps(100, 1000).expect("substeps");
    assert!(matches!(world.step_with_budget(DT, 5), Err(Error::Unsupported(_))));
    world.set_substeps(0, 1000).expect("substeps");
    assert_eq!((world.state_hash(), world.lag()), (before, 0.0));
}
