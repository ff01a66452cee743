//! A net of springs that hangs from two corners and falls from the horizontal.

use super::mesh::net;
use super::{Measure, Scene};
use crate::precision::model::Model;

const SIDE: u32 = 25;

pub fn scene() -> Scene {
    Scene {
        name: "cloth",
        about: "25 x 25 nodes of 0.25 g, 20 mm apart, springs of 1000 N/m to all 8 neighbors, hung from two corners and released \
                from the horizontal, damping 4 /s"
            .into(),
        model: Model {
            pinned: vec![0, SIDE as usize - 1],
            stiffness: 1000.0,
            gravity: 9.81,
            damping: 4.0,
            frames: 60,
            ..net(SIDE, 0.02, 0.25e-3)
        },
        measure: Measure::Motion,
    }
}
