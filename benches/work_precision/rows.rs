//! Springs stored at each of their nodes, with one node per vector lane. The paper's Verlet and Projective Dynamics sum
//! their forces with them.
//!
//! Springs stored once, in colors, need stores to both ends: `xpbd.rs` does so and takes 6.4 ns per spring of the
//! organ, where this pass takes 4.2.

use crate::scene::Scene;
use crate::simd::{IndexList, Proof, Record, Vector, lanes};

/// Nodes are sorted by their number of springs within windows of this many nodes.
const WINDOW: usize = 512;
/// Lower bound of squared lengths [m²], so that coincident nodes give no force.
const LEAST: f32 = 1e-30;

/// The springs of blocks of nodes.
pub struct Rows {
    /// The node of each lane. Surplus lanes of the last block hold the index after the last node.
    pub nodes: IndexList,
    node_count: usize,
    /// Start of the columns of each block.
    first: Vec<usize>,
    neighbors: IndexList,
    stiffnesses: Vec<f32>,
    /// Stiffness times rest length.
    tensions: Vec<f32>,
}

impl Rows {
    /// The scene's springs with nodes renumbered by `ranks` and stiffnesses times `scale`.
    pub fn new(scene: &Scene, ranks: &[u32], scale: f32) -> Self {
        let count = scene.node_count();
        let mut links = vec![Vec::new(); count + 1];
        for (spring, pair) in scene.springs.iter().enumerate() {
            let [a, b] = pair.map(|node| ranks[node as usize]);
            let stiffness = scale * scene.stiffnesses[spring];
            let tension = stiffness * scene.rest_lengths[spring];
            links[a as usize].push((b, stiffness, tension));
            links[b as usize].push((a, stiffness, tension));
        }
        links.iter_mut().for_each(|links| links.sort_by_key(|link| link.0));
        let mut nodes: Vec<u32> = (0..count as u32).collect();
        for window in nodes.chunks_mut(WINDOW) {
            window.sort_by_key(|&node| std::cmp::Reverse(links[node as usize].len()));
        }
        let width = lanes();
        nodes.resize(count.next_multiple_of(width), count as u32);
        let mut first = vec![0];
        let mut neighbors = Vec::new();
        let mut stiffnesses = Vec::new();
        let mut tensions = Vec::new();
        for block in nodes.chunks(width) {
            let longest = block.iter().map(|&node| links[node as usize].len()).max().unwrap_or(0);
            for column in 0..longest {
                for &node in block {
                    // A node without further springs is joined to itself by a spring without stiffness.
                    let link = links[node as usize].get(column).copied().unwrap_or((node, 0.0, 0.0));
                    neighbors.push(link.0);
                    stiffnesses.push(link.1);
                    tensions.push(link.2);
                }
            }
            first.push(neighbors.len());
        }
        Self {
            nodes: IndexList::new(nodes),
            node_count: count,
            first,
            neighbors: IndexList::new(neighbors),
            stiffnesses,
            tensions,
        }
    }

    pub fn block_count(&self) -> usize {
        self.first.len() - 1
    }

    /// The value of each lane's node; 0 for surplus lanes.
    pub fn per_lane(&self, value: impl Fn(u32) -> f32) -> Vec<f32> {
        let lane = |&node: &u32| {
            if node as usize == self.node_count {
                0.0
            } else {
                value(node)
            }
        };
        self.nodes.as_slice().iter().map(lane).collect()
    }

    /// The spring forces on the nodes of a block at these positions.
    #[inline(always)]
    pub fn forces<V: Vector>(&self, proof: Proof<V>, block: usize, positions: &[Record], [x, y, z]: [V; 3]) -> [V; 3] {
        let least = V::splat(proof, LEAST);
        let mut sums = [V::splat(proof, 0.0); 3];
        let mut at = self.first[block];
        while at < self.first[block + 1] {
            let [other_x, other_y, other_z, _] = V::load_records(proof, positions, &self.neighbors, at, 0);
            let separation = [other_x - x, other_y - y, other_z - z];
            let square = separation[0].mul_add(
                separation[0],
                separation[1].mul_add(separation[1], separation[2] * separation[2]),
            );
            let stiffness = V::load(proof, &self.stiffnesses[at..]);
            let tension = V::load(proof, &self.tensions[at..]);
            // k (L - L0) / L
            let pull = stiffness - tension * square.max(least).inverse_root();
            for axis in 0..3 {
                sums[axis] = separation[axis].mul_add(pull, sums[axis]);
            }
            at += V::COUNT;
        }
        sums
    }
}
