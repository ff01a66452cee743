//! A solid that can be cut: cells of material, tetrahedra that fill them, render triangles, and vertices that are bound
//! to nodes.

use glam::{DVec3, Vec3};

use super::separate::{BladeMark, SolidStroke};
use crate::base::{Result, memory};
use crate::codec::{saved, saved_enum};
use crate::cutting::cell_complex::{Cell, CellComplex, NONE, Node, Simplex, cell_complex, weighted_mean};
use crate::cutting::cell_copies::piece_count;
use crate::cutting::tracked::Tracked;

/// The corners of the face opposite each corner, counterclockwise seen from outside.
pub(crate) const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// A simulated tetrahedron.
///
/// ```
#[doc = include_str!("../../doctest/cut_solid.txt")]
/// # solid.cut(&across, &mesh.positions, &near, Limits::NONE)?;
/// let volume: f64 = solid.cells().iter().map(|cell| cell.volume).sum();
/// // A cut takes nothing away.
/// assert!((volume - 0.04_f64.powi(3)).abs() < 1e-9);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolidCell {
    /// The nodes, in the given order.
    pub nodes: [u32; 4],
    /// The volume of the material in the rest shape, m³.
    pub volume: f64,
    /// The snapping distance in the rest shape, m.
    pub snap: f64,
    /// The first tetrahedron of the material.
    pub(crate) first: u32,
    /// For each node the next corner at the node. Corner k of cell c has the index 4 c + k.
    pub(crate) next: [u32; 4],
}

saved! { SolidCell { nodes, volume, snap, first, next } }

/// The state of a face between two tetrahedra of the material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FaceState {
    /// The face is not cut.
    Whole,
    /// The blade has passed through the whole face, but it cannot open yet.
    Severed,
    /// The current cut opens the face.
    Opening,
}

saved_enum!(FaceState { 0 => Whole, 1 => Severed, 2 => Opening });

/// A tetrahedron of the material.
///
/// ```
#[doc = include_str!("../../doctest/cut_solid.txt")]
/// # solid.cut(&across, &mesh.positions, &near, Limits::NONE)?;
/// for tetrahedron in solid.tetrahedra() {
///     assert!(tetrahedron.volume > 0.0);
///     assert!(tetrahedron.volume <= solid.cells()[tetrahedron.cell as usize].volume * (1.0 + 1e-9));
/// }
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolidTetrahedron {
    /// The vertices. Seen from the first one the others are clockwise, so that their triple product is above 0.
    pub corners: [u32; 4],
    /// The cell that contains the tetrahedron.
    pub cell: u32,
    /// The volume in the rest shape, m³, above 0.
    pub volume: f64,
    /// The tetrahedron across the face opposite each corner.
    pub(crate) neighbors: [u32; 4],
    /// The state of the face opposite each corner.
    pub(crate) faces: [FaceState; 4],
    /// The render triangle on the face opposite each corner, if it has no neighbor.
    pub(crate) render_triangles: [u32; 4],
    /// The stroke that treats the tetrahedron, whose corners are all on the blade, as on the other side than their
    /// planes indicate.
    pub(crate) flipped_in: u32,
    /// The next tetrahedron of the same cell.
    pub(crate) next: u32,
}

saved! { SolidTetrahedron { corners, cell, volume, neighbors, faces, render_triangles, flipped_in, next } }

/// A triangle of the render surface: a face of the material without a neighbor.
///
/// ```
#[doc = include_str!("../../doctest/cut_solid.txt")]
/// # let changes = solid.cut(&across, &mesh.positions, &near, Limits::NONE)?;
/// let inner = solid.triangles().iter().filter(|triangle| triangle.is_inner);
/// assert_eq!(inner.count(), 2 * changes.faces.len());
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolidTriangle {
    /// The vertices, counterclockwise seen from outside.
    pub corners: [u32; 3],
    /// The cell that contains the triangle.
    pub cell: u32,
    /// True if a cut exposed the triangle. Otherwise it belongs to the skin.
    pub is_inner: bool,
    /// The tetrahedron that has this face.
    pub(crate) tetrahedron: u32,
}

saved! { SolidTriangle { corners, cell, is_inner, tetrahedron } }

/// A vertex of the material. Vertices of triangles are rendered. Others lie inside.
///
/// ```
/// # use glam::Vec3;
/// # use sinew::{cutting::CutSolid, mesh::Mesh};
/// # let mesh = Mesh::block([0.04, 0.04, 0.04], [2, 2, 2])?;
/// # let solid = CutSolid::new(&mesh.positions, &mesh.tetrahedra, &mesh.surface()?)?;
/// // As long as nothing is cut, each vertex is at a node.
/// for vertex in solid.vertices() {
///     let parts = vertex.nodes.iter().zip(vertex.weights);
///     let place: Vec3 = parts.map(|(&node, weight)| weight as f32 * mesh.positions[node as usize]).sum();
///     assert_eq!(place, mesh.positions[vertex.point as usize]);
/// }
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolidVertex {
    /// The nodes that it is bound to. Unused entries repeat the first one with weight 0.
    pub nodes: [u32; 4],
    /// The weights of the nodes. They are at least 0 and add up to 1.
    pub weights: [f64; 4],
    /// The index among nodes, which no other vertex has: that of the node at this vertex, or a separate one.
    pub point: u32,
    /// One of the tetrahedra around it.
    pub(crate) around: u32,
    /// The position relative to the blade in the last stroke near it, and in the one before.
    pub(crate) mark: BladeMark,
    pub(crate) other_mark: BladeMark,
}

saved! { SolidVertex { nodes, weights, point, around, mark, other_mark } }

/// A solid that can be cut.
///
/// ```
/// # use glam::vec3;
/// # use sinew::cutting::{CutSolid, Limits, Sweep};
/// # use sinew::mesh::Mesh;
/// # let mesh = Mesh::block([0.04, 0.04, 0.04], [2, 2, 2])?;
/// # let edge = |z| [vec3(0.003, -0.03, z), vec3(0.003, 0.03, z)];
/// # let across = Sweep { start: edge(-0.03), end: edge(0.03) };
/// let mut solid = CutSolid::new(&mesh.positions, &mesh.tetrahedra, &mesh.surface()?)?;
/// let near = solid.near(&across, &mesh.positions)?;
/// let changes = solid.cut(&across, &mesh.positions, &near, Limits::NONE)?;
/// assert_eq!(solid.piece_count()?, 2);
/// assert!(!changes.faces.is_empty());
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct CutSolid {
    pub(crate) nodes: Tracked<Node>,
    pub(crate) cells: Tracked<SolidCell>,
    pub(crate) tetrahedra: Tracked<SolidTetrahedron>,
    pub(crate) triangles: Tracked<SolidTriangle>,
    pub(crate) vertices: Tracked<SolidVertex>,
    /// The number of strokes.
    pub(crate) strokes: u32,
    pub(crate) stroke: SolidStroke,
    /// The values of both before the last cut.
    pub(crate) before: (u32, SolidStroke),
}

saved! { CutSolid { nodes, cells, tetrahedra, triangles, vertices, strokes, stroke, before } }

cell_complex!(CutSolid, 4, SolidCell { volume }, tetrahedra, SolidTriangle, {
    const EDGES: &'static [[usize; 2]] = &[[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];
    const SIDES: [&'static [usize]; 4] = [&FACES[0], &FACES[1], &FACES[2], &FACES[3]];

    fn material_fraction(&self, tetrahedron: u32) -> f64 {
        self.tetrahedra[tetrahedron].volume
    }

    fn move_simplex(&mut self, tetrahedron: u32, cell: u32, next: u32) -> Result<()> {
        let SolidTetrahedron {
            cell: before,
            render_triangles,
            ..
        } = self.tetrahedra[tetrahedron];
        self.tetrahedra
            .edit(tetrahedron, |it| (it.cell, it.next) = (cell, next))?;
        for triangle in render_triangles
            .into_iter()
            .filter(|&triangle| cell != before && triangle != NONE)
        {
            self.triangles.edit(triangle, |triangle| triangle.cell = cell)?;
        }
        Ok(())
    }
});

impl CutSolid {
    /// Reserves space for this many more nodes, and for everything else that cuts with these nodes usually need. Cuts
    /// then need not reallocate.
    pub fn reserve(&mut self, nodes: u32) -> Result<()> {
        let nodes = nodes as usize;
        self.nodes.reserve(nodes)?;
        self.cells.reserve(4 * nodes)?;
        self.tetrahedra.reserve(16 * nodes)?;
        self.triangles.reserve(6 * nodes)?;
        self.vertices.reserve(4 * nodes)
    }

    /// The tetrahedra of the material. Cuts never remove one.
    pub fn tetrahedra(&self) -> &[SolidTetrahedron] {
        self.tetrahedra.values()
    }

    /// The vertices of the material, rendered or not. Cuts never remove one. The first ones are one for each node, with
    /// its index.
    pub fn vertices(&self) -> &[SolidVertex] {
        self.vertices.values()
    }

    /// A quarter of the material of the cells at a node, m³.
    pub fn volume_at(&self, node: u32) -> f64 {
        self.cells_at(node).map(|cell| self.cells[cell].volume / 4.0).sum()
    }

    /// The number of connected components of the material. All tetrahedra are visited.
    pub fn piece_count(&self) -> Result<u32> {
        piece_count(self.tetrahedra().iter().map(|tetrahedron| tetrahedron.neighbors))
    }

    /// The tetrahedra around a vertex that are connected through faces at it, each with the corner index of the vertex.
    pub(crate) fn vertex_star(&self, vertex: u32, star: &mut Vec<(u32, usize)>) -> Result<()> {
        star.clear();
        let start = self.vertices[vertex].around;
        if start == NONE {
            return Ok(());
        }
        memory::push(star, (start, self.corner(start, vertex)))?;
        let mut index = 0;
        while let Some(&(tetrahedron, corner)) = star.get(index) {
            index += 1;
            for (face, &across) in self.tetrahedra[tetrahedron].neighbors.iter().enumerate() {
                if face != corner && across != NONE && !star.iter().any(|&(visited, _)| visited == across) {
                    memory::push(star, (across, self.corner(across, vertex)))?;
                }
            }
        }
        star.sort_unstable();
        Ok(())
    }

    /// The tetrahedra around an edge of one of them that are connected through faces at it.
    pub(crate) fn ring(&self, tetrahedron: u32, edge: [u32; 2], ring: &mut Vec<u32>) -> Result<()> {
        ring.clear();
        let [a, b] = self.opposite_corners(tetrahedron, edge);
        for (mut index, mut opposite) in [(tetrahedron, a), self.next_around_edge(tetrahedron, edge, b)] {
            while index != NONE {
                memory::push(ring, index)?;
                (index, opposite) = self.next_around_edge(index, edge, opposite);
                if index == tetrahedron {
                    return Ok(());
                }
            }
        }
        Ok(())
    }

    /// The next tetrahedron around an edge, through the face opposite corner `opposite`, and the corner opposite the
    /// face after it.
    pub(crate) fn next_around_edge(&self, tetrahedron: u32, edge: [u32; 2], opposite: u32) -> (u32, u32) {
        let across = self.tetrahedra[tetrahedron].neighbors[self.corner(tetrahedron, opposite)];
        if across == NONE {
            return (NONE, NONE);
        }
        let [a, b] = self.opposite_corners(tetrahedron, edge);
        let shared = if a == opposite { b } else { a };
        (across, shared)
    }

    /// The corners of a tetrahedron that are not on one of its edges.
    pub(crate) fn opposite_corners(&self, tetrahedron: u32, edge: [u32; 2]) -> [u32; 2] {
        let mut opposite = [NONE; 2];
        let mut count = 0;
        for corner in self.tetrahedra[tetrahedron].corners {
            if !edge.contains(&corner) && count < 2 {
                opposite[count] = corner;
                count += 1;
            }
        }
        opposite
    }

    /// The corner index of a vertex in a tetrahedron.
    pub(crate) fn corner(&self, tetrahedron: u32, vertex: u32) -> usize {
        let corners = self.tetrahedra[tetrahedron].corners;
        (0..3).find(|&k| corners[k] == vertex).unwrap_or(3)
    }

    /// The corners of a tetrahedron's face, counterclockwise seen from outside.
    pub(crate) fn face(&self, tetrahedron: u32, face: usize) -> [u32; 3] {
        FACES[face].map(|k| self.tetrahedra[tetrahedron].corners[k])
    }

    /// The area of a face in the rest shape.
    pub(crate) fn rest_area(&self, tetrahedron: u32, face: usize) -> f64 {
        let [a, b, c] = self.face(tetrahedron, face).map(|corner| self.rest_place(corner));
        0.5 * (b - a).cross(c - a).length()
    }

    /// The index of a face in the tetrahedron across it.
    pub(crate) fn face_in_neighbor(&self, tetrahedron: u32, face: usize) -> usize {
        let across = self.tetrahedra[tetrahedron].neighbors[face];
        let corners = self.face(tetrahedron, face);
        let other = self.tetrahedra[across].corners;
        (0..3).find(|&k| !corners.contains(&other[k])).unwrap_or(3)
    }
}
