//! Sheets, a body that follows the change list alone, and what has to hold after each cut.
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

/// A grid of which inner nodes are shaken, and of which edges are turned at random where that leaves no thin triangle.
pub fn unstructured(n: usize, seed: u64) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let mut random = Random(seed);
    let (mut rest, mut cells) = grid(n);
    for place in &mut rest {
        let is_inside = |x: f32| x > 0.0 && x < n as f32;
        if is_inside(place.x) && is_inside(place.y) {
            *place += Vec3::new(random.between(-0.3, 0.3), random.between(-0.3, 0.3), 0.0);
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

    /// Where the blade's edge stands upright at a point of the rest shape.
    fn blade(&self, at: Vec2) -> [Vec3; 2] {
        let place = (self.deformation)(at.extend(0.0));
        [place - 3.0 * Vec3::Z, place + 3.0 * Vec3::Z]
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
        for way in points.windows(2) {
            let (changes, to) = (self.cut(way[0], way[1]), way[1]);
            for &end in &changes.ends {
                let off = self.surface.rest_place(end).truncate().distance(to.as_dvec2());
                assert!(off <= 1.01 * snap(self), "the cut ends {off} from where the blade does");
            }
        }
    }

    pub fn apply(&mut self, changes: &Changes) {
        let (surface, count) = (&self.surface, self.surface.triangles().len());
        self.follower.apply(changes, surface.node_count(), count, |triangle| {
            surface.corner_points(triangle)
        });
    }

    /// Checks all that has to hold whatever was cut; returns the number of pieces.
    pub fn check(&self) -> usize {
        self.check_drawn();
        self.check_material();
        self.check_masses();
        self.check_springs(self.surface.cells().iter().map(|cell| cell.nodes), &EDGES);
        let (drawn, simulated) = (self.drawn_pieces(), self.simulated_pieces());
        assert_eq!(
            drawn, simulated,
            "pieces that are drawn, and that nodes hang together in"
        );
        assert_eq!(drawn, self.surface.piece_count().unwrap() as usize);
        drawn
    }

    /// The drawn mesh is manifold, and is what the change lists made of the first.
    fn check_drawn(&self) {
        let triangles = self.surface.triangles();
        assert_eq!(self.triangles.len(), triangles.len());
        let mut sides = BTreeMap::new();
        let mut at_vertex = vec![Vec::new(); self.surface.vertices().len()];
        for (number, triangle) in triangles.iter().enumerate() {
            assert_eq!(
                self.triangles[number],
                self.surface.corner_points(number as u32),
                "triangle {number} as lists tell it"
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
                assert!(a && b, "the edge of {from} and {to} is cut on one side alone");
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
                "the triangles about vertex {vertex} are one fan"
            );
            let point = self.surface.vertices()[vertex].point;
            assert!(points.insert(point), "point {point} is two vertices");
            let carried = self.carried[point as usize].distance(self.surface.rest_place(vertex as u32));
            assert!(
                carried < 1e-9,
                "vertex {vertex} carries what its sources did, {carried} off"
            );
        }
    }

    /// No material is lost: each cell is covered exactly, and what it was copied from too.
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
                    let told = ([nodes[0], nodes[1], nodes[2]], [weights[0], weights[1], weights[2]]);
                    assert_eq!(told, (vertex.nodes, vertex.weights), "point {point} as lists tell it");
                    assert_eq!(weights[3], 0.0);
                }
            }
        }
    }

    fn drawn_pieces(&self) -> usize {
        let mut union = Union::new(self.surface.vertices().len());
        for triangle in self.surface.triangles() {
            union.unite(triangle.corners[0], triangle.corners[1]);
            union.unite(triangle.corners[0], triangle.corners[2]);
        }
        union.count()
    }

    /// The areas of the pieces that are drawn, in the rest shape, in ascending order.
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

    /// Which piece each node is in.
    pub fn pieces(&self) -> Vec<u32> {
        let mut union = Union::new(self.surface.node_count() as usize);
        for nodes in self.springs.keys() {
            union.unite(nodes[0], nodes[1]);
        }
        (0..self.surface.node_count()).map(|node| union.root(node)).collect()
    }

    /// The rim in the rest shape.
    pub fn rim(&self) -> Vec<[DVec3; 2]> {
        let mut rim = Vec::new();
        for triangle in self.surface.triangles() {
            for k in (0..3).filter(|&k| triangle.rim[k]) {
                rim.push([k, (k + 1) % 3].map(|k| self.surface.rest_place(triangle.corners[k])));
            }
        }
        rim
    }

    /// The rim lies on the way of the blade, and the way of the blade on the rim; the largest distances.
    pub fn off_the_way(&self, points: &[Vec2]) -> (f64, f64) {
        let way: Vec<[DVec3; 2]> = points
            .windows(2)
            .map(|way| [way[0], way[1]].map(|point| point.extend(0.0).as_dvec3()))
            .collect();
        let rim = self.rim();
        (farthest(&rim, &way), farthest(&way, &rim))
    }
}

/// The largest distance from points of the one set of segments to the other set.
fn farthest(of: &[[DVec3; 2]], from: &[[DVec3; 2]]) -> f64 {
    let mut largest = 0.0f64;
    for [a, b] in of {
        let steps = (a.distance(*b) / 0.02).ceil().max(1.0) as usize;
        for step in 0..=steps {
            let point = a.lerp(*b, step as f64 / steps as f64);
            let nearest = from.iter().map(|&[a, b]| {
                let way = b - a;
                let along = if way == DVec3::ZERO {
                    0.0
                } else {
                    (point - a).dot(way) / way.length_squared()
                };
                point.distance(a + along.clamp(0.0, 1.0) * way)
            });
            largest = largest.max(nearest.fold(f64::INFINITY, f64::min));
        }
    }
    largest
}

/// The sheet at rest.
pub fn flat(place: Vec3) -> Vec3 {
    place
}

/// The sheet bent and stretched, so that straight ways stay in planes that stand upright.
pub fn wavy(place: Vec3) -> Vec3 {
    Vec3::new(
        1.3 * place.x + 0.2 * place.y,
        0.8 * place.y,
        (0.7 * place.x).sin() * (0.5 * place.y).cos(),
    )
}

/// The sheet 2000 edges off, where rounding of places is 1e-4 of an edge.
pub fn far(place: Vec3) -> Vec3 {
    wavy(place) + Vec3::new(2000.0, -1700.0, 900.0)
}

/// The shortest edge's twentieth is the snapping distance of a cell; the largest of all cells.
pub fn snap(body: &Body) -> f64 {
    body.surface.cells().iter().map(|cell| cell.snap).fold(0.0, f64::max)
}
