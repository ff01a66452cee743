//! The assembled tangent of the tetrahedra of a part. A product with it takes a third of the time of a sum over
//! tetrahedra, and assembly takes the time of a few products.
//!
//! The matrix has a 3x3 block for each pair of nodes with a common tetrahedron. Rows are stored in slices of sixteen
//! nodes, with equal numbers of blocks (sliced ELLPACK; Monakov, Lokhmotov, Avetisyan 2010). BlockLanes multiply the
//! difference of two displacements, so no row needs a block on the diagonal, and a translation causes no force.

use std::cmp::Reverse;

use super::linearize::{Linearize, signs};
use super::node_pairs::NodePairs;
use super::{GROUP, Tetrahedra, TetrahedronGroups, batches};
use crate::base::{Result, memory};
use crate::codec::{Reader, Saved, Writer};
use crate::simd::algebra::{add_scaled, difference};
use crate::simd::{ChosenKernel, Lanes, Record, WithLanes};

/// Sixteen rows.
#[derive(Clone, Copy, Debug)]
struct Slice {
    /// Twice the indices of the nodes.
    nodes: [u16; GROUP],
    /// The end of the slice's columns; it starts where the slice before it ends.
    end: u32,
}

/// One block of each row of a slice. Rows with fewer blocks than others are filled up with blocks of zeros.
#[derive(Clone, Copy, Debug)]
struct BlockColumn {
    /// Twice the indices of the other nodes.
    nodes: [u16; GROUP],
    /// Twice the indices of the pairs.
    pairs: [u16; GROUP],
    /// A bit for each row: set if its node has the lower number.
    are_ordered: u16,
}

/// The entries of the blocks of a [`BlockColumn`]: columns of 3x3 matrices.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug)]
struct BlockLanes([[f32; GROUP]; 9]);

/// The tangent matrix of a part.
#[derive(Debug)]
pub(crate) struct TangentMatrix {
    pairs: NodePairs,
    slices: Vec<Slice>,
    columns: Vec<BlockColumn>,
    blocks: Vec<BlockLanes>,
}

impl TangentMatrix {
    /// Allocates the matrix of a part.
    pub fn new(groups: &TetrahedronGroups) -> Result<Self> {
        Self::of(NodePairs::new(groups)?)
    }

    fn of(pairs: NodePairs) -> Result<Self> {
        let (node_count, edges) = (pairs.node_count, &pairs.nodes);
        // The neighbors of each node, and the pairs with them.
        let mut starts = memory::filled(0_u32, node_count + 1)?;
        edges
            .iter()
            .flatten()
            .for_each(|&node| starts[usize::from(node) + 1] += 1);
        for node in 0..node_count {
            starts[node + 1] += starts[node];
        }
        let mut next = memory::copied(&starts)?;
        let mut neighbors = memory::filled([0_u16; 2], 2 * edges.len())?;
        for (index, &[low, high]) in edges.iter().enumerate() {
            for (node, neighbor) in [(low, high), (high, low)] {
                let to = &mut next[usize::from(node)];
                neighbors[*to as usize] = [neighbor, index as u16];
                *to += 1;
            }
        }
        let neighbors_of =
            |node: u16| &neighbors[starts[usize::from(node)] as usize..starts[usize::from(node) + 1] as usize];
        let mut rows = memory::collected(0..node_count as u16)?;
        rows.sort_by_key(|&node| Reverse(neighbors_of(node).len()));
        let longest = |rows: &[u16]| rows.iter().map(|&node| neighbors_of(node).len()).max().unwrap_or(0);
        let column_count = rows.chunks(GROUP).map(longest).sum();
        let mut slices = memory::reserved(node_count.div_ceil(GROUP))?;
        let mut columns = memory::reserved(column_count)?;
        let no_pair = 2 * edges.len() as u16;
        for rows in rows.chunks(GROUP) {
            let mut slice = Slice {
                nodes: [2 * rows[0]; GROUP],
                end: 0,
            };
            for (to, node) in slice.nodes.iter_mut().zip(rows) {
                *to = 2 * node;
            }
            for index in 0..longest(rows) {
                let mut column = BlockColumn {
                    nodes: slice.nodes,
                    pairs: [no_pair; GROUP],
                    are_ordered: 0,
                };
                for (lane, &node) in rows.iter().enumerate() {
                    if let Some(&[neighbor, pair]) = neighbors_of(node).get(index) {
                        (column.nodes[lane], column.pairs[lane]) = (2 * neighbor, 2 * pair);
                        column.are_ordered |= u16::from(node < neighbor) << lane;
                    }
                }
                columns.push(column);
            }
            slice.end = columns.len() as u32;
            slices.push(slice);
        }
        Ok(Self {
            blocks: memory::filled(BlockLanes([[0.0; GROUP]; 9]), columns.len())?,
            pairs,
            slices,
            columns,
        })
    }

    /// Assembles the matrix.
    pub(super) fn assemble(&mut self, kernel: ChosenKernel, law: impl Linearize, tetrahedra: Tetrahedra) {
        self.pairs.assemble(kernel, law, tetrahedra);
        kernel.run_with_lanes(FillBlocks {
            columns: &self.columns,
            blocks: &mut self.blocks,
            records: self.pairs.kinds().map(<[Record]>::as_ptr),
        });
    }

    /// Adds the force differentials for these displacements to `sums`, N.
    pub fn multiply(&self, kernel: ChosenKernel, displacements: &[Record], sums: &mut [Record]) {
        assert!(displacements.len() == self.pairs.node_count && sums.len() == self.pairs.node_count);
        kernel.run_with_lanes(MultiplyRows {
            matrix: self,
            displacements: displacements.as_ptr(),
            sums: sums.as_mut_ptr(),
        });
    }
}

struct FillBlocks<'a> {
    columns: &'a [BlockColumn],
    blocks: &'a mut [BlockLanes],
    records: [*const Record; 3],
}

impl WithLanes for FillBlocks<'_> {
    type Output = ();

    #[inline(always)]
    unsafe fn run<L: Lanes>(self) {
        // SAFETY: the same contract; indices of pairs are indices of records.
        unsafe {
            for (column, BlockLanes(blocks)) in self.columns.iter().zip(self.blocks) {
                for first in batches::<L>() {
                    let pairs = column.pairs.as_ptr().add(first);
                    let [xx, yy, zz, _] = L::gather_records_scaled(self.records[0], pairs);
                    let [yz, zx, xy, _] = L::gather_records_scaled(self.records[1], pairs);
                    let [a, b, c, _] = L::gather_records_scaled(self.records[2], pairs);
                    let sign = signs::<L>(column.are_ordered, first);
                    let (a, b, c) = (a.mul(sign), b.mul(sign), c.mul(sign));
                    let entries = [
                        xx,
                        xy.sub(c),
                        zx.add(b),
                        xy.add(c),
                        yy,
                        yz.sub(a),
                        zx.sub(b),
                        yz.add(a),
                        zz,
                    ];
                    for (entry, to) in entries.into_iter().zip(&mut *blocks) {
                        entry.store(to.as_mut_ptr().add(first));
                    }
                }
            }
        }
    }
}

struct MultiplyRows<'a> {
    matrix: &'a TangentMatrix,
    displacements: *const Record,
    sums: *mut Record,
}

impl WithLanes for MultiplyRows<'_> {
    type Output = ();

    #[inline(always)]
    unsafe fn run<L: Lanes>(self) {
        let Self {
            matrix,
            displacements,
            sums,
        } = self;
        // SAFETY: the same contract; nodes of slices and columns are indices of displacements and sums.
        unsafe {
            let mut start = 0;
            for slice in &matrix.slices {
                let range = start..slice.end as usize;
                start = range.end;
                let (columns, blocks) = (&matrix.columns[range.clone()], &matrix.blocks[range]);
                for first in batches::<L>() {
                    let nodes = slice.nodes.as_ptr().add(first);
                    let [x, y, z, _] = L::gather_records_scaled(displacements, nodes);
                    let mut forces = [L::splat(0.0); 3];
                    for (column, BlockLanes(block)) in columns.iter().zip(blocks) {
                        let others = column.nodes.as_ptr().add(first);
                        let [other_x, other_y, other_z, _] = L::gather_records_scaled(displacements, others);
                        let change = difference([other_x, other_y, other_z], [x, y, z]);
                        for axis in 0..3 {
                            let entries = [
                                L::load(block[3 * axis].as_ptr().add(first)),
                                L::load(block[3 * axis + 1].as_ptr().add(first)),
                                L::load(block[3 * axis + 2].as_ptr().add(first)),
                            ];
                            forces = add_scaled(forces, entries, change[axis]);
                        }
                    }
                    L::scatter_add_records(sums, nodes, forces);
                }
            }
        }
    }
}

impl Saved for TangentMatrix {
    const SHAPE: u64 = NodePairs::SHAPE;
    const LEAST: usize = NodePairs::LEAST;

    fn save(&self, to: &mut Writer) {
        self.pairs.save(to);
    }

    fn load(from: &mut Reader) -> Result<Self> {
        Self::of(NodePairs::load(from)?)
    }
}
