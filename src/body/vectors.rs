//! Vectors of all nodes, one array per component, so that a kernel reads neighbouring nodes in one load.

use glam::Vec3;

use crate::error::Result;
use crate::memory;

/// One vector per node: structure of arrays.
#[derive(Clone, Debug, Default)]
pub(crate) struct Vectors {
    pub x: Vec<f32>,
    pub y: Vec<f32>,
    pub z: Vec<f32>,
}

impl Vectors {
    /// `count` zero vectors.
    pub fn zeros(count: usize) -> Result<Self> {
        Ok(Self {
            x: memory::filled(0.0, count)?,
            y: memory::filled(0.0, count)?,
            z: memory::filled(0.0, count)?,
        })
    }

    #[inline(always)]
    pub fn get(&self, node: usize) -> Vec3 {
        Vec3::new(self.x[node], self.y[node], self.z[node])
    }

    #[inline(always)]
    pub fn set(&mut self, node: usize, value: Vec3) {
        self.x[node] = value.x;
        self.y[node] = value.y;
        self.z[node] = value.z;
    }

    pub fn len(&self) -> usize {
        self.x.len()
    }

    /// All of them as vectors, in order.
    pub fn iter(&self) -> impl Iterator<Item = Vec3> + '_ {
        self.x
            .iter()
            .zip(&self.y)
            .zip(&self.z)
            .map(|((&x, &y), &z)| Vec3::new(x, y, z))
    }

    /// Copies all of `other`, which has as many.
    pub fn copy_from(&mut self, other: &Self) {
        self.x.copy_from_slice(&other.x);
        self.y.copy_from_slice(&other.y);
        self.z.copy_from_slice(&other.z);
    }

    /// Sets every vector to zero.
    pub fn clear(&mut self) {
        self.x.fill(0.0);
        self.y.fill(0.0);
        self.z.fill(0.0);
    }

    /// The longest of them, as its length squared; infinite or NaN components give infinity.
    pub fn largest_length_squared(&self) -> f32 {
        let largest = self.iter().fold(0.0_f32, |largest, vector| {
            let square = vector.length_squared();
            if square <= largest { largest } else { square }
        });
        if largest.is_finite() { largest } else { f32::INFINITY }
    }

    pub fn components(&self) -> [&[f32]; 3] {
        [&self.x, &self.y, &self.z]
    }
}
