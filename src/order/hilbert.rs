//! Nodes along a Hilbert curve: nodes that are near in space are near in the order.

use glam::{DVec3, Vec3};

use crate::Result;
use crate::base::memory;

/// The curve has 2^16 cells along each axis. Three coordinates of 16 bits fit a 64-bit key, and meshes have fewer nodes
/// along an axis.
const BITS: u32 = 16;

/// The nodes along the curve; those in the same cell keep their order.
pub(super) fn along_curve(positions: &[Vec3]) -> Result<Vec<u32>> {
    let low = positions.iter().fold(DVec3::INFINITY, |low, p| low.min(p.as_dvec3()));
    let high = positions
        .iter()
        .fold(DVec3::NEG_INFINITY, |high, p| high.max(p.as_dvec3()));
    // Cells are cubes, because nearness is measured in meters. Without an extent all nodes are in cell 0.
    let extent = (high - low).max_element();
    let scale = if extent > 0.0 {
        f64::from((1 << BITS) - 1) / extent
    } else {
        0.0
    };

    let mut keyed = memory::collected(positions.iter().enumerate().map(|(node, p)| {
        let cell = (p.as_dvec3() - low) * scale;
        (key(cell.to_array().map(|c| c as u32)), node as u32)
    }))?;
    keyed.sort_unstable();
    memory::collected(keyed.iter().map(|&(_, node)| node))
}

/// The position of a cell along the curve (Skilling 2004, "Programming the Hilbert curve"). From the coarsest to the
/// finest level, each coordinate's bit rotates or mirrors the finer bits, so that the curve leaves one cube where it
/// enters the next.
fn key(mut cell: [u32; 3]) -> u64 {
    for level in (1..BITS).rev() {
        let (bit, finer) = (1 << level, (1 << level) - 1);
        for axis in 0..3 {
            if cell[axis] & bit != 0 {
                cell[0] ^= finer;
            } else {
                let swapped = (cell[0] ^ cell[axis]) & finer;
                cell[0] ^= swapped;
                cell[axis] ^= swapped;
            }
        }
    }
    // The result is a Gray code, read across the axes.
    cell[1] ^= cell[0];
    cell[2] ^= cell[1];
    let mut mirror = 0;
    for level in (1..BITS).rev() {
        if cell[2] & 1 << level != 0 {
            mirror ^= (1 << level) - 1;
        }
    }
    cell.map(|coordinate| spread(coordinate ^ mirror))
        .iter()
        .fold(0, |key, bits| key << 1 | bits)
}

/// Spreads 16 bits so that they are three apart.
fn spread(number: u32) -> u64 {
    let mut bits = u64::from(number);
    for (shift, mask) in [
        (16, 0x0000_0000_ff00_00ff),
        (8, 0x0000_00f0_0f00_f00f),
        (4, 0x0000_0c30_c30c_30c3),
        (2, 0x0000_2492_4924_9249),
    ] {
        bits = (bits | bits << shift) & mask;
    }
    bits
}
