//! The cost of a step once velocities have decayed to denormal numbers, which are slow on some processors.

use glam::Vec3;
use sinew::{BodyDefinition, BodyId, Solver, Storage, Values, World, WorldDefinition};

use crate::clock;
use crate::report::{Report, Table, digits};

/// Nodes along each side of the sheet.
const SIDE: u32 = 24;
/// Damping rate [1/s]. Amplitudes decay at half of it: from 1 mm to denormal numbers in 8 s.
const DAMPING: f32 = 20.0;
/// Mass of a node [kg].
const MASS: f32 = 1e-4;
/// Distance of neighboring nodes [m].
const SPACING: f32 = 1.0 / 64.0;
const FRAME: f32 = 1.0 / 60.0;
/// Frames of 10 s.
const FRAMES: usize = 600;
/// Number of measured intervals: the first, the second and the last 10 s.
const INTERVALS: usize = 3;
/// Time limit of each interval [s].
const PATIENCE: f64 = 4.0;

pub fn run(report: &mut Report) {
    report.write(&format!(
        "\n## Settling into denormal numbers\n\nA sheet of {SIDE} x {SIDE} nodes, stretched and fixed at its border, that is \
         struck across its plane, without gravity, damping of {DAMPING} /s, 30 s in frames of 1/60 s. The last 10 s must cost no more than 1.05 times the first.\n"
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
        let mut row = vec![format!("{solver:?}").to_uppercase(), format!("{storage:?}")];
        match settle(solver, storage) {
            Ok(settled) => {
                let [first, .., last] = settled.seconds;
                row.extend([
                    digits(1e3 * first / FRAMES as f64),
                    digits(1e3 * last / FRAMES as f64),
                    format!("{:.3}", last / first),
                    format!("{:.0} %", 100.0 * settled.denormal),
                ]);
            }
            Err(reason) => {
                row.extend(vec!["-".to_owned(); 3]);
                row.push(reason);
            }
        }
        report.progress(&format!("settling: {}", row.join(", ")));
        table.row(row);
    }
    report.table(&table);
}

struct Settled {
    /// Time of each 10 s [s].
    seconds: [f64; INTERVALS],
    /// The fraction of free nodes with denormal velocities at the end.
    denormal: f64,
}

/// Runs the three intervals, or returns the reason of a failure.
fn settle(solver: Solver, storage: Storage) -> Result<Settled, String> {
    let (mut world, body) = sheet(solver, storage);
    let mut seconds = [0.0; INTERVALS];
    for part in &mut seconds {
        for frame in 0..FRAMES {
            if *part > PATIENCE {
                return Err(format!("too slow: {} ms a frame", digits(1e3 * *part / frame as f64)));
            }
            let elapsed = clock::time(|| {
                world.step(FRAME).expect("a step that is taken");
            });
            *part += elapsed.processor;
        }
    }
    let velocities = world.body(body).expect("the world's body").velocities();
    let denormal = velocities.iter().filter(|velocity| velocity.y.is_subnormal()).count();
    Ok(Settled {
        seconds,
        denormal: denormal as f64 / ((SIDE - 2) * (SIDE - 2)) as f64,
    })
}

/// A sheet in motion.
fn sheet(solver: Solver, storage: Storage) -> (World, BodyId) {
    let on_rim = |node: u32| {
        [node % SIDE, node / SIDE]
            .iter()
            .any(|&index| index == 0 || index == SIDE - 1)
    };
    let position = |node: u32| SPACING * Vec3::new((node % SIDE) as f32, 0.0, (node / SIDE) as f32);
    let nodes = || 0..SIDE * SIDE;
    let positions: Vec<Vec3> = nodes().map(position).collect();
    let masses: Vec<f32> = nodes().map(|node| if on_rim(node) { 0.0 } else { MASS }).collect();
    let right = nodes()
        .filter(|node| node % SIDE + 1 < SIDE)
        .map(|node| [node, node + 1]);
    let below = (0..SIDE * (SIDE - 1)).map(|node| [node, node + SIDE]);
    let springs: Vec<[u32; 2]> = right.chain(below).collect();
    let mut world = World::new(WorldDefinition {
        gravity: Vec3::ZERO,
        ..WorldDefinition::default()
    })
    .expect("a valid definition");
    let body = world
        .create_body(&BodyDefinition {
            positions: &positions,
            springs: Some(&springs),
            masses: Values::Each(&masses),
            node_dampings: Values::Uniform(DAMPING * MASS),
            stiffnesses: Values::Uniform(100.0),
            rest_lengths: Some(&vec![0.9 * SPACING; springs.len()]),
            solver,
            storage,
            ..BodyDefinition::default()
        })
        .expect("a valid body");
    let struck: Vec<Vec3> = nodes()
        .map(|node| if on_rim(node) { Vec3::ZERO } else { 0.03 * Vec3::Y })
        .collect();
    let sheet = world.body_mut(body).expect("the world's body");
    sheet.set_velocities(&struck).expect("a velocity for each node");
    (world, body)
}
