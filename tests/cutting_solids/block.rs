//! Blocks, a body that follows the change list alone, and what has to hold after each cut.
#![allow(dead_code)]

use std::collections::{BTreeMap, BTreeSet};

use glam::{DVec3, Vec3, vec3};
use sinew::Error;
use sinew::cutting::{Changes, CutSolid, Limits, Sweep};

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

    pub fn point(&mut self, low: f32, high: f32) -> Vec3 {
        vec3(
            self.between(low, high),
            self.between(low, high),
            self.between(low, high),
        )
    }
}

pub type Mesh = (Vec<Vec3>, Vec<[u32; 4]>);

/// A block of `size` cubes of side 1, each of six tetrahedra about its diagonal.
pub fn block(size: [usize; 3]) -> Mesh {
    let [nx, ny, nz] = size;
    let mut rest = Vec::new();
    for z in 0..=nz {
        for y in 0..=ny {
            for x in 0..=nx {
                rest.push(vec3(x as f32, y as f32, z as f32));
            }
        }
    }
    let at = |p: [usize; 3]| ((p[2] * (ny + 1) + p[1]) * (nx + 1) + p[0]) as u32;
    let mut cells = Vec::new();
    for z in 0..nz {
        for y in 0..ny {
            for x in 0..nx {
                for way in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
                    let mut p = [x, y, z];
                    let mut cell = [at(p); 4];
                    for (k, &axis) in way.iter().enumerate() {
                        p[axis] += 1;
                        cell[k + 1] = at(p);
                    }
                    cells.push(cell);
                }
            }
        }
    }
    (rest, cells)
}

/// A block of which each cube has five tetrahedra, turned from cube to cube, and of which inner nodes are shaken, also within the outer faces.
pub fn shaken(size: [usize; 3], seed: u64) -> Mesh {
    let mut random = Random(seed);
    let [nx, ny, nz] = size;
    let (mut rest, _) = block(size);
    for place in &mut rest {
        for (k, n) in size.into_iter().enumerate() {
            if place[k] > 0.0 && place[k] < n as f32 {
                place[k] += random.between(-0.2, 0.2);
            }
        }
    }
    let at = |x: usize, y: usize, z: usize| ((z * (ny + 1) + y) * (nx + 1) + x) as u32;
    let mut cells = Vec::new();
    for z in 0..nz {
        for y in 0..ny {
            for x in 0..nx {
                let c = |k: usize| at(x + (k & 1), y + (k >> 1 & 1), z + (k >> 2));
                let five = if (x + y + z) % 2 == 0 {
                    [[0, 3, 5, 6], [1, 0, 3, 5], [2, 0, 3, 6], [4, 0, 5, 6], [7, 3, 5, 6]]
                } else {
                    [[1, 2, 4, 7], [0, 1, 2, 4], [3, 1, 2, 7], [5, 1, 4, 7], [6, 2, 4, 7]]
                };
                cells.extend(five.map(|cell| cell.map(c)));
            }
        }
    }
    (rest, cells)
}

/// A cell with its corners turned as bodies ask for.
pub fn upright(rest: &[Vec3], [a, b, c, d]: [u32; 4]) -> [u32; 4] {
    if volume([a, b, c, d].map(|node| rest[node as usize].as_dvec3())) > 0.0 {
        [a, b, c, d]
    } else {
        [a, b, d, c]
    }
}

pub struct Spring {
    pub stiffness: f64,
    pub source: [u32; 2],
}

/// What a simulation and a renderer know: they see the solid only when it is made, and then change lists.
pub struct Body {
    pub solid: CutSolid,
    pub rest: Vec<Vec3>,
    pub positions: Vec<Vec3>,
    pub masses: Vec<f64>,
    pub first_masses: Vec<f64>,
    pub sources: Vec<u32>,
    pub springs: BTreeMap<[u32; 2], Spring>,
    pub first_springs: BTreeMap<[u32; 2], f64>,
    pub triangles: Vec<[u32; 3]>,
    /// Something that nodes and points carry: where they are in the rest shape.
    pub carried: Vec<DVec3>,
    pub bound: BTreeMap<u32, ([u32; 4], [f64; 4])>,
    pub cell_sources: Vec<u32>,
    pub first_volumes: Vec<f64>,
    pub deformation: fn(Vec3) -> Vec3,
}

const EDGES: [(usize, usize); 6] = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];

fn ordered(nodes: [u32; 2]) -> [u32; 2] {
    [nodes[0].min(nodes[1]), nodes[0].max(nodes[1])]
}

pub fn volume([a, b, c, d]: [DVec3; 4]) -> f64 {
    (b - a).cross(c - a).dot(d - a) / 6.0
}

impl Body {
    /// Stiffness of springs by volume and length, masses by volume, both made uneven.
    pub fn new((rest, cells): Mesh, deformation: fn(Vec3) -> Vec3) -> Self {
        let solid = CutSolid::new(&rest, &cells, &[]).unwrap();
        let mut random = Random(11);
        let mut masses = vec![0.0; rest.len()];
        let mut springs = BTreeMap::new();
        for cell in solid.cells() {
            for node in cell.nodes {
                masses[node as usize] += cell.volume / 4.0;
            }
            for (a, b) in EDGES {
                let edge = ordered([cell.nodes[a], cell.nodes[b]]);
                let length = rest[edge[0] as usize].distance(rest[edge[1] as usize]) as f64;
                *springs.entry(edge).or_insert(0.0) += cell.volume / (length * length);
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
            triangles: solid.triangles().iter().map(|triangle| triangle.corners).collect(),
            carried: rest.iter().map(|place| place.as_dvec3()).collect(),
            bound: BTreeMap::new(),
            cell_sources: (0..cells.len() as u32).collect(),
            first_volumes: solid.cells().iter().map(|cell| cell.volume).collect(),
            rest,
            solid,
            deformation,
        }
    }

    /// The blade's edge goes straight from one place to another, all in the rest shape.
    pub fn sweep(&self, start: [Vec3; 2], end: [Vec3; 2]) -> Sweep {
        Sweep {
            start: start.map(self.deformation),
            end: end.map(self.deformation),
        }
    }

    pub fn cut(&mut self, start: [Vec3; 2], end: [Vec3; 2]) -> Changes {
        self.try_cut(start, end, Limits::NONE).unwrap()
    }

    pub fn try_cut(&mut self, start: [Vec3; 2], end: [Vec3; 2], limits: Limits) -> Result<Changes, Error> {
        let sweep = self.sweep(start, end);
        let near = self.solid.near(&sweep, &self.positions)?;
        let before = self.solid.piece_count()?;
        let changes = self.solid.cut(&sweep, &self.positions, &near, limits)?;
        let parted = self.solid.parted(&changes.faces, usize::MAX)?;
        assert_eq!(
            parted,
            Some(self.solid.piece_count()? - before),
            "pieces that the cut has parted"
        );
        self.apply(&changes);
        Ok(changes)
    }

    /// The blade's edge goes along a line of places, stopping at each.
    pub fn cut_along(&mut self, edges: &[[Vec3; 2]]) {
        for way in edges.windows(2) {
            self.cut(way[0], way[1]);
        }
    }

    /// Takes over a change list, as a solver and a renderer do.
    pub fn apply(&mut self, changes: &Changes) {
        let masses = self.masses.clone();
        for piece in &changes.nodes {
            let source = piece.source as usize;
            assert!(piece.part > 0.0);
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
                let spring = &self.springs[&piece.source];
                (spring.stiffness, spring.source)
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
        assert_eq!(self.masses.len(), self.solid.node_count() as usize);
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
            self.carried[node as usize] = self.rest[node as usize].as_dvec3();
        }
        assert!(
            self.carried.iter().all(|place| !place.is_nan()),
            "all that is new is told of"
        );
        assert_eq!(changes.first_triangle as usize, self.triangles.len());
        self.triangles.resize(self.solid.triangles().len(), [u32::MAX; 3]);
        for &triangle in &changes.triangles {
            self.triangles[triangle as usize] = self.solid.corner_points(triangle);
        }
    }

    /// How many nodes there are beside points that are bound to others.
    pub fn nodes_that_move(&self) -> usize {
        self.masses.len() - self.bound.len()
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
            .filter(|&(_, &mass)| mass > 0.0)
            .map(|(sum, mass)| sum / mass)
            .fold(0.0, f64::max)
    }

    /// Checks all that has to hold whatever was cut; returns the number of pieces.
    pub fn check(&self) -> usize {
        self.check_drawn();
        self.check_material();
        self.check_springs();
        let (pieces, simulated) = (self.piece_volumes().len(), self.simulated_pieces());
        assert_eq!(pieces, simulated, "pieces of material, and that nodes hang together in");
        assert_eq!(pieces, self.solid.piece_count().unwrap() as usize);
        pieces
    }

    /// What is drawn is a closed manifold about the material, and is what the change lists made of the first.
    pub fn check_drawn(&self) {
        let triangles = self.solid.triangles();
        assert_eq!(self.triangles.len(), triangles.len());
        let mut sides = BTreeMap::new();
        let mut at_vertex = BTreeMap::new();
        let mut enclosed = 0.0;
        let center = self.rest[0].as_dvec3();
        for (number, triangle) in triangles.iter().enumerate() {
            assert_eq!(
                self.triangles[number],
                self.solid.corner_points(number as u32),
                "triangle {number} as lists tell it"
            );
            let [a, b, c] = triangle.corners.map(|corner| self.solid.rest_place(corner) - center);
            enclosed += a.dot(b.cross(c)) / 6.0;
            for k in 0..3 {
                let (from, to) = (triangle.corners[k], triangle.corners[(k + 1) % 3]);
                assert_ne!(from, to);
                assert!(
                    sides.insert((from, to), number).is_none(),
                    "two sides from {from} to {to}"
                );
                at_vertex.entry(from).or_insert_with(Vec::new).push(number);
            }
        }
        for &(from, to) in sides.keys() {
            assert!(
                sides.contains_key(&(to, from)),
                "nothing drawn across the side from {from} to {to}"
            );
        }
        for (vertex, about) in at_vertex {
            let mut count = 0;
            let mut triangle = about[0];
            loop {
                count += 1;
                let corners = triangles[triangle].corners;
                let k = corners.iter().position(|&corner| corner == vertex).unwrap();
                triangle = sides[&(vertex, corners[(k + 2) % 3])];
                if triangle == about[0] {
                    break;
                }
            }
            assert_eq!(count, about.len(), "the triangles about vertex {vertex} are one fan");
        }
        let material: f64 = self.first_volumes.iter().sum();
        assert!(
            (enclosed / material - 1.0).abs() < 1e-10,
            "{enclosed} is drawn about {material} of material"
        );
        let (mut known, mut bound) = (BTreeSet::new(), 0);
        for (number, vertex) in self.solid.vertices().iter().enumerate() {
            let off = self.carried[vertex.point as usize].distance(self.solid.rest_place(number as u32));
            assert!(off < 1e-9, "vertex {number} carries what its sources did, {off} off");
            assert!(known.insert(vertex.point), "point {} is two vertices", vertex.point);
            if vertex.point == vertex.nodes[0] {
                assert_eq!(vertex.weights[0], 1.0);
            } else {
                bound += 1;
                let told = &self.bound[&vertex.point];
                assert_eq!(told, &(vertex.nodes, vertex.weights));
            }
        }
        assert_eq!(bound, self.bound.len());
    }

    /// No material is lost: each cell is filled exactly, and what it was copied from too.
    pub fn check_material(&self) {
        let mut filled = vec![0.0; self.solid.cells().len()];
        for (number, tetrahedron) in self.solid.tetrahedra().iter().enumerate() {
            let places = tetrahedron.corners.map(|corner| self.solid.rest_place(corner));
            let volume = volume(places);
            let first = self.first_volumes[self.cell_sources[tetrahedron.cell as usize] as usize];
            assert!(tetrahedron.volume > 0.0);
            assert!(
                (volume - tetrahedron.volume).abs() < 1e-12 * first.max(places[0].length_squared()),
                "tetrahedron {number}: {volume} and {}",
                tetrahedron.volume
            );
            filled[tetrahedron.cell as usize] += tetrahedron.volume;
            let nodes = self.solid.cells()[tetrahedron.cell as usize].nodes;
            for corner in tetrahedron.corners {
                let vertex = &self.solid.vertices()[corner as usize];
                assert!(
                    vertex.nodes.iter().all(|node| nodes.contains(node)),
                    "vertex {corner} lies in its cell"
                );
                assert!(vertex.weights.iter().all(|&weight| weight >= 0.0));
                assert!((vertex.weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            }
        }
        for triangle in self.solid.triangles() {
            let nodes = self.solid.cells()[triangle.cell as usize].nodes;
            for corner in triangle.corners {
                let vertex = &self.solid.vertices()[corner as usize];
                assert!(vertex.nodes.iter().all(|node| nodes.contains(node)));
            }
        }
        let mut volumes = vec![0.0; self.first_volumes.len()];
        for (number, cell) in self.solid.cells().iter().enumerate() {
            let source = self.cell_sources[number] as usize;
            assert!(
                (cell.volume - filled[number]).abs() < 1e-12 * self.first_volumes[source],
                "cell {number}: {} and {}",
                cell.volume,
                filled[number]
            );
            volumes[source] += cell.volume;
        }
        for (volume, first) in volumes.iter().zip(&self.first_volumes) {
            assert!((volume / first - 1.0).abs() < 1e-12);
        }
        let mut masses = vec![0.0; self.first_masses.len()];
        for (mass, &source) in self.masses.iter().zip(&self.sources) {
            if source != u32::MAX {
                assert!(*mass > 0.0);
                masses[source as usize] += mass;
            }
        }
        for (mass, first) in masses.iter().zip(&self.first_masses) {
            assert!((mass / first - 1.0).abs() < 1e-12);
        }
    }

    /// Springs lie along the cells' edges, and keep their stiffness in all.
    pub fn check_springs(&self) {
        let mut edges = BTreeSet::new();
        for cell in self.solid.cells() {
            for (a, b) in EDGES {
                edges.insert(ordered([cell.nodes[a], cell.nodes[b]]));
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

    fn simulated_pieces(&self) -> usize {
        let mut union = Union::new(self.solid.node_count() as usize);
        for nodes in self.springs.keys() {
            union.unite(nodes[0], nodes[1]);
        }
        for (&point, (nodes, _)) in &self.bound {
            union.unite(point, nodes[0]);
        }
        union.count()
    }

    /// Which piece each tetrahedron is in, found by shared faces alone.
    pub fn piece_of_each(&self) -> Vec<u32> {
        let tetrahedra = self.solid.tetrahedra();
        let mut union = Union::new(tetrahedra.len());
        let mut faces = BTreeMap::new();
        for (number, tetrahedron) in tetrahedra.iter().enumerate() {
            for k in 0..4 {
                let mut face: Vec<u32> = (0..4).filter(|&j| j != k).map(|j| tetrahedron.corners[j]).collect();
                face.sort_unstable();
                if let Some(other) = faces.insert(face, number as u32) {
                    union.unite(number as u32, other);
                }
            }
        }
        (0..tetrahedra.len() as u32).map(|at| union.root(at)).collect()
    }

    /// The volumes of the pieces, in the rest shape, in ascending order.
    pub fn piece_volumes(&self) -> Vec<f64> {
        let mut volumes = BTreeMap::new();
        for (tetrahedron, piece) in self.solid.tetrahedra().iter().zip(self.piece_of_each()) {
            *volumes.entry(piece).or_insert(0.0) += tetrahedron.volume;
        }
        let mut volumes: Vec<f64> = volumes.into_values().collect();
        volumes.sort_by(f64::total_cmp);
        volumes
    }
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

/// The block at rest.
pub fn flat(place: Vec3) -> Vec3 {
    place
}

/// The block sheared, stretched and bent.
pub fn bent(place: Vec3) -> Vec3 {
    vec3(
        1.3 * place.x + 0.2 * place.y,
        0.8 * place.y + 0.2 * (0.5 * place.x).sin(),
        1.1 * place.z + 0.3 * (0.6 * place.y).cos(),
    )
}

/// The block 2000 edges off, where rounding of places is 1e-4 of an edge.
pub fn far(place: Vec3) -> Vec3 {
    bent(place) + vec3(2000.0, -1700.0, 900.0)
}

/// The largest snapping distance of all cells.
pub fn snap(body: &Body) -> f64 {
    body.solid.cells().iter().map(|cell| cell.snap).fold(0.0, f64::max)
}
