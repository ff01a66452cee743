//! Terms of a few nodes each, indexed by the tiles that contain one of their nodes.

use std::fmt::Debug;
use std::ops::Range;

use glam::{DMat3, DVec3, Vec3};

use super::axial_terms::{AxialResponse, TileAxialTerms};
use super::pieces::TermPieces;
use super::{HistoryEvent, Term};
use crate::base::{Result, StateHasher, memory, outer};
use crate::codec::{Saved, saved};
use crate::def::{RelaxationStep, Spring};
use crate::soa::{NodeOrder, Region, Scale, TILE, TileForces, View, tile_count};

/// The law of a term with unit stiffness.
pub(super) trait StencilLaw<const N: usize>: Saved + Debug + Send + Sync + 'static {
    /// The tag of this law in snapshots.
    const SAVED_AS: u8;

    /// The rest shape of a term.
    type Shape: Saved + Copy + Debug + Send + Sync;

    fn energy(&self, shape: &Self::Shape, positions: &[DVec3; N]) -> f64;

    /// The energy change for these displacements, computed without cancellation.
    fn energy_change(&self, shape: &Self::Shape, positions: &[DVec3; N], displacements: &[DVec3; N]) -> f64;

    /// The energy change of an additional load, which may cancel the first.
    fn load_energy_change(&self, _shape: &Self::Shape, _positions: &[DVec3; N], _displacements: &[DVec3; N]) -> f64 {
        0.0
    }

    /// The force on each node.
    fn forces(&self, shape: &Self::Shape, positions: &[DVec3; N]) -> [DVec3; N];

    /// The first-order force changes for these displacements, by the positive semidefinite blocks.
    fn force_changes(&self, shape: &Self::Shape, positions: &[DVec3; N], displacements: &[DVec3; N]) -> [DVec3; N] {
        let blocks = self.blocks(shape, positions, false);
        blocks.map(|row| {
            -row.iter()
                .zip(displacements)
                .map(|(&block, &displacement)| block * displacement)
                .sum::<DVec3>()
        })
    }

    /// The negative derivatives of each node's force by each position: exact, or a positive semidefinite approximation.
    fn blocks(&self, shape: &Self::Shape, positions: &[DVec3; N], is_exact: bool) -> [[DMat3; N]; N];

    /// A bound of the squared frequency without stiffening, in addition to that of the springs of the terms.
    fn rate_bound(&self, _shape: &Self::Shape, _inverse_masses: [f64; N]) -> f64 {
        0.0
    }

    /// The ratio of the stiffness to the one that the rate assumes, at least 1.
    fn stiffening(&self, _shape: &Self::Shape, _positions: &[DVec3; N]) -> f64 {
        1.0
    }

    /// True if two of its nodes have an edge.
    fn is_edge(&self, _a: usize, _b: usize) -> bool {
        N > 1
    }

    /// True if its terms belong to springs, which are cut and scaled with the springs.
    const BELONGS_TO_SPRINGS: bool = false;

    /// The shape if all rest lengths are multiplied by `length`, and the factor of its stiffness.
    fn scaled(&self, shape: &Self::Shape, _length: f64) -> (Self::Shape, f64) {
        (*shape, 1.0)
    }

    /// True if the rest shape is finite.
    fn is_finite(&self, _shape: &Self::Shape) -> bool {
        true
    }

    /// The number that scaling or a new rest length changes, for hashing.
    fn size(&self, _shape: &Self::Shape) -> f32 {
        0.0
    }

    /// The shape of a spring's term with this rest length. `None`: the spring has no term.
    fn shape_with_rest_length(&self, _before: &Self::Shape, _rest_length: f32) -> Option<Self::Shape> {
        None
    }

    /// Calls `f` with the nodes and stiffness share of each piece of a term after a cut. Terms of springs do not use
    /// it.
    fn visit_pieces(&self, _shape: &Self::Shape, nodes: [u32; N], _pieces: &TermPieces, f: &mut PieceVisitor<N>) {
        f(nodes, 1.0);
    }

    /// Sets the origin that node positions are relative to.
    fn move_origin(&self, _shape: &mut Self::Shape, _origin: DVec3) {}

    /// True if it is an axial term: it pulls along one vector, a sum of its nodes' positions with weights that add up
    /// to 0. The following functions are for axial terms. They run in SIMD-friendly `f32` loops and must be
    /// `#[inline(always)]`.
    const IS_AXIAL: bool = Self::BELONGS_TO_SPRINGS;

    /// The weights of the nodes; by default those of a spring.
    #[inline(always)]
    fn weights(_shape: &Self::Shape) -> [f32; N] {
        let mut weights = [0.0; N];
        (weights[0], weights[N - 1]) = (-1.0, 1.0);
        weights
    }

    /// The parameters of a shape that the response depends on.
    fn parameters(_shape: &Self::Shape) -> [f32; 2] {
        [0.0; 2]
    }

    fn response(&self, _parameters: [f32; 2], _length: f32) -> AxialResponse {
        AxialResponse::default()
    }

    /// The elastic elongation that the internal variables depend on, m.
    fn elastic(&self, _parameters: [f32; 2], length: f32) -> f32 {
        length
    }

    /// True if terms have internal variables. The following functions are for these, which are axial.
    const HAS_HISTORY: bool = false;

    /// Prepares the law for an event that all terms receive.
    fn begin_event(&mut self, _event: HistoryEvent) {}

    fn apply_event(&self, _event: HistoryEvent, _shape: &mut Self::Shape) {}

    /// Advances the internal variables to this elastic elongation, m.
    fn advance(&self, _shape: &mut Self::Shape, _elastic: f32, _relaxation: RelaxationStep) {}

    fn hash(&self, _shape: &Self::Shape, _hasher: &mut StateHasher) {}
}

/// Receives the nodes of a piece of a term and its share of the stiffness.
pub(super) type PieceVisitor<'a, const N: usize> = dyn FnMut([u32; N], f64) + 'a;

/// A term: its nodes, stiffness and rest shape.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stencil<T, const N: usize> {
    pub nodes: [u32; N],
    /// 0: it is inactive. Below 0: it was removed.
    pub stiffness: f32,
    pub shape: T,
}

saved! { [T: Saved, const N: usize] Stencil<T, N> { nodes, stiffness, shape } }

/// Creates a term per spring, with a shape from its rest length. With `needs_strain`, a spring of rest length 0 gets an
/// inactive term, because its strain is undefined.
pub(super) fn spring_stencils<T>(
    springs: &[Spring],
    order: &NodeOrder,
    needs_strain: bool,
    shape: impl Fn(f32) -> T,
) -> Result<Vec<Stencil<T, 2>>> {
    memory::collected(springs.iter().map(|spring| {
        let mut nodes = spring.nodes.map(|node| order.own(node));
        nodes.sort_unstable();
        let is_active = spring.rest_length > 0.0 || !needs_strain;
        Stencil {
            nodes,
            stiffness: if is_active { spring.stiffness } else { 0.0 },
            shape: shape(spring.rest_length),
        }
    }))
}

/// The terms of one law.
#[derive(Debug)]
pub(super) struct Stencils<L: StencilLaw<N>, const N: usize> {
    pub(super) law: L,
    /// Sorted by nodes, and so by first tile. Terms created by cuts follow.
    pub(super) all: Vec<Stencil<L::Shape, N>>,
    /// The start of each tile's range in `all`, for the terms whose first tile it is, and in `visitors`, for others
    /// with a node in it.
    pub(super) starts: Vec<usize>,
    pub(super) visitor_starts: Vec<usize>,
    pub(super) visitors: Vec<u32>,
    /// The terms created by cuts, for each tile with one of their nodes. Empty before the first cut.
    pub(super) cut_terms: Vec<Vec<u32>>,
    /// The prepared cut: new stiffnesses of existing terms, and new terms.
    pub(super) changed: Vec<(u32, f32)>,
    pub(super) added: Vec<Stencil<L::Shape, N>>,
}

saved! { [L: StencilLaw<N>, const N: usize] Stencils<L, N> {
    law, all, starts, visitor_starts, visitors, cut_terms, changed, added,
} }

pub(super) fn tile_of(node: u32) -> usize {
    node as usize / TILE
}

impl<L: StencilLaw<N>, const N: usize> Stencils<L, N> {
    /// Creates the terms as a boxed `Term`.
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
            cut_terms: Vec::new(),
            changed: Vec::new(),
            added: Vec::new(),
        })
    }

    /// The terms that existed before cuts and whose first tile is this one.
    pub(super) fn initial(&self, tile: usize) -> Range<usize> {
        range_of(&self.starts, tile)
    }

    /// The range in `visitors` of the other terms from before cuts with a node in this tile.
    pub(super) fn visitors(&self, tile: usize) -> Range<usize> {
        range_of(&self.visitor_starts, tile)
    }

    /// The terms created by cuts with a node in this tile.
    pub(super) fn cut_terms(&self, tile: usize) -> &[u32] {
        self.cut_terms.get(tile).map_or(&[], |cut_terms| cut_terms)
    }

    /// The terms whose first tile is this one.
    pub(super) fn owned(&self, tile: usize) -> impl Iterator<Item = usize> {
        let begins = move |index: &usize| self.all[*index].first_tile() == tile;
        let cut_terms = self.cut_terms(tile).iter().map(|&index| index as usize);
        self.initial(tile).chain(cut_terms.filter(begins))
    }

    /// All terms with a node in a tile.
    pub(super) fn touching(&self, tile: usize) -> impl Iterator<Item = usize> {
        let others = self.visitors[self.visitors(tile)].iter().chain(self.cut_terms(tile));
        self.initial(tile).chain(others.map(|&index| index as usize))
    }

    /// The term of these sorted nodes, if there is one.
    pub(super) fn find(&self, nodes: &[u32]) -> Option<usize> {
        let cut_terms = self.cut_terms(tile_of(nodes[0])).iter().map(|&index| index as usize);
        let is_it = |index: &usize| self.all[*index].nodes == nodes && self.all[*index].stiffness >= 0.0;
        let first = &self.all[..self.starts.last().copied().unwrap_or(0)];
        let first = first.binary_search_by(|stencil| stencil.nodes[..].cmp(nodes));
        first.ok().into_iter().chain(cut_terms).find(is_it)
    }

    pub(super) fn tile_axial_terms<'a>(
        &'a self,
        (tile, nodes): (usize, Range<usize>),
        positions: View<'a>,
        displacements: Option<View<'a>>,
        sums: &'a mut TileForces,
    ) -> TileAxialTerms<'a, L, N> {
        TileAxialTerms {
            law: &self.law,
            all: &self.all,
            owned: self.initial(tile),
            visitors: &self.visitors[self.visitors(tile)],
            cut_terms: self.cut_terms(tile),
            nodes,
            positions,
            displacements,
            sums,
        }
    }

    pub(super) fn active(&self) -> impl Iterator<Item = &Stencil<L::Shape, N>> {
        self.all.iter().filter(|stencil| stencil.stiffness > 0.0)
    }
}

impl<L: StencilLaw<N>, const N: usize> Stencils<L, N> {
    /// The indices of terms with all nodes in a region.
    pub(super) fn within(&self, region: &Region) -> impl Iterator<Item = usize> {
        let tiles = region.tiles().filter(|_| !L::BELONGS_TO_SPRINGS);
        tiles
            .flat_map(|tile| self.owned(tile))
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
    pub(super) fn vectors_in(&self, vectors: &View) -> [DVec3; N] {
        self.nodes.map(|node| vectors.get(node as usize).as_dvec3())
    }

    #[inline(always)]
    pub(super) fn at(&self, at: &dyn Fn(usize) -> DVec3) -> [DVec3; N] {
        self.nodes.map(|node| at(node as usize))
    }

    /// Adds its stiffness times `vectors` to the sums of its nodes in a tile.
    #[inline(always)]
    pub(super) fn scatter(&self, nodes: &Range<usize>, vectors: &[DVec3; N], sums: &mut TileForces) {
        for (&node, &vector) in self.nodes.iter().zip(vectors) {
            let index = (node as usize).wrapping_sub(nodes.start);
            if index < nodes.len() {
                let contribution: Vec3 = (vector * f64::from(self.stiffness)).as_vec3();
                sums.set(index, sums.get(index) + contribution);
            }
        }
    }
}

/// The weighted sum of positions, where weights add up to 0 and the first is omitted.
#[inline(always)]
pub(super) fn weighted(weights: &[f32; 3], [first, others @ ..]: &[DVec3; 4]) -> DVec3 {
    let terms = weights.iter().zip(others);
    terms
        .map(|(&weight, &position)| (position - *first) * f64::from(weight))
        .sum()
}

/// The weights of all positions in such a sum.
#[inline(always)]
pub(super) fn shares(weights: &[f32; 3]) -> [f64; 4] {
    let [a, b, c] = weights.map(f64::from);
    [-(a + b + c), a, b, c]
}

/// The change of a vector's length if `change` is added, without cancellation; 0 if both lengths are 0.
pub(super) fn lengthening(offset: DVec3, change: DVec3) -> f64 {
    let then = offset + change;
    let both = offset.length() + then.length();
    if both > 0.0 {
        change.dot(offset + then) / both
    } else {
        0.0
    }
}

/// The direction of a vector. A zero vector, of coincident nodes, points along x from the lower node index.
pub(super) fn direction(offset: DVec3) -> DVec3 {
    let length = offset.length();
    if length > 0.0 { offset / length } else { DVec3::X }
}

/// The matrix with the eigenvalue `along` in a direction and `across` perpendicular to it.
pub(super) fn axial_matrix(direction: DVec3, along: f64, across: f64) -> DMat3 {
    outer(direction * (along - across), direction) + DMat3::from_diagonal(DVec3::splat(across))
}

/// The range of a tile; empty for a tile without a start.
fn range_of(starts: &[usize], tile: usize) -> Range<usize> {
    starts.get(tile..tile + 2).map_or(0..0, |ends| ends[0]..ends[1])
}
