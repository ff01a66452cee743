//! What limits substeps.

use crate::base::LimitKind;

/// The step was not refused.
pub const SINEW_LIMIT_NONE: u32 = 0;
/// Springs of a node; the nodes are the stiffest spring.
pub const SINEW_LIMIT_SPRING: u32 = 1;
/// Elements of a node; the nodes are the stiffest tetrahedron.
pub const SINEW_LIMIT_ELEMENT: u32 = 2;
/// Anchor, bending, fiber, Maxwell or strain-limiting terms of a node.
pub const SINEW_LIMIT_TERM: u32 = 3;
/// Pressure in a cavity.
pub const SINEW_LIMIT_CAVITY: u32 = 4;
/// Parts of a step of IMPLICIT or NEWTON in contact or attached.
pub const SINEW_LIMIT_PARTS: u32 = 5;
/// Tolerance of the world.
pub const SINEW_LIMIT_TOLERANCE: u32 = 6;

/// The constant of a limit.
pub(super) fn limit_of(kind: LimitKind) -> u32 {
    match kind {
        LimitKind::Spring => SINEW_LIMIT_SPRING,
        LimitKind::Element => SINEW_LIMIT_ELEMENT,
        LimitKind::Term => SINEW_LIMIT_TERM,
        LimitKind::Cavity => SINEW_LIMIT_CAVITY,
        LimitKind::Parts => SINEW_LIMIT_PARTS,
        LimitKind::Tolerance => SINEW_LIMIT_TOLERANCE,
    }
}
