//! A sphere pressed into a bonded layer against Hertz, corrected for thickness (Dimitriadis et al. 2002).

use sinew::Solver;

use crate::accuracy::hertz::{DEEPEST, Layer, RADIUS};
use crate::lines::Lines;
use crate::report::Report;

pub fn run(report: &mut Report, lines: &mut Lines, is_quick: bool) {
    let cells = if is_quick { 3 } else { 8 };
    report.write(&format!(
        "\n## Sphere on a layer\n\nA sphere of 50 mm, {cells} cells in the radius of the deepest contact, VERLET; `cargo bench --bench accuracy` \
         has other meshes. The Truth Cube (Kerdok et al. 2003; cube of 80 mm of RTV6166 in 30:70) is not compared: its stiffness of 780 N/m comes \
         from an indenter whose size the public text does not give, and neither does it give a Young's modulus that was measured otherwise.\n",
    ));
    let ratios: &[f32] = if is_quick { &[0.3] } else { &[0.3, 0.45] };
    for &nu in ratios {
        let layer = Layer::new(cells, nu);
        let depths = [0.3, 0.55, 1.0].map(|part| part * DEEPEST * RADIUS);
        for (depth, found) in depths.into_iter().zip(layer.found(Solver::Verlet, &depths)) {
            let what = format!("sphere, nu {nu}, {:.2} % of its radius deep", 100.0 * depth / RADIUS);
            let reason = if is_quick { "(coarse: --quick)" } else { "" };
            lines.value(&what, [1e3 * layer.theory(depth).0, 1e3 * found], "mN", 0.05, reason);
        }
    }
}
