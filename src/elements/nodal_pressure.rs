//! Average nodal pressure: the tetrahedra around a node keep their volume together and have the mean of their nodes'
//! pressures.

use super::parts::{FemPart, NodeCopies};
use crate::base::{Result, memory};
use crate::codec::saved;
use crate::simd::Record;
use crate::soa::{TILE, per_node, tile_count, tile_nodes};
use crate::threads::{Items, Team, Tiles};

/// The nodal volume at rest of each node, a quarter of the volume of the tetrahedra around it, m³.
#[derive(Debug)]
pub(super) struct NodalVolumes {
    pub volumes: Vec<f32>,
}

saved! { NodalVolumes { volumes } }

/// Sums the nodal volumes of all tetrahedra.
pub(super) fn nodal_volumes(parts: &[FemPart], node_count: usize) -> Result<NodalVolumes> {
    let mut volumes = memory::filled(0.0_f32, node_count)?;
    for part in parts {
        part.visit(&mut |corners, rest, _| {
            for node in corners {
                volumes[node as usize] += 0.25 * rest.volume as f32;
            }
        });
    }
    Ok(NodalVolumes { volumes })
}

/// The pressure of each node, and the energy of the nodes of each tile.
#[derive(Debug, Default)]
pub(super) struct NodalPressures {
    pub at_nodes: Vec<f32>,
    energies: Vec<f64>,
}

saved! { NodalPressures { at_nodes, energies } }

per_node! { NodalPressures { at_nodes } tiles { energies } }

impl NodalPressures {
    pub fn new(node_count: usize) -> Result<Self> {
        Ok(Self {
            at_nodes: memory::filled(0.0, node_count)?,
            energies: memory::filled(0.0, tile_count(node_count))?,
        })
    }

    /// Computes the pressures from the volume changes of the node copies, m³, minus the offsets, m³, for a bulk
    /// stiffness `kappa`, Pa. Adds the extra pressures if there are any. Returns the energy without extra pressures,
    /// J.
    pub fn update(
        &mut self,
        nodal_volumes: &NodalVolumes,
        copies: &NodeCopies,
        volume_changes: &[Record],
        kappa: f32,
        [offsets, extra]: [&[f32]; 2],
        team: &Team,
    ) -> f64 {
        let node_count = self.at_nodes.len();
        let written = (Tiles::new(&mut self.at_nodes, TILE), Items::new(&mut self.energies));
        team.pass(tile_count(node_count), written, |tile, (pressures, energy)| {
            pressures.fill(0.0);
            for copy in copies.in_tile(tile) {
                pressures[usize::from(copy.tile_slot)] += volume_changes[copy.index as usize].0[0];
            }
            if !offsets.is_empty() {
                let offsets = &offsets[tile_nodes(tile, node_count)];
                pressures
                    .iter_mut()
                    .zip(offsets)
                    .for_each(|(volume_change, offset)| *volume_change -= offset);
            }
            *energy = 0.0;
            let volumes = &nodal_volumes.volumes[tile_nodes(tile, node_count)];
            for (pressure, &volume) in pressures.iter_mut().zip(volumes) {
                let volume_change = *pressure;
                *pressure = if volume > 0.0 {
                    kappa * (volume_change / volume)
                } else {
                    0.0
                };
                *energy += 0.5 * f64::from(volume_change) * f64::from(*pressure);
            }
            if !extra.is_empty() {
                let extra = &extra[tile_nodes(tile, node_count)];
                pressures
                    .iter_mut()
                    .zip(extra)
                    .for_each(|(pressure, extra_pressure)| *pressure += extra_pressure);
            }
        });
        self.energies.iter().sum()
    }
}
