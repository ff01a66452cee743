//! Terms of a few nodes each, kept by the tiles that have one of their nodes.

use std::fmt::Debug;
use std::ops::Range;

use glam::{DMat3, DVec3, Vec3};

use super::parting::Parting;
use super::strings::{OfTile, Tension};
use super::{Event, Term};
use crate::base::{Result, StateHasher, memory, outer};
use crate::codec::{Saved, saved};
use crate::def::{RelaxationStep, Spring};
use crate::soa::{NodeOrder, Region, Scale, TILE, TileForces, View, tile_count};

/// What a term does whose stiffness is 1.
pub(super) trait StencilLaw<const N: usize>: Saved + Debug + Send + Sync + 'static {
    /// Which law it is, in bytes.
    const SAVED_AS: u8;

    /// What the term of some nodes is at rest.
    type Shape: Saved + Copy + Debug + Send + Sync;

    fn energy(&self, shape: &Self::Shape, places: &[DVec3; N]) -> f64;

    /// How the energy changes where nodes go these ways, to the last digits of the change.
    fn change(&self, shape: &Self::Shape, places: &[DVec3; N], ways: &[DVec3; N]) -> f64;

    /// The same of what acts on top of it, which may cancel it.
    fn change_of_load(&self, _shape: &Self::Shape, _places: &[DVec3; N], _ways: &[DVec3; N]) -> f64 {
        0.0
    }

    /// The force on each node.
    fn forces(&self, shape: &Self::Shape, places: &[DVec3; N]) -> [DVec3; N];

    /// How the forces change where nodes go these ways, in the first order, by the blocks that are positive semidefinite.
    fn changes(&self, shape: &Self::Shape, places: &[DVec3; N], ways: &[DVec3; N]) -> [DVec3; N] {
        let blocks = self.blocks(shape, places, false);
        blocks.map(|row| -row.iter().zip(ways).map(|(&block, &way)| block * way).sum::<DVec3>())
    }

    /// How much the force on each node lessens with the place of each: exactly, or what is positive semidefinite of it.
    fn blocks(&self, shape: &Self::Shape, places: &[DVec3; N], is_exact: bool) -> [[DMat3; N]; N];

    /// What bounds the squares of frequencies as long as it does not stiffen, beyond what springs of its terms have.
    fn rate(&self, _shape: &Self::Shape, _inverse_masses: [f64; N]) -> f64 {
        0.0
    }

    /// By how much it is stiffer than that, 1: not at all.
    fn stiffening(&self, _shape: &Self::Shape, _places: &[DVec3; N]) -> f64 {
        1.0
    }

    /// Whether two of its nodes have an edge.
    fn is_edge(&self, _a: usize, _b: usize) -> bool {
        N > 1
    }

    /// Whether its terms are springs': they go with those, and are not scaled by themselves.
    const IS_OF_SPRINGS: bool = false;

    /// What it is where everything is so many times as long at rest, and how many times as stiff it is then.
    fn scaled(&self, shape: &Self::Shape, _length: f64) -> (Self::Shape, f64) {
        (*shape, 1.0)
    }

    /// Whether what it is at rest is a number.
    fn is_finite(&self, _shape: &Self::Shape) -> bool {
        true
    }

    /// What changes of it as it is scaled or its spring is given another rest length.
    fn size(&self, _shape: &Self::Shape) -> f32 {
        0.0
    }

    /// What the term of a spring becomes with this rest length, where its terms are springs'; `None`: it has none.
    fn shape_of_spring(&self, _before: &Self::Shape, _rest_length: f32) -> Option<Self::Shape> {
        None
    }

    /// Shows the nodes of all parts of a term that a cut leaves, and what part of its stiffness each has. Springs' are known.
    fn show_parts(&self, _shape: &Self::Shape, nodes: [u32; N], _parting: &Parting, see: &mut SeePart<N>) {
        see(nodes, 1.0);
    }

    /// Nodes are given from here on.
    fn move_origin(&self, _shape: &mut Self::Shape, _origin: DVec3) {}

    /// Whether it is a string: it pulls along one vector, the sum of what its nodes have, weighted by numbers that add up to 0. What
    /// follows is for those, to be worked out side by side in `f32`, and marked `#[inline(always)]`.
    const IS_STRING: bool = Self::IS_OF_SPRINGS;

    /// Those of a spring, unless it says otherwise.
    #[inline(always)]
    fn weights(_shape: &Self::Shape) -> [f32; N] {
        let mut weights = [0.0; N];
        (weights[0], weights[N - 1]) = (-1.0, 1.0);
        weights
    }

    /// What of a shape counts beside its length.
    fn numbers(_shape: &Self::Shape) -> [f32; 2] {
        [0.0; 2]
    }

    fn tension(&self, _numbers: [f32; 2], _length: f32) -> Tension {
        Tension::default()
    }

    /// What a string that remembers has to know of its length, m.
    fn elastic(&self, _numbers: [f32; 2], length: f32) -> f32 {
        length
    }

    /// Whether terms remember anything; what follows is for those, which are strings.
    const REMEMBERS: bool = false;

    /// Something is about to be done to all terms.
    fn begin(&mut self, _moment: Event) {}

    fn pass(&self, _moment: Event, _shape: &mut Self::Shape) {}

    /// Nodes have come to where this is elastic of it, m.
    fn age(&self, _shape: &mut Self::Shape, _elastic: f32, _course: RelaxationStep) {}

    fn hash(&self, _shape: &Self::Shape, _hasher: &mut StateHasher) {}
}

/// What is shown the nodes of a part of a term, and its part of the stiffness.
pub(super) type SeePart<'a, const N: usize> = dyn FnMut([u32; N], f64) + 'a;

/// A term: some nodes, how stiff it is, and what it is at rest.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stencil<T, const N: usize> {
    pub nodes: [u32; N],
    /// 0: it does nothing; below 0: it was taken away.
    pub stiffness: f32,
    pub shape: T,
}

saved! { [T: Saved, const N: usize] Stencil<T, N> { nodes, stiffness, shape } }

/// A term for each spring, with the shape that its rest length leads to; one without a length at rest has no strain, and nothing that goes
/// by that.
pub(super) fn of_springs<T>(
    springs: &[Spring],
    order: &NodeOrder,
    goes_by_strain: bool,
    shape: impl Fn(f32) -> T,
) -> Result<Vec<Stencil<T, 2>>> {
    memory::collected(springs.iter().map(|spring| {
        let mut nodes = spring.nodes.map(|node| order.own(node));
        nodes.sort_unstable();
        let is_there = spring.rest_length > 0.0 || !goes_by_strain;
        Stencil {
            nodes,
            stiffness: if is_there { spring.stiffness } else { 0.0 },
            shape: shape(spring.rest_length),
        }
    }))
}

/// Terms of one law.
#[derive(Debug)]
pub(super) struct Stencils<L: StencilLaw<N>, const N: usize> {
    pub(super) law: L,
    /// By the first of their tiles, but for those of cuts, which follow them.
    pub(super) all: Vec<Stencil<L::Shape, N>>,
    /// Where the terms of each tile begin among those that begin in it, and those that only end in it.
    pub(super) starts: Vec<usize>,
    pub(super) visitor_starts: Vec<usize>,
    pub(super) visitors: Vec<u32>,
    /// Those that cuts have added, by all tiles that have a node of them; of no tiles before a cut.
    pub(super) later: Vec<Vec<u32>>,
    /// What a cut is to do: stiffnesses of terms there are, and others.
    pub(super) changed: Vec<(u32, f32)>,
    pub(super) added: Vec<Stencil<L::Shape, N>>,
}

saved! { [L: StencilLaw<N>, const N: usize] Stencils<L, N> {
    law, all, starts, visitor_starts, visitors, later, changed, added,
} }

pub(super) fn tile_of(node: u32) -> usize {
    node as usize / TILE
}

impl<L: StencilLaw<N>, const N: usize> Stencils<L, N> {
    /// A term of these, for a body to have.
    pub fn boxed(law: L, all: Vec<Stencil<L::Shape, N>>, node_count: usize) -> Result<Option<Box<dyn Term>>> {
        Ok(Some(memory::boxed(Self::new(law, all, node_count)?)?))
    }

    fn new(law: L, mut all: Vec<Stencil<L::Shape, N>>, node_count: usize) -> Result<Self> {
        let tiles = |stencil: &Stencil<L::Shape, N>| {
            let mut tiles = stencil.nodes.map(tile_of);
            tiles.sort_unstable();
            tiles
        };
        all.sort_unstable_by_key(|stencil| {
            let mut nodes = stencil.nodes;
            nodes.sort_unstable();
            nodes
        });
        let count = tile_count(node_count);
        let mut starts = memory::filled(0, count + 1)?;
        let mut visits: Vec<(u32, u32)> = Vec::new();
        for (index, stencil) in (0..).zip(&all) {
            let tiles = tiles(stencil);
            starts[tiles[0] + 1] += 1;
            let further = tiles.windows(2).filter(|pair| pair[0] != pair[1]);
            memory::extend(&mut visits, further.map(|pair| (pair[1] as u32, index)))?;
        }
        visits.sort_unstable();
        let mut visitor_starts = memory::filled(0, count + 1)?;
        visits
            .iter()
            .for_each(|(tile, _)| visitor_starts[*tile as usize + 1] += 1);
        for starts in [&mut starts, &mut visitor_starts] {
            for tile in 1..=count {
                starts[tile] += starts[tile - 1];
            }
        }
        let visitors = memory::collected(visits.iter().map(|&(_, index)| index))?;
        Ok(Self {
            law,
            all,
            starts,
            visitor_starts,
            visitors,
            later: Vec::new(),
            changed: Vec::new(),
            added: Vec::new(),
        })
    }

    /// Those of the first that begin in a tile.
    pub(super) fn first(&self, tile: usize) -> Range<usize> {
        stretch(&self.starts, tile)
    }

    /// The places among visitors of those of the first that only end in it.
    pub(super) fn visitors(&self, tile: usize) -> Range<usize> {
        stretch(&self.visitor_starts, tile)
    }

    /// Those of cuts that have a node of it.
    pub(super) fn later(&self, tile: usize) -> &[u32] {
        self.later.get(tile).map_or(&[], |later| later)
    }

    /// Those that begin in a tile.
    pub(super) fn beginning(&self, tile: usize) -> impl Iterator<Item = usize> {
        let begins = move |index: &usize| self.all[*index].first_tile() == tile;
        let later = self.later(tile).iter().map(|&index| index as usize);
        self.first(tile).chain(later.filter(begins))
    }

    /// All that have a node of a tile.
    pub(super) fn of_tile(&self, tile: usize) -> impl Iterator<Item = usize> {
        let others = self.visitors[self.visitors(tile)].iter().chain(self.later(tile));
        self.first(tile).chain(others.map(|&index| index as usize))
    }

    /// The one between these nodes, in order, where there is one.
    pub(super) fn find(&self, nodes: &[u32]) -> Option<usize> {
        let later = self.later(tile_of(nodes[0])).iter().map(|&index| index as usize);
        let is_it = |index: &usize| self.all[*index].nodes == nodes && self.all[*index].stiffness >= 0.0;
        let first = &self.all[..self.starts.last().copied().unwrap_or(0)];
        let first = first.binary_search_by(|stencil| stencil.nodes[..].cmp(nodes));
        first.ok().into_iter().chain(later).find(is_it)
    }

    pub(super) fn strings<'a>(
        &'a self,
        (tile, nodes): (usize, Range<usize>),
        positions: View<'a>,
        ways: Option<View<'a>>,
        sums: &'a mut TileForces,
    ) -> OfTile<'a, L, N> {
        OfTile {
            law: &self.law,
            all: &self.all,
            beginning: self.first(tile),
            visitors: &self.visitors[self.visitors(tile)],
            later: self.later(tile),
            nodes,
            positions,
            ways,
            sums,
        }
    }

    pub(super) fn there(&self) -> impl Iterator<Item = &Stencil<L::Shape, N>> {
        self.all.iter().filter(|stencil| stencil.stiffness > 0.0)
    }
}

impl<L: StencilLaw<N>, const N: usize> Stencils<L, N> {
    /// Where the terms are that a region has all nodes of.
    pub(super) fn within(&self, region: &Region) -> impl Iterator<Item = usize> {
        let tiles = region.tiles().filter(|_| !L::IS_OF_SPRINGS);
        tiles
            .flat_map(|tile| self.beginning(tile))
            .filter(|&index| self.all[index].stiffness > 0.0 && region.has_all(&self.all[index].nodes))
    }

    pub(super) fn scaled(&self, index: usize, scale: Scale) -> Stencil<L::Shape, N> {
        let stencil = &self.all[index];
        let (shape, factor) = self.law.scaled(&stencil.shape, f64::from(scale.length));
        let stiffness = f64::from(stencil.stiffness) * f64::from(scale.stiffness) * factor;
        Stencil {
            nodes: stencil.nodes,
            stiffness: stiffness as f32,
            shape,
        }
    }
}

impl<T, const N: usize> Stencil<T, N> {
    pub(super) fn first_tile(&self) -> usize {
        self.nodes.into_iter().map(tile_of).min().unwrap_or(0)
    }

    #[inline(always)]
    pub(super) fn seen(&self, vectors: &View) -> [DVec3; N] {
        self.nodes.map(|node| vectors.get(node as usize).as_dvec3())
    }

    #[inline(always)]
    pub(super) fn at(&self, at: &dyn Fn(usize) -> DVec3) -> [DVec3; N] {
        self.nodes.map(|node| at(node as usize))
    }

    /// Adds what its nodes of a tile are given by a stiffness of 1.
    #[inline(always)]
    pub(super) fn give(&self, nodes: &Range<usize>, gifts: &[DVec3; N], sums: &mut TileForces) {
        for (&node, &gift) in self.nodes.iter().zip(gifts) {
            let place = (node as usize).wrapping_sub(nodes.start);
            if place < nodes.len() {
                let more: Vec3 = (gift * f64::from(self.stiffness)).as_vec3();
                sums.set(place, sums.get(place) + more);
            }
        }
    }
}

/// What a sum of places weighted by numbers that add up to 0 is, given the numbers of all but the first.
#[inline(always)]
pub(super) fn weighted(weights: &[f32; 3], [first, others @ ..]: &[DVec3; 4]) -> DVec3 {
    let terms = weights.iter().zip(others);
    terms
        .map(|(&weight, &place)| (place - *first) * f64::from(weight))
        .sum()
}

/// The share that each place has in such a sum.
#[inline(always)]
pub(super) fn shares(weights: &[f32; 3]) -> [f64; 4] {
    let [a, b, c] = weights.map(f64::from);
    [-(a + b + c), a, b, c]
}

/// How much longer a way becomes by more, to the last digits of that; 0 where both lengths are.
pub(super) fn lengthening(way: DVec3, more: DVec3) -> f64 {
    let then = way + more;
    let both = way.length() + then.length();
    if both > 0.0 { more.dot(way + then) / both } else { 0.0 }
}

/// Where a way points. Where it has no length, its nodes being in one place, it points along x, from the node with the lower number.
pub(super) fn direction(way: DVec3) -> DVec3 {
    let length = way.length();
    if length > 0.0 { way / length } else { DVec3::X }
}

/// The matrix that has `along` in a direction, and `across` at right angles to it.
pub(super) fn directed(direction: DVec3, along: f64, across: f64) -> DMat3 {
    outer(direction * (along - across), direction) + DMat3::from_diagonal(DVec3::splat(across))
}

/// The places from one tile's start to that of the next; none of a tile without a start.
fn stretch(starts: &[usize], tile: usize) -> Range<usize> {
    starts.get(tile..tile + 2).map_or(0..0, |ends| ends[0]..ends[1])
}
