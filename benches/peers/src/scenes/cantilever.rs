//! A straight beam that is fixed at one end and released.

use super::mesh::{block, nodes};
use super::{Measure, Scene};
use crate::precision::model::Model;
use crate::precision::motion::Motion;

const CELLS: [usize; 3] = [20, 4, 4];
const EDGE: f64 = 0.02;
const DENSITY: f64 = 1000.0;

/// The undamped motion.
pub fn released() -> Scene {
    Scene {
        name: "cantilever",
        about: "a beam of 0.4 x 0.08 x 0.08 m, 20 x 4 x 4 cubes in five tetrahedra each, held at one end and released: E = 2 MPa, \
                nu = 0.3, 1000 kg/m³"
            .into(),
        model: model(0.0, 60),
        measure: Measure::Motion,
    }
}

/// The damped motion until rest.
pub fn at_rest() -> Scene {
    Scene {
        name: "cantilever at rest",
        about: "the same beam with a damping of 40 /s of each node's mass, after 2 s".into(),
        model: model(40.0, 120),
        measure: Measure::Rest,
    }
}

fn model(damping: f64, frames: usize) -> Model {
    let block = block(CELLS, EDGE);
    let pinned = nodes(&block.positions, |[x, _, _]| x < 0.5 * EDGE);
    Model {
        damping,
        frames,
        ..Model::solid(block, pinned, 2e6, DENSITY)
    }
}

/// Tip deflection at the last frame, over Timoshenko's for a beam under its own weight.
pub fn tip_ratio(model: &Model, motion: &Motion) -> f64 {
    let [length, height] = [CELLS[0], CELLS[1]].map(|cells| cells as f64 * EDGE);
    let load = DENSITY * model.gravity * height * height;
    let bending = load * length.powi(4) / (8.0 * model.young * height.powi(4) / 12.0);
    let shear_modulus = model.lame().0;
    let share = 10.0 * (1.0 + model.poisson) / (12.0 + 11.0 * model.poisson);
    let shear = load * length.powi(2) / (2.0 * share * shear_modulus * height * height);
    let end = nodes(&model.positions, |[x, _, _]| x > length - 0.5 * EDGE);
    let last = motion.frames.last().expect("a frame");
    let fallen: f64 = end.iter().map(|&node| model.positions[node][1] - last[node][1]).sum();
    fallen / end.len() as f64 / (bending + shear)
}
