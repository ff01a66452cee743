//! What forces do to velocities: the half kicks of leapfrog, with the damping of nodes solved exactly.
//!
//! A full kick is two half kicks with the same force, so that a step cut into several, or followed by another, moves
//! as one long one would.

use std::ops::Range;

use glam::Vec3;

use crate::body::{Bounds, InverseMasses, NodeDamping, Vectors};
use crate::springs::{Loops, TileForces};

/// One kick of a body.
#[derive(Clone, Copy)]
pub(super) struct Kick<'a> {
    /// s
    pub substep: f32,
    /// Whether it is half of one.
    pub half: bool,
    pub gravity: Vec3,
    /// What gravity gives to a node without damping in this kick, whole or half, m/s.
    pub fall: Vec3,
    pub inverse_masses: InverseMasses<'a>,
    /// Forces from outside, N.
    pub applied: Option<&'a Vectors>,
    pub damping: Option<&'a NodeDamping>,
}

/// A kick for the nodes of one tile, and the drift that follows it.
pub(super) struct TileKick<'a, 'b> {
    pub kick: &'b Kick<'a>,
    pub nodes: Range<usize>,
    /// The spring forces on these nodes; lost.
    pub forces: &'b mut TileForces,
    pub velocities: [&'b mut [f32]; 3],
    pub drift: Option<Drift<'b>>,
}

/// Where the nodes of a tile are, and where they are put.
pub(super) struct Drift<'a> {
    pub positions: [&'a [f32]; 3],
    pub next_positions: [&'a mut [f32]; 3],
}

impl Loops for TileKick<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self {
            kick,
            nodes,
            forces,
            mut velocities,
            drift,
        } = self;
        let (gravity, fall) = (kick.gravity.to_array(), kick.fall.to_array());
        for (axis, velocities) in velocities.iter_mut().enumerate() {
            let forces = &mut forces.axes[axis][..nodes.len()];
            if let Some(applied) = kick.applied {
                for (force, applied) in forces.iter_mut().zip(&applied.axes()[axis][nodes.clone()]) {
                    *force += applied;
                }
            }
            match kick.inverse_masses {
                InverseMasses::Uniform(inverse_mass) => {
                    for force in forces.iter_mut() {
                        *force *= inverse_mass;
                    }
                }
                InverseMasses::Each(inverse_masses) => {
                    for (force, inverse_mass) in forces.iter_mut().zip(&inverse_masses[nodes.clone()]) {
                        *force *= inverse_mass;
                    }
                }
            }
            let accelerations = &*forces;
            match kick.damping {
                None => {
                    let duration = if kick.half { 0.5 * kick.substep } else { kick.substep };
                    for (velocity, acceleration) in velocities.iter_mut().zip(accelerations) {
                        *velocity += acceleration * duration + fall[axis];
                    }
                }
                Some(damping) => {
                    let factors = damping.loss[nodes.clone()].iter().zip(&damping.gain[nodes.clone()]);
                    let moved = velocities.iter_mut().zip(accelerations);
                    for ((velocity, acceleration), (&loss, &gain)) in moved.zip(factors) {
                        // Two half kicks in one: the second loses from what the first left.
                        let both = if kick.half { 1.0 } else { 2.0 - loss };
                        *velocity += (acceleration + gravity[axis]) * (gain * both) - *velocity * (loss * both);
                    }
                }
            }
        }
        let Some(drift) = drift else { return };
        let places = drift.positions.into_iter().zip(drift.next_positions);
        for (velocities, (positions, next_positions)) in velocities.iter().zip(places) {
            let moved = positions.iter().zip(next_positions).zip(velocities.iter());
            for ((position, next_position), velocity) in moved {
                *next_position = position + velocity * kick.substep;
            }
        }
    }
}

/// What there is to know of a tile after a kick.
#[derive(Clone, Copy, Debug)]
pub(super) struct Survey {
    /// The box of its velocities; what is NaN is not in it.
    pub velocities: Bounds,
    /// Whether the squares of its velocities, and of its positions where they were looked at, are finite.
    pub finite: bool,
}

impl Survey {
    pub const NOTHING: Self = Self {
        velocities: Bounds::EMPTY,
        finite: true,
    };

    /// What there is to know of both.
    pub fn and(self, other: Self) -> Self {
        Self {
            velocities: Bounds {
                min: self.velocities.min.min(other.velocities.min),
                max: self.velocities.max.max(other.velocities.max),
            },
            finite: self.finite && other.finite,
        }
    }
}

/// Looks at the velocities of a tile.
pub(super) struct Look<'a> {
    pub velocities: [&'a [f32]; 3],
    /// Looked at as well, if only for being finite.
    pub positions: Option<[&'a [f32]; 3]>,
}

impl Loops for Look<'_> {
    type Output = Survey;

    #[inline(always)]
    fn run(self) -> Survey {
        let [mut min, mut max] = [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]];
        for (axis, velocities) in self.velocities.into_iter().enumerate() {
            (min[axis], max[axis]) = range(velocities);
        }
        let finite = match self.positions {
            None => true,
            Some(positions) => squares_are_finite(self.velocities) && squares_are_finite(positions),
        };
        Survey {
            velocities: Bounds {
                min: min.into(),
                max: max.into(),
            },
            finite,
        }
    }
}

/// The least and the greatest of `values`, taken in sixteen lanes side by side.
#[inline(always)]
fn range(values: &[f32]) -> (f32, f32) {
    let (mut least, mut greatest) = ([f32::INFINITY; 16], [f32::NEG_INFINITY; 16]);
    let (blocks, rest) = values.as_chunks::<16>();
    for block in blocks {
        for lane in 0..16 {
            least[lane] = lesser(least[lane], block[lane]);
            greatest[lane] = greater(greatest[lane], block[lane]);
        }
    }
    for (lane, &value) in rest.iter().enumerate() {
        least[lane] = lesser(least[lane], value);
        greatest[lane] = greater(greatest[lane], value);
    }
    let fold = |values: [f32; 16], choose: fn(f32, f32) -> f32| values.into_iter().reduce(choose).unwrap_or(0.0);
    (fold(least, lesser), fold(greatest, greater))
}

#[inline(always)]
fn lesser(a: f32, b: f32) -> f32 {
    if b < a { b } else { a }
}

#[inline(always)]
fn greater(a: f32, b: f32) -> f32 {
    if b > a { b } else { a }
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
