//! Fetching from memory what is needed soon.

/// Begins to fetch the cache line at `place`, if there is one; nothing where the processor cannot.
#[inline(always)]
pub(crate) fn prefetch<T>(place: *const T) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: part of every processor of this kind; it reads nothing that can be seen, and faults nowhere.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(place.cast()) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = place;
}
