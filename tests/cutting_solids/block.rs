//! Blocks, a body that follows change lists only, and the invariants after each cut.
#![allow(dead_code)]

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Deref;

use glam::{DVec3, Vec3, vec3};
use sinew::Error;
use sinew::cutting::{Changes, CutSolid, Limits, Sweep};

use crate::support::change_lists::{Follower, Union};
use crate::support::random::Random;

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
                for axes in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
                    let mut p = [x, y, z];
                    let mut cell = [at(p); 4];
                    for (k, &axis) in axes.iter().enumerate() {
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

/// A block with five tetrahedra per cube, alternating between cubes. Inner nodes are moved at random, also within the
/// outer faces.
pub fn shaken(size: [usize; 3], seed: u64) -> Mesh {
    let mut random = Random(seed);
    let [nx, ny, nz] = size;
    let (mut rest, _) = block(size);
    for position in &mut rest {
        for (k, n) in size.into_iter().enumerate() {
            if position[k] > 0.0 && position[k] < n as f32 {
                position[k] += random.between(-0.2, 0.2);
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

/// Returns a cell with its corners in the orientation that bodies require.
pub fn upright(rest: &[Vec3], [a, b, c, d]: [u32; 4]) -> [u32; 4] {
    if volume([a, b, c, d].map(|node| rest[node as usize].as_dvec3())) > 0.0 {
        [a, b, c, d]
    } else {
        [a, b, d, c]
    }
}

const EDGES: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

pub struct Body {
    pub solid: CutSolid,
    pub follower: Follower,
}

impl Deref for Body {
    type Target = Follower;

    fn deref(&self) -> &Follower {
        &self.follower
    }
}

pub fn volume([a, b, c, d]: [DVec3; 4]) -> f64 {
    (b - a).cross(c - a).dot(d - a) / 6.0
}

impl Body {
    pub fn new((rest, cells): Mesh, deformation: fn(Vec3) -> Vec3) -> Self {
        let solid = CutSolid::new(&rest, &cells, &[]).unwrap();
        let cells: Vec<_> = solid.cells().iter().map(|cell| (cell.nodes, cell.volume)).collect();
        let triangles = solid.triangles().iter().map(|triangle| triangle.corners).collect();
        let follower = Follower::new(rest, &cells, &EDGES, triangles, deformation);
        Self { solid, follower }
    }

    /// Moves the blade's edge straight from one position to another, both in the rest shape.
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
        let changes = self.solid.cut(&sweep, &self.follower.positions, &near, limits)?;
        let parted = self.solid.parted(&changes.faces, usize::MAX)?;
        assert_eq!(
            parted,
            Some(self.solid.piece_count()? - before),
            "pieces that the cut has parted"
        );
        self.apply(&changes);
        Ok(changes)
    }

    /// Moves the blade's edge along a line of positions, stopping at each.
    pub fn cut_along(&mut self, edges: &[[Vec3; 2]]) {
        for pair in edges.windows(2) {
            self.cut(pair[0], pair[1]);
        }
    }

    pub fn apply(&mut self, changes: &Changes) {
        let (solid, count) = (&self.solid, self.solid.triangles().len());
        self.follower.apply(changes, solid.node_count(), count, |triangle| {
            solid.corner_points(triangle)
        });
    }

    /// Checks all invariants; returns the number of pieces.
    pub fn check(&self) -> usize {
        self.check_render_mesh();
        self.check_material();
        self.check_masses();
        self.check_springs(self.solid.cells().iter().map(|cell| cell.nodes), &EDGES);
        let (pieces, simulated) = (self.piece_volumes().len(), self.simulated_pieces());
        assert_eq!(
            pieces, simulated,
            "pieces of material, and connected components of nodes"
        );
        assert_eq!(pieces, self.solid.piece_count().unwrap() as usize);
        pieces
    }

    /// Checks that the render mesh is a closed manifold around the material, and equals the first one updated by the
    /// change lists.
    pub fn check_render_mesh(&self) {
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
                "triangle {number} differs from the change lists"
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
            assert_eq!(count, about.len(), "the triangles around vertex {vertex} are one fan");
        }
        let material: f64 = self.first_sizes.iter().sum();
        assert!(
            (enclosed / material - 1.0).abs() < 1e-10,
            "{enclosed} is drawn about {material} of material"
        );
        let (mut known, mut bound) = (BTreeSet::new(), 0);
        for (number, vertex) in self.solid.vertices().iter().enumerate() {
            let error = self.carried[vertex.point as usize].distance(self.solid.rest_place(number as u32));
            assert!(error < 1e-9, "vertex {number} differs from its sources by {error}");
            assert!(known.insert(vertex.point), "point {} is two vertices", vertex.point);
            if vertex.point == vertex.nodes[0] {
                assert_eq!(vertex.weights[0], 1.0);
            } else {
                bound += 1;
                let reported = &self.bound[&vertex.point];
                assert_eq!(reported, &(vertex.nodes, vertex.weights));
            }
        }
        assert_eq!(bound, self.bound.len());
    }

    /// Checks that no material is lost: each cell is filled exactly, and so is each cell it was copied from.
    pub fn check_material(&self) {
        let mut filled = vec![0.0; self.solid.cells().len()];
        for (number, tetrahedron) in self.solid.tetrahedra().iter().enumerate() {
            let positions = tetrahedron.corners.map(|corner| self.solid.rest_place(corner));
            let volume = volume(positions);
            let first = self.first_sizes[self.cell_sources[tetrahedron.cell as usize] as usize];
            assert!(tetrahedron.volume > 0.0);
            assert!(
                (volume - tetrahedron.volume).abs() < 1e-12 * first.max(positions[0].length_squared()),
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
        let mut volumes = vec![0.0; self.first_sizes.len()];
        for (number, cell) in self.solid.cells().iter().enumerate() {
            let source = self.cell_sources[number] as usize;
            assert!(
                (cell.volume - filled[number]).abs() < 1e-12 * self.first_sizes[source],
                "cell {number}: {} and {}",
                cell.volume,
                filled[number]
            );
            volumes[source] += cell.volume;
        }
        for (volume, first) in volumes.iter().zip(&self.first_sizes) {
            assert!((volume / first - 1.0).abs() < 1e-12);
        }
    }

    /// Returns the piece of each tetrahedron, found by shared faces only.
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

    /// Returns the volumes of the pieces, in the rest shape, in ascending order.
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

/// The block at rest.
pub fn flat(position: Vec3) -> Vec3 {
    position
}

/// The block sheared, stretched and bent.
pub fn bent(position: Vec3) -> Vec3 {
    vec3(
        1.3 * position.x + 0.2 * position.y,
        0.8 * position.y + 0.2 * (0.5 * position.x).sin(),
        1.1 * position.z + 0.3 * (0.6 * position.y).cos(),
    )
}

/// The block 2000 edges away, where rounding of positions is 1e-4 of an edge.
pub fn far(position: Vec3) -> Vec3 {
    bent(position) + vec3(2000.0, -1700.0, 900.0)
}

/// Returns the largest snapping distance of all cells.
pub fn snap(body: &Body) -> f64 {
    body.solid.cells().iter().map(|cell| cell.snap).fold(0.0, f64::max)
}
