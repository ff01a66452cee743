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

/// A part is cut down to so many pixels, unless it is known to be no deeper.
const FINEST: f32 = 1.5;

/// And to so many at least where it may be deeper between the looks.
const COARSEST: f32 = 4.0;

/// What a part must promise to be cut, in pixels.
const PROMISE: f32 = 0.25;

/// How far a surface is taken to fall from its slope, as a part of how much the slopes that are seen differ.
const BEND: f32 = 0.25;

/// A search follows the slope while it promises this, in pixels.
const FOLLOWED: f32 = 0.1;

/// Room for the parts that a search has still to see: three for each time that a face is halved.
const PARTS: usize = 64;

/// A feature is looked at so often at most.
const LOOKS: u32 = 1 << 14;

/// What is seen at a point of a feature.
#[derive(Clone, Copy)]
struct FeatureSample {
    weights: [f32; 3],
    distance: f32,
    normal: Vec3,
}

impl FeatureSample {
    /// This, or the other where it is clearly deeper.
    fn deeper(self, other: Self, pixel: f32) -> Self {
        if other.distance < self.distance - GAIN * pixel {
            other
        } else {
            self
        }
    }
}

/// A part of a face, seen in its middle.
#[derive(Clone, Copy)]
struct FacePart {
    corners: [[f32; 3]; 3],
    middle: FeatureSample,
    /// From its middle to the furthest corner, at most.
    reach: f32,
    /// How far the normals differ over what it is a part of.
    bend: f32,
}

impl LayeredImage {
    /// The deepest point of a node, edge or face; `None` where it is outside and further away than `within`.
    pub(in crate::contact) fn closest(&self, corners: &[Vec3], within: f32) -> Option<Closest> {
        let best = match corners {
            [node] => {
                let (distance, normal) = self.distance(*node, within)?;
                FeatureSample {
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

    /// Halves an edge, and what could hold a deeper point again, down to a pixel.
    fn deepest_of_edge(&self, a: Vec3, b: Vec3, within: f32) -> Option<FeatureSample> {
        let along = b - a;
        let length = along.length();
        let middle = 0.5 * (a + b);
        if self.is_beyond(middle, within + 0.5 * length) {
            return None;
        }
        let [start, end] = self.clipped(a, along, within)?;
        let look = |share: f32| self.sample([a, b, b], [1.0 - share, share, 0.0]);
        let centre = look(0.5 * (start + end))?;
        if (centre.distance - within) * CAUTION >= 0.5 * (end - start) * length {
            return None;
        }
        let ends = [look(start)?, look(end)?];
        let mut best = ends[0].deeper(ends[1], self.pixel()).deeper(centre, self.pixel());
        let mut parts = [ends; PARTS];
        let mut count = 0;
        let halves = |parts: &mut [[FeatureSample; 2]; PARTS],
                      count: &mut usize,
                      [from, to]: [FeatureSample; 2],
                      middle: FeatureSample| {
            // The deeper half is seen first.
            let deeper_first = from.distance < to.distance;
            let (last, first) = if deeper_first {
                ([middle, to], [from, middle])
            } else {
                ([from, middle], [middle, to])
            };
            parts[*count] = last;
            parts[*count + 1] = first;
            *count += 2;
        };
        halves(&mut parts, &mut count, ends, centre);
        let mut looks = 3;
        while count > 0 && looks < LOOKS {
            count -= 1;
            let [from, to] = parts[count];
            let stretch = (to.weights[1] - from.weights[1]) * length;
            if stretch <= self.pixel() || count + 2 > PARTS {
                continue;
            }
            let known = best.distance.min(within) - PROMISE * self.pixel();
            // It is no deeper than the way there, nor, but for how much it bends, than the slopes at its ends lead.
            let reached = 0.5 * (from.distance + to.distance - stretch / CAUTION);
            let [ahead, back] = [from.normal.dot(along) / length, -to.normal.dot(along) / length];
            let bend = ahead + back;
            let low = from.distance.min(to.distance);
            let led = if ahead < 0.0 && back < 0.0 {
                // Where both slopes meet.
                let way = ((to.distance - from.distance - back * stretch) / bend).clamp(0.0, stretch);
                from.distance + ahead * way
            } else {
                low - 0.5 * BEND * bend.abs() * stretch
            };
            let fine = stretch <= COARSEST * self.pixel();
            if reached >= known || fine && led.min(low) >= known {
                continue;
            }
            looks += 1;
            let middle = look(0.5 * (from.weights[1] + to.weights[1]))?;
            best = best.deeper(middle, self.pixel());
            halves(&mut parts, &mut count, [from, to], middle);
        }
        if best.distance > within + self.pixel() {
            return None;
        }
        Some(self.refined([a, b, b], best, |best| {
            let slope = best.normal.dot(along);
            [slope, -slope, 0.0].map(|change| change / (slope.abs() * length))
        }))
    }

    /// Halves a face, and what could hold a deeper point again, down to a pixel.
    fn deepest_of_face(&self, corners: [Vec3; 3], within: f32) -> Option<FeatureSample> {
        let third = [1.0 / 3.0; 3];
        let centre = mixed(corners, third);
        let radius = corners.map(|corner| corner.distance(centre));
        let radius = radius[0].max(radius[1]).max(radius[2]);
        if self.is_beyond(centre, within + radius) {
            return None;
        }
        let middle = self.sample(corners, third)?;
        if (middle.distance - within) * CAUTION >= radius {
            return None;
        }
        // The border is the edges' and nodes' concern: what lies within must be deeper.
        let whole = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let mut best = middle;
        for (weights, corner) in whole.into_iter().zip(corners) {
            if !self.is_beyond(corner, best.distance.min(within)) {
                let corner = self.sample(corners, weights)?;
                best = if corner.distance <= best.distance { corner } else { best };
            }
        }
        let part = FacePart {
            corners: whole,
            middle,
            reach: radius,
            bend: f32::INFINITY,
        };
        let mut parts = [part; PARTS];
        let mut count = 1;
        let mut looks = 0;
        while count > 0 && looks < LOOKS {
            count -= 1;
            looks += 1;
            let part = parts[count];
            if part.reach <= FINEST * self.pixel() || count + 4 > PARTS {
                continue;
            }
            let known = best.distance.min(within) - PROMISE * self.pixel();
            if part.middle.distance - part.reach / CAUTION >= known {
                continue;
            }
            let here = mixed(corners, part.middle.weights);
            let falls = part
                .corners
                .map(|weights| part.middle.normal.dot(mixed(corners, weights) - here));
            let fall = falls[0].min(falls[1]).min(falls[2]);
            let fine = part.reach <= COARSEST * self.pixel();
            if fine && part.middle.distance + fall - BEND * part.bend * part.reach >= known {
                continue;
            }
            let [ab, bc, ca] = [(0, 1), (1, 2), (2, 0)].map(|(i, j)| halfway(part.corners[i], part.corners[j]));
            let [a, b, c] = part.corners;
            let mut bend = 0.0_f32;
            let first = count;
            for smaller in [[a, ab, ca], [ab, b, bc], [ca, bc, c]] {
                let weights = [0, 1, 2].map(|i| (smaller[0][i] + smaller[1][i] + smaller[2][i]) / 3.0);
                if self.is_beyond(mixed(corners, weights), known + 0.5 * part.reach) {
                    continue;
                }
                let middle = self.sample(corners, weights)?;
                best = best.deeper(middle, self.pixel());
                bend = bend.max(middle.normal.distance(part.middle.normal));
                parts[count] = FacePart {
                    corners: smaller,
                    middle,
                    ..part
                };
                count += 1;
            }
            parts[count] = FacePart {
                corners: [ab, bc, ca],
                ..part
            };
            count += 1;
            for smaller in &mut parts[first..count] {
                smaller.reach = 0.5 * part.reach;
                smaller.bend = bend;
            }
        }
        if best.distance > within + self.pixel() {
            return None;
        }
        if best.weights.contains(&1.0) {
            return Some(best);
        }
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
    fn refined(
        &self,
        corners: [Vec3; 3],
        mut best: FeatureSample,
        downhill: impl Fn(&FeatureSample) -> [f32; 3],
    ) -> FeatureSample {
        let mut step = self.pixel();
        for _ in 0..HALVINGS {
            let change = downhill(&best);
            let way = corners[0] * change[0] + corners[1] * change[1] + corners[2] * change[2];
            if !(best.normal.dot(way).abs() * step > FOLLOWED * self.pixel()) {
                break;
            }
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

    fn sample(&self, corners: [Vec3; 3], weights: [f32; 3]) -> Option<FeatureSample> {
        let (distance, normal) = self.signed_distance(mixed(corners, weights))?;
        Some(FeatureSample {
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
