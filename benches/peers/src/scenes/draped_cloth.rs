//! A net of springs that falls over a ball: what contact costs, and how deep it lets nodes sink in.

use super::{Measure, Scene};
use crate::cloth::Cloth;
use crate::precision::model::{Ball, Model};

const SIDE: u32 = 21;
const RADIUS: f64 = 0.1;

pub fn scene() -> Scene {
    let mut cloth = Cloth::new(SIDE);
    cloth.spacing = 0.015;
    let side = SIDE as usize;
    let middle = 0.5 * f64::from(cloth.spacing) * (side - 1) as f64;
    Scene {
        name: "cloth over a ball",
        about: "21 x 21 nodes of 0.25 g, 15 mm apart, springs of 1000 N/m to all 8 neighbours, fall 20 mm onto a fixed ball of \
                100 mm without friction, damping 4 /s"
            .into(),
        model: Model {
            positions: cloth.positions().map(|place| place.map(f64::from)).collect(),
            masses: vec![0.25e-3; side * side],
            springs: cloth.springs().map(|ends| ends.map(|end| end as usize)).collect(),
            triangles: faces(side),
            stiffness: 1000.0,
            ball: Some(Ball {
                center: [middle, -RADIUS - 0.02, middle],
                radius: RADIUS,
                speed: 0.0,
            }),
            gravity: 9.81,
            damping: 4.0,
            frames: 60,
            ..Model::default()
        },
        measure: Measure::Contact { size: RADIUS },
    }
}

/// Two triangles for each quad of a cloth with so many nodes along a side.
pub fn faces(side: usize) -> Vec<[usize; 3]> {
    let corners = (0..side - 1).flat_map(|row| (0..side - 1).map(move |column| row * side + column));
    corners
        .flat_map(|a| [[a, a + side, a + 1], [a + 1, a + side, a + side + 1]])
        .collect()
}
