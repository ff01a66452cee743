//! Lines to fragments.

use super::fragment::{Fragment, PixelVertex, Window};

/// Calls `sink` once per column (a line that is wider than high) or per row (else) of `window` that the line crosses at
/// a pixel's centre.
///
/// The start belongs to the line and the end does not, so a chain of lines visits no centre twice. A line with a
/// coordinate that is not finite has no fragments, nor has one that is shorter than the way to the next centre.
pub fn rasterise_line(window: &Window, vertices: &[PixelVertex; 2], mut sink: impl FnMut(Fragment)) {
    let [a, b] = vertices;
    let finite = [a, b].iter().all(|vertex| {
        vertex.x.is_finite() && vertex.y.is_finite() && vertex.depth.is_finite() && vertex.reciprocal.is_finite()
    });
    if !finite {
        return;
    }
    // Along the major axis every centre is visited; across it the pixel is the one that the line is in there.
    let wide = (b.x - a.x).abs() >= (b.y - a.y).abs();
    let (major, minor) = if wide {
        ((a.x, b.x), (a.y, b.y))
    } else {
        ((a.y, b.y), (a.x, b.x))
    };
    let (major_window, minor_window) = if wide {
        (window.left..window.right, window.top..window.bottom)
    } else {
        (window.top..window.bottom, window.left..window.right)
    };
    let length = major.1 - major.0;
    if length == 0.0 {
        return;
    }
    // Centres in [start, end) when walked forwards, in (end, start] when walked backwards.
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
    for along in low as u32..high as u32 {
        let share = (f64::from(along) + 0.5 - major.0) / length;
        let across = (minor.0 + share * (minor.1 - minor.0)).floor();
        if across < f64::from(minor_window.start) || across >= f64::from(minor_window.end) {
            continue;
        }
        let (first, second) = ((1.0 - share) * a.reciprocal, share * b.reciprocal);
        let weights = [first / (first + second), second / (first + second)];
        let depth = weights[0] * a.depth + weights[1] * b.depth;
        let (x, y) = if wide {
            (along, across as u32)
        } else {
            (across as u32, along)
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
    fn a_long_or_broken_line_stays_in_the_window() {
        assert_eq!(pixels([(-1e300, 2.5), (1e300, 2.5)]).len(), 8);
        assert!(pixels([(0.0, f64::NAN), (4.0, 4.0)]).is_empty());
        assert!(pixels([(f64::INFINITY, 1.0), (4.0, 4.0)]).is_empty());
        assert!(pixels([(3.0, 3.0), (3.0, 3.0)]).is_empty());
    }
}
