//! Splits an edge of the material. Each tetrahedron around it is halved.

use super::body::{FaceState, SolidTetrahedron, SolidTriangle, SolidVertex};
use super::cut::SolidCut;
use super::separate::BladeMark;
use crate::base::{Result, memory};
use crate::cutting::cell_complex::{CellComplex, NONE};
use crate::cutting::changes::NewVertex;

impl SolidCut<'_> {
    /// Splits an edge of a tetrahedron at the fraction `along` from its first end. Each tetrahedron around it keeps the
    /// half at the first end.
    pub(crate) fn split_edge(&mut self, tetrahedron: u32, edge: [u32; 2], along: f64) -> Result<u32> {
        let [from, to] = edge;
        let mut ring = Vec::new();
        self.solid.ring(tetrahedron, edge, &mut ring)?;
        ring.sort_unstable();
        let middle = self.vertex_between(edge, along, tetrahedron)?;
        let first = self.solid.tetrahedra.count();
        let far_of = |near: u32| ring.binary_search(&near).map_or(NONE, |index| first + index as u32);
        for &near in &ring {
            let old = self.solid.tetrahedra[near];
            let [at_from, at_to] = edge.map(|end| self.solid.corner(near, end));
            let far_volume = old.volume * (1.0 - along);
            let mut far = SolidTetrahedron {
                volume: far_volume,
                ..old
            };
            far.corners[at_from] = middle;
            far.neighbors = old.neighbors.map(far_of);
            far.neighbors[at_from] = old.neighbors[at_from];
            far.neighbors[at_to] = near;
            far.faces[at_to] = FaceState::Whole;
            far.render_triangles[at_to] = NONE;
            let far_index = self.add_tetrahedron(far)?;
            let beyond = old.neighbors[at_from];
            if beyond != NONE {
                let opposite_face = self.solid.face_in_neighbor(near, at_from);
                self.solid
                    .tetrahedra
                    .edit(beyond, |beyond| beyond.neighbors[opposite_face] = far_index)?;
            }
            self.solid.tetrahedra.edit(near, |near| {
                near.corners[at_to] = middle;
                near.volume = old.volume - far_volume;
                near.neighbors[at_from] = far_index;
                near.faces[at_from] = FaceState::Whole;
                near.render_triangles[at_from] = NONE;
            })?;
            for (face, &triangle) in old
                .render_triangles
                .iter()
                .enumerate()
                .filter(|&(_, &triangle)| triangle != NONE)
            {
                if face == at_from {
                    self.solid
                        .triangles
                        .edit(triangle, |triangle| triangle.tetrahedron = far_index)?;
                } else if face != at_to {
                    self.halve_triangle(triangle, edge, middle, far_index, face)?;
                }
            }
        }
        self.solid.vertices.edit(to, |vertex| vertex.around = far_of(ring[0]))?;
        debug_assert!(self.solid.tetrahedra[tetrahedron].corners.contains(&from));
        Ok(middle)
    }

    fn halve_triangle(
        &mut self,
        triangle: u32,
        [from, to]: [u32; 2],
        middle: u32,
        far: u32,
        face: usize,
    ) -> Result<()> {
        let old = self.solid.triangles[triangle];
        let swap = |replaced: u32| {
            old.corners
                .map(|corner| if corner == replaced { middle } else { corner })
        };
        self.limits
            .check("triangles", self.solid.triangles.count(), self.limits.triangles)?;
        let far_index = self.solid.triangles.push(SolidTriangle {
            corners: swap(from),
            tetrahedron: far,
            ..old
        })?;
        self.solid.triangles.edit(triangle, |near| near.corners = swap(to))?;
        self.solid
            .tetrahedra
            .edit(far, |far| far.render_triangles[face] = far_index)
    }

    /// Adds a vertex on an edge.
    fn vertex_between(&mut self, edge: [u32; 2], along: f64, around: u32) -> Result<u32> {
        let (sources, shares) = ([edge[0], edge[1], edge[0]], [1.0 - along, along, 0.0]);
        let (nodes, weights) = self.solid.binding_between(sources, shares);
        let vertex = SolidVertex {
            nodes,
            weights,
            point: NONE,
            around,
            mark: BladeMark::NONE,
            other_mark: self.mark_between(edge),
        };
        let from = NewVertex {
            sources,
            weights: shares,
        };
        self.add_vertex(vertex, from)
    }

    pub(crate) fn add_vertex(&mut self, vertex: SolidVertex, from: NewVertex) -> Result<u32> {
        self.limits
            .check("vertices", self.solid.vertices.count(), self.limits.vertices)?;
        memory::push(&mut self.changes.vertices, from)?;
        self.solid.vertices.push(vertex)
    }

    /// Adds a tetrahedron to the cell that it refers to.
    fn add_tetrahedron(&mut self, tetrahedron: SolidTetrahedron) -> Result<u32> {
        let far_index = self.solid.tetrahedra.count();
        self.limits.check("tetrahedra", far_index, u32::MAX)?;
        let next = self.solid.cells[tetrahedron.cell].first;
        self.solid.tetrahedra.push(SolidTetrahedron { next, ..tetrahedron })?;
        self.solid.cells.edit(tetrahedron.cell, |cell| cell.first = far_index)?;
        Ok(far_index)
    }
}
