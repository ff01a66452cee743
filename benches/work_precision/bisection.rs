//! An order of nodes by nested dissection (George 1973), from coordinates: halves first, what separates them last. Little
//! fills in when a matrix is factored in this order, and neighbours lie near each other in memory.

use glam::Vec3;

use crate::scene::Scene;

/// So few nodes are not divided.
const LEAF: usize = 24;

/// The nodes in their new order, pinned ones last.
pub fn order(scene: &Scene) -> Vec<u32> {
    let mut dissection = Dissection {
        positions: &scene.positions,
        neighbours: neighbours(scene),
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

/// For each node, its place in the order.
pub fn places(order: &[u32]) -> Vec<u32> {
    let mut places = vec![0; order.len()];
    for (place, &node) in (0..).zip(order) {
        places[node as usize] = place;
    }
    places
}

/// The nodes that springs join each node to.
pub fn neighbours(scene: &Scene) -> Vec<Vec<u32>> {
    let mut neighbours = vec![Vec::new(); scene.node_count()];
    for &[a, b] in &scene.springs {
        neighbours[a as usize].push(b);
        neighbours[b as usize].push(a);
    }
    neighbours
}

struct Dissection<'a> {
    positions: &'a [Vec3],
    neighbours: Vec<Vec<u32>>,
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

    /// Two halves along an axis, and the nodes of the first that touch the second, taken out of it.
    fn cut(&mut self, nodes: &[u32], axis: usize) -> [Vec<u32>; 3] {
        let mut sorted = nodes.to_vec();
        // Nodes at one height are told apart by their other coordinates, so that grids are cut straight.
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
            self.neighbours[*node as usize]
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
