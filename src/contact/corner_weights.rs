//! The nodes that move a feature: its corners, or the nodes that its corners are bound to. Contact is detected on the
//! render surface and acts on these nodes.

use super::features::Feature;
use crate::nodes::Bindings;

/// Maximum number of nodes that move a feature. The corners of a render triangle are bound to nodes of one cell.
pub(crate) const MAX_FEATURE_NODES: usize = 4;

/// Weight of each node in each of three corners.
pub(super) type CornerWeights = [[f32; MAX_FEATURE_NODES]; 3];

/// The nodes that move a feature.
#[derive(Clone, Copy, Debug)]
pub(super) struct FeatureNodes {
    nodes: [u32; MAX_FEATURE_NODES],
    count: usize,
    /// `None` if the corners are nodes. Then they move the feature, in their order.
    pub corner_weights: Option<CornerWeights>,
}

impl FeatureNodes {
    /// Creates the nodes of a feature of a body with these bound points.
    pub fn new(feature: Feature, bindings: Option<&Bindings>) -> Self {
        let corners = feature.nodes();
        let mut feature_nodes = Self {
            nodes: [0; MAX_FEATURE_NODES],
            count: corners.len(),
            corner_weights: None,
        };
        match bindings {
            Some(bindings) if corners.iter().any(|&corner| bindings.get(corner).is_some()) => {
                feature_nodes.bind(corners, bindings);
            }
            _ => feature_nodes.nodes[..corners.len()].copy_from_slice(corners),
        }
        feature_nodes
    }

    fn bind(&mut self, corners: &[u32], bindings: &Bindings) {
        let mut corner_weights = CornerWeights::default();
        self.count = 0;
        for (node_weights, &corner) in corner_weights.iter_mut().zip(corners) {
            for (node, weight) in bindings.weighted_nodes(corner) {
                let existing = self.nodes().iter().position(|&other| other == node);
                let index = existing.unwrap_or_else(|| {
                    debug_assert!(
                        self.count < MAX_FEATURE_NODES,
                        "corners of one triangle are bound to more than one cell"
                    );
                    // The last entry absorbs further nodes, so that no impulse is lost.
                    let index = self.count.min(MAX_FEATURE_NODES - 1);
                    self.nodes[index] = node;
                    self.count = index + 1;
                    index
                });
                node_weights[index] += weight;
            }
        }
        self.corner_weights = Some(corner_weights);
    }

    pub fn nodes(&self) -> &[u32] {
        &self.nodes[..self.count]
    }

    /// Fraction of an impulse at the point with these corner weights that each node receives. The sums of both are
    /// equal.
    pub fn shares(&self, weights: [f32; 3]) -> [f32; MAX_FEATURE_NODES] {
        let Some(corner_weights) = &self.corner_weights else {
            let [a, b, c] = weights;
            return [a, b, c, 0.0];
        };
        let mut shares = [0.0; MAX_FEATURE_NODES];
        for (node_weights, weight) in corner_weights.iter().zip(weights) {
            for (share, part) in shares.iter_mut().zip(node_weights) {
                *share += part * weight;
            }
        }
        shares
    }
}
