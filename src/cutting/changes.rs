//! What a cut has changed, for the solver and for a renderer.

use crate::base::{Result, memory};

/// A part of what a node was before the cut.
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
    /// The node: its source, which keeps its number, or a new one, which starts with its source's position and velocity.
    pub node: u32,
    /// The node that it was.
    pub source: u32,
    /// Its part of the source's mass as it was, above 0; those of one source add up to 1.
    pub part: f64,
}

/// A part of what a spring was before the cut. It has its source's rest length.
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
    /// Its nodes, in the order of `source`.
    pub nodes: [u32; 2],
    /// The nodes of the spring that it was, in ascending order.
    pub source: [u32; 2],
    /// Its part of the source's stiffness as it was, above 0; those of one source add up to 1.
    pub part: f64,
}

/// A part of what a cell was before the cut.
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
    /// The cell: its source, which keeps its number, or a new one.
    pub cell: u32,
    /// The cell that it was.
    pub source: u32,
    /// Its part of the source's material as it was, above 0; those of one source add up to 1.
    pub part: f64,
}

/// A point of what is drawn that is at no node, but bound to some.
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
    /// Its number among nodes.
    pub point: u32,
    /// The nodes that it is bound to; those beyond the first may repeat it with weight 0.
    pub nodes: [u32; 4],
    /// How much of each, at least 0, 1 in all.
    pub weights: [f64; 4],
}

/// Where a new node or point that is drawn comes from: what it carries (texture coordinates, weights of a skin) follows by these weights.
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
    /// Its number among nodes.
    pub point: u32,
    /// Those that it lies between, each of a lower number than its own; those beyond the first may repeat it with weight 0.
    pub sources: [u32; 3],
    /// How much of each, at least 0, 1 in all.
    pub weights: [f64; 3],
}

/// Where a new vertex comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct NewVertex {
    /// The vertices that it lies between, each of a lower number than its own; those beyond the first may repeat it with weight 0.
    pub sources: [u32; 3],
    pub weights: [f64; 3],
}

/// A new edge of the rim: of surfaces each edge that was cut is two of them, one on either side; of solids those where the inside that was bared
/// meets the skin.
///
/// ```
#[doc = include_str!("../doctest/cut_sheet.txt")]
/// # let near = sheet.near(&across, &mesh.positions)?;
/// # let changes = sheet.cut(&across, &mesh.positions, &near, Limits::NONE)?;
/// // Each edge of the cut is two of the rim.
/// let length: f64 = changes.rim.iter().map(|edge| edge.length).sum();
/// assert!((length - 2.0 * 0.1).abs() < 1e-3);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RimEdge {
    /// Its ends, by their numbers among nodes, in the order in which its triangle has them.
    pub points: [u32; 2],
    /// The triangle that it is a side of.
    pub triangle: u32,
    /// The triangle that lay across; of solids that of the skin, `triangle` being of the inside.
    pub across: u32,
    /// How long it is in the rest shape, m.
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
    /// The triangles that are drawn on its two sides.
    pub triangles: [u32; 2],
    /// Its area in the rest shape, m².
    pub area: f64,
}

/// What a cut has changed. New nodes and points, cells and triangles are numbered from their count before the cut on. The order of all lists
/// depends on what is cut and the blade alone.
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
    /// All parts of each node that fell apart; new ones in ascending order.
    pub nodes: Vec<PieceOfNode>,
    /// All parts of each spring along an edge of cells that fell apart or changed a node.
    pub springs: Vec<PieceOfSpring>,
    /// The springs that are no more: none of their parts has their nodes.
    pub removed_springs: Vec<[u32; 2]>,
    /// All parts of each cell that fell apart, and cells that changed a node.
    pub cells: Vec<PieceOfCell>,
    /// Points that are bound to nodes: new ones, in ascending order, and others whose nodes changed.
    pub bound: Vec<BoundPoint>,
    /// The new nodes that no vertex is at: they lie beyond the cut.
    pub undrawn: Vec<u32>,
    /// Where what is new and drawn, or inside a solid, comes from, in the order of numbers.
    pub sources: Vec<Source>,
    /// The number of the first new triangle.
    pub first_triangle: u32,
    /// The triangles whose corners or cell changed, and the new ones.
    pub triangles: Vec<u32>,
    /// Of surfaces: the vertices where the blade's edge stands at the end of the step, in the surface or on its border: where it goes on from
    /// if the surface moves before the next step.
    pub ends: Vec<u32>,
    /// The new edges of the rim.
    pub rim: Vec<RimEdge>,
    /// Of solids: the faces that have opened.
    pub faces: Vec<CutFace>,
    pub(crate) vertices: Vec<NewVertex>,
}

impl Changes {
    /// Whether nothing is other than it was.
    pub(crate) fn is_empty(&self) -> bool {
        self.triangles.is_empty() && self.nodes.is_empty() && self.bound.is_empty()
    }

    /// Tells of the copies of nodes which have a vertex at them, of which these are all: those come from their sources.
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

    /// Tells where the new vertices come from, which are numbered from `first` on: by the point and the first node of each, and the points of all
    /// before the cut, if they were there.
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
