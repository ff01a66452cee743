//! What a body is made of.

use super::guard::guard;
use super::memory::{self, versioned};
use super::status::sinew_status;

/// Layout optimized for the processor; default.
pub const SINEW_STORAGE_PACKED: u32 = 0;
/// Linked list per node, one allocation per link; for comparison.
pub const SINEW_STORAGE_EFFICIENT: u32 = 1;
/// One array with springs_per_node slots per node; for comparison.
pub const SINEW_STORAGE_FAST_LINK: u32 = 2;
/// Chain of arrays of springs_per_node slots; for comparison.
pub const SINEW_STORAGE_DYNAMIC_BULK: u32 = 3;

/// Explicit; takes as many substeps as stability needs.
pub const SINEW_SOLVER_VERLET: u32 = 0;
/// Implicit; stable at any step size.
pub const SINEW_SOLVER_IMPLICIT: u32 = 1;
/// Reference: IMPLICIT solved to double precision; slow.
pub const SINEW_SOLVER_NEWTON: u32 = 2;
/// VERLET or IMPLICIT, see sinew_solver_report; default.
pub const SINEW_SOLVER_AUTO: u32 = 3;

/// Springs as given, or one stiffness for all. Default.
pub const SINEW_MATERIAL_NONE: u32 = 0;
/// Springs along element edges, of young_modulus.
///
/// Poisson's ratio is 1/4 for tetrahedra and cells, 1/3 in the plane for triangles.
pub const SINEW_MATERIAL_SPRINGS: u32 = 1;
/// Finite elements of element_law, with the springs given.
///
/// Accurate up to a compression of about 20 %, stable beyond.
pub const SINEW_MATERIAL_TETRAHEDRA: u32 = 2;

/// Force = stiffness * rest length * strain e. Default.
pub const SINEW_SPRING_LAW_LINEAR: u32 = 0;
/// J-shaped: (exp(spring_steepness e) - 1) / spring_steepness up to spring_limit, linear beyond.
pub const SINEW_SPRING_LAW_EXPONENTIAL: u32 = 1;
/// Polynomial: e + spring_quadratic e^2 + spring_cubic e^3 up to spring_limit, linear beyond.
pub const SINEW_SPRING_LAW_CUBIC: u32 = 2;

/// With a volume term; default.
pub const SINEW_ELEMENT_LAW_ST_VENANT_KIRCHHOFF: u32 = 0;
/// Stable (Smith, de Goes, Kim 2018).
pub const SINEW_ELEMENT_LAW_NEO_HOOKEAN: u32 = 1;
/// See mooney_ratio.
pub const SINEW_ELEMENT_LAW_MOONEY_RIVLIN: u32 = 2;

/// Geometry, material and settings of a body.
///
/// Filled by sinew_body_def_init; read only during sinew_body_create.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_body_def {
    /// Size of this struct; sinew_body_def_init sets it.
    pub struct_size: usize,
    /// [m] 3 * node_count floats.
    pub positions: *const f32,
    /// [m] 3 * node_count floats; nullable: positions.
    pub rest_positions: *const f32,
    /// Number of nodes, at least 1.
    pub node_count: usize,
    /// [kg] node_count floats, each at least 1e-37, or 0 for a permanent pin; nullable: node_mass.
    ///
    /// IMPLICIT rolls a body back if mass / dt^2 is not a finite float.
    pub masses: *const f32,
    /// [N s/m] node_count floats of drag; nullable: node_damping.
    pub node_dampings: *const f32,
    /// [kg] Mass of each node, at least 1e-37; no default. 0 with a density.
    pub node_mass: f32,
    /// [N s/m] Drag on each node: force = -node_damping * velocity.
    pub node_damping: f32,
    /// 2 * spring_count node indices, each pair once; nullable: the element edges, each once.
    ///
    /// NULL excludes the arrays with one value per spring. A pointer with spring_count 0 means no springs.
    pub springs: *const u32,
    /// Number of springs given.
    pub spring_count: usize,
    /// [N/m] spring_count floats; nullable: stiffness.
    pub stiffnesses: *const f32,
    /// [m] spring_count floats; nullable: from the rest positions.
    pub rest_lengths: *const f32,
    /// [N s/m] spring_count floats; nullable: spring_damping.
    pub spring_dampings: *const f32,
    /// [N/m] Stiffness of each spring; 0 for TETRAHEDRA without springs.
    pub stiffness: f32,
    /// [N s/m] Damping of each spring; 0 for TETRAHEDRA without springs.
    pub spring_damping: f32,
    /// 3 * triangle_count node indices, outward: the render and contact surface.
    ///
    /// Nullable: the boundary of the tetrahedra or cells. Inward faces of tetrahedra are turned.
    pub triangles: *const u32,
    /// Number of triangles given.
    pub triangle_count: usize,
    /// 4 * tetrahedron_count node indices; nullable: no tetrahedra.
    pub tetrahedra: *const u32,
    /// Number of tetrahedra given.
    pub tetrahedron_count: usize,
    /// Spring storage, a sinew_storage value.
    pub storage: u32,
    /// Slots per node (FAST_LINK) or per array (DYNAMIC_BULK); 0 (default): from the springs given.
    pub springs_per_node: u32,
    /// Time integrator, a sinew_solver value; default AUTO.
    pub solver: u32,
    /// Reserved; must be 0.
    pub reserved: u32,
    /// IMPLICIT, NEWTON: 1 is implicit Euler; 2 or 0 is BDF2, far more accurate.
    pub order: u32,
    /// IMPLICIT, NEWTON: largest number of matrix-vector products per step, at most 1,000,000.
    ///
    /// 0 (default) is 1000 for IMPLICIT, 100,000 for NEWTON. Each part of a subdivided step gets at least 1/32 of it.
    /// If less than 256, a step beside a tool may take seven times as many, at most 128 more, before it is subdivided.
    pub iterations: u32,
    /// IMPLICIT, NEWTON: error of the linear solve, 1e-6 to 1, relative to the displacement that forces cause in the
    /// step.
    ///
    /// 0 is 0.01 for IMPLICIT, 1e-6 for NEWTON.
    pub accuracy: f32,
    /// VERLET: largest fraction of the body's mass added to nodes that shorten the substep, 0 to 1; default 0.001.
    ///
    /// A step that would be refused may add more. Mass is added only if it saves 1/4 of the substeps, never with fixed
    /// substeps or a tolerance. It adds inertia but no weight.
    pub mass_scaling: f32,
    /// 8 * cell_count node indices of equal lattice cubes; nullable: no cells.
    ///
    /// Corner bits: x 1, y 2, z 4. Springs are the edges and face diagonals.
    pub cells: *const u32,
    /// Number of cells given.
    pub cell_count: usize,
    /// A sinew_material value: how tetrahedra or cells, or else triangles, make forces; default NONE.
    ///
    /// SPRINGS needs springs NULL and stiffness 0. Cells must be cubes of one size within 0.1 %.
    pub material: u32,
    /// [Pa] Young's modulus at small strain, above 0 with a material, else 0.
    ///
    /// Exact for cells and equilateral triangles; an irregular mesh of springs is 4 to 8 % softer, one or two layers of
    /// tetrahedra are much softer.
    pub young_modulus: f32,
    /// TETRAHEDRA: 0 to 0.49; SPRINGS: 0 or the implied value +- 0.001.
    pub poisson_ratio: f32,
    /// [kg/m^3] Above 0: nodes share the mass of their elements; 0 (default): masses or node_mass.
    ///
    /// Every node must then belong to an element, masses be NULL and node_mass 0.
    pub density: f32,
    /// [m] Thickness of a material that fills triangles, above 0; else 0.
    pub thickness: f32,
    /// [Pa] Resistance of each tetrahedron to volume change and inversion; 0 with TETRAHEDRA.
    ///
    /// 0.3 to 0.6 of Young's modulus lets a body of springs recover from inversion.
    pub volume_stiffness: f32,
    /// [N/m] node_count floats; nullable: home_stiffness.
    pub home_stiffnesses: *const f32,
    /// [N/m] Stiffness of anchor springs, which pull nodes to rest positions.
    pub home_stiffness: f32,
    /// [N m] Flexural rigidity of triangles: E t^3 / (12 (1 - nu^2)) for a sheet of thickness t.
    ///
    /// Exact for equilateral triangles. An edge of more than two triangles is refused.
    pub bending_stiffness: f32,
    /// Force law, a sinew_spring_law value; later springs are linear.
    pub spring_law: u32,
    /// EXPONENTIAL: above 0, at most 13.8 / spring_limit; else 0.
    pub spring_steepness: f32,
    /// CUBIC: its square is at most 3 * spring_cubic; else 0.
    pub spring_quadratic: f32,
    /// CUBIC: cubic coefficient, at least 0; else 0.
    pub spring_cubic: f32,
    /// EXPONENTIAL, CUBIC: strain beyond which the law is linear, above 0; else 0.
    pub spring_limit: f32,
    /// [Pa] Fiber stiffness of each tetrahedron.
    pub fibre_stiffness: f32,
    /// 3 * tetrahedron_count floats: unit fiber directions at rest, or 0 for no fibers; nullable.
    ///
    /// Fibers pull in proportion to their extension and never push.
    pub fibre_directions: *const f32,
    /// [Pa] tetrahedron_count floats; nullable: fibre_stiffness.
    pub fibre_stiffnesses: *const f32,
    /// [s] Viscosity of springs and elements divided by their stiffness, 0 to 1e6.
    ///
    /// It acts in parallel with the stiffness. Later springs have none. From about 0.001 s on use IMPLICIT: VERLET
    /// needs short substeps.
    pub retardation_time: f32,
    /// [s] Relaxation time of the Maxwell branch, 1e-9 to 1e6; 0: a Kelvin-Voigt solid.
    ///
    /// After a strain step the stress is E (1 + retardation_time / relaxation_time exp(-t / relaxation_time)). Bodies
    /// start relaxed; sinew_body_set_positions relaxes them.
    pub relaxation_time: f32,
    /// Strain at which springs and elements yield; 0: never. Strain beyond it is permanent.
    ///
    /// It needs SINEW_SPRING_LAW_LINEAR; later springs do not yield. Long steps slow that of tetrahedra.
    pub yield_strain: f32,
    /// With yield_strain: maximum plastic strain, above 0 and below 1; default 0.5. Elastic beyond.
    pub largest_set: f32,
    /// Strain above which springs stiffen; 0: none. Later springs do not.
    pub strain_limit: f32,
    /// Added stiffness beyond strain_limit as a multiple, above 0, at most 1e6; default 100.
    pub limit_stiffening: f32,
    /// [Pa] Stiffness of the volume inside closed surfaces.
    ///
    /// Energy of a cavity: enclosed_stiffness / 2 * V0 (V / V0 - 1)^2 - pressure (V - V0). Each connected surface
    /// component must be closed and is a cavity; if some are inverted, like the inner wall of a hollow organ, only
    /// those are. Cutting or removing a surface edge opens its cavity.
    pub enclosed_stiffness: f32,
    /// [Pa] Overpressure in cavities at rest volume, of any sign.
    ///
    /// It is constant without enclosed_stiffness. See sinew_body_set_pressure.
    pub pressure: f32,
    /// [m] Distance that tools and tissue keep from the surface, 0 to 1e9.
    pub contact_thickness: f32,
    /// Coulomb coefficient for tissue contact; the larger of two bodies' applies.
    ///
    /// Contact with a tool uses the friction of the tool.
    pub contact_friction: f32,
    /// 1: collides with other bodies that have 1; 0 (default): does not.
    pub meets_bodies: u32,
    /// 1: collides with itself; 0 (default): does not.
    ///
    /// The two sides of a cut then rest against each other; cut edges of a sheet may slide over each other.
    pub meets_itself: u32,
    /// Detection between bodies: SINEW_DETECTION_EXACT (default) or IMAGE_SPACE, if either asks for it.
    ///
    /// Self-collision is exact. SINEW_DETECTION_DISTANCE_FIELD is SINEW_STATUS_UNSUPPORTED.
    pub contact_detection: u32,
    /// [m] IMAGE_SPACE: pixel size; 0 (default): half of the mean surface edge. At most 2^24 pixels.
    pub contact_resolution: f32,
    /// Collision categories of this body; default 1. See base.h.
    pub collision_category: u32,
    /// Categories that it collides with; default 0xffffffff.
    pub collision_mask: u32,
    /// Number of nodes that cuts may add, about 5 per cut element; 0 (default): cannot be cut.
    ///
    /// Needs a consistently oriented 2-manifold surface, or tetrahedra connected through faces around each node;
    /// triangles, if given, are their boundary. 1 is enough for a body of springs alone.
    pub spare_nodes: u32,
    /// Fracture energy of a blade's cut: [J/m^2] for a solid; [J/m] for a surface, with its thickness.
    ///
    /// Above 0 it needs spare_nodes. SINEW_STATUS_UNSUPPORTED for a body of springs alone.
    pub toughness: f32,
    /// Strain above which a spring or an element edge tears; 0: never.
    ///
    /// A surface tears at the node with the larger separating force, across it; a solid along faces. A step that tears
    /// may allocate. See sinew_body_set_tear_limits.
    pub tear_strain: f32,
    /// [N] Force above which a spring tears; 0: never. SINEW_STATUS_UNSUPPORTED for elements alone.
    pub tear_force: f32,
    /// Maximum number of tears per step; 0: does not tear. Needs spare_nodes.
    pub most_tears: u32,
    /// Minimum fragment size at rest: [m^2], or [m^3] for solids.
    pub smallest_piece: f32,
    /// [m/s] Speed below which a node counts as at rest; 0 (default): never sleeps.
    ///
    /// Parts slower for sleep_time, which no force would make faster, are not stepped until something affects them.
    /// Only VERLET bodies without cuts sleep in parts. Touching bodies sleep together.
    pub sleep_speed: f32,
    /// [s] Time at rest before sleep, above 0; default 0.5.
    pub sleep_time: f32,
    /// Law of TETRAHEDRA, a sinew_element_law value; not 0: no viscosity or yield.
    pub element_law: u32,
    /// MOONEY_RIVLIN: c2 / (c1 + c2), 0 to 1.
    pub mooney_ratio: f32,
    /// [m] Translation of all positions, after the rotation; default 0 0 0.
    pub position: [f32; 3],
    /// Rotation of positions and fibers about the origin; default 0 0 0 1.
    pub orientation: [f32; 4],
    /// Factor of the world's gravity on this body, finite; default 1.
    pub gravity_scale: f32,
    /// [1/s] Drag on each node relative to its mass, added to node_damping.
    pub damping_rate: f32,
}

versioned! { sinew_body_def { order } }

/// Fills a body definition with its defaults; `struct_size` is sizeof(sinew_body_def).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_def_init(def: *mut sinew_body_def, struct_size: usize) -> sinew_status {
    guard(|| memory::initialise(def, struct_size, sinew_body_def::defaults()))
}
