//! Slivers: thin pieces of few tetrahedra.

use std::collections::HashSet;

use super::body::FaceState;
use super::cut::SolidCut;
use crate::base::{Result, memory};
use crate::cutting::cell_complex::NONE;

/// A piece between cuts that are closer than this many snapping distances is a sliver.
const MIN_THICKNESS: f64 = 3.0;

/// A piece with more tetrahedra is no sliver.
const MAX_TETRAHEDRA: usize = 64;

impl SolidCut<'_> {
    /// Reverts opening faces around each sliver, so that it stays attached.
    pub(crate) fn keep_slivers(&mut self, faces: &mut Vec<(u32, usize)>) -> Result<()> {
        let mut piece = memory::reserved(MAX_TETRAHEDRA + 4)?;
        // Tetrahedra of large pieces.
        let mut large = HashSet::new();
        for &(tetrahedron, face) in faces.iter() {
            let it = self.solid.tetrahedra[tetrahedron];
            for side in [tetrahedron, it.neighbors[face]] {
                if self.solid.tetrahedra[tetrahedron].faces[face] != FaceState::Opening {
                    continue;
                }
                match self.is_sliver(side, &mut piece, &large) {
                    Some(true) => self.revert_faces(&piece)?,
                    Some(false) => {}
                    None => {
                        large.try_reserve(piece.len())?;
                        large.extend(&piece);
                    }
                }
            }
        }
        faces.retain(|&(tetrahedron, face)| self.solid.tetrahedra[tetrahedron].faces[face] == FaceState::Opening);
        Ok(())
    }

    /// True if the tetrahedra connected with this one are a sliver. `piece` then contains all of them. `None` if they
    /// are large. `piece` then contains a part that was not known to be large. Space for the search is reserved.
    fn is_sliver(&self, tetrahedron: u32, piece: &mut Vec<u32>, large: &HashSet<u32>) -> Option<bool> {
        let snap = self.solid.cells[self.solid.tetrahedra[tetrahedron].cell].snap;
        let (mut volume, mut area) = (0.0, 0.0);
        piece.clear();
        piece.push(tetrahedron);
        let mut index = 0;
        while let Some(&tetrahedron) = piece.get(index) {
            if large.contains(&tetrahedron) || piece.len() > MAX_TETRAHEDRA {
                return None;
            }
            index += 1;
            let it = &self.solid.tetrahedra[tetrahedron];
            volume += it.volume;
            for face in 0..4 {
                if self.solid.is_bare(tetrahedron, face) {
                    let render_triangle = it.render_triangles[face];
                    if render_triangle == NONE || self.solid.triangles[render_triangle].is_inner {
                        area += self.solid.rest_area(tetrahedron, face);
                    }
                } else if !piece.contains(&it.neighbors[face]) {
                    piece.push(it.neighbors[face]);
                }
            }
        }
        // A slice has half of the cut area on either side.
        Some(2.0 * volume < MIN_THICKNESS * snap * area)
    }

    /// Reverts the opening faces of a piece towards the side of the blade with which it shares the larger area.
    fn revert_faces(&mut self, piece: &[u32]) -> Result<()> {
        let mut areas = [0.0; 2];
        for is_last in [false, true] {
            for &tetrahedron in piece {
                let it = self.solid.tetrahedra[tetrahedron];
                for face in (0..4).filter(|&face| it.faces[face] == FaceState::Opening && it.neighbors[face] != NONE) {
                    let side = usize::from(self.is_above(it.neighbors[face]));
                    if !is_last {
                        areas[side] += self.solid.rest_area(tetrahedron, face);
                    } else if areas[side] > areas[1 - side] || (side == 1 && areas[0] == areas[1]) {
                        self.set_face(tetrahedron, face, FaceState::Severed)?;
                    }
                }
            }
        }
        Ok(())
    }
}
