//! Cells whose material fell into pieces are copied for each.

use super::body::{CutSolid, NONE, SolidCell};
use super::cut::Cut;
use crate::base::{Result, memory};
use crate::cutting::changes::PieceOfCell;
use crate::cutting::union::Union;

impl Cut<'_> {
    /// Copies each of the cells for each piece of its material but the largest. Returns the nodes of all of them.
    pub(crate) fn part_cells(&mut self, cells: &[u32]) -> Result<Vec<u32>> {
        let mut nodes = Vec::new();
        let mut union = Union::default();
        let mut inside = Vec::new();
        for &cell in cells {
            for node in self.solid.cells[cell].nodes {
                memory::push(&mut nodes, node)?;
            }
            self.solid.tetrahedra_in(cell, &mut inside)?;
            union.reset(inside.len())?;
            for (at, &tetrahedron) in inside.iter().enumerate() {
                for neighbour in self.solid.tetrahedra[tetrahedron].neighbours {
                    if let Ok(other) = inside.binary_search(&neighbour) {
                        union.unite(at, other);
                    }
                }
            }
            if !union.is_one() {
                self.part_cell(cell, &inside, &mut union)?;
            }
        }
        memory::sort_once(&mut nodes);
        Ok(nodes)
    }

    fn part_cell(&mut self, cell: u32, inside: &[u32], union: &mut Union) -> Result<()> {
        let whole = self.solid.cells[cell];
        // The pieces, each by its lowest tetrahedron, with its volume.
        let mut pieces: Vec<(usize, f64)> = Vec::new();
        for (at, &tetrahedron) in inside.iter().enumerate() {
            let volume = self.solid.tetrahedra[tetrahedron].volume;
            let lowest = union.lowest(at);
            match pieces.iter_mut().find(|(of, _)| *of == lowest) {
                Some((_, sum)) => *sum += volume,
                None => memory::push(&mut pieces, (lowest, volume))?,
            }
        }
        let sum: f64 = pieces.iter().map(|(_, volume)| volume).sum();
        let mut largest = pieces[0];
        for &piece in &pieces {
            if piece.1 > largest.1 {
                largest = piece;
            }
        }
        for (lowest, volume) in pieces {
            let part = volume / sum;
            let volume = whole.volume * part;
            let piece = if lowest == largest.0 {
                self.solid
                    .cells
                    .edit(cell, |cell| (cell.volume, cell.first) = (volume, NONE))?;
                cell
            } else {
                self.copy_cell(SolidCell {
                    volume,
                    first: NONE,
                    ..whole
                })?
            };
            for (at, &tetrahedron) in inside.iter().enumerate().rev() {
                if union.lowest(at) == lowest {
                    self.move_tetrahedron(tetrahedron, piece)?;
                }
            }
            memory::push(
                &mut self.changes.cells,
                PieceOfCell {
                    cell: piece,
                    source: cell,
                    part,
                },
            )?;
        }
        Ok(())
    }

    fn move_tetrahedron(&mut self, tetrahedron: u32, cell: u32) -> Result<()> {
        let next = self.solid.cells[cell].first;
        let is_new = self.solid.tetrahedra[tetrahedron].cell != cell;
        self.solid
            .tetrahedra
            .edit(tetrahedron, |it| (it.cell, it.next) = (cell, next))?;
        self.solid.cells.edit(cell, |cell| cell.first = tetrahedron)?;
        let drawn = self.solid.tetrahedra[tetrahedron].drawn;
        for triangle in drawn.into_iter().filter(|&drawn| is_new && drawn != NONE) {
            self.solid.triangles.edit(triangle, |triangle| triangle.cell = cell)?;
        }
        Ok(())
    }

    /// Adds a cell at the nodes that it names.
    fn copy_cell(&mut self, mut cell: SolidCell) -> Result<u32> {
        let number = self.solid.cells.count();
        self.limits.check("cells", number, u32::MAX / 4)?;
        for k in 0..4 {
            cell.next[k] = self.solid.nodes[cell.nodes[k]].first;
            self.solid
                .nodes
                .edit(cell.nodes[k], |node| node.first = 4 * number + k as u32)?;
        }
        self.solid.cells.push(cell)
    }
}

impl CutSolid {
    /// How many pieces the material has fallen into, found by going through all.
    pub fn piece_count(&self) -> Result<u32> {
        let mut union = Union::default();
        union.reset(self.tetrahedra().len())?;
        for (at, tetrahedron) in self.tetrahedra().iter().enumerate() {
            for neighbour in tetrahedron
                .neighbours
                .into_iter()
                .filter(|&neighbour| neighbour != NONE)
            {
                union.unite(at, neighbour as usize);
            }
        }
        Ok((0..self.tetrahedra().len())
            .filter(|&at| union.lowest(at) == at)
            .count() as u32)
    }
}
