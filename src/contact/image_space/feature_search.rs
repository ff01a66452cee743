//! Search for the deepest point of a node, edge or face in a layered image, subdivided down to a pixel.

use glam::Vec3;

use super::layered_image::LayeredImage;
use crate::contact::closest::Closest;

/// Safety factor on distances from the images. A point is at least this fraction of the seen distance away.
const SAFETY: f32 = 0.7;

/// Least gain of a search step, in pixels. Smaller gains are rounding.
const MIN_GAIN: f32 = 1e-3;

/// Number of halvings of a pixel at which a search ends.
const HALVINGS: u32 = 6;

/// Size below which a part is not subdivided, in pixels.
const MIN_SIZE: f32 = 1.5;

/// Size above which a part is subdivided even if its slopes promise no gain, in pixels.
const MAX_UNSPLIT_SIZE: f32 = 4.0;

/// Least gain that a part must promise to be subdivided, in pixels.
const MIN_PROMISE: f32 = 0.25;

/// Allowance for curvature, as a fraction of the difference between the slopes.
const CURVATURE_ALLOWANCE: f32 = 0.25;

/// Least gain for which a search follows the slope, in pixels.
const MIN_SLOPE_GAIN: f32 = 0.1;

/// Capacity for pending parts: three for each halving of a face.
const MAX_PARTS: usize = 64;

/// Maximum number of samples of a feature.
const MAX_SAMPLES: u32 = 1 << 14;

/// Signed distance at a point of a feature.
#[derive(Clone, Copy)]
struct FeatureSample {
    weights: [f32; 3],
    distance: f32,
    normal: Vec3,
}

impl FeatureSample {
    /// Returns the other sample if it is clearly deeper, else this one.
    fn deeper(self, other: Self, pixel: f32) -> Self {
        if other.distance < self.distance - MIN_GAIN * pixel {
            other
        } else {
            self
        }
    }
}

/// A part of a face, sampled at its middle.
#[derive(Clone, Copy)]
struct FacePart {
    corners: [[f32; 3]; 3],
    middle: FeatureSample,
    /// Upper bound of the distance from its middle to a corner.
    radius: f32,
    /// Difference of the normals over its parent.
    normal_change: f32,
}

impl LayeredImage {
    /// Returns the deepest point of a node, edge or face; `None` if it is further outside than `within`.
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

    /// Subdivides an edge where a deeper point is possible, down to a pixel.
    fn deepest_of_edge(&self, a: Vec3, b: Vec3, within: f32) -> Option<FeatureSample> {
        let along = b - a;
        let length = along.length();
        let middle = 0.5 * (a + b);
        if self.is_beyond(middle, within + 0.5 * length) {
            return None;
        }
        let [start, end] = self.clip_to_bounds(a, along, within)?;
        let sample_at = |parameter: f32| self.sample([a, b, b], [1.0 - parameter, parameter, 0.0]);
        let center = sample_at(0.5 * (start + end))?;
        if (center.distance - within) * SAFETY >= 0.5 * (end - start) * length {
            return None;
        }
        let ends = [sample_at(start)?, sample_at(end)?];
        let mut best = ends[0].deeper(ends[1], self.pixel()).deeper(center, self.pixel());
        let mut parts = [ends; MAX_PARTS];
        let mut count = 0;
        let push_halves = |parts: &mut [[FeatureSample; 2]; MAX_PARTS],
                           count: &mut usize,
                           [from, to]: [FeatureSample; 2],
                           middle: FeatureSample| {
            // The deeper half is processed first.
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
        push_halves(&mut parts, &mut count, ends, center);
        let mut sample_count = 3;
        while count > 0 && sample_count < MAX_SAMPLES {
            count -= 1;
            let [from, to] = parts[count];
            let length_of_part = (to.weights[1] - from.weights[1]) * length;
            if length_of_part <= self.pixel() || count + 2 > MAX_PARTS {
                continue;
            }
            let threshold = best.distance.min(within) - MIN_PROMISE * self.pixel();
            // Lower bounds of the distance: from the distances at both ends, and from their slopes with an allowance
            // for curvature.
            let distance_bound = 0.5 * (from.distance + to.distance - length_of_part / SAFETY);
            let [start_slope, end_slope] = [from.normal.dot(along) / length, -to.normal.dot(along) / length];
            let slope_sum = start_slope + end_slope;
            let low = from.distance.min(to.distance);
            let slope_bound = if start_slope < 0.0 && end_slope < 0.0 {
                // Where both slopes meet.
                let position =
                    ((to.distance - from.distance - end_slope * length_of_part) / slope_sum).clamp(0.0, length_of_part);
                from.distance + start_slope * position
            } else {
                low - 0.5 * CURVATURE_ALLOWANCE * slope_sum.abs() * length_of_part
            };
            let is_fine = length_of_part <= MAX_UNSPLIT_SIZE * self.pixel();
            if distance_bound >= threshold || is_fine && slope_bound.min(low) >= threshold {
                continue;
            }
            sample_count += 1;
            let middle = sample_at(0.5 * (from.weights[1] + to.weights[1]))?;
            best = best.deeper(middle, self.pixel());
            push_halves(&mut parts, &mut count, [from, to], middle);
        }
        if best.distance > within + self.pixel() {
            return None;
        }
        Some(self.refine([a, b, b], best, |best| {
            let slope = best.normal.dot(along);
            [slope, -slope, 0.0].map(|change| change / (slope.abs() * length))
        }))
    }

    /// Subdivides a face where a deeper point is possible, down to a pixel.
    fn deepest_of_face(&self, corners: [Vec3; 3], within: f32) -> Option<FeatureSample> {
        let third = [1.0 / 3.0; 3];
        let center = interpolate(corners, third);
        let face_radius = corners.map(|corner| corner.distance(center));
        let face_radius = face_radius[0].max(face_radius[1]).max(face_radius[2]);
        if self.is_beyond(center, within + face_radius) {
            return None;
        }
        let middle = self.sample(corners, third)?;
        if (middle.distance - within) * SAFETY >= face_radius {
            return None;
        }
        // The border belongs to edges and nodes: an interior point must be deeper.
        let face_corners = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let mut best = middle;
        for (weights, corner) in face_corners.into_iter().zip(corners) {
            if !self.is_beyond(corner, best.distance.min(within)) {
                let corner = self.sample(corners, weights)?;
                best = if corner.distance <= best.distance { corner } else { best };
            }
        }
        let part = FacePart {
            corners: face_corners,
            middle,
            radius: face_radius,
            normal_change: f32::INFINITY,
        };
        let mut parts = [part; MAX_PARTS];
        let mut count = 1;
        let mut sample_count = 0;
        while count > 0 && sample_count < MAX_SAMPLES {
            count -= 1;
            sample_count += 1;
            let part = parts[count];
            if part.radius <= MIN_SIZE * self.pixel() || count + 4 > MAX_PARTS {
                continue;
            }
            let threshold = best.distance.min(within) - MIN_PROMISE * self.pixel();
            if part.middle.distance - part.radius / SAFETY >= threshold {
                continue;
            }
            let here = interpolate(corners, part.middle.weights);
            let slopes = part
                .corners
                .map(|weights| part.middle.normal.dot(interpolate(corners, weights) - here));
            let least_slope = slopes[0].min(slopes[1]).min(slopes[2]);
            let is_fine = part.radius <= MAX_UNSPLIT_SIZE * self.pixel();
            if is_fine
                && part.middle.distance + least_slope - CURVATURE_ALLOWANCE * part.normal_change * part.radius
                    >= threshold
            {
                continue;
            }
            let [ab, bc, ca] = [(0, 1), (1, 2), (2, 0)].map(|(i, j)| midpoint(part.corners[i], part.corners[j]));
            let [a, b, c] = part.corners;
            let mut normal_change = 0.0_f32;
            let first = count;
            for child in [[a, ab, ca], [ab, b, bc], [ca, bc, c]] {
                let weights = [0, 1, 2].map(|i| (child[0][i] + child[1][i] + child[2][i]) / 3.0);
                if self.is_beyond(interpolate(corners, weights), threshold + 0.5 * part.radius) {
                    continue;
                }
                let middle = self.sample(corners, weights)?;
                best = best.deeper(middle, self.pixel());
                normal_change = normal_change.max(middle.normal.distance(part.middle.normal));
                parts[count] = FacePart {
                    corners: child,
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
            for child in &mut parts[first..count] {
                child.radius = 0.5 * part.radius;
                child.normal_change = normal_change;
            }
        }
        if best.distance > within + self.pixel() {
            return None;
        }
        if best.weights.contains(&1.0) {
            return Some(best);
        }
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a);
        // Directions in which the barycentric weights grow, perpendicular to the opposite sides.
        let gradients = [normal.cross(c - b), normal.cross(a - c), normal.cross(b - a)];
        let scale = normal.length_squared();
        Some(self.refine(corners, best, |best| {
            let unit_normal = normal / scale.sqrt();
            let downhill = (unit_normal * best.normal.dot(unit_normal) - best.normal).normalize_or_zero();
            gradients.map(|gradient| gradient.dot(downhill) / scale)
        }))
    }

    /// Follows the slope from the best sample with decreasing steps, starting with a pixel. `downhill` returns the
    /// change of the weights per meter down the slope.
    fn refine(
        &self,
        corners: [Vec3; 3],
        mut best: FeatureSample,
        downhill: impl Fn(&FeatureSample) -> [f32; 3],
    ) -> FeatureSample {
        let mut step = self.pixel();
        for _ in 0..HALVINGS {
            let change = downhill(&best);
            let direction = corners[0] * change[0] + corners[1] * change[1] + corners[2] * change[2];
            if !(best.normal.dot(direction).abs() * step > MIN_SLOPE_GAIN * self.pixel()) {
                break;
            }
            if change.iter().all(|change| change.is_finite()) {
                let weights = [0, 1, 2].map(|i| (best.weights[i] + step * change[i]).max(0.0));
                let sum = weights[0] + weights[1] + weights[2];
                let sample = self.sample(corners, weights.map(|weight| weight / sum));
                if let Some(sample) = sample.filter(|sample| sample.distance < best.distance - MIN_GAIN * self.pixel())
                {
                    best = sample;
                    continue;
                }
            }
            step /= 2.0;
        }
        best
    }

    fn sample(&self, corners: [Vec3; 3], weights: [f32; 3]) -> Option<FeatureSample> {
        let (distance, normal) = self.signed_distance(interpolate(corners, weights))?;
        Some(FeatureSample {
            weights,
            distance,
            normal,
        })
    }

    /// Returns the part of an edge within reach of the solid's bounding box.
    fn clip_to_bounds(&self, start: Vec3, along: Vec3, within: f32) -> Option<[f32; 2]> {
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

fn interpolate(corners: [Vec3; 3], weights: [f32; 3]) -> Vec3 {
    corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2]
}

fn midpoint(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [0, 1, 2].map(|i| (a[i] + b[i]) / 2.0)
}
