//! Edges of one surface that pass through triangles of another: what contact is to prevent, and what it left.

use glam::DVec3;

use super::search::shift;
use super::skin::Skin;
use crate::body::Bounds;

/// Marks the edges of `first` that pass through triangles of `second`, as their trees have them, but for those that are joined with the
/// edge: how many there are.
pub(super) fn mark(
    first: &Skin,
    second: &Skin,
    are_joined: impl Fn(&[u32], &[u32]) -> bool,
    pierces: &mut [bool],
) -> u32 {
    let mut count = 0;
    let shift = shift(first, second);
    for (edge, pierces) in first.edges.iter().zip(pierces) {
        let ends = edge.map(|node| first.starts.get(node as usize) + shift);
        let mut passes = false;
        second.near(&Bounds::of(ends.into_iter()), 0.0, |triangle| {
            if passes {
                return;
            }
            let nodes = second.triangles[triangle];
            let corners = nodes.map(|node| second.starts.get(node as usize).as_dvec3());
            passes = passes_through(ends.map(|end| end.as_dvec3()), corners) && !are_joined(edge, &nodes);
        });
        if passes {
            *pierces = true;
            count += 1;
        }
    }
    count
}

/// Whether a segment passes through a triangle, its border left out.
fn passes_through([from, to]: [DVec3; 2], corners: [DVec3; 3]) -> bool {
    let volume = |a: DVec3, b: DVec3, c: DVec3, d: DVec3| (b - a).cross(c - a).dot(d - a);
    let [a, b, c] = corners;
    let [start, end] = [from, to].map(|point| volume(a, b, c, point));
    if start * end >= 0.0 {
        return false;
    }
    let around = [[a, b], [b, c], [c, a]].map(|[p, q]| volume(from, to, p, q));
    around.iter().all(|&volume| volume > 0.0) || around.iter().all(|&volume| volume < 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_segment_passes_through_the_inside_of_a_triangle_alone() {
        let triangle = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let through = |x: f64, y: f64, from: f64, to: f64| {
            passes_through([DVec3::new(x, y, from), DVec3::new(x, y, to)], triangle)
        };
        assert!(through(0.2, 0.3, -1.0, 0.5) && through(0.2, 0.3, 0.5, -1.0));
        assert!(!through(0.2, 0.3, 0.1, 0.5));
        assert!(!through(0.7, 0.7, -1.0, 1.0));
        assert!(!through(-0.1, 0.3, -1.0, 1.0));
    }
}
