//! Tiles: ranges of nodes that are processed together and fit into the nearest cache.

use std::ops::Range;

use glam::Vec3;

/// Nodes per tile. The last tile of a body has fewer.
pub(crate) const TILE: usize = 512;

/// Number of tiles for `node_count` nodes.
pub(crate) fn tile_count(node_count: usize) -> usize {
    node_count.div_ceil(TILE)
}

/// Nodes of a tile.
#[inline(always)]
pub(crate) fn tile_nodes(tile: usize, node_count: usize) -> Range<usize> {
    tile * TILE..node_count.min((tile + 1) * TILE)
}

/// Forces on the nodes of one tile, N.
#[repr(C, align(64))]
#[derive(Debug)]
pub(crate) struct TileForces {
    axes: [[f32; TILE]; 3],
}

impl TileForces {
    pub const ZERO: Self = Self { axes: [[0.0; TILE]; 3] };

    #[inline(always)]
    pub fn axes(&self) -> [&[f32]; 3] {
        self.axes.each_ref().map(|axis| &axis[..])
    }

    #[inline(always)]
    pub fn axes_mut(&mut self) -> [&mut [f32]; 3] {
        self.axes.each_mut().map(|axis| &mut axis[..])
    }

    #[inline(always)]
    pub fn get(&self, index: usize) -> Vec3 {
        Vec3::from(self.axes().map(|axis| axis[index]))
    }

    #[inline(always)]
    pub fn set(&mut self, index: usize, force: Vec3) {
        for (axis, value) in self.axes.iter_mut().zip(force.to_array()) {
            axis[index] = value;
        }
    }
}
