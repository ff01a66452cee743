//! Motions and wrenches as vectors of six numbers: three for translation and three for rotation.
//!
//! Rotations are scaled by the lever arm of a tool, so that all numbers have the same unit: a motion is (displacement,
//! lever angle), m, a wrench (force, torque / lever), N.

use glam::DVec3;

pub(crate) type Vector6 = [f64; 6];

/// A symmetric matrix of six rows.
pub(crate) type Matrix6 = [Vector6; 6];

pub(crate) const ZERO: Vector6 = [0.0; 6];
pub(crate) const ZERO_MATRIX: Matrix6 = [ZERO; 6];

/// Joins the parts for translation and rotation.
pub(crate) fn joined(along: DVec3, about: DVec3) -> Vector6 {
    [along.x, along.y, along.z, about.x, about.y, about.z]
}

/// The part for translation.
pub(crate) fn along(six: &Vector6) -> DVec3 {
    DVec3::new(six[0], six[1], six[2])
}

/// The part for rotation.
pub(crate) fn about(six: &Vector6) -> DVec3 {
    DVec3::new(six[3], six[4], six[5])
}

pub(crate) fn sum(a: &Vector6, b: &Vector6) -> Vector6 {
    std::array::from_fn(|k| a[k] + b[k])
}

pub(crate) fn difference(a: &Vector6, b: &Vector6) -> Vector6 {
    std::array::from_fn(|k| a[k] - b[k])
}

pub(crate) fn scaled(a: &Vector6, by: f64) -> Vector6 {
    a.map(|part| part * by)
}

/// The elementwise product.
pub(crate) fn each(a: &Vector6, b: &Vector6) -> Vector6 {
    std::array::from_fn(|k| a[k] * b[k])
}

pub(crate) fn dot(a: &Vector6, b: &Vector6) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

pub(crate) fn product(matrix: &Matrix6, six: &Vector6) -> Vector6 {
    std::array::from_fn(|row| dot(&matrix[row], six))
}

/// Clamps the lengths of both parts.
pub(crate) fn limited(six: &Vector6, [most_along, most_about]: [f64; 2]) -> Vector6 {
    joined(
        along(six).clamp_length_max(most_along),
        about(six).clamp_length_max(most_about),
    )
}

/// The diagonal matrix of these numbers.
pub(crate) fn diagonal(six: &Vector6) -> Matrix6 {
    std::array::from_fn(|row| std::array::from_fn(|column| if row == column { six[row] } else { 0.0 }))
}

/// The inverse of a symmetric positive definite matrix by Gauss-Jordan elimination.
pub(crate) fn inverse(matrix: &Matrix6) -> Matrix6 {
    let mut left = *matrix;
    let mut inverse = diagonal(&[1.0; 6]);
    for k in 0..6 {
        let pivot = 1.0 / left[k][k];
        left[k] = scaled(&left[k], pivot);
        inverse[k] = scaled(&inverse[k], pivot);
        for row in (0..6).filter(|&row| row != k) {
            let factor = left[row][k];
            left[row] = difference(&left[row], &scaled(&left[k], factor));
            inverse[row] = difference(&inverse[row], &scaled(&inverse[k], factor));
        }
    }
    inverse
}

/// The number of Jacobi sweeps. After five the off-diagonal elements are rounding.
const SWEEPS: usize = 8;

/// The symmetric matrix with its eigenvalues clamped to a range (cyclic Jacobi rotations).
pub(crate) fn clamped(matrix: &Matrix6, range: [f64; 2]) -> Matrix6 {
    let mut rest = *matrix;
    let mut vectors = diagonal(&[1.0; 6]);
    for _ in 0..SWEEPS {
        for p in 0..5 {
            for q in p + 1..6 {
                if rest[p][q] == 0.0 {
                    continue;
                }
                let ratio = (rest[q][q] - rest[p][p]) / (2.0 * rest[p][q]);
                let tangent = ratio.signum() / (ratio.abs() + ratio.mul_add(ratio, 1.0).sqrt());
                let cosine = 1.0 / tangent.mul_add(tangent, 1.0).sqrt();
                let sine = tangent * cosine;
                for row in &mut rest {
                    (row[p], row[q]) = (cosine * row[p] - sine * row[q], sine * row[p] + cosine * row[q]);
                }
                let (above, below) = (rest[p], rest[q]);
                rest[p] = difference(&scaled(&above, cosine), &scaled(&below, sine));
                rest[q] = sum(&scaled(&above, sine), &scaled(&below, cosine));
                for row in &mut vectors {
                    (row[p], row[q]) = (cosine * row[p] - sine * row[q], sine * row[p] + cosine * row[q]);
                }
            }
        }
    }
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            (0..6)
                .map(|k| vectors[i][k] * vectors[j][k] * rest[k][k].clamp(range[0], range[1]))
                .sum()
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::rotation;
    use glam::DQuat;

    /// Numbers from a fixed seed.
    fn numbers() -> impl FnMut() -> f64 {
        let mut state = 9u64;
        move || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        }
    }

    fn symmetric(next: &mut impl FnMut() -> f64) -> Matrix6 {
        let any: Matrix6 = std::array::from_fn(|_| std::array::from_fn(|_| next()));
        std::array::from_fn(|i| std::array::from_fn(|j| any[i][j] + any[j][i]))
    }

    #[test]
    fn what_is_clamped_has_eigenvalues_in_range_and_is_else_the_same() {
        let mut next = numbers();
        for _ in 0..100 {
            let matrix = symmetric(&mut next);
            let whole = clamped(&matrix, [-100.0, 100.0]);
            let (positive, negative) = (clamped(&matrix, [0.0, 100.0]), clamped(&matrix, [-100.0, 0.0]));
            for i in 0..6 {
                for j in 0..6 {
                    assert!((whole[i][j] - matrix[i][j]).abs() < 1e-12);
                    // Both parts together are the whole, and annul each other.
                    assert!((positive[i][j] + negative[i][j] - matrix[i][j]).abs() < 1e-12);
                    let product: f64 = (0..6).map(|k| positive[i][k] * negative[k][j]).sum();
                    assert!(product.abs() < 1e-12);
                }
            }
            let any: Vector6 = std::array::from_fn(|_| next());
            assert!(dot(&any, &product(&positive, &any)) > -1e-12);
            assert!(dot(&any, &product(&negative, &any)) < 1e-12);
        }
    }

    #[test]
    fn an_inverse_is_one() {
        let mut next = numbers();
        for _ in 0..100 {
            let mut matrix = clamped(&symmetric(&mut next), [0.0, 100.0]);
            (0..6).for_each(|k| matrix[k][k] += 0.1);
            let inverse = inverse(&matrix);
            let any: Vector6 = std::array::from_fn(|_| next());
            let back = product(&inverse, &product(&matrix, &any));
            assert!((0..6).all(|k| (back[k] - any[k]).abs() < 1e-11));
        }
    }

    #[test]
    fn turns_are_undone_by_turning() {
        let mut next = numbers();
        for _ in 0..100 {
            let from = DQuat::from_xyzw(next(), next(), next(), next()).normalize();
            let by = DVec3::new(next(), next(), next()) * 4.0;
            let found = rotation::rotation_between(from, rotation::rotated(from, by));
            assert!((found - by).length() < 1e-12, "{found} {by}");
        }
    }
}
