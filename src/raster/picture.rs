//! Pictures of a scene.

use super::camera::Camera;
use super::fragment::Window;
use super::geometry::{Geometry, Kind};
use super::occlusion::Occlusion;
use super::scene::Scene;
use super::shade::{self, Encoder, Lights, SurfacePlace};
use super::shadow::ShadowMap;
use super::view::{Homogeneous, View};
use crate::Result;
#[cfg(doc)]
use crate::base::Error;
use crate::base::{ensure, memory};
use glam::Vec3;

/// Samples per pixel along each axis.
const FINE: u32 = 2;
/// Samples that are kept at once; a large picture is drawn in bands of rows.
const BAND: u32 = 1 << 18;
/// The longer side of the picture that ambient occlusion is computed in.
const SMALL: f64 = 640.0;
/// The longest side of a picture.
const MAX_SIZE: u32 = 16_384;
/// No triangle.
const NOTHING: u32 = u32::MAX;

/// Pixels, row by row from the upper left.
///
/// ```
/// # use glam::Vec3;
/// # use sinew::raster::{Look, Scene, Shape};
/// # let path = std::env::temp_dir().join(format!("sinew_image_{}.png", std::process::id()));
/// # let mut scene = Scene::default();
/// # scene.shapes.push((Shape::Sphere { centre: Vec3::ZERO, radius: 0.1 }, Look::INSTRUMENT));
/// # let camera = scene.camera(Vec3::Z, Vec3::Y, 0.6, 1.0)?;
/// let image = scene.draw(&camera, 32, 32)?;
/// assert_eq!(image.pixels.len(), 32 * 32);
/// # #[cfg(feature = "pictures")]
/// image.write_png(&path)?;
/// # std::fs::remove_file(&path).ok();
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Red, green, blue, alpha (sRGB); width x height of them.
    pub pixels: Vec<[u8; 4]>,
}

impl Scene<'_> {
    /// A picture of the scene, anti-aliased with four samples per pixel. The same scene gives the same picture.
    ///
    /// Triangles and lines with a coordinate that is not finite are left out. Beside the picture it takes about 50 bytes
    /// per triangle and 30 MB.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: a width or height that is not 1 to 16384, an index without a position, a camera that
    /// [`Camera::view`] refuses. [`Error::OutOfMemory`].
    pub fn draw(&self, camera: &Camera, width: u32, height: u32) -> Result<Image> {
        for (name, size) in [("width", width), ("height", height)] {
            ensure!((1..=MAX_SIZE).contains(&size), "{name} is {size}, not 1 to {MAX_SIZE}");
        }
        let view = camera.view(width * FINE, height * FINE)?;
        let geometry = Geometry::new(self, &view, height)?;
        let painter = Painter::new(&geometry, camera, view, [width, height], self)?;
        let mut pixels = memory::reserved(width as usize * height as usize)?;
        painter.paint(&mut pixels)?;
        Ok(Image { width, height, pixels })
    }
}

/// Draws one picture.
struct Painter<'a> {
    geometry: &'a Geometry,
    view: View,
    width: u32,
    height: u32,
    lights: Lights,
    shadows: ShadowMap,
    occlusion: Occlusion,
    /// How far something hides the sky, in metres.
    reach: f32,
    encoder: Encoder,
}

/// What a sample sees first.
#[derive(Clone, Copy)]
struct PixelSample {
    depth: f32,
    triangle: u32,
    /// Of the first two corners.
    weights: [f32; 2],
}

/// The colour of a sample, and how much it faces the eye, 0 to 1.
#[derive(Clone, Copy)]
struct Shaded {
    colour: Vec3,
    facing: f32,
}

/// The samples of a pixel.
type Samples = [PixelSample; (FINE * FINE) as usize];

impl<'a> Painter<'a> {
    fn new(geometry: &'a Geometry, camera: &Camera, view: View, size: [u32; 2], scene: &Scene) -> Result<Self> {
        let [right, up, forward] = view.axes().map(|axis| axis.as_vec3());
        let lights = Lights::new([right, up, -forward]);
        let extent = scene.extent().map_or(0.0, |(low, high)| (high - low).length());
        let extent = if extent > 0.0 { extent } else { 1.0 };
        let longest = f64::from(size[0].max(size[1]));
        let scale = (SMALL / longest).min(1.0);
        let small = size.map(|length| ((f64::from(length) * scale).round() as u32).max(1));
        // Heights decide the scale of a view; this is what rounding has made of it.
        let scale = f64::from(small[1]) / f64::from(size[1]);
        let reach = 0.09 * extent;
        let small_view = camera.view(small[0], small[1])?;
        Ok(Painter {
            geometry,
            view,
            width: size[0],
            height: size[1],
            shadows: ShadowMap::new(geometry, lights.key)?,
            occlusion: Occlusion::new(geometry, &small_view, small, scale, reach)?,
            lights,
            reach,
            encoder: Encoder::new(),
        })
    }

    /// Appends all pixels, band by band.
    fn paint(&self, pixels: &mut Vec<[u8; 4]>) -> Result<()> {
        let positions = &self.geometry.positions;
        let points = memory::collected(positions.iter().map(|&point| self.view.transform(point)))?;
        let ghosts = self.geometry.parts.iter().any(|part| part.look.show_through > 0.0);

        let fine_width = self.width * FINE;
        let rows = (BAND / fine_width / FINE).clamp(1, self.height);
        let count = (rows * FINE * fine_width) as usize;
        let mut front = memory::reserved(count)?;
        let mut behind = memory::reserved(if ghosts { count } else { 0 })?;
        for top in (0..self.height).step_by(rows as usize) {
            let bottom = (top + rows).min(self.height);
            self.find_nearest(&points, top, bottom, &mut front, |_| true);
            if ghosts {
                self.find_nearest(&points, top, bottom, &mut behind, |triangle| {
                    self.geometry.part(triangle).look.show_through > 0.0
                });
            }
            for y in top..bottom {
                let background = shade::background((y as f32 + 0.5) / self.height as f32);
                let empty = self.encoder.encode(background);
                for x in 0..self.width {
                    let place = ((y - top) * FINE * fine_width + x * FINE) as usize;
                    let gather = |layer: &[PixelSample]| -> Samples {
                        let below = place + fine_width as usize;
                        [place, place + 1, below, below + 1].map(|place| layer[place])
                    };
                    let seen = gather(&front);
                    if seen.iter().all(|sample| sample.triangle == NOTHING) {
                        pixels.push(empty);
                        continue;
                    }
                    let hidden = ghosts.then(|| gather(&behind));
                    let colour = self.pixel(x, y, &seen, hidden.as_ref(), background);
                    pixels.push(self.encoder.encode(colour));
                }
            }
        }
        Ok(())
    }

    /// The nearest of some triangles in each sample of rows `top` to `bottom` of the picture.
    fn find_nearest(
        &self,
        points: &[Homogeneous],
        top: u32,
        bottom: u32,
        samples: &mut Vec<PixelSample>,
        wanted: impl Fn(u32) -> bool,
    ) {
        let width = self.width * FINE;
        let window = Window {
            left: 0,
            top: top * FINE,
            right: width,
            bottom: bottom * FINE,
        };
        let empty = PixelSample {
            depth: f32::INFINITY,
            triangle: NOTHING,
            weights: [0.0; 2],
        };
        samples.clear();
        samples.resize(((window.bottom - window.top) * width) as usize, empty);
        for (triangle, corners) in self.geometry.triangles.iter().enumerate() {
            let triangle = triangle as u32;
            if !wanted(triangle) {
                continue;
            }
            let corners = corners.map(|index| points[index as usize]);
            self.view.transformed_triangle(&window, corners, |fragment| {
                let place = (fragment.y - window.top) * width + fragment.x;
                let sample = &mut samples[place as usize];
                if fragment.depth < sample.depth {
                    *sample = PixelSample {
                        depth: fragment.depth,
                        triangle,
                        weights: [fragment.weights[0], fragment.weights[1]],
                    };
                }
            });
        }
    }

    /// The colour of a pixel, and of the hidden instrument that shows through it.
    fn pixel(&self, x: u32, y: u32, front: &Samples, behind: Option<&Samples>, background: Vec3) -> Vec3 {
        let mut colours = self
            .shade_samples(x, y, front, background, false)
            .map(|shaded| shaded.map_or(background, |shaded| shaded.colour));
        if let Some(behind) = behind {
            let hidden = |i: usize| behind[i].depth.is_finite() && behind[i].depth > front[i].depth;
            if (0..colours.len()).any(hidden) {
                let ghosts = self.shade_samples(x, y, behind, background, true);
                for (i, colour) in colours.iter_mut().enumerate().filter(|(i, _)| hidden(*i)) {
                    if let Some(ghost) = ghosts[i] {
                        let look = &self.geometry.part(behind[i].triangle).look;
                        let outline = (1.0 - ghost.facing).powi(2);
                        let strength = look.show_through.clamp(0.0, 1.0) * (0.3 + 0.7 * outline);
                        *colour = colour.lerp(ghost.colour, strength);
                    }
                }
            }
        }
        colours.iter().sum::<Vec3>() / colours.len() as f32
    }

    /// Shades a pixel's samples: together where they see one smooth surface, each on its own elsewhere.
    fn shade_samples(
        &self,
        x: u32,
        y: u32,
        samples: &Samples,
        background: Vec3,
        hidden: bool,
    ) -> [Option<Shaded>; (FINE * FINE) as usize] {
        let first = &samples[0];
        let spread = self.view.metres_per_pixel(f64::from(first.depth)) as f32 * 12.0;
        let alike = first.triangle != NOTHING
            && samples.iter().all(|sample| {
                sample.triangle == first.triangle
                    || (sample.triangle != NOTHING
                        && self.geometry.part_of[sample.triangle as usize]
                            == self.geometry.part_of[first.triangle as usize]
                        && (sample.depth - first.depth).abs() < spread)
            });
        if alike {
            let centre = [f64::from(x * FINE) + 1.0, f64::from(y * FINE) + 1.0];
            return [self.shade(centre, samples, background, hidden); 4];
        }
        let mut index = 0;
        samples.map(|sample| {
            let column = f64::from(x * FINE + index % FINE) + 0.5;
            let row = f64::from(y * FINE + index / FINE) + 0.5;
            index += 1;
            if sample.triangle == NOTHING {
                return None;
            }
            self.shade([column, row], &[sample], background, hidden)
        })
    }

    /// The colour at a place in the fine grid that these samples, all of one part, stand for; `hidden`: behind something.
    fn shade(&self, [x, y]: [f64; 2], samples: &[PixelSample], background: Vec3, hidden: bool) -> Option<Shaded> {
        let first = samples.first()?;
        let part = self.geometry.part(first.triangle);
        let look = &part.look;
        let depth = samples.iter().map(|sample| sample.depth).sum::<f32>() / samples.len() as f32;
        let position = self.view.unproject(x, y, f64::from(depth));
        let to_eye = (self.view.origin().as_vec3() - position).normalize_or_zero();
        // Normals change little within a pixel of one surface.
        let (normal, front) = self.geometry.normal(first.triangle, first.all_weights(), to_eye);
        let footprint = self.view.metres_per_pixel(f64::from(depth)) as f32 * FINE as f32;
        let mut colour = self.geometry.colour(first.triangle, first.all_weights());
        let mut remaining = 1.0;
        if let Kind::Ground(pattern) = &part.kind {
            let facing = normal.dot(to_eye).max(0.1);
            let (tint, left) = shade::ground(pattern, position, footprint / facing);
            colour *= tint;
            remaining = left;
        }
        // What is hidden is drawn as if in the open: inside tissue it would be black.
        let (lit, open) = if hidden || part.kind == Kind::Thread {
            (1.0, 1.0)
        } else {
            let scale = 1.0 / f64::from(FINE);
            (
                self.shadows.lit(position, normal),
                self.occlusion.open(x * scale, y * scale, depth, self.reach),
            )
        };
        let place = SurfacePlace {
            normal,
            to_eye,
            front,
            lit,
            open,
        };
        let mut shaded = self.lights.shade(look, colour, &place);
        if look.mesh_edges > 0.0 {
            let cover = samples
                .iter()
                .map(|sample| self.edge_cover(sample, footprint))
                .sum::<f32>();
            let strength = look.mesh_edges.min(1.0) * cover / samples.len() as f32;
            shaded *= 1.0 - 0.75 * strength;
        }
        Some(Shaded {
            colour: background.lerp(shaded, remaining),
            facing: normal.dot(to_eye).clamp(0.0, 1.0),
        })
    }

    /// How much of a sample an edge of its triangle covers, 0 to 1; fades out where triangles are a few pixels.
    fn edge_cover(&self, sample: &PixelSample, metres_per_pixel: f32) -> f32 {
        let corners = self.geometry.corners(sample.triangle);
        let [a, b, c] = corners;
        let area = (b - a).cross(c - a).length();
        let weights = sample.all_weights();
        let half_width = (0.0007 * self.height as f32).max(0.5);
        let mut nearest = f32::INFINITY;
        let mut smallest = f32::INFINITY;
        for i in 0..3 {
            let opposite = corners[(i + 1) % 3].distance(corners[(i + 2) % 3]);
            let height = area / opposite.max(f32::MIN_POSITIVE) / metres_per_pixel;
            nearest = nearest.min(weights[i] * height);
            smallest = smallest.min(height);
        }
        let room = shade::smoothstep(2.0, 8.0, smallest / half_width);
        room * (1.0 - shade::smoothstep(half_width - 0.5, half_width + 0.5, nearest))
    }
}

impl PixelSample {
    fn all_weights(&self) -> [f32; 3] {
        let [a, b] = self.weights;
        [a, b, 1.0 - a - b]
    }
}
