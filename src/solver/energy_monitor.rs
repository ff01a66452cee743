//! Keeps a body that VERLET moves from gaining energy that nobody put in.
//!
//! Leapfrog conserves the energy of a linear oscillator at any substep below the limit, but not that of a spring which turns by a
//! good part of a radian within a substep, as compressed springs do when their ends pass each other. Such a body gains a little
//! energy each time, and without damping it gains without end. So every [`PERIOD`] substeps the energy is compared with what there
//! was and what gravity, forces, pins and tools have put in since. What is too much is taken off the velocities, and while much has
//! to be taken off, substeps are shorter.
//!
//! Where motion is nonlinear, energy as it is measured swings to and fro about what leapfrog conserves. So a mean over many comparisons
//! decides, and what stands out from the usual at once. A body that conserves its energy is not touched.

use glam::{BVec3, DMat3, DVec3, Vec3};

use super::attempt::{Carry, StepRequest};
use super::closing::Closed;
use crate::body::{Body, Inertia, Vectors};
use crate::contact::Contacts;
use crate::diagnostics::StateHasher;
use crate::snapshot::saved;
use crate::solver::write_records;
use crate::springs::{Loops, TILE, tile_count, tile_nodes};
use crate::threads::{Items, Team};

/// The energy is compared after so many substeps at least: it takes about as long as two of them.
const PERIOD: u32 = 64;

/// So much more energy than there was is borne, as a part of the most kinetic energy of late. What leapfrog makes of the energy of a linear
/// oscillator swings by as much where the substep is 0.8 of the limit; compared at even intervals it may seem to grow for long.
const BAND: f64 = 1.0;

/// The energy is a mean over so many comparisons. It swings by a percent where springs are stretched by a tenth with the longest stable
/// substep.
const SAMPLES: f64 = 32.0;

/// After so many comparisons it is known what is usual, and nothing is taken off before.
const LEARNED: f64 = 8.0;

/// What is so many standard deviations more than usual is taken off at once.
const UNUSUAL: f64 = 8.0;

/// A body that is slower than this in the mean is at rest but for rounding, and nothing is taken off, m/s.
const STILL: f64 = 1e-4;

/// What was lost may come back, as far as it is no more than this part of the kinetic energy.
const CREDIT: f64 = 0.1;

/// What rounding may add, as a part of the energy, and of the energy of motion that is common to all of a body.
const ROUNDING: [f64; 2] = [1e-6, 1e-4];

/// The kinetic energy of late is that of about so many seconds.
const MEMORY: f64 = 5.0;

/// Substeps are halved where more than this part of the kinetic energy had to be taken off in about [`TRIAL`] seconds.
const TOO_MUCH: f64 = 5e-3;

/// They are doubled again where it is less than this.
const LITTLE: f64 = 5e-4;

/// Seconds; how long substeps are tried.
const TRIAL: f64 = 10.0;

/// Substeps are at most so many times shorter than stability asks for.
const FINEST: u32 = 4;

/// What is known of the energy that a body may have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct EnergyAccount {
    /// The energy when it was compared last, its mean of late, and what that may be, J; `None`: not known since something changed it.
    known: Option<[f64; 3]>,
    /// What was put in since it was compared, J.
    work: f64,
    /// The gravity with which it was compared, m/s².
    gravity: Vec3,
    /// Substeps since, and seconds.
    substeps: u32,
    time: f64,
    /// How often it was compared, up to as often as matters.
    comparisons: f64,
    /// Half the mean square of its changes, J².
    variance: f64,
    /// The most kinetic energy of late, J.
    kinetic: f64,
    /// How much was taken off of late, as a part of that.
    removed: f64,
    /// How many times shorter substeps are than stability asks for.
    refinement: u32,
}

saved!(EnergyAccount {
    known,
    work,
    gravity,
    substeps,
    time,
    comparisons,
    variance,
    kinetic,
    removed,
    refinement
});

impl EnergyAccount {
    pub const UNKNOWN: Self = Self {
        known: None,
        work: 0.0,
        gravity: Vec3::ZERO,
        substeps: 0,
        time: 0.0,
        comparisons: 0.0,
        variance: 0.0,
        kinetic: 0.0,
        removed: 0.0,
        refinement: 1,
    };

    /// The energy is not what it was when the last step ended.
    pub fn forget(&mut self) {
        self.known = None;
        self.start_over();
    }

    /// Nothing was put in yet since now.
    fn start_over(&mut self) {
        (self.work, self.substeps, self.time) = (0.0, 0, 0.0);
    }

    /// Whether a step of so many substeps ends with a comparison.
    pub fn is_due(&self, substeps: u32) -> bool {
        self.substeps.saturating_add(substeps) >= PERIOD
    }

    /// How many times as many substeps are to be taken as stability asks for.
    pub fn refinement(&self) -> u32 {
        self.refinement
    }

    /// Takes in what the energy is, J, of which the motion is that much and may lack `rounding`: by how much it is more than it may be,
    /// in what stands out and in the mean.
    fn compare(&mut self, energy: f64, kinetic: f64, rounding: f64) -> [f64; 2] {
        self.kinetic = kinetic.max(self.kinetic / (1.0 + self.time / MEMORY));
        self.removed /= 1.0 + self.time / TRIAL;
        let Some(known) = self.known else {
            (self.known, self.comparisons) = (Some([energy; 3]), 1.0);
            return [0.0; 2];
        };
        let [last, mean, most] = known.map(|energy| energy + self.work);
        let usual = BAND * self.kinetic + rounding + UNUSUAL * self.variance.sqrt();
        let is_learned = self.comparisons >= LEARNED;
        let at_once = if is_learned {
            (energy - most - usual).max(0.0)
        } else {
            0.0
        };
        let expected = energy - at_once;
        self.comparisons = (self.comparisons + 1.0).min(SAMPLES);
        self.variance += (0.5 * (expected - last).powi(2) - self.variance) / self.comparisons;
        let mean = mean + (expected - mean) / self.comparisons;
        let most = if is_learned {
            most.min(mean + CREDIT * self.kinetic)
        } else {
            mean
        };
        self.known = Some([energy, mean, most]);
        [at_once, (mean - (most + BAND * self.kinetic + rounding)).max(0.0)]
    }

    /// So much kinetic energy was taken off, J, `at_once` of it before it counts in the mean.
    fn remove(&mut self, removed: f64, at_once: f64) {
        if let Some([last, mean, _]) = &mut self.known {
            *last -= removed;
            *mean -= (removed - at_once).max(0.0);
        }
        self.removed += removed / self.kinetic;
    }

    /// Decides how short substeps are.
    fn refine(&mut self) {
        if self.removed > TOO_MUCH && self.refinement < FINEST {
            self.refinement *= 2;
            self.removed = 0.5 * TOO_MUCH;
        } else if self.removed < LITTLE && self.refinement > 1 {
            self.refinement /= 2;
        }
    }

    pub fn hash(&self, hasher: &mut StateHasher) {
        let [last, mean, least] = self.known.unwrap_or([f64::NAN; 3]);
        let numbers = [
            last,
            mean,
            least,
            self.work,
            self.time,
            self.comparisons,
            self.variance,
            self.kinetic,
            self.removed,
        ];
        numbers
            .into_iter()
            .for_each(|number| hasher.write_u64(number.to_bits()));
        hasher.write_floats(&self.gravity.to_array());
        hasher.write_u64(u64::from(self.substeps) << 32 | u64::from(self.refinement));
    }
}

/// A step that has just been taken, of so many substeps.
#[derive(Clone, Copy)]
pub(super) struct Account<'a> {
    pub request: &'a StepRequest<'a>,
    pub substeps: u32,
    /// Whether its energy is to be compared.
    pub compares: bool,
}

impl Account<'_> {
    /// Takes the step into account.
    pub fn settle(&self, body: &mut Body, carry: &mut Carry, team: &Team) {
        let account = &mut carry.energy;
        // What is held by a tool, or sleeps in part, is not alone; fixed substeps are taken as they are.
        if body.is_grasped() || body.sleeps() || self.request.substeps > 0 {
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
        if self.compares {
            self.compare(body, carry, team);
        }
    }

    /// What forces, pins that are led and tools that move put in, J.
    fn work(&self, body: &Body) -> f64 {
        let mut work = 0.0;
        let (first, (last, _)) = (body.state.positions(), body.state.newest());
        if let Some(applied) = body.applied.as_ref().filter(|_| body.forces_applied) {
            for node in (0..body.node_count()).filter(|&node| body.inverse_masses[node] > 0.0) {
                let way = last.get(node).as_dvec3() - first.get(node).as_dvec3();
                work += applied.get(node).as_dvec3().dot(way);
            }
        }
        for pin in body.pins.iter().filter(|pin| pin.travel != Vec3::ZERO) {
            let force = pin.force_sum / f64::from(self.substeps);
            work += DVec3::select(pin.axes, force, DVec3::ZERO).dot(pin.travel.as_dvec3());
        }
        let loads = body.contacts.iter().flat_map(Contacts::loads);
        for (tool, load) in self.request.tools.iter().zip(loads).filter(|(tool, _)| tool.moves()) {
            // Where tissue meets a tool faster than that goes, the rest is lost.
            let [way, turn] = tool.travel();
            work -= (load.impulse.dot(way) + load.angular_impulse.dot(turn)) / f64::from(self.request.dt);
        }
        work
    }

    /// Takes off what there is too much of, and decides how short the next substeps are.
    fn compare(&self, body: &mut Body, carry: &mut Carry, team: &Team) {
        let sums = sums(body, carry, team);
        let account = &mut carry.energy;
        let held = body.held_axes();
        let elastic = elastic(body, team);
        let energy = sums.kinetic + elastic - sums.moment.dot(self.request.gravity.as_dvec3());
        // What is common to all of a body that nothing holds is not looked at closely.
        let common = DVec3::select(held, DVec3::ZERO, sums.momentum).length_squared() / (2.0 * sums.free_mass);
        let own = (sums.kinetic - common).max(0.0);
        let rounding = ROUNDING[0] * (own + elastic.abs()) + ROUNDING[1] * common;
        if energy.is_finite() && rounding.is_finite() {
            let [at_once, in_mean] = account.compare(energy, own, rounding);
            if at_once + in_mean > 0.0 && own > 0.5 * sums.free_mass * STILL * STILL {
                account.remove(slow_down(body, held, at_once + in_mean), at_once);
            }
            account.refine();
            account.start_over();
        } else {
            account.forget();
        }
    }
}

/// What the nodes of a tile, or of a body, add up to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Sums {
    /// Of what is free to move, J.
    kinetic: f64,
    /// Of what is free to move, kg m/s.
    momentum: DVec3,
    /// The sum of `m x`, kg m.
    moment: DVec3,
    mass: f64,
    free_mass: f64,
    elastic: f64,
}

saved!(Sums {
    kinetic,
    momentum,
    moment,
    mass,
    free_mass,
    elastic
});

impl Sums {
    fn plus(self, other: &Self) -> Self {
        Self {
            kinetic: self.kinetic + other.kinetic,
            momentum: self.momentum + other.momentum,
            moment: self.moment + other.moment,
            mass: self.mass + other.mass,
            free_mass: self.free_mass + other.free_mass,
            elastic: self.elastic + other.elastic,
        }
    }
}

/// Adds up the newest positions and velocities of a body; the moment is that about the origin of the world.
fn sums(body: &mut Body, carry: &Carry, team: &Team) -> Sums {
    let kernel = body.kernel;
    let inertia = Inertia::of(body.uniform_inverse_mass, &body.inverse_masses, body.scaling.as_deref());
    let state = body.state.substep();
    let (positions, velocities) = (state.positions, &*state.velocities);
    // Velocities that are half a substep older are brought up to the time of the positions to the side, so that comparing changes nothing.
    let closed = carry.closing.map(|closing| Closed {
        springs: &*body.springs,
        elements: None,
        terms: None,
        enclosed: None,
        kernel,
        kick: closing.kick({ carry.gravity }.next(closing.fall()), inertia, body.damping.as_ref()),
        positions,
        velocities,
    });
    let (masses, inverse_masses, pins) = (&body.masses, &body.inverse_masses, &body.pins);
    let count = masses.len();
    team.pass(tile_count(count), Items::new(&mut body.tile_sums), |tile, sums| {
        let nodes = tile_nodes(tile, count);
        *sums = Sums::default();
        let mut axes = [[0.0_f32; TILE]; 3];
        let velocities = match &closed {
            None => velocities.slices(nodes.clone()),
            Some(closed) => {
                let mut axes = axes.each_mut().map(|axis| &mut axis[..nodes.len()]);
                closed.write(tile, nodes.clone(), &mut axes, pins.of_tile(tile));
                axes.map(|axis| &*axis)
            }
        };
        for (axis, &velocities) in velocities.iter().enumerate() {
            kernel.run(OfAxis {
                axis,
                positions: &positions.axes()[axis][nodes.clone()],
                velocities,
                masses: &masses[nodes.clone()],
                inverse_masses: &inverse_masses[nodes.clone()],
                sums,
            });
        }
        for pin in pins.of_tile(tile).iter().filter(|pin| pin.is_partial()) {
            let node = pin.node as usize;
            let inverse_mass = f64::from(inverse_masses[node]);
            if inverse_mass > 0.0 {
                let velocity = Vec3::from(velocities.map(|axis| axis[node - nodes.start]));
                let velocity = pin.held(velocity).as_dvec3();
                sums.kinetic -= 0.5 * velocity.length_squared() / inverse_mass;
                sums.momentum -= velocity / inverse_mass;
            }
        }
    });
    let mut sums = body
        .tile_sums
        .iter()
        .fold(Sums::default(), |sums, tile| sums.plus(tile));
    sums.moment += sums.mass * body.origin;
    sums
}

/// What the nodes of a tile add to its sums along one axis.
struct OfAxis<'a> {
    axis: usize,
    positions: &'a [f32],
    velocities: &'a [f32],
    masses: &'a [f32],
    inverse_masses: &'a [f32],
    sums: &'a mut Sums,
}

/// Sums that are made side by side, so that none waits for itself.
const LANES: usize = 8;

impl Loops for OfAxis<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        // kinetic, momentum, moment, mass, free mass
        let mut lanes = [[0.0_f64; 5]; LANES];
        let count = self.masses.len();
        for start in (0..count).step_by(LANES) {
            for (lane, node) in lanes.iter_mut().zip(start..count) {
                let inverse_mass = self.inverse_masses[node];
                let mass = f64::from(self.masses[node]);
                let free_mass = if inverse_mass > 0.0 {
                    f64::from(1.0 / inverse_mass)
                } else {
                    0.0
                };
                let velocity = f64::from(self.velocities[node]);
                lane[0] += free_mass * velocity * velocity;
                lane[1] += free_mass * velocity;
                lane[2] += mass * f64::from(self.positions[node]);
                lane[3] += mass;
                lane[4] += free_mass;
            }
        }
        let [kinetic, momentum, moment, mass, free_mass] =
            [0, 1, 2, 3, 4].map(|sum| lanes.iter().map(|lane| lane[sum]).sum::<f64>());
        self.sums.kinetic += 0.5 * kinetic;
        self.sums.momentum[self.axis] += momentum;
        self.sums.moment[self.axis] += moment;
        if self.axis == 0 {
            self.sums.mass = mass;
            self.sums.free_mass = free_mass;
        }
    }
}

/// The energy of all inner forces at the newest positions, less the work of a constant pressure, J.
fn elastic(body: &mut Body, team: &Team) -> f64 {
    let (kernel, springs) = (body.kernel, &*body.springs);
    let (terms, enclosed) = (body.terms.as_deref(), body.enclosed.as_deref());
    let positions = body.state.substep().positions;
    if let Some(records) = &mut body.records {
        write_records(kernel, positions, records, team);
    }
    let view = positions.view().with_records(body.records.as_ref());
    let count = positions.len();
    team.pass(tile_count(count), Items::new(&mut body.tile_sums), |tile, sums| {
        sums.elastic = springs.half_energy(tile_nodes(tile, count), view);
        if let Some(terms) = terms {
            sums.elastic += terms.energy_of_tile(tile, &|node| view.get(node).as_dvec3());
        }
    });
    let of_tiles: f64 = body.tile_sums.iter().map(|sums| sums.elastic).sum();
    let of_elements = match (&mut body.elements, &body.records) {
        (Some(elements), Some(records)) => elements.energy(kernel, records.as_slice(), team),
        _ => 0.0,
    };
    let [of_cavities, work] = enclosed.map_or([0.0; 2], |enclosed| {
        enclosed.energy(&|node| positions.get(node).as_dvec3())
    });
    of_tiles + of_elements + of_cavities - work
}

/// Takes this much kinetic energy off the newest velocities, J, or all there is that nothing conserves: how much it was. A body that nothing
/// holds keeps its momentum and its angular momentum: it is its deformation that becomes slower.
fn slow_down(body: &mut Body, held: BVec3, energy: f64) -> f64 {
    let rigid = RigidMotion::of(body, held);
    let state = body.state.substep();
    let (positions, velocities) = (state.positions, state.velocities);
    let inverse_masses = &body.inverse_masses;
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

/// How a body moves as a whole; not at all where something holds it.
struct RigidMotion {
    centre: DVec3,
    velocity: DVec3,
    spin: DVec3,
}

impl RigidMotion {
    fn of(body: &mut Body, held: BVec3) -> Self {
        let inverse_masses = &body.inverse_masses;
        let state = body.state.substep();
        let (positions, velocities): (&Vectors, &Vectors) = (state.positions, state.velocities);
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
