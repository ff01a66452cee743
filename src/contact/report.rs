//! What contact did in the last step, for whoever wants to draw it or hear of it.

use glam::Vec3;

use crate::base::{BladeId, BodyId, ToolId};
use crate::codec::saved;

/// Where a tool pressed a body when the last step ended.
///
/// ```
/// # use glam::Vec3;
#[doc = include_str!("../doctest/block.txt")]
/// # let mut world = World::new(WorldDefinition { gravity: Vec3::ZERO, ..WorldDefinition::default() })?;
/// # let block = world.create_body(&block)?;
/// # let mut ball = ToolDefinition::new(Shape::Sphere { radius: 0.01 });
/// # ball.pose.position = 0.03 * Vec3::Y;
/// # let ball = world.create_tool(&ball)?;
/// world.set_pose(ball, 0.028 * Vec3::Y, None)?;
/// world.step(1.0 / 60.0)?;
/// let contacts: Vec<Contact> = world.contacts(ball)?.collect();
/// assert!(!contacts.is_empty());
/// assert!(contacts.iter().all(|contact| contact.body == block && contact.force.y > 0.0));
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// The body.
    pub body: BodyId,
    /// The node, the two of an edge or the three of a face that it pressed; the last is repeated.
    pub nodes: [u32; 3],
    /// The point of them, as weights; 0 where a node is repeated.
    pub weights: [f32; 3],
    /// The point, m.
    pub point: Vec3,
    /// Away from the tool, of unit length.
    pub normal: Vec3,
    /// On the tool, friction with it, N, in the last substep: where a step has several, the wrench is their mean.
    pub force: Vec3,
}

/// A tool and a body that began or ceased to touch in the last step.
///
/// ```
/// # use glam::Vec3;
#[doc = include_str!("../doctest/block.txt")]
/// # let mut world = World::new(WorldDefinition { gravity: Vec3::ZERO, ..WorldDefinition::default() })?;
/// # let block = world.create_body(&block)?;
/// # let mut ball = ToolDefinition::new(Shape::Sphere { radius: 0.01 });
/// # ball.pose.position = 0.03 * Vec3::Y;
/// # let ball = world.create_tool(&ball)?;
/// world.set_pose(ball, 0.028 * Vec3::Y, None)?;
/// world.step(1.0 / 60.0)?;
/// let begun = ContactChange { tool: ball, body: block, has_begun: true };
/// assert_eq!(world.contact_changes().next(), Some(begun));
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactChange {
    /// The tool.
    pub tool: ToolId,
    /// The body.
    pub body: BodyId,
    /// Whether they touch now.
    pub has_begun: bool,
}

/// Two bodies that began or ceased to touch in the last step.
///
/// ```
/// # use glam::{Quat, Vec3, vec3};
#[doc = include_str!("../doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// # let contact = BodyContact { thickness: 0.001, with_bodies: true, ..BodyContact::default() };
/// # let [lower, upper] = [0, 1].map(|_| world.create_body(&BodyDefinition { contact, ..cloth }));
/// # let (lower, upper) = (lower?, upper?);
/// # world.body_mut(lower)?.pin_box(vec3(-1.0, -1.0, -1.0), vec3(1.0, 1.0, 1.0))?;
/// # world.body_mut(upper)?.transform(0.01 * Vec3::Y, Quat::IDENTITY, None)?;
/// let mut changes = Vec::new();
/// for _ in 0..10 {
///     world.step(1.0 / 60.0)?;
///     changes.extend(world.body_contact_changes());
/// }
/// assert_eq!(changes.first(), Some(&BodyContactChange { bodies: [lower, upper], has_begun: true }));
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyContactChange {
    /// The bodies.
    pub bodies: [BodyId; 2],
    /// Whether they touch now.
    pub has_begun: bool,
}

/// A blade and a body of which contact began or ceased in the last step.
///
/// ```
/// # use glam::{Vec3, vec3};
#[doc = include_str!("../doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition { gravity: Vec3::ZERO, ..WorldDefinition::default() })?;
/// # let sheet = world.create_body(&BodyDefinition { spare_nodes: 200, toughness: 0.01, ..cloth })?;
/// # let mut blade = BladeDefinition::new([0.01 * Vec3::NEG_Y, 0.01 * Vec3::Y]);
/// # blade.pose.position = vec3(0.003, 0.0, -0.051);
/// # let blade = world.create_blade(&blade)?;
/// let mut changes = Vec::new();
/// for frame in 0..10 {
///     world.set_blade_pose(blade, vec3(0.003, 0.0, -0.051 + 0.001 * frame as f32), None)?;
///     world.step(1.0 / 60.0)?;
///     changes.extend(world.blade_contact_changes());
/// }
/// assert_eq!(changes.first(), Some(&BladeContactChange { blade, body: sheet, has_begun: true }));
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BladeContactChange {
    /// The blade.
    pub blade: BladeId,
    /// The body.
    pub body: BodyId,
    /// Whether it presses the blade now.
    pub has_begun: bool,
}

/// A contact as a body keeps it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Touch {
    /// The tool's place among those of the world.
    pub slot: usize,
    /// In the body's own numbers; the last is repeated.
    pub nodes: [u32; 3],
    pub weights: [f32; 3],
    pub normal: Vec3,
    /// On the tool, N.
    pub force: Vec3,
}

saved! { Touch { slot, nodes, weights, normal, force } }
