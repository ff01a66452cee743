//! Sheets, a body that follows the change list alone, and what has to hold after each cut.
#![allow(dead_code, clippy::unwrap_used)]

use std::collections::{BTreeMap, BTreeSet};

use glam::{DVec3, Vec2, Vec3};
use sinew::Error;
use sinew::cutting::{Changes, CutSurface, Limits, Sweep};

pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.next() as f32
    }
}

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

pub struct Spring {
    pub stiffness: f64,
    pub source: [u32; 2],
}

/// What a simulation and a renderer know: they see the surface only when it is made, and then change lists.
pub struct Body {
    pub surface: CutSurface,
    pub rest: Vec<Vec3>,
    pub positions: Vec<Vec3>,
    pub masses: Vec<f64>,
    pub first_masses: Vec<f64>,
    pub sources: Vec<u32>,
    pub springs: BTreeMap<[u32; 2], Spring>,
    pub first_springs: BTreeMap<[u32; 2], f64>,
    pub triangles: Vec<[u32; 3]>,
    /// Something that what is drawn carries: where it is in the rest shape.
    pub carried: Vec<DVec3>,
    pub bound: BTreeMap<u32, ([u32; 4], [f64; 4])>,
    pub cell_sources: Vec<u32>,
    pub first_areas: Vec<f64>,
    pub deformation: fn(Vec3) -> Vec3,
}

fn ordered(nodes: [u32; 2]) -> [u32; 2] {
    [nodes[0].min(nodes[1]), nodes[0].max(nodes[1])]
}

impl Body {
    /// Stiffness of springs by Van Gelder, masses by area, both made uneven.
    pub fn new((rest, cells): (Vec<Vec3>, Vec<[u32; 3]>), deformation: fn(Vec3) -> Vec3) -> Self {
        let surface = CutSurface::new(&rest, &cells).unwrap();
        let mut random = Random(11);
        let mut masses = vec![0.0; rest.len()];
        let mut springs = BTreeMap::new();
        for (cell, nodes) in surface.cells().iter().zip(&cells) {
            for k in 0..3 {
                masses[nodes[k] as usize] += cell.area / 3.0;
                let edge = ordered([nodes[k], nodes[(k + 1) % 3]]);
                let length = rest[edge[0] as usize].distance(rest[edge[1] as usize]) as f64;
                *springs.entry(edge).or_insert(0.0) += cell.area / (length * length);
            }
        }
        for mass in &mut masses {
            *mass *= 0.9 + 0.2 * random.next();
        }
        for stiffness in springs.values_mut() {
            *stiffness *= 0.9 + 0.2 * random.next();
        }
        Self {
            positions: rest.iter().map(|&place| deformation(place)).collect(),
            first_masses: masses.clone(),
            masses,
            sources: (0..rest.len() as u32).collect(),
            first_springs: springs.clone(),
            springs: springs
                .into_iter()
                .map(|(source, stiffness)| (source, Spring { stiffness, source }))
                .collect(),
            triangles: cells,
            carried: rest.iter().map(|place| place.as_dvec3()).collect(),
            bound: BTreeMap::new(),
            cell_sources: (0..surface.cells().len() as u32).collect(),
            first_areas: surface.cells().iter().map(|cell| cell.area).collect(),
            rest,
            surface,
            deformation,
        }
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
        let changes = self.surface.cut(&sweep, &self.positions, &near, limits)?;
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

    /// Takes over a change list, as a solver and a renderer do.
    pub fn apply(&mut self, changes: &Changes) {
        let masses = self.masses.clone();
        for piece in &changes.nodes {
            let source = piece.source as usize;
            if piece.node != piece.source {
                assert_eq!(piece.node as usize, self.masses.len(), "new nodes are numbered on");
                self.masses.push(0.0);
                self.positions.push(self.positions[source]);
                self.rest.push(self.rest[source]);
                self.sources.push(self.sources[source]);
            }
            self.masses[piece.node as usize] = masses[source] * piece.part;
        }
        let before: Vec<(f64, [u32; 2])> = changes
            .springs
            .iter()
            .map(|piece| {
                (
                    self.springs[&piece.source].stiffness,
                    self.springs[&piece.source].source,
                )
            })
            .collect();
        for source in &changes.removed_springs {
            assert!(self.springs.remove(source).is_some());
        }
        for (piece, (whole, source)) in changes.springs.iter().zip(before) {
            assert!(piece.part > 0.0);
            let spring = Spring {
                stiffness: whole * piece.part,
                source,
            };
            self.springs.insert(ordered(piece.nodes), spring);
        }
        for piece in &changes.cells {
            let source = self.cell_sources[piece.source as usize];
            if piece.cell as usize == self.cell_sources.len() {
                self.cell_sources.push(source);
            }
            assert_eq!(self.cell_sources[piece.cell as usize], source);
        }
        for bound in &changes.bound {
            let parts = || bound.nodes.iter().zip(bound.weights);
            let place: DVec3 = parts()
                .map(|(&node, weight)| weight * self.positions[node as usize].as_dvec3())
                .sum();
            if bound.point as usize == self.masses.len() {
                self.masses.push(0.0);
                self.positions.push(place.as_vec3());
                self.rest.push(Vec3::NAN);
                self.sources.push(u32::MAX);
            }
            assert_eq!(self.masses[bound.point as usize], 0.0);
            self.bound.insert(bound.point, (bound.nodes, bound.weights));
        }
        assert_eq!(self.masses.len(), self.surface.node_count() as usize);
        let known = self.carried.len();
        self.carried.resize(self.masses.len(), DVec3::NAN);
        for source in &changes.sources {
            assert!(source.point as usize >= known && self.carried[source.point as usize].is_nan());
            assert!(source.sources.iter().all(|&from| from < source.point));
            let place = (0..3)
                .map(|k| source.weights[k] * self.carried[source.sources[k] as usize])
                .sum();
            self.carried[source.point as usize] = place;
        }
        for &node in &changes.undrawn {
            assert!(node as usize >= known && self.carried[node as usize].is_nan());
        }
        assert_eq!(changes.first_triangle as usize, self.triangles.len());
        self.triangles.resize(self.surface.triangles().len(), [u32::MAX; 3]);
        for &triangle in &changes.triangles {
            self.triangles[triangle as usize] = self.surface.corner_points(triangle);
        }
    }

    /// Sum of the stiffness of a node's springs by its mass, of the worst node.
    pub fn worst_ratio(&self) -> f64 {
        let mut sums = vec![0.0; self.masses.len()];
        for (nodes, spring) in &self.springs {
            for &node in nodes {
                sums[node as usize] += spring.stiffness;
            }
        }
        sums.iter()
            .zip(&self.masses)
            .map(|(sum, mass)| sum / mass)
            .fold(0.0, f64::max)
    }

    /// Checks all that has to hold whatever was cut; returns the number of pieces.
    pub fn check(&self) -> usize {
        self.check_drawn();
        self.check_material();
        self.check_springs();
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
        let mut areas = vec![0.0; self.first_areas.len()];
        for (number, cell) in self.surface.cells().iter().enumerate() {
            let source = self.cell_sources[number] as usize;
            let part = cell.area / self.first_areas[source];
            assert!(
                (part - covered[number]).abs() < 1e-12,
                "cell {number}: {part} and {}",
                covered[number]
            );
            areas[source] += cell.area;
        }
        for (area, first) in areas.iter().zip(&self.first_areas) {
            assert!((area / first - 1.0).abs() < 1e-12);
        }
        let mut masses = vec![0.0; self.first_masses.len()];
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
        for (node, (mass, &source)) in (0..).zip(self.masses.iter().zip(&self.sources)) {
            if self.bound.contains_key(&node) {
                continue;
            }
            assert!(*mass > 0.0);
            masses[source as usize] += mass;
        }
        for (mass, first) in masses.iter().zip(&self.first_masses) {
            assert!((mass / first - 1.0).abs() < 1e-12);
        }
    }

    /// Springs lie along the cells' edges, and keep their stiffness in all.
    fn check_springs(&self) {
        let mut edges = BTreeSet::new();
        for cell in self.surface.cells() {
            for k in 0..3 {
                edges.insert(ordered([cell.nodes[k], cell.nodes[(k + 1) % 3]]));
            }
        }
        assert!(
            edges.iter().eq(self.springs.keys()),
            "springs lie along the edges of cells"
        );
        let mut sums = BTreeMap::new();
        for (nodes, spring) in &self.springs {
            assert_eq!(ordered(nodes.map(|node| self.sources[node as usize])), spring.source);
            *sums.entry(spring.source).or_insert(0.0) += spring.stiffness;
        }
        assert_eq!(sums.len(), self.first_springs.len());
        for (source, sum) in sums {
            assert!((sum / self.first_springs[&source] - 1.0).abs() < 1e-12, "{source:?}");
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

    /// How many nodes are simulated.
    pub fn simulated_count(&self) -> u32 {
        self.surface.node_count() - self.bound.len() as u32
    }

    fn simulated_pieces(&self) -> usize {
        let mut union = Union::new(self.surface.node_count() as usize);
        for nodes in self.springs.keys() {
            union.unite(nodes[0], nodes[1]);
        }
        union.count() - self.bound.len()
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
            let area = self.first_areas[source] * self.surface.part_of_cell(number as u32);
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

struct Union(Vec<u32>);

impl Union {
    fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    fn root(&mut self, mut at: u32) -> u32 {
        while self.0[at as usize] != at {
            self.0[at as usize] = self.0[self.0[at as usize] as usize];
            at = self.0[at as usize];
        }
        at
    }

    fn unite(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a as usize] = b;
    }

    fn count(&mut self) -> usize {
        (0..self.0.len() as u32).filter(|&at| self.root(at) == at).count()
    }
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
