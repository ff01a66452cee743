//! The position of the blade's edge in the material at the end of a step.

use glam::{DMat3, DVec3, Vec3};

use super::body::CutSolid;
use crate::cutting::cell_complex::SNAP;
use crate::cutting::cut::Sweep;
use crate::cutting::material::CutEnd;

impl CutSolid {
    /// The midpoint of the part of a sweep's final edge that lies in a cell. `None` if the edge does not pass through
    /// it.
    pub(crate) fn end_in(&self, cell: u32, sweep: &Sweep, positions: &[Vec3]) -> Option<CutEnd> {
        let [from, to] = sweep.end.map(|end| end.as_dvec3());
        let nodes = self.cells[cell].nodes;
        let [a, b, c, d] = nodes.map(|node| positions[node as usize].as_dvec3());
        let inverse = DMat3::from_cols(b - a, c - a, d - a).inverse();
        // The weights of the corners at both ends of the edge.
        let weights = [from, to].map(|end| {
            let DVec3 { x, y, z } = inverse * (end - a);
            [1.0 - x - y - z, x, y, z]
        });
        let (mut enters, mut leaves) = (0.0_f64, 1.0_f64);
        for (start, end) in weights[0].into_iter().zip(weights[1]) {
            let rise = end - start;
            if rise > 0.0 {
                enters = enters.max(-start / rise);
            } else if rise < 0.0 {
                leaves = leaves.min(-start / rise);
            } else if !(start >= 0.0) {
                return None;
            }
        }
        let middle = 0.5 * (enters + leaves);
        (enters < leaves).then(|| CutEnd {
            vertex: None,
            nodes,
            weights: std::array::from_fn(|k| weights[0][k] + middle * (weights[1][k] - weights[0][k])),
            // Snapped vertices can lie on either side. A step that begins too early finds faces that are already open.
            slack: 3.0 * self.cells[cell].snap,
            size: self.cells[cell].snap / SNAP,
        })
    }

    /// Sets the edge's current position in the material, which has moved since the last step.
    pub(crate) fn set_edge(&mut self, edge: [Vec3; 2]) {
        self.stroke.set_edge(edge);
    }
}
