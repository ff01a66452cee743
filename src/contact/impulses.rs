//! What contacts with tools and contacts of tissue share: impulses, one contact after another, until they change no more.

/// Sweeps over all contacts, at most: so many that tissue comes to rest.
pub(super) const SWEEPS: u32 = 128;

/// What a sweep changes is nothing, as a part of what the first one did.
const CONVERGED: f32 = 1e-5;

/// The part of how deep something began inside that it is moved out by in a substep.
pub(super) const PUSHED_OUT: f32 = 0.2;

/// How much faster than the contact any of its nodes moves for it, at most. Only a contact close to pinned nodes would
/// need more, and cannot be had: where nothing gives way, the tool goes in.
pub(super) const LEVERAGE: f32 = 4.0;

/// Sweeps until one changes velocities by next to nothing beside `first`, m/s, or else beside what the first of them does: the most
/// that it changed.
pub(super) fn relax(sweeps: u32, first: Option<f32>, mut sweep: impl FnMut() -> f32) -> f32 {
    let mut first = first;
    for _ in 0..sweeps {
        let largest = sweep();
        if !(largest > CONVERGED * *first.get_or_insert(largest)) {
            break;
        }
    }
    first.unwrap_or(0.0)
}
