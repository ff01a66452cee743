//! Force-strain laws of springs.

use crate::base::{Result, above_zero, ensure};
use crate::codec::saved_enum;

/// The force of a spring as a function of its strain e, relative to `k L0` with its stiffness k and rest length L0.
/// Springs that are added later are linear.
///
/// ```
/// # use glam::Vec3;
/// # use sinew::*;
/// # let mut world = World::new(WorldDefinition::default())?;
/// # let (positions, rest_lengths) = (&[Vec3::ZERO, 0.15 * Vec3::X], Some(&[0.1][..]));
/// # let (springs, masses, stiffnesses) = (Some(&[[0, 1]][..]), Values::Uniform(0.01), Values::Uniform(10.0));
/// # let spring = BodyDefinition { positions, springs, rest_lengths, masses, stiffnesses, ..BodyDefinition::default() };
/// let law = SpringLaw::Exponential { steepness: 4.0, limit: 1.0 };
/// let stiffening = world.create_body(&BodyDefinition { spring_law: law, ..spring })?;
/// let linear = world.create_body(&BodyDefinition { spring_law: SpringLaw::Linear, ..spring })?;
/// let elastic = |body| world.body(body).map(|body| body.energy(Vec3::ZERO).elastic);
/// // Both are stretched by a half.
/// assert!(elastic(stiffening)? > 1.5 * elastic(linear)?);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum SpringLaw {
    /// Linear: `e`.
    #[default]
    Linear,
    /// A J-shaped curve: `(exp(steepness e) - 1) / steepness` for strains from 0 to `limit`, linear with the same slope
    /// beyond, and `e` below 0 (found for soft tissue by Fung 1967).
    Exponential {
        /// The exponent per strain, above 0. `steepness limit` must be at most 13.8, so that a spring becomes at most a
        /// million times as stiff.
        steepness: f32,
        /// The strain beyond which the law is linear, above 0.
        limit: f32,
    },
    /// `e + quadratic e² + cubic e³` up to a strain of `limit`, and linear with the same slope beyond. `quadratic²`
    /// must be at most `3 cubic`, so that the force always increases with the length.
    Cubic {
        /// The quadratic coefficient, any number.
        quadratic: f32,
        /// The cubic coefficient, at least 0.
        cubic: f32,
        /// The strain beyond which the law is linear, above 0.
        limit: f32,
    },
}

saved_enum!(SpringLaw { 0 => Linear, 1 => Exponential { steepness, limit }, 2 => Cubic { quadratic, cubic, limit } });

/// The largest exponent: a million times the stiffness.
const STEEPEST: f32 = 13.8;

impl SpringLaw {
    /// Returns an error for parameters out of range.
    pub(crate) fn check(&self) -> Result<()> {
        match *self {
            SpringLaw::Linear => Ok(()),
            SpringLaw::Exponential { steepness, limit } => {
                above_zero("steepness of spring_law", steepness)?;
                above_zero("limit of spring_law", limit)?;
                ensure!(
                    steepness * limit <= STEEPEST,
                    "steepness of spring_law is {steepness} and limit {limit}: their product must be at most {STEEPEST}"
                );
                Ok(())
            }
            SpringLaw::Cubic {
                quadratic,
                cubic,
                limit,
            } => {
                above_zero("limit of spring_law", limit)?;
                ensure!(
                    quadratic * quadratic <= 3.0 * cubic && cubic.is_finite(),
                    "quadratic of spring_law is {quadratic} and cubic {cubic}: quadratic² must be at most 3 cubic, and finite, \
                         or longer springs would pull less"
                );
                Ok(())
            }
        }
    }
}
