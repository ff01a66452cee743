//! A tool that is a closed mesh: what it encloses, in its own frame, and how that is found.

use std::sync::Arc;

use glam::Vec3;

use super::closest::Closest;
use super::distance_field::DistanceField;
use super::exact::ExactSolid;
use super::exact::pierced::WayOut;
use super::image_space::LayeredImage;
use super::ridges::Ridges;
use super::sweep::FLAT;

use crate::base::{Result, StateHasher, ensure, memory, not_negative};
use crate::codec::{Reader, Saved, Writer, shape_of_name};
use crate::def::Detection;
use crate::geometry::Bounds;
use crate::mesh::ClosedSurface;

/// What a mesh encloses.
#[derive(Debug)]
pub(crate) struct MeshSolid {
    surface: ClosedSurface,
    found: Found,
    /// Its corners, edges and sides, past which something that passed into it is led out; as it is found, where that is by these.
    exact: ExactSolid,
    pub(super) ridges: Ridges,
    bounds: Bounds,
    reach: f32,
    hash: u64,
    /// The side of a pixel or a cell, m; 0: it is known exactly.
    grain: f32,
}

/// How what it encloses is found.
#[derive(Debug)]
enum Found {
    Exact,
    Field(Box<DistanceField>),
    Image(Box<LayeredImage>),
}

/// Its surface and how it is found: what else there is of it is made again.
impl Saved for Arc<MeshSolid> {
    const SHAPE: u64 = shape_of_name("MeshSolid { positions, triangles, detection, grain, hash }");
    const LEAST: usize = 29;

    fn save(&self, to: &mut Writer) {
        let MeshSolid {
            surface,
            found,
            exact: _,
            ridges: _,
            bounds: _,
            reach: _,
            hash,
            grain,
        } = &**self;
        let detection = match found {
            Found::Exact => Detection::Exact,
            Found::Image(_) => Detection::ImageSpace,
            Found::Field(_) => Detection::DistanceField,
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
        let mut solid = MeshSolid::shared(&positions, &triangles, detection, grain)?;
        if let Some(solid) = Arc::get_mut(&mut solid) {
            solid.hash = hash;
        }
        Ok(solid)
    }
}

/// Where it is not said how fine an image or a field is, the longest extent is this many pixels or cells, and the least so many; a few
/// less where it would take more than so many of them in one image or in all.
const PIXELS: f32 = 256.0;
const CELLS: f32 = 96.0;
const THIN: f32 = 4.0;
const THINNEST: f32 = 2.0;
const MOST_PIXELS: f64 = (1 << 20) as f64;
const MOST_CELLS: f64 = (1 << 22) as f64;

/// How far beside a feature's deepest point is looked at least, as a part of half the least extent.
const BESIDE: f32 = 1e-3;

/// The least that a normal looks across a face which it leads out, as a cosine.
const ACROSS: f32 = 0.2;

/// A normal that looks across a face so much tells its side alone.
const SURELY_ACROSS: f32 = 0.9;

/// What rounding may take from a distance to the box, as a part of the largest coordinate.
const ROUNDING: f32 = 1e-6;

impl MeshSolid {
    /// What it is enclosed by.
    pub fn surface(&self) -> &ClosedSurface {
        &self.surface
    }

    /// What this surface encloses, to be found in this way; `resolution` as in a tool's definition.
    pub fn shared(
        positions: &[Vec3],
        triangles: &[[u32; 3]],
        detection: Detection,
        resolution: f32,
    ) -> Result<Arc<Self>> {
        let surface = ClosedSurface::new(positions, triangles)?;
        let bounds = Bounds::of(surface.positions().iter().copied());
        let sides = bounds.max - bounds.min;
        let grain = if resolution > 0.0 {
            resolution
        } else {
            grain_for(sides, detection)
        };
        let (found, exact) = match detection {
            Detection::Exact => (Found::Exact, ExactSolid::new(&surface)?),
            Detection::ImageSpace => {
                let image = LayeredImage::new(surface.positions(), surface.triangles(), grain)?;
                (Found::Image(memory::boxed(image)?), ExactSolid::changing(&surface)?)
            }
            Detection::DistanceField => {
                let exact = ExactSolid::new(&surface)?;
                (Found::Field(memory::boxed(DistanceField::of(&exact, grain)?)?), exact)
            }
        };
        let is_fine = resolution > 0.0 || grain * THINNEST <= sides.min_element();
        let is_seen = match &found {
            Found::Exact => true,
            Found::Field(field) => is_fine && field.is_inside_somewhere(BESIDE * sides.min_element()),
            Found::Image(image) => is_fine && image.is_inside_somewhere(),
        };
        ensure!(
            is_seen,
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
            found,
            exact,
            ridges: Ridges::of(&surface)?,
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

    /// The corners of its surface.
    pub fn positions(&self) -> &[Vec3] {
        self.surface.positions()
    }

    /// Its surface.
    pub fn triangles(&self) -> &[[u32; 3]] {
        self.surface.triangles()
    }

    /// The corners of the box about it.
    pub fn corners(&self) -> [Vec3; 8] {
        let ends = [self.bounds.min, self.bounds.max];
        std::array::from_fn(|corner| Vec3::from_array([0, 1, 2].map(|axis| ends[corner >> axis & 1][axis])))
    }

    /// How far it reaches from the tool's position, m.
    pub fn reach(&self) -> f32 {
        self.reach
    }

    /// Half of its least extent, m.
    pub fn thickness(&self) -> f32 {
        0.5 * (self.bounds.max - self.bounds.min).min_element()
    }

    /// What moves no further sees it as flat, m.
    pub fn flat(&self) -> f32 {
        FLAT * self.thickness()
    }

    /// Of everything that what it answers depends on.
    pub fn hash(&self) -> u64 {
        self.hash
    }

    /// The closest that a node, edge or face with these corners comes; `None`: no closer than `within`. One that is pinned somewhere
    /// cannot give way as it likes: where it has passed into the solid it is met if it has a way out of its own, and else lets the solid by.
    pub(super) fn closest(&self, corners: &[Vec3], within: f32, is_pinned: bool) -> Option<Closest> {
        if is_apart(&self.bounds, corners, within) {
            return None;
        }
        let closest = self.deepest(corners, within)?;
        if !(closest.inside && closest.distance < 0.0 && corners.len() > 1) {
            return Some(closest);
        }
        let way = if is_pinned {
            self.exact.way_out(corners)
        } else {
            WayOut::Whole
        };
        Some(match way {
            WayOut::Between(way) => way,
            WayOut::Elsewhere => Closest {
                inside: false,
                ..closest
            },
            WayOut::Whole => self.led_out(corners, closest),
        })
    }

    fn deepest(&self, corners: &[Vec3], within: f32) -> Option<Closest> {
        match &self.found {
            Found::Exact => self.exact.closest(corners, within),
            Found::Field(field) => field.closest(corners, within),
            Found::Image(image) => image.closest(corners, within),
        }
    }

    /// The same for an edge or face that an edge or corner of the solid has passed into. At its deepest point several sides of the solid are
    /// as close, and none of them is where it came in: the way out is a mean of theirs, across the feature.
    fn led_out(&self, corners: &[Vec3], closest: Closest) -> Closest {
        let weighted = corners.iter().zip(closest.weights);
        let point: Vec3 = weighted.map(|(corner, weight)| *corner * weight).sum();
        let aside = (-0.5 * closest.distance).max(self.grain).max(BESIDE * self.thickness());
        let normal_beside = |way: Vec3| {
            let beside = self.deepest(&[point + way * aside], 2.0 * aside);
            beside.map_or(closest.normal, |beside| beside.normal)
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
            let across = (corners[1] - corners[0])
                .cross(corners[2] - corners[0])
                .normalize_or_zero();
            // What looks across the face the most tells its side; where nothing does, that is not where it came in.
            let look = closest.normal.dot(across);
            if look.abs() > SURELY_ACROSS {
                return Closest {
                    normal: across * look.signum(),
                    ..closest
                };
            }
            let u = (corners[1] - corners[0]).normalize_or_zero();
            let v = across.cross(u);
            let ways = [u, u + v, v, v - u, -u, -u - v, -v, u - v];
            let looks = ways.map(|way| normal_beside(way.normalize_or_zero()).dot(across));
            let further = |most: f32, look: f32| if look.abs() > most.abs() { look } else { most };
            let most = looks.into_iter().fold(look, further);
            if most.abs() < ACROSS {
                // All sides of a thin wall look along a face that is flat on its end.
                return match *corners {
                    [a, b, c] => self.exact.past_corner([a, b, c]).unwrap_or(closest),
                    _ => closest,
                };
            }
            across * most
        };
        Closest {
            normal: normal.try_normalize().unwrap_or(closest.normal),
            ..closest
        }
    }
}

/// How fine an image or a field of a solid with these extents is.
fn grain_for(sides: Vec3, detection: Detection) -> f32 {
    let (longest, least) = (sides.max_element(), sides.min_element());
    let is_image = detection == Detection::ImageSpace;
    let whole = longest / if is_image { PIXELS } else { CELLS };
    let fits = |grain: f32| {
        let counts = (sides / grain).as_dvec3();
        if is_image {
            let largest = counts.x * counts.y.max(counts.z);
            largest.max(counts.y * counts.z) <= MOST_PIXELS
        } else {
            // With some around it.
            (counts + 8.0).element_product() <= MOST_CELLS
        }
    };
    let mut grain = whole.min((least / THIN).max(whole / MOST_PIXELS.sqrt() as f32));
    while grain < whole && !fits(grain) {
        grain *= 1.125;
    }
    grain.min(whole)
}

/// Whether a plane that is parallel to a side of the box, to an edge of each, or to the face, tells that a node, edge or face keeps further
/// than `within` from the box (Gottschalk, Lin, Manocha 1996). A long feature beside the box is found out so without a look at the solid.
fn is_apart(bounds: &Bounds, corners: &[Vec3], within: f32) -> bool {
    let centre = 0.5 * (bounds.min + bounds.max);
    let half = 0.5 * (bounds.max - bounds.min) + within;
    let mut from = [Vec3::ZERO; 3];
    let mut size = half.max_element();
    for (from, &corner) in from.iter_mut().zip(corners) {
        *from = corner - centre;
        size = size.max(from.abs().max_element());
    }
    let from = &from[..corners.len()];
    let half = half + ROUNDING * size;
    let low = from.iter().copied().fold(Vec3::INFINITY, Vec3::min);
    let high = from.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
    if low.cmpgt(half).any() || high.cmplt(-half).any() {
        return true;
    }
    let parted = |across: Vec3| {
        let reach = half.dot(across.abs());
        let (mut least, mut most) = (f32::INFINITY, f32::NEG_INFINITY);
        for corner in from {
            let height = corner.dot(across);
            least = least.min(height);
            most = most.max(height);
        }
        least > reach || most < -reach
    };
    let sides = [(0, 1), (1, 2), (2, 0)];
    // An edge has one side, a node none.
    let sides = &sides[..[0, 0, 1, 3][from.len().min(3)]];
    sides.iter().any(|&(a, b)| {
        let side = from[b] - from[a];
        Vec3::AXES.iter().any(|axis| parted(axis.cross(side)))
    }) || from.len() == 3 && parted((from[1] - from[0]).cross(from[2] - from[0]))
}
