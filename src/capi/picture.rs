//! Pictures.

use glam::Vec3;
use libc::c_char;

use super::guard::{guard, sinew_world, with_world};
use super::memory::{self, Versioned};
use super::status::sinew_status;
use crate::error::Result;
use crate::picture::PictureDefinition;

/// How a world is drawn. Filled by sinew_picture_def_init.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_picture_def {
    /// Set by sinew_picture_def_init.
    pub struct_size: usize,
    /// Pixels, 1 to 16384; default 1280.
    pub width: u32,
    /// Pixels, 1 to 16384; default 960.
    pub height: u32,
    /// Where the camera is, m.
    pub eye: [f32; 3],
    /// What it looks at, m; eye equal to target, the default: a view fitted to the bodies, from `direction`.
    pub target: [f32; 3],
    /// What is up in the picture; default 0 1 0.
    pub up: [f32; 3],
    /// For a fitted view: from the scene towards the camera; default 1 0.6 1.4.
    pub direction: [f32; 3],
    /// rad, vertical, above 0 and below pi; default 0.6.
    pub field_of_view: f32,
    /// 0.
    pub reserved: u32,
}

// SAFETY: repr(C), begins with struct_size, numbers alone.
unsafe impl Versioned for sinew_picture_def {
    const SIZES: &'static [usize] = &[size_of::<Self>()];
    const NAME: &'static str = "sinew_picture_def";
}

impl sinew_picture_def {
    fn defaults() -> Self {
        let defaults = PictureDefinition::default();
        Self {
            struct_size: size_of::<Self>(),
            width: defaults.width,
            height: defaults.height,
            eye: [0.0; 3],
            target: [0.0; 3],
            up: defaults.up.to_array(),
            direction: defaults.direction.to_array(),
            field_of_view: defaults.field_of_view,
            reserved: 0,
        }
    }

    fn definition(&self) -> Result<PictureDefinition> {
        memory::reserved("reserved", self.reserved)?;
        let (eye, target) = (Vec3::from_array(self.eye), Vec3::from_array(self.target));
        Ok(PictureDefinition {
            width: self.width,
            height: self.height,
            eye_and_target: (eye != target).then_some((eye, target)),
            up: Vec3::from_array(self.up),
            direction: Vec3::from_array(self.direction),
            field_of_view: self.field_of_view,
        })
    }
}

/// Fills `def` with the defaults. `struct_size` is sizeof(sinew_picture_def).
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT.
///
/// # Safety
/// `def` is NULL or writable for `struct_size` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_picture_def_init(def: *mut sinew_picture_def, struct_size: usize) -> sinew_status {
    // SAFETY: the same contract.
    guard(|| unsafe { memory::initialise(def, struct_size, sinew_picture_def::defaults()) })
}

/// Draws all bodies and tools into a PNG file: the surface of a body, or its springs where it has none. `def` may be NULL:
/// the defaults. `path` is UTF-8; a file that exists is replaced, once the whole picture is written.
///
/// Errors: SINEW_STATUS_INVALID_ARGUMENT, SINEW_STATUS_IO, SINEW_STATUS_OUT_OF_MEMORY, SINEW_STATUS_UNSUPPORTED (a library
/// built without pictures).
///
/// # Safety
/// `world` is NULL or a world nobody changes; `def` is NULL or a definition of the size that it states; `path` is NULL or
/// ends with NUL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_save_picture(
    world: *const sinew_world,
    def: *const sinew_picture_def,
    path: *const c_char,
) -> sinew_status {
    // SAFETY: the same contract.
    unsafe {
        with_world(world, |world| {
            let defaults = sinew_picture_def::defaults();
            let def = if def.is_null() {
                defaults
            } else {
                memory::definition("def", def, defaults)?
            };
            let path = memory::text("path", path)?;
            world.picture(&def.definition()?)?.write_png(path)
        })
    }
}
