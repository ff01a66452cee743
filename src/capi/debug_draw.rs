//! Debug drawing through callbacks.

use glam::Vec3;
use std::ffi::c_void;

use super::guard::{guard, sinew_world, with_world};
use super::memory::{self, Versioned, versioned};
use super::status::sinew_status;
use crate::base::{Result, ensure};
use crate::debug_draw::{DebugCanvas, DebugDrawDefinition, Rgba};

/// Points where tools press bodies, and the forces on the tools.
pub const SINEW_DRAW_CONTACTS: u32 = 1;
/// Normals of these contacts, away from the tool.
pub const SINEW_DRAW_NORMALS: u32 = 2;
/// Pinned nodes.
pub const SINEW_DRAW_PINS: u32 = 4;
/// Attachments and sutures.
pub const SINEW_DRAW_ATTACHMENTS: u32 = 8;
/// Springs: blue compressed, red stretched.
pub const SINEW_DRAW_SPRINGS: u32 = 16;
/// Surface triangles that sleep.
pub const SINEW_DRAW_SLEEPING: u32 = 32;
/// Bounding boxes of bodies.
pub const SINEW_DRAW_BOUNDS: u32 = 64;

const ALL: u32 = 2 * SINEW_DRAW_BOUNDS - 1;

/// Callback that draws a line, point or triangle: 2, 1 or 3 vectors [m], color 0xRRGGBBAA.
pub type sinew_draw = Option<unsafe extern "C" fn(context: *mut c_void, points: *const f32, rgba: u32)>;

/// Contents and callbacks of sinew_world_debug_draw, filled by sinew_debug_draw_init.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_debug_draw {
    /// Size of this struct; sinew_debug_draw_init sets it.
    pub struct_size: usize,
    /// Sum of sinew_draw_flags; default: all.
    pub flags: u32,
    /// [m] Length of a normal, at least 0; default 0.01.
    pub normal_length: f32,
    /// [m/N] Length of a force of 1 N, at least 0; default 0.01.
    pub force_scale: f32,
    /// Spring strain with the full color, above 0; default 0.1.
    pub full_strain: f32,
    /// First argument of the callbacks; nullable.
    pub context: *mut c_void,
    /// Draws a line; nullable: no lines.
    pub draw_line: sinew_draw,
    /// Draws a point; nullable: no points.
    pub draw_point: sinew_draw,
    /// Draws a triangle; nullable: no triangles.
    pub draw_triangle: sinew_draw,
}

versioned! { sinew_debug_draw }

impl sinew_debug_draw {
    fn defaults() -> Self {
        let defaults = DebugDrawDefinition::default();
        Self {
            flags: ALL,
            normal_length: defaults.normal_length,
            force_scale: defaults.force_scale,
            full_strain: defaults.full_strain,
            ..Self::empty()
        }
    }

    fn definition(&self) -> Result<DebugDrawDefinition> {
        let flags = self.flags;
        ensure!(flags & !ALL == 0, "flags is {flags}: no sum of SINEW_DRAW_...");
        let has = |flag: u32| flags & flag != 0;
        Ok(DebugDrawDefinition {
            contacts: has(SINEW_DRAW_CONTACTS),
            normals: has(SINEW_DRAW_NORMALS),
            pins: has(SINEW_DRAW_PINS),
            attachments: has(SINEW_DRAW_ATTACHMENTS),
            springs: has(SINEW_DRAW_SPRINGS),
            sleeping: has(SINEW_DRAW_SLEEPING),
            bounds: has(SINEW_DRAW_BOUNDS),
            normal_length: self.normal_length,
            force_scale: self.force_scale,
            full_strain: self.full_strain,
        })
    }
}

/// The callbacks of a caller, which vouches for them.
struct Callbacks(sinew_debug_draw);

impl Callbacks {
    fn call<const N: usize>(&self, draw: sinew_draw, points: [Vec3; N], color: Rgba) {
        let points = points.map(|point| point.to_array());
        if let Some(draw) = draw {
            // SAFETY: the caller of sinew_world_debug_draw vouches for the function and its context.
            unsafe { draw(self.0.context, points.as_ptr().cast(), color) };
        }
    }
}

impl DebugCanvas for Callbacks {
    fn line(&mut self, ends: [Vec3; 2], color: Rgba) {
        self.call(self.0.draw_line, ends, color);
    }

    fn point(&mut self, place: Vec3, color: Rgba) {
        self.call(self.0.draw_point, [place], color);
    }

    fn triangle(&mut self, corners: [Vec3; 3], color: Rgba) {
        self.call(self.0.draw_triangle, corners, color);
    }
}

/// Fills a debug drawing with its defaults; `struct_size` is sizeof(sinew_debug_draw).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_debug_draw_init(def: *mut sinew_debug_draw, struct_size: usize) -> sinew_status {
    guard(|| memory::initialise(def, struct_size, sinew_debug_draw::defaults()))
}

/// Draws what `def` asks for through its callbacks, as the last step left it.
///
/// It allocates nothing. The callbacks may use the world as a const sinew_world only.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_debug_draw(
    world: *const sinew_world,
    def: *const sinew_debug_draw,
) -> sinew_status {
    with_world(world, |world| {
        let def = memory::definition("def", def, sinew_debug_draw::defaults())?;
        world.debug_draw(&def.definition()?, &mut Callbacks(def))
    })
}
