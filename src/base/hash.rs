//! The hash of the state of a world.

use glam::Vec3;
use xxhash_rust::xxh3::Xxh3Default;

/// Hashes the bits of values; equal states have equal hashes.
pub(crate) struct StateHasher(Xxh3Default);

impl StateHasher {
    pub fn new() -> Self {
        Self(Xxh3Default::new())
    }

    pub fn write_u64(&mut self, value: u64) {
        self.0.update(&value.to_le_bytes());
    }

    pub fn write_floats(&mut self, values: &[f32]) {
        for value in values {
            self.0.update(&value.to_bits().to_le_bytes());
        }
    }

    pub fn write_vectors(&mut self, vectors: impl IntoIterator<Item = Vec3>) {
        for vector in vectors {
            self.write_floats(&vector.to_array());
        }
    }

    pub fn write_doubles(&mut self, values: &[f64]) {
        for value in values {
            self.write_u64(value.to_bits());
        }
    }

    pub fn finish(&self) -> u64 {
        self.0.digest()
    }
}
