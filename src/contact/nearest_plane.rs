//! How features met a mesh last: as they see it until they have moved against it.

use glam::Vec3;

use super::candidates::longest_edge;
use super::closest::Closest;
use super::mesh_solid::MeshSolid;
use crate::codec::saved;

/// An edge or face that moves by this part of its length sees a mesh another way.
const TURNED: f32 = 0.04;

/// The plane through the point of a mesh that is closest to a node, across the way to it, in the mesh's own frame: as the mesh is seen from
/// near by.
#[derive(Clone, Copy, Debug)]
pub(super) struct NearestPlane {
    /// The tool's place in the world; [`NearestPlane::NONE`]: nothing is known.
    pub slot: u32,
    /// Where the node was.
    pub point: Vec3,
    /// How far the mesh is, m, below 0 inside; where there is no normal, at least so far.
    pub distance: f32,
    pub normal: Vec3,
}

saved! { NearestPlane { slot, point, distance, normal } }

impl NearestPlane {
    pub const NONE: Self = Self {
        slot: u32::MAX,
        point: Vec3::ZERO,
        distance: f32::INFINITY,
        normal: Vec3::ZERO,
    };

    /// That the mesh is no closer to this point than so far, m.
    pub fn beyond(slot: usize, point: Vec3, distance: f32) -> Self {
        Self {
            slot: slot as u32,
            point,
            distance,
            normal: Vec3::ZERO,
        }
    }

    /// The node has come to this point: whether it is known how it sees the mesh, as flat within `flat`, m, or that it is further away than `near`, m.
    #[inline]
    pub fn serves(&mut self, slot: usize, point: Vec3, [flat, near]: [f32; 2]) -> bool {
        let moved = point.distance(self.point);
        if self.slot as usize != slot {
            return false;
        }
        if self.normal != Vec3::ZERO && moved <= flat {
            return true;
        }
        let is_far = self.distance - moved > near;
        if is_far {
            *self = Self::beyond(slot, point, self.distance - moved);
        }
        is_far
    }
}

/// The same for an edge or face: where its corners were, and how close it came.
#[derive(Clone, Copy, Debug)]
pub(super) struct LastMet {
    /// The tool's place in the world.
    slot: u32,
    is_pinned: bool,
    points: [Vec3; 3],
    /// Without a normal: at least so far.
    closest: Closest,
}

saved! { LastMet { slot, is_pinned, points, closest } }

impl LastMet {
    pub const NONE: Self = Self {
        slot: u32::MAX,
        is_pinned: false,
        points: [Vec3::ZERO; 3],
        closest: Closest {
            weights: [0.0; 3],
            distance: f32::INFINITY,
            normal: Vec3::ZERO,
            inside: false,
        },
    };

    /// What [`MeshSolid::closest`] tells of a feature, asked again only where that may have changed: no point of it comes closer by more than its corners
    /// move, and one that was closest at its border is so still where it has hardly moved. What touches is asked for anew each time: contacts that were kept
    /// gave energy, and forces that were off by a tenth.
    pub fn closest(
        &mut self,
        (slot, solid): (usize, &MeshSolid),
        corners: &[Vec3],
        within: f32,
        is_pinned: bool,
    ) -> Option<Closest> {
        let flat = solid.flat().min(TURNED * longest_edge(corners));
        if self.slot as usize == slot && self.is_pinned == is_pinned {
            let ways = || corners.iter().zip(self.points).map(|(&corner, point)| corner - point);
            let moved = ways().map(Vec3::length_squared).fold(0.0, f32::max).sqrt();
            let last = &self.closest;
            if last.distance - moved > within {
                return None;
            }
            if last.normal != Vec3::ZERO && !last.inside && moved <= flat {
                return Some(*last);
            }
        }
        let found = solid.closest(corners, within + flat, is_pinned);
        let mut points = [Vec3::ZERO; 3];
        points[..corners.len()].copy_from_slice(corners);
        *self = Self {
            slot: slot as u32,
            is_pinned,
            points,
            closest: found.unwrap_or(Closest {
                distance: within + flat,
                ..Self::NONE.closest
            }),
        };
        found.filter(|closest| closest.distance <= within)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::cuboid;
    use crate::def::Detection;
    use crate::random::Random;

    /// Edges and faces wander about a box: what is kept of them misses nothing that is found anew, and is as far away.
    #[test]
    fn what_is_kept_is_what_would_be_found() {
        let (positions, triangles) = cuboid::surface(Vec3::splat(0.01));
        let solid = MeshSolid::shared(&positions, &triangles, Detection::Exact, 0.0).expect("a box");
        let (within, mut random) = (1e-3, Random(5));
        let (mut compared, mut kept_count) = (0, 0);
        for count in [2, 3] {
            for _ in 0..300 {
                let start = random.vector() * 0.013;
                let mut corners = [0, 1, 2].map(|_| start + random.vector() * 0.004);
                let (drift, mut last) = (random.vector() * 4e-6, LastMet::NONE);
                for _ in 0..100 {
                    corners = corners.map(|corner| corner + drift + random.vector() * 2e-6);
                    let corners = &corners[..count];
                    let found = solid.closest(corners, within, false).filter(|found| found.inside);
                    let before = last.points;
                    let kept = last.closest((0, &solid), corners, within, false);
                    kept_count += usize::from(last.points == before);
                    let Some(found) = found else { continue };
                    let Some(kept) = kept else {
                        panic!("{corners:?}: {found:?} is missed");
                    };
                    if kept.inside {
                        compared += 1;
                        let off = (kept.distance - found.distance).abs();
                        assert!(off <= 1e-7, "{corners:?}: {kept:?}, {found:?}");
                    }
                }
            }
        }
        assert!(compared > 1000 && kept_count > compared, "{compared}, {kept_count}");
    }
}
