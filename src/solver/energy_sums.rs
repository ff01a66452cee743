//! The sums over nodes that the energy monitor needs.

use glam::{BVec3, DVec3, Vec3};

use super::System;
use super::closing::Closed;
use super::kick::Inertia;
use super::step_request::Carry;
use super::substep::{Part, VelocityTime};
use crate::codec::saved;
use crate::simd::Loops;
use crate::soa::{TILE, tile_count, tile_nodes};
use crate::threads::{Items, Team};

/// A body whose mean speed is lower is at rest but for rounding, m/s.
const STILL: f64 = 1e-4;

/// So is one whose nodes move by less than this part of its extent in a substep: coordinates are rounded by about as much, and forces with them.
const UNSEEN: f64 = 4.0 * f32::EPSILON as f64;

/// Rounding errors, as parts of the energy and of the kinetic energy of the motion as a whole.
const ROUNDING: [f64; 2] = [1e-6, 1e-4];

/// What the energy monitor compares, J, of a body or of several.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Energies {
    pub all: f64,
    /// Of motion, but that as a whole of bodies that nothing holds.
    pub own: f64,
    /// By how much rounding may be off.
    pub rounding: f64,
    /// What is no more of `own` than this is rest.
    pub still: f64,
}

impl Energies {
    pub fn plus(self, other: &Self) -> Self {
        Self {
            all: self.all + other.all,
            own: self.own + other.own,
            rounding: self.rounding + other.rounding,
            still: self.still + other.still,
        }
    }
}

/// What the nodes of a tile, or of a body, add up to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct TileSums {
    /// Of what is free to move, J.
    kinetic: f64,
    /// Of what is free to move, kg m/s.
    momentum: DVec3,
    /// The sum of `m x` of the mass that gravity pulls at, kg m.
    moment: DVec3,
    mass: f64,
    free_mass: f64,
    /// The kinetic part of the shadow energy: what open velocities give, then what closed ones add to it, J.
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

    /// Those of the newest positions and open velocities, after the kick `last`; the moment is about the origin of the world.
    ///
    /// With `v` the closed velocities, `v⁺` is `2 v - v⁻`, and the kinetic part of the shadow energy is
    /// `Σ m (v·u + v⁻·v⁻ / 12 - v⁻·u / 2)` with `u = v⁻ - v⁻⁻ / 6`. Here `u` goes to where the next positions will be.
    pub fn of_open(body: &mut System, last: &Part, team: &Team) -> Self {
        let (kernel, masses, inverse_masses, pins) = (body.kernel, &body.masses, &body.inverse_masses, &body.pins);
        let weighs_all = body.weight_share().is_some();
        let state = body.state.substep();
        let (positions, before, velocities) = (state.positions, &*state.forces, &*state.velocities);
        let kicks = last.duration / last.substep;
        let count = masses.len();
        let written = (state.next_positions.tiles_mut(), Items::new(&mut body.tile_sums));
        team.pass(tile_count(count), written, |tile, (mut changes, sums)| {
            let nodes = tile_nodes(tile, count);
            *sums = TileSums::default();
            for (axis, changes) in changes.iter_mut().enumerate() {
                kernel.run(OfAxis {
                    axis,
                    kicks,
                    weighs_all,
                    positions: &positions.axes()[axis][nodes.clone()],
                    before: &before.axes()[axis][nodes.clone()],
                    velocities: &velocities.axes()[axis][nodes.clone()],
                    masses: &masses[nodes.clone()],
                    inverse_masses: &inverse_masses[nodes.clone()],
                    shares: changes,
                    sums,
                });
            }
            for pin in pins.of_tile(tile).iter().filter(|pin| pin.is_partial()) {
                let node = pin.node as usize;
                let inverse_mass = f64::from(inverse_masses[node]);
                if inverse_mass > 0.0 {
                    let place = node - nodes.start;
                    let velocity = pin.held(velocities.get(node)).as_dvec3();
                    let share = DVec3::from(changes.each_ref().map(|axis| f64::from(axis[place])));
                    sums.kinetic -= 0.5 * velocity.length_squared() / inverse_mass;
                    sums.momentum -= velocity / inverse_mass;
                    sums.shadow -= (velocity.length_squared() / 12.0 - 0.5 * velocity.dot(share)) / inverse_mass;
                    pin.put(&mut changes, place, Vec3::ZERO);
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

    /// The kinetic and potential energy as a step begins, with velocities at the time of the positions, J; `None` where less than half of it is of
    /// motion.
    pub(super) fn at_start(body: &mut System, part: &Part, carry: &Carry, gravity: Vec3, team: &Team) -> Option<f64> {
        if part.before == VelocityTime::Current {
            let state = body.state.substep();
            state.velocities.copy_from(state.first_velocities);
        }
        let sums = Self::of_open(body, part, team);
        let own = sums.own(body.held_axes())[0];
        if own == 0.0 {
            return None;
        }
        let [_, elastic] = close(body, carry, team);
        (own > elastic.abs()).then(|| sums.kinetic + elastic - sums.moment.dot(gravity.as_dvec3()))
    }

    /// The kinetic energy of its own, and that of the motion as a whole of a body that nothing holds, J.
    fn own(&self, held: BVec3) -> [f64; 2] {
        let common = DVec3::select(held, DVec3::ZERO, self.momentum).length_squared() / (2.0 * self.free_mass);
        [(self.kinetic - common).max(0.0), common]
    }

    /// The energies at the end of a step in substeps of `substep` seconds.
    pub(super) fn close(self, body: &mut System, carry: &Carry, substep: f64, team: &Team) -> Energies {
        let held = body.held_axes();
        let [closing, elastic] = close(body, carry, team);
        // The motion as a whole is left as it is.
        let [own, common] = self.own(held);
        let still = STILL.max(UNSEEN * f64::from(body.extent()) / substep);
        Energies {
            all: self.shadow + closing + elastic - self.moment.dot(carry.energy.gravity().as_dvec3()),
            own,
            rounding: ROUNDING[0] * (own + elastic.abs()) + ROUNDING[1] * common,
            still: 0.5 * self.free_mass * still * still,
        }
    }
}

/// What the nodes of a tile add to its sums along one axis.
struct OfAxis<'a> {
    axis: usize,
    /// Whether gravity pulls at all mass, or at that before some was added.
    weighs_all: bool,
    /// How long the last kick was, in substeps.
    kicks: f32,
    positions: &'a [f32],
    /// The velocities before and after it.
    before: &'a [f32],
    velocities: &'a [f32],
    masses: &'a [f32],
    inverse_masses: &'a [f32],
    shares: &'a mut [f32],
    sums: &'a mut TileSums,
}

/// Sums that are made side by side, so that none waits for itself.
const LANES: usize = 8;

/// The mass of a node as far as it moves freely, kg.
#[inline(always)]
fn free_mass(inverse_mass: f32) -> f64 {
    if inverse_mass > 0.0 {
        f64::from(1.0 / inverse_mass)
    } else {
        0.0
    }
}

impl Loops for OfAxis<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        // Kinetic energy, momentum, moment, mass, free mass, shadow energy.
        let mut lanes = [[0.0_f64; 6]; LANES];
        let count = self.masses.len();
        let part = 1.0 / (6.0 * self.kicks);
        for start in (0..count).step_by(LANES) {
            for (lane, node) in lanes.iter_mut().zip(start..count) {
                let free_mass = free_mass(self.inverse_masses[node]);
                let mass = if self.weighs_all {
                    free_mass
                } else {
                    f64::from(self.masses[node])
                };
                let velocity = self.velocities[node];
                // A kick of another length stands for one of a substep.
                let share = velocity * (5.0 / 6.0) + (velocity - self.before[node]) * part;
                self.shares[node] = share;
                let [velocity, share] = [velocity, share].map(f64::from);
                lane[0] += free_mass * velocity * velocity;
                lane[1] += free_mass * velocity;
                lane[2] += mass * f64::from(self.positions[node]);
                lane[3] += mass;
                lane[4] += free_mass;
                lane[5] += free_mass * velocity * (velocity / 12.0 - 0.5 * share);
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

/// The sum of `m a b` along one axis.
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

/// What closed velocities add to the shadow energy, and the energy of all inner forces at the newest positions, less the work of a
/// constant pressure, J.
fn close(body: &mut System, carry: &Carry, team: &Team) -> [f64; 2] {
    let kernel = body.kernel;
    let (inverse_masses, pins) = (&body.inverse_masses, &body.pins);
    let inertia = Inertia::of(body.uniform_inverse_mass, inverse_masses, body.scaling.as_deref());
    let state = body.state.substep();
    let (positions, velocities, shares) = (state.positions, &*state.velocities, &*state.next_positions);
    body.forces.write_records(positions, team);
    let forces = &body.forces;
    let view = forces.view(positions);
    // Open velocities are closed to the side, so that comparing changes nothing.
    let closed = carry.closing.map(|closing| Closed {
        forces: forces.sum(),
        kernel,
        kick: closing.kick({ carry.gravity }.next(closing.fall()), inertia, body.damping.as_ref()),
        positions,
        velocities,
    });
    let count = positions.len();
    team.pass(tile_count(count), Items::new(&mut body.tile_sums), |tile, sums| {
        let nodes = tile_nodes(tile, count);
        let mut axes = [[0.0_f32; TILE]; 3];
        let velocities = match &closed {
            None => velocities.slices(nodes.clone()),
            Some(closed) => {
                let mut axes = axes.each_mut().map(|axis| &mut axis[..nodes.len()]);
                closed.write(tile, nodes.clone(), &mut axes, pins.of_tile(tile));
                axes.map(|axis| &*axis)
            }
        };
        let products = velocities.into_iter().zip(shares.slices(nodes.clone()));
        sums.shadow = products
            .map(|(velocities, shares)| kernel.run(Product([velocities, shares], &inverse_masses[nodes.clone()])))
            .sum();
        sums.elastic = forces.energy_of_tile(tile, nodes, view);
    });
    let sums = body.tile_sums.iter();
    let [closing, of_tiles] = sums.fold([0.0; 2], |[closing, elastic], sums| {
        [closing + sums.shadow, elastic + sums.elastic]
    });
    let [elastic, work] = body.forces.energy(of_tiles, positions, team);
    [closing, elastic - work]
}
