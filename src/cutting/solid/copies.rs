//! Virtual nodes: a node is copied for each set of cells about it that no longer hangs together (Molino, Bao, Fedkiw 2004).

use super::body::{NONE, Node};
use super::cut::Cut;
use crate::base::{Result, memory};
use crate::cutting::changes::{PieceOfCell, PieceOfNode, PieceOfSpring};
use crate::cutting::union::Union;

impl Cut<'_> {
    /// Copies each of the nodes for each set of cells about it that hangs together by what is drawn, but for that in
    /// which the material has a vertex at the node, of several that with the most material.
    pub(crate) fn part_nodes(&mut self, nodes: &[u32]) -> Result<()> {
        let mut union = Union::default();
        let mut corners = Vec::new();
        for &node in nodes {
            self.corners_at(node, &mut corners)?;
            union.reset(corners.len())?;
            for (at, &corner) in corners.iter().enumerate() {
                self.join_across(node, corner / 4, at, &corners, &mut union);
            }
            if !union.is_one() {
                self.part_node(node, &corners, &mut union)?;
            }
        }
        self.share_out()
    }

    /// The cells' corners at a node, in ascending order.
    fn corners_at(&self, node: u32, corners: &mut Vec<u32>) -> Result<()> {
        corners.clear();
        for corner in self.solid.corners_at(node) {
            memory::push(corners, corner)?;
        }
        corners.sort_unstable();
        Ok(())
    }

    /// Unites a cell with those that its material goes on in, across faces that the node moves.
    fn join_across(&self, node: u32, cell: u32, at: usize, corners: &[u32], union: &mut Union) {
        let solid = &*self.solid;
        let is_moved = |vertex: u32| solid.vertices[vertex].nodes.contains(&node);
        let mut tetrahedron = solid.cells[cell].first;
        while tetrahedron != NONE {
            let it = solid.tetrahedra[tetrahedron];
            for (face, &across) in it.neighbours.iter().enumerate() {
                if across == NONE || solid.tetrahedra[across].cell <= cell {
                    continue;
                }
                if solid.face(tetrahedron, face).into_iter().any(is_moved) {
                    let other = corners.partition_point(|&corner| corner / 4 < solid.tetrahedra[across].cell);
                    union.unite(at, other);
                }
            }
            tetrahedron = it.next;
        }
    }

    fn part_node(&mut self, node: u32, corners: &[u32], union: &mut Union) -> Result<()> {
        // Each set, by its lowest corner, with whether the material has a vertex there, and how much of it there is.
        let mut sets: Vec<(usize, bool, f64)> = Vec::new();
        for (at, &corner) in corners.iter().enumerate() {
            let cell = corner / 4;
            let (volume, has_vertex) = (self.solid.cells[cell].volume, self.has_vertex_in(node, cell));
            let lowest = union.lowest(at);
            match sets.iter_mut().find(|(of, ..)| *of == lowest) {
                Some((_, known, sum)) => (*known, *sum) = (*known || has_vertex, *sum + volume),
                None => memory::push(&mut sets, (lowest, has_vertex, volume))?,
            }
        }
        let whole: f64 = sets.iter().map(|(.., volume)| volume).sum();
        let mut main = sets[0];
        for &set in &sets {
            if (set.1, set.2) > (main.1, main.2) {
                main = set;
            }
        }
        let rest = self.solid.nodes[node].rest;
        for (lowest, _, volume) in sets {
            let copy = if lowest == main.0 {
                node
            } else {
                self.limits
                    .check("nodes", self.solid.nodes.count(), self.limits.nodes)?;
                self.solid.nodes.push(Node { rest, first: NONE })?
            };
            let mut next = NONE;
            for (at, &corner) in corners.iter().enumerate().rev() {
                if union.lowest(at) == lowest {
                    self.move_corner(corner, node, copy, next)?;
                    next = corner;
                }
            }
            self.solid.nodes.edit(copy, |node| node.first = next)?;
            memory::push(
                &mut self.changes.nodes,
                PieceOfNode {
                    node: copy,
                    source: node,
                    part: volume / whole,
                },
            )?;
        }
        Ok(())
    }

    /// Whether the material of a cell has a vertex at the node.
    fn has_vertex_in(&self, node: u32, cell: u32) -> bool {
        let solid = &*self.solid;
        let is_at_node = |vertex: u32| {
            let vertex = &solid.vertices[vertex];
            vertex.weights[0] == 1.0 && vertex.nodes[0] == node
        };
        let mut tetrahedron = solid.cells[cell].first;
        while tetrahedron != NONE {
            let it = &solid.tetrahedra[tetrahedron];
            if it.corners.into_iter().any(is_at_node) {
                return true;
            }
            tetrahedron = it.next;
        }
        false
    }

    /// A cell's corner, and the material in the cell, is moved by `copy` instead of `node` from now on.
    fn move_corner(&mut self, corner: u32, node: u32, copy: u32, next: u32) -> Result<()> {
        self.solid.cells.edit(corner / 4, |cell| {
            cell.nodes[corner as usize % 4] = copy;
            cell.next[corner as usize % 4] = next;
        })?;
        if copy == node {
            return Ok(());
        }
        let mut tetrahedron = self.solid.cells[corner / 4].first;
        while tetrahedron != NONE {
            let it = self.solid.tetrahedra[tetrahedron];
            for vertex in it.corners {
                if self.solid.vertices[vertex].nodes.contains(&node) {
                    self.solid.vertices.edit(vertex, |vertex| {
                        vertex.nodes = vertex.nodes.map(|of| if of == node { copy } else { of });
                    })?;
                }
            }
            tetrahedron = it.next;
        }
        Ok(())
    }

    /// Shares out springs among the cells at the nodes that fell apart, by their material.
    fn share_out(&mut self) -> Result<()> {
        let first = self.solid.nodes.count_before();
        let mut sources = memory::reserved((self.solid.nodes.count() - first) as usize)?;
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
            self.corners_at(self.changes.nodes[at].node, &mut corners)?;
            for &corner in &corners {
                memory::push(&mut cells, corner / 4)?;
            }
        }
        memory::sort_once(&mut cells);
        let mut shares = memory::reserved(6 * cells.len())?;
        for &cell in &cells {
            let it = self.solid.cells[cell];
            for (a, b) in [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)] {
                let mut nodes = [it.nodes[a], it.nodes[b]];
                let mut source = nodes.map(source_of);
                if source[0] > source[1] {
                    nodes.reverse();
                    source.reverse();
                }
                if source.iter().any(|node| parted.binary_search(node).is_ok()) {
                    shares.push((source, nodes, cell, it.volume));
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
                let volume: f64 = piece.iter().map(|share| share.3).sum();
                let part = volume / whole;
                memory::push(
                    &mut self.changes.springs,
                    PieceOfSpring {
                        nodes: piece[0].1,
                        source,
                        part,
                    },
                )?;
            }
        }
        self.list_cells(&cells)
    }

    /// Adds to the list of pieces the cells whose nodes changed alone.
    fn list_cells(&mut self, cells: &[u32]) -> Result<()> {
        let first = self.solid.nodes.count_before();
        self.changes.cells.sort_unstable_by_key(|piece| piece.cell);
        let known = self.changes.cells.len();
        for &cell in cells {
            let nodes = self.solid.cells[cell].nodes;
            let is_listed = self.changes.cells[..known]
                .binary_search_by_key(&cell, |piece| piece.cell)
                .is_ok();
            if !is_listed && nodes.iter().any(|&node| node >= first) {
                memory::push(
                    &mut self.changes.cells,
                    PieceOfCell {
                        cell,
                        source: cell,
                        part: 1.0,
                    },
                )?;
            }
        }
        self.changes.cells.sort_unstable_by_key(|piece| piece.cell);
        Ok(())
    }
}
