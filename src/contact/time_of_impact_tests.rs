//! Sweeps of nodes with faces and of edges with edges, compared with exact results: no contact is missed.
//!
//! Points are rounded to `f32` first, as in the library. Features that touch exactly may therefore be a rounding error
//! apart. A sweep must find them at any larger radius.

use std::io::Write;
use std::path::Path;

use glam::{DVec3, Vec3A};

use super::time_of_impact::{Corners, Segment};
use crate::geometry::nearest::{nearest_on_segments, nearest_on_triangle};
use crate::random::Random;

/// Radii relative to the longest edge of a query. Surfaces without thickness keep the first.
const RADII: [f32; 4] = [1e-3, 1e-4, 1e-5, 1e-6];

/// A node and a face, or two edges, over a step, and the exact result.
struct Query {
    is_face: bool,
    points: [[DVec3; 4]; 2],
    touches: bool,
}

impl Query {
    /// True if a sweep finds a contact at a distance of `radius` times the longest edge.
    fn is_found(&self, radius: f32) -> bool {
        let [start, end] = self.points.map(|points| points.map(DVec3::as_vec3a));
        let steps: [Vec3A; 4] = std::array::from_fn(|point| end[point] - start[point]);
        let ends = if self.is_face { [0, 0] } else { [0, 1] };
        let others = if self.is_face { [1, 2, 3] } else { [2, 3, 3] };
        let corners = Corners {
            points: others.map(|point| start[point]),
            steps: others.map(|point| steps[point]),
            count: if self.is_face { 3 } else { 2 },
        };
        let segment = Segment {
            ends: ends.map(|point| start[point]),
            steps: ends.map(|point| steps[point]),
            radius: radius * self.longest_edge(),
        };
        let found = corners.approach(&segment, 0.0).is_some();
        // A search that also reports approaches misses no contact.
        for ahead in [0.0, 0.02, 1.0] {
            let start = corners.separation(&segment, 0.0);
            let met = corners.first_contact(start, &segment, ahead * self.longest_edge());
            assert!(met.is_some() || !found, "{ahead} of an edge ahead");
        }
        found
    }

    /// Maximum relative displacement of the two sides in the step.
    fn travel(&self) -> f64 {
        let [start, end] = self.points;
        let steps: Vec<DVec3> = (0..4).map(|point| end[point] - start[point]).collect();
        let pairs = steps.iter().flat_map(|a| steps.iter().map(move |b| a.distance(*b)));
        pairs.fold(0.0, f64::max)
    }

    /// The length that radii refer to: the longest edge, or the displacement if both features are points.
    fn longest_edge(&self) -> f32 {
        let edges: &[[usize; 2]] = if self.is_face {
            &[[1, 2], [2, 3], [3, 1]]
        } else {
            &[[0, 1], [2, 3]]
        };
        let lengths = (self.points.iter()).flat_map(|at| edges.iter().map(|&[a, b]| at[a].distance(at[b])));
        let longest = lengths.fold(0.0, f64::max);
        if longest > 0.0 {
            longest as f32
        } else {
            self.travel() as f32
        }
    }
}

impl Query {
    /// True if a contact is found although the features stay twice that distance apart, because the search ran out of
    /// advances.
    fn is_found_beyond(&self, radius: f32) -> bool {
        self.is_found(radius) && self.least_distance() > 2.0 * f64::from(radius * self.longest_edge())
    }

    /// Lower bound of the smallest distance in the step, m, in `f64`.
    fn least_distance(&self) -> f64 {
        const SAMPLES: usize = 2000;
        let [start, end] = self.points;
        let distance = |time: f64| {
            let [a, b, c, d]: [DVec3; 4] = std::array::from_fn(|point| start[point].lerp(end[point], time));
            if self.is_face {
                let ([first, second, third], _) = nearest_on_triangle(a, [b, c, d]);
                a.distance(b * first + c * second + d * third)
            } else {
                let (first, second) = nearest_on_segments(a, b, c, d);
                a.lerp(b, first).distance(c.lerp(d, second))
            }
        };
        let sampled = (0..=SAMPLES).map(|sample| distance(sample as f64 / SAMPLES as f64));
        sampled.fold(f64::INFINITY, f64::min) - 0.5 * self.travel() / SAMPLES as f64
    }
}

/// Counts missed contacts and false contacts for each radius.
fn count(queries: &[Query]) -> [[usize; 2]; RADII.len()] {
    RADII.map(|radius| {
        let of = |touches: bool| queries.iter().filter(move |query| query.touches == touches);
        let missed = of(true).filter(|query| !query.is_found(radius)).count();
        [missed, of(false).filter(|query| query.is_found(radius)).count()]
    })
}

/// Reads queries of eight rows, each with three fractions and the result.
fn read(path: &Path, is_face: bool) -> Vec<Query> {
    let text = std::fs::read_to_string(path).expect("a file");
    let numbers = |line: &str| -> Vec<f64> {
        line.split(',')
            .map(|cell| cell.trim().parse().expect("a number"))
            .collect()
    };
    let rows: Vec<Vec<f64>> = text.lines().map(numbers).collect();
    assert!(rows.len().is_multiple_of(8), "{}", path.display());
    let point = |row: &Vec<f64>| DVec3::new(row[0] / row[1], row[2] / row[3], row[4] / row[5]);
    let query = |rows: &[Vec<f64>]| Query {
        is_face,
        points: [0, 4].map(|first| std::array::from_fn(|index| point(&rows[first + index]))),
        touches: rows[0][6] == 1.0,
    };
    rows.chunks(8).map(query).collect()
}

/// The benchmark of Wang et al. (2021): unit tests and the degenerate scenes of Erleben.
#[test]
fn no_contact_of_the_exact_benchmark_is_missed() {
    let above = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors();
    let Some(folder) = above
        .map(|above| above.join("shared/truth/ccd"))
        .find(|path| path.exists())
    else {
        let _ = writeln!(
            std::io::stderr(),
            "SKIPPED: the exact queries of ../shared/truth/ccd, which is missing"
        );
        return;
    };
    for (kind, is_face) in [("vertex-face", true), ("edge-edge", false)] {
        let mut queries = Vec::new();
        for scene in std::fs::read_dir(&folder).expect("a folder") {
            for file in std::fs::read_dir(scene.expect("a scene").path().join(kind)).expect("a folder") {
                queries.extend(read(&file.expect("a file").path(), is_face));
            }
        }
        let touching = queries.iter().filter(|query| query.touches).count();
        let counts = count(&queries);
        let _ = writeln!(
            std::io::stderr(),
            "{kind}: {} queries, {touching} touch; missed, found without a touch: {counts:?}; found beyond twice the radius: {:?}",
            queries.len(),
            RADII.map(|radius| queries.iter().filter(|query| query.is_found_beyond(radius)).count())
        );
        for ([missed, _], radius) in counts.into_iter().zip(RADII) {
            assert_eq!(missed, 0, "{kind}, radius {radius}");
        }
    }
}

/// Number of parts of a step, an edge and a face. Points at these parts are exact.
const PARTS: i64 = 4;

/// Integers below this bound are exact in `f32`, also as sums of four parts.
const REACH: usize = 1 << 10;

/// Generates points on straight paths through integer coordinates, including all degenerate cases.
struct Degenerate {
    random: Random,
    /// True if all points lie in one plane.
    is_flat: bool,
    /// Time of the contact, in parts of the step.
    time: i64,
}

impl Degenerate {
    fn new(random: &mut Random) -> Self {
        Self {
            is_flat: random.below(4) == 0,
            time: random.below(PARTS as usize + 1) as i64,
            random: Random(random.below(1 << 30) as u64),
        }
    }

    fn point(&mut self) -> [i64; 3] {
        let mut point = [0; 3].map(|_: i64| (self.random.below(2 * REACH) as i64 - REACH as i64) * 64);
        if self.is_flat {
            point[2] = 0;
        }
        point
    }

    /// A random path; sometimes a point at rest.
    fn path(&mut self) -> [[i64; 3]; 2] {
        let start = self.point();
        let end = if self.random.below(4) == 0 { start } else { self.point() };
        [start, end]
    }

    /// The point of a path at the contact, times the number of parts.
    fn at(&self, [start, end]: [[i64; 3]; 2]) -> [i64; 3] {
        std::array::from_fn(|axis| start[axis] * (PARTS - self.time) + end[axis] * self.time)
    }

    /// A path through a point at the contact.
    fn through(&mut self, point: [i64; 3]) -> [[i64; 3]; 2] {
        let other = self.point();
        let from = |axis: usize| match self.time {
            0 => [point[axis], other[axis]],
            1 => [other[axis], 4 * point[axis] - 3 * other[axis]],
            2 => [other[axis], 2 * point[axis] - other[axis]],
            3 => [4 * point[axis] - 3 * other[axis], other[axis]],
            _ => [other[axis], point[axis]],
        };
        let ends = [0, 1, 2].map(from);
        [0, 1].map(|end| ends.map(|ends| ends[end]))
    }

    /// A node and a face that touch at this time, also at corners and edges of the face.
    fn node_on_face(&mut self) -> [[[i64; 3]; 2]; 4] {
        let mut corners = [self.path(), self.path(), self.path()];
        match self.random.below(6) {
            0 => corners[2] = corners[1],
            1 => corners = [corners[0]; 3],
            _ => {}
        }
        let first = self.random.below(PARTS as usize + 1) as i64;
        let second = self.random.below((PARTS - first) as usize + 1) as i64;
        let weights = [first, second, PARTS - first - second];
        let positions = corners.map(|corner| self.at(corner).map(|value| value / PARTS));
        let point = [0, 1, 2].map(|axis| {
            (0..3)
                .map(|corner| weights[corner] * positions[corner][axis])
                .sum::<i64>()
                / PARTS
        });
        let node = self.through(point);
        // The construction is exact: the scaled node equals the weighted sum of the scaled corners.
        for axis in 0..3 {
            let sum: i64 = (0..3)
                .map(|corner| weights[corner] * self.at(corners[corner])[axis])
                .sum();
            assert_eq!(PARTS * self.at(node)[axis], sum);
        }
        [node, corners[0], corners[1], corners[2]]
    }

    /// Two edges that touch at this time. Some are collinear or as short as a point.
    fn edge_on_edge(&mut self) -> [[[i64; 3]; 2]; 4] {
        let a = self.path();
        let b = if self.random.below(6) == 0 { a } else { self.path() };
        let along = self.random.below(PARTS as usize + 1) as i64;
        let touch: [i64; 3] = std::array::from_fn(|axis| {
            ((PARTS - along) * self.at(a)[axis] + along * self.at(b)[axis]) / (PARTS * PARTS)
        });
        // Starts the second edge along the first, exactly or nearly collinear, or anywhere.
        let c = match self.random.below(4) {
            kind @ (0 | 1) => [0, 1].map(|end| {
                std::array::from_fn(|axis| {
                    2 * b[end][axis] - a[end][axis] + kind as i64 * (self.random.below(128) as i64 - 64)
                })
            }),
            _ => self.path(),
        };
        let there = self.at(c).map(|value| value / PARTS);
        let far: [i64; 3] = match self.random.below(3) {
            0 => std::array::from_fn(|axis| 4 * touch[axis] - 3 * there[axis]),
            1 => std::array::from_fn(|axis| 2 * touch[axis] - there[axis]),
            _ => touch,
        };
        let d = self.through(far);
        assert_eq!(self.at(d), far.map(|value| PARTS * value));
        [a, b, c, d]
    }
}

/// Queries in integer coordinates that touch by construction.
fn touching(is_face: bool) -> Vec<Query> {
    let mut random = Random(11);
    let mut query = |_| {
        let mut source = Degenerate::new(&mut random);
        let paths = if is_face {
            source.node_on_face()
        } else {
            source.edge_on_edge()
        };
        let at = |end: usize| paths.map(|path| DVec3::from_array(path[end].map(|value| value as f64)));
        let points = [at(0), at(1)];
        assert!(
            points
                .iter()
                .flatten()
                .all(|point| point.as_vec3().as_dvec3() == *point),
            "exact in f32"
        );
        Query {
            is_face,
            points,
            touches: true,
        }
    };
    (0..20_000).map(&mut query).collect()
}

#[test]
fn no_degenerate_contact_is_missed() {
    let kinds = [true, false].map(|is_face| count(&touching(is_face)).map(|[missed, _]| missed));
    assert_eq!(
        kinds,
        [[0; RADII.len()]; 2],
        "missed of nodes with faces, edges with edges"
    );
}

/// Features a sixteenth of their displacement apart: the search has enough advances to exclude a contact.
#[test]
fn separate_features_are_not_in_contact() {
    for is_face in [true, false] {
        let first = if is_face { 1 } else { 2 };
        for mut query in touching(is_face) {
            let apart = query.travel() / 16.0 + 1e-2 * f64::from(query.longest_edge()) + 64.0;
            for points in &mut query.points {
                let side = |point: usize| if point < first { apart } else { 0.0 };
                // One side is above a plane, the other in it or below.
                *points = std::array::from_fn(|point| {
                    let height = points[point].z.abs();
                    points[point].with_z(if point < first { height + side(point) } else { -height })
                });
            }
            assert!(!query.is_found(RADII[0]), "{:?}", query.points);
        }
    }
}
