//! Closest points in `f64`, with what they lie on: where rounding would decide a side.

use glam::DVec3;

/// What a point of a triangle lies on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Spot {
    Face,
    /// From this corner to the next.
    Edge(usize),
    Corner(usize),
}

/// The point of a triangle with these weights.
pub(crate) fn weighted(corners: [DVec3; 3], weights: [f64; 3]) -> DVec3 {
    corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2]
}

/// The point of triangle `a b c` that is closest to `point`, as weights, and what it lies on (Ericson 2005, chapter 5).
pub(crate) fn nearest_on_triangle(point: DVec3, [a, b, c]: [DVec3; 3]) -> ([f64; 3], Spot) {
    let (ab, ac) = (b - a, c - a);
    let from_a = point - a;
    let (d1, d2) = (ab.dot(from_a), ac.dot(from_a));
    if d1 <= 0.0 && d2 <= 0.0 {
        return ([1.0, 0.0, 0.0], Spot::Corner(0));
    }
    let from_b = point - b;
    let (d3, d4) = (ab.dot(from_b), ac.dot(from_b));
    if d3 >= 0.0 && d4 <= d3 {
        return ([0.0, 1.0, 0.0], Spot::Corner(1));
    }
    let weight_c = d1 * d4 - d3 * d2;
    if weight_c <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let t = d1 / (d1 - d3);
        return ([1.0 - t, t, 0.0], Spot::Edge(0));
    }
    let from_c = point - c;
    let (d5, d6) = (ab.dot(from_c), ac.dot(from_c));
    if d6 >= 0.0 && d5 <= d6 {
        return ([0.0, 0.0, 1.0], Spot::Corner(2));
    }
    let weight_b = d5 * d2 - d1 * d6;
    if weight_b <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let t = d2 / (d2 - d6);
        return ([1.0 - t, 0.0, t], Spot::Edge(2));
    }
    let weight_a = d3 * d6 - d5 * d4;
    if weight_a <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        let t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return ([0.0, 1.0 - t, t], Spot::Edge(1));
    }
    let sum = weight_a + weight_b + weight_c;
    ([weight_a / sum, weight_b / sum, weight_c / sum], Spot::Face)
}

/// How far along the segments from `a` to `b` and from `c` to `d` their closest points lie, 0 to 1 each. Of parallel ones these are in the
/// middle of where they run side by side.
pub(crate) fn nearest_of_segments(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> (f64, f64) {
    let (first, second, between) = (b - a, d - c, a - c);
    let (first_squared, second_squared) = (first.length_squared(), second.length_squared());
    let along = |way: DVec3, squared: f64| {
        if squared > 0.0 {
            (way / squared, true)
        } else {
            (way, false)
        }
    };
    let (on_first, on_second) = (along(first, first_squared), along(second, second_squared));
    // The point of the one that is closest to a point of the other.
    let closest = |from: DVec3, (on, is_long): (DVec3, bool)| {
        if is_long { from.dot(on).clamp(0.0, 1.0) } else { 0.0 }
    };
    let to_first = |point: DVec3| closest(point - a, on_first);
    let to_second = |point: DVec3| closest(point - c, on_second);
    if !on_first.1 {
        return (0.0, to_second(a));
    }
    let parallel = first.dot(second);
    let denominator = first_squared * second_squared - parallel * parallel;
    let s = if denominator > 1e-12 * first_squared * second_squared {
        let (ahead, behind) = (first.dot(between), second.dot(between));
        ((parallel * behind - ahead * second_squared) / denominator).clamp(0.0, 1.0)
    } else {
        0.5 * (to_first(c) + to_first(d))
    };
    let t = to_second(a + first * s);
    (to_first(c + second * t), t)
}
