//! Copies each cell whose material fell into pieces, once for each piece.

use super::cell_complex::{Cell, CellComplex, NONE};
use super::changes::{Changes, PieceOfCell};
use super::cut::Limits;
use crate::base::DisjointSets;
use crate::base::{Result, memory};

/// Copies cells and nodes whose material a cut has separated.
pub(crate) struct Copier<'a, const N: usize, D: CellComplex<N>> {
    pub body: &'a mut D,
    pub limits: Limits,
    pub changes: &'a mut Changes,
}

impl<const N: usize, D: CellComplex<N>> Copier<'_, N, D> {
    /// Copies each cell for each piece of its material but the largest, and then the nodes of these cells.
    pub(crate) fn run(&mut self, cells: &[u32]) -> Result<()> {
        let mut nodes = Vec::new();
        let mut union = DisjointSets::default();
        let mut inside = Vec::new();
        for &cell in cells {
            memory::extend(&mut nodes, self.body.cell(cell).nodes)?;
            inside.clear();
            memory::extend(&mut inside, self.body.simplices_in(cell))?;
            inside.sort_unstable();
            union.reset(inside.len())?;
            for (index, &simplex) in inside.iter().enumerate() {
                for neighbor in self.body.simplex(simplex).neighbors {
                    if let Ok(other) = inside.binary_search(&neighbor) {
                        union.unite(index, other);
                    }
                }
            }
            if !union.is_one() {
                self.copy_cell_pieces(cell, &inside, &mut union)?;
            }
        }
        memory::sort_once(&mut nodes);
        self.copy_nodes(&nodes)
    }

    fn copy_cell_pieces(&mut self, cell: u32, inside: &[u32], union: &mut DisjointSets) -> Result<()> {
        let whole = self.body.cell(cell);
        // The pieces, each by its lowest simplex, with its amount of material.
        let mut pieces = Vec::new();
        for (index, &simplex) in inside.iter().enumerate() {
            let part = self.body.material_fraction(simplex);
            let lowest = union.lowest(index);
            match pieces.iter_mut().find(|(component, _)| *component == lowest) {
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
            let remainder = Cell {
                material: whole.material * part,
                first: NONE,
                ..whole
            };
            let piece = if lowest == largest.0 {
                self.body.set_cell(cell, remainder)?;
                cell
            } else {
                self.copy_cell(cell, remainder)?
            };
            for (index, &simplex) in inside.iter().enumerate().rev() {
                if union.lowest(index) == lowest {
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

    /// Adds a cell with the nodes and properties of another.
    fn copy_cell(&mut self, source_cell: u32, mut cell: Cell<N>) -> Result<u32> {
        let index_of_copy = self.body.cell_count();
        self.limits.check("cells", index_of_copy, u32::MAX / N as u32)?;
        for (k, (&node, next)) in cell.nodes.iter().zip(&mut cell.next).enumerate() {
            *next = self.body.nodes()[node].first;
            let corner = N as u32 * index_of_copy + k as u32;
            self.body.nodes_mut().edit(node, |node| node.first = corner)?;
        }
        self.body.add_cell(source_cell, cell)
    }
}

/// The number of components of simplices with these neighbors. All are visited.
pub(crate) fn piece_count<const N: usize>(neighbors: impl ExactSizeIterator<Item = [u32; N]>) -> Result<u32> {
    let (mut union, count) = (DisjointSets::default(), neighbors.len());
    union.reset(count)?;
    for (index, neighbors) in neighbors.enumerate() {
        for neighbor in neighbors.into_iter().filter(|&neighbor| neighbor != NONE) {
            union.unite(index, neighbor as usize);
        }
    }
    Ok((0..count).filter(|&index| union.lowest(index) == index).count() as u32)
}
