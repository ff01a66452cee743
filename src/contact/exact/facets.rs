//! What a solid's surface is made of: its faces, edges and corners, which way each looks, and which of them can be closest.

use glam::{DVec3, Vec3};

use crate::base::{Result, memory};
use crate::geometry::nearest::Spot;
use crate::geometry::tree::Tree;
use crate::mesh::{ClosedSurface, TRIANGLE_EDGES, pack, unpack};

/// An edge is flat where its faces turn by less, in radians about.
const FLAT: f64 = 1e-6;

/// What leads off a face or an edge, as the cosine of the angle to it.
const ALONG: f64 = 1e-6;

/// A triangle is thin where it is lower than this part of its longest side: rounding may have folded it over its neighbours.
const THIN: f64 = 1e-3;

/// At least so many convex edges meet at a corner that sticks out.
const POINTED: u8 = 3;

/// The parts of a surface, its triangles in the order of a tree.
#[derive(Debug)]
pub(super) struct Facets {
    positions: Vec<Vec3>,
    triangles: Vec<Facet>,
    edges: Vec<FacetEdge>,
    /// Sums of the normals of the faces about each node, weighted by their angles there.
    node_normals: Vec<DVec3>,
    /// The convex edges at each node.
    convex: Vec<u8>,
    /// Whether any triangle is thin, or an edge has more than two triangles.
    doubtful: bool,
    /// Where those joined to each node begin and end.
    starts: Vec<u32>,
    neighbours: Vec<u32>,
}

#[derive(Clone, Copy, Debug)]
struct Facet {
    nodes: [u32; 3],
    edges: [u32; 3],
    /// The edges (bits 0 to 2) and corners (bits 3 to 5) that this triangle is the first to have.
    own: u8,
    /// Those among them that stick out.
    salient: u8,
}

#[derive(Clone, Copy, Debug)]
struct FacetEdge {
    nodes: [u32; 2],
    /// The third corners of its two triangles; where more meet, its own first node.
    opposite: [u32; 2],
    /// The sum of the normals of its faces.
    normal: DVec3,
    convex: bool,
}

impl Facets {
    pub fn new(surface: &ClosedSurface, tree: &Tree) -> Result<Self> {
        let (positions, given) = (surface.positions(), surface.triangles());
        let mut sides: Vec<(u64, u32, u8)> = memory::reserved(3 * given.len())?;
        let mut triangles: Vec<Facet> = memory::reserved(given.len())?;
        for place in 0..given.len() {
            let nodes = given[tree.triangle(place) as usize];
            for (side, ends) in (0..).zip(TRIANGLE_EDGES) {
                sides.push((pack(&nodes, ends), place as u32, side));
            }
            triangles.push(Facet {
                nodes,
                edges: [0; 3],
                own: 0,
                salient: 0,
            });
        }
        sides.sort_unstable();
        let count = sides.chunk_by(|a, b| a.0 == b.0).count();
        let mut edges: Vec<FacetEdge> = memory::reserved(count)?;
        for same in sides.chunk_by(|a, b| a.0 == b.0) {
            for &(_, place, side) in same {
                triangles[place as usize].edges[side as usize] = edges.len() as u32;
            }
            let (_, first, side) = same[0];
            triangles[first as usize].own |= 1 << side;
            let nodes = unpack(same[0].0);
            let opposite = match *same {
                [(_, first, side), (_, second, other)] => [(first, side), (second, other)]
                    .map(|(place, side)| triangles[place as usize].nodes[(side as usize + 2) % 3]),
                _ => [nodes[0]; 2],
            };
            edges.push(FacetEdge {
                nodes,
                opposite,
                normal: DVec3::ZERO,
                convex: false,
            });
        }
        let mut seen = memory::filled(false, positions.len())?;
        for triangle in &mut triangles {
            for (corner, &node) in triangle.nodes.iter().enumerate() {
                if !std::mem::replace(&mut seen[node as usize], true) {
                    triangle.own |= 8 << corner;
                }
            }
        }
        let mut starts: Vec<u32> = memory::filled(0, positions.len() + 1)?;
        for &node in edges.iter().flat_map(|edge| &edge.nodes) {
            starts[node as usize + 1] += 1;
        }
        for node in 0..positions.len() {
            starts[node + 1] += starts[node];
        }
        let mut next = memory::copied(&starts)?;
        let mut neighbours: Vec<u32> = memory::filled(0, 2 * edges.len())?;
        for edge in &edges {
            let [a, b] = edge.nodes;
            for (node, neighbour) in [(a, b), (b, a)] {
                neighbours[next[node as usize] as usize] = neighbour;
                next[node as usize] += 1;
            }
        }
        let mut facets = Self {
            positions: memory::copied(positions)?,
            triangles,
            edges,
            node_normals: memory::filled(DVec3::ZERO, positions.len())?,
            convex: memory::filled(0, positions.len())?,
            doubtful: false,
            starts,
            neighbours,
        };
        facets.look();
        Ok(facets)
    }

    /// Takes the nodes where they are now.
    pub fn refit(&mut self, position: impl Fn(usize) -> Vec3) {
        for (node, place) in self.positions.iter_mut().enumerate() {
            *place = position(node);
        }
        self.look();
    }

    /// The nodes of the triangle at a place of the tree.
    #[inline]
    pub fn nodes(&self, place: usize) -> [u32; 3] {
        self.triangles[place].nodes
    }

    /// Finds which way everything looks, and what sticks out.
    fn look(&mut self) {
        self.node_normals.fill(DVec3::ZERO);
        self.convex.fill(0);
        self.doubtful = false;
        for edge in &mut self.edges {
            edge.normal = DVec3::ZERO;
        }
        for triangle in &self.triangles {
            let corners = triangle.nodes.map(|node| self.positions[node as usize].as_dvec3());
            let area = normal_of(corners);
            let longest = (0..3).map(|corner| corners[corner].distance_squared(corners[(corner + 1) % 3]));
            if !(area.length() > THIN * longest.fold(0.0, f64::max)) {
                self.doubtful = true;
            }
            let normal = area.normalize_or_zero();
            for corner in 0..3 {
                self.edges[triangle.edges[corner] as usize].normal += normal;
                let [here, next, last] = [0, 1, 2].map(|on| corners[(corner + on) % 3]);
                let (ahead, back) = (next - here, last - here);
                let angle = libm::atan2(ahead.cross(back).length(), ahead.dot(back));
                self.node_normals[triangle.nodes[corner] as usize] += normal * angle;
            }
        }
        for edge in &mut self.edges {
            let at = |node: u32| self.positions[node as usize].as_dvec3();
            let out = at(edge.opposite[0]) - at(edge.nodes[0]);
            edge.convex = edge.opposite[0] == edge.nodes[0] || edge.normal.dot(out) < -FLAT * out.length();
            if edge.opposite[0] == edge.nodes[0] {
                self.doubtful = true;
            }
            if edge.convex {
                for node in edge.nodes {
                    let count = &mut self.convex[node as usize];
                    *count = count.saturating_add(1);
                }
            }
        }
        for triangle in &mut self.triangles {
            triangle.salient = 0;
            for corner in 0..3 {
                let edge = u8::from(self.edges[triangle.edges[corner] as usize].convex);
                let node = u8::from(self.convex[triangle.nodes[corner] as usize] >= POINTED);
                triangle.salient |= triangle.own & (edge << corner | node << (3 + corner));
            }
        }
    }

    /// Towards the outside, of any length, at a part of the triangle at a place: what is outside and closest there is on this side of it
    /// (Baerentzen, Aanaes 2005).
    pub fn normal(&self, place: usize, part: Spot) -> DVec3 {
        let triangle = &self.triangles[place];
        match part {
            Spot::Face => normal_of(triangle.nodes.map(|node| self.positions[node as usize].as_dvec3())),
            Spot::Edge(edge) => self.edges[triangle.edges[edge] as usize].normal,
            Spot::Corner(corner) => self.node_normals[triangle.nodes[corner] as usize],
        }
    }

    /// Whether the side that something is on may not be told by what it is closest to.
    pub fn are_doubtful(&self) -> bool {
        self.doubtful
    }

    /// The ends of the edges that the triangle at a place is the first to have, and the sum of the normals of the other faces there.
    pub fn edges(&self, place: usize) -> impl Iterator<Item = ([Vec3; 2], DVec3)> {
        let triangle = &self.triangles[place];
        let own = move |side: &usize| triangle.own >> side & 1 == 1;
        (0..3).filter(own).map(move |side| {
            let [a, b] = TRIANGLE_EDGES[side].map(|end| triangle.nodes[end] as usize);
            let face = self.normal(place, Spot::Face).normalize_or_zero();
            let others = self.edges[triangle.edges[side] as usize].normal - face;
            ([self.positions[a], self.positions[b]], others)
        })
    }

    /// Of these, those that something outside can be closest to.
    #[inline]
    pub fn salient_edges(&self, place: usize) -> impl Iterator<Item = u32> {
        let triangle = &self.triangles[place];
        let salient = move |side: &usize| triangle.salient >> side & 1 == 1;
        (0..3).filter(salient).map(|side| triangle.edges[side])
    }

    /// The corners that the triangle at a place is the first to have, and that something outside can be closest to while it is no
    /// closer to their edges.
    #[inline]
    pub fn salient_nodes(&self, place: usize) -> impl Iterator<Item = u32> {
        let triangle = &self.triangles[place];
        let salient = move |corner: &usize| triangle.salient >> (3 + corner) & 1 == 1;
        (0..3).filter(salient).map(|corner| triangle.nodes[corner])
    }

    pub fn position(&self, node: u32) -> DVec3 {
        self.positions[node as usize].as_dvec3()
    }

    pub fn ends(&self, edge: u32) -> [DVec3; 2] {
        self.edges[edge as usize].nodes.map(|node| self.position(node))
    }

    /// Whether going from an edge, across it, `offset` leads off its faces.
    pub fn leads_off_edge(&self, edge: u32, offset: DVec3) -> bool {
        let edge = &self.edges[edge as usize];
        let from = self.position(edge.nodes[0]);
        edge.opposite
            .iter()
            .all(|&node| leads_off(offset, self.position(node) - from))
    }

    /// Whether going from a node, `offset` leads off all edges there.
    pub fn leads_off_node(&self, node: u32, offset: DVec3) -> bool {
        let from = self.position(node);
        let [start, end] = [0, 1].map(|on| self.starts[node as usize + on] as usize);
        let mut neighbours = self.neighbours[start..end].iter();
        neighbours.all(|&neighbour| leads_off(offset, self.position(neighbour) - from))
    }
}

fn leads_off(offset: DVec3, way: DVec3) -> bool {
    let along = offset.dot(way);
    along <= 0.0 || along * along <= ALONG * ALONG * offset.length_squared() * way.length_squared()
}

/// Outward, twice as long as the triangle's area.
fn normal_of([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}
