//! The springs of a body as rows of a matrix: each once, at its node with the higher number.

use std::ops::Range;

use crate::error::Result;
use crate::memory;
use crate::springs::{Link, Springs};

/// For each node the springs to nodes of lower numbers, in their order.
#[derive(Debug)]
pub(super) struct Network {
    /// Where the row of each node begins, and the end of the last.
    starts: Vec<usize>,
    links: Vec<Link>,
}

impl Network {
    /// With room for so many.
    pub fn new(node_count: usize, spring_count: usize) -> Result<Self> {
        Ok(Self {
            starts: memory::filled(0, node_count + 1)?,
            links: memory::reserved(spring_count)?,
        })
    }

    /// Makes room for so many springs in all.
    pub fn make_room(&mut self, spring_count: usize) -> Result<()> {
        let more = spring_count.saturating_sub(self.links.len());
        Ok(self.links.try_reserve(more)?)
    }

    /// Takes them from a body's storage, which allocates nothing where there is room for all.
    pub fn read(&mut self, springs: &dyn Springs) {
        self.links.clear();
        for node in 0..self.node_count() {
            let start = self.links.len();
            springs.visit(node, &mut |link| {
                if (link.neighbour as usize) < node {
                    self.links.push(link);
                }
            });
            self.links[start..].sort_unstable_by_key(|link| link.neighbour);
            self.starts[node + 1] = self.links.len();
        }
    }

    pub fn node_count(&self) -> usize {
        self.starts.len() - 1
    }

    pub fn spring_count(&self) -> usize {
        self.links.len()
    }

    /// The places of a node's springs.
    #[inline(always)]
    pub fn row(&self, node: usize) -> Range<usize> {
        self.starts[node]..self.starts[node + 1]
    }

    /// The other node of the spring at this place.
    #[inline(always)]
    pub fn neighbour(&self, place: usize) -> usize {
        self.links[place].neighbour as usize
    }

    /// Every spring with its place and its node of the higher number.
    pub fn springs(&self) -> impl Iterator<Item = (usize, usize, &Link)> {
        (0..self.node_count()).flat_map(move |node| self.row(node).map(move |place| (place, node, &self.links[place])))
    }
}
