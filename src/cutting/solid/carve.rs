//! Splitting the material along the way of the blade.

use glam::{DMat3, DVec3, Vec3};

use super::crossing::Swept;
use super::cut::SolidCut;
use super::sever::Plane;
use crate::base::{Result, memory};
use crate::cutting::divided::Divided;

/// An edge that is crossed.
struct CrossedEdge {
    /// From the lower vertex to the higher.
    edge: [u32; 2],
    /// How far along.
    along: f64,
    /// Whether the lower vertex lies above the blade.
    is_above: bool,
    /// The lowest of the tetrahedra about it.
    tetrahedron: u32,
}

impl SolidCut<'_> {
    /// Splits the edges of the material of cells that a swept triangle crosses, and marks the vertices on it. Its normal is turned by `sign` to the
    /// side that was above before.
    pub(crate) fn carve(&mut self, swept: &Swept, sign: f64, positions: &[Vec3], cells: &[u32]) -> Result<()> {
        let crossed = self.crossed(swept, sign, positions, cells)?;
        let mut on = Vec::new();
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
            let places = edge.map(|end| self.solid.rest_place(end));
            let length = places[0].distance(places[1]);
            let plane = self.rest_plane(tetrahedron, swept, sign, positions);
            let is_on = [0, 1].map(|k| {
                let distance = if k == 0 { along } else { 1.0 - along } * length;
                let is_nearer = (k == 0) == (along < 0.5);
                (distance <= snap && is_nearer) || self.is_on_again(edge[k], plane, snap)
            });
            for (end, is_on) in edge.into_iter().zip(is_on) {
                if is_on {
                    self.mark_on(end, plane)?;
                    memory::push(&mut on, end)?;
                }
                self.mark_beside(end, (end == edge[0]) == is_above)?;
            }
        }
        memory::sort_once(&mut on);
        for CrossedEdge {
            edge,
            along,
            tetrahedron,
            ..
        } in crossed
        {
            // A vertex that counts as on the blade is where the edges to it are crossed.
            if edge.iter().any(|end| on.binary_search(end).is_ok()) {
                continue;
            }
            let plane = self.rest_plane(tetrahedron, swept, sign, positions);
            if let Some(tetrahedron) = self.with_edge(tetrahedron, edge)? {
                let vertex = self.split_edge(tetrahedron, edge, along)?;
                self.mark_on(vertex, plane)?;
            }
        }
        Ok(())
    }

    /// The edges that a swept triangle crosses, in order.
    fn crossed(&self, swept: &Swept, sign: f64, positions: &[Vec3], cells: &[u32]) -> Result<Vec<CrossedEdge>> {
        let mut crossed = Vec::new();
        for &cell in cells {
            for tetrahedron in self.solid.simplices_in(cell) {
                let it = self.solid.tetrahedra[tetrahedron];
                let places = it.corners.map(|corner| self.solid.place(corner, positions).as_dvec3());
                let heights = places.map(|place| swept.height(place));
                let above = heights.map(|height| swept.is_above(height));
                for (a, b) in [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)] {
                    if above[a] == above[b] {
                        continue;
                    }
                    let (low, high) = if it.corners[a] < it.corners[b] { (a, b) } else { (b, a) };
                    if swept.is_crossed(places[low], places[high]) {
                        let whole = heights[low] - heights[high];
                        let along = if whole == 0.0 { 0.5 } else { heights[low] / whole };
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

    /// The swept plane as it lies in the rest shape of a tetrahedron's cell, which is deformed evenly.
    fn rest_plane(&self, tetrahedron: u32, swept: &Swept, sign: f64, positions: &[Vec3]) -> Plane {
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

    /// A tetrahedron that has an edge; the one given had it before that was split.
    fn with_edge(&self, tetrahedron: u32, edge: [u32; 2]) -> Result<Option<u32>> {
        let has = |of: u32| edge.iter().all(|end| self.solid.tetrahedra[of].corners.contains(end));
        if has(tetrahedron) {
            return Ok(Some(tetrahedron));
        }
        let mut star = Vec::new();
        self.solid.star(edge[0], &mut star)?;
        Ok(star.into_iter().map(|(of, _)| of).find(|&of| has(of)))
    }
}
