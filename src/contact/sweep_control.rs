//! Iteration control of projected Gauss-Seidel, shared by contacts with tools and contacts of tissue.

/// Maximum number of sweeps; enough for tissue to come to rest.
pub(super) const SWEEPS: u32 = 128;

/// Convergence tolerance: change of a sweep relative to that of the first.
const TOLERANCE: f32 = 1e-5;

/// Maximum fraction of the initial penetration depth that a substep corrects.
pub(super) const MAX_DEPTH_CORRECTION: f32 = 0.2;

/// Time constant of the depth correction, s. A substep shorter than a fifth of it corrects depth at a speed of the
/// depth over this time. A fixed fraction per substep would be faster the shorter the substep, and viscous tissue would
/// then require ever shorter substeps.
const DEPTH_CORRECTION_TIME: f32 = 1e-3;

/// The fraction of the initial penetration depth that a substep of this many seconds corrects.
pub(super) fn depth_correction(substep: f32) -> f32 {
    (substep / DEPTH_CORRECTION_TIME).min(MAX_DEPTH_CORRECTION)
}

/// Maximum ratio of a node's velocity change to that of its contact. Only contacts close to pinned nodes would exceed
/// it. There the tool penetrates instead.
pub(crate) const LEVERAGE: f32 = 4.0;

/// Number of sweeps over pressing contacts between two sweeps over all. Few contacts begin to press between two full
/// sweeps.
const PRESSING_SWEEPS: u32 = 3;

/// Convergence is slow if the change of a full sweep exceeds `STALL_RATIO` times that of the last full sweep and is
/// below `STALL_LEVEL` times that of the first. Redundant contacts converge slowly and hardly move anything.
const STALL_RATIO: f32 = 0.9;
const STALL_LEVEL: f32 = 0.01;

/// The contacts that a sweep visits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PgsPass {
    All,
    /// Only contacts with an impulse.
    Pressing,
}

/// Termination criteria of the sweeps.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PgsLimits {
    /// Maximum number of sweeps.
    pub sweeps: u32,
    /// Convergence tolerance: change of a sweep relative to that of the first.
    pub tolerance: f32,
    /// True if slow convergence ends the sweeps. The next substep is warm-started from their impulses.
    pub defers_slow_tail: bool,
}

impl PgsLimits {
    /// At most `sweeps` sweeps, until the change is as small as rounding errors of slow tissue.
    pub fn new(sweeps: u32) -> Self {
        Self {
            sweeps,
            tolerance: TOLERANCE,
            defers_slow_tail: false,
        }
    }
}

/// Sweeps until a full sweep changes velocities by a negligible fraction of `first`, m/s, or of the first sweep's
/// change if that is `None`. Returns that reference change.
pub(crate) fn sweep_until_converged(
    limits: PgsLimits,
    first: Option<f32>,
    mut sweep: impl FnMut(PgsPass) -> f32,
) -> f32 {
    let mut first = first;
    let mut sweeps_left = limits.sweeps;
    let mut last = f32::INFINITY;
    while sweeps_left > 0 {
        sweeps_left -= 1;
        let change = sweep(PgsPass::All);
        let first = *first.get_or_insert(change);
        let negligible = limits.tolerance * first;
        let is_slow = change > STALL_RATIO * last && change < STALL_LEVEL * first;
        if !(change > negligible) || limits.defers_slow_tail && is_slow {
            break;
        }
        last = change;
        for _ in 0..PRESSING_SWEEPS.min(sweeps_left) {
            sweeps_left -= 1;
            if !(sweep(PgsPass::Pressing) > negligible) {
                break;
            }
        }
    }
    first.unwrap_or(0.0)
}
