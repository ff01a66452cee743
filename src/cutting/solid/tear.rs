//! Tears through a solid, along faces of its material. The tetrahedra around a vertex are separated across the largest
//! principal strain.

use glam::{DMat3, DVec3, Vec3};

use super::body::{CutSolid, FaceState};
use super::cut::SolidCut;
use super::separate::SolidStroke;
use crate::base::{Result, memory};
use crate::cutting::cell_complex::{CellComplex, NONE};
use crate::cutting::changes::Changes;
use crate::cutting::cut::{Limits, Sweep};
use crate::cutting::tear::VertexLoad;
use crate::strain::eigenvalues;

/// A tetrahedron is above a plane if the height of its middle is more than this fraction of its extent across the
/// plane. Smaller heights are rounding errors.
const ROUNDING: f64 = 1e-9;

impl CutSolid {
    /// The largest principal strain at a node, from the mean over its cells weighted by volume. The strain is
    /// `(F Fᵀ - 1) / 2` with the deformation gradient F (Finger 1894). Its direction is the normal of a tear. `None` if
    /// no strain is positive.
    pub(crate) fn load_at(&self, node: u32, positions: &[Vec3]) -> Option<VertexLoad> {
        let (mut sum, mut volume) = (DMat3::ZERO, 0.0);
        for cell in self.cells_at(node) {
            let cell = &self.cells[cell];
            let edges = |corners: [DVec3; 4]| {
                let [a, b, c, d] = corners;
                DMat3::from_cols(b - a, c - a, d - a)
            };
            let rest = edges(cell.nodes.map(|node| self.nodes[node].rest.as_dvec3()));
            let now = edges(cell.nodes.map(|node| positions[node as usize].as_dvec3()));
            let gradient = now * rest.inverse();
            if gradient.is_finite() {
                sum += (gradient * gradient.transpose() - DMat3::IDENTITY) * (0.5 * cell.volume);
                volume += cell.volume;
            }
        }
        let mean = sum * (1.0 / volume);
        let [smallest, middle, tension] = eigenvalues(&mean);
        if !(tension > 0.0 && tension.is_finite()) {
            return None;
        }
        // Removing the other eigenvalues leaves the direction of the largest (Cayley, Hamilton).
        let shifted = |value: f64| mean - DMat3::from_diagonal(DVec3::splat(value));
        let product = shifted(smallest) * shifted(middle);
        let columns = [product.x_axis, product.y_axis, product.z_axis];
        let longest = columns
            .into_iter()
            .reduce(|a, b| if b.length() > a.length() { b } else { a })?;
        let normal = longest.try_normalize().unwrap_or(DVec3::X);
        let along = normal.any_orthonormal_vector();
        Some(VertexLoad { tension, along, normal })
    }

    /// Separates the tetrahedra around a vertex along the plane across a load, with nodes at `positions`. Each belongs
    /// to the side of its middle. Faces open as far as the render surface stays manifold. `None` if nothing opened, and
    /// nothing has changed. [`CutSolid::undo`] restores the state before the tear, until the next cut.
    ///
    /// # Errors
    /// As [`CutSolid::cut`].
    pub(crate) fn tear(
        &mut self,
        vertex: u32,
        load: &VertexLoad,
        positions: &[Vec3],
        limits: Limits,
    ) -> Result<Option<Changes>> {
        let faces = self.faces_across(vertex, load.normal, positions)?;
        self.begin();
        let strokes = self.strokes + 1;
        // The stroke of a blade continues after the tear.
        let blade_stroke = std::mem::replace(&mut self.stroke, SolidStroke::for_tear(strokes));
        self.strokes = strokes;
        let changes = SolidCut::new(self, limits, true).tear(&faces);
        self.stroke = blade_stroke;
        match changes {
            Ok(changes) if !changes.faces.is_empty() => Ok(Some(changes)),
            other => {
                self.undo();
                other.map(|_| None)
            }
        }
    }

    /// The faces at a vertex between tetrahedra on different sides of a plane through it, each by one of its sides.
    fn faces_across(&self, vertex: u32, normal: DVec3, positions: &[Vec3]) -> Result<Vec<(u32, usize)>> {
        let mut star = Vec::new();
        self.vertex_star(vertex, &mut star)?;
        let from = self.place(vertex, positions).as_dvec3();
        let height = |tetrahedron: u32| {
            let corners = self.tetrahedra[tetrahedron].corners;
            let heights = corners.map(|corner| normal.dot(self.place(corner, positions).as_dvec3() - from));
            let reach = heights.iter().map(|height| height.abs()).sum::<f64>();
            heights.iter().sum::<f64>() / reach
        };
        let mut faces = Vec::new();
        for &(tetrahedron, corner) in &star {
            for face in (0..4).filter(|&face| face != corner) {
                let across = self.tetrahedra[tetrahedron].neighbors[face];
                if across != NONE && height(tetrahedron) > ROUNDING && !(height(across) > ROUNDING) {
                    memory::push(&mut faces, (tetrahedron, face))?;
                }
            }
        }
        Ok(faces)
    }

    /// A square around a vertex across a load. It extends as far as the faces that would separate there, with nodes at
    /// `positions`.
    pub(crate) fn tear_sweep(&self, vertex: u32, load: &VertexLoad, positions: &[Vec3]) -> Result<Sweep> {
        let position = |vertex: u32| self.place(vertex, positions).as_dvec3();
        let from = position(vertex);
        let faces = self.faces_across(vertex, load.normal, positions)?;
        let corners = faces
            .into_iter()
            .flat_map(|(tetrahedron, face)| self.face(tetrahedron, face));
        let reach = corners
            .map(|corner| position(corner).distance(from))
            .fold(0.0, f64::max);
        let [a, b] = [load.along, load.normal.cross(load.along)].map(|axis| axis * reach);
        let at = |along: f64, across: f64| (from + along * a + across * b).as_vec3();
        Ok(Sweep {
            start: [at(-1.0, -1.0), at(-1.0, 1.0)],
            end: [at(1.0, -1.0), at(1.0, 1.0)],
        })
    }
}

impl SolidCut<'_> {
    fn tear(mut self, faces: &[(u32, usize)]) -> Result<Changes> {
        let mut torn = Vec::new();
        for &(tetrahedron, face) in faces {
            if self.solid.tetrahedra[tetrahedron].faces[face] == FaceState::Whole {
                self.set_face(tetrahedron, face, FaceState::Severed)?;
                memory::push(&mut torn, (tetrahedron, face))?;
            }
            memory::extend(&mut self.marked, self.solid.face(tetrahedron, face))?;
        }
        memory::sort_once(&mut self.marked);
        let opening = self.openable_faces()?;
        // Faces that cannot open are not torn.
        for (tetrahedron, face) in torn {
            if self.solid.tetrahedra[tetrahedron].faces[face] == FaceState::Severed {
                self.set_face(tetrahedron, face, FaceState::Whole)?;
            }
        }
        self.finish(&opening)
    }
}
