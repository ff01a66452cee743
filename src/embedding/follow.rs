//! A fine surface after its body has been cut: each vertex on its own side, and no triangle across.

use std::collections::HashMap;

use glam::{DVec3, Vec3};

use super::bind::{Binding, PlacedTetrahedron};
use crate::base::{Error, Result, memory};
use crate::cutting::{CutMaterial, Divided, weighed};
use crate::geometry::nearest::{nearest_on_triangle, weighted};

/// What following cuts asks for: kept for bodies that may be cut.
#[derive(Debug)]
pub(super) enum Follower {
    Surface(Homes<3>),
    Solid(Homes<4>),
}

/// The cells that vertices were bound to.
#[derive(Debug)]
pub(super) struct Homes<const N: usize> {
    /// Their nodes; for copies of a node one of them.
    cells: Vec<[u32; N]>,
    /// The first of those that lay where the vertex's did: copies of a cell were one.
    of_vertices: Vec<u32>,
    /// All triangles.
    triangles: Vec<[u32; 3]>,
}

impl Follower {
    /// For vertices bound to these of the material's cells; `None`: it has none.
    pub fn new(material: &CutMaterial, homes: Vec<u32>, triangles: &[[u32; 3]]) -> Result<Option<Box<Self>>> {
        let triangles = memory::copied(triangles)?;
        Ok(match material {
            CutMaterial::Springs(_) => None,
            CutMaterial::Surface(surface) => {
                let cells = surface.cells().iter().map(|cell| cell.nodes);
                let homes = Homes::new(cells, |node| surface.rest(node), homes, triangles)?;
                Some(memory::boxed(Self::Surface(homes))?)
            }
            CutMaterial::Solid(solid) => {
                let cells = solid.cells().iter().map(|cell| cell.nodes);
                let homes = Homes::new(cells, |node| solid.rest(node), homes, triangles)?;
                Some(memory::boxed(Self::Solid(homes))?)
            }
        })
    }

    /// Binds each vertex to the copy of its cell that has the material where it is, and keeps the triangles whose corners hang together, by the piece of
    /// the body that each of its nodes is of; whether the binding is one to such cells. Nothing is changed where it is not, the body has fewer
    /// nodes than vertices are bound to, or memory is short.
    pub fn follow(
        &self,
        (material, pieces): (&CutMaterial, &[u32]),
        binding: &mut Binding,
        triangles: &mut Vec<[u32; 3]>,
    ) -> Result<bool> {
        match (self, material, binding) {
            (Self::Surface(homes), CutMaterial::Surface(surface), Binding::Triangles(bound)) => {
                let weights = |vertex: usize| {
                    let [b, c] = bound[vertex].weights.map(f64::from);
                    [1.0 - b - c, b, c]
                };
                let nodes = homes.follow((surface, pieces), |vertex| bound[vertex].nodes, weights, triangles)?;
                for (vertex, nodes) in bound.iter_mut().zip(nodes) {
                    vertex.nodes = nodes;
                }
            }
            (Self::Solid(homes), CutMaterial::Solid(solid), Binding::Tetrahedra(bound)) => {
                let weights = |vertex: usize| {
                    let [b, c, d] = bound[vertex].weights.map(f64::from);
                    [1.0 - b - c - d, b, c, d]
                };
                let nodes = homes.follow((solid, pieces), |vertex| bound[vertex].nodes, weights, triangles)?;
                for (vertex, nodes) in bound.iter_mut().zip(nodes) {
                    vertex.nodes = nodes;
                }
            }
            _ => return Ok(false),
        }
        Ok(true)
    }
}

impl<const N: usize> Homes<N> {
    fn new(
        cells: impl ExactSizeIterator<Item = [u32; N]>,
        rest: impl Fn(u32) -> Vec3,
        mut homes: Vec<u32>,
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
        for home in &mut homes {
            *home = firsts[&key(all[*home as usize], &rest)];
        }
        Ok(Self {
            cells: all,
            of_vertices: homes,
            triangles,
        })
    }

    /// Refuses a body that has not all of the cells' nodes.
    fn check(&self, node_count: u32) -> Result<()> {
        self.cells
            .iter()
            .try_for_each(|&nodes| known(nodes, node_count).map(drop))
    }

    /// The nodes of the cell that each vertex goes with from now on, by those of now and the weights that it has of them; keeps the triangles
    /// whose corners hang together then.
    fn follow(
        &self,
        (body, pieces_of_nodes): (&impl Divided<N>, &[u32]),
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
        for (vertex, &home) in self.of_vertices.iter().enumerate() {
            let first = pieces.partition_point(|piece| piece.home < home);
            let of_home = pieces[first..].iter().take_while(|piece| piece.home == home);
            let mut cells = of_home.clone().map(|piece| piece.nodes);
            // All of its material was taken away: it stays with what it was bound to.
            let some = cells.next().map_or_else(|| known(now(vertex), node_count), Ok)?;
            if cells.all(|nodes| nodes == some) {
                chosen.push(some);
                continue;
            }
            let corners = self.cells[home as usize].map(|node| body.nodes()[node].rest.as_dvec3());
            let weights = weights(vertex);
            let place = (0..N).map(|corner| corners[corner] * weights[corner]).sum();
            let fits = |a: &&Piece<N>, b: &&Piece<N>| {
                let (a, b) = (a.fit(place), b.fit(place));
                a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
            };
            chosen.push(of_home.min_by(fits).map_or(some, |piece| piece.nodes));
        }
        *triangles = self.whole(&chosen, pieces_of_nodes)?;
        Ok(chosen)
    }

    /// The triangles whose corners hang together where their vertices go with cells of these nodes.
    fn whole(&self, nodes: &[[u32; N]], pieces: &[u32]) -> Result<Vec<[u32; 3]>> {
        // Two vertices still have in common what their cells had: copies on different sides of a cut have less. Where that was nothing they are
        // still of one piece.
        let common = |a: [u32; N], b: [u32; N]| a.iter().filter(|node| b.contains(node)).count();
        let hang = |u: u32, v: u32| {
            let [u, v] = [u, v].map(|vertex| vertex as usize);
            let [first, last] = [u, v].map(|vertex| self.cells[self.of_vertices[vertex] as usize]);
            let [piece, other] = [u, v].map(|vertex| pieces[nodes[vertex][0] as usize]);
            piece == other && common(nodes[u], nodes[v]) >= common(first, last)
        };
        let mut whole = memory::reserved(self.triangles.len())?;
        let hangs = |&&[a, b, c]: &&[u32; 3]| hang(a, b) && hang(b, c) && hang(c, a);
        whole.extend(self.triangles.iter().filter(hangs));
        Ok(whole)
    }
}

/// Nodes that a body of so many has: one of another world may have fewer, or the same before it was cut.
fn known<const N: usize>(nodes: [u32; N], node_count: u32) -> Result<[u32; N]> {
    match nodes.iter().find(|&&node| node >= node_count) {
        None => Ok(nodes),
        Some(node) => Err(Error::invalid(format!(
            "the embedding goes with node {node}: the body in this world has {node_count} nodes"
        ))),
    }
}

/// A part of the material at rest: a tetrahedron of it, or a triangle.
struct Piece<const N: usize> {
    /// The first of the cells that lay where its own does.
    home: u32,
    /// Those of its cell.
    nodes: [u32; N],
    corners: [DVec3; N],
}

/// How badly a place lies in a piece: the square of its distance, m², then what is less the deeper it is.
trait Fit {
    fn fit(&self, place: DVec3) -> (f64, f64);
}

impl Fit for Piece<3> {
    fn fit(&self, place: DVec3) -> (f64, f64) {
        let (weights, _) = nearest_on_triangle(place, self.corners);
        let nearest = weighted(self.corners, weights);
        // On a side that two have in common either will do.
        (place.distance_squared(nearest), 0.0)
    }
}

impl Fit for Piece<4> {
    fn fit(&self, place: DVec3) -> (f64, f64) {
        let solid = PlacedTetrahedron::of(self.corners);
        // Outside of the body all depths are below 0, and may be the same on both sides.
        let depth = solid.depth(place);
        let distance = if depth < 0.0 {
            solid.distance_squared(place)
        } else {
            0.0
        };
        (distance, -depth)
    }
}

/// Where the nodes of a cell are at rest: the same for copies of it.
fn key<const N: usize>(nodes: [u32; N], rest: impl Fn(u32) -> Vec3) -> [[u32; 3]; N] {
    nodes.map(|node| rest(node).to_array().map(f32::to_bits))
}

/// The first cell in each place.
fn firsts<const N: usize>(cells: &[[u32; N]], rest: impl Fn(u32) -> Vec3) -> Result<HashMap<[[u32; 3]; N], u32>> {
    let mut firsts = HashMap::new();
    firsts.try_reserve(cells.len())?;
    for (number, &nodes) in (0..).zip(cells) {
        firsts.entry(key(nodes, &rest)).or_insert(number);
    }
    Ok(firsts)
}

/// All of a body's material, by the cells that it was in.
fn pieces<const N: usize>(body: &impl Divided<N>, homes: &Homes<N>) -> Result<Vec<Piece<N>>> {
    let rest = |node| body.nodes()[node].rest;
    let firsts = firsts(&homes.cells, rest)?;
    let count = body.simplex_count();
    let mut pieces = memory::reserved(count as usize)?;
    for simplex in (0..count).map(|simplex| body.simplex(simplex)) {
        let nodes = body.cell(simplex.cell).nodes;
        if let Some(&home) = firsts.get(&key(nodes, rest)) {
            let corners = simplex.corners.map(|vertex| weighed(body.bonds(vertex), rest));
            pieces.push(Piece { home, nodes, corners });
        }
    }
    pieces.sort_unstable_by_key(|piece| (piece.home, piece.nodes));
    Ok(pieces)
}
