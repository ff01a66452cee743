//! Pressure in closed surfaces. A cavity of volume V, V0 at rest, has the energy `kappa/2 V0 (V/V0 - 1)² - p (V -
//! V0)`.
//!
//! The volume of a cavity depends on all its nodes, so forces take two passes. The first pass processes blocks of
//! triangles of one cavity. It stores each triangle's vector, which is twice its area along its normal, and sums the
//! blocks in order. The second pass processes tiles of nodes: each node sums the vectors of its triangles and
//! multiplies by the pressure. No two threads write to the same buffer, and results do not depend on the number of
//! threads.

mod exact;
mod rates;
mod surface;

use glam::{DVec3, Vec3};

use crate::base::{Result, StateHasher, memory};
use crate::codec::saved;
use crate::def::BodyDefinition;
use crate::soa::{FrequencyBound, NodeOrder, TileForces, Vectors};
use crate::threads::{Items, Ragged, Team};
pub(crate) use exact::{PositionVectors, VolumeGradients};
use surface::{CavitySurface, SurfaceBlock};

/// The inside of one closed surface.
#[derive(Clone, Copy, Debug)]
struct Cavity {
    /// m³, above 0.
    rest_volume: f64,
    /// The index of its first triangle, and the index after its last.
    triangles: [u32; 2],
    /// True if it has been cut open.
    is_open: bool,
    /// The pressure at the last computed forces, Pa.
    pressure: f64,
}

saved! { Cavity { rest_volume, triangles, is_open, pressure } }

/// The cavities of a body.
#[derive(Debug)]
pub(crate) struct Cavities {
    /// kappa and p, Pa.
    stiffness: f32,
    pressure: f32,
    cavities: Vec<Cavity>,
    surface: CavitySurface,
    /// The vectors of the triangles at the last computed forces, m².
    vectors: Vec<Vec3>,
    sums: Vec<BlockSums>,
    /// A sixth of each cavity's pressure: a triangle's vector times this is its force on each of its nodes.
    factors: Vec<f64>,
    /// The weights of each triangle in the rate bound.
    weights: Vec<rates::Weights>,
    /// The bound of the springs at cavity nodes, and the cavities' bounds at the last computed forces and at the
    /// current state.
    spring_rates: FrequencyBound,
    rate_bound: f32,
    committed_rate_bound: f32,
    rates_known: bool,
}

saved! { Cavities {
    stiffness, pressure, cavities, surface, vectors, sums, factors, weights, spring_rates, rate_bound,
    committed_rate_bound, rates_known,
} }

/// The sums over the triangles of a block.
#[derive(Clone, Copy, Debug, Default)]
struct BlockSums {
    /// Six times the volume, m³.
    volume: f64,
    bounds: rates::CavityBounds,
}

saved! { BlockSums { volume, bounds } }

/// The change of pressures for given displacements.
#[derive(Debug)]
pub(crate) struct PressureDifferentials {
    sums: Vec<f64>,
    factors: Vec<f64>,
}

saved! { PressureDifferentials { sums, factors } }

/// The pressure forces on the nodes of a tile.
#[derive(Clone, Copy)]
pub(crate) struct PressureForces<'a> {
    surface: &'a CavitySurface,
    vectors: &'a [Vec3],
    factors: &'a [f64],
}

impl PressureForces<'_> {
    /// Adds the pressure forces on the nodes of a tile to `forces`.
    pub fn add(&self, tile: usize, forces: &mut TileForces) {
        self.surface.visit_tile(tile, &mut |tile_slot, cavity, triangles| {
            let factor = self.factors[cavity];
            if factor == 0.0 {
                return;
            }
            let sum: DVec3 = triangles
                .iter()
                .map(|&triangle| self.vectors[triangle as usize].as_dvec3())
                .sum();
            forces.set(tile_slot, forces.get(tile_slot) + (sum * factor).as_vec3());
        });
    }
}

impl Cavities {
    /// Creates the cavities of a definition, for triangles in the caller's indices. `None` if it has no pressure and
    /// no volume stiffness.
    pub fn new(definition: &BodyDefinition, triangles: &[[u32; 3]], order: &NodeOrder) -> Result<Option<Box<Self>>> {
        if definition.enclosed_stiffness == 0.0 && definition.pressure == 0.0 {
            return Ok(None);
        }
        let (surface, cavities) = surface::build(definition, triangles, order)?;
        let triangle_count = surface.triangles.len();
        Ok(Some(memory::boxed(Self {
            stiffness: definition.enclosed_stiffness,
            pressure: definition.pressure,
            vectors: memory::filled(Vec3::ZERO, triangle_count)?,
            sums: memory::filled(BlockSums::default(), surface.blocks.len())?,
            factors: memory::filled(0.0, cavities.len())?,
            weights: memory::filled(rates::Weights::default(), triangle_count)?,
            cavities,
            surface,
            spring_rates: FrequencyBound::ZERO,
            rate_bound: f32::INFINITY,
            committed_rate_bound: f32::INFINITY,
            rates_known: false,
        })?))
    }

    /// Allocates the buffers for changes of pressures.
    pub fn new_differentials(&self) -> Result<PressureDifferentials> {
        Ok(PressureDifferentials {
            sums: memory::filled(0.0, self.sums.len())?,
            factors: memory::filled(0.0, self.cavities.len())?,
        })
    }

    /// The pressure of cavities at rest volume, Pa.
    pub fn pressure(&self) -> f32 {
        self.pressure
    }

    /// Sets the pressure of cavities at rest volume, Pa.
    pub fn set_pressure(&mut self, pressure: f32) {
        self.pressure = pressure;
    }

    /// Computes forces and the rate bound with nodes at `positions`.
    pub fn find_forces(&mut self, positions: &Vectors, team: &Team) {
        let positions = positions.view();
        let (surface, cavities, weights) = (&self.surface, &self.cavities, &self.weights);
        let written = (
            Ragged::new(&mut self.vectors, &surface.starts),
            Items::new(&mut self.sums),
        );
        team.pass(surface.blocks.len(), written, |block, (vectors, sums)| {
            let SurfaceBlock { cavity, start, end } = surface.blocks[block];
            let cavity = &cavities[cavity];
            if cavity.is_open {
                return;
            }
            let at = |node: u32| positions.get(node as usize).as_dvec3();
            // Volumes are sums over tetrahedra with a node of the surface as apex: a distant surface loses no digits.
            let apex = at(surface.triangles[cavity.triangles[0] as usize][0]);
            *sums = BlockSums::default();
            let triangles = surface.triangles[start..end].iter().zip(&weights[start..end]);
            for (vector, (corners, weights)) in vectors.iter_mut().zip(triangles) {
                let [a, b, c] = corners.map(at);
                let [ab, ac] = [b - a, c - a];
                let vector_f64 = ab.cross(ac);
                *vector = vector_f64.as_vec3();
                sums.volume += (a - apex).dot(vector_f64);
                sums.bounds.add(weights, vector_f64, [ab, ac]);
            }
        });
        self.update_pressures();
    }

    /// Computes pressures and the rate bound from the sums of blocks.
    fn update_pressures(&mut self) {
        let mut bounds = rates::RateBound::new(self.surface.nodes_are_shared);
        let mut blocks = self.surface.blocks.iter().zip(&self.sums).peekable();
        for (index, cavity) in self.cavities.iter_mut().enumerate() {
            let mut sums = BlockSums::default();
            while let Some((_, block_sums)) = blocks.next_if(|(block, _)| block.cavity == index) {
                sums.volume += block_sums.volume;
                sums.bounds.merge(&block_sums.bounds);
            }
            if cavity.is_open {
                (cavity.pressure, self.factors[index]) = (0.0, 0.0);
                continue;
            }
            cavity.pressure = cavity_pressure(self.stiffness, self.pressure, cavity, sums.volume / 6.0);
            self.factors[index] = cavity.pressure / 6.0;
            bounds.add(
                f64::from(self.stiffness) / cavity.rest_volume,
                cavity.pressure,
                &sums.bounds,
            );
        }
        self.rate_bound = bounds.total() as f32;
    }

    /// Computes the force differentials for these displacements from the last computed forces. The rotation of a
    /// surface under pressure is left out, because its part of the tangent is indefinite.
    pub fn find_differentials(&self, displacements: &Vectors, differentials: &mut PressureDifferentials, team: &Team) {
        if self.stiffness == 0.0 {
            return;
        }
        let displacements = displacements.view();
        let (surface, cavities) = (&self.surface, &self.cavities);
        team.pass(
            surface.blocks.len(),
            Items::new(&mut differentials.sums),
            |block, sum| {
                let SurfaceBlock { cavity, start, end } = surface.blocks[block];
                *sum = 0.0;
                if cavities[cavity].is_open {
                    return;
                }
                for (corners, vector) in surface.triangles[start..end].iter().zip(&self.vectors[start..end]) {
                    let [a, b, c] = corners.map(|node| displacements.get(node as usize).as_dvec3());
                    *sum += vector.as_dvec3().dot(a + b + c);
                }
            },
        );
        let mut blocks = surface.blocks.iter().zip(&differentials.sums).peekable();
        for (index, (cavity, factor)) in cavities.iter().zip(&mut differentials.factors).enumerate() {
            let mut volume_change = 0.0;
            while let Some((_, sum)) = blocks.next_if(|(block, _)| block.cavity == index) {
                volume_change += sum / 6.0;
            }
            *factor = -f64::from(self.stiffness) * (volume_change / cavity.rest_volume) / 6.0;
        }
    }

    /// Makes the rate bound of the last computed forces that of the current state.
    pub fn commit_rate_bound(&mut self) {
        self.committed_rate_bound = self.rate_bound;
    }

    /// The pressure forces for `differentials`, or the last computed ones for `None`.
    pub fn node_forces<'a>(&'a self, differentials: Option<&'a PressureDifferentials>) -> PressureForces<'a> {
        PressureForces {
            surface: &self.surface,
            vectors: &self.vectors,
            factors: differentials.map_or(&self.factors, |differentials| &differentials.factors),
        }
    }

    /// Opens the cavities whose surface has the edge between two nodes. Returns their number.
    pub fn remove_edge(&mut self, a: u32, b: u32) -> usize {
        self.open_where(a, |corners| corners.contains(&b))
    }

    /// Opens the cavities with a triangle of these nodes. Returns true if any was closed.
    pub fn open_at(&mut self, [a, b, c]: [u32; 3]) -> bool {
        self.open_where(a, |corners| corners.contains(&b) && corners.contains(&c)) > 0
    }

    /// Opens the cavities with a triangle at `node` that satisfies `matches`. Returns their number.
    fn open_where(&mut self, node: u32, matches: impl Fn(&[u32; 3]) -> bool) -> usize {
        let (surface, cavities) = (&self.surface, &mut self.cavities);
        let mut opened = 0;
        surface.visit_node(node as usize, &mut |cavity, triangles| {
            let cavity = &mut cavities[cavity];
            let mut corners = triangles.iter().map(|&triangle| &surface.triangles[triangle as usize]);
            if !cavity.is_open && corners.any(&matches) {
                cavity.is_open = true;
                opened += 1;
            }
        });
        opened
    }

    /// Hashes the state that can change.
    pub fn hash(&self, hasher: &mut StateHasher) {
        hasher.write_floats(&[self.stiffness, self.pressure]);
        for cavity in &self.cavities {
            hasher.write_u64(u64::from(cavity.is_open));
        }
    }
}

/// The pressure of a cavity of this volume, Pa.
fn cavity_pressure(stiffness: f32, pressure: f32, cavity: &Cavity, volume: f64) -> f64 {
    f64::from(pressure) - f64::from(stiffness) * ((volume - cavity.rest_volume) / cavity.rest_volume)
}
