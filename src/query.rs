//! Ray casts and nearest-point queries on the bodies of a world.

mod tools;

use glam::{DVec3, Vec3};

#[cfg(doc)]
use crate::base::Error;
use crate::base::{BodyId, Result, ToolId, ensure};
use crate::body::Body;
use crate::def::{CollisionFilter, finite_vector};
use crate::geometry::Aabb;
use crate::geometry::nearest::{nearest_on_triangle, weighted};
use crate::geometry::predicates::pierce;
use crate::world::World;

/// A point of a body's surface.
///
/// ```
/// # use glam::{Vec3, vec3};
#[doc = include_str!("doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// # let body = world.create_body(&cloth)?;
/// let hit = world.cast_ray(vec3(0.01, 0.5, 0.02), Vec3::NEG_Y, 1.0)?.expect("the cloth is below");
/// assert_eq!(hit.body, body);
/// assert!((hit.distance - 0.5).abs() < 1e-6);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceHit {
    /// The body it belongs to.
    pub body: BodyId,
    /// The index of the triangle in [`Body::surface`](crate::Body::surface).
    pub triangle: u32,
    /// The barycentric weights of the triangle's corners: at least 0, with sum 1.
    pub weights: [f32; 3],
    /// The position, m.
    pub position: Vec3,
    /// The outward unit normal of the triangle; 0 if it has no area.
    pub normal: Vec3,
    /// The distance from the query's origin, m.
    pub distance: f32,
}

/// The surface that a ray hits.
///
/// ```
/// # use glam::Vec3;
/// # use sinew::*;
/// # let mut world = World::new(WorldDefinition::default())?;
/// let ball = world.create_tool(&ToolDefinition::new(Shape::Sphere { radius: 0.1 }))?;
/// match world.cast_ray_at(Vec3::Y, Vec3::NEG_Y, 2.0, CollisionFilter::ALL)? {
///     Some(RayHit::Tool { tool, distance, .. }) => assert!(tool == ball && (distance - 0.9).abs() < 1e-6),
///     other => panic!("{other:?}"),
/// }
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RayHit {
    /// The surface of a body.
    Body(SurfaceHit),
    /// The surface of a tool.
    Tool {
        /// The tool.
        tool: ToolId,
        /// The position of the hit, m.
        position: Vec3,
        /// The outward unit normal.
        normal: Vec3,
        /// The distance from the origin of the ray, m.
        distance: f32,
    },
}

impl World {
    /// Casts a ray as [`World::cast_ray`] does, against the bodies and tools that collide with this filter.
    ///
    /// # Errors
    /// Those of [`World::cast_ray`].
    pub fn cast_ray_at(
        &self,
        origin: Vec3,
        direction: Vec3,
        max_distance: f32,
        filter: CollisionFilter,
    ) -> Result<Option<RayHit>> {
        let hit = self.cast_ray_where(origin, direction, max_distance, |body| {
            body.collision_filter().meets(filter)
        })?;
        let (start, way) = (origin.as_dvec3(), direction.as_dvec3().normalize_or_zero());
        let mut nearest = hit.map_or(f64::INFINITY, |hit| f64::from(hit.distance));
        let mut found = hit.map(RayHit::Body);
        for (id, tool) in self.tool_ids().zip(self.tools()) {
            if !tool.filter.meets(filter) {
                continue;
            }
            if let Some((distance, normal)) = tools::meet(tool, start, way)
                && distance < nearest
                && distance as f32 <= max_distance
            {
                nearest = distance;
                found = Some(RayHit::Tool {
                    tool: id,
                    position: (start + way * distance).as_vec3(),
                    normal: normal.as_vec3(),
                    distance: distance as f32,
                });
            }
        }
        Ok(found)
    }

    /// The first point of a body's surface on a ray from `origin` (m) along `direction` (of any length) within
    /// `max_distance` (m, can be infinite), at the current positions; `None` without a hit. Both sides of triangles
    /// count; a ray in the plane of a triangle does not hit it.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: a number is not finite, the direction is zero, or `max_distance` is negative or not
    /// a number. [`Error::OutOfMemory`]: the search tree of a body could not be allocated.
    pub fn cast_ray(&self, origin: Vec3, direction: Vec3, max_distance: f32) -> Result<Option<SurfaceHit>> {
        self.cast_ray_where(origin, direction, max_distance, |_| true)
    }

    /// Casts a ray against some bodies.
    fn cast_ray_where(
        &self,
        origin: Vec3,
        direction: Vec3,
        max_distance: f32,
        is_met: impl Fn(&Body) -> bool,
    ) -> Result<Option<SurfaceHit>> {
        finite_vector("origin", origin)?;
        finite_vector("direction", direction)?;
        check_distance(max_distance)?;
        let way = direction.as_dvec3().normalize_or_zero();
        ensure!(way != DVec3::ZERO, "direction is 0: it points nowhere");
        let start = origin.as_dvec3();
        let mut found: Option<(f64, SurfaceHit)> = None;
        for (id, body) in self.bodies_by_id().filter(|(_, body)| is_met(body)) {
            let bounds = body.published_bounds();
            let furthest = start
                .abs()
                .max(bounds.min.as_dvec3().abs().max(bounds.max.as_dvec3().abs()));
            // Beyond the body; a hit at exactly `max_distance` counts.
            let length = 4.0 * furthest.length() + 1.0;
            let limit = found.map_or(f64::from(max_distance), |(distance, _)| distance);
            if !meets(&bounds, start, way * length.min(limit)) {
                continue;
            }
            let mut first = None;
            let nearest = found.map_or(f64::INFINITY, |(distance, _)| distance);
            body.query_tree()?
                .along(origin, way.as_vec3(), limit as f32, |triangle| {
                    let (nodes, corners) = body.surface_triangle(triangle);
                    if let Some((fraction, _)) = pierce(start, start + way * length, corners, nodes) {
                        let distance = fraction * length;
                        if distance as f32 <= max_distance && distance < nearest {
                            replace_if_first(&mut first, (distance, triangle));
                        }
                    }
                    first.map_or(limit, |(distance, _)| distance) as f32
                });
            if let Some((distance, triangle)) = first {
                let hit = SurfaceHit::new((id, body), triangle, start + way * distance, distance);
                found = Some((distance, hit));
            }
        }
        Ok(found.map(|(_, hit)| hit))
    }

    /// The point of the bodies' surfaces nearest to `point` (m), at the current positions, within `max_distance` (m,
    /// can be infinite); `None` without one.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: a coordinate is not finite, or `max_distance` is negative or not a number.
    /// [`Error::OutOfMemory`]: the search tree of a body could not be allocated.
    pub fn nearest_point(&self, point: Vec3, max_distance: f32) -> Result<Option<SurfaceHit>> {
        finite_vector("point", point)?;
        check_distance(max_distance)?;
        let place = point.as_dvec3();
        let mut limit = f64::from(max_distance);
        let mut found = None;
        for (id, body) in self.bodies_by_id() {
            let bounds = body.published_bounds();
            let (low, high) = (bounds.min.as_dvec3(), bounds.max.as_dvec3());
            if (low - place).max(place - high).max(DVec3::ZERO).length() > limit {
                continue;
            }
            let mut first = None;
            let about = Aabb { min: point, max: point };
            body.query_tree()?.nearest(&about, limit as f32, |triangle| {
                let (_, corners) = body.surface_triangle(triangle);
                let (weights, _) = nearest_on_triangle(place, corners);
                let distance = place.distance(weighted(corners, weights));
                if distance < limit || distance == limit && found.is_none() {
                    replace_if_first(&mut first, (distance, triangle));
                }
                first.map_or(limit, |(distance, _)| distance) as f32
            });
            if let Some((distance, triangle)) = first {
                limit = distance;
                found = Some(SurfaceHit::new((id, body), triangle, place, distance));
            }
        }
        Ok(found)
    }
}

impl SurfaceHit {
    /// The hit on a triangle of a body, at this distance from the query's origin.
    fn new((id, body): (BodyId, &Body), triangle: usize, place: DVec3, distance: f64) -> Self {
        let (_, corners) = body.surface_triangle(triangle);
        let (weights, _) = nearest_on_triangle(place, corners);
        let [a, b, c] = corners;
        Self {
            body: id,
            triangle: triangle as u32,
            weights: weights.map(|weight| weight as f32),
            position: weighted(corners, weights).as_vec3(),
            normal: (b - a).cross(c - a).normalize_or_zero().as_vec3(),
            distance: distance as f32,
        }
    }
}

impl Body {
    /// The nodes of a triangle of the surface, and their published positions.
    fn surface_triangle(&self, triangle: usize) -> ([u32; 3], [DVec3; 3]) {
        let nodes = self.surface()[triangle];
        (nodes, nodes.map(|node| self.positions()[node as usize].as_dvec3()))
    }

    /// The bounding box of the published positions, slightly extended.
    fn published_bounds(&self) -> Aabb {
        let bounds = self.system().local_bounds().moved(self.origin());
        // Covers rounding.
        let rounding = 1e-6 * bounds.magnitudes().max_element();
        bounds.extended(rounding)
    }
}

/// Keeps the nearer hit; between equals the lower index, so that the order of the search does not matter.
fn replace_if_first(first: &mut Option<(f64, usize)>, other: (f64, usize)) {
    if first.is_none_or(|first| other < first) {
        *first = Some(other);
    }
}

fn check_distance(max_distance: f32) -> Result<()> {
    ensure!(
        max_distance >= 0.0,
        "max_distance is {max_distance} m: must be at least 0"
    );
    Ok(())
}

/// True if a segment from `start` passes through a box.
fn meets(bounds: &Aabb, start: DVec3, way: DVec3) -> bool {
    let (mut enters, mut leaves) = (0.0_f64, 1.0_f64);
    for axis in 0..3 {
        let sides = [bounds.min, bounds.max].map(|corner| f64::from(corner[axis]) - start[axis]);
        if way[axis] == 0.0 {
            if sides[0] > 0.0 || sides[1] < 0.0 {
                return false;
            }
            continue;
        }
        let [a, b] = sides.map(|side| side / way[axis]);
        enters = enters.max(a.min(b));
        leaves = leaves.min(a.max(b));
    }
    enters <= leaves
}
