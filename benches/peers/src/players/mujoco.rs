//! MuJoCo's flexible bodies.

use super::{Engine, Line};
use crate::precision::law::Law;
use crate::scenes::Scene;

pub fn engine() -> Engine {
    Engine {
        name: "MuJoCo",
        color: "#7b4fa3",
        program: || super::python::script("mujoco_player.py", "mujoco", "mujoco"),
        lines: |scene| super::has_one_body(scene).map(|()| lines(scene)),
        notes: "A flex of three sliding joints per node, in double precision, without contact or edge constraints. Tetrahedra are \
                St Venant-Kirchhoff's, springs a flex of dimension 1 with the stiffness of its edges. `discrete` logs warnings that the inertia is nearly \
                singular or that its solve did not converge; the notes of each scene list them.",
    }
}

fn lines(scene: &Scene) -> Vec<Line> {
    let law = if scene.model.has(Law::Springs) {
        Law::Springs
    } else {
        Law::StVenantKirchhoff
    };
    let line = |name: &str, integrator: &str, first| Line::doubling(name, law, &[integrator], first, 4096);
    let mut all = vec![
        line("Euler", "integrator=Euler", 8),
        line("RK4", "integrator=RK4", 8),
        line("discrete", "integrator=discrete", 1),
    ];
    // This integrator no longer supports tetrahedra.
    if law == Law::Springs {
        all.push(line("implicitfast", "integrator=implicitfast", 1));
    }
    all
}
