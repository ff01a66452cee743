//! A thick-walled hollow sphere under internal pressure, compared with the radial solution of its law in `f64`.

use std::collections::HashMap;

use glam::{DMat3, DVec3, Vec3};
use sinew::mesh::Mesh;
use sinew::{BodyDefinition, ElementLaw, RestStateDefinition, Solver, World};

use crate::accuracy::cantilever::refined;
use crate::hyperelastic::name;
use crate::laws::{LAWS, stress, tissue};
use crate::lines::Lines;
use crate::report::{Report, Table};
use crate::support::bodies::FREE;

/// Inner and outer radius [m].
const RADII: [f64; 2] = [0.02, 0.04];
/// Internal pressure [Pa].
const PRESSURE: f64 = 900.0;
const NU: f32 = 0.45;

/// A cube of `cells` cells per side without its inner half, mapped to a hollow sphere.
fn hollow(cells: u32) -> Mesh {
    let block = Mesh::block([2.0; 3], [cells; 3]).expect("a block");
    let mut mesh = Mesh::default();
    let mut numbers: HashMap<u32, u32> = HashMap::new();
    for corners in &block.tetrahedra {
        let middle = corners
            .iter()
            .map(|&corner| block.positions[corner as usize])
            .sum::<Vec3>()
            / 4.0;
        if middle.abs().max_element() < 0.5 {
            continue;
        }
        mesh.tetrahedra.push(corners.map(|corner| {
            *numbers.entry(corner).or_insert_with(|| {
                let p = block.positions[corner as usize].as_dvec3();
                mesh.positions
                    .push((p.normalize() * p.abs().max_element() * RADII[1]).as_vec3());
                mesh.positions.len() as u32 - 1
            })
        }));
    }
    mesh
}

/// The simulated ratio of the cavity's deformed to its original width.
fn simulated_width(law: ElementLaw, cells: u32) -> f64 {
    let mesh = hollow(cells);
    let mut world = World::new(FREE).expect("a world");
    let id = world.create_body(&BodyDefinition {
        material: Some(tissue(NU)),
        element_law: law,
        pressure: PRESSURE as f32,
        solver: Solver::Newton,
        ..BodyDefinition::of(&mesh)
    });
    let id = id.expect("a body");
    let body = world.body_mut(id).expect("the body");
    for (node, p) in mesh.positions.iter().enumerate() {
        // Poles stay on their axes.
        let on_axis = [0, 1, 2].map(|axis| p[axis].abs() < 1e-7);
        if on_axis.iter().filter(|is_zero| **is_zero).count() == 2 && p.length() > 0.99 * RADII[1] as f32 {
            body.pin_axes(node as u32, on_axis).expect("a node");
        }
    }
    world
        .rest_state(id, &RestStateDefinition::default())
        .expect("a static equilibrium");
    let enclosed = world.body(id).expect("the body").enclosed();
    assert_eq!(enclosed.cavity_count, 1);
    (enclosed.volume / enclosed.rest_volume).cbrt()
}

/// The theoretical ratio by shooting: radial equilibrium from a guess inside to zero stress outside.
fn expected_width(law: ElementLaw) -> f64 {
    const STEPS: usize = 200;
    let nu = f64::from(NU);
    let gradient = |radial: f64, around: f64| DMat3::from_diagonal(DVec3::new(radial, around, around));
    // The radial stretch with this radial stress.
    let radial = |pull: f64, around: f64| {
        let (mut low, mut high) = (0.05, 4.0);
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            if stress(law, nu, gradient(middle, around), 0, 0) < pull {
                low = middle
            } else {
                high = middle
            }
        }
        0.5 * (low + high)
    };
    let slope = |at: f64, [r, pull]: [f64; 2]| {
        let around = r / at;
        let stretch = radial(pull, around);
        let across = stress(law, nu, gradient(stretch, around), 1, 1);
        [stretch, -2.0 * (pull - across) / at]
    };
    let outside = |growth: f64| {
        let step = (RADII[1] - RADII[0]) / STEPS as f64;
        let mut state = [growth * RADII[0], -PRESSURE * growth * growth];
        for index in 0..STEPS {
            let at = RADII[0] + step * index as f64;
            let first = slope(at, state);
            let middle = [0, 1].map(|which| state[which] + 0.5 * step * first[which]);
            let second = slope(at + 0.5 * step, middle);
            state = [0, 1].map(|which| state[which] + step * second[which]);
        }
        state[1]
    };
    let (mut low, mut high) = (1.0, 2.0);
    for _ in 0..30 {
        let middle = 0.5 * (low + high);
        if outside(middle) < 0.0 {
            low = middle
        } else {
            high = middle
        }
    }
    0.5 * (low + high)
}

pub fn run(report: &mut Report, lines: &mut Lines, is_quick: bool) {
    report.write(&format!(
        "\n## Hollow sphere under pressure\n\nRadii of 20 and 40 mm, {PRESSURE} Pa inside, E = 5 kPa, nu = {NU}: the deformed width of the cavity over the original.\n",
    ));
    let meshes: &[u32] = if is_quick { &[4, 8] } else { &[4, 8, 16] };
    let mut table = Table::new(&["law", "theory", "4 cells across", "8", "16", "refined"]);
    for law in LAWS {
        let theory = expected_width(law);
        let widths: Vec<f64> = meshes.iter().map(|&cells| simulated_width(law, cells)).collect();
        let limit = match widths[..] {
            [coarse, middle, fine] => refined([coarse, middle, fine]).0,
            _ => f64::NAN,
        };
        let cell = |index: usize| widths.get(index).map_or("-".into(), |width| format!("{width:.4}"));
        table.row(vec![
            name(law),
            format!("{theory:.4}"),
            cell(0),
            cell(1),
            cell(2),
            format!("{limit:.4}"),
        ]);
        if !is_quick {
            // The error of the width increase.
            let label = format!("hollow sphere, {}, refined", name(law));
            lines.value(&label, [theory - 1.0, limit - 1.0], "of its width", 0.02, "");
        }
    }
    report.table(&table);
}
