//! How much of what a blade passes through in a tetrahedron opens: between corners of its section that the edge passes. The end of an edge within a
//! tetrahedron leaves the rest of it whole.

use glam::DVec3;

use crate::cutting::cut::Sweep;

/// Along the edge this far beyond its end is still passed, as a part of its length.
const ROUNDING: f64 = 1e-9;

/// A section of a tetrahedron has so many corners at most.
const MOST_CORNERS: usize = 4;

/// What an edge passes, on and on in the direction of its sweep.
pub(super) struct Band {
    origin: DVec3,
    normal: DVec3,
    /// Along it a place on the edge is 0 to 1 from the one end to the other.
    along: DVec3,
}

impl Band {
    /// `None`: it goes nowhere, or along itself.
    pub fn of(sweep: &Sweep) -> Option<Self> {
        let [[a, b], [c, d]] = [sweep.start, sweep.end].map(|edge| edge.map(|end| end.as_dvec3()));
        let way = (c - a + d - b).try_normalize()?;
        let edge = 0.5 * (b - a + d - c);
        let across = edge.reject_from_normalized(way);
        let normal = way.cross(across).try_normalize()?;
        Some(Self {
            origin: 0.25 * (a + b + c + d) - 0.5 * across,
            normal,
            along: across / across.length_squared(),
        })
    }

    /// Which part of what it passes of a tetrahedron opens.
    pub fn opening(&self, corners: [DVec3; 4]) -> f64 {
        let at = |place: DVec3| self.along.dot(place - self.origin);
        let is_passed = |place: DVec3| (-ROUNDING..=1.0 + ROUNDING).contains(&at(place));
        if corners.into_iter().all(is_passed) {
            return 1.0;
        }
        let (section, count) = self.section(corners);
        let section = &section[..count];
        let passed = area(section.iter().copied().filter(|&place| is_passed(place)));
        // Up to both ends of the edge: corners and points of sides.
        let mut clipped = [DVec3::ZERO; 3 * MOST_CORNERS];
        let mut count_clipped = 0;
        for (index, &from) in section.iter().enumerate() {
            let to = section[(index + 1) % count];
            let [start, end] = [from, to].map(at);
            let mut ends = [0.0, 1.0].map(|end_of_edge| (end_of_edge - start) / (end - start));
            if end < start {
                ends.reverse();
            }
            let inner = ends.into_iter().filter(|part| *part > 0.0 && *part < 1.0);
            for part in std::iter::once(0.0).chain(inner) {
                let place = from.lerp(to, part);
                if part > 0.0 || is_passed(place) {
                    clipped[count_clipped] = place;
                    count_clipped += 1;
                }
            }
        }
        let whole = area(clipped[..count_clipped].iter().copied());
        if passed < whole { passed / whole } else { 1.0 }
    }

    /// Where its plane passes the edges of a tetrahedron, around.
    fn section(&self, corners: [DVec3; 4]) -> ([DVec3; MOST_CORNERS], usize) {
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
        let mut section = [DVec3::ZERO; MOST_CORNERS];
        let mut count = 0;
        for (index, &a) in above[..count_above].iter().enumerate() {
            let mut add = |b: usize| {
                let part = heights[a] / (heights[a] - heights[b]);
                section[count] = corners[a].lerp(corners[b], part);
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

/// Of a flat polygon with these corners around.
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

    use super::{Band, Sweep, area};

    const CORNERS: [DVec3; 4] = [
        DVec3::ZERO,
        dvec3(1.0, 0.0, 0.0),
        dvec3(0.0, 1.0, 0.0),
        dvec3(0.0, 0.0, 1.0),
    ];

    /// Of the section at z = 0.2, a right triangle with sides of 0.8, an edge along y passes what lies below its end.
    fn opening(end: f32) -> f64 {
        let edge = |x: f32| [vec3(x, -1.0, 0.2), vec3(x, end, 0.2)];
        let sweep = Sweep {
            start: edge(-1.0),
            end: edge(-0.9),
        };
        Band::of(&sweep).map_or(f64::NAN, |band| band.opening(CORNERS))
    }

    #[test]
    fn what_lies_between_passed_corners_opens() {
        assert!(opening(0.3).abs() < 1e-6);
        assert!((opening(0.81) - 1.0).abs() < 1e-6);
        assert!((opening(2.0) - 1.0).abs() < 1e-6);
        // A section with four corners, at x = 0.2 + 0.2 y ... of which one is not passed.
        let edge = |x: f32| [vec3(x, -1.0, 0.3 - x), vec3(x, 0.5, 0.3 - x)];
        let sweep = Sweep {
            start: edge(-1.0),
            end: edge(-0.9),
        };
        let band = Band::of(&sweep).map(|band| band.opening(CORNERS));
        assert!(band.is_some_and(|part| part.abs() < 1e-6), "{band:?}");
        assert!(
            Band::of(&Sweep {
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
