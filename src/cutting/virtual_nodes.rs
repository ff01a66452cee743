//! Virtual nodes: a node is copied for each disconnected set of cells around it (Molino, Bao, Fedkiw 2004).

use super::cell_complex::{CellComplex, NONE, Node};
use super::cell_copies::Copier;
use super::changes::{PieceOfCell, PieceOfNode, PieceOfSpring};
use crate::base::DisjointSets;
use crate::base::{Result, memory};

impl<const N: usize, D: CellComplex<N>> Copier<'_, N, D> {
    /// Copies each node for each connected set of cells around it but one. The original stays with the set whose
    /// material has a vertex at the node, or of several with the one with the most material.
    pub(super) fn copy_nodes(&mut self, nodes: &[u32]) -> Result<()> {
        let mut union = DisjointSets::default();
        let mut corners = Vec::new();
        for &node in nodes {
            self.list_corners(node, &mut corners)?;
            union.reset(corners.len())?;
            for (index, &corner) in corners.iter().enumerate() {
                self.unite_neighbors(node, corner / N as u32, index, &corners, &mut union);
            }
            if !union.is_one() {
                self.copy_node(node, &corners, &mut union)?;
            }
        }
        self.distribute_springs()
    }

    /// The corners of cells at a node, in ascending order.
    fn list_corners(&self, node: u32, corners: &mut Vec<u32>) -> Result<()> {
        corners.clear();
        memory::extend(corners, self.body.corners_at(node))?;
        corners.sort_unstable();
        Ok(())
    }

    /// Unites a cell with those that its material continues in, across sides that the node moves.
    fn unite_neighbors(&self, node: u32, cell: u32, index: usize, corners: &[u32], union: &mut DisjointSets) {
        for simplex in self.body.simplices_in(cell) {
            let it = self.body.simplex(simplex);
            let is_bound_to_node = |&corner: &usize| self.body.binding(it.corners[corner]).0.contains(&node);
            for (across, side) in it.neighbors.into_iter().zip(D::SIDES) {
                if across == NONE || self.body.simplex(across).cell <= cell {
                    continue;
                }
                if side.iter().any(is_bound_to_node) {
                    let neighbor_cell = self.body.simplex(across).cell;
                    union.unite(
                        index,
                        corners.partition_point(|&corner| corner / (N as u32) < neighbor_cell),
                    );
                }
            }
        }
    }

    fn copy_node(&mut self, node: u32, corners: &[u32], union: &mut DisjointSets) -> Result<()> {
        // Each set, by its lowest corner: whether its material has a vertex at the node, and the amount of material.
        let mut sets: Vec<(usize, bool, f64)> = Vec::new();
        for (index, &corner) in corners.iter().enumerate() {
            let cell = corner / N as u32;
            let (material, has_vertex) = (self.body.cell(cell).material, self.has_vertex_in(node, cell));
            let lowest = union.lowest(index);
            match sets.iter_mut().find(|(component, ..)| *component == lowest) {
                Some((_, listed, sum)) => (*listed, *sum) = (*listed || has_vertex, *sum + material),
                None => memory::push(&mut sets, (lowest, has_vertex, material))?,
            }
        }
        let total: f64 = sets.iter().map(|(.., material)| material).sum();
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
            for (index, &corner) in corners.iter().enumerate().rev() {
                if union.lowest(index) == lowest {
                    self.replace_node(corner, node, copy, next)?;
                    next = corner;
                }
            }
            self.body.nodes_mut().edit(copy, |node| node.first = next)?;
            let piece = PieceOfNode {
                node: copy,
                source: node,
                part: material / total,
            };
            memory::push(&mut self.changes.nodes, piece)?;
        }
        Ok(())
    }

    /// True if the material of a cell has a vertex at the node.
    fn has_vertex_in(&self, node: u32, cell: u32) -> bool {
        let is_at_node = |vertex: u32| self.body.is_at(vertex, node);
        let mut inside = self.body.simplices_in(cell);
        inside.any(|simplex| self.body.simplex(simplex).corners.into_iter().any(is_at_node))
    }

    /// Replaces `node` by `copy` at a cell's corner, and in the vertices of the cell's material.
    fn replace_node(&mut self, corner: u32, node: u32, copy: u32, next: u32) -> Result<()> {
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
                let (nodes, _) = self.body.binding(vertex);
                if nodes.contains(&node) {
                    self.body.bind(
                        vertex,
                        nodes.map(|component| if component == node { copy } else { component }),
                    )?;
                }
            }
            simplex = it.next;
        }
        Ok(())
    }

    /// Distributes springs to the cells at nodes that fell apart, in proportion to their material.
    fn distribute_springs(&mut self) -> Result<()> {
        let first = self.body.nodes().count_before();
        let mut sources = memory::reserved((self.body.nodes().count() - first) as usize)?;
        let mut fallen_apart = memory::reserved(self.changes.nodes.len())?;
        for piece in &self.changes.nodes {
            if piece.node != piece.source {
                sources.push(piece.source);
            }
            fallen_apart.push(piece.source);
        }
        fallen_apart.dedup();
        let source_of = |node: u32| {
            if node < first {
                node
            } else {
                sources[(node - first) as usize]
            }
        };
        let (mut cells, mut corners) = (Vec::new(), Vec::new());
        for index in 0..self.changes.nodes.len() {
            self.list_corners(self.changes.nodes[index].node, &mut corners)?;
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
                if source.iter().any(|node| fallen_apart.binary_search(node).is_ok()) {
                    shares.push((source, nodes, cell, it.material));
                }
            }
        }
        shares.sort_unstable_by_key(|&(source, nodes, cell, _)| (source, nodes, cell));
        for spring_shares in shares.chunk_by(|a, b| a.0 == b.0) {
            let total: f64 = spring_shares.iter().map(|share| share.3).sum();
            let source = spring_shares[0].0;
            if spring_shares.iter().all(|share| share.1 == source) {
                continue;
            }
            if spring_shares.iter().all(|share| share.1 != source) {
                memory::push(&mut self.changes.removed_springs, source)?;
            }
            for piece in spring_shares.chunk_by(|a, b| a.1 == b.1) {
                let material: f64 = piece.iter().map(|share| share.3).sum();
                let piece = PieceOfSpring {
                    nodes: piece[0].1,
                    source,
                    part: material / total,
                };
                memory::push(&mut self.changes.springs, piece)?;
            }
        }
        self.list_cells(&cells)
    }

    /// Lists the cells that only changed a node.
    fn list_cells(&mut self, cells: &[u32]) -> Result<()> {
        let first = self.body.nodes().count_before();
        self.changes.cells.sort_unstable_by_key(|piece| piece.cell);
        let listed = self.changes.cells.len();
        for &cell in cells {
            let nodes = self.body.cell(cell).nodes;
            let is_listed = self.changes.cells[..listed]
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
