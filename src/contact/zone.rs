//! Where the features that a tool may meet lie.

use glam::{DVec3, Vec3};

use super::candidates::longest_edge;
use super::features::Feature;
use super::mesh_solid::MeshSolid;
use super::nearest_plane::NearestPlane;
use super::path::{Placement, Solid, ToolPath};
use crate::def::CollisionFilter;
use crate::geometry::Bounds;

/// How much deeper than its corners an edge or face of a sheet may reach into a tool, as a part of the tool's radius or of half a mesh's least extent: where it
/// cannot, its corners alone meet the tool.
const SAG: f32 = 0.04;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Zone {
    /// About all that a tool sweeps, with the slack that nodes need.
    Box { slot: usize, bounds: Bounds },
    /// About a mesh that stands here, for as long as none of its points leaves its place by more than `allowance`, m.
    Mesh {
        slot: usize,
        bounds: Bounds,
        standing: Placement,
        allowance: f32,
    },
    /// About what lies behind a plane that does not move.
    Behind { slot: usize, point: Vec3, normal: Vec3 },
    /// About what a moving plane sweeps.
    Between { first: (Vec3, Vec3), last: (Vec3, Vec3) },
}

impl Zone {
    pub(super) fn of(tool: &ToolPath, origin: DVec3) -> Self {
        if let Some(sweep) = tool.sweep(origin) {
            let (slot, bounds) = (tool.slot, sweep.bounds);
            return match tool.solid_at(tool.begun(), origin) {
                Solid::Mesh(standing) => Zone::Mesh {
                    slot,
                    bounds,
                    standing,
                    allowance: sweep.travel,
                },
                _ => Zone::Box { slot, bounds },
            };
        }
        let plane = |fraction: f64| match tool.solid_at(fraction, origin) {
            Solid::HalfSpace { point, normal } => (point, normal),
            Solid::Rounded { a, .. } => (a, Vec3::Y),
            Solid::Mesh(placement) => (placement.centre, Vec3::Y),
        };
        let (first, last) = (plane(0.0), plane(1.0));
        if first == last {
            Zone::Behind {
                slot: tool.slot,
                point: first.0,
                normal: first.1,
            }
        } else {
            Zone::Between { first, last }
        }
    }

    pub(super) fn is_bounded(&self) -> bool {
        matches!(self, Zone::Box { .. } | Zone::Mesh { .. })
    }

    /// With so much slack, m.
    pub(super) fn extended(mut self, slack: f32) -> Self {
        if let Zone::Box { bounds, .. } | Zone::Mesh { bounds, .. } = &mut self {
            *bounds = bounds.extended(slack);
        }
        if let Zone::Mesh { allowance, .. } = &mut self {
            *allowance += slack;
        }
        self
    }

    /// Whether it is good for this tool on its way.
    pub(super) fn covers(&self, tool: &ToolPath, origin: DVec3) -> bool {
        match (*self, Zone::of(tool, origin)) {
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
                    standing,
                    allowance,
                    ..
                },
                Zone::Mesh { slot: other, .. },
            ) => slot == other && tool.furthest_from(&standing, origin) <= allowance,
            (behind @ Zone::Behind { .. }, other) => behind == other,
            _ => false,
        }
    }

    /// Whether something within `bounds` may come into the zone when it moves by `reach`.
    pub(super) fn meets(&self, bounds: &Bounds, reach: f32) -> bool {
        let behind = |point: Vec3, normal: Vec3| {
            // The box's lowest corner against the plane.
            let lowest = Vec3::select(normal.cmpge(Vec3::ZERO), bounds.min, bounds.max);
            (lowest - point).dot(normal) <= reach
        };
        match *self {
            Zone::Box { bounds: zone, .. } | Zone::Mesh { bounds: zone, .. } => zone.extended(reach).overlaps(bounds),
            Zone::Behind { point, normal, .. } => behind(point, normal),
            // A turning plane passes between its ends: nothing is ruled out.
            Zone::Between { first, last } => first.1 != last.1 || behind(first.0, first.1) || behind(last.0, last.1),
        }
    }
}

/// The bit of a zone in a mask.
pub(super) fn zone_bit(place: usize) -> u32 {
    1 << place.min(31)
}

/// Whether a feature of so many corners and this longest edge may reach noticeably deeper into a round tool of this radius than its corners do. A chord
/// within a circle of radius r about its corners lies at most r² / 2R below the arc of a tool of radius R.
pub(super) fn sags(corners: usize, length: f32, radius: f32) -> bool {
    let within = match corners {
        1 => return true,
        2 => length * length / 4.0,
        _ => length * length / 3.0,
    };
    within > 2.0 * radius * (SAG * radius)
}

/// Whether a feature with these corners may come to one of the meshes when it moves by `reach`, and is a node or may reach noticeably deeper
/// into it than its corners do: where the surface turns from one to another, or has a ridge between them.
pub(super) fn meets_mesh<'a>(
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
    // No part of a feature is further from its corners than they are from each other.
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
    let is_one = nearest().all(|nearest| nearest.slot == first.slot && nearest.normal != Vec3::ZERO);
    let cosine = nearest()
        .map(|nearest| nearest.normal.dot(first.normal))
        .fold(1.0, f32::min);
    // A chord across which the surface turns evenly by an angle lies an eighth of its length times that below.
    let turn = (2.0 * (1.0 - cosine)).max(0.0).sqrt();
    if !is_one || !(length * turn <= 8.0 * depth) {
        return true;
    }
    meshes.into_iter().any(|(zone, solid)| match zone {
        Zone::Mesh { standing, .. } => {
            let own = Bounds::of(corners.iter().map(|&corner| standing.own(corner)));
            solid.ridges.are_near(&own, reach.min(0.5 * spread), length, depth)
        }
        _ => true,
    })
}

/// Those of the tools that a body with this filter meets: the others are as if they were not there.
pub(super) fn met(tools: &[ToolPath], filter: CollisionFilter) -> impl Iterator<Item = &ToolPath> + Clone {
    tools.iter().filter(move |tool| tool.filter.meets(filter))
}
