//! The features of a body that a tool can touch: its nodes, and the edges and faces of its surface.

use glam::Vec3;

use super::edges::EdgeUses;
use crate::base::{Result, memory};
use crate::codec::saved;
use crate::mesh;

/// The nodes, edges and faces of a surface. The closest points of a tool and a triangle lie on one of these. So each
/// contact is found once, however many triangles share the node or edge.
#[derive(Debug)]
pub(super) struct Features {
    pub node_count: u32,
    /// A removed edge leaves a [`HOLE`] that another edge may fill.
    edges: Vec<[u32; 2]>,
    faces: Vec<[u32; 3]>,
    /// Longest initial edge of each edge and face of a sheet, m. Infinite on a closed surface and for features that
    /// were added later.
    edge_lengths: Vec<f32>,
    face_lengths: Vec<f32>,
    /// Allocated for surfaces that change.
    uses: Option<Box<EdgeUses>>,
}

saved! { Features { node_count, edges, faces, edge_lengths, face_lengths, uses } }

/// The corners of a removed edge.
pub(super) const HOLE: [u32; 2] = [u32::MAX; 2];

/// A node, edge or face.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Feature {
    nodes: [u32; 3],
    count: u8,
}

saved! { Feature { nodes, count } }

impl Feature {
    /// The nodes as three values; the last node is repeated.
    pub fn three_nodes(&self) -> [u32; 3] {
        let nodes = self.nodes();
        [0, 1, 2].map(|corner| nodes[corner.min(nodes.len() - 1)])
    }

    pub fn node(node: u32) -> Self {
        Self {
            nodes: [node, 0, 0],
            count: 1,
        }
    }

    pub fn nodes(&self) -> &[u32] {
        &self.nodes[..self.count as usize]
    }

    /// The feature of the corners with positive weights. A contact at the border of a feature belongs to that smaller
    /// feature.
    pub fn part(&self, weights: [f64; 3]) -> Self {
        let mut part = Self {
            nodes: [0; 3],
            count: 0,
        };
        for (&node, weight) in self.nodes().iter().zip(weights) {
            if weight > 0.0 {
                part.nodes[part.count as usize] = node;
                part.count += 1;
            }
        }
        if part.count == 2 {
            part.nodes[..2].sort_unstable();
        }
        part
    }
}

impl Features {
    /// Creates the features of a surface. `position` returns the position of a node.
    pub fn new(node_count: usize, surface: &[[u32; 3]], position: impl Fn(usize) -> Vec3) -> Result<Self> {
        let edges = mesh::edges(surface, &[])?;
        // Each edge of a closed surface belongs to two faces.
        let is_closed = 2 * edges.len() == 3 * surface.len();
        let length = |a: u32, b: u32| {
            if is_closed {
                f32::INFINITY
            } else {
                position(a as usize).distance(position(b as usize))
            }
        };
        let edge_lengths = memory::collected(edges.iter().map(|&[a, b]| length(a, b)))?;
        let longest_edge = |&[a, b, c]: &[u32; 3]| length(a, b).max(length(b, c)).max(length(c, a));
        let face_lengths = memory::collected(surface.iter().map(longest_edge))?;
        Ok(Self {
            node_count: node_count as u32,
            edges,
            faces: memory::copied(surface)?,
            edge_lengths,
            face_lengths,
            uses: None,
        })
    }

    /// Longest initial edge of the feature with this index, m; 0 for a node. Infinite if it is unknown or the surface
    /// is closed: faces of a solid must resolve even a slight indentation between nodes.
    pub fn length(&self, index: u32) -> f32 {
        let Some(edge) = index.checked_sub(self.node_count) else {
            return 0.0;
        };
        let length = match (edge as usize).checked_sub(self.edges.len()) {
            None => self.edge_lengths.get(edge as usize),
            Some(face) => self.face_lengths.get(face),
        };
        length.copied().unwrap_or(f32::INFINITY)
    }

    /// The number of nodes, edges and faces. Their indices follow in this order.
    pub fn count(&self) -> usize {
        self.node_count as usize + self.edges.len() + self.faces.len()
    }

    /// The existing edges.
    pub fn edges(&self) -> impl Iterator<Item = [u32; 2]> {
        self.edges.iter().copied().filter(|&edge| edge != HOLE)
    }

    /// The numbers of nodes, edges and faces.
    pub fn counts(&self) -> [u32; 3] {
        [self.node_count, self.edges.len() as u32, self.faces.len() as u32]
    }

    /// The feature with this index. `None` for a removed edge.
    #[inline]
    pub fn get(&self, index: u32) -> Option<Feature> {
        let Some(edge) = index.checked_sub(self.node_count) else {
            return Some(Feature::node(index));
        };
        match self.edges.get(edge as usize) {
            Some(&HOLE) => None,
            Some(&[a, b]) => Some(Feature {
                nodes: [a, b, 0],
                count: 2,
            }),
            None => Some(Feature {
                nodes: self.faces[edge as usize - self.edges.len()],
                count: 3,
            }),
        }
    }

    /// Reserves memory for a change of `changed` triangles and the addition of `added` triangles.
    pub fn reserve(&mut self, changed: usize, added: usize) -> Result<()> {
        let uses = match &mut self.uses {
            Some(uses) => uses,
            none => none.insert(memory::boxed(EdgeUses::new(
                self.node_count,
                &self.edges,
                &self.faces,
            )?)?),
        };
        uses.reserve(3 * changed, 3 * (changed + added))?;
        self.edges.try_reserve(3 * (changed + added))?;
        Ok(self.faces.try_reserve(added)?)
    }

    /// Sets the corners of triangle `index`, or appends the triangle. The memory is reserved. `new` receives the index
    /// of each new edge among the edges. [`Self::drop_edges_of`] removes edges that the surface has lost.
    pub fn set_face(&mut self, index: usize, corners: [u32; 3], mut new: impl FnMut(u32)) {
        if let Some(length) = self.face_lengths.get_mut(index) {
            *length = f32::INFINITY;
        }
        let lengths = &mut self.edge_lengths;
        let new = |edge: u32| {
            if let Some(length) = lengths.get_mut(edge as usize) {
                *length = f32::INFINITY;
            }
            new(edge);
        };
        match self.faces.get_mut(index) {
            Some(face) => *face = corners,
            None => self.faces.push(corners),
        }
        if let Some(uses) = &mut self.uses {
            uses.add(corners, &mut self.edges, new);
        }
    }

    pub fn face(&self, index: usize) -> [u32; 3] {
        self.faces[index]
    }

    /// Removes a triangle with these corners from the counts of its edges.
    pub fn drop_edges_of(&mut self, corners: [u32; 3]) {
        if let Some(uses) = &mut self.uses {
            uses.remove(corners, &mut self.edges);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    /// All edges and faces, sorted.
    fn all(features: &Features) -> Vec<Feature> {
        let mut all: Vec<Feature> = (0..features.count() as u32)
            .filter_map(|index| features.get(index))
            .collect();
        all.sort_unstable();
        all
    }

    /// After any changes, the features equal those of the current surface, each once.
    #[test]
    fn a_changed_surface_has_its_features() {
        let mut random = Random(7);
        let count = 40;
        let mut corner = |_| random.below(count) as u32;
        let mut surface: Vec<[u32; 3]> = (0..60).map(|_| [0; 3].map(&mut corner)).collect();
        let mut features = Features::new(count, &surface, |_| Vec3::ZERO).expect("memory");
        for round in 0..300 {
            let index = corner(0) as usize;
            let corners = [0; 3].map(&mut corner);
            let added = (round % 3 == 0).then(|| [0; 3].map(&mut corner));
            let edges = features.edges.clone();
            features.reserve(1, added.iter().count()).expect("memory");
            let mut new = Vec::new();
            let removed = features.face(index);
            features.set_face(index, corners, |edge| new.push(edge));
            features.drop_edges_of(removed);
            surface[index] = corners;
            if let Some(corners) = added {
                features.set_face(surface.len(), corners, |edge| new.push(edge));
                surface.push(corners);
            }
            let whole = Features::new(count, &surface, |_| Vec3::ZERO).expect("memory");
            assert_eq!(all(&features), all(&whole), "{round}");
            for (number, edge) in (0..).zip(&features.edges) {
                let is_new = *edge != HOLE && edges.get(number as usize) != Some(edge);
                assert!(!is_new || new.contains(&number), "{round}: {edge:?}");
            }
        }
        // Indices of removed edges are reused.
        assert!(features.edges.len() < 3 * surface.len(), "{}", features.edges.len());
    }
}
