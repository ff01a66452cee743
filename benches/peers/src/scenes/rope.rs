//! A horizontal chain of springs that is fixed at one end and released.

use super::{Measure, Scene};
use crate::precision::model::Model;

const SPRINGS: usize = 40;

pub fn scene() -> Scene {
    Scene {
        name: "rope",
        about:
            "a chain of 40 springs of 2000 N/m, 1 m long, 5 g a node, held at one end and released from the horizontal"
                .into(),
        model: Model {
            positions: (0..=SPRINGS)
                .map(|node| [node as f64 / SPRINGS as f64, 0.0, 0.0])
                .collect(),
            masses: vec![5e-3; SPRINGS + 1],
            pinned: vec![0],
            springs: (0..SPRINGS).map(|node| [node, node + 1]).collect(),
            stiffness: 2000.0,
            gravity: 9.81,
            frames: 60,
            ..Model::default()
        },
        measure: Measure::Motion,
    }
}
