//! What contact did in the last step.

use super::body::sinew_body_id;
use super::guard::{sinew_world, with_world};
use super::memory;
use super::status::sinew_status;
use super::tool::sinew_tool_id;
use crate::contact::{Contact, ContactChange};

/// Contact between a tool and a body at the end of the last step.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_contact {
    /// Body that the tool touches.
    pub body: sinew_body_id,
    /// Nodes of the touched node, edge or face; the last is repeated below 3.
    pub nodes: [u32; 3],
    /// Weights of the nodes at the contact point; 0 for a repeated node.
    pub weights: [f32; 3],
    /// [m] Contact point on the body.
    pub point: [f32; 3],
    /// Unit normal that points away from the tool.
    pub normal: [f32; 3],
    /// [N] Force on the tool in the last substep; the wrench is a mean.
    pub force: [f32; 3],
}

/// Contact between a tool and a body that began or ended in the last step.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_contact_change {
    /// Tool of the contact.
    pub tool: sinew_tool_id,
    /// Body of the contact.
    pub body: sinew_body_id,
    /// 1: the contact began; 0: it ended.
    pub has_begun: u32,
}

impl From<Contact> for sinew_contact {
    fn from(contact: Contact) -> Self {
        Self {
            body: contact.body.into(),
            nodes: contact.nodes,
            weights: contact.weights,
            point: contact.point.to_array(),
            normal: contact.normal.to_array(),
            force: contact.force.to_array(),
        }
    }
}

impl From<ContactChange> for sinew_contact_change {
    fn from(change: ContactChange) -> Self {
        Self {
            tool: change.tool.into(),
            body: change.body.into(),
            has_begun: change.begun.into(),
        }
    }
}

/// Writes the contacts of a tool at the end of the last step.
///
/// `out_contacts` receives at most `capacity` entries, `out_count` the number that exist.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_tool_get_contacts(
    world: *const sinew_world,
    tool: sinew_tool_id,
    out_contacts: *mut sinew_contact,
    capacity: usize,
    out_count: *mut usize,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_world(world, |world| {
            let found = world.contacts(tool.id())?;
            let places = memory::output_array("out_contacts", out_contacts, capacity)?;
            let out_count = memory::output("out_count", out_count)?;
            *out_count = write(found.map(sinew_contact::from), places);
            Ok(())
        })
    }
}

/// Writes the contacts that began or ended in the last step.
///
/// `out_changes` receives at most `capacity` entries, `out_count` the number that exist. Destroying a tool or body
/// reports no end.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_get_contact_changes(
    world: *const sinew_world,
    out_changes: *mut sinew_contact_change,
    capacity: usize,
    out_count: *mut usize,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_world(world, |world| {
            let places = memory::output_array("out_changes", out_changes, capacity)?;
            let found = world.contact_changes().map(sinew_contact_change::from);
            let out_count = memory::output("out_count", out_count)?;
            *out_count = write(found, places);
            Ok(())
        })
    }
}

/// Writes as many as there are places for: how many there are.
fn write<T>(found: impl Iterator<Item = T>, places: &mut [T]) -> usize {
    let mut count = 0;
    for one in found {
        if let Some(place) = places.get_mut(count) {
            *place = one;
        }
        count += 1;
    }
    count
}
