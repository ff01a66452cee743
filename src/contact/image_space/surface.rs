//! Surfaces for image-space detection, validated once.

use glam::Vec3;

use crate::base::{Error, Result, ensure, memory};
use crate::mesh;

/// Error message for an occluder that is not closed.
pub(super) const OPEN: &str =
    "the surface is not closed: an occluder must be, with each edge as often in one direction as in the other";

/// The triangles of a body and their edges.
///
/// ```
/// # use sinew::detection::image_space::Surface;
/// # use sinew::mesh::Mesh;
/// # let mesh = Mesh::block([0.1, 0.1, 0.1], [2, 2, 2])?;
/// let cube = Surface::closed(mesh.positions.len(), &mesh.surface()?)?;
/// assert!(cube.is_closed());
/// // A closed surface has three edges for two triangles.
/// assert_eq!(2 * cube.edges().len(), 3 * cube.triangles().len());
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Debug)]
pub struct Surface {
    node_count: usize,
    triangles: Vec<[u32; 3]>,
    edges: Vec<[u32; 2]>,
    /// True if other bodies can be inside. A closed surface that was cut is no longer closed.
    pub(crate) closed: bool,
}

/// A surface with its current node positions.
///
/// ```
/// # use glam::Vec3;
/// # use sinew::detection::image_space::*;
/// # use sinew::mesh::Mesh;
/// # let mesh = Mesh::block([0.1, 0.1, 0.1], [2, 2, 2])?;
/// # let moved: Vec<Vec3> = mesh.positions.iter().map(|place| place + 0.08 * Vec3::X).collect();
/// # let cube = Surface::closed(mesh.positions.len(), &mesh.surface()?)?;
/// let place = |positions| Placed { surface: &cube, positions, thickness: 0.0 };
/// let mut space = ImageSpace::new(&ImageSpaceDefinition::new(0.002), &[&cube, &cube])?;
/// let overlap = space.detect(&[place(&mesh.positions[..]), place(&moved[..])])?;
/// assert!(!overlap.is_empty());
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Placed<'a> {
    /// Triangles and edges.
    pub surface: &'a Surface,
    /// One position per node, m.
    pub positions: &'a [Vec3],
    /// Expansion of the body along the view, m, at least 0. It prevents thin parts from being missed.
    pub thickness: f32,
}

impl Surface {
    /// Creates the surface of a body that others can be inside of. Its triangles face outward and leave no gap.
    ///
    /// Errors: [`Error::InvalidArgument`] for no triangles, an index out of range, a surface that is not closed;
    /// [`Error::OutOfMemory`].
    pub fn closed(node_count: usize, triangles: &[[u32; 3]]) -> Result<Self> {
        check(node_count, triangles)?;
        ensure!(mesh::is_closed(triangles)?, Error::invalid(OPEN));
        Self::new(node_count, triangles, true)
    }

    /// Creates the surface of a body without an inside. Only its edges are reported.
    ///
    /// Errors: [`Error::InvalidArgument`] for no triangles or an index out of range; [`Error::OutOfMemory`].
    pub fn open(node_count: usize, triangles: &[[u32; 3]]) -> Result<Self> {
        check(node_count, triangles)?;
        Self::new(node_count, triangles, false)
    }

    fn new(node_count: usize, triangles: &[[u32; 3]], closed: bool) -> Result<Self> {
        Ok(Self {
            node_count,
            triangles: memory::copied(triangles)?,
            edges: mesh::edges(triangles, &[])?,
            closed,
        })
    }

    /// True if other bodies can be inside.
    pub fn is_closed(&self) -> bool {
        self.closed
    }

    /// Returns the number of nodes.
    pub fn node_count(&self) -> usize {
        self.node_count
    }

    /// Returns the triangles, three nodes each.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Returns the edges, two nodes each.
    pub fn edges(&self) -> &[[u32; 2]] {
        &self.edges
    }
}

impl Placed<'_> {
    /// Returns the corners of a triangle.
    pub(super) fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.surface.triangles[triangle].map(|node| self.positions[node as usize])
    }

    /// Checks that the number of positions fits and all values are finite.
    pub(super) fn check(&self) -> Result<()> {
        let node_count = self.surface.node_count;
        ensure!(
            self.positions.len() == node_count,
            "{} positions of a surface of {node_count} nodes",
            self.positions.len()
        );
        ensure!(
            self.thickness >= 0.0 && self.thickness.is_finite(),
            "thickness is {} m: must be finite and at least 0",
            self.thickness
        );
        check_positions(self.positions)
    }
}

pub(super) fn check_positions(positions: &[Vec3]) -> Result<()> {
    for (node, position) in positions.iter().enumerate() {
        ensure!(position.is_finite(), "the position of node {node} is {position}");
    }
    Ok(())
}

/// Checks that the triangles can be drawn.
pub(super) fn check(node_count: usize, triangles: &[[u32; 3]]) -> Result<()> {
    ensure!(!triangles.is_empty(), "triangles: the surface has none");
    if triangles.len() >= 1 << 31 {
        return Err(Error::Unsupported(format!(
            "{} triangles: image space takes fewer than 2^31",
            triangles.len()
        )));
    }
    mesh::check_indices("triangle", triangles, node_count)
}
