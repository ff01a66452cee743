//! The definition of a body as the caller gives it, and its validation.

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

/// The memory layout of a body's springs.
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
    /// A SIMD-friendly layout, the fastest one.
    #[default]
    Packed,
    /// A linked list per node (Halic et al., section 4, "efficient storage").
    Efficient,
    /// One array with a row per node (Halic et al., section 4, "fast link").
    FastLink,
    /// A chain of arrays per node (Halic et al., section 4, "dynamic bulk allocation").
    DynamicBulk,
}

/// The time integrator of a body.
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
    /// Explicit, with as many substeps as stability needs.
    Verlet,
    /// Implicit, and stable at any step length.
    Implicit,
    /// The accurate reference solver. It solves the equations of [`Solver::Implicit`] exactly, and is slow.
    Newton,
    /// [`Solver::Verlet`] if it needs few substeps, otherwise [`Solver::Implicit`]. The choice is made when the body is
    /// created, from its mesh, its material and the length of the world's steps; see
    /// [`Body::solver_choice`](crate::Body::solver_choice).
    #[default]
    Auto,
}

crate::codec::saved_enum!(Solver { 0 => Verlet, 1 => Implicit, 2 => Newton, 3 => Auto });

/// The smallest mass with a finite inverse, kg.
pub(crate) const MIN_MASS: f32 = 1e-37;

/// The largest number of iterations per step.
pub(crate) const MAX_ITERATIONS: u32 = 1_000_000;

/// The definition of a body. Plain data, used only during [`World::create_body`](crate::World::create_body).
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
    /// The initial position of each node, m.
    pub positions: &'a [Vec3],
    /// The rest position of each node, m. `None`: the same as `positions`.
    pub rest_positions: Option<&'a [Vec3]>,
    /// The mass of each node (kg), above 0. In [`Values::Each`] a mass of 0 pins a node permanently.
    /// [`Values::Uniform`] of 0 if the density of a material gives the masses.
    pub masses: Values<'a>,
    /// Damping of each node relative to the world (N s/m), at least 0.
    pub node_dampings: Values<'a>,
    /// Additional damping of each node relative to the world, per mass (1/s), at least 0.
    pub damping_rate: f32,
    /// The two nodes of each spring, each pair once. `None`: the edges of the triangles, tetrahedra and cells, each
    /// once. Cells also get springs along the diagonals of their faces.
    pub springs: Option<&'a [[u32; 2]]>,
    /// The stiffness of each spring (N/m), at least 0. It is 0 if tetrahedra are elements and no springs are given.
    pub stiffnesses: Values<'a>,
    /// The rest length of each spring (m), at least 0. `None`: computed from the rest positions.
    pub rest_lengths: Option<&'a [f32]>,
    /// Damping along each spring (N s/m), at least 0. It is 0 if tetrahedra are elements and no springs are given.
    pub spring_dampings: Values<'a>,
    /// The render and collision surface, facing outward by the right-hand rule. If it is empty, the outer faces of the
    /// tetrahedra or cells are used. Outer faces of tetrahedra that are given facing inward are reversed.
    pub triangles: &'a [[u32; 3]],
    /// The tetrahedra, with four nodes each.
    pub tetrahedra: &'a [[u32; 4]],
    /// The cubes of a lattice, with eight nodes each, numbered by bits: x 1, y 2, z 4. See
    /// [`Mesh::lattice`](crate::mesh::Mesh::lattice).
    pub cells: &'a [[u32; 8]],
    /// The material that gives the stiffnesses, and the masses if it has a density. It fills the tetrahedra or cells at
    /// rest, or the triangles if there are neither. `springs` must then be `None` and `stiffnesses` 0. Triangles beside
    /// tetrahedra or cells may only have edges of these.
    pub material: Option<Material>,
    /// The resistance of tetrahedra that are no elements to a change of their volume (Pa), at least 0. 0: none. A
    /// tetrahedron with rest volume V and current volume V' has the energy `volume_stiffness / 2 V (V'/V - 1)²`. V' is
    /// negative if it is inverted, so it recovers from inversion.
    ///
    /// It adds to the stiffness of the springs like a bulk modulus of this value. With 0.3 to 0.6 of Young's modulus, a
    /// body of springs recovers its rest shape from any state. With far less, tetrahedra stay inverted; with more than
    /// about 4 times as much, folds remain. Not allowed with [`Model::Tetrahedra`](crate::Model), which has its own
    /// volume term.
    pub volume_stiffness: f32,
    /// The stiffness of the anchor spring from each node to its rest position in the world (N/m), at least 0: the
    /// restoring forces of Halic et al.
    pub home_stiffnesses: Values<'a>,
    /// The flexural rigidity of the surface that `triangles` define (N m), at least 0. 0: it bends freely. A sheet with
    /// Young's modulus E, Poisson's ratio nu and thickness t has `E t³ / (12 (1 - nu²))`.
    ///
    /// Each edge of two triangles is a hinge that returns to its rest angle, whether the surface is flat or curved at
    /// rest. An edge of more triangles is refused. Equilateral triangles have exactly this rigidity in every direction.
    /// Squares with alternating diagonals have 5/6 of it along a side. Squares with parallel diagonals have it along a
    /// side and across the diagonals, and three times as much along the diagonals.
    pub bending_stiffness: f32,
    /// The force-strain law of the springs.
    pub spring_law: SpringLaw,
    /// The hyperelastic law of tetrahedra that are elements. With a law other than [`ElementLaw::StVenantKirchhoff`],
    /// neither elements nor springs may be viscous or yield.
    pub element_law: ElementLaw,
    /// The rest direction of the fibers in each tetrahedron: of unit length, or 0 for none. Empty: there are no fibers.
    pub fibre_directions: &'a [Vec3],
    /// The stiffness of the fibers in each tetrahedron (Pa), at least 0. The stress over their rest cross-section is
    /// this value times their strain. Compressed fibers do not push.
    pub fibre_stiffnesses: Values<'a>,
    /// The viscosity of springs, and of tetrahedra that are elements. A `retardation_time` alone is damping along the
    /// springs, in addition to `spring_dampings`. Springs that are added later have none. A body is relaxed when it is
    /// created and after [`Body::set_positions`](crate::Body::set_positions).
    pub viscosity: Viscosity,
    /// The yield strain of springs, and of tetrahedra that are elements. Springs that yield must be
    /// [`SpringLaw::Linear`]; springs that are added later do not yield. Springs yield within a step. Tetrahedra yield
    /// at the end of a substep, or of a step with [`Solver::Implicit`] and [`Solver::Newton`]. With these two solvers,
    /// longer steps under-predict plastic flow under a sustained load.
    pub yielding: Yielding,
    /// The strain beyond which springs are stiffer, at least 0. 0: there is no limit.
    pub strain_limit: f32,
    /// The stiffness added beyond the limit, relative to that of the spring; above 0, at most 1e6. An additional load
    /// then stretches a spring by 1 / (1 + `limit_stiffening`) of what it would without the limit. Springs that are
    /// added later have no limit.
    pub limit_stiffening: f32,
    /// The bulk modulus of the volume inside a closed surface (Pa), at least 0. 0: the volume changes freely. With
    /// [`Self::pressure`] p, a cavity of volume V and rest volume V0 has the energy `enclosed_stiffness / 2 V0 (V/V0 -
    /// 1)² - p (V - V0)`.
    ///
    /// The surface is `triangles`, or the boundary of the tetrahedra or cells if there are none. Each part connected by
    /// edges must be closed and have a rest volume. Each part is a cavity, unless some face inward, as the inner wall
    /// of a hollow organ does; then only those are cavities.
    ///
    /// [`Body::remove_spring`](crate::Body::remove_spring) permanently opens the cavities with that edge, and a cut
    /// those whose triangles it divides or separates. An open cavity has neither stiffness nor pressure, and its
    /// contents are lost. A cut elsewhere leaves the cavity closed.
    pub enclosed_stiffness: f32,
    /// The overpressure in a cavity at its rest volume, Pa. Negative values are suction; 0: none. See
    /// [`Self::enclosed_stiffness`], and [`Body::set_pressure`](crate::Body::set_pressure) to change it. Without an
    /// `enclosed_stiffness` the pressure does not depend on the volume, and springs that do not stiffen may be unable
    /// to contain it.
    pub pressure: f32,
    /// The contact settings of the body.
    pub contact: BodyContact,
    /// The memory layout of the springs.
    pub storage: Storage,
    /// Slots per node ([`Storage::FastLink`]) or per array ([`Storage::DynamicBulk`]). 0: chosen from the given
    /// springs, as the maximum number per node or the size with the least memory.
    pub springs_per_node: u32,
    /// The time integrator of the body.
    pub solver: Solver,
    /// The order of [`Solver::Implicit`] and [`Solver::Newton`]. 1: implicit Euler. 2: the second-order backward
    /// differentiation formula. 0: 2.
    pub order: u32,
    /// The maximum number of matrix-vector products per step of [`Solver::Implicit`] and [`Solver::Newton`]. 0: 1000,
    /// or 100 000 with [`Solver::Newton`]. If a tool or a tolerance divides the step, each part has at least one
    /// thirty-second of it. With fewer than 256, a step near a tool may take seven times as many, at most 128 more,
    /// before it is divided.
    pub iterations: u32,
    /// The relative tolerance of [`Solver::Implicit`] and [`Solver::Newton`], from 1e-6 to 1: the allowed position
    /// error divided by the displacement that forces cause in the step. 0: 0.01, or 1e-6 with [`Solver::Newton`].
    pub accuracy: f32,
    /// The mass that [`Solver::Verlet`] may add, as a fraction of the body's mass from 0 to 1. It goes to nodes whose
    /// springs or elements would make substeps short, as those of slivers do. 0: none.
    ///
    /// Mass is added only if that saves at least a quarter of the substeps, and no more than needed. Motion may make
    /// elements so stiff that a step would be refused. Mass is then added as needed for a quarter of a second, up to
    /// the mass of the body. No mass is added with fixed `substeps` of the world or with a tolerance. Added mass is
    /// inertia only: weight and pin forces do not change. See
    /// [`SolverReport::added_mass`](crate::SolverReport::added_mass).
    pub mass_scaling: f32,
    /// When parts of the body that are at rest fall asleep.
    pub sleep: Sleep,
    /// The number of nodes that cuts may add, for which memory is reserved. These are copies of nodes, and surface
    /// points between nodes. Expect about five for each triangle or tetrahedron that a blade passes through. 0: the
    /// body cannot be cut, and has no cost for it.
    ///
    /// A cuttable surface must be a consistently oriented 2-manifold: at most two triangles per edge, and the triangles
    /// around each node connected through edges. In a cuttable solid the tetrahedra around each node must be connected
    /// through faces at it, and `triangles`, if given, must be its boundary. In a body of springs alone a blade removes
    /// the springs that it passes through; a value of 1 is enough.
    pub spare_nodes: u32,
    /// The limits beyond which the body tears at the end of a step. A body that tears can also be cut. See
    /// [`Body::tear_report`](crate::Body::tear_report) and [`Body::set_tear_limits`](crate::Body::set_tear_limits).
    pub tearing: Tearing,
    /// The work of a blade ([`World::create_blade`](crate::World::create_blade)) per cut, measured in the rest shape.
    /// For a surface it is per length (J/m): the fracture toughness of the material (J/m²) times the thickness. For
    /// tetrahedra it is the toughness per area of the opened faces (J/m²). Springs alone have none. At least 0; 0:
    /// cutting meets no resistance. A value above 0 needs `spare_nodes`.
    pub toughness: f32,
}

impl<'a> BodyDefinition<'a> {
    /// A default definition with the nodes and elements of a mesh.
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
    /// No nodes, masses, stiffnesses or damping. Up to a thousandth of the mass may be added. The maximum plastic
    /// strain is one half, and springs are 101 times as stiff beyond a strain limit.
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
    /// Returns an error that names the first value out of range.
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
            Values::Uniform(mass) if !(mass >= MIN_MASS && mass.is_finite()) => Err(Error::invalid(format!(
                "node_mass is {mass}: must be above 0 and finite, or a material be given a density instead"
            ))),
            Values::Uniform(_) => Ok(()),
            Values::Each(masses) => {
                expect_count("masses", masses.len(), self.positions.len())?;
                match masses
                    .iter()
                    .position(|&mass| mass != 0.0 && !(mass >= MIN_MASS && mass.is_finite()))
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
        // Each pair once: equal pairs are adjacent after sorting.
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
            self.iterations <= MAX_ITERATIONS,
            "iterations is {}: must be at most {MAX_ITERATIONS}",
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
