//! Reference distances to a closed surface in `f64`, by testing triangles.

use glam::{DVec3, Vec3};

/// The triangles of a closed surface, and their bounding spheres, which cull most of them.
pub struct Truth {
    corners: Vec<[DVec3; 3]>,
    centers: Vec<DVec3>,
    radii: Vec<f64>,
}

/// An arbitrary ray direction that no edge of a mesh follows.
const RAY: DVec3 = DVec3::new(0.358_204_13, 0.527_861_94, 0.770_113_57);

impl Truth {
    pub fn new(positions: &[Vec3], triangles: &[[u32; 3]]) -> Self {
        let corners: Vec<[DVec3; 3]> = triangles
            .iter()
            .map(|triangle| triangle.map(|node| positions[node as usize].as_dvec3()))
            .collect();
        let centers: Vec<DVec3> = corners.iter().map(|[a, b, c]| (a + b + c) / 3.0).collect();
        let radii = corners.iter().zip(&centers).map(|(corners, center)| {
            let reach = corners.map(|corner| corner.distance_squared(*center));
            reach[0].max(reach[1]).max(reach[2]).sqrt() * (1.0 + 1e-9)
        });
        Self {
            radii: radii.collect(),
            corners,
            centers,
        }
    }

    /// Signed distance [m], negative inside.
    pub fn signed_distance(&self, point: DVec3) -> f64 {
        let distance = self.distance(point);
        if self.is_inside(point) { -distance } else { distance }
    }

    fn distance(&self, point: DVec3) -> f64 {
        // The nearest sphere center is close to the nearest triangle; starting there culls almost all others.
        let squared = self.centers.iter().map(|center| center.distance_squared(point));
        let nearest = squared
            .enumerate()
            .fold((0, f64::INFINITY), |nearest, (index, squared)| {
                if squared < nearest.1 { (index, squared) } else { nearest }
            });
        let mut least = to_triangle(point, self.corners[nearest.0]);
        for (index, center) in self.centers.iter().enumerate() {
            let reach = least + self.radii[index];
            if center.distance_squared(point) < reach * reach {
                least = least.min(to_triangle(point, self.corners[index]));
            }
        }
        least
    }

    /// Counts the crossings of a ray.
    pub fn is_inside(&self, point: DVec3) -> bool {
        let direction = RAY.normalize();
        let mut winding = 0;
        for (index, center) in self.centers.iter().enumerate() {
            let offset = center - point;
            let along = offset.dot(direction);
            let radius = self.radii[index];
            if along > -radius && offset.length_squared() - along * along < radius * radius {
                winding += crossing(point, direction, self.corners[index]);
            }
        }
        winding > 0
    }
}

/// 1 if the ray leaves through the triangle, -1 if it enters, 0 if it misses it.
fn crossing(from: DVec3, direction: DVec3, corners: [DVec3; 3]) -> i32 {
    let [a, b, c] = corners.map(|corner| corner - from);
    let sides = [(b, c), (c, a), (a, b)].map(|(p, q)| direction.dot(p.cross(q)));
    let outward = sides.iter().all(|side| *side >= 0.0);
    if !outward && !sides.iter().all(|side| *side < 0.0) {
        return 0;
    }
    let volume = a.dot(b.cross(c));
    if outward && volume > 0.0 {
        1
    } else if !outward && volume < 0.0 {
        -1
    } else {
        0
    }
}

fn to_triangle(point: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
    let sides = [(a, b), (b, c), (c, a)];
    let normal = (b - a).cross(c - a);
    let above = sides.iter().all(|(p, q)| (q - p).cross(point - p).dot(normal) >= 0.0);
    if above && normal != DVec3::ZERO {
        return (point - a).dot(normal).abs() / normal.length();
    }
    let to_side = |(p, q): (DVec3, DVec3)| {
        let offset = q - p;
        let share = ((point - p).dot(offset) / offset.length_squared()).clamp(0.0, 1.0);
        point.distance(p + offset * share)
    };
    sides.map(to_side).into_iter().fold(f64::INFINITY, f64::min)
}
