//! A bent, rounded and tapered body that hangs by one end.

use super::mesh::{block, nodes};
use super::{Measure, Scene};
use crate::precision::model::Model;

const CELLS: [usize; 3] = [16, 8, 6];
/// Length from end to end before bending [m].
const LENGTH: f64 = 0.16;

pub fn scene() -> Scene {
    let mut block = block(CELLS, 1.0);
    let pinned = nodes(&block.positions, |[x, _, _]| x < 1.5);
    block
        .positions
        .iter_mut()
        .for_each(|position| *position = shaped(*position));
    Scene {
        name: "organ",
        about: "an organ-like body of 16 x 8 x 6 cells, rounded, tapered and bent, 0.16 m long, hung by one end and released: \
                E = 10 kPa, nu = 0.3, 1050 kg/m³"
            .into(),
        model: Model::solid(block, pinned, 1e4, 1050.0),
        measure: Measure::Motion,
    }
}

/// Maps a lattice corner to its position in the organ.
fn shaped([x, y, z]: [f64; 3]) -> [f64; 3] {
    let [x, y, z] =
        [x / CELLS[0] as f64, y / CELLS[1] as f64, z / CELLS[2] as f64].map(|fraction| 2.0 * fraction - 1.0);
    // Toward the inscribed ball of the cube, but not completely: edges of the lattice would become flat.
    let round = 0.75;
    let pulled = |a: f64, b: f64, c: f64| {
        let ball = (1.0 - b * b / 2.0 - c * c / 2.0 + b * b * c * c / 3.0).sqrt();
        a * (1.0 - round + round * ball)
    };
    let [x, y, z] = [pulled(x, y, z), pulled(y, x, z), pulled(z, x, y)];
    let thick = 0.8 - 0.3 * x + 0.1 * (3.0 * x).sin();
    let (along, across, deep) = (0.5 * LENGTH * x, 0.25 * LENGTH * thick * y, 0.18 * LENGTH * thick * z);
    // Bent about an axis along z, by 1.2 radians from end to end; it hangs along -y.
    let radius = LENGTH / 1.2;
    let angle = along / radius;
    let distance = radius + across;
    [distance * angle.cos() - radius, -distance * angle.sin(), deep]
}
