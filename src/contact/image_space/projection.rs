//! From space to the pixels of a parallel view, and how large such an image may be.

use std::ops::Range;

use glam::{DVec2, DVec3, Vec3};

use crate::base::{Result, ensure};
use crate::codec::saved;
use crate::raster::{GUARD, PixelVertex, Window};

/// The most pixels of one image.
pub(super) const LARGEST_IMAGE: u64 = 1 << 24;

/// Where a parallel view looks, and which way its rows and columns run; a right-handed orthonormal frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Frame {
    pub right: DVec3,
    pub down: DVec3,
    pub forward: DVec3,
}

saved! { Frame { right, down, forward } }

impl Frame {
    /// Along the axes of space.
    pub const AXES: [Frame; 3] = [
        Frame::new(DVec3::Y, DVec3::Z, DVec3::X),
        Frame::new(DVec3::Z, DVec3::X, DVec3::Y),
        Frame::new(DVec3::X, DVec3::Y, DVec3::Z),
    ];

    const fn new(right: DVec3, down: DVec3, forward: DVec3) -> Self {
        Self { right, down, forward }
    }

    /// Along a direction that is not zero.
    pub fn along(direction: Vec3) -> Self {
        let forward = direction.as_dvec3().normalize();
        let (right, down) = forward.any_orthonormal_pair();
        let down = if right.cross(down).dot(forward) > 0.0 {
            down
        } else {
            -down
        };
        Frame::new(right, down, forward)
    }

    /// Right, down, forward.
    pub fn coordinates(&self, point: Vec3) -> DVec3 {
        let point = point.as_dvec3();
        DVec3::new(self.right.dot(point), self.down.dot(point), self.forward.dot(point))
    }
}

/// A parallel view of a rectangle of space, cut into square pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Projection {
    pub frame: Frame,
    /// Right and down, of the upper left corner, m.
    low: [f64; 2],
    /// Metres.
    pub pixel: f64,
    per_metre: f64,
    pub width: u32,
    pub height: u32,
}

saved! { Projection { frame, low, pixel, per_metre, width, height } }

impl Projection {
    /// An image of what lies between `low` and `high`, in the coordinates of the frame, at least a pixel large.
    ///
    /// Refused where it would have more than [`LARGEST_IMAGE`] pixels.
    pub fn new(frame: Frame, low: DVec3, high: DVec3, pixel: f64) -> Result<Self> {
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
        let middle = [low.x + high.x, low.y + high.y];
        Ok(Self {
            frame,
            low: [0, 1].map(|i| (middle[i] - counts[i] * pixel) / 2.0),
            pixel,
            per_metre: 1.0 / pixel,
            width: counts[0] as u32,
            height: counts[1] as u32,
        })
    }

    /// Whether an image of what lies between `low` and `high` has at most so many pixels, and all corners of what lies
    /// between `lowest` and `highest` can be drawn.
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

    /// The columns and rows of the pixels that a rectangle touches, given by its corners in the coordinates of the frame.
    pub fn touched(&self, low: DVec3, high: DVec3) -> [Range<u32>; 2] {
        let side = |low: f64, high: f64, count: u32| {
            let end = ((high * self.per_metre).floor() + 1.0).clamp(0.0, f64::from(count));
            (low * self.per_metre).floor().clamp(0.0, end) as u32..end as u32
        };
        let [left, top] = self.low;
        [
            side(low.x - left, high.x - left, self.width),
            side(low.y - top, high.y - top, self.height),
        ]
    }

    /// Where a point falls.
    pub fn project(&self, point: Vec3) -> PixelVertex {
        let at = self.frame.coordinates(point);
        PixelVertex {
            x: (at.x - self.low[0]) * self.per_metre,
            y: (at.y - self.low[1]) * self.per_metre,
            depth: at.z,
            reciprocal: 1.0,
        }
    }

    /// From a point to the ray in the middle of its pixel, m.
    pub fn way_to_middle(&self, point: Vec3) -> Vec3 {
        let vertex = self.project(point);
        let [right, down] = [vertex.x, vertex.y].map(|at| (at.floor() + 0.5 - at) * self.pixel);
        (self.frame.right * right + self.frame.down * down).as_vec3()
    }

    /// The middle of a pixel, in pixels.
    pub fn middle_of(&self, pixel: usize) -> DVec2 {
        let width = self.width as usize;
        DVec2::new((pixel % width) as f64 + 0.5, (pixel / width) as f64 + 0.5)
    }

    /// Whether what falls there is within the image.
    pub fn shows(&self, vertex: &PixelVertex) -> bool {
        let (width, height) = (f64::from(self.width), f64::from(self.height));
        vertex.x >= 0.0 && vertex.y >= 0.0 && vertex.x < width && vertex.y < height
    }

    /// The pixel of these coordinates, or the nearest one of the image.
    pub fn pixel_at(&self, vertex: &PixelVertex) -> usize {
        let column = (vertex.x.max(0.0) as u32).min(self.width - 1);
        let row = (vertex.y.max(0.0) as u32).min(self.height - 1);
        row as usize * self.width as usize + column as usize
    }
}
