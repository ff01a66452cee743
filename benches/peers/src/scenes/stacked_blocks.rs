//! Soft blocks that fall on the ground and on each other.

use super::mesh::{block, surface};
use super::{Measure, Scene};
use crate::precision::model::Model;

/// Blocks with `cells` cubes per side, of this edge [m], at these offsets.
fn blocks(cells: usize, edge: f64, young: f64, offsets: &[[f64; 3]]) -> Model {
    let block = block([cells; 3], edge);
    let triangles = surface(&block.tetrahedra);
    Model {
        triangles,
        has_floor: true,
        friction: 0.5,
        damping: 2.0,
        frames: 120,
        ..Model::solid(block, Vec::new(), young, 1000.0)
    }
    .copied(offsets)
}

/// Two blocks, one above the other.
pub fn two() -> Scene {
    Scene {
        name: "two blocks",
        about: "cubes of 0.1 m, 125 nodes each, fall 10 mm on the ground and on each other: E = 100 kPa, nu = 0.3, 1000 kg/m³, \
                friction 0.5, damping 2 /s"
            .into(),
        model: blocks(4, 0.025, 1e5, &[[0.0, 0.01, 0.0], [0.005, 0.12, 0.002]]),
        measure: Measure::Contact { size: 0.1 },
    }
}

/// A heap of twenty small blocks.
pub fn heap() -> Scene {
    let offset = |index: usize| {
        let (x, z, layer) = (index % 2, index / 2 % 2, index / 4);
        let askew = if layer % 2 == 0 { 0.004 } else { -0.004 };
        [
            0.05 * x as f64 + askew,
            0.01 + 0.05 * layer as f64,
            0.05 * z as f64 - askew,
        ]
    };
    Scene {
        name: "heap of blocks",
        about: "20 cubes of 40 mm, 27 nodes each, fall in a heap on the ground: E = 20 kPa, nu = 0.3, 1000 kg/m³, friction 0.5, damping 2 /s"
            .into(),
        model: blocks(2, 0.02, 2e4, &(0..20).map(offset).collect::<Vec<_>>()),
        measure: Measure::Contact { size: 0.04 },
    }
}
