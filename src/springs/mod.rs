//! The springs of a body: how they are kept, and the force of one.

mod law;
mod packed;

pub(crate) use law::separation;
pub(crate) use packed::Packed;
