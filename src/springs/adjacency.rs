//! Adjacency lists: the springs of each node.

use super::Link;
use crate::base::{Result, memory};
use crate::def::Spring;

/// Both ends of every spring, sorted by node. The links of a node keep the order of the springs.
pub(super) struct Adjacency<'a> {
    springs: &'a [Spring],
    /// The end of each node's range in `links`.
    link_ends: Vec<usize>,
    /// The neighbor and the spring of each link.
    links: Vec<(u32, u32)>,
}

impl<'a> Adjacency<'a> {
    /// Builds the lists of `springs` between `node_count` nodes.
    pub fn new(node_count: usize, springs: &'a [Spring]) -> Result<Self> {
        let mut link_ends = memory::filled(0, node_count + 1)?;
        for node in springs.iter().flat_map(|spring| spring.nodes) {
            link_ends[node as usize + 1] += 1;
        }
        for node in 0..node_count {
            link_ends[node + 1] += link_ends[node];
        }
        // Each entry is the start of the node's range. Every inserted link advances it by one.
        let mut links = memory::filled((0, 0), 2 * springs.len())?;
        for (index, &Spring { nodes: [a, b], .. }) in springs.iter().enumerate() {
            for (node, neighbor) in [(a, b), (b, a)] {
                let slot = &mut link_ends[node as usize];
                links[*slot] = (neighbor, index as u32);
                *slot += 1;
            }
        }
        link_ends.truncate(node_count);
        Ok(Self {
            springs,
            link_ends,
            links,
        })
    }

    /// The links of a node.
    pub fn links(&self, node: usize) -> impl ExactSizeIterator<Item = Link> + '_ {
        let start = if node == 0 { 0 } else { self.link_ends[node - 1] };
        self.links[start..self.link_ends[node]]
            .iter()
            .map(|&(neighbor, index)| {
                let spring = &self.springs[index as usize];
                Link {
                    neighbor,
                    stiffness: spring.stiffness,
                    rest_length: spring.rest_length,
                    damping: spring.damping,
                }
            })
    }

    /// The node with the most links, and its number of links.
    pub fn max_degree(&self) -> (usize, usize) {
        let counts = (0..self.link_ends.len()).map(|node| (node, self.links(node).len()));
        counts.fold(
            (0, 0),
            |max_degree, row| if row.1 > max_degree.1 { row } else { max_degree },
        )
    }
}
