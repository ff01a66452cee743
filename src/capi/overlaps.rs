//! What a detector has found, as C reads it.

use glam::DVec3;

use super::body::sinew_body_id;
use super::detector::{SINEW_NO_TRIANGLE, sinew_detector_report, sinew_edge_inside, sinew_point_inside};
use super::memory::Versioned;
use crate::base::memory::reserved;
use crate::base::{Error, Result, ensure};
use crate::body::Body;
use crate::detection::exact::{self, Exact};
use crate::detection::image_space::{self, ImageSpace, Surface};
use crate::world::World;

/// One of the two bodies.
pub(super) struct DetectorSide {
    pub body: sinew_body_id,
    pub surface: Surface,
    /// When the detector was made.
    pub was_closed: bool,
    pub thickness: f32,
}

pub(super) enum Method {
    ImageSpace(Box<ImageSpace>),
    /// What each closed body encloses, and what of the other lies within it.
    Exact([Option<Box<Exact>>; 2], [exact::Overlap; 2]),
}

/// What the last detection found; as it was where one fails.
pub(super) struct Overlaps {
    /// Whether volumes are measured.
    has_volume: bool,
    pub report: sinew_detector_report,
    pub points: [Vec<sinew_point_inside>; 2],
    pub edges: [Vec<sinew_edge_inside>; 2],
    pub gradients: [Vec<DVec3>; 2],
}

impl DetectorSide {
    /// The body, where it is still what the detector was made for.
    pub fn body<'a>(&self, number: usize, world: &'a World) -> Result<&'a Body> {
        let sinew_body_id { index1, generation } = self.body;
        let Ok(body) = world.body(self.body.id()) else {
            return Err(Error::invalid(format!(
                "world: body {number} of the detector, of index1 {index1} and generation {generation}, is not there: it was destroyed, or \
                 this is another world"
            )));
        };
        ensure!(
            body.node_count() == self.surface.node_count() && body.surface() == self.surface.triangles(),
            "world: body {number} of the detector, of index1 {index1} and generation {generation}, has another surface now, of {} nodes \
                 and {} triangles: the detector was made for {} and {}",
            body.node_count(),
            body.surface().len(),
            self.surface.node_count(),
            self.surface.triangles().len()
        );
        Ok(body)
    }
}

impl Overlaps {
    pub fn reserved(sides: &[DetectorSide; 2], method: &Method, has_volume: bool) -> Result<Self> {
        let node_counts = [0, 1].map(|side| sides[side].surface.node_count());
        let edges = sides.iter().map(|side| side.surface.edges().len()).max().unwrap_or(0);
        // As many as an image-space detection lists.
        let edges = match method {
            Method::ImageSpace(_) => 4 * edges,
            Method::Exact(..) => edges,
        };
        let gradients = node_counts.map(|count| if has_volume { count } else { 0 });
        Ok(Self {
            has_volume,
            report: sinew_detector_report::empty(),
            points: [reserved(node_counts[0])?, reserved(node_counts[1])?],
            edges: [reserved(edges)?, reserved(edges)?],
            gradients: [reserved(gradients[0])?, reserved(gradients[1])?],
        })
    }

    pub fn clear(&mut self) {
        self.report = sinew_detector_report::empty();
        self.points.iter_mut().for_each(Vec::clear);
        self.edges.iter_mut().for_each(Vec::clear);
        self.gradients.iter_mut().for_each(Vec::clear);
    }

    /// Makes room before anything is lost of what was found before.
    fn begin(&mut self, point_counts: [usize; 2], edge_counts: [usize; 2]) -> Result<()> {
        for side in 0..2 {
            let (points, edges) = (&mut self.points[side], &mut self.edges[side]);
            points.try_reserve(point_counts[side].saturating_sub(points.len()))?;
            edges.try_reserve(edge_counts[side].saturating_sub(edges.len()))?;
        }
        self.clear();
        self.report.point_counts = point_counts.map(|count| count as u32);
        self.report.edge_counts = edge_counts.map(|count| count as u32);
        Ok(())
    }

    pub fn take_image(&mut self, overlap: &image_space::Overlap, surfaces: [&Surface; 2]) -> Result<()> {
        let inside = &overlap.inside;
        self.begin(
            [inside[0].points.len(), inside[1].points.len()],
            [inside[0].edges.len(), inside[1].edges.len()],
        )?;
        for (side, inside) in inside.iter().enumerate() {
            self.points[side].extend(inside.points.iter().map(|point| sinew_point_inside {
                node: point.node,
                triangle: point.triangle,
                depth: point.depth,
                normal: [0.0; 3],
            }));
            self.edges[side].extend(inside.edges.iter().map(|part| sinew_edge_inside {
                nodes: surfaces[side].edges()[part.edge as usize],
                entry: part.entry,
                exit: part.exit,
                depth: part.depth,
            }));
            self.report.unlisted[side] = inside.unlisted;
        }
        self.report.volume = overlap.volume;
        self.report.normal = overlap.normal.to_array();
        self.report.depth = overlap.depth;
        self.report.pixel = overlap.pixel;
        if self.has_volume && surfaces.iter().all(|surface| surface.is_closed()) {
            for (kept, gradient) in self.gradients.iter_mut().zip(&overlap.gradients) {
                kept.extend_from_slice(gradient);
            }
        }
        Ok(())
    }

    pub fn take_exact(&mut self, overlaps: &[exact::Overlap; 2], surfaces: [&Surface; 2]) -> Result<()> {
        self.begin(
            [overlaps[0].points.len(), overlaps[1].points.len()],
            [overlaps[0].edges.len(), overlaps[1].edges.len()],
        )?;
        for (side, overlap) in overlaps.iter().enumerate() {
            self.points[side].extend(overlap.points.iter().map(|point| sinew_point_inside {
                node: point.point,
                triangle: SINEW_NO_TRIANGLE,
                depth: point.depth,
                normal: point.normal.to_array(),
            }));
            self.edges[side].extend(overlap.edges.iter().map(|part| sinew_edge_inside {
                nodes: surfaces[side].edges()[part.edge as usize],
                entry: part.enters,
                exit: part.leaves,
                depth: 0.0,
            }));
        }
        Ok(())
    }
}

/// Says which of the two bodies is meant.
pub(super) fn of_body(side: usize, error: Error) -> Error {
    match error {
        Error::InvalidArgument(why) => Error::InvalidArgument(format!("bodies: body {side}: {why}")),
        Error::Unsupported(why) => Error::Unsupported(format!("bodies: body {side}: {why}")),
        error => error,
    }
}
