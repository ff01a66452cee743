//! Contacts within an equation that is solved: what springs do against a tool belongs to it, or a step would let them push
//! tissue into the tool first and only then have it stopped, with too small a force.
//!
//! An augmented Lagrangian (Hestenes 1969, Powell 1969): each contact pushes with a multiplier and a stiffness, and never pulls;
//! what it has come to do becomes its multiplier. As long as multipliers stay there is a convex function to minimise. Friction, and
//! what is left of a penetration, is a matter of contact's own impulses.

use std::ops::Range;

use glam::{DVec3, Vec3};

use super::constraint::Constraint;
use crate::error::Result;

/// How much stiffer a contact is than its nodes.
const STIFFER: f32 = 100.0;

/// A contact as the equation sees it.
#[derive(Clone, Copy, Debug)]
struct Hold {
    nodes: [u32; 3],
    /// 0 for corners that it does not have.
    weights: [f32; 3],
    normal: DVec3,
    /// The matter's way along the normal is at least this, m.
    least: f64,
    /// N/m
    stiffness: f64,
    /// N
    multiplier: f64,
    /// The matter's way along the normal without a push, m.
    free_way: f64,
    /// What acts on the tissue with the nodes where they were last.
    answer: Answer,
}

/// What a contact does.
#[derive(Clone, Copy, Debug, Default)]
struct Answer {
    /// Along the normal, N.
    force: f64,
    /// N/m
    stiffness: f64,
}

/// The part of a node in a hold.
#[derive(Clone, Copy, Debug)]
struct Share {
    node: u32,
    hold: u32,
    weight: f32,
}

/// The contacts of a body with all tools in the equation in progress.
#[derive(Debug, Default)]
pub(crate) struct Holds {
    holds: Vec<Hold>,
    /// In the order of nodes.
    shares: Vec<Share>,
}

impl Holds {
    /// Makes room for so many contacts.
    pub fn reserve(&mut self, count: usize) -> Result<()> {
        self.holds.try_reserve(count.saturating_sub(self.holds.len()))?;
        let shares = 3 * count;
        Ok(self.shares.try_reserve(shares.saturating_sub(self.shares.len()))?)
    }

    pub fn is_empty(&self) -> bool {
        self.holds.is_empty()
    }

    pub fn clear(&mut self) {
        self.holds.clear();
        self.shares.clear();
    }

    /// Begins anew with these contacts over `duration` seconds, of nodes that are as stiff as `stiffness_of` tells, N/m; infinite
    /// where they are held. Without a push each node goes the way of `way_of`.
    pub(super) fn begin(
        &mut self,
        constraints: &[Constraint],
        duration: f32,
        stiffness_of: impl Fn(usize) -> f32,
        way_of: impl Fn(usize) -> Vec3,
    ) {
        self.clear();
        for constraint in constraints {
            let mut nodes = [0; 3];
            let mut weights = [0.0; 3];
            let mut softness = 0.0;
            for (corner, &node) in constraint.feature.nodes().iter().enumerate() {
                nodes[corner] = node;
                weights[corner] = constraint.weights[corner];
                softness += weights[corner] * weights[corner] / stiffness_of(node as usize);
                self.shares.push(Share {
                    node,
                    hold: self.holds.len() as u32,
                    weight: weights[corner],
                });
            }
            let stiffness = STIFFER / softness;
            let mut hold = Hold {
                nodes,
                weights,
                normal: constraint.normal.as_dvec3(),
                least: f64::from(constraint.least_speed() * duration),
                stiffness: if stiffness.is_finite() {
                    f64::from(stiffness)
                } else {
                    0.0
                },
                multiplier: 0.0,
                free_way: 0.0,
                answer: Answer::default(),
            };
            hold.free_way = hold.weighted(|node| way_of(node).as_dvec3());
            self.holds.push(hold);
        }
        self.shares.sort_unstable_by_key(|share| (share.node, share.hold));
    }

    /// Finds out what each contact does with these pushes of the nodes, m.
    pub fn press(&mut self, push_of: impl Fn(usize) -> DVec3) {
        for hold in &mut self.holds {
            hold.answer = hold.answer_to(hold.weighted(&push_of));
        }
    }

    /// How much more the contacts would do with better multipliers, as a part of what they do.
    pub fn missing(&self, push_of: impl Fn(usize) -> DVec3) -> f64 {
        let (mut missing, mut all) = (0.0, 0.0);
        for hold in &self.holds {
            let better = Hold {
                multiplier: hold.answer.force,
                ..*hold
            };
            let force = better.answer_to(hold.weighted(&push_of)).force;
            missing += (force - hold.answer.force).abs();
            all += hold.answer.force;
        }
        if missing > 0.0 { missing / all } else { 0.0 }
    }

    /// What the contacts do becomes their multiplier, with which they do more where something is missing: shows each node what
    /// is added there, N.
    pub fn improve(&mut self, push_of: impl Fn(usize) -> DVec3, mut add: impl FnMut(usize, DVec3)) {
        for hold in &mut self.holds {
            let before = hold.answer.force;
            hold.multiplier = before;
            hold.answer = hold.answer_to(hold.weighted(&push_of));
            hold.share_out(hold.answer.force - before, &mut add);
        }
    }

    /// What the residuals lack of balance along the contacts' normals, as a part of what those do.
    pub fn imbalance(&self, residual_of: impl Fn(usize) -> DVec3) -> f64 {
        let pressed = || self.holds.iter().filter(|hold| hold.answer.force > 0.0);
        let off: f64 = pressed().map(|hold| hold.weighted(&residual_of).abs()).sum();
        let all: f64 = pressed().map(|hold| hold.answer.force).sum();
        if all > 0.0 { off / all } else { 0.0 }
    }

    /// Whether a contact pushes.
    pub fn are_pressed(&self) -> bool {
        self.holds.iter().any(|hold| hold.answer.stiffness > 0.0)
    }

    /// Shows each node what acts on it with these pushes, N.
    pub fn show_forces(&self, push_of: impl Fn(usize) -> DVec3, mut add: impl FnMut(usize, DVec3)) {
        for hold in &self.holds {
            hold.share_out(hold.answer_to(hold.weighted(&push_of)).force, &mut add);
        }
    }

    /// Shows each node the product of the contacts' stiffness with the vectors.
    pub fn show_products(&self, vector_of: impl Fn(usize) -> DVec3, mut add: impl FnMut(usize, DVec3)) {
        for hold in self.holds.iter().filter(|hold| hold.answer.stiffness > 0.0) {
            hold.share_out(hold.answer.stiffness * hold.weighted(&vector_of), &mut add);
        }
    }

    /// Shows by how much the energy of each contact changes where the pushes grow by these vectors, J.
    pub fn show_changes(
        &self,
        push_of: impl Fn(usize) -> DVec3,
        vector_of: impl Fn(usize) -> DVec3,
        mut add: impl FnMut(f64),
    ) {
        for hold in &self.holds {
            let (push, more) = (hold.weighted(&push_of), hold.weighted(&vector_of));
            let [before, after] = [push, push + more].map(|push| hold.answer_to(push));
            // Where it pushes all along, nothing small is found as a difference of what is large.
            let both = before.stiffness * after.stiffness > 0.0;
            let growth = if both {
                -hold.stiffness * more
            } else {
                after.force - before.force
            };
            if growth != 0.0 {
                add(0.5 * growth * (before.force + after.force) / hold.stiffness);
            }
        }
    }

    /// Shows each node that is pressed, with the diagonal block of its contacts' stiffness: xx, yy, zz, yz, zx, xy.
    pub fn show_blocks(&self, mut see: impl FnMut(usize, [f64; 6])) {
        for shares in self.shares.chunk_by(|a, b| a.node == b.node) {
            let mut block = [0.0; 6];
            for share in shares {
                let Hold { normal: n, answer, .. } = self.holds[share.hold as usize];
                let more = n * (f64::from(share.weight * share.weight) * answer.stiffness);
                let entries = [
                    more.x * n.x,
                    more.y * n.y,
                    more.z * n.z,
                    more.y * n.z,
                    more.z * n.x,
                    more.x * n.y,
                ];
                for (entry, more) in block.iter_mut().zip(entries) {
                    *entry += more;
                }
            }
            if block[0] + block[1] + block[2] > 0.0 {
                see(shares[0].node as usize, block);
            }
        }
    }

    /// Adds what acts on these nodes with the nodes where they were last.
    pub fn add_forces(&self, nodes: &Range<usize>, to: &mut [&mut [f32]; 3]) {
        for share in self.shares_of(nodes) {
            let hold = &self.holds[share.hold as usize];
            let force = hold.normal * hold.answer.force * f64::from(share.weight);
            add(to, share.node as usize - nodes.start, force.as_vec3());
        }
    }

    /// Adds the product of the contacts' stiffness with `vector_of` each node to those of these nodes: the product of both.
    pub fn add_products(
        &self,
        nodes: &Range<usize>,
        vector_of: impl Fn(usize) -> Vec3,
        to: &mut [&mut [f32]; 3],
    ) -> f64 {
        let mut sum = 0.0;
        for share in self.shares_of(nodes) {
            let hold = &self.holds[share.hold as usize];
            if hold.answer.stiffness > 0.0 {
                let vector = hold.weighted(|node| vector_of(node).as_dvec3());
                let product = hold.normal * (hold.answer.stiffness * vector * f64::from(share.weight));
                let product = product.as_vec3();
                add(to, share.node as usize - nodes.start, product);
                sum += f64::from(product.dot(vector_of(share.node as usize)));
            }
        }
        sum
    }

    /// What the contacts do on the nodes' ways, J: none does more than on the way of its tool, or what an equation that was not
    /// solved has them push would pass for energy put in.
    pub fn work(&self, way_of: impl Fn(usize) -> Vec3) -> f64 {
        let way_of = |node: usize| way_of(node).as_dvec3();
        let work = |hold: &Hold| hold.answer.force * hold.weighted(way_of).min(hold.least);
        self.holds.iter().map(work).sum()
    }

    /// What contact number `index` does, N.
    pub(super) fn force(&self, index: usize) -> Vec3 {
        let hold = &self.holds[index];
        (hold.normal * hold.answer.force).as_vec3()
    }

    fn shares_of(&self, nodes: &Range<usize>) -> &[Share] {
        let place = |node: usize| self.shares.partition_point(|share| (share.node as usize) < node);
        &self.shares[place(nodes.start)..place(nodes.end)]
    }
}

impl Hold {
    /// What it does where its matter is pushed so far along the normal, m.
    fn answer_to(&self, push: f64) -> Answer {
        let force = (self.multiplier + self.stiffness * (self.least - self.free_way - push)).max(0.0);
        Answer {
            force,
            stiffness: if force > 0.0 { self.stiffness } else { 0.0 },
        }
    }

    /// The matter's part along the normal.
    fn weighted(&self, vector_of: impl Fn(usize) -> DVec3) -> f64 {
        let corners = self.nodes.iter().zip(self.weights);
        let sum: DVec3 = corners
            .map(|(&node, weight)| vector_of(node as usize) * f64::from(weight))
            .sum();
        sum.dot(self.normal)
    }

    fn share_out(&self, force: f64, add: &mut impl FnMut(usize, DVec3)) {
        for (&node, weight) in self.nodes.iter().zip(self.weights) {
            if weight > 0.0 && force != 0.0 {
                add(node as usize, self.normal * (force * f64::from(weight)));
            }
        }
    }
}

fn add(to: &mut [&mut [f32]; 3], place: usize, vector: Vec3) {
    for (axis, value) in to.iter_mut().zip(vector.to_array()) {
        axis[place] += value;
    }
}
