//! Hand-overs between threads, of which none ever waits for another.
//!
//! One thread writes, others read what was written last and whole. Nothing here locks, allocates or waits.

pub(crate) mod pool;
mod sync;
pub(crate) mod triple_buffer;
