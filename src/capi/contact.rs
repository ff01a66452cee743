//! What contact did in the last step.

use std::ffi::c_void;

use super::blade::sinew_blade_id;
use super::body::sinew_body_id;
use super::guard::{sinew_world, with_world};
use super::memory;
use super::status::sinew_status;
use super::tool::sinew_tool_id;
use crate::base::{BladeId, BodyId, Result};
use crate::body::Body;
use crate::contact::{BladeContactChange, BodyContactChange, Contact, ContactChange};
use crate::world::World;

/// Contact of a tool, blade or body with a body at the end of the last step.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_contact {
    /// Body that is touched.
    pub body: sinew_body_id,
    /// Pointer of sinew_body_set_user_data.
    pub body_user_data: *mut c_void,
    /// Nodes of what is touched, the last repeated; blade: UINT32_MAX.
    pub nodes: [u32; 3],
    /// Weights of the nodes at the contact point; 0 for a repeated node.
    pub weights: [f32; 3],
    /// [m] Contact point on the body.
    pub point: [f32; 3],
    /// Unit normal that points toward the touched body; 0 for a blade.
    pub normal: [f32; 3],
    /// [N] Force on the tool, blade or body in the last substep.
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
    /// Pointer of sinew_tool_set_user_data.
    pub tool_user_data: *mut c_void,
    /// Pointer of sinew_body_set_user_data.
    pub body_user_data: *mut c_void,
    /// 1: the contact began; 0: it ended.
    pub has_begun: u32,
}

/// Contact of a body with another or with a blade that began or ended in the last step.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_body_contact_change {
    /// Body of the contact.
    pub body: sinew_body_id,
    /// Other body; all zero for a blade.
    pub other: sinew_body_id,
    /// Blade; all zero for a body.
    pub blade: sinew_blade_id,
    /// Pointer of sinew_body_set_user_data.
    pub body_user_data: *mut c_void,
    /// That of the other body; NULL for a blade.
    pub other_user_data: *mut c_void,
    /// 1: the contact began; 0: it ended.
    pub has_begun: u32,
}

fn body_user_data(world: &World, body: BodyId) -> *mut c_void {
    world.body(body).map_or(0, Body::user_data) as *mut c_void
}

impl sinew_contact {
    fn of(world: &World, contact: Contact) -> Self {
        Self {
            body: contact.body.into(),
            body_user_data: body_user_data(world, contact.body),
            nodes: contact.nodes,
            weights: contact.weights,
            point: contact.point.to_array(),
            normal: contact.normal.to_array(),
            force: contact.force.to_array(),
        }
    }
}

impl sinew_contact_change {
    fn of(world: &World, change: ContactChange) -> Self {
        Self {
            tool: change.tool.into(),
            body: change.body.into(),
            tool_user_data: world.tool_user_data(change.tool).unwrap_or(0) as *mut c_void,
            body_user_data: body_user_data(world, change.body),
            has_begun: change.has_begun.into(),
        }
    }
}

impl sinew_body_contact_change {
    fn of_bodies(world: &World, change: BodyContactChange) -> Self {
        let [body, other] = change.bodies;
        Self {
            body: body.into(),
            other: other.into(),
            blade: BladeId::default().into(),
            body_user_data: body_user_data(world, body),
            other_user_data: body_user_data(world, other),
            has_begun: change.has_begun.into(),
        }
    }

    fn of_blade(world: &World, change: BladeContactChange) -> Self {
        Self {
            body: change.body.into(),
            other: BodyId::default().into(),
            blade: change.blade.into(),
            body_user_data: body_user_data(world, change.body),
            other_user_data: std::ptr::null_mut(),
            has_begun: change.has_begun.into(),
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
    with_world(world, |world| {
        write_contacts(world, world.contacts(tool.id())?, (out_contacts, capacity, out_count))
    })
}

/// Writes the bodies that a blade pressed in the last step, each with a mean point and force.
///
/// Outputs are those of sinew_tool_get_contacts.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_blade_get_contacts(
    world: *const sinew_world,
    blade: sinew_blade_id,
    out_contacts: *mut sinew_contact,
    capacity: usize,
    out_count: *mut usize,
) -> sinew_status {
    with_world(world, |world| {
        write_contacts(
            world,
            world.blade_contacts(blade.id())?,
            (out_contacts, capacity, out_count),
        )
    })
}

/// Writes the contacts of a body with other bodies and itself; none while it sleeps.
///
/// Outputs are those of sinew_tool_get_contacts.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_body_get_contacts(
    world: *const sinew_world,
    body: sinew_body_id,
    out_contacts: *mut sinew_contact,
    capacity: usize,
    out_count: *mut usize,
) -> sinew_status {
    with_world(world, |world| {
        write_contacts(
            world,
            world.tissue_contacts(body.id())?,
            (out_contacts, capacity, out_count),
        )
    })
}

/// Writes contacts of tools with bodies that began or ended in the last step, not by destruction.
///
/// `out_changes` receives at most `capacity` entries, `out_count` the number that exist.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_get_contact_changes(
    world: *const sinew_world,
    out_changes: *mut sinew_contact_change,
    capacity: usize,
    out_count: *mut usize,
) -> sinew_status {
    with_world(world, |world| {
        let found = world.contact_changes();
        let found = found.map(|change| sinew_contact_change::of(world, change));
        memory::write_found(found, ("out_changes", out_changes, capacity), out_count)
    })
}

/// Writes contacts of bodies with bodies or blades that began or ended in the last step.
///
/// Outputs are those of sinew_world_get_contact_changes. Bodies that sleep stay in contact.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_get_body_contact_changes(
    world: *const sinew_world,
    out_changes: *mut sinew_body_contact_change,
    capacity: usize,
    out_count: *mut usize,
) -> sinew_status {
    with_world(world, |world| {
        let of_bodies = world.body_contact_changes();
        let of_bodies = of_bodies.map(|change| sinew_body_contact_change::of_bodies(world, change));
        let of_blades = world.blade_contact_changes();
        let of_blades = of_blades.map(|change| sinew_body_contact_change::of_blade(world, change));
        let found = of_bodies.chain(of_blades);
        memory::write_found(found, ("out_changes", out_changes, capacity), out_count)
    })
}

/// Writes contacts, and how many there are.
///
/// # Safety
/// The pointers are NULL or have room for what they are for.
unsafe fn write_contacts(
    world: &World,
    found: impl Iterator<Item = Contact>,
    (contacts, capacity, count): (*mut sinew_contact, usize, *mut usize),
) -> Result<()> {
    let found = found.map(|contact| sinew_contact::of(world, contact));
    memory::write_found(found, ("out_contacts", contacts, capacity), count)
}
