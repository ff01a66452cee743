//! All stages of a cut.

use glam::{DVec3, Vec3};

use super::cell_copies::Copier;
use super::changes::Changes;
use super::surface::CutSurface;
use crate::base::{Error, Result, ensure, memory};

/// The surface that a blade's edge sweeps in one step. It consists of two triangles that share the line from the
/// start's first point to the end's second.
///
/// ```
/// # use glam::vec3;
/// # use sinew::cutting::Sweep;
#[doc = include_str!("../doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// # let sheet = world.create_body(&BodyDefinition { spare_nodes: 200, ..cloth })?;
/// // An upright edge, moved along z.
/// let edge = |z| [vec3(0.003, -0.01, z), vec3(0.003, 0.01, z)];
/// let report = world.cut(sheet, &Sweep { start: edge(-0.06), end: edge(0.0) })?;
/// assert!((report.length - 0.05).abs() < 1e-3);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sweep {
    /// Both ends of the edge before the step.
    pub start: [Vec3; 2],
    /// Both ends of the edge after the step.
    pub end: [Vec3; 2],
}

impl Sweep {
    /// The two triangles. Their last side is shared. Their first side is the blade's edge before and after the step.
    pub(crate) fn triangles(&self) -> [[Vec3; 3]; 2] {
        let ([a, b], [c, d]) = (self.start, self.end);
        [[a, b, d], [d, c, a]]
    }

    /// The indices of the items, given by their corners, whose bounding box overlaps that of the sweep.
    pub(crate) fn near<const N: usize>(&self, items: impl Iterator<Item = [Vec3; N]>) -> Result<Vec<u32>> {
        let (low, high) = bounds(&[self.start[0], self.start[1], self.end[0], self.end[1]]);
        let overlaps = |corners: &[Vec3; N]| {
            let (from, to) = bounds(corners);
            from.cmple(high).all() && low.cmple(to).all()
        };
        let near = (0..).zip(items).filter(|(_, corners)| overlaps(corners));
        memory::gathered(near.map(|(number, _)| number))
    }

    /// Refuses invalid arguments of a cut. `nodes_of` returns the nodes of an item.
    pub(crate) fn check<const N: usize>(
        &self,
        positions: &[Vec3],
        node_count: u32,
        candidates: &[u32],
        (items, count): (&str, u32),
        nodes_of: impl Fn(u32) -> [u32; N],
    ) -> Result<()> {
        ensure!(
            positions.len() == node_count as usize,
            "{} positions for {node_count} nodes",
            positions.len()
        );
        for end in self.start.iter().chain(&self.end) {
            ensure!(end.is_finite(), "an end of the blade is at {end}");
        }
        for &item in candidates {
            ensure!(item < count, "candidate {item} of {count} {items}");
            for node in nodes_of(item) {
                let place = positions[node as usize];
                ensure!(place.is_finite(), "node {node} is at {place}");
            }
        }
        Ok(())
    }
}

/// The maximum counts after a cut. A cut that needs more fails.
///
/// ```
#[doc = include_str!("../doctest/cut_sheet.txt")]
/// let near = sheet.near(&across, &mesh.positions)?;
/// let refused = sheet.cut(&across, &mesh.positions, &near, Limits { nodes: 26, ..Limits::NONE });
/// assert!(matches!(refused, Err(sinew::Error::Capacity(_))));
/// assert_eq!(sheet.piece_count()?, 1);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Nodes, including copies and bound points.
    pub nodes: u32,
    /// Vertices of the render mesh.
    pub vertices: u32,
    /// Triangles of the render mesh.
    pub triangles: u32,
}

impl Limits {
    /// The largest counts with valid indices.
    pub const NONE: Self = Self {
        nodes: u32::MAX / 3,
        vertices: u32::MAX / 3,
        triangles: u32::MAX / 3,
    };

    /// Refuses to exceed `limit` with one more than `count`.
    pub(crate) fn check(&self, what: &str, count: u32, limit: u32) -> Result<()> {
        if count < limit.min(u32::MAX / 3) {
            return Ok(());
        }
        Err(Error::Capacity(format!(
            "the cut needs more than the {limit} {what} that spare_nodes of the definition leave room for"
        )))
    }
}

/// A cut in progress.
pub(crate) struct Cut<'a> {
    pub(crate) surface: &'a mut CutSurface,
    pub(crate) limits: Limits,
    pub(crate) changes: Changes,
    /// Positions in the rest shape where the side shared by the swept triangles passes through, with the vertices
    /// there.
    pub(crate) shared_crossings: Vec<(DVec3, u32)>,
    /// Vertices that points were snapped to, and ends of cuts within their snapping distance.
    pub(crate) pending_joins: Vec<[u32; 2]>,
}

impl CutSurface {
    /// Cuts the triangles that a blade passes through with nodes at `positions`. It examines only the triangles in
    /// `candidates`, in any order. They must include all whose bounding box overlaps that of the sweep.
    ///
    /// Each point where the blade crosses an edge or ends in a triangle becomes a vertex. An existing vertex or a point
    /// of an existing edge is used within 5 % of the cell's shortest edge in the rest shape. Edges between these
    /// vertices are cut. A cell whose material falls apart is copied for each piece. Copies share nodes if their
    /// material is connected across an edge (Molino, Bao, Fedkiw 2004). The copy that moves the render mesh at the node
    /// keeps the node's index, or of several the one with the most material.
    ///
    /// The cost is proportional to the intersected triangles. [`CutSurface::undo`] restores the state before the cut,
    /// until the next cut.
    ///
    /// # Errors
    ///
    /// [`Error::InvalidArgument`] if the number of positions is not the number of nodes, if a needed position or the
    /// blade is not finite, or if a candidate is unknown; [`Error::Capacity`] beyond the limits;
    /// [`Error::OutOfMemory`]. An error changes nothing.
    pub fn cut(&mut self, sweep: &Sweep, positions: &[Vec3], candidates: &[u32], limits: Limits) -> Result<Changes> {
        let nodes_of = |triangle: u32| self.cells[self.triangles[triangle].cell].nodes;
        let items = ("triangles", self.triangles.count());
        sweep.check(positions, self.node_count(), candidates, items, nodes_of)?;
        self.begin();
        let cut = Cut {
            limits,
            changes: Changes {
                first_triangle: self.triangles.count(),
                ..Changes::default()
            },
            shared_crossings: Vec::new(),
            pending_joins: Vec::new(),
            surface: self,
        };
        let changes = cut.run(sweep, positions, candidates);
        if changes.is_err() {
            self.undo();
        }
        changes
    }

    /// Undoes the last cut. A second call does nothing.
    pub fn undo(&mut self) {
        self.nodes.undo();
        self.cells.undo();
        self.triangles.undo();
        self.vertices.undo();
    }

    fn begin(&mut self) {
        self.nodes.begin();
        self.cells.begin();
        self.triangles.begin();
        self.vertices.begin();
    }

    /// The triangles whose bounding box overlaps that of the sweep with nodes at `positions`. All triangles are
    /// examined.
    pub fn near(&self, sweep: &Sweep, positions: &[Vec3]) -> Result<Vec<u32>> {
        let position = |corner| self.place(corner, positions);
        sweep.near(self.triangles().iter().map(|triangle| triangle.corners.map(position)))
    }
}

impl Cut<'_> {
    fn run(mut self, sweep: &Sweep, positions: &[Vec3], candidates: &[u32]) -> Result<Changes> {
        let mut candidates = memory::copied(candidates)?;
        memory::sort_once(&mut candidates);
        let [first, second] = sweep.triangles();
        self.intersect(first, false, positions, &candidates)?;
        // Triangles that the first swept triangle added lie in those of the candidates.
        let added = self.surface.triangles.count_before()..self.surface.triangles.count();
        candidates.try_reserve(added.len())?;
        candidates.extend(added);
        self.intersect(second, true, positions, &candidates)?;
        self.keep_slivers()?;
        let cells = self.open()?;
        Copier {
            body: &mut *self.surface,
            limits: self.limits,
            changes: &mut self.changes,
        }
        .run(&cells)?;
        self.finish()
    }

    /// Completes the lists of changes.
    fn finish(mut self) -> Result<Changes> {
        memory::sort_once(&mut self.changes.ends);
        self.changes.triangles = self.surface.triangles.changed_indices()?;
        self.assign_points()?;
        for edge in &mut self.changes.rim {
            edge.points = edge.points.map(|vertex| self.surface.vertices[vertex].point);
        }
        Ok(self.changes)
    }
}

fn bounds(points: &[Vec3]) -> (Vec3, Vec3) {
    points
        .iter()
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), &point| {
            (low.min(point), high.max(point))
        })
}
