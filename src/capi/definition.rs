//! What a body is made of.

use std::mem::offset_of;

use super::guard::guard;
use super::memory::{self, Versioned};
use super::status::sinew_status;
use super::tool::{SINEW_DETECTION_EXACT, detection};
use crate::base::{Error, Result};
use crate::def::{
    BodyContact, BodyDefinition, CollisionFilter, Material, Model, Sleep, Solver, SpringLaw, Storage, Tearing, Values,
    Viscosity, Yielding,
};

/// The default: laid out for the processor.
pub const SINEW_STORAGE_PACKED: u32 = 0;
/// A linked list per node, every link allocated on its own.
pub const SINEW_STORAGE_EFFICIENT: u32 = 1;
/// One array, springs_per_node places per node.
pub const SINEW_STORAGE_FAST_LINK: u32 = 2;
/// Per node, a chain of arrays of springs_per_node places.
pub const SINEW_STORAGE_DYNAMIC_BULK: u32 = 3;

/// Explicit, as many substeps as it needs to be stable.
pub const SINEW_SOLVER_VERLET: u32 = 0;
/// Stable at any step.
pub const SINEW_SOLVER_IMPLICIT: u32 = 1;
/// The accurate reference: the equations of IMPLICIT, solved to the last digits that count; slow.
pub const SINEW_SOLVER_NEWTON: u32 = 2;

/// Springs as they are given, or all of one stiffness.
pub const SINEW_MATERIAL_NONE: u32 = 0;
/// Springs along the edges of the elements, as stiff as young_modulus asks for. Poisson's ratio is what they imply: 1/4 for
/// tetrahedra and cells, 1/3 in the plane for triangles.
pub const SINEW_MATERIAL_SPRINGS: u32 = 1;
/// Tetrahedra as finite elements, St Venant and Kirchhoff's law with a signed volume term: of any Poisson's ratio from 0 to 0.49, right
/// up to compressions of some 20 % and stable beyond. There are no springs but those that are given. sinew_body_remove_spring takes
/// away the tetrahedra that have the edge, whether or not there is a spring along it.
pub const SINEW_MATERIAL_TETRAHEDRA: u32 = 2;

/// The pull of a spring is stiffness times rest length times its strain e, the part by which it is longer than at rest.
pub const SINEW_SPRING_LAW_LINEAR: u32 = 0;
/// Shaped like a J: instead of e, (exp(spring_steepness e) - 1) / spring_steepness for strains from 0 to spring_limit; linear beyond, as
/// stiff as there.
pub const SINEW_SPRING_LAW_EXPONENTIAL: u32 = 1;
/// Instead of e, e + spring_quadratic e^2 + spring_cubic e^3 up to a strain of spring_limit; linear beyond, as stiff as there.
pub const SINEW_SPRING_LAW_CUBIC: u32 = 2;

/// What a body is made of. Filled by sinew_body_def_init; used only during sinew_body_create.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_body_def {
    /// Set by sinew_body_def_init.
    pub struct_size: usize,
    /// 3 node_count floats, m.
    pub positions: *const f32,
    /// Nullable: positions.
    pub rest_positions: *const f32,
    /// At least 1.
    pub node_count: usize,
    /// node_count floats, kg, at least 1e-37, or 0: pinned for good; nullable: node_mass for all. With IMPLICIT a body whose masses
    /// over the square of a step's length are no finite floats is put back.
    pub masses: *const f32,
    /// node_count floats, N s/m: the gamma_i of m a = ... - gamma_i v; nullable: node_damping.
    pub node_dampings: *const f32,
    /// kg, at least 1e-37; no default. 0 where density gives each node its mass.
    pub node_mass: f32,
    /// N s/m; default 0.
    pub node_damping: f32,
    /// 2 spring_count node indices, each pair once; NULL: the edges of triangles, tetrahedra and cells, each once (then no
    /// per-spring arrays); not NULL with spring_count 0: no springs.
    pub springs: *const u32,
    /// Springs given.
    pub spring_count: usize,
    /// spring_count floats, N/m; nullable: stiffness for all.
    pub stiffnesses: *const f32,
    /// spring_count floats, m; nullable: from the rest positions.
    pub rest_lengths: *const f32,
    /// spring_count floats, N s/m along the spring; nullable: spring_damping.
    pub spring_dampings: *const f32,
    /// N/m; default 0; 0 with SINEW_MATERIAL_TETRAHEDRA where no springs are given.
    pub stiffness: f32,
    /// N s/m; default 0; 0 with SINEW_MATERIAL_TETRAHEDRA where no springs are given.
    pub spring_damping: f32,
    /// 3 triangle_count node indices, outward by the right-hand rule; nullable: the boundary of the tetrahedra or cells is what
    /// is drawn and touched.
    pub triangles: *const u32,
    /// Triangles given.
    pub triangle_count: usize,
    /// 4 tetrahedron_count node indices; nullable.
    pub tetrahedra: *const u32,
    /// Tetrahedra given.
    pub tetrahedron_count: usize,
    /// SINEW_STORAGE_...
    pub storage: u32,
    /// FAST_LINK: places of each node, SINEW_STATUS_CAPACITY where a node has more springs; DYNAMIC_BULK: places of each
    /// array. 0, the default: chosen from the springs given, as many as the node with the most has, or what takes the
    /// least memory. Other storages do not use it.
    pub springs_per_node: u32,
    /// SINEW_SOLVER_...
    pub solver: u32,
    /// 0.
    pub reserved: u32,
    /// IMPLICIT, NEWTON: 1, implicit Euler; 2, the second backward difference formula, which follows motion far better; 0, the
    /// default: 2.
    pub order: u32,
    /// IMPLICIT, NEWTON: how often the equation of a step may be multiplied out while it is solved. IMPLICIT: each takes about as
    /// long as a substep of VERLET; 0, the default: 1000. NEWTON: far longer; 0, the default: 100 000.
    /// Where a tool or a tolerance cuts the step, a thirty-second of it for each part at least. At most 1 000 000.
    pub iterations: u32,
    /// IMPLICIT, NEWTON: what may be missing of the solution of a step's equation, as a part of what forces change in the step;
    /// from 1e-6 to 1; 0, the default: 0.01, or 1e-6 with NEWTON.
    pub accuracy: f32,
    /// 0.
    pub reserved1: u32,
    /// VERLET: what part of the body's mass may be added, in all, to the nodes whose springs or elements would make substeps short,
    /// as those of slivers are; from 0 to 1; 0: none; default 0.001. Mass is added where that saves a quarter of the substeps or
    /// more, and no more than they need; never where the world's substeps are fixed or a tolerance is asked for. It is
    /// inertia alone: weight, and the force on a pin, stay as they are. See sinew_solver_report.
    pub mass_scaling: f32,
    /// 0.
    pub reserved2: u32,
    /// 8 cell_count node indices: cubes of a lattice, corners numbered by bits, x 1, y 2, z 4; nullable. Their springs are their
    /// edges and the diagonals of their faces.
    pub cells: *const u32,
    /// Cells given.
    pub cell_count: usize,
    /// SINEW_MATERIAL_...; NONE, the default: the four below are 0. Else it fills the tetrahedra or the cells, or where there are
    /// none the triangles, as they are at rest, and gives each spring its stiffness: springs is NULL and stiffness 0 then, and
    /// triangles beside tetrahedra or cells have no edges but theirs. Cells must be cubes of one size, within 0.001 and the
    /// rounding of their corners' coordinates.
    pub material: u32,
    /// Young's modulus at small strains, Pa, above 0. Exact for cells and equilateral triangles; an irregular mesh is some 4 to 8 %
    /// softer, one that is one or two tetrahedra thick far more.
    pub young_modulus: f32,
    /// SINEW_MATERIAL_SPRINGS: 0, the default, or what it implies within 0.001; SINEW_MATERIAL_TETRAHEDRA: from 0 to 0.49.
    pub poisson_ratio: f32,
    /// kg/m3, above 0: each node has its share of the mass of the elements about it (masses is NULL and node_mass 0 then, and
    /// every node belongs to an element); 0, the default: masses or node_mass.
    pub density: f32,
    /// m: above 0 where the material fills triangles, else 0.
    pub thickness: f32,
    /// Pa: how tetrahedra resist a change of their volume, each by itself, and turn back where they are inside out; at least 0; 0, the
    /// default: they do not. With 0.3 to 0.6 of Young's modulus a body of springs comes back to rest from anywhere. 0 with SINEW_MATERIAL_TETRAHEDRA, which keeps volume by itself.
    pub volume_stiffness: f32,
    /// node_count floats, N/m, at least 0: what draws each node back to its rest position, wherever the body is; nullable:
    /// home_stiffness for all.
    pub home_stiffnesses: *const f32,
    /// N/m; default 0: nothing does.
    pub home_stiffness: f32,
    /// N m, at least 0: the flexural rigidity of the surface that triangles make; default 0: it bends freely. Of a sheet of Young's
    /// modulus E, Poisson's ratio nu and thickness t it is E t^3 / (12 (1 - nu^2)). Each edge of two triangles turns back to its angle
    /// at rest, whether the surface is flat or curved there; an edge of more triangles is refused. Exact where triangles are equilateral;
    /// 5/6 of it along a side where they are squares that are cut alternately. sinew_body_remove_spring takes away the bending of
    /// triangles that have the edge, whether or not there is a spring along it.
    pub bending_stiffness: f32,
    /// SINEW_SPRING_LAW_...; LINEAR, the default: the four below are 0. Springs that are added later are linear.
    pub spring_law: u32,
    /// EXPONENTIAL: above 0, at most 13.8 / spring_limit; else 0.
    pub spring_steepness: f32,
    /// CUBIC: any number whose square is at most 3 spring_cubic, so that longer springs pull more; else 0.
    pub spring_quadratic: f32,
    /// CUBIC: at least 0; else 0.
    pub spring_cubic: f32,
    /// EXPONENTIAL, CUBIC: above 0; else 0.
    pub spring_limit: f32,
    /// Pa, at least 0; default 0.
    pub fibre_stiffness: f32,
    /// 3 tetrahedron_count floats: the direction of each tetrahedron's fibres at rest, 1 long within 0.001, or 0: it has none;
    /// nullable: there are none. Fibres pull where they are longer than at rest, by their stiffness times the part by which they are
    /// longer, over the area across them at rest; they never push.
    pub fibre_directions: *const f32,
    /// tetrahedron_count floats, Pa, at least 0; nullable: fibre_stiffness for all.
    pub fibre_stiffnesses: *const f32,
    /// s, at least 0, at most 1e6: the viscosity of a dashpot beside each spring and each tetrahedron that is an element, over its stiffness;
    /// default 0: there is none. Springs that are added later have none. VERLET takes substeps as short as a dashpot alone asks for: from
    /// some hundredths of a second on IMPLICIT is the solver for it.
    pub retardation_time: f32,
    /// s, from 1e-9 to 1e6: that of a spring in a row with the dashpot, so that after a step of strain the stress relaxes as
    /// E (1 + retardation_time / relaxation_time exp(-t / relaxation_time)): the standard linear solid. 0, the default: the dashpot acts
    /// alone, which is Kelvin and Voigt's solid, and on tetrahedra of order 1 in the step. A body begins relaxed, and is
    /// so where sinew_body_set_positions puts it.
    pub relaxation_time: f32,
    /// The strain from which springs, and rods of tetrahedra that are elements, yield, stretched or pressed, at least 0; default 0: they do
    /// not. What is beyond it stays for good. Springs that yield have SINEW_SPRING_LAW_LINEAR; those that are added later do not yield.
    /// Springs yield within a step; tetrahedra do where a substep of VERLET or a step of the other solvers ends: with those, a load that
    /// deforms them further and further does so the more slowly the longer steps are.
    pub yield_strain: f32,
    /// By what part of its rest length it may become longer or shorter for good, above 0 and below 1 where yield_strain is given; default
    /// 0.5. Beyond that it is elastic again.
    pub largest_set: f32,
    /// The strain of springs from which they are stiffer, at least 0; default 0: there is none. Springs that are added later have none.
    pub strain_limit: f32,
    /// How many times their stiffness is added beyond it, above 0, at most 1e6 where strain_limit is given; default 100.
    pub limit_stiffening: f32,
    /// Pa, at least 0: how the volume inside of a closed surface resists a change; default 0: it does not. The energy of each cavity of
    /// volume V, V0 at rest, is enclosed_stiffness / 2 V0 (V/V0 - 1)^2 - pressure (V - V0). The surface is triangles, or where there are
    /// none the boundary of the tetrahedra or cells; each of its parts that hang together by edges must be closed and have a volume. Each is a
    /// cavity of its own, unless some are inside out, as the inner wall of a hollow organ is: then those alone are cavities.
    /// sinew_body_remove_spring opens the cavities whose triangles have the edge, for good, and a cut those of which it divides or parts
    /// triangles, however little: what is open is neither kept nor pressed. A cut beside a cavity leaves it.
    pub enclosed_stiffness: f32,
    /// Pa: by how much the pressure inside of a cavity that has its volume at rest is above that outside; below 0 it sucks; default 0. Without an
    /// enclosed_stiffness it stays the same however large the cavity becomes. See sinew_body_set_pressure.
    pub pressure: f32,
    /// m, 0 to 1e9: what tools and other tissue keep off the surface; default 0.
    pub contact_thickness: f32,
    /// Coulomb coefficient with other tissue and with itself, at least 0; of two bodies that meet, the larger holds; default 0. With tools
    /// the tool's own holds.
    pub contact_friction: f32,
    /// 1: it meets other bodies that have 1 here; 0, the default: it does not.
    pub meets_bodies: u32,
    /// 1: it meets itself; 0, the default: it does not. The two sides of a cut meet from then on, at no distance: they part freely, and rest against
    /// each other where they are pressed together again; the rims of a sheet may slide over each other until they have parted.
    pub meets_itself: u32,
    /// How it and other bodies find each other: SINEW_DETECTION_EXACT, the default, or SINEW_DETECTION_IMAGE_SPACE, which one of two has to ask
    /// for: then both are drawn in each substep along three axes where their boxes overlap, and what is seen near each other is compared
    /// exactly. Itself it always meets exactly. SINEW_DETECTION_DISTANCE_FIELD is for rigid tools: SINEW_STATUS_UNSUPPORTED.
    pub contact_detection: u32,
    /// IMAGE_SPACE: m, the side of a pixel; 0, the default: half of the surface's mean edge. An image of a body of more than 2^24 pixels is
    /// refused.
    pub contact_resolution: f32,
    /// The categories that it belongs to, a bit for each; default 1. It meets tools and bodies where each has a category that the other's
    /// mask has.
    pub collision_category: u32,
    /// The categories that it meets, a bit for each; default 0xffffffff.
    pub collision_mask: u32,
    /// How many nodes cuts may add, of which room is made: some five for each triangle or tetrahedron that a blade passes through. 0, the default:
    /// the body cannot be cut, and pays nothing for it. A surface that is to be cut is one of triangles turned one way all over, of which two at most
    /// have an edge and those about a node hang together; a solid is one of tetrahedra of which those about a node hang together by faces at it,
    /// and triangles are its boundary, if there are any. A body of springs alone loses those that a blade passes through, and needs no room: 1
    /// will do. See sinew_body_cut.
    pub spare_nodes: u32,
    /// J/m, at least 0: what a blade (sinew_blade_create) spends for each metre of a cut, at rest: the fracture toughness of the material, J/m^2,
    /// times the thickness of the surface. Of tetrahedra the toughness itself, J/m^2. Springs alone have none (SINEW_STATUS_UNSUPPORTED); default 0: it is cut for nothing.
    pub toughness: f32,
    /// The part of its rest length by which a spring may become longer, at least 0; 0, the default: any. A spring that a step has left beyond its
    /// limits tears the surface, as sinew_body_cut cuts it, through that of its nodes which is pulled apart with the larger force, across that
    /// force and as far as the next triangle (O'Brien, Hodgins 1999); where a cut ends in a triangle next to the spring, that goes on
    /// instead. A solid tears at that of them about which the material is stretched more, across that and along faces of its tetrahedra; of
    /// tetrahedra that are elements each edge has the limit of a spring. See sinew_body_set_tear_limits for single springs, and sinew_body_get_tear_report. A step in which something is
    /// beyond its limits may allocate.
    pub tear_strain: f32,
    /// N, at least 0: how much a spring may pull; 0, the default: any amount. What a cut leaves of a spring bears its part. Edges of elements
    /// have no such limit: SINEW_STATUS_UNSUPPORTED where a body has elements and no springs.
    pub tear_force: f32,
    /// The most tears in a step, those of the most loaded springs; 0, the default: the body does not tear, and pays nothing for it. Else
    /// spare_nodes is above 0.
    pub most_tears: u32,
    /// m2, of solids m3, at least 0: a tear that would part a piece with less area or volume at rest is not made; default 0.
    pub smallest_piece: f32,
    /// m/s, at least 0: what is slower is at rest; 0, the default: the body never sleeps, and pays nothing for it. Else parts of it that have
    /// been at rest for sleep_time, and on which no force acts that would make them as fast in that time, stand still and are not stepped
    /// until a neighbour, a force, a pin, a tool, a cut or a changed property reaches them. Speed by time is about how far off their places
    /// may be. Parts of the body sleep by themselves with SINEW_SOLVER_VERLET, where it is made of springs and elements alone and was not cut; else
    /// all of it does or nothing. What meets other tissue or is sewn to it does not sleep. See sinew_body_get_awake_share.
    pub sleep_speed: f32,
    /// s, above 0: some times what the tissue takes to settle; default 0.5.
    pub sleep_time: f32,
}

// SAFETY: repr(C), begins with struct_size; numbers and pointers, which any bits are.
unsafe impl Versioned for sinew_body_def {
    const SIZES: &'static [usize] = &[
        offset_of!(Self, order),
        offset_of!(Self, mass_scaling),
        offset_of!(Self, cells),
        offset_of!(Self, home_stiffnesses),
        offset_of!(Self, retardation_time),
        offset_of!(Self, contact_thickness),
        offset_of!(Self, spare_nodes),
        offset_of!(Self, sleep_speed),
        size_of::<Self>(),
    ];
    const NAME: &'static str = "sinew_body_def";
}

impl sinew_body_def {
    pub(super) fn defaults() -> Self {
        Self {
            struct_size: size_of::<Self>(),
            positions: std::ptr::null(),
            rest_positions: std::ptr::null(),
            node_count: 0,
            masses: std::ptr::null(),
            node_dampings: std::ptr::null(),
            node_mass: 0.0,
            node_damping: 0.0,
            springs: std::ptr::null(),
            spring_count: 0,
            stiffnesses: std::ptr::null(),
            rest_lengths: std::ptr::null(),
            spring_dampings: std::ptr::null(),
            stiffness: 0.0,
            spring_damping: 0.0,
            triangles: std::ptr::null(),
            triangle_count: 0,
            tetrahedra: std::ptr::null(),
            tetrahedron_count: 0,
            storage: SINEW_STORAGE_PACKED,
            springs_per_node: 0,
            solver: SINEW_SOLVER_VERLET,
            reserved: 0,
            order: 0,
            iterations: 0,
            accuracy: 0.0,
            reserved1: 0,
            mass_scaling: BodyDefinition::default().mass_scaling,
            reserved2: 0,
            cells: std::ptr::null(),
            cell_count: 0,
            material: SINEW_MATERIAL_NONE,
            young_modulus: 0.0,
            poisson_ratio: 0.0,
            density: 0.0,
            thickness: 0.0,
            volume_stiffness: 0.0,
            home_stiffnesses: std::ptr::null(),
            home_stiffness: 0.0,
            bending_stiffness: 0.0,
            spring_law: SINEW_SPRING_LAW_LINEAR,
            spring_steepness: 0.0,
            spring_quadratic: 0.0,
            spring_cubic: 0.0,
            spring_limit: 0.0,
            fibre_stiffness: 0.0,
            fibre_directions: std::ptr::null(),
            fibre_stiffnesses: std::ptr::null(),
            retardation_time: 0.0,
            relaxation_time: 0.0,
            yield_strain: 0.0,
            largest_set: Yielding::default().largest,
            strain_limit: 0.0,
            limit_stiffening: BodyDefinition::default().limit_stiffening,
            enclosed_stiffness: 0.0,
            pressure: 0.0,
            contact_thickness: 0.0,
            contact_friction: 0.0,
            meets_bodies: 0,
            meets_itself: 0,
            contact_detection: SINEW_DETECTION_EXACT,
            contact_resolution: 0.0,
            collision_category: CollisionFilter::default().category,
            collision_mask: CollisionFilter::default().mask,
            spare_nodes: 0,
            toughness: 0.0,
            tear_strain: 0.0,
            tear_force: 0.0,
            most_tears: 0,
            smallest_piece: 0.0,
            sleep_speed: Sleep::default().speed,
            sleep_time: Sleep::default().time,
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
                    if value != 0.0 {
                        return Err(Error::invalid(format!(
                            "{name} is {value} while material is SINEW_MATERIAL_NONE: must be 0"
                        )));
                    }
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

    fn contact(&self) -> Result<BodyContact> {
        let flag = |name: &str, value: u32| match value {
            0 => Ok(false),
            1 => Ok(true),
            _ => Err(Error::invalid(format!("{name} is {value}: must be 0 or 1"))),
        };
        Ok(BodyContact {
            thickness: self.contact_thickness,
            friction: self.contact_friction,
            with_bodies: flag("meets_bodies", self.meets_bodies)?,
            with_itself: flag("meets_itself", self.meets_itself)?,
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
        memory::reserved("reserved1", self.reserved1)?;
        memory::reserved("reserved2", self.reserved2)?;
        if self.springs.is_null() && self.spring_count > 0 {
            return Err(Error::invalid(format!(
                "springs is NULL while spring_count is {}",
                self.spring_count
            )));
        }
        let springs = self.spring_count;
        let nodes = self.node_count;
        let tetrahedra = self.tetrahedron_count;
        // SAFETY: the same contract.
        unsafe {
            let directions = memory::optional_array("fibre_directions", self.fibre_directions.cast(), tetrahedra)?;
            Ok(BodyDefinition {
                positions: memory::array("positions", self.positions.cast(), nodes)?,
                rest_positions: memory::optional_array("rest_positions", self.rest_positions.cast(), nodes)?,
                masses: values("masses", self.masses, nodes, self.node_mass)?,
                node_dampings: values("node_dampings", self.node_dampings, nodes, self.node_damping)?,
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
}

/// The values of an array, or one for all where it is NULL.
///
/// # Safety
/// As [`memory::array`].
unsafe fn values<'a>(name: &str, pointer: *const f32, count: usize, uniform: f32) -> Result<Values<'a>> {
    // SAFETY: the same contract.
    let array = unsafe { memory::optional_array(name, pointer, count) }?;
    Ok(array.map_or(Values::Uniform(uniform), Values::Each))
}

/// Fills `def` with the defaults. `struct_size` is sizeof(sinew_body_def).
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT.
///
/// # Safety
/// `def` is NULL or writable for `struct_size` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_def_init(def: *mut sinew_body_def, struct_size: usize) -> sinew_status {
    // SAFETY: the same contract.
    guard(|| unsafe { memory::initialise(def, struct_size, sinew_body_def::defaults()) })
}
