//! A material by a laboratory's numbers.

use super::{BodyDefinition, Values};
use crate::base::{Error, Result, above_zero, ensure, not_negative};

/// How a material's numbers become forces.
///
/// ```
#[doc = include_str!("../doctest/block.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// # let material = material.expect("the block has one");
/// let mut with = |model| world.create_body(&BodyDefinition { material: Some(Material { model, ..material }), ..block });
/// // Poisson's ratio is 0.45: elements can have it, springs cannot.
/// assert!(with(Model::Tetrahedra).is_ok());
/// assert!(with(Model::Springs).is_err());
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Model {
    /// Springs along the edges of the elements. Poisson's ratio is what such springs imply: 1/4 for tetrahedra and cells, 1/3
    /// in the plane for triangles.
    ///
    /// - *Tetrahedra*: `k = sum E V / L²` over the tetrahedra at an edge (Van Gelder 1998), V their volume, L the edge's length.
    ///   What nodes would do in a body deformed evenly, each moved by the same affine map, has this E and nu 1/4 in the mean over
    ///   directions, on any mesh. In an irregular mesh nodes give way: one that TetGen filled is 4 to 8 % softer, nu 0.25; nodes
    ///   moved about by a fifth of an edge cost 5 %. A body that is one or two tetrahedra thick has half to a third of E. Cubes cut
    ///   in five are 19 % stiffer along the axes, with nu 0.19, and 14 % softer along their diagonals.
    /// - *Cells*, cubes of edge a: `k = 0.4 E a` for their edges and the diagonals of their faces alike, at an outer face or edge
    ///   the share of the cells that meet there, a quarter each of the cells at an edge and half of those at a diagonal. E along
    ///   the axes and nu = 1/4 are exact for small strains, and the same in every direction.
    /// - *Triangles* of a thickness t: `k = sum E t A / L²` over the triangles at an edge, A their area; for equilateral ones
    ///   sqrt(3)/2 E t, and half at the border. For these E and nu = 1/3 in the plane are exact for small strains, the same in
    ///   every direction; with nodes moved about by a fifth of an edge E is 5 % lower, nu 0.34. Squares cut in two are 19 % stiffer
    ///   along their sides, with nu 0.19. There is no bending.
    ///
    /// All follow from the even deformation of a network of springs, whose stiffness is `sum k L² n n n n / V` (Cauchy-Born).
    /// Springs turn stiffer as they are stretched: along an axis of the cubic lattice the secant E shifts by 0.7 of the strain.
    #[default]
    Springs,
    /// Tetrahedra as finite elements: St Venant and Kirchhoff's law with a signed volume term, of any Poisson's ratio from 0 to 0.49.
    ///
    /// The energy of a tetrahedron of volume V at rest is `V (lambda/2 (tr E)² + mu tr E² + kappa/2 (J - 1)²)`, with E Green's strain
    /// and J how much larger its volume is (negative where it is inside out); lambda + kappa and mu are those of Young's
    /// modulus and Poisson's ratio, and kappa is lambda + kappa, or a quarter of lambda + kappa + 2 mu where that is more. Forces are
    /// right up to compressions of some 20 %, and stable beyond. There are no springs but those that are given; removing the
    /// spring between two nodes takes away the tetrahedra that have this edge.
    Tetrahedra,
}

/// What a body is made of, by its numbers. Plain data.
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
    /// How they become forces.
    pub model: Model,
    /// Young's modulus at small strains, Pa, above 0.
    pub young_modulus: f32,
    /// Poisson's ratio. [`Model::Springs`]: 0, or what it implies within 0.001. [`Model::Tetrahedra`]: from 0 to 0.49.
    pub poisson_ratio: f32,
    /// kg/m³, at least 0. Above 0: each node has its share of the mass of the elements that it belongs to, a quarter of a
    /// tetrahedron, an eighth of a cell, a third of a triangle; the definition's masses must be 0 then. 0: the definition's masses.
    pub density: f32,
    /// m: for bodies of triangles alone, above 0; 0 for all others.
    pub thickness: f32,
}

impl Material {
    /// Refuses numbers out of their ranges, and what a definition may not give beside a material.
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

/// There are tetrahedra, and Poisson's ratio is one that they can have.
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

/// Springs come from the material alone.
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

/// Masses come from the density alone.
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
