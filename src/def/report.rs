//! What a body says about itself: energy, memory, cavities, how its solver took the last step.

use crate::codec::saved;

/// How much memory the springs of a body take.
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
    /// Nodes of the body.
    pub node_count: usize,
    /// Springs of the body, each counted once.
    pub spring_count: usize,
    /// Bytes taken by the springs that exist.
    pub bytes_used: usize,
    /// Bytes held from the allocator, with what is spare.
    pub bytes_reserved: usize,
}

/// What a body encloses: the sums of the cavities that are closed; all 0 where it was not asked to keep or press anything.
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
    /// Cavities that have not been cut open.
    pub cavity_count: usize,
    /// m³, at the time of the positions; negative where they are inside out.
    pub volume: f64,
    /// The same at rest, m³.
    pub rest_volume: f64,
    /// By how much the pressure inside is above that outside, Pa; the mean by volume at rest.
    pub pressure: f64,
}

/// How a body's solver took the last step.
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
    /// Products with the matrices of the step's equations; 0 for bodies that are moved explicitly.
    pub iterations: u32,
    /// How far nodes may be from where the step's equation has them, m; 0 for bodies that are moved explicitly.
    /// [`Solver::Implicit`](crate::Solver::Implicit): root mean square by mass. [`Solver::Newton`](crate::Solver::Newton): the
    /// longest way of the last correction, of which about a hundredth is left. What a shorter step would change is not in it.
    pub error: f32,
    /// By how much mass scaling makes nodes heavier in all, kg; see
    /// [`BodyDefinition::mass_scaling`](crate::BodyDefinition::mass_scaling).
    pub added_mass: f64,
    /// Linearised equations solved; 0 for bodies that are moved explicitly.
    pub solves: u32,
    /// Whether every equation was solved as far as the definition asks, or as rounding allows; `false` for bodies that are moved
    /// explicitly.
    pub has_converged: bool,
}

saved! { SolverReport { iterations, error, added_mass, solves, has_converged } }

impl SolverReport {
    /// Before anything was solved.
    pub(crate) const BEFORE: Self = Self {
        iterations: 0,
        error: 0.0,
        added_mass: 0.0,
        solves: 0,
        has_converged: true,
    };
}

/// Energy in joules, at the time of the positions.
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
    /// Of the nodes that are free to move, along the axes along which they are. What mass scaling adds to them does not count: it has no weight
    /// either, and comes and goes.
    pub kinetic: f64,
    /// Of the springs, of tetrahedra that are elements, and of every other term; less the work that a constant pressure has done.
    pub elastic: f64,
    /// Of all nodes, zero at the origin.
    pub gravitational: f64,
}
