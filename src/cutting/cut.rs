//! A cut from its beginning to its end.

use glam::{DVec3, Vec3};

use super::changes::Changes;
use super::pieces::Copier;
use super::surface::CutSurface;
use crate::base::{Error, Result, ensure, memory};

/// What a blade's edge, a segment, passes over in one step: two triangles, which meet from the start's first point to the end's second.
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
    /// The two triangles; the last side of each is the one that they share, the first the blade's edge before and after the step.
    pub(crate) fn triangles(&self) -> [[Vec3; 3]; 2] {
        let ([a, b], [c, d]) = (self.start, self.end);
        [[a, b, d], [d, c, a]]
    }

    /// The numbers of the items whose box meets its own, of the corners of each.
    pub(crate) fn near<const N: usize>(&self, items: impl Iterator<Item = [Vec3; N]>) -> Result<Vec<u32>> {
        let (low, high) = bounds(&[self.start[0], self.start[1], self.end[0], self.end[1]]);
        let meets = |corners: &[Vec3; N]| {
            let (from, to) = bounds(corners);
            from.cmple(high).all() && low.cmple(to).all()
        };
        let near = (0..).zip(items).filter(|(_, corners)| meets(corners));
        memory::gathered(near.map(|(number, _)| number))
    }

    /// Refuses what no cut is made of: with items of a name and a count, of which `nodes_of` tells the nodes.
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

/// How many there may be after a cut; one that needs more is refused.
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
    /// Nodes, with copies and bound points.
    pub nodes: u32,
    /// Vertices of what is drawn.
    pub vertices: u32,
    /// Triangles that are drawn.
    pub triangles: u32,
}

impl Limits {
    /// As many as can be numbered.
    pub const NONE: Self = Self {
        nodes: u32::MAX / 3,
        vertices: u32::MAX / 3,
        triangles: u32::MAX / 3,
    };

    /// Refuses one more than `count` if there may be no more than `limit`.
    pub(crate) fn check(&self, what: &str, count: u32, limit: u32) -> Result<()> {
        if count < limit.min(u32::MAX / 3) {
            return Ok(());
        }
        Err(Error::Capacity(format!(
            "the cut needs more than the {limit} {what} that spare_nodes of the definition leave room for"
        )))
    }
}

/// A cut that is being made.
pub(crate) struct Cut<'a> {
    pub(crate) surface: &'a mut CutSurface,
    pub(crate) limits: Limits,
    pub(crate) changes: Changes,
    /// Where the side that the swept triangles share passes through, in the rest shape, with the vertices there.
    pub(crate) joints: Vec<(DVec3, u32)>,
    /// Vertices that a point was snapped to, and ends of cuts within the snapping distance of it.
    pub(crate) joins: Vec<[u32; 2]>,
}

impl CutSurface {
    /// Cuts what a blade passes through while nodes are at `positions`. Of the triangles `candidates` alone, in any order, it finds those
    /// that are met: all whose box meets the sweep's.
    ///
    /// Where the blade crosses an edge or ends in a triangle there is a vertex from then on: one that is there, or on an edge that is there, if
    /// it lies within 5 % of the shortest edge of the cell, in the rest shape. Edges between them are cut. A cell whose material falls apart is
    /// copied for each piece; copies share nodes where their material hangs together across an edge (Molino, Bao, Fedkiw 2004). Of the
    /// copies of a node that keeps its number which moves what is drawn at the node; of several that with the most material.
    ///
    /// The cost is that of what is met. [`CutSurface::undo`] takes it back until the next cut.
    ///
    /// # Errors
    ///
    /// [`Error::InvalidArgument`] if there is not one position for each node, if one that is needed or the blade is not finite, or if a
    /// candidate is unknown; [`Error::Capacity`] beyond the limits; [`Error::OutOfMemory`]. Then nothing has changed.
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
            joints: Vec::new(),
            joins: Vec::new(),
            surface: self,
        };
        let changes = cut.make(sweep, positions, candidates);
        if changes.is_err() {
            self.undo();
        }
        changes
    }

    /// Takes back the last cut; a second time, nothing.
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

    /// The triangles whose box meets the sweep's if nodes are at `positions`, found by going through all.
    pub fn near(&self, sweep: &Sweep, positions: &[Vec3]) -> Result<Vec<u32>> {
        let place = |corner| self.place(corner, positions);
        sweep.near(self.triangles().iter().map(|triangle| triangle.corners.map(place)))
    }
}

impl Cut<'_> {
    fn make(mut self, sweep: &Sweep, positions: &[Vec3], candidates: &[u32]) -> Result<Changes> {
        let mut candidates = memory::copied(candidates)?;
        memory::sort_once(&mut candidates);
        let [first, second] = sweep.triangles();
        self.carve(first, false, positions, &candidates)?;
        // What the first has added lies where candidates were.
        let added = self.surface.triangles.count_before()..self.surface.triangles.count();
        candidates.try_reserve(added.len())?;
        candidates.extend(added);
        self.carve(second, true, positions, &candidates)?;
        self.keep_crumbs()?;
        let cells = self.open()?;
        Copier {
            body: &mut *self.surface,
            limits: self.limits,
            changes: &mut self.changes,
        }
        .part(&cells)?;
        self.finish()
    }

    /// The lists that only the end can tell.
    fn finish(mut self) -> Result<Changes> {
        memory::sort_once(&mut self.changes.ends);
        self.changes.triangles = self.surface.triangles.touched()?;
        self.number_points()?;
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
