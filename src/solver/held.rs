//! Nodes that are held along some axes, in matrices.

use glam::{BVec3, DMat3, DVec3};

/// A block of a matrix without what belongs to axes that the node of its rows, or that of its columns, is held along.
pub(super) fn without_held(block: DMat3, [rows, columns]: [BVec3; 2]) -> DMat3 {
    let [rows, columns] = [rows, columns].map(|held| DVec3::select(held, DVec3::ZERO, DVec3::ONE));
    DMat3::from_cols(
        block.x_axis * rows * columns.x,
        block.y_axis * rows * columns.y,
        block.z_axis * rows * columns.z,
    )
}
