//! The springs of each node.

use crate::Result;
use crate::memory;

/// For each node the nodes it has springs to, in the order of the springs.
pub(super) struct Links {
    /// Where the neighbours of each node begin; one more entry at the end.
    starts: Vec<usize>,
    neighbours: Vec<u32>,
}

impl Links {
    /// The links of nodes of which number `n` of the springs is called `names[n]`.
    pub fn new(springs: &[[u32; 2]], names: &[u32]) -> Result<Self> {
        // Counted one place late, so that filling in moves each start to its place.
        let mut starts = memory::filled(0_usize, names.len() + 2)?;
        let mut renamed = memory::reserved(springs.len())?;
        for spring in springs {
            let [a, b] = spring.map(|node| names[node as usize]);
            starts[a as usize + 2] += 1;
            starts[b as usize + 2] += 1;
            renamed.push([a, b]);
        }
        for node in 2..starts.len() {
            starts[node] += starts[node - 1];
        }
        let mut neighbours = memory::filled(0, 2 * springs.len())?;
        for &[a, b] in &renamed {
            for (node, neighbour) in [(a, b), (b, a)] {
                let place = &mut starts[node as usize + 1];
                neighbours[*place] = neighbour;
                *place += 1;
            }
        }
        starts.pop();
        Ok(Self { starts, neighbours })
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
