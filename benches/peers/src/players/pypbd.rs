//! pyPBD, the Python interface of the library PositionBasedDynamics.

use super::{Engine, Line};
use crate::precision::law::Law;
use crate::scenes::Scene;

pub fn engine() -> Engine {
    Engine {
        name: "pyPBD",
        color: "#4d4d4d",
        program: || super::python::script("pypbd_player.py", "pypbd", "pypbd"),
        lines: |scene| match scene.model.has_contact() {
            true => Err("this player has no contact".into()),
            false => Ok(lines(scene)),
        },
        notes: "Springs are extended position-based distance constraints. Its finite elements are plain position-based constraints, \
                whose stiffness depends on step and iterations; no setting reproduces the material.",
    }
}

fn lines(scene: &Scene) -> Vec<Line> {
    if scene.model.has(Law::Springs) {
        return vec![
            Line::doubling("XPBD, 1 iteration", Law::Springs, &["iterations=1"], 1, 4096),
            Line::doubling("XPBD, 10 iterations", Law::Springs, &["iterations=10"], 1, 4096),
        ];
    }
    vec![Line::doubling(
        "PBD of finite elements, 5 iterations",
        Law::StVenantKirchhoff,
        &["iterations=5"],
        1,
        4096,
    )]
}
