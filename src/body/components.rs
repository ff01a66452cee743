//! The connected components of a body.

use super::Body;
use crate::base::{DisjointSets, Result, memory};

/// The connected components of a body.
///
/// ```
/// # use glam::vec3;
/// # use sinew::cutting::Sweep;
#[doc = include_str!("../doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// # let sheet = world.create_body(&BodyDefinition { spare_nodes: 200, ..cloth })?;
/// # let edge = |z| [vec3(0.003, -0.01, z), vec3(0.003, 0.01, z)];
/// # let across = Sweep { start: edge(-0.06), end: edge(0.06) };
/// world.cut(sheet, &across)?;
/// let pieces = world.body(sheet)?.pieces()?;
/// assert_eq!(pieces.count, 2);
/// assert_ne!(pieces.of_nodes[0], pieces.of_nodes[4]);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Pieces {
    /// The component of each node. Components are numbered from 0 in the order of their lowest nodes.
    pub of_nodes: Vec<u32>,
    /// The number of components.
    pub count: u32,
}

impl Body {
    /// The components of the body, connected by springs, elements and the surface. The cost is proportional to the
    /// body.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub fn pieces(&self) -> Result<Pieces> {
        let count = self.node_count();
        let order = &self.system.order;
        let mut sets = DisjointSets::new(count)?;
        let mut unite_nodes = |a: u32, b: u32| sets.unite(a as usize, b as usize);
        self.system
            .forces
            .visit_joined(&mut |a, b| unite_nodes(order.caller(a), order.caller(b)));
        for &[a, b, c] in &self.system.surface {
            unite_nodes(a, b);
            unite_nodes(a, c);
        }
        for bound in self.system.bindings.iter().flat_map(|bindings| bindings.iter()) {
            for (node, _) in bound.weighted_nodes() {
                unite_nodes(order.caller(bound.node), order.caller(node));
            }
        }
        let lowest = sets.into_lowest();
        let mut count = 0;
        let mut of_nodes: Vec<u32> = memory::reserved(lowest.len())?;
        for (node, &first) in (0..).zip(&lowest) {
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
