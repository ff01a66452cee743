//! Which links of a block of nodes go into runs, which into gathers, and which are left beside the columns.

use crate::error::Result;
use crate::memory;
use crate::springs::kernels::LANES;

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

/// How a block is split.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Split {
    /// The fewest links that make a run.
    pub run: usize,
    /// Whether springs are gathered whatever their kinds, and each brings its own parameters.
    pub mixed: bool,
    pub cost: f64,
}

/// Finds the split of a block that costs least; `levels` is room to count in.
pub(crate) fn cheapest(rows: &[Row], levels: &mut Vec<u32>) -> Result<Split> {
    let mut best: Option<Split> = None;
    for (run, mixed) in FEWEST.into_iter().flat_map(|run| [(run, false), (run, true)]) {
        let mut cost = 0.0;
        for rows in rows.chunk_by(|a, b| mixed || a.kind == b.kind) {
            let mut heights = [0; LANES];
            levels.clear();
            for row in rows {
                if row.lanes.count_ones() as usize >= run {
                    cost += row.costs.run;
                    continue;
                }
                for (lane, height) in heights.iter_mut().enumerate() {
                    if row.lanes >> lane & 1 == 1 {
                        match levels.get_mut(*height) {
                            Some(level) => *level += 1,
                            None => memory::push(levels, 1)?,
                        }
                        *height += 1;
                    }
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
        if best.is_none_or(|best| cost < best.cost) {
            best = Some(Split { run, mixed, cost });
        }
    }
    Ok(best.unwrap_or(Split {
        run: LANES,
        mixed: false,
        cost: 0.0,
    }))
}
