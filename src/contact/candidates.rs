//! The list of features near the tools of a body. It stays valid until something has moved far enough.

use glam::{DVec3, Vec3, Vec3A};

use super::features::{Feature, Features};
use super::mesh_solid::MeshSolid;
use super::nearest_plane::{LastDistance, NearestPlane};
use super::path::ToolPath;
use super::swept_bounds::{SliceBounds, outer_sides};
use super::time_of_impact::Corners;
use super::zone::{Zone, filtered_tools, may_touch_mesh, sags, zone_bit};
use crate::base::{Result, memory};
use crate::codec::{saved, saved_enum};
use crate::def::CollisionFilter;
use crate::geometry::Aabb;
use crate::nodes::{Bindings, vector};
use crate::soa::Vectors;

/// A list is renewed only if its slack lasts for at least this many substeps.
const MIN_REUSED_SUBSTEPS: f32 = 4.0;

/// Features that can touch a tool before anything moves further than the slack.
///
/// Listing a feature only causes it to be tested. Results may still differ in the last bits with
/// the time at which the list was built: planes through a mesh's closest points live as long as the list, and nodes of
/// one tool are solved in batches.
#[derive(Debug)]
pub(super) struct Candidates {
    pub near: Vec<u32>,
    /// The zones that each feature may reach, one bit per zone. The last bit stands for all further zones.
    pub zone_masks: Vec<u32>,
    /// The region that the list covers for each tool that the body collides with.
    zones: Vec<Zone>,
    /// Distance that nodes may still move, m.
    slack: f32,
    /// Distance from a zone within which features are listed, m.
    reach: f32,
    /// How much further bodies can move per substep than a usual list allows for, m.
    pub excess_travel: f32,
    /// Slack of the list when it was built, m, and the node positions at that time. A negative value means that they
    /// are unknown.
    initial_slack: f32,
    initial_positions: Vectors,
    /// The corners of all listed features, each once, those of edges and faces first. Empty if all tools are planes.
    corners: Vec<Corner>,
    /// Number of corners of edges and faces.
    shared_count: usize,
    /// The closest point of the meshes to each node, as of when the list was built.
    node_planes: Vec<NearestPlane>,
    /// The latest closest point of the meshes to each listed node.
    pub planes: Vec<NearestPlane>,
    /// The latest distance from a mesh to each listed edge and face. Empty if no mesh is near.
    pub mesh_distances: Vec<LastDistance>,
    /// Bound on the length of any listed edge while the list is valid, m.
    max_edge: f32,
    /// During a build: the sides of the box of all zones on which each node lies, one bit per side. Afterward: the
    /// index of each node among the corners.
    node_marks: Vec<u32>,
}

saved! { Candidates {
    near, zone_masks, zones, slack, reach, excess_travel, initial_slack, initial_positions, corners, shared_count,
    max_edge, node_planes, planes, mesh_distances, node_marks,
} }

/// A corner of a listed feature, with its motion over a slice.
#[derive(Clone, Copy, Debug)]
struct Corner {
    node: u32,
    /// The sides of the slice's bounds on which it stays, one bit per side.
    sides: u32,
    start: Vec3,
    step: Vec3,
}

saved! { Corner { node, sides, start, step } }

saved_enum!(Zone { 0 => Box { slot, bounds }, 1 => Mesh { slot, bounds, placement, allowance }, 2 => StaticPlane { slot, point, normal }, 3 => MovingPlane { first, last } });

impl Candidates {
    pub fn new(features: &Features) -> Result<Self> {
        Ok(Self {
            near: memory::reserved(features.count())?,
            zone_masks: memory::reserved(features.count())?,
            zones: Vec::new(),
            slack: -1.0,
            reach: 0.0,
            excess_travel: 0.0,
            initial_slack: -1.0,
            initial_positions: Vectors::zeros(features.node_count as usize)?,
            max_edge: 0.0,
            shared_count: 0,
            node_planes: Vec::new(),
            planes: Vec::new(),
            mesh_distances: Vec::new(),
            corners: memory::reserved(features.node_count as usize)?,
            node_marks: memory::filled(0, features.node_count as usize)?,
        })
    }

    /// Reserves memory for `count` features with `nodes` nodes.
    pub fn reserve_features(&mut self, count: usize, nodes: usize) -> Result<()> {
        memory::reserve(&mut self.near, count)?;
        memory::reserve(&mut self.zone_masks, count)?;
        self.corners.try_reserve(nodes.saturating_sub(self.corners.len()))?;
        if !self.node_planes.is_empty() {
            self.reserve_mesh_distances(count, nodes)?;
        }
        Ok(self
            .node_marks
            .try_reserve(nodes.saturating_sub(self.node_marks.len()))?)
    }

    /// Reserves memory for the distances from these features to meshes.
    pub fn reserve_meshes(&mut self, features: &Features) -> Result<()> {
        let nodes = features.node_count as usize;
        self.reserve_mesh_distances(features.count(), nodes)?;
        self.node_planes.resize(nodes, NearestPlane::NONE);
        Ok(())
    }

    fn reserve_mesh_distances(&mut self, count: usize, nodes: usize) -> Result<()> {
        memory::reserve(&mut self.node_planes, nodes)?;
        memory::reserve(&mut self.planes, nodes)?;
        memory::reserve(&mut self.mesh_distances, count - nodes)
    }

    /// Reserves memory for `tools` tools.
    pub fn reserve(&mut self, tools: usize) -> Result<()> {
        self.zones.try_reserve(tools.saturating_sub(self.zones.len()))?;
        Ok(())
    }

    /// The number of listed nodes. They precede edges and faces.
    pub fn node_count(&self, features: &Features) -> usize {
        self.near.partition_point(|&index| index < features.node_count)
    }

    pub fn near(&self) -> &[u32] {
        &self.near
    }

    /// Invalidates the list.
    pub fn invalidate(&mut self) {
        self.slack = -1.0;
        self.initial_slack = -1.0;
    }

    /// Removes a tool whose slot another tool may take.
    pub fn remove_tool(&mut self, slot: usize) {
        let planes = self.node_planes.iter_mut().chain(&mut self.planes);
        let planes = planes.filter(|plane| plane.slot as usize == slot);
        planes.for_each(|plane| *plane = NearestPlane::NONE);
        self.invalidate();
    }

    /// True if the list is valid for these tools along their paths and for a body with this filter.
    pub fn covers(&self, tools: &[ToolPath], filter: CollisionFilter, origin: DVec3) -> bool {
        let mut zones = self.zones.iter();
        let are_covered =
            filtered_tools(tools, filter).all(|tool| zones.next().is_some_and(|zone| zone.covers(tool, origin)));
        are_covered && zones.next().is_none()
    }

    /// True if the list stays valid while nodes move by `distance`, m.
    pub fn has_slack_for(&self, distance: f32) -> bool {
        self.slack >= distance
    }

    /// Subtracts `distance` from the slack. Returns true if the list is still valid after nodes have moved that far.
    pub fn spend_slack(&mut self, distance: f32) -> bool {
        self.slack -= distance;
        self.slack >= 0.0
    }

    /// Recomputes the slack from the node positions. Returns true if the list stays valid for several substeps.
    /// Oscillating nodes spend slack without going anywhere.
    pub fn extend_validity(&mut self, positions: &Vectors, distance: f32) -> bool {
        if self.initial_slack < 0.0 {
            return false;
        }
        let slack = self.initial_slack - self.initial_positions.largest_distance(positions);
        let is_good = slack >= MIN_REUSED_SUBSTEPS * distance;
        if is_good {
            self.slack = slack - distance;
        }
        is_good
    }

    /// Rebuilds the list: all features that can come within `margin` of a tool while no node moves further than `slack`
    /// and no tool leaves its path by more than `slack`. `tools` are the tools that the body collides with.
    pub fn gather<'a>(
        &mut self,
        features: &Features,
        (positions, bindings): (&Vectors, Option<&Bindings>),
        tools: impl Iterator<Item = &'a ToolPath> + Clone,
        origin: DVec3,
        [margin, slack]: [f32; 2],
    ) {
        for (&node, plane) in self.near.iter().zip(&self.planes) {
            self.node_planes[node as usize] = *plane;
        }
        self.near.clear();
        self.zone_masks.clear();
        self.corners.clear();
        self.zones.clear();
        self.slack = slack;
        for tool in tools.clone() {
            self.zones.push(Zone::for_tool(tool, origin).extended(slack));
        }
        let reach = margin + slack;
        self.reach = reach;
        self.initial_slack = -1.0;
        if self.initial_positions.len() == positions.len() {
            self.initial_positions.copy_from(positions);
            self.initial_slack = slack;
        }
        let everything = Aabb::of(positions.iter());
        if !self.zones.iter().any(|zone| zone.meets(&everything, reach)) {
            return;
        }
        let has_bounded = self.zones.iter().any(Zone::is_bounded);
        // Only a node can be the first feature to touch a plane.
        let count = if has_bounded {
            features.count()
        } else {
            features.node_count as usize
        };
        let has_sides = self.classify_nodes((positions, bindings), reach);
        let meshes = || {
            let zones = self.zones.iter().zip(tools.clone());
            zones.filter_map(|(zone, tool)| Some((zone, tool.mesh()?)))
        };
        let has_meshes = meshes().next().is_some() && self.node_planes.len() == features.node_count as usize;
        if has_meshes {
            let edges = (features.node_count..count as u32).filter_map(|index| features.get(index));
            let edges = edges.map(|edge| longest_edge(&corners_of(edge, (positions, bindings))[..edge.nodes().len()]));
            // If one corner of a feature is near, the planes of its other corners are known too.
            let query_distance = reach + 2.0 * edges.fold(0.0, f32::max);
            update_node_planes(&mut self.node_planes, (positions, bindings), meshes(), query_distance);
        }
        // A node that has hardly moved keeps its closest point, so the reach includes the meshes' flat distance.
        let flat = meshes().map(|(_, solid)| solid.flat()).fold(0.0, f32::max);
        self.planes.clear();
        self.mesh_distances.clear();
        for index in 0..count as u32 {
            let Some(feature) = features.get(index) else {
                continue;
            };
            let sides = |node: &u32| self.node_marks[*node as usize];
            if has_sides && feature.nodes().iter().map(sides).fold(!0, |all, one| all & one) != 0 {
                continue;
            }
            if is_hidden(feature, bindings) {
                continue;
            }
            let corners = corners_of(feature, (positions, bindings));
            let corners = &corners[..feature.nodes().len()];
            let bounds = Aabb::of(corners.iter().copied());
            // Stretching a sheet makes a tool smaller relative to its edges.
            let length = features.length(index).max(longest_edge(corners));
            let meets = |(zone, tool): (&Zone, &ToolPath)| {
                (corners.len() == 1 || zone.is_bounded())
                    && zone.meets(&bounds, reach)
                    && tool.radius().is_none_or(|radius| sags(corners.len(), length, radius))
                    && (tool.mesh().is_none() || !has_meshes)
            };
            let near_mesh =
                has_meshes && may_touch_mesh(&self.node_planes, (feature, length), corners, meshes(), reach + flat);
            let mask = self.zones.iter().zip(tools.clone()).enumerate();
            let mask = mask.filter(|&(_, (zone, tool))| near_mesh && tool.mesh().is_some() || meets((zone, tool)));
            let mask = mask.fold(0, |mask, (zone_index, _)| mask | zone_bit(zone_index));
            if mask != 0 {
                self.near.push(index);
                self.zone_masks.push(mask);
                if has_meshes && corners.len() == 1 {
                    self.planes.push(self.node_planes[index as usize]);
                } else if has_meshes {
                    self.mesh_distances.push(LastDistance::NONE);
                }
            }
        }
        self.list_corners(features, (positions, bindings));
    }

    fn list_corners(&mut self, features: &Features, state: (&Vectors, Option<&Bindings>)) {
        const NOT_LISTED: u32 = u32::MAX;
        let Self {
            near,
            corners,
            node_marks,
            ..
        } = self;
        corners.clear();
        self.shared_count = 0;
        if !self.zones.iter().any(Zone::is_bounded) {
            return;
        }
        let nodes = near.partition_point(|&index| index < features.node_count);
        let (nodes, edges_and_faces) = near.split_at(nodes);
        let edges_first = || {
            edges_and_faces
                .iter()
                .chain(nodes)
                .filter_map(|&index| features.get(index))
        };
        let mut longest_squared = 0.0_f32;
        for feature in edges_first() {
            feature
                .nodes()
                .iter()
                .for_each(|&node| node_marks[node as usize] = NOT_LISTED);
            let corners = corners_of(feature, state);
            for (end, corner) in corners[..feature.nodes().len()].iter().enumerate() {
                let squared_lengths = corners[..end].iter().map(|other| corner.distance_squared(*other));
                longest_squared = squared_lengths.fold(longest_squared, f32::max);
            }
        }
        for feature in edges_first() {
            for &node in feature.nodes() {
                let mark = &mut node_marks[node as usize];
                if *mark == NOT_LISTED {
                    *mark = corners.len() as u32;
                    corners.push(Corner {
                        node,
                        sides: 0,
                        start: Vec3::ZERO,
                        step: Vec3::ZERO,
                    });
                }
            }
            if feature.nodes().len() > 1 {
                self.shared_count = corners.len();
            }
        }
        // Both ends of an edge may move.
        self.max_edge = longest_squared.sqrt() + 2.0 * self.reach;
    }

    /// Updates the motion of the listed corners over a slice, and the sides of the slice's bounds on which they stay.
    /// With `without_nodes`, corners of nodes alone are skipped.
    pub fn update_corners(
        &mut self,
        bounds: &SliceBounds,
        without_nodes: bool,
        motion_of: impl Fn(usize) -> (Vec3, Vec3),
    ) {
        let count = if without_nodes {
            self.shared_count
        } else {
            self.corners.len()
        };
        for corner in &mut self.corners[..count] {
            (corner.start, corner.step) = motion_of(corner.node as usize);
            corner.sides = bounds.sides(corner.start, corner.step, self.max_edge);
        }
    }

    /// The nodes of all listed features.
    pub fn corner_nodes(&self) -> impl Iterator<Item = usize> {
        self.corners.iter().map(|corner| corner.node as usize)
    }

    /// The corners of a listed feature. `None` if all of them stay on one side of the slice's bounds: then the feature
    /// is outside.
    #[inline]
    pub fn corners(&self, feature: Feature) -> Option<Corners> {
        let mut corners = Corners {
            points: [Vec3A::ZERO; 3],
            steps: [Vec3A::ZERO; 3],
            count: feature.nodes().len(),
        };
        let mut sides = !0;
        for (index, &node) in feature.nodes().iter().enumerate() {
            let corner = &self.corners[self.node_marks[node as usize] as usize];
            sides &= corner.sides;
            (corners.points[index], corners.steps[index]) = (corner.start.into(), corner.step.into());
        }
        (sides == 0).then_some(corners)
    }

    /// Classifies nodes against a box around all zones. A feature whose corners all lie on one side of the box meets no
    /// zone. Returns false if a zone is unbounded or nodes have been added.
    fn classify_nodes(&mut self, (positions, bindings): (&Vectors, Option<&Bindings>), reach: f32) -> bool {
        let mut all = Aabb::EMPTY;
        for zone in &self.zones {
            let (Zone::Box { bounds, .. } | Zone::Mesh { bounds, .. }) = zone else {
                return false;
            };
            all = all.and(&bounds.extended(reach));
        }
        if self.node_marks.len() != positions.len() {
            return false;
        }
        for (node, sides) in self.node_marks.iter_mut().enumerate() {
            let position = vector(bindings, positions, node);
            *sides = outer_sides(&all, position);
        }
        true
    }

    /// Updates the list after a change of the features. `previous_counts` counts the nodes, edges and faces; `fresh`
    /// lists new features. The list stays as valid as it was, and newly hidden nodes leave it. The memory is reserved.
    pub fn apply_change(
        &mut self,
        features: &Features,
        previous_counts: [u32; 3],
        fresh: &mut Vec<u32>,
        (positions, bindings): (&Vectors, &Bindings),
    ) {
        self.initial_slack = -1.0;
        self.node_marks.resize(features.node_count as usize, 0);
        let has_meshes = !self.node_planes.is_empty();
        if has_meshes {
            self.node_planes
                .resize(features.node_count as usize, NearestPlane::NONE);
        }
        self.planes.clear();
        self.mesh_distances.clear();
        if self.slack < 0.0 {
            return;
        }
        let [nodes, edges, _] = previous_counts;
        let [added_nodes, added_edges] = [0, 1].map(|kind| features.counts()[kind] - previous_counts[kind]);
        for index in &mut self.near {
            if *index >= nodes + edges {
                *index += added_nodes + added_edges;
            } else if *index >= nodes {
                *index += added_nodes;
            }
        }
        let is_visible = |index: &u32| *index >= features.node_count || !bindings.is_hidden(*index);
        self.near.retain(is_visible);
        memory::sort_once(fresh);
        fresh.retain(|&index| {
            let Some(feature) = features.get(index) else {
                return false;
            };
            let corners = corners_of(feature, (positions, Some(bindings)));
            let corners = &corners[..feature.nodes().len()];
            let bounds = Aabb::of(corners.iter().copied());
            let meets = |zone: &Zone| (corners.len() == 1 || zone.is_bounded()) && zone.meets(&bounds, self.reach);
            self.zones.iter().any(meets) && self.near.binary_search(&index).is_err()
        });
        memory::merge(&mut self.near, fresh, |&index| index);
        let nodes = self.node_count(features);
        if has_meshes {
            self.planes.resize(nodes, NearestPlane::NONE);
            self.mesh_distances.resize(self.near.len() - nodes, LastDistance::NONE);
        }
        self.zone_masks.clear();
        self.zone_masks.resize(self.near.len(), !0);
        self.list_corners(features, (positions, Some(bindings)));
    }
}

/// True for a node that is neither drawn nor touched.
fn is_hidden(feature: Feature, bindings: Option<&Bindings>) -> bool {
    match (feature.nodes(), bindings) {
        (&[node], Some(bindings)) => bindings.is_hidden(node),
        _ => false,
    }
}

/// The positions of a feature's corners.
#[inline]
fn corners_of(feature: Feature, (positions, bindings): (&Vectors, Option<&Bindings>)) -> [Vec3; 3] {
    let mut corners = [Vec3::ZERO; 3];
    for (corner, &node) in corners.iter_mut().zip(feature.nodes()) {
        *corner = vector(bindings, positions, node as usize);
    }
    corners
}

/// Length of the longest edge between these corners, m.
pub(super) fn longest_edge(corners: &[Vec3]) -> f32 {
    let from = |start: usize| {
        corners[start + 1..]
            .iter()
            .map(move |end| end.distance_squared(corners[start]))
    };
    (0..corners.len()).flat_map(from).fold(0.0, f32::max).sqrt()
}

/// Finds the meshes' closest point to each node, within `within` plus the allowance of the mesh. With a single mesh, a
/// node that has hardly moved keeps its last result.
fn update_node_planes<'a>(
    node_planes: &mut [NearestPlane],
    (positions, bindings): (&Vectors, Option<&Bindings>),
    meshes: impl Iterator<Item = (&'a Zone, &'a MeshSolid)> + Clone,
    within: f32,
) {
    let is_single = meshes.clone().nth(1).is_none();
    for (node, nearest) in node_planes.iter_mut().enumerate() {
        let mut last = std::mem::replace(nearest, NearestPlane::NONE);
        let position = vector(bindings, positions, node);
        for (zone, solid) in meshes.clone() {
            let &Zone::Mesh {
                slot,
                bounds,
                placement,
                allowance,
            } = zone
            else {
                continue;
            };
            if outer_sides(&bounds.extended(within), position) != 0 {
                continue;
            }
            let point = placement.body_to_local(position);
            if is_single && last.is_valid_at(slot, point, [solid.flat(), within + allowance]) {
                *nearest = last;
                continue;
            }
            let reach = (within + allowance).min(nearest.distance);
            if let Some(closest) = solid.closest(&[point], reach, false) {
                *nearest = NearestPlane {
                    slot: slot as u32,
                    point,
                    distance: closest.distance,
                    normal: closest.normal,
                };
            } else if is_single {
                *nearest = NearestPlane::farther_than(slot, point, reach);
            }
        }
    }
}
