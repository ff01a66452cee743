//! Slivers: small pieces that only snapping would cut off.

use super::cell_complex::NONE;
use super::cut::Cut;
use crate::base::{Result, memory};

/// A piece with less area than this many squares of the snapping distance stays attached. The cut passes it on one
/// side.
const MAX_SLIVER_AREA: f64 = 4.0;

/// A piece with more triangles is no sliver.
const MAX_TRIANGLES: usize = 64;

impl Cut<'_> {
    /// Unmarks one edge around each sliver that the edges marked as cut would separate.
    pub(crate) fn keep_slivers(&mut self) -> Result<()> {
        let mut sides = Vec::new();
        for triangle in self.surface.triangles.changed_indices()? {
            let cut = (0..3).filter(|&side| self.is_newly_cut(triangle, side));
            memory::extend(&mut sides, cut.map(|side| (triangle, side)))?;
        }
        let mut piece = memory::reserved(MAX_TRIANGLES + 3)?;
        let mut is_done = false;
        while !is_done {
            is_done = true;
            for &(triangle, side) in &sides {
                if self.is_newly_cut(triangle, side) && self.is_sliver(triangle, &mut piece) {
                    is_done &= !self.unmark_longest(&piece)?;
                }
            }
        }
        Ok(())
    }

    /// True if a side is marked as cut, and is not open yet.
    fn is_newly_cut(&self, triangle: u32, side: usize) -> bool {
        let triangle = &self.surface.triangles[triangle];
        triangle.rim[side] && triangle.neighbors[side] != NONE
    }

    /// True if the triangles connected with this one are a sliver. `piece` then contains all of them. Space for the
    /// search is reserved.
    fn is_sliver(&self, triangle: u32, piece: &mut Vec<u32>) -> bool {
        let snap = self.surface.cells[self.surface.triangles[triangle].cell].snap;
        let mut remaining_area = MAX_SLIVER_AREA * snap * snap;
        piece.clear();
        piece.push(triangle);
        let mut index = 0;
        while let Some(&triangle) = piece.get(index) {
            index += 1;
            remaining_area -= self.surface.rest_area(triangle);
            if remaining_area < 0.0 || piece.len() > MAX_TRIANGLES {
                return false;
            }
            let it = &self.surface.triangles[triangle];
            for side in 0..3 {
                let across = it.neighbors[side];
                if across != NONE && !it.rim[side] && !piece.contains(&across) {
                    piece.push(across);
                }
            }
        }
        true
    }

    /// Unmarks the longest newly cut edge around a piece, if there is one. The cut stays connected along the other side
    /// of the piece.
    fn unmark_longest(&mut self, piece: &[u32]) -> Result<bool> {
        let mut longest = (0.0, NONE, 0);
        for &triangle in piece {
            let it = &self.surface.triangles[triangle];
            for side in (0..3).filter(|&side| self.is_newly_cut(triangle, side)) {
                if piece.contains(&it.neighbors[side]) {
                    continue;
                }
                let [from, to] = [side, (side + 1) % 3].map(|k| self.surface.rest_place(it.corners[k]));
                let length = from.distance(to);
                if length > longest.0 {
                    longest = (length, triangle, side);
                }
            }
        }
        let (_, triangle, side) = longest;
        if triangle != NONE {
            self.set_cut(triangle, side, false)?;
        }
        Ok(triangle != NONE)
    }
}
