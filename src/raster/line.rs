//! Rasterization of lines.

use super::fragment::{Fragment, PixelVertex, Window};

/// Calls `sink` for each column of `window`, for a line wider than high, or else for each row, whose pixel center line
/// the line crosses.
///
/// The start belongs to the line and the end does not, so a chain of lines visits no pixel twice. A line with a
/// coordinate that is not finite has no fragments; neither has one that ends before the next pixel center.
pub fn rasterise_line(window: &Window, vertices: &[PixelVertex; 2], mut sink: impl FnMut(Fragment)) {
    let [a, b] = vertices;
    let finite = [a, b].iter().all(|vertex| {
        vertex.x.is_finite() && vertex.y.is_finite() && vertex.depth.is_finite() && vertex.reciprocal.is_finite()
    });
    if !finite {
        return;
    }
    // Every center along the major axis is visited. The pixel across it is the one that contains the line there.
    let is_wide = (b.x - a.x).abs() >= (b.y - a.y).abs();
    let (major, minor) = if is_wide {
        ((a.x, b.x), (a.y, b.y))
    } else {
        ((a.y, b.y), (a.x, b.x))
    };
    let (major_window, minor_window) = if is_wide {
        (window.left..window.right, window.top..window.bottom)
    } else {
        (window.top..window.bottom, window.left..window.right)
    };
    let length = major.1 - major.0;
    if length == 0.0 {
        return;
    }
    // Centers in [start, end) for a forward line, in (end, start] for a backward one.
    let (low, high) = if length > 0.0 {
        ((major.0 - 0.5).ceil(), (major.1 - 0.5).ceil())
    } else {
        ((major.1 - 0.5).floor() + 1.0, (major.0 - 0.5).floor() + 1.0)
    };
    let low = low.max(f64::from(major_window.start));
    let high = high.min(f64::from(major_window.end));
    if low >= high {
        return;
    }
    for major_pixel in low as u32..high as u32 {
        let t = (f64::from(major_pixel) + 0.5 - major.0) / length;
        let minor_position = (minor.0 + t * (minor.1 - minor.0)).floor();
        if minor_position < f64::from(minor_window.start) || minor_position >= f64::from(minor_window.end) {
            continue;
        }
        let (first, second) = ((1.0 - t) * a.reciprocal, t * b.reciprocal);
        let weights = [first / (first + second), second / (first + second)];
        let depth = weights[0] * a.depth + weights[1] * b.depth;
        let (x, y) = if is_wide {
            (major_pixel, minor_position as u32)
        } else {
            (minor_position as u32, major_pixel)
        };
        sink(Fragment {
            x,
            y,
            depth: depth as f32,
            weights: [weights[0] as f32, weights[1] as f32, 0.0],
            front: true,
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::fragment::vertex;

    fn pixels(points: [(f64, f64); 2]) -> Vec<(u32, u32)> {
        let vertices = points.map(|(x, y)| vertex(x, y));
        let mut found = Vec::new();
        rasterise_line(&Window::new(8, 8), &vertices, |f| found.push((f.x, f.y)));
        found
    }

    #[test]
    fn a_closed_chain_visits_each_centre_once() {
        let corners = [(1.5, 1.5), (5.5, 1.5), (5.5, 6.5), (1.5, 6.5), (1.5, 1.5)];
        let mut all: Vec<_> = corners.windows(2).flat_map(|pair| pixels([pair[0], pair[1]])).collect();
        assert_eq!(all.len(), 18);
        all.sort_unstable();
        all.dedup();
        assert_eq!(all.len(), 18);
    }

    #[test]
    fn a_long_or_invalid_line_stays_in_the_window() {
        assert_eq!(pixels([(-1e300, 2.5), (1e300, 2.5)]).len(), 8);
        assert!(pixels([(0.0, f64::NAN), (4.0, 4.0)]).is_empty());
        assert!(pixels([(f64::INFINITY, 1.0), (4.0, 4.0)]).is_empty());
        assert!(pixels([(3.0, 3.0), (3.0, 3.0)]).is_empty());
    }
}
