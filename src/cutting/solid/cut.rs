//! A cut from its beginning to its end.

use glam::Vec3;

use super::body::CutSolid;
use super::crossing::Swept;
use crate::base::{Result, memory};
use crate::cutting::changes::Changes;
use crate::cutting::cut::{Limits, Sweep};
use crate::cutting::pieces::Copier;

/// A cut that is being made.
pub(crate) struct SolidCut<'a> {
    pub(crate) solid: &'a mut CutSolid,
    pub(crate) limits: Limits,
    pub(crate) changes: Changes,
    /// The vertices that this step has found on the blade.
    pub(crate) marked: Vec<u32>,
    /// The vertices of which this step has told the side anew.
    pub(crate) beside: Vec<u32>,
    /// Whether it is a tear: sides are not told by a blade.
    pub(crate) is_tear: bool,
}

impl CutSolid {
    /// Cuts what a blade passes through while nodes are at `positions`. Of the cells `candidates` alone, in any order, it finds those that are met:
    /// all whose box meets the sweep's.
    ///
    /// Where the blade crosses an edge of the material there is a vertex from then on: an end of the edge, if it lies within 5 % of the shortest
    /// edge of the cells about it, in the rest shape, or a new one, which divides the tetrahedra about the edge. A face between three of them is
    /// cut. It opens once a corner of it parts, so that what is drawn stays manifold; that of a tetrahedron cut in part when its last edge is
    /// crossed, by the same stroke or a later one in the same plane. Steps of which each starts where the last ended are one stroke.
    ///
    /// A cell whose material falls apart is copied for each piece; copies share nodes where their material hangs together across a face that the
    /// node moves (Molino, Bao, Fedkiw 2004). Of the copies of a node that keeps its number which has a vertex of the
    /// material at it; of several that with the most material.
    ///
    /// The cost is that of what is met. [`CutSolid::undo`] takes it back until the next cut.
    ///
    /// # Errors
    ///
    /// [`Error::InvalidArgument`](crate::Error::InvalidArgument): there is not one position for each node, one that is needed or the blade is
    /// not finite, or a candidate is unknown. [`Error::Capacity`](crate::Error::Capacity) beyond the limits.
    /// [`Error::OutOfMemory`](crate::Error::OutOfMemory). Then nothing has changed.
    pub fn cut(&mut self, sweep: &Sweep, positions: &[Vec3], candidates: &[u32], limits: Limits) -> Result<Changes> {
        let items = ("cells", self.cells.count());
        sweep.check(positions, self.node_count(), candidates, items, |cell| {
            self.cells[cell].nodes
        })?;
        self.begin();
        let changes = SolidCut::new(self, limits, false).make(sweep, positions, candidates);
        if changes.is_err() {
            self.undo();
        }
        changes
    }

    /// Takes back the last cut; a second time, nothing.
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

    /// The cells whose box meets the sweep's if nodes are at `positions`, found by going through all.
    pub fn near(&self, sweep: &Sweep, positions: &[Vec3]) -> Result<Vec<u32>> {
        let place = |node| positions[node as usize];
        sweep.near(self.cells().iter().map(|cell| cell.nodes.map(place)))
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
            beside: Vec::new(),
            is_tear,
            solid,
        }
    }

    fn make(mut self, sweep: &Sweep, positions: &[Vec3], candidates: &[u32]) -> Result<Changes> {
        let mut candidates = memory::copied(candidates)?;
        memory::sort_once(&mut candidates);
        let CutSolid { stroke, strokes, .. } = &mut *self.solid;
        stroke.go_on(sweep, strokes);
        for triangle in sweep.triangles() {
            let swept = Swept::new(triangle.map(|corner| corner.as_dvec3()));
            let sign = self.solid.stroke.turn(swept.normal);
            self.carve(&swept, sign, positions, &candidates)?;
        }
        self.sever()?;
        let faces = self.ready()?;
        self.finish(&faces)
    }

    /// Opens faces that are ready, and what follows from that.
    pub(crate) fn finish(mut self, faces: &[(u32, usize)]) -> Result<Changes> {
        let cells = self.open(faces)?;
        Copier {
            body: &mut *self.solid,
            limits: self.limits,
            changes: &mut self.changes,
        }
        .part(&cells)?;
        // The lists that only the end can tell.
        self.changes.triangles = self.solid.triangles.touched()?;
        self.number_points()?;
        for edge in &mut self.changes.rim {
            edge.points = edge.points.map(|vertex| self.solid.vertices[vertex].point);
        }
        Ok(self.changes)
    }
}
