//! Collision surfaces of bodies that collide with others or themselves.

mod motion;

use glam::{DVec3, Vec3, Vec3A};

use super::edge_curvature::{EdgeCurvature, EdgeCurvatures};
use super::images::SurfaceImages;
use super::narrow_phase::MIN_THICKNESS;
use super::topology_change::SurfaceTopology;
use super::wound::Wound;
use crate::base::{Result, memory};
use crate::codec::saved;
use crate::contact::time_of_impact::{Corners, Segment};
use crate::def::{BodyContact, Detection};
use crate::geometry::{Aabb, Forest};
use crate::mesh;
use crate::soa::Vectors;
use crate::solver::System;

pub(crate) use motion::NodeMotion;

/// The collision surface of a body: the motion of its nodes in a substep, and trees of its triangles.
#[derive(Debug)]
pub(crate) struct CollisionSurface {
    /// Corners of the surface in the body's own order: nodes, and points bound to nodes. Sorted if the topology is
    /// fixed.
    pub nodes: Vec<u32>,
    pub edges: Vec<[u32; 2]>,
    pub triangles: Vec<[u32; 3]>,
    /// Edges of each triangle. Those marked with [`OWNED_ELSEWHERE`] are tested with another triangle.
    pub(super) triangle_edges: Vec<[u32; 3]>,
    pub(super) forest: Forest,
    /// Number of nodes, edges and triangles, including those that cuts may add.
    pub feature_capacity: usize,
    /// True if the surface is closed.
    pub is_closed: bool,
    /// True for edges that cross tissue at the start of the step.
    pub is_crossing: Vec<bool>,
    /// Curvature at edges, which decides whether they need edge-edge contact.
    pub(super) edge_curvatures: EdgeCurvatures,
    /// Maximum relative motion of nodes since the curvature was measured, m.
    motion_since_measured: f32,
    /// True if the curvature was measured again in this substep.
    pub(super) was_remeasured: bool,
    /// Number of crossing edges in the last search for them.
    pub crossings: u32,
    /// Origin of the body's coordinates.
    pub origin: DVec3,
    /// Node positions at the start of a step or substep, in the body's coordinates, and displacements relative to the
    /// center velocity, m.
    pub(super) motions: Vec<NodeMotion>,
    /// Mean velocities of nodes in the substep, m/s.
    pub velocities: Vec<Vec3A>,
    /// Predicted velocities after contact, m/s. Contacts are searched for with these velocities.
    pub predicted_velocities: Vec<Vec3A>,
    /// Changes of velocity by contact in the last substep of the step, m/s.
    pub(super) velocity_changes: Vec<Vec3A>,
    /// Center of the bounds of predicted velocities, m/s, and the maximum displacement relative to it, m.
    pub center_velocity: Vec3,
    pub displacement_spread: f32,
    /// Bounds of the motion of nodes since the last update, m.
    pub motion_bounds: Aabb,
    /// Bounds of the velocities after contact.
    pub velocity_bounds: Aabb,
    /// Accumulated deviation of each node from its predicted motion, due to impulses in the substep, m, and their
    /// maximum.
    pub deviations: Vec<f32>,
    pub max_deviation: f32,
    /// Initial length of short edges, m: the 5 % quantile of edges with a length.
    pub short_edge: f32,
    /// Initial extent along the longest axis, m.
    pub extent: f32,
    /// Initial node positions in the body's coordinates, if self-contact is on.
    pub(super) initial_positions: Option<Vectors>,
    /// Maximum displacement of a node, m.
    pub max_displacement: f32,
    /// True if contact with other bodies is on, and if it uses images.
    pub collides_with_bodies: bool,
    pub wants_images: bool,
    /// Pixel size of its images, m.
    pub resolution: f32,
    /// Images, if this surface or one that it collides with uses them.
    pub(super) images: Option<SurfaceImages>,
    /// Topology that cuts can change, if the body is cuttable.
    pub(super) topology: Option<Box<SurfaceTopology>>,
    /// True if the trees fit the current positions.
    trees_are_current: bool,
}

saved! { CollisionSurface {
    nodes, edges, triangles, triangle_edges, forest, feature_capacity, is_closed, is_crossing, edge_curvatures,
    motion_since_measured, was_remeasured, crossings, origin, motions, velocities, predicted_velocities,
    velocity_changes, center_velocity, displacement_spread, motion_bounds, velocity_bounds, deviations,
    max_deviation, short_edge, extent, initial_positions, max_displacement, collides_with_bodies, wants_images,
    resolution, images, topology, trees_are_current,
} }

/// Maximum initial distance of features that were one before a cut, as a fraction of the minimum thickness.
pub(super) const COINCIDENT_DISTANCE: f32 = 0.1;

/// Minimum depth at which edges of the two sides of a cut count as crossing, as a fraction of a short edge.
const CUT_CROSSING_DEPTH: f32 = 0.01;

/// Maximum distance over which a node inside another body is pushed out through a face, as a fraction of a short edge.
const EJECTION_DEPTH: f32 = 0.5;

/// Maximum distance of self-contact, as a fraction of a short edge. Neighbors would touch at larger distances.
const SELF_CONTACT_DISTANCE: f32 = 0.5;

/// Additional distance at which contacts are found, as a fraction of a short edge. Impulses of the same substep may
/// close it.
const SPECULATIVE_MARGIN: f32 = 0.02;

/// Contact distance of two features.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Clearance {
    /// Distance, m.
    pub radius: f32,
    /// True if a cut separated the features. They then begin closer than this distance without any pressure.
    pub is_cut_apart: bool,
}

impl Clearance {
    /// Returns the clearance of features that were never one.
    pub fn of(radius: f32) -> Self {
        Self {
            radius,
            is_cut_apart: false,
        }
    }
}

/// Marks the absence of an edge.
pub(super) const NONE: u32 = u32::MAX;

/// Mark on an edge of a triangle that is tested with another triangle.
pub(super) const OWNED_ELSEWHERE: u32 = 1 << 31;

/// Default resolution of images, in pixels per mean edge, and the maximum number of pixels along the longest axis.
const PIXELS_PER_EDGE: f32 = 2.0;
const MAX_PIXELS: f32 = 1024.0;

impl CollisionSurface {
    /// Creates the surface of a body that has triangles.
    pub fn new(body: &System) -> Result<Self> {
        let triangles = body.own_surface()?;
        let edges = mesh::edges(&triangles, &[])?;
        let mut triangle_edges = memory::filled([NONE; 3], triangles.len())?;
        let mut is_owned = memory::filled(false, edges.len())?;
        for (triangle_edges, &triangle) in triangle_edges.iter_mut().zip(&triangles) {
            for (slot, ends) in triangle_edges.iter_mut().zip(mesh::ends_of(triangle)) {
                if let Ok(edge) = edges.binary_search(&ends) {
                    let mark = if is_owned[edge] { OWNED_ELSEWHERE } else { 0 };
                    *slot = edge as u32 | mark;
                    is_owned[edge] = true;
                }
            }
        }
        let is_crossing = memory::filled(false, edges.len())?;
        let spare = body.spare_nodes();
        let mut nodes = memory::copied(triangles.as_flattened())?;
        memory::sort_once(&mut nodes);
        let positions = body.state.positions();
        let at = |node: u32| positions.get(node as usize);
        let forest = Forest::new(triangles.len(), |triangle| triangles[triangle as usize].map(at))?;
        let lengths = || edges.iter().map(|&[a, b]| at(a).distance(at(b)));
        let contact = &body.contact;
        let mut initial_positions = None;
        if contact.with_itself {
            let initial_positions = initial_positions.insert(body.zeros()?);
            if body.cut_properties.is_some() {
                // Cuts can expose inner nodes.
                (0..body.node_count()).for_each(|node| initial_positions.set(node, positions.get(node)));
            } else {
                nodes
                    .iter()
                    .for_each(|&node| initial_positions.set(node as usize, at(node)));
            }
        }
        let topology = match &body.cut_properties {
            Some(_) => Some(memory::boxed(SurfaceTopology::new(
                body,
                &nodes,
                edges.len(),
                &triangle_edges,
            )?)?),
            None => None,
        };
        let bounds = forest.bounds();
        let extent = (bounds.max - bounds.min).max_element();
        let wants_images = contact.with_bodies && contact.detection == Detection::ImageSpace;
        let resolution = if wants_images && contact.resolution > 0.0 {
            contact.resolution
        } else {
            let chosen = lengths().sum::<f32>() / (edges.len() as f32 * PIXELS_PER_EDGE);
            chosen.max(extent / MAX_PIXELS).max(f32::MIN_POSITIVE)
        };
        let mut surface = Self {
            extent,
            feature_capacity: nodes.len() + edges.len() + triangles.len(),
            short_edge: short_edge_length(lengths(), edges.len())?,
            initial_positions,
            max_displacement: 0.0,
            collides_with_bodies: contact.with_bodies,
            wants_images,
            resolution,
            images: None,
            nodes,
            edge_curvatures: EdgeCurvatures::new(body.node_count() + spare, edges.len() + 3 * spare)?,
            motion_since_measured: 0.0,
            was_remeasured: false,
            edges,
            triangle_edges,
            forest,
            is_closed: mesh::is_closed(&triangles)?,
            is_crossing,
            crossings: 0,
            origin: body.origin,
            motions: memory::filled(NodeMotion::default(), body.node_count())?,
            velocities: memory::filled(Vec3A::ZERO, body.node_count())?,
            predicted_velocities: memory::filled(Vec3A::ZERO, body.node_count())?,
            velocity_changes: memory::filled(Vec3A::ZERO, body.node_count())?,
            center_velocity: Vec3::ZERO,
            displacement_spread: 0.0,
            motion_bounds: Aabb::EMPTY,
            velocity_bounds: Aabb::EMPTY,
            deviations: memory::filled(0.0, body.node_count())?,
            max_deviation: 0.0,
            triangles,
            topology,
            trees_are_current: true,
        };
        surface.nodes.try_reserve_exact(spare)?;
        surface.deviations.try_reserve_exact(spare)?;
        surface.motions.try_reserve_exact(spare)?;
        for values in [
            &mut surface.velocities,
            &mut surface.predicted_velocities,
            &mut surface.velocity_changes,
        ] {
            values.try_reserve_exact(spare)?;
        }
        for values in [&mut surface.triangles, &mut surface.triangle_edges] {
            values.try_reserve_exact(2 * spare)?;
        }
        surface.edges.try_reserve_exact(3 * spare)?;
        surface.is_crossing.try_reserve_exact(3 * spare)?;
        surface.feature_capacity += 6 * spare;
        Ok(surface)
    }

    /// Returns the distance of self-contact, m, if it is on.
    pub fn self_contact_radius(&self, contact: &BodyContact) -> Option<f32> {
        let distance = (2.0 * contact.thickness).max(self.min_thickness());
        contact
            .with_itself
            .then_some(distance.min(SELF_CONTACT_DISTANCE * self.short_edge))
    }

    /// True if a node is a corner, or moves one.
    pub fn contains(&self, node: u32) -> bool {
        match &self.topology {
            Some(topology) => topology.contains(node),
            None => self.nodes.binary_search(&node).is_ok(),
        }
    }

    /// True if the body is cuttable.
    pub fn can_be_cut(&self) -> bool {
        self.topology.is_some()
    }

    /// Returns the surface exposed by cuts, if this is a solid with self-contact.
    pub(super) fn wound(&self) -> Option<&Wound> {
        self.topology.as_ref()?.wound.as_ref()
    }

    /// Returns the clearance between a node or edge and a point of an edge or face of the same body; `None` if they do
    /// not collide. `radius` is the full distance, m. Features that were initially nearer are exempt, because neighbors
    /// would touch. Features that cuts added collide as if without thickness, because nothing was between them.
    pub(super) fn clearance_between(
        &self,
        nodes: [u32; 2],
        (others, weights): (&[u32], [f32; 3]),
        radius: f32,
    ) -> Option<Clearance> {
        let initial_distance = self.initial_distance(nodes, others)?;
        let full_clearance = Clearance::of(radius);
        let Some(topology) = &self.topology else {
            return (initial_distance > radius).then_some(full_clearance);
        };
        let mut used_corners = others.iter().zip(weights).filter(|(_, weight)| *weight > 0.0);
        if let Some(wound) = &topology.wound
            && wound.contains(nodes.into_iter().chain(used_corners.clone().map(|(&other, _)| other)))
        {
            return None;
        }
        if initial_distance > radius {
            return Some(full_clearance);
        }
        let is_added = |node: u32| node >= topology.first_added_node;
        if !nodes.into_iter().any(is_added) && !used_corners.any(|(&other, _)| is_added(other)) {
            return None;
        }
        let min_thickness = self.min_thickness();
        let is_cut_apart = initial_distance <= COINCIDENT_DISTANCE * min_thickness;
        Some(Clearance {
            radius: if is_cut_apart {
                min_thickness
            } else {
                min_thickness.min(0.5 * initial_distance)
            },
            is_cut_apart,
        })
    }

    /// True if a node or edge and other features are all exposed by cuts. Such features collide only as parts
    /// of a wound.
    pub fn are_in_wound(&self, nodes: [u32; 2], others: &[u32]) -> bool {
        let wound = self.wound();
        wound.is_some_and(|wound| wound.contains(nodes.into_iter().chain(others.iter().copied())))
    }

    /// True if a corner or edge and others of the same body were initially nearer than `radius`, m, and so
    /// never collide.
    pub fn are_neighbors(&self, nodes: [u32; 2], others: &[u32], radius: f32) -> bool {
        let may_touch = match &self.topology {
            Some(topology) => {
                let is_added = |node: &u32| *node >= topology.first_added_node;
                nodes.iter().chain(others).any(is_added) || self.are_in_wound(nodes, others)
            }
            None => false,
        };
        !may_touch
            && self
                .initial_distance(nodes, others)
                .is_some_and(|initial_distance| initial_distance <= radius)
    }

    /// Returns the maximum depth from which a node inside this surface is pushed out through a face, m.
    pub fn ejection_depth(&self) -> f32 {
        EJECTION_DEPTH * self.short_edge
    }

    /// Returns the contact distance of a surface without thickness, m.
    pub fn min_thickness(&self) -> f32 {
        MIN_THICKNESS * self.short_edge
    }

    /// Returns the additional distance at which contacts are found, m. The smaller value of two surfaces applies.
    pub fn speculative_margin(&self) -> f32 {
        SPECULATIVE_MARGIN * self.short_edge
    }

    /// Returns the minimum depth at which an edge counts as crossing a triangle of the same body, m. Sides separated by
    /// a cut touch.
    pub fn crossing_depth(&self, edge: [u32; 2], triangle: &[u32]) -> f64 {
        let is_added = |first_node: u32| edge.iter().chain(triangle).any(|&node| node >= first_node);
        match &self.topology {
            Some(topology) if is_added(topology.first_added_node) => f64::from(CUT_CROSSING_DEPTH * self.short_edge),
            _ => 0.0,
        }
    }

    /// Returns the initial distance of a node or edge from an edge or face of the same body, m; `None` without
    /// self-contact.
    fn initial_distance(&self, nodes: [u32; 2], others: &[u32]) -> Option<f32> {
        self.initial_positions.as_ref().map(|initial_positions| {
            let at = |node: u32| Vec3A::from(initial_positions.get(node as usize));
            let corners = Corners::still(others.iter().map(|&other| at(other)));
            corners.separation(&Segment::still(nodes.map(at)), 0.0).offset.length()
        })
    }

    /// Creates images of the surface, if it has none.
    pub fn add_images(&mut self) -> Result<()> {
        if self.images.is_none() {
            self.images = Some(SurfaceImages::new(self)?);
        }
        Ok(())
    }

    /// Draws the part of the surface within these bounds.
    pub fn draw_images(&mut self, drawn_bounds: &Aabb) {
        if let Some(mut images) = self.images.take() {
            images.draw(self, drawn_bounds);
            self.images = Some(images);
        }
    }

    /// Calls `visit` with the triangles within `reach` of a box.
    pub fn visit_near(&self, bounds: &Aabb, reach: f32, visit: impl FnMut(usize)) {
        self.forest.near(bounds, reach, visit);
    }

    /// Returns the edge indices of a triangle.
    pub fn edges_of(&self, triangle: usize) -> [u32; 3] {
        self.triangle_edges[triangle].map(edge_index)
    }

    /// Returns the edges of a triangle that are tested with it. Each edge is tested with one triangle.
    pub fn owned_edges(&self, triangle: usize) -> [u32; 3] {
        self.triangle_edges[triangle].map(|edge| if edge & OWNED_ELSEWHERE == 0 { edge } else { NONE })
    }

    /// Returns an edge, whether it crosses tissue, and the curvature there; `None` if there is no such edge.
    #[inline]
    pub(super) fn edge(&self, index: u32) -> Option<([u32; 2], bool, EdgeCurvature)> {
        let index = index as usize;
        let edge = *self.edges.get(index)?;
        Some((edge, self.is_crossing[index], self.edge_curvatures.get(index)))
    }
}

/// Removes the mark from the edge of a triangle.
pub(super) fn edge_index(edge: u32) -> u32 {
    if edge == NONE { NONE } else { edge & !OWNED_ELSEWHERE }
}

/// Returns the 5 % quantile of the lengths above 0.
fn short_edge_length(lengths: impl Iterator<Item = f32>, count: usize) -> Result<f32> {
    let mut sorted = memory::reserved(count)?;
    sorted.extend(lengths.filter(|&length| length > 0.0));
    if sorted.is_empty() {
        return Ok(f32::MIN_POSITIVE);
    }
    let rank = sorted.len() / 20;
    Ok(*sorted.select_nth_unstable_by(rank, f32::total_cmp).1)
}
