//! How copies of a node share its mass, so that a cut makes substeps no shorter at rest.
//!
//! By volume, a copy that is left with slivers alone has a higher frequency than the node had with the elements that were cut away. Here each copy
//! has at least the mass `K / omega²` with which what it carries, K, gives it no higher a bound `omega²` than the source or a node beside
//! it had: sum K of the copies is that of the source, so that mass suffices. No mass is added.

use super::Body;
use crate::base::{Result, memory};
use crate::cutting::{Changes, CutMaterial, PieceOfNode};

impl Body {
    /// Shifts mass between the copies of each node, where those of elements would have higher frequencies than there were.
    pub(super) fn share_by_stiffness(&self, material: &CutMaterial, changes: &mut Changes) -> Result<()> {
        let (Some(elements), None) = (&self.elements, &self.implicit) else {
            return Ok(());
        };
        let Changes { nodes, cells, .. } = changes;
        let mut needs = Vec::new();
        for pieces in nodes.chunk_by_mut(|a, b| a.source == b.source) {
            let source = self.order.own(pieces[0].source);
            if self.inverse_masses[source as usize] == 0.0 {
                continue;
            }
            let (mut whole, mut rate) = (0.0, 0.0_f64);
            needs.clear();
            for piece in &*pieces {
                let mut stiffness = 0.0;
                for cell in material.tetrahedra_at(piece.node) {
                    let (of, part) = match cells.binary_search_by_key(&cell, |piece| piece.cell) {
                        Ok(at) => (cells[at].source, cells[at].part),
                        Err(_) => (cell, 1.0),
                    };
                    let (carried, beside) = elements.carried_by(of, source, &self.inverse_masses);
                    stiffness += part * carried;
                    rate = rate.max(beside);
                }
                whole += stiffness;
                memory::push(&mut needs, stiffness)?;
            }
            let most = rate.max(whole / f64::from(self.masses[source as usize]));
            let mass = most * f64::from(self.masses[source as usize]);
            needs.iter_mut().for_each(|need| *need /= mass);
            share(pieces, &needs);
        }
        Ok(())
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
