//! Nodes, edges and faces against a layered image: walked pixel by pixel for their deepest point.

use glam::Vec3;

use super::layered_image::LayeredImage;
use crate::contact::closest::Closest;

/// A point is no closer to the solid than what is seen of it says, times this.
const CAUTION: f32 = 0.7;

/// What a search must gain to go on, in pixels: less is rounding, and stays where it is.
const GAIN: f32 = 1e-3;

/// Halvings of a pixel in which a search ends.
const HALVINGS: u32 = 6;

/// Parts of a face whose corners are no further than this from their middle, in pixels, are not cut again: about a pixel each.
const FINEST: f32 = 1.5;

/// Room for the parts of a face that a search has still to see: three for each time that it is halved.
const PARTS: usize = 64;

/// A feature is looked at so often at most.
const LOOKS: u32 = 1 << 14;

/// What is seen at a point of a feature.
#[derive(Clone, Copy)]
struct Sample {
    weights: [f32; 3],
    distance: f32,
    normal: Vec3,
}

impl LayeredImage {
    /// The deepest point of a node, edge or face; `None` where it is outside and further away than `within`.
    pub(in crate::contact) fn closest(&self, corners: &[Vec3], within: f32) -> Option<Closest> {
        let best = match corners {
            [node] => {
                let (distance, normal) = self.distance(*node, within)?;
                Sample {
                    weights: [1.0, 0.0, 0.0],
                    distance,
                    normal,
                }
            }
            [a, b] => self.deepest_of_edge(*a, *b, within)?,
            [a, b, c] => self.deepest_of_face([*a, *b, *c], within)?,
            _ => return None,
        };
        let inside = best.weights[..corners.len()].iter().all(|&weight| weight > 0.0);
        (best.distance <= within).then_some(Closest {
            weights: best.weights,
            distance: best.distance,
            normal: best.normal,
            inside,
        })
    }

    /// Goes along an edge in steps of a pixel, longer ones where it is far away.
    fn deepest_of_edge(&self, a: Vec3, b: Vec3, within: f32) -> Option<Sample> {
        let along = b - a;
        let length = along.length();
        let [start, end] = self.clipped(a, along, within)?;
        let mut best: Option<Sample> = None;
        let mut share = start;
        let shortest = self.pixel().max((end - start) * length / LOOKS as f32);
        loop {
            let sample = self.sample([a, b, b], [1.0 - share, share, 0.0])?;
            if best.is_none_or(|best| sample.distance < best.distance - GAIN * self.pixel()) {
                best = Some(sample);
            }
            if !(share < end) {
                break;
            }
            let known = best.map_or(within, |best| best.distance.min(within));
            let step = shortest.max((sample.distance - known) * CAUTION);
            share = (share + step / length).min(end);
        }
        let best = best.filter(|best| best.distance <= within + self.pixel())?;
        Some(self.refined([a, b, b], best, |best| {
            let slope = best.normal.dot(along);
            [slope, -slope, 0.0].map(|change| change / (slope.abs() * length))
        }))
    }

    /// Halves a face, and what could hold a deeper point again, down to a pixel.
    fn deepest_of_face(&self, corners: [Vec3; 3], within: f32) -> Option<Sample> {
        let whole = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let mut parts = [whole; PARTS];
        let mut count = 1;
        let mut best: Option<Sample> = None;
        let mut looks = 0;
        while count > 0 && looks < LOOKS {
            count -= 1;
            looks += 1;
            let part = parts[count];
            let middle = [0, 1, 2].map(|i| (part[0][i] + part[1][i] + part[2][i]) / 3.0);
            let sample = self.sample(corners, middle)?;
            let centre = mixed(corners, middle);
            let reach = part.map(|weights| mixed(corners, weights).distance(centre));
            let reach = reach[0].max(reach[1]).max(reach[2]);
            let known = best.map_or(within, |best| best.distance.min(within));
            if (sample.distance - known) * CAUTION >= reach {
                continue;
            }
            if looks == 1 {
                // The border is the edges' and nodes' concern: what lies within must be deeper.
                for weights in whole {
                    let corner = self.sample(corners, weights)?;
                    if best.is_none_or(|best| corner.distance < best.distance) {
                        best = Some(corner);
                    }
                }
            }
            if best.is_none_or(|best| sample.distance < best.distance - GAIN * self.pixel()) {
                best = Some(sample);
            }
            if reach <= FINEST * self.pixel() || count + 4 > PARTS {
                continue;
            }
            let [ab, bc, ca] = [(0, 1), (1, 2), (2, 0)].map(|(from, to)| halfway(part[from], part[to]));
            for smaller in [[part[0], ab, ca], [ab, part[1], bc], [ca, bc, part[2]], [ab, bc, ca]] {
                parts[count] = smaller;
                count += 1;
            }
        }
        let best = best.filter(|best| best.distance <= within + self.pixel())?;
        let [a, b, c] = corners;
        let across = (b - a).cross(c - a);
        // Barycentric weights grow along these, perpendicular to the opposite sides.
        let gradients = [across.cross(c - b), across.cross(a - c), across.cross(b - a)];
        let scale = across.length_squared();
        Some(self.refined(corners, best, |best| {
            let plane = across / scale.sqrt();
            let downhill = (plane * best.normal.dot(plane) - best.normal).normalize_or_zero();
            gradients.map(|gradient| gradient.dot(downhill) / scale)
        }))
    }

    /// Follows the slope from the best sample in steps that grow shorter, from a pixel on. `downhill` gives what a metre
    /// down the slope changes of the weights.
    fn refined(&self, corners: [Vec3; 3], mut best: Sample, downhill: impl Fn(&Sample) -> [f32; 3]) -> Sample {
        let mut step = self.pixel();
        for _ in 0..HALVINGS {
            let change = downhill(&best);
            if change.iter().all(|change| change.is_finite()) {
                let moved = [0, 1, 2].map(|i| (best.weights[i] + step * change[i]).max(0.0));
                let sum = moved[0] + moved[1] + moved[2];
                let sample = self.sample(corners, moved.map(|weight| weight / sum));
                if let Some(sample) = sample.filter(|sample| sample.distance < best.distance - GAIN * self.pixel()) {
                    best = sample;
                    continue;
                }
            }
            step /= 2.0;
        }
        best
    }

    fn sample(&self, corners: [Vec3; 3], weights: [f32; 3]) -> Option<Sample> {
        let (distance, normal) = self.signed_distance(mixed(corners, weights))?;
        Some(Sample {
            weights,
            distance,
            normal,
        })
    }

    /// The shares of an edge between which it is within reach of the box around the solid.
    fn clipped(&self, start: Vec3, along: Vec3, within: f32) -> Option<[f32; 2]> {
        let [low, high] = self.bounds();
        let (mut from, mut to) = (0.0_f32, 1.0_f32);
        for axis in 0..3 {
            let (low, high) = (low[axis] - within - start[axis], high[axis] + within - start[axis]);
            if along[axis] == 0.0 {
                if !(low <= 0.0 && high >= 0.0) {
                    return None;
                }
            } else {
                let (a, b) = (low / along[axis], high / along[axis]);
                from = from.max(a.min(b));
                to = to.min(a.max(b));
            }
        }
        (from <= to).then_some([from, to])
    }
}

fn mixed(corners: [Vec3; 3], weights: [f32; 3]) -> Vec3 {
    corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2]
}

fn halfway(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [0, 1, 2].map(|i| (a[i] + b[i]) / 2.0)
}
