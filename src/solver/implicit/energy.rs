//! Energy balance of a step. An implicit step dissipates energy; a gain means that its equation was not solved.

use glam::{BVec3, DVec3};

use super::iterations::store_pin_reactions;
use super::step::Substep;
use super::{History, Implicit, SubstepOutcome, contact};
use crate::codec::saved;
use crate::contact::Contacts;
use crate::simd::Loops;
use crate::soa::{TileForces, Vectors, tile_count, tile_nodes};
use crate::solver::System;
use crate::solver::energy_removal::remove_kinetic_energy;
use crate::springs::ForceInput;
use crate::threads::{Items, Team};

/// Rounding error, as a fraction of the energies involved.
const ROUNDING: f64 = 1e-6;

/// Independent partial sums, so that additions do not form one dependency chain.
const LANES: usize = 16;

/// Limit of recoverable losses, as a fraction of the energy.
const MAX_CREDIT: f64 = 0.1;

/// Limit of accumulated gains, as a fraction of the energy: rounding, and gains inherent in the second-order formula.
const MAX_DEBT: f64 = 2e-4;

/// Limit of accumulated gains by contact with tools, as a fraction of the energy.
const MAX_CONTACT_DEBT: f64 = 1e-3;

/// Relative error of the displacements by gravity that solved equations may have.
const SOLVE_TOLERANCE: f64 = 1e-4;

/// Safety factor on the mean energy of rounded coordinates.
const ROUNDOFF_MARGIN: f64 = 8.0;

/// Kinetic and elastic energy. Rigid motion along free axes is excluded: in a fast fall it would hide an internal gain.
#[derive(Clone, Copy, Debug)]
pub(super) struct EnergyTotals {
    /// Energy, J. It is negative if a constant pressure has done more work than is stored.
    pub energy: f64,
    /// Scale for rounding errors: the sum of magnitudes, including pressure work, J.
    pub magnitude: f64,
}

saved! { EnergyTotals { energy, magnitude } }

/// Energy before a step.
#[derive(Clone, Copy, Debug)]
pub(super) struct EnergyBefore {
    /// Energy with the pins at their targets of the step.
    total: EnergyTotals,
    /// Losses that may be recovered (positive) or gains that must be lost again (negative), J.
    credit: f64,
    contact_credit: f64,
    /// The kinetic energy of the mean velocity, and the work of tools in the step so far, J; 0 far from tools.
    rigid: f64,
    work_of_tools: f64,
}

impl EnergyTotals {
    /// Creates the totals from stored energy and the work of constant pressures, J.
    fn new(stored: f64, work: f64) -> Self {
        Self {
            energy: stored - work,
            magnitude: stored + work.abs(),
        }
    }

    /// Adds energy, J.
    fn plus(self, added: f64) -> Self {
        Self {
            energy: self.energy + added,
            magnitude: self.magnitude + added,
        }
    }
}

impl Substep<'_> {
    /// Returns the energy before the step.
    pub(super) fn energy_before(&self, body: &mut System, implicit: &mut Implicit) -> EnergyBefore {
        let history = implicit.solution.last(self.is_first);
        let credit = history.credit;
        let pins_move = body.pins.iter().any(|pin| pin.travel != glam::Vec3::ZERO);
        let (rigid, work_of_tools, contact_credit) = if contact::is_near(body) {
            let mean = mean_vector(body, newest_velocities(body, self.is_first));
            (
                rigid_energy(body, mean),
                self.work_of_tools(body),
                history.contact_credit,
            )
        } else {
            (0.0, 0.0, 0.0)
        };
        let before = |total| EnergyBefore {
            total,
            credit,
            contact_credit,
            rigid,
            work_of_tools,
        };
        if let Some(total) = history.energy
            && !pins_move
        {
            return before(total);
        }
        let (kinetic, _) = kinetic_energy(body, self.is_first);
        let from = implicit.solution.history_index(self.is_first);
        let mut total = implicit.elastic(body, false, from, self.team);
        if pins_move {
            // Includes the energy that viscous branches take up along the pin motion.
            body.forces.predict(self.step);
            let state = body.state.substep();
            state.next_positions.copy_from(state.positions);
            for pin in body.pins.iter() {
                pin.set_held(state.next_positions, pin.position_at(self.end));
            }
            let moved = implicit.elastic(body, true, from, self.team);
            total = EnergyTotals {
                energy: total.energy.max(moved.energy),
                magnitude: total.magnitude.max(moved.magnitude),
            };
        }
        before(total.plus(kinetic))
    }

    /// Compares the energy after the step with the energy before it and the external work.
    pub(super) fn check_energy(
        &self,
        body: &mut System,
        implicit: &mut Implicit,
        before: EnergyBefore,
    ) -> SubstepOutcome {
        let (kinetic, velocity) = kinetic_energy(body, false);
        let elastic = implicit.elastic(body, true, 1 - implicit.solution.current_index, self.team);
        let (work, displacement) = self.work(body, implicit.solution.next());
        let after = elastic.plus(kinetic);
        let available = before.total.energy + work;
        let mass = total_mass(body);
        let fall = displacement.dot(self.request.gravity.as_dvec3());
        let available = available + SOLVE_TOLERANCE * SOLVE_TOLERANCE * mass * fall.abs();
        let magnitude = after.magnitude + work.abs();
        let rounding = self.rounding(body, implicit, velocity, [before.total.magnitude, magnitude]);
        if !(after.energy.is_finite() && after.magnitude.is_finite() && work.is_finite()) {
            return SubstepOutcome::NotFinite;
        }
        let is_rounding = after.energy <= available + rounding && !self.can_retry_first_order(implicit);
        // Attached bodies use first order only.
        let max_credit = if implicit.solution.is_attached { 0.0 } else { MAX_CREDIT };
        let history = implicit.solution.next_mut();
        history.energy = Some(after);
        history.contact_credit = before.contact_credit;
        history.credit = (available + before.credit - after.energy).min(max_credit * magnitude);
        if history.credit >= -(MAX_DEBT * magnitude + rounding) || is_rounding {
            SubstepOutcome::Accepted
        } else {
            SubstepOutcome::EnergyGained
        }
    }

    /// The rounding error of energies of these magnitudes before and after the substep, J: of velocities, relative to
    /// the mean velocity, and of coordinates.
    fn rounding(&self, body: &System, implicit: &Implicit, velocity: DVec3, [before, after]: [f64; 2]) -> f64 {
        let extent = body.local_bounds().magnitudes().max_element();
        let speed = velocity.length() * f64::from(f32::EPSILON) + f64::EPSILON * f64::from(extent) / self.step;
        let roundoff = total_mass(body) * speed * speed + ROUNDOFF_MARGIN * implicit.roundoff(extent).energy;
        ROUNDING * (before + after) + roundoff + 2.0 * (roundoff * after).sqrt()
    }

    /// Returns true if contact with tools has raised the energy above that put in. Contact takes energy away, unless it
    /// moves nodes far that the equation did not foresee.
    pub(super) fn has_contact_gain(&self, body: &mut System, implicit: &mut Implicit, before: EnergyBefore) -> bool {
        let (kinetic, mean) = kinetic_energy(body, false);
        let elastic = implicit.elastic(body, true, 1 - implicit.solution.current_index, self.team);
        let internal = elastic.plus(kinetic);
        let after = internal.plus(rigid_energy(body, mean));
        let work = self.external_work(body, implicit.solution.next(), DVec3::ZERO) + self.work_of_tools(body)
            - before.work_of_tools;
        let available = before.total.energy + before.rigid + work;
        let magnitudes = [before.total.magnitude + before.rigid, after.magnitude + work.abs()];
        // Tissue that a tool meets within the substep takes its speed at once, and forces against that act later.
        let contacts = body.contacts.as_deref();
        let fastest = contacts.map_or(0.0, |contacts| {
            contacts.fastest_touching(self.request.tools, self.request.dt)
        });
        let taken = 0.5 * total_mass(body) * f64::from(fastest).powi(2);
        let rounding = self.rounding(body, implicit, mean, magnitudes);
        let max_debt = MAX_CONTACT_DEBT * magnitudes[1];
        let balance = before.contact_credit + available - after.energy;
        let history = implicit.solution.next_mut();
        history.energy = Some(internal);
        // Unlike `clamp`, this accepts NaN.
        history.contact_credit = balance.min(MAX_CREDIT * magnitudes[1]).max(-max_debt);
        balance < -(max_debt + taken + rounding)
    }

    /// The work of tools on the body in the step so far, J.
    fn work_of_tools(&self, body: &System) -> f64 {
        let contacts = body.contacts.as_deref();
        contacts.map_or(0.0, |contacts| {
            contacts.work_of_tools(self.request.tools, self.request.dt)
        })
    }

    /// Removes the energy gain, first from internal velocities, then from all. If that does not suffice, only the pins
    /// move.
    pub(super) fn slow_down(&self, body: &mut System, implicit: &mut Implicit, before: EnergyBefore) {
        let energy = implicit.solution.next().energy;
        let (work, _) = self.work(body, implicit.solution.next());
        let excess = energy.map(|total| total.energy - before.total.energy - work);
        let removed = excess
            .filter(|excess| excess.is_finite())
            .map(|excess| remove_kinetic_energy(body, excess, true));
        let (kinetic, mean) = kinetic_energy(body, false);
        let state = body.state.substep();
        let history = implicit.solution.next_mut();
        if let (Some(total), Some(excess), Some(removed)) = (energy, excess, removed)
            && excess - removed <= kinetic
        {
            let remaining = (excess - removed).max(0.0);
            if remaining > 0.0 {
                let factor = (1.0 - remaining / kinetic).sqrt();
                let mean = mean.as_vec3().to_array();
                for (axis, mean) in state.velocities.axes_mut().into_iter().zip(mean) {
                    axis.iter_mut()
                        .for_each(|value| *value = mean + (*value - mean) * factor as f32);
                }
            }
            history.energy = Some(total.plus(-removed - remaining));
        } else {
            state.next_positions.copy_from(state.positions);
            for pin in body.pins.iter() {
                pin.set_held(state.next_positions, pin.position_at(self.end));
            }
            if self.is_forced {
                let [mut error_sum, mut mass_sum] = [0.0; 2];
                for (node, &mass) in body
                    .masses
                    .iter()
                    .enumerate()
                    .filter(|(node, _)| body.inverse_masses[*node] > 0.0)
                {
                    error_sum += f64::from(mass) * history.displacements.get(node).as_dvec3().length_squared();
                    mass_sum += f64::from(mass);
                }
                implicit.report.error = implicit.report.error.max((error_sum / mass_sum).sqrt() as f32);
            }
            state.velocities.clear();
            history.displacements.clear();
            history.energy = None;
            self.find_pin_reactions(body);
            if let Some(contacts) = body.contacts.as_mut().filter(|_| self.is_forced) {
                contacts.discard_equation_contacts();
            }
        }
        let history = implicit.solution.next_mut();
        history.velocity_changes.clear();
        history.remainders.clear();
        history.step = 0.0;
        history.credit = 0.0;
        implicit.report.has_converged = false;
    }

    /// Computes the pin reactions for nodes that do not move.
    fn find_pin_reactions(&self, body: &mut System) {
        if let Some(velocities) = &mut body.predicted_velocities {
            velocities.clear();
        }
        let positions = &*body.state.substep().next_positions;
        body.forces.write_records(positions, self.team);
        body.forces.compute(positions, self.team);
        let forces = body.forces.sum();
        let motion = ForceInput {
            positions: body.forces.view(positions),
            ..ForceInput::at(positions, body.predicted_velocities.as_ref())
        };
        let (masses, gravity) = (&body.masses, self.request.gravity);
        let node_count = positions.len();
        self.team
            .pass(tile_count(node_count), body.pins.tiles_mut(), |tile, pins| {
                if pins.is_empty() {
                    return;
                }
                let mut sums = TileForces::ZERO;
                forces.write(tile, tile_nodes(tile, node_count), &motion, &mut sums);
                store_pin_reactions(pins, &sums, gravity, masses);
            });
    }

    /// Returns the work of gravity, applied forces, tools and other tissue along the displacements, J. The mean
    /// displacement of the body is excluded and returned, too, m.
    fn work(&self, body: &System, history: &History) -> (f64, DVec3) {
        let displacements = &history.displacements;
        let mean = mean_vector(body, displacements);
        let held = |contacts: &Contacts| {
            contacts
                .multipliers
                .work(|node| displacements.get(node) - mean.as_vec3())
        };
        let work = body.contacts.as_deref().map_or(0.0, held);
        (work + self.external_work(body, history, mean), mean)
    }

    /// Returns the work of gravity, applied forces and other tissue along the displacements relative to `mean` (m), J.
    fn external_work(&self, body: &System, history: &History, mean: DVec3) -> f64 {
        let displacements = &history.displacements;
        let contact_forces = history.active_contact_forces();
        let applied = body.applied.as_ref().filter(|_| body.forces_applied);
        let mut work = 0.0;
        for (axis, displacements) in displacements.axes().into_iter().enumerate() {
            let gravity = f64::from(self.request.gravity[axis]);
            if gravity != 0.0 {
                work += gravity * weighted_sum(body, &body.masses, displacements, mean[axis]);
            }
            for applied in applied.into_iter().chain(contact_forces) {
                work += weighted_sum(body, applied.axes()[axis], displacements, mean[axis]);
            }
        }
        // Prescribed displacements do no work of this kind.
        for pin in body.pins.partial() {
            let (mass, displacement) = (
                f64::from(body.masses[pin.node as usize]),
                displacements.get(pin.node as usize),
            );
            work -= mass * pin.held(displacement).as_dvec3().dot(self.request.gravity.as_dvec3());
        }
        work
    }
}

/// Returns the sum of `weight * (value - about)` over free nodes.
fn weighted_sum(body: &System, weights: &[f32], values: &[f32], about: f64) -> f64 {
    body.kernel.run(WeightedSum {
        weights,
        values,
        about,
        free: &body.inverse_masses,
    })
}

struct WeightedSum<'a> {
    weights: &'a [f32],
    values: &'a [f32],
    about: f64,
    free: &'a [f32],
}

impl Loops for WeightedSum<'_> {
    type Output = f64;

    #[inline(always)]
    fn run(self) -> f64 {
        let mut sums = [0.0; LANES];
        let chunks = self
            .weights
            .chunks(LANES)
            .zip(self.values.chunks(LANES))
            .zip(self.free.chunks(LANES));
        for ((weights, values), free) in chunks {
            for (sum, ((&weight, &value), &free)) in sums.iter_mut().zip(weights.iter().zip(values).zip(free)) {
                let weight = if free > 0.0 { f64::from(weight) } else { 0.0 };
                *sum += weight * (f64::from(value) - self.about);
            }
        }
        sums.into_iter().sum()
    }
}

impl Implicit {
    /// Returns the internal energy with the nodes at the start or at the end of the substep, J. NEWTON adds the
    /// rounding remainders of this index.
    fn elastic(&mut self, body: &mut System, is_next: bool, history_index: usize, team: &Team) -> EnergyTotals {
        let state = body.state.substep();
        let positions = if is_next {
            &*state.next_positions
        } else {
            state.positions
        };
        if let Some(newton) = &mut self.newton {
            let [stored, work] = newton.elastic(&body.forces, positions, history_index);
            return EnergyTotals::new(stored, work);
        }
        let node_count = positions.len();
        body.forces.write_records(positions, team);
        let forces = &body.forces;
        let view = forces.view(positions);
        let tile_sums = Items::new(&mut self.tile_sums);
        team.pass(tile_count(node_count), tile_sums, |tile, partial| {
            partial.product = forces.energy_of_tile(tile, tile_nodes(tile, node_count), view);
        });
        let tile_energy: f64 = self.tile_sums.iter().map(|partial| partial.product).sum();
        let [stored, work] = body.forces.energy(tile_energy, positions, team);
        EnergyTotals::new(stored, work)
    }
}

/// Mass of the free nodes, kg.
fn total_mass(body: &System) -> f64 {
    let free = body
        .masses
        .iter()
        .zip(&body.inverse_masses)
        .filter(|&(_, &inverse)| inverse > 0.0);
    free.map(|(&mass, _)| f64::from(mass)).sum()
}

/// Mass-weighted mean of vectors along free axes. It is zero if node damping acts.
fn mean_vector(body: &System, vectors: &Vectors) -> DVec3 {
    let held = body.held_axes();
    if held == BVec3::TRUE || body.damping.is_some() {
        return DVec3::ZERO;
    }
    let sums = vectors
        .axes()
        .map(|values| weighted_sum(body, &body.masses, values, 0.0));
    let mean = DVec3::from(sums) / total_mass(body);
    if mean.is_finite() {
        DVec3::select(held, DVec3::ZERO, mean)
    } else {
        DVec3::ZERO
    }
}

/// The kinetic energy of a body that moves with its mean velocity, J.
fn rigid_energy(body: &System, mean: DVec3) -> f64 {
    0.5 * total_mass(body) * mean.length_squared()
}

/// The velocities before the first substep, or now, m/s.
fn newest_velocities(body: &System, is_first: bool) -> &Vectors {
    if is_first {
        body.state.velocities()
    } else {
        body.state.newest().1
    }
}

/// Kinetic energy of the free nodes, J, before the first substep or now, and the mean velocity, m/s. The energy of
/// prescribed axes and of the mean velocity is excluded.
fn kinetic_energy(body: &System, is_first: bool) -> (f64, DVec3) {
    let velocities = newest_velocities(body, is_first);
    let mean = mean_vector(body, velocities);
    let (masses, inverse_masses) = (&body.masses, &body.inverse_masses);
    let prescribed = body.pins.partial().map(|pin| {
        let node = pin.node as usize;
        0.5 * f64::from(masses[node]) * pin.held(velocities.get(node)).as_dvec3().length_squared()
    });
    let moving: f64 = (0..tile_count(masses.len()))
        .map(|tile| {
            let nodes = tile_nodes(tile, masses.len());
            body.kernel.run(Kinetic {
                velocities: velocities.slices(nodes.clone()),
                mean,
                masses: &masses[nodes.clone()],
                inverse_masses: &inverse_masses[nodes],
            })
        })
        .sum();
    (moving - prescribed.sum::<f64>(), mean)
}

struct Kinetic<'a> {
    velocities: [&'a [f32]; 3],
    mean: DVec3,
    masses: &'a [f32],
    inverse_masses: &'a [f32],
}

impl Loops for Kinetic<'_> {
    type Output = f64;

    #[inline(always)]
    fn run(self) -> f64 {
        let mut sums = [0.0; LANES];
        for (velocities, mean) in self.velocities.into_iter().zip(self.mean.to_array()) {
            let nodes = velocities.chunks(LANES).zip(self.masses.chunks(LANES));
            for ((velocities, masses), free) in nodes.zip(self.inverse_masses.chunks(LANES)) {
                for (sum, ((&velocity, &mass), &free)) in sums.iter_mut().zip(velocities.iter().zip(masses).zip(free)) {
                    let mass = if free > 0.0 { f64::from(mass) } else { 0.0 };
                    let velocity = f64::from(velocity) - mean;
                    *sum += mass * velocity * velocity;
                }
            }
        }
        0.5 * sums.into_iter().sum::<f64>()
    }
}
