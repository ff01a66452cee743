//! Structure of arrays: vectors of the nodes of a body, tile by tile.

mod node_order;
mod per_node;
mod rates;
mod records;
mod region;
mod tile;
mod vectors;

pub(crate) use node_order::NodeOrder;
pub(crate) use per_node::{PerNode, per_node};
pub(crate) use rates::{Masses, Rates};
pub(crate) use records::{Records, WriteRecords};
pub(crate) use region::{Region, Scale};
pub(crate) use tile::{TILE, TileForces, tile_count, tile_nodes};
pub(crate) use vectors::{MARGIN, Places, Vectors, View, copy_axes};
