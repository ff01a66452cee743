//! What goes into the rasteriser and what comes out.

/// How far from the origin, in pixels, a vertex may be for exact integer coverage.
pub const GUARD: f64 = 131_072.0;

/// A vertex in pixel coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelVertex {
    /// Pixels from the left edge of the picture.
    pub x: f64,
    /// Pixels from the upper edge, downwards.
    pub y: f64,
    /// Distance along the viewing direction, in metres.
    pub depth: f64,
    /// 1 / depth in a perspective view, 1 in an orthographic one: what makes weights and depth perspective-correct.
    pub reciprocal: f64,
}

/// A rectangle of pixels; the right column and the bottom row are outside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// First column.
    pub left: u32,
    /// First row.
    pub top: u32,
    /// One past the last column.
    pub right: u32,
    /// One past the last row.
    pub bottom: u32,
}

impl Window {
    /// The whole of a picture.
    pub fn new(width: u32, height: u32) -> Self {
        Window {
            left: 0,
            top: 0,
            right: width,
            bottom: height,
        }
    }
}

/// One pixel of a triangle or a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fragment {
    /// Column.
    pub x: u32,
    /// Row, downwards.
    pub y: u32,
    /// Distance along the viewing direction at the pixel's centre, in metres.
    pub depth: f32,
    /// Barycentric weights of the vertices in space, in the caller's order; their sum is 1. A line has two, then 0.
    pub weights: [f32; 3],
    /// Whether the vertices appear counter-clockwise to the viewer; true for a line.
    pub front: bool,
}
