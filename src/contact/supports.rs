//! The nodes that move a feature: its corners, or what those are bound to. A feature is met where it is drawn, and what the contact does
//! acts on its nodes.

use super::features::Feature;
use crate::nodes::Bindings;

/// So many nodes move a feature at most: the corners of a drawn triangle are bound to nodes of one cell.
pub(crate) const MOST: usize = 4;

/// What each node has in each of three corners.
pub(super) type Ties = [[f32; MOST]; 3];

/// The nodes that move a feature.
#[derive(Clone, Copy, Debug)]
pub(super) struct Supports {
    nodes: [u32; MOST],
    count: usize,
    /// `None` where its corners are nodes: then those move it, in their order.
    pub ties: Option<Ties>,
}

impl Supports {
    /// Of a feature of a body with such points.
    pub fn of(feature: Feature, bindings: Option<&Bindings>) -> Self {
        let corners = feature.nodes();
        let mut supports = Self {
            nodes: [0; MOST],
            count: corners.len(),
            ties: None,
        };
        match bindings {
            Some(bindings) if corners.iter().any(|&corner| bindings.get(corner).is_some()) => {
                supports.tie(corners, bindings);
            }
            _ => supports.nodes[..corners.len()].copy_from_slice(corners),
        }
        supports
    }

    fn tie(&mut self, corners: &[u32], bindings: &Bindings) {
        let mut ties = Ties::default();
        self.count = 0;
        for (tie, &corner) in ties.iter_mut().zip(corners) {
            for (node, weight) in bindings.parts(corner) {
                let known = self.nodes().iter().position(|&known| known == node);
                let place = known.unwrap_or_else(|| {
                    debug_assert!(
                        self.count < MOST,
                        "corners of one triangle are bound to more than one cell"
                    );
                    // No impulse is lost in any case.
                    let place = self.count.min(MOST - 1);
                    self.nodes[place] = node;
                    self.count = place + 1;
                    place
                });
                tie[place] += weight;
            }
        }
        self.ties = Some(ties);
    }

    pub fn nodes(&self) -> &[u32] {
        &self.nodes[..self.count]
    }

    /// What of an impulse each node receives that acts at the point of these weights of the corners; 1 in sum as those.
    pub fn shares(&self, weights: [f32; 3]) -> [f32; MOST] {
        let Some(ties) = &self.ties else {
            let [a, b, c] = weights;
            return [a, b, c, 0.0];
        };
        let mut shares = [0.0; MOST];
        for (tie, weight) in ties.iter().zip(weights) {
            for (share, part) in shares.iter_mut().zip(tie) {
                *share += part * weight;
            }
        }
        shares
    }
}
