//! Two bodies in, what they have in common out.

use glam::{DVec3, Vec3};

use super::counted::Counted;
use super::layers::Layers;
use super::overlap::Overlap;
use super::projection::{Frame, LARGEST_IMAGE, Projection};
use super::surface::{Placed, Surface};
use super::traced::{find_points, trace_edges};
use super::volume::add_volume;
use crate::base::{Error, Result, above_zero, ensure};

/// From where bodies are looked at.
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
    /// Along one direction, not zero.
    Along(Vec3),
    /// Along the three axes of space, one after the other. What any of them sees counts.
    Axes,
}

/// How an image is made.
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
    /// As its authors describe it: edges are drawn into a depth buffer, faces in front of them counted. Of the edges that
    /// share a pixel only the nearest is seen, and edges shorter than a pixel or along the view are not drawn; no points,
    /// no volume.
    Counted,
    /// By the intervals in which the ray of each pixel is inside a body. Nothing is missed that is deeper than 0.71 pixels.
    Intervals,
}

/// How bodies are compared. Plain data, used only during [`ImageSpace::new`].
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
    /// The side of a pixel, m, above 0.
    pub pixel: f32,
    /// From where.
    pub views: Views,
    /// In which form.
    pub form: Form,
    /// Room for so many pixels in an image, 1 to 2^24. Memory is reserved for this much; a pair whose boxes overlap so far
    /// that it is not enough is drawn with pixels of twice the size, and so on.
    pub pixels: u32,
    /// Room for so many crossings of rays with faces in an image of one body; likewise. Not used by [`Form::Counted`].
    pub crossings: u32,
}

impl ImageSpaceDefinition {
    /// Along the three axes, by intervals, with room for 512 x 512 pixels and four crossings in each.
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

/// Finds in image space what two bodies have in common, in memory that it has reserved.
///
/// Halic, Kockara, Bayrak, Rowe, Chen, section 2.1 (CInDeR), and Faure, Barbier, Allard, Falipou 2008 for volumes. The time
/// is linear in polygons and in pixels covered. Bodies are compared where they are: what passes through a thin part
/// between two detections is not seen.
///
/// ```
#[doc = include_str!("../../doctest/two_cubes.txt")]
/// let mut space = ImageSpace::new(&ImageSpaceDefinition::new(0.002), &[&cube, &cube])?;
/// // Cubes of 10 cm, one 8 cm beside the other.
/// let overlap = space.detect(&bodies)?;
/// assert!((overlap.volume - 0.1 * 0.1 * 0.02).abs() < 0.1 * overlap.volume);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Debug)]
pub struct ImageSpace {
    pixel: f32,
    views: [Frame; 3],
    view_count: usize,
    pixels: usize,
    drawing: Drawing,
    overlap: Overlap,
}

#[derive(Debug)]
enum Drawing {
    Counted(Counted),
    Intervals([Layers; 2]),
}

impl ImageSpace {
    /// A detector with room for any two of these surfaces.
    ///
    /// Errors: [`Error::InvalidArgument`] for a pixel that is not above 0 and finite, a direction that is zero or not
    /// finite, room for no pixels, no crossings or more than 2^24 pixels; [`Error::OutOfMemory`].
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
            Views::Axes => (Frame::AXES, 3),
            Views::Along(direction) => {
                ensure!(
                    direction.is_finite() && direction != Vec3::ZERO,
                    "the view is along {direction}: must be finite and not zero"
                );
                ([Frame::along(direction); 3], 1)
            }
        };
        let (pixels, crossings) = (definition.pixels as usize, definition.crossings as usize);
        let edges = surfaces.iter().map(|surface| surface.edges().len()).max().unwrap_or(0);
        Ok(Self {
            pixel,
            views,
            view_count,
            pixels,
            drawing: match definition.form {
                Form::Counted => Drawing::Counted(Counted::reserved(pixels, edges)?),
                Form::Intervals => Drawing::Intervals([
                    Layers::reserved(pixels, crossings)?,
                    Layers::reserved(pixels, crossings)?,
                ]),
            },
            overlap: Overlap::reserved(surfaces)?,
        })
    }

    /// What two bodies have in common where they are now. One of them at least is closed; where both are, each is looked
    /// for in the other. Allocates nothing.
    ///
    /// Errors: [`Error::InvalidArgument`] for another number of positions than nodes, a position or thickness that is not
    /// finite, two open surfaces; [`Error::Capacity`] for surfaces larger than those that room was reserved for.
    pub fn detect(&mut self, bodies: &[Placed; 2]) -> Result<&Overlap> {
        bodies[0].check()?;
        bodies[1].check()?;
        let surfaces = [bodies[0].surface, bodies[1].surface];
        ensure!(
            surfaces.iter().any(|surface| surface.is_closed()),
            "both surfaces are open: one at least must be closed"
        );
        ensure!(
            self.overlap.takes(surfaces),
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
            // What several views found, which are all of what is there.
            inside.join(0, f32::min);
            inside.join_points();
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

    /// Draws one view, in pixels as small as there is room for; answers whether there was any.
    fn detect_along(&mut self, frame: Frame, bodies: &[Placed; 2]) -> bool {
        let boxes = [0, 1].map(|side| bounds(frame, bodies[side].positions));
        let thickness = f64::from(bodies[0].thickness) + f64::from(bodies[1].thickness);
        let low = boxes[0][0].max(boxes[1][0]) - thickness;
        let high = boxes[0][1].min(boxes[1][1]) + thickness;
        if !low.cmple(high).all() {
            return true;
        }
        let whole = [boxes[0][0].min(boxes[1][0]), boxes[0][1].max(boxes[1][1])];
        let mut pixel = f64::from(self.pixel);
        loop {
            let fits = Projection::fits([low, high], whole, pixel, self.pixels);
            if fits
                && let Ok(projection) = Projection::new(frame, low, high, pixel)
                && self.draw(&projection, bodies)
            {
                self.overlap.pixel = self.overlap.pixel.max(pixel as f32);
                return true;
            }
            // Smaller than an image of one pixel there is none.
            if fits && Projection::fits([low, high], whole, pixel, 1) {
                return false;
            }
            pixel *= 2.0;
        }
    }

    /// Answers whether there was room.
    fn draw(&mut self, projection: &Projection, bodies: &[Placed; 2]) -> bool {
        let overlap = &mut self.overlap;
        let [first, second] = bodies;
        // Of each body, with the other as the occluder.
        let sides = [(0, first, second), (1, second, first)];
        let sides = sides
            .into_iter()
            .filter(|(_, _, occluder)| occluder.surface.is_closed());
        match &mut self.drawing {
            Drawing::Counted(counted) => {
                for (side, body, occluder) in sides {
                    counted.detect(projection, body, occluder, &mut overlap.inside[side]);
                }
            }
            Drawing::Intervals(layers) => {
                for (layers, body) in layers.iter_mut().zip(bodies) {
                    let corners = |triangle: usize| Some(body.corners(triangle));
                    if body.surface.is_closed() && !layers.draw(projection, body.surface.triangles().len(), &corners) {
                        return false;
                    }
                }
                let thickness = f64::from(first.thickness) + f64::from(second.thickness);
                for (side, body, _) in sides {
                    let inside = &mut overlap.inside[side];
                    let others = inside.edges.len();
                    trace_edges(projection, &layers[1 - side], thickness, body, inside);
                    inside.join(others, f32::max);
                    // An open body gives edges alone.
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

/// The box around a body in the coordinates of a view.
fn bounds(frame: Frame, positions: &[Vec3]) -> [DVec3; 2] {
    let mut corners = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    for &position in positions {
        let at = frame.coordinates(position);
        corners = [corners[0].min(at), corners[1].max(at)];
    }
    corners
}
