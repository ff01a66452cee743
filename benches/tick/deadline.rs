//! Steps with a deadline while other work keeps every core busy, and their errors.
//!
//! The processor is shared with as many idle loops as it has cores. The wall time of a step then measures the
//! scheduling, the thread's own time the step itself; both are counted. Now and then a saved copy of the world takes
//! the same step in the same number of parts, with the largest budget of work that they allow.

use std::fmt::Write;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::Vec3;
use sinew::mesh::Mesh;
use sinew::{Model, Solver, World};

use super::{FRAME, Scene, Times, clock};

/// A step is late if it takes longer than the deadline times this factor.
const LATE: f64 = 1.05;

/// Number of steps that are compared with their solutions.
const COMPARED: u32 = 50;

/// Each `PER_PART` units of work add one part to a step.
const WORK_PER_PART: u32 = 20;

/// Warm-up steps, until the pace is known and the ball is in contact.
const WARM_UP: u32 = 60;

/// How often an error is within its bound, and the ratios of bound to error.
#[derive(Default)]
struct Bounds {
    covered: u32,
    ratios: Vec<f64>,
}

impl Bounds {
    fn take(&mut self, bound: f64, error: f64) {
        self.covered += u32::from(bound >= error);
        self.ratios.push(bound / error.max(f64::MIN_POSITIVE));
    }

    fn cells(&self) -> String {
        if self.ratios.is_empty() {
            return "- | -".into();
        }
        let covered = 100.0 * f64::from(self.covered) / self.ratios.len() as f64;
        format!("{covered:.1} | {:.1}", Times(self.ratios.clone()).quantile(0.5))
    }
}

/// The state after a step: positions of nodes and the force on the ball.
fn state(scene: &Scene, world: &World) -> (Vec<Vec3>, Vec3) {
    let positions = world.body(scene.body).expect("the body").positions().to_vec();
    (positions, world.wrench(scene.ball).expect("the ball").0)
}

pub fn run(report: &mut String, mesh: &Mesh, steps: u32) {
    let cores = std::thread::available_parallelism().map_or(1, |cores| cores.get());
    let _ = writeln!(
        report,
        "## Steps with a deadline\n\n{} nodes, {} tetrahedra, {steps} steps of 1/60 s each, one thread beside {cores} busy threads. Late: more than 5 % after the \
         deadline, in wall time and in the thread's own time. Error: of {COMPARED} steps, against the same step in as many parts with the largest budget of work, whose own bound is added.\n\n\
         | body | deadline, ms | wall, of the deadline: p50 | p99 | p99.9 | most | late, % | late by own time, % | behind at most, s | error in position within \
         its bound, % | bound over error, median | in the ball's force, % | median |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|",
        mesh.positions.len(),
        mesh.tetrahedra.len(),
    );
    let is_over = AtomicBool::new(false);
    std::thread::scope(|scope| {
        for _ in 0..cores {
            scope.spawn(|| {
                while !is_over.load(Ordering::Relaxed) {
                    std::hint::spin_loop();
                }
            });
        }
        for (name, tissue) in [
            ("springs, VERLET", (Model::Springs, Solver::Verlet, 0.0)),
            ("springs, IMPLICIT", (Model::Springs, Solver::Implicit, 0.0)),
            ("tetrahedra, IMPLICIT", (Model::Tetrahedra, Solver::Implicit, 0.0)),
        ] {
            for deadline in [2e-3, 8e-3] {
                row(report, Scene::new(mesh, tissue, 1), steps, deadline, name);
            }
        }
        is_over.store(true, Ordering::Relaxed);
    });
    report.push('\n');
}

fn row(report: &mut String, mut scene: Scene, steps: u32, deadline: f64, name: &str) {
    let (mut walls, mut late, mut late_by_own_time, mut behind) = (Vec::new(), 0, 0, 0.0_f64);
    let (mut position_bounds, mut force_bounds) = (Bounds::default(), Bounds::default());
    for step in 0..WARM_UP + steps {
        let commanded = Scene::ball_position(scene.touch, (step + 1) as f32 * FRAME);
        let is_compared = step >= WARM_UP && step % (steps / COMPARED).max(1) == 0;
        let saved = is_compared.then(|| scene.world.save().expect("a snapshot"));
        scene.world.set_pose(scene.ball, commanded, None).expect("a pose");
        let mut done = None;
        let elapsed = clock::time(|| done = Some(scene.world.step_within(FRAME, deadline).expect("a step")));
        let done = done.expect("a step");
        if step < WARM_UP {
            continue;
        }
        walls.push(elapsed.wall / deadline);
        late += u32::from(elapsed.wall > LATE * deadline);
        late_by_own_time += u32::from(elapsed.processor > LATE * deadline);
        behind = behind.max(done.lag);
        if let Some(saved) = saved
            && done.lag == 0.0
            && done.error > 0.0
        {
            let mut solved = World::load(&saved, 1, None).expect("a world");
            solved.set_pose(scene.ball, commanded, None).expect("a pose");
            let more = solved
                .step_with_budget(FRAME, done.work / WORK_PER_PART * WORK_PER_PART + WORK_PER_PART - 1)
                .expect("a step");
            let ((positions, force), (reference, reference_force)) =
                (state(&scene, &scene.world), state(&scene, &solved));
            let body = scene.world.body(scene.body).expect("the body");
            let [mut sum, mut all] = [0.0; 2];
            for (node, (position, reference)) in (0..).zip(positions.iter().zip(&reference)) {
                let mass = f64::from(body.node_mass(node).expect("a node"));
                sum += mass * f64::from(position.distance_squared(*reference));
                all += mass;
            }
            let error = (sum / all).sqrt();
            position_bounds.take(f64::from(done.error) + f64::from(more.error), error);
            let bound = [&scene.world, &solved].map(|world| world.force_error(scene.ball).expect("the ball"));
            force_bounds.take(
                bound.map(f64::from).iter().sum(),
                f64::from(force.distance(reference_force)),
            );
        }
    }
    let percentage = |count: u32| 100.0 * f64::from(count) / f64::from(steps);
    let line = format!(
        "| {name} | {:.0} | {} | {:.3} | {:.3} | {behind:.3} | {} | {} |",
        1e3 * deadline,
        Times(walls).row(),
        percentage(late),
        percentage(late_by_own_time),
        position_bounds.cells(),
        force_bounds.cells(),
    );
    eprintln!("{line}");
    report.push_str(&line);
    report.push('\n');
}
