//! Nested dissection ordering of nodes (George 1973) from coordinates: halves first, separators last. A factor in this
//! order has little fill-in, and neighbors are close in memory.

use glam::Vec3;

use crate::scene::Scene;

/// Sets of at most this many nodes are not divided.
const LEAF: usize = 24;

/// The nodes in their new order, pinned ones last.
pub fn order(scene: &Scene) -> Vec<u32> {
    let mut dissection = Dissection {
        positions: &scene.positions,
        neighbors: neighbors(scene),
        second_half: vec![false; scene.node_count()],
        order: Vec::new(),
    };
    let (pinned, free): (Vec<u32>, Vec<u32>) =
        (0..scene.node_count() as u32).partition(|&node| scene.is_pinned(node as usize));
    dissection.divide(free);
    let mut order = dissection.order;
    order.extend(pinned);
    order
}

/// The rank of each node in the order (the inverse permutation).
pub fn ranks(order: &[u32]) -> Vec<u32> {
    let mut ranks = vec![0; order.len()];
    for (rank, &node) in (0..).zip(order) {
        ranks[node as usize] = rank;
    }
    ranks
}

/// The nodes that springs join to each node.
pub fn neighbors(scene: &Scene) -> Vec<Vec<u32>> {
    let mut neighbors = vec![Vec::new(); scene.node_count()];
    for &[a, b] in &scene.springs {
        neighbors[a as usize].push(b);
        neighbors[b as usize].push(a);
    }
    neighbors
}

struct Dissection<'a> {
    positions: &'a [Vec3],
    neighbors: Vec<Vec<u32>>,
    second_half: Vec<bool>,
    order: Vec<u32>,
}

impl Dissection<'_> {
    fn divide(&mut self, nodes: Vec<u32>) {
        if nodes.len() <= LEAF {
            self.order.extend(nodes);
            return;
        }
        let cuts = (0..3).map(|axis| self.cut(&nodes, axis));
        let [first, second, between] = cuts.min_by_key(|[.., between]| between.len()).unwrap_or_default();
        if first.is_empty() || second.is_empty() {
            self.order.extend(nodes);
            return;
        }
        self.divide(first);
        self.divide(second);
        self.order.extend(between);
    }

    /// Splits nodes into two halves along an axis, and the separator: nodes of the first half with neighbors in the
    /// second.
    fn cut(&mut self, nodes: &[u32], axis: usize) -> [Vec<u32>; 3] {
        let mut sorted = nodes.to_vec();
        // Ties are broken by the other coordinates, so that grids are cut straight.
        let key = |node: u32| {
            let position = self.positions[node as usize];
            [0, 1, 2].map(|next| position[(axis + next) % 3])
        };
        sorted.sort_by(|&a, &b| key(a).partial_cmp(&key(b)).expect("finite positions"));
        let second = sorted.split_off(sorted.len() / 2);
        for &node in &second {
            self.second_half[node as usize] = true;
        }
        let touches = |node: &u32| {
            self.neighbors[*node as usize]
                .iter()
                .any(|&near| self.second_half[near as usize])
        };
        let (between, first) = sorted.into_iter().partition(touches);
        for &node in &second {
            self.second_half[node as usize] = false;
        }
        [first, second, between]
    }
}
