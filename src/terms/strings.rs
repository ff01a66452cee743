//! Strings: terms that pull along one vector, a weighted sum of their nodes' places, worked out side by side in `f32`.
//!
//! Blocks of them are gathered, worked out in plain loops that are compiled for each kind of processor, and added up. Nothing is fused
//! or estimated, so that every kernel gives the same bits.

use std::ops::Range;

use glam::Vec4;

use super::stencils::{Stencil, StencilLaw};
use crate::def::RelaxationStep;
use crate::simd::Loops;
use crate::soa::{TILE, TileForces, View};

/// How many are worked out side by side.
const BLOCK: usize = 64;

/// Strings that follow each other share their first node: it is given theirs with so many others between, or each sum would wait for
/// the one before.
const STRIDE: usize = 16;

/// What a string does whose stiffness is 1, by its length.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Tension {
    pub pull: f32,
    /// How the pull grows with the length.
    pub slope: f32,
    /// The part of the pull that counts against ways across the string.
    pub sideways: f32,
    /// By how much it is stiffer than its rate says, 1: not at all.
    pub stiffening: f32,
}

/// The strings that have a node of a tile.
pub(super) struct OfTile<'a, L: StencilLaw<N>, const N: usize> {
    pub law: &'a L,
    pub all: &'a [Stencil<L::Shape, N>],
    /// Those that begin in it, and those that only end in it.
    pub beginning: Range<usize>,
    pub visitors: &'a [u32],
    /// Those of cuts that do either.
    pub later: &'a [u32],
    pub nodes: Range<usize>,
    pub positions: View<'a>,
    /// Given where changes are wanted of the forces, not the forces.
    pub ways: Option<View<'a>>,
    pub sums: &'a mut TileForces,
}

/// A vector for each of them, by axes.
struct StringVectors([[f32; BLOCK]; 3]);

impl StringVectors {
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

/// Some strings side by side.
struct Block {
    count: usize,
    strings: [u32; BLOCK],
    stiffnesses: [f32; BLOCK],
    numbers: [[f32; BLOCK]; 2],
    lines: StringVectors,
    /// How lines change.
    changes: StringVectors,
    /// What strings pull with, N.
    pulls: StringVectors,
}

impl Block {
    const EMPTY: Self = Self {
        count: 0,
        strings: [0; BLOCK],
        stiffnesses: [0.0; BLOCK],
        numbers: [[0.0; BLOCK]; 2],
        lines: StringVectors::ZERO,
        changes: StringVectors::ZERO,
        pulls: StringVectors::ZERO,
    };

    /// The numbers of a string.
    #[inline(always)]
    fn numbers(&self, lane: usize) -> [f32; 2] {
        [self.numbers[0][lane], self.numbers[1][lane]]
    }
}

/// The vector of a string, given what its nodes have; as records or not.
#[inline(always)]
fn line<const RECORDS: bool, L: StencilLaw<N>, const N: usize>(stencil: &Stencil<L::Shape, N>, of: &View) -> [f32; 3] {
    let weights = L::weights(&stencil.shape);
    let first = four::<RECORDS>(of, stencil.nodes[0]);
    let mut line = Vec4::ZERO;
    for (&node, weight) in stencil.nodes.iter().zip(weights).skip(1) {
        line += (four::<RECORDS>(of, node) - first) * weight;
    }
    [line.x, line.y, line.z]
}

/// What a node has: four numbers are one load and one sum.
#[inline(always)]
fn four<const RECORDS: bool>(of: &View, node: u32) -> Vec4 {
    if RECORDS {
        Vec4::from_array(of.records()[node as usize].0)
    } else {
        of.get(node as usize).extend(0.0)
    }
}

#[inline(always)]
fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The length of a line, 1 over it, and where it points: along x where it has no length.
#[inline(always)]
fn measured(line: [f32; 3]) -> (f32, f32, [f32; 3]) {
    let length = dot(line, line).sqrt();
    let (inverse, along_x) = if length > 0.0 { (1.0 / length, 0.0) } else { (0.0, 1.0) };
    (
        length,
        inverse,
        [line[0] * inverse + along_x, line[1] * inverse, line[2] * inverse],
    )
}

impl<L: StencilLaw<N>, const N: usize> OfTile<'_, L, N> {
    #[inline(always)]
    fn gather<const RECORDS: bool>(&self, indices: &mut impl Iterator<Item = usize>, block: &mut Block) {
        let mut count = 0;
        while count < BLOCK
            && let Some(index) = indices.next()
        {
            block.strings[count] = index as u32;
            count += usize::from(self.all[index].stiffness > 0.0);
        }
        for lane in 0..count {
            let stencil = &self.all[block.strings[lane] as usize];
            block.stiffnesses[lane] = stencil.stiffness;
            let numbers = L::numbers(&stencil.shape);
            (block.numbers[0][lane], block.numbers[1][lane]) = (numbers[0], numbers[1]);
            block.lines.set(lane, line::<RECORDS, L, N>(stencil, &self.positions));
            if let Some(ways) = &self.ways {
                block.changes.set(lane, line::<RECORDS, L, N>(stencil, ways));
            }
        }
        block.count = count;
    }

    /// By how much the stiffest is stiffer than its rate says, as bits, whose order is that of the numbers.
    #[inline(always)]
    fn find_forces(&self, block: &mut Block) -> u32 {
        let mut stiffest = 0;
        for lane in 0..BLOCK {
            let (length, _, direction) = measured(block.lines.get(lane));
            let tension = self.law.tension(block.numbers(lane), length);
            let pull = block.stiffnesses[lane] * tension.pull;
            block
                .pulls
                .set(lane, [pull * direction[0], pull * direction[1], pull * direction[2]]);
            stiffest = stiffest.max(tension.stiffening.to_bits());
        }
        stiffest
    }

    #[inline(always)]
    fn find_changes(&self, block: &mut Block) {
        for lane in 0..BLOCK {
            let (length, inverse, direction) = measured(block.lines.get(lane));
            let tension = self.law.tension(block.numbers(lane), length);
            let across = tension.sideways * inverse;
            let change = block.changes.get(lane);
            let along = (tension.slope - across) * dot(direction, change);
            let stiffness = block.stiffnesses[lane];
            let pull = [
                stiffness * (along * direction[0] + across * change[0]),
                stiffness * (along * direction[1] + across * change[1]),
                stiffness * (along * direction[2] + across * change[2]),
            ];
            block.pulls.set(lane, pull);
        }
    }

    /// Gives pulls to nodes; those of other tiles have one place together.
    #[inline(always)]
    fn scatter(&self, block: &Block, sums: &mut [Vec4; TILE + 1]) {
        for start in 0..STRIDE {
            for lane in (start..block.count).step_by(STRIDE) {
                let stencil = &self.all[block.strings[lane] as usize];
                let [x, y, z] = block.pulls.get(lane);
                let pull = Vec4::new(x, y, z, 0.0);
                for (&node, weight) in stencil.nodes.iter().zip(L::weights(&stencil.shape)) {
                    let place = (node as usize).wrapping_sub(self.nodes.start).min(TILE);
                    sums[place] -= pull * weight;
                }
            }
        }
    }

    #[inline(always)]
    fn add<const RECORDS: bool>(&self, sums: &mut [Vec4; TILE + 1]) -> f64 {
        let mut block = Block::EMPTY;
        let mut stiffest = 1.0_f32.to_bits();
        let others = self.visitors.iter().chain(self.later);
        let mut indices = self.beginning.clone().chain(others.map(|&index| index as usize));
        loop {
            self.gather::<RECORDS>(&mut indices, &mut block);
            if block.count == 0 {
                return f64::from(f32::from_bits(stiffest));
            }
            if self.ways.is_some() {
                self.find_changes(&mut block);
            } else {
                stiffest = stiffest.max(self.find_forces(&mut block));
            }
            self.scatter(&block, sums);
        }
    }
}

impl<L: StencilLaw<N>, const N: usize> Loops for OfTile<'_, L, N> {
    /// By how much the stiffest is stiffer than its rate says, 1: not at all.
    type Output = f64;

    #[inline(always)]
    fn run(self) -> f64 {
        let mut sums = [Vec4::ZERO; TILE + 1];
        let stiffening = if self.positions.has_records() && self.ways.is_none_or(|ways| ways.has_records()) {
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

/// Makes strings remember where their nodes have come to.
pub(super) struct Aging<'a, L: StencilLaw<N>, const N: usize> {
    pub law: &'a L,
    pub strings: &'a mut [Stencil<L::Shape, N>],
    pub positions: View<'a>,
    pub course: RelaxationStep,
}

impl<L: StencilLaw<N>, const N: usize> Loops for Aging<'_, L, N> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let (mut block, mut elastic) = (Block::EMPTY, [0.0; BLOCK]);
        for strings in self.strings.chunks_mut(BLOCK) {
            for (lane, stencil) in strings.iter().enumerate() {
                let numbers = L::numbers(&stencil.shape);
                (block.numbers[0][lane], block.numbers[1][lane]) = (numbers[0], numbers[1]);
                block.lines.set(lane, line::<false, L, N>(stencil, &self.positions));
            }
            for (lane, elastic) in elastic.iter_mut().enumerate() {
                let (length, ..) = measured(block.lines.get(lane));
                *elastic = self.law.elastic(block.numbers(lane), length);
            }
            for (stencil, &elastic) in strings.iter_mut().zip(&elastic) {
                self.law.age(&mut stencil.shape, elastic, self.course);
            }
        }
    }
}
