//! Parts: some tetrahedra near each other, and copies of their nodes.

use glam::{DMat3, DVec3};

use super::cut::{PieceOfElement, TetrahedronPlace};
use super::law::{Deformed, Law, Rest};
use super::tetrahedra::{GROUP, Group, TetrahedronGroups};
use crate::base::{Result, ensure, memory};
use crate::codec::saved;
use crate::simd::Record;
use crate::soa::{TILE, tile_count};

/// Tetrahedra of a part: so few that its nodes stay in the nearest cache, and their numbers are small.
pub(super) const PART: usize = 4096;

/// Some tetrahedra, and their nodes.
#[derive(Debug)]
pub(super) struct FemPart {
    /// In order, but for a part that came later.
    pub nodes: Vec<u32>,
    pub groups: TetrahedronGroups,
    /// Whether a cut has added it.
    pub is_later: bool,
}

saved! { FemPart { nodes, groups, is_later } }

/// What is shown the nodes of a tetrahedron, the way it is at rest, and its group and lane.
pub(super) type SeeNodes<'a> = dyn FnMut([u32; 4], &Rest, [usize; 2]) + 'a;

/// Cuts tetrahedra into parts.
pub(super) fn split(tetrahedra: &[[u32; 4]], rest: impl Fn(u32) -> DVec3) -> Result<Vec<FemPart>> {
    let order = in_order(tetrahedra)?;
    memory::try_collected(
        order
            .chunks(PART)
            .map(|of_part| FemPart::new(tetrahedra, of_part, &rest)),
    )
}

/// Where each tetrahedron is in the parts.
pub(super) fn places(tetrahedra: &[[u32; 4]]) -> Result<Vec<TetrahedronPlace>> {
    let mut places = memory::filled(TetrahedronPlace::NONE, tetrahedra.len())?;
    for (part, of_part) in (0..).zip(in_order(tetrahedra)?.chunks(PART)) {
        let group_count = of_part.len().div_ceil(GROUP);
        for (place, &index) in of_part.iter().enumerate() {
            let [group, lane] = in_group(place, group_count);
            places[index as usize] = TetrahedronPlace {
                part,
                group: group as u16,
                lane: lane as u16,
            };
        }
    }
    Ok(places)
}

/// Tetrahedra in the order in which they fill parts.
fn in_order(tetrahedra: &[[u32; 4]]) -> Result<Vec<u32>> {
    let mut order: Vec<u32> = memory::collected(0..tetrahedra.len() as u32)?;
    let lowest = |index: u32| tetrahedra[index as usize].into_iter().min();
    order.sort_unstable_by_key(|&index| (lowest(index), index));
    Ok(order)
}

/// The group and the lane of a tetrahedron of a part. Those that follow each other have nodes in common: they lie in different groups, so that no
/// sum waits for the last.
pub(super) fn in_group(place: usize, group_count: usize) -> [usize; 2] {
    [place % group_count, place / group_count]
}

impl FemPart {
    fn new(tetrahedra: &[[u32; 4]], of_part: &[u32], rest: impl Fn(u32) -> DVec3) -> Result<Self> {
        let nodes = of_part.iter().flat_map(|&index| tetrahedra[index as usize]);
        let mut nodes = memory::collected_within(4 * of_part.len(), nodes)?;
        memory::sort_once(&mut nodes);
        let group_count = of_part.len().div_ceil(GROUP);
        let mut groups = memory::filled(Group::EMPTY, group_count)?;
        for (place, &index) in of_part.iter().enumerate() {
            let [group, lane] = in_group(place, group_count);
            let group = &mut groups[group];
            let corners = tetrahedra[index as usize];
            let [a, b, c, d] = corners.map(&rest);
            let at_rest = Rest::of(DMat3::from_cols(b - a, c - a, d - a));
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
            is_later: false,
        })
    }

    /// Copies what its nodes have.
    pub fn copy(&self, from: &[Record], to: &mut [Record]) {
        for (to, &node) in to.iter_mut().zip(&self.nodes) {
            *to = from[node as usize];
        }
    }

    /// Shows the tetrahedra there are, and in which group and lane.
    pub fn visit(&self, see: &mut SeeNodes) {
        for (index, group) in self.groups.as_slice().iter().enumerate() {
            for lane in (0..GROUP).filter(|&lane| group.volumes[lane] > 0.0) {
                let rest = self.rest_of(index, lane);
                see(self.nodes_of(index, lane), &rest, [index, lane]);
            }
        }
    }

    /// The energy of its tetrahedra with nodes at `positions`, without that of rings, J.
    pub fn exact_energy(&self, law: Law, positions: &[Record]) -> f64 {
        let mut energy = 0.0;
        self.visit(&mut |corners, rest, _| {
            let [a, b, c, d] = corners.map(|node| {
                let Record([x, y, z, _]) = positions[node as usize];
                DVec3::new(f64::from(x), f64::from(y), f64::from(z))
            });
            energy += Deformed::new(law, rest, DMat3::from_cols(b - a, c - a, d - a)).energy();
        });
        energy
    }

    /// The way a tetrahedron is at rest.
    pub fn rest_of(&self, group: usize, lane: usize) -> Rest {
        let group = &self.groups.as_slice()[group];
        let [xx, xy, xz, yy, yz, zz] = group.inverse.map(|entry| f64::from(entry[lane]));
        Rest {
            inverse: DMat3::from_cols_array(&[xx, 0.0, 0.0, xy, yy, 0.0, xz, yz, zz]),
            volume: f64::from(group.volumes[lane]),
        }
    }

    /// The nodes of a tetrahedron.
    pub fn nodes_of(&self, group: usize, lane: usize) -> [u32; 4] {
        let group = &self.groups.as_slice()[group];
        group.corners.map(|corners| self.nodes[usize::from(corners[lane] / 2)])
    }

    /// Sets what bounds the squared frequencies of each tetrahedron's nodes at rest to the highest of its nodes', 1/s².
    pub fn set_rates(&mut self, of_node: &[f32]) {
        let nodes = &self.nodes;
        self.groups
            .set_rates(|corner| of_node[nodes[usize::from(corner)] as usize]);
    }

    /// Writes pressures beside the places of its nodes, where there are any.
    pub fn copy_pressures(&self, pressures: &[f32], to: &mut [Record]) {
        if !pressures.is_empty() {
            for (Record(to), &node) in to.iter_mut().zip(&self.nodes) {
                to[3] = pressures[node as usize];
            }
        }
    }

    /// Takes away the tetrahedra with an edge between two nodes: how many. Shows what each of their nodes loses of volume, m³.
    pub fn remove_edge(&mut self, a: u32, b: u32, mut see: impl FnMut(u32, f32)) -> usize {
        let mut removed = 0;
        while let Some((group, lane)) = self.find_edge(a, b) {
            let of = &self.groups.as_slice()[group];
            for corners in &of.corners {
                see(self.nodes[usize::from(corners[lane] / 2)], 0.25 * of.volumes[lane]);
            }
            self.groups.remove(group, lane);
            removed += 1;
        }
        removed
    }

    fn find_edge(&self, a: u32, b: u32) -> Option<(usize, usize)> {
        let place = |node| {
            if self.is_later {
                self.nodes.iter().position(|&other| other == node)
            } else {
                self.nodes.binary_search(&node).ok()
            }
        };
        let number = |node| place(node).map(|number| 2 * number as u16);
        let (a, b) = (number(a)?, number(b)?);
        let groups = self.groups.as_slice();
        groups.iter().enumerate().find_map(|(index, group)| {
            let has = |lane: usize, node: u16| group.corners.iter().any(|corners| corners[lane] == node);
            let lane = (0..GROUP).find(|&lane| group.volumes[lane] > 0.0 && has(lane, a) && has(lane, b))?;
            Some((index, lane))
        })
    }
}

/// The entries 00, 01, 02, 11, 12, 22.
fn upper_entries(matrix: DMat3) -> [f32; 6] {
    let [x, y, z] = [matrix.x_axis, matrix.y_axis, matrix.z_axis];
    [x.x, y.x, z.x, y.y, z.y, z.z].map(|entry| entry as f32)
}

/// A copy of a node.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Copy {
    /// Its place among all copies.
    pub at: u32,
    /// The node's place in its tile.
    pub place: u16,
}

saved! { Copy { at, place } }

/// The copies of the nodes of each tile.
#[derive(Debug)]
pub(super) struct Copies {
    copies: Vec<Copy>,
    starts: Vec<u32>,
    /// Those that came later, by tiles; of no tiles where none did.
    later: Vec<Vec<Copy>>,
}

saved! { Copies { copies, starts, later } }

impl Copies {
    pub fn new(parts: &[FemPart], node_count: usize) -> Result<Self> {
        let tiles = tile_count(node_count);
        let mut starts = memory::filled(0_u32, tiles + 1)?;
        let nodes = || parts.iter().flat_map(|part| &part.nodes).map(|&node| node as usize);
        nodes().for_each(|node| starts[node / TILE + 1] += 1);
        for tile in 0..tiles {
            starts[tile + 1] += starts[tile];
        }
        let mut next = memory::copied(&starts)?;
        let mut copies = memory::filled(Copy::default(), nodes().count())?;
        for (at, node) in (0..).zip(nodes()) {
            let to = &mut next[node / TILE];
            copies[*to as usize] = Copy {
                at,
                place: (node % TILE) as u16,
            };
            *to += 1;
        }
        Ok(Self {
            copies,
            starts,
            later: Vec::new(),
        })
    }

    /// In the order of parts.
    pub fn of_tile(&self, tile: usize) -> impl Iterator<Item = &Copy> {
        let start = |tile: usize| *self.starts.get(tile).unwrap_or(&(self.copies.len() as u32)) as usize;
        let first = &self.copies[start(tile)..start(tile + 1)];
        first.iter().chain(self.later.get(tile).into_iter().flatten())
    }

    /// Makes room for those of these pieces, of so many tiles.
    pub fn reserve(&mut self, tiles: usize, pieces: &[PieceOfElement]) -> Result<()> {
        let more = tiles.saturating_sub(self.later.len());
        self.later.try_reserve(more)?;
        self.later.resize_with(self.later.len() + more, Vec::new);
        let nodes = pieces.iter().flat_map(|piece| piece.nodes);
        let mut tiles = memory::collected_within(4 * pieces.len(), nodes.map(|node| node as usize / TILE))?;
        tiles.sort_unstable();
        for at_tile in tiles.chunk_by(|a, b| a == b) {
            self.later[at_tile[0]].try_reserve(at_tile.len())?;
        }
        Ok(())
    }

    /// Adds one, for which there is room.
    pub fn push(&mut self, tile: usize, copy: Copy) {
        self.later[tile].push(copy);
    }
}
