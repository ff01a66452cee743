//! Blades.

use glam::{Quat, Vec3};

use super::guard::{guard, sinew_world, with_world, with_world_mut};
use super::id::converts;
use super::memory::{self, Versioned, versioned};
use super::status::{SINEW_STATUS_OK, sinew_status, status_of};
use crate::base::BladeId;
use crate::contact::Pose;
use crate::def::CollisionFilter;
use crate::world::BladeDefinition;

/// Id of a blade; all zero means none.
#[repr(C)]
#[derive(Clone, Copy, Default)]
pub struct sinew_blade_id {
    /// Slot of the blade, counted from 1.
    pub index1: u32,
    /// Number of the use of that slot; upper 12 bits: tag of the world.
    pub generation: u32,
}

converts!(sinew_blade_id, BladeId);

/// Edge and settings of a blade.
///
/// Filled by sinew_blade_def_init; read only during sinew_blade_create.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_blade_def {
    /// Size of this struct; sinew_blade_def_init sets it.
    pub struct_size: usize,
    /// [m] Two different end points of the edge about the origin, within 1e9.
    pub edge: [f32; 6],
    /// [N/m] Coupling stiffness between blade and proxy, above 0; default 1000.
    ///
    /// Before cutting, tissue of toughness T deforms by about T / stiffness.
    pub stiffness: f32,
    /// Collision categories of this blade; default 1. See base.h.
    pub collision_category: u32,
    /// Categories that it cuts; default 0xffffffff.
    pub collision_mask: u32,
    /// [m] Initial position; default 0 0 0.
    pub position: [f32; 3],
    /// Initial orientation; default 0 0 0 1.
    pub orientation: [f32; 4],
}

/// Report of the cuts of a blade and the load on it in the last step.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_blade_report {
    /// Set to sizeof(sinew_blade_report) before the call.
    pub struct_size: usize,
    /// [N] Mean force on the blade, in world axes.
    pub force: [f32; 3],
    /// [N m] Mean torque on the blade about its position, in world axes.
    pub torque: [f32; 3],
    /// [J] Work that moving the blade did on tissue in the step.
    pub work: f64,
    /// [m] Length of the cuts in the rest shape; for solids on their surface.
    pub length: f64,
    /// [m] Distance of the blade ahead of its cut; 0 without tissue in its path.
    pub lag: f64,
    /// SINEW_STATUS_OK, or CAPACITY or OUT_OF_MEMORY if a cut is retried.
    pub status: sinew_status,
    /// [m^2] Area of one side of the opened faces of solids at rest.
    pub area: f64,
}

versioned! { sinew_blade_def, sinew_blade_report }

impl sinew_blade_def {
    fn defaults() -> Self {
        let BladeDefinition { stiffness, filter, .. } = BladeDefinition::new([Vec3::ZERO; 2]);
        Self {
            stiffness,
            collision_category: filter.category,
            collision_mask: filter.mask,
            orientation: [0.0, 0.0, 0.0, 1.0],
            ..Self::empty()
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

/// Fills a blade definition with its defaults; `struct_size` is sizeof(sinew_blade_def).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_blade_def_init(def: *mut sinew_blade_def, struct_size: usize) -> sinew_status {
    guard(|| memory::initialise(def, struct_size, sinew_blade_def::defaults()))
}

/// Creates a blade: an edge that cuts bodies with spare_nodes as its pose moves.
///
/// It has no volume. Tissue resists with its toughness; tissue that moves onto the edge is cut too. Moving along the
/// edge or back meets no resistance. A triangle needs about 10 spare_nodes. A step that cuts may allocate;
/// sinew_blade_report tells of a failed cut.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_blade_create(
    world: *mut sinew_world,
    def: *const sinew_blade_def,
    out: *mut sinew_blade_id,
) -> sinew_status {
    with_world_mut(world, |world| {
        let out = memory::output("out", out)?;
        let def = memory::definition("def", def, sinew_blade_def::defaults())?;
        *out = world.create_blade(&def.definition())?.into();
        Ok(())
    })
}

/// Destroys a blade; its cuts remain.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_blade_destroy(world: *mut sinew_world, blade: sinew_blade_id) -> sinew_status {
    with_world_mut(world, |world| world.destroy_blade(blade.id()))
}

/// Moves a blade to a new pose during the next step, along a line at constant speed.
///
/// `position` [m] is 3 floats; `orientation` is nullable: unchanged.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_blade_set_pose(
    world: *mut sinew_world,
    blade: sinew_blade_id,
    position: *const f32,
    orientation: *const f32,
) -> sinew_status {
    with_world_mut(world, |world| {
        let position = memory::vector("position", position)?;
        let orientation = memory::optional_orientation("orientation", orientation)?;
        world.set_blade_pose(blade.id(), position, orientation)
    })
}

/// Sets the collision category and mask of a blade; bodies outside of them let go of it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_blade_set_collision(
    world: *mut sinew_world,
    blade: sinew_blade_id,
    category: u32,
    mask: u32,
) -> sinew_status {
    let filter = CollisionFilter { category, mask };
    with_world_mut(world, |world| world.set_blade_collision_filter(blade.id(), filter))
}

/// Writes the cuts of a blade and the load on it in the last step.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_blade_get_report(
    world: *const sinew_world,
    blade: sinew_blade_id,
    out: *mut sinew_blade_report,
) -> sinew_status {
    with_world(world, |world| {
        let told = world.blade_report(blade.id())?;
        let report = sinew_blade_report {
            struct_size: size_of::<sinew_blade_report>(),
            force: told.force.to_array(),
            torque: told.torque.to_array(),
            work: told.work,
            length: told.length,
            lag: told.lag,
            status: told.refused.as_ref().map_or(SINEW_STATUS_OK, status_of),
            area: told.area,
        };
        memory::write_report("out", out, report)
    })
}
