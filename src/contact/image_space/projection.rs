//! Parallel projection from space to pixels, and limits of the image size.

use std::ops::Range;

use glam::{DVec2, DVec3, Vec3};

use crate::base::{Result, ensure};
use crate::codec::saved;
use crate::raster::{GUARD, PixelVertex, Window};

/// Maximum number of pixels of an image.
pub(super) const LARGEST_IMAGE: u64 = 1 << 24;

/// Axes of a parallel view and of its rows and columns: a right-handed orthonormal frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ViewFrame {
    pub right: DVec3,
    pub down: DVec3,
    pub forward: DVec3,
}

saved! { ViewFrame { right, down, forward } }

impl ViewFrame {
    /// Views along the coordinate axes.
    pub const AXES: [ViewFrame; 3] = [
        ViewFrame::new(DVec3::Y, DVec3::Z, DVec3::X),
        ViewFrame::new(DVec3::Z, DVec3::X, DVec3::Y),
        ViewFrame::new(DVec3::X, DVec3::Y, DVec3::Z),
    ];

    const fn new(right: DVec3, down: DVec3, forward: DVec3) -> Self {
        Self { right, down, forward }
    }

    /// Returns a view along a nonzero direction.
    pub fn along(direction: Vec3) -> Self {
        let forward = direction.as_dvec3().normalize();
        let (right, down) = forward.any_orthonormal_pair();
        let down = if right.cross(down).dot(forward) > 0.0 {
            down
        } else {
            -down
        };
        ViewFrame::new(right, down, forward)
    }

    /// Returns the coordinates right, down and forward.
    pub fn coordinates(&self, point: Vec3) -> DVec3 {
        let point = point.as_dvec3();
        DVec3::new(self.right.dot(point), self.down.dot(point), self.forward.dot(point))
    }
}

/// A parallel view of a rectangle, divided into square pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Projection {
    pub frame: ViewFrame,
    /// Right and down coordinate of the upper left corner, m.
    low: [f64; 2],
    /// Side of a pixel, m.
    pub pixel: f64,
    pixels_per_meter: f64,
    pub width: u32,
    pub height: u32,
}

saved! { Projection { frame, low, pixel, pixels_per_meter, width, height } }

impl Projection {
    /// Creates an image of the box from `low` to `high` in the frame's coordinates, at least one pixel large.
    ///
    /// Fails if it would have more than [`LARGEST_IMAGE`] pixels.
    pub fn new(frame: ViewFrame, low: DVec3, high: DVec3, pixel: f64) -> Result<Self> {
        let size = [high.x - low.x, high.y - low.y];
        let counts = size.map(|length| (length / pixel).ceil().max(1.0));
        ensure!(
            counts[0] * counts[1] <= LARGEST_IMAGE as f64 && counts[0].max(counts[1]) < GUARD / 2.0,
            "pixel is {pixel} m: an image of {} x {} m would have {} x {} pixels, at most {LARGEST_IMAGE} are possible",
            size[0],
            size[1],
            counts[0],
            counts[1]
        );
        let sum = [low.x + high.x, low.y + high.y];
        Ok(Self {
            frame,
            low: [0, 1].map(|i| (sum[i] - counts[i] * pixel) / 2.0),
            pixel,
            pixels_per_meter: 1.0 / pixel,
            width: counts[0] as u32,
            height: counts[1] as u32,
        })
    }

    /// True if an image of the box from `low` to `high` has at most `pixels` pixels, and all corners between
    /// `lowest` and `highest` can be drawn.
    pub fn fits([low, high]: [DVec3; 2], [lowest, highest]: [DVec3; 2], pixel: f64, pixels: usize) -> bool {
        let [columns, rows] = [high.x - low.x, high.y - low.y].map(|length| (length / pixel).ceil().max(1.0));
        let reach = (highest - lowest).truncate().max_element() / pixel;
        columns * rows <= pixels as f64 && reach < GUARD / 2.0
    }

    pub fn pixel_count(&self) -> usize {
        self.width as usize * self.height as usize
    }

    pub fn window(&self) -> Window {
        Window::new(self.width, self.height)
    }

    /// Returns the columns and rows of the pixels that a rectangle touches, given by its corners in the frame's
    /// coordinates.
    pub fn pixel_ranges(&self, low: DVec3, high: DVec3) -> [Range<u32>; 2] {
        let range = |low: f64, high: f64, count: u32| {
            let end = ((high * self.pixels_per_meter).floor() + 1.0).clamp(0.0, f64::from(count));
            (low * self.pixels_per_meter).floor().clamp(0.0, end) as u32..end as u32
        };
        let [left, top] = self.low;
        [
            range(low.x - left, high.x - left, self.width),
            range(low.y - top, high.y - top, self.height),
        ]
    }

    /// Projects a point to the image.
    pub fn project(&self, point: Vec3) -> PixelVertex {
        let coordinates = self.frame.coordinates(point);
        PixelVertex {
            x: (coordinates.x - self.low[0]) * self.pixels_per_meter,
            y: (coordinates.y - self.low[1]) * self.pixels_per_meter,
            depth: coordinates.z,
            reciprocal: 1.0,
        }
    }

    /// Returns the displacement from a point to the ray through the center of its pixel, m.
    pub fn offset_to_center(&self, point: Vec3) -> Vec3 {
        let vertex = self.project(point);
        let [right, down] = [vertex.x, vertex.y].map(|coordinate| (coordinate.floor() + 0.5 - coordinate) * self.pixel);
        (self.frame.right * right + self.frame.down * down).as_vec3()
    }

    /// Returns the center of a pixel, in pixels.
    pub fn center_of(&self, pixel: usize) -> DVec2 {
        let width = self.width as usize;
        DVec2::new((pixel % width) as f64 + 0.5, (pixel / width) as f64 + 0.5)
    }

    /// True if a projected point lies within the image.
    pub fn contains(&self, vertex: &PixelVertex) -> bool {
        let (width, height) = (f64::from(self.width), f64::from(self.height));
        vertex.x >= 0.0 && vertex.y >= 0.0 && vertex.x < width && vertex.y < height
    }

    /// Returns the pixel at these coordinates, or the nearest one of the image.
    pub fn pixel_at(&self, vertex: &PixelVertex) -> usize {
        let column = (vertex.x.max(0.0) as u32).min(self.width - 1);
        let row = (vertex.y.max(0.0) as u32).min(self.height - 1);
        row as usize * self.width as usize + column as usize
    }
}
