//! Yielding: deformation beyond a strain becomes permanent.

use crate::base::{Result, ensure, not_negative};

/// The yield strain of springs, and of tetrahedra that are elements. Beyond it their rest shape changes permanently
/// (perfect plasticity).
///
/// ```
/// # use glam::Vec3;
/// # use sinew::*;
/// # let mut world = World::new(WorldDefinition { gravity: Vec3::ZERO, ..WorldDefinition::default() })?;
/// # let (positions, rest_lengths) = (&[Vec3::ZERO, 0.15 * Vec3::X], Some(&[0.1][..]));
/// # let (springs, masses, stiffnesses) = (Some(&[[0, 1]][..]), Values::Uniform(0.01), Values::Uniform(10.0));
/// # let spring = BodyDefinition { positions, springs, rest_lengths, masses, stiffnesses, ..BodyDefinition::default() };
/// let yielding = Yielding { strain: 0.1, ..Yielding::default() };
/// let body = world.create_body(&BodyDefinition { yielding, ..spring })?;
/// world.body_mut(body)?.pin_nodes(&[0, 1])?;
/// world.step(1.0 / 60.0)?;
/// // 10 N/m, 0.1 m at rest, held at 0.15 m: it pulls with 0.1 N, not 0.5 N.
/// assert!((world.body(body)?.pin_force(1)?.x - 0.1).abs() < 1e-5);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Yielding {
    /// The yield strain of a spring, or of a rod of tetrahedra, in tension and compression, at least 0. 0: no yielding.
    pub strain: f32,
    /// The maximum plastic strain in tension and compression, above 0 and below 1. Beyond it the material is elastic
    /// again.
    pub largest: f32,
}

impl Default for Yielding {
    /// No yielding; the maximum plastic strain is one half.
    fn default() -> Self {
        Self {
            strain: 0.0,
            largest: 0.5,
        }
    }
}

impl Yielding {
    pub(crate) fn check(&self) -> Result<()> {
        not_negative("yield_strain", self.strain)?;
        ensure!(
            self.strain <= 0.0 || (self.largest > 0.0 && self.largest < 1.0),
            "largest_set is {}: must be above 0 and below 1",
            self.largest
        );
        Ok(())
    }

    pub(crate) fn is_none(&self) -> bool {
        self.strain == 0.0
    }
}
