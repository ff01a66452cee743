//! A copy of a cut body, as a simulation or a renderer keeps it: made once, then updated by change lists only.
#![allow(clippy::unwrap_used)]

use std::collections::{BTreeMap, BTreeSet};

use glam::{DVec3, Vec3};
use sinew::cutting::Changes;

use super::random::Random;

pub struct Spring {
    pub stiffness: f64,
    pub source: [u32; 2],
}

pub struct Follower {
    pub rest: Vec<Vec3>,
    pub positions: Vec<Vec3>,
    pub masses: Vec<f64>,
    pub first_masses: Vec<f64>,
    pub sources: Vec<u32>,
    pub springs: BTreeMap<[u32; 2], Spring>,
    pub first_springs: BTreeMap<[u32; 2], f64>,
    pub triangles: Vec<[u32; 3]>,
    /// An attribute that nodes and points carry: their position in the rest shape.
    pub carried: Vec<DVec3>,
    pub bound: BTreeMap<u32, ([u32; 4], [f64; 4])>,
    pub cell_sources: Vec<u32>,
    /// The area or volume of each cell before the first cut.
    pub first_sizes: Vec<f64>,
    pub deformation: fn(Vec3) -> Vec3,
}

pub fn ordered(nodes: [u32; 2]) -> [u32; 2] {
    [nodes[0].min(nodes[1]), nodes[0].max(nodes[1])]
}

impl Follower {
    /// Creates a body from cells and their sizes. Stiffnesses follow size and length, masses follow size; both vary at
    /// random.
    pub fn new<const N: usize>(
        rest: Vec<Vec3>,
        cells: &[([u32; N], f64)],
        edges: &[[usize; 2]],
        triangles: Vec<[u32; 3]>,
        deformation: fn(Vec3) -> Vec3,
    ) -> Self {
        let mut random = Random(11);
        let mut masses = vec![0.0; rest.len()];
        let mut springs = BTreeMap::new();
        for (nodes, size) in cells {
            for &node in nodes {
                masses[node as usize] += size / N as f64;
            }
            for edge in edges {
                let edge = ordered(edge.map(|k| nodes[k]));
                let length = rest[edge[0] as usize].distance(rest[edge[1] as usize]) as f64;
                *springs.entry(edge).or_insert(0.0) += size / (length * length);
            }
        }
        for mass in &mut masses {
            *mass *= 0.9 + 0.2 * random.next();
        }
        for stiffness in springs.values_mut() {
            *stiffness *= 0.9 + 0.2 * random.next();
        }
        Self {
            positions: rest.iter().map(|&position| deformation(position)).collect(),
            first_masses: masses.clone(),
            masses,
            sources: (0..rest.len() as u32).collect(),
            first_springs: springs.clone(),
            springs: springs
                .into_iter()
                .map(|(source, stiffness)| (source, Spring { stiffness, source }))
                .collect(),
            triangles,
            carried: rest.iter().map(|position| position.as_dvec3()).collect(),
            bound: BTreeMap::new(),
            cell_sources: (0..cells.len() as u32).collect(),
            first_sizes: cells.iter().map(|&(_, size)| size).collect(),
            rest,
            deformation,
        }
    }

    /// Applies a change list as a solver and a renderer do. The body then has `node_count` nodes and `triangle_count`
    /// triangles with these corners.
    pub fn apply(
        &mut self,
        changes: &Changes,
        node_count: u32,
        triangle_count: usize,
        corners: impl Fn(u32) -> [u32; 3],
    ) {
        let masses = self.masses.clone();
        for piece in &changes.nodes {
            let source = piece.source as usize;
            assert!(piece.part > 0.0);
            if piece.node != piece.source {
                assert_eq!(piece.node as usize, self.masses.len(), "new nodes are appended");
                self.masses.push(0.0);
                self.positions.push(self.positions[source]);
                self.rest.push(self.rest[source]);
                self.sources.push(self.sources[source]);
            }
            self.masses[piece.node as usize] = masses[source] * piece.part;
        }
        let before: Vec<(f64, [u32; 2])> = changes
            .springs
            .iter()
            .map(|piece| {
                let spring = &self.springs[&piece.source];
                (spring.stiffness, spring.source)
            })
            .collect();
        for source in &changes.removed_springs {
            assert!(self.springs.remove(source).is_some());
        }
        for (piece, (whole, source)) in changes.springs.iter().zip(before) {
            assert!(piece.part > 0.0);
            let spring = Spring {
                stiffness: whole * piece.part,
                source,
            };
            self.springs.insert(ordered(piece.nodes), spring);
        }
        for piece in &changes.cells {
            let source = self.cell_sources[piece.source as usize];
            if piece.cell as usize == self.cell_sources.len() {
                self.cell_sources.push(source);
            }
            assert_eq!(self.cell_sources[piece.cell as usize], source);
        }
        for bound in &changes.bound {
            let weighted_nodes = || bound.nodes.iter().zip(bound.weights);
            let position: DVec3 = weighted_nodes()
                .map(|(&node, weight)| weight * self.positions[node as usize].as_dvec3())
                .sum();
            if bound.point as usize == self.masses.len() {
                self.masses.push(0.0);
                self.positions.push(position.as_vec3());
                self.rest.push(Vec3::NAN);
                self.sources.push(u32::MAX);
            }
            assert_eq!(self.masses[bound.point as usize], 0.0);
            self.bound.insert(bound.point, (bound.nodes, bound.weights));
        }
        assert_eq!(self.masses.len(), node_count as usize);
        let old_count = self.carried.len();
        self.carried.resize(self.masses.len(), DVec3::NAN);
        for source in &changes.sources {
            assert!(source.point as usize >= old_count && self.carried[source.point as usize].is_nan());
            assert!(source.sources.iter().all(|&from| from < source.point));
            let position = (0..3)
                .map(|k| source.weights[k] * self.carried[source.sources[k] as usize])
                .sum();
            self.carried[source.point as usize] = position;
        }
        for &node in &changes.undrawn {
            assert!(node as usize >= old_count && self.carried[node as usize].is_nan());
            self.carried[node as usize] = self.rest[node as usize].as_dvec3();
        }
        assert!(
            self.carried.iter().all(|position| !position.is_nan()),
            "the lists contain everything that is new"
        );
        assert_eq!(changes.first_triangle as usize, self.triangles.len());
        self.triangles.resize(triangle_count, [u32::MAX; 3]);
        for &triangle in &changes.triangles {
            self.triangles[triangle as usize] = corners(triangle);
        }
    }

    /// Returns the largest ratio of the stiffness of a node's springs to the mass of the node.
    pub fn worst_ratio(&self) -> f64 {
        let mut sums = vec![0.0; self.masses.len()];
        for (nodes, spring) in &self.springs {
            for &node in nodes {
                sums[node as usize] += spring.stiffness;
            }
        }
        sums.iter()
            .zip(&self.masses)
            .filter(|&(_, &mass)| mass > 0.0)
            .map(|(sum, mass)| sum / mass)
            .fold(0.0, f64::max)
    }

    /// Returns the number of nodes without the points that are bound to others.
    pub fn nodes_that_move(&self) -> usize {
        self.masses.len() - self.bound.len()
    }

    pub fn simulated_pieces(&self) -> usize {
        let mut union = Union::new(self.masses.len());
        for nodes in self.springs.keys() {
            union.unite(nodes[0], nodes[1]);
        }
        union.count() - self.bound.len()
    }

    /// Checks that each node has mass, and that copies share the mass of their source.
    pub fn check_masses(&self) {
        let mut masses = vec![0.0; self.first_masses.len()];
        for (mass, &source) in self.masses.iter().zip(&self.sources) {
            if source != u32::MAX {
                assert!(*mass > 0.0);
                masses[source as usize] += mass;
            }
        }
        for (mass, first) in masses.iter().zip(&self.first_masses) {
            assert!((mass / first - 1.0).abs() < 1e-12);
        }
    }

    /// Checks that springs lie along the edges of cells, and that their total stiffness is unchanged.
    pub fn check_springs<const N: usize>(&self, cells: impl Iterator<Item = [u32; N]>, edges: &[[usize; 2]]) {
        let cell_edges = |nodes: [u32; N]| edges.iter().map(move |edge| ordered(edge.map(|k| nodes[k])));
        let edges: BTreeSet<[u32; 2]> = cells.flat_map(cell_edges).collect();
        assert!(
            edges.iter().eq(self.springs.keys()),
            "springs lie along the edges of cells"
        );
        let mut sums = BTreeMap::new();
        for (nodes, spring) in &self.springs {
            assert_eq!(ordered(nodes.map(|node| self.sources[node as usize])), spring.source);
            *sums.entry(spring.source).or_insert(0.0) += spring.stiffness;
        }
        assert_eq!(sums.len(), self.first_springs.len());
        for (source, sum) in sums {
            assert!((sum / self.first_springs[&source] - 1.0).abs() < 1e-12, "{source:?}");
        }
    }
}

/// Disjoint sets: finds connected components.
pub struct Union(Vec<u32>);

impl Union {
    pub fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    pub fn root(&mut self, mut at: u32) -> u32 {
        while self.0[at as usize] != at {
            self.0[at as usize] = self.0[self.0[at as usize] as usize];
            at = self.0[at as usize];
        }
        at
    }

    pub fn unite(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a as usize] = b;
    }

    pub fn count(&mut self) -> usize {
        (0..self.0.len() as u32).filter(|&at| self.root(at) == at).count()
    }
}
