//! Newton, on NVIDIA Warp's processor backend.

use super::{Engine, Line};
use crate::precision::law::Law;
use crate::scenes::Scene;

pub fn engine() -> Engine {
    Engine {
        name: "Newton",
        color: "#c29a00",
        program: || super::python::script("newton_player.py", "newton", "newton"),
        lines: |scene| super::has_one_body(scene).map(|()| lines(scene)),
        notes: "On the processor, where its kernels use one thread. Their compilation is not counted. XPBD is omitted for \
                tetrahedra: its constraint on shape, the trace of F'F less 3, has no shear stiffness at small strains.",
    }
}

fn lines(scene: &Scene) -> Vec<Line> {
    let law = if scene.model.has(Law::Springs) {
        Law::Springs
    } else {
        Law::NeoHookean
    };
    let mut all = vec![
        Line::doubling("semi-implicit", law, &["kind=semi-implicit"], 8, 2048),
        Line::doubling("VBD, 10 iterations", law, &["kind=vbd", "iterations=10"], 1, 1024),
        Line::doubling("VBD, 100 iterations", law, &["kind=vbd", "iterations=100"], 1, 1024),
    ];
    if law == Law::Springs {
        all.push(Line::doubling(
            "XPBD, 10 iterations",
            law,
            &["kind=xpbd", "iterations=10"],
            1,
            1024,
        ));
    }
    all
}
