//! Element topology after a cut: pieces of tetrahedra with the source's rest shape, other nodes, and fractions of its
//! volume.
//!
//! A piece that keeps its nodes keeps its storage. Other pieces go to additional parts. These reserve nodes for all
//! tetrahedra that they can hold, so that adding pieces moves no data.

use glam::{DMat3, DVec3};

use super::parts::{FemPart, NodeCopy, group_and_lane};
use super::tetrahedra::{GROUP, Group, TetrahedronGroups};
use super::{DeformedTet, Elements, RestTet, Sums, TetStress};
use crate::base::{Result, memory};
use crate::codec::saved;
use crate::soa::{FrequencyBound, NodalMasses, PerNode, TILE, Vectors, tile_count};
use crate::springs::{Springs, spring_rates};

/// The number of groups of a part that a cut adds.
const CUT_PART_GROUPS: usize = 32;

/// The capacity of a part that a cut adds, in tetrahedra and in nodes.
const CUT_PART_SIZE: usize = CUT_PART_GROUPS * GROUP;
const CUT_PART_NODES: usize = 4 * CUT_PART_SIZE;

/// The storage location of a tetrahedron.
#[derive(Clone, Copy, Debug)]
pub(super) struct TetrahedronIndex {
    pub part: u32,
    pub group: u16,
    pub lane: u16,
}

saved! { TetrahedronIndex { part, group, lane } }

/// The locations of the tetrahedra of a body that can be cut.
#[derive(Debug)]
pub(super) struct CellIndices {
    /// The location of each tetrahedron: the original ones in the caller's order, then those of cuts.
    indices: Vec<TetrahedronIndex>,
    /// The number of tetrahedra in the last part that a cut has added.
    used: usize,
    /// Parts reserved for the next cuts.
    spare: Vec<FemPart>,
}

saved! { CellIndices { indices, used, spare } }

/// A piece of a tetrahedron, with nodes in the body's internal indices.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ElementPiece {
    /// The index of the piece: that of its source, or a new one.
    pub cell: u32,
    pub source: u32,
    pub nodes: [u32; 4],
    /// The fraction of the source's volume, above 0.
    pub part: f32,
}

impl TetrahedronIndex {
    pub const NONE: Self = Self {
        part: 0,
        group: 0,
        lane: 0,
    };

    fn group_and_lane_of(self) -> [usize; 2] {
        [self.group, self.lane].map(usize::from)
    }
}

impl ElementPiece {
    fn is_copy(&self) -> bool {
        self.cell != self.source
    }
}

/// A tetrahedron to be stored elsewhere.
struct RelocatedTet {
    nodes: [u32; 4],
    inverse: [f32; 6],
    volume: f32,
    from: TetrahedronIndex,
}

impl Elements {
    /// Enables cuts: records the locations of the tetrahedra, which are in the order of creation.
    pub fn follow_cells(&mut self, tetrahedra: &[[u32; 4]]) -> Result<()> {
        let indices = super::parts::indices(tetrahedra)?;
        self.cells = Some(memory::boxed(CellIndices {
            indices,
            used: CUT_PART_SIZE,
            spare: Vec::new(),
        })?);
        Ok(())
    }

    /// Reserves memory for `count` nodes in all.
    pub fn reserve_nodes(&mut self, count: usize) -> Result<()> {
        for values in [&mut self.stiffnesses, &mut self.node_rates] {
            memory::reserve(values, count)?;
        }
        if let Some(nodal_volumes) = &mut self.nodal_volumes {
            memory::reserve(&mut nodal_volumes.volumes, count)?;
            self.pressure_offsets.resize(nodal_volumes.volumes.len(), count)?;
            self.forces.pressures.reserve_nodes(count)?;
            if let Some(history) = &mut self.history {
                history.reserve_nodal(count)?;
            }
        }
        Ok(())
    }

    /// Reserves memory for these pieces, with copies in the order of their indices, for `node_count` nodes in all.
    /// Also reserves memory in `other_sums`.
    pub fn reserve_pieces(
        &mut self,
        pieces: &[ElementPiece],
        node_count: usize,
        other_sums: Option<&mut Sums>,
    ) -> Result<()> {
        let Some(cells) = &mut self.cells else {
            return Ok(());
        };
        let copies = pieces.iter().filter(|piece| piece.is_copy()).count();
        cells.indices.try_reserve(copies)?;
        // In the worst case every piece moves to another part.
        let added_parts = pieces
            .len()
            .saturating_sub(CUT_PART_SIZE - cells.used)
            .div_ceil(CUT_PART_SIZE);
        while cells.spare.len() < added_parts {
            let part = FemPart {
                groups: TetrahedronGroups::new(memory::filled(Group::EMPTY, CUT_PART_GROUPS)?, CUT_PART_NODES),
                nodes: memory::reserved(CUT_PART_NODES)?,
                is_from_cut: true,
            };
            memory::push(&mut cells.spare, part)?;
        }
        self.parts.try_reserve(added_parts)?;
        self.starts.try_reserve(added_parts)?;
        let pressure_count = if self.nodal_volumes.is_some() { node_count } else { 0 };
        for sums in std::iter::once(&mut self.forces).chain(other_sums) {
            sums.reserve(added_parts * CUT_PART_NODES, added_parts, pressure_count)?;
        }
        if let Some(history) = &mut self.history {
            history.reserve_parts(added_parts, CUT_PART_GROUPS)?;
        }
        self.reserve_nodes(node_count)?;
        let Some(cells) = &self.cells else {
            return Ok(());
        };
        self.copies.reserve(tile_count(node_count), pieces)?;
        // The solvers reserve memory for this number.
        self.count = self.count.max(cells.indices.len() + copies);
        Ok(())
    }

    /// Replaces tetrahedra by their pieces, within the reserved memory.
    pub fn rewire(&mut self, pieces: &[ElementPiece], node_count: usize, mut other_sums: Option<&mut Sums>) {
        self.stiffnesses.resize(node_count, 0.0);
        self.node_rates.resize(node_count, 0.0);
        self.grow_nodal_pressures(node_count, other_sums.as_deref_mut());
        // A source changes after its copies are created.
        for piece in pieces.iter().filter(|piece| piece.is_copy()) {
            let relocated = self.relocated(piece);
            let index = self.append(relocated, &mut other_sums);
            if let Some(cells) = &mut self.cells {
                cells.indices.push(index);
            }
        }
        for piece in pieces.iter().filter(|piece| !piece.is_copy()) {
            let relocated = self.relocated(piece);
            let [group, lane] = relocated.from.group_and_lane_of();
            let part = &mut self.parts[relocated.from.part as usize];
            if part.corner_nodes(group, lane) == piece.nodes {
                part.groups.set_volume([group, lane], relocated.volume);
                continue;
            }
            part.groups.remove(group, lane);
            let index = self.append(relocated, &mut other_sums);
            if let Some(cells) = &mut self.cells {
                cells.indices[piece.cell as usize] = index;
            }
        }
    }

    /// The force of these tetrahedra on one of their nodes, N.
    pub fn force_at(&self, node: u32, cells: impl Iterator<Item = u32>, positions: &Vectors) -> DVec3 {
        let law = self.stiffened();
        let mut force = DVec3::ZERO;
        for cell in cells {
            let Some((corners, rest, index)) = self.cell(cell) else {
                continue;
            };
            let [a, b, c, d] = corners.map(|corner| positions.get(corner as usize).as_dvec3());
            let extra = self.history.as_ref().map_or(TetStress::ZERO, |history| {
                history.extra_stress(index.part as usize, index.group_and_lane_of())
            });
            let deformed = DeformedTet::new(law, &rest, DMat3::from_cols(b - a, c - a, d - a)).with_extra_stress(extra);
            for (corner, gradient) in corners.into_iter().zip(rest.gradients()) {
                if corner == node {
                    force += deformed.force(gradient);
                }
            }
        }
        force
    }

    /// Updates the bounds of [`Self::find_rates`] after a cut has changed the tetrahedra, springs or masses of these
    /// nodes. `cells_at` returns the tetrahedra around a node.
    pub fn find_rates_at<Cells: Iterator<Item = u32>>(
        &mut self,
        nodes: &[u32],
        cells_at: impl Fn(u32) -> Cells,
        springs: &dyn Springs,
        masses: &NodalMasses,
    ) {
        let p_wave_modulus = f64::from(self.law.p_wave_modulus());
        for &node in nodes {
            let (mut stiffness, mut corner_stiffness) = (0.0, 0.0);
            for (corners, rest, _) in cells_at(node).filter_map(|cell| self.cell(cell)) {
                let free = corners.map(|corner| masses.inverse(corner as usize) > 0.0);
                let element_stiffnesses = super::rates::corner_stiffness(self.law, &rest, free);
                for ((corner, gradient), element_stiffness) in
                    corners.into_iter().zip(rest.gradients()).zip(element_stiffnesses)
                {
                    if corner == node {
                        stiffness += rest.volume * p_wave_modulus * gradient.length_squared();
                        corner_stiffness += element_stiffness;
                    }
                }
            }
            self.stiffnesses[node as usize] = stiffness as f32;
            let spring_rates = spring_rates(node as usize, springs, masses).unwrap_or(FrequencyBound::ZERO);
            self.damping_rate = self.damping_rate.max(spring_rates.damping_rate);
            self.node_rates[node as usize] =
                corner_stiffness as f32 * masses.inverse(node as usize) + self.rate_beyond_shared(spring_rates);
            self.max_rest_rate = self.max_rest_rate.max(self.node_rates[node as usize]);
        }
        if let Some(rates) = &mut self.deformed_rates {
            rates.forget_rest_rate();
        }
        for &node in nodes {
            for cell in cells_at(node) {
                if let Some((corners, _, index)) = self.cell(cell) {
                    let rates = corners.map(|corner| self.node_rates[corner as usize]);
                    let rate = rates.into_iter().fold(0.0, f32::max);
                    self.parts[index.part as usize]
                        .groups
                        .set_rate(index.group_and_lane_of(), rate);
                }
            }
        }
    }

    /// The stiffness of a tetrahedron at a node at rest, N/m, and the highest bound on the squared frequencies of its
    /// nodes, 0 if unknown.
    pub fn stiffness_and_rate_of(&self, cell: u32, node: u32, inverse_masses: &[f32]) -> (f64, f64) {
        let Some((corners, rest, _)) = self.cell(cell) else {
            return (0.0, 0.0);
        };
        let free = corners.map(|corner| inverse_masses[corner as usize] > 0.0);
        let corner_stiffness = super::rates::corner_stiffness(self.law, &rest, free);
        let node_stiffness = corners
            .iter()
            .zip(corner_stiffness)
            .find(|(corner, _)| **corner == node);
        let highest = if self.rates_known {
            self.spring_rate
                + corners
                    .map(|corner| self.node_rates[corner as usize])
                    .into_iter()
                    .fold(0.0, f32::max)
        } else {
            0.0
        };
        (
            node_stiffness.map_or(0.0, |(_, corner_stiffness)| corner_stiffness),
            f64::from(highest),
        )
    }

    /// The nodes of a tetrahedron, its rest shape and its location; `None` if it has been removed.
    pub(super) fn cell(&self, cell: u32) -> Option<([u32; 4], RestTet, TetrahedronIndex)> {
        let index = *self.cells.as_ref()?.indices.get(cell as usize)?;
        let part = &self.parts[index.part as usize];
        let [group, lane] = index.group_and_lane_of();
        let rest = part.rest_shape(group, lane);
        (rest.volume > 0.0).then(|| (part.corner_nodes(group, lane), rest, index))
    }

    /// The tetrahedron that a piece becomes.
    fn relocated(&self, piece: &ElementPiece) -> RelocatedTet {
        let from = self
            .cells
            .as_ref()
            .map_or(TetrahedronIndex::NONE, |cells| cells.indices[piece.source as usize]);
        let [group, lane] = from.group_and_lane_of();
        let group = &self.parts[from.part as usize].groups.as_slice()[group];
        RelocatedTet {
            nodes: piece.nodes,
            inverse: group.inverse.map(|entry| entry[lane]),
            volume: group.volumes[lane] * piece.part,
            from,
        }
    }

    /// Appends a tetrahedron to the last part added by a cut, or to a new one. Returns its location.
    fn append(&mut self, relocated: RelocatedTet, other_sums: &mut Option<&mut Sums>) -> TetrahedronIndex {
        let Some(cells) = &mut self.cells else {
            return relocated.from;
        };
        if cells.used == CUT_PART_SIZE
            && let Some(part) = cells.spare.pop()
        {
            self.parts.push(part);
            let count = self.forces.sums.len() + CUT_PART_NODES;
            self.starts.push(count - CUT_PART_NODES);
            self.forces.grow(count, self.parts.len());
            if let Some(sums) = other_sums {
                sums.grow(count, self.parts.len());
            }
            if let Some(history) = &mut self.history {
                history.add_part();
            }
            cells.used = 0;
        }
        let last = self.parts.len() - 1;
        let [group, lane] = group_and_lane(cells.used, CUT_PART_GROUPS);
        cells.used += 1;
        let part = &mut self.parts[last];
        let corners = relocated.nodes.map(|node| {
            let existing = part.nodes.iter().position(|&other| other == node);
            let local_index = existing.unwrap_or_else(|| {
                part.nodes.push(node);
                let copy = NodeCopy {
                    index: (self.starts[last] + part.nodes.len() - 1) as u32,
                    tile_slot: (node as usize % TILE) as u16,
                };
                self.copies.push(node as usize / TILE, copy);
                part.nodes.len() - 1
            });
            2 * local_index as u16
        });
        part.groups
            .insert([group, lane], corners, relocated.inverse, relocated.volume);
        let index = TetrahedronIndex {
            part: last as u32,
            group: group as u16,
            lane: lane as u16,
        };
        if let Some(history) = &mut self.history {
            history.copy(relocated.from, index);
        }
        index
    }
}
