//! How a node, edge or face meets a tool where it is: what an equation asks for again and again as its nodes go.
//!
//! Where a feature is met moves along it as it tilts, by so much that weights which are those of the step's start push to and fro
//! from step to step: for a force f on an edge of length l, held by a sphere of radius r, as much as a spring of `f r / l²` that is
//! always a step late.

use crate::codec::{saved, saved_enum};
use glam::DVec3;

/// The surface of a tool near a feature, at the end of a substep.
#[derive(Clone, Copy, Debug)]
pub(super) enum Gauge {
    /// All that is within `radius` of the segment between the ends.
    Rounded { ends: [DVec3; 2], radius: f64 },
    /// A plane; the feature is met at this point of it, however it tilts.
    Flat {
        weights: [f64; 3],
        normal: DVec3,
        /// Of the plane, along the normal, m.
        level: f64,
    },
}

saved_enum!(Gauge { 0 => Rounded { ends, radius }, 1 => Flat { weights, normal, level } });

/// How a feature meets a tool.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Meets {
    /// Of its corners, for its point closest to the tool; 1 in sum.
    pub weights: [f64; 3],
    /// Away from the tool, of unit length.
    pub normal: DVec3,
    /// m; below 0 inside.
    pub gap: f64,
    /// How much less curved the gap is than flat, for corners that go along the normal, 1/m: the closest point goes to the corner
    /// that comes near.
    pub tilts: [[f64; 3]; 3],
}

saved! { Meets { weights, normal, gap, tilts } }

impl Gauge {
    /// Of a feature with these corners, 1 to 3.
    pub fn meet(&self, corners: &[DVec3]) -> Meets {
        match *self {
            Self::Flat { weights, normal, level } => Meets {
                weights,
                normal,
                gap: weighted(corners, weights).dot(normal) - level,
                tilts: [[0.0; 3]; 3],
            },
            Self::Rounded { ends, radius } => {
                let (weights, centre) = closest(corners, ends);
                let offset = weighted(corners, weights) - centre;
                let distance = offset.length();
                Meets {
                    weights,
                    normal: if distance > 0.0 { offset / distance } else { DVec3::Y },
                    gap: distance - radius,
                    tilts: slopes(corners, weights).map(|row| row.map(|slope| slope * distance)),
                }
            }
        }
    }

    /// By how much the gap grows from the one to the other, where the corners go these ways, m: with as many digits for a short way as
    /// for a long one, which the difference of two gaps has not.
    pub fn opening(&self, before: &Meets, after: &Meets, ways: &[DVec3]) -> f64 {
        /// A way is short as a part of the distance between the feature and the middle of the tool: then the slope changes evenly.
        const SHORT: f64 = 1e-5;
        let along = |meets: &Meets| weighted(ways, meets.weights).dot(meets.normal);
        let is_straight = match *self {
            Self::Flat { .. } => true,
            Self::Rounded { radius, .. } => {
                let short = SHORT * (before.gap + radius);
                ways.iter().all(|way| way.length_squared() <= short * short)
            }
        };
        if is_straight {
            0.5 * (along(before) + along(after))
        } else {
            after.gap - before.gap
        }
    }
}

fn weighted(corners: &[DVec3], weights: [f64; 3]) -> DVec3 {
    corners
        .iter()
        .zip(weights)
        .map(|(&corner, weight)| corner * weight)
        .sum()
}

/// The closest point of a feature to a segment, as weights, and that of the segment. A face is compared with the segment's first end
/// alone.
fn closest(corners: &[DVec3], ends: [DVec3; 2]) -> ([f64; 3], DVec3) {
    match *corners {
        [p] => ([1.0, 0.0, 0.0], ends[0].lerp(ends[1], along(p, ends))),
        [p, q] => {
            let mut centre = ends[0];
            let mut on_edge = along(centre, [p, q]);
            if ends[0] != ends[1] {
                let (f, g) = (q - p, ends[1] - ends[0]);
                let (ff, gg, fg, between) = (f.dot(f), g.dot(g), f.dot(g), p - ends[0]);
                let denominator = ff * gg - fg * fg;
                on_edge = if denominator > 1e-9 * ff * gg {
                    ((fg * g.dot(between) - gg * f.dot(between)) / denominator).clamp(0.0, 1.0)
                } else {
                    0.5
                };
                centre = ends[0].lerp(ends[1], along(p.lerp(q, on_edge), ends));
                if denominator > 1e-9 * ff * gg {
                    on_edge = along(centre, [p, q]);
                }
            }
            ([1.0 - on_edge, on_edge, 0.0], centre)
        }
        [p, q, r] => (closest_of_face([p, q, r], ends[0]), ends[0]),
        _ => ([0.0; 3], ends[0]),
    }
}

/// How far along the segment its closest point lies, 0 to 1.
fn along(point: DVec3, [from, to]: [DVec3; 2]) -> f64 {
    let way = to - from;
    let square = way.length_squared();
    if square > 0.0 {
        ((point - from).dot(way) / square).clamp(0.0, 1.0)
    } else {
        0.0
    }
}

/// The weights of the point of a triangle that is closest.
fn closest_of_face([a, b, c]: [DVec3; 3], point: DVec3) -> [f64; 3] {
    let normal = (b - a).cross(c - a);
    let square = normal.length_squared();
    let within = [
        (c - b).cross(point - b).dot(normal) / square,
        (a - c).cross(point - c).dot(normal) / square,
        (b - a).cross(point - a).dot(normal) / square,
    ];
    if within.iter().all(|&weight| weight >= 0.0) {
        return within;
    }
    let [ab, bc, ca] = [along(point, [a, b]), along(point, [b, c]), along(point, [c, a])];
    let candidates = [[1.0 - ab, ab, 0.0], [0.0, 1.0 - bc, bc], [ca, 0.0, 1.0 - ca]];
    let distance = |weights: [f64; 3]| weighted(&[a, b, c], weights).distance_squared(point);
    let mut best = candidates[0];
    for other in [candidates[1], candidates[2]] {
        if distance(other) < distance(best) {
            best = other;
        }
    }
    best
}

/// The products of the gradients of the weights, 1/m²: 0 for corners that have no part in the closest point.
fn slopes(corners: &[DVec3], weights: [f64; 3]) -> [[f64; 3]; 3] {
    let mut gradients = [DVec3::ZERO; 3];
    let mut with = [0; 3];
    let mut count = 0;
    for (corner, &weight) in weights.iter().enumerate().take(corners.len()) {
        if weight > 0.0 {
            with[count] = corner;
            count += 1;
        }
    }
    match count {
        2 => {
            let way = corners[with[1]] - corners[with[0]];
            let gradient = way / way.length_squared().max(f64::MIN_POSITIVE);
            gradients[with[0]] = -gradient;
            gradients[with[1]] = gradient;
        }
        3 => {
            let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            let per_square = 1.0 / normal.length_squared().max(f64::MIN_POSITIVE);
            for (corner, gradient) in gradients.iter_mut().enumerate() {
                let across = corners[(corner + 2) % 3] - corners[(corner + 1) % 3];
                *gradient = normal.cross(across) * per_square;
            }
        }
        _ => {}
    }
    gradients.map(|row| gradients.map(|column| row.dot(column)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a gauge tells of the gap's slopes and bends is what differences of gaps have.
    #[test]
    fn gaps_bend_as_they_are_said_to() {
        let sphere = [DVec3::ZERO; 2];
        let capsule = [DVec3::new(-0.3, 0.0, 0.1), DVec3::new(0.4, 0.0, -0.2)];
        let [a, b, c] = [
            DVec3::new(-0.5, 1.1, -0.4),
            DVec3::new(0.6, 1.0, -0.3),
            DVec3::new(0.1, 1.2, 0.7),
        ];
        for (corners, ends) in [
            (&[a][..], capsule),
            (&[a, b][..], sphere),
            (&[a, b, c][..], sphere),
            // Met at an edge, and at a corner.
            (&[a, b, c + DVec3::Y][..], [DVec3::NEG_Z; 2]),
            (&[a, b + DVec3::Y, c + DVec3::Y][..], [DVec3::NEG_X; 2]),
        ] {
            let gauge = Gauge::Rounded { ends, radius: 0.5 };
            let meets = gauge.meet(corners);
            let way = 1e-4;
            let gap = |moved: [f64; 3]| {
                let mut corners = corners.to_vec();
                for (corner, part) in corners.iter_mut().zip(moved) {
                    *corner += meets.normal * (part * way);
                }
                gauge.meet(&corners).gap
            };
            let unit = |corner: usize| std::array::from_fn(|other| f64::from(u8::from(other == corner)));
            for i in 0..corners.len() {
                let ahead: [f64; 3] = unit(i);
                let slope = (gap(ahead) - gap(ahead.map(|part| -part))) / (2.0 * way);
                assert!((slope - meets.weights[i]).abs() < 1e-6, "{i}: {slope}, {meets:?}");
                for j in 0..corners.len() {
                    let aside: [f64; 3] = unit(j);
                    let both = |s: f64, t: f64| gap(std::array::from_fn(|k| s * ahead[k] + t * aside[k]));
                    let bend =
                        (both(1.0, 1.0) - both(1.0, -1.0) - both(-1.0, 1.0) + both(-1.0, -1.0)) / (4.0 * way * way);
                    assert!((bend + meets.tilts[i][j]).abs() < 1e-5, "{i}, {j}: {bend}, {meets:?}");
                }
            }
        }
    }
}
