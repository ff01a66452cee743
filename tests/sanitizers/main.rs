//! What `.ci/abuse` runs under the compiler's sanitizers alone; without their flags there is nothing in it.

#[cfg(races)]
mod races;
#[cfg(realtime)]
mod realtime;
