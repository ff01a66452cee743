//! Links that fill no column, of any nodes of a tile, in the order of their nodes.

use std::ops::Range;

use super::layout::Line;
use crate::base::Result;
use crate::codec::saved;
use crate::order::LANES;
use crate::springs::Link;

/// Links beside the columns of a tile.
#[derive(Debug)]
pub(crate) struct Strays {
    /// The tile's first node.
    first: usize,
    /// Nodes of the body.
    node_count: usize,
    damped: bool,
    /// The nodes, counted from the tile's first.
    places: Vec<u16>,
    neighbours: Vec<u32>,
    stiffnesses: Vec<f32>,
    rest_lengths: Vec<f32>,
    dampings: Vec<f32>,
}

saved! { Strays { first, node_count, damped, places, neighbours, stiffnesses, rest_lengths, dampings } }

/// Sixteen strays, or fewer at the end, as the kernel takes them.
pub(super) struct Batch {
    pub count: usize,
    /// The nodes, counted from the tile's first.
    pub places: [u16; LANES],
    pub nodes: [u32; LANES],
    pub neighbours: [u32; LANES],
    pub stiffnesses: Line,
    pub rest_lengths: Line,
    pub dampings: Line,
}

impl Strays {
    pub(super) fn new(first: usize, node_count: usize, damped: bool) -> Self {
        Self {
            first,
            node_count,
            damped,
            places: Vec::new(),
            neighbours: Vec::new(),
            stiffnesses: Vec::new(),
            rest_lengths: Vec::new(),
            dampings: Vec::new(),
        }
    }

    /// The body has so many nodes now.
    pub(super) fn reach(&mut self, node_count: usize) {
        self.node_count = self.node_count.max(node_count);
    }

    /// The body has no more nodes than so many now.
    pub(super) fn shrink(&mut self, node_count: usize) {
        self.node_count = self.node_count.min(node_count);
    }

    pub fn len(&self) -> usize {
        self.places.len()
    }

    /// Makes room for `count` more.
    pub fn reserve(&mut self, count: usize) -> Result<()> {
        self.places.try_reserve(count)?;
        self.neighbours.try_reserve(count)?;
        self.stiffnesses.try_reserve(count)?;
        self.rest_lengths.try_reserve(count)?;
        if self.damped {
            self.dampings.try_reserve(count)?;
        }
        Ok(())
    }

    /// Puts in a link of `node`, for which there is room.
    pub fn insert(&mut self, node: usize, link: &Link) {
        assert!((link.neighbour as usize) < self.node_count && node < self.node_count);
        let place = (node - self.first) as u16;
        let index = self.places.partition_point(|&other| other <= place);
        self.places.insert(index, place);
        self.neighbours.insert(index, link.neighbour);
        self.stiffnesses.insert(index, link.stiffness);
        self.rest_lengths.insert(index, link.rest_length);
        if self.damped {
            self.dampings.insert(index, link.damping);
        }
    }

    /// Gives the link from `node` other parameters, where it is here.
    pub fn set(&mut self, node: usize, link: &Link) {
        if let Some(index) = self.find(node, link.neighbour as usize) {
            self.stiffnesses[index] = link.stiffness;
            self.rest_lengths[index] = link.rest_length;
            if self.damped {
                self.dampings[index] = link.damping;
            }
        }
    }

    /// Takes out the link from `node` to `neighbour`; whether there was one.
    pub fn remove(&mut self, node: usize, neighbour: usize) -> bool {
        let found = self.find(node, neighbour);
        if let Some(index) = found {
            self.places.remove(index);
            self.neighbours.remove(index);
            self.stiffnesses.remove(index);
            self.rest_lengths.remove(index);
            if self.damped {
                self.dampings.remove(index);
            }
        }
        found.is_some()
    }

    /// Shows the links of `node`.
    pub fn visit(&self, node: usize, see: &mut dyn FnMut(Link)) {
        for index in self.of(node) {
            see(Link {
                neighbour: self.neighbours[index],
                stiffness: self.stiffnesses[index],
                rest_length: self.rest_lengths[index],
                damping: if self.damped { self.dampings[index] } else { 0.0 },
            });
        }
    }

    /// Bytes in use, and bytes held from the allocator.
    pub fn bytes(&self) -> (usize, usize) {
        let used = size_of_val(&*self.places)
            + size_of_val(&*self.neighbours)
            + size_of_val(&*self.stiffnesses)
            + size_of_val(&*self.rest_lengths)
            + size_of_val(&*self.dampings);
        let floats = self.stiffnesses.capacity() + self.rest_lengths.capacity() + self.dampings.capacity();
        let held = self.places.capacity() * size_of::<u16>()
            + self.neighbours.capacity() * size_of::<u32>()
            + floats * size_of::<f32>();
        (used, held)
    }

    fn find(&self, node: usize, neighbour: usize) -> Option<usize> {
        self.of(node)
            .find(|&index| self.neighbours[index] as usize == neighbour)
    }

    /// The indices of a node's.
    fn of(&self, node: usize) -> Range<usize> {
        let place = node - self.first;
        let start = self.places.partition_point(|&other| usize::from(other) < place);
        let count = self.places[start..].partition_point(|&other| usize::from(other) == place);
        start..start + count
    }

    /// Whether these are strays of `nodes` in a body of `node_count` that lead to nodes that are read.
    pub(super) fn are_sound(
        &self,
        nodes: Range<usize>,
        node_count: usize,
        damped: bool,
        is_read: impl Fn(isize) -> bool,
    ) -> bool {
        let count = self.len();
        self.first == nodes.start
            && self.node_count <= node_count
            && self.damped == damped
            && [self.neighbours.len(), self.stiffnesses.len(), self.rest_lengths.len()] == [count; 3]
            && self.dampings.len() == if damped { count } else { 0 }
            && self.places.is_sorted()
            && self.places.iter().all(|&place| usize::from(place) < nodes.len())
            && self
                .neighbours
                .iter()
                .all(|&node| (node as usize) < node_count && is_read(node as isize))
    }

    pub(super) fn batch_count(&self) -> usize {
        self.len().div_ceil(LANES)
    }

    /// Sixteen of them; lanes beyond the last repeat it.
    #[inline(always)]
    pub(super) fn batch(&self, batch: usize) -> Batch {
        let start = batch * LANES;
        let places: [u16; LANES] = sixteen(&self.places[start..]);
        Batch {
            count: (self.len() - start).min(LANES),
            places,
            nodes: places.map(|place| (self.first + usize::from(place)) as u32),
            neighbours: sixteen(&self.neighbours[start..]),
            stiffnesses: Line(sixteen(&self.stiffnesses[start..])),
            rest_lengths: Line(sixteen(&self.rest_lengths[start..])),
            dampings: if self.damped {
                Line(sixteen(&self.dampings[start..]))
            } else {
                Line::ZERO
            },
        }
    }
}

/// The first sixteen; where there are fewer, the last of them again.
#[inline(always)]
fn sixteen<T: Copy>(values: &[T]) -> [T; LANES] {
    match values.first_chunk() {
        Some(whole) => *whole,
        None => std::array::from_fn(|lane| values[lane.min(values.len() - 1)]),
    }
}
