//! What of the bodies of a world a ray meets, or is nearest to a point: for a hand that is to grasp it.

use glam::{DVec3, Vec3};

use crate::body::{Body, Bounds, finite_vector};
use crate::contact::nearest::nearest_on_triangle;
use crate::contact::predicates::pierce;
use crate::error::{Error, Result};
use crate::world::{BodyId, World};

/// A point of a body's surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceHit {
    /// The body it belongs to.
    pub body: BodyId,
    /// The triangle, by its place in [`Body::surface`](crate::Body::surface).
    pub triangle: u32,
    /// Of the triangle's corners, 1 in sum, none below 0.
    pub weights: [f32; 3],
    /// Where it is, m.
    pub position: Vec3,
    /// The triangle's, outward, of unit length; 0 where it has no area.
    pub normal: Vec3,
    /// From where it was asked for, m.
    pub distance: f32,
}

impl World {
    /// The first point that a ray from `origin` (m) along `direction` (of any length) meets on the surface of a body within
    /// `max_distance` (m, may be infinite), at the nodes' current places; `None` where there is none. Fronts and backs of triangles count;
    /// what lies along a triangle does not meet it.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: a number is not finite, the direction is zero, or `max_distance` is negative or not a number.
    pub fn cast_ray(&self, origin: Vec3, direction: Vec3, max_distance: f32) -> Result<Option<SurfaceHit>> {
        finite_vector("origin", origin)?;
        finite_vector("direction", direction)?;
        check_distance(max_distance)?;
        let way = direction.as_dvec3().normalize_or_zero();
        if way == DVec3::ZERO {
            return Err(Error::invalid("direction is 0: it points nowhere"));
        }
        let start = origin.as_dvec3();
        let mut found: Option<SurfaceHit> = None;
        for (id, body) in self.bodies_by_id() {
            let bounds = body.published_bounds();
            let furthest = start
                .abs()
                .max(bounds.min.as_dvec3().abs().max(bounds.max.as_dvec3().abs()));
            // Past all of the body: what is as far as is asked for is met too.
            let length = 4.0 * furthest.length() + 1.0;
            let limit = f64::from(found.map_or(max_distance, |found| found.distance));
            if !meets(&bounds, start, way * length.min(limit)) {
                continue;
            }
            for (triangle, &nodes) in (0..).zip(body.surface()) {
                let corners = nodes.map(|node| body.positions()[node as usize].as_dvec3());
                if let Some((fraction, _)) = pierce(start, start + way * length, corners, nodes) {
                    let distance = fraction * length;
                    let is_within = distance as f32 <= max_distance;
                    if is_within && found.is_none_or(|found| distance < f64::from(found.distance)) {
                        let (weights, _) = nearest_on_triangle(start + way * distance, corners);
                        found = Some(SurfaceHit::new(id, triangle, corners, weights, distance));
                    }
                }
            }
        }
        Ok(found)
    }

    /// The point of the bodies' surfaces that is nearest to `point` (m), at the nodes' current places, no further than `max_distance` (m, may
    /// be infinite); `None` where there is none.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: a coordinate is not finite, or `max_distance` is negative or not a number.
    pub fn nearest_point(&self, point: Vec3, max_distance: f32) -> Result<Option<SurfaceHit>> {
        finite_vector("point", point)?;
        check_distance(max_distance)?;
        let place = point.as_dvec3();
        let mut limit = f64::from(max_distance);
        let mut found = None;
        for (id, body) in self.bodies_by_id() {
            let bounds = body.published_bounds();
            let (low, high) = (bounds.min.as_dvec3(), bounds.max.as_dvec3());
            if (low - place).max(place - high).max(DVec3::ZERO).length() > limit {
                continue;
            }
            for (triangle, nodes) in (0..).zip(body.surface()) {
                let corners = nodes.map(|node| body.positions()[node as usize].as_dvec3());
                let (weights, _) = nearest_on_triangle(place, corners);
                let distance = place.distance(mixed(corners, weights));
                if distance < limit || distance == limit && found.is_none() {
                    limit = distance;
                    found = Some(SurfaceHit::new(id, triangle, corners, weights, distance));
                }
            }
        }
        Ok(found)
    }
}

impl SurfaceHit {
    fn new(body: BodyId, triangle: u32, corners: [DVec3; 3], weights: [f64; 3], distance: f64) -> Self {
        let [a, b, c] = corners;
        Self {
            body,
            triangle,
            weights: weights.map(|weight| weight as f32),
            position: mixed(corners, weights).as_vec3(),
            normal: (b - a).cross(c - a).normalize_or_zero().as_vec3(),
            distance: distance as f32,
        }
    }
}

impl Body {
    /// The box about its nodes as they are published, and a little more.
    fn published_bounds(&self) -> Bounds {
        let bounds = self.local_bounds();
        let [min, max] = [bounds.min, bounds.max].map(|corner| (corner.as_dvec3() + self.origin()).as_vec3());
        // By what rounding takes.
        let rounding = 1e-6 * min.abs().max(max.abs()).max_element();
        Bounds { min, max }.extended(rounding)
    }
}

fn mixed(corners: [DVec3; 3], weights: [f64; 3]) -> DVec3 {
    corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2]
}

fn check_distance(max_distance: f32) -> Result<()> {
    if max_distance >= 0.0 {
        return Ok(());
    }
    Err(Error::invalid(format!(
        "max_distance is {max_distance} m: must be at least 0"
    )))
}

/// Whether a way from `start` on passes through a box.
fn meets(bounds: &Bounds, start: DVec3, way: DVec3) -> bool {
    let (mut enters, mut leaves) = (0.0_f64, 1.0_f64);
    for axis in 0..3 {
        let sides = [bounds.min, bounds.max].map(|corner| f64::from(corner[axis]) - start[axis]);
        if way[axis] == 0.0 {
            if sides[0] > 0.0 || sides[1] < 0.0 {
                return false;
            }
            continue;
        }
        let [a, b] = sides.map(|side| side / way[axis]);
        enters = enters.max(a.min(b));
        leaves = leaves.min(a.max(b));
    }
    enters <= leaves
}
