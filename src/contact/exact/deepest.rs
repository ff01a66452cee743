//! The least of a distance along an edge or over a face, by cutting planes (Kelley 1960).

use glam::{DVec3, Vec3};

/// Places that are looked at, at most.
const CUTS: usize = 12;

/// It ends where nothing can be deeper by more than this part of the depth.
const CLOSE: f64 = 1e-3;

/// A point is at a feature's border where a weight is no more.
const BORDER: f64 = 1e-6;

/// A point's signed distance from a solid, and the direction away from it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Signed {
    pub distance: f64,
    pub normal: DVec3,
}

/// The deepest point of an edge or face, as weights of its corners.
#[derive(Clone, Copy, Debug)]
pub(super) struct Deepest {
    pub weights: [f64; 3],
    pub signed: Signed,
}

/// The deepest point of a feature (2 or 3 corners) from `start` on: exact where the solid is convex, to a thousandth; elsewhere the deepest
/// of those looked at, and rather one between the ends.
///
/// Each look gives a plane below which the distance from a convex solid does not lie; the next is where the highest of them is lowest.
pub(super) fn deepest(
    corners: &[Vec3],
    start: [f64; 3],
    mut measure: impl FnMut(Vec3) -> Option<Signed>,
) -> Option<Deepest> {
    let count = corners.len();
    let mut cuts = Cuts::none(count);
    let mut best: Option<Deepest> = None;
    // The deepest between the ends, for where the planes prove wrong.
    let mut inner: Option<Deepest> = None;
    let mut is_convex = true;
    let mut weights = start;
    while cuts.count < CUTS {
        let point: DVec3 = corners
            .iter()
            .zip(weights)
            .map(|(corner, weight)| corner.as_dvec3() * weight)
            .sum();
        let Some(signed) = measure(point.as_vec3()) else {
            break;
        };
        if best.is_none_or(|best| signed.distance < best.signed.distance) {
            best = Some(Deepest { weights, signed });
        }
        if signed.distance < inner.map_or(0.0, |inner| inner.signed.distance) && lies_between(&weights[..count]) {
            inner = Some(Deepest { weights, signed });
        }
        is_convex &= signed.distance >= cuts.bound - CLOSE * cuts.bound.abs();
        let heights = corners
            .iter()
            .map(|corner| signed.distance + signed.normal.dot(corner.as_dvec3() - point));
        cuts.add(heights);
        let found = best.map_or(0.0, |best| best.signed.distance);
        if cuts.bound >= found - CLOSE * found.abs() {
            break;
        }
        weights = cuts.lowest;
    }
    let at_border = best.is_some_and(|best| !lies_between(&best.weights[..count]));
    if at_border && !is_convex { inner.or(best) } else { best }
}

/// Whether a point with these weights lies within its feature, and not at its border.
pub(super) fn lies_between(weights: &[f64]) -> bool {
    weights.iter().all(|&weight| weight > BORDER)
}

/// Planes above which the distance from a convex solid lies, and where the highest of them is lowest.
struct Cuts {
    /// Their heights at the feature's corners.
    planes: [[f64; 3]; CUTS],
    count: usize,
    corners: usize,
    lowest: [f64; 3],
    bound: f64,
}

impl Cuts {
    fn none(corners: usize) -> Self {
        Self {
            planes: [[0.0; 3]; CUTS],
            count: 0,
            corners,
            lowest: [0.0; 3],
            bound: f64::NEG_INFINITY,
        }
    }

    /// Adds one with these heights. Where it is above what was lowest, that is on it now: at a corner, or where it meets another over an edge, or
    /// two others.
    fn add(&mut self, heights: impl Iterator<Item = f64>) {
        let (others, free) = self.planes.split_at_mut(self.count);
        let plane = &mut free[0];
        plane.iter_mut().zip(heights).for_each(|(to, height)| *to = height);
        let (plane, corners) = (*plane, self.corners);
        let over = |plane: &[f64; 3], at: [f64; 3]| plane[0] * at[0] + plane[1] * at[1] + plane[2] * at[2];
        self.count += 1;
        if over(&plane, self.lowest) <= self.bound {
            return;
        }
        let mut best = ([1.0, 0.0, 0.0], f64::INFINITY);
        let mut look = |weights: [f64; 3]| {
            if weights.iter().all(|&weight| weight >= 0.0) {
                let heights = others.iter().map(|plane| over(plane, weights));
                let here = heights.fold(over(&plane, weights), f64::max);
                if here < best.1 {
                    best = (weights, here);
                }
            }
        };
        for corner in 0..corners {
            let mut weights = [0.0; 3];
            weights[corner] = 1.0;
            look(weights);
        }
        let apart = |other: &[f64; 3]| DVec3::from_array(plane) - DVec3::from_array(*other);
        for (index, other) in others.iter().enumerate() {
            let first = apart(other);
            for [i, j] in [[0, 1], [1, 2], [2, 0]] {
                if i.max(j) < corners && first[i] * first[j] < 0.0 {
                    let mut weights = [0.0; 3];
                    weights[i] = first[j] / (first[j] - first[i]);
                    weights[j] = 1.0 - weights[i];
                    look(weights);
                }
            }
            if corners < 3 {
                continue;
            }
            for second in &others[..index] {
                let weights = first.cross(apart(second));
                let sum = weights.element_sum();
                if sum != 0.0 {
                    look((weights / sum).to_array());
                }
            }
        }
        (self.lowest, self.bound) = best;
    }
}
