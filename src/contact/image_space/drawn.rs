//! A surface that changes its shape, drawn along the three axes where others are near, and what of it is seen beside them.

use glam::{DVec3, Vec3};

use super::layers::{Layers, RayCrossing};
use super::projection::{Frame, LARGEST_IMAGE, Projection};
use crate::base::{Result, ensure};
use crate::codec::saved;
use crate::geometry::Bounds;

/// Room for how many times the pixels and the crossings that a surface has when it is made: it may be stretched.
const STRETCHED: f64 = 1.5;

/// A triangle with this many times half the area of a pixel may lie between the rays.
const SMALL: f64 = 4.0;

/// By how many pixels a triangle may rise a pixel aside, along both rows and columns.
const LEAN: f64 = 2.0;

/// A triangle that was shown is not shown again before so many others are.
const RECENT: usize = 16;

/// A surface in memory that was reserved for it, each triangle seen along the axis that sees it the most squarely.
#[derive(Debug)]
pub(crate) struct Drawn {
    /// Metres.
    pixel: f64,
    views: [AxisView; 3],
}

saved! { Drawn { pixel, views } }

#[derive(Debug)]
struct AxisView {
    /// Along which axis it looks.
    axis: usize,
    frame: Frame,
    pixels: usize,
    layers: Layers,
    /// Nothing where nothing is near.
    projection: Option<Projection>,
}

saved! { AxisView { axis, frame, pixels, layers, projection } }

impl Drawn {
    /// Room for a surface like this one, in pixels of `pixel` metres.
    ///
    /// Errors: [`Error::InvalidArgument`] where an image would have more than 2^24 pixels, [`Error::OutOfMemory`].
    pub fn reserved(pixel: f32, bounds: &Bounds, triangles: impl Iterator<Item = [Vec3; 3]>) -> Result<Self> {
        let pixel = f64::from(pixel);
        let mut areas = DVec3::ZERO;
        let mut count = 0;
        for corners in triangles {
            let [a, b, c] = corners.map(|corner| corner.as_dvec3());
            areas += 0.5 * (b - a).cross(c - a).abs();
            count += 1;
        }
        let view = |axis: usize| -> Result<AxisView> {
            let frame = Frame::AXES[axis];
            let size = frame.coordinates(bounds.max - bounds.min);
            let [columns, rows] = [size.x, size.y].map(|length| (length / pixel).ceil().max(1.0));
            ensure!(
                columns * rows <= LARGEST_IMAGE as f64,
                "contact_resolution is {pixel} m: an image of {} x {} m would have {columns} x {rows} pixels, at most {LARGEST_IMAGE} are possible",
                size.x,
                size.y
            );
            // No image is so small that each triangle could not be seen once.
            let pixels = (STRETCHED * columns * rows) as usize + 1;
            let crossings = (STRETCHED * areas.dot(frame.forward) / (pixel * pixel)) as usize + count;
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

    /// Draws the part of a surface, all of which lies within `whole`, that lies within `part`, in pixels as small as there is room for.
    pub fn draw(&mut self, whole: &Bounds, part: &Bounds, count: usize, corners: impl Fn(usize) -> [Vec3; 3]) {
        for view in &mut self.views {
            view.draw(self.pixel, whole, part, count, &corners);
        }
    }

    /// Shows the triangles that are seen within `reach` of a box; some of them more than once.
    pub fn near(&self, bounds: &Bounds, reach: f32, mut see: impl FnMut(usize)) {
        for view in &self.views {
            let mut recent = [u32::MAX; RECENT];
            let mut next = 0;
            view.near(bounds, f64::from(reach), |crossing| {
                let triangle = crossing.triangle();
                if !recent.contains(&triangle) {
                    recent[next % RECENT] = triangle;
                    next += 1;
                    see(triangle as usize);
                }
            });
        }
    }
}

impl AxisView {
    fn draw(
        &mut self,
        mut pixel: f64,
        whole: &Bounds,
        part: &Bounds,
        count: usize,
        corners: &impl Fn(usize) -> [Vec3; 3],
    ) {
        let ends = |bounds: &Bounds| [bounds.min, bounds.max].map(|corner| self.frame.coordinates(corner));
        let (whole, [low, high]) = (ends(whole), ends(part));
        self.projection = None;
        if !low.cmple(high).all() {
            return;
        }
        loop {
            let fits = Projection::fits([low, high], whole, pixel, self.pixels);
            if fits
                && let Ok(projection) = Projection::new(self.frame, low, high, pixel)
                && self.layers.draw(&projection, count, &|triangle| {
                    seen(&projection, self.axis, corners(triangle))
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

    fn near(&self, bounds: &Bounds, reach: f64, mut see: impl FnMut(&RayCrossing)) {
        let Some(projection) = self.projection.as_ref().filter(|_| !self.layers.is_empty()) else {
            return;
        };
        // What is near may be seen a pixel beside it, and then it is up to so much higher or lower: it leans by less than 55 degrees.
        let beside = DVec3::new(1.0, 1.0, LEAN) * projection.pixel + reach;
        let low = self.frame.coordinates(bounds.min) - beside;
        let high = self.frame.coordinates(bounds.max) + beside;
        let (nearest, furthest) = (low.z as f32, high.z as f32);
        let [columns, rows] = projection.touched(low, high);
        for row in rows {
            for column in columns.clone() {
                let crossings = self.layers.at((row * projection.width + column) as usize);
                let behind = crossings.iter().skip_while(|crossing| crossing.depth < nearest);
                behind
                    .take_while(|crossing| crossing.depth <= furthest)
                    .for_each(&mut see);
            }
        }
    }
}

/// The corners of a triangle along whose axis an image looks, for it to be seen. One that may lie between the rays is moved, by half a pixel at
/// most each way, so that one passes it.
fn seen(projection: &Projection, axis: usize, corners: [Vec3; 3]) -> Option<[Vec3; 3]> {
    let [a, b, c] = corners;
    let across = (b - a).cross(c - a).abs();
    if across.max_position() != axis {
        return None;
    }
    if f64::from(across[axis]) > SMALL * projection.pixel * projection.pixel {
        return Some(corners);
    }
    let aside = projection.way_to_middle((a + b + c) / 3.0);
    Some(corners.map(|corner| corner + aside))
}
