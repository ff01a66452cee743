//! Tissue by physical properties: spring stiffnesses from Young's modulus, masses from density.
//!
//! A material is evaluated when a body is created. It becomes stiffnesses and masses of the definition; the body
//! stores nothing else of it.

mod elements;
mod masses;
pub mod presets;
mod springs;

use crate::base::{Error, Result};
use crate::def::{BodyDefinition, Values};
pub use crate::def::{Material, Model, Viscosity, Yielding};
use crate::elements::ElasticLaw;
use elements::MaterialElements;

/// The allowed difference of Poisson's ratio from the one that springs imply.
const SAME_RATIO: f32 = 1e-3;

impl Material {
    /// Returns an error if the model cannot represent Poisson's ratio with these elements.
    fn check_poisson_ratio(&self, elements: &MaterialElements) -> Result<()> {
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

/// Springs, masses and the elastic law that a material gives to a definition.
#[derive(Debug)]
pub(crate) struct DerivedProperties {
    /// Springs and their stiffnesses; `None` keeps those of the definition.
    springs: Option<(Vec<[u32; 2]>, Vec<f32>)>,
    /// The elastic law of finite elements.
    pub law: Option<ElasticLaw>,
    /// Nodal masses; `None` keeps those of the definition.
    masses: Option<Vec<f32>>,
}

impl DerivedProperties {
    /// Derives them from a checked definition that has this material.
    pub fn derive(material: &Material, definition: &BodyDefinition) -> Result<Self> {
        let elements = MaterialElements::from_definition(definition, material.thickness)?;
        material.check_poisson_ratio(&elements)?;
        let (springs, law) = match material.model {
            Model::Springs => (
                Some(springs::edge_springs(&elements, material.young_modulus, definition)?),
                None,
            ),
            Model::Tetrahedra => (
                None,
                Some(ElasticLaw::new(
                    material.young_modulus,
                    material.poisson_ratio,
                    definition.element_law,
                )),
            ),
        };
        let masses = match material.density {
            0.0 => None,
            density => Some(masses::nodal_masses(&elements, density, definition)?),
        };
        Ok(Self { springs, law, masses })
    }

    /// Returns the definition with the derived springs, stiffnesses and masses.
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
