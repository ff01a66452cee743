//! The original method (CInDeR; Halic et al., section 2.1). The edges of one body are drawn into a depth buffer, and
//! the faces of the other body in front of them are counted.

use super::overlap::{EdgeInside, Inside};
use super::projection::Projection;
use super::rasterize::draw_triangles;
use super::surface::Placed;
use crate::base::{Result, memory};
use crate::raster::rasterise_line;

const NO_EDGE: u32 = u32::MAX;

/// The depth buffer and the counts in front of it.
#[derive(Debug, Default)]
pub(super) struct EdgeDepthBuffer {
    pixels: Vec<Pixel>,
    /// For each edge the detected part.
    detected: Vec<Option<EdgeInside>>,
}

#[derive(Clone, Copy, Debug)]
struct Pixel {
    /// The nearest edge, the position along it (0 to 1) and its depth, m.
    edge: u32,
    parameter: f32,
    depth: f32,
    /// Number of front faces minus back faces in front of the edge.
    count: i32,
    /// Distance to the nearest face, m.
    distance: f32,
}

const EMPTY: Pixel = Pixel {
    edge: NO_EDGE,
    parameter: 0.0,
    depth: f32::INFINITY,
    count: 0,
    distance: f32::INFINITY,
};

impl EdgeDepthBuffer {
    /// Reserves memory for this many pixels and edges.
    pub fn reserved(pixels: usize, edges: usize) -> Result<Self> {
        Ok(Self {
            pixels: memory::reserved(pixels)?,
            detected: memory::reserved(edges)?,
        })
    }

    /// Adds the edges of `body` that are detected inside `occluder`, each from its first pixel inside to its last.
    /// The image must not exceed the reserved memory.
    pub fn detect(&mut self, projection: &Projection, body: &Placed, occluder: &Placed, inside: &mut Inside) {
        self.pixels.clear();
        self.pixels.resize(projection.pixel_count(), EMPTY);
        let window = projection.window();
        let pixel_index = |x: u32, y: u32| y as usize * projection.width as usize + x as usize;
        for (index, edge) in body.surface.edges().iter().enumerate() {
            let ends = edge.map(|node| projection.project(body.positions[node as usize]));
            rasterise_line(&window, &ends, |fragment| {
                let pixel = &mut self.pixels[pixel_index(fragment.x, fragment.y)];
                if fragment.depth < pixel.depth {
                    *pixel = Pixel {
                        edge: index as u32,
                        parameter: fragment.weights[1],
                        depth: fragment.depth,
                        ..EMPTY
                    };
                }
            });
        }
        let thickness = body.thickness + occluder.thickness;
        let corners = |triangle: usize| Some(occluder.corners(triangle));
        let triangle_count = occluder.surface.triangles().len();
        draw_triangles(projection, triangle_count, &corners, |_, pixel, fragment| {
            let pixel = &mut self.pixels[pixel];
            if pixel.edge == NO_EDGE {
                return;
            }
            let offset = if fragment.front { -thickness } else { thickness };
            let behind = pixel.depth - (fragment.depth + offset);
            if behind > 0.0 {
                pixel.count += if fragment.front { 1 } else { -1 };
            }
            pixel.distance = pixel.distance.min(behind.abs());
        });
        self.detected.clear();
        self.detected.resize(body.surface.edges().len(), None);
        for pixel in self
            .pixels
            .iter()
            .filter(|pixel| pixel.edge != NO_EDGE && pixel.count > 0)
        {
            let part = self.detected[pixel.edge as usize].get_or_insert(EdgeInside {
                edge: pixel.edge,
                entry: pixel.parameter,
                exit: pixel.parameter,
                depth: 0.0,
            });
            part.entry = part.entry.min(pixel.parameter);
            part.exit = part.exit.max(pixel.parameter);
            part.depth = part.depth.max(pixel.distance);
        }
        let first = inside.edges.len();
        self.detected.iter().flatten().for_each(|part| inside.add(*part, first));
    }
}
