//! How features met a mesh last: as they see it until they have moved against it.

use glam::Vec3;

use super::closest::Closest;
use super::mesh_solid::MeshSolid;
use crate::codec::saved;

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

/// How far a mesh was from an edge or face when that was asked last.
#[derive(Clone, Copy, Debug)]
pub(super) struct LastMet {
    /// The tool's place in the world.
    slot: u32,
    /// Where its corners were.
    points: [Vec3; 3],
    /// At least, m.
    distance: f32,
}

saved! { LastMet { slot, points, distance } }

impl LastMet {
    pub const NONE: Self = Self {
        slot: u32::MAX,
        points: [Vec3::ZERO; 3],
        distance: 0.0,
    };

    /// What [`MeshSolid::closest`] tells of a feature, asked again only where the mesh may have come near: no point comes closer by more than corners
    /// move. An answer is not kept, although it hardly changes: contacts that were kept gave energy, and forces that were off by a tenth.
    pub fn closest(
        &mut self,
        (slot, solid): (usize, &MeshSolid),
        corners: &[Vec3],
        within: f32,
        is_pinned: bool,
    ) -> Option<Closest> {
        if self.slot as usize == slot {
            let ways = corners.iter().zip(self.points);
            let moved = ways.map(|(corner, point)| corner.distance_squared(point));
            if self.distance - moved.fold(0.0, f32::max).sqrt() > within {
                return None;
            }
        }
        let reach = within + solid.flat();
        let found = solid.closest(corners, reach, is_pinned);
        self.slot = slot as u32;
        self.points[..corners.len()].copy_from_slice(corners);
        self.distance = found.map_or(reach, |closest| closest.distance);
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
                    compared += 1;
                    let off = (kept.distance - found.distance).abs();
                    assert!(kept.inside && off <= 1e-7, "{corners:?}: {kept:?}, {found:?}");
                }
            }
        }
        assert!(compared > 1000 && kept_count > 1000, "{compared}, {kept_count}");
    }
}
