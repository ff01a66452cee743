//! What a step does to the energy: an implicit step loses some and gains none, unless its equation was not solved.

use glam::{BVec3, DVec3};

use super::iterations::show_held;
use super::step::Substep;
use super::{End, History, Implicit};
use crate::codec::saved;
use crate::contact::Contacts;
use crate::simd::Loops;
use crate::soa::{TileForces, Vectors, tile_count, tile_nodes};
use crate::solver::System;
use crate::solver::slow_down::slow_down;
use crate::springs::Motion;
use crate::threads::{Items, Team};

/// What rounding may add, as a fraction of the energies involved.
const ROUNDING: f64 = 1e-6;

/// Sums that are made side by side, so that none waits for itself.
const LANES: usize = 16;

/// What was lost may come back, as far as it is no more than this part of the energy there is.
const CREDIT: f64 = 0.1;

/// What steps may have gained in all, as a part of that energy: rounding, and what the formula of order 2 has of its own.
const DEBT: f64 = 2e-4;

/// Equations leave at least this part of the ways that gravity leads nodes.
const SOLVED: f64 = 1e-4;

/// How many times what rounded coordinates store on the mean it may be.
const NOISY: f64 = 8.0;

/// Kinetic and elastic energy. Where nothing holds a body, its motion as a whole is none of it: what falls fast would hide what it gains within.
#[derive(Clone, Copy, Debug)]
pub(super) struct Total {
    /// J; below 0 where a constant pressure has done more work than is stored.
    pub energy: f64,
    /// What rounding is a part of: the same, with that work added, J.
    pub size: f64,
}

saved! { Total { energy, size } }

/// The energy before a step.
#[derive(Clone, Copy, Debug)]
pub(super) struct EnergyBefore {
    /// The pins are already where the step leads them.
    total: Total,
    /// What was lost and may come back, or below 0 what was gained and is to be lost again, J.
    credit: f64,
}

impl Total {
    /// What is stored, and the work that a constant pressure has done, J.
    fn of(stored: f64, work: f64) -> Self {
        Self {
            energy: stored - work,
            size: stored + work.abs(),
        }
    }

    /// With so much more, J, above 0 where `size` is to grow.
    fn plus(self, more: f64) -> Self {
        Self {
            energy: self.energy + more,
            size: self.size + more,
        }
    }
}

impl Substep<'_> {
    /// The energy before the step.
    pub(super) fn energy_before(&self, body: &mut System, implicit: &mut Implicit) -> EnergyBefore {
        let history = implicit.solution.last(self.is_first);
        let credit = history.credit;
        let travels = body.pins.iter().any(|pin| pin.travel != glam::Vec3::ZERO);
        if let Some(total) = history.energy
            && !travels
        {
            return EnergyBefore { total, credit };
        }
        let (kinetic, _) = kinetic(body, self.is_first);
        let from = implicit.solution.place(self.is_first);
        let mut total = implicit.elastic(body, false, from, self.team);
        if travels {
            // With what viscous arms take up on that way.
            body.forces.foresee(self.step);
            let state = body.state.substep();
            state.next_positions.copy_from(state.positions);
            for pin in body.pins.iter() {
                pin.put_among(state.next_positions, pin.place(self.end));
            }
            let there = implicit.elastic(body, true, from, self.team);
            total = Total {
                energy: total.energy.max(there.energy),
                size: total.size.max(there.size),
            };
        }
        EnergyBefore {
            total: total.plus(kinetic),
            credit,
        }
    }

    /// Compares the energy after the step with what there was and what was put in.
    pub(super) fn account(&self, body: &mut System, implicit: &mut Implicit, before: EnergyBefore) -> End {
        let (kinetic, velocity) = kinetic(body, false);
        let elastic = implicit.elastic(body, true, 1 - implicit.solution.settled, self.team);
        let (work, way) = self.work(body, implicit.solution.next());
        let after = elastic.plus(kinetic);
        let has = before.total.energy + work;
        let mass = total_mass(body);
        let fall = way.dot(self.request.gravity.as_dvec3());
        let has = has + SOLVED * SOLVED * mass * fall.abs();
        // Rounding of velocities, a part of what they are in all, and of coordinates.
        let reach = body.local_bounds().magnitudes().max_element();
        let speed = velocity.length() * f64::from(f32::EPSILON) + f64::EPSILON * f64::from(reach) / self.step;
        let noise = mass * speed * speed + NOISY * implicit.noise(reach).energy;
        let size = after.size + work.abs();
        let rounding = ROUNDING * (before.total.size + size) + noise + 2.0 * (noise * size).sqrt();
        if !(after.energy.is_finite() && after.size.is_finite() && work.is_finite()) {
            return End::NotFinite;
        }
        let is_rounding = after.energy <= has + rounding && !self.may_be_of_order_1(implicit);
        // Attached bodies are never of order 2.
        let most_credit = if implicit.solution.is_attached { 0.0 } else { CREDIT };
        let history = implicit.solution.next_mut();
        history.energy = Some(after);
        history.credit = (has + before.credit - after.energy).min(most_credit * size);
        if history.credit >= -(DEBT * size + rounding) || is_rounding {
            End::Fine
        } else {
            End::Gained
        }
    }

    /// Takes off what was gained: first of the velocities within the body, then of all; where that is not enough, nothing moves but the pins.
    pub(super) fn slow_down(&self, body: &mut System, implicit: &mut Implicit, before: EnergyBefore) {
        let known = implicit.solution.next().energy;
        let (work, _) = self.work(body, implicit.solution.next());
        let excess = known.map(|total| total.energy - before.total.energy - work);
        let taken = excess
            .filter(|excess| excess.is_finite())
            .map(|excess| slow_down(body, excess, true));
        let (kinetic, mean) = kinetic(body, false);
        let state = body.state.substep();
        let history = implicit.solution.next_mut();
        if let (Some(total), Some(excess), Some(taken)) = (known, excess, taken)
            && excess - taken <= kinetic
        {
            let left = (excess - taken).max(0.0);
            if left > 0.0 {
                let factor = (1.0 - left / kinetic).sqrt();
                let mean = mean.as_vec3().to_array();
                for (axis, mean) in state.velocities.axes_mut().into_iter().zip(mean) {
                    axis.iter_mut()
                        .for_each(|value| *value = mean + (*value - mean) * factor as f32);
                }
            }
            history.energy = Some(total.plus(-taken - left));
        } else {
            state.next_positions.copy_from(state.positions);
            for pin in body.pins.iter() {
                pin.put_among(state.next_positions, pin.place(self.end));
            }
            if self.stands {
                let [mut missed, mut all] = [0.0; 2];
                for (node, &mass) in body
                    .masses
                    .iter()
                    .enumerate()
                    .filter(|(node, _)| body.inverse_masses[*node] > 0.0)
                {
                    missed += f64::from(mass) * history.ways.get(node).as_dvec3().length_squared();
                    all += f64::from(mass);
                }
                implicit.report.error = implicit.report.error.max((missed / all).sqrt() as f32);
            }
            state.velocities.clear();
            history.ways.clear();
            history.energy = None;
            self.hold(body);
            if let Some(contacts) = body.contacts.as_mut().filter(|_| self.stands) {
                contacts.forget_holds();
            }
        }
        let history = implicit.solution.next_mut();
        history.gains.clear();
        history.remainders.clear();
        history.step = 0.0;
        history.credit = 0.0;
        implicit.report.has_converged = false;
    }

    /// Finds out what holds the pins where nothing moves.
    fn hold(&self, body: &mut System) {
        if let Some(velocities) = &mut body.predicted_velocities {
            velocities.clear();
        }
        let positions = &*body.state.substep().next_positions;
        body.forces.write_records(positions, self.team);
        body.forces.find(positions, self.team);
        let forces = body.forces.sum();
        let motion = Motion {
            positions: body.forces.view(positions),
            ..Motion::at(positions, body.predicted_velocities.as_ref())
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
                show_held(pins, &sums, gravity, masses);
            });
    }

    /// What gravity, forces from outside, tools and other tissue did on these ways, J, but for the way of the body as a whole, which is told too, m.
    fn work(&self, body: &System, history: &History) -> (f64, DVec3) {
        let ways = &history.ways;
        let mean = mean(body, ways);
        let pressed = history.pressing();
        let applied = body.applied.as_ref().filter(|_| body.forces_applied);
        let held = |contacts: &Contacts| contacts.holds.work(|node| ways.get(node) - mean.as_vec3());
        let mut work = body.contacts.as_deref().map_or(0.0, held);
        for (axis, ways) in ways.axes().into_iter().enumerate() {
            let gravity = f64::from(self.request.gravity[axis]);
            if gravity != 0.0 {
                work += gravity * weighted(body, &body.masses, ways, mean[axis]);
            }
            for applied in applied.into_iter().chain(pressed) {
                work += weighted(body, applied.axes()[axis], ways, mean[axis]);
            }
        }
        // The way that a node is led is none of theirs.
        for pin in body.pins.partial() {
            let (mass, way) = (f64::from(body.masses[pin.node as usize]), ways.get(pin.node as usize));
            work -= mass * pin.held(way).as_dvec3().dot(self.request.gravity.as_dvec3());
        }
        (work, mean)
    }
}

/// The sum of products over the nodes that are free to move, with `about` taken off each value.
fn weighted(body: &System, weights: &[f32], values: &[f32], about: f64) -> f64 {
    body.kernel.run(Weighted {
        weights,
        values,
        about,
        free: &body.inverse_masses,
    })
}

struct Weighted<'a> {
    weights: &'a [f32],
    values: &'a [f32],
    about: f64,
    free: &'a [f32],
}

impl Loops for Weighted<'_> {
    type Output = f64;

    #[inline(always)]
    fn run(self) -> f64 {
        let mut lanes = [0.0; LANES];
        let chunks = self
            .weights
            .chunks(LANES)
            .zip(self.values.chunks(LANES))
            .zip(self.free.chunks(LANES));
        for ((weights, values), free) in chunks {
            for (lane, ((&weight, &value), &free)) in lanes.iter_mut().zip(weights.iter().zip(values).zip(free)) {
                let weight = if free > 0.0 { f64::from(weight) } else { 0.0 };
                *lane += weight * (f64::from(value) - self.about);
            }
        }
        lanes.into_iter().sum()
    }
}

impl Implicit {
    /// The energy of what is inside a body with nodes where the substep began, or where they are next; they lack the remainders of this place
    /// where there are some, J.
    fn elastic(&mut self, body: &mut System, is_next: bool, place: usize, team: &Team) -> Total {
        let state = body.state.substep();
        let positions = if is_next {
            &*state.next_positions
        } else {
            state.positions
        };
        if let Some(newton) = &mut self.newton {
            let [stored, work] = newton.elastic(&body.forces, positions, place);
            return Total::of(stored, work);
        }
        let node_count = positions.len();
        body.forces.write_records(positions, team);
        let forces = &body.forces;
        let view = forces.view(positions);
        let partials = Items::new(&mut self.partials);
        team.pass(tile_count(node_count), partials, |tile, partial| {
            partial.first = forces.energy_of_tile(tile, tile_nodes(tile, node_count), view);
        });
        let of_tiles: f64 = self.partials.iter().map(|partial| partial.first).sum();
        let [stored, work] = body.forces.energy(of_tiles, positions, team);
        Total::of(stored, work)
    }
}

/// The mass of what is free to move, kg.
fn total_mass(body: &System) -> f64 {
    let free = body
        .masses
        .iter()
        .zip(&body.inverse_masses)
        .filter(|&(_, &inverse)| inverse > 0.0);
    free.map(|(&mass, _)| f64::from(mass)).sum()
}

/// The mean of vectors over the mass of a body, along axes along which nothing holds it; none where damping of its nodes does.
fn mean(body: &System, vectors: &Vectors) -> DVec3 {
    let held = body.held_axes();
    if held == BVec3::TRUE || body.damping.is_some() {
        return DVec3::ZERO;
    }
    let sums = vectors.axes().map(|values| weighted(body, &body.masses, values, 0.0));
    let mean = DVec3::from(sums) / total_mass(body);
    if mean.is_finite() {
        DVec3::select(held, DVec3::ZERO, mean)
    } else {
        DVec3::ZERO
    }
}

/// The kinetic energy of what is free to move, J, before the first substep or now: not of what is led, though it be along some axes alone, nor
/// that of the motion as a whole, whose velocity is told too, m/s.
fn kinetic(body: &System, is_first: bool) -> (f64, DVec3) {
    let velocities = if is_first {
        body.state.velocities()
    } else {
        body.state.newest().1
    };
    let mean = mean(body, velocities);
    let (masses, inverse_masses) = (&body.masses, &body.inverse_masses);
    let led = body.pins.partial().map(|pin| {
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
    (moving - led.sum::<f64>(), mean)
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
        let mut lanes = [0.0; LANES];
        for (velocities, mean) in self.velocities.into_iter().zip(self.mean.to_array()) {
            let nodes = velocities.chunks(LANES).zip(self.masses.chunks(LANES));
            for ((velocities, masses), free) in nodes.zip(self.inverse_masses.chunks(LANES)) {
                for (lane, ((&velocity, &mass), &free)) in lanes.iter_mut().zip(velocities.iter().zip(masses).zip(free))
                {
                    let mass = if free > 0.0 { f64::from(mass) } else { 0.0 };
                    let velocity = f64::from(velocity) - mean;
                    *lane += mass * velocity * velocity;
                }
            }
        }
        0.5 * lanes.into_iter().sum::<f64>()
    }
}
