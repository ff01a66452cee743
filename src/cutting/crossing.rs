//! Where a triangle that the blade swept meets a triangle that is drawn.
//!
//! All of what is drawn is taken as shifted by next to nothing in one direction (Edelsbrunner, Muecke 1990), and signs are exact: two triangles
//! meet in no point or in a segment with two ends, and triangles that share an edge agree on where it is crossed.

use glam::DVec3;

use crate::base::symbolic_perturbation::{is_above, triple};

/// An end of the segment in which two triangles meet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum SegmentEnd {
    /// On the drawn triangle's side from this corner to the next: how far from the vertex of the lower number to the other.
    Side(usize, f64),
    /// Inside the drawn triangle, by weights of its corners, where the swept triangle's side from this corner to the next passes through.
    Inside(usize, [f64; 3]),
}

/// The ends of the segment in which a swept triangle meets a drawn one with the given corners and their numbers; differences of places have to be
/// exact.
pub(crate) fn meet(swept: [DVec3; 3], corners: [DVec3; 3], numbers: [u32; 3]) -> Option<[SegmentEnd; 2]> {
    let sides = [1, 2].map(|k| swept[k] - swept[0]);
    let swept_normal = sides[0].cross(sides[1]);
    let heights = corners.map(|corner| triple(corner - swept[0], sides[0], sides[1]));
    let above = heights.map(|height| is_above(height, swept_normal));
    if above[0] == above[1] && above[1] == above[2] {
        return None;
    }
    let drawn = [1, 2].map(|k| corners[k] - corners[0]);
    let drawn_normal = drawn[0].cross(drawn[1]);
    let swept_above = swept.map(|corner| is_above(triple(corner - corners[0], drawn[0], drawn[1]), -drawn_normal));
    // How each side of the one passes each side of the other, seen the same from all triangles at the drawn side.
    let mut volumes = [[0.0; 3]; 3];
    let mut passes = [[false; 3]; 3];
    for (i, passes) in passes.iter_mut().enumerate() {
        let (mut low, mut high) = (i, (i + 1) % 3);
        let turned = numbers[low] > numbers[high];
        if turned {
            (low, high) = (high, low);
        }
        let (start, way) = (corners[low], corners[high] - corners[low]);
        for j in 0..3 {
            let (from, to) = (swept[j], swept[(j + 1) % 3]);
            volumes[i][j] = triple(way, from - start, to - start);
            passes[j] = is_above(volumes[i][j], way.cross(to - from)) != turned;
        }
    }
    let mut ends = [None; 2];
    let mut count = 0;
    let mut found = |end| {
        if let Some(place) = ends.get_mut(count) {
            *place = Some(end);
        }
        count += 1;
    };
    for (i, passes) in passes.iter().enumerate() {
        let (a, b) = (i, (i + 1) % 3);
        if above[a] != above[b] && passes[0] == passes[1] && passes[1] == passes[2] {
            let (low, high) = if numbers[a] < numbers[b] { (a, b) } else { (b, a) };
            let whole = heights[low] - heights[high];
            let along = if whole == 0.0 { 0.5 } else { heights[low] / whole };
            found(SegmentEnd::Side(i, along.clamp(0.0, 1.0)));
        }
    }
    for j in 0..3 {
        if swept_above[j] != swept_above[(j + 1) % 3] && passes[0][j] == passes[1][j] && passes[1][j] == passes[2][j] {
            let opposite = [1, 2, 0].map(|i| volumes[i][j].abs());
            let whole: f64 = opposite.iter().sum();
            let weights = if whole > 0.0 {
                opposite.map(|part| part / whole)
            } else {
                [1.0 / 3.0; 3]
            };
            found(SegmentEnd::Inside(j, weights));
        }
    }
    match (count, ends) {
        (2, [Some(a), Some(b)]) => Some([a, b]),
        // A side that lies along the blade's edge, both in one plane: the triangles beside it meet the blade, or none does.
        _ => None,
    }
}
