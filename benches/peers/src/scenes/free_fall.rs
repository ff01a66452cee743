//! A block and a chain in free fall: an engine with other results is set up incorrectly.

use super::mesh::block;
use super::{Measure, Scene};
use crate::precision::model::Model;

pub fn tetrahedra() -> Scene {
    Scene {
        name: "free fall",
        about: "a block of 2 x 2 x 2 cubes falls for half a second".into(),
        model: Model {
            frames: 30,
            ..Model::solid(block([2; 3], 0.05), Vec::new(), 1e5, 1000.0)
        },
        measure: Measure::Check,
    }
}

pub fn springs() -> Scene {
    Scene {
        name: "free fall of springs",
        about: "a chain of four nodes falls for half a second".into(),
        model: Model {
            positions: (0..4).map(|node| [0.02 * f64::from(node), 0.0, 0.0]).collect(),
            masses: vec![1e-3; 4],
            springs: (0..3).map(|node| [node, node + 1]).collect(),
            stiffness: 500.0,
            gravity: 9.81,
            frames: 30,
            ..Model::default()
        },
        measure: Measure::Check,
    }
}
