//! Rasterization of triangles.
//!
//! Coverage is exact: vertices are snapped to 1/4096 of a pixel, and edge functions (Pineda, "A parallel algorithm for
//! polygon rasterization", 1988) are evaluated in integers. The top-left rule decides for pixel centers on an edge.
//! Two triangles that share an edge therefore cover each pixel along it exactly once.

use super::fragment::{Fragment, GUARD, PixelVertex, Window};

const SUBPIXEL_BITS: u32 = 12;
const ONE: i64 = 1 << SUBPIXEL_BITS;
const HALF: i64 = ONE / 2;

/// Calls `sink` for each pixel of `window` whose center is inside the triangle, row by row, left to right.
///
/// Pixel (x, y) has its center at (x + 0.5, y + 0.5); y points down. `Fragment::front` is true if the vertices are
/// counter-clockwise in the image. A triangle has no fragments if it has no area, or a coordinate is not finite or
/// further than [`GUARD`] from the origin. [`View::triangle`](super::View::triangle) clips triangles first.
pub fn rasterise_triangle(window: &Window, vertices: &[PixelVertex; 3], mut sink: impl FnMut(Fragment)) {
    let [Some(a), Some(b), Some(c)] = [snap(&vertices[0]), snap(&vertices[1]), snap(&vertices[2])] else {
        return;
    };
    let signed_area = cross(a, b, c);
    if signed_area == 0 {
        return;
    }
    // With y down, counter-clockwise triangles have negative areas. Their corners are swapped to make the area
    // positive.
    let front = signed_area < 0;
    let (b, c) = if front { (c, b) } else { (b, c) };
    let order = if front { [0, 2, 1] } else { [0, 1, 2] };
    let [va, vb, vc] = order.map(|index| vertices[index]);
    let area = signed_area.unsigned_abs() as f64;

    let limit = GUARD as i64;
    let top = first_center(a.1.min(b.1).min(c.1)).max(i64::from(window.top));
    let bottom = last_center(a.1.max(b.1).max(c.1)).min(i64::from(window.bottom).min(limit) - 1);
    let left = first_center(a.0.min(b.0).min(c.0)).max(i64::from(window.left));
    let right = last_center(a.0.max(b.0).max(c.0)).min(i64::from(window.right).min(limit) - 1);
    if top > bottom || left > right {
        return;
    }

    // Each edge function is proportional to the weight of the opposite vertex.
    let mut edges = [
        EdgeFunction::new(b, c, left, top),
        EdgeFunction::new(c, a, left, top),
        EdgeFunction::new(a, b, left, top),
    ];
    let reciprocals = [va.reciprocal, vb.reciprocal, vc.reciprocal];
    let depths = [va.depth, vb.depth, vc.depth];
    let steps = [0, 1, 2].map(|i| edges[i].step_x as f64 / area * reciprocals[i]);
    let total_step = steps[0] + steps[1] + steps[2];
    let moment_step = dot(steps, depths);
    let width = right - left;
    for y in top..=bottom {
        let (first, last) = edges.iter().fold((0, width), |(first, last), edge| {
            let (from, to) = edge.span();
            (first.max(from), last.min(to))
        });
        if first <= last {
            // Weight over depth is linear in the image, also in perspective.
            let starts = [0, 1, 2].map(|i| edges[i].value as f64 / area * reciprocals[i]);
            let total = starts[0] + starts[1] + starts[2];
            let moment = dot(starts, depths);
            for x in first..=last {
                let offset = x as f64;
                let scale = 1.0 / (total + offset * total_step);
                let depth = (moment + offset * moment_step) * scale;
                let [wa, wb, wc] = [0, 1, 2].map(|i| ((starts[i] + offset * steps[i]) * scale) as f32);
                sink(Fragment {
                    x: (left + x) as u32,
                    y: y as u32,
                    depth: depth as f32,
                    weights: if front { [wa, wc, wb] } else { [wa, wb, wc] },
                    front,
                });
            }
        }
        for edge in &mut edges {
            edge.value += edge.step_y;
        }
    }
}

/// An edge function along the rows, positive inside.
struct EdgeFunction {
    /// The value at the leftmost pixel center of the current row.
    value: i64,
    step_x: i64,
    step_y: i64,
    /// The least value that counts as inside: 0 on a top or left edge, 1 elsewhere.
    least: i64,
}

impl EdgeFunction {
    fn new(from: (i64, i64), to: (i64, i64), left: i64, top: i64) -> Self {
        let (dx, dy) = (to.0 - from.0, to.1 - from.1);
        let top_or_left = dy < 0 || (dy == 0 && dx > 0);
        EdgeFunction {
            value: cross(from, to, (left * ONE + HALF, top * ONE + HALF)),
            step_x: -dy * ONE,
            step_y: dx * ONE,
            least: i64::from(!top_or_left),
        }
    }

    /// The range of pixels of the current row that are inside, relative to the leftmost; first > last if it is empty.
    fn span(&self) -> (i64, i64) {
        let deficit = self.least - self.value;
        match self.step_x {
            0 if deficit <= 0 => (i64::MIN, i64::MAX),
            0 => (i64::MAX, i64::MIN),
            step if step > 0 => (-(-deficit).div_euclid(step), i64::MAX),
            step => (i64::MIN, (-deficit).div_euclid(-step)),
        }
    }
}

/// Converts to fixed point; `None` if a coordinate is not finite or beyond the guard band.
fn snap(vertex: &PixelVertex) -> Option<(i64, i64)> {
    let inside = vertex.x.abs() <= GUARD && vertex.y.abs() <= GUARD;
    let usable = inside && vertex.depth.is_finite() && vertex.reciprocal.is_finite();
    let fixed = |value: f64| (value * ONE as f64).round() as i64;
    usable.then(|| (fixed(vertex.x), fixed(vertex.y)))
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Twice the signed area of a, b, c.
fn cross(a: (i64, i64), b: (i64, i64), c: (i64, i64)) -> i64 {
    (b.0 - a.0) * (c.1 - a.1) - (b.1 - a.1) * (c.0 - a.0)
}

/// The first pixel whose center is not before `fixed`.
fn first_center(fixed: i64) -> i64 {
    -(HALF - fixed).div_euclid(ONE)
}

/// The last pixel whose center is not after `fixed`.
fn last_center(fixed: i64) -> i64 {
    (fixed - HALF).div_euclid(ONE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::fragment::vertex;

    fn covered(size: u32, vertices: [PixelVertex; 3]) -> Vec<(u32, u32)> {
        let mut pixels = Vec::new();
        rasterise_triangle(&Window::new(size, size), &vertices, |fragment| {
            pixels.push((fragment.x, fragment.y));
        });
        pixels
    }

    #[test]
    fn centres_on_top_and_left_edges_are_inside_the_others_are_not() {
        // The legs pass through pixel centers. Top and left ones count; those on the hypotenuse do not.
        let pixels = covered(8, [vertex(0.5, 0.5), vertex(3.5, 0.5), vertex(0.5, 3.5)]);
        assert_eq!(pixels, [(0, 0), (1, 0), (2, 0), (0, 1), (1, 1), (0, 2)]);
    }

    #[test]
    fn orientation_is_counter_clockwise_as_seen() {
        let mut fronts = Vec::new();
        let counter_clockwise = [vertex(0.0, 4.0), vertex(4.0, 4.0), vertex(0.0, 0.0)];
        let [a, b, c] = counter_clockwise;
        for triangle in [counter_clockwise, [a, c, b]] {
            let mut front = None;
            rasterise_triangle(&Window::new(4, 4), &triangle, |fragment| {
                front = Some(fragment.front);
            });
            fronts.push(front);
        }
        assert_eq!(fronts, [Some(true), Some(false)]);
    }

    #[test]
    fn weights_follow_the_callers_order() {
        for triangle in [
            [vertex(0.0, 0.0), vertex(100.0, 0.0), vertex(0.0, 100.0)],
            [vertex(0.0, 0.0), vertex(0.0, 100.0), vertex(100.0, 0.0)],
        ] {
            rasterise_triangle(&Window::new(100, 100), &triangle, |fragment| {
                let at = |coordinate: fn(&PixelVertex) -> f64| -> f64 {
                    (0..3)
                        .map(|i| f64::from(fragment.weights[i]) * coordinate(&triangle[i]))
                        .sum()
                };
                assert!((at(|v| v.x) - f64::from(fragment.x) - 0.5).abs() < 1e-4);
                assert!((at(|v| v.y) - f64::from(fragment.y) - 0.5).abs() < 1e-4);
            });
        }
    }

    #[test]
    fn a_window_clips_to_its_own_pixels() {
        let triangle = [vertex(-50.0, -3.0), vertex(90.0, 10.0), vertex(5.0, 70.0)];
        let all = covered(64, triangle);
        let window = Window {
            left: 7,
            top: 20,
            right: 31,
            bottom: 33,
        };
        let mut part = Vec::new();
        rasterise_triangle(&window, &triangle, |f| part.push((f.x, f.y)));
        let expected: Vec<_> = all
            .into_iter()
            .filter(|(x, y)| (7..31).contains(x) && (20..33).contains(y))
            .collect();
        assert!(!part.is_empty());
        assert_eq!(part, expected);
    }

    #[test]
    fn an_invalid_triangle_has_no_fragments() {
        let good = vertex(1.0, 1.0);
        for bad in [
            vertex(f64::NAN, 0.0),
            vertex(f64::INFINITY, 0.0),
            vertex(1e30, 0.0),
            good,
        ] {
            assert!(covered(8, [good, bad, vertex(5.0, 7.0)]).is_empty());
        }
    }
}
