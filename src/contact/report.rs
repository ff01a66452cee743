//! What contact did in the last step, for whoever wants to draw it or hear of it.

use glam::Vec3;

use crate::base::{BladeId, BodyId, ToolId};
use crate::codec::saved;

/// Where a tool pressed a body when the last step ended.
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
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyContactChange {
    /// The bodies.
    pub bodies: [BodyId; 2],
    /// Whether they touch now.
    pub has_begun: bool,
}

/// A blade and a body of which contact began or ceased in the last step.
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
