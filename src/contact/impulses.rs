//! What contacts with tools and contacts of tissue share: impulses, one contact after another, until they change no more.

/// Sweeps over all contacts, at most: so many that tissue comes to rest.
pub(super) const SWEEPS: u32 = 128;

/// What a sweep changes is nothing, as a part of what the first one did.
const CONVERGED: f32 = 1e-5;

/// The part of how deep something began inside that it is moved out by in a substep, at most.
pub(super) const PUSHED_OUT: f32 = 0.2;

/// s: in substeps so short that this is longer than a fifth of it, what is inside is moved out with a speed of its depth over this time. A part of the
/// depth in each would be the faster the shorter they are, and viscous tissue would ask for ever shorter ones.
const PUSH_TIME: f32 = 1e-3;

/// The part of how deep something began inside a tool that it is moved out by in a substep of so many seconds.
pub(super) fn pushed_out(substep: f32) -> f32 {
    (substep / PUSH_TIME).min(PUSHED_OUT)
}

/// How much faster than the contact any of its nodes moves for it, at most. Only a contact close to pinned nodes would
/// need more, and cannot be had: where nothing gives way, the tool goes in.
pub(crate) const LEVERAGE: f32 = 4.0;

/// Between two sweeps over all contacts so many go over those that press: what does not press seldom begins to.
const BETWEEN: u32 = 3;

/// Sweeps are slow where one over all changes this part of what the last such did, once that is little, as a part of what the first one did. Contacts
/// that share what they give do so for long, and hardly move anything.
const SLOW: f32 = 0.9;
const LITTLE: f32 = 0.01;

/// What a sweep goes over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sweep {
    All,
    /// Contacts that have given something.
    Pressing,
}

/// How long sweeps go on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Effort {
    /// So many at most.
    pub sweeps: u32,
    /// What a sweep changes is nothing, as a part of what the first one did.
    pub converged: f32,
    /// Whether what sweeps change slowly is left to the next substep, which begins with what they gave.
    pub goes_on_later: bool,
}

impl Effort {
    /// So many at most, until they change as little as rounding leaves of slow tissue.
    pub fn of(sweeps: u32) -> Self {
        Self {
            sweeps,
            converged: CONVERGED,
            goes_on_later: false,
        }
    }
}

/// Sweeps until one over all changes velocities by next to nothing beside `first`, m/s, or else beside what the first of them does: the
/// most that it changed.
pub(crate) fn relax(effort: Effort, first: Option<f32>, mut sweep: impl FnMut(Sweep) -> f32) -> f32 {
    let mut first = first;
    let mut left = effort.sweeps;
    let mut before = f32::INFINITY;
    while left > 0 {
        left -= 1;
        let largest = sweep(Sweep::All);
        let first = *first.get_or_insert(largest);
        let still = effort.converged * first;
        let is_slow = largest > SLOW * before && largest < LITTLE * first;
        if !(largest > still) || effort.goes_on_later && is_slow {
            break;
        }
        before = largest;
        for _ in 0..BETWEEN.min(left) {
            left -= 1;
            if !(sweep(Sweep::Pressing) > still) {
                break;
            }
        }
    }
    first.unwrap_or(0.0)
}
