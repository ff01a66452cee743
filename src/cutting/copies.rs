//! Virtual nodes: a node is copied for each set of cells about it that no longer hangs together (Molino, Bao, Fedkiw 2004).

use super::changes::{PieceOfCell, PieceOfNode, PieceOfSpring};
use super::divided::{Divided, NONE, Node};
use super::pieces::Copier;
use crate::base::DisjointSets;
use crate::base::{Result, memory};

impl<const N: usize, D: Divided<N>> Copier<'_, N, D> {
    /// Copies each of the nodes for each set of cells about it that hangs together by their material, but for that in which the material has
    /// a vertex at the node, of several that with the most material.
    pub(super) fn part_nodes(&mut self, nodes: &[u32]) -> Result<()> {
        let mut union = DisjointSets::default();
        let mut corners = Vec::new();
        for &node in nodes {
            self.list_corners(node, &mut corners)?;
            union.reset(corners.len())?;
            for (at, &corner) in corners.iter().enumerate() {
                self.join_across(node, corner / N as u32, at, &corners, &mut union);
            }
            if !union.is_one() {
                self.part_node(node, &corners, &mut union)?;
            }
        }
        self.share_out()
    }

    /// The cells' corners at a node, in ascending order.
    fn list_corners(&self, node: u32, corners: &mut Vec<u32>) -> Result<()> {
        corners.clear();
        memory::extend(corners, self.body.corners_at(node))?;
        corners.sort_unstable();
        Ok(())
    }

    /// Unites a cell with those that its material goes on in, across sides that the node moves.
    fn join_across(&self, node: u32, cell: u32, at: usize, corners: &[u32], union: &mut DisjointSets) {
        for simplex in self.body.simplices_in(cell) {
            let it = self.body.simplex(simplex);
            let is_moved = |&corner: &usize| self.body.bonds(it.corners[corner]).0.contains(&node);
            for (across, side) in it.neighbours.into_iter().zip(D::SIDES) {
                if across == NONE || self.body.simplex(across).cell <= cell {
                    continue;
                }
                if side.iter().any(is_moved) {
                    let beyond = self.body.simplex(across).cell;
                    union.unite(at, corners.partition_point(|&corner| corner / (N as u32) < beyond));
                }
            }
        }
    }

    fn part_node(&mut self, node: u32, corners: &[u32], union: &mut DisjointSets) -> Result<()> {
        // Each set, by its lowest corner, with whether the material has a vertex there, and how much of it there is.
        let mut sets: Vec<(usize, bool, f64)> = Vec::new();
        for (at, &corner) in corners.iter().enumerate() {
            let cell = corner / N as u32;
            let (material, has_vertex) = (self.body.cell(cell).material, self.has_vertex_in(node, cell));
            let lowest = union.lowest(at);
            match sets.iter_mut().find(|(of, ..)| *of == lowest) {
                Some((_, known, sum)) => (*known, *sum) = (*known || has_vertex, *sum + material),
                None => memory::push(&mut sets, (lowest, has_vertex, material))?,
            }
        }
        let whole: f64 = sets.iter().map(|(.., material)| material).sum();
        let mut main = sets[0];
        for &set in &sets {
            if (set.1, set.2) > (main.1, main.2) {
                main = set;
            }
        }
        let rest = self.body.nodes()[node].rest;
        for (lowest, _, material) in sets {
            let copy = if lowest == main.0 {
                node
            } else {
                self.limits
                    .check("nodes", self.body.nodes().count(), self.limits.nodes)?;
                self.body.nodes_mut().push(Node { rest, first: NONE })?
            };
            let mut next = NONE;
            for (at, &corner) in corners.iter().enumerate().rev() {
                if union.lowest(at) == lowest {
                    self.move_corner(corner, node, copy, next)?;
                    next = corner;
                }
            }
            self.body.nodes_mut().edit(copy, |node| node.first = next)?;
            let piece = PieceOfNode {
                node: copy,
                source: node,
                part: material / whole,
            };
            memory::push(&mut self.changes.nodes, piece)?;
        }
        Ok(())
    }

    /// Whether the material of a cell has a vertex at the node.
    fn has_vertex_in(&self, node: u32, cell: u32) -> bool {
        let is_at_node = |vertex: u32| self.body.is_at(vertex, node);
        let mut inside = self.body.simplices_in(cell);
        inside.any(|simplex| self.body.simplex(simplex).corners.into_iter().any(is_at_node))
    }

    /// A cell's corner, and the material in the cell, is moved by `copy` instead of `node` from now on.
    fn move_corner(&mut self, corner: u32, node: u32, copy: u32, next: u32) -> Result<()> {
        let (cell, k) = (corner / N as u32, corner as usize % N);
        let mut it = self.body.cell(cell);
        (it.nodes[k], it.next[k]) = (copy, next);
        self.body.set_cell(cell, it)?;
        if copy == node {
            return Ok(());
        }
        let mut simplex = it.first;
        while simplex != NONE {
            let it = self.body.simplex(simplex);
            for vertex in it.corners {
                let (nodes, _) = self.body.bonds(vertex);
                if nodes.contains(&node) {
                    self.body
                        .bind(vertex, nodes.map(|of| if of == node { copy } else { of }))?;
                }
            }
            simplex = it.next;
        }
        Ok(())
    }

    /// Shares out springs among the cells at the nodes that fell apart, by their material.
    fn share_out(&mut self) -> Result<()> {
        let first = self.body.nodes().count_before();
        let mut sources = memory::reserved((self.body.nodes().count() - first) as usize)?;
        let mut parted = memory::reserved(self.changes.nodes.len())?;
        for piece in &self.changes.nodes {
            if piece.node != piece.source {
                sources.push(piece.source);
            }
            parted.push(piece.source);
        }
        parted.dedup();
        let source_of = |node: u32| {
            if node < first {
                node
            } else {
                sources[(node - first) as usize]
            }
        };
        let (mut cells, mut corners) = (Vec::new(), Vec::new());
        for at in 0..self.changes.nodes.len() {
            self.list_corners(self.changes.nodes[at].node, &mut corners)?;
            memory::extend(&mut cells, corners.iter().map(|corner| corner / N as u32))?;
        }
        memory::sort_once(&mut cells);
        let mut shares = memory::reserved(D::EDGES.len() * cells.len())?;
        for &cell in &cells {
            let it = self.body.cell(cell);
            for &edge in D::EDGES {
                let mut nodes = edge.map(|k| it.nodes[k]);
                let mut source = nodes.map(source_of);
                if source[0] > source[1] {
                    nodes.reverse();
                    source.reverse();
                }
                if source.iter().any(|node| parted.binary_search(node).is_ok()) {
                    shares.push((source, nodes, cell, it.material));
                }
            }
        }
        shares.sort_unstable_by_key(|&(source, nodes, cell, _)| (source, nodes, cell));
        for of_spring in shares.chunk_by(|a, b| a.0 == b.0) {
            let whole: f64 = of_spring.iter().map(|share| share.3).sum();
            let source = of_spring[0].0;
            if of_spring.iter().all(|share| share.1 == source) {
                continue;
            }
            if of_spring.iter().all(|share| share.1 != source) {
                memory::push(&mut self.changes.removed_springs, source)?;
            }
            for piece in of_spring.chunk_by(|a, b| a.1 == b.1) {
                let material: f64 = piece.iter().map(|share| share.3).sum();
                let piece = PieceOfSpring {
                    nodes: piece[0].1,
                    source,
                    part: material / whole,
                };
                memory::push(&mut self.changes.springs, piece)?;
            }
        }
        self.list_cells(&cells)
    }

    /// Adds to the list of pieces the cells whose nodes changed alone.
    fn list_cells(&mut self, cells: &[u32]) -> Result<()> {
        let first = self.body.nodes().count_before();
        self.changes.cells.sort_unstable_by_key(|piece| piece.cell);
        let known = self.changes.cells.len();
        for &cell in cells {
            let nodes = self.body.cell(cell).nodes;
            let is_listed = self.changes.cells[..known]
                .binary_search_by_key(&cell, |piece| piece.cell)
                .is_ok();
            if !is_listed && nodes.iter().any(|&node| node >= first) {
                let piece = PieceOfCell {
                    cell,
                    source: cell,
                    part: 1.0,
                };
                memory::push(&mut self.changes.cells, piece)?;
            }
        }
        self.changes.cells.sort_unstable_by_key(|piece| piece.cell);
        Ok(())
    }
}
