//! The solid that is cut: cells of material, the tetrahedra that fill them, the triangles that are drawn, and the vertices bound to nodes.

use glam::{DVec3, Vec3};

use super::sever::{Mark, SolidStroke};
use crate::base::{Result, memory};
use crate::codec::{saved, saved_enum};
use crate::cutting::divided::{Cell, Divided, NONE, Node, Simplex, divided, weighed};
use crate::cutting::pieces::piece_count;
use crate::cutting::tracked::Tracked;

/// The corners of the face opposite each corner, counterclockwise seen from outside.
pub(crate) const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// A tetrahedron that is simulated.
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
    /// Its nodes, in the order in which they were given.
    pub nodes: [u32; 4],
    /// The volume of its material in the rest shape, m³.
    pub volume: f64,
    /// How far what is snapped in it may be moved, in the rest shape, m.
    pub snap: f64,
    /// The first of the tetrahedra of its material.
    pub(crate) first: u32,
    /// For each of its nodes the next corner at the node; corner k of cell c has the number 4 c + k.
    pub(crate) next: [u32; 4],
}

saved! { SolidCell { nodes, volume, snap, first, next } }

/// Whether a face of the material with a tetrahedron across was cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Face {
    /// It was not.
    Whole,
    /// The blade has passed through all of it, but it cannot open yet.
    Severed,
    /// It is being opened.
    Opening,
}

saved_enum!(Face { 0 => Whole, 1 => Severed, 2 => Opening });

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
    /// Its vertices; seen from the first the others are clockwise, that is, their triple product is above 0.
    pub corners: [u32; 4],
    /// The cell that it lies in.
    pub cell: u32,
    /// Its volume in the rest shape, m³, above 0.
    pub volume: f64,
    /// The tetrahedron across the face opposite each corner.
    pub(crate) neighbours: [u32; 4],
    /// What became of the face opposite each corner.
    pub(crate) faces: [Face; 4],
    /// The triangle drawn on the face opposite each corner, if nothing lies across.
    pub(crate) drawn: [u32; 4],
    /// The stroke that it counts as on the other side of than the planes of its corners tell, which are all on the blade.
    pub(crate) turned: u32,
    /// The next tetrahedron of the same cell.
    pub(crate) next: u32,
}

saved! { SolidTetrahedron { corners, cell, volume, neighbours, faces, drawn, turned, next } }

/// A triangle that is drawn and touched: a face of the material with nothing across.
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
    /// Its vertices, counterclockwise seen from outside.
    pub corners: [u32; 3],
    /// The cell that it lies in.
    pub cell: u32,
    /// Whether a cut has bared it; else it is skin.
    pub is_inner: bool,
    /// The tetrahedron of which it is a face.
    pub(crate) tetrahedron: u32,
}

saved! { SolidTriangle { corners, cell, is_inner, tetrahedron } }

/// A corner of the material. Those that triangles have are drawn; others lie inside.
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
    /// The nodes that it is bound to; unused ones repeat the first with weight 0.
    pub nodes: [u32; 4],
    /// How much of each, at least 0, 1 in all.
    pub weights: [f64; 4],
    /// Its number among nodes, which no other vertex has: that of the node that it is at, or one of its own.
    pub point: u32,
    /// One of the tetrahedra about it.
    pub(crate) around: u32,
    /// Where the blade passed through it, in the stroke that came near it last, and in the one before.
    pub(crate) mark: Mark,
    pub(crate) other_mark: Mark,
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
    /// How many strokes there were.
    pub(crate) strokes: u32,
    pub(crate) stroke: SolidStroke,
    /// Both before the last cut.
    pub(crate) before: (u32, SolidStroke),
}

saved! { CutSolid { nodes, cells, tetrahedra, triangles, vertices, strokes, stroke, before } }

divided!(CutSolid, 4, SolidCell { volume }, tetrahedra, SolidTriangle, {
    const EDGES: &'static [[usize; 2]] = &[[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];
    const SIDES: [&'static [usize]; 4] = [&FACES[0], &FACES[1], &FACES[2], &FACES[3]];

    fn part_of(&self, tetrahedron: u32) -> f64 {
        self.tetrahedra[tetrahedron].volume
    }

    fn move_simplex(&mut self, tetrahedron: u32, cell: u32, next: u32) -> Result<()> {
        let SolidTetrahedron {
            cell: before, drawn, ..
        } = self.tetrahedra[tetrahedron];
        self.tetrahedra
            .edit(tetrahedron, |it| (it.cell, it.next) = (cell, next))?;
        for triangle in drawn.into_iter().filter(|&drawn| cell != before && drawn != NONE) {
            self.triangles.edit(triangle, |triangle| triangle.cell = cell)?;
        }
        Ok(())
    }
});

impl CutSolid {
    /// Reserves room for so many more nodes, and for as much of all else as cuts that make them need in general, so that cuts do not have to
    /// move what is there.
    pub fn reserve(&mut self, nodes: u32) -> Result<()> {
        let nodes = nodes as usize;
        self.nodes.reserve(nodes)?;
        self.cells.reserve(4 * nodes)?;
        self.tetrahedra.reserve(16 * nodes)?;
        self.triangles.reserve(6 * nodes)?;
        self.vertices.reserve(4 * nodes)
    }

    /// The tetrahedra of the material; none is ever taken away.
    pub fn tetrahedra(&self) -> &[SolidTetrahedron] {
        self.tetrahedra.values()
    }

    /// The vertices of the material, drawn or not; none is ever taken away. At first there is one for each node, with its number.
    pub fn vertices(&self) -> &[SolidVertex] {
        self.vertices.values()
    }

    /// A quarter of the material of the cells at a node, m³.
    pub fn volume_at(&self, node: u32) -> f64 {
        self.cells_at(node).map(|cell| self.cells[cell].volume / 4.0).sum()
    }

    /// How many pieces the material has fallen into, found by going through all.
    pub fn piece_count(&self) -> Result<u32> {
        piece_count(self.tetrahedra().iter().map(|tetrahedron| tetrahedron.neighbours))
    }

    /// The tetrahedra about a vertex, as far as they hang together by faces at it, each with the vertex's number in it.
    pub(crate) fn star(&self, vertex: u32, star: &mut Vec<(u32, usize)>) -> Result<()> {
        star.clear();
        let start = self.vertices[vertex].around;
        if start == NONE {
            return Ok(());
        }
        memory::push(star, (start, self.corner(start, vertex)))?;
        let mut at = 0;
        while let Some(&(tetrahedron, corner)) = star.get(at) {
            at += 1;
            for (face, &across) in self.tetrahedra[tetrahedron].neighbours.iter().enumerate() {
                if face != corner && across != NONE && !star.iter().any(|&(seen, _)| seen == across) {
                    memory::push(star, (across, self.corner(across, vertex)))?;
                }
            }
        }
        star.sort_unstable();
        Ok(())
    }

    /// The tetrahedra about an edge between two corners of one, as far as they hang together by faces at it.
    pub(crate) fn ring(&self, tetrahedron: u32, edge: [u32; 2], ring: &mut Vec<u32>) -> Result<()> {
        ring.clear();
        let [a, b] = self.others(tetrahedron, edge);
        for (mut at, mut left) in [(tetrahedron, a), self.round(tetrahedron, edge, b)] {
            while at != NONE {
                memory::push(ring, at)?;
                (at, left) = self.round(at, edge, left);
                if at == tetrahedron {
                    return Ok(());
                }
            }
        }
        Ok(())
    }

    /// Goes on round an edge through the face opposite a corner: the tetrahedron across, and its corner to go on through.
    pub(crate) fn round(&self, tetrahedron: u32, edge: [u32; 2], left: u32) -> (u32, u32) {
        let across = self.tetrahedra[tetrahedron].neighbours[self.corner(tetrahedron, left)];
        if across == NONE {
            return (NONE, NONE);
        }
        let [a, b] = self.others(tetrahedron, edge);
        let shared = if a == left { b } else { a };
        (across, shared)
    }

    /// The corners of a tetrahedron that are not on an edge of it.
    pub(crate) fn others(&self, tetrahedron: u32, edge: [u32; 2]) -> [u32; 2] {
        let mut others = [NONE; 2];
        let mut count = 0;
        for corner in self.tetrahedra[tetrahedron].corners {
            if !edge.contains(&corner) && count < 2 {
                others[count] = corner;
                count += 1;
            }
        }
        others
    }

    /// Which corner of a tetrahedron a vertex is.
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

    /// Which face of the tetrahedron across a face that is.
    pub(crate) fn back(&self, tetrahedron: u32, face: usize) -> usize {
        let across = self.tetrahedra[tetrahedron].neighbours[face];
        let corners = self.face(tetrahedron, face);
        let other = self.tetrahedra[across].corners;
        (0..3).find(|&k| !corners.contains(&other[k])).unwrap_or(3)
    }
}
