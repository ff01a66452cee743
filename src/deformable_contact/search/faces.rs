//! The contacts of corners with faces.

use glam::{Vec3, Vec3A};

use super::{
    ClearanceUpdate, FeatureContact, FeatureSource, FoundContact, PairSearch, SearchSide, insert_closest, shift,
};
use crate::contact::time_of_impact::{Corners, Segment, Separation};
use crate::deformable_contact::clearances::{Clearances, SurfaceFeature};
use crate::deformable_contact::collision_surface::{Clearance, NodeMotion};
use crate::deformable_contact::pair_contact::ContactSide;
use crate::geometry::Aabb;

/// Relative difference below which distances are equal. Faces that share the closest point differ by less. The face
/// seen most squarely then decides the side of a point.
const EQUAL_DISTANCE: f32 = 1e-4;

/// Faces of another body are redundant for a corner if their points and directions differ by less than this fraction of
/// the distance. The closest one suffices. A surface that crumples needs all.
const SIMILAR: f32 = 0.05;

/// Maximum number of faces that a corner touches. With the closest one alone, a corner in a fold would be pushed from
/// face to face and tremble. With three, so would a tip in a matching hole, where eight triangles meet.
const MAX_FACES: usize = 8;

impl PairSearch<'_> {
    pub(super) fn nodes_with_faces(
        &self,
        search_sides: [SearchSide; 2],
        mut clearances: Option<&mut Clearances>,
        visit: &mut impl FnMut(FoundContact),
    ) {
        for corner in 0..search_sides[0].surface.nodes.len() {
            self.node_with_faces(
                search_sides,
                corner,
                FeatureSource::Search,
                clearances.as_deref_mut(),
                visit,
            );
        }
    }

    /// Reports the contacts of a corner of the first side with faces of the second. Returns a lower bound of its
    /// distance at the start, m, and whether it is outside.
    pub(super) fn node_with_faces(
        &self,
        [corner_side, face_side]: [SearchSide; 2],
        corner: usize,
        source: FeatureSource,
        clearances: Option<&mut Clearances>,
        visit: &mut impl FnMut(FoundContact),
    ) -> (f32, bool) {
        let shift = shift(corner_side.surface, face_side.surface);
        let node = corner_side.surface.nodes[corner];
        let NodeMotion {
            start: position,
            displacement,
        } = corner_side
            .surface
            .relative_motion(node, (shift, face_side.surface.center_velocity), self.dt);
        let radius = self.contact_radius(clearances.as_deref(), SurfaceFeature::Corner(corner));
        let segment = Segment {
            ends: [position; 2],
            steps: [displacement; 2],
            radius,
        };
        let mut front_distance = f32::INFINITY;
        let mut closest: [Option<FeatureContact<usize>>; MAX_FACES] = [None; MAX_FACES];
        // Distance of the nearest face of a closed surface and its height above it, and whether the corner is behind
        // it.
        let mut nearest = (f32::INFINITY, 0.0_f32);
        let mut behind: Option<(usize, Separation)> = None;
        let around = Aabb::of([position, position + displacement].map(Vec3::from).into_iter());
        let is_solid = face_side.surface.is_closed && !self.is_self_contact();
        let depth = self.ejection_depth_in(face_side);
        // In crushed solids, a face may approach an outside corner with its inner side. Rounding may also put flush
        // corners behind a face.
        let flush = corner_side
            .surface
            .min_thickness()
            .min(face_side.surface.min_thickness());
        let within_behind = if self.may_be_inside { f32::INFINITY } else { flush };
        let reach = (self.radius + self.speculative_margin).max(depth) + face_side.surface.displacement_spread;
        let max_distance = match source {
            FeatureSource::Search => self.contact_reach(),
            FeatureSource::Listed(_, [_, reach]) => reach,
        };
        let comparison = self.comparison_bounds(&segment, max_distance);
        let anywhere = |_: &Separation| true;
        let lower_bound = self.visit_near_corner(source, face_side.surface, &around, reach, |triangle| {
            let nodes = face_side.surface.triangles[triangle];
            if self.is_self_contact() && (nodes.contains(&node) || face_side.surface.are_in_wound([node; 2], &nodes)) {
                return f32::INFINITY;
            }
            let corners = face_side.surface.corners(&nodes);
            let (start, distance) = match self.separation(&corners, &segment, &comparison) {
                Ok(found) => found,
                Err(lower_bound) => return lower_bound,
            };
            if distance > max_distance {
                return distance;
            }
            let height = if is_solid { height_above(&corners, &start) } else { 0.0 };
            let is_in_front = !(height < 0.0 && distance <= within_behind);
            if is_in_front {
                front_distance = front_distance.min(distance);
            }
            let is_nearer = distance < nearest.0 * (1.0 - EQUAL_DISTANCE)
                || distance < nearest.0 * (1.0 + EQUAL_DISTANCE) && height.abs() > nearest.1;
            if is_solid && is_nearer {
                nearest = (distance, height.abs());
                behind = (!is_in_front).then_some((triangle, start));
            }
            if self.needs_test([corner_side, face_side], &[node], &nodes)
                && let Some((found, is_speculative)) = self.first_contact(
                    face_side.surface,
                    ([node; 2], &segment),
                    (&nodes, &corners),
                    start,
                    anywhere,
                )
            {
                insert_closest(&mut closest, (is_speculative, distance, triangle, found));
            }
            distance
        });
        // A corner created inside another body is pushed out by the full thickness. A flush corner touches.
        let nearest_distance = match behind {
            Some(_) if self.clearance_update == ClearanceUpdate::Reductions && nearest.0 > flush => f32::INFINITY,
            Some(_) => 0.0,
            None => front_distance,
        };
        self.update_clearance(clearances, SurfaceFeature::Corner(corner), nearest_distance);
        // A corner on the wrong side is pushed out, or left alone if it is too deep.
        let is_behind = behind.is_some();
        if let Some((triangle, start)) = behind {
            let is_near = nearest.0 < self.radius.max(depth);
            closest = [None; MAX_FACES];
            closest[0] = is_near.then_some((false, nearest.0, triangle, (start, Clearance::of(radius))));
        }
        let side_of = |triangle: usize, found: &Separation| ContactSide {
            body: face_side.body_index,
            nodes: face_side.surface.triangles[triangle],
            weights: found.weights,
        };
        let position_of = |side: &ContactSide| side.weighted(|node| face_side.surface.start(node));
        let similar = if self.is_self_contact() {
            EQUAL_DISTANCE
        } else {
            SIMILAR
        };
        for slot in 0..MAX_FACES {
            let Some((is_speculative, _, triangle, (found, clearance))) = closest[slot] else {
                break;
            };
            let side = side_of(triangle, &found);
            let is_similar = |(_, _, closer, (other, _)): &FeatureContact<usize>| {
                let max_difference = similar * found.offset.length();
                (other.offset - found.offset).length() <= max_difference
                    && position_of(&side_of(*closer, other)).distance(position_of(&side)) <= max_difference
            };
            if closest[..slot].iter().flatten().any(is_similar) {
                continue;
            }
            let mut offset = Vec3::from(if is_behind { found.offset } else { -found.offset });
            if is_solid && offset == Vec3::ZERO {
                offset = face_normal(&face_side.surface.corners(&side.nodes)).into();
            }
            let sides = [ContactSide::of_node(corner_side.body_index, node), side];
            self.report_contact(sides, (offset, is_speculative), (clearance, shift), visit);
        }
        (lower_bound, !is_behind)
    }
}

/// Returns the height of a point above a face at the start of the substep, m; negative on its inner side.
fn height_above(face: &Corners, start: &Separation) -> f32 {
    -start.offset.dot(face_normal(face))
}

/// Returns the normal of a face at the start of the substep.
fn face_normal(face: &Corners) -> Vec3A {
    let [a, b, c] = face.points;
    (b - a).cross(c - a).normalize_or_zero()
}
