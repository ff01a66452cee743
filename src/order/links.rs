//! The springs of each node.

use super::Costs;
use crate::Result;
use crate::base::memory;

/// The number of groups: the processor can write to this many streams concurrently.
const GROUPS: usize = 256;

/// The neighbors of each node, in the order of its springs.
pub(super) struct Links {
    /// The start of each node's neighbors, with one more entry at the end.
    starts: Vec<usize>,
    neighbors: Vec<u32>,
    /// The costs of the springs' columns.
    pub costs: Costs,
}

impl Links {
    /// The links of nodes where node `n` of the springs is renumbered to `names[n]`.
    pub fn new(springs: &[[u32; 2]], names: &[u32], costs: Costs) -> Result<Self> {
        let ends = ends(springs, names)?;
        // Counted one entry late, so that filling advances each start to its final value.
        let mut starts = memory::filled(0_usize, names.len() + 2)?;
        for &[node, _] in &ends {
            starts[node as usize + 2] += 1;
        }
        for node in 2..starts.len() {
            starts[node] += starts[node - 1];
        }
        let mut neighbors = memory::filled(0, ends.len())?;
        for &[node, neighbor] in &ends {
            let slot = &mut starts[node as usize + 1];
            neighbors[*slot] = neighbor;
            *slot += 1;
        }
        starts.pop();
        Ok(Self {
            starts,
            neighbors,
            costs,
        })
    }

    pub fn node_count(&self) -> usize {
        self.starts.len() - 1
    }

    /// The number of links: twice the number of springs.
    pub fn count(&self) -> usize {
        self.neighbors.len()
    }

    pub fn neighbors(&self, node: u32) -> &[u32] {
        let node = node as usize;
        &self.neighbors[self.starts[node]..self.starts[node + 1]]
    }

    pub fn degree(&self, node: u32) -> usize {
        self.neighbors(node).len()
    }
}

/// Both ends of each spring, sorted by the leading bits of the node. Work per node then stays in the caches, many times
/// as fast for springs in random order.
fn ends(springs: &[[u32; 2]], names: &[u32]) -> Result<Vec<[u32; 2]>> {
    let shift = (usize::BITS - names.len().leading_zeros()).saturating_sub(GROUPS.ilog2());
    let group = |node: u32| node as usize >> shift;
    let mut renamed = memory::reserved(springs.len())?;
    let mut starts = [0_usize; GROUPS + 1];
    for spring in springs {
        let [a, b] = spring.map(|node| names[node as usize]);
        starts[group(a) + 1] += 1;
        starts[group(b) + 1] += 1;
        renamed.push([a, b]);
    }
    for group in 0..GROUPS {
        starts[group + 1] += starts[group];
    }
    let mut ends = memory::filled([0; 2], 2 * springs.len())?;
    for &[a, b] in &renamed {
        for end in [[a, b], [b, a]] {
            let slot = &mut starts[group(end[0])];
            ends[*slot] = end;
            *slot += 1;
        }
    }
    Ok(ends)
}
