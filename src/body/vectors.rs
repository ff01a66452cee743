//! Vectors of all nodes, sixteen bytes each, so that a kernel fetches a neighbour's in one load.

use glam::{Vec3, Vec3A};

use crate::error::Result;
use crate::memory;

/// One vector per node.
#[derive(Clone, Debug, Default)]
pub(crate) struct Vectors(Vec<Vec3A>);

impl Vectors {
    /// `count` zero vectors.
    pub fn zeros(count: usize) -> Result<Self> {
        Ok(Self(memory::filled(Vec3A::ZERO, count)?))
    }

    #[inline(always)]
    pub fn get(&self, node: usize) -> Vec3 {
        self.0[node].into()
    }

    /// The vector as the processor holds it.
    #[inline(always)]
    pub fn lanes(&self, node: usize) -> Vec3A {
        self.0[node]
    }

    #[inline(always)]
    pub fn set(&mut self, node: usize, value: impl Into<Vec3A>) {
        self.0[node] = value.into();
    }

    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// All of them, in order.
    pub fn iter(&self) -> impl Iterator<Item = Vec3> + '_ {
        self.0.iter().map(|&vector| vector.into())
    }

    /// Copies all of `other`, which has as many.
    pub fn copy_from(&mut self, other: &Self) {
        self.0.copy_from_slice(&other.0);
    }

    /// Sets every vector to zero.
    pub fn clear(&mut self) {
        self.0.fill(Vec3A::ZERO);
    }

    /// The length of the longest of them; infinite where one is not finite.
    pub fn largest_length(&self) -> f32 {
        largest(self.0.iter().map(|vector| vector.length_squared()))
    }

    /// The longest way between a vector and that of `other` at its place; infinite where one is not finite.
    pub fn largest_distance(&self, other: &Self) -> f32 {
        largest(self.0.iter().zip(&other.0).map(|(a, b)| a.distance_squared(*b)))
    }
}

/// The root of the largest of `squares`; infinite where one is not finite.
fn largest(squares: impl Iterator<Item = f32>) -> f32 {
    // A NaN, once met, stays.
    let larger = |largest: f32, square: f32| {
        if largest.is_nan() || square <= largest {
            largest
        } else {
            square
        }
    };
    let largest = squares.fold(0.0, larger);
    if largest.is_finite() {
        largest.sqrt()
    } else {
        f32::INFINITY
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_finite_is_seen_wherever_it_is() {
        for spoilt in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            for node in 0..3 {
                let mut vectors = Vectors::zeros(3).expect("memory");
                vectors.set(1, Vec3::ONE);
                assert_eq!(vectors.largest_length(), 3.0_f32.sqrt());
                vectors.set(node, Vec3::new(0.0, spoilt, 0.0));
                assert_eq!(vectors.largest_length(), f32::INFINITY, "{spoilt} at node {node}");
            }
        }
    }
}
