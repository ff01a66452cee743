//! Volume by rings: the tetrahedra about a node keep their volume together, and press with the mean of their nodes' pressures.

use super::parts::{Copies, FemPart};
use crate::base::{Result, memory};
use crate::codec::saved;
use crate::simd::Record;
use crate::soa::{TILE, per_node, tile_count, tile_nodes};
use crate::threads::{Items, Team, Tiles};

/// What each node and the tetrahedra about it have of volume at rest: a quarter of theirs, m³.
#[derive(Debug)]
pub(super) struct Rings {
    pub volumes: Vec<f32>,
}

saved! { Rings { volumes } }

/// The rings of all tetrahedra.
pub(super) fn of(parts: &[FemPart], node_count: usize) -> Result<Rings> {
    let mut volumes = memory::filled(0.0_f32, node_count)?;
    for part in parts {
        part.visit(&mut |corners, rest, _| {
            for node in corners {
                volumes[node as usize] += 0.25 * rest.volume as f32;
            }
        });
    }
    Ok(Rings { volumes })
}

/// The pressures of nodes, and the energy of the nodes of each tile.
#[derive(Debug, Default)]
pub(super) struct Pressures {
    pub of_nodes: Vec<f32>,
    energies: Vec<f64>,
}

saved! { Pressures { of_nodes, energies } }

per_node! { Pressures { of_nodes } tiles { energies } }

impl Pressures {
    pub fn new(node_count: usize) -> Result<Self> {
        Ok(Self {
            of_nodes: memory::filled(0.0, node_count)?,
            energies: memory::filled(0.0, tile_count(node_count))?,
        })
    }

    /// Those that growths of the copies, m³, lead to where volume resists with `kappa`, Pa, less the offsets, m³, and with the loads on top
    /// where there are any: the energy of all without loads, J.
    pub fn find(
        &mut self,
        rings: &Rings,
        copies: &Copies,
        growths: &[Record],
        kappa: f32,
        [offsets, loads]: [&[f32]; 2],
        team: &Team,
    ) -> f64 {
        let node_count = self.of_nodes.len();
        let written = (Tiles::new(&mut self.of_nodes, TILE), Items::new(&mut self.energies));
        team.pass(tile_count(node_count), written, |tile, (pressures, energy)| {
            pressures.fill(0.0);
            for copy in copies.of_tile(tile) {
                pressures[usize::from(copy.place)] += growths[copy.at as usize].0[0];
            }
            if !offsets.is_empty() {
                let offsets = &offsets[tile_nodes(tile, node_count)];
                pressures
                    .iter_mut()
                    .zip(offsets)
                    .for_each(|(growth, offset)| *growth -= offset);
            }
            *energy = 0.0;
            let volumes = &rings.volumes[tile_nodes(tile, node_count)];
            for (pressure, &volume) in pressures.iter_mut().zip(volumes) {
                let growth = *pressure;
                *pressure = if volume > 0.0 { kappa * (growth / volume) } else { 0.0 };
                *energy += 0.5 * f64::from(growth) * f64::from(*pressure);
            }
            if !loads.is_empty() {
                let loads = &loads[tile_nodes(tile, node_count)];
                pressures
                    .iter_mut()
                    .zip(loads)
                    .for_each(|(pressure, load)| *pressure += load);
            }
        });
        self.energies.iter().sum()
    }
}
