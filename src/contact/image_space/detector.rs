//! Overlap query between two bodies in image space.

use glam::{DVec3, Vec3};

use super::depth_buffer::EdgeDepthBuffer;
use super::edge_tracing::{find_points, trace_edges};
use super::layers::Layers;
use super::overlap::Overlap;
use super::projection::{LARGEST_IMAGE, Projection, ViewFrame};
use super::surface::{Placed, Surface};
use super::volume::add_volume;
use crate::base::{Error, Result, above_zero, ensure};

/// The views from which bodies are drawn.
///
/// ```
#[doc = include_str!("../../doctest/two_cubes.txt")]
/// let definition = ImageSpaceDefinition { views: Views::Along(Vec3::Y), ..ImageSpaceDefinition::new(0.002) };
/// let mut space = ImageSpace::new(&definition, &[&cube, &cube])?;
/// assert!(!space.detect(&bodies)?.inside[0].points.is_empty());
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Views {
    /// Along one nonzero direction.
    Along(Vec3),
    /// Along the three coordinate axes in turn. The results are combined.
    Axes,
}

/// The method of detection.
///
/// ```
#[doc = include_str!("../../doctest/two_cubes.txt")]
/// let definition = ImageSpaceDefinition { form: Form::Counted, ..ImageSpaceDefinition::new(0.002) };
/// let mut space = ImageSpace::new(&definition, &[&cube, &cube])?;
/// // The counted form measures no volume.
/// assert_eq!(space.detect(&bodies)?.volume, 0.0);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// The original method: edges are drawn into a depth buffer and the faces in front of them are counted. If
    /// several edges share a pixel, only the nearest is detected. Edges shorter than a pixel or along the view are
    /// not drawn. It reports no points and no volume.
    Counted,
    /// By the intervals in which the ray of each pixel is inside a body. Overlaps deeper than 0.71 pixels are always
    /// found.
    Intervals,
}

/// Definition of a detector. Plain data, used only during [`ImageSpace::new`].
///
/// ```
#[doc = include_str!("../../doctest/two_cubes.txt")]
/// let definition = ImageSpaceDefinition { pixels: 1 << 16, ..ImageSpaceDefinition::new(0.002) };
/// let mut space = ImageSpace::new(&definition, &[&cube, &cube])?;
/// assert_eq!(space.detect(&bodies)?.pixel, 0.002);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageSpaceDefinition {
    /// Side of a pixel, m, above 0.
    pub pixel: f32,
    /// The views.
    pub views: Views,
    /// The method.
    pub form: Form,
    /// Maximum number of pixels in an image, 1 to 2^24. Memory is reserved for this number. If the overlap of two
    /// bodies' boxes needs more, the side of a pixel is doubled until it fits.
    pub pixels: u32,
    /// Maximum number of ray crossings in an image of one body. If an image needs more, the side of a pixel is
    /// doubled until it fits. Not used by [`Form::Counted`].
    pub crossings: u32,
}

impl ImageSpaceDefinition {
    /// Defines a detector along the three axes, by intervals, for 512 x 512 pixels with four crossings each.
    pub fn new(pixel: f32) -> Self {
        Self {
            pixel,
            views: Views::Axes,
            form: Form::Intervals,
            pixels: 1 << 18,
            crossings: 1 << 20,
        }
    }
}

/// Finds the overlap of two bodies in image space, in reserved memory.
///
/// Halic, Kockara, Bayrak, Rowe, Chen, section 2.1 (CInDeR), and Faure, Barbier, Allard, Falipou 2008 for volumes.
/// The time is linear in the number of polygons and of covered pixels. Detection is discrete: a body that passes
/// through a thin part between two calls is not detected.
///
/// ```
#[doc = include_str!("../../doctest/two_cubes.txt")]
/// let mut space = ImageSpace::new(&ImageSpaceDefinition::new(0.002), &[&cube, &cube])?;
/// // Cubes of 10 cm, with an offset of 8 cm.
/// let overlap = space.detect(&bodies)?;
/// assert!((overlap.volume - 0.1 * 0.1 * 0.02).abs() < 0.1 * overlap.volume);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Debug)]
pub struct ImageSpace {
    pixel: f32,
    views: [ViewFrame; 3],
    view_count: usize,
    pixels: usize,
    data: DetectionData,
    overlap: Overlap,
}

#[derive(Debug)]
enum DetectionData {
    Counted(EdgeDepthBuffer),
    Intervals([Layers; 2]),
}

impl ImageSpace {
    /// Creates a detector with memory for any two of these surfaces.
    ///
    /// Errors: [`Error::InvalidArgument`] for a pixel that is not above 0 and finite, a direction that is zero or not
    /// finite, `pixels` of 0 or above 2^24, or `crossings` of 0; [`Error::OutOfMemory`].
    pub fn new(definition: &ImageSpaceDefinition, surfaces: &[&Surface]) -> Result<Self> {
        let pixel = definition.pixel;
        above_zero("pixel", pixel)?;
        ensure!(
            definition.pixels != 0 && u64::from(definition.pixels) <= LARGEST_IMAGE,
            "pixels is {}: must be 1 to {LARGEST_IMAGE}",
            definition.pixels
        );
        ensure!(definition.crossings > 0, "crossings is 0: must be at least 1");
        let (views, view_count) = match definition.views {
            Views::Axes => (ViewFrame::AXES, 3),
            Views::Along(direction) => {
                ensure!(
                    direction.is_finite() && direction != Vec3::ZERO,
                    "the view is along {direction}: must be finite and not zero"
                );
                ([ViewFrame::along(direction); 3], 1)
            }
        };
        let (pixels, crossings) = (definition.pixels as usize, definition.crossings as usize);
        let edges = surfaces.iter().map(|surface| surface.edges().len()).max().unwrap_or(0);
        Ok(Self {
            pixel,
            views,
            view_count,
            pixels,
            data: match definition.form {
                Form::Counted => DetectionData::Counted(EdgeDepthBuffer::reserved(pixels, edges)?),
                Form::Intervals => DetectionData::Intervals([
                    Layers::reserved(pixels, crossings)?,
                    Layers::reserved(pixels, crossings)?,
                ]),
            },
            overlap: Overlap::reserved(surfaces)?,
        })
    }

    /// Finds the overlap of two bodies at their current positions. At least one must be closed. If both are, each is
    /// tested against the other. Does not allocate.
    ///
    /// Errors: [`Error::InvalidArgument`] if the number of positions differs from that of the nodes, a position or
    /// thickness is not finite, or both surfaces are open; [`Error::Capacity`] for surfaces larger than the reserved
    /// memory.
    pub fn detect(&mut self, bodies: &[Placed; 2]) -> Result<&Overlap> {
        bodies[0].check()?;
        bodies[1].check()?;
        let surfaces = [bodies[0].surface, bodies[1].surface];
        ensure!(
            surfaces.iter().any(|surface| surface.is_closed()),
            "both surfaces are open: one at least must be closed"
        );
        ensure!(
            self.overlap.fits(surfaces),
            Error::Capacity(format!(
                "surfaces of {} and {} nodes, {} and {} edges: larger than what the detector was made for",
                surfaces[0].node_count(),
                surfaces[1].node_count(),
                surfaces[0].edges().len(),
                surfaces[1].edges().len()
            ))
        );
        self.overlap.clear(surfaces.map(Surface::node_count), self.pixel);
        for view in 0..self.view_count {
            ensure!(
                self.detect_along(self.views[view], bodies),
                Error::Capacity("crossings: a single ray passes more faces than there is room for".into())
            );
        }
        let overlap = &mut self.overlap;
        for inside in &mut overlap.inside {
            // Merges the results of all views.
            inside.merge_edges(0, f32::min);
            inside.merge_points();
        }
        overlap.volume /= self.view_count as f64;
        let gradient: DVec3 = overlap.gradients[0].iter().sum();
        let area = gradient.length();
        if overlap.volume > 0.0 && area > 0.0 {
            overlap.normal = (-gradient / area).as_vec3();
            overlap.depth = (overlap.volume / area) as f32;
        }
        Ok(overlap)
    }

    /// Draws one view, with the smallest pixels that fit into memory. Returns false if not even one pixel fits.
    fn detect_along(&mut self, frame: ViewFrame, bodies: &[Placed; 2]) -> bool {
        let bounds_of_bodies = [0, 1].map(|side| bounds(frame, bodies[side].positions));
        let thickness = f64::from(bodies[0].thickness) + f64::from(bodies[1].thickness);
        let low = bounds_of_bodies[0][0].max(bounds_of_bodies[1][0]) - thickness;
        let high = bounds_of_bodies[0][1].min(bounds_of_bodies[1][1]) + thickness;
        if !low.cmple(high).all() {
            return true;
        }
        let union = [
            bounds_of_bodies[0][0].min(bounds_of_bodies[1][0]),
            bounds_of_bodies[0][1].max(bounds_of_bodies[1][1]),
        ];
        let mut pixel = f64::from(self.pixel);
        loop {
            let fits = Projection::fits([low, high], union, pixel, self.pixels);
            if fits
                && let Ok(projection) = Projection::new(frame, low, high, pixel)
                && self.draw(&projection, bodies)
            {
                self.overlap.pixel = self.overlap.pixel.max(pixel as f32);
                return true;
            }
            // Not even a single pixel fits.
            if fits && Projection::fits([low, high], union, pixel, 1) {
                return false;
            }
            pixel *= 2.0;
        }
    }

    /// Returns false if the memory is too small.
    fn draw(&mut self, projection: &Projection, bodies: &[Placed; 2]) -> bool {
        let overlap = &mut self.overlap;
        let [first, second] = bodies;
        // Each closed body is the occluder of the other one.
        let sides = [(0, first, second), (1, second, first)];
        let sides = sides
            .into_iter()
            .filter(|(_, _, occluder)| occluder.surface.is_closed());
        match &mut self.data {
            DetectionData::Counted(counted) => {
                for (side, body, occluder) in sides {
                    counted.detect(projection, body, occluder, &mut overlap.inside[side]);
                }
            }
            DetectionData::Intervals(layers) => {
                for (layers, body) in layers.iter_mut().zip(bodies) {
                    let corners = |triangle: usize| Some(body.corners(triangle));
                    if body.surface.is_closed() && !layers.draw(projection, body.surface.triangles().len(), &corners) {
                        return false;
                    }
                }
                let thickness = f64::from(first.thickness) + f64::from(second.thickness);
                for (side, body, _) in sides {
                    let inside = &mut overlap.inside[side];
                    let first_edge = inside.edges.len();
                    trace_edges(projection, &layers[1 - side], thickness, body, inside);
                    inside.merge_edges(first_edge, f32::max);
                    // Of an open body only edges are reported.
                    if body.surface.is_closed() {
                        find_points(projection, &layers[1 - side], thickness, body, inside);
                    }
                }
                if first.surface.is_closed() && second.surface.is_closed() {
                    overlap.volume += add_volume(projection, layers, bodies, &mut overlap.gradients);
                }
            }
        }
        true
    }
}

/// Returns the bounding box of a body in the coordinates of a view.
fn bounds(frame: ViewFrame, positions: &[Vec3]) -> [DVec3; 2] {
    let mut corners = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    for &position in positions {
        let coordinates = frame.coordinates(position);
        corners = [corners[0].min(coordinates), corners[1].max(coordinates)];
    }
    corners
}
