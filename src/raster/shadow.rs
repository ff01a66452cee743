//! Shadows of the key light: the scene's depth as the light sees it.

use super::fragment::Window;
use super::geometry::{Geometry, Kind};
use super::scene::bounds;
use super::view::View;
use crate::Result;
use glam::Vec3;

/// Texels along each side.
const SIZE: u32 = 640;

/// A shadow map (Williams, "Casting curved shadows on curved surfaces", 1978), filtered with a cubic B-spline.
pub(crate) struct ShadowMap {
    view: View,
    depths: Vec<f32>,
    texel: f32,
}

impl ShadowMap {
    /// The shadows of everything solid in light from `direction` (towards the light, length one).
    pub fn new(geometry: &Geometry, direction: Vec3) -> Result<Self> {
        let solid = || {
            (0..geometry.triangles.len() as u32)
                .filter(|&triangle| geometry.part(triangle).kind == Kind::Solid)
        };
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
        let mut depths = Vec::new();
        depths.try_reserve_exact(count)?;
        depths.resize(count, f32::INFINITY);
        let window = Window::new(SIZE, SIZE);
        for triangle in solid() {
            view.triangle(&window, geometry.corners(triangle), |fragment| {
                let place = fragment.y as usize * SIZE as usize + fragment.x as usize;
                if let Some(depth) = depths.get_mut(place) {
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

    /// How much of the light reaches a point of a surface, 0 to 1.
    pub fn lit(&self, position: Vec3, normal: Vec3) -> f32 {
        // Off the surface, so that it does not shade itself.
        let Some(place) = self.view.project(position + normal * (3.0 * self.texel)) else {
            return 1.0;
        };
        let depth = place.depth as f32 - self.texel;
        let (x, y) = (place.x as f32 - 0.5, place.y as f32 - 0.5);
        if !(x > 1.0 && y > 1.0 && x < SIZE as f32 - 3.0 && y < SIZE as f32 - 3.0) {
            return 1.0;
        }
        let (column, row) = (x.floor(), y.floor());
        let (across, down) = (spline(x - column), spline(y - row));
        let (left, top) = (column as usize - 1, row as usize - 1);
        let mut light = 0.0;
        for (i, weight) in down.iter().enumerate() {
            let start = (top + i) * SIZE as usize + left;
            let texels = self.depths.get(start..start + 4).unwrap_or(&[]);
            for (texel, share) in texels.iter().zip(across) {
                light += if *texel >= depth { weight * share } else { 0.0 };
            }
        }
        light
    }
}

/// The weights of a uniform cubic B-spline.
fn spline(t: f32) -> [f32; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [
        (1.0 - 3.0 * t + 3.0 * t2 - t3) / 6.0,
        (4.0 - 6.0 * t2 + 3.0 * t3) / 6.0,
        (1.0 + 3.0 * t + 3.0 * t2 - 3.0 * t3) / 6.0,
        t3 / 6.0,
    ]
}
