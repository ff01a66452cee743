//! Rebinds a fine surface after cuts: each vertex stays on its side, and no triangle spans a cut.

use std::collections::HashMap;

use glam::{DVec3, Vec3};

use super::bind::{Binding, PlacedTetrahedron};
use crate::base::{Error, Result, memory};
use crate::cutting::{CellComplex, CutMaterial, weighted_mean};
use crate::geometry::nearest::{nearest_on_triangle, weighted};

/// The data needed to follow cuts, for cuttable bodies.
#[derive(Debug)]
pub(super) enum Follower {
    Surface(BoundCells<3>),
    Solid(BoundCells<4>),
}

/// The cells that vertices were bound to.
#[derive(Debug)]
pub(super) struct BoundCells<const N: usize> {
    /// Their nodes. Copies of a node are represented by one of them.
    cells: Vec<[u32; N]>,
    /// For each vertex its cell; copies of a cell are represented by the first.
    of_vertices: Vec<u32>,
    /// All triangles.
    triangles: Vec<[u32; 3]>,
}

impl Follower {
    /// The follower of vertices that are bound to cells of the material; `None` if the material has no cells.
    pub fn new(
        material: &CutMaterial,
        cells_of_vertices: Vec<u32>,
        triangles: &[[u32; 3]],
    ) -> Result<Option<Box<Self>>> {
        let triangles = memory::copied(triangles)?;
        Ok(match material {
            CutMaterial::Springs(_) => None,
            CutMaterial::Surface(surface) => {
                let cells = surface.cells().iter().map(|cell| cell.nodes);
                let cells_of_vertices =
                    BoundCells::new(cells, |node| surface.rest(node), cells_of_vertices, triangles)?;
                Some(memory::boxed(Self::Surface(cells_of_vertices))?)
            }
            CutMaterial::Solid(solid) => {
                let cells = solid.cells().iter().map(|cell| cell.nodes);
                let cells_of_vertices = BoundCells::new(cells, |node| solid.rest(node), cells_of_vertices, triangles)?;
                Some(memory::boxed(Self::Solid(cells_of_vertices))?)
            }
        })
    }

    /// Binds each vertex to the copy of its cell that has the material at the vertex, and keeps the triangles whose
    /// corners are connected. `pieces` is the connected component of each node. Returns false, and changes nothing, if
    /// the vertices are not bound to cells of the material. An error changes nothing either.
    pub fn follow(
        &self,
        (material, pieces): (&CutMaterial, &[u32]),
        binding: &mut Binding,
        triangles: &mut Vec<[u32; 3]>,
    ) -> Result<bool> {
        match (self, material, binding) {
            (Self::Surface(cells_of_vertices), CutMaterial::Surface(surface), Binding::Triangles(bound)) => {
                let weights = |vertex: usize| {
                    let [b, c] = bound[vertex].weights.map(f64::from);
                    [1.0 - b - c, b, c]
                };
                let nodes =
                    cells_of_vertices.follow((surface, pieces), |vertex| bound[vertex].nodes, weights, triangles)?;
                for (vertex, nodes) in bound.iter_mut().zip(nodes) {
                    vertex.nodes = nodes;
                }
            }
            (Self::Solid(cells_of_vertices), CutMaterial::Solid(solid), Binding::Tetrahedra(bound)) => {
                let weights = |vertex: usize| {
                    let [b, c, d] = bound[vertex].weights.map(f64::from);
                    [1.0 - b - c - d, b, c, d]
                };
                let nodes =
                    cells_of_vertices.follow((solid, pieces), |vertex| bound[vertex].nodes, weights, triangles)?;
                for (vertex, nodes) in bound.iter_mut().zip(nodes) {
                    vertex.nodes = nodes;
                }
            }
            _ => return Ok(false),
        }
        Ok(true)
    }
}

impl<const N: usize> BoundCells<N> {
    fn new(
        cells: impl ExactSizeIterator<Item = [u32; N]>,
        rest: impl Fn(u32) -> Vec3,
        mut cells_of_vertices: Vec<u32>,
        triangles: Vec<[u32; 3]>,
    ) -> Result<Self> {
        let mut all: Vec<[u32; N]> = memory::reserved(cells.len())?;
        all.extend(cells);
        let mut roots = HashMap::new();
        roots.try_reserve(all.len())?;
        for node in all.iter_mut().flatten() {
            *node = *roots.entry(key([*node], &rest)).or_insert(*node);
        }
        let firsts = firsts(&all, &rest)?;
        for cell in &mut cells_of_vertices {
            *cell = firsts[&key(all[*cell as usize], &rest)];
        }
        Ok(Self {
            cells: all,
            of_vertices: cells_of_vertices,
            triangles,
        })
    }

    /// Refuses a body that lacks nodes of the cells.
    fn check(&self, node_count: u32) -> Result<()> {
        self.cells
            .iter()
            .try_for_each(|&nodes| check_nodes(nodes, node_count).map(drop))
    }

    /// The nodes of the new cell of each vertex, from its current nodes and weights. Keeps the triangles whose corners
    /// are connected.
    fn follow(
        &self,
        (body, pieces_of_nodes): (&impl CellComplex<N>, &[u32]),
        now: impl Fn(usize) -> [u32; N],
        weights: impl Fn(usize) -> [f64; N],
        triangles: &mut Vec<[u32; 3]>,
    ) -> Result<Vec<[u32; N]>>
    where
        Piece<N>: Fit,
    {
        let node_count = body.nodes().count();
        self.check(node_count)?;
        let pieces = pieces(body, self)?;
        let mut chosen = memory::reserved(self.of_vertices.len())?;
        for (vertex, &cell) in self.of_vertices.iter().enumerate() {
            let first = pieces.partition_point(|piece| piece.cell < cell);
            let of_home = pieces[first..].iter().take_while(|piece| piece.cell == cell);
            let mut cells = of_home.clone().map(|piece| piece.nodes);
            // All material of the cell was removed: the vertex keeps its nodes.
            let first_nodes = cells.next().map_or_else(|| check_nodes(now(vertex), node_count), Ok)?;
            if cells.all(|nodes| nodes == first_nodes) {
                chosen.push(first_nodes);
                continue;
            }
            let corners = self.cells[cell as usize].map(|node| body.nodes()[node].rest.as_dvec3());
            let weights = weights(vertex);
            let point = (0..N).map(|corner| corners[corner] * weights[corner]).sum();
            let fits = |a: &&Piece<N>, b: &&Piece<N>| {
                let (a, b) = (a.fit(point), b.fit(point));
                a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
            };
            chosen.push(of_home.min_by(fits).map_or(first_nodes, |piece| piece.nodes));
        }
        *triangles = self.connected_triangles(&chosen, pieces_of_nodes)?;
        Ok(chosen)
    }

    /// The triangles whose corners are connected when the vertices are bound to cells of these nodes.
    fn connected_triangles(&self, nodes: &[[u32; N]], pieces: &[u32]) -> Result<Vec<[u32; 3]>> {
        // Connected vertices share as many nodes as their original cells did; copies on different sides of a cut share
        // fewer. They also belong to one connected component.
        let common = |a: [u32; N], b: [u32; N]| a.iter().filter(|node| b.contains(node)).count();
        let are_connected = |u: u32, v: u32| {
            let [u, v] = [u, v].map(|vertex| vertex as usize);
            let [first, last] = [u, v].map(|vertex| self.cells[self.of_vertices[vertex] as usize]);
            let [piece, other] = [u, v].map(|vertex| pieces[nodes[vertex][0] as usize]);
            piece == other && common(nodes[u], nodes[v]) >= common(first, last)
        };
        let mut connected_triangles = memory::reserved(self.triangles.len())?;
        let is_connected = |&&[a, b, c]: &&[u32; 3]| are_connected(a, b) && are_connected(b, c) && are_connected(c, a);
        connected_triangles.extend(self.triangles.iter().filter(is_connected));
        Ok(connected_triangles)
    }
}

/// Checks that a body has these nodes. A body of another world, or of an earlier snapshot, can have fewer.
fn check_nodes<const N: usize>(nodes: [u32; N], node_count: u32) -> Result<[u32; N]> {
    match nodes.iter().find(|&&node| node >= node_count) {
        None => Ok(nodes),
        Some(node) => Err(Error::invalid(format!(
            "the embedding goes with node {node}: the body in this world has {node_count} nodes"
        ))),
    }
}

/// A tetrahedron or triangle of the material, in the rest shape.
struct Piece<const N: usize> {
    /// The first of the copies of its cell.
    cell: u32,
    /// The nodes of its cell.
    nodes: [u32; N],
    corners: [DVec3; N],
}

/// How badly a point fits a piece: its squared distance, m², then a value that decreases with depth.
trait Fit {
    fn fit(&self, point: DVec3) -> (f64, f64);
}

impl Fit for Piece<3> {
    fn fit(&self, point: DVec3) -> (f64, f64) {
        let (weights, _) = nearest_on_triangle(point, self.corners);
        let nearest = weighted(self.corners, weights);
        // On a shared edge either triangle fits.
        (point.distance_squared(nearest), 0.0)
    }
}

impl Fit for Piece<4> {
    fn fit(&self, point: DVec3) -> (f64, f64) {
        let solid = PlacedTetrahedron::of(self.corners);
        // Outside the body all depths are below 0, and can be equal on both sides of a cut.
        let depth = solid.depth(point);
        let distance = if depth < 0.0 {
            solid.distance_squared(point)
        } else {
            0.0
        };
        (distance, -depth)
    }
}

/// The rest positions of a cell's nodes: equal for all copies of the cell.
fn key<const N: usize>(nodes: [u32; N], rest: impl Fn(u32) -> Vec3) -> [[u32; 3]; N] {
    nodes.map(|node| rest(node).to_array().map(f32::to_bits))
}

/// The first of the copies of each cell.
fn firsts<const N: usize>(cells: &[[u32; N]], rest: impl Fn(u32) -> Vec3) -> Result<HashMap<[[u32; 3]; N], u32>> {
    let mut firsts = HashMap::new();
    firsts.try_reserve(cells.len())?;
    for (number, &nodes) in (0..).zip(cells) {
        firsts.entry(key(nodes, &rest)).or_insert(number);
    }
    Ok(firsts)
}

/// All material of a body, sorted by cell.
fn pieces<const N: usize>(body: &impl CellComplex<N>, cells_of_vertices: &BoundCells<N>) -> Result<Vec<Piece<N>>> {
    let rest = |node| body.nodes()[node].rest;
    let firsts = firsts(&cells_of_vertices.cells, rest)?;
    let count = body.simplex_count();
    let mut pieces = memory::reserved(count as usize)?;
    for simplex in (0..count).map(|simplex| body.simplex(simplex)) {
        let nodes = body.cell(simplex.cell).nodes;
        if let Some(&cell) = firsts.get(&key(nodes, rest)) {
            let corners = simplex.corners.map(|vertex| weighted_mean(body.binding(vertex), rest));
            pieces.push(Piece { cell, nodes, corners });
        }
    }
    pieces.sort_unstable_by_key(|piece| (piece.cell, piece.nodes));
    Ok(pieces)
}
