//! Saves the SIMD level: a world saves it once, its parts do not.

use super::{Reader, Saved, Writer, saved_enum};
use crate::base::Result;
use crate::simd::{ChosenKernel, Kernel};

saved_enum!(Kernel { 0 => Best, 1 => Avx512, 2 => Avx2, 3 => Neon, 4 => Portable });

/// Saved by the world only.
impl Saved for ChosenKernel {
    const SHAPE: u64 = 0;
    const LEAST: usize = 0;

    fn save(&self, _to: &mut Writer) {}

    fn load(from: &mut Reader) -> Result<Self> {
        Ok(from.kernel)
    }
}
