//! Axial terms: they pull along one vector, a weighted sum of their nodes' positions. They are evaluated in
//! SIMD-friendly `f32` loops.
//!
//! Terms are gathered in blocks, evaluated in plain loops that are compiled per SIMD level, and scattered. No operation
//! is fused or approximated, so all SIMD levels give bitwise identical results.

use std::ops::Range;

use glam::Vec4;

use super::stencils::{Stencil, StencilLaw};
use crate::def::RelaxationStep;
use crate::simd::Loops;
use crate::soa::{TILE, TileForces, View};

/// The number of terms per block.
const BLOCK: usize = 64;

/// The stride of the scatter. Consecutive terms share their first node; adding them in order would make each sum wait
/// for the one before.
const STRIDE: usize = 16;

/// The response of an axial term of unit stiffness at a length.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct AxialResponse {
    pub pull: f32,
    /// The derivative of the pull by the length.
    pub slope: f32,
    /// The part of the pull that resists transverse displacements.
    pub transverse: f32,
    /// The ratio of its stiffness to the one that its rate assumes, at least 1.
    pub stiffening: f32,
}

/// The axial terms with a node in a tile.
pub(super) struct TileAxialTerms<'a, L: StencilLaw<N>, const N: usize> {
    pub law: &'a L,
    pub all: &'a [Stencil<L::Shape, N>],
    /// The terms whose first tile is this one, and others from before cuts.
    pub owned: Range<usize>,
    pub visitors: &'a [u32],
    /// The terms created by cuts.
    pub cut_terms: &'a [u32],
    pub nodes: Range<usize>,
    pub positions: View<'a>,
    /// The displacements, present if force changes are computed instead of forces.
    pub displacements: Option<View<'a>>,
    pub sums: &'a mut TileForces,
}

/// A vector per term, stored by axis.
struct BlockVectors([[f32; BLOCK]; 3]);

impl BlockVectors {
    const ZERO: Self = Self([[0.0; BLOCK]; 3]);

    #[inline(always)]
    fn get(&self, lane: usize) -> [f32; 3] {
        [self.0[0][lane], self.0[1][lane], self.0[2][lane]]
    }

    #[inline(always)]
    fn set(&mut self, lane: usize, vector: [f32; 3]) {
        (self.0[0][lane], self.0[1][lane], self.0[2][lane]) = (vector[0], vector[1], vector[2]);
    }
}

/// A block of axial terms.
struct AxialBlock {
    count: usize,
    terms: [u32; BLOCK],
    stiffnesses: [f32; BLOCK],
    parameters: [[f32; BLOCK]; 2],
    spans: BlockVectors,
    /// The changes of the spans.
    changes: BlockVectors,
    /// The forces of the terms, N.
    pulls: BlockVectors,
}

impl AxialBlock {
    const EMPTY: Self = Self {
        count: 0,
        terms: [0; BLOCK],
        stiffnesses: [0.0; BLOCK],
        parameters: [[0.0; BLOCK]; 2],
        spans: BlockVectors::ZERO,
        changes: BlockVectors::ZERO,
        pulls: BlockVectors::ZERO,
    };

    /// The parameters of a term.
    #[inline(always)]
    fn parameters(&self, lane: usize) -> [f32; 2] {
        [self.parameters[0][lane], self.parameters[1][lane]]
    }
}

/// The span of a term: the weighted sum of its nodes' vectors, read from records or axes.
#[inline(always)]
fn span<const RECORDS: bool, L: StencilLaw<N>, const N: usize>(
    stencil: &Stencil<L::Shape, N>,
    vectors: &View,
) -> [f32; 3] {
    let weights = L::weights(&stencil.shape);
    let first = padded_vector::<RECORDS>(vectors, stencil.nodes[0]);
    let mut span = Vec4::ZERO;
    for (&node, weight) in stencil.nodes.iter().zip(weights).skip(1) {
        span += (padded_vector::<RECORDS>(vectors, node) - first) * weight;
    }
    [span.x, span.y, span.z]
}

/// The vector of a node, padded so that it takes one load and one sum.
#[inline(always)]
fn padded_vector<const RECORDS: bool>(vectors: &View, node: u32) -> Vec4 {
    if RECORDS {
        Vec4::from_array(vectors.records()[node as usize].0)
    } else {
        vectors.get(node as usize).extend(0.0)
    }
}

#[inline(always)]
fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The length, inverse length and direction of a span; along x if its length is 0.
#[inline(always)]
fn length_and_direction(span: [f32; 3]) -> (f32, f32, [f32; 3]) {
    let length = dot(span, span).sqrt();
    let (inverse, along_x) = if length > 0.0 { (1.0 / length, 0.0) } else { (0.0, 1.0) };
    (
        length,
        inverse,
        [span[0] * inverse + along_x, span[1] * inverse, span[2] * inverse],
    )
}

impl<L: StencilLaw<N>, const N: usize> TileAxialTerms<'_, L, N> {
    #[inline(always)]
    fn gather<const RECORDS: bool>(&self, indices: &mut impl Iterator<Item = usize>, block: &mut AxialBlock) {
        let mut count = 0;
        while count < BLOCK
            && let Some(index) = indices.next()
        {
            block.terms[count] = index as u32;
            count += usize::from(self.all[index].stiffness > 0.0);
        }
        for lane in 0..count {
            let stencil = &self.all[block.terms[lane] as usize];
            block.stiffnesses[lane] = stencil.stiffness;
            let parameters = L::parameters(&stencil.shape);
            (block.parameters[0][lane], block.parameters[1][lane]) = (parameters[0], parameters[1]);
            block.spans.set(lane, span::<RECORDS, L, N>(stencil, &self.positions));
            if let Some(displacements) = &self.displacements {
                block.changes.set(lane, span::<RECORDS, L, N>(stencil, displacements));
            }
        }
        block.count = count;
    }

    /// Computes the forces. Returns the largest stiffness ratio as bits, whose order is that of the numbers.
    #[inline(always)]
    fn find_forces(&self, block: &mut AxialBlock) -> u32 {
        let mut stiffest = 0;
        for lane in 0..BLOCK {
            let (length, _, direction) = length_and_direction(block.spans.get(lane));
            let response = self.law.response(block.parameters(lane), length);
            let pull = block.stiffnesses[lane] * response.pull;
            block
                .pulls
                .set(lane, [pull * direction[0], pull * direction[1], pull * direction[2]]);
            stiffest = stiffest.max(response.stiffening.to_bits());
        }
        stiffest
    }

    #[inline(always)]
    fn find_changes(&self, block: &mut AxialBlock) {
        for lane in 0..BLOCK {
            let (length, inverse, direction) = length_and_direction(block.spans.get(lane));
            let response = self.law.response(block.parameters(lane), length);
            let across = response.transverse * inverse;
            let change = block.changes.get(lane);
            let along = (response.slope - across) * dot(direction, change);
            let stiffness = block.stiffnesses[lane];
            let pull = [
                stiffness * (along * direction[0] + across * change[0]),
                stiffness * (along * direction[1] + across * change[1]),
                stiffness * (along * direction[2] + across * change[2]),
            ];
            block.pulls.set(lane, pull);
        }
    }

    /// Adds the pulls to the nodes. Nodes of other tiles share one slot, which is ignored.
    #[inline(always)]
    fn scatter(&self, block: &AxialBlock, sums: &mut [Vec4; TILE + 1]) {
        for start in 0..STRIDE {
            for lane in (start..block.count).step_by(STRIDE) {
                let stencil = &self.all[block.terms[lane] as usize];
                let [x, y, z] = block.pulls.get(lane);
                let pull = Vec4::new(x, y, z, 0.0);
                for (&node, weight) in stencil.nodes.iter().zip(L::weights(&stencil.shape)) {
                    let index = (node as usize).wrapping_sub(self.nodes.start).min(TILE);
                    sums[index] -= pull * weight;
                }
            }
        }
    }

    #[inline(always)]
    fn add<const RECORDS: bool>(&self, sums: &mut [Vec4; TILE + 1]) -> f64 {
        let mut block = AxialBlock::EMPTY;
        let mut stiffest = 1.0_f32.to_bits();
        let others = self.visitors.iter().chain(self.cut_terms);
        let mut indices = self.owned.clone().chain(others.map(|&index| index as usize));
        loop {
            self.gather::<RECORDS>(&mut indices, &mut block);
            if block.count == 0 {
                return f64::from(f32::from_bits(stiffest));
            }
            if self.displacements.is_some() {
                self.find_changes(&mut block);
            } else {
                stiffest = stiffest.max(self.find_forces(&mut block));
            }
            self.scatter(&block, sums);
        }
    }
}

impl<L: StencilLaw<N>, const N: usize> Loops for TileAxialTerms<'_, L, N> {
    /// The largest ratio of a stiffness to the one that its rate assumes, at least 1.
    type Output = f64;

    #[inline(always)]
    fn run(self) -> f64 {
        let mut sums = [Vec4::ZERO; TILE + 1];
        let stiffening = if self.positions.has_records()
            && self
                .displacements
                .is_none_or(|displacements| displacements.has_records())
        {
            self.add::<true>(&mut sums)
        } else {
            self.add::<false>(&mut sums)
        };
        for (axis, forces) in self.sums.axes_mut().into_iter().enumerate() {
            for (force, sum) in forces.iter_mut().zip(&sums) {
                *force += sum[axis];
            }
        }
        stiffening
    }
}

/// Advances the internal variables of axial terms to the current positions.
pub(super) struct HistoryUpdate<'a, L: StencilLaw<N>, const N: usize> {
    pub law: &'a L,
    pub terms: &'a mut [Stencil<L::Shape, N>],
    pub positions: View<'a>,
    pub relaxation: RelaxationStep,
}

impl<L: StencilLaw<N>, const N: usize> Loops for HistoryUpdate<'_, L, N> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let (mut block, mut elastic) = (AxialBlock::EMPTY, [0.0; BLOCK]);
        for terms in self.terms.chunks_mut(BLOCK) {
            for (lane, stencil) in terms.iter().enumerate() {
                let parameters = L::parameters(&stencil.shape);
                (block.parameters[0][lane], block.parameters[1][lane]) = (parameters[0], parameters[1]);
                block.spans.set(lane, span::<false, L, N>(stencil, &self.positions));
            }
            for (lane, elastic) in elastic.iter_mut().enumerate() {
                let (length, ..) = length_and_direction(block.spans.get(lane));
                *elastic = self.law.elastic(block.parameters(lane), length);
            }
            for (stencil, &elastic) in terms.iter_mut().zip(&elastic) {
                self.law.advance(&mut stencil.shape, elastic, self.relaxation);
            }
        }
    }
}
