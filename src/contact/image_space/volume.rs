//! The volume that two bodies have in common and its gradient (Faure, Barbier, Allard, Falipou 2008, "Image-based
//! collision detection and response between arbitrary volume objects").

use glam::{DVec2, DVec3};

use super::intervals::{Interval, Intervals};
use super::layers::Layers;
use super::projection::Projection;
use super::surface::Placed;

/// Adds `share` of the volume seen in a view to the gradients of both bodies; answers the volume, m³.
///
/// The volume is the sum of what the intervals of each pixel have in common times the area of the pixel, so that moving a
/// node along the view changes it by the area times the node's weights in the faces that bound those intervals.
pub(super) fn add_volume(
    projection: &Projection,
    layers: &[Layers; 2],
    bodies: &[Placed; 2],
    gradients: &mut [Vec<DVec3>; 2],
) -> f64 {
    let area = projection.pixel * projection.pixel;
    let mut length = 0.0;
    let mut seen = [Seen::new(projection, &bodies[0]), Seen::new(projection, &bodies[1])];
    for pixel in 0..projection.pixel_count() {
        let pieces = |side: usize| Intervals::new(layers[side].at(pixel), bodies[side].thickness.into());
        let (mut first, mut second) = (pieces(0), pieces(1));
        let mut current = [first.next(), second.next()];
        while let [Some(a), Some(b)] = current {
            let entry = usize::from(b.entry > a.entry);
            let exit = usize::from(b.exit < a.exit);
            let ends: [&Interval; 2] = [&a, &b];
            let common = ends[exit].exit - ends[entry].entry;
            if common > 0.0 {
                length += common;
                for (side, triangle, change) in [
                    (entry, ends[entry].triangles[0], -area),
                    (exit, ends[exit].triangles[1], area),
                ] {
                    seen[side].add(projection, pixel, triangle, change, &mut gradients[side]);
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

/// The triangle of a body that a gradient was added to last, as it is seen: the next pixel mostly shows the same.
struct Seen<'a> {
    body: &'a Placed<'a>,
    triangle: u32,
    corners: [DVec2; 3],
}

impl<'a> Seen<'a> {
    fn new(projection: &Projection, body: &'a Placed<'a>) -> Self {
        let mut seen = Self {
            body,
            triangle: 0,
            corners: [DVec2::ZERO; 3],
        };
        seen.look_at(projection, 0);
        seen
    }

    fn look_at(&mut self, projection: &Projection, triangle: u32) {
        self.triangle = triangle;
        self.corners = self.body.surface.triangles()[triangle as usize].map(|node| {
            let vertex = projection.project(self.body.positions[node as usize]);
            DVec2::new(vertex.x, vertex.y)
        });
    }

    /// What moving the point of a triangle in the middle of a pixel along the view changes, shared among its nodes.
    fn add(&mut self, projection: &Projection, pixel: usize, triangle: u32, change: f64, gradient: &mut [DVec3]) {
        if triangle != self.triangle {
            self.look_at(projection, triangle);
        }
        let [a, b, c] = self.corners;
        let middle = projection.middle_of(pixel);
        let area = (b - a).perp_dot(c - a);
        // A triangle seen edge on has no area here; then its nodes share alike.
        let weight = |from: DVec2, to: DVec2| match (to - from).perp_dot(middle - from) / area {
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
