//! Tests that `.ci/abuse` runs under the compiler's sanitizers only; without their flags this program is empty.

#[cfg(races)]
mod races;
#[cfg(realtime)]
mod realtime;
