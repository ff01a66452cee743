//! The parts of a body that a tool can meet: its nodes, and the edges and faces of its surface.

use crate::error::Result;
use crate::memory;
use crate::mesh;

/// What a tool can meet. The closest points of a tool and a triangle lie on one of these, so that each touch is found
/// once, however many triangles share the node or edge.
#[derive(Debug)]
pub(super) struct Features {
    pub node_count: u32,
    pub edges: Vec<[u32; 2]>,
    pub faces: Vec<[u32; 3]>,
}

/// One node, edge or face.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Feature {
    nodes: [u32; 3],
    count: u8,
}

impl Feature {
    pub fn nodes(&self) -> &[u32] {
        &self.nodes[..self.count as usize]
    }

    /// That part of it whose corners have weight: a smaller feature where it is met at its border.
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
    pub fn new(node_count: usize, surface: &[[u32; 3]]) -> Result<Self> {
        Ok(Self {
            node_count: node_count as u32,
            edges: mesh::edges(surface, &[])?,
            faces: memory::copied(surface)?,
        })
    }

    /// How many there are: nodes, then edges, then faces.
    pub fn count(&self) -> usize {
        self.node_count as usize + self.edges.len() + self.faces.len()
    }

    /// Feature number `index`.
    pub fn get(&self, index: u32) -> Feature {
        let Some(edge) = index.checked_sub(self.node_count) else {
            return Feature {
                nodes: [index, 0, 0],
                count: 1,
            };
        };
        match self.edges.get(edge as usize) {
            Some(&[a, b]) => Feature {
                nodes: [a, b, 0],
                count: 2,
            },
            None => Feature {
                nodes: self.faces[edge as usize - self.edges.len()],
                count: 3,
            },
        }
    }
}
