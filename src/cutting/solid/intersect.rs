//! Splits the material along the path of the blade.

use glam::{DMat3, DVec3, Vec3};

use super::crossing::SweptTriangle;
use super::cut::SolidCut;
use super::separate::Plane;
use crate::base::{Result, memory};
use crate::cutting::cell_complex::CellComplex;

/// An edge that a swept triangle crosses.
struct CrossedEdge {
    /// From the lower vertex to the higher.
    edge: [u32; 2],
    /// The position along the edge, 0 to 1.
    along: f64,
    /// True if the lower vertex lies above the blade.
    is_above: bool,
    /// The lowest of the tetrahedra around the edge.
    tetrahedron: u32,
}

impl SolidCut<'_> {
    /// Splits the edges of the cells' material that a swept triangle crosses, and marks the vertices on it. `sign`
    /// orients its normal to the side that was above in earlier steps.
    pub(crate) fn intersect(
        &mut self,
        swept: &SweptTriangle,
        sign: f64,
        positions: &[Vec3],
        cells: &[u32],
    ) -> Result<()> {
        let crossed = self.crossed_edges(swept, sign, positions, cells)?;
        let mut on_blade = Vec::new();
        let mut ring = Vec::new();
        for crossed in &crossed {
            let CrossedEdge {
                edge,
                along,
                is_above,
                tetrahedron,
            } = *crossed;
            self.solid.ring(tetrahedron, edge, &mut ring)?;
            let snap = ring
                .iter()
                .map(|&at| self.solid.cells[self.solid.tetrahedra[at].cell].snap)
                .fold(f64::INFINITY, f64::min);
            let end_positions = edge.map(|end| self.solid.rest_place(end));
            let length = end_positions[0].distance(end_positions[1]);
            let plane = self.rest_plane(tetrahedron, swept, sign, positions);
            let is_on = [0, 1].map(|k| {
                let distance = if k == 0 { along } else { 1.0 - along } * length;
                let is_nearer = (k == 0) == (along < 0.5);
                (distance <= snap && is_nearer) || self.is_on_again(edge[k], plane, snap)
            });
            for (end, is_on) in edge.into_iter().zip(is_on) {
                if is_on {
                    self.mark_on(end, plane)?;
                    memory::push(&mut on_blade, end)?;
                }
                self.mark_beside(end, (end == edge[0]) == is_above)?;
            }
        }
        memory::sort_once(&mut on_blade);
        for CrossedEdge {
            edge,
            along,
            tetrahedron,
            ..
        } in crossed
        {
            // A vertex on the blade replaces crossings of its edges.
            if edge.iter().any(|end| on_blade.binary_search(end).is_ok()) {
                continue;
            }
            let plane = self.rest_plane(tetrahedron, swept, sign, positions);
            if let Some(tetrahedron) = self.tetrahedron_with_edge(tetrahedron, edge)? {
                let vertex = self.split_edge(tetrahedron, edge, along)?;
                self.mark_on(vertex, plane)?;
            }
        }
        Ok(())
    }

    /// The edges that a swept triangle crosses, in order.
    fn crossed_edges(
        &self,
        swept: &SweptTriangle,
        sign: f64,
        positions: &[Vec3],
        cells: &[u32],
    ) -> Result<Vec<CrossedEdge>> {
        let mut crossed = Vec::new();
        for &cell in cells {
            for tetrahedron in self.solid.simplices_in(cell) {
                let it = self.solid.tetrahedra[tetrahedron];
                let corner_positions = it.corners.map(|corner| self.solid.place(corner, positions).as_dvec3());
                let heights = corner_positions.map(|position| swept.height(position));
                let above = heights.map(|height| swept.is_above(height));
                for (a, b) in [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)] {
                    if above[a] == above[b] {
                        continue;
                    }
                    let (low, high) = if it.corners[a] < it.corners[b] { (a, b) } else { (b, a) };
                    if swept.is_crossed(corner_positions[low], corner_positions[high]) {
                        let total = heights[low] - heights[high];
                        let along = if total == 0.0 { 0.5 } else { heights[low] / total };
                        let edge = [it.corners[low], it.corners[high]];
                        memory::push(
                            &mut crossed,
                            CrossedEdge {
                                edge,
                                along: along.clamp(0.0, 1.0),
                                is_above: above[low] == (sign > 0.0),
                                tetrahedron,
                            },
                        )?;
                    }
                }
            }
        }
        crossed.sort_unstable_by_key(|crossed| (crossed.edge, crossed.tetrahedron));
        crossed.dedup_by_key(|crossed| crossed.edge);
        Ok(crossed)
    }

    /// The swept plane in the rest shape of a tetrahedron's cell, whose deformation is affine.
    fn rest_plane(&self, tetrahedron: u32, swept: &SweptTriangle, sign: f64, positions: &[Vec3]) -> Plane {
        let nodes = self.solid.cells[self.solid.tetrahedra[tetrahedron].cell].nodes;
        let rest = nodes.map(|node| self.solid.nodes[node].rest.as_dvec3());
        let heights = nodes.map(|node| sign * swept.height(positions[node as usize].as_dvec3()));
        let edges = DMat3::from_cols(rest[1] - rest[0], rest[2] - rest[0], rest[3] - rest[0]);
        let rises = DVec3::new(heights[1], heights[2], heights[3]) - heights[0];
        let slope = edges.transpose().inverse() * rises;
        let length = slope.length();
        if !(length > 0.0 && length.is_finite()) {
            return Plane::NONE;
        }
        let normal = slope / length;
        Plane {
            normal,
            offset: normal.dot(rest[0]) - heights[0] / length,
        }
    }

    /// A tetrahedron with an edge. The given tetrahedron had this edge before it was split.
    fn tetrahedron_with_edge(&self, tetrahedron: u32, edge: [u32; 2]) -> Result<Option<u32>> {
        let has_edge = |candidate: u32| {
            edge.iter()
                .all(|end| self.solid.tetrahedra[candidate].corners.contains(end))
        };
        if has_edge(tetrahedron) {
            return Ok(Some(tetrahedron));
        }
        let mut star = Vec::new();
        self.solid.vertex_star(edge[0], &mut star)?;
        Ok(star
            .into_iter()
            .map(|(candidate, _)| candidate)
            .find(|&candidate| has_edge(candidate)))
    }
}
