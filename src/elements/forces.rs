//! Forces, their changes and energies of elements.

use glam::{DMat3, DVec3};

use super::law::Deformed;
use super::parts::Copies;
use super::past::Memory;
use super::tetrahedra::Stresses;
use super::{Elements, Sums};
use crate::simd::{ChosenKernel, Record};
use crate::soa::{TILE, TileForces};
use crate::threads::{Items, Ragged, Team};

/// What the nodes of a tile are given.
#[derive(Clone, Copy)]
pub(crate) struct Shares<'a> {
    copies: &'a Copies,
    sums: &'a [Record],
}

impl Shares<'_> {
    /// Adds what the elements give to the nodes of a tile.
    pub fn add(&self, tile: usize, forces: &mut TileForces) {
        let mut sums = [Record::default(); TILE];
        for copy in self.copies.of_tile(tile) {
            let Record(sum) = &mut sums[usize::from(copy.place)];
            for (sum, more) in sum.iter_mut().zip(self.sums[copy.at as usize].0) {
                *sum += more;
            }
        }
        for (axis, forces) in forces.axes_mut().into_iter().enumerate() {
            for (force, Record(sum)) in forces.iter_mut().zip(&sums) {
                *force += sum[axis];
            }
        }
    }
}

impl Elements {
    /// Works out the forces of all elements with nodes at `positions`.
    pub fn find_forces(&mut self, kernel: ChosenKernel, positions: &[Record], team: &Team) {
        if self.rings.is_some() {
            self.find_pressures(kernel, positions, true, team);
        }
        let (law, parts, starts) = (self.stiffened(), &self.parts, &self.starts);
        let (sums, memory) = (&mut self.forces, self.memory.as_deref());
        let written = (
            Ragged::new(&mut sums.positions, starts),
            Ragged::new(&mut sums.sums, starts),
            Items::new(&mut sums.of_parts),
        );
        let pressures = &sums.pressures.of_nodes;
        team.pass(parts.len(), written, |part, (copies, sums, highest)| {
            let of = &parts[part];
            of.copy(positions, copies);
            of.copy_pressures(pressures, copies);
            sums.fill(Record::default());
            *highest = f64::from(of.groups.forces(kernel, law, loads(memory, part), copies, sums));
        });
        self.highest = sums.of_parts.iter().fold(0.0, |highest: f64, &of| highest.max(of)) as f32;
    }

    /// Works out how their forces change, to first order, with nodes at `positions` that go these ways.
    pub fn find_changes(&self, kernel: ChosenKernel, [positions, ways]: [&[Record]; 2], sums: &mut Sums, team: &Team) {
        let (law, parts, starts) = (self.stiffened(), &self.parts, &self.starts);
        let memory = self.memory.as_deref();
        if let Some(rings) = &self.rings {
            let written = (
                Ragged::new(&mut sums.positions, starts),
                Ragged::new(&mut sums.ways, starts),
                Ragged::new(&mut sums.sums, starts),
            );
            team.pass(parts.len(), written, |part, (copies, copied_ways, sums)| {
                let part = &parts[part];
                part.copy(positions, copies);
                part.copy(ways, copied_ways);
                sums.fill(Record::default());
                part.groups.growths(kernel, copies, Some(copied_ways), sums);
            });
            sums.pressures
                .find(rings, &self.copies, &sums.sums, law.kappa, [&[]; 2], team);
        }
        let written = (
            Ragged::new(&mut sums.positions, starts),
            Ragged::new(&mut sums.ways, starts),
            Ragged::new(&mut sums.sums, starts),
        );
        let pressures = &sums.pressures.of_nodes;
        team.pass(parts.len(), written, |part, (copies, copied_ways, sums)| {
            let of = &parts[part];
            of.copy(positions, copies);
            of.copy(ways, copied_ways);
            of.copy_pressures(pressures, copied_ways);
            sums.fill(Record::default());
            of.groups
                .changes(kernel, law, loads(memory, part), [copies, copied_ways], sums);
        });
    }

    /// Their energy with nodes at `positions`, with that of the arms beside them, J.
    pub fn energy(&mut self, kernel: ChosenKernel, positions: &[Record], team: &Team) -> f64 {
        let of_rings = if self.rings.is_some() {
            self.find_pressures(kernel, positions, false, team)
        } else {
            0.0
        };
        let (law, parts, sums) = (self.law, &self.parts, &mut self.forces);
        let written = (
            Ragged::new(&mut sums.positions, &self.starts),
            Items::new(&mut sums.of_parts),
        );
        team.pass(parts.len(), written, |part, (copies, energy)| {
            let part = &parts[part];
            *energy = if law.is_hyperelastic() {
                // The stress at rest is a difference, of which an f32 leaves nothing of a small energy.
                part.exact_energy(law, positions)
            } else {
                part.copy(positions, copies);
                part.groups.energy(kernel, law, copies)
            };
        });
        let elastic = of_rings + sums.of_parts.iter().sum::<f64>();
        elastic + self.energy_of_arms(kernel, positions, team)
    }

    /// Works out the pressures of nodes at `positions`, with the loads on them or without: the elastic energy of all rings, J.
    pub(super) fn find_pressures(
        &mut self,
        kernel: ChosenKernel,
        positions: &[Record],
        loaded: bool,
        team: &Team,
    ) -> f64 {
        let (parts, starts, sums) = (&self.parts, &self.starts, &mut self.forces);
        let written = (
            Ragged::new(&mut sums.positions, starts),
            Ragged::new(&mut sums.sums, starts),
        );
        team.pass(parts.len(), written, |part, (copies, sums)| {
            let part = &parts[part];
            part.copy(positions, copies);
            sums.fill(Record::default());
            part.groups.growths(kernel, copies, None, sums);
        });
        let Some(rings) = &self.rings else {
            return 0.0;
        };
        let memory = self.memory.as_deref().filter(|_| loaded);
        let loads = memory.map_or(&[][..], |memory| &memory.rings.loads);
        let law = memory.map_or(self.law, |memory| memory.stiffened(self.law));
        sums.pressures.find(
            rings,
            &self.copies,
            &sums.sums,
            law.kappa,
            [self.offsets.get(), loads],
            team,
        )
    }

    /// Where forces were worked out last is the current state.
    pub fn settle(&mut self) {
        self.settled = self.highest;
    }

    /// What these sums give to nodes; `None`: the forces that were worked out last.
    pub fn shares<'a>(&'a self, sums: Option<&'a Sums>) -> Shares<'a> {
        Shares {
            copies: &self.copies,
            sums: &sums.unwrap_or(&self.forces).sums,
        }
    }

    /// The energy with nodes at `positions`, J, worked out in `f64`; `growths` are for its use.
    pub fn exact_energy(&self, position: impl Fn(usize) -> DVec3, growths: &mut [f64]) -> f64 {
        let (mut energy, law) = (0.0, self.law);
        let (memory, kappa) = (self.memory.as_deref(), f64::from(law.kappa));
        growths.fill(0.0);
        for (index, part) in self.parts.iter().enumerate() {
            part.visit(&mut |corners, rest, place| {
                let [a, b, c, d] = corners.map(|node| position(node as usize));
                let deformed = Deformed::new(law, rest, DMat3::from_cols(b - a, c - a, d - a));
                energy += deformed.energy();
                if let Some(memory) = memory {
                    energy += rest.volume * memory.energy_of(law, index, place, deformed.elastic());
                }
                if law.rings {
                    for node in corners {
                        growths[node as usize] += 0.25 * deformed.swelling();
                    }
                }
            });
        }
        let rings = self.rings.iter().flat_map(|rings| &rings.volumes).zip(&*growths);
        for (node, (&volume, growth)) in rings.enumerate().filter(|(_, (volume, _))| **volume > 0.0) {
            let volume = f64::from(volume);
            let growth = growth - self.offsets.of(node);
            energy += 0.5 * kappa * growth * growth / volume;
            if let Some(memory) = memory {
                energy += memory.energy_of_ring(law, node, kappa * growth / volume, volume);
            }
        }
        energy
    }

    /// Works out the elastic stresses with nodes at `positions`, without the pressures of rings.
    pub(super) fn find_stresses(&mut self, kernel: ChosenKernel, positions: &[Record], team: &Team) {
        let (law, parts, sums) = (self.law, &self.parts, &mut self.forces);
        if let Some(memory) = &mut self.memory {
            let written = (
                Ragged::new(&mut sums.positions, &self.starts),
                Items::new(&mut memory.parts),
            );
            team.pass(parts.len(), written, |part, (copies, memory)| {
                let part = &parts[part];
                part.copy(positions, copies);
                part.groups.stresses(kernel, law, copies, &mut memory.newest);
            });
        }
    }

    /// The energy of the arms' springs with nodes at `positions`, J, where the pressures of rings have just been worked out.
    fn energy_of_arms(&mut self, kernel: ChosenKernel, positions: &[Record], team: &Team) -> f64 {
        if self.memory.as_ref().is_none_or(|memory| !memory.has_energy()) {
            return 0.0;
        }
        self.find_stresses(kernel, positions, team);
        let (law, parts, sums) = (self.law, &self.parts, &mut self.forces);
        let Some(memory) = self.memory.as_deref() else {
            return 0.0;
        };
        team.pass(parts.len(), Items::new(&mut sums.of_parts), |part, energy| {
            *energy = memory.energy_of_part(law, part, parts[part].groups.as_slice());
        });
        let rings = self.rings.iter().flat_map(|rings| &rings.volumes);
        let rings = rings.zip(&sums.pressures.of_nodes).enumerate();
        let of_rings = rings.map(|(node, (&volume, &pressure))| {
            memory.energy_of_ring(law, node, f64::from(pressure), f64::from(volume))
        });
        sums.of_parts.iter().sum::<f64>() + of_rings.sum::<f64>()
    }
}

/// The loads on the tetrahedra of a part; none where there is no memory.
fn loads(memory: Option<&Memory>, part: usize) -> &[Stresses] {
    memory.map_or(&[], |memory| memory.parts[part].loads())
}
