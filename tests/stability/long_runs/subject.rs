//! The bodies of the long runs: a shape, and the law of its forces.

use std::fmt;

use glam::{Vec3, Vec3Swizzles};
use sinew::mesh::Mesh;
use sinew::{BodyDefinition, Material, Model, Solver, SpringLaw, Values, Viscosity};

use super::scene::Scene;
use crate::support::solid::{ball, real};

/// Of soft tissue, Pa and kg/m³.
const YOUNG: f32 = 5400.0;
const DENSITY: f32 = 1060.0;

/// Thickness of surfaces, m.
const THICKNESS: f32 = 0.001;

/// Mass of a body of springs of given stiffness, kg.
const MASS: f32 = 0.2;

/// The ends, as a fraction of the length of the body.
const HELD: f32 = 0.1;

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Shape {
    Organ,
    /// The organ as coarse as it can be.
    SmallOrgan,
    Stomach,
    Flap,
    Liver,
    Gallbladder,
    Cloth,
    Lattice,
    Balloon,
}

impl Shape {
    pub fn name(self) -> &'static str {
        match self {
            Shape::Organ => "organ",
            Shape::SmallOrgan => "small organ",
            Shape::Stomach => "stomach",
            Shape::Flap => "flap",
            Shape::Liver => "liver",
            Shape::Gallbladder => "gallbladder",
            Shape::Cloth => "cloth",
            Shape::Lattice => "lattice",
            Shape::Balloon => "balloon",
        }
    }

    /// `None` if its file is missing.
    fn mesh(self) -> Option<Mesh> {
        let made = match self {
            Shape::Organ => Mesh::organ(0.15, 0.012),
            Shape::SmallOrgan => Mesh::organ(0.15, 0.15 / 8.0),
            Shape::Stomach => return real("stomach.msh", 1e-3),
            Shape::Flap => return real("tissue_volume.msh", 1.0),
            Shape::Liver => return real("liver_volumetric.vtk", 1e-3),
            Shape::Gallbladder => return real("gallbladder_volumetric.vtk", 1e-3),
            Shape::Cloth => Mesh::cloth([0.3; 2], [16; 2]),
            Shape::Lattice => Mesh::lattice(0.02, [8, 3, 3]),
            Shape::Balloon => Ok(ball(0.05, 2)),
        };
        Some(made.expect("a mesh"))
    }

    /// The direction from the free end to the pinned end.
    fn axis(self) -> Vec3 {
        match self {
            Shape::Stomach | Shape::Balloon => Vec3::Y,
            _ => Vec3::NEG_X,
        }
    }
}

/// The law of the forces in a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Law {
    /// Springs of this stiffness, N/m.
    Springs(f32),
    /// Springs from Young's modulus.
    Young,
    /// Finite elements of this Poisson's ratio.
    Elements(f32),
}

/// A term beside the law.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Extra {
    #[default]
    Nothing,
    /// Tetrahedra keep their volume.
    Volume,
    /// The surface resists bending.
    Bending,
    /// A spring and a dashpot in series, parallel to the elastic law.
    Maxwell,
    /// A dashpot parallel to the elastic law.
    Voigt,
    /// Fibers along the body.
    Fibres,
    /// Springs stiffen exponentially.
    Exponential,
    /// Springs stiffen with the cube of their strain.
    Cubic,
    /// Springs are much stiffer above a strain.
    Limited,
    /// Anchor springs pull nodes to their rest positions.
    Home,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Matter {
    pub shape: Shape,
    pub law: Law,
    pub extra: Extra,
}

impl fmt::Display for Matter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.shape.name())?;
        match self.law {
            Law::Springs(stiffness) => write!(f, ", springs of {stiffness} N/m")?,
            Law::Young => f.write_str(", springs by modulus")?,
            Law::Elements(ratio) => write!(f, ", elements {ratio:.2}")?,
        }
        match self.extra {
            Extra::Nothing => Ok(()),
            extra => write!(f, ", {}", format!("{extra:?}").to_lowercase()),
        }
    }
}

/// A body to be created.
pub struct Subject {
    pub matter: Matter,
    mesh: Mesh,
    /// Nodal masses, kg.
    pub masses: Vec<f32>,
    /// The nodes at the pinned end and at the free end.
    pub ends: [Vec<u32>; 2],
    /// The direction from the free end to the pinned end.
    pub axis: Vec3,
    /// Extent along the axis, m.
    pub length: f32,
    fibres: Vec<Vec3>,
    dampings: Vec<f32>,
}

impl Subject {
    /// With node damping of `rate`, 1/s. `None` if a file is missing.
    pub fn new(matter: Matter, rate: f32) -> Option<Self> {
        let mesh = matter.shape.mesh()?;
        let axis = matter.shape.axis();
        let heights: Vec<f32> = mesh.positions.iter().map(|p| p.dot(axis)).collect();
        let low = heights.iter().copied().fold(f32::INFINITY, f32::min);
        let high = heights.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        let length = high - low;
        let within = |is_there: &dyn Fn(f32) -> bool| -> Vec<u32> {
            let nodes = (0..).zip(&heights).filter(|&(_, &height)| is_there(height));
            nodes.map(|(node, _)| node).collect()
        };
        let ends = [
            within(&|height| height > high - HELD * length),
            within(&|height| height < low + HELD * length),
        ];
        let fibres = match matter.extra {
            Extra::Fibres => vec![axis; mesh.tetrahedra.len()],
            _ => Vec::new(),
        };
        let mut subject = Self {
            matter,
            masses: Vec::new(),
            ends,
            axis,
            length,
            fibres,
            dampings: vec![0.0; mesh.positions.len()],
            mesh,
        };
        let scene = Scene::new(&subject.definition(Solver::Verlet), Vec3::ZERO);
        let nodes = 0..scene.body().node_count() as u32;
        subject.masses = nodes
            .map(|node| scene.body().node_mass(node).expect("a node"))
            .collect();
        subject.dampings = subject.masses.iter().map(|mass| rate * mass).collect();
        Some(subject)
    }

    /// A direction perpendicular to the axis.
    pub fn across(&self) -> Vec3 {
        self.axis.zxy().abs()
    }

    pub fn definition(&self, solver: Solver) -> BodyDefinition<'_> {
        let mesh = &self.mesh;
        let is_surface = mesh.tetrahedra.is_empty() && mesh.cells.is_empty();
        let definition = BodyDefinition {
            triangles: if is_surface { &mesh.triangles } else { &[] },
            node_dampings: Values::Each(&self.dampings),
            solver,
            ..BodyDefinition::of(mesh)
        };
        let definition = match self.matter.shape {
            // Its filling is nearly incompressible.
            Shape::Balloon => BodyDefinition {
                pressure: 20.0,
                enclosed_stiffness: 1e4,
                ..definition
            },
            _ => definition,
        };
        self.with_extra(self.with_law(definition, is_surface))
    }

    fn with_law<'a>(&'a self, definition: BodyDefinition<'a>, is_surface: bool) -> BodyDefinition<'a> {
        let material = Material {
            young_modulus: YOUNG,
            density: DENSITY,
            thickness: if is_surface { THICKNESS } else { 0.0 },
            ..Material::default()
        };
        match self.matter.law {
            Law::Springs(stiffness) => BodyDefinition {
                stiffnesses: Values::Uniform(stiffness),
                masses: Values::Uniform(MASS / self.mesh.positions.len() as f32),
                ..definition
            },
            Law::Young => BodyDefinition {
                material: Some(material),
                ..definition
            },
            Law::Elements(poisson_ratio) => BodyDefinition {
                material: Some(Material {
                    model: Model::Tetrahedra,
                    poisson_ratio,
                    ..material
                }),
                ..definition
            },
        }
    }

    fn with_extra<'a>(&'a self, mut definition: BodyDefinition<'a>) -> BodyDefinition<'a> {
        match self.matter.extra {
            Extra::Nothing => {}
            Extra::Volume => definition.volume_stiffness = 0.5 * YOUNG,
            Extra::Bending => definition.bending_stiffness = YOUNG * THICKNESS.powi(3) / 12.0 * 100.0,
            Extra::Maxwell => {
                definition.viscosity = Viscosity {
                    retardation_time: 0.02,
                    relaxation_time: 0.02,
                }
            }
            Extra::Voigt => {
                definition.viscosity = Viscosity {
                    retardation_time: 0.001,
                    relaxation_time: 0.0,
                }
            }
            Extra::Fibres => {
                definition.fibre_directions = &self.fibres;
                definition.fibre_stiffnesses = Values::Uniform(2.0 * YOUNG);
            }
            Extra::Exponential => {
                definition.spring_law = SpringLaw::Exponential {
                    steepness: 5.0,
                    limit: 0.5,
                }
            }
            Extra::Cubic => {
                definition.spring_law = SpringLaw::Cubic {
                    quadratic: 1.0,
                    cubic: 20.0,
                    limit: 0.5,
                }
            }
            Extra::Limited => definition.strain_limit = 0.1,
            Extra::Home => definition.home_stiffnesses = Values::Uniform(1.0),
        }
        definition
    }
}
