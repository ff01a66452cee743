//! Detection that loses no edges. Each edge is divided at pixel borders, and each piece is compared with the
//! intervals in which the pixel's ray is inside the other body.
//!
//! A point of an edge is compared with the ray through the center of its pixel, at most 0.71 pixels away. Overlaps
//! deeper than that are always found.

use super::intervals::Intervals;
use super::layers::Layers;
use super::overlap::{EdgeInside, Inside, PointInside};
use super::projection::Projection;
use super::surface::Placed;
use crate::raster::traverse_line;

/// Adds the parts of the edges of `body` that lie inside the body of `layers`, expanded by `thickness`.
pub(super) fn trace_edges(
    projection: &Projection,
    layers: &Layers,
    thickness: f64,
    body: &Placed,
    inside: &mut Inside,
) {
    let window = projection.window();
    let first = inside.edges.len();
    for (index, edge) in body.surface.edges().iter().enumerate() {
        let ends = edge.map(|node| projection.project(body.positions[node as usize]));
        let (start, depth_change) = (ends[0].depth, ends[1].depth - ends[0].depth);
        traverse_line(&window, &ends, |x, y, [from, to]| {
            let pixel = y as usize * projection.width as usize + x as usize;
            for interval in Intervals::new(layers.at(pixel), thickness) {
                let [entry, exit] = if depth_change == 0.0 {
                    [from, if interval.depth_of(start).0 > 0.0 { to } else { f64::NAN }]
                } else {
                    let (a, b) = (
                        (interval.entry - start) / depth_change,
                        (interval.exit - start) / depth_change,
                    );
                    [from.max(a.min(b)), to.min(a.max(b))]
                };
                if entry <= exit {
                    let depths = [start + entry * depth_change, start + exit * depth_change];
                    let middle = (interval.entry + interval.exit) / 2.0;
                    let deepest = middle.clamp(depths[0].min(depths[1]), depths[0].max(depths[1]));
                    let part = EdgeInside {
                        edge: index as u32,
                        entry: entry as f32,
                        exit: exit as f32,
                        depth: interval.depth_of(deepest).0.max(0.0) as f32,
                    };
                    inside.add(part, first);
                }
            }
        });
    }
}

/// Adds the nodes of `body` that lie inside the body of `layers`.
pub(super) fn find_points(
    projection: &Projection,
    layers: &Layers,
    thickness: f64,
    body: &Placed,
    inside: &mut Inside,
) {
    for (node, &position) in body.positions.iter().enumerate() {
        let vertex = projection.project(position);
        if !projection.contains(&vertex) {
            continue;
        }
        for interval in Intervals::new(layers.at(projection.pixel_at(&vertex)), thickness) {
            let (depth, triangle) = interval.depth_of(vertex.depth);
            if depth > 0.0 {
                inside.points.push(PointInside {
                    node: node as u32,
                    depth: depth as f32,
                    triangle,
                });
            }
        }
    }
}
