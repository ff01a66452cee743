//! A closed mesh in `f64`, evaluated triangle by triangle.

#![allow(dead_code, reason = "each test uses some of these helpers")]

use std::f64::consts::PI;
use std::path::Path;

use glam::{BVec3, DVec3, Vec3};
use sinew::Pose;
use sinew::mesh::{Mesh, MeshFormat};

use super::tissue::point_to_triangle;

/// A closed mesh at a pose.
pub struct Solid {
    triangles: Vec<[DVec3; 3]>,
}

impl Solid {
    pub fn new(mesh: &Mesh, pose: Pose) -> Self {
        let (position, orientation) = (pose.position.as_dvec3(), pose.orientation.as_dquat());
        let corner = |node: u32| position + orientation * mesh.positions[node as usize].as_dvec3();
        Self {
            triangles: mesh.triangles.iter().map(|triangle| triangle.map(corner)).collect(),
        }
    }

    /// Returns the winding number of the surface about a point: 1 inside, 0 outside. It sums the solid angles of the
    /// triangles (van Oosterom, Strackee 1983).
    pub fn winding(&self, point: DVec3) -> f64 {
        let angle = |triangle: &[DVec3; 3]| {
            let [a, b, c] = triangle.map(|corner| corner - point);
            let (la, lb, lc) = (a.length(), b.length(), c.length());
            let denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
            2.0 * a.dot(b.cross(c)).atan2(denominator)
        };
        self.triangles.iter().map(angle).sum::<f64>() / (4.0 * PI)
    }

    /// Returns the distance of a point from the surface (m).
    pub fn distance(&self, point: DVec3) -> f64 {
        let distances = self
            .triangles
            .iter()
            .map(|&triangle| point_to_triangle(point, triangle));
        distances.fold(f64::INFINITY, f64::min)
    }

    /// Returns the distance of a point from the surface, negative inside (m).
    pub fn signed_distance(&self, point: DVec3) -> f64 {
        let distance = self.distance(point);
        if self.winding(point) > 0.5 { -distance } else { distance }
    }
}

/// Loads a real mesh and scales it by `scale`. If the file is missing, reports that on stderr and returns `None`.
pub fn real(name: &str, scale: f32) -> Option<Mesh> {
    let above = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors();
    let mut paths = above.map(|folder| folder.join("shared/meshes").join(name));
    let Some(path) = paths.find(|path| path.exists()) else {
        use std::io::Write;
        let _ = writeln!(std::io::stderr(), "SKIPPED: ../shared/meshes/{name} is missing");
        return None;
    };
    Some(sinew::mesh::load(path, MeshFormat::Auto, scale).expect("a mesh").mesh)
}

/// Returns a box between two corners.
pub fn cuboid(low: Vec3, high: Vec3) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let corner = |i: u32| Vec3::select(BVec3::new(i & 1 > 0, i & 2 > 0, i & 4 > 0), high, low);
    let sides = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let triangles = sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
    ((0..8).map(corner).collect(), triangles.collect())
}

/// Returns a ball of this radius: an icosahedron whose triangles are quartered `quartered` times.
pub fn ball(radius: f32, quartered: u32) -> Mesh {
    let golden = 0.5 * (1.0 + 5.0_f32.sqrt());
    let corners = [
        [-1.0, golden, 0.0],
        [1.0, golden, 0.0],
        [-1.0, -golden, 0.0],
        [1.0, -golden, 0.0],
        [0.0, -1.0, golden],
        [0.0, 1.0, golden],
        [0.0, -1.0, -golden],
        [0.0, 1.0, -golden],
        [golden, 0.0, -1.0],
        [golden, 0.0, 1.0],
        [-golden, 0.0, -1.0],
        [-golden, 0.0, 1.0],
    ];
    let positions: Vec<Vec3> = corners
        .map(|corner| Vec3::from_array(corner).normalize() * radius)
        .to_vec();
    let triangles = vec![
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    let (positions, triangles) = quarter((positions, triangles), radius, quartered);
    Mesh {
        positions,
        triangles,
        ..Default::default()
    }
}

/// Returns a ball of radius 1: an octahedron whose triangles are quartered `quartered` times.
pub fn octahedral_ball(quartered: u32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let corners = vec![Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z];
    let triangles = vec![
        [0, 1, 2],
        [1, 3, 2],
        [3, 4, 2],
        [4, 0, 2],
        [1, 0, 5],
        [3, 1, 5],
        [4, 3, 5],
        [0, 4, 5],
    ];
    quarter((corners, triangles), 1.0, quartered)
}

/// Divides each triangle in four, `times` times. New corners lie on a ball of this radius.
fn quarter(
    (mut positions, mut triangles): (Vec<Vec3>, Vec<[u32; 3]>),
    radius: f32,
    times: u32,
) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    for _ in 0..times {
        let mut midpoints = std::collections::HashMap::new();
        let mut midpoint = |a: u32, b: u32| {
            *midpoints.entry((a.min(b), a.max(b))).or_insert_with(|| {
                let sum = positions[a as usize] + positions[b as usize];
                positions.push(sum.normalize() * radius);
                positions.len() as u32 - 1
            })
        };
        let quarters = triangles.iter().flat_map(|&[a, b, c]| {
            let (ab, bc, ca) = (midpoint(a, b), midpoint(b, c), midpoint(c, a));
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        });
        triangles = quarters.collect();
    }
    (positions, triangles)
}
