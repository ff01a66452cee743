//! Materials by their measured parameters.

use super::{BodyDefinition, Values};
use crate::base::{Error, Result, above_zero, ensure, not_negative};

/// The mechanical model that a material's parameters apply to.
///
/// ```
#[doc = include_str!("../doctest/block.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// # let material = material.expect("the block has one");
/// let mut with = |model| world.create_body(&BodyDefinition { material: Some(Material { model, ..material }), ..block
/// }); // Poisson's ratio is 0.45: elements can have it, springs cannot. assert!(with(Model::Tetrahedra).is_ok());
/// assert!(with(Model::Springs).is_err());
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Model {
    /// Springs along the edges of the elements. Such springs imply Poisson's ratio: 1/4 for tetrahedra and cells, 1/3
    /// in the plane for triangles.
    ///
    /// - *Tetrahedra*: `k = sum E V / L²` over the tetrahedra at an edge (Van Gelder 1998), with their volume V and the
    ///   edge length L. Under an affine deformation any mesh has this E and nu = 1/4, averaged over directions. In
    ///   irregular meshes nodes yield: a mesh from TetGen is 4 to 8 % softer with nu = 0.25. Moving nodes by a fifth of
    ///   an edge costs 5 %. A body of one or two tetrahedra in thickness has one third to one half of E. Cubes cut in
    ///   five are 19 % stiffer along the axes, with nu = 0.19, and 14 % softer along their diagonals.
    /// - *Cells*, cubes of edge a: `k = 0.4 E a` for their edges and the diagonals of their faces. An outer edge or
    ///   diagonal has the share of the cells that meet there: a quarter per cell at an edge, half at a diagonal. E and
    ///   nu = 1/4 are exact along the axes for small strains, and the same in every direction.
    /// - *Triangles* of thickness t: `k = sum E t A / L²` over the triangles at an edge, with their area A. Equilateral
    ///   triangles have sqrt(3)/2 E t, and half at the border; for them E and nu = 1/3 in the plane are exact for small
    ///   strains and the same in every direction. With nodes moved by a fifth of an edge, E is 5 % lower and nu = 0.34.
    ///   Squares cut in two are 19 % stiffer along their sides, with nu = 0.19. There is no bending.
    ///
    /// All follow from the affine deformation of a spring network, whose stiffness is `sum k L² n n n n / V`
    /// (Cauchy-Born). Springs stiffen when stretched: along an axis of the cubic lattice the secant E shifts by 0.7 of
    /// the strain.
    #[default]
    Springs,
    /// Tetrahedra as finite elements: the St. Venant-Kirchhoff law with a signed volume term, for Poisson's ratios from
    /// 0 to 0.49.
    ///
    /// A tetrahedron of rest volume V has the energy `V (lambda/2 (tr E)² + mu tr E² + kappa/2 (J - 1)²)`. E is the
    /// Green strain and J the volume ratio, negative if it is inverted. Young's modulus and Poisson's ratio give
    /// lambda + kappa and mu. kappa is lambda + kappa, or a quarter of lambda + kappa + 2 mu if that is larger. Forces
    /// are accurate up to compressions of about 20 %, and stable beyond. The only springs are those that are given.
    /// Removing the spring between two nodes removes the tetrahedra with that edge.
    Tetrahedra,
}

/// The material of a body by its parameters. Plain data.
///
/// ```
#[doc = include_str!("../doctest/block.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// let material = Material {
///     model: Model::Tetrahedra,
///     young_modulus: 5000.0,
///     poisson_ratio: 0.45,
///     density: 1000.0,
///     ..Material::default()
/// };
/// let body = world.create_body(&BodyDefinition { material: Some(material), ..block })?;
/// # let mut masses = vec![0.0; mesh.positions.len()];
/// world.body(body)?.node_masses(&mut masses)?;
/// assert!((masses.iter().sum::<f32>() - 0.064).abs() < 1e-6);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Material {
    /// The mechanical model.
    pub model: Model,
    /// Young's modulus at small strains (Pa), above 0.
    pub young_modulus: f32,
    /// Poisson's ratio. [`Model::Springs`]: 0, or the implied value within 0.001. [`Model::Tetrahedra`]: from 0 to
    /// 0.49.
    pub poisson_ratio: f32,
    /// The density (kg/m³), at least 0. 0: the definition gives the masses. Above 0: each element distributes its mass
    /// equally to its nodes, and the definition's masses must be 0.
    pub density: f32,
    /// The thickness of a body of triangles alone (m), above 0. It is 0 for other bodies.
    pub thickness: f32,
}

impl Material {
    /// Returns an error for parameters out of range, and for settings that are not allowed with a material.
    pub(crate) fn check(&self, definition: &BodyDefinition) -> Result<()> {
        above_zero("young_modulus", self.young_modulus)?;
        not_negative("density", self.density)?;
        not_negative("thickness", self.thickness)?;
        match self.model {
            Model::Springs => check_springs(definition)?,
            Model::Tetrahedra => check_tetrahedra(self, definition)?,
        }
        if self.density > 0.0 {
            check_no_masses(definition.masses)?;
        }
        Ok(())
    }
}

/// Checks that there are tetrahedra and that Poisson's ratio is in their range.
fn check_tetrahedra(material: &Material, definition: &BodyDefinition) -> Result<()> {
    const HIGHEST: f32 = 0.49;
    ensure!(
        !definition.tetrahedra.is_empty(),
        "material is of tetrahedra, and the body has none: tetrahedron_count is 0"
    );
    ensure!(
        definition.volume_stiffness <= 0.0,
        "volume_stiffness is {} Pa beside a material of tetrahedra, which keeps volume by itself: must be 0",
        definition.volume_stiffness
    );
    ensure!(
        (0.0..=HIGHEST).contains(&material.poisson_ratio),
        "poisson_ratio is {}: must be from 0 to {HIGHEST}",
        material.poisson_ratio
    );
    Ok(())
}

/// Checks that only the material defines springs.
fn check_springs(definition: &BodyDefinition) -> Result<()> {
    ensure!(
        definition.springs.is_none(),
        "springs is given beside a material, which makes springs of the elements"
    );
    match definition.stiffnesses {
        Values::Uniform(stiffness) if stiffness != 0.0 => Err(Error::invalid(format!(
            "stiffness is {stiffness}: must be 0 beside a material, which gives each spring its own"
        ))),
        _ => Ok(()),
    }
}

/// Checks that only the density defines masses.
fn check_no_masses(masses: Values) -> Result<()> {
    match masses {
        Values::Uniform(0.0) => Ok(()),
        Values::Uniform(mass) => Err(Error::invalid(format!(
            "node_mass is {mass}: must be 0 beside a density, which gives each node its mass"
        ))),
        Values::Each(_) => Err(Error::invalid(
            "masses is given beside a density, which gives each node its mass",
        )),
    }
}
