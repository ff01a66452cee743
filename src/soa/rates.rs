//! The masses of nodes, and what bounds their frequencies.

use crate::codec::saved;

/// What bounds the frequencies and the dampings of a node and its springs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rates {
    /// The highest frequency squared, 1/s².
    pub stiffest: f32,
    /// The highest rate of damping, 1/s.
    pub most_damped: f32,
}

saved! { Rates { stiffest, most_damped } }

impl Rates {
    pub const ZERO: Self = Self {
        stiffest: 0.0,
        most_damped: 0.0,
    };

    /// The longest stable substep, s; infinity where there is no limit. Springs beyond the range of `f32` allow no substep
    /// at all.
    pub fn limit(self) -> f32 {
        let damping = 0.5 * self.most_damped;
        let limit = 2.0 / ((self.stiffest + damping * damping).sqrt() + damping);
        if limit.is_nan() { 0.0 } else { limit }
    }

    /// Those of both together.
    pub fn and(self, other: Self) -> Self {
        Self {
            stiffest: self.stiffest + other.stiffest,
            most_damped: self.most_damped + other.most_damped,
        }
    }
}

/// Masses at the ends of a spring count as no more unequal than this. It loses 1 % of a substep on meshes of organs, and 11 % where a light
/// node on a heavy one sets the limit.
const MOST_UNEQUAL: f32 = 4.0;

/// The masses of a body as they are, or with what is added to them.
#[derive(Clone, Copy)]
pub(crate) struct Masses<'a> {
    /// kg
    pub masses: &'a [f32],
    /// 0 for nodes that are pinned.
    pub inverse_masses: &'a [f32],
    /// Whether with what is added to them.
    pub are_heavier: bool,
}

impl<'a> Masses<'a> {
    /// Without what is added to them.
    pub fn new(masses: &'a [f32], inverse_masses: &'a [f32]) -> Self {
        Self {
            masses,
            inverse_masses,
            are_heavier: false,
        }
    }

    /// 1/kg, 0 for a node that is pinned.
    #[inline(always)]
    pub fn inverse(&self, node: usize) -> f32 {
        if self.are_heavier {
            self.inverse_masses[node]
        } else if self.inverse_masses[node] > 0.0 {
            1.0 / self.masses[node]
        } else {
            0.0
        }
    }

    /// What the stiffness of a spring counts with in the bound of a node with this inverse mass, 1/kg.
    ///
    /// A heavy node with many light neighbours is not given all that they need: see `solver/stability.rs`.
    #[inline(always)]
    pub fn of_spring(&self, inverse_mass: f32, neighbour: usize) -> f32 {
        let other = self.inverse(neighbour);
        if other == 0.0 {
            return inverse_mass;
        }
        inverse_mass + other.max(inverse_mass / MOST_UNEQUAL).min(inverse_mass * MOST_UNEQUAL)
    }
}
