//! The node order of packed storage: it makes neighbors adjacent in memory.
//!
//! Several orders are tried, and the one with the least estimated work is taken. Rows suit lattices best; a
//! space-filling curve and reverse Cuthill-McKee suit other meshes. Each is tried as it is and with nodes grouped by
//! their number of springs.

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

/// The number of consecutive nodes that share columns.
pub(crate) const LANES: usize = 16;

/// The relative saving for which another order replaces the caller's; below it the search stops.
const MIN_GAIN: f64 = 0.03;

/// The window within which nodes are sorted by degree; a larger one would separate neighbors.
const WINDOW: usize = 512;

/// The order in which packed storage is fastest, `order[new] = old`. `None` if the given order is within 3 % of it.
/// Each spring joins two existing nodes, and each pair occurs once. `costs` are those of most springs.
///
/// Errors: [`Error::OutOfMemory`](crate::Error::OutOfMemory).
pub(crate) fn best_order(positions: &[Vec3], springs: &[[u32; 2]], costs: Costs) -> Result<Option<Vec<u32>>> {
    if springs.is_empty() {
        return Ok(None);
    }
    // Nodes are renumbered along the curve first. Neighbor walks then stay in the caches, several times as fast for
    // nodes in random order.
    let curve = along_curve(positions)?;
    let given = inverse(&curve)?;
    let links = Links::new(springs, &given, costs)?;

    let mut best = BestOrder {
        order: None,
        cost: cost(&given, &links)? * (1.0 - MIN_GAIN),
        good_enough: least_cost(&links) / (1.0 - MIN_GAIN),
        links: &links,
    };
    if best.cost <= least_cost(&links) {
        return Ok(None);
    }
    let named_positions = memory::collected(curve.iter().map(|&node| positions[node as usize]))?;
    if let Some(rows) = along_rows(&named_positions, &links)? {
        best.offer(rows)?;
    }
    if !best.is_good_enough() {
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
struct BestOrder<'a> {
    /// `None`: the caller's order.
    order: Option<Vec<u32>>,
    cost: f64,
    /// A cost that leaves little to gain.
    good_enough: f64,
    links: &'a Links,
}

impl BestOrder<'_> {
    fn is_good_enough(&self) -> bool {
        self.cost <= self.good_enough
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

/// Sorts the nodes of each window by descending degree, otherwise in their order.
fn by_degree(order: &[u32], links: &Links) -> Result<Vec<u32>> {
    let mut sorted = memory::reserved(order.len())?;
    let mut keyed = memory::reserved(WINDOW)?;
    for window in order.chunks(WINDOW) {
        keyed.clear();
        keyed.extend(
            (0_u32..)
                .zip(window)
                .map(|(index, &node)| (Reverse(links.degree(node)), index, node)),
        );
        keyed.sort_unstable();
        sorted.extend(keyed.iter().map(|&(.., node)| node));
    }
    Ok(sorted)
}

/// The rank of each node in an order.
fn inverse(order: &[u32]) -> Result<Vec<u32>> {
    let mut ranks = memory::filled(0, order.len())?;
    for (rank, &node) in (0..).zip(order) {
        ranks[node as usize] = rank;
    }
    Ok(ranks)
}
