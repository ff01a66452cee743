//! A net of springs that hangs from two corners and falls from the horizontal.

use super::{Measure, Scene};
use crate::cloth::Cloth;
use crate::precision::model::Model;

const SIDE: u32 = 25;

pub fn scene() -> Scene {
    let cloth = Cloth::new(SIDE);
    let pinned = vec![0, SIDE as usize - 1];
    Scene {
        name: "cloth",
        about: "25 x 25 nodes of 0.25 g, 20 mm apart, springs of 1000 N/m to all 8 neighbours, hung from two corners and released \
                from the horizontal, damping 4 /s"
            .into(),
        model: Model {
            positions: cloth.positions().map(|place| place.map(f64::from)).collect(),
            masses: vec![0.25e-3; (SIDE * SIDE) as usize],
            pinned,
            springs: cloth.springs().map(|ends| ends.map(|end| end as usize)).collect(),
            stiffness: 1000.0,
            gravity: 9.81,
            damping: 4.0,
            frames: 60,
            ..Model::default()
        },
        measure: Measure::Motion,
    }
}
