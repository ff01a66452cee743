//! Structure-of-arrays storage of nodal vectors, in tiles.

mod frequency_bound;
mod node_order;
mod per_node;
mod records;
mod region;
mod tile;
mod vectors;

pub(crate) use frequency_bound::{FrequencyBound, NodalMasses};
pub(crate) use node_order::NodeOrder;
pub(crate) use per_node::{PerNode, per_node};
pub(crate) use records::{Records, WriteRecords};
pub(crate) use region::{Region, Scale};
pub(crate) use tile::{TILE, TileForces, tile_count, tile_nodes};
pub(crate) use vectors::{BasePointers, MARGIN, Vectors, View, copy_axes};
