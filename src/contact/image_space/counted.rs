//! The method as its authors describe it (CInDeR; Halic et al., section 2.1): the edges of one body are drawn into a depth
//! buffer, the faces of the other that lie in front of them are counted.

use super::draw::draw_triangles;
use super::overlap::{EdgeInside, Inside};
use super::projection::Projection;
use super::surface::Placed;
use crate::base::{Result, memory};
use crate::raster::rasterise_line;

const NO_EDGE: u32 = u32::MAX;

/// The depth buffer, and what was counted in front of it.
#[derive(Debug, Default)]
pub(super) struct Counted {
    pixels: Vec<Pixel>,
    /// For each edge the part of it that was found.
    found: Vec<Option<EdgeInside>>,
}

#[derive(Clone, Copy, Debug)]
struct Pixel {
    /// The nearest edge, where along it, and how far, m.
    edge: u32,
    share: f32,
    depth: f32,
    /// Faces in front of it that face the viewer, less those that face away.
    count: i32,
    /// From it to the next face, m.
    free: f32,
}

const EMPTY: Pixel = Pixel {
    edge: NO_EDGE,
    share: 0.0,
    depth: f32::INFINITY,
    count: 0,
    free: f32::INFINITY,
};

impl Counted {
    /// Room for so many pixels and edges.
    pub fn reserved(pixels: usize, edges: usize) -> Result<Self> {
        Ok(Self {
            pixels: memory::reserved(pixels)?,
            found: memory::reserved(edges)?,
        })
    }

    /// Adds to `inside` the edges of `body` that are seen inside `occluder`, each from the first pixel that shows it there to the last. The image has no more pixels than there is
    /// room for.
    pub fn detect(&mut self, projection: &Projection, body: &Placed, occluder: &Placed, inside: &mut Inside) {
        self.pixels.clear();
        self.pixels.resize(projection.pixel_count(), EMPTY);
        let window = projection.window();
        let place = |x: u32, y: u32| y as usize * projection.width as usize + x as usize;
        for (index, edge) in body.surface.edges().iter().enumerate() {
            let ends = edge.map(|node| projection.project(body.positions[node as usize]));
            rasterise_line(&window, &ends, |fragment| {
                let pixel = &mut self.pixels[place(fragment.x, fragment.y)];
                if fragment.depth < pixel.depth {
                    *pixel = Pixel {
                        edge: index as u32,
                        share: fragment.weights[1],
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
            let outwards = if fragment.front { -thickness } else { thickness };
            let behind = pixel.depth - (fragment.depth + outwards);
            if behind > 0.0 {
                pixel.count += if fragment.front { 1 } else { -1 };
            }
            pixel.free = pixel.free.min(behind.abs());
        });
        self.found.clear();
        self.found.resize(body.surface.edges().len(), None);
        for pixel in self
            .pixels
            .iter()
            .filter(|pixel| pixel.edge != NO_EDGE && pixel.count > 0)
        {
            let part = self.found[pixel.edge as usize].get_or_insert(EdgeInside {
                edge: pixel.edge,
                entry: pixel.share,
                exit: pixel.share,
                depth: 0.0,
            });
            part.entry = part.entry.min(pixel.share);
            part.exit = part.exit.max(pixel.share);
            part.depth = part.depth.max(pixel.free);
        }
        let first = inside.edges.len();
        self.found.iter().flatten().for_each(|part| inside.add(*part, first));
    }
}
