//! The way of a tear: through a vertex and across the cells beside it, or from the end of a cut across the cell ahead.

use glam::{DMat3, DVec3, Vec3};

use super::cut::Sweep;
use super::divided::{Divided, NONE};
use super::surface::{CutSurface, SurfaceTriangle};
use crate::base::{Result, memory};

/// How far beside a side of a triangle a way may go, as a part of how far it goes along it, to be taken for one along the side.
const BESIDE: f64 = 0.05;

/// How far the way goes on at either end to pass through springs that meet it just there, as a part of it.
const BEYOND: f64 = 0.01;

/// A way that meets more triangles in one cell ends there.
const MOST_TRIANGLES: usize = 64;

/// What pulls a vertex apart.
#[derive(Clone, Copy, Debug)]
pub(crate) struct VertexLoad {
    /// N, above 0.
    pub tension: f64,
    /// Across the pull in the surface, 1 long: where a tear goes, or the opposite.
    pub along: DVec3,
    /// Of the surface, 1 long.
    pub normal: DVec3,
}

/// Where a surface is to tear.
#[derive(Clone, Debug)]
pub(crate) struct Tear {
    /// What it is cut with: more than the way, which begins and ends where `triangles` do.
    pub sweep: Sweep,
    /// The same, hardly longer than the way.
    pub way: Sweep,
    /// Those that are met.
    pub triangles: Vec<u32>,
}

/// A way in the surface from a vertex on, as nodes are now.
struct Way<'a> {
    surface: &'a CutSurface,
    positions: &'a [Vec3],
    from: DVec3,
    along: DVec3,
    /// In the surface, to the left.
    left: DVec3,
}

impl CutSurface {
    /// The end of a cut in a cell at one of two nodes that is next to the middle between them in the rest shape.
    pub(crate) fn tip_near(&self, nodes: [u32; 2]) -> Result<Option<u32>> {
        let mut nearest: Option<(f64, u32)> = None;
        let mut ring = memory::reserved(8)?;
        for vertex in self.vertices_about(nodes)? {
            if self.behind(vertex, &mut ring)?.is_none() {
                continue;
            }
            let off = self.off_middle(vertex, nodes);
            if nearest.is_none_or(|(least, _)| off < least) {
                nearest = Some((off, vertex));
            }
        }
        Ok(nearest.map(|(_, vertex)| vertex))
    }

    /// The vertex at the third node of a cell of two, of those that will do; that next to the middle between them in the rest shape.
    pub(crate) fn vertex_between(&self, nodes: [u32; 2], will_do: impl Fn(u32) -> bool) -> Option<u32> {
        let others = self.nodes_beside(nodes).filter(|&node| will_do(node));
        let mut nearest: Option<(f64, u32)> = None;
        for vertex in others.filter_map(|node| self.vertex_of(node)) {
            let off = self.off_middle(vertex, nodes);
            if nearest.is_none_or(|least| (off, vertex) < least) {
                nearest = Some((off, vertex));
            }
        }
        nearest.map(|(_, vertex)| vertex)
    }

    /// The nodes of the cells about a vertex, in order.
    pub(crate) fn nodes_about(&self, vertex: u32) -> Result<Vec<u32>> {
        let mut ring = memory::reserved(8)?;
        self.ring(vertex, &mut ring)?;
        let nodes = ring.iter().flat_map(|&(triangle, _)| self.nodes_under(triangle));
        let mut nodes = memory::collected_within(3 * ring.len(), nodes)?;
        memory::sort_once(&mut nodes);
        Ok(nodes)
    }

    /// The nodes of the cell that a triangle lies in.
    pub(crate) fn nodes_under(&self, triangle: u32) -> [u32; 3] {
        self.cells[self.triangles[triangle].cell].nodes
    }

    /// A triangle of each cell that shares a node with those of some triangles.
    pub(crate) fn beside(&self, triangles: &[u32]) -> Result<Vec<u32>> {
        let nodes = triangles.iter().flat_map(|&triangle| self.nodes_under(triangle));
        let cells = nodes.flat_map(|node| self.cells_at(node));
        let mut beside = memory::gathered(cells.map(|cell| self.cells[cell].first))?;
        memory::sort_once(&mut beside);
        Ok(beside)
    }

    /// What a tensor of forces, N, does to a vertex in the surface as it is now: its larger principal value there; `None`: nothing pulls it apart.
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
        // Of both rows of the matrix less the value the one with the longer solution.
        let pull = if half > 0.0 {
            x * (tension - c) + y * b
        } else {
            x * b + y * (tension - a)
        };
        let along = normal.cross(pull.try_normalize().unwrap_or(x));
        Ok((tension > 0.0).then_some(VertexLoad { tension, along, normal }))
    }

    /// The tear through a vertex that a load pulls apart: of the end of a cut ahead, from elsewhere both ways; `None`: there is nothing.
    pub(crate) fn tear(&self, vertex: u32, load: &VertexLoad, positions: &[Vec3]) -> Result<Option<Tear>> {
        let from = self.place(vertex, positions).as_dvec3();
        let mut triangles = memory::reserved(16)?;
        let behind = self.behind(vertex, &mut Vec::new())?;
        let mut run = |along: DVec3| {
            let way = Way {
                surface: self,
                positions,
                from,
                along,
                left: load.normal.cross(along),
            };
            way.run(vertex, &mut triangles)
        };
        let (start, end) = match behind {
            Some(ends) => {
                let [a, b] = ends.map(|end| self.place(end, positions).as_dvec3());
                let ahead = from - 0.5 * (a + b);
                (
                    None,
                    run(if load.along.dot(ahead) < 0.0 {
                        -load.along
                    } else {
                        load.along
                    })?,
                )
            }
            None => (run(-load.along)?, run(load.along)?),
        };
        if start.is_none() && end.is_none() {
            return Ok(None);
        }
        let (start, end) = (start.unwrap_or(from), end.unwrap_or(from));
        let way = end - start;
        let reach = |triangle: &u32| {
            let corners = self.triangles[*triangle].corners;
            corners.map(|corner| self.place(corner, positions).as_dvec3().distance(from))
        };
        let high = 2.0 * triangles.iter().flat_map(reach).fold(0.0, f64::max) * load.normal;
        let edge = |at: DVec3| [at - high, at + high].map(|end| end.as_vec3());
        Ok(Some(Tear {
            sweep: Sweep {
                // One triangle, so that no corner of it lies on the way.
                start: [(start - way).as_vec3(); 2],
                end: edge(end + 0.5 * way),
            },
            way: Sweep {
                start: edge(start - BEYOND * way),
                end: edge(end + BEYOND * way),
            },
            triangles,
        }))
    }

    /// The vertices before the end of a cut, on either side; `None`: no cut ends at this vertex.
    fn behind(&self, vertex: u32, ring: &mut Vec<(u32, usize)>) -> Result<Option<[u32; 2]>> {
        self.ring(vertex, ring)?;
        let (Some(&(first, corner)), Some(&(last, other))) = (ring.first(), ring.last()) else {
            return Ok(None);
        };
        let open = |triangle: u32, side: usize| {
            let SurfaceTriangle { neighbours, rim, .. } = self.triangles[triangle];
            neighbours[side] == NONE && rim[side]
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

    /// The vertices drawn in cells at two nodes, in order.
    fn vertices_about(&self, nodes: [u32; 2]) -> Result<Vec<u32>> {
        let mut seen = memory::gathered(nodes.into_iter().flat_map(|node| self.corners_about(node)))?;
        memory::sort_once(&mut seen);
        Ok(seen)
    }

    /// The square of how far a vertex lies from the middle of two nodes in the rest shape.
    fn off_middle(&self, vertex: u32, nodes: [u32; 2]) -> f64 {
        let [a, b] = nodes.map(|node| self.rest(node).as_dvec3());
        self.rest_place(vertex).distance_squared(0.5 * (a + b))
    }
}

impl Way<'_> {
    /// How far a vertex lies along the way and to its left.
    fn place(&self, vertex: u32) -> (f64, f64) {
        let offset = self.surface.place(vertex, self.positions).as_dvec3() - self.from;
        (offset.dot(self.along), offset.dot(self.left))
    }

    /// Where it leaves the first cell that it comes into, with the triangles that it meets there added; `None`: it meets none.
    fn run(&self, vertex: u32, met: &mut Vec<u32>) -> Result<Option<DVec3>> {
        let surface = self.surface;
        let mut ring = memory::reserved(8)?;
        surface.ring(vertex, &mut ring)?;
        let crossed = |&(triangle, corner): &(u32, usize)| {
            let corners = surface.triangles[triangle].corners;
            let [(u, v), (s, t)] = [1, 2].map(|k| self.place(corners[(corner + k) % 3]));
            v <= 0.0 && t > 0.0 && u * t - s * v > 0.0
        };
        let Some(at) = ring.iter().position(crossed) else {
            return Ok(None);
        };
        let (mut triangle, corner) = ring[at];
        let corners = surface.triangles[triangle].corners;
        let (mut right, mut left) = (corners[(corner + 1) % 3], corners[(corner + 2) % 3]);
        let mut side = (corner + 1) % 3;
        memory::push(met, triangle)?;
        // What is nearly along a side may be just across it.
        for (end, side) in [(right, corner), (left, (corner + 2) % 3)] {
            let (along, beside) = self.place(end);
            let across = surface.triangles[triangle].neighbours[side];
            if across != NONE && beside.abs() < BESIDE * along {
                memory::push(met, across)?;
            }
        }
        let cell = surface.triangles[triangle].cell;
        for _ in 0..MOST_TRIANGLES {
            let across = surface.triangles[triangle].neighbours[side];
            if across == NONE || surface.triangles[across].cell != cell {
                break;
            }
            memory::push(met, across)?;
            let corner = surface.corner(across, left);
            let opposite = surface.triangles[across].corners[(corner + 2) % 3];
            (side, right, left) = if self.place(opposite).1 > 0.0 {
                ((corner + 1) % 3, right, opposite)
            } else {
                ((corner + 2) % 3, opposite, left)
            };
            triangle = across;
        }
        let ((_, v), (_, t)) = (self.place(right), self.place(left));
        let [a, b] = [right, left].map(|vertex| surface.place(vertex, self.positions).as_dvec3());
        Ok(Some(a.lerp(b, -v / (t - v))))
    }
}
