//! The links of a tile in columns. A column holds one link of each of sixteen consecutive nodes.
//!
//! A column is a *run* if its neighbors are consecutive too, so that one load reads them, and a *gather* otherwise. The
//! springs of a column share their parameters or have their own. A *stray* is a link outside of columns, such as most
//! links of a node that has far more links than the nodes around it. Strays of any nodes are evaluated sixteen at a
//! time.
//!
//! Values that kernels read without a check are checked here on insertion.

use std::ops::Range;

use super::layout::{
    Column, ColumnEnds, ColumnParameters, F32x16, FarIndices, GatherColumn, LinkLocation, NearIndices, Neighbors,
    OWN_PARAMETERS, OwnRun, RunColumn, SpringParameters,
};
use super::strays::Strays;
use crate::base::{Result, memory};
use crate::codec::saved;
use crate::order::LANES;
use crate::soa::{MARGIN, TILE};
use crate::springs::Link;

/// The number of nodes that 16-bit indices can address.
const NEAR_WINDOW: usize = 1 << 16;

/// The number of links of a node that one search covers.
const LINKS_PER_SEARCH: usize = 16;

/// The links of the nodes of one tile.
#[derive(Debug)]
pub(crate) struct Columns {
    /// The first node of the tile, and its number of nodes.
    pub(super) first: usize,
    pub(super) count: usize,
    /// The number of nodes in the body.
    pub(super) node_count: usize,
    /// The nodes that the kernel reads, with at most sixteen more at the ends of a body.
    pub(super) reads: Range<isize>,
    /// The node that 16-bit indices are relative to.
    pub(super) window: usize,
    pub(super) blocks: Vec<ColumnEnds>,
    pub(super) runs: Vec<RunColumn>,
    pub(super) own_runs: Vec<OwnRun>,
    pub(super) near: Vec<GatherColumn>,
    pub(super) near_indices: Vec<NearIndices>,
    pub(super) far: Vec<GatherColumn>,
    pub(super) far_indices: Vec<FarIndices>,
    /// The parameters of columns with per-spring parameters, block by block. Within a block runs come first, then near
    /// gathers, then far gathers.
    pub(super) own_rest_lengths: Vec<F32x16>,
    /// Empty if all stiffnesses equal `own_stiffness`.
    pub(super) own_stiffnesses: Vec<F32x16>,
    pub(super) own_stiffness: f32,
    /// Empty in a body without spring damping.
    pub(super) own_dampings: Vec<F32x16>,
    pub(super) damped: bool,
    pub(super) strays: Strays,
}

saved! { Columns {
    first, count, node_count, reads, window, blocks, runs, own_runs, near, near_indices, far, far_indices,
    own_rest_lengths, own_stiffnesses, own_stiffness, own_dampings, damped, strays,
} }

impl Columns {
    /// Creates empty columns for `nodes` of a body with `node_count` nodes. Columns with per-spring parameters use this
    /// uniform stiffness; with `None` each spring has its own.
    pub fn new(nodes: Range<usize>, node_count: usize, own_stiffness: Option<f32>, damped: bool) -> Self {
        assert!(nodes.start.is_multiple_of(LANES) && nodes.end <= node_count && nodes.len() <= TILE);
        Self {
            first: nodes.start,
            count: nodes.len(),
            node_count,
            reads: nodes.start as isize..nodes.end.next_multiple_of(LANES) as isize,
            window: nodes
                .start
                .saturating_sub(NEAR_WINDOW / 2)
                .min(node_count.saturating_sub(NEAR_WINDOW)),
            blocks: Vec::new(),
            runs: Vec::new(),
            own_runs: Vec::new(),
            near: Vec::new(),
            near_indices: Vec::new(),
            far: Vec::new(),
            far_indices: Vec::new(),
            own_rest_lengths: Vec::new(),
            own_stiffnesses: Vec::new(),
            own_stiffness: own_stiffness.unwrap_or(f32::NAN),
            own_dampings: Vec::new(),
            damped,
            strays: Strays::new(nodes.start, node_count, damped),
        }
    }

    /// Appends the columns of the next sixteen nodes. Shared parameters refer to `table`.
    pub fn push_block(&mut self, columns: &[Column], table: &[SpringParameters]) -> Result<()> {
        let first = self.first + self.blocks.len() * LANES;
        let nodes = (self.first + self.count).saturating_sub(first).min(LANES);
        assert!(nodes > 0, "a block beyond the tile's last node");
        let kinds: [fn(&Self, &Neighbors) -> bool; 3] = [
            |_, neighbors| matches!(neighbors, Neighbors::Run(_)),
            Self::is_near,
            Self::is_far,
        ];
        for kind in kinds {
            for column in columns {
                if kind(self, &column.neighbors) {
                    assert!(column.lanes != 0 && u32::from(column.lanes) < 1 << nodes);
                    self.push_column(first, column, table)?;
                }
            }
        }
        memory::push(
            &mut self.blocks,
            ColumnEnds {
                runs: self.runs.len() as u32,
                own_runs: self.own_runs.len() as u32,
                near: self.near.len() as u32,
                far: self.far.len() as u32,
                own: self.own_rest_lengths.len() as u32,
            },
        )
    }

    /// Appends nodes without links up to the body's node `end`. Changes nothing on failure.
    pub fn grow(&mut self, end: usize) -> Result<()> {
        let count = end - self.first;
        assert!(count <= TILE);
        let blocks = count.div_ceil(LANES);
        memory::reserve(&mut self.blocks, blocks)?;
        let (_, empty) = match self.blocks.len() {
            0 => Default::default(),
            block_count => self.ends(block_count - 1),
        };
        self.blocks.resize(blocks, empty);
        self.count = count;
        self.extend_node_count(end);
        self.extend_reads(self.first as isize..end.next_multiple_of(LANES) as isize);
        Ok(())
    }

    /// Removes the last nodes of the body, down to `end` in this tile. The removed nodes have no links.
    pub fn shrink_nodes(&mut self, end: usize, node_count: usize) {
        self.count = end - self.first;
        self.blocks.truncate(self.count.div_ceil(LANES));
        let last = self.blocks.last().copied().unwrap_or_default();
        self.runs.truncate(last.runs as usize);
        self.own_runs.truncate(last.own_runs as usize);
        self.near.truncate(last.near as usize);
        self.near_indices.truncate(last.near as usize);
        self.far.truncate(last.far as usize);
        self.far_indices.truncate(last.far as usize);
        self.own_rest_lengths.truncate(last.own as usize);
        self.own_stiffnesses.truncate(last.own as usize);
        self.own_dampings.truncate(last.own as usize);
        self.node_count = self.node_count.min(node_count);
        self.strays.shrink(node_count);
        if self.reads.end > node_count as isize {
            self.clamp_unused_lanes();
        }
    }

    /// Redirects unused lanes to existing nodes.
    fn clamp_unused_lanes(&mut self) {
        // A run with any used lane ends within the margin.
        let end = self.node_count.next_multiple_of(LANES) + MARGIN;
        self.reads.end = self.reads.end.min(end as isize);
        for run in self.runs.iter_mut().filter(|run| run.lanes == 0) {
            run.offset = 0;
        }
        for run in self.own_runs.iter_mut().filter(|run| run.lanes == 0) {
            run.offset = 0;
        }
        let (first, window, node_count) = (self.first, self.window, self.node_count);
        for index in self.near_indices.iter_mut().flat_map(|column| &mut column.0) {
            if window + usize::from(*index) >= node_count {
                *index = (first - window) as u16;
            }
        }
        for index in self.far_indices.iter_mut().flat_map(|column| &mut column.0) {
            if *index as usize >= node_count {
                *index = first as u32;
            }
        }
    }

    /// Raises the body's number of nodes.
    pub fn extend_node_count(&mut self, node_count: usize) {
        self.node_count = self.node_count.max(node_count);
        self.strays.extend_node_count(node_count);
    }

    /// Adds a column of the sixteen nodes starting at `first`.
    fn push_column(&mut self, first: usize, column: &Column, table: &[SpringParameters]) -> Result<()> {
        let Column { lanes, .. } = *column;
        let entry = self.push_parameters(&column.parameters)?;
        match column.neighbors {
            Neighbors::Run(offset) => {
                // If one lane has a neighbor, the other lanes stay within the margins.
                const { assert!(MARGIN >= LANES) };
                for lane in set_lanes(lanes) {
                    let neighbor = (first + lane).checked_add_signed(offset as isize);
                    assert!(neighbor.is_some_and(|neighbor| neighbor < self.node_count));
                }
                let start = first as isize + offset as isize;
                self.extend_reads(start..start + LANES as isize);
                if entry == OWN_PARAMETERS {
                    return memory::push(&mut self.own_runs, OwnRun { offset, lanes });
                }
                let shared = &table[usize::from(entry)];
                let run = RunColumn {
                    offset,
                    lanes,
                    entry,
                    stiffness: shared.stiffness,
                    half_tension: shared.half_tension(),
                };
                memory::push(&mut self.runs, run)
            }
            Neighbors::Gather(neighbors) => {
                assert!(neighbors.iter().all(|&neighbor| (neighbor as usize) < self.node_count));
                for node in neighbors {
                    self.extend_reads(node as isize..node as isize + 1);
                }
                let gather = GatherColumn { lanes, entry };
                if self.is_near(&column.neighbors) {
                    let indices = neighbors.map(|neighbor| (neighbor as usize - self.window) as u16);
                    memory::push(&mut self.near, gather)?;
                    memory::push(&mut self.near_indices, NearIndices(indices))
                } else {
                    memory::push(&mut self.far, gather)?;
                    memory::push(&mut self.far_indices, FarIndices(neighbors))
                }
            }
        }
    }

    fn extend_reads(&mut self, nodes: Range<isize>) {
        self.reads.start = self.reads.start.min(nodes.start);
        self.reads.end = self.reads.end.max(nodes.end);
    }

    /// The number of gathered neighbors, unused lanes included.
    pub fn gather_count(&self) -> usize {
        LANES * (self.near.len() + self.far.len())
    }

    /// The range of nodes whose positions the forces depend on.
    pub fn reads(&self) -> Range<isize> {
        self.reads.clone()
    }

    fn is_near(&self, neighbors: &Neighbors) -> bool {
        let near = self.window..self.window + NEAR_WINDOW;
        matches!(neighbors, Neighbors::Gather(nodes) if nodes.iter().all(|&node| near.contains(&(node as usize))))
    }

    fn is_far(&self, neighbors: &Neighbors) -> bool {
        matches!(neighbors, Neighbors::Gather(_)) && !self.is_near(neighbors)
    }

    fn push_parameters(&mut self, parameters: &ColumnParameters) -> Result<u16> {
        match parameters {
            &ColumnParameters::Shared(entry) => {
                assert!(entry != OWN_PARAMETERS);
                Ok(entry)
            }
            ColumnParameters::Own {
                stiffnesses,
                rest_lengths,
                dampings,
            } => {
                memory::push(&mut self.own_rest_lengths, *rest_lengths)?;
                if self.own_stiffness.is_nan() {
                    memory::push(&mut self.own_stiffnesses, *stiffnesses)?;
                }
                if self.damped {
                    memory::push(&mut self.own_dampings, *dampings)?;
                }
                Ok(OWN_PARAMETERS)
            }
        }
    }

    /// Releases excess capacity after all columns were added.
    pub fn shrink(&mut self) -> Result<()> {
        memory::shrink(&mut self.blocks)?;
        memory::shrink(&mut self.runs)?;
        memory::shrink(&mut self.own_runs)?;
        memory::shrink(&mut self.near)?;
        memory::shrink(&mut self.near_indices)?;
        memory::shrink(&mut self.far)?;
        memory::shrink(&mut self.far_indices)?;
        memory::shrink(&mut self.own_rest_lengths)?;
        memory::shrink(&mut self.own_stiffnesses)?;
        memory::shrink(&mut self.own_dampings)
    }

    /// The links outside of columns.
    pub fn strays(&self) -> &Strays {
        &self.strays
    }

    /// Reserves memory for `count` more strays.
    pub fn reserve_strays(&mut self, count: usize) -> Result<()> {
        self.strays.reserve(count)
    }

    /// Adds a link of `node` as a stray, within the reserved memory.
    pub fn insert_stray(&mut self, node: usize, link: &Link) {
        self.strays.insert(node, link);
        self.extend_reads(link.neighbor as isize..link.neighbor as isize + 1);
    }

    /// Bytes in use, and bytes held from the allocator.
    pub fn bytes(&self) -> (usize, usize) {
        let lists = [
            bytes_of(&self.blocks),
            bytes_of(&self.runs),
            bytes_of(&self.own_runs),
            bytes_of(&self.near),
            bytes_of(&self.near_indices),
            bytes_of(&self.far),
            bytes_of(&self.far_indices),
            bytes_of(&self.own_rest_lengths),
            bytes_of(&self.own_stiffnesses),
            bytes_of(&self.own_dampings),
        ];
        let add = |(used, held), (more, more_held)| (used + more, held + more_held);
        lists.into_iter().fold(self.strays.bytes(), add)
    }

    /// Calls `f` for each link of `node`.
    pub fn visit(&self, node: usize, table: &[SpringParameters], f: &mut dyn FnMut(Link)) {
        self.visit_columns(node, table, f);
        self.strays.visit(node, f);
    }

    /// Calls `f` for each link of `node` in a column.
    pub(super) fn visit_columns(&self, node: usize, table: &[SpringParameters], f: &mut dyn FnMut(Link)) {
        let lane = (node - self.first) % LANES;
        self.visit_columns_of(node, &mut |_, entry, own, neighbor| {
            let entry = match entry {
                Some(entry) => table[entry],
                None => self.own_parameters(own, lane),
            };
            f(Link {
                neighbor: neighbor as u32,
                stiffness: entry.stiffness,
                rest_length: entry.rest_length,
                damping: entry.damping,
            });
        });
    }

    /// Counts the given links of a node that share their parameters. New parameters would move them out of their
    /// columns.
    pub fn count_shared(&self, links: &[(u32, Link)]) -> usize {
        let chunks = links.chunks(LINKS_PER_SEARCH);
        chunks
            .map(|links| {
                self.find_links(links)
                    .iter()
                    .filter(|slot| **slot == Some(None))
                    .count()
            })
            .sum()
    }

    /// Reserves memory for per-spring stiffnesses if any of these differs from the uniform one.
    pub fn reserve_stiffnesses(&mut self, mut stiffnesses: impl Iterator<Item = f32>) -> Result<()> {
        let uniform = self.own_stiffness;
        if !uniform.is_nan() && stiffnesses.any(|stiffness| stiffness != uniform) {
            self.own_stiffnesses = memory::filled(F32x16([uniform; LANES]), self.own_rest_lengths.len())?;
            self.own_stiffness = f32::NAN;
        }
        Ok(())
    }

    /// Sets the parameters of a node's links, sorted by neighbor, within the reserved memory. Links with shared
    /// parameters become strays. Returns the number of these.
    pub fn set(&mut self, links: &[(u32, Link)]) -> usize {
        let mut moved = 0;
        for links in links.chunks(LINKS_PER_SEARCH) {
            let slots = self.find_links(links);
            for (&(node, link), slot) in links.iter().zip(slots) {
                let node = node as usize;
                match slot {
                    Some(Some(own)) => {
                        let lane = (node - self.first) % LANES;
                        self.own_rest_lengths[own].0[lane] = link.rest_length;
                        if let Some(line) = self.own_stiffnesses.get_mut(own) {
                            line.0[lane] = link.stiffness;
                        }
                        if let Some(line) = self.own_dampings.get_mut(own) {
                            line.0[lane] = link.damping;
                        }
                    }
                    Some(None) => {
                        self.remove(node, link.neighbor as usize);
                        self.insert_stray(node, &link);
                        moved += 1;
                    }
                    None => {
                        self.strays.set(node, &link);
                    }
                }
            }
        }
        moved
    }

    /// Finds up to sixteen links of a node, sorted by neighbor. Each result is the link's index among per-spring
    /// parameters, `Some(None)` for shared parameters, or `None` if the link is in no column.
    fn find_links(&self, links: &[(u32, Link)]) -> [Option<Option<usize>>; LINKS_PER_SEARCH] {
        let mut slots = [None; LINKS_PER_SEARCH];
        if let Some((node, _)) = links.first() {
            self.visit_columns_of(*node as usize, &mut |_, entry, own, other| {
                if let Ok(index) = links.binary_search_by_key(&other, |(_, link)| link.neighbor as usize) {
                    slots[index] = Some(entry.is_none().then_some(own));
                }
            });
        }
        slots
    }

    /// Removes the link from `node` to `neighbor`. Returns true if there was one.
    pub fn remove(&mut self, node: usize, neighbor: usize) -> bool {
        let mut location = None;
        self.visit_columns_of(node, &mut |candidate, _, _, other| {
            if other == neighbor {
                location = Some(candidate);
            }
        });
        let lanes = match location {
            Some(LinkLocation::Run(run)) => &mut self.runs[run].lanes,
            Some(LinkLocation::OwnRun(run)) => &mut self.own_runs[run].lanes,
            Some(LinkLocation::Near(near)) => &mut self.near[near].lanes,
            Some(LinkLocation::Far(far)) => &mut self.far[far].lanes,
            None => return self.strays.remove(node, neighbor),
        };
        *lanes &= !(1 << ((node - self.first) % LANES));
        true
    }

    /// Calls `f` for each column in which `node` has a link. The arguments are its location, its index in the parameter
    /// table, its index among per-spring parameters, and the neighbor.
    fn visit_columns_of(&self, node: usize, f: &mut dyn FnMut(LinkLocation, Option<usize>, usize, usize)) {
        let local_node = node - self.first;
        let (block, lane) = (local_node / LANES, local_node % LANES);
        let (start, end) = self.ends(block);
        let mut own = start.own as usize;
        let mut f = |location, lanes: u16, entry: Option<usize>, neighbor| {
            if lanes >> lane & 1 == 1 {
                f(location, entry, own, neighbor);
            }
            own += usize::from(entry.is_none());
        };
        // In an unused lane this may be no valid node.
        let at = |offset: i32| node.wrapping_add_signed(offset as isize);
        for index in start.runs as usize..end.runs as usize {
            let run = &self.runs[index];
            f(
                LinkLocation::Run(index),
                run.lanes,
                Some(usize::from(run.entry)),
                at(run.offset),
            );
        }
        for index in start.own_runs as usize..end.own_runs as usize {
            let run = &self.own_runs[index];
            f(LinkLocation::OwnRun(index), run.lanes, None, at(run.offset));
        }
        for index in start.near as usize..end.near as usize {
            let gather = self.near[index];
            let neighbor = self.window + usize::from(self.near_indices[index].0[lane]);
            f(LinkLocation::Near(index), gather.lanes, gather.entry(), neighbor);
        }
        for index in start.far as usize..end.far as usize {
            let gather = self.far[index];
            let neighbor = self.far_indices[index].0[lane] as usize;
            f(LinkLocation::Far(index), gather.lanes, gather.entry(), neighbor);
        }
    }

    fn own_parameters(&self, own: usize, lane: usize) -> SpringParameters {
        SpringParameters {
            stiffness: self
                .own_stiffnesses
                .get(own)
                .map_or(self.own_stiffness, |line| line.0[lane]),
            rest_length: self.own_rest_lengths[own].0[lane],
            damping: self.own_dampings.get(own).map_or(0.0, |line| line.0[lane]),
        }
    }

    /// The start and end of a block's columns.
    #[inline(always)]
    pub(super) fn ends(&self, block: usize) -> (ColumnEnds, ColumnEnds) {
        let start = if block == 0 {
            ColumnEnds::default()
        } else {
            self.blocks[block - 1]
        };
        (start, self.blocks[block])
    }
}

fn bytes_of<T>(values: &Vec<T>) -> (usize, usize) {
    (size_of_val(&**values), values.capacity() * size_of::<T>())
}

fn set_lanes(lanes: u16) -> impl Iterator<Item = usize> {
    (0..LANES).filter(move |&lane| lanes >> lane & 1 == 1)
}
