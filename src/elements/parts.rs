//! Parts: groups of neighboring tetrahedra with copies of their nodes.

use glam::{DMat3, DVec3};

use super::cut::{ElementPiece, TetrahedronIndex};
use super::law::{DeformedTet, ElasticLaw, RestTet};
use super::tetrahedra::{GROUP, Group, TangentMatrix, TetrahedronGroups};
use crate::base::{Result, ensure, memory};
use crate::codec::saved;
use crate::simd::Record;
use crate::soa::{TILE, tile_count};

/// The most tetrahedra of a part: their nodes stay in the first-level cache, and indices fit in 16 bits.
pub(super) const PART_SIZE: usize = 4096;

/// A set of tetrahedra and their nodes.
#[derive(Debug)]
pub(super) struct FemPart {
    /// Sorted, except in a part that a cut has added.
    pub nodes: Vec<u32>,
    pub groups: TetrahedronGroups,
    /// True if a cut has added the part.
    pub is_from_cut: bool,
}

saved! { FemPart { nodes, groups, is_from_cut } }

/// A callback for the nodes of a tetrahedron, its rest shape, and its group and lane.
pub(super) type VisitTetrahedra<'a> = dyn FnMut([u32; 4], &RestTet, [usize; 2]) + 'a;

/// Splits tetrahedra into parts.
pub(super) fn split(tetrahedra: &[[u32; 4]], rest: impl Fn(u32) -> DVec3) -> Result<Vec<FemPart>> {
    let order = fill_order(tetrahedra)?;
    memory::try_collected(
        order
            .chunks(PART_SIZE)
            .map(|chunk| FemPart::new(tetrahedra, chunk, &rest)),
    )
}

/// The part, group and lane of each tetrahedron.
pub(super) fn indices(tetrahedra: &[[u32; 4]]) -> Result<Vec<TetrahedronIndex>> {
    let mut indices = memory::filled(TetrahedronIndex::NONE, tetrahedra.len())?;
    for (part, chunk) in (0..).zip(fill_order(tetrahedra)?.chunks(PART_SIZE)) {
        let group_count = chunk.len().div_ceil(GROUP);
        for (position, &index) in chunk.iter().enumerate() {
            let [group, lane] = group_and_lane(position, group_count);
            indices[index as usize] = TetrahedronIndex {
                part,
                group: group as u16,
                lane: lane as u16,
            };
        }
    }
    Ok(indices)
}

/// The order in which tetrahedra fill the parts: by their lowest node.
fn fill_order(tetrahedra: &[[u32; 4]]) -> Result<Vec<u32>> {
    let mut order: Vec<u32> = memory::collected(0..tetrahedra.len() as u32)?;
    let lowest = |index: u32| tetrahedra[index as usize].into_iter().min();
    order.sort_unstable_by_key(|&index| (lowest(index), index));
    Ok(order)
}

/// The group and the lane of a tetrahedron of a part. Successive tetrahedra share nodes, so they go to different
/// groups, where no sum has to wait for the one before.
pub(super) fn group_and_lane(index: usize, group_count: usize) -> [usize; 2] {
    [index % group_count, index / group_count]
}

impl FemPart {
    fn new(tetrahedra: &[[u32; 4]], chunk: &[u32], rest: impl Fn(u32) -> DVec3) -> Result<Self> {
        let nodes = chunk.iter().flat_map(|&index| tetrahedra[index as usize]);
        let mut nodes = memory::collected_within(4 * chunk.len(), nodes)?;
        memory::sort_once(&mut nodes);
        let group_count = chunk.len().div_ceil(GROUP);
        let mut groups = memory::filled(Group::EMPTY, group_count)?;
        for (position, &index) in chunk.iter().enumerate() {
            let [group, lane] = group_and_lane(position, group_count);
            let group = &mut groups[group];
            let corners = tetrahedra[index as usize];
            let [a, b, c, d] = corners.map(&rest);
            let at_rest = RestTet::from_edges(DMat3::from_cols(b - a, c - a, d - a));
            let entries = upper_entries(at_rest.inverse);
            let volume = at_rest.volume as f32;
            ensure!(
                volume > 0.0 && entries.iter().all(|entry| entry.is_finite()),
                "tetrahedra[{index}] has a volume of {volume} m³ at rest: must be above 0"
            );
            for (to, node) in group.corners.iter_mut().zip(corners) {
                to[lane] = 2 * nodes.partition_point(|&other| other < node) as u16;
            }
            for (to, entry) in group.inverse.iter_mut().zip(entries) {
                to[lane] = entry;
            }
            group.volumes[lane] = volume;
        }
        Ok(Self {
            groups: TetrahedronGroups::new(groups, nodes.len()),
            nodes,
            is_from_cut: false,
        })
    }

    /// Allocates the tangent matrix of the part, unless a cut has added it.
    pub fn new_matrix(&self) -> Result<Option<TangentMatrix>> {
        (!self.is_from_cut)
            .then(|| TangentMatrix::new(&self.groups))
            .transpose()
    }

    /// Copies the records of the part's nodes from `from` to `to`.
    pub fn copy(&self, from: &[Record], to: &mut [Record]) {
        for (to, &node) in to.iter_mut().zip(&self.nodes) {
            *to = from[node as usize];
        }
    }

    /// Calls `f` with each tetrahedron, its group and its lane.
    pub fn visit(&self, f: &mut VisitTetrahedra) {
        for (index, group) in self.groups.as_slice().iter().enumerate() {
            for lane in (0..GROUP).filter(|&lane| group.volumes[lane] > 0.0) {
                let rest = self.rest_shape(index, lane);
                f(self.corner_nodes(index, lane), &rest, [index, lane]);
            }
        }
    }

    /// The elastic energy with nodes at `positions`, without that of nodal pressures, J.
    pub fn exact_energy(&self, law: ElasticLaw, positions: &[Record]) -> f64 {
        let mut energy = 0.0;
        self.visit(&mut |corners, rest, _| {
            let [a, b, c, d] = corners.map(|node| {
                let Record([x, y, z, _]) = positions[node as usize];
                DVec3::new(f64::from(x), f64::from(y), f64::from(z))
            });
            energy += DeformedTet::new(law, rest, DMat3::from_cols(b - a, c - a, d - a)).energy();
        });
        energy
    }

    /// The rest shape of a tetrahedron.
    pub fn rest_shape(&self, group: usize, lane: usize) -> RestTet {
        let group = &self.groups.as_slice()[group];
        let [xx, xy, xz, yy, yz, zz] = group.inverse.map(|entry| f64::from(entry[lane]));
        RestTet {
            inverse: DMat3::from_cols_array(&[xx, 0.0, 0.0, xy, yy, 0.0, xz, yz, zz]),
            volume: f64::from(group.volumes[lane]),
        }
    }

    /// The nodes of a tetrahedron.
    pub fn corner_nodes(&self, group: usize, lane: usize) -> [u32; 4] {
        let group = &self.groups.as_slice()[group];
        group.corners.map(|corners| self.nodes[usize::from(corners[lane] / 2)])
    }

    /// Sets the bound of each tetrahedron on squared frequencies at rest to the highest of its nodes' bounds, 1/s².
    pub fn set_rates(&mut self, node_rates: &[f32]) {
        let nodes = &self.nodes;
        self.groups
            .set_rates(|corner| node_rates[nodes[usize::from(corner)] as usize]);
    }

    /// Writes the nodes' pressures into the fourth component of their records, if there are pressures.
    pub fn copy_pressures(&self, pressures: &[f32], to: &mut [Record]) {
        if !pressures.is_empty() {
            for (Record(to), &node) in to.iter_mut().zip(&self.nodes) {
                to[3] = pressures[node as usize];
            }
        }
    }

    /// Removes the tetrahedra with an edge between two nodes. Returns their number, and calls `f` with the volume
    /// that each node loses, m³.
    pub fn remove_edge(&mut self, a: u32, b: u32, mut f: impl FnMut(u32, f32)) -> usize {
        let mut removed = 0;
        while let Some((group, lane)) = self.find_edge(a, b) {
            let group_data = &self.groups.as_slice()[group];
            for corners in &group_data.corners {
                f(
                    self.nodes[usize::from(corners[lane] / 2)],
                    0.25 * group_data.volumes[lane],
                );
            }
            self.groups.remove(group, lane);
            removed += 1;
        }
        removed
    }

    fn find_edge(&self, a: u32, b: u32) -> Option<(usize, usize)> {
        let position = |node| {
            if self.is_from_cut {
                self.nodes.iter().position(|&other| other == node)
            } else {
                self.nodes.binary_search(&node).ok()
            }
        };
        let corner = |node| position(node).map(|index| 2 * index as u16);
        let (a, b) = (corner(a)?, corner(b)?);
        let groups = self.groups.as_slice();
        groups.iter().enumerate().find_map(|(index, group)| {
            let contains = |lane: usize, node: u16| group.corners.iter().any(|corners| corners[lane] == node);
            let lane = (0..GROUP).find(|&lane| group.volumes[lane] > 0.0 && contains(lane, a) && contains(lane, b))?;
            Some((index, lane))
        })
    }
}

/// The entries 00, 01, 02, 11, 12, 22.
fn upper_entries(matrix: DMat3) -> [f32; 6] {
    let [x, y, z] = [matrix.x_axis, matrix.y_axis, matrix.z_axis];
    [x.x, y.x, z.x, y.y, z.y, z.z].map(|entry| entry as f32)
}

/// A copy of a node in a part.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct NodeCopy {
    /// The index of the copy among all copies.
    pub index: u32,
    /// The index of the node in its tile.
    pub tile_slot: u16,
}

saved! { NodeCopy { index, tile_slot } }

/// The copies of the nodes of each tile.
#[derive(Debug)]
pub(super) struct NodeCopies {
    copies: Vec<NodeCopy>,
    starts: Vec<u32>,
    /// The copies that cuts have added, for each tile. Empty without such copies.
    from_cuts: Vec<Vec<NodeCopy>>,
}

saved! { NodeCopies { copies, starts, from_cuts } }

impl NodeCopies {
    pub fn new(parts: &[FemPart], node_count: usize) -> Result<Self> {
        let tiles = tile_count(node_count);
        let mut starts = memory::filled(0_u32, tiles + 1)?;
        let nodes = || parts.iter().flat_map(|part| &part.nodes).map(|&node| node as usize);
        nodes().for_each(|node| starts[node / TILE + 1] += 1);
        for tile in 0..tiles {
            starts[tile + 1] += starts[tile];
        }
        let mut next = memory::copied(&starts)?;
        let mut copies = memory::filled(NodeCopy::default(), nodes().count())?;
        for (index, node) in (0..).zip(nodes()) {
            let to = &mut next[node / TILE];
            copies[*to as usize] = NodeCopy {
                index,
                tile_slot: (node % TILE) as u16,
            };
            *to += 1;
        }
        Ok(Self {
            copies,
            starts,
            from_cuts: Vec::new(),
        })
    }

    /// The copies of a tile's nodes, in the order of the parts.
    pub fn in_tile(&self, tile: usize) -> impl Iterator<Item = &NodeCopy> {
        let start = |tile: usize| *self.starts.get(tile).unwrap_or(&(self.copies.len() as u32)) as usize;
        let first = &self.copies[start(tile)..start(tile + 1)];
        first.iter().chain(self.from_cuts.get(tile).into_iter().flatten())
    }

    /// Reserves memory for copies of the nodes of these pieces, in this number of tiles.
    pub fn reserve(&mut self, tiles: usize, pieces: &[ElementPiece]) -> Result<()> {
        let added_tiles = tiles.saturating_sub(self.from_cuts.len());
        self.from_cuts.try_reserve(added_tiles)?;
        self.from_cuts.resize_with(self.from_cuts.len() + added_tiles, Vec::new);
        let nodes = pieces.iter().flat_map(|piece| piece.nodes);
        let mut tiles = memory::collected_within(4 * pieces.len(), nodes.map(|node| node as usize / TILE))?;
        tiles.sort_unstable();
        for same_tile in tiles.chunk_by(|a, b| a == b) {
            self.from_cuts[same_tile[0]].try_reserve(same_tile.len())?;
        }
        Ok(())
    }

    /// Adds a copy, within the reserved memory.
    pub fn push(&mut self, tile: usize, copy: NodeCopy) {
        self.from_cuts[tile].push(copy);
    }
}
