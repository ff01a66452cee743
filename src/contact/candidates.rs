//! Which features of a body are near a tool: a list that stays good while nothing has moved far.

use glam::{DVec3, Vec3, Vec3A};

use super::features::{Feature, Features};
use super::mesh_solid::MeshSolid;
use super::nearest_plane::{LastMet, NearestPlane};
use super::path::ToolPath;
use super::room::{Room, sides_of};
use super::sweep::Corners;
use super::zone::{Zone, meets_mesh, met, sags, zone_bit};
use crate::base::{Result, memory};
use crate::codec::{saved, saved_enum};
use crate::def::CollisionFilter;
use crate::geometry::Bounds;
use crate::nodes::{Bindings, vector};
use crate::soa::Vectors;

/// A list that is good for so many substeps more is kept.
const WORTH_KEEPING: f32 = 4.0;

/// Features that can meet a tool before anything moves further than the slack that they were gathered with.
///
/// Being in the list has no other consequence than being looked at. Where a mesh is near, or the list is all nodes of one tool, when it was made may show in
/// the last bits all the same: planes through a mesh's closest points are kept as long as the list, and nodes are taken side by side.
#[derive(Debug)]
pub(super) struct Candidates {
    pub near: Vec<u32>,
    /// Which of the zones each of them may come to, a bit for each; the last bit stands for the rest too.
    pub masks: Vec<u32>,
    /// The room that the list covers, one for each tool that the body meets.
    zones: Vec<Zone>,
    /// How far nodes may still move, m.
    slack: f32,
    /// What is no further from a zone was gathered, m.
    reach: f32,
    /// How far things may go in a substep beyond what a usual list is good for, m.
    pub excess: f32,
    /// How far nodes might move since the list was made, m, and where they were then; below 0: it is not known.
    whole_slack: f32,
    firsts: Vectors,
    /// The corners of what is near, each once, and those of edges and faces first; none where only planes are.
    corners: Vec<Corner>,
    /// How many are those of edges and faces.
    shared: usize,
    /// Of each node, as the list was made, the closest point of the meshes that it may meet.
    surface: Vec<NearestPlane>,
    /// The same for the nodes of the list, as it was found last.
    pub planes: Vec<NearestPlane>,
    /// How the edges and faces of the list met a mesh last, those behind its nodes; none where no mesh is near.
    pub met: Vec<LastMet>,
    /// No edge of what is near can be longer while the list is good, m.
    longest: f32,
    /// Of each node, while the list is made, on which sides of all that the zones reach it is, a bit for each; then, of those that are
    /// corners, their place among them.
    marks: Vec<u32>,
}

saved! { Candidates {
    near, masks, zones, slack, reach, excess, whole_slack, firsts, corners, shared, longest, surface, planes, met, marks,
} }

/// A corner of what is near, over a slice.
#[derive(Clone, Copy, Debug)]
struct Corner {
    node: u32,
    /// On which sides of the room that is looked at it stays, a bit for each.
    sides: u32,
    start: Vec3,
    step: Vec3,
}

saved! { Corner { node, sides, start, step } }

saved_enum!(Zone { 0 => Box { slot, bounds }, 1 => Mesh { slot, bounds, standing, allowance }, 2 => Behind { slot, point, normal }, 3 => Between { first, last } });

impl Candidates {
    pub fn new(features: &Features) -> Result<Self> {
        Ok(Self {
            near: memory::reserved(features.count())?,
            masks: memory::reserved(features.count())?,
            zones: Vec::new(),
            slack: -1.0,
            reach: 0.0,
            excess: 0.0,
            whole_slack: -1.0,
            firsts: Vectors::zeros(features.node_count as usize)?,
            longest: 0.0,
            shared: 0,
            surface: Vec::new(),
            planes: Vec::new(),
            met: Vec::new(),
            corners: memory::reserved(features.node_count as usize)?,
            marks: memory::filled(0, features.node_count as usize)?,
        })
    }

    /// Makes room for so many features, of so many nodes.
    pub fn reserve_features(&mut self, count: usize, nodes: usize) -> Result<()> {
        memory::reserve(&mut self.near, count)?;
        memory::reserve(&mut self.masks, count)?;
        self.corners.try_reserve(nodes.saturating_sub(self.corners.len()))?;
        if !self.surface.is_empty() {
            self.reserve_met(count, nodes)?;
        }
        Ok(self.marks.try_reserve(nodes.saturating_sub(self.marks.len()))?)
    }

    /// Makes room for how these features meet meshes.
    pub fn reserve_meshes(&mut self, features: &Features) -> Result<()> {
        let nodes = features.node_count as usize;
        self.reserve_met(features.count(), nodes)?;
        self.surface.resize(nodes, NearestPlane::NONE);
        Ok(())
    }

    fn reserve_met(&mut self, count: usize, nodes: usize) -> Result<()> {
        memory::reserve(&mut self.surface, nodes)?;
        memory::reserve(&mut self.planes, nodes)?;
        memory::reserve(&mut self.met, count - nodes)
    }

    /// Makes room for `tools` tools.
    pub fn reserve(&mut self, tools: usize) -> Result<()> {
        self.zones.try_reserve(tools.saturating_sub(self.zones.len()))?;
        Ok(())
    }

    /// How many of what is near are nodes, which come first.
    pub fn node_count(&self, features: &Features) -> usize {
        self.near.partition_point(|&index| index < features.node_count)
    }

    pub fn near(&self) -> &[u32] {
        &self.near
    }

    /// Forgets the list.
    pub fn invalidate(&mut self) {
        self.slack = -1.0;
        self.whole_slack = -1.0;
    }

    /// A tool is gone, and another may come to its place.
    pub fn forget_tool(&mut self, slot: usize) {
        let planes = self.surface.iter_mut().chain(&mut self.planes);
        let planes = planes.filter(|plane| plane.slot as usize == slot);
        planes.for_each(|plane| *plane = NearestPlane::NONE);
        self.invalidate();
    }

    /// Whether the list is good for these tools on their ways and a body with this filter.
    pub fn covers(&self, tools: &[ToolPath], filter: CollisionFilter, origin: DVec3) -> bool {
        let mut zones = self.zones.iter();
        let are_covered = met(tools, filter).all(|tool| zones.next().is_some_and(|zone| zone.covers(tool, origin)));
        are_covered && zones.next().is_none()
    }

    /// Whether the list stays good while nodes move by so much more, m.
    pub fn lasts_for(&self, distance: f32) -> bool {
        self.slack >= distance
    }

    /// Takes `distance` from the slack: whether the list is still good when the nodes have moved so far.
    pub fn spend(&mut self, distance: f32) -> bool {
        self.slack -= distance;
        self.slack >= 0.0
    }

    /// Whether the list is still good, and for some time, by where the nodes have come to: what trembles spends much and goes nowhere.
    pub fn renew(&mut self, positions: &Vectors, distance: f32) -> bool {
        if self.whole_slack < 0.0 {
            return false;
        }
        let slack = self.whole_slack - self.firsts.largest_distance(positions);
        let is_good = slack >= WORTH_KEEPING * distance;
        if is_good {
            self.slack = slack - distance;
        }
        is_good
    }

    /// Makes the list anew: all features that can come within `margin` of a tool while no node moves further than
    /// `slack` and no tool leaves its way by more than `slack`; `tools` are those that the body meets.
    pub fn gather<'a>(
        &mut self,
        features: &Features,
        (positions, bindings): (&Vectors, Option<&Bindings>),
        tools: impl Iterator<Item = &'a ToolPath> + Clone,
        origin: DVec3,
        [margin, slack]: [f32; 2],
    ) {
        for (&node, plane) in self.near.iter().zip(&self.planes) {
            self.surface[node as usize] = *plane;
        }
        self.near.clear();
        self.masks.clear();
        self.corners.clear();
        self.zones.clear();
        self.slack = slack;
        for tool in tools.clone() {
            self.zones.push(Zone::of(tool, origin).extended(slack));
        }
        let reach = margin + slack;
        self.reach = reach;
        self.whole_slack = -1.0;
        if self.firsts.len() == positions.len() {
            self.firsts.copy_from(positions);
            self.whole_slack = slack;
        }
        let everything = Bounds::of(positions.iter());
        if !self.zones.iter().any(|zone| zone.meets(&everything, reach)) {
            return;
        }
        let boxes = self.zones.iter().any(Zone::is_bounded);
        // Only nodes can be the first to meet a plane.
        let count = if boxes {
            features.count()
        } else {
            features.node_count as usize
        };
        let is_told = self.find_sides((positions, bindings), reach);
        let meshes = || {
            let zones = self.zones.iter().zip(tools.clone());
            zones.filter_map(|(zone, tool)| Some((zone, tool.mesh()?)))
        };
        let has_meshes = meshes().next().is_some() && self.surface.len() == features.node_count as usize;
        if has_meshes {
            let edges = (features.node_count..count as u32).filter_map(|index| features.get(index));
            let edges = edges.map(|edge| longest_edge(&corners_of(edge, (positions, bindings))[..edge.nodes().len()]));
            // Where one corner is near, the others are known too.
            let within = reach + 2.0 * edges.fold(0.0, f32::max);
            measure_nodes(&mut self.surface, (positions, bindings), meshes(), within);
        }
        // What was found where a node was nearly is not looked for again.
        let flat = meshes().map(|(_, solid)| solid.flat()).fold(0.0, f32::max);
        self.planes.clear();
        self.met.clear();
        for index in 0..count as u32 {
            let Some(feature) = features.get(index) else {
                continue;
            };
            let sides = |node: &u32| self.marks[*node as usize];
            if is_told && feature.nodes().iter().map(sides).fold(!0, |all, one| all & one) != 0 {
                continue;
            }
            if is_hidden(feature, bindings) {
                continue;
            }
            let corners = corners_of(feature, (positions, bindings));
            let corners = &corners[..feature.nodes().len()];
            let bounds = Bounds::of(corners.iter().copied());
            // Where a sheet is stretched a tool is the smaller beside its edges.
            let length = features.length(index).max(longest_edge(corners));
            let meets = |(zone, tool): (&Zone, &ToolPath)| {
                (corners.len() == 1 || zone.is_bounded())
                    && zone.meets(&bounds, reach)
                    && tool.radius().is_none_or(|radius| sags(corners.len(), length, radius))
                    && (tool.mesh().is_none() || !has_meshes)
            };
            let of_meshes = has_meshes && meets_mesh(&self.surface, (feature, length), corners, meshes(), reach + flat);
            let mask = self.zones.iter().zip(tools.clone()).enumerate();
            let mask = mask.filter(|&(_, (zone, tool))| of_meshes && tool.mesh().is_some() || meets((zone, tool)));
            let mask = mask.fold(0, |mask, (place, _)| mask | zone_bit(place));
            if mask != 0 {
                self.near.push(index);
                self.masks.push(mask);
                if has_meshes && corners.len() == 1 {
                    self.planes.push(self.surface[index as usize]);
                } else if has_meshes {
                    self.met.push(LastMet::NONE);
                }
            }
        }
        self.list_corners(features, (positions, bindings));
    }

    fn list_corners(&mut self, features: &Features, places: (&Vectors, Option<&Bindings>)) {
        const NOT_LISTED: u32 = u32::MAX;
        let Self {
            near, corners, marks, ..
        } = self;
        corners.clear();
        self.shared = 0;
        if !self.zones.iter().any(Zone::is_bounded) {
            return;
        }
        let nodes = near.partition_point(|&index| index < features.node_count);
        let (nodes, shared) = near.split_at(nodes);
        let edges_first = || shared.iter().chain(nodes).filter_map(|&index| features.get(index));
        let mut longest = 0.0_f32;
        for feature in edges_first() {
            feature
                .nodes()
                .iter()
                .for_each(|&node| marks[node as usize] = NOT_LISTED);
            let corners = corners_of(feature, places);
            for (end, corner) in corners[..feature.nodes().len()].iter().enumerate() {
                let edges = corners[..end].iter().map(|other| corner.distance_squared(*other));
                longest = edges.fold(longest, f32::max);
            }
        }
        for feature in edges_first() {
            for &node in feature.nodes() {
                let mark = &mut marks[node as usize];
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
                self.shared = corners.len();
            }
        }
        // Both of its ends may move.
        self.longest = longest.sqrt() + 2.0 * self.reach;
    }

    /// Sees where in a slice the corners of what is near, or only those of edges and faces, start and how far they go, and on which sides of the room
    /// they stay.
    pub fn see_corners(&mut self, room: &Room, only_shared: bool, way_of: impl Fn(usize) -> (Vec3, Vec3)) {
        let count = if only_shared { self.shared } else { self.corners.len() };
        for corner in &mut self.corners[..count] {
            (corner.start, corner.step) = way_of(corner.node as usize);
            corner.sides = room.sides(corner.start, corner.step, self.longest);
        }
    }

    /// The nodes of all features that are near.
    pub fn corner_nodes(&self) -> impl Iterator<Item = usize> {
        self.corners.iter().map(|corner| corner.node as usize)
    }

    /// The corners of a feature that is near; `None` where all are on one side of the room: then it does not come there.
    #[inline]
    pub fn corners(&self, feature: Feature) -> Option<Corners> {
        let mut corners = Corners {
            points: [Vec3A::ZERO; 3],
            steps: [Vec3A::ZERO; 3],
            count: feature.nodes().len(),
        };
        let mut sides = !0;
        for (place, &node) in feature.nodes().iter().enumerate() {
            let corner = &self.corners[self.marks[node as usize] as usize];
            sides &= corner.sides;
            (corners.points[place], corners.steps[place]) = (corner.start.into(), corner.step.into());
        }
        (sides == 0).then_some(corners)
    }

    /// Finds on which sides of a box about all zones nodes are: what has all of its corners on one side meets none. Not where a zone has no end, or
    /// nodes have been added.
    fn find_sides(&mut self, (positions, bindings): (&Vectors, Option<&Bindings>), reach: f32) -> bool {
        let mut all = Bounds::EMPTY;
        for zone in &self.zones {
            let (Zone::Box { bounds, .. } | Zone::Mesh { bounds, .. }) = zone else {
                return false;
            };
            all = all.and(&bounds.extended(reach));
        }
        if self.marks.len() != positions.len() {
            return false;
        }
        for (node, sides) in self.marks.iter_mut().enumerate() {
            let place = vector(bindings, positions, node);
            *sides = sides_of(&all, place);
        }
        true
    }

    /// The features have changed, of which there were so many nodes, edges and faces, and these are `fresh`: the list stays as good as it
    /// was, and what has become hidden is not on it. There is room.
    pub fn change(
        &mut self,
        features: &Features,
        before: [u32; 3],
        fresh: &mut Vec<u32>,
        (positions, bindings): (&Vectors, &Bindings),
    ) {
        self.whole_slack = -1.0;
        self.marks.resize(features.node_count as usize, 0);
        let has_meshes = !self.surface.is_empty();
        if has_meshes {
            self.surface.resize(features.node_count as usize, NearestPlane::NONE);
        }
        self.planes.clear();
        self.met.clear();
        if self.slack < 0.0 {
            return;
        }
        let [nodes, edges, _] = before;
        let [more_nodes, more_edges] = [0, 1].map(|kind| features.counts()[kind] - before[kind]);
        for index in &mut self.near {
            if *index >= nodes + edges {
                *index += more_nodes + more_edges;
            } else if *index >= nodes {
                *index += more_nodes;
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
            let bounds = Bounds::of(corners.iter().copied());
            let meets = |zone: &Zone| (corners.len() == 1 || zone.is_bounded()) && zone.meets(&bounds, self.reach);
            self.zones.iter().any(meets) && self.near.binary_search(&index).is_err()
        });
        memory::merge(&mut self.near, fresh, |&index| index);
        let nodes = self.node_count(features);
        if has_meshes {
            self.planes.resize(nodes, NearestPlane::NONE);
            self.met.resize(self.near.len() - nodes, LastMet::NONE);
        }
        self.masks.clear();
        self.masks.resize(self.near.len(), !0);
        self.list_corners(features, (positions, Some(bindings)));
    }
}

/// Whether it is a node that nobody draws or touches.
fn is_hidden(feature: Feature, bindings: Option<&Bindings>) -> bool {
    match (feature.nodes(), bindings) {
        (&[node], Some(bindings)) => bindings.is_hidden(node),
        _ => false,
    }
}

/// Where the corners of a feature are.
#[inline]
fn corners_of(feature: Feature, (positions, bindings): (&Vectors, Option<&Bindings>)) -> [Vec3; 3] {
    let mut corners = [Vec3::ZERO; 3];
    for (corner, &node) in corners.iter_mut().zip(feature.nodes()) {
        *corner = vector(bindings, positions, node as usize);
    }
    corners
}

/// The length of the longest edge between these corners, m.
pub(super) fn longest_edge(corners: &[Vec3]) -> f32 {
    let from = |start: usize| {
        corners[start + 1..]
            .iter()
            .map(move |end| end.distance_squared(corners[start]))
    };
    (0..corners.len()).flat_map(from).fold(0.0, f32::max).sqrt()
}

/// Finds the point of the meshes that is closest to each node, where that is no further than `within` and what the mesh may move. Of a mesh alone it is
/// known already where a node has hardly moved.
fn measure_nodes<'a>(
    surface: &mut [NearestPlane],
    (positions, bindings): (&Vectors, Option<&Bindings>),
    meshes: impl Iterator<Item = (&'a Zone, &'a MeshSolid)> + Clone,
    within: f32,
) {
    let is_one = meshes.clone().nth(1).is_none();
    for (node, nearest) in surface.iter_mut().enumerate() {
        let mut last = std::mem::replace(nearest, NearestPlane::NONE);
        let place = vector(bindings, positions, node);
        for (zone, solid) in meshes.clone() {
            let &Zone::Mesh {
                slot,
                bounds,
                standing,
                allowance,
            } = zone
            else {
                continue;
            };
            if sides_of(&bounds.extended(within), place) != 0 {
                continue;
            }
            let point = standing.own(place);
            if is_one && last.serves(slot, point, [solid.flat(), within + allowance]) {
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
            } else if is_one {
                *nearest = NearestPlane::beyond(slot, point, reach);
            }
        }
    }
}
