//! When a moving point meets a moving triangle, or a moving edge another: additive advancement (Li, Kaufman, Jiang 2021, Codimensional
//! Incremental Potential Contact, algorithm 1), in `f64`.
//!
//! Nothing is missed: from where they are, two things cannot meet before they have come as far as they are apart, at the fastest that any of their
//! corners comes. There are no roots of a cubic to be lost. What comes very close without touching may count as a touch.

use glam::{DVec3, Vec3};

use super::nearest::nearest_of_segments;

/// They touch where no more than this part of the first gap is left, or of their size.
const TOUCHING: f64 = 1e-6;
const ROUNDING: f64 = 1e-12;

/// The part of a gap that is taken at once.
const STRIDE: f64 = 0.9;

/// Advances of one search. One that takes more passes very near, and counts as a touch.
const ADVANCES: u32 = 1 << 13;

/// The first time, 0 to 1, at which a point comes within `separation` of a triangle, each moving evenly from its first place to its second;
/// `None` where it does not. 0 where it is there from the start.
pub(crate) fn first_touch_of_point(point: [Vec3; 2], triangle: [[Vec3; 3]; 2], separation: f32) -> Option<f64> {
    let corners = |time: usize| {
        let [a, b, c] = triangle[time];
        [point[time], a, b, c].map(|corner| corner.as_dvec3())
    };
    let distance = |[p, a, b, c]: [DVec3; 4]| distance_to_triangle(p, [a, b, c]);
    first_touch([corners(0), corners(1)], 1, f64::from(separation), distance)
}

/// The same of two edges.
pub(crate) fn first_touch_of_edges(first: [[Vec3; 2]; 2], second: [[Vec3; 2]; 2], separation: f32) -> Option<f64> {
    let corners = |time: usize| {
        let ([a, b], [c, d]) = (first[time], second[time]);
        [a, b, c, d].map(|corner| corner.as_dvec3())
    };
    let distance = |[a, b, c, d]: [DVec3; 4]| distance_of_edges(a, b, c, d);
    first_touch([corners(0), corners(1)], 2, f64::from(separation), distance)
}

/// Of the corners the first `split` are one thing, the rest the other.
fn first_touch(
    [from, to]: [[DVec3; 4]; 2],
    split: usize,
    separation: f64,
    distance: impl Fn([DVec3; 4]) -> f64,
) -> Option<f64> {
    let ways: [DVec3; 4] = std::array::from_fn(|corner| to[corner] - from[corner]);
    // What all do together brings nothing closer.
    let mean = ways.iter().sum::<DVec3>() / 4.0;
    let fastest = |ways: &[DVec3]| ways.iter().map(|way| way.distance(mean)).fold(0.0, f64::max);
    let closing = fastest(&ways[..split]) + fastest(&ways[split..]);
    let size = from
        .iter()
        .chain(&to)
        .map(|corner| corner.abs().max_element())
        .fold(0.0, f64::max);
    let mut gap = distance(from) - separation;
    let touching = (gap * TOUCHING).max(size * ROUNDING);
    let mut time = 0.0;
    for _ in 0..ADVANCES {
        if !(gap > touching) {
            return Some(time);
        }
        time += STRIDE * gap / closing;
        if !(time <= 1.0) {
            break;
        }
        gap = distance(std::array::from_fn(|corner| from[corner] + ways[corner] * time)) - separation;
    }
    if time <= 1.0 {
        return Some(time);
    }
    // The last stride is shorter than the gap: nothing was met in it.
    None
}

fn distance_to_segment(point: DVec3, a: DVec3, b: DVec3) -> f64 {
    let way = b - a;
    let squared = way.length_squared();
    let along = if squared > 0.0 {
        ((point - a).dot(way) / squared).clamp(0.0, 1.0)
    } else {
        0.0
    };
    point.distance(a + way * along)
}

/// Its border is measured too, so that what has no area has a distance.
fn distance_to_triangle(point: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
    let border = distance_to_segment(point, a, b)
        .min(distance_to_segment(point, b, c))
        .min(distance_to_segment(point, c, a));
    let normal = (b - a).cross(c - a);
    let is_left = |from: DVec3, to: DVec3| normal.dot((to - from).cross(point - from)) >= 0.0;
    let length = normal.length();
    if length > 0.0 && is_left(a, b) && is_left(b, c) && is_left(c, a) {
        border.min((normal.dot(point - a) / length).abs())
    } else {
        border
    }
}

/// Their ends are measured too, as where they are parallel there is no one closest pair.
fn distance_of_edges(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> f64 {
    let (s, t) = nearest_of_segments(a, b, c, d);
    let between = a.lerp(b, s).distance(c.lerp(d, t));
    let ends = distance_to_segment(a, c, d).min(distance_to_segment(b, c, d));
    let other_ends = distance_to_segment(c, a, b).min(distance_to_segment(d, a, b));
    between.min(ends).min(other_ends)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    fn at(moving: [Vec3; 2], time: f64) -> DVec3 {
        moving[0].as_dvec3().lerp(moving[1].as_dvec3(), time)
    }

    /// When four moving corners are in one plane and `meets` there: from sign changes between `samples` times, bisected.
    fn reference(corners: &[[Vec3; 2]; 4], samples: u32, meets: impl Fn([DVec3; 4]) -> bool) -> Option<f64> {
        let places = |time: f64| corners.map(|corner| at(corner, time));
        let volume = |time: f64| {
            let [a, b, c, d] = places(time);
            (b - a).cross(c - a).dot(d - a)
        };
        let mut before = volume(0.0);
        for index in 1..=samples {
            let [mut low, mut high] = [index - 1, index].map(|index| f64::from(index) / f64::from(samples));
            let after = volume(high);
            if (before < 0.0) != (after < 0.0) {
                for _ in 0..60 {
                    let middle = 0.5 * (low + high);
                    if (volume(middle) < 0.0) == (before < 0.0) {
                        low = middle
                    } else {
                        high = middle
                    }
                }
                if meets(places(high)) {
                    return Some(high);
                }
            }
            before = after;
        }
        None
    }

    fn meets_triangle([p, a, b, c]: [DVec3; 4]) -> bool {
        let normal = (b - a).cross(c - a);
        let part = |from: DVec3, to: DVec3| normal.dot((to - from).cross(p - from)) / normal.length_squared();
        part(a, b) > 1e-7 && part(b, c) > 1e-7 && part(c, a) > 1e-7
    }

    fn meet([a, b, c, d]: [DVec3; 4]) -> bool {
        let normal = (b - a).cross(d - c);
        let along = (c - a).cross(d - c).dot(normal) / normal.length_squared();
        let other = (c - a).cross(b - a).dot(normal) / normal.length_squared();
        [along, other].iter().all(|part| *part > 1e-7 && *part < 1.0 - 1e-7)
    }

    #[test]
    fn nothing_is_missed() {
        let mut random = Random(17);
        // Touches, and of those the ones that dense sampling does not see.
        let (mut touches, mut unseen, mut grazes) = (0, 0, 0);
        for turn in 0..100_000_u32 {
            let scale = 10.0_f32.powi(turn as i32 % 5 - 3);
            let mut corner = || {
                let from = random.vector();
                [from, from + random.vector() * 2.0 * random.unit()].map(|place| place * scale)
            };
            let corners = [corner(), corner(), corner(), corner()];
            let [a, b, c, d] = corners;
            let start = corners.map(|corner| corner[0].as_dvec3());
            let (told, expected, gap) = if turn % 2 == 0 {
                let told = first_touch_of_point(a, [0, 1].map(|time| [b[time], c[time], d[time]]), 0.0);
                let [p, triangle @ ..] = start;
                (
                    told,
                    reference(&corners, 32, meets_triangle),
                    distance_to_triangle(p, triangle),
                )
            } else {
                let pair = |x: [Vec3; 2], y: [Vec3; 2]| [0, 1].map(|time| [x[time], y[time]]);
                let told = first_touch_of_edges(pair(a, b), pair(c, d), 0.0);
                (
                    told,
                    reference(&corners, 32, meet),
                    distance_of_edges(start[0], start[1], start[2], start[3]),
                )
            };
            if let Some(expected) = expected {
                let told = told.expect("a touch");
                assert!(told <= expected + 1e-9, "{corners:?}: {told} for {expected}");
            }
            if let Some(told) = told {
                touches += 1;
                unseen += i32::from(expected.is_none());
                // They are as close as is said then.
                let [p, q, r, s] = corners.map(|corner| at(corner, told));
                let left = if turn % 2 == 0 {
                    distance_to_triangle(p, [q, r, s])
                } else {
                    distance_of_edges(p, q, r, s)
                };
                // But for those that pass each other so closely for so long that the search ends.
                let close = left / gap.max(f64::from(scale));
                grazes += i32::from(close > 2e-6);
                assert!(close < 1e-3, "{corners:?}: {left} at {told}");
            }
        }
        assert!(touches > 5_000, "{touches}");
        assert!(grazes * 1000 < touches, "{grazes} of {touches} passed");
        assert!(unseen * 1000 < touches, "{unseen} of {touches} were no touches");
    }

    #[test]
    fn the_separation_is_kept() {
        let triangle = [[Vec3::ZERO, Vec3::X, Vec3::Y]; 2];
        let point = [Vec3::new(0.2, 0.2, 1.0), Vec3::new(0.2, 0.2, -1.0)];
        for (separation, expected) in [(0.0, 0.5), (0.1, 0.45), (0.5, 0.25), (1.0, 0.0), (1.5, 0.0)] {
            let told = first_touch_of_point(point, triangle, separation).expect("a touch");
            assert!(
                told <= expected + 1e-7 && told > expected - 1e-5,
                "{told} for {expected}"
            );
        }
        let edge = [[Vec3::ZERO, Vec3::X]; 2];
        let other = [1.0, -1.0].map(|z| [Vec3::new(0.5, -1.0, z), Vec3::new(0.5, 1.0, z)]);
        let told = first_touch_of_edges(edge, other, 0.2).expect("a touch");
        assert!((told - 0.4).abs() < 1e-5, "{told}");
    }

    #[test]
    fn degenerate_cases() {
        let v = Vec3::new;
        let triangle = [[Vec3::ZERO, Vec3::X, Vec3::Y]; 2];
        let meets = |from: Vec3, to: Vec3| first_touch_of_point([from, to], triangle, 0.0);
        // Within the plane, into a side, into a corner, past it, away.
        assert!((meets(v(-1.0, 0.5, 0.0), v(1.0, 0.5, 0.0)).expect("the side") - 0.5).abs() < 1e-5);
        assert!((meets(v(-1.0, -1.0, 0.0), v(1.0, 1.0, 0.0)).expect("the corner") - 0.5).abs() < 1e-5);
        assert_eq!(meets(v(-1.0, -0.1, 0.0), v(1.0, -0.1, 0.0)), None);
        assert_eq!(meets(v(0.2, 0.2, 0.1), v(0.2, 0.2, 1.0)), None);
        // On it from the start, and all moving alike.
        assert_eq!(meets(v(0.2, 0.2, 0.0), v(0.2, 0.2, 1.0)), Some(0.0));
        let along = [v(0.2, 0.2, 0.1), v(5.2, 0.2, 0.1)];
        assert_eq!(
            first_touch_of_point(along, [triangle[0], triangle[0].map(|c| c + Vec3::X * 5.0)], 0.0),
            None
        );
        assert_eq!(meets(v(0.2, 0.2, 0.1), v(0.2, 0.2, 0.1)), None);
        // Triangles that are a line or a point.
        let line = [[Vec3::ZERO, Vec3::X, Vec3::X * 2.0]; 2];
        let fall = [v(1.5, 0.0, 1.0), v(1.5, 0.0, -1.0)];
        assert!((first_touch_of_point(fall, line, 0.0).expect("the line") - 0.5).abs() < 1e-5);
        let dot = [[v(1.5, 0.0, 0.0); 3]; 2];
        assert!((first_touch_of_point(fall, dot, 0.0).expect("the point") - 0.5).abs() < 1e-5);
        // Parallel edges, one above the other and end to end.
        let edge = [[Vec3::ZERO, Vec3::X]; 2];
        let fall = [1.0, -1.0].map(|z| [v(0.5, 0.0, z), v(1.5, 0.0, z)]);
        assert!((first_touch_of_edges(edge, fall, 0.0).expect("the edge") - 0.5).abs() < 1e-5);
        let slide = [3.0, 1.0].map(|x| [v(x, 0.0, 0.0), v(x - 1.0, 0.0, 0.0)]);
        assert!((first_touch_of_edges(edge, slide, 0.0).expect("the end") - 0.5).abs() < 1e-5);
        // A triangle that turns inside out about a point at rest.
        let turning = [
            triangle[0].map(|c| c + Vec3::Z),
            [-Vec3::Z, Vec3::X - Vec3::Z, Vec3::Y - Vec3::Z],
        ];
        assert!(first_touch_of_point([v(0.3, 0.3, 0.0); 2], turning, 0.0).is_some());
    }
}
