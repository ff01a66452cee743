//! The common volume of two closed surfaces, from the corners of their intersection alone.

use std::collections::HashMap;

use glam::{DVec3, Vec3};
use sinew::detection::image_space::Placed;

/// A surface with its edge topology.
struct Faces {
    corners: Vec<[DVec3; 3]>,
    /// Outward unit normals.
    normals: Vec<DVec3>,
    /// The ends of each edge, and its two adjacent triangles.
    edges: Vec<([DVec3; 2], [usize; 2])>,
}

/// Computes the common volume [m³] (Franklin 1987). It is the sum over each corner of the intersection, each edge there
/// and each face at that edge of a sixth of a product. The factors are the corner's coordinates along the edge, into
/// the face and along its normal. `inside` returns true for nodes of a surface that lie in the other.
pub fn common(bodies: &[Placed; 2], inside: [&dyn Fn(u32) -> bool; 2]) -> f64 {
    let faces = [0, 1].map(|side| Faces::new(bodies[side].positions, bodies[side].surface.triangles()));
    let mut six_volumes = 0.0;
    for side in 0..2 {
        let (own, other) = (&faces[side], &faces[1 - side]);
        for (triangle, nodes) in bodies[side].surface.triangles().iter().enumerate() {
            for corner in (0..3).filter(|&corner| inside[side](nodes[corner])) {
                six_volumes += own.at_node(triangle, corner);
            }
        }
        for (ends, joined) in &own.edges {
            for (pierced, corners) in other.corners.iter().enumerate() {
                if let Some(point) = intersection(*ends, *corners) {
                    six_volumes += own.at_crossing(point, *ends, *joined, other.normals[pierced]);
                }
            }
        }
    }
    six_volumes / 6.0
}

impl Faces {
    fn new(positions: &[Vec3], triangles: &[[u32; 3]]) -> Self {
        let position = |node: u32| positions[node as usize].as_dvec3();
        let corners: Vec<[DVec3; 3]> = triangles.iter().map(|nodes| nodes.map(position)).collect();
        let mut first = HashMap::new();
        let mut edges = Vec::new();
        for (triangle, nodes) in triangles.iter().enumerate() {
            for side in 0..3 {
                let (from, to) = (nodes[side], nodes[(side + 1) % 3]);
                match first.remove(&(to, from)) {
                    Some(other) => edges.push(([position(from), position(to)], [triangle, other])),
                    None => {
                        first.insert((from, to), triangle);
                    }
                }
            }
        }
        let normal = |[a, b, c]: &[DVec3; 3]| (b - a).cross(c - a).normalize();
        Self {
            normals: corners.iter().map(normal).collect(),
            corners,
            edges,
        }
    }

    /// The terms of a node inside the other surface, in one of its triangles.
    fn at_node(&self, triangle: usize, corner: usize) -> f64 {
        let corners = self.corners[triangle];
        let at = corners[corner];
        let [one, two] = [1, 2].map(|step| corners[(corner + step) % 3] - at);
        let normal = self.normals[triangle];
        term(at, one, two, normal) + term(at, two, one, normal)
    }

    /// The terms of the point where an edge of one surface crosses a triangle of the other with this normal; three
    /// faces and three edges meet there.
    fn at_crossing(&self, at: DVec3, [from, to]: [DVec3; 2], joined: [usize; 2], normal: DVec3) -> f64 {
        let edge = to - from;
        let inward = if edge.dot(normal) < 0.0 { edge } else { -edge };
        let faces = joined.map(|face| {
            let own = self.normals[face];
            let middle = self.corners[face].iter().sum::<DVec3>() / 3.0;
            let into = middle - from;
            let along_both = own.cross(normal);
            let across = into - edge * (into.dot(edge) / edge.length_squared());
            let line = if along_both.dot(across) > 0.0 {
                along_both
            } else {
                -along_both
            };
            term(at, inward, into, own) + term(at, line, -normal, own) + term(at, line, -own, normal)
        });
        faces[0] + faces[1]
    }
}

/// The term of a corner: along an edge, into a face at it, and out of the solid there.
fn term(at: DVec3, edge: DVec3, into: DVec3, normal: DVec3) -> f64 {
    let edge = edge.normalize();
    let flat = into - normal * into.dot(normal);
    let into = (flat - edge * flat.dot(edge)).normalize();
    at.dot(edge) * at.dot(into) * at.dot(normal)
}

/// The intersection point of a segment and a triangle.
fn intersection([from, to]: [DVec3; 2], [a, b, c]: [DVec3; 3]) -> Option<DVec3> {
    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
    if !(from.min(to).cmple(high).all() && from.max(to).cmpge(low).all()) {
        return None;
    }
    let normal = (b - a).cross(c - a);
    let heights = [from, to].map(|end| (end - a).dot(normal));
    if (heights[0] > 0.0) == (heights[1] > 0.0) {
        return None;
    }
    let point = from.lerp(to, heights[0] / (heights[0] - heights[1]));
    let within = |(p, q): (DVec3, DVec3)| (q - p).cross(point - p).dot(normal) >= 0.0;
    [(a, b), (b, c), (c, a)].into_iter().all(within).then_some(point)
}
