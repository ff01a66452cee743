//! Ray casts against the surface of a tool.

use glam::{DQuat, DVec3};

use crate::contact::{Tool, ToolShape};
use crate::geometry::predicates::pierce;

/// The distance from `start` along the unit vector `direction` to the tool's surface, m, and the outward normal there.
pub(super) fn meet(tool: &Tool, start: DVec3, direction: DVec3) -> Option<(f64, DVec3)> {
    let turn: DQuat = tool.pose.orientation.as_dquat().normalize();
    let from = turn.inverse() * (start - tool.pose.position.as_dvec3());
    let along = turn.inverse() * direction;
    let (distance, normal) = match &tool.shape {
        ToolShape::Rounded { radius, half_length } => {
            meet_capsule(from, along, f64::from(*radius), f64::from(*half_length))?
        }
        ToolShape::HalfSpace => {
            let distance = -from.y / along.y;
            (distance >= 0.0 && distance.is_finite()).then_some((distance, DVec3::Y))?
        }
        ToolShape::Mesh(solid) => {
            let surface = solid.surface();
            let (positions, triangles) = (surface.positions(), surface.triangles());
            let furthest = |far: f64, corner: &glam::Vec3| far.max(corner.as_dvec3().length());
            // Beyond the tool.
            let length = 2.0 * (from.length() + positions.iter().fold(0.0, furthest));
            let mut first: Option<(f64, DVec3)> = None;
            for &nodes in triangles {
                let corners = nodes.map(|node| positions[node as usize].as_dvec3());
                if let Some((fraction, _)) = pierce(from, from + along * length, corners, nodes)
                    && first.is_none_or(|(nearest, _)| fraction * length < nearest)
                {
                    let [a, b, c] = corners;
                    first = Some((fraction * length, (b - a).cross(c - a).normalize_or_zero()));
                }
            }
            first?
        }
    };
    Some((distance, turn * normal))
}

/// The hit on a capsule along y; without a length it is a sphere.
fn meet_capsule(from: DVec3, along: DVec3, radius: f64, half_length: f64) -> Option<(f64, DVec3)> {
    let mut first: Option<(f64, DVec3)> = None;
    let mut see = |distance: f64, normal: DVec3| {
        if distance >= 0.0 && first.is_none_or(|(nearest, _)| distance < nearest) {
            first = Some((distance, normal));
        }
    };
    let flat = DVec3::new(1.0, 0.0, 1.0);
    for distance in crossings(from * flat, along * flat, radius) {
        let at = from + along * distance;
        if at.y.abs() < half_length {
            see(distance, at * flat / radius);
        }
    }
    for end in [half_length, -half_length] {
        let centre = DVec3::Y * end;
        for distance in crossings(from - centre, along, radius) {
            let out = from + along * distance - centre;
            // Each cap is the half of a sphere beyond its center.
            if out.y * end >= 0.0 {
                see(distance, out / radius);
            }
        }
    }
    first
}

/// The distance along a line to a sphere about the origin; NaN without a hit.
fn crossings(from: DVec3, along: DVec3, radius: f64) -> [f64; 2] {
    let (a, b, c) = (
        along.length_squared(),
        from.dot(along),
        from.length_squared() - radius * radius,
    );
    let root = (b * b - a * c).sqrt();
    [(-b - root) / a, (-b + root) / a]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_capsule_is_met_on_its_side_and_on_its_caps() {
        let met = |from, along| meet_capsule(from, along, 0.5, 2.0);
        let side = met(DVec3::new(-3.0, 1.0, 0.0), DVec3::X).expect("met");
        assert!(
            (side.0 - 2.5).abs() < 1e-12 && (side.1 + DVec3::X).length() < 1e-12,
            "{side:?}"
        );
        let cap = met(DVec3::new(0.0, 9.0, 0.0), -DVec3::Y).expect("met");
        assert!(
            (cap.0 - 6.5).abs() < 1e-12 && (cap.1 - DVec3::Y).length() < 1e-12,
            "{cap:?}"
        );
        // From inside, the exit; from outside beside it, no hit.
        let out = met(DVec3::ZERO, DVec3::Y).expect("met");
        assert!((out.0 - 2.5).abs() < 1e-12, "{out:?}");
        assert_eq!(met(DVec3::new(-3.0, 2.6, 0.0), DVec3::X), None);
        assert_eq!(met(DVec3::new(3.0, 0.0, 0.0), DVec3::X), None);
    }
}
