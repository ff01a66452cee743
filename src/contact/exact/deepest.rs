//! Minimum of the signed distance along an edge or over a face, by cutting planes (Kelley 1960).

use glam::{DVec3, Vec3};

/// Maximum number of evaluations.
const MAX_CUTS: usize = 12;

/// Relative depth tolerance at which the search ends.
const TOLERANCE: f64 = 1e-3;

/// Largest weight at which a point counts as lying on a feature's border.
const BORDER: f64 = 1e-6;

/// Signed distance of a point from a solid, and the direction away from it.
#[derive(Clone, Copy, Debug)]
pub(super) struct SignedDistance {
    pub distance: f64,
    pub normal: DVec3,
}

/// Deepest point of an edge or face, with barycentric weights.
#[derive(Clone, Copy, Debug)]
pub(super) struct DeepestPoint {
    pub weights: [f64; 3],
    pub signed: SignedDistance,
}

/// Finds the deepest point of a feature (2 or 3 corners), starting from `start`. For a convex solid it is accurate to
/// 0.1 %. Otherwise it is the deepest point evaluated, with a preference for the interior.
///
/// Each evaluation gives a plane that bounds the distance from a convex solid from below. The next point is the
/// minimum of the planes' upper envelope.
pub(super) fn deepest(
    corners: &[Vec3],
    start: [f64; 3],
    mut measure: impl FnMut(Vec3) -> Option<SignedDistance>,
) -> Option<DeepestPoint> {
    let count = corners.len();
    let mut cuts = CuttingPlanes::none(count);
    let mut best: Option<DeepestPoint> = None;
    // Deepest interior point, in case the solid is not convex.
    let mut interior: Option<DeepestPoint> = None;
    let mut is_convex = true;
    let mut weights = start;
    while cuts.count < MAX_CUTS {
        let point: DVec3 = corners
            .iter()
            .zip(weights)
            .map(|(corner, weight)| corner.as_dvec3() * weight)
            .sum();
        let Some(signed) = measure(point.as_vec3()) else {
            break;
        };
        if best.is_none_or(|best| signed.distance < best.signed.distance) {
            best = Some(DeepestPoint { weights, signed });
        }
        if signed.distance < interior.map_or(0.0, |interior| interior.signed.distance) && is_interior(&weights[..count])
        {
            interior = Some(DeepestPoint { weights, signed });
        }
        is_convex &= signed.distance >= cuts.bound - TOLERANCE * cuts.bound.abs();
        let heights = corners
            .iter()
            .map(|corner| signed.distance + signed.normal.dot(corner.as_dvec3() - point));
        cuts.add(heights);
        let depth = best.map_or(0.0, |best| best.signed.distance);
        if cuts.bound >= depth - TOLERANCE * depth.abs() {
            break;
        }
        weights = cuts.lowest;
    }
    let at_border = best.is_some_and(|best| !is_interior(&best.weights[..count]));
    if at_border && !is_convex {
        interior.or(best)
    } else {
        best
    }
}

/// True if a point with these weights lies in its feature's interior.
pub(super) fn is_interior(weights: &[f64]) -> bool {
    weights.iter().all(|&weight| weight > BORDER)
}

/// Lower bounds of the distance from a convex solid, and the minimum of their upper envelope.
struct CuttingPlanes {
    /// Heights of the planes at the feature's corners.
    planes: [[f64; 3]; MAX_CUTS],
    count: usize,
    corners: usize,
    lowest: [f64; 3],
    bound: f64,
}

impl CuttingPlanes {
    fn none(corners: usize) -> Self {
        Self {
            planes: [[0.0; 3]; MAX_CUTS],
            count: 0,
            corners,
            lowest: [0.0; 3],
            bound: f64::NEG_INFINITY,
        }
    }

    /// Adds a plane with these heights. If it cuts off the minimum, the new minimum lies on it: at a corner, at its
    /// intersection with another plane over an edge, or with two others.
    fn add(&mut self, heights: impl Iterator<Item = f64>) {
        let (others, free) = self.planes.split_at_mut(self.count);
        let plane = &mut free[0];
        plane.iter_mut().zip(heights).for_each(|(to, height)| *to = height);
        let (plane, corners) = (*plane, self.corners);
        let height = |plane: &[f64; 3], at: [f64; 3]| plane[0] * at[0] + plane[1] * at[1] + plane[2] * at[2];
        self.count += 1;
        if height(&plane, self.lowest) <= self.bound {
            return;
        }
        let mut best = ([1.0, 0.0, 0.0], f64::INFINITY);
        let mut consider = |weights: [f64; 3]| {
            if weights.iter().all(|&weight| weight >= 0.0) {
                let heights = others.iter().map(|plane| height(plane, weights));
                let here = heights.fold(height(&plane, weights), f64::max);
                if here < best.1 {
                    best = (weights, here);
                }
            }
        };
        for corner in 0..corners {
            let mut weights = [0.0; 3];
            weights[corner] = 1.0;
            consider(weights);
        }
        let difference = |other: &[f64; 3]| DVec3::from_array(plane) - DVec3::from_array(*other);
        for (index, other) in others.iter().enumerate() {
            let first = difference(other);
            for [i, j] in [[0, 1], [1, 2], [2, 0]] {
                if i.max(j) < corners && first[i] * first[j] < 0.0 {
                    let mut weights = [0.0; 3];
                    weights[i] = first[j] / (first[j] - first[i]);
                    weights[j] = 1.0 - weights[i];
                    consider(weights);
                }
            }
            if corners < 3 {
                continue;
            }
            for second in &others[..index] {
                let weights = first.cross(difference(second));
                let sum = weights.element_sum();
                if sum != 0.0 {
                    consider((weights / sum).to_array());
                }
            }
        }
        (self.lowest, self.bound) = best;
    }
}
