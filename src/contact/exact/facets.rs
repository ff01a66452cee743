//! Faces, edges and corners of a solid's surface, their pseudonormals, and which of them can be closest.

use glam::{DVec3, Vec3};

use crate::base::{Result, memory};
use crate::geometry::bvh::Bvh;
use crate::geometry::nearest::TriangleFeature;
use crate::mesh::{ClosedSurface, TRIANGLE_EDGES, pack, unpack};

/// Largest angle between the faces of a flat edge, about, in radians.
const FLAT_ANGLE: f64 = 1e-6;

/// Tolerance of the normal-cone test, as the cosine of the angle.
const CONE_TOLERANCE: f64 = 1e-6;

/// Least height of a regular triangle, relative to its longest side. Rounding may fold a thinner one over its
/// neighbors.
const MIN_HEIGHT: f64 = 1e-3;

/// Least number of convex edges at a convex corner.
const MIN_CONVEX_EDGES: u8 = 3;

/// Faces, edges and corners of a surface, with the triangles in the order of a tree.
#[derive(Debug)]
pub(super) struct Facets {
    positions: Vec<Vec3>,
    triangles: Vec<Facet>,
    edges: Vec<FacetEdge>,
    /// Sums of the face normals around each node, weighted by the faces' angles.
    node_normals: Vec<DVec3>,
    /// Number of convex edges at each node.
    convex: Vec<u8>,
    /// True if a triangle is thin or an edge has more than two triangles. The pseudonormals are then unreliable.
    unreliable: bool,
    /// Start of each node's range in `neighbors`.
    starts: Vec<u32>,
    neighbors: Vec<u32>,
}

#[derive(Clone, Copy, Debug)]
struct Facet {
    nodes: [u32; 3],
    edges: [u32; 3],
    /// Edges (bits 0 to 2) and corners (bits 3 to 5) of which this triangle is the owner: the first that has them.
    owned: u8,
    /// The convex ones among the owned edges and corners.
    convex_parts: u8,
}

#[derive(Clone, Copy, Debug)]
struct FacetEdge {
    nodes: [u32; 2],
    /// Third corners of its two triangles; for more than two triangles, its own first node.
    opposite: [u32; 2],
    /// Sum of the normals of its faces.
    normal: DVec3,
    convex: bool,
}

impl Facets {
    pub fn new(surface: &ClosedSurface, tree: &Bvh) -> Result<Self> {
        let (positions, faces) = (surface.positions(), surface.triangles());
        let mut sides: Vec<(u64, u32, u8)> = memory::reserved(3 * faces.len())?;
        let mut triangles: Vec<Facet> = memory::reserved(faces.len())?;
        for slot in 0..faces.len() {
            let nodes = faces[tree.triangle(slot) as usize];
            for (side, ends) in (0..).zip(TRIANGLE_EDGES) {
                sides.push((pack(&nodes, ends), slot as u32, side));
            }
            triangles.push(Facet {
                nodes,
                edges: [0; 3],
                owned: 0,
                convex_parts: 0,
            });
        }
        sides.sort_unstable();
        let count = sides.chunk_by(|a, b| a.0 == b.0).count();
        let mut edges: Vec<FacetEdge> = memory::reserved(count)?;
        for group in sides.chunk_by(|a, b| a.0 == b.0) {
            for &(_, slot, side) in group {
                triangles[slot as usize].edges[side as usize] = edges.len() as u32;
            }
            let (_, first, side) = group[0];
            triangles[first as usize].owned |= 1 << side;
            let nodes = unpack(group[0].0);
            let opposite = match *group {
                [(_, first, side), (_, second, other)] => [(first, side), (second, other)]
                    .map(|(slot, side)| triangles[slot as usize].nodes[(side as usize + 2) % 3]),
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
                    triangle.owned |= 8 << corner;
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
        let mut neighbors: Vec<u32> = memory::filled(0, 2 * edges.len())?;
        for edge in &edges {
            let [a, b] = edge.nodes;
            for (node, neighbor) in [(a, b), (b, a)] {
                neighbors[next[node as usize] as usize] = neighbor;
                next[node as usize] += 1;
            }
        }
        let mut facets = Self {
            positions: memory::copied(positions)?,
            triangles,
            edges,
            node_normals: memory::filled(DVec3::ZERO, positions.len())?,
            convex: memory::filled(0, positions.len())?,
            unreliable: false,
            starts,
            neighbors,
        };
        facets.update_normals();
        Ok(facets)
    }

    /// Updates the node positions.
    pub fn refit(&mut self, position: impl Fn(usize) -> Vec3) {
        for (node, current) in self.positions.iter_mut().enumerate() {
            *current = position(node);
        }
        self.update_normals();
    }

    /// Returns the nodes of the triangle at a tree slot.
    #[inline]
    pub fn nodes(&self, slot: usize) -> [u32; 3] {
        self.triangles[slot].nodes
    }

    /// Updates pseudonormals and convexity.
    fn update_normals(&mut self) {
        self.node_normals.fill(DVec3::ZERO);
        self.convex.fill(0);
        self.unreliable = false;
        for edge in &mut self.edges {
            edge.normal = DVec3::ZERO;
        }
        for triangle in &self.triangles {
            let corners = triangle.nodes.map(|node| self.positions[node as usize].as_dvec3());
            let area = normal_of(corners);
            let longest = (0..3).map(|corner| corners[corner].distance_squared(corners[(corner + 1) % 3]));
            if !(area.length() > MIN_HEIGHT * longest.fold(0.0, f64::max)) {
                self.unreliable = true;
            }
            let normal = area.normalize_or_zero();
            for corner in 0..3 {
                self.edges[triangle.edges[corner] as usize].normal += normal;
                let [here, next, last] = [0, 1, 2].map(|step| corners[(corner + step) % 3]);
                let (to_next, to_last) = (next - here, last - here);
                let angle = libm::atan2(to_next.cross(to_last).length(), to_next.dot(to_last));
                self.node_normals[triangle.nodes[corner] as usize] += normal * angle;
            }
        }
        for edge in &mut self.edges {
            let at = |node: u32| self.positions[node as usize].as_dvec3();
            let opposite_direction = at(edge.opposite[0]) - at(edge.nodes[0]);
            edge.convex = edge.opposite[0] == edge.nodes[0]
                || edge.normal.dot(opposite_direction) < -FLAT_ANGLE * opposite_direction.length();
            if edge.opposite[0] == edge.nodes[0] {
                self.unreliable = true;
            }
            if edge.convex {
                for node in edge.nodes {
                    let count = &mut self.convex[node as usize];
                    *count = count.saturating_add(1);
                }
            }
        }
        for triangle in &mut self.triangles {
            triangle.convex_parts = 0;
            for corner in 0..3 {
                let edge = u8::from(self.edges[triangle.edges[corner] as usize].convex);
                let node = u8::from(self.convex[triangle.nodes[corner] as usize] >= MIN_CONVEX_EDGES);
                triangle.convex_parts |= triangle.owned & (edge << corner | node << (3 + corner));
            }
        }
    }

    /// Returns the outward pseudonormal, not normalized, at a spot of the triangle at a tree slot. A point outside
    /// with its closest point there lies on its positive side (Baerentzen, Aanaes 2005).
    pub fn normal(&self, slot: usize, spot: TriangleFeature) -> DVec3 {
        let triangle = &self.triangles[slot];
        match spot {
            TriangleFeature::Face => normal_of(triangle.nodes.map(|node| self.positions[node as usize].as_dvec3())),
            TriangleFeature::Edge(edge) => self.edges[triangle.edges[edge] as usize].normal,
            TriangleFeature::Corner(corner) => self.node_normals[triangle.nodes[corner] as usize],
        }
    }

    /// True if the pseudonormals may give the wrong side.
    pub fn are_normals_unreliable(&self) -> bool {
        self.unreliable
    }

    /// Visits the owned edges of the triangle at a tree slot: their ends, and the sum of the normals of the other
    /// faces there.
    pub fn edges(&self, slot: usize) -> impl Iterator<Item = ([Vec3; 2], DVec3)> {
        let triangle = &self.triangles[slot];
        let is_owned = move |side: &usize| triangle.owned >> side & 1 == 1;
        (0..3).filter(is_owned).map(move |side| {
            let [a, b] = TRIANGLE_EDGES[side].map(|end| triangle.nodes[end] as usize);
            let face = self.normal(slot, TriangleFeature::Face).normalize_or_zero();
            let others = self.edges[triangle.edges[side] as usize].normal - face;
            ([self.positions[a], self.positions[b]], others)
        })
    }

    /// Returns the owned convex edges. Only they can be closest to a point outside.
    #[inline]
    pub fn convex_edges(&self, slot: usize) -> impl Iterator<Item = u32> {
        let triangle = &self.triangles[slot];
        let is_convex = move |side: &usize| triangle.convex_parts >> side & 1 == 1;
        (0..3).filter(is_convex).map(|side| triangle.edges[side])
    }

    /// Returns the owned convex corners. Only they can be closest to a point outside that is not closer to their
    /// edges.
    #[inline]
    pub fn convex_nodes(&self, slot: usize) -> impl Iterator<Item = u32> {
        let triangle = &self.triangles[slot];
        let is_convex = move |corner: &usize| triangle.convex_parts >> (3 + corner) & 1 == 1;
        (0..3).filter(is_convex).map(|corner| triangle.nodes[corner])
    }

    pub fn position(&self, node: u32) -> DVec3 {
        self.positions[node as usize].as_dvec3()
    }

    pub fn ends(&self, edge: u32) -> [DVec3; 2] {
        self.edges[edge as usize].nodes.map(|node| self.position(node))
    }

    /// True if `offset`, perpendicular to an edge, lies in its normal cone.
    pub fn is_in_edge_cone(&self, edge: u32, offset: DVec3) -> bool {
        let edge = &self.edges[edge as usize];
        let from = self.position(edge.nodes[0]);
        edge.opposite
            .iter()
            .all(|&node| points_away(offset, self.position(node) - from))
    }

    /// True if `offset` lies in the normal cone of a node.
    pub fn is_in_node_cone(&self, node: u32, offset: DVec3) -> bool {
        let from = self.position(node);
        let [start, end] = [0, 1].map(|on| self.starts[node as usize + on] as usize);
        let mut neighbors = self.neighbors[start..end].iter();
        neighbors.all(|&neighbor| points_away(offset, self.position(neighbor) - from))
    }
}

fn points_away(offset: DVec3, direction: DVec3) -> bool {
    let along = offset.dot(direction);
    along <= 0.0
        || along * along <= CONE_TOLERANCE * CONE_TOLERANCE * offset.length_squared() * direction.length_squared()
}

/// Outward normal, twice as long as the triangle's area.
fn normal_of([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}
