//! What a ray meets, and what is nearest to a point.

use super::body::sinew_body_id;
use super::guard::{sinew_world, with_world};
use super::memory::{self, Versioned, versioned};
use super::status::sinew_status;
use super::tool::sinew_tool_id;
use crate::def::CollisionFilter;
use crate::query::{RayHit, SurfaceHit};

/// Point on the surface of a body.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_surface_point {
    /// Set to sizeof(sinew_surface_point) before the call.
    pub struct_size: usize,
    /// Body of the point; all zero if none was found.
    pub body: sinew_body_id,
    /// Index of the triangle in the body's surface.
    pub triangle: u32,
    /// Weights of the triangle's corners, with sum 1.
    pub weights: [f32; 3],
    /// [m] Position of the point.
    pub position: [f32; 3],
    /// Outward unit normal of the triangle; 0 if it has no area.
    pub normal: [f32; 3],
    /// [m] Distance from the query point.
    pub distance: f32,
}

versioned! { sinew_surface_point }

impl From<Option<SurfaceHit>> for sinew_surface_point {
    fn from(found: Option<SurfaceHit>) -> Self {
        found.map_or_else(Self::empty, |found| Self {
            struct_size: size_of::<Self>(),
            body: found.body.into(),
            triangle: found.triangle,
            weights: found.weights,
            position: found.position.to_array(),
            normal: found.normal.to_array(),
            distance: found.distance,
        })
    }
}

/// Finds the first body surface point that a ray hits; without one out->body is all zero.
///
/// `origin` [m] and `direction`, of any length but 0, are 3 floats each; `max_distance` [m] is at least 0. A triangle
/// parallel to the ray is not hit. The first query near a body may allocate.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_cast_ray(
    world: *const sinew_world,
    origin: *const f32,
    direction: *const f32,
    max_distance: f32,
    out: *mut sinew_surface_point,
) -> sinew_status {
    with_world(world, |world| {
        let out = memory::report("out", out)?;
        let origin = memory::vector("origin", origin)?;
        let direction = memory::vector("direction", direction)?;
        out.fill(world.cast_ray(origin, direction, max_distance)?.into());
        Ok(())
    })
}

/// Finds the body surface point nearest to a point; without one out->body is all zero.
///
/// `point` [m] is 3 floats; `max_distance` [m] is at least 0. The first query may allocate.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_find_nearest(
    world: *const sinew_world,
    point: *const f32,
    max_distance: f32,
    out: *mut sinew_surface_point,
) -> sinew_status {
    with_world(world, |world| {
        let out = memory::report("out", out)?;
        let point = memory::vector("point", point)?;
        out.fill(world.nearest_point(point, max_distance)?.into());
        Ok(())
    })
}

/// First body or tool that a ray hits.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_ray_hit {
    /// Set to sizeof(sinew_ray_hit) before the call.
    pub struct_size: usize,
    /// Body that is hit; all zero if none.
    pub body: sinew_body_id,
    /// Tool that is hit; all zero if none.
    pub tool: sinew_tool_id,
    /// Index of the triangle in the body's surface; 0 for a tool.
    pub triangle: u32,
    /// Weights of the triangle's corners, with sum 1; 0 for a tool.
    pub weights: [f32; 3],
    /// [m] Position of the hit.
    pub position: [f32; 3],
    /// Outward unit normal at the hit.
    pub normal: [f32; 3],
    /// [m] Distance from the origin.
    pub distance: f32,
}

versioned! { sinew_ray_hit }

impl From<Option<RayHit>> for sinew_ray_hit {
    fn from(hit: Option<RayHit>) -> Self {
        match hit {
            None => Self::empty(),
            Some(RayHit::Body(hit)) => Self {
                body: hit.body.into(),
                triangle: hit.triangle,
                weights: hit.weights,
                position: hit.position.to_array(),
                normal: hit.normal.to_array(),
                distance: hit.distance,
                ..Self::empty()
            },
            Some(RayHit::Tool {
                tool,
                position,
                normal,
                distance,
            }) => Self {
                tool: tool.into(),
                position: position.to_array(),
                normal: normal.to_array(),
                distance,
                ..Self::empty()
            },
        }
    }
}

/// Finds the first body or tool that a ray hits, as if it had this category and mask.
///
/// Otherwise like sinew_world_cast_ray; without a hit both ids are all zero.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_cast_ray_filtered(
    world: *const sinew_world,
    origin: *const f32,
    direction: *const f32,
    max_distance: f32,
    category: u32,
    mask: u32,
    out: *mut sinew_ray_hit,
) -> sinew_status {
    with_world(world, |world| {
        let out = memory::report("out", out)?;
        let origin = memory::vector("origin", origin)?;
        let direction = memory::vector("direction", direction)?;
        let filter = CollisionFilter { category, mask };
        out.fill(world.cast_ray_at(origin, direction, max_distance, filter)?.into());
        Ok(())
    })
}
