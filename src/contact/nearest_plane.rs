//! Cached distance queries between features and meshes, valid until the feature has moved relative to the mesh.

use glam::Vec3;

use super::closest::Closest;
use super::mesh_solid::MeshSolid;
use crate::codec::saved;

/// The plane through the point of a mesh that is closest to a node, in the mesh's frame. Its normal is the direction to
/// the node. It approximates the mesh near the node.
#[derive(Clone, Copy, Debug)]
pub(super) struct NearestPlane {
    /// The tool's slot in the world; [`u32::MAX`] in [`NearestPlane::NONE`].
    pub slot: u32,
    /// Position of the node at the query.
    pub point: Vec3,
    /// Distance of the mesh, m; negative inside. Without a normal, it is a lower bound.
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

    /// States that the mesh is at least `distance` away from this point, m.
    pub fn farther_than(slot: usize, point: Vec3, distance: f32) -> Self {
        Self {
            slot: slot as u32,
            point,
            distance,
            normal: Vec3::ZERO,
        }
    }

    /// True if a node at this point needs no query: it has moved by at most `flat`, m, since the last one, or the mesh
    /// is further away than `near`, m. In the second case the lower bound is moved to this point.
    #[inline]
    pub fn is_valid_at(&mut self, slot: usize, point: Vec3, [flat, near]: [f32; 2]) -> bool {
        let moved = point.distance(self.point);
        if self.slot as usize != slot {
            return false;
        }
        if self.normal != Vec3::ZERO && moved <= flat {
            return true;
        }
        let is_far = self.distance - moved > near;
        if is_far {
            *self = Self::farther_than(slot, point, self.distance - moved);
        }
        is_far
    }
}

/// The distance between a mesh and an edge or face at the last query.
#[derive(Clone, Copy, Debug)]
pub(super) struct LastDistance {
    /// The tool's slot in the world.
    slot: u32,
    /// Positions of the corners.
    points: [Vec3; 3],
    /// Lower bound, m.
    distance: f32,
}

saved! { LastDistance { slot, points, distance } }

impl LastDistance {
    pub const NONE: Self = Self {
        slot: u32::MAX,
        points: [Vec3::ZERO; 3],
        distance: 0.0,
    };

    /// Returns [`MeshSolid::closest`] of a feature. It queries the mesh only if the mesh may have come near, since no
    /// point approaches faster than the corners. The closest point itself is not cached, although it hardly changes:
    /// cached contacts gained energy and caused force errors of 10 %.
    pub fn closest(
        &mut self,
        (slot, solid): (usize, &MeshSolid),
        corners: &[Vec3],
        within: f32,
        is_pinned: bool,
    ) -> Option<Closest> {
        if self.slot as usize == slot {
            let pairs = corners.iter().zip(self.points);
            let moved = pairs.map(|(corner, point)| corner.distance_squared(point));
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

    /// An edge or face that moves about a box. The cache misses no contact that a query finds, and returns the same
    /// distance.
    #[test]
    fn the_cache_agrees_with_queries() {
        let (positions, triangles) = cuboid::surface(Vec3::splat(0.01));
        let solid = MeshSolid::new_shared(&positions, &triangles, Detection::Exact, 0.0).expect("a box");
        let (within, mut random) = (1e-3, Random(5));
        let (mut compared, mut kept_count) = (0, 0);
        for count in [2, 3] {
            for _ in 0..300 {
                let start = random.vector() * 0.013;
                let mut corners = [0, 1, 2].map(|_| start + random.vector() * 0.004);
                let (drift, mut last) = (random.vector() * 4e-6, LastDistance::NONE);
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
