//! Cuts through surfaces with virtual nodes (Molino, Bao, Fedkiw 2004; Wang, Jiang, Schroeder, Teran 2014).
//!
//! Material lies in *cells*, the triangles that are simulated. What is drawn and touched is a mesh of its own, whose *vertices* are given by
//! weights of a cell's nodes. A cut splits the drawn mesh where the blade went; a cell whose material falls into pieces is copied for each,
//! so that what is simulated stays as well shaped as it was.
//!
//! What holds between cuts: triangles lie in one cell and cover its material; an edge has two triangles, which are neighbours, or is border or
//! rim; the triangles about a vertex are one fan; the nodes of a vertex are nodes of all cells about it; cells whose triangles are neighbours
//! share the two nodes of the edge between them, and no others do unless a chain of such edges about the node joins them.
//!
//! A cut goes through these stages: `carve` finds and splits (with `crossing`, `snap`, `split`, `connect`), `crumbs`, `open`, `pieces`, `copies`.

mod carve;
mod changes;
mod connect;
mod copies;
mod crossing;
mod crumbs;
mod cut;
mod divided;
mod material;
mod met;
mod numbers;
mod open;
mod parted;
mod pieces;
mod points;
mod snap;
mod solid;
mod split;
mod surface;
mod tear;
mod tracked;

pub use changes::{BoundPoint, Changes, CutFace, PieceOfCell, PieceOfNode, PieceOfSpring, RimEdge, Source};
pub use cut::{Limits, Sweep};
pub(crate) use divided::{Divided, weighed};
pub(crate) use material::{CutEnd, CutMaterial};
pub(crate) use met::Met;
pub(crate) use solid::SolidStroke;
pub use solid::{CutSolid, SolidCell, SolidTetrahedron, SolidTriangle, SolidVertex};
pub use surface::{CutSurface, SurfaceCell, SurfaceTriangle, SurfaceVertex};
pub(crate) use tear::VertexLoad;
