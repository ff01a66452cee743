//! Cells whose material fell into pieces are copied for each.

use super::changes::PieceOfCell;
use super::cut::Cut;
use super::surface::{CutSurface, NONE, SurfaceCell};
use super::union::Union;
use crate::base::{Result, memory};

impl Cut<'_> {
    /// Copies each of the cells for each piece of its material but the largest. Returns the nodes of all of them.
    pub(crate) fn part_cells(&mut self, cells: &[u32]) -> Result<Vec<u32>> {
        let mut nodes = Vec::new();
        let mut union = Union::default();
        let mut drawn = Vec::new();
        for &cell in cells {
            for node in self.surface.cells[cell].nodes {
                memory::push(&mut nodes, node)?;
            }
            self.surface.drawn_in(cell, &mut drawn)?;
            union.reset(drawn.len())?;
            for (at, &triangle) in drawn.iter().enumerate() {
                for neighbour in self.surface.triangles[triangle].neighbours {
                    if let Ok(other) = drawn.binary_search(&neighbour) {
                        union.unite(at, other);
                    }
                }
            }
            if !union.is_one() {
                self.part_cell(cell, &drawn, &mut union)?;
            }
        }
        memory::sort_once(&mut nodes);
        Ok(nodes)
    }

    fn part_cell(&mut self, cell: u32, drawn: &[u32], union: &mut Union) -> Result<()> {
        let whole = self.surface.cells[cell];
        // The pieces, each by its lowest triangle, with the part of the cell that it has.
        let mut pieces = Vec::new();
        for (at, &triangle) in drawn.iter().enumerate() {
            let part = self.surface.part_of_cell(triangle);
            let lowest = union.lowest(at);
            match pieces.iter_mut().find(|(of, _)| *of == lowest) {
                Some((_, sum)) => *sum += part,
                None => memory::push(&mut pieces, (lowest, part))?,
            }
        }
        let sum: f64 = pieces.iter().map(|(_, part)| part).sum();
        let mut largest = pieces[0];
        for &piece in &pieces {
            if piece.1 > largest.1 {
                largest = piece;
            }
        }
        for (lowest, part) in pieces {
            let area = whole.area * (part / sum);
            let piece = if lowest == largest.0 {
                self.surface
                    .cells
                    .edit(cell, |cell| (cell.area, cell.first) = (area, NONE))?;
                cell
            } else {
                self.copy_cell(SurfaceCell {
                    area,
                    first: NONE,
                    ..whole
                })?
            };
            for (at, &triangle) in drawn.iter().enumerate().rev() {
                if union.lowest(at) == lowest {
                    let next = self.surface.cells[piece].first;
                    self.surface
                        .triangles
                        .edit(triangle, |triangle| (triangle.cell, triangle.next) = (piece, next))?;
                    self.surface.cells.edit(piece, |cell| cell.first = triangle)?;
                }
            }
            memory::push(
                &mut self.changes.cells,
                PieceOfCell {
                    cell: piece,
                    source: cell,
                    part: part / sum,
                },
            )?;
        }
        Ok(())
    }

    /// Adds a cell at the nodes that it names.
    fn copy_cell(&mut self, mut cell: SurfaceCell) -> Result<u32> {
        let number = self.surface.cells.count();
        self.limits.check("cells", number, u32::MAX)?;
        for k in 0..3 {
            cell.next[k] = self.surface.nodes[cell.nodes[k]].first;
            self.surface
                .nodes
                .edit(cell.nodes[k], |node| node.first = 3 * number + k as u32)?;
        }
        self.surface.cells.push(cell)
    }
}

impl CutSurface {
    /// The triangles drawn in a cell, in ascending order.
    pub(crate) fn drawn_in(&self, cell: u32, drawn: &mut Vec<u32>) -> Result<()> {
        drawn.clear();
        let mut triangle = self.cells[cell].first;
        while triangle != NONE {
            memory::push(drawn, triangle)?;
            triangle = self.triangles[triangle].next;
        }
        drawn.sort_unstable();
        Ok(())
    }

    /// How many pieces what is drawn has fallen into, found by going through all.
    pub fn piece_count(&self) -> Result<u32> {
        let mut union = Union::default();
        union.reset(self.triangles().len())?;
        for (at, triangle) in self.triangles().iter().enumerate() {
            for neighbour in triangle.neighbours.into_iter().filter(|&neighbour| neighbour != NONE) {
                union.unite(at, neighbour as usize);
            }
        }
        Ok((0..self.triangles().len()).filter(|&at| union.lowest(at) == at).count() as u32)
    }
}
