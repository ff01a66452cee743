//! The beams whose time per step SOFA's authors published.

use super::mesh::{block, nodes};
use crate::precision::model::Model;

/// A beam, and what is published about it.
pub struct SofaBeam {
    /// Nodes along each axis.
    pub nodes: [usize; 3],
    pub model: Model,
    /// ms per step of 10 ms, implicit Euler, tetrahedra.
    pub published: f64,
}

pub fn sofa_beams() -> Vec<SofaBeam> {
    [([40, 10, 10], 33.6), ([76, 16, 16], 109.0)]
        .map(|(nodes, published)| beam(nodes, published))
        .into()
}

fn beam(counts: [usize; 3], published: f64) -> SofaBeam {
    let edge = 0.1 / (counts[1] - 1) as f64;
    let block = block(counts.map(|count| count - 1), edge);
    let held = nodes(&block.positions, |[x, _, _]| x < 0.5 * edge);
    SofaBeam {
        nodes: counts,
        model: Model::solid(block, held, 2e6, 1000.0),
        published,
    }
}
