//! Splitting what is drawn: at a point of an edge, or inside a triangle.

use super::changes::NewVertex;
use super::cut::Cut;
use super::divided::{Divided, NONE};
use super::surface::{SurfaceTriangle, SurfaceVertex};
use crate::base::{Result, memory};

impl Cut<'_> {
    /// Splits a triangle, and the one across, at a point of the side that starts at corner `side`, `along` of the way to the next corner.
    pub(crate) fn split_edge(&mut self, triangle: u32, side: usize, along: f64) -> Result<u32> {
        let old = self.surface.triangles[triangle];
        let [a, b, c] = [0, 1, 2].map(|k| old.corners[(side + k) % 3]);
        let across = old.neighbours[side];
        let middle = self.new_vertex([a, b, a], [1.0 - along, along, 0.0], triangle)?;
        let far = self.half(triangle, side, middle)?;
        if across == NONE {
            return self.point_at(b, far).map(|()| middle);
        }
        let back = self.surface.corner(across, b);
        let other = self.half(across, back, middle)?;
        self.link(triangle, a, other)?;
        self.link(far, middle, across)?;
        self.link(across, b, far)?;
        self.link(other, middle, triangle)?;
        self.point_at(b, far)?;
        self.point_at(a, triangle)?;
        self.point_at(c, triangle)?;
        Ok(middle)
    }

    /// Splits a triangle in three at a point inside, given by weights of its corners.
    pub(crate) fn split_inside(&mut self, triangle: u32, weights: [f64; 3]) -> Result<u32> {
        let old = self.surface.triangles[triangle];
        let [a, b, c] = old.corners;
        let middle = self.new_vertex(old.corners, weights, triangle)?;
        let second = self.add_triangle(SurfaceTriangle {
            corners: [b, c, middle],
            rim: [old.rim[1], false, false],
            neighbours: [old.neighbours[1], NONE, triangle],
            ..old
        })?;
        let third = self.add_triangle(SurfaceTriangle {
            corners: [c, a, middle],
            rim: [old.rim[2], false, false],
            neighbours: [old.neighbours[2], triangle, second],
            ..old
        })?;
        self.link(second, c, third)?;
        self.relink(old.neighbours[1], triangle, second, c)?;
        self.relink(old.neighbours[2], triangle, third, a)?;
        self.surface.triangles.edit(triangle, |first| {
            first.corners[2] = middle;
            first.rim = [old.rim[0], false, false];
            first.neighbours = [old.neighbours[0], second, third];
        })?;
        self.point_at(b, triangle)?;
        self.point_at(a, triangle)?;
        self.point_at(c, second)?;
        Ok(middle)
    }

    /// Halves a triangle (a, b, c) from `middle` on its side from a to b; it becomes (a, middle, c), and (middle, b, c) is returned.
    fn half(&mut self, triangle: u32, side: usize, middle: u32) -> Result<u32> {
        let old = self.surface.triangles[triangle];
        let [at_a, at_b, at_c] = [side, (side + 1) % 3, (side + 2) % 3];
        let (b, c) = (old.corners[at_b], old.corners[at_c]);
        let far = self.add_triangle(SurfaceTriangle {
            corners: [middle, b, c],
            rim: [old.rim[at_a], old.rim[at_b], false],
            neighbours: [old.neighbours[at_a], old.neighbours[at_b], triangle],
            ..old
        })?;
        self.relink(old.neighbours[at_b], triangle, far, c)?;
        self.surface.triangles.edit(triangle, |near| {
            near.corners[at_b] = middle;
            near.rim[at_b] = false;
            near.neighbours[at_b] = far;
        })?;
        Ok(far)
    }

    /// A vertex between the corners of one triangle.
    fn new_vertex(&mut self, sources: [u32; 3], weights: [f64; 3], around: u32) -> Result<u32> {
        let (nodes, shares) = self.surface.bonds_between(sources, weights);
        let vertex = SurfaceVertex {
            nodes,
            weights: shares,
            point: NONE,
            around,
        };
        self.add_vertex(vertex, NewVertex { sources, weights })
    }

    pub(crate) fn add_vertex(&mut self, vertex: SurfaceVertex, from: NewVertex) -> Result<u32> {
        self.limits
            .check("vertices", self.surface.vertices.count(), self.limits.vertices)?;
        memory::push(&mut self.changes.vertices, from)?;
        self.surface.vertices.push(vertex)
    }

    /// Adds a triangle to the cell that it names.
    fn add_triangle(&mut self, triangle: SurfaceTriangle) -> Result<u32> {
        self.limits
            .check("triangles", self.surface.triangles.count(), self.limits.triangles)?;
        let next = self.surface.cells[triangle.cell].first;
        let number = self.surface.triangles.push(SurfaceTriangle { next, ..triangle })?;
        self.surface.cells.edit(triangle.cell, |cell| cell.first = number)?;
        Ok(number)
    }

    /// Across the side that starts at a vertex lies `neighbour`.
    fn link(&mut self, triangle: u32, from: u32, neighbour: u32) -> Result<()> {
        let side = self.surface.corner(triangle, from);
        self.surface
            .triangles
            .edit(triangle, |triangle| triangle.neighbours[side] = neighbour)
    }

    /// Where `triangle` lay across the side of `other` that starts at a vertex, now `new` does.
    fn relink(&mut self, other: u32, triangle: u32, new: u32, from: u32) -> Result<()> {
        if other == NONE || other == triangle {
            return Ok(());
        }
        self.link(other, from, new)
    }

    /// A vertex has this triangle about it.
    fn point_at(&mut self, vertex: u32, triangle: u32) -> Result<()> {
        self.surface.vertices.edit(vertex, |vertex| vertex.around = triangle)
    }
}
