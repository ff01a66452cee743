//! Tetrahedra against the theory of elasticity, and against the same meshes in `f64`: sizes that are cheap. `cargo bench --bench accuracy`
//! has the rest, and writes tables of all.

mod accuracy;
mod support;

use accuracy::cantilever::{Cantilever, refined};

/// Poisson's ratio, and how far the end of a beam comes over what beam theory says, with cubes without end (Richardson, from beams 2, 4 and
/// 8 cubes thick).
const REFINED: [(f32, f64); 4] = [(0.0, 1.021), (0.25, 1.009), (0.4, 0.997), (0.49, 0.994)];

#[test]
fn a_cantilever_gives_way_as_its_mesh_in_f64_does() {
    for (nu, _) in REFINED {
        for thick in [2, 4] {
            let cantilever = Cantilever::new(thick, nu);
            let (found, exact) = (cantilever.found(), cantilever.exact());
            let off = (found / exact - 1.0).abs();
            // Both are the least energy of one mesh; coordinates in f32 leave strains of 1e-6 of those here.
            assert!(off < 2e-5, "nu {nu}, {thick} thick: {found} for {exact}");
        }
    }
}

#[test]
fn a_cantilever_nears_what_a_beam_does() {
    for (nu, limit) in REFINED {
        let [coarse, middle] = [2, 4].map(|thick| Cantilever::new(thick, nu).found());
        // The theory of beams has no clamp that keeps its end from getting thinner: within 3 % of it.
        assert!((limit - 1.0).abs() < 0.03);
        let order = ((limit - coarse) / (limit - middle)).log2();
        assert!(
            (1.2..2.0).contains(&order),
            "nu {nu}: {coarse} {middle}, of order {order}"
        );
        if nu < 0.4 {
            let fine = Cantilever::new(8, nu).found();
            let (found, order) = refined([coarse, middle, fine]);
            assert!((found - limit).abs() < 1e-3, "nu {nu}: refines to {found}");
            assert!((1.2..2.0).contains(&order), "nu {nu}: of order {order}");
        }
    }
}
