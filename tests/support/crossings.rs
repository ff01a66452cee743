//! Counts interpenetrating surfaces.

use glam::DVec3;

/// Counts how often edges of `triangles` pass through `others`. Pairs that share a corner are left out.
pub fn crossings(positions: &[DVec3], triangles: &[[u32; 3]], others: &[[u32; 3]]) -> usize {
    let at = |node: u32| positions[node as usize];
    let volume = |a: DVec3, b: DVec3, c: DVec3, d: DVec3| (b - a).cross(c - a).dot(d - a);
    let edges = || triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let edge_crosses = |[from, to]: [u32; 2], triangle: &[u32; 3]| {
        let ([p, q], [a, b, c]) = ([at(from), at(to)], triangle.map(at));
        let volumes = [volume(p, q, a, b), volume(p, q, b, c), volume(p, q, c, a)];
        let is_within = volumes.iter().all(|volume_sign| *volume_sign > 0.0)
            || volumes.iter().all(|volume_sign| *volume_sign < 0.0);
        is_within && volume(a, b, c, p) * volume(a, b, c, q) < 0.0
    };
    let crossings_of = |triangle: &[u32; 3]| {
        let others = edges().filter(|edge| edge.iter().all(|node| !triangle.contains(node)));
        others.filter(|&edge| edge_crosses(edge, triangle)).count()
    };
    others.iter().map(crossings_of).sum()
}
