//! Sheets, a body that follows change lists only, and the invariants after each cut.
#![allow(dead_code, clippy::unwrap_used)]

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Deref;

use glam::{DVec3, Vec2, Vec3};
use sinew::Error;
use sinew::cutting::{Changes, CutSurface, Limits, Sweep};

use crate::support::change_lists::{Follower, Union};
use crate::support::random::Random;

/// A grid of `n` x `n` squares of side 1, each of two triangles, in the plane z = 0.
pub fn grid(n: usize) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let rest = (0..=n)
        .flat_map(|y| (0..=n).map(move |x| Vec3::new(x as f32, y as f32, 0.0)))
        .collect();
    let at = |x: usize, y: usize| (y * (n + 1) + x) as u32;
    let mut cells = Vec::new();
    for y in 0..n {
        for x in 0..n {
            let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
            if (x + y) % 2 == 0 {
                cells.extend([[a, b, c], [a, c, d]]);
            } else {
                cells.extend([[a, b, d], [b, c, d]]);
            }
        }
    }
    (rest, cells)
}

/// A grid whose inner nodes are moved at random, with edges flipped at random where that leaves no thin triangle.
pub fn unstructured(n: usize, seed: u64) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let mut random = Random(seed);
    let (mut rest, mut cells) = grid(n);
    for position in &mut rest {
        let is_inside = |x: f32| x > 0.0 && x < n as f32;
        if is_inside(position.x) && is_inside(position.y) {
            *position += Vec3::new(random.between(-0.3, 0.3), random.between(-0.3, 0.3), 0.0);
        }
    }
    for _ in 0..2 * cells.len() {
        let first = (random.next() * cells.len() as f64) as usize;
        let side = (random.next() * 3.0) as usize;
        let [a, b, c] = [0, 1, 2].map(|k| cells[first][(side + k) % 3]);
        let Some(second) = cells
            .iter()
            .position(|it| (0..3).any(|k| (it[k], it[(k + 1) % 3]) == (b, a)))
        else {
            continue;
        };
        let d = *cells[second].iter().find(|&&node| node != a && node != b).unwrap();
        let area = |t: [u32; 3]| {
            let [p, q, r] = t.map(|node| rest[node as usize]);
            (q - p).cross(r - p).z
        };
        let (one, other) = ([a, d, c], [d, b, c]);
        if area(one) > 0.2 && area(other) > 0.2 {
            (cells[first], cells[second]) = (one, other);
        }
    }
    (rest, cells)
}

const EDGES: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];

pub struct Body {
    pub surface: CutSurface,
    pub follower: Follower,
}

impl Deref for Body {
    type Target = Follower;

    fn deref(&self) -> &Follower {
        &self.follower
    }
}

impl Body {
    pub fn new((rest, triangles): (Vec<Vec3>, Vec<[u32; 3]>), deformation: fn(Vec3) -> Vec3) -> Self {
        let surface = CutSurface::new(&rest, &triangles).unwrap();
        let cells: Vec<_> = surface.cells().iter().map(|cell| (cell.nodes, cell.area)).collect();
        let follower = Follower::new(rest, &cells, &EDGES, triangles, deformation);
        Self { surface, follower }
    }

    /// Returns the blade's edge, upright at a point of the rest shape.
    fn blade(&self, at: Vec2) -> [Vec3; 2] {
        let position = (self.deformation)(at.extend(0.0));
        [position - 3.0 * Vec3::Z, position + 3.0 * Vec3::Z]
    }

    /// Cuts straight from one point of the rest shape to another.
    pub fn cut(&mut self, from: Vec2, to: Vec2) -> Changes {
        self.try_cut(from, to, Limits::NONE).unwrap()
    }

    pub fn sweep(&self, from: Vec2, to: Vec2) -> Sweep {
        Sweep {
            start: self.blade(from),
            end: self.blade(to),
        }
    }

    pub fn try_cut(&mut self, from: Vec2, to: Vec2, limits: Limits) -> Result<Changes, Error> {
        let sweep = self.sweep(from, to);
        let near = self.surface.near(&sweep, &self.positions)?;
        let before = self.surface.piece_count()?;
        let changes = self.surface.cut(&sweep, &self.follower.positions, &near, limits)?;
        let parted = self.surface.parted(&changes.rim, usize::MAX)?;
        assert_eq!(
            parted,
            Some(self.surface.piece_count()? - before),
            "pieces that the cut has parted"
        );
        self.apply(&changes);
        Ok(changes)
    }

    /// Cuts along a line of points, stopping at each.
    pub fn cut_along(&mut self, points: &[Vec2]) {
        for segment in points.windows(2) {
            let (changes, to) = (self.cut(segment[0], segment[1]), segment[1]);
            for &end in &changes.ends {
                let distance = self.surface.rest_place(end).truncate().distance(to.as_dvec2());
                assert!(
                    distance <= 1.01 * snap(self),
                    "the cut ends {distance} from the end of the blade"
                );
            }
        }
    }

    pub fn apply(&mut self, changes: &Changes) {
        let (surface, count) = (&self.surface, self.surface.triangles().len());
        self.follower.apply(changes, surface.node_count(), count, |triangle| {
            surface.corner_points(triangle)
        });
    }

    /// Checks all invariants; returns the number of pieces.
    pub fn check(&self) -> usize {
        self.check_render_mesh();
        self.check_material();
        self.check_masses();
        self.check_springs(self.surface.cells().iter().map(|cell| cell.nodes), &EDGES);
        let (drawn, simulated) = (self.render_pieces(), self.simulated_pieces());
        assert_eq!(
            drawn, simulated,
            "pieces that are drawn, and that nodes hang together in"
        );
        assert_eq!(drawn, self.surface.piece_count().unwrap() as usize);
        drawn
    }

    /// Checks that the render mesh is manifold and equals the first one updated by the change lists.
    fn check_render_mesh(&self) {
        let triangles = self.surface.triangles();
        assert_eq!(self.triangles.len(), triangles.len());
        let mut sides = BTreeMap::new();
        let mut at_vertex = vec![Vec::new(); self.surface.vertices().len()];
        for (number, triangle) in triangles.iter().enumerate() {
            assert_eq!(
                self.triangles[number],
                self.surface.corner_points(number as u32),
                "triangle {number} differs from the change lists"
            );
            for k in 0..3 {
                let (from, to) = (triangle.corners[k], triangle.corners[(k + 1) % 3]);
                assert_ne!(from, to);
                assert!(
                    sides.insert((from, to), (number, triangle.rim[k])).is_none(),
                    "two sides from {from} to {to}"
                );
                at_vertex[from as usize].push(number);
            }
        }
        let joined = |from: u32, to: u32| match (sides.get(&(from, to)), sides.get(&(to, from))) {
            (Some(&(_, false)), Some(&(across, false))) => Some(across),
            (Some(&(_, a)), Some(&(_, b))) => {
                assert!(a && b, "the edge of {from} and {to} is cut on one side only");
                None
            }
            _ => None,
        };
        let mut points = BTreeSet::new();
        for (vertex, about) in at_vertex.iter().enumerate() {
            assert!(!about.is_empty(), "vertex {vertex} is in no triangle");
            let mut seen = BTreeSet::from([about[0]]);
            let mut open = vec![about[0]];
            while let Some(triangle) = open.pop() {
                let corners = triangles[triangle].corners;
                for k in 0..3 {
                    let (from, to) = (corners[k], corners[(k + 1) % 3]);
                    if from as usize != vertex && to as usize != vertex {
                        continue;
                    }
                    if let Some(across) = joined(from, to)
                        && seen.insert(across)
                    {
                        open.push(across);
                    }
                }
            }
            assert_eq!(
                seen.len(),
                about.len(),
                "the triangles around vertex {vertex} are one fan"
            );
            let point = self.surface.vertices()[vertex].point;
            assert!(points.insert(point), "point {point} is two vertices");
            let carried = self.carried[point as usize].distance(self.surface.rest_place(vertex as u32));
            assert!(carried < 1e-9, "vertex {vertex} differs from its sources by {carried}");
        }
    }

    /// Checks that no material is lost: each cell is covered exactly, and so is each cell it was copied from.
    fn check_material(&self) {
        let mut covered = vec![0.0; self.surface.cells().len()];
        for (number, triangle) in self.surface.triangles().iter().enumerate() {
            let part = self.surface.part_of_cell(number as u32);
            assert!(part > 0.0, "triangle {number} is turned over: {part}");
            covered[triangle.cell as usize] += part;
            let nodes = self.surface.cells()[triangle.cell as usize].nodes;
            for corner in triangle.corners {
                let vertex = &self.surface.vertices()[corner as usize];
                assert!(
                    vertex.nodes.iter().all(|node| nodes.contains(node)),
                    "vertex {corner} lies in its cell"
                );
                assert!(vertex.weights.iter().all(|&weight| weight >= 0.0));
                assert!((vertex.weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            }
        }
        let mut areas = vec![0.0; self.first_sizes.len()];
        for (number, cell) in self.surface.cells().iter().enumerate() {
            let source = self.cell_sources[number] as usize;
            let part = cell.area / self.first_sizes[source];
            assert!(
                (part - covered[number]).abs() < 1e-12,
                "cell {number}: {part} and {}",
                covered[number]
            );
            areas[source] += cell.area;
        }
        for (area, first) in areas.iter().zip(&self.first_sizes) {
            assert!((area / first - 1.0).abs() < 1e-12);
        }
        for (point, vertex) in self.surface.vertices().iter().map(|vertex| (vertex.point, vertex)) {
            match self.bound.get(&point) {
                None => assert_eq!((vertex.nodes[0], vertex.weights[0]), (point, 1.0)),
                Some((nodes, weights)) => {
                    let reported = ([nodes[0], nodes[1], nodes[2]], [weights[0], weights[1], weights[2]]);
                    assert_eq!(
                        reported,
                        (vertex.nodes, vertex.weights),
                        "point {point} differs from the change lists"
                    );
                    assert_eq!(weights[3], 0.0);
                }
            }
        }
    }

    fn render_pieces(&self) -> usize {
        let mut union = Union::new(self.surface.vertices().len());
        for triangle in self.surface.triangles() {
            union.unite(triangle.corners[0], triangle.corners[1]);
            union.unite(triangle.corners[0], triangle.corners[2]);
        }
        union.count()
    }

    /// Returns the areas of the pieces of the render mesh, in the rest shape, in ascending order.
    pub fn piece_areas(&self) -> Vec<f64> {
        let mut union = Union::new(self.surface.vertices().len());
        for triangle in self.surface.triangles() {
            union.unite(triangle.corners[0], triangle.corners[1]);
            union.unite(triangle.corners[0], triangle.corners[2]);
        }
        let mut areas = BTreeMap::new();
        for (number, triangle) in self.surface.triangles().iter().enumerate() {
            let source = self.cell_sources[triangle.cell as usize] as usize;
            let area = self.first_sizes[source] * self.surface.part_of_cell(number as u32);
            *areas.entry(union.root(triangle.corners[0])).or_insert(0.0) += area;
        }
        let mut areas: Vec<f64> = areas.into_values().collect();
        areas.sort_by(f64::total_cmp);
        areas
    }

    /// Returns the piece of each node.
    pub fn pieces(&self) -> Vec<u32> {
        let mut union = Union::new(self.surface.node_count() as usize);
        for nodes in self.springs.keys() {
            union.unite(nodes[0], nodes[1]);
        }
        (0..self.surface.node_count()).map(|node| union.root(node)).collect()
    }

    /// Returns the cut boundary in the rest shape.
    pub fn rim(&self) -> Vec<[DVec3; 2]> {
        let mut rim = Vec::new();
        for triangle in self.surface.triangles() {
            for k in (0..3).filter(|&k| triangle.rim[k]) {
                rim.push([k, (k + 1) % 3].map(|k| self.surface.rest_place(triangle.corners[k])));
            }
        }
        rim
    }

    /// Returns the largest distances of the cut boundary from the blade's path, and of the path from the cut boundary.
    pub fn distance_from_path(&self, points: &[Vec2]) -> (f64, f64) {
        let path: Vec<[DVec3; 2]> = points
            .windows(2)
            .map(|ends| [ends[0], ends[1]].map(|point| point.extend(0.0).as_dvec3()))
            .collect();
        let rim = self.rim();
        (farthest(&rim, &path), farthest(&path, &rim))
    }
}

/// Returns the largest distance from points of one set of segments to the other set.
fn farthest(segments: &[[DVec3; 2]], others: &[[DVec3; 2]]) -> f64 {
    let mut largest = 0.0f64;
    for [a, b] in segments {
        let steps = (a.distance(*b) / 0.02).ceil().max(1.0) as usize;
        for step in 0..=steps {
            let point = a.lerp(*b, step as f64 / steps as f64);
            let nearest = others.iter().map(|&[a, b]| {
                let direction = b - a;
                let along = if direction == DVec3::ZERO {
                    0.0
                } else {
                    (point - a).dot(direction) / direction.length_squared()
                };
                point.distance(a + along.clamp(0.0, 1.0) * direction)
            });
            largest = largest.max(nearest.fold(f64::INFINITY, f64::min));
        }
    }
    largest
}

/// The sheet at rest.
pub fn flat(position: Vec3) -> Vec3 {
    position
}

/// The sheet bent and stretched, so that straight paths stay in upright planes.
pub fn wavy(position: Vec3) -> Vec3 {
    Vec3::new(
        1.3 * position.x + 0.2 * position.y,
        0.8 * position.y,
        (0.7 * position.x).sin() * (0.5 * position.y).cos(),
    )
}

/// The sheet 2000 edges away, where rounding of positions is 1e-4 of an edge.
pub fn far(position: Vec3) -> Vec3 {
    wavy(position) + Vec3::new(2000.0, -1700.0, 900.0)
}

/// The snapping distance of a cell is a twentieth of its shortest edge; this is the largest of all cells.
pub fn snap(body: &Body) -> f64 {
    body.surface.cells().iter().map(|cell| cell.snap).fold(0.0, f64::max)
}
