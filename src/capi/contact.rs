//! What contact did in the last step.

use super::body::sinew_body_id;
use super::guard::{sinew_world, with_world};
use super::memory;
use super::status::sinew_status;
use super::tool::sinew_tool_id;
use crate::contact::{Contact, ContactChange};

/// Where a tool pressed a body when the last step ended.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_contact {
    /// The body.
    pub body: sinew_body_id,
    /// The node, the two of an edge or the three of a face that it pressed; the last is repeated.
    pub nodes: [u32; 3],
    /// The point of them, as weights; 0 where a node is repeated.
    pub weights: [f32; 3],
    /// The point, m.
    pub point: [f32; 3],
    /// Away from the tool, 1 long.
    pub normal: [f32; 3],
    /// On the tool, friction with it, N, in the last substep: where a step has several, the wrench is their mean.
    pub force: [f32; 3],
}

/// A tool and a body that began or ceased to touch in the last step.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_contact_change {
    /// The tool.
    pub tool: sinew_tool_id,
    /// The body.
    pub body: sinew_body_id,
    /// 1: they touch now; 0: they do no longer.
    pub begun: u32,
    /// 0.
    pub reserved: u32,
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
            begun: change.begun.into(),
            reserved: 0,
        }
    }
}

/// Writes where the tool pressed bodies when the last step ended, `capacity` of them at most, to `contacts`, which may be NULL where
/// that is 0, and how many there are to `count`.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
///
/// # Safety
/// `world` is NULL or a world nobody changes; `contacts` is NULL or writable for `capacity` of them; `count` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_tool_get_contacts(
    world: *const sinew_world,
    tool: sinew_tool_id,
    contacts: *mut sinew_contact,
    capacity: usize,
    count: *mut usize,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_world(world, |world| {
            let found = world.contacts(tool.id())?;
            let places = memory::output_array("contacts", contacts, capacity)?;
            let count = memory::output("count", count)?;
            *count = write(found.map(sinew_contact::from), places);
            Ok(())
        })
    }
}

/// Writes which tools and bodies began or ceased to touch in the last step, `capacity` of them at most, to `changes`, which may be NULL
/// where that is 0, and how many there are to `count`. With a tool or body that was destroyed nothing ceases.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT.
///
/// # Safety
/// `world` is NULL or a world nobody changes; `changes` is NULL or writable for `capacity` of them; `count` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_get_contact_changes(
    world: *const sinew_world,
    changes: *mut sinew_contact_change,
    capacity: usize,
    count: *mut usize,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_world(world, |world| {
            let places = memory::output_array("changes", changes, capacity)?;
            let found = world.contact_changes().map(sinew_contact_change::from);
            let count = memory::output("count", count)?;
            *count = write(found, places);
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
