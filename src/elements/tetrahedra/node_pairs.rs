//! The pairs of nodes with a common tetrahedron, and the tangent blocks of each pair.

use super::linearize::{FindTangents, Linearize};
use super::{GROUP, Group, Tetrahedra, TetrahedronGroups};
use crate::base::{Result, memory};
use crate::codec::{Reader, Saved, Writer, saved, shape_of_name};
use crate::simd::algebra::{difference, dot};
use crate::simd::{ChosenKernel, Lanes, Record, WithLanes};

/// Pairs of corners. The second corner's displacement causes a force on the first.
pub(super) const PAIRS: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

/// The pairs of nodes of the tetrahedra of a group.
#[derive(Clone, Copy, Debug)]
pub(super) struct PairLanes {
    /// Twice the index of each of `PAIRS`, as for [`Group::corners`].
    pub indices: [[u16; GROUP]; 6],
    /// A bit for each lane: set if the first node has the lower number.
    pub are_ordered: [u16; 6],
}

saved! { PairLanes { indices, are_ordered } }

/// The pairs of nodes of a part, and the records of their blocks.
#[derive(Debug)]
pub(in crate::elements) struct NodePairs {
    pub node_count: usize,
    /// The nodes of each pair, sorted, the lower number first.
    pub nodes: Vec<[u16; 2]>,
    /// One for each group.
    lanes: Vec<PairLanes>,
    /// Three records for each pair, and for at least one of zeros: the entries xx, yy, zz of the block with the lower
    /// number first; the means of yz and zy, zx and xz, xy and yx; and half their differences.
    records: Vec<Record>,
}

impl NodePairs {
    /// Finds the pairs of a part.
    pub fn new(groups: &TetrahedronGroups) -> Result<Self> {
        let mut nodes = memory::reserved(6 * GROUP * groups.groups.len())?;
        for group in &groups.groups {
            for lane in (0..GROUP).filter(|&lane| group.volumes[lane] > 0.0) {
                nodes.extend(PAIRS.map(|pair| nodes_of(group, lane, pair)));
            }
        }
        memory::sort_once(&mut nodes);
        memory::shrink(&mut nodes)?;
        let index = |pair: [u16; 2]| nodes.partition_point(|&other| other < pair);
        let lanes = groups.groups.iter().map(|group| {
            let mut lanes = PairLanes {
                indices: [[0; GROUP]; 6],
                are_ordered: [0; 6],
            };
            for (number, pair) in PAIRS.into_iter().enumerate() {
                for lane in (0..GROUP).filter(|&lane| group.volumes[lane] > 0.0) {
                    lanes.indices[number][lane] = 2 * index(nodes_of(group, lane, pair)) as u16;
                    let is_ordered = group.corners[pair[0]][lane] < group.corners[pair[1]][lane];
                    lanes.are_ordered[number] |= u16::from(is_ordered) << lane;
                }
            }
            lanes
        });
        let lanes = memory::collected(lanes)?;
        Self::with_lanes(groups.node_count, nodes, lanes)
    }

    fn with_lanes(node_count: usize, nodes: Vec<[u16; 2]>, lanes: Vec<PairLanes>) -> Result<Self> {
        Ok(Self {
            node_count,
            records: memory::filled(Record::default(), 3 * padded(nodes.len()))?,
            nodes,
            lanes,
        })
    }

    /// The records of each kind.
    pub(super) fn kinds(&self) -> [&[Record]; 3] {
        let count = padded(self.nodes.len());
        [0, count, 2 * count].map(|start| &self.records[start..start + count])
    }

    pub fn group_count(&self) -> usize {
        self.lanes.len()
    }

    /// The number of norms that [`Self::find_norms`] writes.
    pub fn norm_count(&self) -> usize {
        padded(self.nodes.len())
    }

    /// Computes the norms of the blocks of pairs and of nodes: the largest singular values, or a few percent more.
    /// The block of a node is minus the sum of the symmetric parts of its pairs. `sums` is memory for two records of
    /// each node.
    pub fn find_norms(
        &self,
        kernel: ChosenKernel,
        norms: &mut [f32],
        node_norms: &mut [f32],
        (sums, spreads): (&mut [Record], &mut [f32]),
    ) {
        let [diagonals, symmetric, antisymmetric] = self.kinds();
        let (node_diagonals, node_symmetric) = sums.split_at_mut(node_norms.len());
        node_diagonals.fill(Record::default());
        node_symmetric.fill(Record::default());
        for ((&nodes, diagonal), symmetric) in self.nodes.iter().zip(diagonals).zip(symmetric) {
            for node in nodes.map(usize::from) {
                for axis in 0..4 {
                    node_diagonals[node].0[axis] += diagonal.0[axis];
                    node_symmetric[node].0[axis] += symmetric.0[axis];
                }
            }
        }
        let zeros = &[Record::default(); GROUP];
        for (kinds, norms, is_symmetric) in [
            ([diagonals, symmetric, antisymmetric], norms, false),
            ([&*node_diagonals, &*node_symmetric, zeros], node_norms, true),
        ] {
            let spreads = &mut spreads[..norms.len()];
            kernel.run_with_lanes(FindSpectra {
                kinds,
                is_symmetric,
                means: norms,
                spreads,
            });
            for (norm, spread) in norms.iter_mut().zip(spreads) {
                *norm = (*norm + 2.0 * spread.sqrt()).sqrt();
            }
        }
    }

    /// Assembles the blocks.
    pub(super) fn assemble(&mut self, kernel: ChosenKernel, law: impl Linearize, tetrahedra: Tetrahedra) {
        assert!(self.lanes.len() == tetrahedra.groups.len());
        self.records.fill(Record::default());
        let count = padded(self.nodes.len());
        kernel.run_with_lanes(FindTangents {
            law,
            pairs: &self.lanes,
            records: [0, count, 2 * count].map(|start| self.records[start..].as_mut_ptr()),
            tetrahedra,
        });
    }
}

/// Computes the mean and the squared spread of the eigenvalues of `K^T K` for blocks K. The largest is at most the mean
/// plus twice the spread.
struct FindSpectra<'a> {
    kinds: [&'a [Record]; 3],
    is_symmetric: bool,
    means: &'a mut [f32],
    spreads: &'a mut [f32],
}

impl WithLanes for FindSpectra<'_> {
    type Output = ();

    #[inline(always)]
    unsafe fn run<L: Lanes>(self) {
        let Self {
            kinds,
            is_symmetric,
            means,
            spreads,
        } = self;
        // The last batch overlaps the one before it.
        let count = means.len();
        assert!(count >= L::COUNT && spreads.len() == count);
        assert!(kinds[0].len() >= count && kinds[1].len() >= count && (is_symmetric || kinds[2].len() >= count));
        // SAFETY: the same contract; all batches are within the records and the results.
        unsafe {
            let (third, sixth) = (L::splat(1.0 / 3.0), L::splat(1.0 / 6.0));
            for batch in 0..count.div_ceil(L::COUNT) {
                let first = (batch * L::COUNT).min(count - L::COUNT);
                let [xx, yy, zz, _] = L::load_transposed(|lane| kinds[0].as_ptr().wrapping_add(first + lane));
                let [yz, zx, xy, _] = L::load_transposed(|lane| kinds[1].as_ptr().wrapping_add(first + lane));
                let mut columns = [[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]];
                if !is_symmetric {
                    let [a, b, c, _] = L::load_transposed(|lane| kinds[2].as_ptr().wrapping_add(first + lane));
                    columns = [
                        [xx, xy.sub(c), zx.add(b)],
                        [xy.add(c), yy, yz.sub(a)],
                        [zx.sub(b), yz.add(a), zz],
                    ];
                }
                let [x, y, z] = columns;
                let squares = [dot(x, x), dot(y, y), dot(z, z)];
                let products = [dot(y, z), dot(z, x), dot(x, y)];
                let mean = squares[0].add(squares[1]).add(squares[2]).mul(third);
                let deviation = difference(squares, [mean; 3]);
                let off_diagonal = dot(products, products);
                let spread = dot(deviation, deviation).add(off_diagonal).add(off_diagonal).mul(sixth);
                mean.store(means.as_mut_ptr().add(first));
                spread.store(spreads.as_mut_ptr().add(first));
            }
        }
    }
}

/// The number of records of each kind for this number of pairs.
fn padded(count: usize) -> usize {
    (count + 1).next_multiple_of(GROUP)
}

/// The nodes of a pair of corners, the lower number first.
fn nodes_of(group: &Group, lane: usize, pair: [usize; 2]) -> [u16; 2] {
    let [a, b] = pair.map(|corner| group.corners[corner][lane] / 2);
    [a.min(b), a.max(b)]
}

/// The blocks are not saved: they are assembled before they are used.
impl Saved for NodePairs {
    const SHAPE: u64 = shape_of_name("NodePairs { node_count, nodes, lanes }");
    const LEAST: usize = size_of::<u64>();

    fn save(&self, to: &mut Writer) {
        self.node_count.save(to);
        self.nodes.save(to);
        self.lanes.save(to);
    }

    fn load(from: &mut Reader) -> Result<Self> {
        let (node_count, nodes, lanes) = (
            usize::load(from)?,
            Vec::<[u16; 2]>::load(from)?,
            Vec::<PairLanes>::load(from)?,
        );
        let has_valid_nodes = node_count <= usize::from(u16::MAX) / 2
            && nodes.iter().flatten().all(|&node| usize::from(node) < node_count)
            && 2 * nodes.len() <= usize::from(u16::MAX);
        let mut indices = lanes.iter().flat_map(|lanes| lanes.indices.as_flattened());
        let is_valid = |&index: &u16| usize::from(index) <= 2 * nodes.len() && index.is_multiple_of(2);
        if !has_valid_nodes || !indices.all(is_valid) {
            return Err(from.refusal("no NodePairs is like this"));
        }
        Self::with_lanes(node_count, nodes, lanes)
    }
}
