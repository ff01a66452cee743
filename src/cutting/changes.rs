//! The changes of a cut, for the solver and for renderers.

use crate::base::{Result, memory};

/// A part of a node after a cut.
///
/// ```
#[doc = include_str!("../doctest/cut_sheet.txt")]
/// # let near = sheet.near(&across, &mesh.positions)?;
/// # let changes = sheet.cut(&across, &mesh.positions, &near, Limits::NONE)?;
/// # assert!(!changes.nodes.is_empty());
/// for piece in &changes.nodes {
///     let pieces = changes.nodes.iter().filter(|other| other.source == piece.source);
///     assert!((pieces.map(|piece| piece.part).sum::<f64>() - 1.0).abs() < 1e-9);
/// }
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PieceOfNode {
    /// The node: the source, which keeps its index, or a copy, which starts with the position and velocity of the
    /// source.
    pub node: u32,
    /// The node before the cut.
    pub source: u32,
    /// The part of the source's previous mass, above 0. The parts of one source add up to 1.
    pub part: f64,
}

/// A part of a spring after a cut. It has the rest length of its source.
///
/// ```
#[doc = include_str!("../doctest/cut_sheet.txt")]
/// # let near = sheet.near(&across, &mesh.positions)?;
/// # let changes = sheet.cut(&across, &mesh.positions, &near, Limits::NONE)?;
/// # assert!(!changes.springs.is_empty());
/// for piece in &changes.springs {
///     let pieces = changes.springs.iter().filter(|other| other.source == piece.source);
///     assert!((pieces.map(|piece| piece.part).sum::<f64>() - 1.0).abs() < 1e-9);
/// }
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PieceOfSpring {
    /// The nodes, in the order of `source`.
    pub nodes: [u32; 2],
    /// The nodes of the spring before the cut, in ascending order.
    pub source: [u32; 2],
    /// The part of the source's previous stiffness, above 0. The parts of one source add up to 1.
    pub part: f64,
}

/// A part of a cell after a cut.
///
/// ```
#[doc = include_str!("../doctest/cut_sheet.txt")]
/// # let near = sheet.near(&across, &mesh.positions)?;
/// # let changes = sheet.cut(&across, &mesh.positions, &near, Limits::NONE)?;
/// // The copies of cells that fell apart are numbered from the last old cell on.
/// let copies = changes.cells.iter().filter(|piece| piece.cell != piece.source);
/// assert_eq!(copies.count(), sheet.cells().len() - mesh.triangles.len());
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PieceOfCell {
    /// The cell: the source, which keeps its index, or a copy.
    pub cell: u32,
    /// The cell before the cut.
    pub source: u32,
    /// The part of the source's previous material, above 0. The parts of one source add up to 1.
    pub part: f64,
}

/// A point of the render mesh that is bound to nodes.
///
/// ```
#[doc = include_str!("../doctest/cut_sheet.txt")]
/// # let near = sheet.near(&across, &mesh.positions)?;
/// # let changes = sheet.cut(&across, &mesh.positions, &near, Limits::NONE)?;
/// # assert!(!changes.bound.is_empty());
/// for bound in &changes.bound {
///     assert!((bound.weights.iter().sum::<f64>() - 1.0).abs() < 1e-9);
///     assert!(!bound.nodes.contains(&bound.point));
/// }
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundPoint {
    /// The index among nodes.
    pub point: u32,
    /// The nodes that it is bound to. Further entries may repeat the first one with weight 0.
    pub nodes: [u32; 4],
    /// The weights of the nodes. They are at least 0 and add up to 1.
    pub weights: [f64; 4],
}

/// The origin of a new point of the render mesh. Attributes of vertices, such as texture coordinates and skinning
/// weights, are interpolated with these weights.
///
/// ```
#[doc = include_str!("../doctest/cut_sheet.txt")]
/// # let near = sheet.near(&across, &mesh.positions)?;
/// # let changes = sheet.cut(&across, &mesh.positions, &near, Limits::NONE)?;
/// # assert!(!changes.sources.is_empty());
/// for new in &changes.sources {
///     assert!(new.point as usize >= mesh.positions.len());
///     assert!(new.sources.iter().all(|&source| source < new.point));
/// }
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Source {
    /// The index among nodes.
    pub point: u32,
    /// The points that it lies between, each with a lower index than its own. Further entries may repeat the first one
    /// with weight 0.
    pub sources: [u32; 3],
    /// The weights of the sources. They are at least 0 and add up to 1.
    pub weights: [f64; 3],
}

/// The origin of a new vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct NewVertex {
    /// The vertices that it lies between, each with a lower index than its own. Further entries may repeat the first
    /// one with weight 0.
    pub sources: [u32; 3],
    pub weights: [f64; 3],
}

/// A new cut-boundary edge. A cut edge of a surface becomes two of them, one on each side. In a solid they lie where
/// exposed faces meet the skin.
///
/// ```
#[doc = include_str!("../doctest/cut_sheet.txt")]
/// # let near = sheet.near(&across, &mesh.positions)?;
/// # let changes = sheet.cut(&across, &mesh.positions, &near, Limits::NONE)?;
/// // Each cut edge becomes two boundary edges.
/// let length: f64 = changes.rim.iter().map(|edge| edge.length).sum();
/// assert!((length - 2.0 * 0.1).abs() < 1e-3);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RimEdge {
    /// The ends, by their indices among nodes, in the order of the corners of `triangle`.
    pub points: [u32; 2],
    /// The triangle that has this edge. In a solid it is an exposed one.
    pub triangle: u32,
    /// The triangle on the other side of the edge. In a solid it belongs to the skin.
    pub across: u32,
    /// The length in the rest shape, m.
    pub length: f64,
}

/// A face of a solid's material that has opened.
///
/// ```
#[doc = include_str!("../doctest/cut_solid.txt")]
/// # let changes = solid.cut(&across, &mesh.positions, &near, Limits::NONE)?;
/// let area: f64 = changes.faces.iter().map(|face| face.area).sum();
/// // The block is cut across, snapped to its nodes where it passes near them.
/// assert!((area - 0.04 * 0.04).abs() < 0.1 * area);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CutFace {
    /// The triangles of the render mesh on the two sides.
    pub triangles: [u32; 2],
    /// The area in the rest shape, m².
    pub area: f64,
}

/// The changes of a cut. New nodes, points, cells and triangles are numbered from their count before the cut on. The
/// order of all lists depends only on the material and the blade.
///
/// ```
#[doc = include_str!("../doctest/cut_sheet.txt")]
/// let near = sheet.near(&across, &mesh.positions)?;
/// let changes = sheet.cut(&across, &mesh.positions, &near, Limits::NONE)?;
/// let triangles = sheet.triangles().len() as u32;
/// assert!((changes.first_triangle..triangles).all(|new| changes.triangles.contains(&new)));
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Changes {
    /// All parts of each node that fell apart. Copies are in ascending order.
    pub nodes: Vec<PieceOfNode>,
    /// All parts of each spring along an edge of cells that fell apart or changed a node.
    pub springs: Vec<PieceOfSpring>,
    /// Springs that have been removed: none of their parts has their nodes.
    pub removed_springs: Vec<[u32; 2]>,
    /// All parts of each cell that fell apart, and cells that changed a node.
    pub cells: Vec<PieceOfCell>,
    /// Points that are bound to nodes: new ones in ascending order, and others whose nodes changed.
    pub bound: Vec<BoundPoint>,
    /// New nodes without a vertex. They lie beyond the cut.
    pub undrawn: Vec<u32>,
    /// The origins of new points of the render mesh and of points inside solids, in the order of indices.
    pub sources: Vec<Source>,
    /// The index of the first new triangle.
    pub first_triangle: u32,
    /// Triangles whose corners or cell changed, and new ones.
    pub triangles: Vec<u32>,
    /// For surfaces, the vertices at the blade's edge at the end of the step, inside the surface or on its border. The
    /// next step continues from them if the surface moves.
    pub ends: Vec<u32>,
    /// New cut-boundary edges.
    pub rim: Vec<RimEdge>,
    /// For solids, the faces that have opened.
    pub faces: Vec<CutFace>,
    pub(crate) vertices: Vec<NewVertex>,
}

impl Changes {
    /// True if nothing has changed.
    pub(crate) fn is_empty(&self) -> bool {
        self.triangles.is_empty() && self.nodes.is_empty() && self.bound.is_empty()
    }

    /// Lists the origins of copies of nodes, given all nodes that have a vertex. Copies without a vertex are not
    /// rendered.
    pub(crate) fn list_copies(&mut self, at_vertices: &[u32]) -> Result<()> {
        for &PieceOfNode { node, source, .. } in &self.nodes {
            if node == source {
                continue;
            }
            if at_vertices.binary_search(&node).is_err() {
                memory::push(&mut self.undrawn, node)?;
                continue;
            }
            let source = Source {
                point: node,
                sources: [source; 3],
                weights: [1.0, 0.0, 0.0],
            };
            memory::push(&mut self.sources, source)?;
        }
        Ok(())
    }

    /// Lists the origins of the new vertices, numbered from `first` on. `at` returns the point and the first node of a
    /// vertex, and `point_before` the point before the cut.
    pub(crate) fn list_sources(
        &mut self,
        first: u32,
        at: impl Fn(u32) -> [u32; 2],
        point_before: impl Fn(u32) -> u32,
    ) -> Result<()> {
        for (vertex, new) in (first..).zip(&self.vertices) {
            let [point, node] = at(vertex);
            if point == node {
                continue;
            }
            let source = Source {
                point,
                sources: new.sources.map(&point_before),
                weights: new.weights,
            };
            memory::push(&mut self.sources, source)?;
        }
        self.sources.sort_unstable_by_key(|source| source.point);
        Ok(())
    }
}
