//! Opens the material along severed faces. They become part of the render surface, and vertices are duplicated where
//! the material around them falls apart.

use super::body::{FaceState, SolidTriangle};
use super::cut::SolidCut;
use crate::base::DisjointSets;
use crate::base::{Result, memory};
use crate::cutting::cell_complex::NONE;
use crate::cutting::changes::{CutFace, NewVertex, RimEdge};

impl SolidCut<'_> {
    /// Separates tetrahedra at opening faces, each given by one of its sides. Returns the cells next to them.
    pub(crate) fn open(&mut self, faces: &[(u32, usize)]) -> Result<Vec<u32>> {
        let (mut corners, mut cells) = (Vec::new(), Vec::new());
        for &(tetrahedron, face) in faces {
            let across = self.solid.tetrahedra[tetrahedron].neighbors[face];
            memory::extend(&mut corners, self.solid.face(tetrahedron, face))?;
            memory::extend(
                &mut cells,
                [tetrahedron, across].map(|side| self.solid.tetrahedra[side].cell),
            )?;
        }
        memory::sort_once(&mut corners);
        memory::sort_once(&mut cells);
        // The tetrahedra around each corner, while they are still connected.
        let stars = memory::try_collected(corners.iter().map(|&vertex| {
            let mut star = Vec::new();
            self.solid.vertex_star(vertex, &mut star)?;
            Ok(star)
        }))?;
        for &(tetrahedron, face) in faces {
            self.open_face(tetrahedron, face)?;
        }
        for (&vertex, star) in corners.iter().zip(&stars) {
            self.split_vertex(vertex, star)?;
        }
        for index in 0..self.changes.faces.len() {
            for triangle in self.changes.faces[index].triangles {
                self.list_rim(triangle)?;
            }
        }
        Ok(cells)
    }

    fn open_face(&mut self, tetrahedron: u32, face: usize) -> Result<()> {
        let across = self.solid.tetrahedra[tetrahedron].neighbors[face];
        let opposite_face = self.solid.face_in_neighbor(tetrahedron, face);
        let area = self.solid.rest_area(tetrahedron, face);
        let mut triangles = [NONE; 2];
        for (triangle, (side, face)) in triangles.iter_mut().zip([(tetrahedron, face), (across, opposite_face)]) {
            self.limits
                .check("triangles", self.solid.triangles.count(), self.limits.triangles)?;
            *triangle = self.solid.triangles.push(SolidTriangle {
                corners: self.solid.face(side, face),
                cell: self.solid.tetrahedra[side].cell,
                is_inner: true,
                tetrahedron: side,
            })?;
            self.solid.tetrahedra.edit(side, |it| {
                it.neighbors[face] = NONE;
                it.faces[face] = FaceState::Whole;
                it.render_triangles[face] = *triangle;
            })?;
        }
        memory::push(&mut self.changes.faces, CutFace { triangles, area })
    }

    /// Gives each component around a vertex its own vertex, except that of the lowest tetrahedron.
    fn split_vertex(&mut self, vertex: u32, star: &[(u32, usize)]) -> Result<()> {
        let mut union = DisjointSets::default();
        union.reset(star.len())?;
        for (index, &(tetrahedron, corner)) in star.iter().enumerate() {
            for face in (0..4).filter(|&face| face != corner) {
                let across = self.solid.tetrahedra[tetrahedron].neighbors[face];
                if let Ok(other) = star.binary_search_by_key(&across, |&(other, _)| other) {
                    union.unite(index, other);
                }
            }
        }
        self.solid.vertices.edit(vertex, |vertex| vertex.around = star[0].0)?;
        for lowest in 1..star.len() {
            if union.lowest(lowest) != lowest {
                continue;
            }
            let mut copy = self.solid.vertices[vertex];
            (copy.around, copy.point) = (star[lowest].0, NONE);
            let from = NewVertex {
                sources: [vertex; 3],
                weights: [1.0, 0.0, 0.0],
            };
            let copy = self.add_vertex(copy, from)?;
            for (index, &(tetrahedron, corner)) in star.iter().enumerate() {
                if union.lowest(index) != lowest {
                    continue;
                }
                self.solid
                    .tetrahedra
                    .edit(tetrahedron, |it| it.corners[corner] = copy)?;
                for triangle in self.solid.tetrahedra[tetrahedron].render_triangles {
                    if triangle != NONE && self.solid.triangles[triangle].corners.contains(&vertex) {
                        self.solid.triangles.edit(triangle, |triangle| {
                            triangle.corners = triangle
                                .corners
                                .map(|corner| if corner == vertex { copy } else { corner });
                        })?;
                    }
                }
            }
        }
        Ok(())
    }

    /// Lists the sides of an exposed triangle that adjoin the skin.
    fn list_rim(&mut self, inner: u32) -> Result<()> {
        let it = self.solid.triangles[inner];
        let render_triangles = self.solid.tetrahedra[it.tetrahedron].render_triangles;
        let face = (0..3).find(|&face| render_triangles[face] == inner).unwrap_or(3);
        for k in 0..3 {
            let vertices = [it.corners[k], it.corners[(k + 1) % 3]];
            let (across, face) = self.solid.next_bare_face(it.tetrahedron, face, vertices);
            let skin = self.solid.tetrahedra[across].render_triangles[face];
            if !self.solid.triangles[skin].is_inner {
                let [from, to] = vertices.map(|vertex| self.solid.rest_place(vertex));
                let edge = RimEdge {
                    points: vertices,
                    triangle: inner,
                    across: skin,
                    length: from.distance(to),
                };
                memory::push(&mut self.changes.rim, edge)?;
            }
        }
        Ok(())
    }
}
