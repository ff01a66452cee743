//! Which pieces a body consists of.

use super::Body;
use crate::base::{Result, memory};

/// The pieces of a body.
#[derive(Clone, Debug, PartialEq)]
pub struct Pieces {
    /// Of each node, from 0 on in the order of the lowest nodes.
    pub of_nodes: Vec<u32>,
    /// How many there are.
    pub count: u32,
}

impl Body {
    /// Which nodes hang together, by springs, elements and the surface. All nodes are looked at.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub fn pieces(&self) -> Result<Pieces> {
        let count = self.node_count();
        let order = &self.system.order;
        let mut lowest: Vec<u32> = memory::reserved(count)?;
        lowest.extend(0..count as u32);
        let mut join = |a: u32, b: u32| unite(&mut lowest, order.caller(a), order.caller(b));
        self.system.forces.show_joined(&mut join);
        for &[a, b, c] in &self.system.surface {
            unite(&mut lowest, a, b);
            unite(&mut lowest, a, c);
        }
        for bound in self.system.bindings.iter().flat_map(|bindings| bindings.iter()) {
            for (node, _) in bound.parts() {
                unite(&mut lowest, order.caller(bound.node), order.caller(node));
            }
        }
        let mut count = 0;
        let mut of_nodes: Vec<u32> = memory::reserved(lowest.len())?;
        for node in 0..lowest.len() as u32 {
            let first = root(&mut lowest, node);
            if first == node {
                of_nodes.push(count);
                count += 1;
            } else {
                of_nodes.push(of_nodes[first as usize]);
            }
        }
        Ok(Pieces { of_nodes, count })
    }
}

/// The lowest node that hangs together with one, of those that were united.
fn root(lowest: &mut [u32], mut node: u32) -> u32 {
    while lowest[node as usize] != node {
        lowest[node as usize] = lowest[lowest[node as usize] as usize];
        node = lowest[node as usize];
    }
    node
}

fn unite(lowest: &mut [u32], a: u32, b: u32) {
    let (a, b) = (root(lowest, a), root(lowest, b));
    lowest[a.max(b) as usize] = a.min(b);
}
