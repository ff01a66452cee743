//! Tissue by a laboratory's numbers: the stiffnesses of springs from Young's modulus, masses from density.
//!
//! A material is worked out when a body is made. It becomes stiffnesses and masses of the definition, and a body keeps nothing
//! else of it.

mod filled;
mod masses;
pub mod presets;
mod springs;

use crate::base::{Error, Result};
use crate::def::{BodyDefinition, Values};
pub use crate::def::{Material, Model, Viscosity, Yielding};
use crate::elements::Law;
use filled::Filled;

/// How far a ratio may be from the one that the model implies.
const SAME_RATIO: f32 = 1e-3;

impl Material {
    /// Refuses a Poisson's ratio that the model does not have on such elements.
    fn check_poisson_ratio(&self, elements: &Filled) -> Result<()> {
        let given = self.poisson_ratio;
        match self.model {
            Model::Tetrahedra => Ok(()),
            Model::Springs => {
                let implied = elements.poisson_ratio_of_springs();
                if given == 0.0 || (given - implied).abs() <= SAME_RATIO {
                    return Ok(());
                }
                Err(Error::invalid(format!(
                    "poisson_ratio is {given}: springs of {} imply {implied}; must be that, or 0 for what they imply",
                    elements.name()
                )))
            }
        }
    }
}

/// What a material makes of a definition.
#[derive(Debug)]
pub(crate) struct Made {
    /// With their stiffnesses; `None`: the definition's own, none where it gives none.
    springs: Option<(Vec<[u32; 2]>, Vec<f32>)>,
    /// What tetrahedra follow, where they are elements.
    pub law: Option<Law>,
    /// `None`: the definition's own.
    masses: Option<Vec<f32>>,
}

impl Made {
    /// Of a definition that has been checked and whose material this is.
    pub fn of(material: &Material, definition: &BodyDefinition) -> Result<Self> {
        let elements = Filled::of(definition, material.thickness)?;
        material.check_poisson_ratio(&elements)?;
        let (springs, law) = match material.model {
            Model::Springs => (Some(springs::of(&elements, material.young_modulus, definition)?), None),
            Model::Tetrahedra => (
                None,
                Some(Law::new(
                    material.young_modulus,
                    material.poisson_ratio,
                    definition.element_law,
                )),
            ),
        };
        let masses = match material.density {
            0.0 => None,
            density => Some(masses::of(&elements, density, definition)?),
        };
        Ok(Self { springs, law, masses })
    }

    /// The definition with what was made.
    pub fn complete<'a>(&'a self, definition: &BodyDefinition<'a>) -> BodyDefinition<'a> {
        let (springs, stiffnesses) = match &self.springs {
            Some((springs, stiffnesses)) => (&springs[..], Values::Each(stiffnesses)),
            None => (definition.springs.unwrap_or_default(), definition.stiffnesses),
        };
        BodyDefinition {
            springs: Some(springs),
            stiffnesses,
            masses: self.masses.as_deref().map_or(definition.masses, Values::Each),
            material: None,
            ..*definition
        }
    }
}
