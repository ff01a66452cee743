//! Binds the vertices of a fine surface to the tetrahedra or triangles of a body.

use glam::{DMat3, DVec3, Vec3};

use crate::base::{Result, ensure, memory};
use crate::cutting::{CutSolid, CutSurface};
use crate::geometry::Aabb;
use crate::geometry::bvh::Bvh;
use crate::geometry::nearest::{nearest_on_triangle, weighted};

/// A vertex bound to a tetrahedron, inside or outside it.
#[derive(Clone, Copy, Debug)]
pub(super) struct InTetrahedron {
    pub nodes: [u32; 4],
    /// The barycentric weights of all but the first.
    pub weights: [f32; 3],
}

/// A vertex bound to a triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct OverTriangle {
    pub nodes: [u32; 3],
    /// The barycentric weights of all but the first.
    pub weights: [f32; 2],
    /// The distance along the normal, m.
    pub offset: f32,
}

/// What each vertex is bound to, in the order of the vertices.
#[derive(Debug)]
pub(super) enum Binding {
    Tetrahedra(Vec<InTetrahedron>),
    Triangles(Vec<OverTriangle>),
}

const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]];

impl Binding {
    /// Binds each vertex to the tetrahedron that contains it, or else the nearest one; among several to the one in
    /// which it is deepest. Returns these tetrahedra too.
    pub fn to_tetrahedra(vertices: &[Vec3], positions: &[Vec3], tetrahedra: &[[u32; 4]]) -> Result<(Self, Vec<u32>)> {
        let corners = |index: u32| tetrahedra[index as usize].map(|node| positions[node as usize]);
        let solids: Vec<PlacedTetrahedron> = memory::collected(
            (0..tetrahedra.len() as u32)
                .map(|index| PlacedTetrahedron::of(corners(index).map(|corner| corner.as_dvec3()))),
        )?;
        ensure!(
            solids.iter().any(PlacedTetrahedron::has_volume),
            "tetrahedra: none of them has a volume"
        );
        // The bounding box of these three points is that of the tetrahedron.
        let tree = Bvh::new(tetrahedra.len(), |index| {
            let bounds = Aabb::of(corners(index).into_iter());
            [bounds.min, bounds.max, bounds.min]
        })?;
        let mut bound = memory::reserved(vertices.len())?;
        let mut cells = memory::reserved(vertices.len())?;
        for &vertex in vertices {
            let point = vertex.as_dvec3();
            // The squared distance, depth and index of the best tetrahedron so far.
            let mut best = (f64::INFINITY, f64::NEG_INFINITY, 0);
            tree.near(&Aabb::of(std::iter::once(vertex)), f32::INFINITY, |index| {
                let number = tree.triangle(index);
                let solid = &solids[number as usize];
                if solid.has_volume() {
                    let depth = solid.depth(point);
                    let distance = if depth >= 0.0 {
                        0.0
                    } else {
                        solid.distance_squared(point)
                    };
                    let is_better = distance < best.0
                        || distance == best.0 && (depth > best.1 || depth == best.1 && number < best.2);
                    if is_better {
                        best = (distance, depth, number);
                    }
                }
                best.0 as f32
            });
            cells.push(best.2);
            let number = best.2 as usize;
            bound.push(InTetrahedron {
                nodes: tetrahedra[number],
                weights: solids[number].weights(point).as_vec3().to_array(),
            });
        }
        Ok((Self::Tetrahedra(bound), cells))
    }

    /// Binds each vertex to the cell of a cut solid whose material contains it or is nearest.
    pub fn to_solid(vertices: &[Vec3], positions: &[Vec3], solid: &CutSolid) -> Result<(Self, Vec<u32>)> {
        let count = solid.vertices().len() as u32;
        let places: Vec<Vec3> = memory::collected((0..count).map(|vertex| solid.place(vertex, positions)))?;
        let pieces: Vec<[u32; 4]> =
            memory::collected(solid.tetrahedra().iter().map(|tetrahedron| tetrahedron.corners))?;
        let (_, mut cells) = Self::to_tetrahedra(vertices, &places, &pieces)?;
        let bound = memory::collected(vertices.iter().zip(&mut cells).map(|(vertex, cell)| {
            *cell = solid.tetrahedra()[*cell as usize].cell;
            let nodes = solid.cells()[*cell as usize].nodes;
            let placed = PlacedTetrahedron::of(nodes.map(|node| positions[node as usize].as_dvec3()));
            InTetrahedron {
                nodes,
                weights: placed.weights(vertex.as_dvec3()).as_vec3().to_array(),
            }
        }))?;
        Ok((Self::Tetrahedra(bound), cells))
    }

    /// Binds each vertex to the cell of a cuttable surface whose material is nearest. Returns these cells too.
    pub fn to_surface(vertices: &[Vec3], positions: &[Vec3], surface: &CutSurface) -> Result<(Self, Vec<u32>)> {
        let count = surface.vertices().len() as u32;
        let places: Vec<Vec3> = memory::collected((0..count).map(|vertex| surface.place(vertex, positions)))?;
        let pieces: Vec<[u32; 3]> = memory::collected(surface.triangles().iter().map(|triangle| triangle.corners))?;
        let mut cells = nearest_triangles(vertices, &places, &pieces)?;
        let bound = memory::collected(vertices.iter().zip(&mut cells).map(|(vertex, cell)| {
            *cell = surface.triangles()[*cell as usize].cell;
            let nodes = surface.cells()[*cell as usize].nodes;
            bind_to_triangle(vertex.as_dvec3(), nodes, nodes.map(|node| positions[node as usize]))
        }))?;
        Ok((Self::Triangles(bound), cells))
    }

    /// Binds each vertex to the nearest triangle.
    pub fn to_triangles(vertices: &[Vec3], positions: &[Vec3], triangles: &[[u32; 3]]) -> Result<Self> {
        ensure!(
            !triangles.is_empty(),
            "tetrahedra are 0, and nothing is drawn of the body: there is nothing to bind to"
        );
        let cells = nearest_triangles(vertices, positions, triangles)?;
        let bound = memory::collected(vertices.iter().zip(cells).map(|(vertex, triangle)| {
            let nodes = triangles[triangle as usize];
            bind_to_triangle(vertex.as_dvec3(), nodes, nodes.map(|node| positions[node as usize]))
        }))?;
        Ok(Self::Triangles(bound))
    }
}

/// The triangle nearest to each vertex, the first among equals.
fn nearest_triangles(vertices: &[Vec3], positions: &[Vec3], triangles: &[[u32; 3]]) -> Result<Vec<u32>> {
    let corners = |triangle: u32| triangles[triangle as usize].map(|node| positions[node as usize]);
    let tree = Bvh::new(triangles.len(), corners)?;
    let mut nearest = memory::reserved(vertices.len())?;
    for &vertex in vertices {
        let point = vertex.as_dvec3();
        let mut best = (f64::INFINITY, 0);
        tree.near(&Aabb::of(std::iter::once(vertex)), f32::INFINITY, |index| {
            let number = tree.triangle(index);
            let exact = tree.placed(index).exact();
            let distance = point.distance_squared(weighted(exact, nearest_on_triangle(point, exact).0));
            if distance < best.0 || distance == best.0 && number < best.1 {
                best = (distance, number);
            }
            best.0 as f32
        });
        nearest.push(best.1);
    }
    Ok(nearest)
}

/// Binds a vertex to a triangle: its projection onto the plane, which can lie outside the triangle, and its height. A
/// triangle without area binds it to the nearest point, without height.
fn bind_to_triangle(point: DVec3, nodes: [u32; 3], corners: [Vec3; 3]) -> OverTriangle {
    let [a, b, c] = corners.map(|corner| corner.as_dvec3());
    let normal = (b - a).cross(c - a).normalize_or_zero();
    let inverse = DMat3::from_cols(b - a, c - a, normal).inverse();
    if normal == DVec3::ZERO || !inverse.is_finite() {
        let (nearest, _) = nearest_on_triangle(point, [a, b, c]);
        return OverTriangle {
            nodes,
            weights: [nearest[1] as f32, nearest[2] as f32],
            offset: 0.0,
        };
    }
    let [along_b, along_c, offset] = (inverse * (point - a)).as_vec3().to_array();
    OverTriangle {
        nodes,
        weights: [along_b, along_c],
        offset,
    }
}

/// A tetrahedron with the positions of its corners.
pub(super) struct PlacedTetrahedron {
    corners: [DVec3; 4],
    /// Maps the vector from the first corner to the weights of the other three.
    inverse: DMat3,
}

impl PlacedTetrahedron {
    pub fn of(corners: [DVec3; 4]) -> Self {
        let [a, b, c, d] = corners;
        Self {
            corners,
            inverse: DMat3::from_cols(b - a, c - a, d - a).inverse(),
        }
    }

    fn has_volume(&self) -> bool {
        self.inverse.is_finite()
    }

    fn weights(&self, point: DVec3) -> DVec3 {
        self.inverse * (point - self.corners[0])
    }

    /// The least barycentric weight; below 0 outside.
    pub fn depth(&self, point: DVec3) -> f64 {
        let weights = self.weights(point);
        weights.min_element().min(1.0 - weights.element_sum())
    }

    pub fn distance_squared(&self, point: DVec3) -> f64 {
        let faces = FACES.iter().map(|face| {
            let corners = face.map(|corner| self.corners[corner]);
            point.distance_squared(weighted(corners, nearest_on_triangle(point, corners).0))
        });
        faces.fold(f64::INFINITY, f64::min)
    }
}
