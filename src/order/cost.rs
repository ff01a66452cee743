//! What a visit of all springs costs in a given order.

use super::inverse;
use super::links::Links;
use super::{BlockSplit, Row, cheapest};
use crate::Result;
use crate::base::memory;

/// Nodes side by side whose links share columns.
const LANES: usize = 1 << LANE_BITS;
const LANE_BITS: u32 = 4;

/// Neighbours further away than this many nodes have left the first, or the second, cache since their own turn. What a line
/// of sixteen of them costs then, in cycles beyond those of its gather.
const FAR: u64 = 4 << 10;
const FAR_COST: f64 = 5.0;
const VERY_FAR: u64 = 32 << 10;
const VERY_FAR_COST: f64 = 40.0;

/// Of a larger body about as many nodes are looked at, pieces of this many in even distances.
const MOST_NODES: usize = 128 << 10;
const PIECE: usize = 512;

/// The least that any order can cost: nothing but full runs.
pub(super) fn least_cost(links: &Links) -> f64 {
    links.count() as f64 / LANES as f64 * links.costs.run
}

/// An estimate of the cycles that a visit of all springs takes, with nodes in this order: the columns that packed storage
/// makes of each sixteen nodes. There is a node at least.
pub(super) fn cost(order: &[u32], links: &Links) -> Result<f64> {
    let places = inverse(order)?;
    let mut block = CacheBlock::default();
    // Odd, as the rows of a grid are rarely that long.
    let step = (order.len() / MOST_NODES) | 1;
    let mut sum = 0.0;
    let mut counted = 0;
    for (index, nodes) in order.chunks(PIECE).enumerate().step_by(step) {
        for (block_index, nodes) in nodes.chunks(LANES).enumerate() {
            let first = index * PIECE + block_index * LANES;
            sum += block.cost(first as i64, nodes, &places, links)?;
        }
        counted += nodes.len();
    }
    Ok(sum * order.len() as f64 / counted as f64)
}

/// What counting a block needs, kept from block to block.
#[derive(Default)]
struct CacheBlock {
    /// How far away the neighbour is, above the bits of the lane.
    links: Vec<i64>,
    rows: Vec<Row>,
    levels: Vec<u32>,
    /// Lines of sixteen nodes that are far away.
    lines: Vec<(u64, bool)>,
}

impl CacheBlock {
    fn cost(&mut self, first: i64, nodes: &[u32], places: &[u32], links: &Links) -> Result<f64> {
        let costs = links.costs;
        self.links.clear();
        self.rows.clear();
        self.lines.clear();
        for (lane, &node) in (0..).zip(nodes) {
            let neighbours = links.of(node);
            self.links.try_reserve(neighbours.len())?;
            let own = first + lane;
            self.links.extend(
                neighbours
                    .iter()
                    .map(|&n| (i64::from(places[n as usize]) - own) << LANE_BITS | lane),
            );
        }
        self.links.sort_unstable();

        let same = |a: &i64, b: &i64| a >> LANE_BITS == b >> LANE_BITS;
        for links in self.links.chunk_by(same) {
            let lanes = links
                .iter()
                .fold(0, |lanes, link| lanes | 1 << (link & (LANES as i64 - 1)));
            let (kind, costs) = (0, costs);
            memory::push(&mut self.rows, Row { kind, costs, lanes })?;
        }
        let BlockSplit { run, cost: mut sum, .. } = cheapest(&self.rows, &mut self.levels)?;
        for links in self.links.chunk_by(same).filter(|links| links.len() < run) {
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
