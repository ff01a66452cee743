//! The fraction of a swept section of a tetrahedron that opens. Only corners of the section that the edge passes open.
//! The end of an edge within a tetrahedron leaves the rest of it closed.

use glam::DVec3;

use crate::cutting::cut::Sweep;

/// The relative tolerance of positions along the edge beyond its ends.
const ROUNDING: f64 = 1e-9;

/// The maximum number of corners of a section of a tetrahedron.
const MAX_CORNERS: usize = 4;

/// The strip that an edge passes, extended without limit in the direction of the sweep.
pub(super) struct SweptStrip {
    origin: DVec3,
    normal: DVec3,
    /// Maps positions on the edge to 0 to 1, from one end to the other.
    along: DVec3,
}

impl SweptStrip {
    /// The strip of a sweep. `None` if the edge does not move, or moves along itself.
    pub fn of(sweep: &Sweep) -> Option<Self> {
        let [[a, b], [c, d]] = [sweep.start, sweep.end].map(|edge| edge.map(|end| end.as_dvec3()));
        let direction = (c - a + d - b).try_normalize()?;
        let edge = 0.5 * (b - a + d - c);
        let across = edge.reject_from_normalized(direction);
        let normal = direction.cross(across).try_normalize()?;
        Some(Self {
            origin: 0.25 * (a + b + c + d) - 0.5 * across,
            normal,
            along: across / across.length_squared(),
        })
    }

    /// The fraction of the swept section of a tetrahedron that opens.
    pub fn opening(&self, corners: [DVec3; 4]) -> f64 {
        let coordinate = |position: DVec3| self.along.dot(position - self.origin);
        let is_passed = |position: DVec3| (-ROUNDING..=1.0 + ROUNDING).contains(&coordinate(position));
        if corners.into_iter().all(is_passed) {
            return 1.0;
        }
        let (section, count) = self.section(corners);
        let section = &section[..count];
        let passed_area = area(section.iter().copied().filter(|&position| is_passed(position)));
        // The section clipped to both ends of the edge: its corners, and points of its sides.
        let mut clipped = [DVec3::ZERO; 3 * MAX_CORNERS];
        let mut count_clipped = 0;
        for (index, &from) in section.iter().enumerate() {
            let to = section[(index + 1) % count];
            let [start, end] = [from, to].map(coordinate);
            let mut ends = [0.0, 1.0].map(|end_of_edge| (end_of_edge - start) / (end - start));
            if end < start {
                ends.reverse();
            }
            let inner = ends.into_iter().filter(|fraction| *fraction > 0.0 && *fraction < 1.0);
            for fraction in std::iter::once(0.0).chain(inner) {
                let position = from.lerp(to, fraction);
                if fraction > 0.0 || is_passed(position) {
                    clipped[count_clipped] = position;
                    count_clipped += 1;
                }
            }
        }
        let clipped_area = area(clipped[..count_clipped].iter().copied());
        if passed_area < clipped_area {
            passed_area / clipped_area
        } else {
            1.0
        }
    }

    /// The corners of the section of a tetrahedron with the plane, in order around it.
    fn section(&self, corners: [DVec3; 4]) -> ([DVec3; MAX_CORNERS], usize) {
        let heights = corners.map(|corner| self.normal.dot(corner - self.origin));
        let (mut above, mut below) = ([0; 4], [0; 4]);
        let (mut count_above, mut count_below) = (0, 0);
        for (corner, height) in heights.into_iter().enumerate() {
            let (side, count) = if height >= 0.0 {
                (&mut above, &mut count_above)
            } else {
                (&mut below, &mut count_below)
            };
            side[*count] = corner;
            *count += 1;
        }
        let mut section = [DVec3::ZERO; MAX_CORNERS];
        let mut count = 0;
        for (index, &a) in above[..count_above].iter().enumerate() {
            let mut add = |b: usize| {
                let fraction = heights[a] / (heights[a] - heights[b]);
                section[count] = corners[a].lerp(corners[b], fraction);
                count += 1;
            };
            if index == 0 {
                below[..count_below].iter().for_each(|&b| add(b));
            } else {
                below[..count_below].iter().rev().for_each(|&b| add(b));
            }
        }
        (section, count)
    }
}

/// The area of a planar polygon with these corners in order.
fn area(mut corners: impl Iterator<Item = DVec3>) -> f64 {
    let (Some(first), Some(mut last)) = (corners.next(), corners.next()) else {
        return 0.0;
    };
    let mut sum = DVec3::ZERO;
    for corner in corners {
        sum += (last - first).cross(corner - first);
        last = corner;
    }
    0.5 * sum.length()
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec3, dvec3, vec3};

    use super::{Sweep, SweptStrip, area};

    const CORNERS: [DVec3; 4] = [
        DVec3::ZERO,
        dvec3(1.0, 0.0, 0.0),
        dvec3(0.0, 1.0, 0.0),
        dvec3(0.0, 0.0, 1.0),
    ];

    /// The section at z = 0.2 is a right triangle with sides of 0.8. An edge along y passes everything below its end.
    fn opening(end: f32) -> f64 {
        let edge = |x: f32| [vec3(x, -1.0, 0.2), vec3(x, end, 0.2)];
        let sweep = Sweep {
            start: edge(-1.0),
            end: edge(-0.9),
        };
        SweptStrip::of(&sweep).map_or(f64::NAN, |strip| strip.opening(CORNERS))
    }

    #[test]
    fn the_section_between_passed_corners_opens() {
        assert!(opening(0.3).abs() < 1e-6);
        assert!((opening(0.81) - 1.0).abs() < 1e-6);
        assert!((opening(2.0) - 1.0).abs() < 1e-6);
        // A section with four corners, at x = 0.2 + 0.2 y ... of which one is not passed.
        let edge = |x: f32| [vec3(x, -1.0, 0.3 - x), vec3(x, 0.5, 0.3 - x)];
        let sweep = Sweep {
            start: edge(-1.0),
            end: edge(-0.9),
        };
        let strip = SweptStrip::of(&sweep).map(|strip| strip.opening(CORNERS));
        assert!(strip.is_some_and(|fraction| fraction.abs() < 1e-6), "{strip:?}");
        assert!(
            SweptStrip::of(&Sweep {
                start: edge(0.0),
                end: edge(0.0)
            })
            .is_none()
        );
    }

    #[test]
    fn a_polygon_has_its_area() {
        let corners = [Vec3::ZERO, Vec3::X, vec3(1.0, 1.0, 0.0), Vec3::Y];
        assert_eq!(area(corners.into_iter().map(Vec3::as_dvec3)), 1.0);
        assert_eq!(area([DVec3::ONE; 2].into_iter()), 0.0);
    }
}
