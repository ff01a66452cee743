//! Crumbs: pieces that only snapping would cut off.

use super::cut::Cut;
use super::divided::NONE;
use crate::base::{Result, memory};

/// A piece with less area than this many squares of the snapping distance stays with what it was cut from: the blade goes round it on one side.
const CRUMB: f64 = 4.0;

/// A piece of more triangles is none.
const MOST_TRIANGLES: usize = 64;

impl Cut<'_> {
    /// Takes back one edge about each crumb that the edges now marked as cut would leave.
    pub(crate) fn keep_crumbs(&mut self) -> Result<()> {
        let mut sides = Vec::new();
        for triangle in self.surface.triangles.touched()? {
            let cut = (0..3).filter(|&side| self.is_newly_cut(triangle, side));
            memory::extend(&mut sides, cut.map(|side| (triangle, side)))?;
        }
        let mut piece = memory::reserved(MOST_TRIANGLES + 3)?;
        let mut is_done = false;
        while !is_done {
            is_done = true;
            for &(triangle, side) in &sides {
                if self.is_newly_cut(triangle, side) && self.is_crumb(triangle, &mut piece) {
                    is_done &= !self.take_back(&piece)?;
                }
            }
        }
        Ok(())
    }

    /// Whether a side is marked as cut, and does not lie open yet.
    fn is_newly_cut(&self, triangle: u32, side: usize) -> bool {
        let triangle = &self.surface.triangles[triangle];
        triangle.rim[side] && triangle.neighbours[side] != NONE
    }

    /// Whether what hangs together with a triangle is a crumb; then `piece` is all of it. It has room for what is looked at.
    fn is_crumb(&self, triangle: u32, piece: &mut Vec<u32>) -> bool {
        let snap = self.surface.cells[self.surface.triangles[triangle].cell].snap;
        let mut left = CRUMB * snap * snap;
        piece.clear();
        piece.push(triangle);
        let mut at = 0;
        while let Some(&triangle) = piece.get(at) {
            at += 1;
            left -= self.surface.rest_area(triangle);
            if left < 0.0 || piece.len() > MOST_TRIANGLES {
                return false;
            }
            let it = &self.surface.triangles[triangle];
            for side in 0..3 {
                let across = it.neighbours[side];
                if across != NONE && !it.rim[side] && !piece.contains(&across) {
                    piece.push(across);
                }
            }
        }
        true
    }

    /// Leaves the longest edge about a piece that was newly cut as it was, if there is one. What is cut still hangs together, round the piece's
    /// other side.
    fn take_back(&mut self, piece: &[u32]) -> Result<bool> {
        let mut longest = (0.0, NONE, 0);
        for &triangle in piece {
            let it = &self.surface.triangles[triangle];
            for side in (0..3).filter(|&side| self.is_newly_cut(triangle, side)) {
                if piece.contains(&it.neighbours[side]) {
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
