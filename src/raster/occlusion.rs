//! Ambient occlusion: the fraction of the sky hidden from each point. It darkens folds and contacts.

use super::fragment::Window;
use super::geometry::{Geometry, PartKind};
use super::view::View;
use crate::Result;
use crate::base::memory;
use glam::Vec3;

/// The number of samples around each pixel, on a spiral.
const TAPS: usize = 16;
/// The strength of the darkening.
const STRENGTH: f32 = 1.2;
/// The turns of the spiral; 7 turns with 16 samples leave out no direction.
const TURNS: f32 = 7.0;
/// The size of the square of pixels with different spiral rotations, over which the result is averaged.
const BLUR: usize = 4;

/// Screen-space ambient occlusion in a small image (McGuire et al., "The alchemy screen-space ambient obscurance
/// algorithm", 2011), interpolated by position and depth.
pub(crate) struct Occlusion {
    width: usize,
    height: usize,
    /// The resolution of this image relative to the final one.
    scale: f64,
    depths: Vec<f32>,
    visibility: Vec<f32>,
}

impl Occlusion {
    /// Computes the occlusion for the view `small` with `size` pixels, at `scale` times the final resolution. `reach`
    /// is the largest distance of an occluder, m.
    pub fn new(geometry: &Geometry, small: &View, size: [u32; 2], scale: f64, reach: f32) -> Result<Self> {
        let [width, height] = size.map(|length| length as usize);
        let mut depths = memory::filled(f32::INFINITY, width * height)?;
        let mut normals = memory::filled(Vec3::ZERO, width * height)?;
        let window = Window::new(size[0], size[1]);
        let eye = small.origin().as_vec3();
        for triangle in 0..geometry.triangles.len() as u32 {
            if geometry.part(triangle).kind == PartKind::Thread {
                continue;
            }
            let corners = geometry.corners(triangle);
            let to_eye = (eye - corners[0]).normalize_or_zero();
            small.triangle(&window, corners, |fragment| {
                let pixel = fragment.y as usize * width + fragment.x as usize;
                if fragment.depth < depths[pixel] {
                    depths[pixel] = fragment.depth;
                    normals[pixel] = geometry.normal(triangle, fragment.weights, to_eye).0;
                }
            });
        }
        let mut occlusion = Occlusion {
            width,
            height,
            scale,
            depths,
            visibility: memory::filled(1.0, width * height)?,
        };
        let mut positions = memory::filled(Vec3::ZERO, width * height)?;
        for (pixel, position) in positions.iter_mut().enumerate() {
            let depth = occlusion.depths[pixel];
            if depth.is_finite() {
                let (x, y) = ((pixel % width) as f64 + 0.5, (pixel / width) as f64 + 0.5);
                *position = small.unproject(x, y, f64::from(depth));
            }
        }
        let spirals = spirals();
        for pixel in 0..width * height {
            if occlusion.depths[pixel].is_finite() {
                let (x, y) = (pixel % width, pixel / width);
                let spiral = &spirals[y % BLUR * BLUR + x % BLUR];
                let pixels = reach / small.meters_per_pixel(f64::from(occlusion.depths[pixel])) as f32;
                let radius = pixels.clamp(2.0, width as f32 / 4.0);
                let displacement = |dx: f32, dy: f32| {
                    let column = x as f32 + 0.5 + dx * radius;
                    let row = y as f32 + 0.5 + dy * radius;
                    let inside = column >= 0.0 && row >= 0.0 && column < width as f32 && row < height as f32;
                    let other = if inside {
                        row as usize * width + column as usize
                    } else {
                        pixel
                    };
                    let is_covered = occlusion.depths[other].is_finite();
                    if is_covered {
                        positions[other] - positions[pixel]
                    } else {
                        Vec3::ZERO
                    }
                };
                occlusion.visibility[pixel] = sky_visibility(spiral, normals[pixel], reach, displacement);
            }
        }
        occlusion.blur(reach)?;
        Ok(occlusion)
    }

    /// Averages over the pixels with different spirals, along rows and then columns, within one surface.
    fn blur(&mut self, reach: f32) -> Result<()> {
        let mut result = memory::filled(1.0, self.visibility.len())?;
        for step in [1, self.width] {
            for (pixel, value) in result.iter_mut().enumerate() {
                let depth = self.depths[pixel];
                let (mut sum, mut total) = (0.0, 0.0);
                for k in 0..=BLUR {
                    let Some(other) = (pixel + k * step).checked_sub(BLUR / 2 * step) else {
                        continue;
                    };
                    let Some(other_depth) = self.depths.get(other) else {
                        continue;
                    };
                    let is_near = (other_depth - depth).abs() < 0.3 * reach;
                    // The first and the last have the same position in the pattern.
                    let weight = if k == 0 || k == BLUR { 0.5 } else { 1.0 };
                    if is_near {
                        sum += weight * self.visibility[other];
                        total += weight;
                    }
                }
                *value = if total > 0.0 { sum / total } else { 1.0 };
            }
            std::mem::swap(&mut self.visibility, &mut result);
        }
        Ok(())
    }

    /// The visible fraction of the sky, 0 to 1, at coordinates of the final image and a depth.
    pub fn visibility(&self, x: f64, y: f64, depth: f32, reach: f32) -> f32 {
        let column = (x * self.scale - 0.5).max(0.0);
        let row = (y * self.scale - 0.5).max(0.0);
        let (left, top) = (column as usize, row as usize);
        let (across, down) = (column.fract() as f32, row.fract() as f32);
        let (mut sum, mut total) = (0.0, 1e-6);
        for (j, vertical) in [1.0 - down, down].into_iter().enumerate() {
            for (i, horizontal) in [1.0 - across, across].into_iter().enumerate() {
                let pixel = (top + j).min(self.height - 1) * self.width + (left + i).min(self.width - 1);
                let difference = (self.depths[pixel] - depth).abs() / reach;
                let weight = horizontal * vertical / (0.02 + difference).powi(2) + 1e-9;
                if weight.is_finite() {
                    sum += weight * self.visibility[pixel];
                    total += weight;
                }
            }
        }
        (sum / total).clamp(0.0, 1.0)
    }
}

/// The sample offsets, up to 1, for each position in the pattern of rotations.
fn spirals() -> [[[f32; 2]; TAPS]; BLUR * BLUR] {
    std::array::from_fn(|pattern| {
        let rotation = pattern as f32 / (BLUR * BLUR) as f32;
        std::array::from_fn(|tap| {
            let t = (tap as f32 + 0.5) / TAPS as f32;
            let angle = std::f32::consts::TAU * (t * TURNS + rotation);
            [t * angle.cos(), t * angle.sin()]
        })
    })
}

/// The visible fraction of the sky at a point with this normal. `displacement` returns the vector to the visible point
/// at an offset.
fn sky_visibility(spiral: &[[f32; 2]; TAPS], normal: Vec3, reach: f32, displacement: impl Fn(f32, f32) -> Vec3) -> f32 {
    // Heights below this are the curvature of the surface itself.
    let bias = 0.03 * reach;
    let mut hidden = 0.0;
    for &[across, down] in spiral {
        let displacement = displacement(across, down);
        let height = (displacement.dot(normal) - bias).max(0.0);
        let squared = displacement.length_squared() / (reach * reach);
        hidden += (1.0 - squared).max(0.0) * (height / reach) / (squared + 0.01);
    }
    (1.0 - STRENGTH * hidden / TAPS as f32).clamp(0.0, 1.0)
}
