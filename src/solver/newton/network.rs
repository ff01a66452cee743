//! The springs, elements and terms of a body as rows of a matrix: each pair of nodes once, at the node with the higher number.

use std::ops::Range;

use crate::base::{Result, memory};
use crate::codec::saved;
use crate::elements::{Elements, Law, Load, Rest};
use crate::forces::{Beside, Forces};
use crate::springs::Link;

/// For each node the springs to nodes of lower numbers, in their order; pairs of nodes that only elements or terms join are springs of
/// no stiffness.
#[derive(Debug)]
pub(super) struct Network {
    /// Where the row of each node begins, and the end of the last.
    starts: Vec<usize>,
    links: Vec<Link>,
    tetrahedra: Vec<Tetrahedron>,
    /// On each of them, where elements remember; none otherwise.
    loads: Vec<Load>,
    /// Lent by the body while it is solved.
    pub beside: Beside,
    /// The pairs of nodes of tetrahedra, terms and closed surfaces, the higher number first.
    edges: Vec<[u32; 2]>,
    law: Option<Law>,
    /// Where volume is kept by rings: each node's volume at rest, m³, and where the tetrahedra about it begin among all.
    pub volumes: Vec<f64>,
    /// The load on each, Pa, where elements remember; none otherwise.
    ring_loads: Vec<f64>,
    ring_starts: Vec<usize>,
    ring_members: Vec<u32>,
}

saved! { Network {
    starts, links, tetrahedra, loads, beside, edges, law, volumes, ring_loads, ring_starts, ring_members,
} }

/// A tetrahedron, and where its pairs of corners are.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tetrahedron {
    pub corners: [usize; 4],
    pub rest: Rest,
    /// Of the pairs of [`PAIRS`].
    pub places: [usize; 6],
}

saved! { Tetrahedron { corners, rest, places } }

/// A tetrahedron with the law and the load of the equation.
#[derive(Clone, Copy)]
pub(super) struct Element<'a> {
    pub law: Law,
    pub load: Load,
    pub of: &'a Tetrahedron,
}

/// The pairs of corners.
pub(super) const PAIRS: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

/// With the higher number first.
fn ordered([a, b]: [u32; 2]) -> [u32; 2] {
    [a.max(b), a.min(b)]
}

/// Shows the pairs of nodes of each term, and of each triangle of a closed surface.
fn show_pairs(beside: &Beside, see: &mut dyn FnMut([u32; 2])) {
    beside.show_nodes(&mut |nodes, _| {
        for (place, &a) in nodes.iter().enumerate() {
            nodes[..place].iter().for_each(|&b| see(ordered([a, b])));
        }
    });
}

impl Network {
    /// That of a body that these forces move.
    pub fn new(forces: &Forces) -> Result<Self> {
        let (node_count, elements) = (forces.springs.node_count(), forces.elements());
        let mut pair_count = 6 * elements.map_or(0, Elements::count);
        show_pairs(&forces.beside, &mut |_| pair_count += 1);
        let tetrahedron_count = elements.map_or(0, Elements::count);
        let ring_count = forces.ring_count();
        let may_load_rings = elements.is_some_and(Elements::may_load_rings);
        let remember = elements.is_some_and(Elements::remember);
        let mut network = Self {
            starts: memory::filled(0, node_count + 1)?,
            links: memory::reserved(forces.springs.spring_count() + pair_count)?,
            tetrahedra: memory::reserved(tetrahedron_count)?,
            loads: memory::reserved(if remember { tetrahedron_count } else { 0 })?,
            ring_loads: memory::reserved(if may_load_rings { ring_count } else { 0 })?,
            beside: Beside::default(),
            edges: memory::reserved(pair_count)?,
            law: None,
            volumes: memory::filled(0.0, ring_count)?,
            ring_starts: memory::filled(0, if ring_count > 0 { ring_count + 1 } else { 0 })?,
            ring_members: memory::filled(0, if ring_count > 0 { 4 * tetrahedron_count } else { 0 })?,
        };
        network.read(forces);
        Ok(network)
    }

    /// Makes room for so many springs in all: how many pairs of nodes there may be then.
    pub fn make_room(&mut self, spring_count: usize) -> Result<usize> {
        let pair_count = spring_count + self.edges.len();
        self.links.try_reserve(pair_count.saturating_sub(self.links.len()))?;
        Ok(pair_count)
    }

    /// Takes them from a body, which allocates nothing where there is room for all.
    pub fn read(&mut self, forces: &Forces) {
        let elements = forces.elements();
        self.tetrahedra.clear();
        self.loads.clear();
        self.ring_loads.clear();
        self.edges.clear();
        self.law = elements.map(Elements::stiffened);
        if let Some(elements) = elements {
            elements.visit_loaded(&mut |corners, rest, load| {
                if elements.remember() {
                    self.loads.push(load);
                }
                self.edges
                    .extend(PAIRS.map(|pair| ordered(pair.map(|corner| corners[corner]))));
                self.tetrahedra.push(Tetrahedron {
                    corners: corners.map(|corner| corner as usize),
                    rest: *rest,
                    places: [0; 6],
                });
            });
        }
        show_pairs(&forces.beside, &mut |pair| self.edges.push(pair));
        memory::sort_once(&mut self.edges);
        if let Some(elements) = elements.filter(|_| !self.volumes.is_empty()) {
            self.read_rings(elements);
        }
        self.links.clear();
        let mut edges = self.edges.iter().peekable();
        for node in 0..self.node_count() {
            let start = self.links.len();
            forces.springs.visit(node, &mut |link| {
                if (link.neighbour as usize) < node {
                    self.links.push(link);
                }
            });
            self.links[start..].sort_unstable_by_key(|link| link.neighbour);
            let end = self.links.len();
            while let Some(&&[_, neighbour]) = edges.peek().filter(|edge| edge[0] as usize == node) {
                edges.next();
                let has_spring = self.links[start..end].binary_search_by_key(&neighbour, |link| link.neighbour);
                if has_spring.is_err() {
                    self.links.push(Link {
                        neighbour,
                        stiffness: 0.0,
                        rest_length: 0.0,
                        damping: 0.0,
                    });
                }
            }
            self.links[start..].sort_unstable_by_key(|link| link.neighbour);
            self.starts[node + 1] = self.links.len();
        }
        for index in 0..self.tetrahedra.len() {
            let corners = self.tetrahedra[index].corners;
            self.tetrahedra[index].places = PAIRS.map(|pair| self.place(pair.map(|corner| corners[corner] as u32)));
        }
    }

    /// Where a pair of nodes is.
    pub fn place(&self, pair: [u32; 2]) -> usize {
        let [high, low] = ordered(pair);
        let row = self.row(high as usize);
        row.start + self.links[row].partition_point(|link| link.neighbour < low)
    }

    /// Finds the tetrahedra about each node.
    fn read_rings(&mut self, elements: &Elements) {
        for (node, volume) in self.volumes.iter_mut().enumerate() {
            *volume = elements.ring_volume(node).unwrap_or(0.0);
        }
        if elements.may_load_rings() {
            let nodes = 0..self.volumes.len();
            self.ring_loads.extend(nodes.map(|node| elements.load_of_ring(node)));
        }
        let starts = &mut self.ring_starts;
        starts.fill(0);
        let corners = || {
            self.tetrahedra
                .iter()
                .enumerate()
                .flat_map(|(at, of)| of.corners.map(|node| (at, node)))
        };
        corners().for_each(|(_, node)| starts[node + 1] += 1);
        for node in 1..starts.len() {
            starts[node] += starts[node - 1];
        }
        // Filled from the end of each ring, so that its start is where it should be afterwards.
        for (at, node) in corners() {
            starts[node + 1] -= 1;
            self.ring_members[starts[node + 1]] = at as u32;
        }
        let count = 4 * self.tetrahedra.len();
        starts.rotate_left(1);
        if let Some(last) = starts.last_mut() {
            *last = count;
        }
    }

    /// The tetrahedra about a node, where volume is kept by rings.
    pub fn ring(&self, node: usize) -> impl Iterator<Item = Element<'_>> {
        let members = &self.ring_members[self.ring_starts[node]..self.ring_starts[node + 1]];
        members.iter().filter_map(|&at| self.element(at as usize))
    }

    fn element(&self, at: usize) -> Option<Element<'_>> {
        Some(Element {
            law: self.law?,
            load: self.loads.get(at).copied().unwrap_or(Load::NONE),
            of: &self.tetrahedra[at],
        })
    }

    /// The load on the ring of a node, Pa.
    pub fn ring_load(&self, node: usize) -> f64 {
        self.ring_loads.get(node).copied().unwrap_or(0.0)
    }

    /// How many nodes have a ring: all, or none.
    pub fn ring_count(&self) -> usize {
        self.volumes.len()
    }

    /// What rings resist growth with, Pa.
    pub fn kappa(&self) -> f64 {
        self.law.map_or(0.0, |law| f64::from(law.kappa))
    }

    /// Makes pressures, Pa, of how much the volume of each node's ring has grown, m³.
    pub fn press(&self, growths: &mut [f64]) {
        for (growth, &volume) in growths.iter_mut().zip(&self.volumes) {
            *growth = if volume > 0.0 {
                self.kappa() * *growth / volume
            } else {
                0.0
            };
        }
    }

    /// How many tetrahedra are in rings: all, or none.
    pub fn member_count(&self) -> usize {
        self.ring_members.len() / 4
    }

    pub fn node_count(&self) -> usize {
        self.starts.len() - 1
    }

    /// How many pairs of nodes it has.
    pub fn pair_count(&self) -> usize {
        self.links.len()
    }

    /// The places of a node's springs.
    #[inline(always)]
    pub fn row(&self, node: usize) -> Range<usize> {
        self.starts[node]..self.starts[node + 1]
    }

    /// The other node of the spring at this place.
    #[inline(always)]
    pub fn neighbour(&self, place: usize) -> usize {
        self.links[place].neighbour as usize
    }

    /// Every spring with its place and its node of the higher number.
    pub fn springs(&self) -> impl Iterator<Item = (usize, usize, &Link)> {
        (0..self.node_count()).flat_map(move |node| self.row(node).map(move |place| (place, node, &self.links[place])))
    }

    /// Every tetrahedron.
    pub fn tetrahedra(&self) -> impl Iterator<Item = Element<'_>> {
        (0..self.tetrahedra.len()).filter_map(|at| self.element(at))
    }
}
