//! What forces do to velocities: the half kicks of leapfrog, with the damping of nodes solved exactly.
//!
//! A full kick is two half kicks with the same force, so that a step cut into several, or followed by another, moves
//! as one long one would.

use std::ops::Range;

use glam::Vec3;

use super::mass_scaling::{MassScaling, Sliver};
use super::subnormal::{on_grid, still_or};
use crate::codec::saved;
use crate::geometry::Bounds;
use crate::nodes::NodeDamping;
use crate::simd::{ChosenKernel, Loops};
use crate::soa::{TileForces, Vectors};

/// The inverse masses of nodes that are free to move, 1/kg.
#[derive(Clone, Copy, Debug)]
pub(super) enum InverseMasses<'a> {
    /// The same for all; for a pinned node too, which something else holds.
    Uniform(f32),
    /// 0 where a node is pinned.
    Each(&'a [f32]),
}

/// How nodes resist a force.
#[derive(Clone, Copy)]
pub(super) struct Inertia<'a> {
    pub inverse_masses: InverseMasses<'a>,
    /// The nodes that gravity pulls less than in proportion, in their order.
    pub heavier: &'a [Sliver],
}

impl<'a> Inertia<'a> {
    /// With the inverse mass `uniform` where there is such a one, else with `each`.
    pub fn of(uniform: Option<f32>, each: &'a [f32], scaling: Option<&'a MassScaling>) -> Self {
        Self {
            inverse_masses: uniform.map_or(InverseMasses::Each(each), InverseMasses::Uniform),
            heavier: scaling.map_or(&[], MassScaling::heavier),
        }
    }
}

/// One kick of a body.
#[derive(Clone, Copy)]
pub(super) struct Kick<'a> {
    /// How long the forces act, s.
    pub duration: f32,
    /// How long a drift after it takes, s.
    pub substep: f32,
    /// Whether it is half of one.
    pub half: bool,
    pub gravity: Vec3,
    /// What gravity gives to a node without damping in this kick, m/s.
    pub fall: Vec3,
    pub inertia: Inertia<'a>,
    /// Forces from outside, N.
    pub applied: Option<&'a Vectors>,
    pub damping: Option<&'a NodeDamping>,
}

impl Kick<'_> {
    /// Takes from the forces on nodes that have been made heavier what gravity will give them too much.
    fn lighten(&self, nodes: &Range<usize>, forces: &mut TileForces) {
        let heavier = self.inertia.heavier;
        let gravity = match self.damping {
            None => self.fall / self.duration,
            Some(_) => self.gravity,
        };
        if gravity == Vec3::ZERO {
            return;
        }
        let first = heavier.partition_point(|sliver| (sliver.node as usize) < nodes.start);
        for sliver in &heavier[first..] {
            let node = sliver.node as usize;
            if node >= nodes.end {
                break;
            }
            let place = node - nodes.start;
            forces.set(place, forces.get(place) - gravity * sliver.added);
        }
    }
}

/// A kick for the nodes of one tile, and the drift that follows it.
pub(super) struct TileKick<'a, 'b> {
    pub kick: &'b Kick<'a>,
    pub nodes: Range<usize>,
    /// The spring forces on these nodes; others are added to them.
    pub forces: &'b mut TileForces,
    pub velocities: [&'b mut [f32]; 3],
    pub drift: Option<Drift<'b>>,
}

/// Where the nodes of a tile are, and where they are put.
pub(super) struct Drift<'a> {
    pub positions: [&'a [f32]; 3],
    pub next_positions: [&'a mut [f32]; 3],
    /// What positions lack, where that is carried on.
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
        kick.lighten(&nodes, forces);
        let mut drift = drift;
        for (axis, velocities) in velocities.into_iter().enumerate() {
            let axis = Axis {
                kick,
                nodes: nodes.clone(),
                forces: &forces.axes()[axis][..nodes.len()],
                gravity: kick.gravity[axis],
                fall: kick.fall[axis],
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
    fall: f32,
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
    /// Chooses among loops that do no more than they must.
    #[inline(always)]
    fn run(self) {
        let kick = self.kick;
        let (duration, gravity, fall) = (kick.duration, self.gravity, self.fall);
        match (kick.damping, kick.inertia.inverse_masses) {
            (None, InverseMasses::Uniform(inverse_mass)) => {
                self.each(
                    |_, force, velocity| velocity + (force * inverse_mass * duration + fall),
                    |coordinate| coordinate,
                );
            }
            (None, InverseMasses::Each(inverse_masses)) => {
                let inverse_masses = &inverse_masses[self.nodes.clone()];
                self.each(
                    |place, force, velocity| velocity + (force * inverse_masses[place] * duration + fall),
                    |coordinate| coordinate,
                );
            }
            (Some(damping), inverse_masses) => {
                let nodes = self.nodes.clone();
                let (loss, gain) = (&damping.loss[nodes.clone()], &damping.gain[nodes.clone()]);
                // Two half kicks in one: the second loses from what the first left.
                let (whole, share) = if kick.half { (1.0, 0.0) } else { (2.0, 1.0) };
                let damped = move |place: usize, acceleration: f32, velocity: f32| {
                    let (loss, gain) = (loss[place], gain[place]);
                    let both = whole - share * loss;
                    still_or(velocity + ((acceleration + gravity) * (gain * both) - velocity * (loss * both)))
                };
                match inverse_masses {
                    InverseMasses::Uniform(inverse_mass) => {
                        self.each(
                            |place, force, velocity| damped(place, force * inverse_mass, velocity),
                            on_grid,
                        );
                    }
                    InverseMasses::Each(inverse_masses) => {
                        let inverse_masses = &inverse_masses[nodes];
                        self.each(
                            |place, force, velocity| damped(place, force * inverse_masses[place], velocity),
                            on_grid,
                        );
                    }
                }
            }
        }
    }

    /// Gives each node the velocity that `kicked` makes of its place in the tile, its force and its velocity, and lets it
    /// drift to what `rounded` makes of its coordinate. Only what is damped comes to rest, and needs that.
    #[inline(always)]
    fn each(self, kicked: impl Fn(usize, f32, f32) -> f32, rounded: impl Fn(f32) -> f32) {
        let count = self.nodes.len();
        let (forces, velocities) = (&self.forces[..count], &mut self.velocities[..count]);
        match self.drift {
            None => {
                for place in 0..count {
                    velocities[place] = kicked(place, forces[place], velocities[place]);
                }
            }
            Some(drift) => {
                let substep = self.kick.substep;
                let (positions, next_positions) = (&drift.positions[..count], &mut drift.next_positions[..count]);
                let Some(remainders) = drift.remainders else {
                    for place in 0..count {
                        let velocity = kicked(place, forces[place], velocities[place]);
                        velocities[place] = velocity;
                        next_positions[place] = rounded(positions[place] + velocity * substep);
                    }
                    return;
                };
                let remainders = &mut remainders[..count];
                for place in 0..count {
                    let velocity = kicked(place, forces[place], velocities[place]);
                    velocities[place] = velocity;
                    let way = velocity * substep + remainders[place];
                    let next = rounded(positions[place] + way);
                    next_positions[place] = next;
                    remainders[place] = way - (next - positions[place]);
                }
            }
        }
    }
}

/// What there is to know of a tile after a kick.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Survey {
    /// The box of its velocities; what is NaN is not in it.
    pub velocities: Bounds,
    /// Whether the squares of its velocities, and of its positions where they were looked at, are finite.
    pub finite: bool,
}

saved! { Survey { velocities, finite } }

impl Default for Survey {
    fn default() -> Self {
        Self::NOTHING
    }
}

impl Survey {
    pub const NOTHING: Self = Self {
        velocities: Bounds::EMPTY,
        finite: true,
    };

    /// What there is to know of both.
    pub fn and(self, other: Self) -> Self {
        Self {
            velocities: self.velocities.and(&other.velocities),
            finite: self.finite && other.finite,
        }
    }
}

/// Looks at the velocities of a tile, and at positions as well if only for being finite.
pub(super) fn look(kernel: ChosenKernel, velocities: [&[f32]; 3], positions: Option<[&[f32]; 3]>) -> Survey {
    Survey {
        velocities: kernel.ranges(velocities).into(),
        finite: positions.is_none_or(|positions| kernel.run(AreFinite([velocities, positions]))),
    }
}

/// Whether the squares of vectors are finite.
struct AreFinite<'a>([[&'a [f32]; 3]; 2]);

impl Loops for AreFinite<'_> {
    type Output = bool;

    #[inline(always)]
    fn run(self) -> bool {
        self.0.into_iter().all(squares_are_finite)
    }
}

/// Whether the square of every vector's length is finite.
#[inline(always)]
fn squares_are_finite([x, y, z]: [&[f32]; 3]) -> bool {
    // Zero times what is not finite is NaN, and stays.
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
