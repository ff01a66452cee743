//! The definition of a body as Rust has it.

use super::definition::{
    SINEW_ELEMENT_LAW_MOONEY_RIVLIN, SINEW_ELEMENT_LAW_NEO_HOOKEAN, SINEW_ELEMENT_LAW_ST_VENANT_KIRCHHOFF,
    SINEW_MATERIAL_NONE, SINEW_MATERIAL_SPRINGS, SINEW_MATERIAL_TETRAHEDRA, SINEW_SOLVER_AUTO, SINEW_SOLVER_IMPLICIT,
    SINEW_SOLVER_NEWTON, SINEW_SOLVER_VERLET, SINEW_SPRING_LAW_CUBIC, SINEW_SPRING_LAW_EXPONENTIAL,
    SINEW_SPRING_LAW_LINEAR, SINEW_STORAGE_DYNAMIC_BULK, SINEW_STORAGE_EFFICIENT, SINEW_STORAGE_FAST_LINK,
    SINEW_STORAGE_PACKED, sinew_body_def,
};
use super::memory::{self, Versioned};
use super::tool::{SINEW_DETECTION_EXACT, detection};
use crate::base::{Error, Result, ensure};
use crate::def::{
    BodyContact, BodyDefinition, CollisionFilter, ElementLaw, Material, Model, Sleep, Solver, SpringLaw, Storage,
    Tearing, Values, Viscosity, Yielding,
};

impl sinew_body_def {
    pub(super) fn defaults() -> Self {
        Self {
            storage: SINEW_STORAGE_PACKED,
            solver: SINEW_SOLVER_AUTO,
            mass_scaling: BodyDefinition::default().mass_scaling,
            material: SINEW_MATERIAL_NONE,
            spring_law: SINEW_SPRING_LAW_LINEAR,
            largest_set: Yielding::default().largest,
            limit_stiffening: BodyDefinition::default().limit_stiffening,
            contact_detection: SINEW_DETECTION_EXACT,
            collision_category: CollisionFilter::default().category,
            collision_mask: CollisionFilter::default().mask,
            sleep_speed: Sleep::default().speed,
            sleep_time: Sleep::default().time,
            element_law: SINEW_ELEMENT_LAW_ST_VENANT_KIRCHHOFF,
            orientation: [0.0, 0.0, 0.0, 1.0],
            gravity_scale: 1.0,
            ..Self::empty()
        }
    }

    fn material(&self) -> Result<Option<Material>> {
        let model = match self.material {
            SINEW_MATERIAL_NONE => {
                for (name, value) in [
                    ("young_modulus", self.young_modulus),
                    ("poisson_ratio", self.poisson_ratio),
                    ("density", self.density),
                    ("thickness", self.thickness),
                ] {
                    ensure!(
                        value == 0.0,
                        "{name} is {value} while material is SINEW_MATERIAL_NONE: must be 0"
                    );
                }
                return Ok(None);
            }
            SINEW_MATERIAL_SPRINGS => Model::Springs,
            SINEW_MATERIAL_TETRAHEDRA => Model::Tetrahedra,
            unknown => {
                return Err(Error::invalid(format!("material is {unknown}: no SINEW_MATERIAL_...")));
            }
        };
        Ok(Some(Material {
            model,
            young_modulus: self.young_modulus,
            poisson_ratio: self.poisson_ratio,
            density: self.density,
            thickness: self.thickness,
        }))
    }

    fn element_law(&self) -> Result<ElementLaw> {
        let law = match self.element_law {
            SINEW_ELEMENT_LAW_ST_VENANT_KIRCHHOFF => ElementLaw::StVenantKirchhoff,
            SINEW_ELEMENT_LAW_NEO_HOOKEAN => ElementLaw::NeoHookean,
            SINEW_ELEMENT_LAW_MOONEY_RIVLIN => ElementLaw::MooneyRivlin {
                ratio: self.mooney_ratio,
            },
            unknown => {
                return Err(Error::invalid(format!(
                    "element_law is {unknown}: no SINEW_ELEMENT_LAW_..."
                )));
            }
        };
        ensure!(
            self.mooney_ratio == 0.0 || matches!(law, ElementLaw::MooneyRivlin { .. }),
            "mooney_ratio is {} while element_law is not SINEW_ELEMENT_LAW_MOONEY_RIVLIN: must be 0",
            self.mooney_ratio
        );
        Ok(law)
    }

    fn contact(&self) -> Result<BodyContact> {
        Ok(BodyContact {
            thickness: self.contact_thickness,
            friction: self.contact_friction,
            with_bodies: memory::flag("meets_bodies", self.meets_bodies)?,
            with_itself: memory::flag("meets_itself", self.meets_itself)?,
            detection: detection("contact_detection", self.contact_detection)?,
            resolution: self.contact_resolution,
            filter: CollisionFilter {
                category: self.collision_category,
                mask: self.collision_mask,
            },
        })
    }

    fn spring_law(&self) -> Result<SpringLaw> {
        let numbers = [
            ("spring_steepness", self.spring_steepness),
            ("spring_quadratic", self.spring_quadratic),
            ("spring_cubic", self.spring_cubic),
            ("spring_limit", self.spring_limit),
        ];
        let (law, name, used) = match self.spring_law {
            SINEW_SPRING_LAW_LINEAR => (SpringLaw::Linear, "SINEW_SPRING_LAW_LINEAR", [false; 4]),
            SINEW_SPRING_LAW_EXPONENTIAL => (
                SpringLaw::Exponential {
                    steepness: self.spring_steepness,
                    limit: self.spring_limit,
                },
                "SINEW_SPRING_LAW_EXPONENTIAL",
                [true, false, false, true],
            ),
            SINEW_SPRING_LAW_CUBIC => (
                SpringLaw::Cubic {
                    quadratic: self.spring_quadratic,
                    cubic: self.spring_cubic,
                    limit: self.spring_limit,
                },
                "SINEW_SPRING_LAW_CUBIC",
                [false, true, true, true],
            ),
            unknown => {
                return Err(Error::invalid(format!(
                    "spring_law is {unknown}: no SINEW_SPRING_LAW_..."
                )));
            }
        };
        match numbers
            .iter()
            .zip(used)
            .find(|((_, value), used)| !used && *value != 0.0)
        {
            None => Ok(law),
            Some(((number, value), _)) => Err(Error::invalid(format!(
                "{number} is {value} while spring_law is {name}: must be 0"
            ))),
        }
    }

    /// The definition with its arrays found.
    ///
    /// # Safety
    /// Every array is NULL or has as many entries as the definition states.
    pub(super) unsafe fn definition<'a>(&self) -> Result<BodyDefinition<'a>> {
        memory::reserved("reserved", self.reserved)?;
        ensure!(
            !self.springs.is_null() || self.spring_count == 0,
            "springs is NULL while spring_count is {}",
            self.spring_count
        );
        let springs = self.spring_count;
        let nodes = self.node_count;
        let tetrahedra = self.tetrahedron_count;
        let directions = memory::optional_array("fibre_directions", self.fibre_directions.cast(), tetrahedra)?;
        Ok(BodyDefinition {
            positions: memory::array("positions", self.positions.cast(), nodes)?,
            rest_positions: memory::optional_array("rest_positions", self.rest_positions.cast(), nodes)?,
            masses: values("masses", self.masses, nodes, self.node_mass)?,
            node_dampings: values("node_dampings", self.node_dampings, nodes, self.node_damping)?,
            damping_rate: self.damping_rate,
            springs: memory::optional_array("springs", self.springs.cast(), springs)?,
            stiffnesses: values("stiffnesses", self.stiffnesses, springs, self.stiffness)?,
            rest_lengths: memory::optional_array("rest_lengths", self.rest_lengths, springs)?,
            spring_dampings: values("spring_dampings", self.spring_dampings, springs, self.spring_damping)?,
            triangles: memory::array("triangles", self.triangles.cast(), self.triangle_count)?,
            tetrahedra: memory::array("tetrahedra", self.tetrahedra.cast(), self.tetrahedron_count)?,
            cells: memory::array("cells", self.cells.cast(), self.cell_count)?,
            material: self.material()?,
            home_stiffnesses: values("home_stiffnesses", self.home_stiffnesses, nodes, self.home_stiffness)?,
            bending_stiffness: self.bending_stiffness,
            spring_law: self.spring_law()?,
            element_law: self.element_law()?,
            fibre_directions: directions.unwrap_or(&[]),
            fibre_stiffnesses: values(
                "fibre_stiffnesses",
                self.fibre_stiffnesses,
                tetrahedra,
                self.fibre_stiffness,
            )?,
            viscosity: Viscosity {
                retardation_time: self.retardation_time,
                relaxation_time: self.relaxation_time,
            },
            yielding: Yielding {
                strain: self.yield_strain,
                largest: self.largest_set,
            },
            strain_limit: self.strain_limit,
            limit_stiffening: self.limit_stiffening,
            storage: match self.storage {
                SINEW_STORAGE_PACKED => Storage::Packed,
                SINEW_STORAGE_EFFICIENT => Storage::Efficient,
                SINEW_STORAGE_FAST_LINK => Storage::FastLink,
                SINEW_STORAGE_DYNAMIC_BULK => Storage::DynamicBulk,
                unknown => return Err(Error::invalid(format!("storage is {unknown}: no SINEW_STORAGE_..."))),
            },
            springs_per_node: self.springs_per_node,
            solver: match self.solver {
                SINEW_SOLVER_VERLET => Solver::Verlet,
                SINEW_SOLVER_IMPLICIT => Solver::Implicit,
                SINEW_SOLVER_NEWTON => Solver::Newton,
                SINEW_SOLVER_AUTO => Solver::Auto,
                unknown => return Err(Error::invalid(format!("solver is {unknown}: no SINEW_SOLVER_..."))),
            },
            order: self.order,
            iterations: self.iterations,
            accuracy: self.accuracy,
            mass_scaling: self.mass_scaling,
            volume_stiffness: self.volume_stiffness,
            enclosed_stiffness: self.enclosed_stiffness,
            pressure: self.pressure,
            contact: self.contact()?,
            sleep: Sleep {
                speed: self.sleep_speed,
                time: self.sleep_time,
            },
            spare_nodes: self.spare_nodes,
            toughness: self.toughness,
            tearing: Tearing {
                strain: self.tear_strain,
                force: self.tear_force,
                most_per_step: self.most_tears,
                smallest_piece: self.smallest_piece,
            },
        })
    }
}

/// The values of an array, or one for all where it is NULL.
///
/// # Safety
/// As [`memory::array`].
unsafe fn values<'a>(name: &str, pointer: *const f32, count: usize, uniform: f32) -> Result<Values<'a>> {
    let array = memory::optional_array(name, pointer, count)?;
    Ok(array.map_or(Values::Uniform(uniform), Values::Each))
}
