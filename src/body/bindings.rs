//! Points of the surface that have no mass of their own: they go where the nodes of their material go.

use glam::Vec3;

use super::vectors::Vectors;
use crate::error::Result;

/// A point that is bound to nodes, which are not bound themselves. It has a number among the body's nodes, without mass or springs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bound {
    pub node: u32,
    /// Those that count come first.
    pub nodes: [u32; 4],
    /// At least 0, 1 in sum.
    pub weights: [f32; 4],
}

impl Bound {
    /// The nodes that count, with their weights.
    pub fn parts(&self) -> impl Iterator<Item = (u32, f32)> {
        let parts = self.nodes.into_iter().zip(self.weights);
        parts.filter(|&(_, weight)| weight > 0.0)
    }

    /// What the nodes' vectors make of it.
    pub fn of(&self, vector_of: impl Fn(usize) -> Vec3) -> Vec3 {
        self.parts()
            .map(|(node, weight)| vector_of(node as usize) * weight)
            .sum()
    }
}

/// The bound points of a body, in the order of their numbers.
#[derive(Debug, Default)]
pub(crate) struct Bindings(Vec<Bound>);

impl Bindings {
    /// Makes room for so many more.
    pub fn reserve(&mut self, count: usize) -> Result<()> {
        Ok(self.0.try_reserve(count)?)
    }

    /// Adds a point, for which there is room, of a higher number than those before.
    pub fn push(&mut self, bound: Bound) {
        self.0.push(bound);
    }

    pub fn iter(&self) -> impl Iterator<Item = &Bound> {
        self.0.iter()
    }

    pub fn get(&self, node: u32) -> Option<&Bound> {
        let place = self.0.binary_search_by_key(&node, |bound| bound.node);
        place.ok().map(|place| &self.0[place])
    }

    pub fn get_mut(&mut self, node: u32) -> Option<&mut Bound> {
        let place = self.0.binary_search_by_key(&node, |bound| bound.node);
        place.ok().map(|place| &mut self.0[place])
    }

    /// Makes the vectors of all points what those of their nodes make of them.
    pub fn follow(&self, vectors: &mut Vectors) {
        for bound in &self.0 {
            let vector = bound.of(|node| vectors.get(node));
            vectors.set(bound.node as usize, vector);
        }
    }
}
