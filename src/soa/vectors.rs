//! Vectors of all nodes as structure of arrays, laid out for kernels that take sixteen nodes at a time.

use super::PerNode;
use std::ops::Range;

use glam::Vec3;

use super::Records;
use super::TILE;
use crate::base::{Result, memory};
use crate::codec::{Reader, Saved, Writer, floats_into};
use crate::simd::Record;
use crate::threads::{Ragged, Tiles};

/// How many numbers there are to spare on either side: a kernel that takes the neighbours of sixteen nodes in one load may
/// read so far beyond the ends.
pub(crate) const MARGIN: usize = 16;

/// Numbers in a cache line.
const LINE: usize = 16;

/// Numbers in a memory page. Arrays that begin at the same place of a page get in each other's way: a load waits for the store before it where their
/// addresses agree in the last twelve bits.
const PAGE: usize = 1024;

/// An axis that is longer than a page begins so many numbers further into its page than the one before it.
const SKEW: usize = 21 * LINE;

/// Vectors of some nodes in a row, to be read; at the ends of a body also the numbers to spare beyond them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View<'a> {
    axes: [&'a [f32]; 3],
    /// What would be the number of the node that the first belongs to.
    start: isize,
    /// The same vectors from node 0 on, where they are there as records.
    records: Option<&'a [Record]>,
}

/// Where the vectors of node 0 would be, whether or not they are there.
#[derive(Clone, Copy)]
pub(crate) struct Places {
    pub axes: [*const f32; 3],
    pub records: Option<*const Record>,
}

impl<'a> View<'a> {
    /// Vectors along each axis from the node of this number on.
    pub fn new(axes: [&'a [f32]; 3], start: isize) -> Self {
        Self {
            axes,
            start,
            records: None,
        }
    }

    /// With the same vectors as records.
    pub fn with_records(self, records: Option<&'a Records>) -> Self {
        Self {
            records: records.map(Records::as_slice),
            ..self
        }
    }

    /// Whether all of these may be read, and all nodes of the body where they are records.
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

    /// The same vectors from node 0 on as records, none where there are none.
    #[inline(always)]
    pub fn records(&self) -> &'a [Record] {
        self.records.unwrap_or(&[])
    }

    pub fn has_records(&self) -> bool {
        self.records.is_some()
    }

    /// Those of some nodes along each axis.
    #[inline(always)]
    pub fn slices(&self, nodes: Range<usize>) -> [&'a [f32]; 3] {
        let place = |node: usize| (node as isize - self.start) as usize;
        self.axes.map(|axis| &axis[place(nodes.start)..place(nodes.end)])
    }

    /// Where node 0 would be.
    #[inline(always)]
    pub fn places(&self) -> Places {
        Places {
            axes: self.axes.map(|axis| axis.as_ptr().wrapping_offset(-self.start)),
            records: self.records.map(<[Record]>::as_ptr),
        }
    }
}

/// One vector per node: a number per node along each axis, the first aligned to a cache line, with zeros on both sides that may be read.
#[derive(Debug)]
pub(crate) struct Vectors {
    values: Vec<f32>,
    /// The place of node 0 along the first axis, and how far it is from there to the next axis.
    first: usize,
    stride: usize,
    count: usize,
}

/// Where they lie in memory is not kept, but how much room there is.
impl Saved for Vectors {
    const SHAPE: u64 = Vec::<Vec3>::SHAPE;
    const LEAST: usize = 16;

    fn save(&self, to: &mut Writer) {
        self.len().save(to);
        self.room().save(to);
        to.needs(3 * size_of::<f32>() * self.room());
        for axis in self.axes() {
            f32::save_all(axis, to);
        }
    }

    fn load(from: &mut Reader) -> Result<Self> {
        let (count, room) = (usize::load(from)?, usize::load(from)?);
        if room < count || !room.is_multiple_of(LINE) {
            return Err(from.refusal("vectors have not the room that they take"));
        }
        from.will_take(room.checked_mul(3 * size_of::<f32>()))?;
        let mut vectors = Self::with_room(count, room)?;
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
    /// `count` zero vectors.
    pub fn zeros(count: usize) -> Result<Self> {
        Self::with_room(count, count)
    }

    /// The same with room for `room` vectors, at least as many, to be grown into.
    fn with_room(count: usize, room: usize) -> Result<Self> {
        let least = room.next_multiple_of(LINE) + 2 * MARGIN;
        let stride = if least < PAGE {
            least
        } else {
            (least - SKEW).next_multiple_of(PAGE) + SKEW
        };
        let values = memory::filled(0.0_f32, LINE + 3 * stride)?;
        // What cannot be aligned is not, and only slower.
        let aligned = values.as_ptr().align_offset(LINE * size_of::<f32>()).min(LINE);
        Ok(Self {
            values,
            first: aligned + MARGIN,
            stride,
            count,
        })
    }

    /// Makes room for so many vectors in all.
    pub fn reserve(&mut self, count: usize) -> Result<()> {
        if count > self.room() {
            let mut roomier = Self::with_room(self.count, count)?;
            roomier.copy_from(self);
            *self = roomier;
        }
        Ok(())
    }

    /// Adds zero vectors, for which there is room, up to so many in all.
    pub fn grow(&mut self, count: usize) {
        assert!(count <= self.room());
        self.count = self.count.max(count);
    }

    /// So many vectors may there be, a multiple of a line's.
    fn room(&self) -> usize {
        self.stride - 2 * MARGIN
    }

    /// The places of the numbers along an axis, with a margin before the first and one after the last block of sixteen.
    #[inline(always)]
    fn padded_places(&self, axis: usize) -> Range<usize> {
        let start = self.first - MARGIN + axis * self.stride;
        start..start + self.count.next_multiple_of(LINE) + 2 * MARGIN
    }

    /// The numbers along each axis with those margins.
    #[inline(always)]
    fn padded_mut(&mut self) -> [&mut [f32]; 3] {
        let all = self.padded_places(0);
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

    /// The coordinates along each axis.
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

    /// The coordinates of some nodes along each axis.
    #[inline(always)]
    pub fn slices(&self, nodes: Range<usize>) -> [&[f32]; 3] {
        self.axes().map(|axis| &axis[nodes.clone()])
    }

    /// The coordinates along each axis, tile by tile.
    pub fn tiles_mut(&mut self) -> [Tiles<'_, f32>; 3] {
        self.axes_mut().map(|axis| Tiles::new(axis, TILE))
    }

    /// All of them, to be read, with the margins on both sides.
    #[inline(always)]
    pub fn view(&self) -> View<'_> {
        View {
            axes: [0, 1, 2].map(|axis| &self.values[self.padded_places(axis)]),
            start: -(MARGIN as isize),
            records: None,
        }
    }

    /// The coordinates along each axis cut into pieces, each from the first node of a tile on; the first piece has the margin
    /// before it and the last the margin after it. `starts` are to be those of [`Vectors::piece_start`].
    pub fn pieces_mut<'a>(&'a mut self, starts: &'a [usize]) -> [Ragged<'a, f32>; 3] {
        self.padded_mut().map(|axis| Ragged::new(axis, starts))
    }

    /// Where a piece begins that begins with this tile.
    pub fn piece_start(tile: usize) -> usize {
        if tile == 0 { 0 } else { MARGIN + tile * TILE }
    }

    /// What would be the number of the node that such a piece begins with.
    pub fn piece_node(tile: usize) -> isize {
        Self::piece_start(tile) as isize - MARGIN as isize
    }

    /// All of them, in order.
    pub fn iter(&self) -> impl Iterator<Item = Vec3> + '_ {
        let [x, y, z] = self.axes();
        x.iter().zip(y).zip(z).map(|((&x, &y), &z)| Vec3::new(x, y, z))
    }

    /// Copies all of `other`, which has as many.
    pub fn copy_from(&mut self, other: &Self) {
        copy_axes(&mut self.axes_mut(), other.axes());
    }

    /// Sets every vector to zero.
    pub fn clear(&mut self) {
        for axis in self.axes_mut() {
            axis.fill(0.0);
        }
    }

    /// The length of the longest of them; infinite where one is not finite.
    pub fn largest_length(&self) -> f32 {
        largest(self.iter().map(|vector| vector.length_squared()))
    }

    /// The longest way between a vector and that of `other` at its place; infinite where one is not finite.
    pub fn largest_distance(&self, other: &Self) -> f32 {
        largest(self.iter().zip(other.iter()).map(|(a, b)| a.distance_squared(b)))
    }
}

/// The root of the largest of `squares`; infinite where one is not finite.
fn largest(squares: impl Iterator<Item = f32>) -> f32 {
    // Bits of numbers not below 0 are in their order, what is infinite and what is not a number above all others.
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
    fn what_is_not_finite_is_seen_wherever_it_is() {
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
    fn kernels_may_read_beyond_both_ends() {
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
