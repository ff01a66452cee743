//! Three layered depth images of a rigid solid along its own axes, with signed distance queries.

use glam::{DVec3, Vec3, Vec3A};

use super::distance_transform::nearest_covered;
use super::layers::{Layers, RayCrossing};
use super::projection::{Projection, ViewFrame};
use super::surface;
use crate::base::{Error, Result, above_zero, ensure, memory};
use crate::contact::distance::closest_on_triangle;
use crate::contact::exact::distance_cache::{DistanceCache, Sample};
use crate::geometry::Aabb;
use crate::geometry::bvh::{Bvh, BvhTriangle};
use crate::geometry::nearest::{nearest_on_triangle, weighted};
use crate::mesh;

/// Maximum number of times that a search continues from the foot of the perpendicular on the closest face.
const MAX_STEPS: usize = 4;

/// Maximum number of faces that a search keeps, the closest ones.
const MAX_FACES: usize = 24;

/// Largest distance of a point from the ray through its pixel's center, in pixels.
const HALF_DIAGONAL: f32 = 0.7072;

/// Marks a pixel with a neighbor that has a different number of faces. A closer face, as in a groove narrower than a
/// pixel, may be visible only there.
const BROKEN: u32 = 1 << 31;

/// Relative difference below which distances to faces count as equal: the faces meet at their closest point.
const EQUAL_DISTANCE: f32 = 1e-4;

/// A closed solid drawn once along its three axes: for each pixel all faces that the ray through its center crosses.
///
/// Distances come from the faces at a point's pixels, and at adjacent pixels with a different number of faces. They
/// are exact if the closest face is visible there. Otherwise the error near the surface is about a pixel. A part
/// thinner than a pixel along two axes, which no ray crosses, is not detected.
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
    triangles: Vec<BvhTriangle>,
    images: [AxisImage; 3],
    /// Distances far from the surface.
    cache: DistanceCache,
    low: Vec3,
    high: Vec3,
    /// Side of a pixel, m.
    pixel: f32,
}

/// One of the three images.
#[derive(Debug)]
struct AxisImage {
    projection: Projection,
    layers: Layers,
    /// For each pixel the nearest one that the solid covers, with the mark [`BROKEN`].
    covered: Vec<u32>,
}

/// A face found by a search, relative to the query point.
#[derive(Clone, Copy, Default)]
struct NearbyFace {
    triangle: u32,
    squared_distance: f32,
    /// Signed height of the point above the face's plane.
    height: f32,
    normal: Vec3,
    /// From the query point to the triangle's closest point.
    closest: Vec3,
    /// From that point to the foot of the perpendicular on the plane; zero if it lies within the triangle.
    foot_offset: Vec3,
    /// From the query point to the triangle's center.
    center: Vec3,
}

impl NearbyFace {
    /// Height of a neighbor's center above the plane; below 0 at a ridge.
    fn height_of(&self, neighbor: &NearbyFace) -> f32 {
        self.normal.dot(neighbor.center - self.closest)
    }
}

/// The faces found by a search.
struct NearbyFaces {
    faces: [NearbyFace; MAX_FACES],
    count: usize,
    /// The closest face. Of equally close ones, that with the largest height, which determines the side.
    closest: usize,
}

impl NearbyFaces {
    fn add(&mut self, face: NearbyFace) {
        let Some(slot) = self.slot_for(&face) else {
            return;
        };
        let closest = &self.faces[self.closest];
        let (lower, upper) = (1.0 - EQUAL_DISTANCE, 1.0 + EQUAL_DISTANCE);
        let closer = face.squared_distance < closest.squared_distance * lower;
        let as_close = face.squared_distance <= closest.squared_distance * upper;
        let is_closest = self.count == 0 || closer || as_close && face.height.abs() > closest.height.abs();
        self.faces[slot] = face;
        self.count = self.count.max(slot + 1);
        if is_closest {
            self.closest = slot;
        }
    }

    /// Returns a free slot, or that of the furthest face if this one is closer.
    fn slot_for(&self, face: &NearbyFace) -> Option<usize> {
        if self.count < MAX_FACES {
            return Some(self.count);
        }
        let distance = |slot: &usize| self.faces[*slot].squared_distance;
        let furthest = (0..MAX_FACES)
            .filter(|slot| *slot != self.closest)
            .max_by(|a, b| distance(a).total_cmp(&distance(b)))?;
        (face.squared_distance < distance(&furthest)).then_some(furthest)
    }

    fn faces(&self) -> &[NearbyFace] {
        &self.faces[..self.count]
    }

    fn closest(&self) -> Option<&NearbyFace> {
        self.faces().get(self.closest)
    }

    /// Returns the face that determines the side of the point. Beside the closest face, neighbors count too: at a
    /// ridge the solid is the intersection of their half-spaces, in a valley the union.
    fn side_face(&self, pixel: f32) -> Option<&NearbyFace> {
        let closest = self.closest()?;
        if closest.foot_offset == Vec3::ZERO {
            return Some(closest);
        }
        let mut side_face = closest;
        for face in self.faces() {
            let offset = face.closest - closest.closest;
            let near = offset.length_squared() <= pixel * pixel;
            let ridge = side_face.height_of(face) <= 0.0;
            if near && (ridge == (face.height > side_face.height)) {
                side_face = face;
            }
        }
        Some(side_face)
    }
}

impl LayeredImage {
    /// Draws a closed surface with outward triangles, `positions` in meters, in pixels of `pixel` meters.
    ///
    /// Errors: [`Error::InvalidArgument`] for a pixel that is not above 0 and finite or so small that an image would
    /// have more than 2^24 pixels, a position that is not finite, an index out of range, a surface that is not
    /// closed; [`Error::OutOfMemory`].
    pub fn new(positions: &[Vec3], triangles: &[[u32; 3]], pixel: f32) -> Result<Self> {
        above_zero("pixel", pixel)?;
        surface::check(positions.len(), triangles)?;
        surface::check_positions(positions)?;
        ensure!(mesh::is_closed(triangles)?, Error::invalid(surface::OPEN));
        let corners_of = |triangle: &[u32; 3]| triangle.map(|node| positions[node as usize]);
        let bounds = Aabb::of(triangles.iter().flat_map(corners_of));
        let (low, high) = (bounds.min, bounds.max);
        let drawn = memory::collected(triangles.iter().map(|triangle| BvhTriangle::new(corners_of(triangle))))?;
        let image = |axis: usize| AxisImage::new(ViewFrame::AXES[axis], positions, triangles, [low, high], pixel);
        let images = [image(0)?, image(1)?, image(2)?];
        let tree = Bvh::new(triangles.len(), |triangle| drawn[triangle as usize].corners)?;
        let mut cache = DistanceCache::new(bounds, triangles.len(), |point, hint| {
            let (distance, slot) = nearest_triangle(&tree, point, hint);
            let side = if is_inside_image(&images, point) { -1.0 } else { 1.0 };
            (side * distance, slot)
        })?;
        cache.map_hints(|slot| tree.triangle(slot as usize));
        Ok(Self {
            images,
            cache,
            triangles: drawn,
            low,
            high,
            pixel,
        })
    }

    /// Returns the signed distance of a point from the surface (m), negative inside, and its unit gradient; `None` if
    /// the point is further outside than `within`.
    pub fn distance(&self, point: Vec3, within: f32) -> Option<(f32, Vec3)> {
        let beyond = point - point.clamp(self.low, self.high);
        if !(beyond.length() <= within) || self.is_beyond(point, within) {
            return None;
        }
        let (distance, normal) = self.signed_distance(point)?;
        (distance <= within).then_some((distance, normal))
    }

    /// True if a point may be inside: at least two images are not empty.
    pub(in crate::contact) fn has_interior(&self) -> bool {
        let images = self.images.iter();
        images.filter(|image| !image.layers.is_empty()).count() >= 2
    }

    /// Side of a pixel, m.
    pub(super) fn pixel(&self) -> f32 {
        self.pixel
    }

    /// True if a point is certainly further outside than `within`.
    #[inline]
    pub(super) fn is_beyond(&self, point: Vec3, within: f32) -> bool {
        self.cache.distance_range(point).is_some_and(|range| range.min > within)
    }

    /// Returns the corners of the solid's bounding box.
    pub(super) fn bounds(&self) -> [Vec3; 2] {
        [self.low, self.high]
    }

    /// Returns the signed distance at any distance; `None` only if all images are empty.
    pub(super) fn signed_distance(&self, point: Vec3) -> Option<(f32, Vec3)> {
        let mut faces = NearbyFaces {
            faces: [NearbyFace::default(); MAX_FACES],
            count: 0,
            closest: 0,
        };
        for image in &self.images {
            image.near(point, |crossings| self.add_crossings(crossings, point, &mut faces));
        }
        // Deep inside, the closest face may be visible along no axis.
        if let Some(hint) = self.cache.distance_range(point).and_then(|range| range.hint) {
            self.add_face(hint, point, &mut faces);
        }
        for _ in 0..MAX_STEPS {
            let last = *faces.closest()?;
            let axis = last.normal.abs().max_position();
            let foot = point - last.normal * last.height;
            self.images[axis].near(foot, |crossings| self.add_crossings(crossings, point, &mut faces));
            if faces.closest()?.triangle == last.triangle {
                break;
            }
        }
        let face = faces.side_face(self.pixel)?;
        // A foot less than a pixel beside the face lies on a neighbor that no ray hit.
        let length = face.foot_offset.length();
        let excess = length - self.pixel;
        if excess <= 0.0 {
            // At this distance the rays near the point give the right side even if a face is folded or a neighbor was
            // missed.
            let closest = faces.closest()?;
            let distance = closest.squared_distance.sqrt();
            if distance > HALF_DIAGONAL * self.pixel && self.is_inside(point) != (face.height < 0.0) {
                let side = face.height.signum();
                return Some((-side * distance, closest.closest * (side / distance)));
            }
            return Some((face.height, face.normal));
        }
        let offset = face.normal * face.height + face.foot_offset * (excess / length);
        let side = if self.is_inside(point) { -1.0 } else { 1.0 };
        let distance = offset.length();
        Some((side * distance, offset * (side / distance)))
    }

    /// Adds the faces that a ray crosses.
    fn add_crossings(&self, crossings: &[RayCrossing], point: Vec3, faces: &mut NearbyFaces) {
        for crossing in crossings {
            self.add_face(crossing.triangle(), point, faces);
        }
    }

    fn add_face(&self, triangle: u32, point: Vec3, faces: &mut NearbyFaces) {
        let BvhTriangle { corners, normal } = self.triangles[triangle as usize];
        // Relative to the point, to avoid cancellation.
        let [a, b, c] = corners.map(|corner| corner - point);
        let height = -a.dot(normal);
        let too_far = faces.closest().is_some_and(|closest| {
            let excess = height.abs() - self.pixel;
            excess > 0.0 && excess * excess > closest.squared_distance
        });
        if too_far || normal == Vec3::ZERO || faces.faces().iter().any(|face| face.triangle == triangle) {
            return;
        }
        let weights = closest_on_triangle(Vec3A::ZERO, a.into(), b.into(), c.into());
        let closest = a * weights[0] + b * weights[1] + c * weights[2];
        let within = weights.iter().all(|&weight| weight > 0.0);
        faces.add(NearbyFace {
            triangle,
            squared_distance: closest.length_squared(),
            height,
            normal,
            closest,
            foot_offset: if within {
                Vec3::ZERO
            } else {
                -(closest + normal * height)
            },
            center: (a + b + c) / 3.0,
        });
    }

    /// True if the point is inside: by the distance bounds, or else by a majority of the images.
    fn is_inside(&self, point: Vec3) -> bool {
        match self.cache.distance_range(point) {
            Some(range) if range.min > 0.0 => false,
            Some(range) if range.max < 0.0 => true,
            _ => is_inside_image(&self.images, point),
        }
    }
}

/// By a majority of the images.
fn is_inside_image(images: &[AxisImage; 3], point: Vec3) -> bool {
    images.iter().filter(|image| image.is_inside_image(point)).count() >= 2
}

/// Returns the distance of the closest triangle and its tree slot, given a candidate.
fn nearest_triangle(tree: &Bvh, point: Vec3, hint: u32) -> Sample {
    let exact = point.as_dvec3();
    let distance_squared = |slot: usize| {
        let corners = tree.placed(slot).exact();
        let (weights, _) = nearest_on_triangle(exact, corners);
        exact.distance_squared(weighted(corners, weights))
    };
    let mut best = (distance_squared(hint as usize), hint);
    let bounds = Aabb { min: point, max: point };
    tree.near(&bounds, best.0 as f32, |slot| {
        let here = distance_squared(slot);
        if here < best.0 {
            best = (here, slot as u32);
        }
        best.0 as f32
    });
    (best.0.sqrt() as f32, best.1)
}

/// Visits the neighbors of a pixel.
fn visit_neighbors(projection: &Projection, pixel: usize, mut visit: impl FnMut(usize)) {
    let (width, height) = (projection.width as usize, projection.height as usize);
    let (column, row) = (pixel % width, pixel / width);
    for y in row.saturating_sub(1)..(row + 2).min(height) {
        for x in column.saturating_sub(1)..(column + 2).min(width) {
            if (x, y) != (column, row) {
                visit(y * width + x);
            }
        }
    }
}

impl AxisImage {
    fn new(
        frame: ViewFrame,
        positions: &[Vec3],
        triangles: &[[u32; 3]],
        bounds: [Vec3; 2],
        pixel: f32,
    ) -> Result<Self> {
        let [low, high]: [DVec3; 2] = bounds.map(|corner| frame.coordinates(corner));
        let projection = Projection::new(frame, low, high, pixel.into())?;
        let layers = Layers::new(&projection, positions, triangles)?;
        let mut covered = nearest_covered(projection.width, projection.height, |pixel| {
            !layers.at(pixel).is_empty()
        })?;
        let has_other_counts = |pixel: usize| {
            let count = layers.at(pixel).len();
            let mut differ = false;
            visit_neighbors(&projection, pixel, |neighbor| {
                differ |= layers.at(neighbor).len() != count
            });
            differ
        };
        for pixel in &mut covered {
            if *pixel != u32::MAX && has_other_counts(*pixel as usize) {
                *pixel |= BROKEN;
            }
        }
        Ok(Self {
            projection,
            layers,
            covered,
        })
    }

    /// Visits, for the ray nearest to a point, the last crossing before the point and the first one behind it. Where
    /// the rays around it have other numbers of crossings, they are included.
    fn near(&self, point: Vec3, mut visit: impl FnMut(&[RayCrossing])) {
        let vertex = self.projection.project(point);
        let nearest_covered = self.covered[self.projection.pixel_at(&vertex)];
        if nearest_covered == u32::MAX {
            return;
        }
        let mut visit_pixel = |pixel: usize| {
            let crossings = self.layers.at(pixel);
            let behind = crossings.partition_point(|crossing| f64::from(crossing.depth) < vertex.depth);
            visit(&crossings[behind.saturating_sub(1)..(behind + 1).min(crossings.len())]);
        };
        let pixel = (nearest_covered & !BROKEN) as usize;
        visit_pixel(pixel);
        if nearest_covered & BROKEN != 0 {
            visit_neighbors(&self.projection, pixel, visit_pixel);
        }
    }

    fn is_inside_image(&self, point: Vec3) -> bool {
        let vertex = self.projection.project(point);
        let is_before = |crossing: &&RayCrossing| f64::from(crossing.depth) < vertex.depth;
        let crossings = self.layers.at(self.projection.pixel_at(&vertex));
        let windings = crossings.iter().take_while(is_before).map(RayCrossing::winding);
        self.projection.contains(&vertex) && windings.sum::<i32>() > 0
    }
}
