//! Bound points: indices of the render surface without mass, at weighted means of nodes.

use glam::Vec3;

use crate::base::{Result, StateHasher, memory};
use crate::codec::saved;
use crate::soa::Vectors;

/// Binding of a point to up to four nodes, which are not bound themselves. The point has an index among the body's
/// nodes, but no mass and no springs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct NodeBinding {
    pub node: u32,
    /// Nodes with a nonzero weight come first.
    pub nodes: [u32; 4],
    /// Nonnegative weights with sum 1.
    pub weights: [f32; 4],
}

saved! { NodeBinding { node, nodes, weights } }

impl NodeBinding {
    /// Binding of a node to itself.
    fn identity(node: u32) -> Self {
        Self {
            node,
            nodes: [node; 4],
            weights: [1.0, 0.0, 0.0, 0.0],
        }
    }

    /// Nodes with a nonzero weight, and the weights.
    pub fn weighted_nodes(&self) -> impl Iterator<Item = (u32, f32)> {
        self.into_weighted_nodes()
    }

    fn into_weighted_nodes(self) -> impl Iterator<Item = (u32, f32)> {
        let pairs = self.nodes.into_iter().zip(self.weights);
        pairs.filter(|&(_, weight)| weight > 0.0)
    }

    /// Weighted mean of the nodes' vectors.
    pub fn interpolate(&self, vector_of: impl Fn(usize) -> Vec3) -> Vec3 {
        self.weighted_nodes()
            .map(|(node, weight)| vector_of(node as usize) * weight)
            .sum()
    }
}

/// Kind of a new node.
#[derive(Clone, Copy, Debug)]
pub(crate) enum NewNode {
    /// A copy of this node's motion and damping, without mass, pin or springs.
    Copy(u32),
    /// A bound point.
    Bound(NodeBinding),
}

/// Bound points of a body, by ascending index.
#[derive(Debug, Default)]
pub(crate) struct Bindings {
    points: Vec<NodeBinding>,
    /// Position in `points` of each index from the first bound point on; [`NOT_BOUND`] for a node.
    indices: Vec<u32>,
    /// One bit per index, set if it is neither drawn nor in contact. It ends at the last such index.
    hidden: Vec<u64>,
}

saved! { Bindings { points, indices, hidden } }

/// Vector at an index: that of the node, or the weighted mean of a bound point.
#[inline]
pub(crate) fn vector(bindings: Option<&Bindings>, vectors: &Vectors, node: usize) -> Vec3 {
    match bindings.and_then(|bindings| bindings.get(node as u32)) {
        Some(binding) => binding.interpolate(|node| vectors.get(node)),
        None => vectors.get(node),
    }
}

/// Nodes and weights of an index; the node itself with weight 1 if it is not bound.
#[inline]
pub(crate) fn weighted_nodes(bindings: Option<&Bindings>, node: u32) -> impl Iterator<Item = (u32, f32)> + use<> {
    let binding = bindings.and_then(|bindings| bindings.get(node)).copied();
    binding
        .unwrap_or_else(|| NodeBinding::identity(node))
        .into_weighted_nodes()
}

const NOT_BOUND: u32 = u32::MAX;

impl Bindings {
    /// Reserves capacity for `count` new indices, any of which may be bound or hidden.
    pub fn reserve(&mut self, count: usize, node_count: usize) -> Result<()> {
        self.points.try_reserve(count)?;
        self.indices.try_reserve(count)?;
        memory::reserve(&mut self.hidden, (node_count + count).div_ceil(64))
    }

    /// Adds a bound point with a higher index than those before, within the capacity.
    pub fn push(&mut self, binding: NodeBinding) {
        let first = self.points.first().map_or(binding.node, |binding| binding.node);
        self.indices.resize((binding.node - first) as usize, NOT_BOUND);
        self.indices.push(self.points.len() as u32);
        self.points.push(binding);
    }

    pub fn iter(&self) -> impl Iterator<Item = &NodeBinding> {
        self.points.iter()
    }

    pub fn get(&self, node: u32) -> Option<&NodeBinding> {
        self.points.get(self.index_of(node)?)
    }

    pub fn get_mut(&mut self, node: u32) -> Option<&mut NodeBinding> {
        let index = self.index_of(node)?;
        self.points.get_mut(index)
    }

    #[inline]
    fn index_of(&self, node: u32) -> Option<usize> {
        let index = node.checked_sub(self.points.first()?.node)?;
        let &index = self.indices.get(index as usize)?;
        (index != NOT_BOUND).then_some(index as usize)
    }

    /// Nodes and weights of an index; the node itself with weight 1 if it is not bound.
    #[inline]
    pub fn weighted_nodes(&self, node: u32) -> impl Iterator<Item = (u32, f32)> {
        weighted_nodes(Some(self), node)
    }

    /// Hides an index, within the capacity: it is neither drawn nor in contact.
    pub fn hide(&mut self, node: u32) {
        let word = node as usize / 64;
        if word >= self.hidden.len() {
            self.hidden.resize(word + 1, 0);
        }
        self.hidden[word] |= 1 << (node % 64);
    }

    /// Makes an index visible again.
    pub fn show(&mut self, node: u32) {
        if let Some(word) = self.hidden.get_mut(node as usize / 64) {
            *word &= !(1 << (node % 64));
        }
    }

    #[inline]
    pub fn is_hidden(&self, node: u32) -> bool {
        let word = self.hidden.get(node as usize / 64);
        word.is_some_and(|word| word >> (node % 64) & 1 == 1)
    }

    /// Hashes the data that contact depends on.
    pub fn hash(&self, hasher: &mut StateHasher) {
        for binding in &self.points {
            hasher.write_u64(u64::from(binding.node));
            binding.nodes.iter().for_each(|&node| hasher.write_u64(u64::from(node)));
            hasher.write_floats(&binding.weights);
        }
        self.hidden.iter().for_each(|&word| hasher.write_u64(word));
    }

    /// Sets the vectors of all bound points to the weighted means of their nodes.
    pub fn update_points(&self, vectors: &mut Vectors) {
        for binding in &self.points {
            let vector = binding.interpolate(|node| vectors.get(node));
            vectors.set(binding.node as usize, vector);
        }
    }
}
