//! Nodes along a Hilbert curve: what is near in space is near in the order.

use glam::{DVec3, Vec3};

use crate::Result;
use crate::base::memory;

/// The curve visits 2^16 places along each axis: as many as a key of 64 bits has room for three times over, and more than
/// meshes have nodes along an axis.
const BITS: u32 = 16;

/// The nodes along the curve; those at one place of it in their own order.
pub(super) fn along_curve(positions: &[Vec3]) -> Result<Vec<u32>> {
    let low = positions.iter().fold(DVec3::INFINITY, |low, p| low.min(p.as_dvec3()));
    let high = positions
        .iter()
        .fold(DVec3::NEG_INFINITY, |high, p| high.max(p.as_dvec3()));
    // Cubes, not boxes: neighbours are near in metres. Without any extent all are at place 0.
    let extent = (high - low).max_element();
    let scale = if extent > 0.0 {
        f64::from((1 << BITS) - 1) / extent
    } else {
        0.0
    };

    let mut keyed = memory::collected(positions.iter().enumerate().map(|(node, p)| {
        let place = (p.as_dvec3() - low) * scale;
        (key(place.to_array().map(|c| c as u32)), node as u32)
    }))?;
    keyed.sort_unstable();
    memory::collected(keyed.iter().map(|&(_, node)| node))
}

/// How far along the curve a place is (Skilling 2004, "Programming the Hilbert curve"): from the coarsest cubes to the
/// finest, each coordinate's bit turns or mirrors what is finer, so that the curve leaves one cube where it enters the next.
fn key(mut place: [u32; 3]) -> u64 {
    for level in (1..BITS).rev() {
        let (bit, finer) = (1 << level, (1 << level) - 1);
        for axis in 0..3 {
            if place[axis] & bit != 0 {
                place[0] ^= finer;
            } else {
                let swapped = (place[0] ^ place[axis]) & finer;
                place[0] ^= swapped;
                place[axis] ^= swapped;
            }
        }
    }
    // What is left is a Gray code, read across the axes.
    place[1] ^= place[0];
    place[2] ^= place[1];
    let mut mirror = 0;
    for level in (1..BITS).rev() {
        if place[2] & 1 << level != 0 {
            mirror ^= (1 << level) - 1;
        }
    }
    place
        .map(|coordinate| spread(coordinate ^ mirror))
        .iter()
        .fold(0, |key, bits| key << 1 | bits)
}

/// The bits of a number of 16, three apart.
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
