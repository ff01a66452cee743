//! A soft cube on a floor that is compressed by its weight.

use super::mesh::{block, nodes};
use super::{Measure, Scene};
use crate::precision::model::Model;

const CELLS: usize = 8;
const EDGE: f64 = 0.0125;

pub fn scene() -> Scene {
    let block = block([CELLS; 3], EDGE);
    let pinned = nodes(&block.positions, |[_, y, _]| y < 0.5 * EDGE);
    Scene {
        name: "jelly",
        about: "a cube of 0.1 m, 8 x 8 x 8 cubes in five tetrahedra each, bonded to a floor, compressed by its weight: E = 10 kPa, \
                nu = 0.3, 1000 kg/m³"
            .into(),
        model: Model::solid(block, pinned, 1e4, 1000.0),
        measure: Measure::Motion,
    }
}
