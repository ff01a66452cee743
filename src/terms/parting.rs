//! What a cut makes of the nodes, springs and cells that terms are of, in a body's own numbers.
//!
//! Each term goes on as parts of it, one for each copy of what it is of, as stiff as that copy's share of the material: together they
//! have the energy that it had, or less where what it joined is severed.

use crate::base::{Result, memory};

/// No node.
const NONE: u32 = u32::MAX;

#[derive(Debug, Default)]
pub(crate) struct Parting {
    nodes: Vec<NodePart>,
    springs: Vec<SpringPart>,
    cells: Vec<CellPart>,
    /// The faces of cells as they were, each with the place of the piece.
    faces: Vec<([u32; 3], u32)>,
    /// All nodes that terms which change have one of, in order.
    touched: Vec<u32>,
}

#[derive(Clone, Copy, Debug)]
struct NodePart {
    source: u32,
    node: u32,
    part: f64,
}

/// With nodes in order; of no stiffness: it is gone.
#[derive(Clone, Copy, Debug)]
struct SpringPart {
    source: [u32; 2],
    nodes: [u32; 2],
    part: f64,
}

/// A piece of a triangle, with a node that is none, or of a tetrahedron.
#[derive(Clone, Copy, Debug)]
struct CellPart {
    before: [u32; 4],
    nodes: [u32; 4],
    part: f64,
}

/// A part of what some nodes are joined by.
#[derive(Clone, Copy, Debug)]
pub(super) struct StencilPart<const N: usize> {
    pub nodes: [u32; N],
    pub part: f64,
}

fn ordered([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

impl Parting {
    /// A node is now a part of what another was, which may be itself.
    pub fn add_node(&mut self, source: u32, node: u32, part: f64) -> Result<()> {
        memory::push(&mut self.nodes, NodePart { source, node, part })
    }

    /// A spring is now a part of what another was; 0: it is gone.
    pub fn add_spring(&mut self, source: [u32; 2], nodes: [u32; 2], part: f64) -> Result<()> {
        let (source, nodes) = (ordered(source), ordered(nodes));
        memory::push(&mut self.springs, SpringPart { source, nodes, part })
    }

    /// The spring between these nodes is a part of what it was, if it is none of the first so many, which are in order.
    pub fn add_other_spring(&mut self, nodes: [u32; 2], known: usize, part: f64) -> Result<()> {
        let source = ordered(nodes);
        if self.springs[..known]
            .binary_search_by_key(&source, |piece| piece.source)
            .is_ok()
        {
            return Ok(());
        }
        self.add_spring(source, source, part)
    }

    /// Puts pieces of springs in order: how many there are.
    pub fn know_springs(&mut self) -> usize {
        self.springs.sort_unstable_by_key(|piece| (piece.source, piece.nodes));
        self.springs.len()
    }

    /// A triangle or tetrahedron of these nodes is now a part of what it was between those that [`Self::know_nodes`] tells.
    pub fn add_cell(&mut self, nodes: impl Iterator<Item = u32>, part: f64, by_node: &[(u32, u32)]) -> Result<()> {
        let mut piece = CellPart {
            before: [NONE; 4],
            nodes: [NONE; 4],
            part,
        };
        for (place, node) in nodes.enumerate() {
            let source = by_node.binary_search_by_key(&node, |&(node, _)| node);
            piece.nodes[place] = node;
            piece.before[place] = source.map_or(node, |place| by_node[place].1);
        }
        memory::push(&mut self.cells, piece)
    }

    /// Each node that was added with its source, in order.
    pub fn know_nodes(&mut self) -> Result<Vec<(u32, u32)>> {
        let mut by_node = memory::collected(self.nodes.iter().map(|piece| (piece.node, piece.source)))?;
        by_node.sort_unstable();
        Ok(by_node)
    }

    /// All has been added.
    pub fn complete(&mut self) -> Result<()> {
        self.nodes.sort_unstable_by_key(|piece| (piece.source, piece.node));
        self.know_springs();
        self.faces = memory::reserved(4 * self.cells.len())?;
        for (place, cell) in (0..).zip(&self.cells) {
            let [a, b, c, d] = cell.before;
            for mut face in [[a, b, c], [a, b, d], [a, c, d], [b, c, d]] {
                if !face.contains(&NONE) {
                    face.sort_unstable();
                    self.faces.push((face, place));
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

    /// The nodes that terms which change have one of, in order.
    pub(super) fn touched(&self) -> &[u32] {
        &self.touched
    }

    /// Whether a term of these nodes may change.
    pub(super) fn touches(&self, nodes: &[u32]) -> bool {
        nodes.iter().any(|node| self.touched.binary_search(node).is_ok())
    }

    /// The parts of a node.
    pub(super) fn of_node(&self, node: u32) -> impl Iterator<Item = StencilPart<1>> {
        let first = self.nodes.partition_point(|piece| piece.source < node);
        let pieces = self.nodes[first..].iter().take_while(move |piece| piece.source == node);
        let parts = pieces.map(|piece| StencilPart {
            nodes: [piece.node],
            part: piece.part,
        });
        or_whole([node], parts)
    }

    /// What is left of a spring.
    pub(super) fn of_spring(&self, nodes: [u32; 2]) -> impl Iterator<Item = StencilPart<2>> {
        let source = ordered(nodes);
        let first = self.springs.partition_point(|piece| piece.source < source);
        let pieces = self.springs[first..]
            .iter()
            .take_while(move |piece| piece.source == source);
        let parts = pieces.map(|piece| StencilPart {
            nodes: piece.nodes,
            part: piece.part,
        });
        or_whole(source, parts).filter(|part| part.part > 0.0)
    }

    /// The parts of a cell that has these nodes, three at least.
    pub(super) fn of_cell<const N: usize>(&self, nodes: [u32; N]) -> impl Iterator<Item = StencilPart<N>> {
        let mut face = [nodes[0], nodes[1], nodes[2]];
        face.sort_unstable();
        let first = self.faces.partition_point(|&(other, _)| other < face);
        let pieces = self.faces[first..].iter().take_while(move |(other, _)| *other == face);
        let parts = pieces.filter_map(move |&(_, place)| {
            let piece = &self.cells[place as usize];
            let mut copies = [NONE; N];
            for (copy, node) in copies.iter_mut().zip(nodes) {
                *copy = piece.nodes[piece.before.iter().position(|&other| other == node)?];
            }
            Some(StencilPart {
                nodes: copies,
                part: piece.part,
            })
        });
        or_whole(nodes, parts)
    }
}

/// The parts, or the whole where there are none.
fn or_whole<const N: usize>(
    nodes: [u32; N],
    parts: impl Iterator<Item = StencilPart<N>>,
) -> impl Iterator<Item = StencilPart<N>> {
    let mut parts = parts.peekable();
    let whole = parts.peek().is_none().then_some(StencilPart { nodes, part: 1.0 });
    parts.chain(whole)
}
