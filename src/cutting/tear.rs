//! The path of a tear: through a vertex and the cells next to it, or from the end of a cut through the cell ahead.

use glam::{DMat3, DVec3, Vec3};

use super::cell_complex::{CellComplex, NONE};
use super::cut::Sweep;
use super::surface::{CutSurface, SurfaceTriangle};
use crate::base::{Result, memory};

/// A path is along a side if its distance from the side is at most this fraction of its length.
const ALONG_SIDE: f64 = 0.05;

/// The extension of a path at either end, as a fraction of its length, so that it passes through springs at its ends.
const EXTENSION: f64 = 0.01;

/// A path ends after this many triangles of one cell.
const MAX_TRIANGLES: usize = 64;

/// The load that separates a vertex.
#[derive(Clone, Copy, Debug)]
pub(crate) struct VertexLoad {
    /// The largest principal value of the load: of forces, N, or without unit of strains. It is above 0.
    pub tension: f64,
    /// Unit vector across the load in the surface: the direction of a tear, or the opposite.
    pub along: DVec3,
    /// Unit normal of the surface.
    pub normal: DVec3,
}

/// The path of a tear through a surface.
#[derive(Clone, Debug)]
pub(crate) struct SurfaceTear {
    /// The sweep that cuts the triangles. It extends beyond the path, which begins and ends at the borders of
    /// `triangles`.
    pub sweep: Sweep,
    /// A sweep only slightly longer than the path.
    pub path_sweep: Sweep,
    /// The triangles that the path passes through.
    pub triangles: Vec<u32>,
}

/// A straight path in the surface from a vertex, at the current positions of the nodes.
struct TearPath<'a> {
    surface: &'a CutSurface,
    positions: &'a [Vec3],
    from: DVec3,
    along: DVec3,
    /// The direction to the left in the surface.
    left: DVec3,
}

impl CutSurface {
    /// The end of a cut, in a cell at both nodes, that is closest to their midpoint in the rest shape.
    pub(crate) fn cut_end_near(&self, nodes: [u32; 2]) -> Result<Option<u32>> {
        let mut nearest: Option<(f64, u32)> = None;
        let mut ring = memory::reserved(8)?;
        for vertex in self.vertices_in_cells_at(nodes)? {
            if self.cut_end_neighbors(vertex, &mut ring)?.is_none() {
                continue;
            }
            let distance_squared = self.midpoint_distance_squared(vertex, nodes);
            if nearest.is_none_or(|(smallest, _)| distance_squared < smallest) {
                nearest = Some((distance_squared, vertex));
            }
        }
        Ok(nearest.map(|(_, vertex)| vertex))
    }

    /// The vertex at the third node of a cell with both nodes, among nodes that satisfy `will_do`. Of several, the one
    /// closest to their midpoint in the rest shape.
    pub(crate) fn vertex_between(&self, nodes: [u32; 2], will_do: impl Fn(u32) -> bool) -> Option<u32> {
        let others = self.opposite_nodes(nodes).filter(|&node| will_do(node));
        let mut nearest: Option<(f64, u32)> = None;
        for vertex in others.filter_map(|node| self.vertex_of(node)) {
            let distance_squared = self.midpoint_distance_squared(vertex, nodes);
            if nearest.is_none_or(|smallest| (distance_squared, vertex) < smallest) {
                nearest = Some((distance_squared, vertex));
            }
        }
        nearest.map(|(_, vertex)| vertex)
    }

    /// The nodes of the cells around a vertex, in order.
    pub(crate) fn nodes_around(&self, vertex: u32) -> Result<Vec<u32>> {
        let mut ring = memory::reserved(8)?;
        self.ring(vertex, &mut ring)?;
        let nodes = ring.iter().flat_map(|&(triangle, _)| self.cell_nodes(triangle));
        let mut nodes = memory::collected_within(3 * ring.len(), nodes)?;
        memory::sort_once(&mut nodes);
        Ok(nodes)
    }

    /// The nodes of the cell that contains a triangle.
    pub(crate) fn cell_nodes(&self, triangle: u32) -> [u32; 3] {
        self.cells[self.triangles[triangle].cell].nodes
    }

    /// One triangle of each cell that shares a node with the cells of the given triangles.
    pub(crate) fn adjacent_triangles(&self, triangles: &[u32]) -> Result<Vec<u32>> {
        let nodes = triangles.iter().flat_map(|&triangle| self.cell_nodes(triangle));
        let cells = nodes.flat_map(|node| self.cells_at(node));
        let mut side_distance = memory::gathered(cells.map(|cell| self.cells[cell].first))?;
        memory::sort_once(&mut side_distance);
        Ok(side_distance)
    }

    /// The load of a force tensor, N, at a vertex: its larger principal value in the current surface. `None` if it does
    /// not separate the vertex.
    pub(crate) fn load_at(&self, vertex: u32, forces: DMat3, positions: &[Vec3]) -> Result<Option<VertexLoad>> {
        let mut ring = memory::reserved(8)?;
        self.ring(vertex, &mut ring)?;
        let place = |vertex: u32| self.place(vertex, positions).as_dvec3();
        let from = place(vertex);
        let cross = |&(triangle, corner): &(u32, usize)| {
            let corners = self.triangles[triangle].corners;
            let [next, last] = [1, 2].map(|k| place(corners[(corner + k) % 3]) - from);
            next.cross(last)
        };
        let Some(normal) = ring.iter().map(cross).sum::<DVec3>().try_normalize() else {
            return Ok(None);
        };
        let (x, y) = normal.any_orthonormal_pair();
        let (a, b, c) = (x.dot(forces * x), x.dot(forces * y), y.dot(forces * y));
        let (middle, half) = (0.5 * (a + c), 0.5 * (a - c));
        let tension = middle + libm::hypot(half, b);
        // Of both rows of the matrix minus the eigenvalue, the one with the longer solution.
        let pull = if half > 0.0 {
            x * (tension - c) + y * b
        } else {
            x * b + y * (tension - a)
        };
        let along = normal.cross(pull.try_normalize().unwrap_or(x));
        Ok((tension > 0.0).then_some(VertexLoad { tension, along, normal }))
    }

    /// The tear through a vertex under a load. It extends ahead from the end of a cut, otherwise in both directions.
    /// `None` if there is nothing to tear.
    pub(crate) fn tear(&self, vertex: u32, load: &VertexLoad, positions: &[Vec3]) -> Result<Option<SurfaceTear>> {
        let from = self.place(vertex, positions).as_dvec3();
        let mut triangles = memory::reserved(16)?;
        let neighbors = self.cut_end_neighbors(vertex, &mut Vec::new())?;
        let mut trace = |along: DVec3| {
            let path = TearPath {
                surface: self,
                positions,
                from,
                along,
                left: load.normal.cross(along),
            };
            path.trace(vertex, &mut triangles)
        };
        let (start, end) = match neighbors {
            Some(ends) => {
                let [a, b] = ends.map(|end| self.place(end, positions).as_dvec3());
                let ahead = from - 0.5 * (a + b);
                (
                    None,
                    trace(if load.along.dot(ahead) < 0.0 {
                        -load.along
                    } else {
                        load.along
                    })?,
                )
            }
            None => (trace(-load.along)?, trace(load.along)?),
        };
        if start.is_none() && end.is_none() {
            return Ok(None);
        }
        let (start, end) = (start.unwrap_or(from), end.unwrap_or(from));
        let displacement = end - start;
        let reach = |triangle: &u32| {
            let corners = self.triangles[*triangle].corners;
            corners.map(|corner| self.place(corner, positions).as_dvec3().distance(from))
        };
        let high = 2.0 * triangles.iter().flat_map(reach).fold(0.0, f64::max) * load.normal;
        let edge = |point: DVec3| [point - high, point + high].map(|end| end.as_vec3());
        Ok(Some(SurfaceTear {
            sweep: Sweep {
                // One triangle, so that none of its corners lies on the path.
                start: [(start - displacement).as_vec3(); 2],
                end: edge(end + 0.5 * displacement),
            },
            path_sweep: Sweep {
                start: edge(start - EXTENSION * displacement),
                end: edge(end + EXTENSION * displacement),
            },
            triangles,
        }))
    }

    /// The vertices before the end of a cut, on either side. `None` if no cut ends at this vertex.
    fn cut_end_neighbors(&self, vertex: u32, ring: &mut Vec<(u32, usize)>) -> Result<Option<[u32; 2]>> {
        self.ring(vertex, ring)?;
        let (Some(&(first, corner)), Some(&(last, other))) = (ring.first(), ring.last()) else {
            return Ok(None);
        };
        let open = |triangle: u32, side: usize| {
            let SurfaceTriangle { neighbors, rim, .. } = self.triangles[triangle];
            neighbors[side] == NONE && rim[side]
        };
        if !(open(first, corner) && open(last, (other + 2) % 3)) {
            return Ok(None);
        }
        let ends = [
            self.triangles[first].corners[(corner + 1) % 3],
            self.triangles[last].corners[(other + 2) % 3],
        ];
        Ok((self.rest_place(ends[0]) == self.rest_place(ends[1])).then_some(ends))
    }

    /// The vertices in cells at two nodes, in order.
    fn vertices_in_cells_at(&self, nodes: [u32; 2]) -> Result<Vec<u32>> {
        let mut vertices = memory::gathered(nodes.into_iter().flat_map(|node| self.corners_around(node)))?;
        memory::sort_once(&mut vertices);
        Ok(vertices)
    }

    /// The squared distance of a vertex from the midpoint of two nodes in the rest shape, m².
    fn midpoint_distance_squared(&self, vertex: u32, nodes: [u32; 2]) -> f64 {
        let [a, b] = nodes.map(|node| self.rest(node).as_dvec3());
        self.rest_place(vertex).distance_squared(0.5 * (a + b))
    }
}

impl TearPath<'_> {
    /// The coordinates of a vertex along the path and to its left.
    fn coordinates(&self, vertex: u32) -> (f64, f64) {
        let offset = self.surface.place(vertex, self.positions).as_dvec3() - self.from;
        (offset.dot(self.along), offset.dot(self.left))
    }

    /// The point where the path leaves the first cell that it enters. Adds the triangles that it passes through. `None`
    /// if there are none.
    fn trace(&self, vertex: u32, triangles: &mut Vec<u32>) -> Result<Option<DVec3>> {
        let surface = self.surface;
        let mut ring = memory::reserved(8)?;
        surface.ring(vertex, &mut ring)?;
        let crossed = |&(triangle, corner): &(u32, usize)| {
            let corners = surface.triangles[triangle].corners;
            let [(u, v), (s, t)] = [1, 2].map(|k| self.coordinates(corners[(corner + k) % 3]));
            v <= 0.0 && t > 0.0 && u * t - s * v > 0.0
        };
        let Some(index) = ring.iter().position(crossed) else {
            return Ok(None);
        };
        let (mut triangle, corner) = ring[index];
        let corners = surface.triangles[triangle].corners;
        let (mut right, mut left) = (corners[(corner + 1) % 3], corners[(corner + 2) % 3]);
        let mut side = (corner + 1) % 3;
        memory::push(triangles, triangle)?;
        // A path that is nearly along a side can be just across it.
        for (end, side) in [(right, corner), (left, (corner + 2) % 3)] {
            let (along, side_distance) = self.coordinates(end);
            let across = surface.triangles[triangle].neighbors[side];
            if across != NONE && side_distance.abs() < ALONG_SIDE * along {
                memory::push(triangles, across)?;
            }
        }
        let cell = surface.triangles[triangle].cell;
        for _ in 0..MAX_TRIANGLES {
            let across = surface.triangles[triangle].neighbors[side];
            if across == NONE || surface.triangles[across].cell != cell {
                break;
            }
            memory::push(triangles, across)?;
            let corner = surface.corner(across, left);
            let opposite = surface.triangles[across].corners[(corner + 2) % 3];
            (side, right, left) = if self.coordinates(opposite).1 > 0.0 {
                ((corner + 1) % 3, right, opposite)
            } else {
                ((corner + 2) % 3, opposite, left)
            };
            triangle = across;
        }
        let ((_, v), (_, t)) = (self.coordinates(right), self.coordinates(left));
        let [a, b] = [right, left].map(|vertex| surface.place(vertex, self.positions).as_dvec3());
        Ok(Some(a.lerp(b, -v / (t - v))))
    }
}
