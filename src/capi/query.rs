//! What a ray meets, and what is nearest to a point.

use super::body::sinew_body_id;
use super::guard::{sinew_world, with_world};
use super::memory::{self, Versioned};
use super::status::sinew_status;
use crate::query::SurfaceHit;

/// A point of a body's surface.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_surface_point {
    /// Set by the caller.
    pub struct_size: usize,
    /// The body it belongs to; all zero: nothing was found, and the rest is 0.
    pub body: sinew_body_id,
    /// The triangle, in the order of the body's surface.
    pub triangle: u32,
    /// Of the triangle's corners, 1 in sum.
    pub weights: [f32; 3],
    /// m
    pub position: [f32; 3],
    /// The triangle's, outward, of unit length; 0 where it has no area.
    pub normal: [f32; 3],
    /// m: from where it was asked for.
    pub distance: f32,
    /// 0.
    pub reserved: u32,
}

// SAFETY: repr(C), begins with struct_size, numbers alone.
unsafe impl Versioned for sinew_surface_point {
    const SIZES: &'static [usize] = &[size_of::<Self>()];
    const NAME: &'static str = "sinew_surface_point";
}

impl From<Option<SurfaceHit>> for sinew_surface_point {
    fn from(found: Option<SurfaceHit>) -> Self {
        let id = found.map(|found| found.body.0).unwrap_or_default();
        Self {
            struct_size: size_of::<Self>(),
            body: sinew_body_id {
                index1: id.index1,
                generation: id.generation,
            },
            triangle: found.map_or(0, |found| found.triangle),
            weights: found.map_or([0.0; 3], |found| found.weights),
            position: found.map_or([0.0; 3], |found| found.position.to_array()),
            normal: found.map_or([0.0; 3], |found| found.normal.to_array()),
            distance: found.map_or(0.0, |found| found.distance),
            reserved: 0,
        }
    }
}

/// Writes the first point that a ray from `origin`, 3 floats, m, along `direction`, 3 floats of any length, meets on the surface of a
/// body within `max_distance`, m, at least 0, at the nodes' current places. `out->struct_size` is set by the caller; where nothing is
/// met out->body is all zero. What lies along a triangle does not meet it. Of equal distances the first body's lowest triangle is taken.
/// The first query near a body builds a tree over its surface, and the first after its nodes have moved refits it; others take a few us.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT (also where the direction is zero), SINEW_STATUS_OUT_OF_MEMORY.
///
/// # Safety
/// `world` is NULL or a world nobody changes; `origin` and `direction` are NULL or 3 floats; `out` is NULL or writable for
/// `out->struct_size` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_cast_ray(
    world: *const sinew_world,
    origin: *const f32,
    direction: *const f32,
    max_distance: f32,
    out: *mut sinew_surface_point,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_world(world, |world| {
            let out = memory::report("out", out)?;
            let origin = memory::vector("origin", origin)?;
            let direction = memory::vector("direction", direction)?;
            out.fill(world.cast_ray(origin, direction, max_distance)?.into());
            Ok(())
        })
    }
}

/// Writes the point of the bodies' surfaces that is nearest to `point`, 3 floats, m, at the nodes' current places, no further than
/// `max_distance`, m, at least 0. `out->struct_size` is set by the caller; where there is none out->body is all zero. Of equal
/// distances the first body's lowest triangle is taken. It uses the same trees as sinew_world_cast_ray.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_OUT_OF_MEMORY.
///
/// # Safety
/// `world` is NULL or a world nobody changes; `point` is NULL or 3 floats; `out` is NULL or writable for `out->struct_size` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_find_nearest(
    world: *const sinew_world,
    point: *const f32,
    max_distance: f32,
    out: *mut sinew_surface_point,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_world(world, |world| {
            let out = memory::report("out", out)?;
            let point = memory::vector("point", point)?;
            out.fill(world.nearest_point(point, max_distance)?.into());
            Ok(())
        })
    }
}
