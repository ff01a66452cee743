//! Splits the links of a block of nodes into runs, gathers and strays.

use super::LANES;
use crate::base::{Result, memory};

/// The fewest links for which a gather pays off: as strays they cost a third more than a gather of sixteen.
pub(crate) const GATHER: usize = 4;

/// The candidates for the fewest links of a run, from many runs to none. A run is cheaper than a gather, but the links
/// it takes may leave gathers half empty.
const RUN_LENGTHS: [usize; 5] = [5, 8, 11, 14, LANES + 1];

/// The costs of columns in processor cycles, measured with AVX-512: a run and a gather of sixteen, and one stray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Costs {
    pub run: f64,
    pub gather: f64,
    pub stray: f64,
}

impl Costs {
    /// The costs of columns with shared parameters.
    pub const SHARED: Self = Self {
        run: 9.0,
        gather: 30.0,
        stray: 10.0,
    };
    /// The costs of columns with per-spring parameters.
    pub const OWN: Self = Self {
        run: 16.0,
        gather: 34.0,
        stray: 10.0,
    };
}

/// The links of a block with the same index offset. Many of them make a run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Row {
    /// The parameter class. Rows of the same class are adjacent.
    pub class: u16,
    pub costs: Costs,
    /// A mask of the nodes that have such a link.
    pub lanes: u16,
}

impl Row {
    fn links(&self) -> usize {
        self.lanes.count_ones() as usize
    }
}

/// The split of a block into columns.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BlockSplit {
    /// The fewest links that make a run.
    pub min_run: usize,
    /// True if gathers mix springs of all classes, with per-spring parameters.
    pub mixed: bool,
    pub cost: f64,
}

/// Finds the split of a block with the least cost. `levels` is working memory.
pub(crate) fn cheapest(rows: &[Row], levels: &mut Vec<u32>) -> Result<BlockSplit> {
    let has_classes = rows.windows(2).any(|pair| pair[0].class != pair[1].class);
    let mut best = BlockSplit {
        min_run: RUN_LENGTHS[0],
        mixed: false,
        cost: cost(rows, RUN_LENGTHS[0], false, levels)?,
    };
    let mut offer = |min_run, mixed| -> Result<()> {
        let cost = cost(rows, min_run, mixed, levels)?;
        if cost < best.cost {
            best = BlockSplit { min_run, mixed, cost };
        }
        Ok(())
    };
    if has_classes {
        offer(RUN_LENGTHS[0], true)?;
    }
    for pair in RUN_LENGTHS.windows(2) {
        // Otherwise the split is the same.
        if rows.iter().any(|row| (pair[0]..pair[1]).contains(&row.links())) {
            offer(pair[1], false)?;
            if has_classes {
                offer(pair[1], true)?;
            }
        }
    }
    Ok(best)
}

/// The cost of a block with runs of at least `min_run` links, and gathers per class or mixed.
fn cost(rows: &[Row], min_run: usize, mixed: bool, levels: &mut Vec<u32>) -> Result<f64> {
    let mut cost = 0.0;
    for rows in rows.chunk_by(|a, b| mixed || a.class == b.class) {
        let mut heights = [0; LANES];
        levels.clear();
        for row in rows {
            if row.links() >= min_run {
                cost += row.costs.run;
                continue;
            }
            let mut lanes = row.lanes;
            while lanes != 0 {
                let height = &mut heights[lanes.trailing_zeros() as usize];
                match levels.get_mut(*height) {
                    Some(level) => *level += 1,
                    None => memory::push(levels, 1)?,
                }
                *height += 1;
                lanes &= lanes - 1;
            }
        }
        let costs = if mixed { Costs::OWN } else { rows[0].costs };
        // A level never has more links than the level below.
        for &links in &*levels {
            cost += if links as usize >= GATHER {
                costs.gather
            } else {
                costs.stray * f64::from(links)
            };
        }
    }
    Ok(cost)
}
