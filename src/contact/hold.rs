//! A contact as the equation of a step sees it.

use glam::DVec3;

use super::gauge::{Gauge, Meets};
use super::holds::STIFFER;
use super::supports::{MOST, Ties};
use crate::codec::saved;

/// A contact as the equation sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hold {
    /// The nodes that move the feature.
    pub nodes: [u32; MOST],
    pub count: usize,
    pub corner_count: usize,
    pub ties: Option<Ties>,
    /// Where its corners are without a push, m.
    pub free: [DVec3; 3],
    pub gauge: Gauge,
    /// The gap is at least this, m: below 0 where it began inside.
    pub least: f64,
    /// N/m
    pub stiffness: f64,
    /// N
    pub multiplier: f64,
    /// What part of its force becomes its multiplier: less than 1 where it gives way, as what holds nodes leaves them no way out.
    pub kept: f64,
    /// Whether it may pull: where it pushed before, the first solution takes it for one that goes on, though a node that were left
    /// alone might go away from the tool for once.
    pub holds_on: bool,
    /// Whether it pushed in the last equation.
    pub lasts: bool,
    /// What acts on the tissue with the nodes where they were last.
    pub answer: Answer,
    /// Whether it pushed when it was last asked.
    pub pushed: bool,
    /// The friction of its nodes.
    pub grips: [Option<usize>; MOST],
}

saved! { Hold {
    nodes, count, corner_count, ties, free, gauge, least, stiffness, multiplier, kept, holds_on, lasts, answer, pushed,
    grips,
} }

/// What a contact does.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Answer {
    pub meets: Meets,
    /// Along the normal, N.
    pub force: f64,
    /// What of it acts on each node.
    pub shares: [f64; MOST],
    /// How it falls as each node goes along the normal, for each that goes, N/m.
    pub stiffness: [[f64; MOST]; MOST],
}

saved! { Answer { meets, force, shares, stiffness } }

impl Hold {
    /// What it does with these pushes of the nodes, m.
    pub fn answer_to(&self, push_of: impl Fn(usize) -> DVec3) -> Answer {
        let mut corners = self.free;
        for (corner, push) in corners.iter_mut().zip(self.corner_vectors(push_of)) {
            *corner += push;
        }
        let meets = self.gauge.meet(&corners[..self.corner_count]);
        let mut force = self.multiplier + self.stiffness * (self.least - meets.gap);
        if !self.holds_on {
            force = force.max(0.0);
        }
        let shares = self.shared(meets.weights);
        let mut stiffness = [[0.0; MOST]; MOST];
        if force != 0.0 {
            let tilts = self.shared(meets.tilts.map(|row| self.shared(row)));
            for (row, entries) in stiffness.iter_mut().enumerate() {
                for (column, entry) in entries.iter_mut().enumerate() {
                    *entry = self.stiffness * shares[row] * shares[column] + force.max(0.0) * tilts[row][column];
                }
            }
        }
        Answer {
            meets,
            force,
            shares,
            stiffness,
        }
    }

    /// How much more it would do with a better multiplier, N.
    pub fn missing(&self, push_of: impl Fn(usize) -> DVec3) -> f64 {
        let better = Self {
            multiplier: self.kept * self.answer.force,
            ..*self
        };
        better.answer_to(push_of).force - self.answer.force
    }

    /// What holds its nodes beside it, N/m, where its constraint is so firm.
    pub fn resistance(&self, firmness: f32) -> f64 {
        self.stiffness / f64::from(STIFFER * firmness)
    }

    /// The vectors of its corners, which those of its nodes make.
    pub fn corners(&self, vectors: [DVec3; MOST]) -> [DVec3; 3] {
        let [a, b, c, _] = vectors;
        let Some(ties) = &self.ties else {
            return [a, b, c];
        };
        ties.map(|tie| {
            let parts = vectors.iter().zip(tie);
            parts.map(|(&vector, part)| vector * f64::from(part)).sum()
        })
    }

    pub fn corner_vectors(&self, vector_of: impl Fn(usize) -> DVec3) -> [DVec3; 3] {
        let mut vectors = [DVec3::ZERO; MOST];
        for (vector, &node) in vectors.iter_mut().zip(&self.nodes).take(self.count) {
            *vector = vector_of(node as usize);
        }
        self.corners(vectors)
    }

    /// What its nodes have of what its corners have.
    fn shared<T: Spread>(&self, of_corners: [T; 3]) -> [T; MOST] {
        let Some(ties) = &self.ties else {
            let [a, b, c] = of_corners;
            return [a, b, c, T::default()];
        };
        let mut shared = [T::default(); MOST];
        for (tie, of_corner) in ties.iter().zip(of_corners) {
            for (sum, &part) in shared.iter_mut().zip(tie) {
                sum.add(of_corner, f64::from(part));
            }
        }
        shared
    }

    /// The matter's part along the normal.
    pub fn weighted(&self, vector_of: impl Fn(usize) -> DVec3) -> f64 {
        let nodes = self.nodes.iter().zip(self.answer.shares).take(self.count);
        let sum: DVec3 = nodes.map(|(&node, share)| vector_of(node as usize) * share).sum();
        sum.dot(self.answer.meets.normal)
    }

    /// The product of its stiffness with the vectors, for each of its nodes along the normal.
    pub fn products(&self, vector_of: impl Fn(usize) -> DVec3) -> [f64; MOST] {
        let mut products = [0.0; MOST];
        for (place, &node) in self.nodes.iter().enumerate().take(self.count) {
            let along = vector_of(node as usize).dot(self.answer.meets.normal);
            for (product, row) in products.iter_mut().zip(&self.answer.stiffness) {
                *product += row[place] * along;
            }
        }
        products
    }

    pub fn share_out(&self, answer: &Answer, force: f64, add: &mut impl FnMut(usize, DVec3)) {
        for (&node, share) in self.nodes.iter().zip(answer.shares).take(self.count) {
            if share > 0.0 && force != 0.0 {
                add(node as usize, answer.meets.normal * (force * share));
            }
        }
    }
}

/// What corners share out to their nodes.
trait Spread: Copy + Default {
    fn add(&mut self, other: Self, part: f64);
}

impl Spread for f64 {
    fn add(&mut self, other: Self, part: f64) {
        *self += other * part;
    }
}

impl Spread for [f64; MOST] {
    fn add(&mut self, other: Self, part: f64) {
        for (sum, other) in self.iter_mut().zip(other) {
            *sum += other * part;
        }
    }
}
