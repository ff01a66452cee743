//! Matrices built from vectors.

use glam::{DMat3, DVec3};

/// The outer product of two vectors.
pub(crate) fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// The matrix of the cross product with a vector.
pub(crate) fn cross_matrix(vector: DVec3) -> DMat3 {
    DMat3::from_cols(
        DVec3::new(0.0, vector.z, -vector.y),
        DVec3::new(-vector.z, 0.0, vector.x),
        DVec3::new(vector.y, -vector.x, 0.0),
    )
}

pub(crate) fn trace(matrix: &DMat3) -> f64 {
    matrix.x_axis.x + matrix.y_axis.y + matrix.z_axis.z
}
