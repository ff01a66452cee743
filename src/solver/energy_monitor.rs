//! Keeps a body that VERLET moves from gaining energy that nobody put in.
//!
//! Leapfrog conserves the energy of a linear oscillator at any substep below the limit, but not that of a spring that turns by a good
//! part of a radian within a substep, as compressed springs do when their ends pass each other. Such a body gains a little energy each
//! time, and without damping it gains without end. So every 80 substeps or so the energy is compared with a reference: the energy at the
//! first comparison, plus the work of forces, pins and tools since. Excess energy is taken off the velocities. A body that often has
//! some takes shorter substeps.
//!
//! Kinetic plus elastic energy would not do: it oscillates by `(h omega)²/4` in a linear mode that leapfrog follows without a fault. The
//! monitor measures the shadow energy of leapfrog, to order 4 in the substep `h`. Let `v⁻⁻`, `v⁻` and `v⁺` be three successive half-step
//! velocities, and let the positions lie between the last two. Then the shadow energy is
//!
//! `V + Σ m/2 (v⁻·v⁺ + (v⁻·v⁻ - v⁻⁻·v⁺) / 6) = K + V + h² (v·V''·v / 12 - f·f / 24m) + O(h⁴)`.
//!
//! It needs no forces beside those of the closing kick, and it is exactly constant in every linear mode: the mode has `S = V + Σ m/2 v⁻·v⁺`
//! and `(h omega)² S / 6` of it. Where nonlinear forces move energy between slow and fast modes, it is constant up to order 4.
//!
//! The mean of `K + V` is smaller by about `h² f·f / 24m`, so one reference bounds the energy at any substep. (Only the mean of modes whose
//! `h omega` is above 1 is greater, by up to a third at 1.6, and few modes of a body are so fast.)

use glam::{BVec3, DMat3, DVec3, Vec3};

use super::System;
use super::attempt::{Carry, StepRequest};
use super::closing::Closed;
use super::kick::Inertia;
use super::substep::{Part, VelocityTime};
use crate::base::StateHasher;
use crate::codec::saved;
use crate::simd::Loops;
use crate::soa::{TILE, Vectors, tile_count, tile_nodes};
use crate::threads::{Items, Team};

/// Substeps between two comparisons, at least, and how many more there may be: at even intervals, comparisons might meet a mode in its
/// turning points alone. A comparison takes about as long as two substeps.
const PERIOD: [u32; 2] = [66, 25];

/// The number of comparisons after which the kinetic energy is known. Nothing is taken off before.
const LEARNED: u32 = 3;

/// Excess that is tolerated, as a part of the kinetic energy: the shadow energy of nonlinear motion fluctuates.
const BAND: f64 = 5e-4;

/// A body whose mean speed is lower is at rest but for rounding, m/s.
const STILL: f64 = 1e-4;

/// So is one whose nodes move by less than this part of its extent in a substep: coordinates are rounded by about as much, and forces with them.
const UNSEEN: f64 = 4.0 * f32::EPSILON as f64;

/// Rounding errors, as parts of the energy and of the kinetic energy of the motion as a whole.
const ROUNDING: [f64; 2] = [1e-6, 1e-4];

/// The time in which older comparisons lose half their weight, s.
const MEMORY: f64 = 5.0;

/// Substeps are halved when more than this part of the kinetic energy has been taken off of late.
const TOO_MUCH: f64 = 5e-3;

/// Substeps are doubled again when the kinetic energy is less than this part of that with which they were halved. A body that moves as
/// fast as before would gain energy again.
const SLOWER: f64 = 0.5;

/// How many times shorter substeps may be than stability asks for.
const FINEST: u32 = 8;

/// What is known of the energy that a body may have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct EnergyAccount {
    /// The energy that the body had when it was compared last, or might have had, J; `None` after a change from outside.
    reference: Option<f64>,
    /// The work since the last comparison, J.
    work: f64,
    /// The gravity of the last step, m/s².
    gravity: Vec3,
    /// Substeps and seconds since the last comparison.
    substeps: u32,
    time: f64,
    /// How often the energy was compared since a change from outside.
    comparisons: u32,
    /// The most kinetic energy of late, J.
    kinetic: f64,
    /// How much was taken off of late, as a part of that.
    removed: f64,
    /// How many times shorter substeps are than stability asks for.
    refinement: u32,
    /// The most kinetic energy of late when that changed, J.
    refined_at: f64,
}

saved!(EnergyAccount {
    reference,
    work,
    gravity,
    substeps,
    time,
    comparisons,
    kinetic,
    removed,
    refinement,
    refined_at
});

impl EnergyAccount {
    pub const UNKNOWN: Self = Self {
        reference: None,
        work: 0.0,
        gravity: Vec3::ZERO,
        substeps: 0,
        time: 0.0,
        comparisons: 0,
        kinetic: 0.0,
        removed: 0.0,
        refinement: 1,
        refined_at: 0.0,
    };

    /// The energy is not what it was when the last step ended.
    pub fn forget(&mut self) {
        (self.reference, self.comparisons) = (None, 0);
        self.start_over();
    }

    /// So much energy was put in from outside, J; what is not finite is not known.
    pub fn gain(&mut self, energy: f64) {
        self.lose(energy.is_finite().then_some(-energy));
    }

    /// So much energy is gone with mass that was taken away, J, or unknown.
    fn lose(&mut self, energy: Option<f64>) {
        match energy {
            Some(energy) => self.work -= energy,
            None => self.forget(),
        }
    }

    fn start_over(&mut self) {
        (self.work, self.substeps, self.time) = (0.0, 0, 0.0);
    }

    /// Whether a step of so many substeps ends with a comparison.
    fn is_due(&self, substeps: u32) -> bool {
        let [least, more] = PERIOD;
        self.substeps.saturating_add(substeps) >= least + self.comparisons.wrapping_mul(11) % more
    }

    /// How many times as many substeps are to be taken as stability asks for.
    pub fn refinement(&self) -> u32 {
        self.refinement
    }

    /// The excess of the energy, J, given the kinetic energy and the rounding error.
    fn compare(&mut self, energy: f64, kinetic: f64, rounding: f64) -> f64 {
        let fading = 1.0 / (1.0 + self.time / MEMORY);
        self.kinetic = kinetic.max(self.kinetic * fading);
        self.removed *= fading;
        // Lost energy may come back, up to the kinetic energy of late: a body that has come to rest stays so.
        let allowed = self.reference.map_or(energy, |reference| reference + self.work);
        let allowed = allowed.min(energy + self.kinetic);
        self.reference = Some(allowed);
        self.start_over();
        self.comparisons = self.comparisons.saturating_add(1);
        if self.comparisons < LEARNED {
            return 0.0;
        }
        (energy - allowed - BAND * self.kinetic - rounding).max(0.0)
    }

    /// Decides how short substeps are, after so much kinetic energy was taken off, J.
    fn refine(&mut self, removed: f64) {
        if removed > 0.0 {
            self.removed += removed / self.kinetic;
        }
        if self.removed > TOO_MUCH && self.refinement < FINEST {
            self.refinement *= 2;
        } else if self.kinetic < SLOWER * self.refined_at && self.refinement > 1 {
            self.refinement /= 2;
        } else {
            return;
        }
        (self.removed, self.refined_at) = (0.0, self.kinetic);
    }

    pub fn hash(&self, hasher: &mut StateHasher) {
        let reference = self.reference.unwrap_or(f64::NAN);
        let numbers = [
            reference,
            self.work,
            self.time,
            self.kinetic,
            self.removed,
            self.refined_at,
        ];
        numbers
            .into_iter()
            .for_each(|number| hasher.write_u64(number.to_bits()));
        hasher.write_floats(&self.gravity.to_array());
        hasher.write_u64(u64::from(self.substeps) << 32 | u64::from(self.refinement));
        hasher.write_u64(u64::from(self.comparisons));
    }
}

/// The account of one step.
#[derive(Clone, Copy)]
pub(super) struct Account<'a> {
    request: &'a StepRequest<'a>,
    substeps: u32,
    /// Whether the body is watched.
    watches: bool,
    /// Whether the step ends with a comparison.
    pub compares: bool,
}

impl<'a> Account<'a> {
    pub fn new(body: &System, carry: &Carry, request: &'a StepRequest<'a>, substeps: u32) -> Self {
        // What sleeps in part is not alone; fixed substeps are taken as they are.
        let watches = request.substeps == 0 && !body.sleeps();
        Self {
            request,
            substeps,
            watches,
            compares: watches && carry.energy.is_due(substeps),
        }
    }

    /// Keeps the velocities before the last kick, where forces are kept at the end of a step.
    pub fn keep_velocities(&self, body: &mut System, last: &Part) {
        let state = body.state.substep();
        state.forces.copy_from(match last.before {
            VelocityTime::Current | VelocityTime::CurrentOpen => state.first_velocities,
            VelocityTime::Closed | VelocityTime::Open => state.velocities,
        });
    }

    /// Takes the step into account. `sums` are those of the open velocities, if it ends with a comparison.
    pub fn settle(&self, body: &mut System, carry: &mut Carry, sums: Option<TileSums>, team: &Team) {
        let account = &mut carry.energy;
        if !self.watches {
            account.forget();
            return;
        }
        if account.gravity != self.request.gravity {
            account.forget();
            account.gravity = self.request.gravity;
        }
        account.substeps = account.substeps.saturating_add(self.substeps);
        account.time += f64::from(self.request.dt);
        account.work += self.work(body);
        if let Some(sums) = sums {
            self.compare(body, carry, sums, team);
        }
    }

    /// What forces, pins that are led and tools that move put in, J.
    fn work(&self, body: &System) -> f64 {
        let mut work = 0.0;
        let (first, (last, _)) = (body.state.positions(), body.state.newest());
        if let Some(applied) = body.applied.as_ref().filter(|_| body.forces_applied) {
            for node in (0..body.node_count()).filter(|&node| body.inverse_masses[node] > 0.0) {
                let way = last.get(node).as_dvec3() - first.get(node).as_dvec3();
                work += applied.get(node).as_dvec3().dot(way);
            }
        }
        for pin in body.pins.iter() {
            // Tools lead what they hold.
            let way = if body.is_held_by_tool(pin.node) {
                let node = pin.node as usize;
                last.get(node).as_dvec3() - first.get(node).as_dvec3()
            } else {
                pin.travel.as_dvec3()
            };
            if way != DVec3::ZERO {
                let force = pin.force_sum / f64::from(self.substeps);
                work += DVec3::select(pin.axes, force, DVec3::ZERO).dot(way);
            }
        }
        let loads = body.contacts.iter().flat_map(|contacts| contacts.loads());
        let tools = self.request.tools.iter().zip(loads).enumerate();
        for (index, (tool, load)) in tools.filter(|(_, (tool, _))| tool.moves()) {
            let received = body.contacts.as_ref().and_then(|contacts| contacts.received(index));
            if let Some(received) = received {
                work -= received;
                continue;
            }
            // Where tissue meets a tool faster than that goes, the rest is lost.
            let [way, turn] = tool.travel();
            work -= (load.impulse.dot(way) + load.angular_impulse.dot(turn)) / f64::from(self.request.dt);
        }
        work
    }

    /// Takes off the excess energy, and decides how short the next substeps are.
    fn compare(&self, body: &mut System, carry: &mut Carry, open: TileSums, team: &Team) {
        let held = body.held_axes();
        let [closing, elastic] = close(body, carry, team);
        let energy = open.shadow + closing + elastic - open.moment.dot(self.request.gravity.as_dvec3());
        // The motion as a whole of a body that nothing holds is left as it is.
        let common = DVec3::select(held, DVec3::ZERO, open.momentum).length_squared() / (2.0 * open.free_mass);
        let own = (open.kinetic - common).max(0.0);
        let rounding = ROUNDING[0] * (own + elastic.abs()) + ROUNDING[1] * common;
        let account = &mut carry.energy;
        if !(energy.is_finite() && rounding.is_finite()) {
            account.forget();
            return;
        }
        let excess = account.compare(energy, own, rounding);
        let substep = f64::from(self.request.dt) / f64::from(self.substeps);
        let still = STILL.max(UNSEEN * f64::from(body.extent()) / substep);
        let is_still = own <= 0.5 * open.free_mass * still * still;
        let account = &mut carry.energy;
        account.refine(if excess > 0.0 && !is_still {
            slow_down(body, held, excess, false)
        } else {
            0.0
        });
    }
}

/// What the nodes of a tile, or of a body, add up to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct TileSums {
    /// Of what is free to move, J.
    kinetic: f64,
    /// Of what is free to move, kg m/s.
    momentum: DVec3,
    /// The sum of `m x`, kg m.
    moment: DVec3,
    mass: f64,
    free_mass: f64,
    /// The kinetic part of the shadow energy: what open velocities give, then what closed ones add to it, J.
    shadow: f64,
    elastic: f64,
}

saved!(TileSums {
    kinetic,
    momentum,
    moment,
    mass,
    free_mass,
    shadow,
    elastic
});

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
    pub(super) fn of_open(body: &mut System, last: &Part, team: &Team) -> Self {
        let (kernel, masses, inverse_masses, pins) = (body.kernel, &body.masses, &body.inverse_masses, &body.pins);
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
}

/// What the nodes of a tile add to its sums along one axis.
struct OfAxis<'a> {
    axis: usize,
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
                let mass = f64::from(self.masses[node]);
                let free_mass = free_mass(self.inverse_masses[node]);
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

/// Takes this much kinetic energy off the newest velocities, J, or all there is that nothing conserves: how much it was. A body that nothing
/// holds keeps its momentum and its angular momentum: it is its deformation that becomes slower.
/// `at_next`: the nodes are at the next positions.
pub(super) fn slow_down(body: &mut System, held: BVec3, energy: f64, at_next: bool) -> f64 {
    let state = body.state.substep();
    let positions = if at_next {
        &*state.next_positions
    } else {
        state.positions
    };
    let velocities = state.velocities;
    let inverse_masses = &body.inverse_masses;
    let rigid = RigidMotion::of(positions, velocities, inverse_masses, held);
    let mut own = 0.0;
    for node in (0..inverse_masses.len()).filter(|&node| inverse_masses[node] > 0.0) {
        let held = body.pins.partial_axes_of(node as u32);
        let velocity = velocities.get(node).as_dvec3() - rigid.at(positions.get(node));
        own += 0.5 * DVec3::select(held, DVec3::ZERO, velocity).length_squared() / f64::from(inverse_masses[node]);
    }
    if own <= 0.0 {
        return 0.0;
    }
    let factor = (1.0 - energy / own).max(0.0).sqrt();
    for node in (0..inverse_masses.len()).filter(|&node| inverse_masses[node] > 0.0) {
        let held = body.pins.partial_axes_of(node as u32);
        let velocity = velocities.get(node);
        let common = rigid.at(positions.get(node));
        let slower = common + (velocity.as_dvec3() - common) * factor;
        velocities.set(node, Vec3::select(held, velocity, slower.as_vec3()));
    }
    energy.min(own)
}

/// Sees that motion has no more kinetic energy after masses have changed than before, as a step begins with velocities at the time of its
/// positions. The motion as a whole of a body that nothing holds stays as it is.
pub(super) fn keep_energy(body: &mut System, account: &mut EnergyAccount) {
    let state = body.state.substep();
    state.velocities.copy_from(state.first_velocities);
    let held = body.held_axes();
    let state = body.state.substep();
    let rigid = RigidMotion::of(state.positions, state.velocities, &body.inverse_masses, held);
    let mut added = 0.0;
    for sliver in body.scaling.iter().flat_map(|scaling| scaling.slivers()) {
        let node = sliver.node as usize;
        let held = body.pins.partial_axes_of(sliver.node);
        let velocity = state.velocities.get(node).as_dvec3() - rigid.at(state.positions.get(node));
        added += 0.5 * f64::from(sliver.change()) * DVec3::select(held, DVec3::ZERO, velocity).length_squared();
    }
    if added > 0.0 {
        slow_down(body, held, added, false);
    }
    account.lose((held == BVec3::TRUE).then_some((-added).max(0.0)));
}

/// How a body moves as a whole; not at all where something holds it.
struct RigidMotion {
    centre: DVec3,
    velocity: DVec3,
    spin: DVec3,
}

impl RigidMotion {
    fn of(positions: &Vectors, velocities: &Vectors, inverse_masses: &[f32], held: BVec3) -> Self {
        let nodes = || (0..inverse_masses.len()).filter(|&node| inverse_masses[node] > 0.0);
        let mass_of = |node: usize| 1.0 / f64::from(inverse_masses[node]);
        let (mut mass, mut moment, mut momentum) = (0.0, DVec3::ZERO, DVec3::ZERO);
        for node in nodes() {
            mass += mass_of(node);
            moment += mass_of(node) * positions.get(node).as_dvec3();
            momentum += mass_of(node) * velocities.get(node).as_dvec3();
        }
        let centre = moment / mass;
        let velocity = DVec3::select(held, DVec3::ZERO, momentum / mass);
        let mut spin = DVec3::ZERO;
        if held == BVec3::FALSE {
            let (mut inertia, mut angular) = (DMat3::ZERO, DVec3::ZERO);
            for node in nodes() {
                let arm = positions.get(node).as_dvec3() - centre;
                angular += mass_of(node) * arm.cross(velocities.get(node).as_dvec3());
                inertia += (DMat3::from_diagonal(DVec3::splat(arm.length_squared()))
                    - DMat3::from_cols(arm * arm.x, arm * arm.y, arm * arm.z))
                    * mass_of(node);
            }
            // A row of nodes has no inertia about its axis, and does not turn about it.
            let trace = inertia.x_axis.x + inertia.y_axis.y + inertia.z_axis.z;
            spin = (inertia + DMat3::from_diagonal(DVec3::splat(1e-9 * trace))).inverse() * angular;
        }
        let or_none = |vector: DVec3| if vector.is_finite() { vector } else { DVec3::ZERO };
        Self {
            centre: or_none(centre),
            velocity: or_none(velocity),
            spin: or_none(spin),
        }
    }

    fn at(&self, position: Vec3) -> DVec3 {
        self.velocity + self.spin.cross(position.as_dvec3() - self.centre)
    }
}
