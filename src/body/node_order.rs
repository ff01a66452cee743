//! The order of the nodes in memory.

use glam::Vec3;

use crate::base::{Result, memory};
use crate::def::{Rounding, Spring};
use crate::order::best_order;
use crate::soa::NodeOrder;
use crate::springs::costs;

/// The best order for these springs.
pub(super) fn order_for_springs(positions: &[Vec3], springs: &[Spring], rounding: Rounding) -> Result<NodeOrder> {
    let pairs = memory::collected(springs.iter().map(|spring| spring.nodes))?;
    match best_order(positions, &pairs, costs(springs, rounding)?)? {
        Some(order) => NodeOrder::new(order),
        None => Ok(NodeOrder::default()),
    }
}

/// The best order for the edges of these tetrahedra.
pub(super) fn order_for_tetrahedra(positions: &[Vec3], tetrahedra: &[[u32; 4]]) -> Result<NodeOrder> {
    let edges = crate::mesh::edges(&[], tetrahedra)?;
    let springs = memory::collected(edges.into_iter().map(|nodes| Spring {
        nodes,
        stiffness: 0.0,
        rest_length: 0.0,
        damping: 0.0,
    }))?;
    order_for_springs(positions, &springs, Rounding { reach: 0.0 })
}
