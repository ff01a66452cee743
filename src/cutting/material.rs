//! What a body's material is made of where it can be cut: triangles, tetrahedra, or springs alone.

use glam::{DVec3, Vec3};

use super::changes::Changes;
use super::cut::{Limits, Sweep};
use super::divided::Divided;
use super::met::Met;
use super::solid::{CutSolid, SolidStroke};
use super::surface::CutSurface;
use crate::base::{Result, StateHasher, memory};
use crate::codec::{saved, saved_enum};

/// The material of a body. It is looked for by *items*: the triangles of a surface, the cells of a solid, springs.
#[derive(Debug)]
pub(crate) enum CutMaterial {
    /// Those that a blade passes through go; nothing else changes.
    Springs(Vec<[u32; 2]>),
    Surface(CutSurface),
    Solid(CutSolid),
}

saved_enum!(CutMaterial { 0 => Springs(it), 1 => Surface(it), 2 => Solid(it) });

impl CutMaterial {
    /// That of triangles.
    pub fn surface(&self) -> Option<&CutSurface> {
        match self {
            Self::Surface(surface) => Some(surface),
            Self::Springs(_) | Self::Solid(_) => None,
        }
    }

    /// That of tetrahedra.
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

    /// See [`CutSurface::meet`] and [`CutSolid::meet`], with items as candidates.
    pub fn meet(&self, sweep: &Sweep, positions: &[Vec3], near: &[u32], met: &mut Vec<Met>) -> Result<()> {
        match self {
            Self::Springs(_) => Ok(()),
            Self::Surface(surface) => surface.meet(sweep, positions, near, met),
            Self::Solid(solid) => solid.meet(sweep, positions, near, met),
        }
    }

    /// Takes back the last cut.
    pub fn undo(&mut self) {
        match self {
            Self::Springs(_) => {}
            Self::Surface(surface) => surface.undo(),
            Self::Solid(solid) => solid.undo(),
        }
    }

    /// How many more pieces it has after the last cut; `None` if that takes more than `most` triangles or tetrahedra to find out.
    pub fn parted(&self, changes: &Changes, most: usize) -> Result<Option<u32>> {
        match self {
            Self::Springs(_) => Ok(Some(0)),
            Self::Surface(surface) => surface.parted(&changes.rim, most),
            Self::Solid(solid) => solid.parted(&changes.faces, most),
        }
    }

    pub fn triangle_count(&self) -> u32 {
        match self {
            Self::Springs(_) => 0,
            Self::Surface(surface) => surface.triangles().len() as u32,
            Self::Solid(solid) => solid.triangles().len() as u32,
        }
    }

    /// How many triangles may come for each node that comes. Of a surface those that a split adds, two, with a vertex that has a node of its
    /// own. Where a solid opens along n nodes inside, n copies come and 4 n triangles, and more at the line where it ends.
    pub fn triangles_per_node(&self) -> u32 {
        match self {
            Self::Springs(_) => 0,
            Self::Surface(_) => 2,
            Self::Solid(_) => 6,
        }
    }

    /// Of the triangles of solids, whether a cut has bared them.
    pub fn bared(&self) -> impl Iterator<Item = bool> {
        let triangles = self.solid().map_or(&[][..], CutSolid::triangles);
        triangles.iter().map(|triangle| triangle.is_inner)
    }

    /// Whether a cut has bared a triangle of a solid.
    pub fn is_bared(&self, triangle: u32) -> bool {
        self.solid()
            .is_some_and(|solid| solid.triangles()[triangle as usize].is_inner)
    }

    /// The corners of a triangle, by their numbers among nodes.
    pub fn corner_points(&self, triangle: u32) -> [u32; 3] {
        match self {
            Self::Springs(_) => [0; 3],
            Self::Surface(surface) => surface.corner_points(triangle),
            Self::Solid(solid) => solid.corner_points(triangle),
        }
    }

    /// Where the corners of a triangle are in the rest shape.
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

    /// A node's part of the material of its cells, m² or m³.
    pub fn share_at(&self, node: u32) -> f64 {
        match self {
            Self::Springs(_) => 0.0,
            Self::Surface(surface) => surface.area_at(node),
            Self::Solid(solid) => solid.volume_at(node),
        }
    }

    /// Whether two nodes are corners of one cell.
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

    /// The nodes of the cell that an item lies in; those beyond the third may repeat the first.
    pub fn nodes_of(&self, item: u32) -> [u32; 4] {
        let cell = self.cell_of(item) as usize;
        match self {
            Self::Springs(springs) => with_first(springs[cell]),
            Self::Surface(surface) => three_and_first(surface.cells()[cell].nodes),
            Self::Solid(solid) => solid.cells()[cell].nodes,
        }
    }

    /// What an item lies between, by numbers among nodes.
    pub fn corners_of(&self, item: u32) -> [u32; 4] {
        match self {
            Self::Springs(springs) => with_first(springs[item as usize]),
            Self::Surface(surface) => three_and_first(surface.corner_points(item)),
            Self::Solid(solid) => solid.cells()[item as usize].nodes,
        }
    }

    /// How many items there are.
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

    /// How many ends there are at most, of items that were near.
    pub fn most_ends(&self, changes: &Changes, near: &[u32]) -> usize {
        match self {
            Self::Springs(_) => 0,
            Self::Surface(_) => changes.ends.len(),
            Self::Solid(_) => near.len(),
        }
    }

    /// Shows points of the material where a cut's edge stands at its end, with nodes at `positions`, given the items that were near it.
    pub fn ends(
        &self,
        changes: &Changes,
        sweep: &Sweep,
        positions: &[Vec3],
        near: &[u32],
        mut see: impl FnMut(CutEnd),
    ) {
        match self {
            Self::Springs(_) => {}
            Self::Surface(surface) => {
                for &vertex in &changes.ends {
                    let of = &surface.vertices()[vertex as usize];
                    let [u, v, w] = of.weights;
                    see(CutEnd {
                        vertex: Some(vertex),
                        nodes: three_and_first(of.nodes),
                        weights: [u, v, w, 0.0],
                        slack: 0.0,
                        size: surface.size_at(vertex),
                    });
                }
            }
            Self::Solid(solid) => {
                let ends = near.iter().filter_map(|&cell| solid.end_in(cell, sweep, positions));
                ends.for_each(see);
            }
        }
    }

    /// Where an end is if nodes are at `positions`, also after other cuts.
    pub fn place_of(&self, end: &CutEnd, positions: &[Vec3]) -> Vec3 {
        if let (Self::Surface(surface), Some(vertex)) = (self, end.vertex) {
            return positions[surface.vertices()[vertex as usize].point as usize];
        }
        let parts = end.nodes.iter().zip(end.weights);
        let places = parts.map(|(&node, weight)| weight * positions[node as usize].as_dvec3());
        places.sum::<DVec3>().as_vec3()
    }

    /// Takes a stroke for that of the next cut, and gives the one that it had.
    pub fn swap_stroke(&mut self, stroke: &mut SolidStroke) {
        if let Self::Solid(solid) = self {
            std::mem::swap(&mut solid.stroke, stroke);
        }
    }

    /// The stroke of the next cut of a solid.
    pub fn stroke(&self) -> Option<SolidStroke> {
        self.solid().map(|solid| solid.stroke)
    }

    /// Has it be this again.
    pub fn take_back(&mut self, stroke: Option<SolidStroke>) {
        if let (Self::Solid(solid), Some(stroke)) = (self, stroke) {
            solid.stroke = stroke;
        }
    }

    /// Adds the bits that what a cut does depends on beside what is drawn.
    pub fn hash(&self, hasher: &mut StateHasher) {
        if let Self::Solid(solid) = self {
            solid.hash(hasher);
        }
    }

    /// The material has moved since the last cut: the blade's edge, which stopped there, is here in it now.
    pub fn carry(&mut self, edge: [Vec3; 2]) {
        if let Self::Solid(solid) = self {
            solid.carry(edge);
        }
    }
}

fn with_first([a, b]: [u32; 2]) -> [u32; 4] {
    [a, b, a, a]
}

fn three_and_first([a, b, c]: [u32; 3]) -> [u32; 4] {
    [a, b, c, a]
}

/// A point of the material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CutEnd {
    /// The vertex of a surface that it is.
    pub vertex: Option<u32>,
    pub nodes: [u32; 4],
    pub weights: [f64; 4],
    /// How far from it what was cut may end, m: nothing where it is an end of that itself.
    pub slack: f64,
    /// The shortest edge of a cell that it is in, in the rest shape, m.
    pub size: f64,
}

saved! { CutEnd { vertex, nodes, weights, slack, size } }
