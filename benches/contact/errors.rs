//! Errors of a detection method: missed points, false points, and depth errors.

use glam::{DVec3, Vec3};
use sinew::detection::image_space::Placed;

use crate::random::Random;
use crate::scene::{SIZE, Scene};
use crate::truth::Truth;

/// The result of one detection of one surface in another.
#[derive(Default)]
pub struct DetectionResult {
    /// Nodes and their depths [m], in ascending order of node.
    pub nodes: Vec<(u32, f32)>,
    /// Edges and the fractions of their length between which they are inside, in ascending order of edge.
    pub edges: Vec<(u32, [f32; 2])>,
}

impl DetectionResult {
    fn has(&self, edge: u32, share: f32) -> bool {
        let first = self.edges.partition_point(|interval| interval.0 < edge);
        let intervals = self.edges[first..].iter().take_while(|interval| interval.0 == edge);
        intervals
            .into_iter()
            .any(|(_, [entry, exit])| (*entry..=*exit).contains(&share))
    }

    fn depth(&self, node: u32) -> Option<f32> {
        let index = self.nodes.binary_search_by_key(&node, |entry| entry.0).ok()?;
        Some(self.nodes[index].1)
    }
}

/// Points with known distances: on edges and at nodes of both surfaces of every pair.
pub struct Samples {
    /// One entry per pair: tissue in the ring, then ring in the tissue.
    sides: Vec<[Side; 2]>,
}

#[derive(Default)]
struct Side {
    /// The edge, the fraction along it, and the signed distance from the other surface [m].
    on_edges: Vec<(u32, f32, f64)>,
    /// The node and its signed distance from the other surface [m].
    nodes: Vec<(u32, f64)>,
}

impl Samples {
    /// Draws `count` points on edges and `count / 2` nodes for each side.
    pub fn new(scene: &Scene, count: usize) -> Self {
        let mut random = Random(7);
        let sides = scene.pairs.iter().map(|pair| {
            let placed = scene.placed(pair);
            let truths = placed.map(|body| Truth::new(body.positions, body.surface.triangles()));
            [0, 1].map(|side| Side::new(&placed[side], &placed[1 - side], &truths[1 - side], count, &mut random))
        });
        Self { sides: sides.collect() }
    }
}

impl Side {
    /// Draws points of `body` within the bounding box of `other`; no contact is possible outside.
    fn new(body: &Placed, other: &Placed, truth: &Truth, count: usize, random: &mut Random) -> Self {
        let low = other.positions.iter().copied().fold(Vec3::INFINITY, Vec3::min);
        let high = other.positions.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
        let is_near = |point: Vec3| point.cmpge(low).all() && point.cmple(high).all();
        let edges = body.surface.edges();
        let mut side = Self::default();
        // Enough tries: about a tenth or more of a surface lies in the box.
        for _ in 0..100 * count {
            if side.on_edges.len() == count {
                break;
            }
            let edge = random.below(edges.len());
            let share = 0.5 + 0.5 * random.signed();
            let [from, to] = edges[edge].map(|node| body.positions[node as usize]);
            if is_near(from.lerp(to, share)) {
                let point = from.as_dvec3().lerp(to.as_dvec3(), share.into());
                side.on_edges.push((edge as u32, share, truth.signed_distance(point)));
            }
        }
        for _ in 0..100 * count {
            if side.nodes.len() == count / 2 {
                break;
            }
            let node = random.below(body.positions.len());
            let point = body.positions[node];
            if is_near(point) {
                side.nodes.push((node as u32, truth.signed_distance(point.as_dvec3())));
            }
        }
        side
    }
}

/// The errors of a detection method. Lengths are relative to the size.
#[derive(Clone, Copy, Debug, Default)]
pub struct Errors {
    inside: usize,
    missed: usize,
    false_ones: usize,
    /// The depth of the deepest missed point, and the distance of the furthest false point.
    pub deepest_missed: f64,
    pub furthest_false: f64,
    depths: usize,
    squares: f64,
    pub worst_depth: f64,
}

impl Errors {
    /// Errors of all results, by pair and side as in the samples. A method without nodes has no node errors; a side
    /// that was not queried is `None`.
    pub fn of(samples: &Samples, detections: &[[Option<DetectionResult>; 2]]) -> Self {
        let mut errors = Self::default();
        for (sides, detections) in samples.sides.iter().zip(detections) {
            for (side, detection) in sides.iter().zip(detections) {
                if let Some(detection) = detection {
                    errors.add(side, detection);
                }
            }
        }
        errors
    }

    fn add(&mut self, side: &Side, detection: &DetectionResult) {
        for &(edge, share, distance) in &side.on_edges {
            self.record(distance, detection.has(edge, share));
        }
        if detection.nodes.is_empty() {
            return;
        }
        for &(node, distance) in &side.nodes {
            let depth = detection.depth(node);
            self.record(distance, depth.is_some());
            if let Some(depth) = depth.filter(|_| distance < 0.0) {
                self.record_depth(f64::from(depth) + distance);
            }
        }
    }

    /// Counts a point at this signed distance [m] that was reported inside or not.
    pub fn record(&mut self, distance: f64, is_reported: bool) {
        let outside = distance / f64::from(SIZE);
        self.inside += usize::from(distance < 0.0);
        if is_reported && distance >= 0.0 {
            self.false_ones += 1;
            self.furthest_false = self.furthest_false.max(outside);
        }
        if !is_reported && distance < 0.0 {
            self.missed += 1;
            self.deepest_missed = self.deepest_missed.max(-outside);
        }
    }

    /// Counts a depth error [m].
    pub fn record_depth(&mut self, error: f64) {
        let error = error.abs() / f64::from(SIZE);
        self.depths += 1;
        self.squares += error * error;
        self.worst_depth = self.worst_depth.max(error);
    }

    /// Missed points over points inside.
    pub fn missed(&self) -> f64 {
        self.missed as f64 / self.inside as f64
    }

    /// False points over points inside.
    pub fn false_ones(&self) -> f64 {
        self.false_ones as f64 / self.inside as f64
    }

    pub fn inside(&self) -> usize {
        self.inside
    }

    /// RMS depth error; `None` if there are no depths.
    pub fn depth(&self) -> Option<f64> {
        (self.depths > 0).then(|| (self.squares / self.depths as f64).sqrt())
    }
}

/// The points of a surface within a distance of another's bounding box: the query points of a tool.
pub fn near(positions: &[Vec3], other: &[Vec3], within: f32) -> Vec<Vec3> {
    let low = other.iter().copied().fold(Vec3::INFINITY, Vec3::min) - within;
    let high = other.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max) + within;
    let is_near = |point: &Vec3| point.cmpge(low).all() && point.cmple(high).all();
    positions.iter().copied().filter(is_near).collect()
}

/// Converts points to `f64`.
pub fn exact(points: &[Vec3]) -> impl Iterator<Item = DVec3> {
    points.iter().map(|point| point.as_dvec3())
}
