//! Haptic rates: a step in each 1 ms tick, and simulation frames beside the ticks of a haptic handle.
//!
//! `cargo bench --bench tick` (ten minutes; `-- --quick`: one; `-- --deadlines 1000000`: only this many steps with
//! deadlines) writes `target/report/tick.md`. A ball presses 5 mm into an organ of tissue (E 5 kPa) and slides there,
//! with a step in each millisecond. It reports the processor time of steps and the number of late steps, beside that of
//! an empty loop. Then two threads step larger organs at 60 Hz while a third ticks a handle a thousand times a second.
#![allow(clippy::print_stderr)]

#[path = "../storage/clock.rs"]
#[allow(dead_code)] // the storage bench uses the rest
mod clock;
mod deadline;

use std::fmt::Write;
use std::path::Path;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use glam::Vec3;
use sinew::mesh::{Mesh, MeshFormat, load};
use sinew::{
    BodyDefinition, BodyId, HapticDefinition, Material, Model, Pose, Shape, Solver, ToolDefinition, ToolId, Values,
    World, WorldDefinition,
};

/// Radius of the ball, its depth, and its sliding distance [m].
const RADIUS: f32 = 0.01;
const DEPTH: f32 = 0.005;
const SLIDE: f32 = 0.005;

/// Durations of a tick and a frame [s].
const TICK: f32 = 1e-3;
const FRAME: f32 = 1.0 / 60.0;

/// Measured times, in the unit of their row in the report.
struct Times(Vec<f64>);

impl Times {
    /// The value that this fraction of the times does not exceed, in their unit.
    fn quantile(&self, fraction: f64) -> f64 {
        let mut sorted = self.0.clone();
        sorted.sort_by(f64::total_cmp);
        let index = (fraction * sorted.len() as f64) as usize;
        sorted
            .get(index.min(sorted.len().saturating_sub(1)))
            .copied()
            .unwrap_or(0.0)
    }

    fn row(&self) -> String {
        let [p50, p99, p999, all] = [0.5, 0.99, 0.999, 1.0].map(|fraction| self.quantile(fraction));
        format!("{p50:.3} | {p99:.3} | {p999:.3} | {all:.3}")
    }
}

/// A stomach if its file exists, otherwise a generated organ with about as many nodes.
fn stomach() -> Mesh {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/meshes/stomach.msh");
    match load(&path, MeshFormat::Auto, 1e-3) {
        Ok(loaded) => loaded.mesh,
        Err(_) => Mesh::organ(0.2, 0.006).expect("an organ"),
    }
}

/// Rotates positions so that the shortest side is vertical, and centers them on the ground. Returns them and their
/// height [m].
fn laid_flat(positions: &[Vec3]) -> (Vec<Vec3>, f32) {
    let (low, high) = { positions.iter() }.fold((Vec3::MAX, Vec3::MIN), |(low, high), position| {
        (low.min(*position), high.max(*position))
    });
    let size = high - low;
    let turned = |point: Vec3| match size.min_position() {
        0 => Vec3::new(point.y, point.x, -point.z),
        1 => point,
        _ => Vec3::new(point.x, point.z, -point.y),
    };
    let middle = turned(0.5 * (low + high));
    let height = size.min_element();
    let ground = middle.with_y(middle.y - 0.5 * height);
    (
        positions.iter().map(|position| turned(*position) - ground).collect(),
        height,
    )
}

/// The model of the tissue, its solver, and its mass scaling.
type Tissue = (Model, Solver, f32);

/// An organ and a ball on its highest point.
struct Scene {
    world: World,
    body: BodyId,
    ball: ToolId,
    /// The first contact point of the ball.
    touch: Vec3,
}

impl Scene {
    fn new(mesh: &Mesh, (model, solver, mass_scaling): Tissue, thread_count: u32) -> Self {
        let mut world = World::new(WorldDefinition {
            gravity: Vec3::ZERO,
            thread_count,
            max_substeps: 10_000,
            ..WorldDefinition::default()
        })
        .expect("a world");
        let (positions, height) = laid_flat(&mesh.positions);
        let node_mass = 1060.0 * mesh.volume().expect("a volume") as f32 / mesh.positions.len() as f32;
        let body = world
            .create_body(&BodyDefinition {
                positions: &positions,
                tetrahedra: &mesh.tetrahedra,
                material: Some(Material {
                    model,
                    young_modulus: 5000.0,
                    poisson_ratio: if model == Model::Springs { 0.25 } else { 0.3 },
                    density: 1060.0,
                    ..Material::default()
                }),
                node_dampings: Values::Uniform(10.0 * node_mass),
                solver,
                mass_scaling,
                ..BodyDefinition::default()
            })
            .expect("a body");
        // The lowest tenth is pinned; the ball touches the top of the middle.
        let is_low = |position: &Vec3| position.y < 0.1 * height;
        for node in (0..)
            .zip(&positions)
            .filter(|(_, position)| is_low(position))
            .map(|(node, _)| node)
        {
            world.body_mut(body).expect("the body").pin(node).expect("a pin");
        }
        let in_the_middle = positions
            .iter()
            .filter(|position| position.with_y(0.0).length() < RADIUS);
        let touch = in_the_middle.max_by(|one, other| one.y.total_cmp(&other.y));
        let touch = *touch.expect("a node in the middle");
        let ball = ToolDefinition {
            pose: Pose {
                position: touch + Vec3::Y * RADIUS,
                ..Pose::IDENTITY
            },
            ..ToolDefinition::new(Shape::Sphere { radius: RADIUS })
        };
        let ball = world.create_tool(&ball).expect("a ball");
        Self {
            world,
            body,
            ball,
            touch,
        }
    }

    /// The commanded position of the ball at a time [s].
    fn ball_position(touch: Vec3, time: f32) -> Vec3 {
        let press = 0.5 - 0.5 * (std::f32::consts::TAU * time).cos();
        touch + Vec3::new(SLIDE * (4.0 * time).sin(), RADIUS - DEPTH * press, 0.0)
    }
}

/// Calls `work` each millisecond, `count` times. Returns the processor times [ms], and how often it ended after its
/// millisecond.
fn paced(count: u32, mut work: impl FnMut(u32)) -> (Times, u32) {
    let (mut times, mut late) = (Vec::new(), 0);
    let mut due = Instant::now();
    for index in 0..count {
        while Instant::now() < due {
            std::hint::spin_loop();
        }
        times.push(1e3 * clock::time(|| work(index)).processor);
        due += Duration::from_secs_f32(TICK);
        if Instant::now() > due {
            late += 1;
            due = Instant::now();
        }
    }
    (Times(times), late)
}

/// Measures a step in each tick.
fn step_in_the_tick(report: &mut String, ticks: u32) {
    let mesh = stomach();
    let _ = writeln!(
        report,
        "## A step in each tick\n\n{} nodes, {} tetrahedra, {ticks} ticks, one thread; an empty loop was late {} times.\n\n\
         | body | processor's time of a step, ms: p50 | p99 | p99.9 | most | late | substeps | force at most, N |\n|---|---|---|---|---|---|---|---|",
        mesh.positions.len(),
        mesh.tetrahedra.len(),
        paced(ticks, |_| ()).1,
    );
    for (name, tissue) in [
        ("springs, VERLET", (Model::Springs, Solver::Verlet, 0.0)),
        (
            "springs, VERLET, 1 % of mass added",
            (Model::Springs, Solver::Verlet, 0.01),
        ),
        ("tetrahedra, VERLET", (Model::Tetrahedra, Solver::Verlet, 0.0)),
        (
            "tetrahedra, VERLET, 1 % of mass added",
            (Model::Tetrahedra, Solver::Verlet, 0.01),
        ),
        ("springs, IMPLICIT", (Model::Springs, Solver::Implicit, 0.0)),
    ] {
        let Scene {
            mut world, ball, touch, ..
        } = Scene::new(&mesh, tissue, 1);
        let (mut substeps, mut force) = (0, 0.0_f32);
        let (times, late) = paced(ticks, |tick| {
            let commanded = Scene::ball_position(touch, (tick + 1) as f32 * TICK);
            world.set_pose(ball, commanded, None).expect("a pose");
            substeps = world.step(TICK).expect("a step").substeps.max(substeps);
            force = force.max(world.wrench(ball).expect("the ball").0.length());
        });
        let _ = writeln!(
            report,
            "| {name} | {} | {late} | {substeps} | {force:.3} |",
            times.row()
        );
        eprintln!("{name}");
    }
    report.push('\n');
}

/// Measures frames beside the ticks of a handle.
fn frames_beside_a_handle(report: &mut String, frames: u32) {
    let _ = writeln!(
        report,
        "## Frames of 1/60 s beside a haptic device of 1 kHz\n\nTwo threads step, a third ticks a handle.\n\n\
         | body | nodes | wall time of a frame, ms: p50 | p99 | p99.9 | most | late | substeps | of real time | a tick, us: p50 | p99 | p99.9 | most |\n\
         |---|---|---|---|---|---|---|---|---|---|---|---|---|"
    );
    let organ = |spacing| Mesh::organ(0.2, spacing).expect("an organ");
    let block = Mesh::block([0.2, 0.1, 0.2], [56, 28, 56]).expect("a block");
    let springs = |mass_scaling| (Model::Springs, Solver::Verlet, mass_scaling);
    for (name, mesh, tissue) in [
        ("organ", organ(0.0057), springs(0.0)),
        ("block", block, springs(0.0)),
        ("organ", organ(0.00235), springs(0.0)),
        ("organ, 1 % of mass added", organ(0.00235), springs(0.01)),
        ("organ, 5 % of mass added", organ(0.00235), springs(0.05)),
    ] {
        let Scene {
            mut world, ball, touch, ..
        } = Scene::new(&mesh, tissue, 2);
        let definition = HapticDefinition {
            stiffness: 300.0,
            ..HapticDefinition::new(ball)
        };
        let mut handle = world.create_haptic(&definition).expect("a handle");
        let is_over = AtomicBool::new(false);
        let (mut walls, mut substeps) = (Vec::new(), 0);
        let ticks = std::thread::scope(|scope| {
            let device = scope.spawn(|| {
                let mut ticks = Vec::new();
                let start = Instant::now();
                let mut due = start;
                while !is_over.load(Ordering::Relaxed) {
                    due += Duration::from_secs_f32(TICK);
                    std::thread::sleep(due.saturating_duration_since(Instant::now()));
                    let pose = Pose {
                        position: Scene::ball_position(touch, start.elapsed().as_secs_f32()),
                        ..Pose::IDENTITY
                    };
                    let elapsed = clock::time(|| {
                        std::hint::black_box(handle.tick(pose, None, None, TICK).expect("a pose"));
                    });
                    ticks.push(1e6 * elapsed.processor);
                }
                Times(ticks)
            });
            for _ in 0..frames {
                let start = Instant::now();
                substeps = world.step(FRAME).expect("a step").substeps.max(substeps);
                let elapsed = start.elapsed();
                walls.push(1e3 * elapsed.as_secs_f64());
                std::thread::sleep(Duration::from_secs_f32(FRAME).saturating_sub(elapsed));
            }
            is_over.store(true, Ordering::Relaxed);
            device.join().expect("the device thread")
        });
        let late = walls.iter().filter(|&&wall| wall > 1e3 * f64::from(FRAME)).count();
        let share = walls.iter().sum::<f64>() / (1e3 * f64::from(frames) * f64::from(FRAME));
        let _ = writeln!(
            report,
            "| {name} | {} | {} | {late} | {substeps} | {share:.2} | {} |",
            mesh.positions.len(),
            Times(walls).row(),
            ticks.row(),
        );
        eprintln!("{name}, {} nodes", mesh.positions.len());
    }
    report.push('\n');
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().collect();
    let is_quick = arguments.iter().any(|argument| argument == "--quick");
    let deadlines = arguments
        .iter()
        .skip_while(|argument| *argument != "--deadlines")
        .nth(1);
    let deadlines = deadlines.map(|count| count.parse().expect("--deadlines: a number of steps"));
    let (ticks, frames) = if is_quick { (1_000, 60) } else { (10_000, 600) };
    let mut report = String::from("# Haptic rendering at 1 kHz\n\n");
    if deadlines.is_none() {
        step_in_the_tick(&mut report, ticks);
        frames_beside_a_handle(&mut report, frames);
    }
    deadline::run(&mut report, &stomach(), deadlines.unwrap_or(ticks));
    eprintln!("{report}");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).with_file_name("report");
    let path = folder.join("tick.md");
    if let Err(error) = std::fs::create_dir_all(&folder).and_then(|()| std::fs::write(&path, report)) {
        eprintln!("{}: {error}", path.display());
        return ExitCode::FAILURE;
    }
    ExitCode::SUCCESS
}
