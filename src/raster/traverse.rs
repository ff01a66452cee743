//! Lines to all pixels that they pass through.

use super::fragment::{PixelVertex, Window};

/// Calls `sink` with the column and row of each pixel of `window` that a line passes through, however little of it, and
/// with the shares of the line, as seen, between which it does (Amanatides, Woo, "A fast voxel traversal algorithm for ray
/// tracing", 1987).
///
/// In the order of the line; the shares of one pixel end where those of the next begin. A point, or a line that points at
/// the viewer, lies in one pixel from 0 to 1. A line with a coordinate that is not finite passes through none.
pub fn traverse_line(window: &Window, vertices: &[PixelVertex; 2], mut sink: impl FnMut(u32, u32, [f64; 2])) {
    let start = [vertices[0].x, vertices[0].y];
    let way = [vertices[1].x - start[0], vertices[1].y - start[1]];
    let first = [window.left, window.top];
    let past = [window.right, window.bottom];
    if !(start.iter().chain(&way).all(|value| value.is_finite()) && first[0] < past[0] && first[1] < past[1]) {
        return;
    }
    let (mut from, mut to) = (0.0_f64, 1.0_f64);
    for i in 0..2 {
        let (low, high) = (f64::from(first[i]) - start[i], f64::from(past[i]) - start[i]);
        if way[i] != 0.0 {
            let (a, b) = (low / way[i], high / way[i]);
            from = from.max(a.min(b));
            to = to.min(a.max(b));
        } else if !(low <= 0.0 && high > 0.0) {
            return;
        }
    }
    if !(from <= to) {
        return;
    }
    let pixel = |i: usize, share: f64| {
        let at = (start[i] + share * way[i]).floor();
        at.clamp(f64::from(first[i]), f64::from(past[i] - 1)) as u32
    };
    let mut at = [pixel(0, from), pixel(1, from)];
    let last = [pixel(0, to), pixel(1, to)];
    // The share at which the line leaves the current column or row.
    let leaves = |i: usize, at: u32| {
        if at == last[i] {
            return f64::INFINITY;
        }
        (f64::from(at + u32::from(way[i] > 0.0)) - start[i]) / way[i]
    };
    let mut next = [leaves(0, at[0]), leaves(1, at[1])];
    loop {
        let i = usize::from(next[1] < next[0]);
        let leaving = next[i].clamp(from, to);
        sink(at[0], at[1], [from, leaving]);
        if !next[i].is_finite() {
            return;
        }
        from = leaving;
        at[i] = if way[i] > 0.0 { at[i] + 1 } else { at[i] - 1 };
        next[i] = leaves(i, at[i]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use crate::raster::fragment::vertex;

    #[test]
    fn each_point_of_a_line_lies_in_the_pixel_that_has_its_share() {
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
            let mut pieces = Vec::new();
            traverse_line(&window, &[a, b], |x, y, shares| pieces.push((x, y, shares)));
            for pair in pieces.windows(2) {
                assert_eq!(pair[0].2[1], pair[1].2[0]);
                assert_eq!(pair[0].0.abs_diff(pair[1].0) + pair[0].1.abs_diff(pair[1].1), 1);
            }
            for i in 0..=400 {
                let share = f64::from(i) / 400.0;
                let (x, y) = (a.x + share * (b.x - a.x), a.y + share * (b.y - a.y));
                let within = (3.001..39.999).contains(&x) && (5.001..28.999).contains(&y);
                let has = |piece: &&(u32, u32, [f64; 2])| piece.2[0] <= share && share <= piece.2[1];
                let piece = pieces.iter().find(has);
                assert!(piece.is_some() || !within, "{a:?} {b:?} {share}");
                if let Some(&(column, row, _)) = piece {
                    crossed += 1;
                    assert!((x - f64::from(column) - 0.5).abs() < 0.5 + 1e-9, "{a:?} {b:?} {share}");
                    assert!((y - f64::from(row) - 0.5).abs() < 0.5 + 1e-9, "{a:?} {b:?} {share}");
                }
            }
        }
        assert!(crossed > 10_000);
    }

    #[test]
    fn a_point_lies_in_one_pixel_and_what_is_broken_in_none() {
        let pixels = |a, b| {
            let mut pieces = Vec::new();
            traverse_line(&Window::new(8, 8), &[a, b], |x, y, shares| pieces.push((x, y, shares)));
            pieces
        };
        assert_eq!(pixels(vertex(2.5, 3.5), vertex(2.5, 3.5)), [(2, 3, [0.0, 1.0])]);
        assert!(pixels(vertex(f64::NAN, 3.5), vertex(2.5, 3.5)).is_empty());
        assert!(pixels(vertex(8.0, 3.5), vertex(8.0, 7.5)).is_empty());
    }
}
