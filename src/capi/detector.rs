//! What two bodies have in common: to know it, not to part them.

use glam::{DVec3, Vec3};

use super::body::sinew_body_id;
use super::guard::{destroy, guard, sinew_world, with_world};
use super::memory::{self, Versioned, versioned};
use super::overlaps::{DetectorSide, Method, Overlaps, of_body};
use super::status::sinew_status;
use super::tool::{SINEW_DETECTION_EXACT, detection};
use crate::base::memory::reserved;
use crate::base::{Error, Result, ensure};
use crate::body::Body;
use crate::def::{Detection, finite_vector};
use crate::detection::exact::{self, Exact};
use crate::detection::image_space::{Form, ImageSpace, ImageSpaceDefinition, Placed, Surface, Views};
use crate::mesh::{self, ClosedSurface};
use crate::world::World;

/// Intervals of rays inside; finds all edges, points deeper than 0.71 pixels.
pub const SINEW_IMAGE_FORM_INTERVALS: u32 = 0;
/// CInDeR (Halic et al.): edges in a depth buffer, faces in front counted; for comparison.
///
/// Of edges that share a pixel only the nearest is found. No points, no volume.
pub const SINEW_IMAGE_FORM_COUNTED: u32 = 1;

/// Value of `triangle` if there is none.
pub const SINEW_NO_TRIANGLE: u32 = u32::MAX;

/// Bodies and method of a detector.
///
/// Filled by sinew_detector_def_init; read only during sinew_detector_create.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_detector_def {
    /// Size of this struct; sinew_detector_def_init sets it.
    pub struct_size: usize,
    /// First and second body with surfaces, one of them at least closed.
    pub bodies: [sinew_body_id; 2],
    /// SINEW_DETECTION_EXACT (default), where only `bodies` count, or IMAGE_SPACE.
    ///
    /// thickness must be 0 with EXACT. SINEW_DETECTION_DISTANCE_FIELD is SINEW_STATUS_UNSUPPORTED.
    pub detection: u32,
    /// IMAGE_SPACE: a sinew_image_form value; default INTERVALS.
    pub form: u32,
    /// [m] IMAGE_SPACE: pixel size, above 0. 1/256 of the body finds 99.9 % of edges.
    pub pixel: f32,
    /// IMAGE_SPACE: view direction of any length; 0 0 0 (default): the three axes.
    ///
    /// Depths along the view exceed the shortest distance by about 2 % of the size with three axes, by 6 % with one.
    pub direction: [f32; 3],
    /// IMAGE_SPACE: pixels of an image, 1 to 2^24; default 2^18. Too few become larger.
    pub pixels: u32,
    /// INTERVALS: capacity of ray-face crossings per body and image, at least 1; default 2^20.
    ///
    /// If it is too small, the pixel size doubles. The default capacities take about 18 MB.
    pub crossings: u32,
    /// [m] IMAGE_SPACE: thickness added along the view, so that thin parts are found.
    pub thickness: [f32; 2],
}

/// Overlap that a detector found; index 0 is the first body, 1 the second.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_detector_report {
    /// Set to sizeof(sinew_detector_report) before the call.
    pub struct_size: usize,
    /// [m^3] INTERVALS: overlap volume, mean over the views; 0 with an open body.
    pub volume: f64,
    /// Unit direction that moves the first body out fastest; 0 without volume.
    pub normal: [f32; 3],
    /// [m] Linear estimate of the distance to move it.
    pub depth: f32,
    /// [m] Largest pixel size used; 0 with EXACT.
    pub pixel: f32,
    /// Number of entries of sinew_detector_get_points.
    pub point_counts: [u32; 2],
    /// Number of entries of sinew_detector_get_edges.
    pub edge_counts: [u32; 2],
    /// Number of edge parts beyond four per edge on average.
    pub unlisted: [u32; 2],
    /// 1: closed; 0: open, and nothing is found inside; not checked again.
    pub is_closed: [u32; 2],
}

/// Node of a body that lies inside the other body.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_point_inside {
    /// Index of the node.
    pub node: u32,
    /// IMAGE_SPACE: triangle to leave through; EXACT: SINEW_NO_TRIANGLE.
    pub triangle: u32,
    /// [m] IMAGE_SPACE: shortest distance out along the views; EXACT: to the surface.
    pub depth: f32,
    /// EXACT: unit direction of the shortest distance out; IMAGE_SPACE: 0.
    pub normal: [f32; 3],
}

/// Part of an edge of a body that lies inside the other body.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_edge_inside {
    /// First and second node of the edge.
    pub nodes: [u32; 2],
    /// Fraction of the edge where it enters; 0 if it starts inside.
    pub entry: f32,
    /// Fraction of the edge where it leaves; 1 if it ends inside.
    pub exit: f32,
    /// [m] IMAGE_SPACE: largest distance out along the view, the least over the views; EXACT: 0.
    ///
    /// COUNTED: the distance from the edge to the next face.
    pub depth: f32,
}

/// Borrowed array of vectors of 3 doubles; vector i starts at (const char *)data + i * stride.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_dvec3_view {
    /// First vector.
    pub data: *const f64,
    /// Number of vectors.
    pub count: usize,
    /// [bytes] Distance from one vector to the next.
    pub stride: usize,
}

versioned! { sinew_detector_def, sinew_detector_report }

/// Detector of the overlap of two bodies; it applies no forces and may outlive its world.
///
/// Any number of threads may use it where it is const, else one alone.
pub struct sinew_detector {
    sides: [DetectorSide; 2],
    method: Method,
    found: Overlaps,
}

impl sinew_detector_def {
    fn defaults() -> Self {
        let image = ImageSpaceDefinition::new(0.0);
        Self {
            detection: SINEW_DETECTION_EXACT,
            form: SINEW_IMAGE_FORM_INTERVALS,
            pixel: image.pixel,
            pixels: image.pixels,
            crossings: image.crossings,
            ..Self::empty()
        }
    }

    fn image(&self) -> Result<ImageSpaceDefinition> {
        let direction = Vec3::from_array(self.direction);
        finite_vector("direction", direction)?;
        Ok(ImageSpaceDefinition {
            pixel: self.pixel,
            views: if direction == Vec3::ZERO {
                Views::Axes
            } else {
                Views::Along(direction)
            },
            form: match self.form {
                SINEW_IMAGE_FORM_INTERVALS => Form::Intervals,
                SINEW_IMAGE_FORM_COUNTED => Form::Counted,
                unknown => return Err(Error::invalid(format!("form is {unknown}: no SINEW_IMAGE_FORM_..."))),
            },
            pixels: self.pixels,
            crossings: self.crossings,
        })
    }

    fn detector(&self, world: &World) -> Result<sinew_detector> {
        let method = detection("detection", self.detection)?;
        ensure!(
            method != Detection::DistanceField,
            Error::Unsupported(
                "detection is SINEW_DETECTION_DISTANCE_FIELD: that is for rigid tools, not for bodies".into(),
            )
        );
        let image = self.image()?;
        let [a, b] = self.bodies.map(sinew_body_id::id);
        ensure!(
            a != b,
            "bodies are one and the same: a body is not compared with itself"
        );
        let bodies = [world.body(a)?, world.body(b)?];
        let sides = [self.side(0, bodies[0])?, self.side(1, bodies[1])?];
        ensure!(
            sides.iter().any(|side| side.was_closed),
            "bodies: both are open, or were cut open: one at least must be closed, so that the other can be inside of it"
        );
        let has_volume = method == Detection::ImageSpace
            && image.form == Form::Intervals
            && sides.iter().all(|side| side.was_closed);
        let method = if method == Detection::ImageSpace {
            let surfaces = [&sides[0].surface, &sides[1].surface];
            Method::ImageSpace(crate::base::memory::boxed(ImageSpace::new(&image, &surfaces)?)?)
        } else {
            let solids = [
                Self::solid(0, &sides[0], bodies[0])?,
                Self::solid(1, &sides[1], bodies[1])?,
            ];
            let mut overlaps = <[exact::Overlap; 2]>::default();
            for (overlap, side) in overlaps.iter_mut().zip(&sides) {
                overlap.points = reserved(side.surface.node_count())?;
                overlap.edges = reserved(side.surface.edges().len())?;
            }
            Method::Exact(solids, overlaps)
        };
        let found = Overlaps::reserved(&sides, &method, has_volume)?;
        Ok(sinew_detector { sides, method, found })
    }

    fn side(&self, side: usize, body: &Body) -> Result<DetectorSide> {
        let thickness = self.thickness[side];
        ensure!(
            thickness >= 0.0 && thickness.is_finite(),
            "thickness of body {side} is {thickness} m: must be finite and at least 0"
        );
        ensure!(
            thickness == 0.0 || self.detection != SINEW_DETECTION_EXACT,
            "thickness of body {side} is {thickness} m while detection is SINEW_DETECTION_EXACT: must be 0"
        );
        let (node_count, triangles) = (body.node_count(), body.surface());
        let was_closed = mesh::is_closed(triangles)? && !body.system().is_cut_open;
        let surface = if was_closed {
            Surface::closed(node_count, triangles)
        } else {
            Surface::open(node_count, triangles)
        };
        Ok(DetectorSide {
            body: self.bodies[side],
            surface: surface.map_err(|error| of_body(side, error))?,
            was_closed,
            thickness,
        })
    }

    /// What a closed body encloses.
    fn solid(number: usize, side: &DetectorSide, body: &Body) -> Result<Option<Box<Exact>>> {
        if !side.was_closed {
            return Ok(None);
        }
        let surface = ClosedSurface::new(body.positions(), body.surface()).map_err(|error| of_body(number, error))?;
        ensure!(
            surface.triangles() == body.surface(),
            "bodies: body {number} has nodes at the same place or a triangle along a line, which SINEW_DETECTION_EXACT cannot follow \
                 as they move; SINEW_DETECTION_IMAGE_SPACE can"
        );
        Ok(Some(crate::base::memory::boxed(Exact::changing(&surface)?)?))
    }
}

impl sinew_detector {
    fn find(&mut self, world: &World) -> Result<()> {
        let Self { sides, method, found } = self;
        let bodies = [sides[0].body(0, world)?, sides[1].body(1, world)?];
        let closed = [0, 1].map(|side| sides[side].was_closed && !bodies[side].system().is_cut_open);
        for (side, closed) in sides.iter_mut().zip(closed) {
            side.surface.closed = closed;
        }
        let surfaces = [&sides[0].surface, &sides[1].surface];
        let positions = bodies.map(Body::positions);
        match method {
            _ if closed == [false; 2] => found.clear(),
            Method::ImageSpace(image) => {
                let placed = [0, 1].map(|side| Placed {
                    surface: surfaces[side],
                    positions: positions[side],
                    thickness: sides[side].thickness,
                });
                found.take_image(image.detect(&placed)?, surfaces)?;
            }
            Method::Exact(solids, overlaps) => {
                for (side, overlap) in overlaps.iter_mut().enumerate() {
                    overlap.points.clear();
                    overlap.edges.clear();
                    if let (Some(solid), true) = (&mut solids[1 - side], closed[1 - side]) {
                        solid.refit(positions[1 - side])?;
                        solid.find(positions[side], surfaces[side].edges(), overlap)?;
                    }
                }
                found.take_exact(overlaps, surfaces)?;
            }
        }
        found.report.is_closed = closed.map(u32::from);
        Ok(())
    }
}

/// Fills a detector definition with its defaults; `struct_size` is sizeof(sinew_detector_def).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_detector_def_init(def: *mut sinew_detector_def, struct_size: usize) -> sinew_status {
    guard(|| memory::initialise(def, struct_size, sinew_detector_def::defaults()))
}

/// Creates a detector for two bodies and allocates its memory, without a first search.
///
/// Destroy it with sinew_detector_destroy.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT if the bodies are the same, one has no surface, or both are open; with EXACT
/// also if a closed surface is inverted, self-intersecting or degenerate.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_detector_create(
    world: *const sinew_world,
    def: *const sinew_detector_def,
    out: *mut *mut sinew_detector,
) -> sinew_status {
    with_world(world, |world| {
        let out = memory::output("out", out)?;
        let def = memory::definition("def", def, sinew_detector_def::defaults())?;
        *out = Box::into_raw(crate::base::memory::boxed(def.detector(world)?)?);
        Ok(())
    })
}

/// Finds the overlap of the two bodies at their current positions.
///
/// You may pass a world loaded from a snapshot if both ids refer there to bodies with identical surfaces. An open body
/// reports only edges (EXACT: also points). Image space does not allocate.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT if a body was destroyed or has another surface; SINEW_STATUS_CAPACITY if one
/// ray has more than `crossings`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_detector_find(
    detector: *mut sinew_detector,
    world: *const sinew_world,
    out_report: *mut sinew_detector_report,
) -> sinew_status {
    with_world(world, |world| {
        let detector = memory::output("detector", detector)?;
        let out_report = memory::report("out_report", out_report)?;
        detector.find(world)?;
        out_report.fill(detector.found.report);
        Ok(())
    })
}

/// Writes the list of nodes of one body that lie inside the other, in ascending order.
///
/// `side` 0 is the first body, 1 the second. It is empty before the first search and with COUNTED. Lifetime: until the
/// next sinew_detector_find, or the detector's destruction.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_detector_get_points(
    detector: *const sinew_detector,
    side: u32,
    out_points: *mut *const sinew_point_inside,
    out_count: *mut usize,
) -> sinew_status {
    guard(|| {
        let detector = memory::reference("detector", detector)?;
        let found = &detector.found.points[index_of(side)?];
        memory::write_both(
            ("out_points", out_points, found.as_ptr()),
            ("out_count", out_count, found.len()),
        )
    })
}

/// Writes the list of surface edge parts of one body that lie inside the other, by edge.
///
/// `side` and lifetime are as for sinew_detector_get_points. It is empty before the first search.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_detector_get_edges(
    detector: *const sinew_detector,
    side: u32,
    out_edges: *mut *const sinew_edge_inside,
    out_count: *mut usize,
) -> sinew_status {
    guard(|| {
        let detector = memory::reference("detector", detector)?;
        let found = &detector.found.edges[index_of(side)?];
        memory::write_both(
            ("out_edges", out_edges, found.as_ptr()),
            ("out_count", out_count, found.len()),
        )
    })
}

/// Writes a view of the gradient [m^2] of the overlap volume at each node of one body.
///
/// Moving the nodes against it separates the bodies. It is empty with COUNTED, EXACT or an open body. `side` and
/// lifetime are as for sinew_detector_get_points.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_detector_get_gradient(
    detector: *const sinew_detector,
    side: u32,
    out: *mut sinew_dvec3_view,
) -> sinew_status {
    guard(|| {
        let detector = memory::reference("detector", detector)?;
        let gradient = &detector.found.gradients[index_of(side)?];
        memory::write(
            "out",
            out,
            sinew_dvec3_view {
                data: gradient.as_ptr().cast(),
                count: gradient.len(),
                stride: size_of::<DVec3>(),
            },
        )
    })
}

/// Destroys a detector and ends its lists and views; NULL has no effect.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_detector_destroy(detector: *mut sinew_detector) {
    destroy(detector);
}

fn index_of(side: u32) -> Result<usize> {
    ensure!(side < 2, "side is {side}: must be 0 or 1");
    Ok(side as usize)
}
