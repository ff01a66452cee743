//! How much of the sky is hidden from each place: dark in folds and where things touch.

use super::fragment::Window;
use super::geometry::{Geometry, Kind};
use super::view::View;
use crate::Result;
use crate::base::memory;
use glam::Vec3;

/// Places looked at around each pixel, on a spiral.
const TAPS: usize = 16;
/// How dark hidden places become.
const STRENGTH: f32 = 1.2;
/// Turns of the spiral; with 16 taps this leaves no direction out.
const TURNS: f32 = 7.0;
/// Pixels in a row or column whose spirals are turned differently, and over which the result is averaged.
const BLUR: usize = 4;

/// Ambient occlusion in a small picture of its own (McGuire et al., "The alchemy screen-space ambient obscurance
/// algorithm", 2011), looked up by place and depth.
pub(crate) struct Occlusion {
    width: usize,
    height: usize,
    /// Pixels here per pixel of the picture.
    scale: f64,
    depths: Vec<f32>,
    open: Vec<f32>,
}

impl Occlusion {
    /// For a picture seen in `view`; `small` is the same view of `size` pixels, `scale` pixels for one of the picture.
    /// `reach`, in metres, is how far something may be and still hide the sky.
    pub fn new(geometry: &Geometry, small: &View, size: [u32; 2], scale: f64, reach: f32) -> Result<Self> {
        let [width, height] = size.map(|length| length as usize);
        let mut depths = memory::filled(f32::INFINITY, width * height)?;
        let mut normals = memory::filled(Vec3::ZERO, width * height)?;
        let window = Window::new(size[0], size[1]);
        let eye = small.origin().as_vec3();
        for triangle in 0..geometry.triangles.len() as u32 {
            if geometry.part(triangle).kind == Kind::Thread {
                continue;
            }
            let corners = geometry.corners(triangle);
            let to_eye = (eye - corners[0]).normalize_or_zero();
            small.triangle(&window, corners, |fragment| {
                let place = fragment.y as usize * width + fragment.x as usize;
                if fragment.depth < depths[place] {
                    depths[place] = fragment.depth;
                    normals[place] = geometry.normal(triangle, fragment.weights, to_eye).0;
                }
            });
        }
        let mut occlusion = Occlusion {
            width,
            height,
            scale,
            depths,
            open: memory::filled(1.0, width * height)?,
        };
        let mut positions = memory::filled(Vec3::ZERO, width * height)?;
        for (place, position) in positions.iter_mut().enumerate() {
            let depth = occlusion.depths[place];
            if depth.is_finite() {
                let (x, y) = ((place % width) as f64 + 0.5, (place / width) as f64 + 0.5);
                *position = small.unproject(x, y, f64::from(depth));
            }
        }
        let spirals = spirals();
        for place in 0..width * height {
            if occlusion.depths[place].is_finite() {
                let (x, y) = (place % width, place / width);
                let spiral = &spirals[y % BLUR * BLUR + x % BLUR];
                let pixels = reach / small.metres_per_pixel(f64::from(occlusion.depths[place])) as f32;
                let radius = pixels.clamp(2.0, width as f32 / 4.0);
                let way = |dx: f32, dy: f32| {
                    let column = x as f32 + 0.5 + dx * radius;
                    let row = y as f32 + 0.5 + dy * radius;
                    let inside = column >= 0.0 && row >= 0.0 && column < width as f32 && row < height as f32;
                    let other = if inside {
                        row as usize * width + column as usize
                    } else {
                        place
                    };
                    let known = occlusion.depths[other].is_finite();
                    if known {
                        positions[other] - positions[place]
                    } else {
                        Vec3::ZERO
                    }
                };
                occlusion.open[place] = open_sky(spiral, normals[place], reach, way);
            }
        }
        occlusion.blur(reach)?;
        Ok(occlusion)
    }

    /// Averages over the pixels whose spirals differ, along rows and then columns, within one surface.
    fn blur(&mut self, reach: f32) -> Result<()> {
        let mut result = memory::filled(1.0, self.open.len())?;
        for step in [1, self.width] {
            for (place, value) in result.iter_mut().enumerate() {
                let depth = self.depths[place];
                let (mut sum, mut total) = (0.0, 0.0);
                for k in 0..=BLUR {
                    let Some(other) = (place + k * step).checked_sub(BLUR / 2 * step) else {
                        continue;
                    };
                    let Some(other_depth) = self.depths.get(other) else {
                        continue;
                    };
                    let near = (other_depth - depth).abs() < 0.3 * reach;
                    // The first and the last fall on the same place of the pattern.
                    let weight = if k == 0 || k == BLUR { 0.5 } else { 1.0 };
                    if near {
                        sum += weight * self.open[other];
                        total += weight;
                    }
                }
                *value = if total > 0.0 { sum / total } else { 1.0 };
            }
            std::mem::swap(&mut self.open, &mut result);
        }
        Ok(())
    }

    /// The share of the sky that is open at coordinates of the picture and this depth, 0 to 1.
    pub fn open(&self, x: f64, y: f64, depth: f32, reach: f32) -> f32 {
        let column = (x * self.scale - 0.5).max(0.0);
        let row = (y * self.scale - 0.5).max(0.0);
        let (left, top) = (column as usize, row as usize);
        let (across, down) = (column.fract() as f32, row.fract() as f32);
        let (mut sum, mut total) = (0.0, 1e-6);
        for (j, vertical) in [1.0 - down, down].into_iter().enumerate() {
            for (i, horizontal) in [1.0 - across, across].into_iter().enumerate() {
                let place = (top + j).min(self.height - 1) * self.width + (left + i).min(self.width - 1);
                let difference = (self.depths[place] - depth).abs() / reach;
                let weight = horizontal * vertical / (0.02 + difference).powi(2) + 1e-9;
                if weight.is_finite() {
                    sum += weight * self.open[place];
                    total += weight;
                }
            }
        }
        (sum / total).clamp(0.0, 1.0)
    }
}

/// The offsets of the taps, up to 1, for each place in the pattern of turns.
fn spirals() -> [[[f32; 2]; TAPS]; BLUR * BLUR] {
    std::array::from_fn(|pattern| {
        let turn = pattern as f32 / (BLUR * BLUR) as f32;
        std::array::from_fn(|tap| {
            let share = (tap as f32 + 0.5) / TAPS as f32;
            let angle = std::f32::consts::TAU * (share * TURNS + turn);
            [share * angle.cos(), share * angle.sin()]
        })
    })
}

/// The share of the sky that is open at a place with this normal; `way` leads to what is seen at an offset.
fn open_sky(spiral: &[[f32; 2]; TAPS], normal: Vec3, reach: f32, way: impl Fn(f32, f32) -> Vec3) -> f32 {
    // Below this height over the tangent plane it is the roundness of the surface itself.
    let bias = 0.03 * reach;
    let mut hidden = 0.0;
    for &[across, down] in spiral {
        let way = way(across, down);
        let height = (way.dot(normal) - bias).max(0.0);
        let squared = way.length_squared() / (reach * reach);
        hidden += (1.0 - squared).max(0.0) * (height / reach) / (squared + 0.01);
    }
    (1.0 - STRENGTH * hidden / TAPS as f32).clamp(0.0, 1.0)
}
