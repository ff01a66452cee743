//! The common part of surfaces and solids: cells whose material is divided into simplices, and vertices that are bound
//! to nodes.

use glam::{DVec3, Vec3};

use super::tracked::Tracked;
use crate::base::{Result, ensure, memory};
use crate::codec::saved;

/// No simplex, or no corner.
pub(crate) const NONE: u32 = u32::MAX;

/// The snapping distance, relative to the shortest edge of a cell.
pub(crate) const SNAP: f64 = 0.05;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Node {
    /// The rest position. Not used for points that are bound to others.
    pub(crate) rest: Vec3,
    /// The first corner of a cell at this node.
    pub(crate) first: u32,
}

saved! { Node { rest, first } }

impl Node {
    /// A point that is bound to others.
    pub(crate) const BOUND: Self = Self {
        rest: Vec3::ZERO,
        first: NONE,
    };

    /// True for a point that is bound to others.
    pub(crate) fn is_bound(&self) -> bool {
        self.first == NONE
    }
}

/// A cell: its nodes, its material, m² or m³, its first simplex, and for each of its nodes the next corner at the node.
#[derive(Clone, Copy)]
pub(crate) struct Cell<const N: usize> {
    pub nodes: [u32; N],
    pub material: f64,
    pub first: u32,
    pub next: [u32; N],
}

/// A triangle or tetrahedron: its corners, the simplices across its sides, its cell, and the next simplex of the cell.
#[derive(Clone, Copy)]
pub(crate) struct Simplex<const N: usize> {
    pub corners: [u32; N],
    pub neighbors: [u32; N],
    pub cell: u32,
    pub next: u32,
}

/// Cells with N nodes, whose material is divided into simplices with N corners. Corner k of cell c has the index N c +
/// k.
pub(crate) trait CellComplex<const N: usize> {
    /// The corners of each edge of a cell.
    const EDGES: &'static [[usize; 2]];
    /// The corners of the side that each neighbor of a simplex lies across.
    const SIDES: [&'static [usize]; N];

    fn nodes(&self) -> &Tracked<Node>;
    fn nodes_mut(&mut self) -> &mut Tracked<Node>;
    fn cell_count(&self) -> u32;
    fn cell(&self, cell: u32) -> Cell<N>;
    fn set_cell(&mut self, cell: u32, to: Cell<N>) -> Result<()>;
    /// Adds a cell. Properties that `Cell` does not contain are copied from cell `like`.
    fn add_cell(&mut self, like: u32, cell: Cell<N>) -> Result<u32>;
    fn simplex_count(&self) -> u32;
    fn simplex(&self, simplex: u32) -> Simplex<N>;
    /// The amount of material of a simplex, relative to other simplices of its cell.
    fn material_fraction(&self, simplex: u32) -> f64;
    /// Moves a simplex to a cell, in front of the simplex `next`.
    fn move_simplex(&mut self, simplex: u32, cell: u32, next: u32) -> Result<()>;
    /// The nodes that a vertex is bound to, and their weights.
    fn binding(&self, vertex: u32) -> ([u32; N], [f64; N]);
    fn bind(&mut self, vertex: u32, nodes: [u32; N]) -> Result<()>;

    /// The corners of cells at a node.
    fn corners_at(&self, node: u32) -> impl Iterator<Item = u32> {
        let valid = |corner: u32| (corner != NONE).then_some(corner);
        let next = move |&corner: &u32| valid(self.cell(corner / N as u32).next[corner as usize % N]);
        std::iter::successors(valid(self.nodes()[node].first), next)
    }

    /// The cells at a node.
    fn cells_at(&self, node: u32) -> impl Iterator<Item = u32> {
        self.corners_at(node).map(|corner| corner / N as u32)
    }

    /// The simplices of a cell, the latest first.
    fn simplices_in(&self, cell: u32) -> impl Iterator<Item = u32> {
        let valid = |simplex: u32| (simplex != NONE).then_some(simplex);
        let next = move |&simplex: &u32| valid(self.simplex(simplex).next);
        std::iter::successors(valid(self.cell(cell).first), next)
    }

    /// The other nodes of the cells at two nodes, with repetitions.
    fn opposite_nodes(&self, nodes: [u32; 2]) -> impl Iterator<Item = u32> {
        let cells = self.cells_at(nodes[0]).map(|cell| self.cell(cell).nodes);
        let others = cells.filter(move |cell| cell.contains(&nodes[1])).flatten();
        others.filter(move |node| !nodes.contains(node))
    }

    /// The corners of the simplices of the cells at a node, with repetitions.
    fn corners_around(&self, node: u32) -> impl Iterator<Item = u32> {
        let simplices = self.cells_at(node).flat_map(|cell| self.simplices_in(cell));
        simplices.flat_map(|simplex| self.simplex(simplex).corners)
    }

    /// The vertex at a node, the lowest if there are several.
    fn vertex_of(&self, node: u32) -> Option<u32> {
        self.corners_around(node)
            .filter(|&vertex| self.is_at(vertex, node))
            .min()
    }

    /// The nodes and weights for a vertex between others of one cell, given its shares of these.
    fn binding_between(&self, sources: [u32; 3], shares: [f64; 3]) -> ([u32; N], [f64; N]) {
        let (mut nodes, mut weights) = ([NONE; N], [0.0; N]);
        for (source, share) in sources.into_iter().zip(shares) {
            let (source_nodes, source_weights) = self.binding(source);
            for (node, weight) in source_nodes
                .into_iter()
                .zip(source_weights)
                .filter(|(_, weight)| weight * share != 0.0)
            {
                // All nodes are of one cell, so there is a slot for each.
                if let Some(k) = (0..N).find(|&k| nodes[k] == node || nodes[k] == NONE) {
                    nodes[k] = node;
                    weights[k] += weight * share;
                }
            }
        }
        (nodes.map(|node| if node == NONE { nodes[0] } else { node }), weights)
    }

    /// True if a vertex is at a node.
    fn is_at(&self, vertex: u32, node: u32) -> bool {
        let (nodes, weights) = self.binding(vertex);
        weights[0] == 1.0 && nodes[0] == node
    }
}

/// Implements the common methods of surfaces and solids, and [`CellComplex`] with the methods in `$own`.
macro_rules! cell_complex {
    ($body:ident, $corners:literal, $cell:ident { $material:ident }, $simplices:ident, $triangle:ident, { $($methods:tt)* }) => {
        impl $body {
            /// The number of nodes: those of the body, then copies and bound points.
            pub fn node_count(&self) -> u32 {
                self.nodes.count()
            }

            /// The cells. Those that cuts add are appended.
            pub fn cells(&self) -> &[$cell] {
                self.cells.values()
            }

            /// The triangles of the render mesh. Cuts never remove one.
            pub fn triangles(&self) -> &[$triangle] {
                self.triangles.values()
            }

            /// The position of a node in the rest shape.
            pub fn rest(&self, node: u32) -> Vec3 {
                self.nodes[node].rest
            }

            /// The position of a vertex with nodes at `positions`, rounded to `f32`, so that differences of positions
            /// are exact in `f64`.
            pub fn place(&self, vertex: u32, positions: &[Vec3]) -> Vec3 {
                let (nodes, weights) = self.binding(vertex);
                if weights[0] == 1.0 {
                    return positions[nodes[0] as usize];
                }
                weighted_mean((nodes, weights), |node| positions[node as usize]).as_vec3()
            }

            /// The position of a vertex in the rest shape.
            pub fn rest_place(&self, vertex: u32) -> DVec3 {
                weighted_mean(self.binding(vertex), |node| self.nodes[node].rest)
            }

            /// The weights of a vertex with respect to the corners of a cell that it lies in.
            pub fn weights_in(&self, vertex: u32, cell: u32) -> [f64; $corners] {
                let (nodes, weights) = self.binding(vertex);
                let weight = |node| (0..$corners).filter(|&k| nodes[k] == node).map(|k| weights[k]).sum();
                self.cells[cell].nodes.map(weight)
            }

            /// The corners of a triangle, by their indices among nodes.
            pub fn corner_points(&self, triangle: u32) -> [u32; 3] {
                self.triangles[triangle].corners.map(|corner| self.vertices[corner].point)
            }

            /// True if two nodes are corners of one cell.
            pub fn has_edge(&self, [a, b]: [u32; 2]) -> bool {
                self.cells_at(a).any(|cell| self.cells[cell].nodes.contains(&b))
            }
        }

        impl CellComplex<$corners> for $body {
            $($methods)*

            fn nodes(&self) -> &Tracked<Node> {
                &self.nodes
            }

            fn nodes_mut(&mut self) -> &mut Tracked<Node> {
                &mut self.nodes
            }

            fn cell_count(&self) -> u32 {
                self.cells.count()
            }

            fn cell(&self, cell: u32) -> Cell<$corners> {
                let $cell { nodes, $material: material, first, next, .. } = self.cells[cell];
                Cell { nodes, material, first, next }
            }

            fn set_cell(&mut self, cell: u32, to: Cell<$corners>) -> Result<()> {
                let Cell { nodes, material: $material, first, next } = to;
                self.cells.edit(cell, |cell| *cell = $cell { nodes, $material, first, next, ..*cell })
            }

            fn add_cell(&mut self, like: u32, cell: Cell<$corners>) -> Result<u32> {
                let Cell { nodes, material: $material, first, next } = cell;
                self.cells.push($cell { nodes, $material, first, next, ..self.cells[like] })
            }

            fn simplex_count(&self) -> u32 {
                self.$simplices.count()
            }

            fn simplex(&self, simplex: u32) -> Simplex<$corners> {
                let it = &self.$simplices[simplex];
                Simplex { corners: it.corners, neighbors: it.neighbors, cell: it.cell, next: it.next }
            }

            fn binding(&self, vertex: u32) -> ([u32; $corners], [f64; $corners]) {
                (self.vertices[vertex].nodes, self.vertices[vertex].weights)
            }

            fn bind(&mut self, vertex: u32, nodes: [u32; $corners]) -> Result<()> {
                self.vertices.edit(vertex, |vertex| vertex.nodes = nodes)
            }
        }
    };
}

pub(crate) use cell_complex;

/// Creates nodes without cells at these rest positions. All must be finite.
pub(crate) fn nodes_without_cells(rest: &[Vec3]) -> Result<Vec<Node>> {
    for (at, place) in rest.iter().enumerate() {
        ensure!(place.is_finite(), "rest position {at} is {place}");
    }
    memory::collected(rest.iter().map(|&rest| Node { rest, first: NONE }))
}

/// The rest positions of a cell's nodes. Unknown nodes are refused.
pub(crate) fn rest_positions_of<const N: usize>(number: usize, nodes: [u32; N], rest: &[Vec3]) -> Result<[DVec3; N]> {
    let count = rest.len();
    for node in nodes {
        ensure!((node as usize) < count, "cell {number} has node {node} of {count}");
    }
    Ok(nodes.map(|node| rest[node as usize].as_dvec3()))
}

/// Inserts the corners of a cell at the front of the lists of their nodes. Returns the next corner in each list.
pub(crate) fn insert_corners<const N: usize>(nodes: &mut [Node], cell_index: usize, corners: [u32; N]) -> [u32; N] {
    std::array::from_fn(|k| {
        let first = (N * cell_index + k) as u32;
        std::mem::replace(&mut nodes[corners[k] as usize].first, first)
    })
}

/// The weighted mean of nodes, given the positions of nodes.
pub(crate) fn weighted_mean<const N: usize>(
    (nodes, weights): ([u32; N], [f64; N]),
    position: impl Fn(u32) -> Vec3,
) -> DVec3 {
    (0..N)
        .filter(|&k| weights[k] != 0.0)
        .map(|k| weights[k] * position(nodes[k]).as_dvec3())
        .sum()
}
