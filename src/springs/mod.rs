//! The springs of a body: how they are kept, and the forces of a tile's.

mod kernels;
mod law;
mod packed;
mod tile;

use std::fmt::Debug;

pub use kernels::Kernel;
pub(crate) use kernels::{ChosenKernel, Loops, Range};
pub(crate) use law::separation;
pub(crate) use packed::{Packed, Rounding};
pub(crate) use tile::{TILE, TileForces, tile_count, tile_nodes};

use crate::body::{Spring, Vectors};
use crate::error::Result;

/// One end of a spring, as the node at the other end sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Link {
    pub neighbour: u32,
    /// N/m
    pub stiffness: f32,
    /// m
    pub rest_length: f32,
    /// N s/m
    pub damping: f32,
}

/// What spring forces depend on, and what is wanted next.
#[derive(Clone, Copy)]
pub(crate) struct Motion<'a> {
    pub positions: &'a Vectors,
    /// Given where springs are damped.
    pub velocities: Option<&'a Vectors>,
    /// What the nodes of the tile need after the forces, to be fetched from memory meanwhile.
    pub soon: [&'a [f32]; 6],
}

impl<'a> Motion<'a> {
    /// Nothing is wanted next.
    pub fn at(positions: &'a Vectors, velocities: Option<&'a Vectors>) -> Self {
        Self {
            positions,
            velocities,
            soon: [&[]; 6],
        }
    }
}

/// How the springs of a body are kept. Every solver and every change of topology goes through this.
pub(crate) trait Springs: Debug + Send + Sync {
    /// Whether springs may have damping: fixed when the body is made.
    fn damped(&self) -> bool;

    fn spring_count(&self) -> usize;

    /// Bytes taken by the springs that exist, and bytes held from the allocator.
    fn bytes(&self) -> (usize, usize);

    /// Shows the links of `node`, each once.
    fn visit(&self, node: usize, see: &mut dyn FnMut(Link));

    /// Writes the spring forces on the nodes of `tile`, in newtons; with velocities also the damping along springs.
    fn forces(&self, tile: usize, motion: &Motion, forces: &mut TileForces);

    /// Adds a spring between two nodes of the body; refused where the pair has one already. Its damping counts only where
    /// springs are damped. Changes nothing where it fails.
    fn add(&mut self, spring: &Spring) -> Result<()>;

    /// Removes the spring between `a` and `b`; refused where there is none.
    fn remove(&mut self, a: u32, b: u32) -> Result<()>;
}
