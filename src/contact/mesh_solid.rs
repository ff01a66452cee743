//! A tool that is a closed mesh, in its own frame, with its method of contact detection.

use std::sync::Arc;

use glam::Vec3;

use super::closest::Closest;
use super::distance_field::DistanceField;
use super::exact::ExactSolid;
use super::exact::separation::FeatureSeparation;
use super::image_space::LayeredImage;
use super::ridges::Ridges;
use super::time_of_impact::FLAT;

use crate::base::{Result, StateHasher, ensure, memory, not_negative};
use crate::codec::{Reader, Saved, Writer, shape_of_name};
use crate::def::Detection;
use crate::geometry::Aabb;
use crate::mesh::ClosedSurface;

/// The inside of a closed mesh.
#[derive(Debug)]
pub(crate) struct MeshSolid {
    surface: ClosedSurface,
    detector: MeshDetection,
    /// Exact solid, for EXACT detection and for separating features that have passed through the mesh.
    exact: ExactSolid,
    pub(super) ridges: Ridges,
    bounds: Aabb,
    reach: f32,
    hash: u64,
    /// Side of a pixel or cell, m; 0 for EXACT.
    grain: f32,
}

/// Contact detection with the mesh.
#[derive(Debug)]
enum MeshDetection {
    Exact,
    Field(Box<DistanceField>),
    Image(Box<LayeredImage>),
}

/// Saves the surface and the detection. The rest is rebuilt on load.
impl Saved for Arc<MeshSolid> {
    const SHAPE: u64 = shape_of_name("MeshSolid { positions, triangles, detection, grain, hash }");
    const LEAST: usize = 29;

    fn save(&self, to: &mut Writer) {
        let MeshSolid {
            surface,
            detector,
            exact: _,
            ridges: _,
            bounds: _,
            reach: _,
            hash,
            grain,
        } = &**self;
        let detection = match detector {
            MeshDetection::Exact => Detection::Exact,
            MeshDetection::Image(_) => Detection::ImageSpace,
            MeshDetection::Field(_) => Detection::DistanceField,
        };
        detection.save(to);
        grain.save(to);
        hash.save(to);
        surface.positions().len().save(to);
        Vec3::save_all(surface.positions(), to);
        surface.triangles().len().save(to);
        <[u32; 3]>::save_all(surface.triangles(), to);
    }

    fn load(from: &mut Reader) -> Result<Self> {
        let detection = Detection::load(from)?;
        let (grain, hash) = (f32::load(from)?, u64::load(from)?);
        let positions: Box<[Vec3]> = Saved::load(from)?;
        let triangles: Box<[[u32; 3]]> = Saved::load(from)?;
        not_negative("resolution", grain)?;
        let mut solid = MeshSolid::new_shared(&positions, &triangles, detection, grain)?;
        if let Some(solid) = Arc::get_mut(&mut solid) {
            solid.hash = hash;
        }
        Ok(solid)
    }
}

/// Default number of pixels along the longest extent.
const DEFAULT_PIXELS: f32 = 256.0;
/// Default number of cells along the longest extent.
const DEFAULT_CELLS: f32 = 96.0;
/// Default least number of pixels or cells along the least extent.
const MIN_SAMPLES: f32 = 4.0;
/// Below this number along the least extent, the default resolution counts as too coarse.
const MIN_DETECTED: f32 = 2.0;
/// Maximum number of pixels in an image with the default resolution.
const MAX_PIXELS: f64 = (1 << 20) as f64;
/// Maximum number of cells with the default resolution.
const MAX_CELLS: f64 = (1 << 22) as f64;

/// Least distance of the samples beside a feature's deepest point, relative to half the least extent.
const SAMPLE_OFFSET: f32 = 1e-3;

/// Least cosine between a contact normal and the normal of the face that it pushes out.
const MIN_ACROSS: f32 = 0.2;

/// Above this cosine a contact normal alone determines the side of the face.
const SURELY_ACROSS: f32 = 0.9;

/// Rounding error of a distance to the box, relative to the largest coordinate.
const ROUNDING: f32 = 1e-6;

impl MeshSolid {
    /// Returns the surface.
    pub fn surface(&self) -> &ClosedSurface {
        &self.surface
    }

    /// Creates a solid from a closed surface. `resolution` is that of the tool's definition.
    pub fn new_shared(
        positions: &[Vec3],
        triangles: &[[u32; 3]],
        detection: Detection,
        resolution: f32,
    ) -> Result<Arc<Self>> {
        let surface = ClosedSurface::new(positions, triangles)?;
        let bounds = Aabb::of(surface.positions().iter().copied());
        let sides = bounds.max - bounds.min;
        let grain = if resolution > 0.0 {
            resolution
        } else {
            default_grain(sides, detection)
        };
        let (detector, exact) = match detection {
            Detection::Exact => (MeshDetection::Exact, ExactSolid::new(&surface)?),
            Detection::ImageSpace => {
                let image = LayeredImage::new(surface.positions(), surface.triangles(), grain)?;
                (
                    MeshDetection::Image(memory::boxed(image)?),
                    ExactSolid::changing(&surface)?,
                )
            }
            Detection::DistanceField => {
                let exact = ExactSolid::new(&surface)?;
                (
                    MeshDetection::Field(memory::boxed(DistanceField::of(&exact, grain)?)?),
                    exact,
                )
            }
        };
        let is_fine = resolution > 0.0 || grain * MIN_DETECTED <= sides.min_element();
        let is_detected = match &detector {
            MeshDetection::Exact => true,
            MeshDetection::Field(field) => is_fine && field.has_interior(SAMPLE_OFFSET * sides.min_element()),
            MeshDetection::Image(image) => is_fine && image.has_interior(),
        };
        ensure!(
            is_detected,
            "resolution is {resolution} m: {} that are {grain} m apart do not show a solid of which the least extent is {least} m: \
                 a quarter of that would do",
            if detection == Detection::ImageSpace {
                "rays"
            } else {
                "samples"
            },
            least = sides.min_element()
        );
        let mut hasher = StateHasher::new();
        hasher.write_u64(detection as u64);
        hasher.write_floats(&[resolution]);
        hasher.write_vectors(positions.iter().copied());
        for corner in triangles.as_flattened() {
            hasher.write_u64(u64::from(*corner));
        }
        let solid = Self {
            detector,
            exact,
            ridges: Ridges::new(&surface)?,
            bounds,
            reach: surface
                .positions()
                .iter()
                .fold(0.0, |reach, corner| corner.length().max(reach)),
            grain: if detection == Detection::Exact { 0.0 } else { grain },
            surface,
            hash: hasher.finish(),
        };
        Ok(Arc::new(solid))
    }

    /// Returns the corners of the surface.
    pub fn positions(&self) -> &[Vec3] {
        self.surface.positions()
    }

    /// Returns the triangles of the surface.
    pub fn triangles(&self) -> &[[u32; 3]] {
        self.surface.triangles()
    }

    /// Returns the corners of the bounding box.
    pub fn corners(&self) -> [Vec3; 8] {
        let ends = [self.bounds.min, self.bounds.max];
        std::array::from_fn(|corner| Vec3::from_array([0, 1, 2].map(|axis| ends[corner >> axis & 1][axis])))
    }

    /// Returns the largest distance from the tool's position, m.
    pub fn reach(&self) -> f32 {
        self.reach
    }

    /// Returns half of the least extent, m.
    pub fn thickness(&self) -> f32 {
        0.5 * (self.bounds.max - self.bounds.min).min_element()
    }

    /// Returns the displacement up to which the surface counts as flat, m.
    pub fn flat(&self) -> f32 {
        FLAT * self.thickness()
    }

    /// Returns a hash of everything that detection depends on.
    pub fn hash(&self) -> u64 {
        self.hash
    }

    /// Returns the closest point of a node, edge or face; `None` if it is further than `within`. A feature with a
    /// pinned node cannot move freely. If it passes through the solid, it has a contact only if a translation in its
    /// interior separates it; otherwise it is ignored.
    pub(super) fn closest(&self, corners: &[Vec3], within: f32, is_pinned: bool) -> Option<Closest> {
        if is_separated_from_box(&self.bounds, corners, within) {
            return None;
        }
        let closest = self.deepest(corners, within)?;
        if !(closest.inside && closest.distance < 0.0 && corners.len() > 1) {
            return Some(closest);
        }
        let separation = if is_pinned {
            self.exact.separate(corners)
        } else {
            FeatureSeparation::Uncrossed
        };
        Some(match separation {
            FeatureSeparation::Interior(contact) => contact,
            FeatureSeparation::Elsewhere => Closest {
                inside: false,
                ..closest
            },
            FeatureSeparation::Uncrossed => self.with_corrected_normal(corners, closest),
        })
    }

    fn deepest(&self, corners: &[Vec3], within: f32) -> Option<Closest> {
        match &self.detector {
            MeshDetection::Exact => self.exact.closest(corners, within),
            MeshDetection::Field(field) => field.closest(corners, within),
            MeshDetection::Image(image) => image.closest(corners, within),
        }
    }

    /// Corrects the normal of an edge or face that an edge or corner of the solid has passed into. At its deepest
    /// point several faces of the solid are equally close, and none is the entry side. The new normal is a mean of
    /// theirs, across the feature.
    fn with_corrected_normal(&self, corners: &[Vec3], closest: Closest) -> Closest {
        let weighted = corners.iter().zip(closest.weights);
        let point: Vec3 = weighted.map(|(corner, weight)| *corner * weight).sum();
        let offset = (-0.5 * closest.distance)
            .max(self.grain)
            .max(SAMPLE_OFFSET * self.thickness());
        let normal_beside = |direction: Vec3| {
            let sample = self.deepest(&[point + direction * offset], 2.0 * offset);
            sample.map_or(closest.normal, |sample| sample.normal)
        };
        let normal = if let &[a, b] = corners {
            let along = (b - a).normalize_or_zero();
            let [ahead, behind] = [along, -along].map(normal_beside);
            let [rise, fall] = [ahead, behind].map(|normal| normal.dot(along));
            if rise > 0.0 && fall < 0.0 {
                ahead * -fall + behind * rise
            } else {
                closest.normal - along * closest.normal.dot(along)
            }
        } else {
            let face_normal = (corners[1] - corners[0])
                .cross(corners[2] - corners[0])
                .normalize_or_zero();
            // The normal most nearly across the face determines its side. If no normal is, the closest one is not on
            // the entry side.
            let cosine = closest.normal.dot(face_normal);
            if cosine.abs() > SURELY_ACROSS {
                return Closest {
                    normal: face_normal * cosine.signum(),
                    ..closest
                };
            }
            let u = (corners[1] - corners[0]).normalize_or_zero();
            let v = face_normal.cross(u);
            let directions = [u, u + v, v, v - u, -u, -u - v, -v, u - v];
            let cosines = directions.map(|direction| normal_beside(direction.normalize_or_zero()).dot(face_normal));
            let larger = |largest: f32, cosine: f32| if cosine.abs() > largest.abs() { cosine } else { largest };
            let largest = cosines.into_iter().fold(cosine, larger);
            if largest.abs() < MIN_ACROSS {
                // All sides of a thin wall face along the feature if that lies flat on the wall's end.
                return match *corners {
                    [a, b, c] => self.exact.separate_past_corner([a, b, c]).unwrap_or(closest),
                    _ => closest,
                };
            }
            face_normal * largest
        };
        Closest {
            normal: normal.try_normalize().unwrap_or(closest.normal),
            ..closest
        }
    }
}

/// Returns the default resolution for a solid with these extents.
fn default_grain(sides: Vec3, detection: Detection) -> f32 {
    let (longest, least) = (sides.max_element(), sides.min_element());
    let is_image = detection == Detection::ImageSpace;
    let coarsest = longest / if is_image { DEFAULT_PIXELS } else { DEFAULT_CELLS };
    let fits = |grain: f32| {
        let counts = (sides / grain).as_dvec3();
        if is_image {
            let largest = counts.x * counts.y.max(counts.z);
            largest.max(counts.y * counts.z) <= MAX_PIXELS
        } else {
            // With a margin around it.
            (counts + 8.0).element_product() <= MAX_CELLS
        }
    };
    let mut grain = coarsest.min((least / MIN_SAMPLES).max(coarsest / MAX_PIXELS.sqrt() as f32));
    while grain < coarsest && !fits(grain) {
        grain *= 1.125;
    }
    grain.min(coarsest)
}

/// Separating-axis test of a feature and the box: face normals of the box, cross products with its edges, and the
/// feature's normal (Gottschalk, Lin, Manocha 1996). It rejects a long feature beside the box without a query of the
/// solid.
fn is_separated_from_box(bounds: &Aabb, corners: &[Vec3], within: f32) -> bool {
    let center = 0.5 * (bounds.min + bounds.max);
    let half = 0.5 * (bounds.max - bounds.min) + within;
    let mut offsets = [Vec3::ZERO; 3];
    let mut size = half.max_element();
    for (offset, &corner) in offsets.iter_mut().zip(corners) {
        *offset = corner - center;
        size = size.max(offset.abs().max_element());
    }
    let offsets = &offsets[..corners.len()];
    let half = half + ROUNDING * size;
    let low = offsets.iter().copied().fold(Vec3::INFINITY, Vec3::min);
    let high = offsets.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
    if low.cmpgt(half).any() || high.cmplt(-half).any() {
        return true;
    }
    let is_separated = |axis: Vec3| {
        let reach = half.dot(axis.abs());
        let (mut least, mut most) = (f32::INFINITY, f32::NEG_INFINITY);
        for corner in offsets {
            let height = corner.dot(axis);
            least = least.min(height);
            most = most.max(height);
        }
        least > reach || most < -reach
    };
    let sides = [(0, 1), (1, 2), (2, 0)];
    // An edge has one side, a node none.
    let sides = &sides[..[0, 0, 1, 3][offsets.len().min(3)]];
    sides.iter().any(|&(a, b)| {
        let side = offsets[b] - offsets[a];
        Vec3::AXES.iter().any(|axis| is_separated(axis.cross(side)))
    }) || offsets.len() == 3 && is_separated((offsets[1] - offsets[0]).cross(offsets[2] - offsets[0]))
}
