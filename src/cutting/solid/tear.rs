//! Tears through a solid, along faces of its material: what lies about a vertex is parted across what stretches it most.

use glam::{DMat3, DVec3, Vec3};

use super::body::{CutSolid, Face};
use super::cut::SolidCut;
use super::sever::SolidStroke;
use crate::base::{Result, memory};
use crate::cutting::changes::Changes;
use crate::cutting::cut::{Limits, Sweep};
use crate::cutting::divided::{Divided, NONE};
use crate::cutting::tear::VertexLoad;
use crate::strain::eigenvalues;

/// A tetrahedron of which the middle lies no higher above a plane than this part of how far it reaches off it is not above: rounding does not tell.
const BESIDE: f64 = 1e-9;

impl CutSolid {
    /// What the cells at a node are stretched by, in the mean over their material: the largest principal value of (F Fᵀ - 1) / 2 with the gradient F of
    /// the deformation (Finger 1894), without unit, and the direction of it as the normal of a tear; `None`: nothing stretches it.
    pub(crate) fn load_at(&self, node: u32, positions: &[Vec3]) -> Option<VertexLoad> {
        let (mut sum, mut volume) = (DMat3::ZERO, 0.0);
        for cell in self.cells_at(node) {
            let cell = &self.cells[cell];
            let edges = |places: [DVec3; 4]| {
                let [a, b, c, d] = places;
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
        // What is left of the others has the direction of the largest (Cayley, Hamilton).
        let without = |value: f64| mean - DMat3::from_diagonal(DVec3::splat(value));
        let left = without(smallest) * without(middle);
        let columns = [left.x_axis, left.y_axis, left.z_axis];
        let longest = columns
            .into_iter()
            .reduce(|a, b| if b.length() > a.length() { b } else { a })?;
        let normal = longest.try_normalize().unwrap_or(DVec3::X);
        let along = normal.any_orthonormal_vector();
        Some(VertexLoad { tension, along, normal })
    }

    /// Parts the tetrahedra about a vertex whose middles lie on the two sides of the plane across a load while nodes are at `positions`, as far as what is
    /// drawn stays manifold; `None`: nothing opened, and nothing has changed. [`CutSolid::undo`] takes it back until the next cut.
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
        // The stroke of a blade goes on after it.
        let of_blade = std::mem::replace(&mut self.stroke, SolidStroke::of_tear(strokes));
        self.strokes = strokes;
        let changes = SolidCut::new(self, limits, true).tear(&faces);
        self.stroke = of_blade;
        match changes {
            Ok(changes) if !changes.faces.is_empty() => Ok(Some(changes)),
            other => {
                self.undo();
                other.map(|_| None)
            }
        }
    }

    /// The faces at a vertex between tetrahedra on the two sides of a plane through it, each by one of its sides.
    fn faces_across(&self, vertex: u32, normal: DVec3, positions: &[Vec3]) -> Result<Vec<(u32, usize)>> {
        let mut star = Vec::new();
        self.star(vertex, &mut star)?;
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
                let across = self.tetrahedra[tetrahedron].neighbours[face];
                if across != NONE && height(tetrahedron) > BESIDE && !(height(across) > BESIDE) {
                    memory::push(&mut faces, (tetrahedron, face))?;
                }
            }
        }
        Ok(faces)
    }

    /// A square about a vertex across a load that reaches as far as what would part there, with nodes at `positions`.
    pub(crate) fn way_of(&self, vertex: u32, load: &VertexLoad, positions: &[Vec3]) -> Result<Sweep> {
        let place = |vertex: u32| self.place(vertex, positions).as_dvec3();
        let from = place(vertex);
        let faces = self.faces_across(vertex, load.normal, positions)?;
        let corners = faces
            .into_iter()
            .flat_map(|(tetrahedron, face)| self.face(tetrahedron, face));
        let reach = corners.map(|corner| place(corner).distance(from)).fold(0.0, f64::max);
        let [a, b] = [load.along, load.normal.cross(load.along)].map(|way| way * reach);
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
            if self.solid.tetrahedra[tetrahedron].faces[face] == Face::Whole {
                self.set_face(tetrahedron, face, Face::Severed)?;
                memory::push(&mut torn, (tetrahedron, face))?;
            }
            memory::extend(&mut self.marked, self.solid.face(tetrahedron, face))?;
        }
        memory::sort_once(&mut self.marked);
        let opening = self.ready()?;
        // What cannot open is not torn.
        for (tetrahedron, face) in torn {
            if self.solid.tetrahedra[tetrahedron].faces[face] == Face::Severed {
                self.set_face(tetrahedron, face, Face::Whole)?;
            }
        }
        self.finish(&opening)
    }
}
