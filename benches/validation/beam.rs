//! A silicone cantilever that swings after release, against motion capture (Zhang, Du et al. 2022; MIT license, Soft
//! Robotics Lab, ETH Zürich).
//!
//! Stiffness and damping are fitted to the takes without a weight. Takes with a weight at the upper edge of the tip are
//! predicted. The beam is released by hand, and the weight hangs on a thread, so that the first descent differs even
//! between takes of one kind. Swings are therefore compared from the first lowest point on, where the beam is
//! momentarily at rest. The result for an instant release is reported separately.

use std::path::{Path, PathBuf};

use glam::{DVec3, Vec3};
use sinew::mesh::Mesh;
use sinew::{
    BodyDefinition, BodyId, Material, Model, RestStateDefinition, Solver, Values, Viscosity, World, WorldDefinition,
};

use crate::c3d::Capture;
use crate::lines::Lines;
use crate::report::{Report, Table};
use crate::time_plot::{Curve, plot};

const SIZE: [f32; 3] = [0.1, 0.03, 0.03];
const DENSITY: f32 = 1070.0;
/// Dragon Skin 10 has about 0.499; this is the largest value that the library supports.
const NU: f32 = 0.49;
/// The mean height of the glued-on markers above the middle of the tip [m].
const MARKERS_ABOVE: f64 = 0.007;
const STEP: f64 = 2e-3;
/// Duration of the comparison after the release [s].
const SPAN: f64 = 1.5;
const TARGET: f64 = 0.05;

/// File names, weights at the tip [kg], and plot colors.
const TAKES: [(&str, f32, &str); 4] = [
    ("beam_gravity_V2_a", 0.0, "#1f6fb4"),
    ("beam_gravity_V2_b", 0.0, "#3aa6a6"),
    ("beam_load52_V2_a", 0.052, "#d1495b"),
    ("beam_load101_V2_a", 0.101, "#8e5ea2"),
];

struct Take {
    name: &'static str,
    load: f32,
    color: &'static str,
    /// Drop of the tip at each frame [m].
    drops: Vec<f64>,
    rate: f64,
    /// The first frame in motion.
    start: usize,
    /// Time [s] and drop [m] of the first lowest point.
    first_turn: (f64, f64),
    /// The final drop [m], which is the amplitude of the swing.
    end: f64,
}

impl Take {
    fn read(folder: &Path, (name, load, color): (&'static str, f32, &'static str)) -> Result<Self, String> {
        let capture = Capture::read(&folder.join(name).with_extension("c3d"))?;
        // Three markers at the tip; down is -x.
        let height = |frame: &Vec<DVec3>| frame[..3].iter().map(|marker| marker.x).sum::<f64>() / 3.0;
        let heights: Vec<f64> = capture.frames.iter().map(height).collect();
        let mean = |range: &[f64]| range.iter().sum::<f64>() / range.len() as f64;
        // The cameras settle before these frames, and the beam is released after them.
        let initial = mean(&heights[25..40]);
        let drops: Vec<f64> = heights.iter().map(|height| initial - height).collect();
        let start = drops.iter().position(|&drop| drop > 5e-4).ok_or("it never moves")?;
        let end = mean(&drops[drops.len() - 50..]);
        let is_turn = |&frame: &usize| drops[frame] > 1.2 * end && drops[frame + 1] < drops[frame];
        let at = (start..drops.len() - 1).find(is_turn).ok_or("it never turns round")?;
        // The extremum of a parabola through three frames.
        let [before, here, after] = [at - 1, at, at + 1].map(|frame| drops[frame]);
        let offset = 0.5 * (before - after) / (before - 2.0 * here + after);
        let first_turn = (
            (at as f64 + offset) / capture.rate,
            here - 0.25 * (before - after) * offset,
        );
        Ok(Self {
            name,
            load,
            color,
            drops,
            rate: capture.rate,
            start,
            first_turn,
            end,
        })
    }

    /// RMS difference [m] from a computed swing that starts at time `begin` [s].
    fn difference(&self, swing: &[f64], begin: f64) -> f64 {
        let first = (begin * self.rate).ceil().max(0.0) as usize;
        let frames = first..self.drops.len().min(first + (SPAN * self.rate) as usize);
        let count = frames.len() as f64;
        let squares = frames.map(|frame| {
            let at = (frame as f64 / self.rate - begin) / STEP;
            let step = (at as usize).min(swing.len() - 2);
            let computed = swing[step] + (at - step as f64) * (swing[step + 1] - swing[step]);
            (computed - self.drops[frame]).powi(2)
        });
        (squares.sum::<f64>() / count).sqrt()
    }

    /// RMS difference from a swing after an instant release, at the best release time.
    fn difference_from_release(&self, swing: &[f64]) -> f64 {
        let instants = (-80..=40).map(|step| self.start as f64 / self.rate + 1e-3 * f64::from(step));
        instants
            .map(|release| self.difference(swing, release))
            .fold(f64::INFINITY, f64::min)
    }
}

/// Young's modulus [Pa], and the times of the viscosity [s].
#[derive(Clone, Copy)]
struct Silicone {
    young: f64,
    retardation: f64,
    relaxation: f64,
}

struct Beam {
    world: World,
    id: BodyId,
    face: [Vec<usize>; 2],
}

impl Beam {
    fn new(cells: u32, silicone: Silicone, load: f32) -> Self {
        let mesh = Mesh::block(SIZE, [10 * cells / 3, cells, cells]).expect("a block");
        let mut masses = vec![0.0_f32; mesh.positions.len()];
        for corners in &mesh.tetrahedra {
            let [a, b, c, d] = corners.map(|corner| mesh.positions[corner as usize].as_dvec3());
            let volume = (b - a).cross(c - a).dot(d - a).abs() / 6.0;
            corners
                .iter()
                .for_each(|&corner| masses[corner as usize] += 0.25 * DENSITY * volume as f32);
        }
        let half = mesh.positions[0].abs();
        let at = |axis: usize, side: f32| {
            let nodes = 0..mesh.positions.len();
            nodes
                .filter(|&node| mesh.positions[node][axis] == side * half[axis])
                .collect::<Vec<usize>>()
        };
        let tip = at(0, 1.0);
        let face = [-1.0, 1.0].map(|side| {
            at(1, side)
                .into_iter()
                .filter(|node| tip.contains(node))
                .collect::<Vec<_>>()
        });
        for &node in &face[1] {
            masses[node] += load / face[1].len() as f32;
        }
        let mut world = World::new(WorldDefinition::default()).expect("a world");
        let id = world.create_body(&BodyDefinition {
            masses: Values::Each(&masses),
            material: Some(Material {
                model: Model::Tetrahedra,
                young_modulus: silicone.young as f32,
                poisson_ratio: NU,
                ..Material::default()
            }),
            viscosity: Viscosity {
                retardation_time: silicone.retardation as f32,
                relaxation_time: silicone.relaxation as f32,
            },
            solver: Solver::Implicit,
            accuracy: 1e-4,
            ..BodyDefinition::of(&mesh)
        });
        let id = id.expect("a body");
        let body = world.body_mut(id).expect("the body");
        at(0, -1.0)
            .into_iter()
            .for_each(|node| body.pin(node as u32).expect("a node"));
        Self { world, id, face }
    }

    /// The height of the center of the markers [m].
    fn height(&self) -> f64 {
        let positions = self.world.body(self.id).expect("the body").positions();
        let [low, high] = self
            .face
            .each_ref()
            .map(|nodes| nodes.iter().map(|&node| positions[node].as_dvec3()).sum::<DVec3>() / nodes.len() as f64);
        (0.5 * (low + high) + (high - low).normalize() * MARKERS_ABOVE).y
    }

    fn rest(&mut self) {
        self.world
            .rest_state(self.id, &RestStateDefinition::default())
            .expect("a static equilibrium");
    }

    /// The final drop of the tip [m].
    fn drop_at_rest(mut self) -> f64 {
        let before = self.height();
        self.rest();
        before - self.height()
    }

    /// The drop of the tip at each step, relative to the straight beam. It starts at rest from `shape`, or straight.
    fn swing(mut self, shape: Option<&[Vec3]>) -> Vec<f64> {
        let before = self.height();
        if let Some(shape) = shape {
            self.world
                .body_mut(self.id)
                .expect("the body")
                .set_positions(shape)
                .expect("a shape");
        }
        let mut drops = vec![before - self.height()];
        for _ in 0..((SPAN + 0.1) / STEP) as usize {
            self.world.step(STEP as f32).expect("a step");
            drops.push(before - self.height());
        }
        drops
    }

    /// The drop of the tip in equilibrium with a force on it [N], and the shape.
    fn loaded_shape(mut self, force: f64) -> (f64, Vec<Vec3>) {
        let before = self.height();
        let nodes: Vec<u32> = self.face.iter().flatten().map(|&node| node as u32).collect();
        let forces = vec![Vec3::NEG_Y * (force / nodes.len() as f64) as f32; nodes.len()];
        self.world
            .body_mut(self.id)
            .expect("the body")
            .apply_forces(&nodes, &forces)
            .expect("forces");
        self.rest();
        let shape = self.world.body(self.id).expect("the body").positions().to_vec();
        (before - self.height(), shape)
    }
}

/// The swing of a beam released from this drop, found by the force at the tip (secant method).
fn swing_from(beam: impl Fn() -> Beam, drop: f64) -> Vec<f64> {
    let mut last = (0.0, beam().loaded_shape(0.0).0);
    let mut force = 0.1;
    for _ in 0..6 {
        let (reached, shape) = beam().loaded_shape(force);
        if (reached - drop).abs() < 1e-5 {
            return beam().swing(Some(&shape));
        }
        let slope = (force - last.0) / (reached - last.1);
        last = (force, reached);
        force += (drop - reached) * slope;
    }
    panic!("no force holds the beam at {drop} m");
}

/// The folder of the takes, if it exists.
fn folder() -> Option<PathBuf> {
    let above = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors();
    above
        .map(|above| above.join("shared/truth/beam"))
        .find(|path| path.exists())
}

/// The location of the minimum of a unimodal function (golden-section search).
fn golden_section([mut low, mut high]: [f64; 2], evaluations: usize, mut function: impl FnMut(f64) -> f64) -> f64 {
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let mut inner = [high - golden * (high - low), low + golden * (high - low)];
    let mut values = inner.map(&mut function);
    for _ in 2..evaluations {
        if values[0] < values[1] {
            high = inner[1];
            inner = [high - golden * (high - low), inner[0]];
            values = [function(inner[0]), values[0]];
        } else {
            low = inner[0];
            inner = [inner[1], low + golden * (high - low)];
            values = [values[1], function(inner[1])];
        }
    }
    0.5 * (low + high)
}

pub fn run(report: &mut Report, lines: &mut Lines, is_quick: bool) {
    let Some(folder) = folder() else {
        report.not_offered("silicone beam", "SKIPPED: ../shared/truth/beam is missing");
        return;
    };
    let takes: Result<Vec<Take>, String> = TAKES.into_iter().map(|take| Take::read(&folder, take)).collect();
    let takes = match takes {
        Ok(takes) => takes,
        Err(error) => {
            report.not_offered("silicone beam", &error);
            return;
        }
    };
    let cells = if is_quick { 3 } else { 6 };
    let (fitted, loaded): (Vec<&Take>, Vec<&Take>) = takes.iter().partition(|take| take.load == 0.0);
    let drop = fitted.iter().map(|take| take.end).sum::<f64>() / fitted.len() as f64;
    // Relaxation times do not depend on the mesh; stiffness does.
    let young = |cells: u32| {
        (0..4).fold(2.6e5, |young, _| {
            let silicone = Silicone {
                young,
                retardation: 0.0,
                relaxation: 0.0,
            };
            young * Beam::new(cells, silicone, 0.0).drop_at_rest() / drop
        })
    };
    let coarse = young(3);
    let gain = |relaxation: f64, gain: f64| Silicone {
        young: coarse,
        retardation: gain * relaxation,
        relaxation,
    };
    let fit_error = |silicone: Silicone| -> f64 {
        let swing = |take: &&Take| swing_from(|| Beam::new(3, silicone, 0.0), take.first_turn.1);
        fitted
            .iter()
            .map(|take| take.difference(&swing(take), take.first_turn.0))
            .sum()
    };
    let evaluations = if is_quick { 5 } else { 9 };
    let best_gain =
        |relaxation: f64| golden_section([0.0, 1.0], evaluations, |ratio| fit_error(gain(relaxation, ratio)));
    let relaxation = golden_section([0.004_f64.ln(), 0.1_f64.ln()], evaluations, |logarithm| {
        let relaxation = logarithm.exp();
        fit_error(gain(relaxation, best_gain(relaxation)))
    })
    .exp();
    let retardation = best_gain(relaxation) * relaxation;
    let silicone = Silicone {
        young: young(cells),
        retardation,
        relaxation,
    };
    report.write(&format!(
        "\n## Silicone beam\n\nDragon Skin 10, 100 x 30 x 30 mm, {cells} cells across, IMPLICIT, 2 ms, nu = {NU}. Fitted to the takes under gravity \
         alone: E = {:.1} kPa from their rest position, `retardation_time` = {:.2} ms and `relaxation_time` = {:.1} ms from their swing. Weights hang at \
         the upper edge of the tip and move with it. RMS over {SPAN} s from the first lowest point on; in percent of the drop in the end, and of the swing \
         about it.\n",
        1e-3 * silicone.young,
        1e3 * retardation,
        1e3 * relaxation
    ));
    let mut table = Table::new(&[
        "take",
        "drop in the end, mm",
        "found, mm",
        "lowest point, mm",
        "RMS, mm",
        "of the drop, %",
        "of the swing, %",
        "from an instant release, of the drop, %",
    ]);
    let mut curves = Vec::new();
    for take in fitted.iter().chain(&loaded) {
        let beam = || Beam::new(cells, silicone, take.load);
        let swing = swing_from(beam, take.first_turn.1);
        let difference = take.difference(&swing, take.first_turn.0);
        let released = take.difference_from_release(&beam().swing(None));
        let rest = beam().drop_at_rest();
        let millimeters = |value: f64| format!("{:.2}", 1e3 * value);
        let percent = |ratio: f64| format!("{:.1}", 100.0 * ratio);
        table.row(vec![
            take.name.into(),
            millimeters(take.end),
            millimeters(rest),
            millimeters(take.first_turn.1),
            millimeters(difference),
            percent(difference / take.end),
            percent(difference / (take.first_turn.1 - take.end)),
            percent(released / take.end),
        ]);
        let kind = if take.load == 0.0 { "fitted" } else { "predicted" };
        let label = format!("silicone beam, {}, {kind}", take.name);
        let measured_error = format!("RMS {} mm of {}", millimeters(difference), millimeters(take.end));
        lines.error(
            &label,
            ["measured".into(), measured_error],
            difference / take.end,
            TARGET,
            "",
        );
        let frames =
            (0..take.drops.len()).map(|frame| (frame as f64 / take.rate - take.first_turn.0, 1e3 * take.drops[frame]));
        let measured = frames.filter(|(time, _)| (0.0..=SPAN).contains(time)).collect();
        let computed = swing
            .iter()
            .enumerate()
            .map(|(step, drop)| (step as f64 * STEP, 1e3 * drop));
        let computed = computed.filter(|(time, _)| *time <= SPAN).collect();
        let curve = |name: String, points: Vec<(f64, f64)>, is_dotted: bool| Curve {
            name,
            color: take.color,
            points,
            is_dotted,
        };
        let grams = format!("{:.0} g", 1e3 * take.load);
        curves.push(curve(format!("{grams}, measured"), measured, true));
        curves.push(curve(format!("{grams}, {kind}"), computed, false));
    }
    report.table(&table);
    let title = "Silicone beam: drop of the tip from its first lowest point on";
    report.plot("beam.svg", title, plot(title, ["s", "mm"], &curves));
}
