//! Splitting what is drawn along the way of the blade.

use glam::{DVec3, Vec3};

use super::crossing::{SegmentEnd, meet};
use super::cut::Cut;
use super::divided::NONE;
use super::surface::SurfaceTriangle;
use crate::base::{Result, memory};

/// An edge as all of its triangles name it: from the lower vertex to the higher; if it has one triangle alone, as that has it. The sides of
/// a slit that is not open yet are told apart so.
type Edge = (u32, u32);

/// The side of both swept triangles that they share.
const JOINT: usize = 2;

/// The side of the last swept triangle that is the blade's edge at the end of the step.
const END: usize = 0;

/// An edge that is crossed.
struct Crossed {
    edge: Edge,
    /// How far from the lower vertex to the higher.
    along: f64,
    vertex: u32,
}

/// A point where an edge of what was swept passes through a triangle.
struct Pierced {
    triangle: u32,
    /// By weights of the triangle's cell.
    weights: [f64; 3],
    /// In the rest shape.
    place: DVec3,
    /// The swept triangle's side.
    side: usize,
    vertex: u32,
}

#[derive(Clone, Copy)]
enum CrossingPlace {
    Crossed(Edge),
    Pierced(usize),
}

impl Cut<'_> {
    /// Splits the candidates where a swept triangle, the first of the sweep or the last, meets them, and marks the edges that it passes along as
    /// cut.
    pub(crate) fn carve(
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
            let places: [DVec3; 3] = corners.map(|corner| self.surface.place(corner, positions).as_dvec3());
            let Some(ends) = meet(swept, places, corners) else {
                continue;
            };
            let mut segment = [CrossingPlace::Pierced(0); 2];
            for (place, end) in segment.iter_mut().zip(ends) {
                *place = match end {
                    SegmentEnd::Side(side, along) => {
                        let edge = self.edge(triangle, side);
                        memory::push(
                            &mut crossed,
                            Crossed {
                                edge,
                                along,
                                vertex: NONE,
                            },
                        )?;
                        CrossingPlace::Crossed(edge)
                    }
                    SegmentEnd::Inside(side, weights) => {
                        let weights = self.weights_in_cell(triangle, weights);
                        let place = self
                            .surface
                            .rest_place_in(self.surface.triangles[triangle].cell, weights);
                        memory::push(
                            &mut pierced,
                            Pierced {
                                triangle,
                                weights,
                                place,
                                side,
                                vertex: NONE,
                            },
                        )?;
                        CrossingPlace::Pierced(pierced.len() - 1)
                    }
                };
            }
            memory::push(&mut segments, segment)?;
        }
        crossed.sort_unstable_by_key(|crossed| crossed.edge);
        crossed.dedup_by_key(|crossed| crossed.edge);
        // What a cut ended at is found before new vertices lie nearer.
        for pierced in &mut pierced {
            pierced.vertex = self.vertex_known(pierced)?.unwrap_or(NONE);
        }
        for crossed in &mut crossed {
            crossed.vertex = self.vertex_on(crossed.edge, crossed.along)?;
        }
        for pierced in &mut pierced {
            if pierced.vertex == NONE {
                pierced.vertex = self.vertex_inside(pierced.triangle, pierced.weights)?;
            }
            match (is_last, pierced.side) {
                (false, JOINT) => memory::push(&mut self.joints, (pierced.place, pierced.vertex))?,
                (true, END) => memory::push(&mut self.changes.ends, pierced.vertex)?,
                _ => {}
            }
        }
        for segment in segments {
            let [from, to] = segment.map(|place| match place {
                CrossingPlace::Crossed(edge) => crossed
                    .binary_search_by_key(&edge, |crossed| crossed.edge)
                    .map_or(NONE, |at| crossed[at].vertex),
                CrossingPlace::Pierced(at) => pierced[at].vertex,
            });
            self.connect(from, to)?;
        }
        for [vertex, end] in std::mem::take(&mut self.joins) {
            self.connect(vertex, end)?;
        }
        Ok(())
    }

    fn edge(&self, triangle: u32, side: usize) -> Edge {
        let it = &self.surface.triangles[triangle];
        let (from, to) = (it.corners[side], it.corners[(side + 1) % 3]);
        if it.neighbours[side] == NONE {
            (from, to)
        } else {
            (from.min(to), from.max(to))
        }
    }

    /// Weights of a triangle's corners as weights of its cell's.
    fn weights_in_cell(&self, triangle: u32, weights: [f64; 3]) -> [f64; 3] {
        let SurfaceTriangle { corners, cell, .. } = self.surface.triangles[triangle];
        let of = corners.map(|corner| self.surface.weights_in(corner, cell));
        [0, 1, 2].map(|k| (0..3).map(|corner| weights[corner] * of[corner][k]).sum())
    }

    /// The vertex there is for a point: of one that both swept triangles have what the first has made of it.
    fn vertex_known(&mut self, pierced: &Pierced) -> Result<Option<u32>> {
        let snap = self.surface.cells[self.surface.triangles[pierced.triangle].cell].snap;
        let is_same = |&&(place, _): &&(DVec3, u32)| place.distance(pierced.place) < 0.1 * snap;
        if let Some(&(_, vertex)) = self.joints.iter().find(is_same).filter(|_| pierced.side == JOINT) {
            return Ok(Some(vertex));
        }
        let Some((vertex, ends)) = self.nearest(pierced.triangle, pierced.place, snap)? else {
            return Ok(None);
        };
        self.join(vertex, &ends)?;
        Ok(Some(vertex))
    }

    /// The vertex where an edge is crossed: one of its ends, or a new one.
    fn vertex_on(&mut self, edge: Edge, along: f64) -> Result<u32> {
        let (from, to) = edge;
        let along = if from < to { along } else { 1.0 - along };
        for (triangle, side) in self.ring(from)? {
            if self.surface.triangles[triangle].corners[(side + 1) % 3] == to {
                return self.vertex_at(triangle, side, along);
            }
        }
        Ok(from)
    }
}
