//! Making columns of a tile's links.

use std::ops::Range;

use crate::base::{Result, memory};
use crate::order::{BlockSplit, Costs, GATHER, LANES, Row, cheapest};
use crate::springs::Link;
use crate::springs::kernels::{Column, Columns, Line, Neighbours, Parameters, SpringMaterial};

/// Marks a link that is of no kind in the table of materials.
pub(super) const NO_KIND: u16 = u16::MAX;

/// One end of a spring, to be put into a column.
#[derive(Clone, Copy, Debug)]
pub(super) struct Loose {
    pub node: u32,
    pub neighbour: u32,
    /// Its place in the table of materials; [`NO_KIND`].
    pub kind: u16,
    pub own: SpringMaterial,
}

impl Loose {
    fn offset(&self) -> i64 {
        i64::from(self.neighbour) - i64::from(self.node)
    }
}

/// Packs the links of `nodes`, in the order of their nodes. The order of `links` is lost.
pub(super) fn pack(
    nodes: Range<usize>,
    node_count: usize,
    damped: bool,
    materials: &[SpringMaterial],
    links: &mut [Loose],
) -> Result<Columns> {
    let stiffness = links.first().map_or(0.0, |link| link.own.stiffness);
    let uniform = links.iter().all(|link| link.own.stiffness == stiffness);
    let mut columns = Columns::new(nodes.clone(), node_count, uniform.then_some(stiffness), damped);
    let mut packer = Packer {
        node_count,
        columns: Vec::new(),
        rows: Vec::new(),
        levels: Vec::new(),
    };
    let mut rest = links;
    let mut first = nodes.start;
    while first < nodes.end {
        let count = rest.partition_point(|link| (link.node as usize) < first + LANES);
        let (block, after) = rest.split_at_mut(count);
        let strays = packer.block(first, block)?;
        columns.push_block(&packer.columns, materials)?;
        columns.reserve_strays(strays)?;
        for loose in &mut block[..strays] {
            let link = Link {
                neighbour: loose.neighbour,
                stiffness: loose.own.stiffness,
                rest_length: loose.own.rest_length,
                damping: loose.own.damping,
            };
            columns.insert_stray(loose.node as usize, &link);
        }
        rest = after;
        first += LANES;
    }
    columns.shrink()?;
    Ok(columns)
}

/// What packing a block needs, kept from block to block.
struct Packer {
    node_count: usize,
    columns: Vec<Column>,
    rows: Vec<Row>,
    /// For each level, how many links lie there: where a node has its n-th link, n - 1 others lie below.
    levels: Vec<u32>,
}

impl Packer {
    /// Puts the links of the sixteen nodes from `first` on into columns: how many are left, which are the first then.
    fn block(&mut self, first: usize, links: &mut [Loose]) -> Result<usize> {
        self.columns.clear();
        self.columns.try_reserve(links.len() / GATHER + 1)?;
        links.sort_unstable_by_key(|link| (link.kind, link.offset(), link.node));
        self.see_rows(first, links)?;
        let BlockSplit { run, mixed, .. } = cheapest(&self.rows, &mut self.levels)?;
        let mut left = self.take_runs(first, links, run);
        if !mixed {
            left = self.take_gathers(first, &mut links[..left])?;
        }
        // What is too little of one kind may do together, each with its own parameters.
        for link in &mut links[..left] {
            link.kind = NO_KIND;
        }
        links[..left].sort_unstable_by_key(|link| (link.offset(), link.node));
        self.take_gathers(first, &mut links[..left])
    }

    /// Notes which links are of a kind and lead equally far.
    fn see_rows(&mut self, first: usize, links: &[Loose]) -> Result<()> {
        self.rows.clear();
        let same = |a: &Loose, b: &Loose| a.kind == b.kind && a.offset() == b.offset();
        for links in links.chunk_by(same) {
            let kind = links[0].kind;
            let costs = if kind == NO_KIND { Costs::OWN } else { Costs::SHARED };
            let lanes = links
                .iter()
                .fold(0, |lanes, link| lanes | 1 << (link.node as usize - first));
            memory::push(&mut self.rows, Row { kind, costs, lanes })?;
        }
        Ok(())
    }

    /// Makes runs of links of a kind with the same offset, so many at least: how many are left, moved to the front.
    fn take_runs(&mut self, first: usize, links: &mut [Loose], fewest: usize) -> usize {
        let (mut left, mut start) = (0, 0);
        while start < links.len() {
            let head = links[start];
            let same = |link: &&Loose| link.kind == head.kind && link.offset() == head.offset();
            let count = links[start..].iter().take_while(same).count();
            let run = start..start + count;
            if count >= fewest
                && let Ok(offset) = i32::try_from(head.offset())
            {
                let mut column = Column::empty(Neighbours::Run(offset), head.kind);
                for link in &links[run.clone()] {
                    column.put(link, first);
                }
                self.columns.push(column);
            } else {
                links.copy_within(run.clone(), left);
                left += count;
            }
            start = run.end;
        }
        left
    }

    /// Makes gathers of links of a kind, as many as are well filled: how many are left, moved to the front.
    fn take_gathers(&mut self, first: usize, links: &mut [Loose]) -> Result<usize> {
        let (mut left, mut start) = (0, 0);
        while start < links.len() {
            let kind = links[start].kind;
            let count = links[start..].iter().take_while(|link| link.kind == kind).count();
            let group = start..start + count;
            self.count_levels(first, &links[group.clone()])?;
            // A level is never fuller than the one below.
            let worth = self
                .levels
                .iter()
                .take_while(|&&links| links as usize >= GATHER)
                .count();
            let base = self.columns.len();
            self.columns.try_reserve(worth)?;
            for _ in 0..worth {
                // Lanes without a link lead to the block's first node.
                let nowhere = Neighbours::Gather([first.min(self.node_count - 1) as u32; LANES]);
                self.columns.push(Column::empty(nowhere, kind));
            }
            let mut heights = [0; LANES];
            for index in group.clone() {
                let link = links[index];
                let height = &mut heights[link.node as usize - first];
                if *height < worth {
                    self.columns[base + *height].put(&link, first);
                } else {
                    links[left] = link;
                    left += 1;
                }
                *height += 1;
            }
            start = group.end;
        }
        Ok(left)
    }

    fn count_levels(&mut self, first: usize, links: &[Loose]) -> Result<()> {
        let mut heights = [0; LANES];
        self.levels.clear();
        for link in links {
            let height = &mut heights[link.node as usize - first];
            match self.levels.get_mut(*height) {
                Some(level) => *level += 1,
                None => memory::push(&mut self.levels, 1)?,
            }
            *height += 1;
        }
        Ok(())
    }
}

impl Column {
    fn empty(neighbours: Neighbours, kind: u16) -> Self {
        Self {
            neighbours,
            lanes: 0,
            parameters: match kind {
                NO_KIND => Parameters::Own {
                    stiffnesses: Line::ZERO,
                    rest_lengths: Line::ZERO,
                    dampings: Line::ZERO,
                },
                kind => Parameters::Shared(kind),
            },
        }
    }

    /// Puts a link into the lane of its node.
    fn put(&mut self, link: &Loose, first: usize) {
        let lane = link.node as usize - first;
        self.lanes |= 1 << lane;
        if let Neighbours::Gather(neighbours) = &mut self.neighbours {
            neighbours[lane] = link.neighbour;
        }
        if let Parameters::Own {
            stiffnesses,
            rest_lengths,
            dampings,
        } = &mut self.parameters
        {
            stiffnesses.0[lane] = link.own.stiffness;
            rest_lengths.0[lane] = link.own.rest_length;
            dampings.0[lane] = link.own.damping;
        }
    }
}
