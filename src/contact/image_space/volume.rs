//! Overlap volume of two bodies and its gradient (Faure, Barbier, Allard, Falipou 2008, "Image-based collision
//! detection and response between arbitrary volume objects").

use glam::{DVec2, DVec3};

use super::intervals::{Interval, Intervals};
use super::layers::Layers;
use super::projection::Projection;
use super::surface::Placed;

/// Adds the gradient of the overlap volume in a view for both bodies. Returns the volume, m³.
///
/// The volume is the area of a pixel times the sum of the intervals' common lengths. Moving a node along the view
/// changes it by the area times the node's weights in the faces that bound those intervals.
pub(super) fn add_volume(
    projection: &Projection,
    layers: &[Layers; 2],
    bodies: &[Placed; 2],
    gradients: &mut [Vec<DVec3>; 2],
) -> f64 {
    let area = projection.pixel * projection.pixel;
    let mut length = 0.0;
    let mut triangles = [
        ProjectedTriangle::new(projection, &bodies[0]),
        ProjectedTriangle::new(projection, &bodies[1]),
    ];
    for pixel in 0..projection.pixel_count() {
        let intervals = |side: usize| Intervals::new(layers[side].at(pixel), bodies[side].thickness.into());
        let (mut first, mut second) = (intervals(0), intervals(1));
        let mut current = [first.next(), second.next()];
        while let [Some(a), Some(b)] = current {
            let entry = usize::from(b.entry > a.entry);
            let exit = usize::from(b.exit < a.exit);
            let ends: [&Interval; 2] = [&a, &b];
            let overlap = ends[exit].exit - ends[entry].entry;
            if overlap > 0.0 {
                length += overlap;
                for (side, triangle, change) in [
                    (entry, ends[entry].triangles[0], -area),
                    (exit, ends[exit].triangles[1], area),
                ] {
                    triangles[side].add(projection, pixel, triangle, change, &mut gradients[side]);
                }
            }
            if exit == 0 {
                current[0] = first.next();
            } else {
                current[1] = second.next();
            }
        }
    }
    length * area
}

/// The last triangle of a body that a gradient was added to, projected to the image. The next pixel usually has the
/// same triangle.
struct ProjectedTriangle<'a> {
    body: &'a Placed<'a>,
    triangle: u32,
    corners: [DVec2; 3],
}

impl<'a> ProjectedTriangle<'a> {
    fn new(projection: &Projection, body: &'a Placed<'a>) -> Self {
        let mut projected = Self {
            body,
            triangle: 0,
            corners: [DVec2::ZERO; 3],
        };
        projected.project(projection, 0);
        projected
    }

    fn project(&mut self, projection: &Projection, triangle: u32) {
        self.triangle = triangle;
        self.corners = self.body.surface.triangles()[triangle as usize].map(|node| {
            let vertex = projection.project(self.body.positions[node as usize]);
            DVec2::new(vertex.x, vertex.y)
        });
    }

    /// Distributes the change of volume from moving a triangle's point at a pixel's center along the view among its
    /// nodes.
    fn add(&mut self, projection: &Projection, pixel: usize, triangle: u32, change: f64, gradient: &mut [DVec3]) {
        if triangle != self.triangle {
            self.project(projection, triangle);
        }
        let [a, b, c] = self.corners;
        let center = projection.center_of(pixel);
        let area = (b - a).perp_dot(c - a);
        // A triangle seen edge-on has no projected area; its nodes get equal weights.
        let weight = |from: DVec2, to: DVec2| match (to - from).perp_dot(center - from) / area {
            weight if weight.is_finite() => weight.clamp(0.0, 1.0),
            _ => 1.0 / 3.0,
        };
        let weights = [weight(b, c), weight(c, a), weight(a, b)];
        let nodes = self.body.surface.triangles()[triangle as usize];
        for (node, weight) in nodes.into_iter().zip(weights) {
            gradient[node as usize] += projection.frame.forward * (change * weight);
        }
    }
}
