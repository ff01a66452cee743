//! Reports of a body: energy, memory, cavities, and the solver's last step.

use crate::codec::saved;

/// The memory of a body's springs.
///
/// ```
#[doc = include_str!("../doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// # let body = world.create_body(&cloth)?;
/// let report = world.body(body)?.storage_report();
/// assert_eq!(report.spring_count, mesh.edges()?.len());
/// assert!(report.bytes_used <= report.bytes_reserved);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StorageReport {
    /// The number of nodes in the body.
    pub node_count: usize,
    /// The number of springs, each counted once.
    pub spring_count: usize,
    /// Bytes used by the existing springs.
    pub bytes_used: usize,
    /// Bytes held from the allocator, spare capacity included.
    pub bytes_reserved: usize,
}

/// The sums over the closed cavities of a body. All values are 0 if the body has no enclosed stiffness or pressure.
///
/// ```
/// # use sinew::{mesh::Mesh, *};
/// # let mut world = World::new(WorldDefinition::default())?;
/// # let mesh = Mesh::block([0.04, 0.04, 0.04], [2, 2, 2])?;
/// # let (positions, tetrahedra) = (&mesh.positions[..], &mesh.tetrahedra[..]);
/// # let (masses, stiffnesses) = (Values::Uniform(1e-3), Values::Uniform(20.0));
/// # let balloon = BodyDefinition { positions, tetrahedra, masses, stiffnesses, ..BodyDefinition::default() };
/// let body = world.create_body(&BodyDefinition { enclosed_stiffness: 1e4, ..balloon })?;
/// let enclosed = world.body(body)?.enclosed();
/// assert_eq!(enclosed.cavity_count, 1);
/// assert!((enclosed.volume - 0.04_f64.powi(3)).abs() < 1e-9);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EnclosedReport {
    /// The number of cavities that have not been cut open.
    pub cavity_count: usize,
    /// The volume at the current positions, m³; negative if the cavities are inverted.
    pub volume: f64,
    /// The volume at rest, m³.
    pub rest_volume: f64,
    /// The overpressure (Pa), averaged by rest volume.
    pub pressure: f64,
}

/// The report of a body's solver on the last step.
///
/// ```
#[doc = include_str!("../doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// let body = world.create_body(&BodyDefinition { solver: Solver::Implicit, ..cloth })?;
/// # world.body_mut(body)?.pin(0)?;
/// world.step(1.0 / 60.0)?;
/// let report = world.body(body)?.solver_report();
/// assert!(report.has_converged && report.iterations > 0);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SolverReport {
    /// The number of matrix-vector products in the step; 0 for explicit bodies.
    pub iterations: u32,
    /// The estimated position error of the solve, m; 0 for explicit bodies.
    /// [`Solver::Implicit`](crate::Solver::Implicit): root mean square, weighted by mass.
    /// [`Solver::Newton`](crate::Solver::Newton): the largest displacement of the last correction, of which about a
    /// hundredth remains. The error of the time step is not included.
    pub error: f32,
    /// The total mass that mass scaling adds, kg; see
    /// [`BodyDefinition::mass_scaling`](crate::BodyDefinition::mass_scaling).
    pub added_mass: f64,
    /// The number of linearized equations that were solved; 0 for explicit bodies.
    pub solves: u32,
    /// True if every equation reached the required accuracy, or the limit of rounding. `false` for explicit bodies.
    pub has_converged: bool,
}

saved! { SolverReport { iterations, error, added_mass, solves, has_converged } }

impl SolverReport {
    /// The report before the first solve.
    pub(crate) const BEFORE: Self = Self {
        iterations: 0,
        error: 0.0,
        added_mass: 0.0,
        solves: 0,
        has_converged: true,
    };
}

/// The energy of a body at the current positions, J.
///
/// ```
#[doc = include_str!("../doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// # let body = world.create_body(&cloth)?;
/// world.step(1.0 / 60.0)?;
/// let energy = world.body(body)?.energy(world.gravity());
/// // It falls freely from y = 0.
/// assert!(energy.kinetic > 0.0);
/// assert!((energy.kinetic + energy.gravitational).abs() < 0.01 * energy.kinetic);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Energy {
    /// The kinetic energy of free nodes along their free axes. Mass from mass scaling is not included: it has no weight
    /// and varies.
    pub kinetic: f64,
    /// The elastic energy of springs, elements and all other terms, minus the work of constant pressures.
    pub elastic: f64,
    /// The gravitational energy of all nodes, zero at the origin.
    pub gravitational: f64,
}
