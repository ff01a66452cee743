//! Edges of one surface that pass through triangles of another: what contact is to prevent, and what it left.

use super::search::shift;
use super::skin::{NONE, Skin};
use crate::geometry::Bounds;
use crate::geometry::predicates::crosses;

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
    let is_of_one = std::ptr::eq(first, second);
    let edges = first.edges.iter().zip(pierces).enumerate();
    for (number, (edge, pierces)) in edges.filter(|(_, (edge, _))| edge[0] != NONE) {
        let ends = edge.map(|node| first.starts.get(node as usize) + shift);
        let mut passes = false;
        let around = Bounds::of(ends.into_iter());
        let see = |triangle: usize| {
            let nodes = second.triangles[triangle];
            if passes || are_joined(edge, &nodes) {
                return;
            }
            let corners = nodes.map(|node| second.starts.get(node as usize));
            // What a cut has parted touches.
            let depth = if is_of_one {
                first.crossing_depth(*edge, &nodes)
            } else {
                0.0
            };
            passes = crosses(ends[0], ends[1], corners, depth);
        };
        if is_of_one {
            second.near_edge(number, &around, 0.0, see);
        } else {
            second.near(&around, 0.0, see);
        }
        if passes {
            *pierces = true;
            count += 1;
        }
    }
    count
}

/// Whether an edge of `first` passes through a triangle of `second` by more than `depth`, m.
pub(super) fn is_deep(first: &Skin, second: &Skin, depth: f32) -> bool {
    let shift = shift(first, second);
    let mut crossing = first.edges.iter().zip(&first.pierces).filter(|(_, pierces)| **pierces);
    crossing.any(|(edge, _)| {
        let ends = edge.map(|node| first.starts.get(node as usize) + shift);
        let mut passes = false;
        second.near(&Bounds::of(ends.into_iter()), 0.0, |triangle| {
            let corners = second.triangles[triangle].map(|node| second.starts.get(node as usize));
            passes |= crosses(ends[0], ends[1], corners, f64::from(depth));
        });
        passes
    })
}
