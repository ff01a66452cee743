//! Meshes: topology, repair, shapes, files.
//!
//! [`load`] reads a file. [`Mesh::cloth`], [`Mesh::block`], [`Mesh::lattice`] and [`Mesh::organ`] create a shape.
//! [`tidy`] cleans a mesh in memory.

mod closed;
mod file;
mod hinges;
mod isosurface_stuffing;
mod organ;
mod repair;
mod shapes;
mod tetrahedralize;
mod topology;

use glam::{DVec3, Vec3};

use crate::base::{ensure, memory};
use crate::{Error, Result};

pub use closed::ClosedSurface;
pub(crate) use closed::MAX_COORDINATE;
pub use file::{MeshFormat, load};
pub use repair::{LoadedMesh, NO_NODE, TidyReport, tidy};
pub(crate) use topology::{
    CELL_DIAGONALS, CELL_EDGES, TETRAHEDRON_EDGES, TRIANGLE_EDGES, cell_boundary, element_edges, ends_of, outer_faces,
    pack, turn_outward, unpack,
};
pub use topology::{boundary, edges, is_closed};

/// Nodes joined by triangles, tetrahedra or cells. Positions are in meters; triangles face outward by the right-hand
/// rule.
///
/// ```
/// use sinew::mesh::Mesh;
/// let block = Mesh::block([0.04, 0.02, 0.03], [4, 2, 3])?;
/// assert_eq!(block.positions.len(), 5 * 3 * 4);
/// assert!((block.volume()? - 0.04 * 0.02 * 0.03).abs() < 1e-10);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// The position of each node, m.
    pub positions: Vec<Vec3>,
    /// Three node indices for each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Four node indices for each tetrahedron.
    pub tetrahedra: Vec<[u32; 4]>,
    /// Eight node indices for each cell: the corners of a cube, numbered by bits: x 1, y 2, z 4.
    pub cells: Vec<[u32; 8]>,
}

impl Mesh {
    /// Checks that every position is finite and every index is in range.
    ///
    /// Errors: [`Error::InvalidArgument`] with the first invalid node, triangle, tetrahedron or cell.
    pub fn check(&self) -> Result<()> {
        let node_count = self.positions.len();
        // The last index is reserved for "no node".
        ensure!(
            node_count <= NO_NODE as usize,
            "{node_count} nodes: at most {NO_NODE} are possible"
        );
        if let Some(node) = self.positions.iter().position(|p| !p.is_finite()) {
            let position = self.positions[node];
            return Err(Error::invalid(format!("the position of node {node} is {position}")));
        }
        check_indices("triangle", &self.triangles, node_count)?;
        check_indices("tetrahedron", &self.tetrahedra, node_count)?;
        check_indices("cell", &self.cells, node_count)
    }

    /// Every edge of the triangles, tetrahedra and cells once, including the diagonals of cell faces. See [`edges`].
    pub fn edges(&self) -> Result<Vec<[u32; 2]>> {
        element_edges(&self.triangles, &self.tetrahedra, &self.cells)
    }

    /// The surface: the [`boundary`] of the tetrahedra, outward for either orientation of them. Without tetrahedra it
    /// is the outer faces of the cells; without cells, the triangles.
    ///
    /// Errors: [`Error::OutOfMemory`].
    pub fn surface(&self) -> Result<Vec<[u32; 3]>> {
        if !self.tetrahedra.is_empty() {
            return outer_faces(&self.positions, &self.tetrahedra);
        }
        if !self.cells.is_empty() {
            return cell_boundary(&self.cells);
        }
        let mut surface = memory::reserved(self.triangles.len())?;
        surface.extend_from_slice(&self.triangles);
        Ok(surface)
    }

    /// The volume of the tetrahedra and cells, m³; inverted ones count as negative. Without either, it is the volume
    /// enclosed by the triangles: negative if they face inward, and meaningless if they are not closed.
    ///
    /// Errors: those of [`Mesh::check`].
    pub fn volume(&self) -> Result<f64> {
        self.check()?;
        if !self.tetrahedra.is_empty() || !self.cells.is_empty() {
            let tetrahedra = self.tetrahedra.iter().map(|&t| tetrahedron_volume(self.corners(t)));
            let cells = self.cells.iter().map(|&cell| cell_volume(self.corners(cell)));
            return Ok(tetrahedra.sum::<f64>() + cells.sum::<f64>());
        }
        // The apex is a node rather than the origin, so that a distant mesh loses no digits.
        let apex = self.positions.first().map_or(DVec3::ZERO, |p| p.as_dvec3());
        let cones = self.triangles.iter().map(|&t| self.corners(t));
        Ok(cones.map(|[a, b, c]| tetrahedron_volume([apex, a, b, c])).sum())
    }

    /// The positions of an element's nodes; the mesh must be valid.
    fn corners<const N: usize>(&self, element: [u32; N]) -> [DVec3; N] {
        element.map(|node| self.positions[node as usize].as_dvec3())
    }
}

/// The volume of a tetrahedron: positive if `b`, `c`, `d` are counter-clockwise seen from outside, with `a` behind
/// them.
pub(crate) fn tetrahedron_volume([a, b, c, d]: [DVec3; 4]) -> f64 {
    (b - a).dot((c - a).cross(d - a)) / 6.0
}

/// The volume of a cell, as the sum of its tetrahedra: positive if its axes are right-handed.
pub(crate) fn cell_volume(corners: [DVec3; 8]) -> f64 {
    let volumes = shapes::EVEN_CELL.map(|tetrahedron| tetrahedron_volume(tetrahedron.map(|corner| corners[corner])));
    volumes.iter().sum()
}

/// Returns an error if an element has a node index that is out of range.
pub(crate) fn check_indices<const N: usize>(what: &str, elements: &[[u32; N]], node_count: usize) -> Result<()> {
    for (i, element) in elements.iter().enumerate() {
        for &node in element {
            ensure!(
                (node as usize) < node_count,
                "{what} {i} names node {node}; there are {node_count}"
            );
        }
    }
    Ok(())
}
