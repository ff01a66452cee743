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
    let mut cuts = [[0.0; 3]; CUTS];
    let mut best: Option<Deepest> = None;
    // The deepest between the ends, for where the planes prove wrong.
    let mut inner: Option<Deepest> = None;
    let mut is_convex = true;
    let mut bound = f64::NEG_INFINITY;
    let mut weights = start;
    for looks in 0..CUTS {
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
        is_convex &= signed.distance >= bound - CLOSE * bound.abs();
        for (cut, corner) in cuts[looks].iter_mut().zip(corners) {
            *cut = signed.distance + signed.normal.dot(corner.as_dvec3() - point);
        }
        let (next, least) = lowest(&cuts[..=looks], count);
        bound = least;
        let found = best.map_or(0.0, |best| best.signed.distance);
        if bound >= found - CLOSE * found.abs() {
            break;
        }
        weights = next;
    }
    let at_border = best.is_some_and(|best| !lies_between(&best.weights[..count]));
    if at_border && !is_convex { inner.or(best) } else { best }
}

/// Whether a point with these weights lies within its feature, and not at its border.
pub(super) fn lies_between(weights: &[f64]) -> bool {
    weights.iter().all(|&weight| weight > BORDER)
}

/// Where the highest of some planes, given by their heights at the corners, is lowest, and how high it is there: a corner, or where
/// two meet over an edge, or three.
fn lowest(planes: &[[f64; 3]], count: usize) -> ([f64; 3], f64) {
    let height = |weights: [f64; 3]| {
        let over = |plane: &[f64; 3]| plane[0] * weights[0] + plane[1] * weights[1] + plane[2] * weights[2];
        planes.iter().map(over).fold(f64::NEG_INFINITY, f64::max)
    };
    let mut best = ([1.0, 0.0, 0.0], f64::INFINITY);
    let mut look = |weights: [f64; 3]| {
        if weights.iter().all(|&weight| weight >= 0.0) {
            let here = height(weights);
            if here < best.1 {
                best = (weights, here);
            }
        }
    };
    for corner in 0..count {
        let mut weights = [0.0; 3];
        weights[corner] = 1.0;
        look(weights);
    }
    for (index, a) in planes.iter().enumerate() {
        for (other, b) in planes[..index].iter().enumerate() {
            let apart: [f64; 3] = std::array::from_fn(|corner| a[corner] - b[corner]);
            for [i, j] in [[0, 1], [1, 2], [2, 0]] {
                if i.max(j) < count && apart[i] * apart[j] < 0.0 {
                    let mut weights = [0.0; 3];
                    weights[i] = apart[j] / (apart[j] - apart[i]);
                    weights[j] = 1.0 - weights[i];
                    look(weights);
                }
            }
            if count < 3 {
                continue;
            }
            for c in &planes[..other] {
                let other = DVec3::from_array(std::array::from_fn(|corner| a[corner] - c[corner]));
                let weights = DVec3::from_array(apart).cross(other);
                let sum = weights.element_sum();
                if sum != 0.0 {
                    look((weights / sum).to_array());
                }
            }
        }
    }
    best
}
