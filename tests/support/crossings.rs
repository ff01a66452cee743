//! Surfaces that pass through each other.

use glam::DVec3;

/// How often edges of the first triangles pass through the second, where they share no corner.
pub fn crossings(places: &[DVec3], triangles: &[[u32; 3]], others: &[[u32; 3]]) -> usize {
    let at = |node: u32| places[node as usize];
    let volume = |a: DVec3, b: DVec3, c: DVec3, d: DVec3| (b - a).cross(c - a).dot(d - a);
    let edges = || triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let passes = |[from, to]: [u32; 2], triangle: &[u32; 3]| {
        let ([p, q], [a, b, c]) = ([at(from), at(to)], triangle.map(at));
        let turns = [volume(p, q, a, b), volume(p, q, b, c), volume(p, q, c, a)];
        let is_within = turns.iter().all(|turn| *turn > 0.0) || turns.iter().all(|turn| *turn < 0.0);
        is_within && volume(a, b, c, p) * volume(a, b, c, q) < 0.0
    };
    let of = |triangle: &[u32; 3]| {
        let others = edges().filter(|edge| edge.iter().all(|node| !triangle.contains(node)));
        others.filter(|&edge| passes(edge, triangle)).count()
    };
    others.iter().map(of).sum()
}
