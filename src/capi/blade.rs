//! Blades.

use glam::{Quat, Vec3};

use super::guard::{guard, sinew_world, with_world, with_world_mut};
use super::memory::{self, Versioned};
use super::status::{SINEW_STATUS_OK, sinew_status, status_of};
use crate::contact::Pose;
use crate::def::CollisionFilter;
use crate::ids::SlotId;
use crate::world::{BladeDefinition, BladeId};

/// A blade: a plain value, all zero is "none".
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_blade_id {
    /// Which place, from 1.
    pub index1: u32,
    /// Which of the blades that lived there.
    pub generation: u32,
}

/// What a blade is. Filled by sinew_blade_def_init; used only during sinew_blade_create.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_blade_def {
    /// Set by sinew_blade_def_init.
    pub struct_size: usize,
    /// Both ends of the cutting edge about the blade's own origin, m, each coordinate within 1e9 of 0; not at one place; no default.
    pub edge: [f32; 6],
    /// N/m, above 0 and finite; default 1000: the force for each metre by which it is ahead of where tissue is cut, in each body. How blunt it is:
    /// tissue of toughness T resists with some T, and gives way by T / stiffness first.
    pub stiffness: f32,
    /// The categories that it belongs to, a bit for each; default 1. It meets bodies where each has a category that the other's
    /// mask has.
    pub collision_category: u32,
    /// The categories that it meets, a bit for each; default 0xffffffff.
    pub collision_mask: u32,
    /// Where it is at first, m, each within 1e9 of 0; default 0 0 0.
    pub position: [f32; 3],
    /// x y z w; default 0 0 0 1; normalised, zero is refused.
    pub orientation: [f32; 4],
}

/// What a blade did in the last step, and what was done to it.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_blade_report {
    /// Set by the caller.
    pub struct_size: usize,
    /// The force on it, world axes, mean over the step, N.
    pub force: [f32; 3],
    /// The torque on it about its position, world axes, mean over the step, N m.
    pub torque: [f32; 3],
    /// What whoever moves it has spent on tissue in the step, J.
    pub work: f64,
    /// How long the cuts are that it made at the end of the step, at rest, m; of solids on their skin.
    pub length: f64,
    /// How far it is ahead of where tissue is cut, m: 0 where nothing is in its way.
    pub lag: f64,
    /// SINEW_STATUS_OK, or why what it went through was not cut: SINEW_STATUS_CAPACITY or SINEW_STATUS_OUT_OF_MEMORY. It is tried again with the
    /// next step.
    pub status: sinew_status,
    /// 0.
    pub reserved0: u32,
    /// Of solids: how large the faces are that have opened, at rest, m^2.
    /// A cell in which a stroke ends holds: this can be less than what was swept and resisted.
    pub area: f64,
}

// SAFETY: repr(C), begins with struct_size, numbers alone.
unsafe impl Versioned for sinew_blade_def {
    const SIZES: &'static [usize] = &[size_of::<Self>()];
    const NAME: &'static str = "sinew_blade_def";
}

// SAFETY: repr(C), begins with struct_size, numbers alone.
unsafe impl Versioned for sinew_blade_report {
    const SIZES: &'static [usize] = &[size_of::<Self>()];
    const NAME: &'static str = "sinew_blade_report";
}

impl sinew_blade_id {
    fn id(self) -> BladeId {
        BladeId(SlotId {
            index1: self.index1,
            generation: self.generation,
        })
    }
}

impl sinew_blade_def {
    fn defaults() -> Self {
        let BladeDefinition { stiffness, filter, .. } = BladeDefinition::new([Vec3::ZERO; 2]);
        Self {
            struct_size: size_of::<Self>(),
            edge: [0.0; 6],
            stiffness,
            collision_category: filter.category,
            collision_mask: filter.mask,
            position: [0.0; 3],
            orientation: [0.0, 0.0, 0.0, 1.0],
        }
    }

    fn definition(&self) -> BladeDefinition {
        let [a, b, c, d, e, f] = self.edge;
        BladeDefinition {
            edge: [Vec3::new(a, b, c), Vec3::new(d, e, f)],
            stiffness: self.stiffness,
            filter: CollisionFilter {
                category: self.collision_category,
                mask: self.collision_mask,
            },
            pose: Pose {
                position: Vec3::from_array(self.position),
                orientation: Quat::from_array(self.orientation),
            },
        }
    }
}

/// Fills `def` with the defaults. `struct_size` is sizeof(sinew_blade_def).
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT.
///
/// # Safety
/// `def` is NULL or writable for `struct_size` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_blade_def_init(def: *mut sinew_blade_def, struct_size: usize) -> sinew_status {
    // SAFETY: the same contract.
    guard(|| unsafe { memory::initialise(def, struct_size, sinew_blade_def::defaults()) })
}

/// Creates a blade: an edge that is moved by its pose, as tools are, cuts the bodies made for it (their definition's spare_nodes) as
/// sinew_body_cut does, and feels their toughness. It is an edge alone: what has a body needs a tool beside it.
///
/// Tissue that the edge meets gives way until the edge is so far ahead, on the spring of the definition's stiffness, that this pulls as hard as the
/// tissue resists: by its toughness for each metre that is cut, at rest. From then on its proxy follows, at the end of each step, as far as
/// keeps both equal; so the work of the blade is the toughness times the length that is cut, or the area in solids, and what the spring stores (Mahvash,
/// Hayward 2001).
/// What pulls at the tissue through a step is what the blade feels: momentum is kept. An edge that goes along itself meets nothing, nor
/// does one that goes back through its cut.
///
/// The cut is made where the proxy went, by a fifth of a triangle's shortest edge at a time and to its end where it leaves the tissue; so a triangle that
/// is passed through takes some ten spare_nodes. Tissue of toughness 0 is cut with each step, just where the edge went. Where a cut fails the
/// proxy stays and pulls on, as hard as the tissue resisted: the report's status tells; the step itself succeeds.
///
/// Tissue that moves onto an edge is cut as if that had moved; a turn is followed in parts of half a radian.
///
/// A body that a blade stands in takes its substeps as one that is attached does. A step in which a blade goes through tissue may allocate.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_OUT_OF_MEMORY.
///
/// # Safety
/// `world` is NULL or a world nobody else uses; `def` is NULL or a definition of the size that it states; `out` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_blade_create(
    world: *mut sinew_world,
    def: *const sinew_blade_def,
    out: *mut sinew_blade_id,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_world_mut(world, |world| {
            let out = memory::output("out", out)?;
            let def = memory::definition("def", def, sinew_blade_def::defaults())?;
            let BladeId(id) = world.create_blade(&def.definition())?;
            *out = sinew_blade_id {
                index1: id.index1,
                generation: id.generation,
            };
            Ok(())
        })
    }
}

/// Destroys a blade. What it has cut stays.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
///
/// # Safety
/// `world` is NULL or a world nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_blade_destroy(world: *mut sinew_world, blade: sinew_blade_id) -> sinew_status {
    // SAFETY: the same contract.
    unsafe { with_world_mut(world, |world| world.destroy_blade(blade.id())) }
}

/// Moves a blade to `position`, 3 floats, m, over the next step, and turns it to `orientation`, x y z w, which may be NULL: as it is. It goes
/// straight and evenly.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT (also where a coordinate is further than 1e9 m from 0 or the orientation is zero),
/// SINEW_STATUS_STALE_ID.
///
/// # Safety
/// `world` is NULL or a world nobody else uses; `position` is NULL or 3 floats, `orientation` NULL or 4.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_blade_set_pose(
    world: *mut sinew_world,
    blade: sinew_blade_id,
    position: *const f32,
    orientation: *const f32,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_world_mut(world, |world| {
            let position = memory::vector("position", position)?;
            let orientation = memory::optional_array("orientation", orientation.cast::<[f32; 4]>(), 1)?;
            let orientation = orientation.map(|orientation| Quat::from_array(orientation[0]));
            world.set_blade_pose(blade.id(), position, orientation)
        })
    }
}

/// Writes what a blade did and felt in the last step. `out->struct_size` is set by the caller.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_STALE_ID.
///
/// # Safety
/// `world` is NULL or a world nobody changes; `out` is NULL or writable for the size that it states.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_blade_get_report(
    world: *const sinew_world,
    blade: sinew_blade_id,
    out: *mut sinew_blade_report,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_world(world, |world| {
            let told = world.blade_report(blade.id())?;
            memory::report("out", out)?.fill(sinew_blade_report {
                struct_size: size_of::<sinew_blade_report>(),
                force: told.force.to_array(),
                torque: told.torque.to_array(),
                work: told.work,
                length: told.length,
                lag: told.lag,
                status: told.refused.as_ref().map_or(SINEW_STATUS_OK, status_of),
                reserved0: 0,
                area: told.area,
            });
            Ok(())
        })
    }
}
