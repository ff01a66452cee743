//! Contact reports of the last step, for visualization and events.

use glam::Vec3;

use crate::base::{BladeId, BodyId, ToolId};
use crate::codec::saved;

/// A contact between a tool and a body at the end of the last step.
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
    /// The node, the two nodes of an edge or the three of a face in contact; the last is repeated.
    pub nodes: [u32; 3],
    /// Weights of the nodes for the contact point; 0 for a repeated node.
    pub weights: [f32; 3],
    /// Contact point, m.
    pub point: Vec3,
    /// Unit vector away from the tool.
    pub normal: Vec3,
    /// Force on the tool including friction, N, in the last substep. With several substeps, the wrench is their mean.
    pub force: Vec3,
}

/// A change of contact between a tool and a body in the last step.
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
    /// True if they touch now.
    pub has_begun: bool,
}

/// A change of contact between two bodies in the last step.
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
    /// True if they touch now.
    pub has_begun: bool,
}

/// A change of contact between a blade and a body in the last step.
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
    /// True if they touch now.
    pub has_begun: bool,
}

/// A contact as a body stores it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ToolContact {
    /// Index of the tool in the world.
    pub slot: usize,
    /// Nodes with the body's own indices; the last is repeated.
    pub nodes: [u32; 3],
    pub weights: [f32; 3],
    pub normal: Vec3,
    /// Force on the tool, N.
    pub force: Vec3,
}

saved! { ToolContact { slot, nodes, weights, normal, force } }
