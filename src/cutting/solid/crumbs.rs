//! Crumbs: thin pieces of a few tetrahedra.

use std::collections::HashSet;

use super::body::Face;
use super::cut::SolidCut;
use crate::base::{Result, memory};
use crate::cutting::divided::NONE;

/// A piece between cuts that are nearer to each other, in snapping distances, is a crumb.
const THIN: f64 = 3.0;

/// A piece of more tetrahedra is none.
const MOST: usize = 64;

impl SolidCut<'_> {
    /// Takes back the opening faces about each crumb, so that it stays with what it was cut from.
    pub(crate) fn keep_crumbs(&mut self, faces: &mut Vec<(u32, usize)>) -> Result<()> {
        let mut piece = memory::reserved(MOST + 4)?;
        // Tetrahedra of pieces that are large.
        let mut large = HashSet::new();
        for &(tetrahedron, face) in faces.iter() {
            let it = self.solid.tetrahedra[tetrahedron];
            for side in [tetrahedron, it.neighbours[face]] {
                if self.solid.tetrahedra[tetrahedron].faces[face] != Face::Opening {
                    continue;
                }
                match self.is_crumb(side, &mut piece, &large) {
                    Some(true) => self.take_back(&piece)?,
                    Some(false) => {}
                    None => {
                        large.try_reserve(piece.len())?;
                        large.extend(&piece);
                    }
                }
            }
        }
        faces.retain(|&(tetrahedron, face)| self.solid.tetrahedra[tetrahedron].faces[face] == Face::Opening);
        Ok(())
    }

    /// Whether what hangs together with a tetrahedron is a crumb; then `piece` is all of it. None if it is large, and `piece` a part of it that was
    /// not known to be. `piece` has room for what is looked at.
    fn is_crumb(&self, tetrahedron: u32, piece: &mut Vec<u32>, large: &HashSet<u32>) -> Option<bool> {
        let snap = self.solid.cells[self.solid.tetrahedra[tetrahedron].cell].snap;
        let (mut volume, mut area) = (0.0, 0.0);
        piece.clear();
        piece.push(tetrahedron);
        let mut at = 0;
        while let Some(&tetrahedron) = piece.get(at) {
            if large.contains(&tetrahedron) || piece.len() > MOST {
                return None;
            }
            at += 1;
            let it = &self.solid.tetrahedra[tetrahedron];
            volume += it.volume;
            for face in 0..4 {
                if self.solid.is_bare(tetrahedron, face) {
                    let drawn = it.drawn[face];
                    if drawn == NONE || self.solid.triangles[drawn].is_inner {
                        area += self.solid.rest_area(tetrahedron, face);
                    }
                } else if !piece.contains(&it.neighbours[face]) {
                    piece.push(it.neighbours[face]);
                }
            }
        }
        // A slice has half of what was cut on either side.
        Some(2.0 * volume < THIN * snap * area)
    }

    /// Takes back the opening faces about a piece towards the side of the blade with which it has the larger area in common.
    fn take_back(&mut self, piece: &[u32]) -> Result<()> {
        let mut areas = [0.0; 2];
        for is_last in [false, true] {
            for &tetrahedron in piece {
                let it = self.solid.tetrahedra[tetrahedron];
                for face in (0..4).filter(|&face| it.faces[face] == Face::Opening && it.neighbours[face] != NONE) {
                    let side = usize::from(self.is_above(it.neighbours[face]));
                    if !is_last {
                        areas[side] += self.solid.rest_area(tetrahedron, face);
                    } else if areas[side] > areas[1 - side] || (side == 1 && areas[0] == areas[1]) {
                        self.set_face(tetrahedron, face, Face::Severed)?;
                    }
                }
            }
        }
        Ok(())
    }
}
