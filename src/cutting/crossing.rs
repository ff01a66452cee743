//! The intersection of a swept triangle with a triangle of the render mesh.
//!
//! The render mesh is treated as shifted by an infinitesimal displacement (Edelsbrunner, Muecke 1990), and signs are
//! exact. Two triangles therefore intersect in nothing or in a segment with two ends, and triangles that share an edge
//! agree on where it is crossed.

use glam::DVec3;

use crate::base::symbolic_perturbation::{is_above, triple};

/// An end of the segment in which two triangles intersect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum SegmentEnd {
    /// On the side from this corner to the next of the render triangle. The fraction is measured from the vertex with
    /// the lower index.
    Side(usize, f64),
    /// Inside the render triangle, by weights of its corners, where a side of the swept triangle passes through. It
    /// starts at this corner.
    Inside(usize, [f64; 3]),
}

/// The ends of the segment in which a swept triangle intersects a render triangle, given its corners and their indices.
/// Differences of positions must be exact.
pub(crate) fn intersect_triangles(
    swept: [DVec3; 3],
    corners: [DVec3; 3],
    numbers: [u32; 3],
) -> Option<[SegmentEnd; 2]> {
    let sides = [1, 2].map(|k| swept[k] - swept[0]);
    let swept_normal = sides[0].cross(sides[1]);
    let heights = corners.map(|corner| triple(corner - swept[0], sides[0], sides[1]));
    let above = heights.map(|height| is_above(height, swept_normal));
    if above[0] == above[1] && above[1] == above[2] {
        return None;
    }
    let render_sides = [1, 2].map(|k| corners[k] - corners[0]);
    let render_normal = render_sides[0].cross(render_sides[1]);
    let swept_above = swept.map(|corner| {
        is_above(
            triple(corner - corners[0], render_sides[0], render_sides[1]),
            -render_normal,
        )
    });
    // The orientation of each pair of sides, computed identically for all triangles at a side of the render mesh.
    let mut volumes = [[0.0; 3]; 3];
    let mut passes = [[false; 3]; 3];
    for (i, passes) in passes.iter_mut().enumerate() {
        let (mut low, mut high) = (i, (i + 1) % 3);
        let is_reversed = numbers[low] > numbers[high];
        if is_reversed {
            (low, high) = (high, low);
        }
        let (start, direction) = (corners[low], corners[high] - corners[low]);
        for j in 0..3 {
            let (from, to) = (swept[j], swept[(j + 1) % 3]);
            volumes[i][j] = triple(direction, from - start, to - start);
            passes[j] = is_above(volumes[i][j], direction.cross(to - from)) != is_reversed;
        }
    }
    let mut ends = [None; 2];
    let mut count = 0;
    let mut add_end = |end| {
        if let Some(slot) = ends.get_mut(count) {
            *slot = Some(end);
        }
        count += 1;
    };
    for (i, passes) in passes.iter().enumerate() {
        let (a, b) = (i, (i + 1) % 3);
        if above[a] != above[b] && passes[0] == passes[1] && passes[1] == passes[2] {
            let (low, high) = if numbers[a] < numbers[b] { (a, b) } else { (b, a) };
            let total = heights[low] - heights[high];
            let along = if total == 0.0 { 0.5 } else { heights[low] / total };
            add_end(SegmentEnd::Side(i, along.clamp(0.0, 1.0)));
        }
    }
    for j in 0..3 {
        if swept_above[j] != swept_above[(j + 1) % 3] && passes[0][j] == passes[1][j] && passes[1][j] == passes[2][j] {
            let opposite = [1, 2, 0].map(|i| volumes[i][j].abs());
            let total: f64 = opposite.iter().sum();
            let weights = if total > 0.0 {
                opposite.map(|volume| volume / total)
            } else {
                [1.0 / 3.0; 3]
            };
            add_end(SegmentEnd::Inside(j, weights));
        }
    }
    match (count, ends) {
        (2, [Some(a), Some(b)]) => Some([a, b]),
        // A side along the blade's edge, in one plane: either both triangles beside it intersect the blade, or neither.
        _ => None,
    }
}
