//! The Physics-Based Animation Toolkit: vertex block descent and extended position-based dynamics.

use super::{Engine, Line};
use crate::precision::law::Law;

pub fn engine() -> Engine {
    Engine {
        name: "pbatoolkit",
        color: "#a33b5e",
        program: || super::python::script("pbat_player.py", "pbatoolkit", "pbatoolkit==0.0.11"),
        lines: |scene| match scene.model.has(Law::Springs) {
            true => Err("it has tetrahedra and no springs".into()),
            false => super::has_one_body(scene).map(|()| lines()),
        },
        notes: "Version 0.0.11, in double precision, one thread. It has no Newton solver in Python: VBD and XPBD are what its package \
                offers.",
    }
}

fn lines() -> Vec<Line> {
    let law = Law::PlainNeoHookean;
    vec![
        Line::doubling("VBD, 10 iterations", law, &["kind=vbd", "iterations=10"], 1, 1024),
        Line::doubling("VBD, 100 iterations", law, &["kind=vbd", "iterations=100"], 1, 1024),
        Line::doubling("XPBD, 1 iteration", law, &["kind=xpbd", "iterations=1"], 1, 4096),
        Line::doubling("XPBD, 10 iterations", law, &["kind=xpbd", "iterations=10"], 1, 4096),
    ]
}
