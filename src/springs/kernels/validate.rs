//! Validates indices and lengths that kernels read without bounds checks.

use std::ops::Range;

use super::columns::Columns;
use super::layout::GatherColumn;
use crate::order::LANES;
use crate::soa::{MARGIN, TILE};

impl Columns {
    /// True if these are valid columns of `nodes` in a body of `node_count` nodes with a parameter table of `table_len`
    /// entries.
    pub fn is_valid(&self, nodes: Range<usize>, node_count: usize, table_len: usize) -> bool {
        let margin = MARGIN as isize;
        let end = node_count.next_multiple_of(LANES) as isize + margin;
        let ends_of_tile = [nodes.start as isize, nodes.end.next_multiple_of(LANES) as isize];
        self.first == nodes.start
            && self.count == nodes.len()
            && self.node_count <= node_count
            && nodes.len() <= TILE
            && nodes.start.is_multiple_of(LANES)
            && nodes.end <= node_count
            && -margin <= self.reads.start
            && self.reads.end <= end
            && self.reads_all(ends_of_tile[0]..ends_of_tile[1])
            && self.list_lengths_match()
            && (0..self.blocks.len()).all(|block| self.block_is_valid(block, table_len))
            && self
                .strays()
                .are_valid(nodes, node_count, self.damped, |node| self.reads_all(node..node + 1))
    }

    fn reads_all(&self, nodes: Range<isize>) -> bool {
        self.reads.start <= nodes.start && nodes.end <= self.reads.end
    }

    fn list_lengths_match(&self) -> bool {
        let last = self.blocks.last().copied().unwrap_or_default();
        let own = self.own_rest_lengths.len();
        self.blocks.len() == self.count.div_ceil(LANES)
            && last.runs as usize == self.runs.len()
            && last.own_runs as usize == self.own_runs.len()
            && last.near as usize == self.near.len()
            && last.far as usize == self.far.len()
            && last.own as usize == own
            && self.near_indices.len() == self.near.len()
            && self.far_indices.len() == self.far.len()
            && (self.own_stiffnesses.len() == own || self.own_stiffnesses.is_empty())
            && self.own_dampings.len() == if self.damped { own } else { 0 }
    }

    fn block_is_valid(&self, block: usize, table_len: usize) -> bool {
        let (start, end) = self.ends(block);
        let list = |start: u32, end: u32| start as usize..end as usize;
        let (Some(runs), Some(own_runs), Some(near), Some(far)) = (
            self.runs.get(list(start.runs, end.runs)),
            self.own_runs.get(list(start.own_runs, end.own_runs)),
            self.near.get(list(start.near, end.near)),
            self.far.get(list(start.far, end.far)),
        ) else {
            return false;
        };
        let first = self.first + block * LANES;
        let nodes = (self.count - block * LANES).min(LANES);
        let fits = |lanes: u16| u32::from(lanes) < 1 << nodes;
        let run_is_valid = |offset: i32, lanes: u16| {
            let start = first as isize + offset as isize;
            let is_node = |lane: usize| (0..self.node_count as isize).contains(&(start + lane as isize));
            fits(lanes)
                && self.reads_all(start..start + LANES as isize)
                && (0..LANES).all(|lane| lanes >> lane & 1 == 0 || is_node(lane))
        };
        let is_read_node = |node: usize| node < self.node_count && self.reads_all(node as isize..node as isize + 1);
        let gather_is_valid =
            |gather: &GatherColumn| fits(gather.lanes) && gather.entry().is_none_or(|entry| entry < table_len);
        let own = own_runs.len() + near.iter().chain(far).filter(|gather| gather.entry().is_none()).count();
        let near_indices = &self.near_indices[list(start.near, end.near)];
        let far_indices = &self.far_indices[list(start.far, end.far)];
        end.own.checked_sub(start.own) == Some(own as u32)
            && runs.iter().all(|run| run_is_valid(run.offset, run.lanes))
            && runs.iter().all(|run| usize::from(run.entry) < table_len)
            && own_runs.iter().all(|run| run_is_valid(run.offset, run.lanes))
            && near.iter().chain(far).all(gather_is_valid)
            && near_indices
                .iter()
                .flat_map(|column| column.0)
                .all(|index| is_read_node(self.window + usize::from(index)))
            && far_indices
                .iter()
                .flat_map(|column| column.0)
                .all(|index| is_read_node(index as usize))
    }
}
