//! Points of a body for attachments.

use crate::codec::{saved, saved_enum};

/// A point of a body's surface.
///
/// ```
/// # use glam::vec3;
#[doc = include_str!("../doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// # let body = world.create_body(&cloth)?;
/// # let ball = world.create_tool(&ToolDefinition::new(Shape::Sphere { radius: 0.01 }))?;
/// let hit = world.nearest_point(vec3(0.01, 0.02, 0.005), 0.1)?.expect("the cloth is 2 cm away");
/// let point = SurfacePoint { triangle: hit.triangle, weights: hit.weights };
/// let held = world.attach_points(body, &[point], ball, 0.0)?;
/// assert!(world.has_attachment(held[0]));
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// The index of the triangle in [`Body::surface`](crate::Body::surface).
    pub triangle: u32,
    /// The barycentric weights of its corners: at least 0, with a sum of 1.
    pub weights: [f32; 3],
}

saved! { SurfacePoint { triangle, weights } }

/// A point of a body that is attached to another body.
///
/// ```
/// # use glam::{Quat, Vec3};
#[doc = include_str!("../doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// # let [left, right] = [0, 1].map(|_| world.create_body(&cloth));
/// # let (left, right) = (left?, right?);
/// # world.body_mut(right)?.transform(0.1 * Vec3::X, Quat::IDENTITY, None)?;
/// world.attach_to_body(left, &[Anchor::Node(4)], right, &[Anchor::Node(0)], 0.0)?;
/// world.step(1.0 / 60.0)?;
/// let place = |body, node: usize| world.body(body).map(|body| body.positions()[node]);
/// assert!(place(left, 4)?.distance(place(right, 0)?) < 1e-5);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Anchor {
    /// A node, on the surface or inside.
    Node(u32),
    /// A point of the surface.
    Point(SurfacePoint),
}

saved_enum!(Anchor { 0 => Node(it), 1 => Point(it) });
