//! What a step costs once velocities have decayed to denormal numbers, which processors may take long to add.

use glam::Vec3;
use sinew::{BodyDefinition, Solver, Storage, Values, World, WorldDefinition};

use crate::clock;
use crate::report::{Report, Table, digits};

/// Nodes along each side of the sheet.
const SIDE: u32 = 50;
/// 1/s: from 1 m/s to denormal numbers in 9 s.
const DAMPING: f32 = 10.0;
const FRAME: f32 = 1.0 / 60.0;
/// Of 10 s.
const FRAMES: usize = 600;
/// The first 10 s, 10 s between, the last 10 s.
const PARTS: usize = 3;

pub fn run(report: &mut Report) {
    report.write(&format!(
        "\n## Settling into denormal numbers\n\nA sheet of {SIDE} x {SIDE} nodes that is struck, without gravity, damping of {DAMPING} \
         /s, 30 s in frames of 1/60 s. The last 10 s must cost no more than 1.05 times the first.\n"
    ));
    let mut table = Table::new(&[
        "solver",
        "storage",
        "first 10 s, ms a frame",
        "last 10 s",
        "ratio",
        "denormal velocities at the end",
    ]);
    for (solver, storage) in [
        (Solver::Verlet, Storage::Packed),
        (Solver::Verlet, Storage::FastLink),
        (Solver::Verlet, Storage::DynamicBulk),
        (Solver::Verlet, Storage::Efficient),
        (Solver::Implicit, Storage::Packed),
    ] {
        let settled = settle(solver, storage);
        let [first, .., last] = settled.seconds;
        let row = vec![
            format!("{solver:?}").to_uppercase(),
            format!("{storage:?}"),
            digits(1e3 * first / FRAMES as f64),
            digits(1e3 * last / FRAMES as f64),
            format!("{:.3}", last / first),
            format!("{:.0} %", 100.0 * settled.denormal),
        ];
        report.progress(&format!("settling: {}", row.join(", ")));
        table.row(row);
    }
    report.table(&table);
}

struct Settled {
    /// Of each 10 s.
    seconds: [f64; PARTS],
    /// The part of the velocities' coordinates that are denormal numbers when it ends.
    denormal: f64,
}

fn settle(solver: Solver, storage: Storage) -> Settled {
    let mut world = World::new(WorldDefinition {
        gravity: Vec3::ZERO,
        ..WorldDefinition::default()
    })
    .expect("a valid definition");
    let place = |node: u32| Vec3::new((node % SIDE) as f32, 0.0, (node / SIDE) as f32) / 64.0;
    let positions: Vec<Vec3> = (0..SIDE * SIDE).map(place).collect();
    let right = (0..SIDE * SIDE)
        .filter(|node| node % SIDE + 1 < SIDE)
        .map(|node| [node, node + 1]);
    let below = (0..SIDE * (SIDE - 1)).map(|node| [node, node + SIDE]);
    let springs: Vec<[u32; 2]> = right.chain(below).collect();
    let mass = 1e-4;
    let body = world
        .create_body(&BodyDefinition {
            positions: &positions,
            springs: Some(&springs),
            masses: Values::Uniform(mass),
            node_dampings: Values::Uniform(DAMPING * mass),
            stiffnesses: Values::Uniform(10.0),
            solver,
            storage,
            ..BodyDefinition::default()
        })
        .expect("a valid body");
    let struck: Vec<Vec3> = (positions.iter())
        .map(|p| 0.1 * Vec3::new(f32::sin(7.0 * p.z), 0.0, f32::sin(9.0 * p.x)))
        .collect();
    let sheet = world.body_mut(body).expect("the world's body");
    sheet.set_velocities(&struck).expect("a velocity for each node");
    let seconds = std::array::from_fn(|_| {
        clock::time(|| {
            for _ in 0..FRAMES {
                world.step(FRAME).expect("a step that is taken");
            }
        })
        .processor
    });
    let velocities = world.body(body).expect("the world's body").velocities();
    let coordinates = velocities.iter().flat_map(|velocity| velocity.to_array());
    let denormal = coordinates.filter(|coordinate| coordinate.is_subnormal()).count();
    Settled {
        seconds,
        denormal: denormal as f64 / (3 * positions.len()) as f64,
    }
}
