//! The springs of a body, node by node.

use super::Link;
use crate::base::{Result, memory};
use crate::def::Spring;

/// Both ends of every spring, in the order of their nodes; those of a node in the order of its springs.
pub(super) struct Ends<'a> {
    springs: &'a [Spring],
    /// Where each node's ends end.
    ends: Vec<usize>,
    /// The node at the other end, and the spring.
    links: Vec<(u32, u32)>,
}

impl<'a> Ends<'a> {
    /// Sorts the ends of `springs` between `node_count` nodes.
    pub fn of(node_count: usize, springs: &'a [Spring]) -> Result<Self> {
        let mut ends = memory::filled(0, node_count + 1)?;
        for node in springs.iter().flat_map(|spring| spring.nodes) {
            ends[node as usize + 1] += 1;
        }
        for node in 0..node_count {
            ends[node + 1] += ends[node];
        }
        // So far each entry is where the node's ends begin; each end moves it on by one.
        let mut links = memory::filled((0, 0), 2 * springs.len())?;
        for (index, &Spring { nodes: [a, b], .. }) in springs.iter().enumerate() {
            for (node, neighbour) in [(a, b), (b, a)] {
                let place = &mut ends[node as usize];
                links[*place] = (neighbour, index as u32);
                *place += 1;
            }
        }
        ends.truncate(node_count);
        Ok(Self { springs, ends, links })
    }

    /// The links of a node.
    pub fn links(&self, node: usize) -> impl ExactSizeIterator<Item = Link> + '_ {
        let start = if node == 0 { 0 } else { self.ends[node - 1] };
        self.links[start..self.ends[node]].iter().map(|&(neighbour, index)| {
            let spring = &self.springs[index as usize];
            Link {
                neighbour,
                stiffness: spring.stiffness,
                rest_length: spring.rest_length,
                damping: spring.damping,
            }
        })
    }

    /// The node with the most links, and how many it has.
    pub fn longest(&self) -> (usize, usize) {
        let counts = (0..self.ends.len()).map(|node| (node, self.links(node).len()));
        counts.fold((0, 0), |longest, row| if row.1 > longest.1 { row } else { longest })
    }
}
