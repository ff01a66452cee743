//! How copies of a node share its mass, so that a cut makes substeps no shorter at rest.
//!
//! By volume, a copy that is left with slivers alone has a higher frequency than the node had with what was cut away. Here each copy
//! has at least the mass `K / omega²` with which what it carries, K, gives it no higher a bound `omega²` than the source or a node beside
//! it had: sum K of the copies is that of the source, so that mass suffices. No mass is added.

use super::Body;
use crate::base::Result;
use crate::cutting::{Changes, CutMaterial, PieceOfCell, PieceOfNode, PieceOfSpring};

impl Body {
    /// Shifts mass between the copies of each node, where they would have higher frequencies than there were.
    pub(super) fn share_by_stiffness(&self, material: &CutMaterial, changes: &mut Changes) -> Result<()> {
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
            let of_elements = self.carried_of_elements(material, pieces, cells, &mut needs);
            let of_springs = self.carried_of_springs(pieces, springs, &mut needs);
            let mass = f64::from(self.system.masses[source as usize]);
            let whole: f64 = needs.iter().sum();
            let most = of_elements.max(of_springs).max(whole / mass);
            needs.iter_mut().for_each(|need| *need /= most * mass);
            share(pieces, &needs);
        }
        Ok(())
    }

    /// Adds what each copy carries of elements, N/m: the highest bound there is on the squares of frequencies of nodes beside them, 1/s².
    fn carried_of_elements(
        &self,
        material: &CutMaterial,
        pieces: &[PieceOfNode],
        cells: &[PieceOfCell],
        carried: &mut [f64],
    ) -> f64 {
        let mut highest = 0.0_f64;
        let Some(elements) = self.system.forces.elements() else {
            return highest;
        };
        let source = self.system.order.own(pieces[0].source);
        for (piece, carried) in pieces.iter().zip(carried) {
            for cell in material.tetrahedra_at(piece.node) {
                let (of, part) = match cells.binary_search_by_key(&cell, |piece| piece.cell) {
                    Ok(at) => (cells[at].source, cells[at].part),
                    Err(_) => (cell, 1.0),
                };
                let (of_cell, beside) = elements.carried_by(of, source, &self.system.inverse_masses);
                *carried += part * of_cell;
                highest = highest.max(beside);
            }
        }
        highest
    }

    /// The same of springs: those that did not fall apart stay with the source.
    fn carried_of_springs(&self, pieces: &[PieceOfNode], springs: &[PieceOfSpring], carried: &mut [f64]) -> f64 {
        let source = self.system.order.own(pieces[0].source);
        let mut highest = 0.0_f64;
        self.system.forces.springs.visit(source as usize, &mut |link| {
            let [a, b] = [pieces[0].source, self.system.order.caller(link.neighbour)];
            let ends = [a.min(b), a.max(b)];
            let first = springs.partition_point(|piece| piece.source < ends);
            let parts = springs[first..].iter().take_while(|piece| piece.source == ends);
            // With masses m of both ends, and half a bound for each, the square of a frequency is at most sum 2 k / m.
            let stiffness = 2.0 * f64::from(link.stiffness);
            for (piece, carried) in pieces.iter().zip(&mut *carried) {
                let mut kept = parts.clone().peekable();
                if kept.peek().is_none() && piece.node == piece.source {
                    *carried += stiffness;
                }
                let of_piece = kept.filter(|part| part.nodes.contains(&piece.node));
                *carried += of_piece.map(|part| stiffness * part.part).sum::<f64>();
            }
            highest = highest.max(self.spring_rate(link.neighbour));
        });
        highest
    }

    /// A bound on the square of a node's frequency that its springs give it, 1/s²; 0 where it is held.
    fn spring_rate(&self, node: u32) -> f64 {
        let mut stiffness = 0.0;
        self.system
            .forces
            .springs
            .visit(node as usize, &mut |link| stiffness += 2.0 * f64::from(link.stiffness));
        stiffness * f64::from(self.system.inverse_masses[node as usize])
    }
}

/// Gives each piece at least the part that it needs, of what the others have beyond theirs. Needs are at most 1 in all.
fn share(pieces: &mut [PieceOfNode], needs: &[f64]) {
    let (mut lacking, mut spare) = (0.0, 0.0);
    for (piece, need) in pieces.iter().zip(needs) {
        lacking += (need - piece.part).max(0.0);
        spare += (piece.part - need).max(0.0);
    }
    if !(lacking > 0.0 && spare > 0.0) {
        return;
    }
    let left = 1.0 - (lacking / spare).min(1.0);
    for (piece, &need) in pieces.iter_mut().zip(needs) {
        piece.part = need + left * (piece.part - need).max(0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::{PieceOfNode, share};

    #[test]
    fn pieces_get_what_they_need_and_keep_what_all_have() {
        let piece = |part| PieceOfNode {
            node: 0,
            source: 0,
            part,
        };
        let mut pieces = [0.01, 0.5, 0.49].map(piece);
        share(&mut pieces, &[0.2, 0.3, 0.4]);
        let parts = pieces.map(|piece| piece.part);
        assert!((parts.iter().sum::<f64>() - 1.0).abs() < 1e-15, "{parts:?}");
        assert_eq!(parts[0], 0.2);
        assert!(
            parts[1] >= 0.3 && parts[1] < 0.5 && parts[2] >= 0.4 && parts[2] < 0.49,
            "{parts:?}"
        );
        let mut pieces = [0.3, 0.7].map(piece);
        share(&mut pieces, &[0.2, 0.3]);
        assert_eq!(pieces.map(|piece| piece.part), [0.3, 0.7]);
    }
}
