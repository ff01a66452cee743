//! Traversal of all pixels that a line passes through.

use super::fragment::{PixelVertex, Window};

/// Calls `sink` with the column and row of each pixel of `window` that a line passes through, and the interval of the
/// projected line's parameter, 0 to 1, in the pixel (Amanatides, Woo, "A fast voxel traversal algorithm for ray
/// tracing", 1987).
///
/// Pixels are in the order of the line; each interval begins where the previous one ends. A point, or a line toward
/// the viewer, is in one pixel from 0 to 1. A line with a coordinate that is not finite is in no pixel.
pub fn traverse_line(window: &Window, vertices: &[PixelVertex; 2], mut sink: impl FnMut(u32, u32, [f64; 2])) {
    let start = [vertices[0].x, vertices[0].y];
    let direction = [vertices[1].x - start[0], vertices[1].y - start[1]];
    let first = [window.left, window.top];
    let end = [window.right, window.bottom];
    if !(start.iter().chain(&direction).all(|value| value.is_finite()) && first[0] < end[0] && first[1] < end[1]) {
        return;
    }
    let (mut from, mut to) = (0.0_f64, 1.0_f64);
    for i in 0..2 {
        let (low, high) = (f64::from(first[i]) - start[i], f64::from(end[i]) - start[i]);
        if direction[i] != 0.0 {
            let (a, b) = (low / direction[i], high / direction[i]);
            from = from.max(a.min(b));
            to = to.min(a.max(b));
        } else if !(low <= 0.0 && high > 0.0) {
            return;
        }
    }
    if !(from <= to) {
        return;
    }
    let pixel = |i: usize, t: f64| {
        let position = (start[i] + t * direction[i]).floor();
        position.clamp(f64::from(first[i]), f64::from(end[i] - 1)) as u32
    };
    let mut pixel_index = [pixel(0, from), pixel(1, from)];
    let last = [pixel(0, to), pixel(1, to)];
    // The parameter at which the line leaves the current column or row.
    let exit = |i: usize, pixel_index: u32| {
        if pixel_index == last[i] {
            return f64::INFINITY;
        }
        (f64::from(pixel_index + u32::from(direction[i] > 0.0)) - start[i]) / direction[i]
    };
    let mut next = [exit(0, pixel_index[0]), exit(1, pixel_index[1])];
    loop {
        let i = usize::from(next[1] < next[0]);
        let leaving = next[i].clamp(from, to);
        sink(pixel_index[0], pixel_index[1], [from, leaving]);
        if !next[i].is_finite() {
            return;
        }
        from = leaving;
        pixel_index[i] = if direction[i] > 0.0 {
            pixel_index[i] + 1
        } else {
            pixel_index[i] - 1
        };
        next[i] = exit(i, pixel_index[i]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use crate::raster::fragment::vertex;

    #[test]
    fn each_point_of_a_line_lies_in_the_pixel_with_its_parameter() {
        let window = Window {
            left: 3,
            top: 5,
            right: 40,
            bottom: 29,
        };
        let mut random = Random(3);
        let mut crossed = 0;
        for turn in 0..500 {
            let mut coordinate = || f64::from(random.unit()) * 60.0 - 10.0;
            let a = vertex(coordinate(), coordinate());
            let b = match turn % 4 {
                0 => vertex(a.x, coordinate()),
                1 => vertex(coordinate(), a.y),
                _ => vertex(coordinate(), coordinate()),
            };
            let mut intervals = Vec::new();
            traverse_line(&window, &[a, b], |x, y, interval| intervals.push((x, y, interval)));
            for pair in intervals.windows(2) {
                assert_eq!(pair[0].2[1], pair[1].2[0]);
                assert_eq!(pair[0].0.abs_diff(pair[1].0) + pair[0].1.abs_diff(pair[1].1), 1);
            }
            for i in 0..=400 {
                let t = f64::from(i) / 400.0;
                let (x, y) = (a.x + t * (b.x - a.x), a.y + t * (b.y - a.y));
                let within = (3.001..39.999).contains(&x) && (5.001..28.999).contains(&y);
                let contains = |interval: &&(u32, u32, [f64; 2])| interval.2[0] <= t && t <= interval.2[1];
                let interval = intervals.iter().find(contains);
                assert!(interval.is_some() || !within, "{a:?} {b:?} {t}");
                if let Some(&(column, row, _)) = interval {
                    crossed += 1;
                    assert!((x - f64::from(column) - 0.5).abs() < 0.5 + 1e-9, "{a:?} {b:?} {t}");
                    assert!((y - f64::from(row) - 0.5).abs() < 0.5 + 1e-9, "{a:?} {b:?} {t}");
                }
            }
        }
        assert!(crossed > 10_000);
    }

    #[test]
    fn a_point_lies_in_one_pixel_and_an_invalid_line_in_none() {
        let pixels = |a, b| {
            let mut intervals = Vec::new();
            traverse_line(&Window::new(8, 8), &[a, b], |x, y, interval| {
                intervals.push((x, y, interval))
            });
            intervals
        };
        assert_eq!(pixels(vertex(2.5, 3.5), vertex(2.5, 3.5)), [(2, 3, [0.0, 1.0])]);
        assert!(pixels(vertex(f64::NAN, 3.5), vertex(2.5, 3.5)).is_empty());
        assert!(pixels(vertex(8.0, 3.5), vertex(8.0, 7.5)).is_empty());
    }
}
