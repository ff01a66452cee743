//! Springs laid out for the processor: every node's links side by side, one array per property.
//!
//! Each spring is kept at both of its nodes, so that the force on a node is a sum over its own row, nothing is written
//! but that node, and the sum is the same in whatever order nodes are visited. A row that is full moves to the end of
//! the arrays with twice the room; once more than half of the places are abandoned, the rows are packed again.

use glam::Vec3A;

use super::law::separation;
use crate::body::{Spring, Vectors};
use crate::error::{Error, Result};
use crate::memory;

/// One end of a spring, as the node at the other end sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Link {
    pub neighbour: u32,
    pub stiffness: f32,
    pub rest_length: f32,
    pub damping: f32,
}

/// The places of one node's links.
#[derive(Clone, Copy, Debug, Default)]
struct Row {
    first: usize,
    count: u32,
    capacity: u32,
}

impl Row {
    fn links(self) -> std::ops::Range<usize> {
        self.first..self.first + self.count as usize
    }
}

/// Springs as rows of links.
#[derive(Debug)]
pub(crate) struct Packed {
    rows: Vec<Row>,
    neighbours: Vec<u32>,
    stiffnesses: Vec<f32>,
    rest_lengths: Vec<f32>,
    /// Empty in a body whose springs have no damping.
    dampings: Vec<f32>,
    damped: bool,
    spring_count: usize,
    abandoned: usize,
}

impl Packed {
    /// Packs `springs` of `node_count` nodes.
    pub fn new(node_count: usize, springs: &[Spring]) -> Result<Self> {
        let mut rows = memory::filled(Row::default(), node_count)?;
        for spring in springs {
            for node in spring.nodes {
                rows[node as usize].capacity += 1;
            }
        }
        let mut places = 0;
        for row in &mut rows {
            row.first = places;
            places += row.capacity as usize;
        }
        let damped = springs.iter().any(|spring| spring.damping != 0.0);
        let mut packed = Self {
            rows,
            neighbours: memory::filled(0, places)?,
            stiffnesses: memory::filled(0.0, places)?,
            rest_lengths: memory::filled(0.0, places)?,
            dampings: memory::filled(0.0, if damped { places } else { 0 })?,
            damped,
            spring_count: springs.len(),
            abandoned: 0,
        };
        for spring in springs {
            packed.push_both(spring);
        }
        Ok(packed)
    }

    /// Whether any spring has damping.
    pub fn damped(&self) -> bool {
        self.damped
    }

    pub fn spring_count(&self) -> usize {
        self.spring_count
    }

    /// Bytes taken by the springs that exist, and bytes held from the allocator.
    pub fn bytes(&self) -> (usize, usize) {
        let link = 3 * size_of::<f32>() + if self.damped { size_of::<f32>() } else { 0 };
        let rows = self.rows.len() * size_of::<Row>();
        let held = self.rows.capacity() * size_of::<Row>()
            + (self.neighbours.capacity()
                + self.stiffnesses.capacity()
                + self.rest_lengths.capacity()
                + self.dampings.capacity())
                * size_of::<f32>();
        (rows + 2 * self.spring_count * link, held)
    }

    /// The links of `node`.
    #[inline]
    pub fn links(&self, node: usize) -> impl Iterator<Item = Link> + '_ {
        self.rows[node].links().map(|place| Link {
            neighbour: self.neighbours[place],
            stiffness: self.stiffnesses[place],
            rest_length: self.rest_lengths[place],
            damping: if self.damped { self.dampings[place] } else { 0.0 },
        })
    }

    /// The force of all springs on `node`, in newtons.
    #[inline(always)]
    pub fn force(&self, node: usize, positions: &Vectors) -> Vec3A {
        let position = positions.lanes(node);
        let links = self.rows[node].links();
        let neighbours = &self.neighbours[links.clone()];
        let stiffnesses = &self.stiffnesses[links.clone()];
        let rest_lengths = &self.rest_lengths[links];
        let mut force = Vec3A::ZERO;
        for ((&neighbour, &stiffness), &rest_length) in neighbours.iter().zip(stiffnesses).zip(rest_lengths) {
            let neighbour = neighbour as usize;
            let (length, direction) = separation(node, neighbour, positions.lanes(neighbour) - position);
            force += direction * (stiffness * (length - rest_length));
        }
        force
    }

    /// The force of all springs and of the damping along them on `node`, in newtons; for springs with damping alone.
    #[inline(always)]
    pub fn damped_force(&self, node: usize, positions: &Vectors, velocities: &Vectors) -> Vec3A {
        let (position, velocity) = (positions.lanes(node), velocities.lanes(node));
        let links = self.rows[node].links();
        let springs = self.stiffnesses[links.clone()]
            .iter()
            .zip(&self.rest_lengths[links.clone()])
            .zip(&self.dampings[links.clone()]);
        let mut force = Vec3A::ZERO;
        for (&neighbour, ((&stiffness, &rest_length), &damping)) in self.neighbours[links].iter().zip(springs) {
            let neighbour = neighbour as usize;
            let (length, direction) = separation(node, neighbour, positions.lanes(neighbour) - position);
            let rate = direction.dot(velocities.lanes(neighbour) - velocity);
            force += direction * (stiffness * (length - rest_length) + damping * rate);
        }
        force
    }

    /// [`Packed::damped_force`] where velocities are given, else [`Packed::force`].
    #[inline(always)]
    pub fn force_at(&self, node: usize, positions: &Vectors, velocities: Option<&Vectors>) -> Vec3A {
        match velocities {
            None => self.force(node, positions),
            Some(velocities) => self.damped_force(node, positions, velocities),
        }
    }

    /// Adds a spring; refused where the pair has one already. Its damping counts only in a body whose springs have some.
    pub fn add(&mut self, spring: &Spring) -> Result<()> {
        let [a, b] = spring.nodes;
        if self.place_of(a, b).is_some() {
            return Err(Error::invalid(format!("nodes {a} and {b} have a spring already")));
        }
        self.make_room(a)?;
        self.make_room(b)?;
        self.push_both(spring);
        self.spring_count += 1;
        Ok(())
    }

    /// Removes the spring between `a` and `b`; refused where there is none.
    pub fn remove(&mut self, a: u32, b: u32) -> Result<()> {
        let (Some(at_a), Some(at_b)) = (self.place_of(a, b), self.place_of(b, a)) else {
            return Err(Error::invalid(format!("nodes {a} and {b} have no spring")));
        };
        self.remove_link(a, at_a);
        self.remove_link(b, at_b);
        self.spring_count -= 1;
        Ok(())
    }

    fn place_of(&self, node: u32, neighbour: u32) -> Option<usize> {
        self.rows[node as usize]
            .links()
            .find(|&place| self.neighbours[place] == neighbour)
    }

    fn remove_link(&mut self, node: u32, place: usize) {
        let row = &mut self.rows[node as usize];
        row.count -= 1;
        let last = row.first + row.count as usize;
        self.copy_link(last, place);
    }

    fn copy_link(&mut self, from: usize, to: usize) {
        self.neighbours[to] = self.neighbours[from];
        self.stiffnesses[to] = self.stiffnesses[from];
        self.rest_lengths[to] = self.rest_lengths[from];
        if self.damped {
            self.dampings[to] = self.dampings[from];
        }
    }

    fn push_both(&mut self, spring: &Spring) {
        let [a, b] = spring.nodes;
        for (node, neighbour) in [(a, b), (b, a)] {
            let row = &mut self.rows[node as usize];
            let place = row.first + row.count as usize;
            row.count += 1;
            self.neighbours[place] = neighbour;
            self.stiffnesses[place] = spring.stiffness;
            self.rest_lengths[place] = spring.rest_length;
            if self.damped {
                self.dampings[place] = spring.damping;
            }
        }
    }

    /// Makes sure that one more link of `node` has a place; existing links keep their order.
    fn make_room(&mut self, node: u32) -> Result<()> {
        let row = self.rows[node as usize];
        if row.count < row.capacity {
            return Ok(());
        }
        if self.abandoned > self.neighbours.len() / 2 {
            self.pack()?;
        }
        let row = self.rows[node as usize];
        let capacity = (2 * row.capacity).max(4);
        self.grow(capacity as usize)?;
        let first = self.neighbours.len() - capacity as usize;
        for (offset, place) in row.links().enumerate() {
            self.copy_link(place, first + offset);
        }
        self.abandoned += row.capacity as usize;
        self.rows[node as usize] = Row { first, capacity, ..row };
        Ok(())
    }

    fn grow(&mut self, places: usize) -> Result<()> {
        self.neighbours.try_reserve(places)?;
        self.stiffnesses.try_reserve(places)?;
        self.rest_lengths.try_reserve(places)?;
        if self.damped {
            self.dampings.try_reserve(places)?;
        }
        let length = self.neighbours.len() + places;
        self.neighbours.resize(length, 0);
        self.stiffnesses.resize(length, 0.0);
        self.rest_lengths.resize(length, 0.0);
        if self.damped {
            self.dampings.resize(length, 0.0);
        }
        Ok(())
    }

    /// Writes the rows side by side again, without the places that were abandoned.
    fn pack(&mut self) -> Result<()> {
        let places = self.rows.iter().map(|row| row.capacity as usize).sum();
        let mut packed = Self {
            rows: memory::copied(&self.rows)?,
            neighbours: memory::filled(0, places)?,
            stiffnesses: memory::filled(0.0, places)?,
            rest_lengths: memory::filled(0.0, places)?,
            dampings: memory::filled(0.0, if self.damped { places } else { 0 })?,
            ..*self
        };
        packed.abandoned = 0;
        let mut first = 0;
        for (row, old) in packed.rows.iter_mut().zip(&self.rows) {
            row.first = first;
            for (to, from) in (first..).zip(old.links()) {
                packed.neighbours[to] = self.neighbours[from];
                packed.stiffnesses[to] = self.stiffnesses[from];
                packed.rest_lengths[to] = self.rest_lengths[from];
                if self.damped {
                    packed.dampings[to] = self.dampings[from];
                }
            }
            first += row.capacity as usize;
        }
        *self = packed;
        Ok(())
    }
}
