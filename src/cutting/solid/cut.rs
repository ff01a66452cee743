//! All stages of a cut.

use glam::Vec3;

use super::body::CutSolid;
use super::crossing::SweptTriangle;
use crate::base::{Result, memory};
use crate::cutting::cell_copies::Copier;
use crate::cutting::changes::Changes;
use crate::cutting::cut::{Limits, Sweep};

/// A cut in progress.
pub(crate) struct SolidCut<'a> {
    pub(crate) solid: &'a mut CutSolid,
    pub(crate) limits: Limits,
    pub(crate) changes: Changes,
    /// The vertices on the blade that this step has found.
    pub(crate) marked: Vec<u32>,
    /// The vertices whose side this step has changed.
    pub(crate) side_changed: Vec<u32>,
    /// True for a tear, where no blade defines the sides.
    pub(crate) is_tear: bool,
}

impl CutSolid {
    /// Cuts the cells that a blade passes through with nodes at `positions`. It examines only the cells in
    /// `candidates`, in any order. They must include all whose bounding box overlaps that of the sweep.
    ///
    /// Each point where the blade crosses an edge of the material becomes a vertex. An end of the edge is used within 5
    /// % of the shortest edge of the cells around it in the rest shape. A new vertex divides the tetrahedra around the
    /// edge. A face between three such vertices is cut. It opens once one of its corners separates, so that the render
    /// surface stays manifold. The face of a partly cut tetrahedron opens when its last edge is crossed, by the same
    /// stroke or a later one in the same plane. Consecutive steps, each starting where the last one ended, are one
    /// stroke.
    ///
    /// A cell whose material falls apart is copied for each piece. Copies share nodes if their material is connected
    /// across a face that the node moves (Molino, Bao, Fedkiw 2004). The copy with a vertex of the material at the node
    /// keeps the node's index, or of several the one with the most material.
    ///
    /// The cost is proportional to the intersected cells. [`CutSolid::undo`] restores the state before the cut, until
    /// the next cut.
    ///
    /// # Errors
    ///
    /// [`Error::InvalidArgument`](crate::Error::InvalidArgument): the number of positions is not the number of nodes, a
    /// needed position or the blade is not finite, or a candidate is unknown.
    /// [`Error::Capacity`](crate::Error::Capacity) beyond the limits.
    /// [`Error::OutOfMemory`](crate::Error::OutOfMemory). An error changes nothing.
    pub fn cut(&mut self, sweep: &Sweep, positions: &[Vec3], candidates: &[u32], limits: Limits) -> Result<Changes> {
        let items = ("cells", self.cells.count());
        sweep.check(positions, self.node_count(), candidates, items, |cell| {
            self.cells[cell].nodes
        })?;
        self.begin();
        let changes = SolidCut::new(self, limits, false).run(sweep, positions, candidates);
        if changes.is_err() {
            self.undo();
        }
        changes
    }

    /// Undoes the last cut. A second call does nothing.
    pub fn undo(&mut self) {
        self.nodes.undo();
        self.cells.undo();
        self.tetrahedra.undo();
        self.triangles.undo();
        self.vertices.undo();
        (self.strokes, self.stroke) = self.before;
    }

    pub(crate) fn begin(&mut self) {
        self.nodes.begin();
        self.cells.begin();
        self.tetrahedra.begin();
        self.triangles.begin();
        self.vertices.begin();
        self.before = (self.strokes, self.stroke);
    }

    /// The cells whose bounding box overlaps that of the sweep with nodes at `positions`. All cells are examined.
    pub fn near(&self, sweep: &Sweep, positions: &[Vec3]) -> Result<Vec<u32>> {
        let position = |node| positions[node as usize];
        sweep.near(self.cells().iter().map(|cell| cell.nodes.map(position)))
    }
}

impl<'a> SolidCut<'a> {
    pub(crate) fn new(solid: &'a mut CutSolid, limits: Limits, is_tear: bool) -> Self {
        Self {
            limits,
            changes: Changes {
                first_triangle: solid.triangles.count(),
                ..Changes::default()
            },
            marked: Vec::new(),
            side_changed: Vec::new(),
            is_tear,
            solid,
        }
    }

    fn run(mut self, sweep: &Sweep, positions: &[Vec3], candidates: &[u32]) -> Result<Changes> {
        let mut candidates = memory::copied(candidates)?;
        memory::sort_once(&mut candidates);
        let CutSolid { stroke, strokes, .. } = &mut *self.solid;
        stroke.advance(sweep, strokes);
        for triangle in sweep.triangles() {
            let swept = SweptTriangle::new(triangle.map(|corner| corner.as_dvec3()));
            let sign = self.solid.stroke.orient(swept.normal);
            self.intersect(&swept, sign, positions, &candidates)?;
        }
        self.mark_severed()?;
        let faces = self.openable_faces()?;
        self.finish(&faces)
    }

    /// Opens faces, copies cells and nodes, and completes the changes.
    pub(crate) fn finish(mut self, faces: &[(u32, usize)]) -> Result<Changes> {
        let cells = self.open(faces)?;
        Copier {
            body: &mut *self.solid,
            limits: self.limits,
            changes: &mut self.changes,
        }
        .run(&cells)?;
        // Lists that are known only at the end.
        self.changes.triangles = self.solid.triangles.changed_indices()?;
        self.assign_points()?;
        for edge in &mut self.changes.rim {
            edge.points = edge.points.map(|vertex| self.solid.vertices[vertex].point);
        }
        Ok(self.changes)
    }
}
