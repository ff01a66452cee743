//! What goes into the rasteriser and what comes out.

/// How far from the origin, in pixels, a vertex may be for exact integer coverage.
pub const GUARD: f64 = 131_072.0;

/// A vertex in pixel coordinates.
///
/// ```
/// # use glam::Vec3;
/// use sinew::raster::View;
/// let view = View::orthographic(Vec3::ZERO, Vec3::NEG_Z, Vec3::Y, 100.0, 64, 48);
/// let vertex = view.project(Vec3::new(0.1, 0.0, -2.0)).expect("it is in front");
/// assert!((vertex.x - 42.0).abs() < 1e-4 && (vertex.depth - 2.0).abs() < 1e-9);
/// ```
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
///
/// ```
/// use sinew::raster::Window;
/// let window = Window::new(64, 48);
/// assert_eq!(window, Window { left: 0, top: 0, right: 64, bottom: 48 });
/// ```
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
///
/// ```
/// # use glam::Vec3;
/// use sinew::raster::{View, Window};
/// let view = View::orthographic(Vec3::ZERO, Vec3::NEG_Z, Vec3::Y, 100.0, 64, 48);
/// let mut depths = Vec::new();
/// let corners = [Vec3::NEG_Z, Vec3::new(0.1, 0.0, -1.0), Vec3::new(0.0, 0.1, -1.0)];
/// view.triangle(&Window::new(64, 48), corners, |fragment| depths.push(fragment.depth));
/// // Half of ten by ten pixels, 1 m away.
/// assert!((45..=55).contains(&depths.len()) && depths.iter().all(|depth| (depth - 1.0).abs() < 1e-6));
/// ```
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

/// For tests: in an orthographic view, 1 m away.
#[cfg(test)]
pub(super) fn vertex(x: f64, y: f64) -> PixelVertex {
    PixelVertex {
        x,
        y,
        depth: 1.0,
        reciprocal: 1.0,
    }
}
