//! The velocity update of leapfrog, with exact node damping.
//!
//! A full kick equals two half kicks with the same force. A step that is split into several, or followed by another,
//! thus moves the body as one long step does.

use std::ops::Range;

use glam::Vec3;

use super::flush_denormals::{flush_velocity, round_to_grid};
use super::mass_scaling::{AddedMass, MassScaling};
use crate::codec::saved;
use crate::geometry::Aabb;
use crate::nodes::NodeDamping;
use crate::simd::{ChosenKernel, Loops};
use crate::soa::{TileForces, Vectors};

/// The inverse masses of free nodes, 1/kg.
#[derive(Clone, Copy, Debug)]
pub(super) enum InverseMasses<'a> {
    /// One value for all nodes, including pinned ones, which are constrained elsewhere.
    Uniform(f32),
    /// One value per node, 0 for pinned nodes.
    Each(&'a [f32]),
}

/// The resistance of nodes to a force.
#[derive(Clone, Copy)]
pub(super) struct Inertia<'a> {
    pub inverse_masses: InverseMasses<'a>,
    /// The nodes with added mass that gravity must not act on, sorted by node.
    pub weightless: &'a [AddedMass],
}

impl<'a> Inertia<'a> {
    /// Uses the inverse mass `uniform` if there is one, otherwise `each`.
    pub fn of(uniform: Option<f32>, each: &'a [f32], scaling: Option<&'a MassScaling>) -> Self {
        Self {
            inverse_masses: uniform.map_or(InverseMasses::Each(each), InverseMasses::Uniform),
            weightless: scaling.map_or(&[], MassScaling::weightless),
        }
    }
}

/// One kick of a body.
#[derive(Clone, Copy)]
pub(super) struct Kick<'a> {
    /// The time that the forces act, s.
    pub duration: f32,
    /// The duration of the drift after it, s.
    pub substep: f32,
    /// True for a half kick.
    pub half: bool,
    pub gravity: Vec3,
    /// The velocity change by gravity of a node without damping, m/s.
    pub gravity_change: Vec3,
    pub inertia: Inertia<'a>,
    /// Applied forces, N.
    pub applied: Option<&'a Vectors>,
    pub damping: Option<&'a NodeDamping>,
}

impl Kick<'_> {
    /// Subtracts the weight of added mass from the forces.
    fn remove_excess_weight(&self, nodes: &Range<usize>, forces: &mut TileForces) {
        let weightless = self.inertia.weightless;
        let gravity = match self.damping {
            None => self.gravity_change / self.duration,
            Some(_) => self.gravity,
        };
        if gravity == Vec3::ZERO {
            return;
        }
        let first = weightless.partition_point(|candidate| (candidate.node as usize) < nodes.start);
        for candidate in &weightless[first..] {
            let node = candidate.node as usize;
            if node >= nodes.end {
                break;
            }
            let index = node - nodes.start;
            forces.set(index, forces.get(index) - gravity * candidate.added);
        }
    }
}

/// A kick for the nodes of one tile and the drift that follows it.
pub(super) struct TileKick<'a, 'b> {
    pub kick: &'b Kick<'a>,
    pub nodes: Range<usize>,
    /// The spring forces on these nodes. The kick adds other forces to them.
    pub forces: &'b mut TileForces,
    pub velocities: [&'b mut [f32]; 3],
    pub drift: Option<Drift<'b>>,
}

/// The positions of a tile before and after the drift.
pub(super) struct Drift<'a> {
    pub positions: [&'a [f32]; 3],
    pub next_positions: [&'a mut [f32]; 3],
    /// The rounding remainders of positions, if they are tracked.
    pub remainders: Option<[&'a mut [f32]; 3]>,
}

impl Loops for TileKick<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self {
            kick,
            nodes,
            forces,
            velocities,
            drift,
        } = self;
        if let Some(applied) = kick.applied {
            for (forces, applied) in forces.axes_mut().into_iter().zip(applied.slices(nodes.clone())) {
                for (force, applied) in forces.iter_mut().zip(applied) {
                    *force += applied;
                }
            }
        }
        kick.remove_excess_weight(&nodes, forces);
        let mut drift = drift;
        for (axis, velocities) in velocities.into_iter().enumerate() {
            let axis = Axis {
                kick,
                nodes: nodes.clone(),
                forces: &forces.axes()[axis][..nodes.len()],
                gravity: kick.gravity[axis],
                gravity_change: kick.gravity_change[axis],
                velocities,
                drift: drift.as_mut().map(|drift| AxisDrift {
                    positions: drift.positions[axis],
                    next_positions: &mut *drift.next_positions[axis],
                    remainders: drift.remainders.as_mut().map(|remainders| &mut *remainders[axis]),
                }),
            };
            axis.run();
        }
    }
}

/// The kick along one axis.
struct Axis<'a> {
    kick: &'a Kick<'a>,
    nodes: Range<usize>,
    forces: &'a [f32],
    gravity: f32,
    gravity_change: f32,
    velocities: &'a mut [f32],
    drift: Option<AxisDrift<'a>>,
}

/// The drift along one axis.
struct AxisDrift<'a> {
    positions: &'a [f32],
    next_positions: &'a mut [f32],
    remainders: Option<&'a mut [f32]>,
}

impl Axis<'_> {
    /// Selects the cheapest loop for the kick.
    #[inline(always)]
    fn run(self) {
        let kick = self.kick;
        let (duration, gravity, gravity_change) = (kick.duration, self.gravity, self.gravity_change);
        match (kick.damping, kick.inertia.inverse_masses) {
            (None, InverseMasses::Uniform(inverse_mass)) => {
                self.for_each_node(
                    |_, force, velocity| velocity + (force * inverse_mass * duration + gravity_change),
                    |coordinate| coordinate,
                );
            }
            (None, InverseMasses::Each(inverse_masses)) => {
                let inverse_masses = &inverse_masses[self.nodes.clone()];
                self.for_each_node(
                    |index, force, velocity| velocity + (force * inverse_masses[index] * duration + gravity_change),
                    |coordinate| coordinate,
                );
            }
            (Some(damping), inverse_masses) => {
                let nodes = self.nodes.clone();
                let (loss, gain) = (&damping.loss[nodes.clone()], &damping.gain[nodes.clone()]);
                // A full kick merges two half kicks: the second one damps what the first one left.
                let (whole, share) = if kick.half { (1.0, 0.0) } else { (2.0, 1.0) };
                let damped = move |index: usize, acceleration: f32, velocity: f32| {
                    let (loss, gain) = (loss[index], gain[index]);
                    let both = whole - share * loss;
                    flush_velocity(velocity + ((acceleration + gravity) * (gain * both) - velocity * (loss * both)))
                };
                match inverse_masses {
                    InverseMasses::Uniform(inverse_mass) => {
                        self.for_each_node(
                            |index, force, velocity| damped(index, force * inverse_mass, velocity),
                            round_to_grid,
                        );
                    }
                    InverseMasses::Each(inverse_masses) => {
                        let inverse_masses = &inverse_masses[nodes];
                        self.for_each_node(
                            |index, force, velocity| damped(index, force * inverse_masses[index], velocity),
                            round_to_grid,
                        );
                    }
                }
            }
        }
    }

    /// Sets each velocity to `new_velocity` of the index in the tile, the force and the velocity. Then drifts each
    /// coordinate and applies `round` to it. Only damped nodes come to rest and need rounding.
    #[inline(always)]
    fn for_each_node(self, new_velocity: impl Fn(usize, f32, f32) -> f32, round: impl Fn(f32) -> f32) {
        let count = self.nodes.len();
        let (forces, velocities) = (&self.forces[..count], &mut self.velocities[..count]);
        match self.drift {
            None => {
                for index in 0..count {
                    velocities[index] = new_velocity(index, forces[index], velocities[index]);
                }
            }
            Some(drift) => {
                let substep = self.kick.substep;
                let (positions, next_positions) = (&drift.positions[..count], &mut drift.next_positions[..count]);
                let Some(remainders) = drift.remainders else {
                    for index in 0..count {
                        let velocity = new_velocity(index, forces[index], velocities[index]);
                        velocities[index] = velocity;
                        next_positions[index] = round(positions[index] + velocity * substep);
                    }
                    return;
                };
                let remainders = &mut remainders[..count];
                for index in 0..count {
                    let velocity = new_velocity(index, forces[index], velocities[index]);
                    velocities[index] = velocity;
                    let displacement = velocity * substep + remainders[index];
                    let next = round(positions[index] + displacement);
                    next_positions[index] = next;
                    remainders[index] = displacement - (next - positions[index]);
                }
            }
        }
    }
}

/// Statistics of a tile after a kick.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TileStats {
    /// The bounding box of its velocities without NaN.
    pub velocities: Aabb,
    /// True if the squares of its velocities, and of its positions if they were tested, are finite.
    pub finite: bool,
}

saved! { TileStats { velocities, finite } }

impl Default for TileStats {
    fn default() -> Self {
        Self::EMPTY
    }
}

impl TileStats {
    pub const EMPTY: Self = Self {
        velocities: Aabb::EMPTY,
        finite: true,
    };

    /// Merges two statistics.
    pub fn merge(self, other: Self) -> Self {
        Self {
            velocities: self.velocities.and(&other.velocities),
            finite: self.finite && other.finite,
        }
    }
}

/// Computes the statistics of a tile. `positions` are only tested for finite values.
pub(super) fn tile_stats(kernel: ChosenKernel, velocities: [&[f32]; 3], positions: Option<[&[f32]; 3]>) -> TileStats {
    TileStats {
        velocities: kernel.ranges(velocities).into(),
        finite: positions.is_none_or(|positions| kernel.run(AreFinite([velocities, positions]))),
    }
}

/// Tests if the squares of vectors are finite.
struct AreFinite<'a>([[&'a [f32]; 3]; 2]);

impl Loops for AreFinite<'_> {
    type Output = bool;

    #[inline(always)]
    fn run(self) -> bool {
        self.0.into_iter().all(squares_are_finite)
    }
}

/// True if the squared length of every vector is finite.
#[inline(always)]
fn squares_are_finite([x, y, z]: [&[f32]; 3]) -> bool {
    // Zero times a value that is not finite is NaN, and the sum stays NaN.
    let mut sums = [0.0_f32; 16];
    let blocks = x
        .as_chunks::<16>()
        .0
        .iter()
        .zip(y.as_chunks::<16>().0)
        .zip(z.as_chunks::<16>().0);
    for ((x, y), z) in blocks {
        for lane in 0..16 {
            sums[lane] += 0.0 * (x[lane] * x[lane] + y[lane] * y[lane] + z[lane] * z[lane]);
        }
    }
    for node in x.len() / 16 * 16..x.len() {
        sums[0] += 0.0 * (x[node] * x[node] + y[node] * y[node] + z[node] * z[node]);
    }
    sums.into_iter().sum::<f32>() == 0.0
}
