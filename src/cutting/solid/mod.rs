//! Cuts through tetrahedral solids with virtual nodes (Molino, Bao, Fedkiw 2004; Wang, Jiang, Schroeder, Teran 2014).
//!
//! Material lies in *cells*, the tetrahedra that are simulated. It is divided into tetrahedra of its own, one for each cell at first, whose
//! *vertices* are given by weights of a cell's nodes. A cut splits edges of the material where the blade crosses them, which leaves the material
//! conforming and loses none, and parts it along faces whose corners all lie on the blade's way. A cell whose material falls into pieces is copied
//! for each, so that what is simulated stays as well shaped as it was. What is drawn and touched are the faces of the material with nothing across.
//!
//! What holds between cuts: a cell's tetrahedra fill its material; across a face lies one tetrahedron, or nothing, and then the face is drawn; the
//! tetrahedra about a vertex hang together by faces at it; what is drawn is a closed manifold; the nodes of a vertex are nodes of all cells about
//! it; cells whose tetrahedra are neighbours share the nodes that move the face between them.
//!
//! A cut goes through these stages: `carve` finds and splits (with `crossing`, `split`) and marks vertices as being on the blade, `sever` finds the
//! faces on its way, `crumbs` and `manifold` those of them that can open yet, `open` opens them; cells and nodes are parted as those of surfaces are.

mod body;
mod build;
mod carve;
mod crossing;
mod crumbs;
mod cut;
mod ends;
mod manifold;
mod met;
mod open;
mod points;
mod reach;
mod sever;
mod split;
mod tear;

pub use body::{CutSolid, SolidCell, SolidTetrahedron, SolidTriangle, SolidVertex};
pub(crate) use sever::SolidStroke;
