//! The structural tests of Turek and Hron (2006): an elastic bar behind a cylinder, in plane strain.
//!
//! The bar is a slab one cell thick whose nodes are all pinned along z. Its left end is clamped to a cylinder of radius
//! 0.05 m at a distance of 0.2 m from the origin, so its border is round there.

use glam::{Vec2, Vec3};
use sinew::mesh::Mesh;
use sinew::{BodyDefinition, BodyId, Material, Model, RestStateDefinition, Solver, World, WorldDefinition};

use crate::accuracy::cantilever::refined;
use crate::lines::Lines;
use crate::report::{Report, Table};
use crate::svg::{Series, plot};

const HEIGHT: f32 = 0.02;
const DENSITY: f32 = 1000.0;
const NU: f32 = 0.4;
const GRAVITY: f32 = 2.0;
/// Start and end of the bar's center line [m].
const BAR: [f32; 2] = [0.25, 0.6];

/// The shear modulus [Pa] of each static test, and the displacement of the middle of the free end [m].
const STATIC: [(&str, f32, [f64; 2]); 2] = [
    ("CSM1", 0.5e6, [-7.187e-3, -66.10e-3]),
    ("CSM2", 2.0e6, [-0.4690e-3, -16.97e-3]),
];

/// CSM3: mean and amplitude of both displacements [m], and the frequency [Hz].
const MOVING: [f64; 5] = [-14.305e-3, 14.305e-3, -63.607e-3, 65.160e-3, 1.0995];

/// The mesh of the slab with `cells` cells across the bar.
fn bar(cells: u32) -> Mesh {
    let cell = HEIGHT / cells as f32;
    let length = BAR[1] - BAR[0];
    let mut mesh = Mesh::block([length, HEIGHT, cell], [35 * cells / 2, cells, 1]).expect("a block");
    for p in &mut mesh.positions {
        let round = (0.05_f32 * 0.05 - p.y * p.y).sqrt() - 0.05;
        let share = p.x / length + 0.5;
        // Relative to the middle of the cylinder's side, so that coordinates are small.
        p.x = round + share * (length - round);
    }
    mesh
}

struct Bar {
    world: World,
    id: BodyId,
    /// The nodes in the middle of the free end.
    tip: Vec<usize>,
}

impl Bar {
    fn new(cells: u32, shear_modulus: f32) -> Self {
        let mesh = bar(cells);
        let gravity = Vec3::NEG_Y * GRAVITY;
        let mut world = World::new(WorldDefinition {
            gravity,
            ..WorldDefinition::default()
        })
        .expect("a world");
        let id = world.create_body(&BodyDefinition {
            material: Some(Material {
                model: Model::Tetrahedra,
                young_modulus: 2.0 * shear_modulus * (1.0 + NU),
                poisson_ratio: NU,
                density: DENSITY,
                ..Material::default()
            }),
            solver: Solver::Verlet,
            mass_scaling: 0.0,
            ..BodyDefinition::of(&mesh)
        });
        let id = id.expect("a body");
        let body = world.body_mut(id).expect("the body");
        let columns = 35 * cells as usize / 2 + 1;
        for node in 0..mesh.positions.len() {
            let is_clamped = node % columns == 0;
            body.pin_axes(node as u32, [is_clamped, is_clamped, true])
                .expect("a node");
        }
        let end = BAR[1] - BAR[0];
        let is_tip = |p: &Vec3| (p.x - end).abs() < 1e-5 && p.y.abs() < 1e-6;
        let tip: Vec<usize> = (0..mesh.positions.len())
            .filter(|&node| is_tip(&mesh.positions[node]))
            .collect();
        assert_eq!(tip.len(), 2, "a node on each side");
        Self { world, id, tip }
    }

    /// The displacement of the middle of the end [m].
    fn displacement(&self) -> [f64; 2] {
        let positions = self.world.body(self.id).expect("the body").positions();
        let sum: Vec2 = self.tip.iter().map(|&node| positions[node].truncate()).sum();
        let mean = sum.as_dvec2() / self.tip.len() as f64;
        [mean.x - f64::from(BAR[1] - BAR[0]), mean.y]
    }

    fn at_rest(mut self) -> [f64; 2] {
        let definition = RestStateDefinition {
            tolerance: 1e-8,
            ..RestStateDefinition::default()
        };
        self.world
            .rest_state(self.id, &definition)
            .expect("a static equilibrium");
        self.displacement()
    }

    /// Means, amplitudes and the frequency of a swing from rest, in the order of [`MOVING`].
    fn swing(mut self) -> [f64; 5] {
        const STEP: f32 = 2.5e-3;
        // A little more than one and a half periods: two lowest points.
        let path: Vec<[f64; 2]> = (0..620)
            .map(|_| {
                self.world.step(STEP).expect("a step");
                self.displacement()
            })
            .collect();
        let of = |axis: usize| {
            let values = || path.iter().map(move |at| at[axis]);
            let (low, high) = (
                values().fold(0.0, f64::min),
                values().skip(200).fold(f64::NEG_INFINITY, f64::max),
            );
            [0.5 * (low + high), 0.5 * (high - low)]
        };
        let lowest = |steps: std::ops::Range<usize>| {
            let middle = steps.min_by(|&a, &b| path[a][1].total_cmp(&path[b][1])).expect("steps");
            let [before, at, after] = [middle - 1, middle, middle + 1].map(|step| path[step][1]);
            f64::from(STEP) * (middle as f64 + 0.5 * (before - after) / (before - 2.0 * at + after))
        };
        let period = lowest(400..619) - lowest(1..300);
        let ([mean_x, x], [mean_y, y]) = (of(0), of(1));
        [mean_x, x, mean_y, y, 1.0 / period]
    }
}

/// The extrapolation of each figure from three meshes.
fn limit<const N: usize>(results: [[f64; N]; 3]) -> [f64; N] {
    std::array::from_fn(|index| refined(results.map(|figures| figures[index])).0)
}

pub fn run(report: &mut Report, lines: &mut Lines, is_quick: bool) {
    report.write(
        "\n## Turek and Hron, CSM1 to CSM3\n\nA bar of 0.35 x 0.02 m behind a cylinder under 2 m/s², in plane strain: a slab one cell thick \
         whose nodes are pinned along z; five tetrahedra per cell, nodal pressure. *Refined* is the extrapolation from the three finest meshes (Richardson).\n",
    );
    let mut errors = Vec::new();
    let reason = if is_quick { "(coarse: --quick)" } else { "" };
    let cells: &[u32] = if is_quick { &[2, 4, 8] } else { &[2, 4, 8, 16] };
    for (name, shear_modulus, expected) in STATIC {
        let results: Vec<[f64; 2]> = cells
            .iter()
            .map(|&cells| Bar::new(cells, shear_modulus).at_rest())
            .collect();
        let mut table = Table::new(&["cells across", "x, mm", "y, mm", "x off, %", "y off, %"]);
        let row = |name: String, [x, y]: [f64; 2]| {
            let error = |value: f64, axis: usize| format!("{:.2}", 100.0 * (value / expected[axis] - 1.0));
            vec![
                name,
                format!("{:.4}", 1e3 * x),
                format!("{:.3}", 1e3 * y),
                error(x, 0),
                error(y, 1),
            ]
        };
        for (cells, results) in cells.iter().zip(&results) {
            table.row(row(cells.to_string(), *results));
        }
        let last = results.len() - 3;
        let limit = limit([results[last], results[last + 1], results[last + 2]]);
        table.row(row("refined".into(), limit));
        report.write(&format!("\n{name}:\n"));
        report.table(&table);
        for (axis, direction) in ["x", "y"].into_iter().enumerate() {
            let label = format!("{name}, {direction} of the tip, refined");
            lines.value(&label, [1e3 * expected[axis], 1e3 * limit[axis]], "mm", 0.01, reason);
        }
        let error = |index: usize| {
            (
                f64::from(cells[index]),
                100.0 * (results[index][1] / expected[1] - 1.0).abs(),
            )
        };
        errors.push(Series {
            name: format!("{name}, y"),
            points: (0..cells.len()).map(error).collect(),
            dashed: false,
        });
    }
    let cells: [u32; 3] = if is_quick { [2, 4, 8] } else { [4, 8, 16] };
    let results = cells.map(|cells| {
        report.progress(&format!("CSM3, {cells} cells across"));
        Bar::new(cells, STATIC[0].1).swing()
    });
    let limit = limit(results);
    report.write("\nCSM3, VERLET, from one lowest point to the next:\n");
    let mut table = Table::new(&["cells across", "x, mm", "y, mm", "frequency, Hz"]);
    let row = |name: String, [mean_x, x, mean_y, y, frequency]: [f64; 5]| {
        let text = |mean: f64, by: f64| format!("{:.3} ± {:.3}", 1e3 * mean, 1e3 * by);
        vec![name, text(mean_x, x), text(mean_y, y), format!("{frequency:.4}")]
    };
    for (cells, results) in cells.iter().zip(results) {
        table.row(row(cells.to_string(), results));
    }
    table.row(row("refined".into(), limit));
    table.row(row("published".into(), MOVING));
    report.table(&table);
    for (index, name) in [(1, "x"), (3, "y")] {
        let label = format!("CSM3, amplitude of {name}, refined");
        lines.value(&label, [1e3 * MOVING[index], 1e3 * limit[index]], "mm", 0.02, reason);
    }
    lines.value("CSM3, frequency, refined", [MOVING[4], limit[4]], "Hz", 0.02, reason);
    let error = |index: usize| {
        (
            f64::from(cells[index]),
            100.0 * (results[index][4] / MOVING[4] - 1.0).abs(),
        )
    };
    errors.push(Series {
        name: "CSM3, frequency".into(),
        points: (0..3).map(error).collect(),
        dashed: false,
    });
    let title = "Turek and Hron: error against the published figure";
    report.plot(
        "csm.svg",
        title,
        plot(title, "cells across the bar", "error, %", &errors),
    );
}
