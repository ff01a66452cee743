//! The links of a tile in columns: one link each of sixteen nodes that lie side by side.
//!
//! A column is a *run* where the neighbours lie side by side too, so that one load fetches them, and a *gather* where they
//! do not. Its springs share their parameters, or bring their own. What fills no column well, such as most links of a node
//! that has far more than those around it, is a *stray*: sixteen of those, of any nodes, are worked on at a time.
//!
//! Whatever is read without a check at every step is checked here when it is put in.

use std::ops::Range;

use super::layout::{
    Column, ColumnEnds, FarIndices, GatherColumn, Line, LinkPlace, NearIndices, Neighbours, OWN, OwnRun, Parameters,
    RunColumn, SpringMaterial,
};
use super::strays::Strays;
use crate::base::{Result, memory};
use crate::codec::saved;
use crate::order::LANES;
use crate::soa::{MARGIN, TILE};
use crate::springs::Link;

/// How far ahead a gather with small indices reaches.
const WINDOW: usize = 1 << 16;

/// How many links of a node are looked for at a time.
const AT_ONCE: usize = 16;

/// The links of the nodes of one tile.
#[derive(Debug)]
pub(crate) struct Columns {
    /// The tile's first node, and how many it has.
    pub(super) first: usize,
    pub(super) count: usize,
    /// Nodes of the body.
    pub(super) node_count: usize,
    /// The nodes that the kernel reads; sixteen more at most at the ends of a body.
    pub(super) reads: Range<isize>,
    /// What small indices count from.
    pub(super) window: usize,
    pub(super) blocks: Vec<ColumnEnds>,
    pub(super) runs: Vec<RunColumn>,
    pub(super) own_runs: Vec<OwnRun>,
    pub(super) near: Vec<GatherColumn>,
    pub(super) near_indices: Vec<NearIndices>,
    pub(super) far: Vec<GatherColumn>,
    pub(super) far_indices: Vec<FarIndices>,
    /// The parameters of columns that bring their own, in the order of the blocks, and in a block runs first, then near and
    /// far gathers.
    pub(super) own_rest_lengths: Vec<Line>,
    /// Empty where all of them are `own_stiffness`.
    pub(super) own_stiffnesses: Vec<Line>,
    pub(super) own_stiffness: f32,
    /// Empty in a body whose springs have no damping.
    pub(super) own_dampings: Vec<Line>,
    pub(super) damped: bool,
    pub(super) strays: Strays,
}

saved! { Columns {
    first, count, node_count, reads, window, blocks, runs, own_runs, near, near_indices, far, far_indices,
    own_rest_lengths, own_stiffnesses, own_stiffness, own_dampings, damped, strays,
} }

impl Columns {
    /// No links yet of `nodes`, of a body of `node_count`. Springs that bring their own parameters have this stiffness;
    /// `None`: each its own.
    pub fn new(nodes: Range<usize>, node_count: usize, own_stiffness: Option<f32>, damped: bool) -> Self {
        assert!(nodes.start.is_multiple_of(LANES) && nodes.end <= node_count && nodes.len() <= TILE);
        Self {
            first: nodes.start,
            count: nodes.len(),
            node_count,
            reads: nodes.start as isize..nodes.end.next_multiple_of(LANES) as isize,
            window: nodes
                .start
                .saturating_sub(WINDOW / 2)
                .min(node_count.saturating_sub(WINDOW)),
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

    /// The columns of the next sixteen nodes; those that are shared are of `materials`.
    pub fn push_block(&mut self, columns: &[Column], materials: &[SpringMaterial]) -> Result<()> {
        let first = self.first + self.blocks.len() * LANES;
        let nodes = (self.first + self.count).saturating_sub(first).min(LANES);
        assert!(nodes > 0, "a block beyond the tile's last node");
        let kinds: [fn(&Self, &Neighbours) -> bool; 3] = [
            |_, neighbours| matches!(neighbours, Neighbours::Run(_)),
            Self::is_near,
            Self::is_far,
        ];
        for kind in kinds {
            for column in columns {
                if kind(self, &column.neighbours) {
                    assert!(column.lanes != 0 && u32::from(column.lanes) < 1 << nodes);
                    self.push_column(first, column, materials)?;
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

    /// Adds nodes without links, up to this one in the order of the body. Changes nothing where it fails.
    pub fn grow(&mut self, end: usize) -> Result<()> {
        let count = end - self.first;
        assert!(count <= TILE);
        let blocks = count.div_ceil(LANES);
        memory::reserve(&mut self.blocks, blocks)?;
        let (_, empty) = match self.blocks.len() {
            0 => Default::default(),
            known => self.ends(known - 1),
        };
        self.blocks.resize(blocks, empty);
        self.count = count;
        self.reach(end);
        self.reads_also(self.first as isize..end.next_multiple_of(LANES) as isize);
        Ok(())
    }

    /// Takes away the last nodes of the body, of which those of the tile have no links, up to this one.
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
            self.turn_back();
        }
    }

    /// Has lanes without a link lead to nodes that there are.
    fn turn_back(&mut self) {
        // A run ends within the margin where one of its lanes has a link.
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

    /// The body has so many nodes now.
    pub fn reach(&mut self, node_count: usize) {
        self.node_count = self.node_count.max(node_count);
        self.strays.reach(node_count);
    }

    /// A column of the sixteen nodes from `first` on.
    fn push_column(&mut self, first: usize, column: &Column, materials: &[SpringMaterial]) -> Result<()> {
        let Column { lanes, .. } = *column;
        let material = self.push_parameters(&column.parameters)?;
        match column.neighbours {
            Neighbours::Run(offset) => {
                // Where one lane has a neighbour, those of the others lie within the margins.
                const { assert!(MARGIN >= LANES) };
                for lane in set_lanes(lanes) {
                    let neighbour = (first + lane).checked_add_signed(offset as isize);
                    assert!(neighbour.is_some_and(|neighbour| neighbour < self.node_count));
                }
                let start = first as isize + offset as isize;
                self.reads_also(start..start + LANES as isize);
                if material == OWN {
                    return memory::push(&mut self.own_runs, OwnRun { offset, lanes });
                }
                let shared = &materials[usize::from(material)];
                let run = RunColumn {
                    offset,
                    lanes,
                    material,
                    stiffness: shared.stiffness,
                    half_tension: shared.half_tension(),
                };
                memory::push(&mut self.runs, run)
            }
            Neighbours::Gather(neighbours) => {
                assert!(
                    neighbours
                        .iter()
                        .all(|&neighbour| (neighbour as usize) < self.node_count)
                );
                for node in neighbours {
                    self.reads_also(node as isize..node as isize + 1);
                }
                let gather = GatherColumn { lanes, material };
                if self.is_near(&column.neighbours) {
                    let indices = neighbours.map(|neighbour| (neighbour as usize - self.window) as u16);
                    memory::push(&mut self.near, gather)?;
                    memory::push(&mut self.near_indices, NearIndices(indices))
                } else {
                    memory::push(&mut self.far, gather)?;
                    memory::push(&mut self.far_indices, FarIndices(neighbours))
                }
            }
        }
    }

    fn reads_also(&mut self, nodes: Range<isize>) {
        self.reads.start = self.reads.start.min(nodes.start);
        self.reads.end = self.reads.end.max(nodes.end);
    }

    /// How many neighbours are gathered, of nodes without them too.
    pub fn gathers(&self) -> usize {
        LANES * (self.near.len() + self.far.len())
    }

    /// The nodes whose positions forces are made of.
    pub fn reads(&self) -> Range<isize> {
        self.reads.clone()
    }

    fn is_near(&self, neighbours: &Neighbours) -> bool {
        let near = self.window..self.window + WINDOW;
        matches!(neighbours, Neighbours::Gather(nodes) if nodes.iter().all(|&node| near.contains(&(node as usize))))
    }

    fn is_far(&self, neighbours: &Neighbours) -> bool {
        matches!(neighbours, Neighbours::Gather(_)) && !self.is_near(neighbours)
    }

    fn push_parameters(&mut self, parameters: &Parameters) -> Result<u16> {
        match parameters {
            &Parameters::Shared(material) => {
                assert!(material != OWN);
                Ok(material)
            }
            Parameters::Own {
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
                Ok(OWN)
            }
        }
    }

    /// Gives back what was reserved too much while columns were put in.
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

    /// Links beside the columns.
    pub fn strays(&self) -> &Strays {
        &self.strays
    }

    /// Makes room for `count` more links beside the columns.
    pub fn reserve_strays(&mut self, count: usize) -> Result<()> {
        self.strays.reserve(count)
    }

    /// Puts a link of `node` beside the columns, where there is room for it.
    pub fn insert_stray(&mut self, node: usize, link: &Link) {
        self.strays.insert(node, link);
        self.reads_also(link.neighbour as isize..link.neighbour as isize + 1);
    }

    /// Bytes in use, and bytes held from the allocator.
    pub fn bytes(&self) -> (usize, usize) {
        let of_lists = [
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
        of_lists.into_iter().fold(self.strays.bytes(), add)
    }

    /// Shows the links of `node`.
    pub fn visit(&self, node: usize, materials: &[SpringMaterial], see: &mut dyn FnMut(Link)) {
        self.visit_columns(node, materials, see);
        self.strays.visit(node, see);
    }

    /// Shows the links of `node` that are in columns.
    pub(super) fn visit_columns(&self, node: usize, materials: &[SpringMaterial], see: &mut dyn FnMut(Link)) {
        let lane = (node - self.first) % LANES;
        self.columns_of(node, &mut |_, material, own, neighbour| {
            let material = match material {
                Some(material) => materials[material],
                None => self.own_parameters(own, lane),
            };
            see(Link {
                neighbour: neighbour as u32,
                stiffness: material.stiffness,
                rest_length: material.rest_length,
                damping: material.damping,
            });
        });
    }

    /// How many of some links of a node share their parameters with others: they would have to leave their columns to have others.
    pub fn shared(&self, links: &[(u32, Link)]) -> usize {
        let chunks = links.chunks(AT_ONCE);
        chunks
            .map(|links| {
                self.find_all(links)
                    .iter()
                    .filter(|place| **place == Some(None))
                    .count()
            })
            .sum()
    }

    /// Makes room for springs in columns to have any of these stiffnesses.
    pub fn room_for_stiffnesses(&mut self, mut stiffnesses: impl Iterator<Item = f32>) -> Result<()> {
        let uniform = self.own_stiffness;
        if !uniform.is_nan() && stiffnesses.any(|stiffness| stiffness != uniform) {
            self.own_stiffnesses = memory::filled(Line([uniform; LANES]), self.own_rest_lengths.len())?;
            self.own_stiffness = f32::NAN;
        }
        Ok(())
    }

    /// Gives links of a node, in the order of their neighbours, other parameters, for which there is room; those that
    /// share their parameters go beside the columns: how many.
    pub fn set(&mut self, links: &[(u32, Link)]) -> usize {
        let mut left = 0;
        for links in links.chunks(AT_ONCE) {
            let places = self.find_all(links);
            for (&(node, link), place) in links.iter().zip(places) {
                let node = node as usize;
                match place {
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
                        self.remove(node, link.neighbour as usize);
                        self.insert_stray(node, &link);
                        left += 1;
                    }
                    None => {
                        self.strays.set(node, &link);
                    }
                }
            }
        }
        left
    }

    /// Where in columns links of a node are, a few in the order of their neighbours: their places among those with parameters of their
    /// own, `Some(None)`: they share theirs; `None`: in no column.
    fn find_all(&self, links: &[(u32, Link)]) -> [Option<Option<usize>>; AT_ONCE] {
        let mut places = [None; AT_ONCE];
        if let Some((node, _)) = links.first() {
            self.columns_of(*node as usize, &mut |_, material, own, other| {
                if let Ok(index) = links.binary_search_by_key(&other, |(_, link)| link.neighbour as usize) {
                    places[index] = Some(material.is_none().then_some(own));
                }
            });
        }
        places
    }

    /// Takes out the link from `node` to `neighbour`; whether there was one.
    pub fn remove(&mut self, node: usize, neighbour: usize) -> bool {
        let mut place = None;
        self.columns_of(node, &mut |found, _, _, other| {
            if other == neighbour {
                place = Some(found);
            }
        });
        let lanes = match place {
            Some(LinkPlace::Run(run)) => &mut self.runs[run].lanes,
            Some(LinkPlace::OwnRun(run)) => &mut self.own_runs[run].lanes,
            Some(LinkPlace::Near(near)) => &mut self.near[near].lanes,
            Some(LinkPlace::Far(far)) => &mut self.far[far].lanes,
            None => return self.strays.remove(node, neighbour),
        };
        *lanes &= !(1 << ((node - self.first) % LANES));
        true
    }

    /// Shows the columns in which `node` has a link: place, place in the table of materials, place among those with parameters
    /// of their own, and the neighbour.
    fn columns_of(&self, node: usize, see: &mut dyn FnMut(LinkPlace, Option<usize>, usize, usize)) {
        let place = node - self.first;
        let (block, lane) = (place / LANES, place % LANES);
        let (start, end) = self.ends(block);
        let mut own = start.own as usize;
        let mut see = |found, lanes: u16, material: Option<usize>, neighbour| {
            if lanes >> lane & 1 == 1 {
                see(found, material, own, neighbour);
            }
            own += usize::from(material.is_none());
        };
        // In a lane that is not set this may be no node.
        let at = |offset: i32| node.wrapping_add_signed(offset as isize);
        for index in start.runs as usize..end.runs as usize {
            let run = &self.runs[index];
            see(
                LinkPlace::Run(index),
                run.lanes,
                Some(usize::from(run.material)),
                at(run.offset),
            );
        }
        for index in start.own_runs as usize..end.own_runs as usize {
            let run = &self.own_runs[index];
            see(LinkPlace::OwnRun(index), run.lanes, None, at(run.offset));
        }
        for index in start.near as usize..end.near as usize {
            let gather = self.near[index];
            let neighbour = self.window + usize::from(self.near_indices[index].0[lane]);
            see(LinkPlace::Near(index), gather.lanes, gather.material(), neighbour);
        }
        for index in start.far as usize..end.far as usize {
            let gather = self.far[index];
            let neighbour = self.far_indices[index].0[lane] as usize;
            see(LinkPlace::Far(index), gather.lanes, gather.material(), neighbour);
        }
    }

    fn own_parameters(&self, own: usize, lane: usize) -> SpringMaterial {
        SpringMaterial {
            stiffness: self
                .own_stiffnesses
                .get(own)
                .map_or(self.own_stiffness, |line| line.0[lane]),
            rest_length: self.own_rest_lengths[own].0[lane],
            damping: self.own_dampings.get(own).map_or(0.0, |line| line.0[lane]),
        }
    }

    /// Where the columns of a block start and end.
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
