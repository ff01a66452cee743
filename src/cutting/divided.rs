//! What surfaces and solids have in common: cells of material that is divided into simplices, whose vertices nodes move.

use glam::{DVec3, Vec3};

use super::tracked::Tracked;
use crate::base::{Result, ensure, memory};
use crate::codec::saved;

/// No simplex, or no corner.
pub(crate) const NONE: u32 = u32::MAX;

/// What is snapped lies within this part of a cell's shortest edge.
pub(crate) const SNAP: f64 = 0.05;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Node {
    /// Of a point that is bound to others nothing is said here.
    pub(crate) rest: Vec3,
    /// The first of the cells' corners at it.
    pub(crate) first: u32,
}

saved! { Node { rest, first } }

impl Node {
    /// A point that is bound to others.
    pub(crate) const BOUND: Self = Self {
        rest: Vec3::ZERO,
        first: NONE,
    };

    /// Whether it is such a point.
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

/// A triangle or tetrahedron: its corners, what lies across its sides, its cell, and the next simplex of that.
#[derive(Clone, Copy)]
pub(crate) struct Simplex<const N: usize> {
    pub corners: [u32; N],
    pub neighbours: [u32; N],
    pub cell: u32,
    pub next: u32,
}

/// Cells with N nodes, of which corner k of cell c has the number N c + k. Their material is divided into simplices with N corners.
pub(crate) trait Divided<const N: usize> {
    /// The corners of each edge of a cell.
    const EDGES: &'static [[usize; 2]];
    /// The corners of the side that each of a simplex's neighbours lies across.
    const SIDES: [&'static [usize]; N];

    fn nodes(&self) -> &Tracked<Node>;
    fn nodes_mut(&mut self) -> &mut Tracked<Node>;
    fn cell_count(&self) -> u32;
    fn cell(&self, cell: u32) -> Cell<N>;
    fn set_cell(&mut self, cell: u32, to: Cell<N>) -> Result<()>;
    /// Adds a cell with what is not named here from another.
    fn add_cell(&mut self, like: u32, cell: Cell<N>) -> Result<u32>;
    fn simplex_count(&self) -> u32;
    fn simplex(&self, simplex: u32) -> Simplex<N>;
    /// How much of the material of its cell a simplex has, to compare with others in the cell.
    fn part_of(&self, simplex: u32) -> f64;
    /// A simplex belongs to a cell now, before the simplex `next`.
    fn move_simplex(&mut self, simplex: u32, cell: u32, next: u32) -> Result<()>;
    /// The nodes that move a vertex, and how much each does.
    fn bonds(&self, vertex: u32) -> ([u32; N], [f64; N]);
    fn bind(&mut self, vertex: u32, nodes: [u32; N]) -> Result<()>;

    /// The cells' corners at a node.
    fn corners_at(&self, node: u32) -> impl Iterator<Item = u32> {
        let known = |corner: u32| (corner != NONE).then_some(corner);
        let next = move |&corner: &u32| known(self.cell(corner / N as u32).next[corner as usize % N]);
        std::iter::successors(known(self.nodes()[node].first), next)
    }

    /// The cells at a node.
    fn cells_at(&self, node: u32) -> impl Iterator<Item = u32> {
        self.corners_at(node).map(|corner| corner / N as u32)
    }

    /// The simplices of a cell, that added last first.
    fn simplices_in(&self, cell: u32) -> impl Iterator<Item = u32> {
        let known = |simplex: u32| (simplex != NONE).then_some(simplex);
        let next = move |&simplex: &u32| known(self.simplex(simplex).next);
        std::iter::successors(known(self.cell(cell).first), next)
    }

    /// Other nodes of the cells at two, some more than once.
    fn nodes_beside(&self, nodes: [u32; 2]) -> impl Iterator<Item = u32> {
        let cells = self.cells_at(nodes[0]).map(|cell| self.cell(cell).nodes);
        let others = cells.filter(move |cell| cell.contains(&nodes[1])).flatten();
        others.filter(move |node| !nodes.contains(node))
    }

    /// The corners of the simplices of the cells at a node, some more than once.
    fn corners_about(&self, node: u32) -> impl Iterator<Item = u32> {
        let simplices = self.cells_at(node).flat_map(|cell| self.simplices_in(cell));
        simplices.flat_map(|simplex| self.simplex(simplex).corners)
    }

    /// The vertex at a node, the lowest of several.
    fn vertex_of(&self, node: u32) -> Option<u32> {
        self.corners_about(node)
            .filter(|&vertex| self.is_at(vertex, node))
            .min()
    }

    /// The nodes that are to move a vertex between others of one cell, which have these shares in it, and how much each does.
    fn bonds_between(&self, sources: [u32; 3], shares: [f64; 3]) -> ([u32; N], [f64; N]) {
        let (mut nodes, mut weights) = ([NONE; N], [0.0; N]);
        for (source, share) in sources.into_iter().zip(shares) {
            let (of_source, parts) = self.bonds(source);
            for (node, part) in of_source.into_iter().zip(parts).filter(|(_, part)| part * share != 0.0) {
                // There is room for the nodes of a cell.
                if let Some(k) = (0..N).find(|&k| nodes[k] == node || nodes[k] == NONE) {
                    nodes[k] = node;
                    weights[k] += part * share;
                }
            }
        }
        (nodes.map(|node| if node == NONE { nodes[0] } else { node }), weights)
    }

    /// Whether a vertex is at a node.
    fn is_at(&self, vertex: u32, node: u32) -> bool {
        let (nodes, weights) = self.bonds(vertex);
        weights[0] == 1.0 && nodes[0] == node
    }
}

/// What surfaces and solids tell of themselves alike, and [`Divided`] with what is particular to each.
macro_rules! divided {
    ($body:ident, $corners:literal, $cell:ident { $material:ident }, $simplices:ident, $triangle:ident, { $($own:tt)* }) => {
        impl $body {
            /// How many nodes there are: those of the body, and copies and bound points, which are numbered on.
            pub fn node_count(&self) -> u32 {
                self.nodes.count()
            }

            /// The cells; those made by cuts follow the first ones.
            pub fn cells(&self) -> &[$cell] {
                self.cells.values()
            }

            /// The triangles that are drawn; none is ever taken away.
            pub fn triangles(&self) -> &[$triangle] {
                self.triangles.values()
            }

            /// Where a node is in the rest shape.
            pub fn rest(&self, node: u32) -> Vec3 {
                self.nodes[node].rest
            }

            /// Where a vertex is if nodes are at `positions`, rounded to `f32`, so that differences of places are exact in `f64`.
            pub fn place(&self, vertex: u32, positions: &[Vec3]) -> Vec3 {
                let (nodes, weights) = self.bonds(vertex);
                if weights[0] == 1.0 {
                    return positions[nodes[0] as usize];
                }
                weighed((nodes, weights), |node| positions[node as usize]).as_vec3()
            }

            /// Where a vertex is in the rest shape.
            pub fn rest_place(&self, vertex: u32) -> DVec3 {
                weighed(self.bonds(vertex), |node| self.nodes[node].rest)
            }

            /// The weights of a vertex, by the corners of a cell that it lies in.
            pub fn weights_in(&self, vertex: u32, cell: u32) -> [f64; $corners] {
                let (nodes, weights) = self.bonds(vertex);
                let weight = |node| (0..$corners).filter(|&k| nodes[k] == node).map(|k| weights[k]).sum();
                self.cells[cell].nodes.map(weight)
            }

            /// The corners of a triangle, by their numbers among nodes.
            pub fn corner_points(&self, triangle: u32) -> [u32; 3] {
                self.triangles[triangle].corners.map(|corner| self.vertices[corner].point)
            }

            /// Whether two nodes are corners of one cell.
            pub fn has_edge(&self, [a, b]: [u32; 2]) -> bool {
                self.cells_at(a).any(|cell| self.cells[cell].nodes.contains(&b))
            }
        }

        impl Divided<$corners> for $body {
            $($own)*

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
                Simplex { corners: it.corners, neighbours: it.neighbours, cell: it.cell, next: it.next }
            }

            fn bonds(&self, vertex: u32) -> ([u32; $corners], [f64; $corners]) {
                (self.vertices[vertex].nodes, self.vertices[vertex].weights)
            }

            fn bind(&mut self, vertex: u32, nodes: [u32; $corners]) -> Result<()> {
                self.vertices.edit(vertex, |vertex| vertex.nodes = nodes)
            }
        }
    };
}

pub(crate) use divided;

/// Nodes at these places in the rest shape, which no cell has yet; refused unless all are finite.
pub(crate) fn nodes_at(rest: &[Vec3]) -> Result<Vec<Node>> {
    for (at, place) in rest.iter().enumerate() {
        ensure!(place.is_finite(), "rest position {at} is {place}");
    }
    memory::collected(rest.iter().map(|&rest| Node { rest, first: NONE }))
}

/// Where the nodes of a cell are in the rest shape; refused unless they are known.
pub(crate) fn places_of<const N: usize>(number: usize, nodes: [u32; N], rest: &[Vec3]) -> Result<[DVec3; N]> {
    let count = rest.len();
    for node in nodes {
        ensure!((node as usize) < count, "cell {number} has node {node} of {count}");
    }
    Ok(nodes.map(|node| rest[node as usize].as_dvec3()))
}

/// Puts the corners of a cell first among those at its nodes: the next corner at each.
pub(crate) fn put_at<const N: usize>(nodes: &mut [Node], number: usize, corners: [u32; N]) -> [u32; N] {
    std::array::from_fn(|k| {
        let first = (N * number + k) as u32;
        std::mem::replace(&mut nodes[corners[k] as usize].first, first)
    })
}

/// The place that nodes at these places give by weights.
pub(crate) fn weighed<const N: usize>((nodes, weights): ([u32; N], [f64; N]), place: impl Fn(u32) -> Vec3) -> DVec3 {
    (0..N)
        .filter(|&k| weights[k] != 0.0)
        .map(|k| weights[k] * place(nodes[k]).as_dvec3())
        .sum()
}
