//! Zones: the regions in which features may touch a tool.

use glam::{DVec3, Vec3};

use super::candidates::longest_edge;
use super::features::Feature;
use super::mesh_solid::MeshSolid;
use super::nearest_plane::NearestPlane;
use super::path::{MeshPose, PosedShape, ToolPath};
use crate::def::CollisionFilter;
use crate::geometry::Aabb;

/// Maximum penetration of an edge or face of a sheet below its corners, as a fraction of the tool's radius or of half a
/// mesh's least extent. If an edge or face cannot go deeper, only its corners collide with the tool.
const SAG: f32 = 0.04;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Zone {
    /// The swept bounds of a tool, with the slack that nodes need.
    Box { slot: usize, bounds: Aabb },
    /// The bounds of a mesh at this placement. They are valid while none of its points is displaced by more than
    /// `allowance`, m.
    Mesh {
        slot: usize,
        bounds: Aabb,
        placement: MeshPose,
        allowance: f32,
    },
    /// The half-space behind a plane at rest.
    StaticPlane { slot: usize, point: Vec3, normal: Vec3 },
    /// The region that a moving plane sweeps.
    MovingPlane { first: (Vec3, Vec3), last: (Vec3, Vec3) },
}

impl Zone {
    pub(super) fn for_tool(tool: &ToolPath, origin: DVec3) -> Self {
        if let Some(sweep) = tool.sweep(origin) {
            let (slot, bounds) = (tool.slot, sweep.bounds);
            return match tool.shape_at(tool.begin(), origin) {
                PosedShape::Mesh(placement) => Zone::Mesh {
                    slot,
                    bounds,
                    placement,
                    allowance: sweep.travel,
                },
                _ => Zone::Box { slot, bounds },
            };
        }
        let plane = |fraction: f64| match tool.shape_at(fraction, origin) {
            PosedShape::HalfSpace { point, normal } => (point, normal),
            PosedShape::Rounded { a, .. } => (a, Vec3::Y),
            PosedShape::Mesh(placement) => (placement.center, Vec3::Y),
        };
        let (first, last) = (plane(0.0), plane(1.0));
        if first == last {
            Zone::StaticPlane {
                slot: tool.slot,
                point: first.0,
                normal: first.1,
            }
        } else {
            Zone::MovingPlane { first, last }
        }
    }

    pub(super) fn is_bounded(&self) -> bool {
        matches!(self, Zone::Box { .. } | Zone::Mesh { .. })
    }

    /// The zone extended by `slack`, m.
    pub(super) fn extended(mut self, slack: f32) -> Self {
        if let Zone::Box { bounds, .. } | Zone::Mesh { bounds, .. } = &mut self {
            *bounds = bounds.extended(slack);
        }
        if let Zone::Mesh { allowance, .. } = &mut self {
            *allowance += slack;
        }
        self
    }

    /// True if the zone is valid for this tool along its path.
    pub(super) fn covers(&self, tool: &ToolPath, origin: DVec3) -> bool {
        match (*self, Zone::for_tool(tool, origin)) {
            (
                Zone::Box { slot, bounds },
                Zone::Box {
                    slot: other,
                    bounds: swept,
                },
            ) => slot == other && bounds.contains(&swept),
            (
                Zone::Mesh {
                    slot,
                    placement,
                    allowance,
                    ..
                },
                Zone::Mesh { slot: other, .. },
            ) => slot == other && tool.max_distance_from(&placement, origin) <= allowance,
            (behind @ Zone::StaticPlane { .. }, other) => behind == other,
            _ => false,
        }
    }

    /// True if something within `bounds` may enter the zone by moving `reach`.
    pub(super) fn meets(&self, bounds: &Aabb, reach: f32) -> bool {
        let behind = |point: Vec3, normal: Vec3| {
            // Tests the box's lowest corner against the plane.
            let lowest = Vec3::select(normal.cmpge(Vec3::ZERO), bounds.min, bounds.max);
            (lowest - point).dot(normal) <= reach
        };
        match *self {
            Zone::Box { bounds: zone, .. } | Zone::Mesh { bounds: zone, .. } => zone.extended(reach).overlaps(bounds),
            Zone::StaticPlane { point, normal, .. } => behind(point, normal),
            // A rotating plane passes between its end positions, so nothing is culled.
            Zone::MovingPlane { first, last } => {
                first.1 != last.1 || behind(first.0, first.1) || behind(last.0, last.1)
            }
        }
    }
}

/// The bit of the zone with this index in a mask.
pub(super) fn zone_bit(index: usize) -> u32 {
    1 << index.min(31)
}

/// True if a feature with this number of corners and this longest edge may reach noticeably deeper into a rounded tool
/// than its corners. A chord within a circle of radius r about its corners lies at most r² / 2R below the arc of a tool
/// of radius R.
pub(super) fn sags(corners: usize, length: f32, radius: f32) -> bool {
    let radius_squared = match corners {
        1 => return true,
        2 => length * length / 4.0,
        _ => length * length / 3.0,
    };
    radius_squared > 2.0 * radius * (SAG * radius)
}

/// True if a feature that moves by `reach` may touch one of the meshes. An edge or face must also be able to reach
/// noticeably deeper into the mesh than its corners. It may do so where the surface bends between the corners, or has a
/// ridge there.
pub(super) fn may_touch_mesh<'a>(
    surface: &[NearestPlane],
    (feature, length): (Feature, f32),
    corners: &[Vec3],
    meshes: impl Iterator<Item = (&'a Zone, &'a MeshSolid)> + Clone,
    reach: f32,
) -> bool {
    let allowances = meshes.clone().map(|(zone, _)| match zone {
        Zone::Mesh { allowance, .. } => *allowance,
        _ => 0.0,
    });
    let reach = reach + allowances.fold(0.0, f32::max);
    let nearest = || feature.nodes().iter().map(|&node| &surface[node as usize]);
    let spread = longest_edge(corners);
    // No point of a feature is further from the corners than the corners are from each other.
    let distance = nearest().map(|nearest| nearest.distance).fold(f32::INFINITY, f32::min);
    if !(distance <= reach + spread) {
        return false;
    }
    if corners.len() == 1 {
        return true;
    }
    let depth = SAG
        * meshes
            .clone()
            .map(|(_, solid)| solid.thickness())
            .fold(f32::INFINITY, f32::min);
    let first = &surface[feature.nodes()[0] as usize];
    let is_same_mesh = nearest().all(|nearest| nearest.slot == first.slot && nearest.normal != Vec3::ZERO);
    let cosine = nearest()
        .map(|nearest| nearest.normal.dot(first.normal))
        .fold(1.0, f32::min);
    // A chord across which the surface bends evenly by an angle lies an eighth of its length times the angle below it.
    let bend = (2.0 * (1.0 - cosine)).max(0.0).sqrt();
    if !is_same_mesh || !(length * bend <= 8.0 * depth) {
        return true;
    }
    meshes.into_iter().any(|(zone, solid)| match zone {
        Zone::Mesh { placement, .. } => {
            let local = Aabb::of(corners.iter().map(|&corner| placement.body_to_local(corner)));
            solid.ridges.may_intrude(&local, reach.min(0.5 * spread), length, depth)
        }
        _ => true,
    })
}

/// The tools that collide with a body that has this filter.
pub(super) fn filtered_tools(tools: &[ToolPath], filter: CollisionFilter) -> impl Iterator<Item = &ToolPath> + Clone {
    tools.iter().filter(move |tool| tool.filter.meets(filter))
}
