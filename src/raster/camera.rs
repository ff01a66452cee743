//! The camera of an image.

use super::view::{View, axes};
use crate::Result;
#[cfg(doc)]
use crate::base::Error;
use crate::base::ensure;
use glam::{DVec3, Vec3};

/// The free margin of a fitted view, as a fraction of the half width or height.
const MARGIN: f64 = 0.06;

/// The least distance of a fitted camera from the nearest point, as a fraction of the points' extent.
const NEAREST: f64 = 0.02;

/// The near plane, as a fraction of the distance from the eye to the target.
const NEAR: f64 = 1e-3;

/// A pinhole camera.
///
/// ```
/// # use glam::Vec3;
/// use sinew::raster::Camera;
/// let camera = Camera { eye: Vec3::Z, target: Vec3::ZERO, up: Vec3::Y, field_of_view: 0.6 };
/// let middle = camera.view(64, 48)?.project(Vec3::ZERO).expect("it is in front");
/// assert!((middle.x - 32.0).abs() < 1e-6 && (middle.y - 24.0).abs() < 1e-6);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// The position of the camera, m.
    pub eye: Vec3,
    /// The point that the camera looks at, in the center of the image, m.
    pub target: Vec3,
    /// The direction that points up in the image, of any length. If it is parallel to the view direction, another axis
    /// replaces it.
    pub up: Vec3,
    /// The vertical field of view, between 0 and pi, rad.
    pub field_of_view: f32,
}

impl Camera {
    /// The nearest camera in a direction that has all `points` in the frame, with a margin of 6 %.
    ///
    /// `direction` points from the scene to the camera; `aspect` is width over height. The fit is exact: points touch
    /// one pair of opposite margins. The exception is a camera closer to the nearest point than 2 % of the points'
    /// extent, for example with points in a row along the view; it moves back to that distance. Points that are not
    /// finite are ignored. A single point is viewed from 1 m; without points it is the origin. A zero direction, or an
    /// `up` parallel to it, is replaced.
    /// # Errors
    /// [`Error::InvalidArgument`] if a direction, `up` or the angle is not finite, the angle is not between 0 and pi,
    /// or the aspect is not above 0.
    pub fn fitted(
        points: impl IntoIterator<Item = Vec3>,
        direction: Vec3,
        up: Vec3,
        field_of_view: f32,
        aspect: f32,
    ) -> Result<Self> {
        check_direction("direction", direction)?;
        check_direction("up", up)?;
        check_angle(field_of_view)?;
        ensure!(aspect > 0.0 && aspect.is_finite(), "aspect is {aspect}, not above 0");
        let direction = if direction.as_dvec3().length_squared() > 0.0 {
            direction
        } else {
            Vec3::Z
        };
        let [right, upwards, forward] = axes(-direction, up);
        let tangent_y = f64::from(field_of_view / 2.0).tan() * (1.0 - MARGIN);
        let tangent_x = tangent_y * f64::from(aspect);

        // Each side of the frame is a plane through the eye. The point furthest outside determines its position.
        let mut sides = [f64::NEG_INFINITY; 4];
        let mut bounds = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for point in points.into_iter().filter(|point| point.is_finite()) {
            let point = point.as_dvec3();
            let view_point = DVec3::new(point.dot(right), point.dot(upwards), -point.dot(forward));
            bounds = (bounds.0.min(view_point), bounds.1.max(view_point));
            let outward = [view_point.x, -view_point.x, view_point.y, -view_point.y];
            for (i, side) in sides.iter_mut().enumerate() {
                let tangent = if i < 2 { tangent_x } else { tangent_y };
                *side = side.max(outward[i] + tangent * view_point.z);
            }
        }
        if bounds.0.x > bounds.1.x {
            bounds = (DVec3::ZERO, DVec3::ZERO);
            sides = [0.0; 4];
        }
        let size = (bounds.1 - bounds.0).length();
        let least_distance = if size > 0.0 { NEAREST * size } else { 1.0 };
        let distance = ((sides[0] + sides[1]) / (2.0 * tangent_x))
            .max((sides[2] + sides[3]) / (2.0 * tangent_y))
            .max(bounds.1.z + least_distance);
        let offset = right * ((sides[0] - sides[1]) / 2.0) + upwards * ((sides[2] - sides[3]) / 2.0);
        let middle = (bounds.0.z + bounds.1.z) / 2.0;
        Ok(Camera {
            eye: (offset - forward * distance).as_vec3(),
            target: (offset - forward * middle).as_vec3(),
            up: upwards.as_vec3(),
            field_of_view,
        })
    }

    /// The view with `width` x `height` square pixels.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] if a coordinate is not finite, the eye is at the target, the angle is not between 0
    /// and pi, or the width or height is not 1 to 32768.
    pub fn view(&self, width: u32, height: u32) -> Result<View> {
        for (name, size) in [("width", width), ("height", height)] {
            ensure!((1..=32_768).contains(&size), "{name} is {size}, not 1 to 32768");
        }
        check_direction("eye", self.eye)?;
        check_direction("target", self.target)?;
        check_direction("up", self.up)?;
        check_angle(self.field_of_view)?;
        let forward = self.target.as_dvec3() - self.eye.as_dvec3();
        let distance = forward.length();
        ensure!(distance != 0.0, "the camera's eye is at its target");
        let focal_length = f64::from(height) / 2.0 / f64::from(self.field_of_view / 2.0).tan();
        Ok(View::perspective(
            self.eye,
            (forward / distance).as_vec3(),
            self.up,
            focal_length,
            [width, height],
            NEAR * distance,
        ))
    }
}

fn check_direction(name: &str, vector: Vec3) -> Result<()> {
    ensure!(vector.is_finite(), "{name} is {vector}, not finite");
    Ok(())
}

fn check_angle(field_of_view: f32) -> Result<()> {
    ensure!(
        field_of_view > 0.0 && field_of_view < std::f32::consts::PI,
        "field_of_view is {field_of_view}, not between 0 and pi"
    );
    Ok(())
}
