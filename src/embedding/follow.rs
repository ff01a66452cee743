//! A fine surface after its body has been cut: each vertex on its own side, and no triangle across.

use std::collections::HashMap;

use glam::DVec3;

use super::bind::{InTetrahedron, Solid};
use crate::cutting::CutSolid;
use crate::error::Result;
use crate::memory;

/// What following cuts asks for: kept for bodies that may be cut.
#[derive(Debug)]
pub(super) struct Follower {
    /// The cells as the body was made.
    cells: Vec<[u32; 4]>,
    /// The cell that each vertex was bound to.
    homes: Vec<u32>,
    /// All triangles.
    triangles: Vec<[u32; 3]>,
}

impl Follower {
    /// For vertices in these cells, if they are those of the solid, which has not been cut.
    pub fn new(
        solid: &CutSolid,
        cells: &[[u32; 4]],
        homes: Vec<u32>,
        triangles: &[[u32; 3]],
    ) -> Result<Option<Box<Self>>> {
        let own = solid.cells().iter().map(|cell| cell.nodes);
        if !own.eq(cells.iter().copied()) {
            return Ok(None);
        }
        Ok(Some(Box::new(Self {
            cells: memory::copied(cells)?,
            homes,
            triangles: memory::copied(triangles)?,
        })))
    }

    /// Binds each vertex to the copy of its cell that has the material where it is, and keeps the triangles whose corners hang together.
    /// Nothing is changed where memory is short.
    pub fn follow(&self, solid: &CutSolid, bound: &mut [InTetrahedron], triangles: &mut Vec<[u32; 3]>) -> Result<()> {
        let material = self.material(solid)?;
        let mut nodes: Vec<[u32; 4]> = memory::reserved(bound.len())?;
        for (vertex, &home) in bound.iter().zip(&self.homes) {
            let first = material.partition_point(|piece| piece.home < home);
            let pieces = material[first..].iter().take_while(|piece| piece.home == home);
            nodes.push(match pieces.clone().count() {
                // All of its material was taken away: it stays with what it was bound to.
                0 => vertex.nodes,
                1 => pieces.map(|piece| piece.nodes).next().unwrap_or(vertex.nodes),
                _ => {
                    let place = self.rest_place(solid, vertex, home);
                    // Of a vertex outside of the body all depths are below 0, and may be the same on both sides.
                    let fit = |piece: &&Piece| {
                        let depth = piece.solid.depth(place);
                        let distance = if depth < 0.0 {
                            piece.solid.distance_squared(place)
                        } else {
                            0.0
                        };
                        (distance, -depth)
                    };
                    let fits = |a: &&Piece, b: &&Piece| {
                        let (a, b) = (fit(a), fit(b));
                        a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
                    };
                    pieces.min_by(fits).map_or(vertex.nodes, |piece| piece.nodes)
                }
            });
        }
        let mut whole: Vec<[u32; 3]> = memory::reserved(self.triangles.len())?;
        whole.extend(self.triangles.iter().filter(|[a, b, c]| {
            let hangs = |u: u32, v: u32| self.hang_together([u, v].map(|vertex| vertex as usize), &nodes);
            hangs(*a, *b) && hangs(*b, *c) && hangs(*c, *a)
        }));
        for (vertex, nodes) in bound.iter_mut().zip(nodes) {
            vertex.nodes = nodes;
        }
        *triangles = whole;
        Ok(())
    }

    /// All of the solid's material, by the cells that it was in.
    fn material(&self, solid: &CutSolid) -> Result<Vec<Piece>> {
        // Copies of a cell are where it was at rest.
        let key = |nodes: [u32; 4]| nodes.map(|node| solid.rest(node).to_array().map(f32::to_bits));
        let mut homes: HashMap<_, u32> = HashMap::new();
        homes.try_reserve(self.cells.len())?;
        for (home, &nodes) in (0..).zip(&self.cells) {
            homes.entry(key(nodes)).or_insert(home);
        }
        let mut material = memory::reserved(solid.tetrahedra().len())?;
        for tetrahedron in solid.tetrahedra() {
            let nodes = solid.cells()[tetrahedron.cell as usize].nodes;
            if let Some(&home) = homes.get(&key(nodes)) {
                let corners = tetrahedron.corners.map(|vertex| solid.rest_place(vertex));
                material.push(Piece {
                    home,
                    nodes,
                    solid: Solid::of(corners),
                });
            }
        }
        material.sort_by_key(|piece| piece.home);
        Ok(material)
    }

    fn rest_place(&self, solid: &CutSolid, vertex: &InTetrahedron, home: u32) -> DVec3 {
        let [a, b, c, d] = self.cells[home as usize].map(|node| solid.rest(node).as_dvec3());
        let [to_b, to_c, to_d] = vertex.weights.map(f64::from);
        a + (b - a) * to_b + (c - a) * to_c + (d - a) * to_d
    }

    /// Whether two vertices still have in common what their cells had: copies on different sides of a cut have less.
    fn hang_together(&self, [u, v]: [usize; 2], nodes: &[[u32; 4]]) -> bool {
        let common = |a: [u32; 4], b: [u32; 4]| a.iter().filter(|node| b.contains(node)).count();
        let [first, last] = [u, v].map(|vertex| self.cells[self.homes[vertex] as usize]);
        common(nodes[u], nodes[v]) >= common(first, last)
    }
}

/// A tetrahedron of the material at rest.
struct Piece {
    /// The cell that it was in as the body was made.
    home: u32,
    /// Those of the cell that it is in now.
    nodes: [u32; 4],
    solid: Solid,
}
