//! Shadows of the key light by a depth map from the light.

use super::fragment::Window;
use super::geometry::{Geometry, PartKind};
use super::scene::bounds;
use super::view::View;
use crate::Result;
use crate::base::memory;
use glam::Vec3;

/// The texels along each side.
const SIZE: u32 = 1024;
/// The texels across the filter, which softens the edges of shadows.
const TAPS: usize = 8;
/// The columns and rows of the filter that are tested first.
const PROBES: [usize; 3] = [0, 4, 7];

/// A shadow map (Williams, "Casting curved shadows on curved surfaces", 1978) with percentage-closer filtering (Reeves
/// et al., "Rendering antialiased shadows with depth maps", 1987).
pub(crate) struct ShadowMap {
    view: View,
    depths: Vec<f32>,
    texel: f32,
}

impl ShadowMap {
    /// Renders the depths of all solid parts for light from `direction`, a unit vector toward the light.
    pub fn new(geometry: &Geometry, direction: Vec3) -> Result<Self> {
        let solid =
            || (0..geometry.triangles.len() as u32).filter(|&triangle| geometry.part(triangle).kind == PartKind::Solid);
        let points = || {
            solid()
                .flat_map(|triangle| geometry.corners(triangle))
                .filter(|point| point.is_finite())
        };
        let (low, high) = bounds(points());
        let (centre, radius) = if low.x <= high.x {
            let centre = (low + high) / 2.0;
            let far = points().map(|point| point.distance(centre));
            (centre, far.fold(0.0, f32::max))
        } else {
            (Vec3::ZERO, 1.0)
        };
        let half_width = radius * 1.05;
        let view = View::orthographic(
            centre + direction * half_width,
            -direction,
            Vec3::Y,
            f64::from(SIZE) / f64::from(2.0 * half_width),
            SIZE,
            SIZE,
        );
        let count = SIZE as usize * SIZE as usize;
        let mut depths = memory::filled(f32::INFINITY, count)?;
        let window = Window::new(SIZE, SIZE);
        for triangle in solid() {
            view.triangle(&window, geometry.corners(triangle), |fragment| {
                let texel_index = fragment.y as usize * SIZE as usize + fragment.x as usize;
                if let Some(depth) = depths.get_mut(texel_index) {
                    *depth = depth.min(fragment.depth);
                }
            });
        }
        Ok(ShadowMap {
            view,
            depths,
            texel: 2.0 * half_width / SIZE as f32,
        })
    }

    /// The fraction of the light that reaches a point of a surface, 0 to 1.
    pub fn lit(&self, position: Vec3, normal: Vec3) -> f32 {
        // Offset from the surface, so that it does not shadow itself.
        let Some(projected) = self.view.project(position + normal * (3.0 * self.texel)) else {
            return 1.0;
        };
        let depth = projected.depth as f32 - self.texel;
        let (x, y) = (projected.x as f32 - 0.5, projected.y as f32 - 0.5);
        let (low, high) = (TAPS as f32 / 2.0, (SIZE - TAPS as u32 / 2) as f32 - 1.0);
        if !(x >= low && y >= low && x < high && y < high) {
            return 1.0;
        }
        let first = |value: f32| value as usize + 1 - TAPS / 2;
        let (left, top) = (first(x), first(y));
        let in_light = |column: usize, row: usize| {
            let texel = self.depths.get((top + row) * SIZE as usize + left + column);
            texel.is_none_or(|&texel| texel >= depth)
        };
        // Nearly everywhere, all texels of the filter agree.
        let probes = PROBES.map(|row| PROBES.map(|column| in_light(column, row)));
        let count = probes.as_flattened().iter().filter(|&&lit| lit).count();
        if count == 0 || count == PROBES.len() * PROBES.len() {
            return if count == 0 { 0.0 } else { 1.0 };
        }
        let (column_weights, row_weights) = (weights(x.fract()), weights(y.fract()));
        let mut light = 0.0;
        for (i, weight) in row_weights.iter().enumerate() {
            let start = (top + i) * SIZE as usize + left;
            let texels = self.depths.get(start..start + TAPS).unwrap_or(&[]);
            for (texel, column_weight) in texels.iter().zip(column_weights) {
                light += if *texel >= depth { weight * column_weight } else { 0.0 };
            }
        }
        light
    }
}

/// The filter weights of the texels around a position that is `t` past the center of the inner left one. They are the
/// bump (1 - d^2)^2 in the distance d relative to half the filter's width, normalized to sum 1.
fn weights(t: f32) -> [f32; TAPS] {
    let half = TAPS as f32 / 2.0;
    let bump = std::array::from_fn(|i| {
        let distance = (i as f32 + 1.0 - half - t) / half;
        (1.0 - distance * distance).max(0.0).powi(2)
    });
    let sum: f32 = bump.iter().sum();
    bump.map(|weight: f32| weight / sum)
}
