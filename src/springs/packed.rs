//! Springs laid out for the processor: every node's links side by side, one array per property.
//!
//! Each spring is kept at both of its nodes, so that the force on a node is a sum over its own row, nothing is written
//! but that node, and the sum is the same in whatever order nodes are visited. A row that is full moves to the end of
//! the arrays with twice the room; once more than half of the places are abandoned, the rows are packed again.

use glam::Vec3;

use super::law::separation;
use super::{Link, Springs, TileForces, tile_nodes};
use crate::body::{Spring, Vectors};
use crate::error::{Error, Result};
use crate::memory;

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

impl Springs for Packed {
    fn damped(&self) -> bool {
        self.damped
    }

    fn spring_count(&self) -> usize {
        self.spring_count
    }

    fn bytes(&self) -> (usize, usize) {
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

    fn visit(&self, node: usize, see: &mut dyn FnMut(Link)) {
        for place in self.rows[node].links() {
            see(Link {
                neighbour: self.neighbours[place],
                stiffness: self.stiffnesses[place],
                rest_length: self.rest_lengths[place],
                damping: if self.damped { self.dampings[place] } else { 0.0 },
            });
        }
    }

    fn forces(&self, tile: usize, positions: &Vectors, velocities: Option<&Vectors>, forces: &mut TileForces) {
        for (place, node) in tile_nodes(tile, self.rows.len()).enumerate() {
            let mut force = Vec3::ZERO;
            for link in self.rows[node].links() {
                let neighbour = self.neighbours[link] as usize;
                let (length, direction) = separation(node, neighbour, positions.get(neighbour) - positions.get(node));
                let rate = velocities.map_or(0.0, |velocities| {
                    self.dampings[link] * direction.dot(velocities.get(neighbour) - velocities.get(node))
                });
                force += direction * (self.stiffnesses[link] * (length - self.rest_lengths[link]) + rate);
            }
            forces.set(place, force);
        }
    }

    fn add(&mut self, spring: &Spring) -> Result<()> {
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

    fn remove(&mut self, a: u32, b: u32) -> Result<()> {
        let (Some(at_a), Some(at_b)) = (self.place_of(a, b), self.place_of(b, a)) else {
            return Err(Error::invalid(format!("nodes {a} and {b} have no spring")));
        };
        self.remove_link(a, at_a);
        self.remove_link(b, at_b);
        self.spring_count -= 1;
        Ok(())
    }
}
