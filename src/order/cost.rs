//! The estimated cost of a traversal of all springs in a given order.

use super::inverse;
use super::links::Links;
use super::{BlockSplit, Row, cheapest};
use crate::Result;
use crate::base::memory;

/// The number of consecutive nodes that share columns.
const LANES: usize = 1 << LANE_BITS;
const LANE_BITS: u32 = 4;

/// Neighbors farther away than this number of nodes are no longer in the first-level or second-level cache. The cost is
/// that of a cache line of sixteen of them, in cycles beyond their gather.
const FAR: u64 = 4 << 10;
const FAR_COST: f64 = 5.0;
const VERY_FAR: u64 = 32 << 10;
const VERY_FAR_COST: f64 = 40.0;

/// A larger body is sampled with about this number of nodes, in evenly spaced pieces.
const MAX_NODES: usize = 128 << 10;
const PIECE_LENGTH: usize = 512;

/// The lower bound of the cost: full runs only.
pub(super) fn least_cost(links: &Links) -> f64 {
    links.count() as f64 / LANES as f64 * links.costs.run
}

/// Estimates the cycles of a traversal of all springs with nodes in this order, from the columns that packed storage
/// makes of each sixteen nodes. There must be at least one node.
pub(super) fn cost(order: &[u32], links: &Links) -> Result<f64> {
    let ranks = inverse(order)?;
    let mut block = CacheBlock::default();
    // Odd, because the rows of a grid rarely have odd multiples of this length.
    let step = (order.len() / MAX_NODES) | 1;
    let mut sum = 0.0;
    let mut counted = 0;
    for (index, nodes) in order.chunks(PIECE_LENGTH).enumerate().step_by(step) {
        for (block_index, nodes) in nodes.chunks(LANES).enumerate() {
            let first = index * PIECE_LENGTH + block_index * LANES;
            sum += block.cost(first as i64, nodes, &ranks, links)?;
        }
        counted += nodes.len();
    }
    Ok(sum * order.len() as f64 / counted as f64)
}

/// Working memory for counting blocks.
#[derive(Default)]
struct CacheBlock {
    /// The index offset of the neighbor in the upper bits, the lane in the lower ones.
    links: Vec<i64>,
    rows: Vec<Row>,
    levels: Vec<u32>,
    /// Cache lines of sixteen far nodes.
    lines: Vec<(u64, bool)>,
}

impl CacheBlock {
    fn cost(&mut self, first: i64, nodes: &[u32], ranks: &[u32], links: &Links) -> Result<f64> {
        let costs = links.costs;
        self.links.clear();
        self.rows.clear();
        self.lines.clear();
        for (lane, &node) in (0..).zip(nodes) {
            let neighbors = links.neighbors(node);
            self.links.try_reserve(neighbors.len())?;
            let own = first + lane;
            self.links.extend(
                neighbors
                    .iter()
                    .map(|&n| (i64::from(ranks[n as usize]) - own) << LANE_BITS | lane),
            );
        }
        self.links.sort_unstable();

        let same = |a: &i64, b: &i64| a >> LANE_BITS == b >> LANE_BITS;
        for links in self.links.chunk_by(same) {
            let lanes = links
                .iter()
                .fold(0, |lanes, link| lanes | 1 << (link & (LANES as i64 - 1)));
            let (class, costs) = (0, costs);
            memory::push(&mut self.rows, Row { class, costs, lanes })?;
        }
        let BlockSplit {
            min_run, cost: mut sum, ..
        } = cheapest(&self.rows, &mut self.levels)?;
        for links in self.links.chunk_by(same).filter(|links| links.len() < min_run) {
            for &link in links {
                let (offset, lane) = (link >> LANE_BITS, link & (LANES as i64 - 1));
                let distance = offset.unsigned_abs();
                if distance > FAR {
                    let line = (first + lane + offset) as u64 / LANES as u64;
                    memory::push(&mut self.lines, (line, distance > VERY_FAR))?;
                }
            }
        }
        self.lines.sort_unstable();
        self.lines.dedup_by_key(|line| line.0);
        for &(_, very_far) in &self.lines {
            sum += if very_far { VERY_FAR_COST } else { FAR_COST };
        }
        Ok(sum)
    }
}
