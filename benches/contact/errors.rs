//! What a way of detection misses, finds that is not there, and how far its depths are off.

use glam::{DVec3, Vec3};
use sinew::detection::image_space::Placed;

use crate::random::Random;
use crate::scene::{SIZE, Scene};
use crate::truth::Truth;

/// What a detection found of one surface in another, whatever the way.
#[derive(Default)]
pub struct Found {
    /// Nodes and their depths, m, in ascending order.
    pub nodes: Vec<(u32, f32)>,
    /// Edges and the shares of them between which they are inside, in ascending order.
    pub edges: Vec<(u32, [f32; 2])>,
}

impl Found {
    fn has(&self, edge: u32, share: f32) -> bool {
        let first = self.edges.partition_point(|part| part.0 < edge);
        let parts = self.edges[first..].iter().take_while(|part| part.0 == edge);
        parts
            .into_iter()
            .any(|(_, [entry, exit])| (*entry..=*exit).contains(&share))
    }

    fn depth(&self, node: u32) -> Option<f32> {
        let place = self.nodes.binary_search_by_key(&node, |found| found.0).ok()?;
        Some(self.nodes[place].1)
    }
}

/// Points whose place is known: on edges and at nodes of both surfaces of every pair.
pub struct Samples {
    /// By pair, then the tissue's in the ring and the ring's in the tissue.
    sides: Vec<[Side; 2]>,
}

#[derive(Default)]
struct Side {
    /// The edge, the share along it, and the signed distance from the other surface, m.
    on_edges: Vec<(u32, f32, f64)>,
    /// Likewise.
    nodes: Vec<(u32, f64)>,
}

impl Samples {
    /// So many of each on each side.
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
    /// Of `body` within the box about `other`: beyond it nothing is found.
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

/// The errors of a way of detection, lengths in parts of the size.
#[derive(Clone, Copy, Debug, Default)]
pub struct Errors {
    inside: usize,
    missed: usize,
    false_ones: usize,
    /// What lies deepest of what was missed, and furthest outside of what was found.
    pub deepest_missed: f64,
    pub furthest_false: f64,
    depths: usize,
    squares: f64,
    pub worst_depth: f64,
}

impl Errors {
    /// Of everything found, by pair and side as in the samples; without nodes where the method finds none, without a side where
    /// it was not asked.
    pub fn of(samples: &Samples, found: &[[Option<Found>; 2]]) -> Self {
        let mut errors = Self::default();
        for (sides, found) in samples.sides.iter().zip(found) {
            for (side, found) in sides.iter().zip(found) {
                if let Some(found) = found {
                    errors.add(side, found);
                }
            }
        }
        errors
    }

    fn add(&mut self, side: &Side, found: &Found) {
        for &(edge, share, distance) in &side.on_edges {
            self.see(distance, found.has(edge, share));
        }
        if found.nodes.is_empty() {
            return;
        }
        for &(node, distance) in &side.nodes {
            let depth = found.depth(node);
            self.see(distance, depth.is_some());
            if let Some(depth) = depth.filter(|_| distance < 0.0) {
                self.see_depth(f64::from(depth) + distance);
            }
        }
    }

    /// A point this far from the surface, m, that was found inside or not.
    pub fn see(&mut self, distance: f64, found: bool) {
        let outside = distance / f64::from(SIZE);
        self.inside += usize::from(distance < 0.0);
        if found && distance >= 0.0 {
            self.false_ones += 1;
            self.furthest_false = self.furthest_false.max(outside);
        }
        if !found && distance < 0.0 {
            self.missed += 1;
            self.deepest_missed = self.deepest_missed.max(-outside);
        }
    }

    /// A depth that is off by so much, m.
    pub fn see_depth(&mut self, error: f64) {
        let error = error.abs() / f64::from(SIZE);
        self.depths += 1;
        self.squares += error * error;
        self.worst_depth = self.worst_depth.max(error);
    }

    /// In parts of the points inside.
    pub fn missed(&self) -> f64 {
        self.missed as f64 / self.inside as f64
    }

    /// Likewise.
    pub fn false_ones(&self) -> f64 {
        self.false_ones as f64 / self.inside as f64
    }

    pub fn inside(&self) -> usize {
        self.inside
    }

    /// RMS; `None` where no depth is told.
    pub fn depth(&self) -> Option<f64> {
        (self.depths > 0).then(|| (self.squares / self.depths as f64).sqrt())
    }
}

/// The points of a surface within a distance of another's box: what a tool is asked about.
pub fn near(positions: &[Vec3], other: &[Vec3], within: f32) -> Vec<Vec3> {
    let low = other.iter().copied().fold(Vec3::INFINITY, Vec3::min) - within;
    let high = other.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max) + within;
    let is_near = |point: &Vec3| point.cmpge(low).all() && point.cmple(high).all();
    positions.iter().copied().filter(is_near).collect()
}

/// As vectors of `f64`.
pub fn exact(points: &[Vec3]) -> impl Iterator<Item = DVec3> {
    points.iter().map(|point| point.as_dvec3())
}
