//! The beams whose times per step were published by SOFA's authors.

use super::mesh::{block, nodes};
use crate::precision::model::Model;

/// A beam and its published time.
pub struct SofaBeam {
    /// Nodes along each axis.
    pub nodes: [usize; 3],
    pub model: Model,
    /// Time per step of 10 ms with implicit Euler and tetrahedra [ms].
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
    let pinned = nodes(&block.positions, |[x, _, _]| x < 0.5 * edge);
    SofaBeam {
        nodes: counts,
        model: Model::solid(block, pinned, 2e6, 1000.0),
        published,
    }
}
