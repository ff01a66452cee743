//! Contact between the two sides of a cut through a solid. Their faces coincide after the cut and then collide without
//! thickness.
//!
//! The distance of coincident faces does not identify their sides, but their normals do. A corner of one side must stay
//! in front of the opposing faces of the other, at distance 0. A cut thus pushes nothing apart, and a closed wound
//! behaves like uncut tissue.

use glam::{Vec3, Vec3A};

use super::collision_surface::{Clearance, CollisionSurface, NONE, NodeMotion};
use super::pair_contact::ContactSide;
use super::search::{FoundContact, PairSearch};
use crate::base::{Result, memory};
use crate::codec::saved;
use crate::contact::time_of_impact::{Corners, Segment, Separation};
use crate::geometry::Aabb;
use crate::soa::Vectors;
use crate::solver::System;

/// Minimum cosine of the angle between an edge's normal and the direction across the gap, for contact of edges.
const MIN_FACING: f32 = 0.5;

/// Maximum cosine of the angle between the normals of two such edges.
const MAX_ALIGNMENT: f32 = 1.0 - 2.0 * MIN_FACING * MIN_FACING;

/// Maximum depth of a corner behind a face, as a fraction of a short edge. The size of the exposed faces also limits
/// it, because many cuts leave small pieces, which would be compared with all others.
const MAX_DEPTH: f32 = 1.0;

/// Width of the border, as a fraction of a short edge. Corners beside or behind a border by no more than this touch it,
/// since they initially lie on it.
const BORDER_WIDTH: f32 = 0.05;

/// Factor on that depth within which a corner that was initially behind a face belongs to the same tissue.
const ORIGINAL_DEPTH: f32 = 4.0;

/// Minimum initial distance, as a fraction of the minimum thickness, of edges that no cut separated.
const MIN_INITIAL_GAP: f32 = 0.1;

/// Depth behind a face that counts as rounding, as a fraction of the minimum thickness.
const MIN_DEPTH: f32 = 0.01;

/// Surface of a solid that cuts exposed.
#[derive(Debug)]
pub(super) struct Wound {
    /// Exposed triangles, and a flag for each triangle.
    faces: Vec<u32>,
    is_exposed: Vec<bool>,
    /// Their corners, and a flag for each node.
    nodes: Vec<u32>,
    is_corner: Vec<bool>,
    /// Sum of the exposed triangles' normals at each node.
    normals: Vectors,
    /// Longest edge of the exposed triangles at each node, m.
    longest: Vec<f32>,
}

saved! { Wound { faces, is_exposed, nodes, is_corner, normals, longest } }

impl Wound {
    /// Creates an empty wound for a body with this number of triangles.
    pub fn new(body: &System, triangles: usize) -> Result<Self> {
        let spare = body.spare_nodes();
        let mut is_exposed = memory::reserved(triangles + 2 * spare)?;
        is_exposed.resize(triangles, false);
        let mut is_corner = memory::reserved(body.node_count() + spare)?;
        is_corner.resize(body.node_count(), false);
        Ok(Self {
            faces: memory::reserved(2 * spare)?,
            is_exposed,
            nodes: memory::reserved(spare)?,
            is_corner,
            normals: body.zeros()?,
            longest: memory::reserved(body.node_count() + spare)?,
        })
    }

    /// Reserves memory for this number of additional and of exposed triangles.
    pub fn reserve(&mut self, triangles: usize, exposed: usize) -> Result<()> {
        self.is_exposed.try_reserve(triangles)?;
        self.faces.try_reserve(exposed)?;
        Ok(self.nodes.try_reserve(3 * exposed)?)
    }

    /// Adds exposed triangles.
    pub fn expose(&mut self, exposed: &[u32], triangles: &[[u32; 3]], node_count: usize) {
        self.is_exposed.resize(triangles.len(), false);
        self.is_corner.resize(node_count.max(self.is_corner.len()), false);
        self.normals.grow(node_count);
        self.longest.resize(node_count.max(self.longest.len()), 0.0);
        for &triangle in exposed {
            if !std::mem::replace(&mut self.is_exposed[triangle as usize], true) {
                self.faces.push(triangle);
            }
            for corner in triangles[triangle as usize] {
                if !std::mem::replace(&mut self.is_corner[corner as usize], true) {
                    self.nodes.push(corner);
                }
            }
        }
    }

    /// Computes normals from positions at the start of a substep.
    pub fn update_normals(&mut self, triangles: &[[u32; 3]], start: impl Fn(u32) -> Vec3) {
        for &node in &self.nodes {
            self.normals.set(node as usize, Vec3::ZERO);
            self.longest[node as usize] = 0.0;
        }
        for &face in &self.faces {
            let corners = triangles[face as usize];
            let [a, b, c] = corners.map(&start);
            let normal = normal([a, b, c]);
            let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
            for corner in corners {
                let sum = self.normals.get(corner as usize) + normal;
                self.normals.set(corner as usize, sum);
                self.longest[corner as usize] = longest.max(self.longest[corner as usize]);
            }
        }
    }

    /// True if any triangle is exposed.
    pub fn is_open(&self) -> bool {
        !self.faces.is_empty()
    }

    /// True if a triangle is exposed.
    pub fn is_exposed(&self, triangle: usize) -> bool {
        self.is_exposed[triangle]
    }

    /// True if all these nodes are corners of exposed triangles.
    pub fn contains(&self, mut nodes: impl Iterator<Item = u32>) -> bool {
        nodes.all(|node| self.is_corner[node as usize])
    }
}

impl PairSearch<'_> {
    /// Reports exposed corners behind faces of the other side.
    pub fn report_wound_corners(&self, visit: &mut impl FnMut(FoundContact)) {
        let search_side = self.search_sides[0];
        let surface = search_side.surface;
        let Some(wound) = surface.wound().filter(|_| self.is_self_contact()) else {
            return;
        };
        for &node in &wound.nodes {
            let border = surface.wound_border();
            let depth = (MAX_DEPTH * surface.short_edge)
                .min(wound.longest[node as usize])
                .max(border);
            let outward = wound.normals.get(node as usize);
            let NodeMotion { start, displacement } = surface.node_motion(node);
            let [start, end] = [start, start + displacement].map(Vec3::from);
            let around = Aabb::of([start, end].into_iter());
            let mut nearest: Option<((bool, f32), FaceProjection, usize, Vec3)> = None;
            // Maximum distance of a face to consider.
            let mut reach = depth;
            surface
                .forest
                .nearest(&around, depth + surface.displacement_spread, |triangle| {
                    let nodes = surface.triangles[triangle];
                    let search_distance = |reach: f32| reach + surface.min_thickness() + surface.displacement_spread;
                    if !wound.is_exposed(triangle) || nodes.contains(&node) {
                        return search_distance(reach);
                    }
                    let positions = surface.corners(&nodes).at(1.0).map(Vec3::from);
                    let face_normal = normal(positions);
                    let height = face_normal.dot(end - positions[0]);
                    let is_too_far = height * height > reach * reach * face_normal.length_squared();
                    if is_too_far || !(face_normal.dot(outward) < 0.0) {
                        return search_distance(reach);
                    }
                    let normal = face_normal.normalize_or_zero();
                    let projection = FaceProjection::new(end, positions, normal);
                    let is_lateral = projection.lateral > surface.min_thickness();
                    let within = if is_lateral { border } else { depth };
                    // Faces with the corner above or below come first.
                    let key = (is_lateral, projection.height.abs());
                    if projection.height.abs() < within
                        && projection.lateral < border
                        && nearest.is_none_or(|(best, ..)| key < best)
                        && !surface.was_initially_behind(node, nodes, ORIGINAL_DEPTH * depth)
                    {
                        nearest = Some((key, projection, triangle, normal));
                        if !is_lateral {
                            reach = projection.height.abs();
                        }
                    }
                    search_distance(reach)
                });
            if let Some((_, projection, triangle, normal)) = nearest
                && projection.height < -MIN_DEPTH * surface.min_thickness()
            {
                let sides = [
                    ContactSide::of_node(search_side.body_index, node),
                    ContactSide {
                        body: search_side.body_index,
                        nodes: surface.triangles[triangle],
                        weights: projection.weights,
                    },
                ];
                self.report_contact(sides, (normal, false), (Clearance::of(0.0), Vec3::ZERO), visit);
            }
        }
    }
}

impl PairSearch<'_> {
    /// Reports exposed edges that pass behind edges of the other side.
    pub fn report_wound_edges(&self, visit: &mut impl FnMut(FoundContact)) {
        let search_side = self.search_sides[0];
        let surface = search_side.surface;
        let Some(wound) = surface.wound().filter(|wound| !wound.faces.is_empty()) else {
            return;
        };
        let border = surface.wound_border();
        let outward = |[a, b]: [u32; 2]| wound.normals.get(a as usize) + wound.normals.get(b as usize);
        for &edge in &surface.edges {
            if edge[0] == NONE || !wound.contains(edge.into_iter()) {
                continue;
            }
            let motions = edge.map(|node| surface.node_motion(node));
            let segment = Segment::still(motions.map(|motion| motion.start + motion.displacement));
            let around = Aabb::of(segment.ends.into_iter().map(Vec3::from));
            let within = around.extended(border);
            let edge_normal = outward(edge);
            let mut deepest: Option<(f32, [u32; 2], Separation, Vec3)> = None;
            surface.visit_near(&around, border + surface.displacement_spread, |triangle| {
                for other in surface.owned_edges(triangle).into_iter().filter(|&other| other != NONE) {
                    let other = surface.edges[other as usize];
                    let is_candidate = other > edge && !other.iter().any(|node| edge.contains(node));
                    if !(is_candidate && wound.contains(other.into_iter())) {
                        continue;
                    }
                    let mut corners = surface.corners(&other);
                    corners.points = corners.at(1.0);
                    corners.steps = [Vec3A::ZERO; 3];
                    // Cheap tests come first, because most edges near a long edge's box are not near the edge.
                    let other_normal = outward(other);
                    let alignment = other_normal.dot(edge_normal);
                    let squared_lengths = other_normal.length_squared() * edge_normal.length_squared();
                    let face_same_side =
                        alignment > 0.0 && alignment * alignment > MAX_ALIGNMENT * MAX_ALIGNMENT * squared_lengths;
                    if face_same_side
                        || !Aabb::of(corners.points[..2].iter().map(|&point| point.into())).overlaps(&within)
                    {
                        continue;
                    }
                    let separation = corners.separation(&segment, 0.0);
                    let is_inside = separation.inside && separation.along > 0.0 && separation.along < 1.0;
                    let depth = separation.offset.length();
                    if !is_inside || depth > border || depth < MIN_DEPTH * surface.min_thickness() {
                        continue;
                    }
                    // The normal leads from the first edge to the other, which is outward from the other if the first
                    // is behind it.
                    let normal = Vec3::from(separation.offset) / depth;
                    let facing = |along: Vec3| normal.dot(along.normalize_or_zero());
                    let is_behind = facing(other_normal) > MIN_FACING && facing(edge_normal) < -MIN_FACING;
                    let is_deeper = |max_depth: f32, known_edge: [u32; 2]| {
                        depth > max_depth || depth == max_depth && other < known_edge
                    };
                    if is_behind
                        && deepest.is_none_or(|(max_depth, known_edge, ..)| is_deeper(max_depth, known_edge))
                        && !surface.were_initially_apart(edge, other, normal)
                    {
                        deepest = Some((depth, other, separation, normal));
                    }
                }
            });
            if let Some((_, other, separation, normal)) = deepest {
                let sides = ContactSide::of_edges([search_side.body_index; 2], [edge, other], &separation);
                self.report_contact(sides, (normal, false), (Clearance::of(0.0), Vec3::ZERO), visit);
            }
        }
    }
}

impl CollisionSurface {
    /// Returns the width of a wound's border, m.
    pub fn wound_border(&self) -> f32 {
        BORDER_WIDTH * self.short_edge
    }

    /// True if two edges of the body were initially apart along a direction. The tissue between them is then
    /// their own, as in a thin wedge between two cuts.
    fn were_initially_apart(&self, edge: [u32; 2], other: [u32; 2], along: Vec3) -> bool {
        self.initial_positions.as_ref().is_some_and(|initial_positions| {
            let at = |node: u32| Vec3A::from(initial_positions.get(node as usize));
            let separation = Corners::still(other.into_iter().map(at)).separation(&Segment::still(edge.map(at)), 0.0);
            separation.offset.dot(along.into()) > MIN_INITIAL_GAP * self.min_thickness()
        })
    }

    /// True if a node was initially behind a triangle within `max_distance`, m. The tissue behind the triangle
    /// is then its own.
    fn was_initially_behind(&self, node: u32, triangle: [u32; 3], max_distance: f32) -> bool {
        self.initial_positions.as_ref().is_some_and(|initial_positions| {
            let at = |node: u32| initial_positions.get(node as usize);
            let positions = triangle.map(at);
            let normal = normal(positions).normalize_or_zero();
            let from = at(node) - positions[0];
            let separation = separation(at(node), positions);
            from.dot(normal) < -MIN_INITIAL_GAP * self.min_thickness()
                && separation.0.length_squared() < max_distance * max_distance
        })
    }
}

/// Position of a point relative to a triangle.
#[derive(Clone, Copy)]
struct FaceProjection {
    /// Height above the triangle, m.
    height: f32,
    /// Lateral distance from the triangle, m.
    lateral: f32,
    /// Weights of the closest point of the triangle.
    weights: [f32; 3],
}

impl FaceProjection {
    fn new(point: Vec3, triangle: [Vec3; 3], normal: Vec3) -> Self {
        let (offset, weights) = separation(point, triangle);
        let height = offset.dot(normal);
        Self {
            height,
            lateral: (offset - normal * height).length(),
            weights,
        }
    }
}

/// Returns the vector from the closest point of a triangle to a point, and the weights of that closest point.
fn separation(point: Vec3, triangle: [Vec3; 3]) -> (Vec3, [f32; 3]) {
    let corners = Corners::still(triangle.into_iter().map(Vec3A::from));
    let separation = corners.separation(&Segment::still([point.into(); 2]), 0.0);
    ((-separation.offset).into(), separation.weights)
}

/// Returns the normal with twice the area as its length.
fn normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    (b - a).cross(c - a)
}
