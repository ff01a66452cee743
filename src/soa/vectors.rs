//! Structure-of-arrays vectors, laid out for kernels that process sixteen nodes at a time.

use super::PerNode;
use std::ops::Range;

use glam::Vec3;

use super::Records;
use super::TILE;
use crate::base::{Result, memory};
use crate::codec::{Reader, Saved, Writer, floats_into};
use crate::simd::Record;
use crate::threads::{Ragged, Tiles};

/// Padding before and after each axis. A kernel that loads the neighbors of sixteen nodes at once may read this far
/// beyond the ends.
pub(crate) const MARGIN: usize = 16;

/// Numbers per cache line.
const LINE: usize = 16;

/// Numbers per memory page. Arrays at equal page offsets conflict: a load waits for an earlier store whose address has
/// the same lowest twelve bits.
const PAGE: usize = 1024;

/// Offset between the page offsets of consecutive axes, for axes longer than a page.
const SKEW: usize = 21 * LINE;

/// Read-only vectors of consecutive nodes. At the ends of a body they include the padding.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View<'a> {
    axes: [&'a [f32]; 3],
    /// Node number of the first entry, negative in the padding.
    start: isize,
    /// The same vectors as records, from node 0 on, if available.
    records: Option<&'a [Record]>,
}

/// Addresses of node 0, which may lie outside the view.
#[derive(Clone, Copy)]
pub(crate) struct BasePointers {
    pub axes: [*const f32; 3],
    pub records: Option<*const Record>,
}

impl<'a> View<'a> {
    /// Creates a view of vectors along each axis. The first belongs to node `start`.
    pub fn new(axes: [&'a [f32]; 3], start: isize) -> Self {
        Self {
            axes,
            start,
            records: None,
        }
    }

    /// Adds the same vectors as records.
    pub fn with_records(self, records: Option<&'a Records>) -> Self {
        Self {
            records: records.map(Records::as_slice),
            ..self
        }
    }

    /// True if all these nodes may be read, and if records cover all nodes of the body.
    pub fn covers(&self, nodes: &Range<isize>, node_count: usize) -> bool {
        self.start <= nodes.start
            && self
                .axes
                .iter()
                .all(|axis| nodes.end - self.start <= axis.len() as isize)
            && self.records.is_none_or(|records| node_count <= records.len())
    }

    #[inline(always)]
    pub fn get(&self, node: usize) -> Vec3 {
        Vec3::from(self.axes.map(|axis| axis[(node as isize - self.start) as usize]))
    }

    /// The records from node 0 on; empty if there are none.
    #[inline(always)]
    pub fn records(&self) -> &'a [Record] {
        self.records.unwrap_or(&[])
    }

    pub fn has_records(&self) -> bool {
        self.records.is_some()
    }

    /// Coordinates of these nodes along each axis.
    #[inline(always)]
    pub fn slices(&self, nodes: Range<usize>) -> [&'a [f32]; 3] {
        let index = |node: usize| (node as isize - self.start) as usize;
        self.axes.map(|axis| &axis[index(nodes.start)..index(nodes.end)])
    }

    /// Addresses of node 0.
    #[inline(always)]
    pub fn base_pointers(&self) -> BasePointers {
        BasePointers {
            axes: self.axes.map(|axis| axis.as_ptr().wrapping_offset(-self.start)),
            records: self.records.map(<[Record]>::as_ptr),
        }
    }
}

/// One vector per node: an array per axis, with zero padding on both sides. The first axis is aligned to a cache line.
#[derive(Debug)]
pub(crate) struct Vectors {
    values: Vec<f32>,
    /// Index of node 0 along the first axis, and distance between axes.
    first: usize,
    stride: usize,
    count: usize,
}

/// Saves the capacity, but not the memory layout.
impl Saved for Vectors {
    const SHAPE: u64 = Vec::<Vec3>::SHAPE;
    const LEAST: usize = 16;

    fn save(&self, to: &mut Writer) {
        self.len().save(to);
        self.capacity().save(to);
        to.needs(3 * size_of::<f32>() * self.capacity());
        for axis in self.axes() {
            f32::save_all(axis, to);
        }
    }

    fn load(from: &mut Reader) -> Result<Self> {
        let (count, capacity) = (usize::load(from)?, usize::load(from)?);
        if capacity < count || !capacity.is_multiple_of(LINE) {
            return Err(from.refusal("vectors have not the room that they take"));
        }
        from.reserve_memory(capacity.checked_mul(3 * size_of::<f32>()))?;
        let mut vectors = Self::with_capacity(count, capacity)?;
        for axis in vectors.axes_mut() {
            floats_into(axis, from)?;
        }
        Ok(vectors)
    }
}

impl PerNode for Vectors {
    fn reserve_nodes(&mut self, count: usize) -> Result<()> {
        self.reserve(count)
    }

    fn grow(&mut self, count: usize) {
        Self::grow(self, count);
    }
}

impl Vectors {
    /// Creates `count` zero vectors.
    pub fn zeros(count: usize) -> Result<Self> {
        Self::with_capacity(count, count)
    }

    /// Creates `count` zero vectors with this capacity.
    fn with_capacity(count: usize, capacity: usize) -> Result<Self> {
        let padded = capacity.next_multiple_of(LINE) + 2 * MARGIN;
        let stride = if padded < PAGE {
            padded
        } else {
            (padded - SKEW).next_multiple_of(PAGE) + SKEW
        };
        let values = memory::filled(0.0_f32, LINE + 3 * stride)?;
        // Misaligned data are only slower.
        let aligned = values.as_ptr().align_offset(LINE * size_of::<f32>()).min(LINE);
        Ok(Self {
            values,
            first: aligned + MARGIN,
            stride,
            count,
        })
    }

    /// Reserves capacity for `count` vectors in all.
    pub fn reserve(&mut self, count: usize) -> Result<()> {
        if count > self.capacity() {
            let mut enlarged = Self::with_capacity(self.count, count)?;
            enlarged.copy_from(self);
            *self = enlarged;
        }
        Ok(())
    }

    /// Adds zero vectors within the capacity, up to `count` in all.
    pub fn grow(&mut self, count: usize) {
        assert!(count <= self.capacity());
        self.count = self.count.max(count);
    }

    /// Maximum number of vectors, a multiple of a cache line.
    fn capacity(&self) -> usize {
        self.stride - 2 * MARGIN
    }

    /// Indices along an axis, with padding before the first number and after the last block of sixteen.
    #[inline(always)]
    fn padded_range(&self, axis: usize) -> Range<usize> {
        let start = self.first - MARGIN + axis * self.stride;
        start..start + self.count.next_multiple_of(LINE) + 2 * MARGIN
    }

    /// Numbers along each axis, with padding.
    #[inline(always)]
    fn padded_mut(&mut self) -> [&mut [f32]; 3] {
        let all = self.padded_range(0);
        let (x, rest) = self.values[all.start..].split_at_mut(self.stride);
        let (y, z) = rest.split_at_mut(self.stride);
        [x, y, z].map(|axis| &mut axis[..all.len()])
    }

    #[inline(always)]
    pub fn get(&self, node: usize) -> Vec3 {
        debug_assert!(node < self.count);
        let first = self.first + node;
        Vec3::from([0, 1, 2].map(|axis| self.values[first + axis * self.stride]))
    }

    #[inline(always)]
    pub fn set(&mut self, node: usize, value: Vec3) {
        debug_assert!(node < self.count);
        let first = self.first + node;
        for (axis, number) in value.to_array().into_iter().enumerate() {
            self.values[first + axis * self.stride] = number;
        }
    }

    pub fn len(&self) -> usize {
        self.count
    }

    /// Coordinates along each axis.
    #[inline(always)]
    pub fn axes(&self) -> [&[f32]; 3] {
        [0, 1, 2].map(|axis| {
            let first = self.first + axis * self.stride;
            &self.values[first..first + self.count]
        })
    }

    #[inline(always)]
    pub fn axes_mut(&mut self) -> [&mut [f32]; 3] {
        let count = self.count;
        self.padded_mut().map(|axis| &mut axis[MARGIN..MARGIN + count])
    }

    /// Coordinates of these nodes along each axis.
    #[inline(always)]
    pub fn slices(&self, nodes: Range<usize>) -> [&[f32]; 3] {
        self.axes().map(|axis| &axis[nodes.clone()])
    }

    /// Coordinates along each axis, in tiles.
    pub fn tiles_mut(&mut self) -> [Tiles<'_, f32>; 3] {
        self.axes_mut().map(|axis| Tiles::new(axis, TILE))
    }

    /// View of all vectors, with padding.
    #[inline(always)]
    pub fn view(&self) -> View<'_> {
        View {
            axes: [0, 1, 2].map(|axis| &self.values[self.padded_range(axis)]),
            start: -(MARGIN as isize),
            records: None,
        }
    }

    /// Splits the coordinates along each axis at tile boundaries, `starts`, which must come from
    /// [`Vectors::piece_start`]. The first piece includes the padding before it, the last one the padding after it.
    pub fn pieces_mut<'a>(&'a mut self, starts: &'a [usize]) -> [Ragged<'a, f32>; 3] {
        self.padded_mut().map(|axis| Ragged::new(axis, starts))
    }

    /// Start of the piece whose first tile is `tile`.
    pub fn piece_start(tile: usize) -> usize {
        if tile == 0 { 0 } else { MARGIN + tile * TILE }
    }

    /// Node number of the first entry of such a piece, negative in the padding.
    pub fn piece_node(tile: usize) -> isize {
        Self::piece_start(tile) as isize - MARGIN as isize
    }

    /// All vectors, in order.
    pub fn iter(&self) -> impl Iterator<Item = Vec3> + '_ {
        let [x, y, z] = self.axes();
        x.iter().zip(y).zip(z).map(|((&x, &y), &z)| Vec3::new(x, y, z))
    }

    /// Copies all vectors of `other`, which must have the same number.
    pub fn copy_from(&mut self, other: &Self) {
        copy_axes(&mut self.axes_mut(), other.axes());
    }

    /// Sets all vectors to zero.
    pub fn clear(&mut self) {
        for axis in self.axes_mut() {
            axis.fill(0.0);
        }
    }

    /// Largest length; infinite if a vector is not finite.
    pub fn largest_length(&self) -> f32 {
        largest(self.iter().map(|vector| vector.length_squared()))
    }

    /// Largest distance between corresponding vectors; infinite if one is not finite.
    pub fn largest_distance(&self, other: &Self) -> f32 {
        largest(self.iter().zip(other.iter()).map(|(a, b)| a.distance_squared(b)))
    }
}

/// Square root of the largest of `squares`; infinite if one is not finite.
fn largest(squares: impl Iterator<Item = f32>) -> f32 {
    // The bit patterns of nonnegative numbers are in numerical order, with infinity and NaN above all others.
    let bits = squares.map(|square| (square.to_bits() & (u32::MAX >> 1)) as i32);
    let largest = f32::from_bits(bits.fold(0, i32::max) as u32);
    if largest.is_finite() {
        largest.sqrt()
    } else {
        f32::INFINITY
    }
}

/// Copies the coordinates along each axis.
pub(crate) fn copy_axes(to: &mut [&mut [f32]; 3], from: [&[f32]; 3]) {
    for (to, from) in to.iter_mut().zip(from) {
        to.copy_from_slice(from);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_length_detects_non_finite_vectors() {
        for spoilt in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            for node in 0..3 {
                let mut vectors = Vectors::zeros(3).expect("memory");
                vectors.set(1, Vec3::ONE);
                assert_eq!(vectors.largest_length(), 3.0_f32.sqrt());
                vectors.set(node, Vec3::new(0.0, spoilt, 0.0));
                assert_eq!(vectors.largest_length(), f32::INFINITY, "{spoilt} at node {node}");
            }
        }
    }

    #[test]
    fn padding_is_readable_and_zero() {
        for count in [1, 15, 16, 17, 1000] {
            let mut vectors = Vectors::zeros(count).expect("memory");
            for node in 0..count {
                vectors.set(node, Vec3::splat(1.0 + node as f32));
            }
            for (axis, padded) in vectors.axes().into_iter().zip(vectors.view().axes) {
                assert!(axis.as_ptr().addr().is_multiple_of(64));
                assert_eq!(&padded[MARGIN..MARGIN + count], axis);
                assert!(padded.len() >= MARGIN + count.next_multiple_of(16) + MARGIN);
                let spare = padded[..MARGIN].iter().chain(&padded[MARGIN + count..]);
                assert!(spare.into_iter().all(|&number| number == 0.0));
            }
        }
    }
}
