//! Closest points in `f64`, with the feature they are on, for cases where rounding would decide the side.

use glam::DVec3;

/// The feature of a triangle that a point is on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TriangleFeature {
    Face,
    /// The edge from this corner to the next.
    Edge(usize),
    Corner(usize),
}

/// The point of a triangle with these barycentric weights.
pub(crate) fn weighted(corners: [DVec3; 3], weights: [f64; 3]) -> DVec3 {
    corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2]
}

/// The barycentric weights of the point of triangle `a b c` closest to `point`, and the feature it is on (Ericson
/// 2005, chapter 5).
pub(crate) fn nearest_on_triangle(point: DVec3, [a, b, c]: [DVec3; 3]) -> ([f64; 3], TriangleFeature) {
    let (ab, ac) = (b - a, c - a);
    let from_a = point - a;
    let (d1, d2) = (ab.dot(from_a), ac.dot(from_a));
    if d1 <= 0.0 && d2 <= 0.0 {
        return ([1.0, 0.0, 0.0], TriangleFeature::Corner(0));
    }
    let from_b = point - b;
    let (d3, d4) = (ab.dot(from_b), ac.dot(from_b));
    if d3 >= 0.0 && d4 <= d3 {
        return ([0.0, 1.0, 0.0], TriangleFeature::Corner(1));
    }
    let weight_c = d1 * d4 - d3 * d2;
    if weight_c <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let t = d1 / (d1 - d3);
        return ([1.0 - t, t, 0.0], TriangleFeature::Edge(0));
    }
    let from_c = point - c;
    let (d5, d6) = (ab.dot(from_c), ac.dot(from_c));
    if d6 >= 0.0 && d5 <= d6 {
        return ([0.0, 0.0, 1.0], TriangleFeature::Corner(2));
    }
    let weight_b = d5 * d2 - d1 * d6;
    if weight_b <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let t = d2 / (d2 - d6);
        return ([1.0 - t, 0.0, t], TriangleFeature::Edge(2));
    }
    let weight_a = d3 * d6 - d5 * d4;
    if weight_a <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        let t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return ([0.0, 1.0 - t, t], TriangleFeature::Edge(1));
    }
    let sum = weight_a + weight_b + weight_c;
    ([weight_a / sum, weight_b / sum, weight_c / sum], TriangleFeature::Face)
}

/// The parameters, 0 to 1, of the closest points on the segments from `a` to `b` and from `c` to `d`. For parallel
/// segments they are in the middle of the overlap.
pub(crate) fn nearest_on_segments(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> (f64, f64) {
    let (first, second, between) = (b - a, d - c, a - c);
    let (first_squared, second_squared) = (first.length_squared(), second.length_squared());
    let scaled = |vector: DVec3, squared: f64| {
        if squared > 0.0 {
            (vector / squared, true)
        } else {
            (vector, false)
        }
    };
    let (on_first, on_second) = (scaled(first, first_squared), scaled(second, second_squared));
    // The parameter on one segment closest to a point of the other.
    let closest = |from: DVec3, (direction, has_length): (DVec3, bool)| {
        if has_length {
            from.dot(direction).clamp(0.0, 1.0)
        } else {
            0.0
        }
    };
    let to_first = |point: DVec3| closest(point - a, on_first);
    let to_second = |point: DVec3| closest(point - c, on_second);
    if !on_first.1 {
        return (0.0, to_second(a));
    }
    let projection = first.dot(second);
    let denominator = first_squared * second_squared - projection * projection;
    let s = if denominator > 1e-12 * first_squared * second_squared {
        let (first_offset, second_offset) = (first.dot(between), second.dot(between));
        ((projection * second_offset - first_offset * second_squared) / denominator).clamp(0.0, 1.0)
    } else {
        0.5 * (to_first(c) + to_first(d))
    };
    let t = to_second(a + first * s);
    (to_first(c + second * t), t)
}
