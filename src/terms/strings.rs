//! Strings: terms that pull along one vector, a weighted sum of their nodes' places, worked out side by side in `f32`.
//!
//! Blocks of them are gathered, worked out in plain loops that are compiled for each kind of processor, and added up. Nothing is fused
//! or estimated, so that every kernel gives the same bits.

use std::ops::Range;

use super::stencils::{Law, Stencil};
use crate::body::{Record, View};
use crate::material::Course;
use crate::springs::{Loops, TILE, TileForces};

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
pub(super) struct OfTile<'a, L: Law<N>, const N: usize> {
    pub law: &'a L,
    pub all: &'a [Stencil<L::Shape, N>],
    /// Those that begin in it, and those that only end in it.
    pub beginning: Range<usize>,
    pub visitors: &'a [u32],
    pub nodes: Range<usize>,
    pub positions: View<'a>,
    /// Given where changes are wanted of the forces, not the forces.
    pub ways: Option<View<'a>>,
    pub sums: &'a mut TileForces,
}

/// Some strings side by side.
struct Block {
    count: usize,
    strings: [u32; BLOCK],
    stiffnesses: [f32; BLOCK],
    numbers: [[f32; BLOCK]; 2],
    lines: [Record; BLOCK],
    /// How lines change.
    changes: [Record; BLOCK],
    /// What strings pull with, N.
    pulls: [Record; BLOCK],
}

impl Block {
    const EMPTY: Self = Self {
        count: 0,
        strings: [0; BLOCK],
        stiffnesses: [0.0; BLOCK],
        numbers: [[0.0; BLOCK]; 2],
        lines: [Record([0.0; 4]); BLOCK],
        changes: [Record([0.0; 4]); BLOCK],
        pulls: [Record([0.0; 4]); BLOCK],
    };

    #[inline(always)]
    fn line(&self, lane: usize) -> [f32; 3] {
        let [x, y, z, _] = self.lines[lane].0;
        [x, y, z]
    }

    /// The numbers of a string.
    #[inline(always)]
    fn numbers(&self, lane: usize) -> [f32; 2] {
        self.numbers.map(|numbers| numbers[lane])
    }
}

/// The vector of a string, given what its nodes have.
#[inline(always)]
fn line<L: Law<N>, const N: usize>(stencil: &Stencil<L::Shape, N>, of: &View) -> Record {
    let weights = L::weights(&stencil.shape);
    let Record(first) = of.record(stencil.nodes[0] as usize);
    let mut line = [0.0; 4];
    for (&node, weight) in stencil.nodes.iter().zip(weights).skip(1) {
        let Record(other) = of.record(node as usize);
        for (line, (other, first)) in line.iter_mut().zip(other.into_iter().zip(first)) {
            *line += weight * (other - first);
        }
    }
    Record(line)
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

impl<L: Law<N>, const N: usize> OfTile<'_, L, N> {
    #[inline(always)]
    fn gather(&self, indices: impl Iterator<Item = usize>, block: &mut Block) {
        block.count = 0;
        for index in indices {
            let stencil = &self.all[index];
            let lane = block.count;
            if !(stencil.stiffness > 0.0 && lane < BLOCK) {
                continue;
            }
            block.strings[lane] = index as u32;
            block.stiffnesses[lane] = stencil.stiffness;
            let numbers = L::numbers(&stencil.shape);
            (block.numbers[0][lane], block.numbers[1][lane]) = (numbers[0], numbers[1]);
            block.lines[lane] = line::<L, N>(stencil, &self.positions);
            if let Some(ways) = &self.ways {
                block.changes[lane] = line::<L, N>(stencil, ways);
            }
            block.count += 1;
        }
    }

    /// By how much the stiffest is stiffer than its rate says, as bits, whose order is that of the numbers.
    #[inline(always)]
    fn find_forces(&self, block: &mut Block) -> u32 {
        let mut stiffest = 0;
        for lane in 0..BLOCK {
            let (length, _, direction) = measured(block.line(lane));
            let tension = self.law.tension(block.numbers(lane), length);
            let pull = block.stiffnesses[lane] * tension.pull;
            block.pulls[lane] = Record([pull * direction[0], pull * direction[1], pull * direction[2], 0.0]);
            stiffest = stiffest.max(tension.stiffening.to_bits());
        }
        stiffest
    }

    #[inline(always)]
    fn find_changes(&self, block: &mut Block) {
        for lane in 0..BLOCK {
            let (length, inverse, direction) = measured(block.line(lane));
            let tension = self.law.tension(block.numbers(lane), length);
            let across = tension.sideways * inverse;
            let [x, y, z, _] = block.changes[lane].0;
            let along = (tension.slope - across) * dot(direction, [x, y, z]);
            let stiffness = block.stiffnesses[lane];
            block.pulls[lane] = Record([
                stiffness * (along * direction[0] + across * x),
                stiffness * (along * direction[1] + across * y),
                stiffness * (along * direction[2] + across * z),
                0.0,
            ]);
        }
    }

    /// Gives pulls to nodes; those of other tiles have one place together.
    #[inline(always)]
    fn scatter(&self, block: &Block, sums: &mut [Record; TILE + 1]) {
        for start in 0..STRIDE {
            for lane in (start..block.count).step_by(STRIDE) {
                let stencil = &self.all[block.strings[lane] as usize];
                let Record(pull) = block.pulls[lane];
                for (&node, weight) in stencil.nodes.iter().zip(L::weights(&stencil.shape)) {
                    let place = (node as usize).wrapping_sub(self.nodes.start).min(TILE);
                    let Record(sum) = &mut sums[place];
                    for (sum, pull) in sum.iter_mut().zip(pull) {
                        *sum -= weight * pull;
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn take(&self, indices: impl Iterator<Item = usize>, block: &mut Block, sums: &mut [Record; TILE + 1]) -> u32 {
        self.gather(indices, block);
        let mut stiffest = 0;
        if self.ways.is_some() {
            self.find_changes(block);
        } else {
            stiffest = self.find_forces(block);
        }
        self.scatter(block, sums);
        stiffest
    }
}

impl<L: Law<N>, const N: usize> Loops for OfTile<'_, L, N> {
    /// By how much the stiffest is stiffer than its rate says, 1: not at all.
    type Output = f64;

    #[inline(always)]
    fn run(self) -> f64 {
        let (mut block, mut sums) = (Block::EMPTY, [Record::default(); TILE + 1]);
        let mut stiffest = 1.0_f32.to_bits();
        for start in self.beginning.clone().step_by(BLOCK) {
            let indices = start..self.beginning.end.min(start + BLOCK);
            stiffest = stiffest.max(self.take(indices, &mut block, &mut sums));
        }
        for visitors in self.visitors.chunks(BLOCK) {
            let indices = visitors.iter().map(|&index| index as usize);
            stiffest = stiffest.max(self.take(indices, &mut block, &mut sums));
        }
        for (axis, forces) in self.sums.axes_mut().into_iter().enumerate() {
            for (force, Record(sum)) in forces.iter_mut().zip(&sums) {
                *force += sum[axis];
            }
        }
        f64::from(f32::from_bits(stiffest))
    }
}

/// Makes strings remember where their nodes have come to.
pub(super) struct Aging<'a, L: Law<N>, const N: usize> {
    pub law: &'a L,
    pub strings: &'a mut [Stencil<L::Shape, N>],
    pub positions: View<'a>,
    pub course: Course,
}

impl<L: Law<N>, const N: usize> Loops for Aging<'_, L, N> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let (mut block, mut elastic) = (Block::EMPTY, [0.0; BLOCK]);
        for strings in self.strings.chunks_mut(BLOCK) {
            for (lane, stencil) in strings.iter().enumerate() {
                let numbers = L::numbers(&stencil.shape);
                (block.numbers[0][lane], block.numbers[1][lane]) = (numbers[0], numbers[1]);
                block.lines[lane] = line::<L, N>(stencil, &self.positions);
            }
            for (lane, elastic) in elastic.iter_mut().enumerate() {
                let (length, ..) = measured(block.line(lane));
                *elastic = self.law.elastic(block.numbers(lane), length);
            }
            for (stencil, &elastic) in strings.iter_mut().zip(&elastic) {
                self.law.age(&mut stencil.shape, elastic, self.course);
            }
        }
    }
}
