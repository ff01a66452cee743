//! Rendering of a scene into an image.

use super::camera::Camera;
use super::fragment::Window;
use super::geometry::{Geometry, PartKind};
use super::occlusion::Occlusion;
use super::scene::Scene;
use super::shade::{self, Encoder, Lights, ShadingPoint};
use super::shadow::ShadowMap;
use super::view::{Homogeneous, View};
use crate::Result;
#[cfg(doc)]
use crate::base::Error;
use crate::base::{ensure, memory};
use glam::Vec3;

/// The samples per pixel along each axis.
const SUPERSAMPLING: u32 = 2;
/// The most samples in memory at once; a large image is rendered in bands of rows.
const BAND_SAMPLES: u32 = 1 << 18;
/// The longer side of the image for ambient occlusion, in pixels.
const OCCLUSION_SIZE: f64 = 640.0;
/// The longest side of an image, in pixels.
const MAX_SIZE: u32 = 16_384;
/// The index of no triangle.
const NOTHING: u32 = u32::MAX;

/// An image: pixels row by row from the upper left.
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
    /// The number of pixels in a row.
    pub width: u32,
    /// The number of rows.
    pub height: u32,
    /// Red, green, blue and alpha (sRGB) of width x height pixels.
    pub pixels: Vec<[u8; 4]>,
}

impl Scene<'_> {
    /// Renders the scene, anti-aliased with four samples per pixel. The result is deterministic.
    ///
    /// Triangles and lines with a coordinate that is not finite are ignored. Besides the image, rendering takes about
    /// 50 bytes per triangle and 30 MB.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] if the width or height is not 1 to 16384, an index has no position, or
    /// [`Camera::view`] returns an error. [`Error::OutOfMemory`].
    pub fn draw(&self, camera: &Camera, width: u32, height: u32) -> Result<Image> {
        for (name, size) in [("width", width), ("height", height)] {
            ensure!((1..=MAX_SIZE).contains(&size), "{name} is {size}, not 1 to {MAX_SIZE}");
        }
        let view = camera.view(width * SUPERSAMPLING, height * SUPERSAMPLING)?;
        let geometry = Geometry::new(self, &view, height)?;
        let renderer = Renderer::new(&geometry, camera, view, [width, height], self)?;
        let mut pixels = memory::reserved(width as usize * height as usize)?;
        renderer.render(&mut pixels)?;
        Ok(Image { width, height, pixels })
    }
}

/// The renderer of one image.
struct Renderer<'a> {
    geometry: &'a Geometry,
    view: View,
    width: u32,
    height: u32,
    lights: Lights,
    shadows: ShadowMap,
    occlusion: Occlusion,
    /// The largest distance of an occluder, m.
    reach: f32,
    encoder: Encoder,
}

/// The nearest triangle at a sample.
#[derive(Clone, Copy)]
struct PixelSample {
    depth: f32,
    triangle: u32,
    /// The barycentric weights of the first two corners.
    weights: [f32; 2],
}

/// The color of a sample, and the cosine between normal and view direction.
#[derive(Clone, Copy)]
struct Shaded {
    colour: Vec3,
    facing: f32,
}

/// The samples of a pixel.
type Samples = [PixelSample; (SUPERSAMPLING * SUPERSAMPLING) as usize];

impl<'a> Renderer<'a> {
    fn new(geometry: &'a Geometry, camera: &Camera, view: View, size: [u32; 2], scene: &Scene) -> Result<Self> {
        let [right, up, forward] = view.axes().map(|axis| axis.as_vec3());
        let lights = Lights::new([right, up, -forward]);
        let extent = scene.extent().map_or(0.0, |(low, high)| (high - low).length());
        let extent = if extent > 0.0 { extent } else { 1.0 };
        let longest = f64::from(size[0].max(size[1]));
        let scale = (OCCLUSION_SIZE / longest).min(1.0);
        let small = size.map(|length| ((f64::from(length) * scale).round() as u32).max(1));
        // The height defines the scale of a view, here after rounding.
        let scale = f64::from(small[1]) / f64::from(size[1]);
        let reach = 0.09 * extent;
        let small_view = camera.view(small[0], small[1])?;
        Ok(Renderer {
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
    fn render(&self, pixels: &mut Vec<[u8; 4]>) -> Result<()> {
        let positions = &self.geometry.positions;
        let points = memory::collected(positions.iter().map(|&point| self.view.transform(point)))?;
        let hidden_layer = self.geometry.parts.iter().any(|part| part.look.show_through > 0.0);

        let fine_width = self.width * SUPERSAMPLING;
        let rows = (BAND_SAMPLES / fine_width / SUPERSAMPLING).clamp(1, self.height);
        let count = (rows * SUPERSAMPLING * fine_width) as usize;
        let mut front = memory::reserved(count)?;
        let mut behind = memory::reserved(if hidden_layer { count } else { 0 })?;
        for top in (0..self.height).step_by(rows as usize) {
            let bottom = (top + rows).min(self.height);
            self.rasterize_nearest(&points, top, bottom, &mut front, |_| true);
            if hidden_layer {
                self.rasterize_nearest(&points, top, bottom, &mut behind, |triangle| {
                    self.geometry.part(triangle).look.show_through > 0.0
                });
            }
            for y in top..bottom {
                let background = shade::background((y as f32 + 0.5) / self.height as f32);
                let empty = self.encoder.encode(background);
                for x in 0..self.width {
                    let sample_index = ((y - top) * SUPERSAMPLING * fine_width + x * SUPERSAMPLING) as usize;
                    let pixel_samples = |layer: &[PixelSample]| -> Samples {
                        let below = sample_index + fine_width as usize;
                        [sample_index, sample_index + 1, below, below + 1].map(|sample_index| layer[sample_index])
                    };
                    let seen = pixel_samples(&front);
                    if seen.iter().all(|sample| sample.triangle == NOTHING) {
                        pixels.push(empty);
                        continue;
                    }
                    let hidden = hidden_layer.then(|| pixel_samples(&behind));
                    let colour = self.pixel(x, y, &seen, hidden.as_ref(), background);
                    pixels.push(self.encoder.encode(colour));
                }
            }
        }
        Ok(())
    }

    /// Finds the nearest accepted triangle at each sample of the image rows `top` to `bottom`.
    fn rasterize_nearest(
        &self,
        points: &[Homogeneous],
        top: u32,
        bottom: u32,
        samples: &mut Vec<PixelSample>,
        accepts: impl Fn(u32) -> bool,
    ) {
        let width = self.width * SUPERSAMPLING;
        let window = Window {
            left: 0,
            top: top * SUPERSAMPLING,
            right: width,
            bottom: bottom * SUPERSAMPLING,
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
            if !accepts(triangle) {
                continue;
            }
            let corners = corners.map(|index| points[index as usize]);
            self.view.transformed_triangle(&window, corners, |fragment| {
                let sample_index = (fragment.y - window.top) * width + fragment.x;
                let sample = &mut samples[sample_index as usize];
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

    /// The color of a pixel, including the hidden objects that show through.
    fn pixel(&self, x: u32, y: u32, front: &Samples, behind: Option<&Samples>, background: Vec3) -> Vec3 {
        let mut colours = self
            .shade_samples(x, y, front, background, false)
            .map(|shaded| shaded.map_or(background, |shaded| shaded.colour));
        if let Some(behind) = behind {
            let hidden = |i: usize| behind[i].depth.is_finite() && behind[i].depth > front[i].depth;
            if (0..colours.len()).any(hidden) {
                let shaded_hidden = self.shade_samples(x, y, behind, background, true);
                for (i, colour) in colours.iter_mut().enumerate().filter(|(i, _)| hidden(*i)) {
                    if let Some(shaded) = shaded_hidden[i] {
                        let look = &self.geometry.part(behind[i].triangle).look;
                        let outline = (1.0 - shaded.facing).powi(2);
                        let strength = look.show_through.clamp(0.0, 1.0) * (0.3 + 0.7 * outline);
                        *colour = colour.lerp(shaded.colour, strength);
                    }
                }
            }
        }
        colours.iter().sum::<Vec3>() / colours.len() as f32
    }

    /// Shades a pixel's samples: together if they are on one smooth surface, else separately.
    fn shade_samples(
        &self,
        x: u32,
        y: u32,
        samples: &Samples,
        background: Vec3,
        hidden: bool,
    ) -> [Option<Shaded>; (SUPERSAMPLING * SUPERSAMPLING) as usize] {
        let first = &samples[0];
        let spread = self.view.meters_per_pixel(f64::from(first.depth)) as f32 * 12.0;
        let is_uniform = first.triangle != NOTHING
            && samples.iter().all(|sample| {
                sample.triangle == first.triangle
                    || (sample.triangle != NOTHING
                        && self.geometry.part_index[sample.triangle as usize]
                            == self.geometry.part_index[first.triangle as usize]
                        && (sample.depth - first.depth).abs() < spread)
            });
        if is_uniform {
            let centre = [f64::from(x * SUPERSAMPLING) + 1.0, f64::from(y * SUPERSAMPLING) + 1.0];
            return [self.shade(centre, samples, background, hidden); 4];
        }
        let mut index = 0;
        samples.map(|sample| {
            let column = f64::from(x * SUPERSAMPLING + index % SUPERSAMPLING) + 0.5;
            let row = f64::from(y * SUPERSAMPLING + index / SUPERSAMPLING) + 0.5;
            index += 1;
            if sample.triangle == NOTHING {
                return None;
            }
            self.shade([column, row], &[sample], background, hidden)
        })
    }

    /// The color at a position in the sample grid, for samples of one part. `hidden` is true behind another object.
    fn shade(&self, [x, y]: [f64; 2], samples: &[PixelSample], background: Vec3, hidden: bool) -> Option<Shaded> {
        let first = samples.first()?;
        let part = self.geometry.part(first.triangle);
        let look = &part.look;
        let depth = samples.iter().map(|sample| sample.depth).sum::<f32>() / samples.len() as f32;
        let position = self.view.unproject(x, y, f64::from(depth));
        let to_eye = (self.view.origin().as_vec3() - position).normalize_or_zero();
        // Normals vary little within a pixel of one surface.
        let (normal, front) = self.geometry.normal(first.triangle, first.all_weights(), to_eye);
        let footprint = self.view.meters_per_pixel(f64::from(depth)) as f32 * SUPERSAMPLING as f32;
        let mut colour = self.geometry.colour(first.triangle, first.all_weights());
        let mut opacity = 1.0;
        if let PartKind::Ground(pattern) = &part.kind {
            let facing = normal.dot(to_eye).max(0.1);
            let (tint, fade) = shade::ground(pattern, position, footprint / facing);
            colour *= tint;
            opacity = fade;
        }
        // Hidden objects are shaded without shadows: inside tissue they would be black.
        let (lit, sky) = if hidden || part.kind == PartKind::Thread {
            (1.0, 1.0)
        } else {
            let scale = 1.0 / f64::from(SUPERSAMPLING);
            (
                self.shadows.lit(position, normal),
                self.occlusion.visibility(x * scale, y * scale, depth, self.reach),
            )
        };
        let point = ShadingPoint {
            normal,
            to_eye,
            front,
            lit,
            sky,
        };
        let mut shaded = self.lights.shade(look, colour, &point);
        if look.mesh_edges > 0.0 {
            let cover = samples
                .iter()
                .map(|sample| self.edge_cover(sample, footprint))
                .sum::<f32>();
            let strength = look.mesh_edges.min(1.0) * cover / samples.len() as f32;
            shaded *= 1.0 - 0.75 * strength;
        }
        Some(Shaded {
            colour: background.lerp(shaded, opacity),
            facing: normal.dot(to_eye).clamp(0.0, 1.0),
        })
    }

    /// The fraction of a sample that an edge of its triangle covers, 0 to 1. It fades out for triangles of a few
    /// pixels.
    fn edge_cover(&self, sample: &PixelSample, meters_per_pixel: f32) -> f32 {
        let corners = self.geometry.corners(sample.triangle);
        let [a, b, c] = corners;
        let area = (b - a).cross(c - a).length();
        let weights = sample.all_weights();
        let half_width = (0.0007 * self.height as f32).max(0.5);
        let mut nearest = f32::INFINITY;
        let mut smallest = f32::INFINITY;
        for i in 0..3 {
            let opposite = corners[(i + 1) % 3].distance(corners[(i + 2) % 3]);
            let height = area / opposite.max(f32::MIN_POSITIVE) / meters_per_pixel;
            nearest = nearest.min(weights[i] * height);
            smallest = smallest.min(height);
        }
        let fade = shade::smoothstep(2.0, 8.0, smallest / half_width);
        fade * (1.0 - shade::smoothstep(half_width - 0.5, half_width + 0.5, nearest))
    }
}

impl PixelSample {
    fn all_weights(&self) -> [f32; 3] {
        let [a, b] = self.weights;
        [a, b, 1.0 - a - b]
    }
}
