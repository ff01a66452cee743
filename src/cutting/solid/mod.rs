//! Cuts through tetrahedral solids with virtual nodes (Molino, Bao, Fedkiw 2004; Wang, Jiang, Schroeder, Teran 2014).
//!
//! The *cells* are the simulated tetrahedra. Their material is divided into separate tetrahedra, one for each cell at
//! first, whose *vertices* are weighted means of the nodes of one cell. A cut splits edges of the material where the
//! blade crosses them, which keeps the material conforming and conserves its volume. It separates the material along
//! faces whose corners all lie on the blade's path. A cell whose material falls into pieces is copied for each piece,
//! so that the simulated elements keep their shape. The render surface consists of the faces of the material without a
//! neighbor.
//!
//! Invariants between cuts:
//! - The tetrahedra of a cell fill its material. A face has one neighbor, or is in the render surface.
//! - The tetrahedra around a vertex are connected through faces at it. The render surface is a closed manifold.
//! - The nodes of a vertex are nodes of all cells around it. Cells with neighboring tetrahedra share the nodes that
//!   move the face between them.
//!
//! The stages of a cut: `intersect` finds and splits (with `crossing`, `split`) and marks vertices as on the blade.
//! `separate` finds the faces on its path. `slivers` and `manifold` select those that can open, and `open` opens them.
//! Cells and nodes are copied as in surfaces.

mod blade_query;
mod body;
mod build;
mod crossing;
mod cut;
mod ends;
mod intersect;
mod manifold;
mod open;
mod opening;
mod points;
mod separate;
mod slivers;
mod split;
mod tear;

pub use body::{CutSolid, SolidCell, SolidTetrahedron, SolidTriangle, SolidVertex};
pub(crate) use separate::SolidStroke;
