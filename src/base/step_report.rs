//! What a step did, and what one failed by that could not be taken.

use super::ids::BodyId;

/// What bounds the substeps of a body.
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
    /// How many parts a step of IMPLICIT or NEWTON may have.
    Parts,
    /// The tolerance of the world.
    Tolerance,
}

impl LimitKind {
    /// What it is called in a message.
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
    /// What it is.
    pub kind: LimitKind,
    /// Its nodes in the caller's numbers, that of the highest frequency first; the last is repeated.
    pub nodes: [u32; 4],
    /// How many of them differ; 0: it is of no nodes.
    pub node_count: u32,
}

impl SubstepLimit {
    /// One that is of no nodes.
    pub(crate) fn of_all(kind: LimitKind) -> Self {
        Self {
            kind,
            nodes: [0; 4],
            node_count: 0,
        }
    }

    /// Its nodes, each once.
    pub fn nodes(&self) -> &[u32] {
        &self.nodes[..self.node_count as usize]
    }
}

/// What a step did.
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
    /// The most substeps that any body took.
    pub substeps: u32,
    /// The longest explicit substep that is stable now, over all bodies, s; infinity: no limit.
    pub stable_substep: f32,
    /// Bodies that would have become non-finite: put back as they were, the others stepped.
    pub bodies_restored: u32,
    /// How far a position of this step may be off, m; 0 where the tolerance is off, infinite where the step is refused before there is
    /// anything to compare.
    pub error_estimate: f32,
    /// Edges of surfaces that pass through other tissue, or through their own body's where it meets itself: what contact could not keep
    /// apart. Those of another body in one that is closed come out again by themselves.
    pub crossings: u32,
    /// What a step that is refused as unstable failed by.
    pub limit: Option<StepLimit>,
    /// The body that took the most substeps.
    pub substeps_body: Option<BodyId>,
    /// A body that was put back.
    pub restored_body: Option<BodyId>,
    /// The body with the most edges that pass through tissue.
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
    /// Which.
    pub body: BodyId,
    /// What of it allows no longer substep, where its nodes were as the step began.
    pub of: SubstepLimit,
    /// How many substeps the step would need, as far as that is known.
    pub needed: u32,
    /// Whether [`Solver::Auto`](crate::Solver::Auto) chose the solver of the body: naming it again would not help.
    pub is_chosen: bool,
}

impl std::fmt::Display for StepLimit {
    /// Names the body, what limits it, and what helps.
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
