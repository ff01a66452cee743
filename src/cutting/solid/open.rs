//! The material opens along severed faces: they are drawn, and vertices are doubled where what lies about them falls apart.

use super::body::{Face, SolidTriangle};
use super::cut::SolidCut;
use crate::base::DisjointSets;
use crate::base::{Result, memory};
use crate::cutting::changes::{CutFace, NewVertex, RimEdge};
use crate::cutting::divided::NONE;

impl SolidCut<'_> {
    /// Parts tetrahedra at faces marked as opening, each given by one of its sides. Returns the cells beside them.
    pub(crate) fn open(&mut self, faces: &[(u32, usize)]) -> Result<Vec<u32>> {
        let (mut corners, mut cells) = (Vec::new(), Vec::new());
        for &(tetrahedron, face) in faces {
            let across = self.solid.tetrahedra[tetrahedron].neighbours[face];
            memory::extend(&mut corners, self.solid.face(tetrahedron, face))?;
            memory::extend(
                &mut cells,
                [tetrahedron, across].map(|side| self.solid.tetrahedra[side].cell),
            )?;
        }
        memory::sort_once(&mut corners);
        memory::sort_once(&mut cells);
        // What lies about each corner, while it still hangs together.
        let stars = memory::try_collected(corners.iter().map(|&vertex| {
            let mut star = Vec::new();
            self.solid.star(vertex, &mut star)?;
            Ok(star)
        }))?;
        for &(tetrahedron, face) in faces {
            self.bare_face(tetrahedron, face)?;
        }
        for (&vertex, star) in corners.iter().zip(&stars) {
            self.part_vertex(vertex, star)?;
        }
        for at in 0..self.changes.faces.len() {
            for triangle in self.changes.faces[at].triangles {
                self.list_rim(triangle)?;
            }
        }
        Ok(cells)
    }

    fn bare_face(&mut self, tetrahedron: u32, face: usize) -> Result<()> {
        let across = self.solid.tetrahedra[tetrahedron].neighbours[face];
        let back = self.solid.back(tetrahedron, face);
        let area = self.solid.rest_area(tetrahedron, face);
        let mut triangles = [NONE; 2];
        for (triangle, (of, face)) in triangles.iter_mut().zip([(tetrahedron, face), (across, back)]) {
            self.limits
                .check("triangles", self.solid.triangles.count(), self.limits.triangles)?;
            *triangle = self.solid.triangles.push(SolidTriangle {
                corners: self.solid.face(of, face),
                cell: self.solid.tetrahedra[of].cell,
                is_inner: true,
                tetrahedron: of,
            })?;
            self.solid.tetrahedra.edit(of, |it| {
                it.neighbours[face] = NONE;
                it.faces[face] = Face::Whole;
                it.drawn[face] = *triangle;
            })?;
        }
        memory::push(&mut self.changes.faces, CutFace { triangles, area })
    }

    /// Gives each part of what lay about a vertex, but that of the lowest tetrahedron, a vertex of its own.
    fn part_vertex(&mut self, vertex: u32, star: &[(u32, usize)]) -> Result<()> {
        let mut union = DisjointSets::default();
        union.reset(star.len())?;
        for (at, &(tetrahedron, corner)) in star.iter().enumerate() {
            for face in (0..4).filter(|&face| face != corner) {
                let across = self.solid.tetrahedra[tetrahedron].neighbours[face];
                if let Ok(other) = star.binary_search_by_key(&across, |&(of, _)| of) {
                    union.unite(at, other);
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
            for (at, &(tetrahedron, corner)) in star.iter().enumerate() {
                if union.lowest(at) != lowest {
                    continue;
                }
                self.solid
                    .tetrahedra
                    .edit(tetrahedron, |it| it.corners[corner] = copy)?;
                for triangle in self.solid.tetrahedra[tetrahedron].drawn {
                    if triangle != NONE && self.solid.triangles[triangle].corners.contains(&vertex) {
                        self.solid.triangles.edit(triangle, |triangle| {
                            triangle.corners = triangle.corners.map(|of| if of == vertex { copy } else { of });
                        })?;
                    }
                }
            }
        }
        Ok(())
    }

    /// Lists the sides of a triangle of the inside beyond which there is skin.
    fn list_rim(&mut self, inner: u32) -> Result<()> {
        let it = self.solid.triangles[inner];
        let drawn = self.solid.tetrahedra[it.tetrahedron].drawn;
        let face = (0..3).find(|&face| drawn[face] == inner).unwrap_or(3);
        for k in 0..3 {
            let vertices = [it.corners[k], it.corners[(k + 1) % 3]];
            let (across, face) = self.solid.beside(it.tetrahedron, face, vertices);
            let skin = self.solid.tetrahedra[across].drawn[face];
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
