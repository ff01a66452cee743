//! The report of a step, and the reason of a refused one.

use super::ids::BodyId;

/// The kind of force that limits the substeps of a body.
///
/// ```
#[doc = include_str!("../doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition { max_substeps: 1, ..WorldDefinition::default() })?;
/// # world.create_body(&BodyDefinition { solver: Solver::Verlet, ..cloth })?;
/// let Err(Error::Unstable { report, .. }) = world.step(1.0 / 60.0) else { panic!("a single substep suffices") };
/// assert_eq!(report.limit.map(|limit| limit.of.kind), Some(LimitKind::Spring));
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LimitKind {
    /// The springs of a node.
    Spring,
    /// The tetrahedra of a node.
    Element,
    /// The terms of a node: anchor springs, bending, fibers, Maxwell branches and strain limits.
    Term,
    /// The pressure in a cavity.
    Cavity,
    /// The largest number of substeps of IMPLICIT or NEWTON near tools and attachments.
    Parts,
    /// The tolerance of the world.
    Tolerance,
}

impl LimitKind {
    /// The name in error messages.
    pub(crate) fn name(self) -> &'static str {
        match self {
            LimitKind::Spring => "the springs",
            LimitKind::Element => "the element",
            LimitKind::Term => "the term",
            LimitKind::Cavity => "a cavity",
            LimitKind::Parts => "contact or attachments",
            LimitKind::Tolerance => "the tolerance",
        }
    }
}

/// The part of a body that allows the shortest substep.
///
/// ```
#[doc = include_str!("../doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition { max_substeps: 1, ..WorldDefinition::default() })?;
/// # world.create_body(&BodyDefinition { solver: Solver::Verlet, ..cloth })?;
/// if let Err(Error::Unstable { report: StepReport { limit: Some(limit), .. }, .. }) = world.step(1.0 / 60.0) {
///     let SubstepLimit { kind, nodes, node_count } = limit.of;
///     assert_eq!(kind, LimitKind::Spring);
///     assert!(nodes[..node_count as usize].iter().all(|&node| node < 25));
/// # } else {
/// #     panic!("a single substep suffices");
/// }
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SubstepLimit {
    /// The kind of force.
    pub kind: LimitKind,
    /// The nodes in the caller's numbers, the one of the highest frequency first; the last is repeated.
    pub nodes: [u32; 4],
    /// The number of distinct nodes; 0 if the limit has no nodes.
    pub node_count: u32,
}

impl SubstepLimit {
    /// A limit without nodes.
    pub(crate) fn of_all(kind: LimitKind) -> Self {
        Self {
            kind,
            nodes: [0; 4],
            node_count: 0,
        }
    }

    /// The distinct nodes.
    pub fn nodes(&self) -> &[u32] {
        &self.nodes[..self.node_count as usize]
    }
}

/// The report of a step.
///
/// ```
#[doc = include_str!("../doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// # let body = world.create_body(&cloth)?;
/// let report = world.step(1.0 / 60.0)?;
/// assert!(report.substeps as f32 * report.stable_substep >= 1.0 / 60.0);
/// assert_eq!(report.substeps_body, Some(body));
/// assert_eq!(report.restored_body, None);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepReport {
    /// The largest number of substeps of any body.
    pub substeps: u32,
    /// The longest explicit substep that is now stable for all bodies, s; infinity without a limit.
    pub stable_substep: f32,
    /// The number of bodies that would have become non-finite. They were rolled back; the others were stepped.
    pub bodies_restored: u32,
    /// The estimated largest position error of the step, m; 0 without a tolerance, infinite if the step was refused
    /// before an estimate.
    pub error_estimate: f32,
    /// The number of interpenetrating surface edges, between bodies or within a body with self-contact, that contact
    /// could not prevent. Edges inside a closed body are pushed out again.
    pub crossings: u32,
    /// The reason of an unstable step.
    pub limit: Option<StepLimit>,
    /// The body with the most substeps.
    pub substeps_body: Option<BodyId>,
    /// A body that was rolled back.
    pub restored_body: Option<BodyId>,
    /// The body with the most interpenetrating edges.
    pub crossing_body: Option<BodyId>,
}

/// The body that needs more substeps than are allowed.
///
/// ```
#[doc = include_str!("../doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition { max_substeps: 1, ..WorldDefinition::default() })?;
/// # let body = world.create_body(&BodyDefinition { solver: Solver::Verlet, ..cloth })?;
/// if let Err(Error::Unstable { report: StepReport { limit: Some(limit), .. }, .. }) = world.step(1.0 / 60.0) {
///     assert_eq!(limit.body, body);
///     world.set_substeps(0, limit.needed)?;
/// # } else {
/// #     panic!("a single substep suffices");
/// }
/// assert!(world.step(1.0 / 60.0).is_ok());
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepLimit {
    /// The body.
    pub body: BodyId,
    /// The force that limits its substep, at the positions before the step.
    pub of: SubstepLimit,
    /// The estimated number of substeps that the step needs.
    pub needed: u32,
    /// True if [`Solver::Auto`](crate::Solver::Auto) chose the solver of the body, so that choosing AUTO would not
    /// help.
    pub is_chosen: bool,
}

impl std::fmt::Display for StepLimit {
    /// Names the body, the limiting force, and options that help.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self {
            body,
            of,
            needed,
            is_chosen,
        } = self;
        let solver = if *is_chosen { "IMPLICIT" } else { "AUTO or IMPLICIT" };
        write!(f, "body {} is limited by {}", body.0, of.kind.name())?;
        match of.nodes() {
            [] => {}
            [node] => write!(f, " of node {node}")?,
            nodes => write!(f, " of nodes {nodes:?}")?,
        }
        match of.kind {
            LimitKind::Parts => write!(f, ": take shorter steps"),
            LimitKind::Tolerance => write!(f, ": raise tolerance or max_substeps, or take shorter steps"),
            _ => write!(
                f,
                " and needs {needed} substeps: use solver {solver}, raise mass_scaling or max_substeps, or take shorter steps"
            ),
        }
    }
}
