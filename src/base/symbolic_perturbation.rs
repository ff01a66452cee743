//! Exact signs: of a triple product, and of values under symbolic perturbation.

use glam::DVec3;

/// A bound on the rounding error of a triple product, relative to the sum of the magnitudes of its products.
const ROUNDING: f64 = 1e-15;

/// `a . (b x c)` with an exact sign. Differences of coordinates that are rounded to `f32` are exact too.
#[inline]
pub(crate) fn triple(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let rounded = a.dot(b.cross(c));
    let (x, y, z) = (b.abs(), c.abs(), a.abs());
    let size = z.x * (x.y * y.z + x.z * y.y) + z.y * (x.z * y.x + x.x * y.z) + z.z * (x.x * y.y + x.y * y.x);
    if rounded.abs() > ROUNDING * size {
        return rounded;
    }
    exact_triple(a, b, c)
}

#[cold]
fn exact_triple(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let mut terms = [0.0; 24];
    let products = [
        (a.x, b.y, c.z),
        (-a.x, b.z, c.y),
        (a.y, b.z, c.x),
        (-a.y, b.x, c.z),
        (a.z, b.x, c.y),
        (-a.z, b.y, c.x),
    ];
    for (four, (a, b, c)) in terms.chunks_exact_mut(4).zip(products) {
        let (high, low) = two_product(a, b);
        (four[0], four[1]) = two_product(high, c);
        (four[2], four[3]) = two_product(low, c);
    }
    // The terms are added to an expansion of nonoverlapping numbers. Its last nonzero number has the sign of the sum
    // (Shewchuk 1997).
    let mut sum = [0.0; 24];
    for (count, &term) in terms.iter().enumerate() {
        let mut carried = term;
        for part in &mut sum[..count] {
            (carried, *part) = two_sum(carried, *part);
        }
        sum[count] = carried;
    }
    sum.into_iter().rev().find(|&part| part != 0.0).unwrap_or(0.0)
}

/// The product and its rounding error.
fn two_product(a: f64, b: f64) -> (f64, f64) {
    let product = a * b;
    (product, a.mul_add(b, -product))
}

/// The sum and its rounding error.
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let taken = sum - a;
    (sum, (a - (sum - taken)) + (b - taken))
}

/// True if a value is above 0 after an infinitesimal shift along x, a far smaller one along y and again a far smaller
/// one along z (simulation of simplicity: Edelsbrunner, Muecke 1990). `slope` is its derivative along the axes.
pub(crate) fn is_above(value: f64, slope: DVec3) -> bool {
    [value, slope.x, slope.y, slope.z]
        .into_iter()
        .find(|&term| term != 0.0)
        .is_some_and(|term| term > 0.0)
}
