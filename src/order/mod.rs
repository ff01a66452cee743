//! The order in which packed storage keeps nodes for itself: one that makes neighbours neighbours.
//!
//! Several ways to order nodes are tried, and the one for which packed storage needs the least work is taken: rows, which
//! suit lattices best; a space-filling curve and reverse Cuthill-McKee, for what is no lattice; each as it is, and with
//! nodes that have equally many springs side by side.

mod axes;
mod cost;
mod cuthill_mckee;
mod hilbert;
mod links;
mod rows;
mod split;

#[cfg(test)]
mod tests;

use std::cmp::Reverse;

use glam::Vec3;

use crate::Result;
use crate::base::memory;
use cost::{cost, least_cost};
use cuthill_mckee::reverse_cuthill_mckee;
use hilbert::along_curve;
use links::Links;
use rows::along_rows;
pub(crate) use split::{BlockSplit, Costs, GATHER, Row, cheapest};

/// Nodes side by side whose links share columns.
pub(crate) const LANES: usize = 16;

/// What another order must save to be taken instead of the caller's, and what is too little to look further for.
const WORTH: f64 = 0.03;

/// Nodes are sorted by their number of springs within windows of this many: more would tear neighbours apart.
const WINDOW: usize = 512;

/// The order in which packed storage works fastest, `order[new] = old`; `None` where that in which nodes are given is as good
/// within 3 %. The springs join nodes that there are, each two at most once; `costs` are those of most of them.
///
/// Errors: [`Error::OutOfMemory`](crate::Error::OutOfMemory).
pub(crate) fn best_order(positions: &[Vec3], springs: &[[u32; 2]], costs: Costs) -> Result<Option<Vec<u32>>> {
    if springs.is_empty() {
        return Ok(None);
    }
    // Nodes are named along the curve here: whatever walks from neighbour to neighbour then stays in the caches, several times
    // as fast where nodes are given in random order.
    let curve = along_curve(positions)?;
    let given = inverse(&curve)?;
    let links = Links::new(springs, &given, costs)?;

    let mut best = Best {
        order: None,
        cost: cost(&given, &links)? * (1.0 - WORTH),
        settled: least_cost(&links) / (1.0 - WORTH),
        links: &links,
    };
    if best.cost <= least_cost(&links) {
        return Ok(None);
    }
    let named_positions = memory::collected(curve.iter().map(|&node| positions[node as usize]))?;
    if let Some(rows) = along_rows(&named_positions, &links)? {
        best.offer(rows)?;
    }
    if !best.is_settled() {
        best.offer(given)?;
        let names = memory::collected(0..curve.len() as u32)?;
        best.offer(names)?;
        best.offer(reverse_cuthill_mckee(&links)?)?;
    }
    let Some(mut order) = best.order else {
        return Ok(None);
    };
    for node in &mut order {
        *node = curve[*node as usize];
    }
    Ok(Some(order))
}

/// The best order so far.
struct Best<'a> {
    /// `None`: the caller's.
    order: Option<Vec<u32>>,
    cost: f64,
    /// With that cost there is little left to gain.
    settled: f64,
    links: &'a Links,
}

impl Best<'_> {
    fn is_settled(&self) -> bool {
        self.cost <= self.settled
    }

    /// Takes an order if it is better, as it is or sorted by degree.
    fn offer(&mut self, order: Vec<u32>) -> Result<()> {
        let sorted = by_degree(&order, self.links)?;
        for order in [order, sorted] {
            let cost = cost(&order, self.links)?;
            if cost < self.cost {
                self.cost = cost;
                self.order = Some(order);
            }
        }
        Ok(())
    }
}

/// The nodes of each window by how many springs they have, the most first, and else as they were.
fn by_degree(order: &[u32], links: &Links) -> Result<Vec<u32>> {
    let mut sorted = memory::reserved(order.len())?;
    let mut keyed = memory::reserved(WINDOW)?;
    for window in order.chunks(WINDOW) {
        keyed.clear();
        keyed.extend(
            (0_u32..)
                .zip(window)
                .map(|(place, &node)| (Reverse(links.degree(node)), place, node)),
        );
        keyed.sort_unstable();
        sorted.extend(keyed.iter().map(|&(.., node)| node));
    }
    Ok(sorted)
}

/// Where each node is in an order.
fn inverse(order: &[u32]) -> Result<Vec<u32>> {
    let mut places = memory::filled(0, order.len())?;
    for (place, &node) in (0..).zip(order) {
        places[node as usize] = place;
    }
    Ok(places)
}
