//! Tetrahedra that a cut parts: pieces of them, which are as they were at rest, of other nodes and with parts of the volume.
//!
//! A piece that keeps its nodes stays where it is. Others go to parts that come later, which have room for so many nodes that none has to be
//! moved when more come.

use glam::{DMat3, DVec3};

use super::parts::{Copy, FemPart, in_group};
use super::tetrahedra::{GROUP, Group, TetrahedronGroups};
use super::{Deformed, Elements, Load, Rest, Sums};
use crate::base::{Result, memory};
use crate::codec::saved;
use crate::soa::{Masses, PerNode, Rates, TILE, Vectors, tile_count};
use crate::springs::{Springs, rates_anywhere};

/// The groups of a part that comes later.
const GROUPS: usize = 32;

/// The tetrahedra of a part that comes later, and its nodes at most.
const LATER: usize = GROUPS * GROUP;
const NODES: usize = 4 * LATER;

/// Where a tetrahedron is.
#[derive(Clone, Copy, Debug)]
pub(super) struct TetrahedronPlace {
    pub part: u32,
    pub group: u16,
    pub lane: u16,
}

saved! { TetrahedronPlace { part, group, lane } }

/// What bodies that may be cut know of their tetrahedra.
#[derive(Debug)]
pub(super) struct Cells {
    /// Where each is, in the order in which they were given, and then that of cuts.
    places: Vec<TetrahedronPlace>,
    /// How many are in the last part that came later.
    used: usize,
    /// Parts that are to come.
    spare: Vec<FemPart>,
}

saved! { Cells { places, used, spare } }

/// A piece of a tetrahedron, in the body's own numbers of nodes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PieceOfElement {
    /// The tetrahedron: its source, or a new one.
    pub cell: u32,
    pub source: u32,
    pub nodes: [u32; 4],
    /// Its part of the volume, above 0.
    pub part: f32,
}

impl TetrahedronPlace {
    pub const NONE: Self = Self {
        part: 0,
        group: 0,
        lane: 0,
    };

    fn in_part(self) -> [usize; 2] {
        [self.group, self.lane].map(usize::from)
    }
}

impl PieceOfElement {
    fn is_copy(&self) -> bool {
        self.cell != self.source
    }
}

/// A tetrahedron that goes elsewhere.
struct Moved {
    nodes: [u32; 4],
    inverse: [f32; 6],
    volume: f32,
    from: TetrahedronPlace,
}

impl Elements {
    /// Remembers where tetrahedra are that were given in this order.
    pub fn follow_cells(&mut self, tetrahedra: &[[u32; 4]]) -> Result<()> {
        let places = super::parts::places(tetrahedra)?;
        self.cells = Some(memory::boxed(Cells {
            places,
            used: LATER,
            spare: Vec::new(),
        })?);
        Ok(())
    }

    /// Makes room for so many nodes in all.
    pub fn reserve_nodes(&mut self, count: usize) -> Result<()> {
        for values in [&mut self.stiffnesses, &mut self.carried] {
            memory::reserve(values, count)?;
        }
        if let Some(rings) = &mut self.rings {
            memory::reserve(&mut rings.volumes, count)?;
            self.offsets.make_room(rings.volumes.len(), count)?;
            self.forces.pressures.reserve_nodes(count)?;
            if let Some(memory) = &mut self.memory {
                memory.reserve_rings(count)?;
            }
        }
        Ok(())
    }

    /// Makes room for these pieces, copies of sources in the order of their numbers, in a body of so many nodes then, and in sums beside these.
    pub fn reserve_pieces(
        &mut self,
        pieces: &[PieceOfElement],
        node_count: usize,
        beside: Option<&mut Sums>,
    ) -> Result<()> {
        let Some(cells) = &mut self.cells else {
            return Ok(());
        };
        let copies = pieces.iter().filter(|piece| piece.is_copy()).count();
        cells.places.try_reserve(copies)?;
        // All of them may have to go elsewhere.
        let more = pieces.len().saturating_sub(LATER - cells.used).div_ceil(LATER);
        while cells.spare.len() < more {
            let part = FemPart {
                groups: TetrahedronGroups::new(memory::filled(Group::EMPTY, GROUPS)?, NODES),
                nodes: memory::reserved(NODES)?,
                is_later: true,
            };
            memory::push(&mut cells.spare, part)?;
        }
        self.parts.try_reserve(more)?;
        self.starts.try_reserve(more)?;
        let ring_count = if self.rings.is_some() { node_count } else { 0 };
        for sums in std::iter::once(&mut self.forces).chain(beside) {
            sums.reserve(more * NODES, more, ring_count)?;
        }
        if let Some(memory) = &mut self.memory {
            memory.reserve_parts(more, GROUPS)?;
        }
        self.reserve_nodes(node_count)?;
        let Some(cells) = &self.cells else {
            return Ok(());
        };
        self.copies.reserve(tile_count(node_count), pieces)?;
        // The solvers make room for as many.
        self.count = self.count.max(cells.places.len() + copies);
        Ok(())
    }

    /// Parts tetrahedra into pieces, for which there is room.
    pub fn rewire(&mut self, pieces: &[PieceOfElement], node_count: usize, mut beside: Option<&mut Sums>) {
        self.stiffnesses.resize(node_count, 0.0);
        self.carried.resize(node_count, 0.0);
        self.grow_rings(node_count, beside.as_deref_mut());
        // Sources change once their copies are made.
        for piece in pieces.iter().filter(|piece| piece.is_copy()) {
            let moved = self.moved(piece);
            let place = self.put(moved, &mut beside);
            if let Some(cells) = &mut self.cells {
                cells.places.push(place);
            }
        }
        for piece in pieces.iter().filter(|piece| !piece.is_copy()) {
            let moved = self.moved(piece);
            let [group, lane] = moved.from.in_part();
            let of = &mut self.parts[moved.from.part as usize];
            if of.nodes_of(group, lane) == piece.nodes {
                of.groups.set_volume([group, lane], moved.volume);
                continue;
            }
            of.groups.remove(group, lane);
            let place = self.put(moved, &mut beside);
            if let Some(cells) = &mut self.cells {
                cells.places[piece.cell as usize] = place;
            }
        }
    }

    /// The force of these tetrahedra on a node of them, N.
    pub fn force_at(&self, node: u32, cells: impl Iterator<Item = u32>, positions: &Vectors) -> DVec3 {
        let law = self.stiffened();
        let mut force = DVec3::ZERO;
        for cell in cells {
            let Some((corners, rest, place)) = self.cell(cell) else {
                continue;
            };
            let [a, b, c, d] = corners.map(|corner| positions.get(corner as usize).as_dvec3());
            let load = self
                .memory
                .as_ref()
                .map_or(Load::NONE, |memory| memory.load(place.part as usize, place.in_part()));
            let deformed = Deformed::new(law, &rest, DMat3::from_cols(b - a, c - a, d - a)).loaded(load);
            for (corner, gradient) in corners.into_iter().zip(rest.gradients()) {
                if corner == node {
                    force += deformed.force(gradient);
                }
            }
        }
        force
    }

    /// What [`Self::find_rates`] finds, where it has been found, after a cut has changed the tetrahedra, springs or masses of these nodes, given
    /// the cells at each.
    pub fn find_rates_at<Cells: Iterator<Item = u32>>(
        &mut self,
        nodes: &[u32],
        cells_at: impl Fn(u32) -> Cells,
        springs: &dyn Springs,
        masses: &Masses,
    ) {
        let whole = f64::from(self.law.whole());
        for &node in nodes {
            let (mut stiffness, mut carried) = (0.0, 0.0);
            for (corners, rest, _) in cells_at(node).filter_map(|cell| self.cell(cell)) {
                let free = corners.map(|corner| masses.inverse(corner as usize) > 0.0);
                let carried_there = super::rates::carried(self.law, &rest, free);
                for ((corner, gradient), more) in corners.into_iter().zip(rest.gradients()).zip(carried_there) {
                    if corner == node {
                        stiffness += rest.volume * whole * gradient.length_squared();
                        carried += more;
                    }
                }
            }
            self.stiffnesses[node as usize] = stiffness as f32;
            let of_springs = rates_anywhere(node as usize, springs, masses).unwrap_or(Rates::ZERO);
            self.most_damped = self.most_damped.max(of_springs.most_damped);
            self.carried[node as usize] = carried as f32 * masses.inverse(node as usize) + self.beyond_all(of_springs);
        }
        for &node in nodes {
            for cell in cells_at(node) {
                if let Some((corners, _, place)) = self.cell(cell) {
                    let rates = corners.map(|corner| self.carried[corner as usize]);
                    let rate = rates.into_iter().fold(0.0, f32::max);
                    self.parts[place.part as usize].groups.set_rate(place.in_part(), rate);
                }
            }
        }
    }

    /// What a node carries of a tetrahedron at rest, N/m, and the highest bound on the squares of frequencies of its corners, if that is known.
    pub fn carried_by(&self, cell: u32, node: u32, inverse_masses: &[f32]) -> (f64, f64) {
        let Some((corners, rest, _)) = self.cell(cell) else {
            return (0.0, 0.0);
        };
        let free = corners.map(|corner| inverse_masses[corner as usize] > 0.0);
        let carried = super::rates::carried(self.law, &rest, free);
        let of_node = corners.iter().zip(carried).find(|(corner, _)| **corner == node);
        let highest = if self.rates_known {
            self.of_springs
                + corners
                    .map(|corner| self.carried[corner as usize])
                    .into_iter()
                    .fold(0.0, f32::max)
        } else {
            0.0
        };
        (of_node.map_or(0.0, |(_, carried)| carried), f64::from(highest))
    }

    /// The nodes of a tetrahedron, what it is like at rest, and where it is; `None` where it is none any more.
    pub(super) fn cell(&self, cell: u32) -> Option<([u32; 4], Rest, TetrahedronPlace)> {
        let place = *self.cells.as_ref()?.places.get(cell as usize)?;
        let part = &self.parts[place.part as usize];
        let [group, lane] = place.in_part();
        let rest = part.rest_of(group, lane);
        (rest.volume > 0.0).then(|| (part.nodes_of(group, lane), rest, place))
    }

    /// A piece as it will be.
    fn moved(&self, piece: &PieceOfElement) -> Moved {
        let from = self
            .cells
            .as_ref()
            .map_or(TetrahedronPlace::NONE, |cells| cells.places[piece.source as usize]);
        let [group, lane] = from.in_part();
        let group = &self.parts[from.part as usize].groups.as_slice()[group];
        Moved {
            nodes: piece.nodes,
            inverse: group.inverse.map(|entry| entry[lane]),
            volume: group.volumes[lane] * piece.part,
            from,
        }
    }

    /// Puts a tetrahedron into the last part that came later, or the next: where it is then.
    fn put(&mut self, moved: Moved, beside: &mut Option<&mut Sums>) -> TetrahedronPlace {
        let Some(cells) = &mut self.cells else {
            return moved.from;
        };
        if cells.used == LATER
            && let Some(part) = cells.spare.pop()
        {
            self.parts.push(part);
            let count = self.forces.sums.len() + NODES;
            self.starts.push(count - NODES);
            self.forces.grow(count, self.parts.len());
            if let Some(sums) = beside {
                sums.grow(count, self.parts.len());
            }
            if let Some(memory) = &mut self.memory {
                memory.add_part();
            }
            cells.used = 0;
        }
        let last = self.parts.len() - 1;
        let [group, lane] = in_group(cells.used, GROUPS);
        cells.used += 1;
        let part = &mut self.parts[last];
        let corners = moved.nodes.map(|node| {
            let known = part.nodes.iter().position(|&other| other == node);
            let number = known.unwrap_or_else(|| {
                part.nodes.push(node);
                let copy = Copy {
                    at: (self.starts[last] + part.nodes.len() - 1) as u32,
                    place: (node as usize % TILE) as u16,
                };
                self.copies.push(node as usize / TILE, copy);
                part.nodes.len() - 1
            });
            2 * number as u16
        });
        part.groups.put([group, lane], corners, moved.inverse, moved.volume);
        let place = TetrahedronPlace {
            part: last as u32,
            group: group as u16,
            lane: lane as u16,
        };
        if let Some(memory) = &mut self.memory {
            memory.copy(moved.from, place);
        }
        place
    }
}
