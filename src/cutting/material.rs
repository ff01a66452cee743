//! The material of a body that can be cut: triangles, tetrahedra, or only springs.

use glam::{DVec3, Vec3};

use super::blade_query::BladeContact;
use super::cell_complex::CellComplex;
use super::changes::Changes;
use super::cut::{Limits, Sweep};
use super::solid::{CutSolid, SolidStroke};
use super::surface::CutSurface;
use crate::base::{Result, StateHasher, memory};
use crate::codec::{saved, saved_enum};

/// The material of a body. Its *items* are the triangles of a surface, the cells of a solid, or springs.
#[derive(Debug)]
pub(crate) enum CutMaterial {
    /// A blade removes those that it passes through, and changes nothing else.
    Springs(Vec<[u32; 2]>),
    Surface(CutSurface),
    Solid(CutSolid),
}

saved_enum!(CutMaterial { 0 => Springs(it), 1 => Surface(it), 2 => Solid(it) });

impl CutMaterial {
    /// The material if it consists of triangles.
    pub fn surface(&self) -> Option<&CutSurface> {
        match self {
            Self::Surface(surface) => Some(surface),
            Self::Springs(_) | Self::Solid(_) => None,
        }
    }

    /// The material if it consists of tetrahedra.
    pub fn solid(&self) -> Option<&CutSolid> {
        match self {
            Self::Solid(solid) => Some(solid),
            Self::Springs(_) | Self::Surface(_) => None,
        }
    }

    pub fn reserve(&mut self, nodes: u32) -> Result<()> {
        match self {
            Self::Springs(_) => Ok(()),
            Self::Surface(surface) => surface.reserve(nodes),
            Self::Solid(solid) => solid.reserve(nodes),
        }
    }

    /// See [`CutSurface::cut`] and [`CutSolid::cut`], with items as candidates.
    pub fn cut(&mut self, sweep: &Sweep, positions: &[Vec3], near: &[u32], limits: Limits) -> Result<Changes> {
        match self {
            Self::Springs(_) => Ok(Changes::default()),
            Self::Surface(surface) => surface.cut(sweep, positions, near, limits),
            Self::Solid(solid) => solid.cut(sweep, positions, near, limits),
        }
    }

    /// See [`CutSurface::query_blade`] and [`CutSolid::query_blade`], with items as candidates.
    pub fn query_blade(
        &self,
        sweep: &Sweep,
        positions: &[Vec3],
        near: &[u32],
        contacts: &mut Vec<BladeContact>,
    ) -> Result<()> {
        match self {
            Self::Springs(_) => Ok(()),
            Self::Surface(surface) => surface.query_blade(sweep, positions, near, contacts),
            Self::Solid(solid) => solid.query_blade(sweep, positions, near, contacts),
        }
    }

    /// Undoes the last cut.
    pub fn undo(&mut self) {
        match self {
            Self::Springs(_) => {}
            Self::Surface(surface) => surface.undo(),
            Self::Solid(solid) => solid.undo(),
        }
    }

    /// The number of components that the last cut has added. `None` if more than `max_simplices` triangles or
    /// tetrahedra must be visited.
    pub fn parted(&self, changes: &Changes, max_simplices: usize) -> Result<Option<u32>> {
        match self {
            Self::Springs(_) => Ok(Some(0)),
            Self::Surface(surface) => surface.parted(&changes.rim, max_simplices),
            Self::Solid(solid) => solid.parted(&changes.faces, max_simplices),
        }
    }

    pub fn triangle_count(&self) -> u32 {
        match self {
            Self::Springs(_) => 0,
            Self::Surface(surface) => surface.triangles().len() as u32,
            Self::Solid(solid) => solid.triangles().len() as u32,
        }
    }

    /// The maximum number of new triangles per new node. A split of a surface adds two triangles and a vertex with its
    /// own node. A solid that opens along n inner nodes gains n copies and 4 n triangles, and more at the line where
    /// the cut ends.
    pub fn triangles_per_node(&self) -> u32 {
        match self {
            Self::Springs(_) => 0,
            Self::Surface(_) => 2,
            Self::Solid(_) => 6,
        }
    }

    /// For each triangle of a solid, true if a cut exposed it.
    pub fn exposed(&self) -> impl Iterator<Item = bool> {
        let triangles = self.solid().map_or(&[][..], CutSolid::triangles);
        triangles.iter().map(|triangle| triangle.is_inner)
    }

    /// True if a cut exposed a triangle of a solid.
    pub fn is_exposed(&self, triangle: u32) -> bool {
        self.solid()
            .is_some_and(|solid| solid.triangles()[triangle as usize].is_inner)
    }

    /// The corners of a triangle, by their indices among nodes.
    pub fn corner_points(&self, triangle: u32) -> [u32; 3] {
        match self {
            Self::Springs(_) => [0; 3],
            Self::Surface(surface) => surface.corner_points(triangle),
            Self::Solid(solid) => solid.corner_points(triangle),
        }
    }

    /// The rest positions of the corners of a triangle.
    pub fn corners_at_rest(&self, triangle: u32) -> [DVec3; 3] {
        match self {
            Self::Springs(_) => [DVec3::NAN; 3],
            Self::Surface(surface) => {
                let corners = surface.triangles()[triangle as usize].corners;
                corners.map(|corner| surface.rest_place(corner))
            }
            Self::Solid(solid) => {
                let corners = solid.triangles()[triangle as usize].corners;
                corners.map(|corner| solid.rest_place(corner))
            }
        }
    }

    /// The share of a node of the material of its cells, m² or m³.
    pub fn material_at(&self, node: u32) -> f64 {
        match self {
            Self::Springs(_) => 0.0,
            Self::Surface(surface) => surface.area_at(node),
            Self::Solid(solid) => solid.volume_at(node),
        }
    }

    /// True if two nodes are corners of one cell.
    pub fn has_edge(&self, nodes: [u32; 2]) -> bool {
        match self {
            Self::Springs(_) => false,
            Self::Surface(surface) => surface.has_edge(nodes),
            Self::Solid(solid) => solid.has_edge(nodes),
        }
    }

    /// The tetrahedra at a node, if there are any.
    pub fn tetrahedra_at(&self, node: u32) -> impl Iterator<Item = u32> {
        self.solid().into_iter().flat_map(move |solid| solid.cells_at(node))
    }

    /// The cell that an item lies in.
    pub fn cell_of(&self, item: u32) -> u32 {
        match self {
            Self::Surface(surface) => surface.triangles()[item as usize].cell,
            Self::Springs(_) | Self::Solid(_) => item,
        }
    }

    /// The nodes of a triangle or tetrahedron.
    pub fn nodes_of_cell(&self, cell: u32) -> &[u32] {
        match self {
            Self::Springs(springs) => &springs[cell as usize],
            Self::Surface(surface) => &surface.cells()[cell as usize].nodes,
            Self::Solid(solid) => &solid.cells()[cell as usize].nodes,
        }
    }

    /// The nodes of the cell that an item lies in. Nodes beyond the third may repeat the first.
    pub fn nodes_of(&self, item: u32) -> [u32; 4] {
        let cell = self.cell_of(item) as usize;
        match self {
            Self::Springs(springs) => two_and_first(springs[cell]),
            Self::Surface(surface) => three_and_first(surface.cells()[cell].nodes),
            Self::Solid(solid) => solid.cells()[cell].nodes,
        }
    }

    /// The corners of an item, by their indices among nodes.
    pub fn item_corners(&self, item: u32) -> [u32; 4] {
        match self {
            Self::Springs(springs) => two_and_first(springs[item as usize]),
            Self::Surface(surface) => three_and_first(surface.corner_points(item)),
            Self::Solid(solid) => solid.cells()[item as usize].nodes,
        }
    }

    /// The number of items.
    pub fn item_count(&self) -> u32 {
        match self {
            Self::Springs(springs) => springs.len() as u32,
            Self::Surface(_) => self.triangle_count(),
            Self::Solid(solid) => solid.cells().len() as u32,
        }
    }

    /// The items that a cut has changed or added, in order.
    pub fn items_changed(&self, changes: &Changes) -> Result<Vec<u32>> {
        match self {
            Self::Springs(_) => Ok(Vec::new()),
            Self::Surface(_) => memory::copied(&changes.triangles),
            Self::Solid(_) => memory::collected(changes.cells.iter().map(|piece| piece.cell)),
        }
    }

    /// The maximum number of ends of a cut, given the items near it.
    pub fn max_ends(&self, changes: &Changes, near: &[u32]) -> usize {
        match self {
            Self::Springs(_) => 0,
            Self::Surface(_) => changes.ends.len(),
            Self::Solid(_) => near.len(),
        }
    }

    /// Visits the points of the material at the edge's end position, with nodes at `positions`. `near` contains the
    /// items near it.
    pub fn visit_ends(
        &self,
        changes: &Changes,
        sweep: &Sweep,
        positions: &[Vec3],
        near: &[u32],
        mut visit: impl FnMut(CutEnd),
    ) {
        match self {
            Self::Springs(_) => {}
            Self::Surface(surface) => {
                for &vertex in &changes.ends {
                    let surface_vertex = &surface.vertices()[vertex as usize];
                    let [u, v, w] = surface_vertex.weights;
                    visit(CutEnd {
                        vertex: Some(vertex),
                        nodes: three_and_first(surface_vertex.nodes),
                        weights: [u, v, w, 0.0],
                        slack: 0.0,
                        size: surface.size_at(vertex),
                    });
                }
            }
            Self::Solid(solid) => {
                let ends = near.iter().filter_map(|&cell| solid.end_in(cell, sweep, positions));
                ends.for_each(visit);
            }
        }
    }

    /// The position of an end with nodes at `positions`, also after other cuts.
    pub fn position_of_end(&self, end: &CutEnd, positions: &[Vec3]) -> Vec3 {
        if let (Self::Surface(surface), Some(vertex)) = (self, end.vertex) {
            return positions[surface.vertices()[vertex as usize].point as usize];
        }
        let weighted = end.nodes.iter().zip(end.weights);
        let terms = weighted.map(|(&node, weight)| weight * positions[node as usize].as_dvec3());
        terms.sum::<DVec3>().as_vec3()
    }

    /// Exchanges the stroke that the next cut continues.
    pub fn swap_stroke(&mut self, stroke: &mut SolidStroke) {
        if let Self::Solid(solid) = self {
            std::mem::swap(&mut solid.stroke, stroke);
        }
    }

    /// The stroke that the next cut of a solid continues.
    pub fn stroke(&self) -> Option<SolidStroke> {
        self.solid().map(|solid| solid.stroke)
    }

    /// Restores a stroke of a solid.
    pub fn restore_stroke(&mut self, stroke: Option<SolidStroke>) {
        if let (Self::Solid(solid), Some(stroke)) = (self, stroke) {
            solid.stroke = stroke;
        }
    }

    /// Hashes the state that cuts depend on in addition to the render mesh.
    pub fn hash(&self, hasher: &mut StateHasher) {
        if let Self::Solid(solid) = self {
            solid.hash(hasher);
        }
    }

    /// Sets the edge's current position in the material, which has moved since the last cut.
    pub fn set_edge(&mut self, edge: [Vec3; 2]) {
        if let Self::Solid(solid) = self {
            solid.set_edge(edge);
        }
    }
}

fn two_and_first([a, b]: [u32; 2]) -> [u32; 4] {
    [a, b, a, a]
}

fn three_and_first([a, b, c]: [u32; 3]) -> [u32; 4] {
    [a, b, c, a]
}

/// A point of the material at the end of a cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CutEnd {
    /// The vertex at the point, for surfaces.
    pub vertex: Option<u32>,
    pub nodes: [u32; 4],
    pub weights: [f64; 4],
    /// The distance within which the cut can end, m. It is 0 if the point is an end of the cut.
    pub slack: f64,
    /// The shortest edge of the cell in the rest shape, m.
    pub size: f64,
}

saved! { CutEnd { vertex, nodes, weights, slack, size } }
