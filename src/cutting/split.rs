//! Splits the render mesh at a point of an edge or inside a triangle.

use super::cell_complex::{CellComplex, NONE};
use super::changes::NewVertex;
use super::cut::Cut;
use super::surface::{SurfaceTriangle, SurfaceVertex};
use crate::base::{Result, memory};

impl Cut<'_> {
    /// Splits a triangle, and the one across, at the fraction `along` of the side that starts at corner `side`.
    pub(crate) fn split_edge(&mut self, triangle: u32, side: usize, along: f64) -> Result<u32> {
        let old = self.surface.triangles[triangle];
        let [a, b, c] = [0, 1, 2].map(|k| old.corners[(side + k) % 3]);
        let across = old.neighbors[side];
        let middle = self.new_vertex([a, b, a], [1.0 - along, along, 0.0], triangle)?;
        let far = self.halve(triangle, side, middle)?;
        if across == NONE {
            return self.set_around(b, far).map(|()| middle);
        }
        let opposite_side = self.surface.corner(across, b);
        let other = self.halve(across, opposite_side, middle)?;
        self.set_neighbor(triangle, a, other)?;
        self.set_neighbor(far, middle, across)?;
        self.set_neighbor(across, b, far)?;
        self.set_neighbor(other, middle, triangle)?;
        self.set_around(b, far)?;
        self.set_around(a, triangle)?;
        self.set_around(c, triangle)?;
        Ok(middle)
    }

    /// Splits a triangle into three at an inner point, given by weights of its corners.
    pub(crate) fn split_inside(&mut self, triangle: u32, weights: [f64; 3]) -> Result<u32> {
        let old = self.surface.triangles[triangle];
        let [a, b, c] = old.corners;
        let middle = self.new_vertex(old.corners, weights, triangle)?;
        let second = self.add_triangle(SurfaceTriangle {
            corners: [b, c, middle],
            rim: [old.rim[1], false, false],
            neighbors: [old.neighbors[1], NONE, triangle],
            ..old
        })?;
        let third = self.add_triangle(SurfaceTriangle {
            corners: [c, a, middle],
            rim: [old.rim[2], false, false],
            neighbors: [old.neighbors[2], triangle, second],
            ..old
        })?;
        self.set_neighbor(second, c, third)?;
        self.replace_neighbor(old.neighbors[1], triangle, second, c)?;
        self.replace_neighbor(old.neighbors[2], triangle, third, a)?;
        self.surface.triangles.edit(triangle, |first| {
            first.corners[2] = middle;
            first.rim = [old.rim[0], false, false];
            first.neighbors = [old.neighbors[0], second, third];
        })?;
        self.set_around(b, triangle)?;
        self.set_around(a, triangle)?;
        self.set_around(c, second)?;
        Ok(middle)
    }

    /// Halves a triangle (a, b, c) at `middle` on its side from a to b. It becomes (a, middle, c). Returns (middle, b,
    /// c).
    fn halve(&mut self, triangle: u32, side: usize, middle: u32) -> Result<u32> {
        let old = self.surface.triangles[triangle];
        let [at_a, at_b, at_c] = [side, (side + 1) % 3, (side + 2) % 3];
        let (b, c) = (old.corners[at_b], old.corners[at_c]);
        let far = self.add_triangle(SurfaceTriangle {
            corners: [middle, b, c],
            rim: [old.rim[at_a], old.rim[at_b], false],
            neighbors: [old.neighbors[at_a], old.neighbors[at_b], triangle],
            ..old
        })?;
        self.replace_neighbor(old.neighbors[at_b], triangle, far, c)?;
        self.surface.triangles.edit(triangle, |near| {
            near.corners[at_b] = middle;
            near.rim[at_b] = false;
            near.neighbors[at_b] = far;
        })?;
        Ok(far)
    }

    /// Adds a vertex between the corners of one triangle.
    fn new_vertex(&mut self, sources: [u32; 3], weights: [f64; 3], around: u32) -> Result<u32> {
        let (nodes, shares) = self.surface.binding_between(sources, weights);
        let vertex = SurfaceVertex {
            nodes,
            weights: shares,
            point: NONE,
            around,
        };
        self.add_vertex(vertex, NewVertex { sources, weights })
    }

    pub(crate) fn add_vertex(&mut self, vertex: SurfaceVertex, origin: NewVertex) -> Result<u32> {
        self.limits
            .check("vertices", self.surface.vertices.count(), self.limits.vertices)?;
        memory::push(&mut self.changes.vertices, origin)?;
        self.surface.vertices.push(vertex)
    }

    /// Adds a triangle to the cell that it refers to.
    fn add_triangle(&mut self, triangle: SurfaceTriangle) -> Result<u32> {
        self.limits
            .check("triangles", self.surface.triangles.count(), self.limits.triangles)?;
        let next = self.surface.cells[triangle.cell].first;
        let index = self.surface.triangles.push(SurfaceTriangle { next, ..triangle })?;
        self.surface.cells.edit(triangle.cell, |cell| cell.first = index)?;
        Ok(index)
    }

    /// Sets the neighbor across the side that starts at a vertex.
    fn set_neighbor(&mut self, triangle: u32, from: u32, neighbor: u32) -> Result<()> {
        let side = self.surface.corner(triangle, from);
        self.surface
            .triangles
            .edit(triangle, |triangle| triangle.neighbors[side] = neighbor)
    }

    /// Replaces the neighbor `triangle` of `other`, across the side that starts at a vertex, by `new`.
    fn replace_neighbor(&mut self, other: u32, triangle: u32, new: u32, from: u32) -> Result<()> {
        if other == NONE || other == triangle {
            return Ok(());
        }
        self.set_neighbor(other, from, new)
    }

    /// Sets the triangle from which the ring of a vertex is found.
    fn set_around(&mut self, vertex: u32, triangle: u32) -> Result<()> {
        self.surface.vertices.edit(vertex, |vertex| vertex.around = triangle)
    }
}
