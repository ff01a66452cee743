//! Cuts along edges: connects two vertices by a path of edges.

use glam::DVec3;

use super::cell_complex::NONE;
use super::cut::Cut;
use crate::base::Result;

/// A longer path was misled by a surface that is folded in its rest shape. The cut ends there.
const MAX_PATH_EDGES: usize = 64;

impl Cut<'_> {
    /// Cuts between two vertices near each other: along the edge between them, or in a straight line across the
    /// triangles between them. If an earlier cut lies between them, both ends are connected to it.
    pub(crate) fn connect(&mut self, from: u32, to: u32) -> Result<()> {
        if from != NONE && to != NONE && !self.cut_straight(from, to)? {
            self.cut_straight(to, from)?;
        }
        Ok(())
    }

    /// Cuts in a straight line from one vertex to another. Returns true if it arrives there.
    fn cut_straight(&mut self, from: u32, to: u32) -> Result<bool> {
        let (mut before, mut current) = (NONE, from);
        for _ in 0..MAX_PATH_EDGES {
            if current == to || self.mark_edge(current, to)? {
                return Ok(true);
            }
            let target = self.surface.rest_place(to);
            let Some((triangle, side, along)) = self.exit_towards(current, target)? else {
                return Ok(false);
            };
            let next = self.vertex_on_side(triangle, side, along)?;
            if next == before {
                return Ok(false);
            }
            self.mark_edge(current, next)?;
            (before, current) = (current, next);
        }
        Ok(false)
    }

    /// Marks the edge between two vertices as cut. Returns true if it exists.
    fn mark_edge(&mut self, from: u32, to: u32) -> Result<bool> {
        for (triangle, corner) in self.ring(from)? {
            let it = &self.surface.triangles[triangle];
            let has_end = |side: &usize| it.corners[*side] == to || it.corners[(side + 1) % 3] == to;
            if let Some(side) = [corner, (corner + 2) % 3].into_iter().find(has_end) {
                if it.neighbors[side] != NONE {
                    self.set_cut(triangle, side, true)?;
                }
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Marks a side of a triangle, which has a triangle across, as cut or uncut.
    pub(crate) fn set_cut(&mut self, triangle: u32, side: usize, is_cut: bool) -> Result<()> {
        let it = &self.surface.triangles[triangle];
        let across = it.neighbors[side];
        let opposite_side = self.surface.corner(across, it.corners[(side + 1) % 3]);
        self.surface
            .triangles
            .edit(triangle, |triangle| triangle.rim[side] = is_cut)?;
        self.surface
            .triangles
            .edit(across, |across| across.rim[opposite_side] = is_cut)
    }

    /// The point where a straight line from a vertex to a position leaves the triangles around the vertex: the
    /// triangle, its side, and the position along the side. `None` if the line enters none of them.
    pub(crate) fn exit_towards(&self, current: u32, target: DVec3) -> Result<Option<(u32, usize, f64)>> {
        let start = self.surface.rest_place(current);
        let direction = target - start;
        for (triangle, corner) in self.ring(current)? {
            let corners = self.surface.triangles[triangle].corners;
            let [right, left] = [1, 2].map(|k| self.surface.rest_place(corners[(corner + k) % 3]) - start);
            let normal = right.cross(left);
            // A line along an edge enters the triangles on both sides.
            let rounding = 1e-6 * normal.length() * direction.length() * right.length().max(left.length());
            let [right, left] = [right, left].map(|side| normal.dot(direction.cross(side)));
            if right <= rounding && left >= -rounding && right < left {
                let along = (right / (right - left)).clamp(0.0, 1.0);
                return Ok(Some((triangle, (corner + 1) % 3, along)));
            }
        }
        Ok(None)
    }
}
