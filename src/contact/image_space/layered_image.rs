//! A rigid solid as three layered depth images along its own axes, and how far a point is from it.

use glam::{DVec3, Vec3, Vec3A};

use super::covered::nearest_covered;
use super::layers::{Layers, RayCrossing};
use super::projection::{Frame, Projection};
use super::surface;
use crate::base::{Error, Result, above_zero, ensure, memory};
use crate::contact::distance::closest_on_triangle;
use crate::contact::exact::coarse::{CoarseField, Sample};
use crate::geometry::Bounds;
use crate::geometry::nearest::{nearest_on_triangle, weighted};
use crate::geometry::tree::{PlacedTriangle, Tree};
use crate::mesh;

/// How often a search goes on from the foot of the perpendicular on the face that it has found.
const STEPS: usize = 4;

/// A search keeps so many of the faces that it meets, the closest.
const MET: usize = 24;

/// How far a point can be from the ray in the middle of its pixel, in pixels.
const HALF_DIAGONAL: f32 = 0.7072;

/// Marks a pixel of whose neighbours some are passed by more faces or fewer: there a face that is closer may be seen beside it alone, as
/// those of a groove narrower than a pixel.
const BROKEN: u32 = 1 << 31;

/// Faces whose distance differs by less than this part of it are equally close: they meet where they are closest.
const EQUAL: f32 = 1e-4;

/// A closed solid drawn along its three axes, once: for each pixel all faces that the ray through its middle passes.
///
/// Distances come from the faces seen at a point's pixels, and at those around them where more or fewer are seen. They are exact where the
/// closest face is seen there, else wrong by no more than about a pixel near the surface; what no ray passes, a part thinner than a pixel
/// along two axes, is not seen at all.
///
/// ```
/// # use glam::Vec3;
/// # use sinew::mesh::Mesh;
/// # let mesh = Mesh::block([0.1, 0.1, 0.1], [2, 2, 2])?;
/// # let triangles = mesh.surface()?;
/// use sinew::detection::image_space::LayeredImage;
/// let image = LayeredImage::new(&mesh.positions, &triangles, 0.002)?;
/// let (distance, normal) = image.distance(0.052 * Vec3::Y, 0.01).expect("it is 2 mm away");
/// assert!((distance - 0.002).abs() < 1e-4 && normal.y > 0.99);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Debug)]
pub struct LayeredImage {
    triangles: Vec<PlacedTriangle>,
    images: [AxisImage; 3],
    /// What is far away is known from here.
    coarse: CoarseField,
    low: Vec3,
    high: Vec3,
    /// Metres.
    pixel: f32,
}

/// One of the three images.
#[derive(Debug)]
struct AxisImage {
    projection: Projection,
    layers: Layers,
    /// For each pixel the nearest that shows the solid, marked where that is broken.
    covered: Vec<u32>,
}

/// A face that a search has met, as the point sees it.
#[derive(Clone, Copy, Default)]
struct FoundFace {
    triangle: u32,
    squared_distance: f32,
    /// From the face's plane to the point.
    height: f32,
    normal: Vec3,
    /// From the point to the closest of the triangle.
    closest: Vec3,
    /// From there to the foot of the perpendicular on the plane; zero where that is within the triangle.
    beside: Vec3,
    /// From the point to the triangle's centre.
    centre: Vec3,
}

impl FoundFace {
    /// How far a neighbour's centre stands out of the plane: below 0 where they meet at a ridge.
    fn bend(&self, neighbour: &FoundFace) -> f32 {
        self.normal.dot(neighbour.centre - self.closest)
    }
}

/// The faces that a search has met.
struct Faces {
    met: [FoundFace; MET],
    count: usize,
    /// The closest; of several as close the one that the point is most in front of or behind, which tells the side.
    closest: usize,
}

impl Faces {
    fn add(&mut self, face: FoundFace) {
        let Some(place) = self.place_for(&face) else {
            return;
        };
        let known = &self.met[self.closest];
        let (least, most) = (1.0 - EQUAL, 1.0 + EQUAL);
        let closer = face.squared_distance < known.squared_distance * least;
        let as_close = face.squared_distance <= known.squared_distance * most;
        let is_closest = self.count == 0 || closer || as_close && face.height.abs() > known.height.abs();
        self.met[place] = face;
        self.count = self.count.max(place + 1);
        if is_closest {
            self.closest = place;
        }
    }

    /// A free place, or that of the face furthest away where this one is closer.
    fn place_for(&self, face: &FoundFace) -> Option<usize> {
        if self.count < MET {
            return Some(self.count);
        }
        let distance = |place: &usize| self.met[*place].squared_distance;
        let furthest = (0..MET)
            .filter(|place| *place != self.closest)
            .max_by(|a, b| distance(a).total_cmp(&distance(b)))?;
        (face.squared_distance < distance(&furthest)).then_some(furthest)
    }

    fn met(&self) -> &[FoundFace] {
        &self.met[..self.count]
    }

    fn closest(&self) -> Option<&FoundFace> {
        self.met().get(self.closest)
    }

    /// Where the point is beside the closest face, that face or its neighbours decide: what they have in common if they
    /// meet at a ridge, what either has if they meet in a valley.
    fn deciding(&self, pixel: f32) -> Option<&FoundFace> {
        let closest = self.closest()?;
        if closest.beside == Vec3::ZERO {
            return Some(closest);
        }
        let mut deciding = closest;
        for face in self.met() {
            let apart = face.closest - closest.closest;
            let near = apart.length_squared() <= pixel * pixel;
            let ridge = deciding.bend(face) <= 0.0;
            if near && (ridge == (face.height > deciding.height)) {
                deciding = face;
            }
        }
        Some(deciding)
    }
}

impl LayeredImage {
    /// Draws a closed surface whose triangles face outwards, `positions` in metres, in pixels of `pixel` metres.
    ///
    /// Errors: [`Error::InvalidArgument`] for a pixel that is not above 0 and finite or so small that an image would
    /// have more than 2^24 pixels, a position that is not finite, an index out of range, a surface that is not closed;
    /// [`Error::OutOfMemory`].
    pub fn new(positions: &[Vec3], triangles: &[[u32; 3]], pixel: f32) -> Result<Self> {
        above_zero("pixel", pixel)?;
        surface::check(positions.len(), triangles)?;
        surface::check_positions(positions)?;
        ensure!(mesh::is_closed(triangles)?, Error::invalid(surface::OPEN));
        let corners_of = |triangle: &[u32; 3]| triangle.map(|node| positions[node as usize]);
        let bounds = Bounds::of(triangles.iter().flat_map(corners_of));
        let (low, high) = (bounds.min, bounds.max);
        let drawn = memory::collected(
            triangles
                .iter()
                .map(|triangle| PlacedTriangle::new(corners_of(triangle))),
        )?;
        let image = |axis: usize| AxisImage::new(Frame::AXES[axis], positions, triangles, [low, high], pixel);
        let images = [image(0)?, image(1)?, image(2)?];
        let tree = Tree::new(triangles.len(), |triangle| drawn[triangle as usize].corners)?;
        let mut coarse = CoarseField::new(bounds, triangles.len(), |point, hint| {
            let (distance, place) = nearest_of(&tree, point, hint);
            let side = if shows_inside(&images, point) { -1.0 } else { 1.0 };
            (side * distance, place)
        })?;
        coarse.name_hints(|place| tree.triangle(place as usize));
        Ok(Self {
            images,
            coarse,
            triangles: drawn,
            low,
            high,
            pixel,
        })
    }

    /// The signed distance of a point from the surface in metres, below 0 inside, and the direction in which it grows, of
    /// unit length; `None` where the point is outside and further away than `within`.
    pub fn distance(&self, point: Vec3, within: f32) -> Option<(f32, Vec3)> {
        let beyond = point - point.clamp(self.low, self.high);
        if !(beyond.length() <= within) || self.is_beyond(point, within) {
            return None;
        }
        let (distance, normal) = self.signed_distance(point)?;
        (distance <= within).then_some((distance, normal))
    }

    /// Whether any point is inside: at least two images show something.
    pub(in crate::contact) fn is_inside_somewhere(&self) -> bool {
        let images = self.images.iter();
        images.filter(|image| !image.layers.is_empty()).count() >= 2
    }

    /// Metres.
    pub(super) fn pixel(&self) -> f32 {
        self.pixel
    }

    /// Whether a point is known to be outside and further away than `within`.
    #[inline]
    pub(super) fn is_beyond(&self, point: Vec3, within: f32) -> bool {
        self.coarse.between(point).is_some_and(|known| known.least > within)
    }

    /// The corners of the box around the solid.
    pub(super) fn bounds(&self) -> [Vec3; 2] {
        [self.low, self.high]
    }

    /// At any distance; `None` only where no image shows anything.
    pub(super) fn signed_distance(&self, point: Vec3) -> Option<(f32, Vec3)> {
        let mut faces = Faces {
            met: [FoundFace::default(); MET],
            count: 0,
            closest: 0,
        };
        for image in &self.images {
            image.near(point, |crossings| self.meet(crossings, point, &mut faces));
        }
        // Deep inside the closest face may be seen along no axis.
        if let Some(hint) = self.coarse.between(point).and_then(|known| known.hint) {
            self.meet_face(hint, point, &mut faces);
        }
        for _ in 0..STEPS {
            let last = *faces.closest()?;
            let axis = last.normal.abs().max_position();
            let foot = point - last.normal * last.height;
            self.images[axis].near(foot, |crossings| self.meet(crossings, point, &mut faces));
            if faces.closest()?.triangle == last.triangle {
                break;
            }
        }
        let face = faces.deciding(self.pixel)?;
        // A foot less than a pixel beside the face lies on its neighbour, which no ray has met.
        let length = face.beside.length();
        let beside = length - self.pixel;
        if beside <= 0.0 {
            // So far away the rays beside the point know the side, also of a face that is folded over or whose neighbour is not seen.
            let closest = faces.closest()?;
            let distance = closest.squared_distance.sqrt();
            if distance > HALF_DIAGONAL * self.pixel && self.is_inside(point) != (face.height < 0.0) {
                let side = face.height.signum();
                return Some((-side * distance, closest.closest * (side / distance)));
            }
            return Some((face.height, face.normal));
        }
        let offset = face.normal * face.height + face.beside * (beside / length);
        let side = if self.is_inside(point) { -1.0 } else { 1.0 };
        let distance = offset.length();
        Some((side * distance, offset * (side / distance)))
    }

    /// Adds the faces that a ray passes to those met.
    fn meet(&self, crossings: &[RayCrossing], point: Vec3, faces: &mut Faces) {
        for crossing in crossings {
            self.meet_face(crossing.triangle(), point, faces);
        }
    }

    fn meet_face(&self, triangle: u32, point: Vec3, faces: &mut Faces) {
        let PlacedTriangle { corners, normal } = self.triangles[triangle as usize];
        // As seen from the point, so that no digits are lost.
        let [a, b, c] = corners.map(|corner| corner - point);
        let height = -a.dot(normal);
        let too_far = faces.closest().is_some_and(|closest| {
            let reach = height.abs() - self.pixel;
            reach > 0.0 && reach * reach > closest.squared_distance
        });
        if too_far || normal == Vec3::ZERO || faces.met().iter().any(|face| face.triangle == triangle) {
            return;
        }
        let weights = closest_on_triangle(Vec3A::ZERO, a.into(), b.into(), c.into());
        let closest = a * weights[0] + b * weights[1] + c * weights[2];
        let within = weights.iter().all(|&weight| weight > 0.0);
        faces.add(FoundFace {
            triangle,
            squared_distance: closest.length_squared(),
            height,
            normal,
            closest,
            beside: if within {
                Vec3::ZERO
            } else {
                -(closest + normal * height)
            },
            centre: (a + b + c) / 3.0,
        });
    }

    /// Where it is not known, what most of the three images say.
    fn is_inside(&self, point: Vec3) -> bool {
        match self.coarse.between(point) {
            Some(known) if known.least > 0.0 => false,
            Some(known) if known.most < 0.0 => true,
            _ => shows_inside(&self.images, point),
        }
    }
}

/// What most of the images say.
fn shows_inside(images: &[AxisImage; 3], point: Vec3) -> bool {
    images.iter().filter(|image| image.shows_inside(point)).count() >= 2
}

/// How far the closest triangle is, and its place, given one that may be.
fn nearest_of(tree: &Tree, point: Vec3, hint: u32) -> Sample {
    let exact = point.as_dvec3();
    let squared = |place: usize| {
        let corners = tree.placed(place).exact();
        let (weights, _) = nearest_on_triangle(exact, corners);
        exact.distance_squared(weighted(corners, weights))
    };
    let mut best = (squared(hint as usize), hint);
    let bounds = Bounds { min: point, max: point };
    tree.near(&bounds, best.0 as f32, |place| {
        let here = squared(place);
        if here < best.0 {
            best = (here, place as u32);
        }
        best.0 as f32
    });
    (best.0.sqrt() as f32, best.1)
}

/// Shows the neighbours of a pixel.
fn around(projection: &Projection, pixel: usize, mut see: impl FnMut(usize)) {
    let (width, height) = (projection.width as usize, projection.height as usize);
    let (column, row) = (pixel % width, pixel / width);
    for y in row.saturating_sub(1)..(row + 2).min(height) {
        for x in column.saturating_sub(1)..(column + 2).min(width) {
            if (x, y) != (column, row) {
                see(y * width + x);
            }
        }
    }
}

impl AxisImage {
    fn new(frame: Frame, positions: &[Vec3], triangles: &[[u32; 3]], bounds: [Vec3; 2], pixel: f32) -> Result<Self> {
        let [low, high]: [DVec3; 2] = bounds.map(|corner| frame.coordinates(corner));
        let projection = Projection::new(frame, low, high, pixel.into())?;
        let layers = Layers::new(&projection, positions, triangles)?;
        let mut covered = nearest_covered(projection.width, projection.height, |pixel| {
            !layers.at(pixel).is_empty()
        })?;
        let is_broken = |pixel: usize| {
            let count = layers.at(pixel).len();
            let mut differ = false;
            around(&projection, pixel, |beside| differ |= layers.at(beside).len() != count);
            differ
        };
        for found in &mut covered {
            if *found != u32::MAX && is_broken(*found as usize) {
                *found |= BROKEN;
            }
        }
        Ok(Self {
            projection,
            layers,
            covered,
        })
    }

    /// Shows of what the ray next to a point passes the last before it and the first behind it, and what the rays around that one pass there
    /// where that differs.
    fn near(&self, point: Vec3, mut see: impl FnMut(&[RayCrossing])) {
        let vertex = self.projection.project(point);
        let marked = self.covered[self.projection.pixel_at(&vertex)];
        if marked == u32::MAX {
            return;
        }
        let mut look = |pixel: usize| {
            let crossings = self.layers.at(pixel);
            let behind = crossings.partition_point(|crossing| f64::from(crossing.depth) < vertex.depth);
            see(&crossings[behind.saturating_sub(1)..(behind + 1).min(crossings.len())]);
        };
        let pixel = (marked & !BROKEN) as usize;
        look(pixel);
        if marked & BROKEN != 0 {
            around(&self.projection, pixel, look);
        }
    }

    fn shows_inside(&self, point: Vec3) -> bool {
        let vertex = self.projection.project(point);
        let passed = |crossing: &&RayCrossing| f64::from(crossing.depth) < vertex.depth;
        let crossings = self.layers.at(self.projection.pixel_at(&vertex));
        let windings = crossings.iter().take_while(passed).map(RayCrossing::winding);
        self.projection.shows(&vertex) && windings.sum::<i32>() > 0
    }
}
