//! Cells whose material fell into pieces are copied for each.

use super::changes::{Changes, PieceOfCell};
use super::cut::Limits;
use super::divided::{Cell, Divided, NONE};
use crate::base::DisjointSets;
use crate::base::{Result, memory};

/// Copies cells and nodes whose material a cut has parted.
pub(crate) struct Copier<'a, const N: usize, D: Divided<N>> {
    pub body: &'a mut D,
    pub limits: Limits,
    pub changes: &'a mut Changes,
}

impl<const N: usize, D: Divided<N>> Copier<'_, N, D> {
    /// Copies each of the cells for each piece of its material but the largest, and then their nodes.
    pub(crate) fn part(&mut self, cells: &[u32]) -> Result<()> {
        let mut nodes = Vec::new();
        let mut union = DisjointSets::default();
        let mut inside = Vec::new();
        for &cell in cells {
            memory::extend(&mut nodes, self.body.cell(cell).nodes)?;
            inside.clear();
            memory::extend(&mut inside, self.body.simplices_in(cell))?;
            inside.sort_unstable();
            union.reset(inside.len())?;
            for (at, &simplex) in inside.iter().enumerate() {
                for neighbour in self.body.simplex(simplex).neighbours {
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
        self.part_nodes(&nodes)
    }

    fn part_cell(&mut self, cell: u32, inside: &[u32], union: &mut DisjointSets) -> Result<()> {
        let whole = self.body.cell(cell);
        // The pieces, each by its lowest simplex, with the part of the cell that it has.
        let mut pieces = Vec::new();
        for (at, &simplex) in inside.iter().enumerate() {
            let part = self.body.part_of(simplex);
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
            let part = part / sum;
            let left = Cell {
                material: whole.material * part,
                first: NONE,
                ..whole
            };
            let piece = if lowest == largest.0 {
                self.body.set_cell(cell, left)?;
                cell
            } else {
                self.copy_cell(cell, left)?
            };
            for (at, &simplex) in inside.iter().enumerate().rev() {
                if union.lowest(at) == lowest {
                    let it = self.body.cell(piece);
                    self.body.move_simplex(simplex, piece, it.first)?;
                    self.body.set_cell(piece, Cell { first: simplex, ..it })?;
                }
            }
            let piece = PieceOfCell {
                cell: piece,
                source: cell,
                part,
            };
            memory::push(&mut self.changes.cells, piece)?;
        }
        Ok(())
    }

    /// Adds a cell like another at its nodes.
    fn copy_cell(&mut self, like: u32, mut cell: Cell<N>) -> Result<u32> {
        let number = self.body.cell_count();
        self.limits.check("cells", number, u32::MAX / N as u32)?;
        for (k, (&node, next)) in cell.nodes.iter().zip(&mut cell.next).enumerate() {
            *next = self.body.nodes()[node].first;
            let corner = N as u32 * number + k as u32;
            self.body.nodes_mut().edit(node, |node| node.first = corner)?;
        }
        self.body.add_cell(like, cell)
    }
}

/// How many pieces simplices with these neighbours are, found by going through all.
pub(crate) fn piece_count<const N: usize>(neighbours: impl ExactSizeIterator<Item = [u32; N]>) -> Result<u32> {
    let (mut union, count) = (DisjointSets::default(), neighbours.len());
    union.reset(count)?;
    for (at, neighbours) in neighbours.enumerate() {
        for neighbour in neighbours.into_iter().filter(|&neighbour| neighbour != NONE) {
            union.unite(at, neighbour as usize);
        }
    }
    Ok((0..count).filter(|&at| union.lowest(at) == at).count() as u32)
}
