//! Packs the links of a tile into columns.

use std::ops::Range;

use crate::base::{Result, memory};
use crate::order::{BlockSplit, Costs, GATHER, LANES, Row, cheapest};
use crate::springs::Link;
use crate::springs::kernels::{Column, ColumnParameters, Columns, F32x16, Neighbors, SpringParameters};

/// Marks a link that has no class in the parameter table.
pub(super) const NO_CLASS: u16 = u16::MAX;

/// One end of a spring that is not in a column yet.
#[derive(Clone, Copy, Debug)]
pub(super) struct UnpackedLink {
    pub node: u32,
    pub neighbor: u32,
    /// The index in the parameter table, or [`NO_CLASS`].
    pub class: u16,
    pub own: SpringParameters,
}

impl UnpackedLink {
    fn offset(&self) -> i64 {
        i64::from(self.neighbor) - i64::from(self.node)
    }
}

/// Packs the links of `nodes`, sorted by node. The order of `links` is lost.
pub(super) fn pack(
    nodes: Range<usize>,
    node_count: usize,
    damped: bool,
    table: &[SpringParameters],
    links: &mut [UnpackedLink],
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
        columns.push_block(&packer.columns, table)?;
        columns.reserve_strays(strays)?;
        for unpacked in &mut block[..strays] {
            let link = Link {
                neighbor: unpacked.neighbor,
                stiffness: unpacked.own.stiffness,
                rest_length: unpacked.own.rest_length,
                damping: unpacked.own.damping,
            };
            columns.insert_stray(unpacked.node as usize, &link);
        }
        rest = after;
        first += LANES;
    }
    columns.shrink()?;
    Ok(columns)
}

/// Working memory for packing blocks.
struct Packer {
    node_count: usize,
    columns: Vec<Column>,
    rows: Vec<Row>,
    /// The number of links on each level. The n-th link of a node is on level n.
    levels: Vec<u32>,
}

impl Packer {
    /// Packs the links of sixteen nodes starting at `first` into columns. Returns the number of links left over, which
    /// are moved to the front.
    fn block(&mut self, first: usize, links: &mut [UnpackedLink]) -> Result<usize> {
        self.columns.clear();
        self.columns.try_reserve(links.len() / GATHER + 1)?;
        links.sort_unstable_by_key(|link| (link.class, link.offset(), link.node));
        self.find_rows(first, links)?;
        let BlockSplit { min_run, mixed, .. } = cheapest(&self.rows, &mut self.levels)?;
        let mut remaining = self.take_runs(first, links, min_run);
        if !mixed {
            remaining = self.take_gathers(first, &mut links[..remaining])?;
        }
        // Links that are too few in their class may fill a column together, with per-spring parameters.
        for link in &mut links[..remaining] {
            link.class = NO_CLASS;
        }
        links[..remaining].sort_unstable_by_key(|link| (link.offset(), link.node));
        self.take_gathers(first, &mut links[..remaining])
    }

    /// Groups links of the same class and index offset into rows.
    fn find_rows(&mut self, first: usize, links: &[UnpackedLink]) -> Result<()> {
        self.rows.clear();
        let same = |a: &UnpackedLink, b: &UnpackedLink| a.class == b.class && a.offset() == b.offset();
        for links in links.chunk_by(same) {
            let class = links[0].class;
            let costs = if class == NO_CLASS { Costs::OWN } else { Costs::SHARED };
            let lanes = links
                .iter()
                .fold(0, |lanes, link| lanes | 1 << (link.node as usize - first));
            memory::push(&mut self.rows, Row { class, costs, lanes })?;
        }
        Ok(())
    }

    /// Makes runs of at least `min_links` links of the same class and offset. Returns the number of links left over,
    /// which are moved to the front.
    fn take_runs(&mut self, first: usize, links: &mut [UnpackedLink], min_links: usize) -> usize {
        let (mut remaining, mut start) = (0, 0);
        while start < links.len() {
            let head = links[start];
            let same = |link: &&UnpackedLink| link.class == head.class && link.offset() == head.offset();
            let count = links[start..].iter().take_while(same).count();
            let run = start..start + count;
            if count >= min_links
                && let Ok(offset) = i32::try_from(head.offset())
            {
                let mut column = Column::empty(Neighbors::Run(offset), head.class);
                for link in &links[run.clone()] {
                    column.insert(link, first);
                }
                self.columns.push(column);
            } else {
                links.copy_within(run.clone(), remaining);
                remaining += count;
            }
            start = run.end;
        }
        remaining
    }

    /// Makes gathers of links of the same class, as long as they are well filled. Returns the number of links left
    /// over, which are moved to the front.
    fn take_gathers(&mut self, first: usize, links: &mut [UnpackedLink]) -> Result<usize> {
        let (mut remaining, mut start) = (0, 0);
        while start < links.len() {
            let class = links[start].class;
            let count = links[start..].iter().take_while(|link| link.class == class).count();
            let group = start..start + count;
            self.count_levels(first, &links[group.clone()])?;
            // A level never has more links than the level below.
            let level_count = self
                .levels
                .iter()
                .take_while(|&&links| links as usize >= GATHER)
                .count();
            let base = self.columns.len();
            self.columns.try_reserve(level_count)?;
            for _ in 0..level_count {
                // Unused lanes refer to the first node of the block.
                let nowhere = Neighbors::Gather([first.min(self.node_count - 1) as u32; LANES]);
                self.columns.push(Column::empty(nowhere, class));
            }
            let mut heights = [0; LANES];
            for index in group.clone() {
                let link = links[index];
                let height = &mut heights[link.node as usize - first];
                if *height < level_count {
                    self.columns[base + *height].insert(&link, first);
                } else {
                    links[remaining] = link;
                    remaining += 1;
                }
                *height += 1;
            }
            start = group.end;
        }
        Ok(remaining)
    }

    fn count_levels(&mut self, first: usize, links: &[UnpackedLink]) -> Result<()> {
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
    fn empty(neighbors: Neighbors, class: u16) -> Self {
        Self {
            neighbors,
            lanes: 0,
            parameters: match class {
                NO_CLASS => ColumnParameters::Own {
                    stiffnesses: F32x16::ZERO,
                    rest_lengths: F32x16::ZERO,
                    dampings: F32x16::ZERO,
                },
                class => ColumnParameters::Shared(class),
            },
        }
    }

    /// Inserts a link into the lane of its node.
    fn insert(&mut self, link: &UnpackedLink, first: usize) {
        let lane = link.node as usize - first;
        self.lanes |= 1 << lane;
        if let Neighbors::Gather(neighbors) = &mut self.neighbors {
            neighbors[lane] = link.neighbor;
        }
        if let ColumnParameters::Own {
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
