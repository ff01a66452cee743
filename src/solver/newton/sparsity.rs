//! Sparsity pattern of the stiffness matrix from springs, elements and terms. Each pair of nodes is stored once, at the
//! node with the higher number.

use std::ops::Range;

use crate::base::{Result, memory};
use crate::codec::saved;
use crate::elements::{ElasticLaw, Elements, RestTet, TetStress};
use crate::forces::{AuxiliaryForces, Forces};
use crate::springs::Link;

/// For each node, the springs to nodes of lower numbers, sorted. Pairs that only elements or terms connect are springs
/// without stiffness.
#[derive(Debug)]
pub(super) struct Sparsity {
    /// Start of each node's row, and the end of the last.
    row_starts: Vec<usize>,
    links: Vec<Link>,
    tetrahedra: Vec<Tetrahedron>,
    /// Extra stress of each tetrahedron from its history; empty if elements have none.
    loads: Vec<TetStress>,
    /// Other forces, borrowed from the body during a solve.
    pub non_spring: AuxiliaryForces,
    /// Pairs of nodes of tetrahedra, terms and closed surfaces, the higher number first.
    edges: Vec<[u32; 2]>,
    law: Option<ElasticLaw>,
    /// Rest volume of each node's ring, m³; empty without rings.
    pub volumes: Vec<f64>,
    /// Extra pressure of each ring from its history, Pa; empty if elements have none.
    ring_loads: Vec<f64>,
    ring_starts: Vec<usize>,
    ring_members: Vec<u32>,
}

saved! { Sparsity {
    row_starts, links, tetrahedra, loads, non_spring, edges, law, volumes, ring_loads, ring_starts, ring_members,
} }

/// A tetrahedron, and the indices of its pairs of corners.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tetrahedron {
    pub corners: [usize; 4],
    pub rest: RestTet,
    /// One index for each of [`PAIRS`].
    pub pair_indices: [usize; 6],
}

saved! { Tetrahedron { corners, rest, pair_indices } }

/// A tetrahedron with its material law and extra stress.
#[derive(Clone, Copy)]
pub(super) struct Element<'a> {
    pub law: ElasticLaw,
    pub load: TetStress,
    pub of: &'a Tetrahedron,
}

/// Pairs of corners.
pub(super) const PAIRS: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

/// Returns the pair with the higher number first.
fn ordered([a, b]: [u32; 2]) -> [u32; 2] {
    [a.max(b), a.min(b)]
}

/// Visits the pairs of nodes of each term and of each triangle of a closed surface.
fn visit_pairs(beside: &AuxiliaryForces, visit: &mut dyn FnMut([u32; 2])) {
    beside.visit_nodes(&mut |nodes, _| {
        for (index, &a) in nodes.iter().enumerate() {
            nodes[..index].iter().for_each(|&b| visit(ordered([a, b])));
        }
    });
}

impl Sparsity {
    /// Creates the pattern for a body with these forces.
    pub fn new(forces: &Forces) -> Result<Self> {
        let (node_count, elements) = (forces.springs.node_count(), forces.elements());
        let mut pair_count = 6 * elements.map_or(0, Elements::count);
        visit_pairs(&forces.auxiliary, &mut |_| pair_count += 1);
        let tetrahedron_count = elements.map_or(0, Elements::count);
        let ring_count = forces.ring_count();
        let may_load_rings = elements.is_some_and(Elements::may_have_extra_pressure);
        let remember = elements.is_some_and(Elements::has_history);
        let mut sparsity = Self {
            row_starts: memory::filled(0, node_count + 1)?,
            links: memory::reserved(forces.springs.spring_count() + pair_count)?,
            tetrahedra: memory::reserved(tetrahedron_count)?,
            loads: memory::reserved(if remember { tetrahedron_count } else { 0 })?,
            ring_loads: memory::reserved(if may_load_rings { ring_count } else { 0 })?,
            non_spring: AuxiliaryForces::default(),
            edges: memory::reserved(pair_count)?,
            law: None,
            volumes: memory::filled(0.0, ring_count)?,
            ring_starts: memory::filled(0, if ring_count > 0 { ring_count + 1 } else { 0 })?,
            ring_members: memory::filled(0, if ring_count > 0 { 4 * tetrahedron_count } else { 0 })?,
        };
        sparsity.update(forces);
        Ok(sparsity)
    }

    /// Reserves capacity for this number of springs. Returns the possible number of pairs.
    pub fn reserve(&mut self, spring_count: usize) -> Result<usize> {
        let pair_count = spring_count + self.edges.len();
        self.links.try_reserve(pair_count.saturating_sub(self.links.len()))?;
        Ok(pair_count)
    }

    /// Updates the pattern from a body. It does not allocate if the capacity suffices.
    pub fn update(&mut self, forces: &Forces) {
        let elements = forces.elements();
        self.tetrahedra.clear();
        self.loads.clear();
        self.ring_loads.clear();
        self.edges.clear();
        self.law = elements.map(Elements::stiffened);
        if let Some(elements) = elements {
            elements.visit_with_extra_stress(&mut |corners, rest, load| {
                if elements.has_history() {
                    self.loads.push(load);
                }
                self.edges
                    .extend(PAIRS.map(|pair| ordered(pair.map(|corner| corners[corner]))));
                self.tetrahedra.push(Tetrahedron {
                    corners: corners.map(|corner| corner as usize),
                    rest: *rest,
                    pair_indices: [0; 6],
                });
            });
        }
        visit_pairs(&forces.auxiliary, &mut |pair| self.edges.push(pair));
        memory::sort_once(&mut self.edges);
        if let Some(elements) = elements.filter(|_| !self.volumes.is_empty()) {
            self.update_rings(elements);
        }
        self.links.clear();
        let mut edges = self.edges.iter().peekable();
        for node in 0..self.node_count() {
            let start = self.links.len();
            forces.springs.visit(node, &mut |link| {
                if (link.neighbor as usize) < node {
                    self.links.push(link);
                }
            });
            self.links[start..].sort_unstable_by_key(|link| link.neighbor);
            let end = self.links.len();
            while let Some(&&[_, neighbor]) = edges.peek().filter(|edge| edge[0] as usize == node) {
                edges.next();
                let has_spring = self.links[start..end].binary_search_by_key(&neighbor, |link| link.neighbor);
                if has_spring.is_err() {
                    self.links.push(Link {
                        neighbor,
                        stiffness: 0.0,
                        rest_length: 0.0,
                        damping: 0.0,
                    });
                }
            }
            self.links[start..].sort_unstable_by_key(|link| link.neighbor);
            self.row_starts[node + 1] = self.links.len();
        }
        for index in 0..self.tetrahedra.len() {
            let corners = self.tetrahedra[index].corners;
            self.tetrahedra[index].pair_indices =
                PAIRS.map(|pair| self.pair_index(pair.map(|corner| corners[corner] as u32)));
        }
    }

    /// Index of a pair of nodes.
    pub fn pair_index(&self, pair: [u32; 2]) -> usize {
        let [high, low] = ordered(pair);
        let row = self.row(high as usize);
        row.start + self.links[row].partition_point(|link| link.neighbor < low)
    }

    /// Finds the tetrahedra of each node.
    fn update_rings(&mut self, elements: &Elements) {
        for (node, volume) in self.volumes.iter_mut().enumerate() {
            *volume = elements.nodal_volume(node).unwrap_or(0.0);
        }
        if elements.may_have_extra_pressure() {
            let nodes = 0..self.volumes.len();
            self.ring_loads.extend(nodes.map(|node| elements.extra_pressure(node)));
        }
        let starts = &mut self.ring_starts;
        starts.fill(0);
        let corners = || {
            self.tetrahedra
                .iter()
                .enumerate()
                .flat_map(|(index, tetrahedron)| tetrahedron.corners.map(|node| (index, node)))
        };
        corners().for_each(|(_, node)| starts[node + 1] += 1);
        for node in 1..starts.len() {
            starts[node] += starts[node - 1];
        }
        // Filling each ring from its end leaves its start correct.
        for (tetrahedron, node) in corners() {
            starts[node + 1] -= 1;
            self.ring_members[starts[node + 1]] = tetrahedron as u32;
        }
        let count = 4 * self.tetrahedra.len();
        starts.rotate_left(1);
        if let Some(last) = starts.last_mut() {
            *last = count;
        }
    }

    /// Tetrahedra of a node's ring.
    pub fn ring(&self, node: usize) -> impl Iterator<Item = Element<'_>> {
        let members = &self.ring_members[self.ring_starts[node]..self.ring_starts[node + 1]];
        members.iter().filter_map(|&index| self.element(index as usize))
    }

    fn element(&self, index: usize) -> Option<Element<'_>> {
        Some(Element {
            law: self.law?,
            load: self.loads.get(index).copied().unwrap_or(TetStress::ZERO),
            of: &self.tetrahedra[index],
        })
    }

    /// Extra pressure of a node's ring from its history, Pa.
    pub fn ring_load(&self, node: usize) -> f64 {
        self.ring_loads.get(node).copied().unwrap_or(0.0)
    }

    /// Number of rings: one per node, or 0.
    pub fn ring_count(&self) -> usize {
        self.volumes.len()
    }

    /// Bulk stiffness of rings, Pa.
    pub fn kappa(&self) -> f64 {
        self.law.map_or(0.0, |law| f64::from(law.kappa))
    }

    /// Converts volume changes of rings, m³, to pressures, Pa.
    pub fn convert_to_pressures(&self, values: &mut [f64]) {
        for (value, &volume) in values.iter_mut().zip(&self.volumes) {
            *value = if volume > 0.0 {
                self.kappa() * *value / volume
            } else {
                0.0
            };
        }
    }

    /// Number of tetrahedra in rings: all, or 0.
    pub fn member_count(&self) -> usize {
        self.ring_members.len() / 4
    }

    pub fn node_count(&self) -> usize {
        self.row_starts.len() - 1
    }

    /// Number of pairs of nodes.
    pub fn pair_count(&self) -> usize {
        self.links.len()
    }

    /// Indices of a node's pairs.
    #[inline(always)]
    pub fn row(&self, node: usize) -> Range<usize> {
        self.row_starts[node]..self.row_starts[node + 1]
    }

    /// The other node of the pair.
    #[inline(always)]
    pub fn neighbor(&self, index: usize) -> usize {
        self.links[index].neighbor as usize
    }

    /// All springs with their index and their node of the higher number.
    pub fn springs(&self) -> impl Iterator<Item = (usize, usize, &Link)> {
        (0..self.node_count()).flat_map(move |node| self.row(node).map(move |index| (index, node, &self.links[index])))
    }

    pub fn tetrahedra(&self) -> impl Iterator<Item = Element<'_>> {
        (0..self.tetrahedra.len()).filter_map(|index| self.element(index))
    }
}
