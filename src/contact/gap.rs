//! Signed gap between a node, edge or face and a tool, reevaluated as the nodes of an implicit step move.
//!
//! The closest point of a feature moves along it as the feature tilts. Weights fixed at the start of the step would
//! make the force oscillate from step to step: a force f on an edge of length l, held by a sphere of radius r, would
//! act like a spring of stiffness `f r / l²` that lags a step behind.

use crate::codec::{saved, saved_enum};
use glam::DVec3;

/// Surface of a tool near a feature at the end of a substep.
#[derive(Clone, Copy, Debug)]
pub(super) enum GapSurface {
    /// All points within `radius` of the segment between the ends.
    Rounded { ends: [DVec3; 2], radius: f64 },
    /// A plane. The feature's contact point has fixed weights, however the feature tilts.
    Flat {
        weights: [f64; 3],
        normal: DVec3,
        /// Offset of the plane along the normal, m.
        level: f64,
    },
}

saved_enum!(GapSurface { 0 => Rounded { ends, radius }, 1 => Flat { weights, normal, level } });

/// Closest distance between a feature and a tool.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Gap {
    /// Barycentric weights of the feature's point closest to the tool, 1 in sum.
    pub weights: [f64; 3],
    /// Unit vector away from the tool.
    pub normal: DVec3,
    /// Signed distance, m; below 0 inside.
    pub distance: f64,
    /// Negated second derivatives of the distance for displacements of the corners along the normal, 1/m. The closest
    /// point moves toward the corner that approaches.
    pub neg_hessian: [[f64; 3]; 3],
}

saved! { Gap { weights, normal, distance, neg_hessian } }

impl GapSurface {
    /// Measures the distance of a feature with 1 to 3 corners.
    pub fn measure(&self, corners: &[DVec3]) -> Gap {
        match *self {
            Self::Flat { weights, normal, level } => Gap {
                weights,
                normal,
                distance: weighted(corners, weights).dot(normal) - level,
                neg_hessian: [[0.0; 3]; 3],
            },
            Self::Rounded { ends, radius } => {
                let (weights, centre) = closest_point(corners, ends);
                let offset = weighted(corners, weights) - centre;
                let length = offset.length();
                Gap {
                    weights,
                    normal: if length > 0.0 { offset / length } else { DVec3::Y },
                    distance: length - radius,
                    neg_hessian: weight_gradient_products(corners, weights).map(|row| row.map(|slope| slope * length)),
                }
            }
        }
    }

    /// Returns the increase of the distance between two states, m, for these displacements of the corners. It keeps
    /// the relative precision of short displacements, which the difference of two distances loses.
    pub fn opening(&self, before: &Gap, after: &Gap, displacements: &[DVec3]) -> f64 {
        /// Largest short displacement, relative to the distance between the feature and the tool's axis. The slope
        /// changes linearly over a short displacement.
        const SHORT: f64 = 1e-5;
        let slope = |gap: &Gap| weighted(displacements, gap.weights).dot(gap.normal);
        let is_straight = match *self {
            Self::Flat { .. } => true,
            Self::Rounded { radius, .. } => {
                let limit = SHORT * (before.distance + radius);
                displacements
                    .iter()
                    .all(|displacement| displacement.length_squared() <= limit * limit)
            }
        };
        if is_straight {
            0.5 * (slope(before) + slope(after))
        } else {
            after.distance - before.distance
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

/// Returns the weights of a feature's closest point to a segment, and the closest point of the segment. A face is
/// only compared with the first end of the segment.
fn closest_point(corners: &[DVec3], ends: [DVec3; 2]) -> ([f64; 3], DVec3) {
    match *corners {
        [p] => ([1.0, 0.0, 0.0], ends[0].lerp(ends[1], parameter_on(p, ends))),
        [p, q] => {
            let mut centre = ends[0];
            let mut parameter = parameter_on(centre, [p, q]);
            if ends[0] != ends[1] {
                let (f, g) = (q - p, ends[1] - ends[0]);
                let (ff, gg, fg, between) = (f.dot(f), g.dot(g), f.dot(g), p - ends[0]);
                let denominator = ff * gg - fg * fg;
                parameter = if denominator > 1e-9 * ff * gg {
                    ((fg * g.dot(between) - gg * f.dot(between)) / denominator).clamp(0.0, 1.0)
                } else {
                    0.5
                };
                centre = ends[0].lerp(ends[1], parameter_on(p.lerp(q, parameter), ends));
                if denominator > 1e-9 * ff * gg {
                    parameter = parameter_on(centre, [p, q]);
                }
            }
            ([1.0 - parameter, parameter, 0.0], centre)
        }
        [p, q, r] => (closest_of_face([p, q, r], ends[0]), ends[0]),
        _ => ([0.0; 3], ends[0]),
    }
}

/// Returns the parameter of the segment's closest point, 0 to 1.
fn parameter_on(point: DVec3, [from, to]: [DVec3; 2]) -> f64 {
    let direction = to - from;
    let square = direction.length_squared();
    if square > 0.0 {
        ((point - from).dot(direction) / square).clamp(0.0, 1.0)
    } else {
        0.0
    }
}

/// Returns the weights of the triangle's closest point.
fn closest_of_face([a, b, c]: [DVec3; 3], point: DVec3) -> [f64; 3] {
    let normal = (b - a).cross(c - a);
    let square = normal.length_squared();
    let weights = [
        (c - b).cross(point - b).dot(normal) / square,
        (a - c).cross(point - c).dot(normal) / square,
        (b - a).cross(point - a).dot(normal) / square,
    ];
    if weights.iter().all(|&value| value >= 0.0) {
        return weights;
    }
    let [ab, bc, ca] = [
        parameter_on(point, [a, b]),
        parameter_on(point, [b, c]),
        parameter_on(point, [c, a]),
    ];
    let candidates = [[1.0 - ab, ab, 0.0], [0.0, 1.0 - bc, bc], [ca, 0.0, 1.0 - ca]];
    let distance = |weights: [f64; 3]| weighted(&[a, b, c], weights).distance_squared(point);
    let mut best = candidates[0];
    for candidate in [candidates[1], candidates[2]] {
        if distance(candidate) < distance(best) {
            best = candidate;
        }
    }
    best
}

/// Returns the products of the weights' gradients, 1/m²; 0 for corners whose weight is 0.
fn weight_gradient_products(corners: &[DVec3], weights: [f64; 3]) -> [[f64; 3]; 3] {
    let mut gradients = [DVec3::ZERO; 3];
    let mut active = [0; 3];
    let mut count = 0;
    for (corner, &weight) in weights.iter().enumerate().take(corners.len()) {
        if weight > 0.0 {
            active[count] = corner;
            count += 1;
        }
    }
    match count {
        2 => {
            let edge = corners[active[1]] - corners[active[0]];
            let gradient = edge / edge.length_squared().max(f64::MIN_POSITIVE);
            gradients[active[0]] = -gradient;
            gradients[active[1]] = gradient;
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

    /// Slopes and second derivatives agree with finite differences.
    #[test]
    fn derivatives_match_finite_differences() {
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
            // Contact at an edge, and at a corner.
            (&[a, b, c + DVec3::Y][..], [DVec3::NEG_Z; 2]),
            (&[a, b + DVec3::Y, c + DVec3::Y][..], [DVec3::NEG_X; 2]),
        ] {
            let surface = GapSurface::Rounded { ends, radius: 0.5 };
            let meets = surface.measure(corners);
            let step = 1e-4;
            let distance = |moved: [f64; 3]| {
                let mut corners = corners.to_vec();
                for (corner, factor) in corners.iter_mut().zip(moved) {
                    *corner += meets.normal * (factor * step);
                }
                surface.measure(&corners).distance
            };
            let unit = |corner: usize| std::array::from_fn(|other| f64::from(u8::from(other == corner)));
            for i in 0..corners.len() {
                let ahead: [f64; 3] = unit(i);
                let slope = (distance(ahead) - distance(ahead.map(|factor| -factor))) / (2.0 * step);
                assert!((slope - meets.weights[i]).abs() < 1e-6, "{i}: {slope}, {meets:?}");
                for j in 0..corners.len() {
                    let aside: [f64; 3] = unit(j);
                    let both = |s: f64, t: f64| distance(std::array::from_fn(|k| s * ahead[k] + t * aside[k]));
                    let bend =
                        (both(1.0, 1.0) - both(1.0, -1.0) - both(-1.0, 1.0) + both(-1.0, -1.0)) / (4.0 * step * step);
                    assert!(
                        (bend + meets.neg_hessian[i][j]).abs() < 1e-5,
                        "{i}, {j}: {bend}, {meets:?}"
                    );
                }
            }
        }
    }
}
