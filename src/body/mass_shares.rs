//! Distributes the mass of a node to its copies so that a cut does not shorten the stable substep at rest.
//!
//! If mass were shared by volume, a copy with only slivers would have a higher frequency than the whole node had. Each
//! copy with stiffness K instead gets at least the mass `K / omega²`. `omega²` is the bound of the source or of a node
//! next to it, whichever is higher. The stiffnesses of the copies add up to that of the source, so its mass suffices.
//! No mass is added.

use super::Body;
use crate::base::Result;
use crate::cutting::{Changes, CutMaterial, PieceOfCell, PieceOfNode, PieceOfSpring};

impl Body {
    /// Shifts mass between the copies of each node if their frequencies would exceed those before the cut.
    pub(super) fn shift_mass_by_stiffness(&self, material: &CutMaterial, changes: &mut Changes) -> Result<()> {
        if !self.system.integrator.is_limited_by_stability() {
            return Ok(());
        }
        let Changes {
            nodes, cells, springs, ..
        } = changes;
        let mut needs = Vec::new();
        for pieces in nodes.chunk_by_mut(|a, b| a.source == b.source) {
            let source = self.system.order.own(pieces[0].source);
            if self.system.inverse_masses[source as usize] == 0.0 {
                continue;
            }
            needs.clear();
            needs.try_reserve(pieces.len())?;
            needs.resize(pieces.len(), 0.0);
            let element_bound = self.add_element_stiffness(material, pieces, cells, &mut needs);
            let spring_bound = self.add_spring_stiffness(pieces, springs, &mut needs);
            let mass = f64::from(self.system.masses[source as usize]);
            let total: f64 = needs.iter().sum();
            let highest_bound = element_bound.max(spring_bound).max(total / mass);
            needs.iter_mut().for_each(|need| *need /= highest_bound * mass);
            raise_to_needs(pieces, &needs);
        }
        Ok(())
    }

    /// Adds the stiffness of elements at each copy, N/m. Returns the highest bound on the squared frequencies of the
    /// nodes next to them, 1/s².
    fn add_element_stiffness(
        &self,
        material: &CutMaterial,
        pieces: &[PieceOfNode],
        cells: &[PieceOfCell],
        stiffnesses: &mut [f64],
    ) -> f64 {
        let mut highest = 0.0_f64;
        let Some(elements) = self.system.forces.elements() else {
            return highest;
        };
        let source = self.system.order.own(pieces[0].source);
        for (piece, stiffness) in pieces.iter().zip(stiffnesses) {
            for cell in material.tetrahedra_at(piece.node) {
                let (source_cell, part) = match cells.binary_search_by_key(&cell, |piece| piece.cell) {
                    Ok(index) => (cells[index].source, cells[index].part),
                    Err(_) => (cell, 1.0),
                };
                let (cell_stiffness, bound) =
                    elements.stiffness_and_rate_of(source_cell, source, &self.system.inverse_masses);
                *stiffness += part * cell_stiffness;
                highest = highest.max(bound);
            }
        }
        highest
    }

    /// Adds the stiffness of springs at each copy. Springs that were not split stay with the source.
    fn add_spring_stiffness(&self, pieces: &[PieceOfNode], springs: &[PieceOfSpring], stiffnesses: &mut [f64]) -> f64 {
        let source = self.system.order.own(pieces[0].source);
        let mut highest = 0.0_f64;
        self.system.forces.springs.visit(source as usize, &mut |link| {
            let [a, b] = [pieces[0].source, self.system.order.caller(link.neighbor)];
            let ends = [a.min(b), a.max(b)];
            let first = springs.partition_point(|piece| piece.source < ends);
            let parts = springs[first..].iter().take_while(|piece| piece.source == ends);
            // Each end is bounded separately and carries half of the spring: with masses m of both ends, a squared
            // frequency is at most sum 2 k / m.
            let stiffness = 2.0 * f64::from(link.stiffness);
            for (piece, sum) in pieces.iter().zip(&mut *stiffnesses) {
                let mut link_pieces = parts.clone().peekable();
                if link_pieces.peek().is_none() && piece.node == piece.source {
                    *sum += stiffness;
                }
                let node_pieces = link_pieces.filter(|part| part.nodes.contains(&piece.node));
                *sum += node_pieces.map(|part| stiffness * part.part).sum::<f64>();
            }
            highest = highest.max(self.spring_bound_at(link.neighbor));
        });
        highest
    }

    /// A bound on the squared frequency of a node from its springs, 1/s²; 0 if the node is held.
    fn spring_bound_at(&self, node: u32) -> f64 {
        let mut stiffness = 0.0;
        self.system
            .forces
            .springs
            .visit(node as usize, &mut |link| stiffness += 2.0 * f64::from(link.stiffness));
        stiffness * f64::from(self.system.inverse_masses[node as usize])
    }
}

/// Raises the part of each piece to its need, taken in proportion from the surplus of the others. The needs add up to
/// at most 1.
fn raise_to_needs(pieces: &mut [PieceOfNode], needs: &[f64]) {
    let (mut deficit, mut spare) = (0.0, 0.0);
    for (piece, need) in pieces.iter().zip(needs) {
        deficit += (need - piece.part).max(0.0);
        spare += (piece.part - need).max(0.0);
    }
    if !(deficit > 0.0 && spare > 0.0) {
        return;
    }
    let remaining = 1.0 - (deficit / spare).min(1.0);
    for (piece, &need) in pieces.iter_mut().zip(needs) {
        piece.part = need + remaining * (piece.part - need).max(0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::{PieceOfNode, raise_to_needs};

    #[test]
    fn pieces_reach_their_needs_and_keep_the_total() {
        let piece = |part| PieceOfNode {
            node: 0,
            source: 0,
            part,
        };
        let mut pieces = [0.01, 0.5, 0.49].map(piece);
        raise_to_needs(&mut pieces, &[0.2, 0.3, 0.4]);
        let parts = pieces.map(|piece| piece.part);
        assert!((parts.iter().sum::<f64>() - 1.0).abs() < 1e-15, "{parts:?}");
        assert_eq!(parts[0], 0.2);
        assert!(
            parts[1] >= 0.3 && parts[1] < 0.5 && parts[2] >= 0.4 && parts[2] < 0.49,
            "{parts:?}"
        );
        let mut pieces = [0.3, 0.7].map(piece);
        raise_to_needs(&mut pieces, &[0.2, 0.3]);
        assert_eq!(pieces.map(|piece| piece.part), [0.3, 0.7]);
    }
}
