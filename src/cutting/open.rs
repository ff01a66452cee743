//! Opens the render mesh along cut edges. Vertices are duplicated where the fan around them falls apart.

use super::cell_complex::NONE;
use super::changes::{NewVertex, RimEdge};
use super::cut::Cut;
use crate::base::{Result, memory};

impl Cut<'_> {
    /// Separates triangles along edges newly marked as cut, and copies vertices for each fan but the first. Returns the
    /// cells beside these edges.
    pub(crate) fn open(&mut self) -> Result<Vec<u32>> {
        let (mut sides, mut ends, mut cells) = (Vec::new(), Vec::new(), Vec::new());
        for triangle in self.surface.triangles.changed_indices()? {
            let it = self.surface.triangles[triangle];
            for side in 0..3 {
                if it.rim[side] && it.neighbors[side] != NONE {
                    memory::push(&mut sides, (triangle, side, it.neighbors[side]))?;
                    memory::push(&mut ends, it.corners[side])?;
                    memory::push(&mut ends, it.corners[(side + 1) % 3])?;
                    memory::push(&mut cells, it.cell)?;
                }
            }
        }
        memory::sort_once(&mut ends);
        memory::sort_once(&mut cells);
        // The triangles around each end, while they are still connected.
        let rings = memory::try_collected(ends.iter().map(|&vertex| self.ring(vertex)))?;
        for &(triangle, side, _) in &sides {
            self.surface
                .triangles
                .edit(triangle, |triangle| triangle.neighbors[side] = NONE)?;
        }
        for (&vertex, ring) in ends.iter().zip(&rings) {
            self.split_vertex(vertex, ring)?;
        }
        self.changes.rim.try_reserve(sides.len())?;
        for &(triangle, side, across) in &sides {
            let corners = self.surface.triangles[triangle].corners;
            self.changes.rim.push(RimEdge {
                // Indices of vertices. The points are numbered at the end of the cut.
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

    /// Gives each fan of a ring of triangles but the first its own vertex.
    fn split_vertex(&mut self, vertex: u32, ring: &[(u32, usize)]) -> Result<()> {
        let is_connected =
            |&(triangle, corner): &(u32, usize)| self.surface.triangles[triangle].neighbors[(corner + 2) % 3] != NONE;
        // The last triangles belong to the first fan if they are connected with the first triangle.
        let wrapped = ring.iter().rev().take_while(|&entry| is_connected(entry)).count();
        let count = ring.len() - wrapped;
        let ends_of_fans = (1..).zip(&ring[..count]).filter(|(_, entry)| !is_connected(entry));
        let ends_of_fans: Vec<usize> = memory::gathered(ends_of_fans.map(|(end, _)| end))?;
        self.surface.vertices.edit(vertex, |vertex| vertex.around = ring[0].0)?;
        for fan in ends_of_fans.windows(2) {
            let fan = &ring[fan[0]..fan[1]];
            let mut copy = self.surface.vertices[vertex];
            (copy.around, copy.point) = (fan[0].0, NONE);
            let origin = NewVertex {
                sources: [vertex; 3],
                weights: [1.0, 0.0, 0.0],
            };
            let copy = self.add_vertex(copy, origin)?;
            for &(triangle, corner) in fan {
                self.surface
                    .triangles
                    .edit(triangle, |triangle| triangle.corners[corner] = copy)?;
            }
        }
        Ok(())
    }
}
