//! Removes constrained axes from matrix blocks.

use glam::{BVec3, DMat3, DVec3};

/// Returns a matrix block without the rows and columns of constrained axes.
pub(super) fn mask_axes(block: DMat3, [rows, columns]: [BVec3; 2]) -> DMat3 {
    let [rows, columns] = [rows, columns].map(|held| DVec3::select(held, DVec3::ZERO, DVec3::ONE));
    DMat3::from_cols(
        block.x_axis * rows * columns.x,
        block.y_axis * rows * columns.y,
        block.z_axis * rows * columns.z,
    )
}
