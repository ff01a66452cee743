//! Cuts through surfaces with virtual nodes (Molino, Bao, Fedkiw 2004; Wang, Jiang, Schroeder, Teran 2014).
//!
//! The *cells* are the simulated triangles. The render surface is a separate mesh whose *vertices* are weighted means
//! of the nodes of one cell. A cut splits the render mesh along the path of the blade. A cell whose material falls into
//! pieces is copied for each piece, so that the simulated elements keep their shape.
//!
//! Invariants between cuts:
//! - Triangles lie in one cell each and cover its material.
//! - An edge has two triangles, which are neighbors, or is a border or cut-boundary edge.
//! - The triangles around a vertex are one fan. The nodes of a vertex are nodes of all cells around it.
//! - Cells with neighboring triangles share the two nodes of the edge between them. Other cells share a node only if a
//!   chain of such edges around the node connects them.
//!
//! The stages of a cut: `intersect` finds and splits (with `crossing`, `snap`, `split`, `connect`), `slivers`, `open`,
//! `cell_copies`, `virtual_nodes`.

mod blade_query;
mod cell_complex;
mod cell_copies;
mod changes;
mod connect;
mod crossing;
mod cut;
mod intersect;
mod material;
mod node_indices;
mod open;
mod points;
mod separation;
mod slivers;
mod snap;
mod solid;
mod split;
mod surface;
mod tear;
mod tracked;
mod virtual_nodes;

pub(crate) use blade_query::BladeContact;
pub(crate) use cell_complex::{CellComplex, weighted_mean};
pub use changes::{BoundPoint, Changes, CutFace, PieceOfCell, PieceOfNode, PieceOfSpring, RimEdge, Source};
pub use cut::{Limits, Sweep};
pub(crate) use material::{CutEnd, CutMaterial};
pub(crate) use solid::SolidStroke;
pub use solid::{CutSolid, SolidCell, SolidTetrahedron, SolidTriangle, SolidVertex};
pub use surface::{CutSurface, SurfaceCell, SurfaceTriangle, SurfaceVertex};
pub(crate) use tear::VertexLoad;
