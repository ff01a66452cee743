//! Points of the surface that have no mass of their own: they go where the nodes of their material go.

use glam::Vec3;

use crate::base::{Result, StateHasher, memory};
use crate::codec::saved;
use crate::soa::Vectors;

/// A point that is bound to nodes, which are not bound themselves. It has a number among the body's nodes, without mass or springs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bound {
    pub node: u32,
    /// Those that count come first.
    pub nodes: [u32; 4],
    /// At least 0, 1 in sum.
    pub weights: [f32; 4],
}

saved! { Bound { node, nodes, weights } }

impl Bound {
    /// A node that is bound to none: to itself.
    fn itself(node: u32) -> Self {
        Self {
            node,
            nodes: [node; 4],
            weights: [1.0, 0.0, 0.0, 0.0],
        }
    }

    /// The nodes that count, with their weights.
    pub fn parts(&self) -> impl Iterator<Item = (u32, f32)> {
        self.into_parts()
    }

    fn into_parts(self) -> impl Iterator<Item = (u32, f32)> {
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

/// What a new node is.
#[derive(Clone, Copy, Debug)]
pub(crate) enum NewNode {
    /// It moves as this one does, and is damped as it is; it has no mass yet, and is held by nothing.
    Copy(u32),
    /// A point that is bound to others.
    Bound(Bound),
}

/// The bound points of a body, in the order of their numbers.
#[derive(Debug, Default)]
pub(crate) struct Bindings {
    points: Vec<Bound>,
    /// For each number from that of the first point on its place among them; [`NOT_BOUND`] where it has none.
    places: Vec<u32>,
    /// A bit for each of the body's numbers up to the last that nobody draws or touches.
    hidden: Vec<u64>,
}

saved! { Bindings { points, places, hidden } }

/// That of these vectors which a number has: its own, or what the nodes that it is bound to make of theirs.
#[inline]
pub(crate) fn vector(bindings: Option<&Bindings>, vectors: &Vectors, node: usize) -> Vec3 {
    match bindings.and_then(|bindings| bindings.get(node as u32)) {
        Some(bound) => bound.of(|node| vectors.get(node)),
        None => vectors.get(node),
    }
}

/// The nodes that a number stands for, with their weights: itself where it is not bound, as where nothing is.
#[inline]
pub(crate) fn parts(bindings: Option<&Bindings>, node: u32) -> impl Iterator<Item = (u32, f32)> + use<> {
    let bound = bindings.and_then(|bindings| bindings.get(node)).copied();
    bound.unwrap_or_else(|| Bound::itself(node)).into_parts()
}

const NOT_BOUND: u32 = u32::MAX;

impl Bindings {
    /// Makes room for so many numbers more than the body has, of which any may be bound and any hidden.
    pub fn reserve(&mut self, count: usize, node_count: usize) -> Result<()> {
        self.points.try_reserve(count)?;
        self.places.try_reserve(count)?;
        memory::reserve(&mut self.hidden, (node_count + count).div_ceil(64))
    }

    /// Adds a point, for which there is room, of a higher number than those before.
    pub fn push(&mut self, bound: Bound) {
        let first = self.points.first().map_or(bound.node, |bound| bound.node);
        self.places.resize((bound.node - first) as usize, NOT_BOUND);
        self.places.push(self.points.len() as u32);
        self.points.push(bound);
    }

    pub fn iter(&self) -> impl Iterator<Item = &Bound> {
        self.points.iter()
    }

    pub fn get(&self, node: u32) -> Option<&Bound> {
        self.points.get(self.place(node)?)
    }

    pub fn get_mut(&mut self, node: u32) -> Option<&mut Bound> {
        let place = self.place(node)?;
        self.points.get_mut(place)
    }

    #[inline]
    fn place(&self, node: u32) -> Option<usize> {
        let place = node.checked_sub(self.points.first()?.node)?;
        let &place = self.places.get(place as usize)?;
        (place != NOT_BOUND).then_some(place as usize)
    }

    /// The nodes that a number stands for, with their weights: itself where it is not bound.
    #[inline]
    pub fn parts(&self, node: u32) -> impl Iterator<Item = (u32, f32)> {
        parts(Some(self), node)
    }

    /// Nobody draws or touches this number any more; there is room for it.
    pub fn hide(&mut self, node: u32) {
        let word = node as usize / 64;
        if word >= self.hidden.len() {
            self.hidden.resize(word + 1, 0);
        }
        self.hidden[word] |= 1 << (node % 64);
    }

    /// It is drawn again.
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

    /// What contact depends on.
    pub fn hash(&self, hasher: &mut StateHasher) {
        for bound in &self.points {
            hasher.write_u64(u64::from(bound.node));
            bound.nodes.iter().for_each(|&node| hasher.write_u64(u64::from(node)));
            hasher.write_floats(&bound.weights);
        }
        self.hidden.iter().for_each(|&word| hasher.write_u64(word));
    }

    /// Makes the vectors of all points what those of their nodes make of them.
    pub fn follow(&self, vectors: &mut Vectors) {
        for bound in &self.points {
            let vector = bound.of(|node| vectors.get(node));
            vectors.set(bound.node as usize, vector);
        }
    }
}
