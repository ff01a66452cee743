//! Closest points of points, segments and triangles (Ericson 2005, Real-Time Collision Detection, chapter 5).

use glam::Vec3A;

use crate::geometry::nearest::nearest_on_segments;

/// Squared sine of the angle below which two segments are compared in `f64`. Above it, the error of the distance is
/// about 1e-5 of their length.
const NEARLY_PARALLEL: f32 = 1e-4;

/// Parameter of the point closest to `point` on the segment from `a` to `b`, 0 to 1.
pub(super) fn closest_on_segment(point: Vec3A, a: Vec3A, b: Vec3A) -> f32 {
    let along = b - a;
    let length_squared = along.length_squared();
    if length_squared > 0.0 {
        ((point - a).dot(along) / length_squared).clamp(0.0, 1.0)
    } else {
        0.0
    }
}

/// Parameters of the closest points of the segments from `a` to `b` and from `c` to `d`, 0 to 1 each.
pub(super) fn closest_of_segments(a: Vec3A, b: Vec3A, c: Vec3A, d: Vec3A) -> (f32, f32) {
    let (first, second, between) = (b - a, d - c, a - c);
    let (first_squared, second_squared) = (first.length_squared(), second.length_squared());
    if second_squared == 0.0 {
        return (closest_on_segment(c, a, b), 0.0);
    }
    if first_squared == 0.0 {
        return (0.0, closest_on_segment(a, c, d));
    }
    let parallel = first.dot(second);
    let (ahead, behind) = (first.dot(between), second.dot(between));
    let denominator = first_squared * second_squared - parallel * parallel;
    // Rounding errors dominate for nearly parallel segments. An overestimated distance would let a sweep step over a
    // contact.
    if !(denominator > NEARLY_PARALLEL * first_squared * second_squared) {
        let (on_first, on_second) = nearest_on_segments(a.as_dvec3(), b.as_dvec3(), c.as_dvec3(), d.as_dvec3());
        return (on_first as f32, on_second as f32);
    }
    let on_first = ((parallel * behind - ahead * second_squared) / denominator).clamp(0.0, 1.0);
    let on_second = (parallel * on_first + behind) / second_squared;
    if (0.0..=1.0).contains(&on_second) {
        return (on_first, on_second);
    }
    let on_second = on_second.clamp(0.0, 1.0);
    (closest_on_segment(c + second * on_second, a, b), on_second)
}

/// Barycentric weights of the point of triangle `a b c` that is closest to `point`.
pub(super) fn closest_on_triangle(point: Vec3A, a: Vec3A, b: Vec3A, c: Vec3A) -> [f32; 3] {
    let (ab, ac) = (b - a, c - a);
    let from_a = point - a;
    let (d1, d2) = (ab.dot(from_a), ac.dot(from_a));
    if d1 <= 0.0 && d2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let from_b = point - b;
    let (d3, d4) = (ab.dot(from_b), ac.dot(from_b));
    if d3 >= 0.0 && d4 <= d3 {
        return [0.0, 1.0, 0.0];
    }
    let weight_c = d1 * d4 - d3 * d2;
    if weight_c <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let t = d1 / (d1 - d3);
        return [1.0 - t, t, 0.0];
    }
    let from_c = point - c;
    let (d5, d6) = (ab.dot(from_c), ac.dot(from_c));
    if d6 >= 0.0 && d5 <= d6 {
        return [0.0, 0.0, 1.0];
    }
    let weight_b = d5 * d2 - d1 * d6;
    if weight_b <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let t = d2 / (d2 - d6);
        return [1.0 - t, 0.0, t];
    }
    let weight_a = d3 * d6 - d5 * d4;
    if weight_a <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        let t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return [0.0, 1.0 - t, t];
    }
    let sum = weight_a + weight_b + weight_c;
    if sum > 0.0 {
        [weight_a / sum, weight_b / sum, weight_c / sum]
    } else {
        [1.0, 0.0, 0.0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn nothing_sampled_is_closer() {
        let mut random = Random(7);
        let mut point = || glam::Vec3A::from(random.vector());
        for _ in 0..500 {
            let [p, q, a, b, c] = [point(), point(), point(), point(), point()];
            let [wa, wb, wc] = closest_on_triangle(p, a, b, c);
            assert!((wa + wb + wc - 1.0).abs() < 1e-5);
            let found = (a * wa + b * wb + c * wc).distance(p);
            let (s, t) = closest_of_segments(p, q, a, b);
            let found_of_segments = p.lerp(q, s).distance(a.lerp(b, t));
            for i in 0..=20 {
                for j in 0..=20 {
                    let (u, v) = (i as f32 / 20.0, j as f32 / 20.0);
                    if u + v <= 1.0 {
                        let other = a + (b - a) * u + (c - a) * v;
                        assert!(other.distance(p) >= found - 1e-5);
                    }
                    assert!(p.lerp(q, u).distance(a.lerp(b, v)) >= found_of_segments - 1e-5);
                }
            }
        }
    }
}
