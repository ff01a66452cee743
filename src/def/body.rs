//! What a body is made of, as the caller gives it, and the checks at the door.

use glam::Vec3;

use super::BodyContact;
use super::ElementLaw;
use super::Sleep;
use super::SpringLaw;
use super::Tearing;
use super::values::{check_values, expect_count, finite_vectors, node_indices};
use super::{Material, Model, Values, Viscosity, Yielding};
use crate::base::{Error, Result, ensure, finite, memory, not_negative};
use crate::mesh::Mesh;

/// How a body keeps its springs.
///
/// ```
#[doc = include_str!("../doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// let packed = world.create_body(&BodyDefinition { storage: Storage::Packed, ..cloth })?;
/// let linked = world.create_body(&BodyDefinition { storage: Storage::Efficient, ..cloth })?;
/// let bytes = |body| world.body(body).map(|body| body.storage_report().bytes_used);
/// assert!(bytes(packed)? < bytes(linked)?);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Storage {
    /// Laid out for the processor.
    #[default]
    Packed,
    /// A linked list per node (Halic et al., section 4, "efficient storage").
    Efficient,
    /// One array with a row per node (Halic et al., section 4, "fast link").
    FastLink,
    /// A chain of arrays per node (Halic et al., section 4, "dynamic bulk allocation").
    DynamicBulk,
}

/// How a body is moved.
///
/// ```
#[doc = include_str!("../doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// let stiff = BodyDefinition { stiffnesses: Values::Uniform(1e5), solver: Solver::Implicit, ..cloth };
/// # world.create_body(&stiff)?;
/// let report = world.step(1.0 / 60.0)?;
/// assert_eq!(report.substeps, 1);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Solver {
    /// Explicit, with as many substeps as it needs to be stable.
    Verlet,
    /// Stable at any step.
    Implicit,
    /// The accurate reference: the equations of [`Solver::Implicit`], solved exactly; slow.
    Newton,
    /// [`Solver::Verlet`] where its substeps are few, else [`Solver::Implicit`]: chosen when the body is made, from its mesh, its
    /// material and the length of the world's steps; see [`Body::solver_choice`](crate::Body::solver_choice).
    #[default]
    Auto,
}

crate::codec::saved_enum!(Solver { 0 => Verlet, 1 => Implicit, 2 => Newton, 3 => Auto });

/// A smaller mass, kg, has no finite inverse.
pub(crate) const SMALLEST_MASS: f32 = 1e-37;

/// The most iterations of a step.
pub(crate) const MOST_ITERATIONS: u32 = 1_000_000;

/// What a body is made of. Plain data, used only during [`World::create_body`](crate::World::create_body).
///
/// ```
/// use sinew::mesh::Mesh;
/// use sinew::{BodyDefinition, Values, World, WorldDefinition};
/// let mesh = Mesh::cloth([0.1, 0.1], [4, 4])?;
/// let cloth = BodyDefinition {
///     masses: Values::Uniform(1e-4),
///     stiffnesses: Values::Uniform(20.0),
///     ..BodyDefinition::of(&mesh)
/// };
/// let mut world = World::new(WorldDefinition::default())?;
/// let body = world.create_body(&cloth)?;
/// assert_eq!(world.body(body)?.spring_pairs()?.len(), mesh.edges()?.len());
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct BodyDefinition<'a> {
    /// Where each node is, in metres.
    pub positions: &'a [Vec3],
    /// Where each node would be at rest, in metres; `None`: as in `positions`.
    pub rest_positions: Option<&'a [Vec3]>,
    /// The mass of each node in kilograms, above 0; in [`Values::Each`] 0 pins a node for good. [`Values::Uniform`] of 0 where a
    /// material's density gives them.
    pub masses: Values<'a>,
    /// Damping of each node against the world, in N s/m, at least 0.
    pub node_dampings: Values<'a>,
    /// Damping of each node against the world for each kilogram of its mass, in 1/s, at least 0, beside that.
    pub damping_rate: f32,
    /// The two nodes of each spring, each pair once; `None`: the edges of the triangles, tetrahedra and cells, of
    /// the latter with the diagonals of their faces, each once.
    pub springs: Option<&'a [[u32; 2]]>,
    /// The stiffness of each spring in N/m, at least 0; 0 where tetrahedra are elements and no springs are given.
    pub stiffnesses: Values<'a>,
    /// The rest length of each spring in metres, at least 0; `None`: from the rest positions.
    pub rest_lengths: Option<&'a [f32]>,
    /// Damping along each spring in N s/m, at least 0; 0 where tetrahedra are elements and no springs are given.
    pub spring_dampings: Values<'a>,
    /// The surface that is drawn and touched, outward by the right-hand rule; where it is empty, the outer faces of the tetrahedra, or
    /// of the cells. Outer faces of tetrahedra that are given facing inward are turned.
    pub triangles: &'a [[u32; 3]],
    /// Tetrahedra, four nodes each.
    pub tetrahedra: &'a [[u32; 4]],
    /// Cubes of a lattice, eight nodes each, numbered by bits: x 1, y 2, z 4; see [`Mesh::lattice`](crate::mesh::Mesh::lattice).
    pub cells: &'a [[u32; 8]],
    /// Where stiffnesses, and masses if it has a density, come from instead; it fills the tetrahedra or the cells, or else the
    /// triangles, as they are at rest. `springs` must be `None` then and `stiffnesses` 0, and triangles beside tetrahedra or cells
    /// may have no edges but theirs.
    pub material: Option<Material>,
    /// How tetrahedra that are no elements resist a change of their volume, each by itself, Pa: the energy of one of volume V at rest that
    /// becomes V' is `volume_stiffness / 2 V (V'/V - 1)²`, and negative where it is inside out, so that it turns back. At least 0; 0: they
    /// do not. It adds to the stiffness of the springs: a bulk modulus of so much. From 0.3 to 0.6 of Young's modulus a body of springs comes
    /// back to rest from anywhere; with far less tetrahedra stay inside out, with more than some 4 times as much folds stay. Not beside [`Model::Tetrahedra`](crate::Model),
    /// which has a term of its own.
    pub volume_stiffness: f32,
    /// What draws each node back to its rest position, wherever the body is, in N/m, at least 0: the paper's restoring forces.
    pub home_stiffnesses: Values<'a>,
    /// The flexural rigidity of the surface that `triangles` make, in N m, at least 0; 0: it bends freely. Of a sheet of Young's
    /// modulus E, Poisson's ratio nu and thickness t it is `E t³ / (12 (1 - nu²))`.
    ///
    /// Each edge of two triangles is a hinge that turns back to its angle at rest, whether the surface is flat or curved there; an edge
    /// of more triangles is refused. Where triangles are equilateral it is rolled up with just this rigidity, whichever way. Where they are
    /// squares that are cut alternately it has 5/6 of it along a side; where all are cut the same way, it has it along a side and across
    /// the cuts, and three times as much along them.
    pub bending_stiffness: f32,
    /// How the pull of the springs grows as they are stretched.
    pub spring_law: SpringLaw,
    /// The law of tetrahedra that are elements. Those of another than [`ElementLaw::StVenantKirchhoff`] have no viscosity and do not yield, nor do
    /// springs beside them.
    pub element_law: ElementLaw,
    /// For each tetrahedron the direction of its fibres at rest, 1 long, or 0: it has none. Empty: there are none at all.
    pub fibre_directions: &'a [Vec3],
    /// For each tetrahedron how stiff its fibres are, in Pa, at least 0. Fibres pull where they are longer than at rest, by this times
    /// the part by which they are longer, over the area across them at rest; they never push.
    pub fibre_stiffnesses: Values<'a>,
    /// How springs, and tetrahedra that are elements, resist the speed at which they are deformed. With a `retardation_time` alone it is
    /// damping along the springs, on top of `spring_dampings`; springs that are added later have none. A body begins relaxed, and is so
    /// where [`Body::set_positions`](crate::Body::set_positions) puts it.
    pub viscosity: Viscosity,
    /// From which strain springs, and tetrahedra that are elements, take a set. Springs that yield are [`SpringLaw::Linear`]; those that
    /// are added later do not. Springs yield within a step; tetrahedra do where a substep ends, and with [`Solver::Implicit`] and
    /// [`Solver::Newton`] where a step does: there a load that deforms them further and further does so the more slowly the longer steps are.
    pub yielding: Yielding,
    /// The strain of springs from which they are stiffer, at least 0; 0: there is none.
    pub strain_limit: f32,
    /// How many times their stiffness is added beyond it, above 0, at most 1e6: a load that would stretch a spring by some strain more
    /// stretches it by that over 1 + `limit_stiffening`. Springs that are added later have no limit.
    pub limit_stiffening: f32,
    /// How the volume inside of a closed surface resists a change, Pa, at least 0; 0: it does not. With
    /// [`Self::pressure`] p the energy of each cavity of volume V, V0 at rest, is
    /// `enclosed_stiffness / 2 V0 (V/V0 - 1)² - p (V - V0)`: what fills it has this bulk modulus.
    ///
    /// The surface is `triangles`, or where there are none the boundary of the tetrahedra or cells; each of its parts that hang together
    /// by edges must be closed and have a volume at rest. Each is a cavity of its own, unless some are inside out, as the inner wall
    /// of a hollow organ is: then those alone are cavities. [`Body::remove_spring`](crate::Body::remove_spring) opens the cavities whose
    /// triangles have the edge, for good, and a cut those of which it divides or parts triangles, however little: what is open is neither kept nor
    /// pressed, and what that took goes with what was inside. A cut beside a cavity leaves it.
    pub enclosed_stiffness: f32,
    /// By how much the pressure inside of a cavity that has its volume at rest is above that outside, Pa; below 0 it sucks; 0: it is not. See
    /// [`Self::enclosed_stiffness`], and [`Body::set_pressure`](crate::Body::set_pressure) to change it. Without a stiffness the pressure
    /// stays the same however large the cavity becomes: springs that do not stiffen may not hold it.
    pub pressure: f32,
    /// What keeps off its surface, and whether it meets other bodies and itself.
    pub contact: BodyContact,
    /// How the springs are kept.
    pub storage: Storage,
    /// [`Storage::FastLink`]: places of each node; [`Storage::DynamicBulk`]: places of each array. 0: chosen from the
    /// springs given, as many as the node with the most has, or what takes the least memory.
    pub springs_per_node: u32,
    /// How the body is moved.
    pub solver: Solver,
    /// [`Solver::Implicit`], [`Solver::Newton`]: 1, implicit Euler; 2, the second backward difference formula; 0: 2.
    pub order: u32,
    /// [`Solver::Implicit`], [`Solver::Newton`]: the most products with the matrix of its equation in a step; 0: 1000, or
    /// 100 000 with [`Solver::Newton`]. Where a tool or a tolerance cuts the step, a
    /// thirty-second of it for each part at least. With fewer than 256 a step beside a tool may take seven times as many, at most 128
    /// more, before it is cut.
    pub iterations: u32,
    /// [`Solver::Implicit`], [`Solver::Newton`]: what may be missing of the solution of a step's equation, as a part of what forces
    /// change in the step; from 1e-6 to 1; 0: 0.01, or 1e-6 with [`Solver::Newton`].
    pub accuracy: f32,
    /// [`Solver::Verlet`]: what part of the body's mass may be added, in all, to the nodes whose springs or elements would make
    /// substeps short, as those of slivers are; from 0 to 1; 0: none.
    ///
    /// Mass is added where that saves a quarter of the substeps or more, and no more than they need; where motion makes elements so stiff that a
    /// step would be refused, as much as it takes for a quarter of a second, but no more than the body has. Never where the
    /// world's `substeps` are fixed or a tolerance is asked for. It is inertia alone: weight, and the force on a pin, stay
    /// as they are. See [`SolverReport::added_mass`](crate::SolverReport::added_mass).
    pub mass_scaling: f32,
    /// Whether what is at rest of it is left alone, and when.
    pub sleep: Sleep,
    /// How many nodes cuts may add, of which room is made: copies of nodes, and points of the surface between them. Some five for each triangle or
    /// tetrahedron that a blade passes through. 0: the body cannot be cut, and pays nothing for it.
    ///
    /// A surface that is to be cut is one of triangles turned one way all over, of which two at most have an edge and those about a node hang
    /// together; a solid is one of tetrahedra of which those about a node hang together by faces at it, and `triangles` are its boundary, if there
    /// are any. A body of springs alone loses those that a blade passes through, and needs no room: 1 will do.
    pub spare_nodes: u32,
    /// When it tears by itself, at the end of a step; a body that does may be cut. See [`Body::tear_report`](crate::Body::tear_report) and
    /// [`Body::set_tear_limits`](crate::Body::set_tear_limits).
    pub tearing: Tearing,
    /// What a blade ([`World::create_blade`](crate::World::create_blade)) spends to cut it, J for each m of the cut in the rest shape: the
    /// fracture toughness of the material, J/m², times the thickness of the surface; of tetrahedra that itself, for each m² of their faces that opens.
    /// Springs alone have none. At least 0; 0: it is cut for nothing. Above 0 it needs `spare_nodes`.
    pub toughness: f32,
}

impl<'a> BodyDefinition<'a> {
    /// The default with the nodes of a mesh and all that they make.
    pub fn of(mesh: &'a Mesh) -> Self {
        Self {
            positions: &mesh.positions,
            triangles: &mesh.triangles,
            tetrahedra: &mesh.tetrahedra,
            cells: &mesh.cells,
            ..Self::default()
        }
    }
}

impl Default for BodyDefinition<'_> {
    /// No nodes, masses or stiffnesses yet; no damping; up to a thousandth of the mass may be added. Springs that yield may do so by half of
    /// their length, and are 101 times as stiff beyond a limit.
    fn default() -> Self {
        Self {
            positions: &[],
            rest_positions: None,
            masses: Values::Uniform(0.0),
            node_dampings: Values::Uniform(0.0),
            damping_rate: 0.0,
            springs: None,
            stiffnesses: Values::Uniform(0.0),
            rest_lengths: None,
            spring_dampings: Values::Uniform(0.0),
            triangles: &[],
            tetrahedra: &[],
            cells: &[],
            material: None,
            volume_stiffness: 0.0,
            home_stiffnesses: Values::Uniform(0.0),
            bending_stiffness: 0.0,
            spring_law: SpringLaw::Linear,
            element_law: ElementLaw::default(),
            fibre_directions: &[],
            fibre_stiffnesses: Values::Uniform(0.0),
            viscosity: Viscosity::default(),
            yielding: Yielding::default(),
            strain_limit: 0.0,
            limit_stiffening: 100.0,
            enclosed_stiffness: 0.0,
            pressure: 0.0,
            contact: BodyContact::default(),
            storage: Storage::Packed,
            springs_per_node: 0,
            solver: Solver::Auto,
            order: 0,
            iterations: 0,
            accuracy: 0.0,
            mass_scaling: 0.001,
            sleep: Sleep::default(),
            spare_nodes: 0,
            tearing: Tearing::default(),
            toughness: 0.0,
        }
    }
}

impl BodyDefinition<'_> {
    /// Refuses whatever is out of range, with a message that names it.
    pub(crate) fn check(&self) -> Result<()> {
        let nodes = self.positions.len();
        ensure!(
            (1..=u32::MAX as usize / 2).contains(&nodes),
            "node_count is {nodes}: must be from 1 to {}",
            u32::MAX / 2
        );
        self.sleep.check()?;
        finite_vectors("positions", self.positions)?;
        if let Some(rest) = self.rest_positions {
            expect_count("rest_positions", rest.len(), nodes)?;
            finite_vectors("rest_positions", rest)?;
        }
        if self.material.is_none_or(|material| material.density == 0.0) {
            self.check_masses()?;
        }
        check_values("node_damping", &self.node_dampings, nodes)?;
        not_negative("damping_rate", self.damping_rate)?;
        node_indices("triangles", self.triangles, nodes)?;
        node_indices("tetrahedra", self.tetrahedra, nodes)?;
        node_indices("cells", self.cells, nodes)?;
        match self.springs {
            Some(springs) => self.check_springs(springs)?,
            None => {
                for (name, given) in [
                    ("stiffnesses", matches!(self.stiffnesses, Values::Each(_))),
                    ("rest_lengths", self.rest_lengths.is_some()),
                    ("spring_dampings", matches!(self.spring_dampings, Values::Each(_))),
                ] {
                    ensure!(
                        !given,
                        "{name} is given while springs is not: there is no order of springs to give it in"
                    );
                }
                check_values("stiffness", &self.stiffnesses, 0)?;
                check_values("spring_damping", &self.spring_dampings, 0)?;
            }
        }
        not_negative("volume_stiffness", self.volume_stiffness)?;
        ensure!(
            self.volume_stiffness <= 0.0 || !self.tetrahedra.is_empty(),
            "volume_stiffness is {} Pa, and the body has no tetrahedra to keep their volume",
            self.volume_stiffness
        );
        self.viscosity.check()?;
        self.yielding.check()?;
        let is_of_elements = |material: Material| material.model == Model::Tetrahedra;
        let refused = [
            ("retardation_time", self.viscosity.retardation_time),
            ("yield_strain", self.yielding.strain),
        ];
        self.element_law
            .check(self.material.is_some_and(is_of_elements), refused)?;
        self.contact.check()?;
        self.tearing.check(self)?;
        not_negative("enclosed_stiffness", self.enclosed_stiffness)?;
        finite("pressure", self.pressure)?;
        not_negative("toughness", self.toughness)?;
        ensure!(
            self.toughness <= 0.0 || self.spare_nodes != 0,
            "toughness is {} while spare_nodes is 0: the body cannot be cut",
            self.toughness
        );
        if let Some(material) = &self.material {
            material.check(self)?;
        }
        self.check_solver()
    }

    fn check_masses(&self) -> Result<()> {
        match self.masses {
            Values::Uniform(mass) if !(mass >= SMALLEST_MASS && mass.is_finite()) => Err(Error::invalid(format!(
                "node_mass is {mass}: must be above 0 and finite, or a material be given a density instead"
            ))),
            Values::Uniform(_) => Ok(()),
            Values::Each(masses) => {
                expect_count("masses", masses.len(), self.positions.len())?;
                match masses
                    .iter()
                    .position(|&mass| mass != 0.0 && !(mass >= SMALLEST_MASS && mass.is_finite()))
                {
                    None => Ok(()),
                    Some(node) => Err(Error::invalid(format!(
                        "masses[{node}] is {}: must be 0 or above, and finite",
                        masses[node]
                    ))),
                }
            }
        }
    }

    fn check_springs(&self, springs: &[[u32; 2]]) -> Result<()> {
        node_indices("springs", springs, self.positions.len())?;
        check_values("stiffness", &self.stiffnesses, springs.len())?;
        check_values("spring_damping", &self.spring_dampings, springs.len())?;
        if let Some(lengths) = self.rest_lengths {
            check_values("rest_length", &Values::Each(lengths), springs.len())?;
        }
        // Each pair once: equal pairs are neighbours once sorted.
        let mut pairs: Vec<(u64, u32)> = memory::reserved(springs.len())?;
        for (index, &[a, b]) in springs.iter().enumerate() {
            pairs.push((u64::from(a.min(b)) << 32 | u64::from(a.max(b)), index as u32));
        }
        pairs.sort_unstable();
        match pairs.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            None => Ok(()),
            Some(pair) => Err(Error::invalid(format!(
                "springs[{}] joins nodes {:?}, as springs[{}] does: each pair once",
                pair[1].1, springs[pair[1].1 as usize], pair[0].1
            ))),
        }
    }

    fn check_solver(&self) -> Result<()> {
        ensure!(self.order <= 2, "order is {}: must be 0, 1 or 2", self.order);
        ensure!(
            self.accuracy == 0.0 || (1e-6..=1.0).contains(&self.accuracy),
            "accuracy is {}: must be 0, or from 1e-6 to 1",
            self.accuracy
        );
        ensure!(
            self.iterations <= MOST_ITERATIONS,
            "iterations is {}: must be at most {MOST_ITERATIONS}",
            self.iterations
        );
        ensure!(
            (0.0..=1.0).contains(&self.mass_scaling),
            "mass_scaling is {}: must be from 0 to 1",
            self.mass_scaling
        );
        Ok(())
    }
}
