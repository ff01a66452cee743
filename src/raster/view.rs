//! Projection from space to pixels.

use super::fragment::{Fragment, GUARD, PixelVertex, Window};
use super::line::rasterise_line;
use super::triangle::rasterise_triangle;
use glam::{DVec3, Vec3};

/// A perspective or orthographic projection to a grid of pixels, with depth.
///
/// ```
/// # use glam::Vec3;
/// use sinew::raster::View;
/// let view = View::orthographic(Vec3::ZERO, Vec3::NEG_Z, Vec3::Y, 100.0, 64, 48);
/// let place = Vec3::new(0.1, 0.05, -2.0);
/// let vertex = view.project(place).expect("it is in front");
/// assert!(view.unproject(vertex.x, vertex.y, vertex.depth).distance(place) < 1e-6);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    origin: DVec3,
    right: DVec3,
    up: DVec3,
    forward: DVec3,
    centre: [f64; 2],
    /// Pixels per meter: at depth 1 in perspective, at any depth otherwise.
    scale: f64,
    near: f64,
    perspective: bool,
}

/// A point in homogeneous pixel coordinates. All clipping planes are linear in it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Homogeneous {
    x: f64,
    y: f64,
    w: f64,
    depth: f64,
}

/// A corner of a clipped polygon, with the barycentric weights of the original triangle or line.
#[derive(Clone, Copy, Default)]
struct ClippedCorner {
    point: Homogeneous,
    weights: [f64; 3],
}

/// A triangle clipped by five planes has at most eight corners.
const MAX_CORNERS: usize = 8;

impl View {
    /// An orthographic projection with `width` x `height` pixels.
    ///
    /// `origin` is projected to the center of the image and has depth 0; points behind it are clipped. `forward` is
    /// the view direction and `up` the direction that points up in the image; an `up` parallel to `forward` is
    /// replaced. `pixels_per_metre` is the scale. With a zero or non-finite direction or scale, nothing is visible.
    pub fn orthographic(origin: Vec3, forward: Vec3, up: Vec3, pixels_per_metre: f64, width: u32, height: u32) -> Self {
        View::new(origin, forward, up, pixels_per_metre, [width, height], 0.0, false)
    }

    /// A perspective view; `focal_length` is in pixels, `near` in meters.
    pub(crate) fn perspective(
        origin: Vec3,
        forward: Vec3,
        up: Vec3,
        focal_length: f64,
        size: [u32; 2],
        near: f64,
    ) -> Self {
        View::new(origin, forward, up, focal_length, size, near, true)
    }

    fn new(origin: Vec3, forward: Vec3, up: Vec3, scale: f64, size: [u32; 2], near: f64, perspective: bool) -> Self {
        let [right, up, forward] = axes(forward, up);
        View {
            origin: origin.as_dvec3(),
            right,
            up,
            forward,
            centre: size.map(|length| f64::from(length) / 2.0),
            scale,
            near,
            perspective,
        }
    }

    /// The pixel coordinates of a point; `None` if it is in front of the near plane or not finite.
    pub fn project(&self, point: Vec3) -> Option<PixelVertex> {
        let point = self.transform(point);
        (point.depth >= self.near && point.is_finite()).then(|| point.divide(self.perspective))
    }

    /// The point of space with these pixel coordinates and depth.
    pub fn unproject(&self, x: f64, y: f64, depth: f64) -> Vec3 {
        let meters_per_unit = if self.perspective { depth } else { 1.0 } / self.scale;
        let rightward = self.right * ((x - self.centre[0]) * meters_per_unit);
        let upwards = self.up * ((self.centre[1] - y) * meters_per_unit);
        (self.origin + rightward + upwards + self.forward * depth).as_vec3()
    }

    /// Calls `sink` for each pixel that a triangle covers, like [`rasterise_triangle`], after clipping.
    ///
    /// [`Fragment::weights`] refer to `points`, even for a clipped triangle. A triangle with a point that is not
    /// finite has no fragments.
    pub fn triangle(&self, window: &Window, points: [Vec3; 3], sink: impl FnMut(Fragment)) {
        self.transformed_triangle(window, points.map(|point| self.transform(point)), sink);
    }

    /// Calls `sink` for each pixel of a line, like [`rasterise_line`], after clipping at the near plane.
    pub fn line(&self, window: &Window, points: [Vec3; 2], mut sink: impl FnMut(Fragment)) {
        let [a, b] = points.map(|point| self.transform(point));
        if !a.is_finite() || !b.is_finite() {
            return;
        }
        let corners = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let [mut a, mut b] =
            [(a, corners[0]), (b, corners[1])].map(|(point, weights)| ClippedCorner { point, weights });
        let distance = |corner: &ClippedCorner| corner.point.depth - self.near;
        match (distance(&a) < 0.0, distance(&b) < 0.0) {
            (true, true) => return,
            (true, false) => a = b.towards(&a, distance(&b), distance(&a)),
            (false, true) => b = a.towards(&b, distance(&a), distance(&b)),
            (false, false) => {}
        }
        let ends = [a, b].map(|corner| corner.point.divide(self.perspective));
        rasterise_line(window, &ends, |fragment| {
            sink(with_original_weights(fragment, [&a, &b, &ClippedCorner::default()]));
        });
    }

    /// The first step of [`View::triangle`], for callers that draw a vertex several times.
    pub(crate) fn transform(&self, point: Vec3) -> Homogeneous {
        let offset = point.as_dvec3() - self.origin;
        let depth = offset.dot(self.forward);
        let w = if self.perspective { depth } else { 1.0 };
        Homogeneous {
            x: self.scale * offset.dot(self.right) + self.centre[0] * w,
            y: self.centre[1] * w - self.scale * offset.dot(self.up),
            w,
            depth,
        }
    }

    /// [`View::triangle`] for points transformed by [`View::transform`].
    pub(crate) fn transformed_triangle(
        &self,
        window: &Window,
        points: [Homogeneous; 3],
        mut sink: impl FnMut(Fragment),
    ) {
        if is_outside(window, &points) {
            return;
        }
        if points.iter().all(|point| self.planes(point).iter().all(|&d| d >= 0.0)) {
            let vertices = points.map(|point| point.divide(self.perspective));
            rasterise_triangle(window, &vertices, sink);
            return;
        }
        if !points.iter().all(Homogeneous::is_finite) {
            return;
        }
        let mut polygon = [ClippedCorner::default(); MAX_CORNERS];
        for (i, &point) in points.iter().enumerate() {
            polygon[i].point = point;
            polygon[i].weights[i] = 1.0;
        }
        let mut count = 3;
        for plane in 0..5 {
            (polygon, count) = clip(&polygon[..count], |corner| self.planes(&corner.point)[plane]);
        }
        for i in 2..count {
            let corners = [&polygon[0], &polygon[i - 1], &polygon[i]];
            // Clipped corners are on the guard band except for rounding.
            let vertices = corners.map(|corner| {
                let vertex = corner.point.divide(self.perspective);
                PixelVertex {
                    x: vertex.x.clamp(-GUARD, GUARD),
                    y: vertex.y.clamp(-GUARD, GUARD),
                    ..vertex
                }
            });
            rasterise_triangle(window, &vertices, |fragment| {
                sink(with_original_weights(fragment, corners));
            });
        }
    }

    /// Scaled signed distances from the near plane and the four sides of the guard band, negative outside.
    fn planes(&self, point: &Homogeneous) -> [f64; 5] {
        let guard = GUARD * point.w;
        [
            point.depth - self.near,
            guard + point.x,
            guard - point.x,
            guard + point.y,
            guard - point.y,
        ]
    }

    /// The size of a pixel at this depth, m.
    pub(crate) fn meters_per_pixel(&self, depth: f64) -> f64 {
        if self.perspective { depth } else { 1.0 }.abs() / self.scale
    }

    /// The position of the camera, or the origin of an orthographic view, m.
    pub(crate) fn origin(&self) -> DVec3 {
        self.origin
    }

    /// The unit vectors right, up and forward.
    pub(crate) fn axes(&self) -> [DVec3; 3] {
        [self.right, self.up, self.forward]
    }
}

impl Homogeneous {
    fn is_finite(&self) -> bool {
        self.x.is_finite() && self.y.is_finite() && self.w.is_finite() && self.depth.is_finite()
    }

    fn divide(&self, perspective: bool) -> PixelVertex {
        PixelVertex {
            x: self.x / self.w,
            y: self.y / self.w,
            depth: self.depth,
            reciprocal: if perspective { 1.0 / self.depth } else { 1.0 },
        }
    }
}

impl ClippedCorner {
    /// The intersection of a plane with the segment from here, at the distance `inside`, to `other`, at the distance
    /// `outside` < 0. It is always computed from the inside, so that two triangles clip their common edge at the same
    /// point.
    fn towards(&self, other: &ClippedCorner, inside: f64, outside: f64) -> ClippedCorner {
        let t = inside / (inside - outside);
        let mix = |from: f64, to: f64| from + t * (to - from);
        let (a, b) = (&self.point, &other.point);
        ClippedCorner {
            point: Homogeneous {
                x: mix(a.x, b.x),
                y: mix(a.y, b.y),
                w: mix(a.w, b.w),
                depth: mix(a.depth, b.depth),
            },
            weights: [0, 1, 2].map(|i| mix(self.weights[i], other.weights[i])),
        }
    }
}

/// True if all points are outside of the same side of a window. The test is linear, like clipping, so it also holds
/// behind the eye.
fn is_outside(window: &Window, points: &[Homogeneous; 3]) -> bool {
    let all = |outside: &dyn Fn(&Homogeneous) -> bool| points.iter().all(outside);
    let [left, top] = [window.left, window.top].map(f64::from);
    let [right, bottom] = [window.right, window.bottom].map(f64::from);
    all(&|point| point.y < top * point.w)
        || all(&|point| point.y > bottom * point.w)
        || all(&|point| point.x < left * point.w)
        || all(&|point| point.x > right * point.w)
}

/// Clips a convex polygon at a plane (Sutherland and Hodgman, 1974).
fn clip(polygon: &[ClippedCorner], distance: impl Fn(&ClippedCorner) -> f64) -> ([ClippedCorner; MAX_CORNERS], usize) {
    let mut result = [ClippedCorner::default(); MAX_CORNERS];
    let mut count = 0;
    let mut push = |corner: ClippedCorner| {
        if let Some(slot) = result.get_mut(count) {
            *slot = corner;
            count += 1;
        }
    };
    for (i, current) in polygon.iter().enumerate() {
        let previous = &polygon[(i + polygon.len() - 1) % polygon.len()];
        let (current_distance, previous_distance) = (distance(current), distance(previous));
        match (previous_distance >= 0.0, current_distance >= 0.0) {
            (true, true) => push(*current),
            (true, false) => push(previous.towards(current, previous_distance, current_distance)),
            (false, true) => {
                push(current.towards(previous, current_distance, previous_distance));
                push(*current);
            }
            (false, false) => {}
        }
    }
    (result, count)
}

/// A fragment of a clipped piece, with the weights of the original.
fn with_original_weights(fragment: Fragment, corners: [&ClippedCorner; 3]) -> Fragment {
    let weight = |i: usize| -> f32 {
        (0..3)
            .map(|k| f64::from(fragment.weights[k]) * corners[k].weights[i])
            .sum::<f64>() as f32
    };
    Fragment {
        weights: [weight(0), weight(1), weight(2)],
        ..fragment
    }
}

/// The orthonormal vectors right, up and forward of a viewer. If `up` is parallel to the view direction, it is
/// replaced by the axis most perpendicular to it.
pub(crate) fn axes(forward: Vec3, up: Vec3) -> [DVec3; 3] {
    let forward = forward.as_dvec3().normalize_or_zero();
    let up = up.as_dvec3().normalize_or_zero();
    let mut right = forward.cross(up);
    if right.length_squared() < 1e-10 {
        let size = forward.abs();
        let replacement = if size.z <= size.x && size.z <= size.y {
            DVec3::Z
        } else if size.x <= size.y {
            DVec3::X
        } else {
            DVec3::Y
        };
        // Seen from above, far is up: -z before +z, like a right-handed floor plan.
        right = forward.cross(-replacement);
    }
    let right = right.normalize_or_zero();
    [right, right.cross(forward), forward]
}
