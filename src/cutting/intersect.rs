//! Splits the render mesh along the path of the blade.

use glam::{DVec3, Vec3};

use super::cell_complex::NONE;
use super::crossing::{SegmentEnd, intersect_triangles};
use super::cut::Cut;
use super::surface::SurfaceTriangle;
use crate::base::{Result, memory};

/// An edge with the same direction for all of its triangles, from the lower vertex to the higher. An edge with one
/// triangle has the direction of this triangle, so that the sides of a slit that is not open yet differ.
type Edge = (u32, u32);

/// The side that both swept triangles share.
const SHARED_SIDE: usize = 2;

/// The side of the last swept triangle that is the blade's edge at the end of the step.
const EDGE_SIDE: usize = 0;

/// An edge that a swept triangle crosses.
struct EdgeCrossing {
    edge: Edge,
    /// The position from the lower vertex to the higher, 0 to 1.
    along: f64,
    vertex: u32,
}

/// A point where an edge of a swept triangle passes through a triangle.
struct FaceCrossing {
    triangle: u32,
    /// Weights of the corners of the triangle's cell.
    weights: [f64; 3],
    /// The position in the rest shape.
    position: DVec3,
    /// The side of the swept triangle.
    side: usize,
    vertex: u32,
}

#[derive(Clone, Copy)]
enum CrossingRef {
    EdgeCrossing(Edge),
    FaceCrossing(usize),
}

impl Cut<'_> {
    /// Splits the candidates that a swept triangle intersects, and marks the edges along the intersection as cut. It is
    /// the first or the last triangle of the sweep.
    pub(crate) fn intersect(
        &mut self,
        swept: [Vec3; 3],
        is_last: bool,
        positions: &[Vec3],
        candidates: &[u32],
    ) -> Result<()> {
        let swept = swept.map(|corner| corner.as_dvec3());
        let (mut crossed, mut pierced, mut segments) = (Vec::new(), Vec::new(), Vec::new());
        for &triangle in candidates {
            let SurfaceTriangle { corners, .. } = self.surface.triangles[triangle];
            let corner_positions: [DVec3; 3] = corners.map(|corner| self.surface.place(corner, positions).as_dvec3());
            let Some(ends) = intersect_triangles(swept, corner_positions, corners) else {
                continue;
            };
            let mut segment = [CrossingRef::FaceCrossing(0); 2];
            for (slot, end) in segment.iter_mut().zip(ends) {
                *slot = match end {
                    SegmentEnd::Side(side, along) => {
                        let edge = self.directed_edge(triangle, side);
                        memory::push(
                            &mut crossed,
                            EdgeCrossing {
                                edge,
                                along,
                                vertex: NONE,
                            },
                        )?;
                        CrossingRef::EdgeCrossing(edge)
                    }
                    SegmentEnd::Inside(side, weights) => {
                        let weights = self.weights_in_cell(triangle, weights);
                        let position = self
                            .surface
                            .rest_position_in(self.surface.triangles[triangle].cell, weights);
                        memory::push(
                            &mut pierced,
                            FaceCrossing {
                                triangle,
                                weights,
                                position,
                                side,
                                vertex: NONE,
                            },
                        )?;
                        CrossingRef::FaceCrossing(pierced.len() - 1)
                    }
                };
            }
            memory::push(&mut segments, segment)?;
        }
        crossed.sort_unstable_by_key(|crossed| crossed.edge);
        crossed.dedup_by_key(|crossed| crossed.edge);
        // Ends of cuts are found before new vertices lie nearer.
        for pierced in &mut pierced {
            pierced.vertex = self.existing_vertex(pierced)?.unwrap_or(NONE);
        }
        for crossed in &mut crossed {
            crossed.vertex = self.vertex_on_edge(crossed.edge, crossed.along)?;
        }
        for pierced in &mut pierced {
            if pierced.vertex == NONE {
                pierced.vertex = self.vertex_in_triangle(pierced.triangle, pierced.weights)?;
            }
            match (is_last, pierced.side) {
                (false, SHARED_SIDE) => memory::push(&mut self.shared_crossings, (pierced.position, pierced.vertex))?,
                (true, EDGE_SIDE) => memory::push(&mut self.changes.ends, pierced.vertex)?,
                _ => {}
            }
        }
        for segment in segments {
            let [from, to] = segment.map(|end| match end {
                CrossingRef::EdgeCrossing(edge) => crossed
                    .binary_search_by_key(&edge, |crossed| crossed.edge)
                    .map_or(NONE, |index| crossed[index].vertex),
                CrossingRef::FaceCrossing(index) => pierced[index].vertex,
            });
            self.connect(from, to)?;
        }
        for [vertex, end] in std::mem::take(&mut self.pending_joins) {
            self.connect(vertex, end)?;
        }
        Ok(())
    }

    fn directed_edge(&self, triangle: u32, side: usize) -> Edge {
        let it = &self.surface.triangles[triangle];
        let (from, to) = (it.corners[side], it.corners[(side + 1) % 3]);
        if it.neighbors[side] == NONE {
            (from, to)
        } else {
            (from.min(to), from.max(to))
        }
    }

    /// Converts weights of a triangle's corners to weights of its cell's corners.
    fn weights_in_cell(&self, triangle: u32, weights: [f64; 3]) -> [f64; 3] {
        let SurfaceTriangle { corners, cell, .. } = self.surface.triangles[triangle];
        let corner_weights = corners.map(|corner| self.surface.weights_in(corner, cell));
        [0, 1, 2].map(|k| (0..3).map(|corner| weights[corner] * corner_weights[corner][k]).sum())
    }

    /// The existing vertex for a point. For a point on the side that both swept triangles share, it is the vertex of
    /// the first one.
    fn existing_vertex(&mut self, pierced: &FaceCrossing) -> Result<Option<u32>> {
        let snap = self.surface.cells[self.surface.triangles[pierced.triangle].cell].snap;
        let is_same_position = |&&(position, _): &&(DVec3, u32)| position.distance(pierced.position) < 0.1 * snap;
        if let Some(&(_, vertex)) = self
            .shared_crossings
            .iter()
            .find(is_same_position)
            .filter(|_| pierced.side == SHARED_SIDE)
        {
            return Ok(Some(vertex));
        }
        let Some((vertex, ends)) = self.nearest_vertex(pierced.triangle, pierced.position, snap)? else {
            return Ok(None);
        };
        self.schedule_join(vertex, &ends)?;
        Ok(Some(vertex))
    }

    /// The vertex where an edge is crossed: one of its ends, or a new one.
    fn vertex_on_edge(&mut self, edge: Edge, along: f64) -> Result<u32> {
        let (from, to) = edge;
        let along = if from < to { along } else { 1.0 - along };
        for (triangle, side) in self.ring(from)? {
            if self.surface.triangles[triangle].corners[(side + 1) % 3] == to {
                return self.vertex_on_side(triangle, side, along);
            }
        }
        Ok(from)
    }
}
