//! A net of springs that falls over a ball: the cost of contact, and the penetration of nodes.

use super::mesh::net;
use super::{Measure, Scene};
use crate::precision::model::{Ball, Model};

const SIDE: u32 = 21;
const SPACING: f32 = 0.015;
const RADIUS: f64 = 0.1;

pub fn scene() -> Scene {
    let middle = 0.5 * f64::from(SPACING) * f64::from(SIDE - 1);
    Scene {
        name: "cloth over a ball",
        about: "21 x 21 nodes of 0.25 g, 15 mm apart, springs of 1000 N/m to all 8 neighbors, fall 20 mm onto a fixed ball of \
                100 mm without friction, damping 4 /s"
            .into(),
        model: Model {
            stiffness: 1000.0,
            ball: Some(Ball {
                center: [middle, -RADIUS - 0.02, middle],
                radius: RADIUS,
                speed: 0.0,
            }),
            gravity: 9.81,
            damping: 4.0,
            frames: 60,
            ..net(SIDE, SPACING, 0.25e-3)
        },
        measure: Measure::Contact { size: RADIUS },
    }
}
