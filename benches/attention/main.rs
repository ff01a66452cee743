//! Estimates the benefit of shorter substeps near a tool only (local time steps).
//!
//! `cargo bench --bench attention` writes `target/report/attention.md`. A ball presses a block of springs. The first
//! measurement is the cost and the accuracy near the ball of shorter substeps everywhere, in the library. The second is
//! a small model in `f64` with shorter substeps everywhere or near the ball only: its error and its number of spring
//! visits. Both give a lower bound for the cost of local steps in the library, where contact is solved in each short
//! substep.
#![allow(clippy::print_stderr)]

#[path = "../storage/clock.rs"]
#[allow(dead_code)] // the storage bench uses the rest
mod clock;
mod local;
mod scene;

use std::fmt::Write;
use std::path::Path;
use std::process::ExitCode;

use glam::{DVec3, Vec3};
use scene::{Scene, error};
use sinew::{BodyDefinition, Pose, Shape, ToolDefinition, Values, World, WorldDefinition};

/// Factors by which substeps are shorter.
const RATES: [u32; 4] = [1, 2, 4, 8];

/// The reference has substeps shorter by this factor.
const REFERENCE_RATE: u32 = 32;

/// Number of timed runs; the fastest counts.
const REPEATS: usize = 3;

/// Nodes are near the ball within this many radii of the first contact point.
const NEAR: f64 = 2.5;

/// The result of a run of the library.
struct Run {
    positions: Vec<DVec3>,
    /// Mean time of a step [ms].
    time: f64,
    /// Mean force on the ball [N].
    force: f64,
}

/// Presses the ball into a body, or moves it past the body, with `substeps` per step.
fn run(scene: &Scene, substeps: u32, touches: bool) -> Run {
    let mut world = World::new(WorldDefinition {
        substeps,
        gravity: Vec3::ZERO,
        ..WorldDefinition::default()
    })
    .expect("a world");
    let body = world
        .create_body(&BodyDefinition {
            springs: Some(&scene.edges),
            masses: Values::Uniform(scene.mass as f32),
            stiffnesses: Values::Uniform(scene.stiffness as f32),
            node_dampings: Values::Uniform((scene.damping * scene.mass) as f32),
            ..BodyDefinition::of(&scene.mesh)
        })
        .expect("a body");
    for node in 0..scene.mesh.positions.len() {
        if scene.is_pinned(node) {
            let body = world.body_mut(body).expect("the body");
            body.pin(node as u32).expect("a pin");
        }
    }
    let aside = if touches { Vec3::ZERO } else { Vec3::Y };
    let ball = ToolDefinition {
        pose: Pose {
            position: scene.tool_in_world(0.0) + aside,
            ..Pose::IDENTITY
        },
        ..ToolDefinition::new(Shape::Sphere {
            radius: scene.radius as f32,
        })
    };
    let ball = world.create_tool(&ball).expect("a ball");
    let mut positions = Vec::new();
    let (mut time, mut force) = (0.0, 0.0);
    for step in 1..=scene.steps {
        let position = scene.tool_in_world(f64::from(step) * f64::from(scene.step));
        world.set_pose(ball, position + aside, None).expect("a pose");
        time += clock::time(|| {
            world.step(scene.step).expect("a step");
        })
        .processor;
        force += f64::from(world.wrench(ball).expect("the ball").0.length());
        let body = world.body(body).expect("the body");
        positions.extend(scene.watched.iter().map(|&node| body.positions()[node].as_dvec3()));
    }
    Run {
        positions,
        time: 1e3 * time / f64::from(scene.steps),
        force: force / f64::from(scene.steps),
    }
}

/// Returns the fastest of several identical runs.
fn timed(scene: &Scene, substeps: u32, touches: bool) -> Run {
    let runs = (0..REPEATS).map(|_| run(scene, substeps, touches));
    let least = runs.min_by(|one, other| one.time.total_cmp(&other.time));
    least.expect("a turn")
}

/// The smallest stable number of substeps.
fn fewest(scene: &Scene) -> u32 {
    // Gershgorin bound: the highest squared frequency is at most twice a node's total spring stiffness over its mass.
    let mut valence = vec![0_u32; scene.mesh.positions.len()];
    scene
        .edges
        .iter()
        .flatten()
        .for_each(|&node| valence[node as usize] += 1);
    let most = f64::from(valence.into_iter().max().unwrap_or(0));
    let stable = 2.0 / (2.0 * most * scene.stiffness / scene.mass).sqrt();
    (f64::from(scene.step) / stable).ceil() as u32
}

fn report_scene(report: &mut String, cells: u32, speed: f64) {
    let scene = Scene::new(cells, speed);
    let nodes = scene.mesh.positions.len();
    let substeps = fewest(&scene);
    let rest: Vec<DVec3> = scene
        .watched
        .iter()
        .map(|&node| scene.mesh.positions[node].as_dvec3())
        .collect();
    let Run {
        positions: reference,
        force,
        ..
    } = run(&scene, REFERENCE_RATE * substeps, true);
    let at_rest: Vec<DVec3> = rest.iter().copied().cycle().take(reference.len()).collect();
    let motion = error(&reference, &at_rest);
    let in_model = local::run(&scene, REFERENCE_RATE * substeps, 1, &|_| true).positions;
    let is_near = |node: usize| scene.is_within(node, NEAR);
    let share = (0..nodes).filter(|&node| is_near(node)).count() as f64 / nodes as f64;
    let _ = writeln!(
        report,
        "## {nodes} nodes, {speed} m/s\n\nSteps of 1 ms in {substeps} substeps or more; nodes near the ball move by {:.2} mm RMS, \
         the force on the ball is {force:.3} N; \
         {:.1} % of the nodes get shorter substeps with local steps.\n\n\
         | substeps | ms a step, ball away | touching | error near the ball, of the motion | model: error everywhere | near alone | visits saved | \
         local steps at the least, ms | gain at the most |\n|---|---|---|---|---|---|---|---|---|",
        1e3 * motion,
        100.0 * share,
    );
    let mut first: Option<[f64; 2]> = None;
    for rate in RATES {
        let [away, touching] = [false, true].map(|touches| timed(&scene, rate * substeps, touches));
        let everywhere = local::run(&scene, rate * substeps, 1, &|_| true);
        let alone = local::run(&scene, substeps, rate, &is_near);
        let [away_once, touching_once] = *first.get_or_insert([away.time, touching.time]);
        // The near part pays for all substeps, and contact for each; the rest costs the same as without local steps.
        let contact = (touching.time - away.time).max(touching_once - away_once);
        let least = away_once + share * (away.time - away_once) + contact;
        let _ = writeln!(
            report,
            "| {} | {:.3} | {:.3} | {:.1e} | {:.1e} | {:.1e} | {:.2} | {:.3} | {:.2} |",
            rate * substeps,
            away.time,
            touching.time,
            error(&touching.positions, &reference) / motion,
            error(&everywhere.positions, &in_model) / motion,
            error(&alone.positions, &in_model) / motion,
            everywhere.visits as f64 / alone.visits as f64,
            least,
            touching.time / least,
        );
        eprintln!("{nodes} nodes, {speed} m/s, {rate} times as many substeps");
    }
    report.push('\n');
}

fn main() -> ExitCode {
    let mut report = String::from("# Local time steps: shorter substeps near a tool\n\n");
    for (cells, speed) in [(20, 0.1), (40, 0.1), (40, 0.5), (60, 0.1)] {
        report_scene(&mut report, cells, speed);
    }
    eprintln!("{report}");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).with_file_name("report");
    let path = folder.join("attention.md");
    if let Err(error) = std::fs::create_dir_all(&folder).and_then(|()| std::fs::write(&path, report)) {
        eprintln!("{}: {error}", path.display());
        return ExitCode::FAILURE;
    }
    ExitCode::SUCCESS
}
