//! The contents of an image.

use super::camera::Camera;
use super::scale::Coloured;
use crate::Result;
use glam::Vec3;

/// The appearance of an object.
///
/// ```
/// use sinew::raster::Look;
/// let green = Look::TISSUE.coloured([0.2, 0.6, 0.3]);
/// assert_eq!((green.colour, green.gloss), ([0.2, 0.6, 0.3], Look::TISSUE.gloss));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// The color in sRGB, 0 to 1.
    pub colour: [f32; 3],
    /// The gloss, from 0 for dull to 1 for wet.
    pub gloss: f32,
    /// True if both sides are outsides, as for a cloth. Otherwise the side away from the normals is drawn darker, like
    /// the inside of something cut open.
    pub two_sided: bool,
    /// The strength of the mesh edges, from 0 for invisible to 1.
    pub mesh_edges: f32,
    /// The visibility through objects in front, from 0 for none to 1. It is highest at the silhouette.
    pub show_through: f32,
}

impl Look {
    /// The common properties of the looks below.
    const MATT: Look = Look {
        colour: [0.0; 3],
        gloss: 0.0,
        two_sided: false,
        mesh_edges: 0.0,
        show_through: 0.0,
    };

    /// The wet, dark red of a liver.
    pub const TISSUE: Look = Look {
        colour: [0.62, 0.24, 0.20],
        gloss: 0.75,
        ..Look::MATT
    };

    /// Liver tissue exposed by a cut.
    pub const INSIDE: Look = Look {
        colour: [0.46, 0.10, 0.11],
        gloss: 0.5,
        ..Look::MATT
    };

    /// A light membrane with equal sides and a faint mesh.
    pub const CLOTH: Look = Look {
        colour: [0.80, 0.58, 0.52],
        gloss: 0.3,
        two_sided: true,
        mesh_edges: 0.3,
        ..Look::MATT
    };

    /// An instrument, visible through tissue.
    pub const INSTRUMENT: Look = Look {
        colour: [0.50, 0.57, 0.64],
        gloss: 0.9,
        show_through: 0.8,
        ..Look::MATT
    };

    /// A contact and its force.
    pub const CONTACT: Look = Look {
        colour: [0.95, 0.80, 0.10],
        show_through: 0.9,
        ..Look::MATT
    };

    /// A ground plane.
    pub const GROUND: Look = Look {
        colour: [0.85, 0.86, 0.88],
        ..Look::MATT
    };

    /// An object colored by values. It is dull, so that lighting changes its colors little.
    pub const CHART: Look = Look {
        colour: [0.8, 0.8, 0.8],
        gloss: 0.15,
        two_sided: true,
        ..Look::MATT
    };

    /// The springs of a body without a surface.
    pub const SPRINGS: Look = Look {
        colour: [0.70, 0.33, 0.27],
        gloss: 0.2,
        two_sided: true,
        ..Look::MATT
    };

    /// The same look in another color (sRGB, 0 to 1).
    pub const fn coloured(self, colour: [f32; 3]) -> Look {
        Look { colour, ..self }
    }
}

/// A surface of triangles.
///
/// ```
/// # use glam::Vec3;
/// use sinew::mesh::Mesh;
/// use sinew::raster::{Look, Scene, Surface};
/// let Mesh { positions, triangles, .. } = &Mesh::cloth([0.1, 0.1], [4, 4])?;
/// let surface = Surface { positions, triangles, look: Look::CLOTH, coloured: None };
/// let scene = Scene { surfaces: vec![surface], ..Scene::default() };
/// let camera = scene.camera(Vec3::Y, Vec3::NEG_Z, 0.6, 1.0)?;
/// let middle = scene.draw(&camera, 32, 32)?.pixels[16 * 32 + 16];
/// assert_ne!(middle, Scene::default().draw(&camera, 32, 32)?.pixels[16 * 32 + 16]);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Surface<'a> {
    /// The positions of the points, m.
    pub positions: &'a [Vec3],
    /// Three indices for each triangle, outward by the right-hand rule.
    pub triangles: &'a [[u32; 3]],
    /// The appearance.
    pub look: Look,
    /// The values that color the surface; `None` for the look's color.
    pub coloured: Option<Coloured<'a>>,
}

/// Straight lines between points, such as springs.
///
/// ```
/// # use glam::Vec3;
/// # use sinew::mesh::Mesh;
/// # use sinew::raster::{Lines, Look, Scene};
/// # let mesh = Mesh::cloth([0.1, 0.1], [4, 4])?;
/// # let (positions, pairs) = (&mesh.positions[..], &mesh.edges()?[..]);
/// let mut scene = Scene::default();
/// scene.lines.push(Lines { positions, pairs, thickness: 3.0, look: Look::SPRINGS, coloured: None });
/// let camera = scene.camera(Vec3::Y, Vec3::NEG_Z, 0.6, 1.0)?;
/// assert_ne!(scene.draw(&camera, 32, 32)?, Scene::default().draw(&camera, 32, 32)?);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Lines<'a> {
    /// The positions of the points, m.
    pub positions: &'a [Vec3],
    /// Two indices for each line.
    pub pairs: &'a [[u32; 2]],
    /// The thickness in the image, in thousandths of its height.
    pub thickness: f32,
    /// The appearance.
    pub look: Look,
    /// The values that color the lines; `None` for the look's color.
    pub coloured: Option<Coloured<'a>>,
}

/// A geometric shape, for an instrument or the environment, in world coordinates.
///
/// ```
/// # use glam::Vec3;
/// # use sinew::raster::{Look, Scene, Shape};
/// let mut scene = Scene::default();
/// scene.shapes.push((Shape::Capsule { start: Vec3::ZERO, end: 0.1 * Vec3::Y, radius: 0.01 }, Look::INSTRUMENT));
/// let camera = scene.camera(Vec3::Z, Vec3::Y, 0.6, 1.0)?;
/// assert_ne!(scene.draw(&camera, 32, 32)?, Scene::default().draw(&camera, 32, 32)?);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// A sphere.
    Sphere {
        /// The center, m.
        centre: Vec3,
        /// The radius, m.
        radius: f32,
    },
    /// All points within `radius` of a segment.
    Capsule {
        /// One end of the segment, m.
        start: Vec3,
        /// The other end, m.
        end: Vec3,
        /// The radius, m.
        radius: f32,
    },
    /// The boundary of a half-space, drawn as a faint checkerboard that fades out around the scene. It is invisible
    /// from behind.
    Plane {
        /// A point of the plane, m.
        point: Vec3,
        /// The normal toward the free side, of any length.
        normal: Vec3,
    },
}

/// The contents of an image. It borrows the bodies' arrays.
///
/// ```
/// use glam::Vec3;
/// use sinew::raster::{Look, Scene, Shape, Surface};
///
/// let positions = [Vec3::ZERO, Vec3::X, Vec3::NEG_Z];
/// let mut scene = Scene::default();
/// scene.surfaces.push(Surface { positions: &positions, triangles: &[[0, 1, 2]], look: Look::CLOTH, coloured: None });
/// let ball = Shape::Sphere { centre: Vec3::new(0.3, 0.2, -0.3), radius: 0.2 };
/// scene.shapes.push((ball, Look::INSTRUMENT));
/// let camera = scene.camera(Vec3::new(1.0, 0.6, 1.4), Vec3::Y, 0.6, 4.0 / 3.0)?;
/// let image = scene.draw(&camera, 320, 240)?;
/// assert_eq!(image.pixels.len(), 320 * 240);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct Scene<'a> {
    /// Bodies with triangles, and instruments that are meshes.
    pub surfaces: Vec<Surface<'a>>,
    /// Bodies without triangles.
    pub lines: Vec<Lines<'a>>,
    /// Instruments and environment.
    pub shapes: Vec<(Shape, Look)>,
}

impl Scene<'_> {
    /// A camera with the bodies in the frame, and the parts of instruments near them.
    ///
    /// The arguments are those of [`Camera::fitted`]. The bodies' bounding box, extended by a quarter of its diagonal,
    /// limits the parts of instruments that count. So a long shaft leaves the frame and does not make the tissue
    /// small.
    ///
    /// # Errors
    /// Those of [`Camera::fitted`].
    pub fn camera(&self, direction: Vec3, up: Vec3, field_of_view: f32, aspect: f32) -> Result<Camera> {
        let (low, high) = bounds(self.body_points());
        let margin = Vec3::splat((high - low).length() / 4.0);
        let has_no_bodies = low.x > high.x;
        let is_near_bodies =
            |point: &Vec3| has_no_bodies || (point.cmpge(low - margin).all() && point.cmple(high + margin).all());
        let instruments = self
            .shapes
            .iter()
            .flat_map(|(shape, _)| shape.outline())
            .filter(is_near_bodies);
        let points = self.body_points().chain(instruments);
        Camera::fitted(points, direction, up, field_of_view, aspect)
    }

    /// The bounding box of the bodies, or of the instruments if there are no bodies.
    pub(crate) fn extent(&self) -> Option<(Vec3, Vec3)> {
        let instruments = self.shapes.iter().flat_map(|(shape, _)| shape.outline());
        let finite = instruments.filter(|point| point.is_finite());
        [bounds(self.body_points()), bounds(finite)]
            .into_iter()
            .find(|(low, high)| low.x <= high.x)
    }

    /// The finite points of surfaces and lines.
    pub(crate) fn body_points(&self) -> impl Iterator<Item = Vec3> {
        let surfaces = self.surfaces.iter().map(|surface| surface.positions);
        let lines = self.lines.iter().map(|lines| lines.positions);
        surfaces
            .chain(lines)
            .flatten()
            .copied()
            .filter(|point| point.is_finite())
    }
}

impl Shape {
    /// Points on its surface, enough to frame it; none for a plane.
    pub(crate) fn outline(&self) -> Vec<Vec3> {
        let (start, end, radius) = match *self {
            Shape::Sphere { centre, radius } => (centre, centre, radius),
            Shape::Capsule { start, end, radius } => (start, end, radius),
            Shape::Plane { .. } => return Vec::new(),
        };
        // Points along the segment too: the part near the bodies counts even if the ends are far away.
        const STOPS: u8 = 16;
        let directions = super::tessellate::directions();
        let stops = if start == end { 0 } else { STOPS };
        (0..=stops)
            .map(|stop| start.lerp(end, f32::from(stop) / f32::from(STOPS)))
            .flat_map(|centre| directions.map(|direction| centre + radius * direction))
            .collect()
    }
}

/// The bounding box of points. Without points, the lower corner is above the upper one.
pub(crate) fn bounds(points: impl Iterator<Item = Vec3>) -> (Vec3, Vec3) {
    points.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), point| {
        (low.min(point), high.max(point))
    })
}
