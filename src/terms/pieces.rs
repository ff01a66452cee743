//! The pieces into which a cut divides the nodes, springs and cells of terms, in the body's node numbering.
//!
//! Each term continues as one term per piece, with a stiffness proportional to the piece's share of material. Together
//! they have the energy of the original, or less if what it joined is severed.

use crate::base::{Result, memory};

/// Marks an unused corner.
const NONE: u32 = u32::MAX;

#[derive(Debug, Default)]
pub(crate) struct TermPieces {
    nodes: Vec<NodePiece>,
    springs: Vec<SpringPiece>,
    cells: Vec<CellPiece>,
    /// The faces of cells before the cut, each with the index of its piece.
    faces: Vec<([u32; 3], u32)>,
    /// The nodes of changed terms, sorted; each changed term has at least one.
    touched: Vec<u32>,
}

#[derive(Clone, Copy, Debug)]
struct NodePiece {
    source: u32,
    node: u32,
    share: f64,
}

/// A piece of a spring, with sorted nodes. A share of 0 means that the spring is removed.
#[derive(Clone, Copy, Debug)]
struct SpringPiece {
    source: [u32; 2],
    nodes: [u32; 2],
    share: f64,
}

/// A piece of a tetrahedron, or of a triangle with one corner unused.
#[derive(Clone, Copy, Debug)]
struct CellPiece {
    source_nodes: [u32; 4],
    nodes: [u32; 4],
    share: f64,
}

/// A piece of a stencil, with its share of the stiffness.
#[derive(Clone, Copy, Debug)]
pub(super) struct StencilPiece<const N: usize> {
    pub nodes: [u32; N],
    pub share: f64,
}

fn ordered([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

impl TermPieces {
    /// Adds a node as a piece of a source node, which may be itself.
    pub fn add_node(&mut self, source: u32, node: u32, share: f64) -> Result<()> {
        memory::push(&mut self.nodes, NodePiece { source, node, share })
    }

    /// Adds a spring as a piece of a source spring. A share of 0 removes it.
    pub fn add_spring(&mut self, source: [u32; 2], nodes: [u32; 2], share: f64) -> Result<()> {
        let (source, nodes) = (ordered(source), ordered(nodes));
        memory::push(&mut self.springs, SpringPiece { source, nodes, share })
    }

    /// Adds the spring between these nodes as a piece of itself, unless it is the source of one of the first
    /// `sorted_count` pieces.
    pub fn add_other_spring(&mut self, nodes: [u32; 2], sorted_count: usize, share: f64) -> Result<()> {
        let source = ordered(nodes);
        if self.springs[..sorted_count]
            .binary_search_by_key(&source, |piece| piece.source)
            .is_ok()
        {
            return Ok(());
        }
        self.add_spring(source, source, share)
    }

    /// Sorts the pieces of springs. Returns their number.
    pub fn sort_springs(&mut self) -> usize {
        self.springs.sort_unstable_by_key(|piece| (piece.source, piece.nodes));
        self.springs.len()
    }

    /// Adds a triangle or tetrahedron as a piece of a cell. `by_node` is the result of [`Self::sorted_nodes`] and gives
    /// the source of each node.
    pub fn add_cell(&mut self, nodes: impl Iterator<Item = u32>, share: f64, by_node: &[(u32, u32)]) -> Result<()> {
        let mut piece = CellPiece {
            source_nodes: [NONE; 4],
            nodes: [NONE; 4],
            share,
        };
        for (index, node) in nodes.enumerate() {
            let source = by_node.binary_search_by_key(&node, |&(node, _)| node);
            piece.nodes[index] = node;
            piece.source_nodes[index] = source.map_or(node, |index| by_node[index].1);
        }
        memory::push(&mut self.cells, piece)
    }

    /// The added nodes with their sources, sorted.
    pub fn sorted_nodes(&mut self) -> Result<Vec<(u32, u32)>> {
        let mut by_node = memory::collected(self.nodes.iter().map(|piece| (piece.node, piece.source)))?;
        by_node.sort_unstable();
        Ok(by_node)
    }

    /// Finishes the lists after all pieces were added.
    pub fn complete(&mut self) -> Result<()> {
        self.nodes.sort_unstable_by_key(|piece| (piece.source, piece.node));
        self.sort_springs();
        self.faces = memory::reserved(4 * self.cells.len())?;
        for (index, cell) in (0..).zip(&self.cells) {
            let [a, b, c, d] = cell.source_nodes;
            for mut face in [[a, b, c], [a, b, d], [a, c, d], [b, c, d]] {
                if !face.contains(&NONE) {
                    face.sort_unstable();
                    self.faces.push((face, index));
                }
            }
        }
        self.faces.sort_unstable();
        self.touched = memory::reserved(self.nodes.len() + 2 * self.springs.len())?;
        self.touched.extend(self.nodes.iter().map(|piece| piece.source));
        self.touched.extend(self.springs.iter().flat_map(|piece| piece.source));
        memory::sort_once(&mut self.touched);
        Ok(())
    }

    /// The nodes of changed terms, sorted; each changed term has at least one.
    pub(super) fn touched(&self) -> &[u32] {
        &self.touched
    }

    /// True if a term of these nodes may change.
    pub(super) fn touches(&self, nodes: &[u32]) -> bool {
        nodes.iter().any(|node| self.touched.binary_search(node).is_ok())
    }

    /// The pieces of a node.
    pub(super) fn node_pieces(&self, node: u32) -> impl Iterator<Item = StencilPiece<1>> {
        let first = self.nodes.partition_point(|piece| piece.source < node);
        let pieces = self.nodes[first..].iter().take_while(move |piece| piece.source == node);
        let stencil_pieces = pieces.map(|piece| StencilPiece {
            nodes: [piece.node],
            share: piece.share,
        });
        or_whole([node], stencil_pieces)
    }

    /// The pieces of a spring.
    pub(super) fn spring_pieces(&self, nodes: [u32; 2]) -> impl Iterator<Item = StencilPiece<2>> {
        let source = ordered(nodes);
        let first = self.springs.partition_point(|piece| piece.source < source);
        let pieces = self.springs[first..]
            .iter()
            .take_while(move |piece| piece.source == source);
        let stencil_pieces = pieces.map(|piece| StencilPiece {
            nodes: piece.nodes,
            share: piece.share,
        });
        or_whole(source, stencil_pieces).filter(|share| share.share > 0.0)
    }

    /// The pieces of the cell with these nodes, at least three.
    pub(super) fn cell_pieces<const N: usize>(&self, nodes: [u32; N]) -> impl Iterator<Item = StencilPiece<N>> {
        let mut face = [nodes[0], nodes[1], nodes[2]];
        face.sort_unstable();
        let first = self.faces.partition_point(|&(other, _)| other < face);
        let pieces = self.faces[first..].iter().take_while(move |(other, _)| *other == face);
        let stencil_pieces = pieces.filter_map(move |&(_, index)| {
            let piece = &self.cells[index as usize];
            let mut copies = [NONE; N];
            for (copy, node) in copies.iter_mut().zip(nodes) {
                *copy = piece.nodes[piece.source_nodes.iter().position(|&other| other == node)?];
            }
            Some(StencilPiece {
                nodes: copies,
                share: piece.share,
            })
        });
        or_whole(nodes, stencil_pieces)
    }
}

/// The pieces, or the whole if there are none.
fn or_whole<const N: usize>(
    nodes: [u32; N],
    stencil_pieces: impl Iterator<Item = StencilPiece<N>>,
) -> impl Iterator<Item = StencilPiece<N>> {
    let mut stencil_pieces = stencil_pieces.peekable();
    let whole = stencil_pieces
        .peek()
        .is_none()
        .then_some(StencilPiece { nodes, share: 1.0 });
    stencil_pieces.chain(whole)
}
