//! A tight bound on the frequencies of elements, at the deformation at the start of a step.
//!
//! The bound of [`super::rates`] adds the stiffness of each tetrahedron, as if all deformed in their worst direction at
//! once. It is 1.4 times the highest frequency at rest, and 2 to 4 times where elements are stretched. Here the tangent
//! is assembled first, so that blocks of neighbors cancel. Let K be the tangent and M the masses. For any positive
//! weights w, the largest eigenvalue of `M⁻¹ K` is at most the highest row sum `sum_b |K_ab| w_b / (m_a w_a)`
//! (Collatz 1942, for the matrix of the norms of blocks). A few power iterations find good weights.
//!
//! Within the step, elements stiffen. Each tetrahedron's row sum grows at most with its bound of [`super::rates`]
//! relative to that at the start, as far as that bound is equally tight. The next step assembles the tangent anew. A
//! body near rest must stay stable when it returns there, so the bound at rest is always part of the bound.

use super::Elements;
use super::forces::extra_stresses;
use super::tetrahedra::{GROUP, NodePairs};
use crate::base::{Result, memory};
use crate::codec::{Reader, Saved, Writer, saved};
use crate::simd::{ChosenKernel, Record};
use crate::soa::NodalMasses;
use crate::springs::{Springs, spring_rates};
use crate::threads::{Items, Ragged, Team};

/// The number of products with the matrix of norms.
const PRODUCTS: usize = 6;

/// The least weight of a node, relative to the largest.
const MIN_WEIGHT: f32 = 1e-6;

/// Elements that are at most this much stiffer than at rest have a bound that also serves for the rest shape, with the
/// margin.
const NEAR_REST: f32 = 1.05;
const REST_MARGIN: f32 = 1.1;

/// Memory for the tangent of a body.
#[derive(Debug)]
pub(super) struct DeformedRates {
    parts: Vec<PartBlocks>,
    /// A weight and a row sum for each node.
    weights: Vec<f32>,
    row_sums: Vec<f32>,
    /// A bound at rest, 1/s². `None`: that of [`super::rates`].
    rest_rate: Option<f32>,
    /// True if the rates of tetrahedra are relative to a deformation.
    pub is_used: bool,
    /// `rest_rate` and `is_used` at the end of the last step.
    committed: (Option<f32>, bool),
}

saved! { DeformedRates { parts, weights, row_sums, rest_rate, is_used, committed } }

impl DeformedRates {
    /// Returns to the bound at rest of [`super::rates`].
    pub fn forget_rest_rate(&mut self) {
        self.rest_rate = None;
    }
}

#[derive(Debug)]
struct PartBlocks {
    pairs: NodePairs,
    /// The norms of the blocks of pairs, and of those of nodes.
    norms: Vec<f32>,
    node_norms: Vec<f32>,
    /// Memory for [`NodePairs::find_norms`].
    sums: Vec<Record>,
    spreads: Vec<f32>,
    /// For each group.
    stiffenings: Vec<[f32; GROUP]>,
}

impl PartBlocks {
    fn of(pairs: NodePairs) -> Result<Self> {
        let node_count = pairs.node_count.max(GROUP);
        Ok(Self {
            norms: memory::filled(0.0, pairs.norm_count())?,
            node_norms: memory::filled(0.0, node_count)?,
            sums: memory::filled(Record::default(), 2 * node_count)?,
            spreads: memory::filled(0.0, pairs.norm_count().max(node_count))?,
            stiffenings: memory::filled([1.0; GROUP], pairs.group_count())?,
            pairs,
        })
    }

    /// Adds the products of the norms and the weights of nodes.
    fn add_products(&self, nodes: &[u32], weights: &[f32], sums: &mut [f32]) {
        for (&[a, b], norm) in self.pairs.nodes.iter().zip(&self.norms) {
            let [a, b] = [a, b].map(|node| nodes[usize::from(node)] as usize);
            sums[a] += norm * weights[b];
            sums[b] += norm * weights[a];
        }
        for (&node, norm) in nodes.iter().zip(&self.node_norms) {
            sums[node as usize] += norm * weights[node as usize];
        }
    }
}

/// The rest is computed before it is used.
impl Saved for PartBlocks {
    const SHAPE: u64 = NodePairs::SHAPE;
    const LEAST: usize = NodePairs::LEAST;

    fn save(&self, to: &mut Writer) {
        self.pairs.save(to);
    }

    fn load(from: &mut Reader) -> Result<Self> {
        Self::of(NodePairs::load(from)?)
    }
}

impl Elements {
    /// Prepares tight bounds, for an explicit solver.
    pub fn prepare_deformed_rates(&mut self) -> Result<()> {
        // Nodal pressures couple more nodes than those of a tetrahedron.
        if self.nodal_volumes.is_none() {
            let node_count = self.node_rates.len();
            self.deformed_rates = Some(memory::boxed(DeformedRates {
                parts: memory::try_collected(
                    self.parts
                        .iter()
                        .map(|part| PartBlocks::of(NodePairs::new(&part.groups)?)),
                )?,
                weights: memory::filled(0.0, node_count)?,
                row_sums: memory::filled(0.0, node_count)?,
                rest_rate: None,
                is_used: false,
                committed: (None, false),
            })?);
        }
        Ok(())
    }

    /// True if there is memory for a tight bound, and no cut has added parts or nodes since.
    pub fn can_tighten(&self) -> bool {
        let (parts, nodes) = (self.parts.len(), self.node_rates.len());
        let rates = self.deformed_rates.as_ref();
        rates.is_some_and(|rates| rates.parts.len() == parts && rates.weights.len() == nodes)
    }

    /// True if the bound is relative to a deformation.
    pub fn uses_deformed_rates(&self) -> bool {
        self.deformed_rates.as_ref().is_some_and(|rates| rates.is_used)
    }

    /// Computes the bound for nodes at `positions`, which forces until [`Self::forget_rates`] are relative to. Returns
    /// true if there is one. The bounds at rest must be known.
    pub fn find_deformed_rates(
        &mut self,
        kernel: ChosenKernel,
        positions: &[Record],
        springs: &dyn Springs,
        masses: &NodalMasses,
        team: &Team,
    ) -> bool {
        if !self.can_tighten() {
            return false;
        }
        let Some(mut rates) = self.deformed_rates.take() else {
            return false;
        };
        let law = self.stiffened();
        let (parts, history) = (&self.parts, self.history.as_deref());
        let written = (
            Ragged::new(&mut self.forces.positions, &self.starts),
            Items::new(&mut rates.parts),
        );
        team.pass(parts.len(), written, |part, (copies, blocks)| {
            let part_data = &parts[part];
            part_data.copy(positions, copies);
            let extra = extra_stresses(history, part);
            let assembled = (&mut blocks.pairs, &mut blocks.stiffenings[..]);
            part_data.groups.assemble_pairs(kernel, law, extra, copies, assembled);
            let memory = (&mut blocks.sums[..], &mut blocks.spreads[..]);
            blocks
                .pairs
                .find_norms(kernel, &mut blocks.norms, &mut blocks.node_norms, memory);
        });
        let highest = self.find_row_sums(&mut rates, masses);
        let is_finite = highest > 0.0 && highest.is_finite();
        if is_finite {
            self.set_deformed_rates(&mut rates, springs, masses);
            let sum_bound = self.sum_bound(&rates);
            // Among nodes of very different masses, the sum over tetrahedra may be lower.
            if sum_bound <= self.rate_bound {
                let node_rates = &self.node_rates;
                self.parts.iter_mut().for_each(|part| part.set_rates(node_rates));
                rates.is_used = false;
                self.rate_bound = sum_bound;
            }
            self.committed_rate_bound = self.rate_bound;
        }
        self.deformed_rates = Some(rates);
        is_finite
    }

    /// The bound of [`super::rates`] at the deformation that was assembled, 1/s².
    fn sum_bound(&self, rates: &DeformedRates) -> f32 {
        let mut highest = 0.0_f32;
        for (part, blocks) in self.parts.iter().zip(&rates.parts) {
            let groups = part.groups.as_slice();
            for (group, stiffenings) in blocks.stiffenings.iter().enumerate() {
                for lane in (0..GROUP).filter(|&lane| groups[group].volumes[lane] > 0.0) {
                    let corners = part.corner_nodes(group, lane);
                    let node_rates = corners.map(|node| self.node_rates[node as usize]);
                    highest = highest.max(stiffenings[lane] * node_rates.into_iter().fold(0.0, f32::max));
                }
            }
        }
        highest
    }

    /// Leaves a bound on the squared frequency of each node in `row_sums`, 1/s². Returns the highest.
    fn find_row_sums(&self, rates: &mut DeformedRates, masses: &NodalMasses) -> f32 {
        let DeformedRates {
            parts,
            weights,
            row_sums,
            ..
        } = rates;
        let mut highest = 0.0_f32;
        for (node, weight) in weights.iter_mut().enumerate() {
            *weight = if masses.inverse(node) > 0.0 { 1.0 } else { 0.0 };
        }
        for product in 1..=PRODUCTS {
            row_sums.fill(0.0);
            for (part, blocks) in self.parts.iter().zip(&*parts) {
                blocks.add_products(&part.nodes, weights, row_sums);
            }
            highest = 0.0;
            for (node, (sum, weight)) in row_sums.iter_mut().zip(&*weights).enumerate() {
                *sum = if *weight > 0.0 {
                    *sum * masses.inverse(node) / *weight
                } else {
                    0.0
                };
                highest = highest.max(*sum);
            }
            if product < PRODUCTS && highest > 0.0 {
                for (weight, sum) in weights.iter_mut().zip(&*row_sums) {
                    if *weight > 0.0 {
                        *weight = (*weight * *sum / highest).max(MIN_WEIGHT);
                    }
                }
            }
        }
        highest
    }

    /// Makes the rates of tetrahedra relative to the deformation that `row_sums` belong to.
    fn set_deformed_rates(&mut self, rates: &mut DeformedRates, springs: &dyn Springs, masses: &NodalMasses) {
        let (mut highest, mut stiffest) = (0.0_f32, 0.0_f32);
        for (node, sum) in rates.row_sums.iter_mut().enumerate() {
            if *sum > 0.0 {
                *sum += spring_rates(node, springs, masses).map_or(0.0, |rates| self.rate_beyond_shared(rates));
                highest = highest.max(*sum);
            }
        }
        let row_sums = &rates.row_sums;
        for (part, blocks) in self.parts.iter_mut().zip(&rates.parts) {
            let nodes = &part.nodes;
            let rate = |corner: u16| row_sums[nodes[usize::from(corner)] as usize];
            stiffest = stiffest.max(part.groups.set_relative_rates(&blocks.stiffenings, rate));
        }
        if stiffest <= NEAR_REST {
            rates.rest_rate = Some(REST_MARGIN * highest);
        }
        rates.is_used = true;
        self.rate_bound = highest.max(self.rest_rate(rates));
    }

    /// The bound at rest, 1/s².
    fn rest_rate(&self, rates: &DeformedRates) -> f32 {
        rates.rest_rate.unwrap_or(self.max_rest_rate)
    }

    /// The part of the bound that does not depend on the deformation, 1/s².
    pub(super) fn least_rate(&self) -> f32 {
        let rates = self.deformed_rates.as_deref().filter(|rates| rates.is_used);
        rates.map_or(0.0, |rates| self.rest_rate(rates))
    }

    /// Makes the bound of the step in progress that of the current state.
    pub(super) fn commit_deformed_rates(&mut self) {
        if let Some(rates) = &mut self.deformed_rates {
            rates.committed = (rates.rest_rate, rates.is_used);
        }
    }

    /// Discards the bound of a step that is not taken.
    pub fn rollback_deformed_rates(&mut self) {
        let Some(rates) = &mut self.deformed_rates else {
            return;
        };
        let (rest_rate, was_used) = rates.committed;
        if rates.is_used && !was_used {
            self.forget_rates();
        }
        if let Some(rates) = &mut self.deformed_rates {
            rates.rest_rate = rest_rate;
        }
    }

    /// Returns to the bounds at rest.
    pub(super) fn forget_deformed_rates(&mut self) {
        if let Some(rates) = &mut self.deformed_rates {
            (rates.rest_rate, rates.is_used) = (None, false);
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DVec3, Vec3};

    use crate::def::{BodyDefinition, ElementLaw, Material, Model, Solver};
    use crate::mesh::Mesh;
    use crate::random::Random;
    use crate::solver::System;
    use crate::threads::Team;
    use crate::world::{World, WorldDefinition};

    /// The largest magnitude of an eigenvalue of the tangent over the masses, by power iteration with blocks in `f64`.
    fn highest_rate(system: &System) -> f64 {
        let mut blocks: Vec<([usize; 2], DMat3)> = Vec::new();
        let positions = system.state.positions();
        let is_free = |node: usize| system.inverse_masses[node] > 0.0;
        system
            .forces
            .visit_deformed(positions, 1.0, &mut |corners, gradients, deformed| {
                for (a, gradient) in corners.into_iter().zip(gradients) {
                    for (b, other) in corners.into_iter().zip(gradients) {
                        let pair = [a as usize, b as usize];
                        if pair.into_iter().all(is_free) {
                            blocks.push((pair, deformed.stiffness(*gradient, *other)));
                        }
                    }
                }
            });
        let mut random = Random(3);
        let mut vectors: Vec<DVec3> = (0..positions.len()).map(|_| random.vector().as_dvec3()).collect();
        let mut rate = 0.0;
        for _ in 0..400 {
            let mut products = vec![DVec3::ZERO; vectors.len()];
            for ([a, b], block) in &blocks {
                products[*a] += *block * vectors[*b];
            }
            for (product, inverse_mass) in products.iter_mut().zip(&system.inverse_masses) {
                *product *= f64::from(*inverse_mass);
            }
            let norm = |vectors: &[DVec3]| vectors.iter().map(|one| one.length_squared()).sum::<f64>().sqrt();
            rate = norm(&products) / norm(&vectors);
            let scale = 1.0 / norm(&products);
            vectors = products.into_iter().map(|product| product * scale).collect();
        }
        rate
    }

    #[test]
    fn the_bound_is_above_the_highest_frequency_and_near_it() {
        let mesh = Mesh::organ(0.15, 0.15 / 12.0).expect("a mesh");
        let laws = [
            ElementLaw::StVenantKirchhoff,
            ElementLaw::NeoHookean,
            ElementLaw::MooneyRivlin { ratio: 0.4 },
        ];
        // At rest, crumpled, stretched and squeezed, and with inverted elements.
        let deformations = [
            (0.0, Vec3::ONE),
            (3e-3, Vec3::ONE),
            (1e-3, Vec3::new(2.5, 0.7, 0.6)),
            (9e-3, Vec3::ONE),
        ];
        for (law, (noise, stretch)) in laws
            .into_iter()
            .flat_map(|law| deformations.map(|deformation| (law, deformation)))
        {
            let mut world = World::new(WorldDefinition::default()).expect("a world");
            let id = world.create_body(&BodyDefinition {
                material: Some(Material {
                    model: Model::Tetrahedra,
                    poisson_ratio: 0.3,
                    young_modulus: 5000.0,
                    density: 1060.0,
                    ..Material::default()
                }),
                element_law: law,
                solver: Solver::Verlet,
                ..BodyDefinition::of(&mesh)
            });
            let body = world.body_mut(id.expect("a body")).expect("a body");
            let mut random = Random(11);
            let moved: Vec<Vec3> = mesh
                .positions
                .iter()
                .map(|&at| at * stretch + noise * random.vector())
                .collect();
            body.set_positions(&moved).expect("positions");
            body.pin_nodes(&[0, 1, 2]).expect("pins");
            let system = body.system_mut();
            let loose = f64::from(system.non_spring_dt_limit(&Team::alone()));
            let tight = f64::from(system.tightened_dt_limit(false, &Team::alone()).expect("a bound"));
            let exact = 2.0 / highest_rate(system).sqrt();
            // A body at rest keeps its margin for other shapes.
            let within = if noise == 0.0 { 0.83 } else { 0.75 };
            assert!(
                tight < exact * 1.0001 && tight > within * exact,
                "{law:?}, noise {noise}, stretch {stretch}: {tight:e} s, {exact:e} s, before {loose:e} s"
            );
            assert!(tight > 1.05 * loose, "{law:?}: {tight:e} s, before {loose:e} s");
        }
    }
}
