//! A ball that is pressed into a net of springs with a pinned border.

use super::mesh::net;
use super::{Measure, Scene};
use crate::precision::model::{Ball, FRAME, Model};

const SIDE: u32 = 41;
const RADIUS: f64 = 0.015;
const FRAMES: usize = 60;

pub fn scene() -> Scene {
    let side = SIDE as usize;
    let is_rim = |node: usize| {
        [node % side, node / side]
            .iter()
            .any(|&index| index == 0 || index + 1 == side)
    };
    let nodes = side * side;
    Scene {
        name: "ball pressed into a cloth",
        about: "a ball of 30 mm goes 40 mm down into a cloth of 200 mm, 41 x 41 nodes, fixed at its border, without weight: springs of \
                100 N/m, 0.1 kg, damping 2 /s, no friction"
            .into(),
        model: Model {
            pinned: (0..nodes).filter(|&node| is_rim(node)).collect(),
            stiffness: 100.0,
            ball: Some(Ball {
                center: [0.1, RADIUS + 1e-3, 0.1],
                radius: RADIUS,
                speed: 0.041 / (FRAME * (2 * FRAMES / 3) as f64),
            }),
            damping: 2.0,
            frames: FRAMES,
            ..net(SIDE, 0.005, 0.1 / nodes as f64)
        },
        measure: Measure::Contact { size: RADIUS },
    }
}
