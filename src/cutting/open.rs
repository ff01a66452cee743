//! What is drawn opens along the edges that were cut: vertices are doubled where the fan about them falls apart.

use super::changes::{NewVertex, RimEdge};
use super::cut::Cut;
use super::divided::NONE;
use crate::base::{Result, memory};

impl Cut<'_> {
    /// Parts triangles along edges newly marked as cut, and copies vertices for each fan but the first. Returns the cells beside those edges.
    pub(crate) fn open(&mut self) -> Result<Vec<u32>> {
        let (mut sides, mut ends, mut cells) = (Vec::new(), Vec::new(), Vec::new());
        for triangle in self.surface.triangles.touched()? {
            let it = self.surface.triangles[triangle];
            for side in 0..3 {
                if it.rim[side] && it.neighbours[side] != NONE {
                    memory::push(&mut sides, (triangle, side, it.neighbours[side]))?;
                    memory::push(&mut ends, it.corners[side])?;
                    memory::push(&mut ends, it.corners[(side + 1) % 3])?;
                    memory::push(&mut cells, it.cell)?;
                }
            }
        }
        memory::sort_once(&mut ends);
        memory::sort_once(&mut cells);
        // What lies about each end, while it still hangs together.
        let rings = memory::try_collected(ends.iter().map(|&vertex| self.ring(vertex)))?;
        for &(triangle, side, _) in &sides {
            self.surface
                .triangles
                .edit(triangle, |triangle| triangle.neighbours[side] = NONE)?;
        }
        for (&vertex, ring) in ends.iter().zip(&rings) {
            self.part_vertex(vertex, ring)?;
        }
        self.changes.rim.try_reserve(sides.len())?;
        for &(triangle, side, across) in &sides {
            let corners = self.surface.triangles[triangle].corners;
            self.changes.rim.push(RimEdge {
                // Vertices as yet: their points are not numbered before the end.
                points: [corners[side], corners[(side + 1) % 3]],
                triangle,
                across,
                length: self
                    .surface
                    .rest_place(corners[side])
                    .distance(self.surface.rest_place(corners[(side + 1) % 3])),
            });
        }
        Ok(cells)
    }

    /// Gives each fan of a ring of triangles but the first a vertex of its own.
    fn part_vertex(&mut self, vertex: u32, ring: &[(u32, usize)]) -> Result<()> {
        let hangs_on =
            |&(triangle, corner): &(u32, usize)| self.surface.triangles[triangle].neighbours[(corner + 2) % 3] != NONE;
        // What hangs on to the first triangle from behind belongs to its fan.
        let closing = ring.iter().rev().take_while(|&of| hangs_on(of)).count();
        let count = ring.len() - closing;
        let ends_of_fans = (1..).zip(&ring[..count]).filter(|(_, of)| !hangs_on(of));
        let ends_of_fans: Vec<usize> = memory::gathered(ends_of_fans.map(|(end, _)| end))?;
        self.surface.vertices.edit(vertex, |vertex| vertex.around = ring[0].0)?;
        for fan in ends_of_fans.windows(2) {
            let fan = &ring[fan[0]..fan[1]];
            let mut copy = self.surface.vertices[vertex];
            (copy.around, copy.point) = (fan[0].0, NONE);
            let from = NewVertex {
                sources: [vertex; 3],
                weights: [1.0, 0.0, 0.0],
            };
            let copy = self.add_vertex(copy, from)?;
            for &(triangle, corner) in fan {
                self.surface
                    .triangles
                    .edit(triangle, |triangle| triangle.corners[corner] = copy)?;
            }
        }
        Ok(())
    }
}
