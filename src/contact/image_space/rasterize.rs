//! Rasterization of triangles.

use glam::Vec3;

use super::projection::Projection;
use crate::raster::{Fragment, rasterise_triangle};

/// More than the rasterizer's rounding of a vertex, in pixels.
const ROUNDING: f64 = 1.0 / 2048.0;

/// Calls `sink` with triangle, pixel and fragment for each pixel whose center a triangle covers. Triangles without
/// corners are left out.
pub(super) fn draw_triangles(
    projection: &Projection,
    count: usize,
    corners: &impl Fn(usize) -> Option<[Vec3; 3]>,
    mut sink: impl FnMut(usize, usize, Fragment),
) {
    let window = projection.window();
    for index in 0..count {
        let Some(corners) = corners(index) else {
            continue;
        };
        let vertices = corners.map(|corner| projection.project(corner));
        // Most triangles of a fine mesh cover no pixel center or lie beside the image.
        let columns = vertices.each_ref().map(|vertex| vertex.x);
        let rows = vertices.each_ref().map(|vertex| vertex.y);
        if may_cover(columns, projection.width) && may_cover(rows, projection.height) {
            rasterise_triangle(&window, &vertices, |fragment| {
                let pixel = fragment.y as usize * projection.width as usize + fragment.x as usize;
                sink(index, pixel, fragment);
            });
        }
    }
}

/// True if the center of a column or row may lie between the least and the largest coordinate.
fn may_cover([a, b, c]: [f64; 3], count: u32) -> bool {
    let first = (a.min(b).min(c) + 0.5 - ROUNDING).max(0.0) as u32;
    let past = (a.max(b).max(c) + 0.5 + ROUNDING) as u32;
    first < past && first < count
}
