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

    /// The longest of them, as its length squared; infinite or NaN components give infinity.
    pub fn largest_length_squared(&self) -> f32 {
        let largest = self.0.iter().fold(0.0_f32, |largest, vector| {
            let square = vector.length_squared();
            if square <= largest { largest } else { square }
        });
        if largest.is_finite() { largest } else { f32::INFINITY }
    }
}
