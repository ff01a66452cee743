//! Pressure inside closed surfaces: a cavity of volume V, V0 at rest, has the energy `kappa/2 V0 (V/V0 - 1)² - p (V - V0)`.
//!
//! A cavity's volume depends on all of its nodes, so forces take two passes. The first goes over blocks of triangles of one cavity: it leaves
//! the vector of each triangle, twice its area along its normal, and the sums of blocks, which are added up in their order. The second
//! is that of the tiles of nodes: each adds up the vectors about its own nodes, times the pressure. So there are no buffers that two threads
//! write to, and results are the same for any number of threads.

mod exact;
mod rates;
mod surface;

use glam::{DVec3, Vec3};

use crate::base::{Result, StateHasher, memory};
use crate::codec::saved;
use crate::def::BodyDefinition;
use crate::soa::{NodeOrder, Rates, TileForces, Vectors};
use crate::threads::{Items, Ragged, Team};
pub(crate) use exact::{At, Gradients};
use surface::{CavitySurface, SurfaceBlock};

/// What is inside of one closed surface.
#[derive(Clone, Copy, Debug)]
struct Cavity {
    /// m³, above 0.
    rest_volume: f64,
    /// Where its triangles begin, and the end of the last.
    triangles: [u32; 2],
    /// Whether it was cut open.
    is_open: bool,
    /// Pa, where forces were last worked out.
    pressure: f64,
}

saved! { Cavity { rest_volume, triangles, is_open, pressure } }

/// The cavities of a body.
#[derive(Debug)]
pub(crate) struct Enclosed {
    /// kappa and p, Pa.
    stiffness: f32,
    pressure: f32,
    cavities: Vec<Cavity>,
    surface: CavitySurface,
    /// The vectors of triangles where forces were last worked out, m².
    vectors: Vec<Vec3>,
    sums: Vec<BlockSums>,
    /// Pressures, over 6: what a triangle's vector gives to each of its nodes.
    factors: Vec<f64>,
    /// For each triangle, what its vector and its longest edge count for in the bound on frequencies.
    weights: Vec<rates::Weights>,
    /// That of springs beside, and all of it where forces were last worked out, and at the current state.
    of_springs: Rates,
    highest: f32,
    settled: f32,
    rates_known: bool,
}

saved! { Enclosed {
    stiffness, pressure, cavities, surface, vectors, sums, factors, weights, of_springs, highest, settled, rates_known,
} }

/// What there is to know of the triangles of a block.
#[derive(Clone, Copy, Debug, Default)]
struct BlockSums {
    /// Six times their volume, m³.
    volume: f64,
    bounds: rates::CavityBounds,
}

saved! { BlockSums { volume, bounds } }

/// How pressures change where nodes go some ways.
#[derive(Debug)]
pub(crate) struct PressureChanges {
    sums: Vec<f64>,
    factors: Vec<f64>,
}

saved! { PressureChanges { sums, factors } }

/// What the nodes of a tile are given.
#[derive(Clone, Copy)]
pub(crate) struct PressureShares<'a> {
    surface: &'a CavitySurface,
    vectors: &'a [Vec3],
    factors: &'a [f64],
}

impl PressureShares<'_> {
    /// Adds what pressures give to the nodes of a tile.
    pub fn add(&self, tile: usize, forces: &mut TileForces) {
        self.surface.visit_tile(tile, &mut |place, cavity, triangles| {
            let factor = self.factors[cavity];
            if factor == 0.0 {
                return;
            }
            let sum: DVec3 = triangles
                .iter()
                .map(|&triangle| self.vectors[triangle as usize].as_dvec3())
                .sum();
            forces.set(place, forces.get(place) + (sum * factor).as_vec3());
        });
    }
}

impl Enclosed {
    /// What a definition asks for of a body with these triangles, in the caller's numbers. `None`: it asks for nothing.
    pub fn new(definition: &BodyDefinition, triangles: &[[u32; 3]], order: &NodeOrder) -> Result<Option<Box<Self>>> {
        if definition.enclosed_stiffness == 0.0 && definition.pressure == 0.0 {
            return Ok(None);
        }
        let (surface, cavities) = surface::close(definition, triangles, order)?;
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
            of_springs: Rates::ZERO,
            highest: f32::INFINITY,
            settled: f32::INFINITY,
            rates_known: false,
        })?))
    }

    /// Room for what pressures change by.
    pub fn room_for_changes(&self) -> Result<PressureChanges> {
        Ok(PressureChanges {
            sums: memory::filled(0.0, self.sums.len())?,
            factors: memory::filled(0.0, self.cavities.len())?,
        })
    }

    /// The pressure of cavities that have their volume at rest, Pa.
    pub fn pressure(&self) -> f32 {
        self.pressure
    }

    /// Makes the pressure of cavities that have their volume at rest this, Pa.
    pub fn set_pressure(&mut self, pressure: f32) {
        self.pressure = pressure;
    }

    /// Works out the forces with nodes at `positions`.
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
            // Volumes are those of the tetrahedra with one of the surface's own nodes, so that nothing is lost far away.
            let apex = at(surface.triangles[cavity.triangles[0] as usize][0]);
            *sums = BlockSums::default();
            let triangles = surface.triangles[start..end].iter().zip(&weights[start..end]);
            for (vector, (corners, weights)) in vectors.iter_mut().zip(triangles) {
                let [a, b, c] = corners.map(at);
                let [ab, ac] = [b - a, c - a];
                let exact = ab.cross(ac);
                *vector = exact.as_vec3();
                sums.volume += (a - apex).dot(exact);
                sums.bounds.add(weights, exact, [ab, ac]);
            }
        });
        self.press();
    }

    /// Makes pressures of the sums of blocks.
    fn press(&mut self) {
        let mut bounds = rates::RateBound::new(self.surface.nodes_are_shared);
        let mut blocks = self.surface.blocks.iter().zip(&self.sums).peekable();
        for (index, cavity) in self.cavities.iter_mut().enumerate() {
            let mut sums = BlockSums::default();
            while let Some((_, of_block)) = blocks.next_if(|(block, _)| block.cavity == index) {
                sums.volume += of_block.volume;
                sums.bounds.and(&of_block.bounds);
            }
            if cavity.is_open {
                (cavity.pressure, self.factors[index]) = (0.0, 0.0);
                continue;
            }
            cavity.pressure = pressure_of(self.stiffness, self.pressure, cavity, sums.volume / 6.0);
            self.factors[index] = cavity.pressure / 6.0;
            bounds.add(
                f64::from(self.stiffness) / cavity.rest_volume,
                cavity.pressure,
                &sums.bounds,
            );
        }
        self.highest = bounds.total() as f32;
    }

    /// Works out how forces change, to first order, where nodes go these ways from where forces were last worked out. What pressure
    /// itself does as a surface turns is left out: it pushes one way as much as another.
    pub fn find_changes(&self, ways: &Vectors, changes: &mut PressureChanges, team: &Team) {
        if self.stiffness == 0.0 {
            return;
        }
        let ways = ways.view();
        let (surface, cavities) = (&self.surface, &self.cavities);
        team.pass(surface.blocks.len(), Items::new(&mut changes.sums), |block, sum| {
            let SurfaceBlock { cavity, start, end } = surface.blocks[block];
            *sum = 0.0;
            if cavities[cavity].is_open {
                return;
            }
            for (corners, vector) in surface.triangles[start..end].iter().zip(&self.vectors[start..end]) {
                let [a, b, c] = corners.map(|node| ways.get(node as usize).as_dvec3());
                *sum += vector.as_dvec3().dot(a + b + c);
            }
        });
        let mut blocks = surface.blocks.iter().zip(&changes.sums).peekable();
        for (index, (cavity, factor)) in cavities.iter().zip(&mut changes.factors).enumerate() {
            let mut growth = 0.0;
            while let Some((_, sum)) = blocks.next_if(|(block, _)| block.cavity == index) {
                growth += sum / 6.0;
            }
            *factor = -f64::from(self.stiffness) * (growth / cavity.rest_volume) / 6.0;
        }
    }

    /// Where forces were worked out last is the current state.
    pub fn settle(&mut self) {
        self.settled = self.highest;
    }

    /// What these changes give to nodes; `None`: the forces that were worked out last.
    pub fn shares<'a>(&'a self, changes: Option<&'a PressureChanges>) -> PressureShares<'a> {
        PressureShares {
            surface: &self.surface,
            vectors: &self.vectors,
            factors: changes.map_or(&self.factors, |changes| &changes.factors),
        }
    }

    /// Opens the cavities whose surface has an edge between two nodes: how many.
    pub fn remove_edge(&mut self, a: u32, b: u32) -> usize {
        self.open_where(a, |corners| corners.contains(&b))
    }

    /// Opens the cavities with a triangle of these nodes: whether any was closed.
    pub fn open_at(&mut self, [a, b, c]: [u32; 3]) -> bool {
        self.open_where(a, |corners| corners.contains(&b) && corners.contains(&c)) > 0
    }

    /// Opens the cavities that have such a triangle about a node: how many.
    fn open_where(&mut self, node: u32, is_it: impl Fn(&[u32; 3]) -> bool) -> usize {
        let (surface, cavities) = (&self.surface, &mut self.cavities);
        let mut opened = 0;
        surface.visit_node(node as usize, &mut |cavity, triangles| {
            let cavity = &mut cavities[cavity];
            let mut corners = triangles.iter().map(|&triangle| &surface.triangles[triangle as usize]);
            if !cavity.is_open && corners.any(&is_it) {
                cavity.is_open = true;
                opened += 1;
            }
        });
        opened
    }

    /// What may change of it.
    pub fn hash(&self, hasher: &mut StateHasher) {
        hasher.write_floats(&[self.stiffness, self.pressure]);
        for cavity in &self.cavities {
            hasher.write_u64(u64::from(cavity.is_open));
        }
    }
}

/// The pressure of a cavity of this volume, Pa.
fn pressure_of(stiffness: f32, pressure: f32, cavity: &Cavity, volume: f64) -> f64 {
    f64::from(pressure) - f64::from(stiffness) * ((volume - cavity.rest_volume) / cavity.rest_volume)
}
