//! Forces, force differentials and energies of elements.

use glam::{DMat3, DVec3};

use super::history::ElementHistory;
use super::law::DeformedTet;
use super::parts::NodeCopies;
use super::tetrahedra::Stresses;
use super::{Elements, Sums};
use crate::simd::{ChosenKernel, Record};
use crate::soa::{TILE, TileForces};
use crate::threads::{Items, Ragged, Team};

/// The element forces on the nodes of a tile.
#[derive(Clone, Copy)]
pub(crate) struct ElementForces<'a> {
    copies: &'a NodeCopies,
    sums: &'a [Record],
}

impl ElementForces<'_> {
    /// Adds the sums over the copies of the tile's nodes to `forces`.
    pub fn add(&self, tile: usize, forces: &mut TileForces) {
        let mut sums = [Record::default(); TILE];
        // `for_each`, because a loop over a chain tests each time which half it is in.
        self.copies.in_tile(tile).for_each(|copy| {
            let (Record(sum), Record(value)) = (
                &mut sums[usize::from(copy.tile_slot) % TILE],
                &self.sums[copy.index as usize],
            );
            for axis in 0..4 {
                sum[axis] += value[axis];
            }
        });
        for (axis, forces) in forces.axes_mut().into_iter().enumerate() {
            for (force, Record(sum)) in forces.iter_mut().zip(&sums) {
                *force += sum[axis];
            }
        }
    }
}

impl Elements {
    /// Computes the forces of all elements, and the rate bound, with nodes at `positions`.
    pub fn find_forces(&mut self, kernel: ChosenKernel, positions: &[Record], team: &Team) {
        if self.nodal_volumes.is_some() {
            self.find_pressures(kernel, positions, true, team);
        }
        let (law, parts, starts) = (self.stiffened(), &self.parts, &self.starts);
        let (sums, history) = (&mut self.forces, self.history.as_deref());
        let written = (
            Ragged::new(&mut sums.positions, starts),
            Ragged::new(&mut sums.sums, starts),
            Items::new(&mut sums.part_totals),
        );
        let pressures = &sums.pressures.at_nodes;
        team.pass(parts.len(), written, |part, (copies, sums, rate_bound)| {
            let part_data = &parts[part];
            part_data.copy(positions, copies);
            part_data.copy_pressures(pressures, copies);
            sums.fill(Record::default());
            *rate_bound = f64::from(
                part_data
                    .groups
                    .forces(kernel, law, extra_stresses(history, part), copies, sums),
            );
        });
        self.rate_bound = sums
            .part_totals
            .iter()
            .fold(0.0, |highest: f64, &bound| highest.max(bound)) as f32;
        self.rate_bound = self.rate_bound.max(self.least_rate());
    }

    /// Assembles the tangent at `positions` for the following products, unless nodal pressures couple more nodes than
    /// those of a tetrahedron.
    pub fn assemble(&self, kernel: ChosenKernel, positions: &[Record], sums: &mut Sums, team: &Team) {
        if sums.matrices.is_empty() {
            return;
        }
        let (law, parts) = (self.stiffened(), &self.parts);
        let history = self.history.as_deref();
        let written = (
            Ragged::new(&mut sums.positions, &self.starts),
            Items::new(&mut sums.matrices),
        );
        team.pass(parts.len(), written, |part, (copies, matrix)| {
            if let Some(matrix) = matrix {
                let part_data = &parts[part];
                part_data.copy(positions, copies);
                let extra = extra_stresses(history, part);
                part_data.groups.assemble(kernel, law, extra, copies, matrix);
            }
        });
        sums.are_assembled = true;
    }

    /// Computes the force differentials at `positions` for these displacements, to first order.
    pub fn find_differentials(
        &self,
        kernel: ChosenKernel,
        [positions, displacements]: [&[Record]; 2],
        sums: &mut Sums,
        team: &Team,
    ) {
        let (law, parts, starts) = (self.stiffened(), &self.parts, &self.starts);
        let history = self.history.as_deref();
        if let Some(nodal_volumes) = &self.nodal_volumes {
            let written = (
                Ragged::new(&mut sums.positions, starts),
                Ragged::new(&mut sums.displacements, starts),
                Ragged::new(&mut sums.sums, starts),
            );
            team.pass(parts.len(), written, |part, (copies, displacement_copies, sums)| {
                let part = &parts[part];
                part.copy(positions, copies);
                part.copy(displacements, displacement_copies);
                sums.fill(Record::default());
                part.groups
                    .volume_changes(kernel, copies, Some(displacement_copies), sums);
            });
            sums.pressures
                .update(nodal_volumes, &self.copies, &sums.sums, law.kappa, [&[]; 2], team);
        }
        let written = (
            Ragged::new(&mut sums.positions, starts),
            Ragged::new(&mut sums.displacements, starts),
            Ragged::new(&mut sums.sums, starts),
        );
        let pressures = &sums.pressures.at_nodes;
        let matrices = if sums.are_assembled { &sums.matrices[..] } else { &[] };
        team.pass(parts.len(), written, |part, (copies, displacement_copies, sums)| {
            let part_data = &parts[part];
            part_data.copy(displacements, displacement_copies);
            if let Some(Some(matrix)) = matrices.get(part) {
                sums.fill(Record::default());
                matrix.multiply(kernel, displacement_copies, sums);
                return;
            }
            part_data.copy(positions, copies);
            part_data.copy_pressures(pressures, displacement_copies);
            sums.fill(Record::default());
            part_data.groups.force_differentials(
                kernel,
                law,
                extra_stresses(history, part),
                [copies, displacement_copies],
                sums,
            );
        });
    }

    /// The energy with nodes at `positions`, including that of Maxwell branches and plasticity, J.
    pub fn energy(&mut self, kernel: ChosenKernel, positions: &[Record], team: &Team) -> f64 {
        let pressure_energy = if self.nodal_volumes.is_some() {
            self.find_pressures(kernel, positions, false, team)
        } else {
            0.0
        };
        let (law, parts, sums) = (self.law, &self.parts, &mut self.forces);
        let written = (
            Ragged::new(&mut sums.positions, &self.starts),
            Items::new(&mut sums.part_totals),
        );
        team.pass(parts.len(), written, |part, (copies, energy)| {
            let part = &parts[part];
            *energy = if law.is_hyperelastic() {
                // A small energy is a difference that loses all digits in `f32`.
                part.exact_energy(law, positions)
            } else {
                part.copy(positions, copies);
                part.groups.energy(kernel, law, copies)
            };
        });
        let elastic = pressure_energy + sums.part_totals.iter().sum::<f64>();
        elastic + self.history_energy(kernel, positions, team)
    }

    /// Computes the nodal pressures at `positions`, with or without their extra part. Returns the elastic energy of
    /// the pressures, J.
    pub(super) fn find_pressures(
        &mut self,
        kernel: ChosenKernel,
        positions: &[Record],
        with_extra: bool,
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
            part.groups.volume_changes(kernel, copies, None, sums);
        });
        let Some(nodal_volumes) = &self.nodal_volumes else {
            return 0.0;
        };
        let history = self.history.as_deref().filter(|_| with_extra);
        let extra = history.map_or(&[][..], |history| &history.nodal.extra);
        let law = history.map_or(self.law, |history| history.stiffened(self.law));
        sums.pressures.update(
            nodal_volumes,
            &self.copies,
            &sums.sums,
            law.kappa,
            [self.pressure_offsets.values(), extra],
            team,
        )
    }

    /// Makes the rate bound of the last computed forces that of the current state.
    pub fn commit_rate_bound(&mut self) {
        self.committed_rate_bound = self.rate_bound;
        self.commit_deformed_rates();
    }

    /// The node forces in `sums`, or the last computed forces for `None`.
    pub fn node_forces<'a>(&'a self, sums: Option<&'a Sums>) -> ElementForces<'a> {
        ElementForces {
            copies: &self.copies,
            sums: &sums.unwrap_or(&self.forces).sums,
        }
    }

    /// The energy with nodes at `positions`, J, in `f64`. `volume_changes` is a buffer with one number for each node.
    pub fn exact_energy(&self, position: impl Fn(usize) -> DVec3, volume_changes: &mut [f64]) -> f64 {
        let (mut energy, law) = (0.0, self.law);
        let (history, kappa) = (self.history.as_deref(), f64::from(law.kappa));
        volume_changes.fill(0.0);
        for (index, part) in self.parts.iter().enumerate() {
            part.visit(&mut |corners, rest, lane_index| {
                let [a, b, c, d] = corners.map(|node| position(node as usize));
                let deformed = DeformedTet::new(law, rest, DMat3::from_cols(b - a, c - a, d - a));
                energy += deformed.energy();
                if let Some(history) = history {
                    energy += rest.volume * history.energy_density(law, index, lane_index, deformed.elastic());
                }
                if law.nodal_pressure {
                    for node in corners {
                        volume_changes[node as usize] += 0.25 * deformed.volume_change();
                    }
                }
            });
        }
        let nodal_volumes = self
            .nodal_volumes
            .iter()
            .flat_map(|nodal_volumes| &nodal_volumes.volumes)
            .zip(&*volume_changes);
        for (node, (&volume, change)) in nodal_volumes.enumerate().filter(|(_, (volume, _))| **volume > 0.0) {
            let volume = f64::from(volume);
            let change = change - self.pressure_offsets.at(node);
            energy += 0.5 * kappa * change * change / volume;
            if let Some(history) = history {
                energy += history.nodal_energy(law, node, kappa * change / volume, volume);
            }
        }
        energy
    }

    /// Computes the elastic stresses at `positions`, without nodal pressures.
    pub(super) fn find_stresses(&mut self, kernel: ChosenKernel, positions: &[Record], team: &Team) {
        let (law, parts, sums) = (self.law, &self.parts, &mut self.forces);
        if let Some(history) = &mut self.history {
            let written = (
                Ragged::new(&mut sums.positions, &self.starts),
                Items::new(&mut history.parts),
            );
            team.pass(parts.len(), written, |part, (copies, history)| {
                let part = &parts[part];
                part.copy(positions, copies);
                part.groups.stresses(kernel, law, copies, &mut history.newest);
            });
        }
    }

    /// The energy of Maxwell branches and plasticity at `positions`, J. Nodal pressures must be up to date.
    fn history_energy(&mut self, kernel: ChosenKernel, positions: &[Record], team: &Team) -> f64 {
        if self.history.as_ref().is_none_or(|history| !history.has_energy()) {
            return 0.0;
        }
        self.find_stresses(kernel, positions, team);
        let (law, parts, sums) = (self.law, &self.parts, &mut self.forces);
        let Some(history) = self.history.as_deref() else {
            return 0.0;
        };
        team.pass(parts.len(), Items::new(&mut sums.part_totals), |part, energy| {
            *energy = history.part_energy(law, part, parts[part].groups.as_slice());
        });
        let nodal_volumes = self
            .nodal_volumes
            .iter()
            .flat_map(|nodal_volumes| &nodal_volumes.volumes);
        let nodal_volumes = nodal_volumes.zip(&sums.pressures.at_nodes).enumerate();
        let pressure_energy = nodal_volumes.map(|(node, (&volume, &pressure))| {
            history.nodal_energy(law, node, f64::from(pressure), f64::from(volume))
        });
        sums.part_totals.iter().sum::<f64>() + pressure_energy.sum::<f64>()
    }
}

/// The extra stresses of the tetrahedra of a part; empty without history.
pub(super) fn extra_stresses(history: Option<&ElementHistory>, part: usize) -> &[Stresses] {
    history.map_or(&[], |history| history.parts[part].extra_stresses())
}
