//! Which links of a block of nodes go into runs, which into gathers, and which are left beside the columns.

use super::LANES;
use crate::base::{Result, memory};

/// The fewest links that are worth a gather: alone they cost a third as much as a gather of sixteen.
pub(crate) const GATHER: usize = 4;

/// How few links a run may have, from many runs to none. A run is cheaper than a gather, but what runs take may leave gathers
/// half empty.
const FEWEST: [usize; 5] = [5, 8, 11, 14, LANES + 1];

/// What a column costs, in cycles of the processor, measured with AVX-512: sixteen neighbours side by side, sixteen
/// anywhere; and a link of a node that has far more of them than those around it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Costs {
    pub run: f64,
    pub gather: f64,
    pub stray: f64,
}

impl Costs {
    /// Of springs that share their parameters.
    pub const SHARED: Self = Self {
        run: 9.0,
        gather: 30.0,
        stray: 10.0,
    };
    /// Of springs that bring their own.
    pub const OWN: Self = Self {
        run: 16.0,
        gather: 34.0,
        stray: 10.0,
    };
}

/// Links of a block that lead equally far in the order of nodes: a run, if they are many.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Row {
    /// Rows that share their parameters, or have to bring their own, come one after the other.
    pub kind: u16,
    pub costs: Costs,
    /// The nodes that have such a link.
    pub lanes: u16,
}

impl Row {
    fn links(&self) -> usize {
        self.lanes.count_ones() as usize
    }
}

/// How a block is split.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BlockSplit {
    /// The fewest links that make a run.
    pub run: usize,
    /// Whether springs are gathered whatever their kinds, and each brings its own parameters.
    pub mixed: bool,
    pub cost: f64,
}

/// Finds the split of a block that costs least; `levels` is room to count in.
pub(crate) fn cheapest(rows: &[Row], levels: &mut Vec<u32>) -> Result<BlockSplit> {
    let has_kinds = rows.windows(2).any(|pair| pair[0].kind != pair[1].kind);
    let mut best = BlockSplit {
        run: FEWEST[0],
        mixed: false,
        cost: cost(rows, FEWEST[0], false, levels)?,
    };
    let mut offer = |run, mixed| -> Result<()> {
        let cost = cost(rows, run, mixed, levels)?;
        if cost < best.cost {
            best = BlockSplit { run, mixed, cost };
        }
        Ok(())
    };
    if has_kinds {
        offer(FEWEST[0], true)?;
    }
    for pair in FEWEST.windows(2) {
        // Else it is the same split.
        if rows.iter().any(|row| (pair[0]..pair[1]).contains(&row.links())) {
            offer(pair[1], false)?;
            if has_kinds {
                offer(pair[1], true)?;
            }
        }
    }
    Ok(best)
}

/// What a block costs with runs of at least so many links, and gathers of kinds or mixed.
fn cost(rows: &[Row], run: usize, mixed: bool, levels: &mut Vec<u32>) -> Result<f64> {
    let mut cost = 0.0;
    for rows in rows.chunk_by(|a, b| mixed || a.kind == b.kind) {
        let mut heights = [0; LANES];
        levels.clear();
        for row in rows {
            if row.links() >= run {
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
        // A level is never fuller than the one below.
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
