//! Input and output of the rasterizer.

/// The largest coordinate of a vertex, in pixels from the origin, for which integer coverage is exact.
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
    /// The distance from the left edge of the image, in pixels.
    pub x: f64,
    /// The distance from the upper edge, downward, in pixels.
    pub y: f64,
    /// The distance along the view direction, m.
    pub depth: f64,
    /// 1 / depth in a perspective view, 1 in an orthographic one. It makes weights and depth perspective-correct.
    pub reciprocal: f64,
}

/// A rectangle of pixels. `right` and `bottom` are exclusive.
///
/// ```
/// use sinew::raster::Window;
/// let window = Window::new(64, 48);
/// assert_eq!(window, Window { left: 0, top: 0, right: 64, bottom: 48 });
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// The first column.
    pub left: u32,
    /// The first row.
    pub top: u32,
    /// One past the last column.
    pub right: u32,
    /// One past the last row.
    pub bottom: u32,
}

impl Window {
    /// The window of a whole image.
    pub fn new(width: u32, height: u32) -> Self {
        Window {
            left: 0,
            top: 0,
            right: width,
            bottom: height,
        }
    }
}

/// A pixel of a triangle or a line.
///
/// ```
/// # use glam::Vec3;
/// use sinew::raster::{View, Window};
/// let view = View::orthographic(Vec3::ZERO, Vec3::NEG_Z, Vec3::Y, 100.0, 64, 48);
/// let mut depths = Vec::new();
/// let corners = [Vec3::NEG_Z, Vec3::new(0.1, 0.0, -1.0), Vec3::new(0.0, 0.1, -1.0)];
/// view.triangle(&Window::new(64, 48), corners, |fragment| depths.push(fragment.depth));
/// // Half of ten by ten pixels, at a depth of 1 m.
/// assert!((45..=55).contains(&depths.len()) && depths.iter().all(|depth| (depth - 1.0).abs() < 1e-6));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fragment {
    /// The column.
    pub x: u32,
    /// The row, downward.
    pub y: u32,
    /// The distance along the view direction at the pixel's center, m.
    pub depth: f32,
    /// The barycentric weights of the vertices in space, in the caller's order; their sum is 1. A line has two weights
    /// and a 0.
    pub weights: [f32; 3],
    /// True if the vertices are counter-clockwise in the image; true for a line.
    pub front: bool,
}

/// A test vertex in an orthographic view, at a depth of 1 m.
#[cfg(test)]
pub(super) fn vertex(x: f64, y: f64) -> PixelVertex {
    PixelVertex {
        x,
        y,
        depth: 1.0,
        reciprocal: 1.0,
    }
}
