//! Images of a deformable surface along the three axes, drawn where other surfaces are near, and queries of nearby
//! triangles.

use glam::{DVec3, Vec3};

use super::layers::{Layers, RayCrossing};
use super::projection::{LARGEST_IMAGE, Projection, ViewFrame};
use crate::base::{Result, ensure};
use crate::codec::saved;
use crate::geometry::Aabb;

/// Reserve for stretching: factor on the pixels and crossings of the initial surface.
const RESERVE: f64 = 1.5;

/// Twice the area in pixels up to which a triangle may lie between the rays.
const SMALL: f64 = 4.0;

/// Maximum rise of a triangle per pixel along rows plus columns, in pixels.
const MAX_SLOPE: f64 = 2.0;

/// Number of recent triangles that are not reported again.
const RECENT: usize = 16;

/// Images of a surface in reserved memory. Each triangle is drawn along the axis closest to its normal.
#[derive(Debug)]
pub(crate) struct DeformableImages {
    /// Side of a pixel, m.
    pixel: f64,
    views: [AxisView; 3],
}

saved! { DeformableImages { pixel, views } }

#[derive(Debug)]
struct AxisView {
    /// The axis of the view.
    axis: usize,
    frame: ViewFrame,
    pixels: usize,
    layers: Layers,
    /// `None` if nothing is near.
    projection: Option<Projection>,
}

saved! { AxisView { axis, frame, pixels, layers, projection } }

impl DeformableImages {
    /// Reserves memory for a surface like this one, with pixels of `pixel` meters.
    ///
    /// Errors: [`Error::InvalidArgument`] if an image would have more than 2^24 pixels, [`Error::OutOfMemory`].
    pub fn reserved(pixel: f32, bounds: &Aabb, triangles: impl Iterator<Item = [Vec3; 3]>) -> Result<Self> {
        let pixel = f64::from(pixel);
        let mut areas = DVec3::ZERO;
        let mut count = 0;
        for corners in triangles {
            let [a, b, c] = corners.map(|corner| corner.as_dvec3());
            areas += 0.5 * (b - a).cross(c - a).abs();
            count += 1;
        }
        let view = |axis: usize| -> Result<AxisView> {
            let frame = ViewFrame::AXES[axis];
            let size = frame.coordinates(bounds.max - bounds.min);
            let [columns, rows] = [size.x, size.y].map(|length| (length / pixel).ceil().max(1.0));
            ensure!(
                columns * rows <= LARGEST_IMAGE as f64,
                "contact_resolution is {pixel} m: an image of {} x {} m would have {columns} x {rows} pixels, at most {LARGEST_IMAGE} are possible",
                size.x,
                size.y
            );
            // Even the smallest image can show each triangle once.
            let pixels = (RESERVE * columns * rows) as usize + 1;
            let crossings = (RESERVE * areas.dot(frame.forward) / (pixel * pixel)) as usize + count;
            Ok(AxisView {
                axis,
                frame,
                pixels,
                layers: Layers::reserved(pixels, crossings)?,
                projection: None,
            })
        };
        Ok(Self {
            pixel,
            views: [view(0)?, view(1)?, view(2)?],
        })
    }

    /// Draws the part of a surface inside `part`, with the smallest pixels that fit into memory. `whole` bounds the
    /// whole surface.
    pub fn draw(&mut self, whole: &Aabb, part: &Aabb, count: usize, corners: impl Fn(usize) -> [Vec3; 3]) {
        for view in &mut self.views {
            view.draw(self.pixel, whole, part, count, &corners);
        }
    }

    /// Visits the triangles seen within `reach` of a box. Some are visited more than once.
    pub fn near(&self, bounds: &Aabb, reach: f32, mut visit: impl FnMut(usize)) {
        for view in &self.views {
            let mut recent = [u32::MAX; RECENT];
            let mut next = 0;
            view.near(bounds, f64::from(reach), |crossing| {
                let triangle = crossing.triangle();
                if !recent.contains(&triangle) {
                    recent[next % RECENT] = triangle;
                    next += 1;
                    visit(triangle as usize);
                }
            });
        }
    }
}

impl AxisView {
    fn draw(&mut self, mut pixel: f64, whole: &Aabb, part: &Aabb, count: usize, corners: &impl Fn(usize) -> [Vec3; 3]) {
        let corners_of = |bounds: &Aabb| [bounds.min, bounds.max].map(|corner| self.frame.coordinates(corner));
        let (whole, [low, high]) = (corners_of(whole), corners_of(part));
        self.projection = None;
        if !low.cmple(high).all() {
            return;
        }
        loop {
            let fits = Projection::fits([low, high], whole, pixel, self.pixels);
            if fits
                && let Ok(projection) = Projection::new(self.frame, low, high, pixel)
                && self.layers.draw(&projection, count, &|triangle| {
                    drawn_corners(&projection, self.axis, corners(triangle))
                })
            {
                self.projection = Some(projection);
                return;
            }
            if !pixel.is_finite() || fits && Projection::fits([low, high], whole, pixel, 1) {
                return;
            }
            pixel *= 2.0;
        }
    }

    fn near(&self, bounds: &Aabb, reach: f64, mut visit: impl FnMut(&RayCrossing)) {
        let Some(projection) = self.projection.as_ref().filter(|_| !self.layers.is_empty()) else {
            return;
        };
        // A nearby triangle may be seen a pixel beside its position. It is then higher or lower by at most this,
        // since its slope is below 55 degrees.
        let margin = DVec3::new(1.0, 1.0, MAX_SLOPE) * projection.pixel + reach;
        let low = self.frame.coordinates(bounds.min) - margin;
        let high = self.frame.coordinates(bounds.max) + margin;
        let (min_depth, max_depth) = (low.z as f32, high.z as f32);
        let [columns, rows] = projection.pixel_ranges(low, high);
        for row in rows {
            for column in columns.clone() {
                let crossings = self.layers.at((row * projection.width + column) as usize);
                let from_nearest = crossings.iter().skip_while(|crossing| crossing.depth < min_depth);
                from_nearest
                    .take_while(|crossing| crossing.depth <= max_depth)
                    .for_each(&mut visit);
            }
        }
    }
}

/// Returns the corners of a triangle that is drawn along this axis. A small one that may lie between the rays is
/// moved by up to half a pixel in each direction, so that a ray hits it.
fn drawn_corners(projection: &Projection, axis: usize, corners: [Vec3; 3]) -> Option<[Vec3; 3]> {
    let [a, b, c] = corners;
    let normal = (b - a).cross(c - a).abs();
    if normal.max_position() != axis {
        return None;
    }
    if f64::from(normal[axis]) > SMALL * projection.pixel * projection.pixel {
        return Some(corners);
    }
    let offset = projection.offset_to_center((a + b + c) / 3.0);
    Some(corners.map(|corner| corner + offset))
}
