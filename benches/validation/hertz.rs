//! A sphere pressed into a bonded layer, compared with Hertz's theory corrected for thickness (Dimitriadis et al.
//! 2002).

use sinew::Solver;

use crate::accuracy::hertz::{DEEPEST, Layer, RADIUS};
use crate::lines::Lines;
use crate::report::Report;

pub fn run(report: &mut Report, lines: &mut Lines, is_quick: bool) {
    let cells = if is_quick { 3 } else { 8 };
    report.write(&format!(
        "\n## Sphere on a layer\n\nA sphere of 50 mm, {cells} cells in the radius of the deepest contact, VERLET; `cargo bench --bench accuracy` \
         has other meshes. The Truth Cube (Kerdok et al. 2003; cube of 80 mm of RTV6166 in 30:70) is not compared: its stiffness of 780 N/m comes \
         from an indenter of unpublished size, and there is no published Young's modulus from another measurement.\n",
    ));
    let ratios: &[f32] = if is_quick { &[0.3] } else { &[0.3, 0.45] };
    for &nu in ratios {
        let layer = Layer::new(cells, nu);
        let depths = [0.3, 0.55, 1.0].map(|ratio| ratio * DEEPEST * RADIUS);
        for (depth, force) in depths.into_iter().zip(layer.found(Solver::Verlet, &depths)) {
            let label = format!("sphere, nu {nu}, {:.2} % of its radius deep", 100.0 * depth / RADIUS);
            let reason = if is_quick { "(coarse: --quick)" } else { "" };
            lines.value(&label, [1e3 * layer.theory(depth).0, 1e3 * force], "mN", 0.05, reason);
        }
    }
}
