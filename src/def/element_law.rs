//! The hyperelastic law of tetrahedra that are elements.

use crate::base::{Error, Result, ensure};
use crate::codec::saved_enum;

/// The hyperelastic law of tetrahedra that are elements. At small strains all laws have the Young's modulus and
/// Poisson's ratio of the material.
///
/// With the deformation gradient F, the energies use `I1 = |F|²`, `I2 = |cof F|²` and `J = det F`. Each law adds
/// `lambda/2 (J - 1)²` to the given energy. From a Poisson's ratio of 0.4 on, the tetrahedra around a node share that
/// term (average nodal pressure).
///
/// ```
#[doc = include_str!("../doctest/block.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// let rubber = BodyDefinition { element_law: ElementLaw::MooneyRivlin { ratio: 0.25 }, ..block };
/// assert!(world.create_body(&rubber).is_ok());
/// let refused = BodyDefinition { element_law: ElementLaw::MooneyRivlin { ratio: 1.5 }, ..block };
/// assert!(world.create_body(&refused).is_err());
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum ElementLaw {
    /// The St. Venant-Kirchhoff law with a signed volume term: the fastest. It stiffens when stretched.
    #[default]
    StVenantKirchhoff,
    /// The stable neo-Hookean law (Smith, de Goes, Kim 2018): `2/3 mu (I1 - 3 - ln((I1 + 1)/4)) - mu (J - 1) + 5/12 mu
    /// (J - 1)²`.
    NeoHookean,
    /// The Mooney-Rivlin law for any J: `c1 (I1 - 3) + c2 (I2 - 3) - (2 c1 + 4 c2)(J - 1) + c1 (J - 1)²`, with `c1 +
    /// c2 = mu/2`.
    MooneyRivlin {
        /// `c2 / (c1 + c2)`, from 0 to 1.
        ratio: f32,
    },
}

saved_enum!(ElementLaw { 0 => StVenantKirchhoff, 1 => NeoHookean, 2 => MooneyRivlin { ratio } });

impl ElementLaw {
    /// The name of the law in C.
    fn name(self) -> &'static str {
        match self {
            Self::StVenantKirchhoff => "SINEW_ELEMENT_LAW_ST_VENANT_KIRCHHOFF",
            Self::NeoHookean => "SINEW_ELEMENT_LAW_NEO_HOOKEAN",
            Self::MooneyRivlin { .. } => "SINEW_ELEMENT_LAW_MOONEY_RIVLIN",
        }
    }

    /// Returns an error for a parameter out of range, or for a setting that only the default law supports. `refused`
    /// lists these by name and value.
    pub(crate) fn check(self, is_of_elements: bool, refused: [(&str, f32); 2]) -> Result<()> {
        if let Self::MooneyRivlin { ratio } = self
            && !(0.0..=1.0).contains(&ratio)
        {
            return Err(Error::invalid(format!("mooney_ratio is {ratio}: must be from 0 to 1")));
        }
        if self == Self::default() {
            return Ok(());
        }
        let name = self.name();
        ensure!(
            is_of_elements,
            "element_law is {name}, and material is not SINEW_MATERIAL_TETRAHEDRA: there are no elements"
        );
        for (other, value) in refused {
            ensure!(
                value == 0.0,
                "{other} is {value} while element_law is {name}: must be 0, only elements of {} have it",
                Self::default().name()
            );
        }
        Ok(())
    }
}
