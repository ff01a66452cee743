//! Edges that are cut: between two vertices there is a way of edges.

use glam::DVec3;

use super::cut::Cut;
use super::divided::NONE;
use crate::base::Result;

/// A way that is longer was led astray by a surface that is folded in its rest shape; the cut ends there.
const LONGEST_WAY: usize = 64;

impl Cut<'_> {
    /// Cuts between two vertices near each other: along the edge between them, mostly; else straight across what lies between. What was cut
    /// before may lie between: then from both up to there.
    pub(crate) fn connect(&mut self, from: u32, to: u32) -> Result<()> {
        if from != NONE && to != NONE && !self.cut_towards(from, to)? {
            self.cut_towards(to, from)?;
        }
        Ok(())
    }

    /// Cuts from one vertex straight to another; answers whether it has come there.
    fn cut_towards(&mut self, from: u32, to: u32) -> Result<bool> {
        let (mut before, mut at) = (NONE, from);
        for _ in 0..LONGEST_WAY {
            if at == to || self.mark(at, to)? {
                return Ok(true);
            }
            let goal = self.surface.rest_place(to);
            let Some((triangle, side, along)) = self.way_out(at, goal)? else {
                return Ok(false);
            };
            let next = self.vertex_at(triangle, side, along)?;
            if next == before {
                return Ok(false);
            }
            self.mark(at, next)?;
            (before, at) = (at, next);
        }
        Ok(false)
    }

    /// Marks the edge between two vertices as cut; answers whether there is one.
    fn mark(&mut self, from: u32, to: u32) -> Result<bool> {
        for (triangle, corner) in self.ring(from)? {
            let it = &self.surface.triangles[triangle];
            let ends_there = |side: &usize| it.corners[*side] == to || it.corners[(side + 1) % 3] == to;
            if let Some(side) = [corner, (corner + 2) % 3].into_iter().find(ends_there) {
                if it.neighbours[side] != NONE {
                    self.set_cut(triangle, side, true)?;
                }
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Sets whether a side of a triangle, which has a triangle across, is to be cut.
    pub(crate) fn set_cut(&mut self, triangle: u32, side: usize, is_cut: bool) -> Result<()> {
        let it = &self.surface.triangles[triangle];
        let across = it.neighbours[side];
        let back = self.surface.corner(across, it.corners[(side + 1) % 3]);
        self.surface
            .triangles
            .edit(triangle, |triangle| triangle.rim[side] = is_cut)?;
        self.surface.triangles.edit(across, |across| across.rim[back] = is_cut)
    }

    /// Where the straight way from a vertex to a place leaves the triangles about it: the triangle, its side, and how far along that. None if the
    /// way does not lead into one of them.
    pub(crate) fn way_out(&self, at: u32, goal: DVec3) -> Result<Option<(u32, usize, f64)>> {
        let start = self.surface.rest_place(at);
        let way = goal - start;
        for (triangle, corner) in self.ring(at)? {
            let corners = self.surface.triangles[triangle].corners;
            let [right, left] = [1, 2].map(|k| self.surface.rest_place(corners[(corner + k) % 3]) - start);
            let normal = right.cross(left);
            // A way along an edge leads into the triangles on both sides.
            let rounding = 1e-6 * normal.length() * way.length() * right.length().max(left.length());
            let [right, left] = [right, left].map(|side| normal.dot(way.cross(side)));
            if right <= rounding && left >= -rounding && right < left {
                let along = (right / (right - left)).clamp(0.0, 1.0);
                return Ok(Some((triangle, (corner + 1) % 3, along)));
            }
        }
        Ok(None)
    }
}
