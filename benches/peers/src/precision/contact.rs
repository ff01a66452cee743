//! Contact errors of a motion: penetration, and energy above that at the start.

use glam::{DMat3, DVec3};

use super::model::{FRAME, Model};
use super::motion::Motion;

/// The largest depth of a node in the ball, in the ground or in another body at the end of any frame [m].
pub fn deepest(model: &Model, motion: &Motion) -> f64 {
    let mut deepest = 0.0_f64;
    for (passed, frame) in (1..).zip(&motion.frames) {
        let nodes: Vec<DVec3> = frame.iter().copied().map(DVec3::from).collect();
        if let Some(ball) = model.ball {
            let center = DVec3::from(ball.center_after(passed, model.frames));
            let depths = nodes.iter().map(|node| ball.radius - node.distance(center));
            deepest = depths.fold(deepest, f64::max);
        }
        if model.has_floor {
            deepest = nodes.iter().map(|node| -node.y).fold(deepest, f64::max);
        }
        deepest = deepest.max(deepest_in_another(model, &nodes));
    }
    deepest
}

fn deepest_in_another(model: &Model, nodes: &[DVec3]) -> f64 {
    let count = model.body_count();
    let size = nodes.len() / count;
    let mut deepest = 0.0_f64;
    for (body, own) in nodes.chunks_exact(size).enumerate() {
        let tetrahedra = model.tetrahedra.chunks_exact((model.tetrahedra.len() / count).max(1));
        let triangles = model.triangles.chunks_exact((model.triangles.len() / count).max(1));
        let Some((tetrahedra, triangles)) = tetrahedra.zip(triangles).nth(body).filter(|_| count > 1) else {
            continue;
        };
        let low = own.iter().copied().fold(DVec3::INFINITY, DVec3::min);
        let high = own.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
        for (index, &node) in nodes.iter().enumerate() {
            let is_near = node.cmpge(low).all() && node.cmple(high).all();
            if is_near
                && index / size != body
                && tetrahedra
                    .iter()
                    .any(|corners| is_within(corners.map(|c| nodes[c]), node))
            {
                let distances = triangles
                    .iter()
                    .map(|corners| distance(corners.map(|c| nodes[c]), node));
                deepest = deepest.max(distances.fold(f64::INFINITY, f64::min));
            }
        }
    }
    deepest
}

fn is_within([a, b, c, d]: [DVec3; 4], point: DVec3) -> bool {
    let weights = DMat3::from_cols(b - a, c - a, d - a).inverse() * (point - a);
    weights.min_element() >= 0.0 && weights.element_sum() <= 1.0
}

/// The distance of a point from a triangle.
fn distance([a, b, c]: [DVec3; 3], point: DVec3) -> f64 {
    let normal = (b - a).cross(c - a).normalize_or_zero();
    let sides = [(a, b), (b, c), (c, a)];
    if sides
        .iter()
        .all(|&(from, to)| normal.dot((to - from).cross(point - from)) >= 0.0)
    {
        return normal.dot(point - a).abs();
    }
    let from_side = |&(from, to): &(DVec3, DVec3)| {
        let edge = to - from;
        let along = ((point - from).dot(edge) / edge.length_squared()).clamp(0.0, 1.0);
        point.distance(from + edge * along)
    };
    sides.iter().map(from_side).fold(f64::INFINITY, f64::min)
}

/// A lower bound of the energy gain: the largest kinetic plus gravitational energy above that at the start. It is
/// relative to the potential energy that all nodes lose until the last frame. Elastic energy is omitted, and the mean
/// velocity of a frame has less energy than the node. The result is 0 if a ball does work.
pub fn energy_gain(model: &Model, motion: &Motion) -> f64 {
    if model.ball.is_some_and(|ball| ball.speed != 0.0) {
        return 0.0;
    }
    let before = std::iter::once(&model.positions).chain(&motion.frames);
    let energy = |(from, to): (&Vec<[f64; 3]>, &Vec<[f64; 3]>)| -> f64 {
        let motions = from.iter().zip(to).zip(&model.masses);
        let node_energy = |((from, to), mass): ((&[f64; 3], &[f64; 3]), &f64)| {
            let (from, to) = (DVec3::from(*from), DVec3::from(*to));
            mass * (0.5 * (to - from).length_squared() / FRAME.powi(2) + 0.5 * model.gravity * (from.y + to.y))
        };
        motions.map(node_energy).sum()
    };
    let most = before.zip(&motion.frames).map(energy).fold(f64::NEG_INFINITY, f64::max);
    let potential = |nodes: &[[f64; 3]]| -> f64 {
        let heights = nodes.iter().zip(&model.masses);
        heights.map(|(node, mass)| model.gravity * mass * node[1]).sum()
    };
    let start = potential(&model.positions);
    let lost = start - motion.frames.last().map_or(start, |last| potential(last));
    ((most - start) / lost.max(f64::MIN_POSITIVE)).max(0.0)
}
