//! A kilohertz hand: a step in each tick, and steps of a frame beside the ticks of a handle.
//!
//! `cargo bench --bench tick` (ten minutes; `-- --quick`: one; `-- --deadlines 1000000`: so many steps with deadlines alone) writes `target/report/tick.md`. A ball presses into an organ of tissue
//! (E 5 kPa) by 5 mm and slides there, and each millisecond a step is taken: how much of the processor's time steps take, and how many of them end late, beside a
//! loop that does nothing. Then larger organs are stepped at 60 Hz by two threads while a third ticks a handle a thousand times a second.
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

/// Of the ball, m, how deep it presses, and how far it slides.
const RADIUS: f32 = 0.01;
const DEPTH: f32 = 0.005;
const SLIDE: f32 = 0.005;

/// s
const TICK: f32 = 1e-3;
const FRAME: f32 = 1.0 / 60.0;

/// What is timed, as it is asked for in a row of its report.
struct Times(Vec<f64>);

impl Times {
    /// The value that this part of them does not exceed, in the unit that they are in.
    fn quantile(&self, part: f64) -> f64 {
        let mut sorted = self.0.clone();
        sorted.sort_by(f64::total_cmp);
        let place = (part * sorted.len() as f64) as usize;
        sorted
            .get(place.min(sorted.len().saturating_sub(1)))
            .copied()
            .unwrap_or(0.0)
    }

    fn row(&self) -> String {
        let [half, most, nearly_all, all] = [0.5, 0.99, 0.999, 1.0].map(|part| self.quantile(part));
        format!("{half:.3} | {most:.3} | {nearly_all:.3} | {all:.3}")
    }
}

/// A stomach where there is one, else a filled organ of as many nodes.
fn stomach() -> Mesh {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/meshes/stomach.msh");
    match load(&path, MeshFormat::Auto, 1e-3) {
        Ok(loaded) => loaded.mesh,
        Err(_) => Mesh::organ(0.2, 0.006).expect("an organ"),
    }
}

/// Places with the shortest side upright, on the ground, about the middle; and how high they are, m.
fn lying(places: &[Vec3]) -> (Vec<Vec3>, f32) {
    let (low, high) = { places.iter() }.fold((Vec3::MAX, Vec3::MIN), |(low, high), place| {
        (low.min(*place), high.max(*place))
    });
    let size = high - low;
    let turned = |place: Vec3| match size.min_position() {
        0 => Vec3::new(place.y, place.x, -place.z),
        1 => place,
        _ => Vec3::new(place.x, place.z, -place.y),
    };
    let middle = turned(0.5 * (low + high));
    let height = size.min_element();
    let ground = middle.with_y(middle.y - 0.5 * height);
    (places.iter().map(|place| turned(*place) - ground).collect(), height)
}

/// What it is made of, how it is stepped, and what part of its mass may be added.
type Tissue = (Model, Solver, f32);

/// An organ and a ball that stands on its highest point.
struct Scene {
    world: World,
    body: BodyId,
    ball: ToolId,
    /// Where the ball first touches.
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
        let (places, height) = lying(&mesh.positions);
        let node_mass = 1060.0 * mesh.volume().expect("a volume") as f32 / mesh.positions.len() as f32;
        let body = world
            .create_body(&BodyDefinition {
                positions: &places,
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
        // It lies on its lowest tenth, and is touched on top of its middle.
        let is_low = |place: &Vec3| place.y < 0.1 * height;
        for node in (0..)
            .zip(&places)
            .filter(|(_, place)| is_low(place))
            .map(|(node, _)| node)
        {
            world.body_mut(body).expect("the body").pin(node).expect("a pin");
        }
        let in_the_middle = places.iter().filter(|place| place.with_y(0.0).length() < RADIUS);
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

    /// Where the ball is after so many seconds.
    fn place(touch: Vec3, time: f32) -> Vec3 {
        let press = 0.5 - 0.5 * (std::f32::consts::TAU * time).cos();
        touch + Vec3::new(SLIDE * (4.0 * time).sin(), RADIUS - DEPTH * press, 0.0)
    }
}

/// Does `work` each millisecond, so many times: how much of the processor each took, ms, and how often it ended after its millisecond.
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

/// A step in each tick.
fn step_in_the_tick(report: &mut String, ticks: u32) {
    let mesh = stomach();
    let _ = writeln!(
        report,
        "## A step in each tick\n\n{} nodes, {} tetrahedra, {ticks} ticks, one thread; a loop that did nothing was late {} times.\n\n\
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
            let place = Scene::place(touch, (tick + 1) as f32 * TICK);
            world.set_pose(ball, place, None).expect("a pose");
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

/// Frames beside the ticks of a handle.
fn frames_beside_a_hand(report: &mut String, frames: u32) {
    let _ = writeln!(
        report,
        "## Frames of 1/60 s beside a hand of 1 kHz\n\nTwo threads step, a third ticks a handle.\n\n\
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
            let hand = scope.spawn(|| {
                let mut ticks = Vec::new();
                let start = Instant::now();
                let mut due = start;
                while !is_over.load(Ordering::Relaxed) {
                    due += Duration::from_secs_f32(TICK);
                    std::thread::sleep(due.saturating_duration_since(Instant::now()));
                    let pose = Pose {
                        position: Scene::place(touch, start.elapsed().as_secs_f32()),
                        ..Pose::IDENTITY
                    };
                    let took = clock::time(|| {
                        std::hint::black_box(handle.tick(pose, None, None, TICK).expect("a pose"));
                    });
                    ticks.push(1e6 * took.processor);
                }
                Times(ticks)
            });
            for _ in 0..frames {
                let begun = Instant::now();
                substeps = world.step(FRAME).expect("a step").substeps.max(substeps);
                let took = begun.elapsed();
                walls.push(1e3 * took.as_secs_f64());
                std::thread::sleep(Duration::from_secs_f32(FRAME).saturating_sub(took));
            }
            is_over.store(true, Ordering::Relaxed);
            hand.join().expect("the hand")
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
    let mut report = String::from("# A kilohertz hand\n\n");
    if deadlines.is_none() {
        step_in_the_tick(&mut report, ticks);
        frames_beside_a_hand(&mut report, frames);
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
