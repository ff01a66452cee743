//! Wait-free exchange of values between threads.
//!
//! One thread writes; others read the latest complete value. Nothing here locks, allocates or waits.

mod atomics;
pub(crate) mod pool;
pub(crate) mod triple_buffer;
