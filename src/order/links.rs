//! The springs of each node.

use super::Costs;
use crate::Result;
use crate::base::memory;

/// As many as the processor writes to side by side.
const GROUPS: usize = 256;

/// For each node the nodes it has springs to, in the order of the springs.
pub(super) struct Links {
    /// Where the neighbours of each node begin; one more entry at the end.
    starts: Vec<usize>,
    neighbours: Vec<u32>,
    /// What they cost.
    pub costs: Costs,
}

impl Links {
    /// The links of nodes of which number `n` of the springs is called `names[n]`.
    pub fn new(springs: &[[u32; 2]], names: &[u32], costs: Costs) -> Result<Self> {
        let ends = ends(springs, names)?;
        // Counted one place late, so that filling in moves each start to its place.
        let mut starts = memory::filled(0_usize, names.len() + 2)?;
        for &[node, _] in &ends {
            starts[node as usize + 2] += 1;
        }
        for node in 2..starts.len() {
            starts[node] += starts[node - 1];
        }
        let mut neighbours = memory::filled(0, ends.len())?;
        for &[node, neighbour] in &ends {
            let place = &mut starts[node as usize + 1];
            neighbours[*place] = neighbour;
            *place += 1;
        }
        starts.pop();
        Ok(Self {
            starts,
            neighbours,
            costs,
        })
    }

    pub fn node_count(&self) -> usize {
        self.starts.len() - 1
    }

    /// Twice the springs.
    pub fn count(&self) -> usize {
        self.neighbours.len()
    }

    pub fn of(&self, node: u32) -> &[u32] {
        let node = node as usize;
        &self.neighbours[self.starts[node]..self.starts[node + 1]]
    }

    pub fn degree(&self, node: u32) -> usize {
        self.of(node).len()
    }
}

/// Both ends of each spring, the other one after it, sorted by the leading bits of the node: what is then done for each node
/// stays in the caches, many times as fast where springs are given in random order.
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
            let place = &mut starts[group(end[0])];
            ends[*place] = end;
            *place += 1;
        }
    }
    Ok(ends)
}
