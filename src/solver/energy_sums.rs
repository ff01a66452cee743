//! Sums over nodes for the energy monitor.

use glam::{BVec3, DVec3, Vec3};

use super::System;
use super::deferred_half_kick::HalfKickFlush;
use super::kick::Inertia;
use super::step_request::IntegratorState;
use super::substep::{SubstepKick, VelocityTime};
use crate::codec::saved;
use crate::simd::Loops;
use crate::soa::{TILE, tile_count, tile_nodes};
use crate::threads::{Items, Team};

/// A body with a lower mean speed is at rest up to rounding, m/s.
const REST_SPEED: f64 = 1e-4;

/// A body whose nodes move by less than this fraction of its extent per substep is at rest too. Rounding of
/// coordinates, and of the forces, is about as large.
const REST_DISPLACEMENT: f64 = 4.0 * f32::EPSILON as f64;

/// Rounding errors, as fractions of the total energy and of the kinetic energy of rigid motion.
const ROUNDING: [f64; 2] = [1e-6, 1e-4];

/// The energies that the monitor compares, of one body or several, J.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Energies {
    pub all: f64,
    /// Kinetic energy, without the rigid motion of unconstrained bodies.
    pub internal_kinetic: f64,
    /// The bound of the rounding error.
    pub rounding: f64,
    /// The body is at rest if `internal_kinetic` does not exceed this.
    pub rest_energy: f64,
}

impl Energies {
    pub fn plus(self, other: &Self) -> Self {
        Self {
            all: self.all + other.all,
            internal_kinetic: self.internal_kinetic + other.internal_kinetic,
            rounding: self.rounding + other.rounding,
            rest_energy: self.rest_energy + other.rest_energy,
        }
    }
}

/// Sums over the nodes of a tile or a body.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct TileSums {
    /// Kinetic energy of free nodes, J.
    kinetic: f64,
    /// Momentum of free nodes, kg m/s.
    momentum: DVec3,
    /// Sum of `m x` over the mass that gravity acts on, kg m.
    moment: DVec3,
    mass: f64,
    free_mass: f64,
    /// Kinetic part of the shadow energy. It contains first the part of the velocities before the closing half kick,
    /// then the part of those after it, J.
    shadow: f64,
    elastic: f64,
}

saved! { TileSums { kinetic, momentum, moment, mass, free_mass, shadow, elastic } }

impl TileSums {
    fn plus(self, other: &Self) -> Self {
        Self {
            kinetic: self.kinetic + other.kinetic,
            momentum: self.momentum + other.momentum,
            moment: self.moment + other.moment,
            mass: self.mass + other.mass,
            free_mass: self.free_mass + other.free_mass,
            shadow: self.shadow + other.shadow,
            elastic: self.elastic + other.elastic,
        }
    }

    /// Sums for the newest positions and the velocities after the kick `last`, before the closing half kick. The moment
    /// is about the world origin.
    ///
    /// With `v` the velocities after the closing half kick, `v⁺` is `2 v - v⁻`. The kinetic part of the shadow energy
    /// is `Σ m (v·u + v⁻·v⁻ / 12 - v⁻·u / 2)` with `u = v⁻ - v⁻⁻ / 6`. The buffer of the next positions stores `u`.
    pub fn before_flush(body: &mut System, last: &SubstepKick, team: &Team) -> Self {
        let (kernel, masses, inverse_masses, pins) = (body.kernel, &body.masses, &body.inverse_masses, &body.pins);
        let weighs_all = body.weight_share().is_some();
        let state = body.state.substep();
        let (positions, before, velocities) = (state.positions, &*state.forces, &*state.velocities);
        let kick_substeps = last.duration / last.substep;
        let count = masses.len();
        let written = (state.next_positions.tiles_mut(), Items::new(&mut body.tile_sums));
        team.pass(tile_count(count), written, |tile, (mut buffer, sums)| {
            let nodes = tile_nodes(tile, count);
            *sums = TileSums::default();
            for (axis, buffer) in buffer.iter_mut().enumerate() {
                kernel.run(AxisSums {
                    axis,
                    kick_substeps,
                    weighs_all,
                    positions: &positions.axes()[axis][nodes.clone()],
                    previous_velocities: &before.axes()[axis][nodes.clone()],
                    velocities: &velocities.axes()[axis][nodes.clone()],
                    masses: &masses[nodes.clone()],
                    inverse_masses: &inverse_masses[nodes.clone()],
                    shadow_terms: buffer,
                    sums,
                });
            }
            for pin in pins.of_tile(tile).iter().filter(|pin| pin.is_partial()) {
                let node = pin.node as usize;
                let inverse_mass = f64::from(inverse_masses[node]);
                if inverse_mass > 0.0 {
                    let index = node - nodes.start;
                    let velocity = pin.held(velocities.get(node)).as_dvec3();
                    let shadow_term = DVec3::from(buffer.each_ref().map(|axis| f64::from(axis[index])));
                    sums.kinetic -= 0.5 * velocity.length_squared() / inverse_mass;
                    sums.momentum -= velocity / inverse_mass;
                    sums.shadow -= (velocity.length_squared() / 12.0 - 0.5 * velocity.dot(shadow_term)) / inverse_mass;
                    pin.write_held(&mut buffer, index, Vec3::ZERO);
                }
            }
        });
        let mut sums = body
            .tile_sums
            .iter()
            .fold(TileSums::default(), |sums, tile| sums.plus(tile));
        sums.moment += sums.mass * body.origin;
        sums
    }

    /// The kinetic plus potential energy at the beginning of a step, with velocities at the time of the positions, J.
    /// `None` if less than half of it is kinetic.
    pub(super) fn at_start(
        body: &mut System,
        substep_kick: &SubstepKick,
        carry: &IntegratorState,
        gravity: Vec3,
        team: &Team,
    ) -> Option<f64> {
        if substep_kick.velocity_time == VelocityTime::Current {
            let state = body.state.substep();
            state.velocities.copy_from(state.first_velocities);
        }
        let sums = Self::before_flush(body, substep_kick, team);
        let internal_kinetic = sums.kinetic_parts(body.held_axes())[0];
        if internal_kinetic == 0.0 {
            return None;
        }
        let [_, elastic] = flush_contribution(body, carry, team);
        (internal_kinetic > elastic.abs()).then(|| sums.kinetic + elastic - sums.moment.dot(gravity.as_dvec3()))
    }

    /// The kinetic energy without rigid motion, and the kinetic energy of the rigid translation of an unconstrained
    /// body, J.
    fn kinetic_parts(&self, constrained: BVec3) -> [f64; 2] {
        let translation =
            DVec3::select(constrained, DVec3::ZERO, self.momentum).length_squared() / (2.0 * self.free_mass);
        [(self.kinetic - translation).max(0.0), translation]
    }

    /// The energies at the end of a step with substeps of `substep` seconds.
    pub(super) fn after_flush(self, body: &mut System, carry: &IntegratorState, substep: f64, team: &Team) -> Energies {
        let constrained = body.held_axes();
        let [flushed, elastic] = flush_contribution(body, carry, team);
        // Rigid motion is not changed.
        let [internal_kinetic, translation] = self.kinetic_parts(constrained);
        let rest_energy = REST_SPEED.max(REST_DISPLACEMENT * f64::from(body.extent()) / substep);
        Energies {
            all: self.shadow + flushed + elastic - self.moment.dot(carry.energy.gravity().as_dvec3()),
            internal_kinetic,
            rounding: ROUNDING[0] * (internal_kinetic + elastic.abs()) + ROUNDING[1] * translation,
            rest_energy: 0.5 * self.free_mass * rest_energy * rest_energy,
        }
    }
}

/// Adds the nodes of a tile to its sums along one axis.
struct AxisSums<'a> {
    axis: usize,
    /// True if gravity acts on all mass, false if it acts on the unscaled mass.
    weighs_all: bool,
    /// The duration of the last kick in substeps.
    kick_substeps: f32,
    positions: &'a [f32],
    /// The velocities before and after the last kick.
    previous_velocities: &'a [f32],
    velocities: &'a [f32],
    masses: &'a [f32],
    inverse_masses: &'a [f32],
    shadow_terms: &'a mut [f32],
    sums: &'a mut TileSums,
}

/// The number of independent accumulators, which hides the latency of additions.
const LANES: usize = 8;

/// The mass of a node; 0 if it is pinned, kg.
#[inline(always)]
fn free_mass(inverse_mass: f32) -> f64 {
    if inverse_mass > 0.0 {
        f64::from(1.0 / inverse_mass)
    } else {
        0.0
    }
}

impl Loops for AxisSums<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        // Kinetic energy, momentum, moment, mass, free mass, shadow energy.
        let mut lanes = [[0.0_f64; 6]; LANES];
        let count = self.masses.len();
        let inverse_kicks = 1.0 / (6.0 * self.kick_substeps);
        for start in (0..count).step_by(LANES) {
            for (lane, node) in lanes.iter_mut().zip(start..count) {
                let free_mass = free_mass(self.inverse_masses[node]);
                let mass = if self.weighs_all {
                    free_mass
                } else {
                    f64::from(self.masses[node])
                };
                let velocity = self.velocities[node];
                // The difference is scaled to a kick of one substep.
                let shadow_term = velocity * (5.0 / 6.0) + (velocity - self.previous_velocities[node]) * inverse_kicks;
                self.shadow_terms[node] = shadow_term;
                let [velocity, shadow_term] = [velocity, shadow_term].map(f64::from);
                lane[0] += free_mass * velocity * velocity;
                lane[1] += free_mass * velocity;
                lane[2] += mass * f64::from(self.positions[node]);
                lane[3] += mass;
                lane[4] += free_mass;
                lane[5] += free_mass * velocity * (velocity / 12.0 - 0.5 * shadow_term);
            }
        }
        let [kinetic, momentum, moment, mass, free_mass, shadow] =
            [0, 1, 2, 3, 4, 5].map(|sum| lanes.iter().map(|lane| lane[sum]).sum::<f64>());
        self.sums.kinetic += 0.5 * kinetic;
        self.sums.momentum[self.axis] += momentum;
        self.sums.moment[self.axis] += moment;
        self.sums.shadow += shadow;
        if self.axis == 0 {
            self.sums.mass = mass;
            self.sums.free_mass = free_mass;
        }
    }
}

/// Computes the sum of `m a b` along one axis.
struct Product<'a>([&'a [f32]; 2], &'a [f32]);

impl Loops for Product<'_> {
    type Output = f64;

    #[inline(always)]
    fn run(self) -> f64 {
        let Self([a, b], inverse_masses) = self;
        let mut lanes = [0.0_f64; LANES];
        for start in (0..a.len()).step_by(LANES) {
            for (lane, node) in lanes.iter_mut().zip(start..a.len()) {
                *lane += free_mass(inverse_masses[node]) * f64::from(a[node]) * f64::from(b[node]);
            }
        }
        lanes.iter().sum()
    }
}

/// Returns two energies, J: the part of the shadow energy that depends on velocities after the closing half kick, and
/// the potential energy of internal forces at the newest positions. The work of a constant pressure is subtracted from
/// the second one.
fn flush_contribution(body: &mut System, carry: &IntegratorState, team: &Team) -> [f64; 2] {
    let kernel = body.kernel;
    let (inverse_masses, pins) = (&body.inverse_masses, &body.pins);
    let inertia = Inertia::of(body.uniform_inverse_mass, inverse_masses, body.scaling.as_deref());
    let state = body.state.substep();
    let (positions, velocities, shadow_terms) = (state.positions, &*state.velocities, &*state.next_positions);
    body.forces.write_records(positions, team);
    let forces = &body.forces;
    let view = forces.view(positions);
    // The half kick goes to a separate buffer, so that a comparison does not change the state.
    let flush = carry.deferred_kick.map(|deferred| HalfKickFlush {
        forces: forces.sum(),
        kernel,
        kick: deferred.kick(
            { carry.gravity }.next(deferred.gravity_change()),
            inertia,
            body.damping.as_ref(),
        ),
        positions,
        velocities,
    });
    let count = positions.len();
    team.pass(tile_count(count), Items::new(&mut body.tile_sums), |tile, sums| {
        let nodes = tile_nodes(tile, count);
        let mut axes = [[0.0_f32; TILE]; 3];
        let velocities = match &flush {
            None => velocities.slices(nodes.clone()),
            Some(flush) => {
                let mut axes = axes.each_mut().map(|axis| &mut axis[..nodes.len()]);
                flush.write(tile, nodes.clone(), &mut axes, pins.of_tile(tile));
                axes.map(|axis| &*axis)
            }
        };
        let products = velocities.into_iter().zip(shadow_terms.slices(nodes.clone()));
        sums.shadow = products
            .map(|(velocities, shadow_terms)| {
                kernel.run(Product([velocities, shadow_terms], &inverse_masses[nodes.clone()]))
            })
            .sum();
        sums.elastic = forces.energy_of_tile(tile, nodes, view);
    });
    let sums = body.tile_sums.iter();
    let [flushed, tile_elastic] = sums.fold([0.0; 2], |[flushed, elastic], sums| {
        [flushed + sums.shadow, elastic + sums.elastic]
    });
    let [elastic, work] = body.forces.energy(tile_elastic, positions, team);
    [flushed, elastic - work]
}
