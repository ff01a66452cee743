//! Virtual nodes: a node is copied for each set of cells about it that no longer hangs together (Molino, Bao, Fedkiw 2004).

use super::changes::{PieceOfCell, PieceOfNode, PieceOfSpring};
use super::cut::Cut;
use super::surface::{NONE, Node};
use super::union::Union;
use crate::base::{Result, memory};

impl Cut<'_> {
    /// Copies each of the nodes for each set of cells about it that hangs together by what is drawn, but for that with the most material.
    pub(crate) fn part_nodes(&mut self, nodes: &[u32]) -> Result<()> {
        let mut union = Union::default();
        let mut corners = Vec::new();
        for &node in nodes {
            self.corners_at(node, &mut corners)?;
            union.reset(corners.len())?;
            for (at, &corner) in corners.iter().enumerate() {
                self.join_across(node, corner / 3, at, &corners, &mut union);
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
        let mut corner = self.surface.nodes[node].first;
        while corner != NONE {
            memory::push(corners, corner)?;
            corner = self.surface.cells[corner / 3].next[corner as usize % 3];
        }
        corners.sort_unstable();
        Ok(())
    }

    /// Unites a cell with those that its triangles go on in, across edges that the node moves.
    fn join_across(&self, node: u32, cell: u32, at: usize, corners: &[u32], union: &mut Union) {
        let surface = &*self.surface;
        let is_moved = |vertex: u32| surface.vertices[vertex].nodes.contains(&node);
        let mut triangle = surface.cells[cell].first;
        while triangle != NONE {
            let it = surface.triangles[triangle];
            for side in 0..3 {
                let across = it.neighbours[side];
                if across == NONE || surface.triangles[across].cell <= cell {
                    continue;
                }
                if is_moved(it.corners[side]) || is_moved(it.corners[(side + 1) % 3]) {
                    let other = corners.partition_point(|&corner| corner / 3 < surface.triangles[across].cell);
                    union.unite(at, other);
                }
            }
            triangle = it.next;
        }
    }

    fn part_node(&mut self, node: u32, corners: &[u32], union: &mut Union) -> Result<()> {
        // Each set, by its lowest corner, with its material, and whether the node itself is drawn there.
        let mut sets: Vec<(usize, f64, bool)> = Vec::new();
        for (at, &corner) in corners.iter().enumerate() {
            let area = self.surface.cells[corner / 3].area;
            let is_drawn = self.is_drawn_in(node, corner / 3);
            let lowest = union.lowest(at);
            match sets.iter_mut().find(|(of, ..)| *of == lowest) {
                Some((_, sum, drawn)) => (*sum, *drawn) = (*sum + area, *drawn || is_drawn),
                None => memory::push(&mut sets, (lowest, area, is_drawn))?,
            }
        }
        let whole: f64 = sets.iter().map(|(_, area, _)| area).sum();
        let mut first = sets[0];
        for &set in &sets {
            if (set.2, set.1) > (first.2, first.1) {
                first = set;
            }
        }
        let rest = self.surface.nodes[node].rest;
        for (lowest, area, _) in sets {
            let copy = if lowest == first.0 {
                node
            } else {
                self.limits
                    .check("nodes", self.surface.nodes.count(), self.limits.nodes)?;
                self.surface.nodes.push(Node { rest, first: NONE })?
            };
            let mut next = NONE;
            for (at, &corner) in corners.iter().enumerate().rev() {
                if union.lowest(at) == lowest {
                    self.move_corner(corner, node, copy, next)?;
                    next = corner;
                }
            }
            self.surface.nodes.edit(copy, |node| node.first = next)?;
            memory::push(
                &mut self.changes.nodes,
                PieceOfNode {
                    node: copy,
                    source: node,
                    part: area / whole,
                },
            )?;
        }
        Ok(())
    }

    /// Whether a vertex at the node is drawn in the cell.
    fn is_drawn_in(&self, node: u32, cell: u32) -> bool {
        let surface = &*self.surface;
        let is_at_node = |vertex: u32| {
            let vertex = &surface.vertices[vertex];
            vertex.weights[0] == 1.0 && vertex.nodes[0] == node
        };
        let mut triangle = surface.cells[cell].first;
        while triangle != NONE {
            let it = surface.triangles[triangle];
            if it.corners.into_iter().any(is_at_node) {
                return true;
            }
            triangle = it.next;
        }
        false
    }

    /// A cell's corner, and what is drawn in the cell, is moved by `copy` instead of `node` from now on.
    fn move_corner(&mut self, corner: u32, node: u32, copy: u32, next: u32) -> Result<()> {
        self.surface.cells.edit(corner / 3, |cell| {
            cell.nodes[corner as usize % 3] = copy;
            cell.next[corner as usize % 3] = next;
        })?;
        if copy == node {
            return Ok(());
        }
        let mut triangle = self.surface.cells[corner / 3].first;
        while triangle != NONE {
            let it = self.surface.triangles[triangle];
            for vertex in it.corners {
                if self.surface.vertices[vertex].nodes.contains(&node) {
                    self.surface.vertices.edit(vertex, |vertex| {
                        vertex.nodes = vertex.nodes.map(|of| if of == node { copy } else { of });
                    })?;
                }
            }
            triangle = it.next;
        }
        Ok(())
    }

    /// Shares out springs among the cells at the nodes that fell apart, by their material.
    fn share_out(&mut self) -> Result<()> {
        let first = self.surface.nodes.count_before();
        let mut sources = memory::reserved((self.surface.nodes.count() - first) as usize)?;
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
                memory::push(&mut cells, corner / 3)?;
            }
        }
        memory::sort_once(&mut cells);
        let mut shares = memory::reserved(3 * cells.len())?;
        for &cell in &cells {
            let it = self.surface.cells[cell];
            for k in 0..3 {
                let mut nodes = [it.nodes[k], it.nodes[(k + 1) % 3]];
                let mut source = nodes.map(source_of);
                if source[0] > source[1] {
                    nodes.reverse();
                    source.reverse();
                }
                if source.iter().any(|node| parted.binary_search(node).is_ok()) {
                    shares.push((source, nodes, cell, it.area));
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
                let area: f64 = piece.iter().map(|share| share.3).sum();
                let part = area / whole;
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
        let first = self.surface.nodes.count_before();
        self.changes.cells.sort_unstable_by_key(|piece| piece.cell);
        let known = self.changes.cells.len();
        for &cell in cells {
            let nodes = self.surface.cells[cell].nodes;
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
