//! What two bodies have in common: to know it, not to part them.

use glam::{DVec3, Vec3};

use super::body::sinew_body_id;
use super::guard::{guard, sinew_world, with_world};
use super::memory::{self, Versioned};
use super::status::sinew_status;
use super::tool::{SINEW_DETECTION_EXACT, detection};
use crate::base::memory::reserved;
use crate::base::{Error, Result};
use crate::body::Body;
use crate::def::{Detection, finite_vector};
use crate::detection::exact::{self, Exact};
use crate::detection::image_space::{self, Form, ImageSpace, ImageSpaceDefinition, Placed, Surface, Views};
use crate::mesh::{self, ClosedSurface};
use crate::world::World;

/// By the intervals in which the ray of each pixel is inside a body: no edge is lost, and no point that is deeper than 0.71 pixels.
pub const SINEW_IMAGE_FORM_INTERVALS: u32 = 0;
/// As its authors describe it (CInDeR; Halic et al., section 2.1): edges are drawn into a depth buffer, faces in front of them counted.
/// Of edges that share a pixel only the nearest is seen, edges shorter than a pixel or along the view are not drawn; no points, no
/// volume. For comparison.
pub const SINEW_IMAGE_FORM_COUNTED: u32 = 1;

/// In `triangle`: none is named.
pub const SINEW_NO_TRIANGLE: u32 = u32::MAX;

/// Which two bodies are compared, and how. Filled by sinew_detector_def_init; used only during sinew_detector_create.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_detector_def {
    /// Set by sinew_detector_def_init.
    pub struct_size: usize,
    /// The first and the second; no default. Both have triangles, tetrahedra or cells, and one at least has a closed surface.
    pub bodies: [sinew_body_id; 2],
    /// SINEW_DETECTION_EXACT, the default: trees of triangles, refitted (the rest, but `bodies`, is not used then, and `thickness` 0); or
    /// SINEW_DETECTION_IMAGE_SPACE: rays through the pixels of a parallel view. SINEW_DETECTION_DISTANCE_FIELD is for rigid
    /// tools: SINEW_STATUS_UNSUPPORTED.
    pub detection: u32,
    /// SINEW_IMAGE_FORM_...; default SINEW_IMAGE_FORM_INTERVALS.
    pub form: u32,
    /// IMAGE_SPACE: m, the side of a pixel, above 0; no default. A 256th of a body's size finds all but a thousandth of its edges.
    pub pixel: f32,
    /// IMAGE_SPACE: along which to look, of any length; 0 0 0, the default: along the three axes, one after the other, and what any of them
    /// sees counts. Depths are along the view: along three axes some 2 % of the size more than the shortest way out, along one 6 %.
    pub direction: [f32; 3],
    /// IMAGE_SPACE: room for so many pixels in an image, 1 to 2^24; default 2^18. A pair whose boxes overlap so far that it is not enough is
    /// drawn with pixels of twice the size, and so on.
    pub pixels: u32,
    /// INTERVALS: room for so many crossings of rays with faces in an image of one body, at least 1; likewise; default 2^20. Both
    /// defaults take some 18 MB.
    pub crossings: u32,
    /// IMAGE_SPACE: m, at least 0; default 0 0: how much further along the view than its faces each of the two counts as there, so that
    /// thin parts are not missed; depths, and the volume that a view sees, are those of bodies that are so much thicker.
    pub thickness: [f32; 2],
}

/// What a detector found, but for lists. Index 0 is of the first body, 1 of the second.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_detector_report {
    /// Set by the caller.
    pub struct_size: usize,
    /// INTERVALS: what both enclose, m^3, the mean over the views (Faure et al. 2008); 0 where one of them is open, and with COUNTED and
    /// EXACT.
    pub volume: f64,
    /// The direction of unit length in which the first has to be moved so that the volume shrinks fastest; 0 where there is no volume.
    pub normal: [f32; 3],
    /// How far it has to be moved, were the volume to shrink so all the way, m.
    pub depth: f32,
    /// The largest pixel used, m: that asked for, or twice that and so on where there was not enough room; EXACT: 0.
    pub pixel: f32,
    /// Entries of sinew_detector_get_points.
    pub point_counts: [u32; 2],
    /// Entries of sinew_detector_get_edges.
    pub edge_counts: [u32; 2],
    /// Parts of edges inside that there was no room for: more than four an edge, on average.
    pub unlisted: [u32; 2],
    /// 1: the body is closed, so that the other can be inside of it; 0: it is open, or was cut open: nothing is found within it, and in image
    /// space of itself edges alone. As sinew_body_is_closed, but that a detector made for an open body does not ask again.
    pub closed: [u32; 2],
    /// 0.
    pub reserved: u32,
}

/// A node of a body that lies within the other.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_point_inside {
    /// The node.
    pub node: u32,
    /// IMAGE_SPACE: the triangle of the other's surface at the end of the way out; EXACT: SINEW_NO_TRIANGLE.
    pub triangle: u32,
    /// m: IMAGE_SPACE: the way out along the view, the shortest of those of several views; EXACT: how far the other's surface is.
    pub depth: f32,
    /// EXACT: the shortest way out, of unit length; IMAGE_SPACE: 0.
    pub normal: [f32; 3],
}

/// A part of an edge of a body that lies within the other.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_edge_inside {
    /// From the first to the second.
    pub nodes: [u32; 2],
    /// Where it goes in, as a fraction of the edge; 0 where it begins inside.
    pub entry: f32,
    /// Where it comes out; 1 where it ends inside.
    pub exit: f32,
    /// IMAGE_SPACE: the longest of the ways out along the view, m, of several views the one that sees the least; COUNTED: from the edge to
    /// the next face; EXACT: 0.
    pub depth: f32,
}

/// Vector i is at (const char *)data + i * stride; valid as long as what gave it says.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_dvec3_view {
    /// The first.
    pub data: *const f64,
    /// How many.
    pub count: usize,
    /// Bytes from one to the next.
    pub stride: usize,
}

// SAFETY: repr(C), begins with struct_size, numbers alone.
unsafe impl Versioned for sinew_detector_def {
    const SIZES: &'static [usize] = &[size_of::<Self>()];
    const NAME: &'static str = "sinew_detector_def";
}

// SAFETY: repr(C), begins with struct_size, numbers alone.
unsafe impl Versioned for sinew_detector_report {
    const SIZES: &'static [usize] = &[size_of::<Self>()];
    const NAME: &'static str = "sinew_detector_report";
}

/// Finds what two bodies have in common, in memory of its own. It belongs to the caller; it changes no world, and may outlive it.
///
/// As `const sinew_detector *` it may be used by any number of threads at once; as `sinew_detector *` by one, with nobody else inside.
pub struct sinew_detector {
    sides: [Side; 2],
    method: Method,
    found: Found,
}

/// One of the two bodies.
struct Side {
    body: sinew_body_id,
    surface: Surface,
    /// When the detector was made.
    was_closed: bool,
    thickness: f32,
}

enum Method {
    ImageSpace(Box<ImageSpace>),
    /// What each closed body encloses, and what of the other lies within it.
    Exact([Option<Box<Exact>>; 2], [exact::Overlap; 2]),
}

/// What the last detection found; as it was where one fails.
struct Found {
    /// Whether volumes are measured.
    has_volume: bool,
    report: sinew_detector_report,
    points: [Vec<sinew_point_inside>; 2],
    edges: [Vec<sinew_edge_inside>; 2],
    gradients: [Vec<DVec3>; 2],
}

const NOTHING: sinew_detector_report = sinew_detector_report {
    struct_size: size_of::<sinew_detector_report>(),
    volume: 0.0,
    normal: [0.0; 3],
    depth: 0.0,
    pixel: 0.0,
    point_counts: [0; 2],
    edge_counts: [0; 2],
    unlisted: [0; 2],
    closed: [0; 2],
    reserved: 0,
};

impl sinew_detector_def {
    fn defaults() -> Self {
        let image = ImageSpaceDefinition::new(0.0);
        Self {
            struct_size: size_of::<Self>(),
            bodies: [sinew_body_id {
                index1: 0,
                generation: 0,
            }; 2],
            detection: SINEW_DETECTION_EXACT,
            form: SINEW_IMAGE_FORM_INTERVALS,
            pixel: image.pixel,
            direction: [0.0; 3],
            pixels: image.pixels,
            crossings: image.crossings,
            thickness: [0.0; 2],
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
        if method == Detection::DistanceField {
            return Err(Error::Unsupported(
                "detection is SINEW_DETECTION_DISTANCE_FIELD: that is for rigid tools, not for bodies".into(),
            ));
        }
        let image = self.image()?;
        let [a, b] = self.bodies.map(sinew_body_id::id);
        if a == b {
            return Err(Error::invalid(
                "bodies are one and the same: a body is not compared with itself",
            ));
        }
        let bodies = [world.body(a)?, world.body(b)?];
        let sides = [self.side(0, bodies[0])?, self.side(1, bodies[1])?];
        if !sides.iter().any(|side| side.was_closed) {
            return Err(Error::invalid(
                "bodies: both are open, or were cut open: one at least must be closed, so that the other can be inside of it",
            ));
        }
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
        let found = Found::reserved(&sides, &method, has_volume)?;
        Ok(sinew_detector { sides, method, found })
    }

    fn side(&self, side: usize, body: &Body) -> Result<Side> {
        let thickness = self.thickness[side];
        if !(thickness >= 0.0 && thickness.is_finite()) {
            return Err(Error::invalid(format!(
                "thickness of body {side} is {thickness} m: must be finite and at least 0"
            )));
        }
        if thickness != 0.0 && self.detection == SINEW_DETECTION_EXACT {
            return Err(Error::invalid(format!(
                "thickness of body {side} is {thickness} m while detection is SINEW_DETECTION_EXACT: must be 0"
            )));
        }
        let (node_count, triangles) = (body.node_count(), body.surface());
        let was_closed = mesh::is_closed(triangles)? && !body.is_cut_open;
        let surface = if was_closed {
            Surface::closed(node_count, triangles)
        } else {
            Surface::open(node_count, triangles)
        };
        Ok(Side {
            body: self.bodies[side],
            surface: surface.map_err(|error| of_body(side, error))?,
            was_closed,
            thickness,
        })
    }

    /// What a closed body encloses.
    fn solid(number: usize, side: &Side, body: &Body) -> Result<Option<Box<Exact>>> {
        if !side.was_closed {
            return Ok(None);
        }
        let surface = ClosedSurface::new(body.positions(), body.surface()).map_err(|error| of_body(number, error))?;
        if surface.triangles() != body.surface() {
            return Err(Error::invalid(format!(
                "bodies: body {number} has nodes at the same place or a triangle along a line, which SINEW_DETECTION_EXACT cannot follow \
                 as they move; SINEW_DETECTION_IMAGE_SPACE can"
            )));
        }
        Ok(Some(crate::base::memory::boxed(Exact::changing(&surface)?)?))
    }
}

/// Says which of the two bodies is meant.
fn of_body(side: usize, error: Error) -> Error {
    match error {
        Error::InvalidArgument(why) => Error::InvalidArgument(format!("bodies: body {side}: {why}")),
        Error::Unsupported(why) => Error::Unsupported(format!("bodies: body {side}: {why}")),
        error => error,
    }
}

impl Side {
    /// The body, where it is still what the detector was made for.
    fn body<'a>(&self, number: usize, world: &'a World) -> Result<&'a Body> {
        let sinew_body_id { index1, generation } = self.body;
        let Ok(body) = world.body(self.body.id()) else {
            return Err(Error::invalid(format!(
                "world: body {number} of the detector, of index1 {index1} and generation {generation}, is not there: it was destroyed, or \
                 this is another world"
            )));
        };
        if body.node_count() != self.surface.node_count() || body.surface() != self.surface.triangles() {
            return Err(Error::invalid(format!(
                "world: body {number} of the detector, of index1 {index1} and generation {generation}, has another surface in this world, of \
                 {} nodes and {} triangles: the detector was made with another world, for {} and {}",
                body.node_count(),
                body.surface().len(),
                self.surface.node_count(),
                self.surface.triangles().len()
            )));
        }
        Ok(body)
    }
}

impl sinew_detector {
    fn find(&mut self, world: &World) -> Result<()> {
        let Self { sides, method, found } = self;
        let bodies = [sides[0].body(0, world)?, sides[1].body(1, world)?];
        let closed = [0, 1].map(|side| sides[side].was_closed && !bodies[side].is_cut_open);
        for (side, closed) in sides.iter_mut().zip(closed) {
            side.surface.set_closed(closed);
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
        found.report.closed = closed.map(u32::from);
        Ok(())
    }
}

impl Found {
    fn reserved(sides: &[Side; 2], method: &Method, has_volume: bool) -> Result<Self> {
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
            report: NOTHING,
            points: [reserved(node_counts[0])?, reserved(node_counts[1])?],
            edges: [reserved(edges)?, reserved(edges)?],
            gradients: [reserved(gradients[0])?, reserved(gradients[1])?],
        })
    }

    fn clear(&mut self) {
        self.report = NOTHING;
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

    fn take_image(&mut self, overlap: &image_space::Overlap, surfaces: [&Surface; 2]) -> Result<()> {
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

    fn take_exact(&mut self, overlaps: &[exact::Overlap; 2], surfaces: [&Surface; 2]) -> Result<()> {
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

/// Fills `def` with the defaults. `struct_size` is sizeof(sinew_detector_def).
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT.
///
/// # Safety
/// `def` is NULL or writable for `struct_size` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_detector_def_init(def: *mut sinew_detector_def, struct_size: usize) -> sinew_status {
    // SAFETY: the same contract.
    guard(|| unsafe { memory::initialise(def, struct_size, sinew_detector_def::defaults()) })
}

/// Makes a detector for two bodies of a world, whether or not they meet each other there, and reserves its memory; nothing is looked for
/// yet. The caller destroys it with sinew_detector_destroy.
///
/// The methods: Halic, Kockara, Bayrak, Rowe, Chen, section 2.1 (CInDeR), and Faure, Barbier, Allard, Falipou 2008 for volumes; EXACT: signed
/// distances by pseudonormals (Baerentzen, Aanaes 2005), from the closest of a tree of triangles.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT (also for one and the same body twice, a body without triangles, and two that are open or were cut
/// open; with EXACT for a closed one that is inside out, passes through itself, or has two nodes at the same place or a triangle along a line
/// where it is now), SINEW_STATUS_STALE_ID, SINEW_STATUS_UNSUPPORTED (SINEW_DETECTION_DISTANCE_FIELD), SINEW_STATUS_OUT_OF_MEMORY.
///
/// # Safety
/// `world` is NULL or a world nobody changes; `def` is NULL or a definition of the size that it states; `out` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_detector_create(
    world: *const sinew_world,
    def: *const sinew_detector_def,
    out: *mut *mut sinew_detector,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_world(world, |world| {
            let out = memory::output("out", out)?;
            let def = memory::definition("def", def, sinew_detector_def::defaults())?;
            *out = Box::into_raw(crate::base::memory::boxed(def.detector(world)?)?);
            Ok(())
        })
    }
}

/// Compares the two bodies where they are now: each is looked for in the other, where that is closed. Writes what was found to `report`,
/// whose struct_size is set by the caller; the lists are read with sinew_detector_get_points, sinew_detector_get_edges and
/// sinew_detector_get_gradient. In image space it allocates nothing, and takes a time linear in polygons and in the pixels covered.
///
/// An open body gives edges alone in image space (and points with EXACT), and nothing is found within it. So it is with one that was cut open
/// since (sinew_body_is_closed): `report->closed` says so; where both were, nothing is found. Bodies are compared where they are: what passes
/// through a thin part between two calls is not seen. Whether a surface has come to pass through itself is not asked: EXACT is then not sure of
/// sides; in images a part that is inside out counts as outside.
///
/// A world in which the two ids are of bodies with the same surfaces is as good as the one that the detector was made with.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT (also where one of the bodies was destroyed, or has another surface, as in another world),
/// SINEW_STATUS_CAPACITY (a single ray passes more faces than `crossings`), SINEW_STATUS_OUT_OF_MEMORY (EXACT, which may allocate); then what
/// was found before stays.
///
/// # Safety
/// `detector` is NULL or a detector nobody else uses; `world` is NULL or a world nobody changes; `report` is NULL or writable for the size
/// that it states.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_detector_find(
    detector: *mut sinew_detector,
    world: *const sinew_world,
    report: *mut sinew_detector_report,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_world(world, |world| {
            let detector = memory::output("detector", detector)?;
            let report = memory::report("report", report)?;
            detector.find(world)?;
            report.fill(detector.found.report);
            Ok(())
        })
    }
}

/// Writes where the nodes of a body that lie within the other are listed, in ascending order, those within a tetrahedral body and those on
/// no triangle among them, and how many there are: of the first body with `side` 0, of the second with 1. Empty before the first
/// sinew_detector_find, and with COUNTED; valid until the next, or the detector's end.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT.
///
/// # Safety
/// `detector` is NULL or a detector nobody changes; `points` and `count` are NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_detector_get_points(
    detector: *const sinew_detector,
    side: u32,
    points: *mut *const sinew_point_inside,
    count: *mut usize,
) -> sinew_status {
    // SAFETY: the same contract.
    guard(|| unsafe {
        let detector = memory::reference("detector", detector)?;
        let found = &detector.found.points[index_of(side)?];
        let points = memory::output("points", points)?;
        *memory::output("count", count)? = found.len();
        *points = found.as_ptr();
        Ok(())
    })
}

/// Writes where the parts of a body's edges that lie within the other are listed, by edge and along it, and how many there are: of the first
/// body with `side` 0, of the second with 1. Edges are those of the surface's triangles. Empty before the first sinew_detector_find; valid
/// until the next, or the detector's end.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT.
///
/// # Safety
/// `detector` is NULL or a detector nobody changes; `edges` and `count` are NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_detector_get_edges(
    detector: *const sinew_detector,
    side: u32,
    edges: *mut *const sinew_edge_inside,
    count: *mut usize,
) -> sinew_status {
    // SAFETY: the same contract.
    guard(|| unsafe {
        let detector = memory::reference("detector", detector)?;
        let found = &detector.found.edges[index_of(side)?];
        let edges = memory::output("edges", edges)?;
        *memory::output("count", count)? = found.len();
        *edges = found.as_ptr();
        Ok(())
    })
}

/// Writes a view of how the volume changes with each node of a body, m^2, in the caller's order (Faure et al. 2008): of the first body with
/// `side` 0, of the second with 1. Moving nodes against it parts the bodies. Empty before the first sinew_detector_find, with COUNTED and EXACT,
/// and where one of the bodies is open: there is no volume then. Valid until the next sinew_detector_find, or the detector's end.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT.
///
/// # Safety
/// `detector` is NULL or a detector nobody changes; `out` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_detector_get_gradient(
    detector: *const sinew_detector,
    side: u32,
    out: *mut sinew_dvec3_view,
) -> sinew_status {
    // SAFETY: the same contract.
    guard(|| unsafe {
        let detector = memory::reference("detector", detector)?;
        let gradient = &detector.found.gradients[index_of(side)?];
        *memory::output("out", out)? = sinew_dvec3_view {
            data: gradient.as_ptr().cast(),
            count: gradient.len(),
            stride: size_of::<DVec3>(),
        };
        Ok(())
    })
}

/// Destroys a detector; what its lists and views show ends. NULL: nothing.
///
/// # Safety
/// `detector` is NULL or a detector that is not destroyed and that nobody uses any more.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_detector_destroy(detector: *mut sinew_detector) {
    if !detector.is_null() {
        guard(|| {
            // SAFETY: made by Box::into_raw in `sinew_detector_create`, and given back once.
            drop(unsafe { Box::from_raw(detector) });
            Ok(())
        });
    }
}

fn index_of(side: u32) -> Result<usize> {
    if side < 2 {
        return Ok(side as usize);
    }
    Err(Error::invalid(format!("side is {side}: must be 0 or 1")))
}
