//! Pictures.

use glam::Vec3;
use std::ffi::c_char;

use super::body::sinew_body_id;
use super::guard::{guard, sinew_world, with_world};
use super::memory::{self, Versioned, versioned};
use super::status::sinew_status;
use crate::base::{Error, Result};
use crate::picture::{BodyValues, PictureDefinition};
use crate::raster::{ColourScale, Colours};

/// Camera and size of an image of a world, filled by sinew_picture_def_init.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_picture_def {
    /// Size of this struct; sinew_picture_def_init sets it.
    pub struct_size: usize,
    /// [pixels] Width of the image, 1 to 16384; default 1280.
    pub width: u32,
    /// [pixels] Height of the image, 1 to 16384; default 960.
    pub height: u32,
    /// [m] Position of the camera.
    pub eye: [f32; 3],
    /// [m] Center of the view; equal to eye (default): fitted along `direction`.
    pub target: [f32; 3],
    /// Up direction of the image; default 0 1 0.
    pub up: [f32; 3],
    /// Fitted view: direction to the camera; default 1 0.6 1.4.
    pub direction: [f32; 3],
    /// [rad] Vertical angle, above 0 and below pi; default 0.6.
    pub field_of_view: f32,
    /// 1: draws contact points and forces on tools; 0 (default).
    pub show_contacts: u32,
}

versioned! { sinew_picture_def }

impl sinew_picture_def {
    fn defaults() -> Self {
        let defaults = PictureDefinition::default();
        Self {
            width: defaults.width,
            height: defaults.height,
            up: defaults.up.to_array(),
            direction: defaults.direction.to_array(),
            field_of_view: defaults.field_of_view,
            ..Self::empty()
        }
    }

    fn definition(&self) -> Result<PictureDefinition> {
        let (eye, target) = (Vec3::from_array(self.eye), Vec3::from_array(self.target));
        Ok(PictureDefinition {
            width: self.width,
            height: self.height,
            eye_and_target: (eye != target).then_some((eye, target)),
            up: Vec3::from_array(self.up),
            direction: Vec3::from_array(self.direction),
            field_of_view: self.field_of_view,
            show_contacts: memory::flag("show_contacts", self.show_contacts)?,
        })
    }
}

/// Fills an image definition with its defaults; `struct_size` is sizeof(sinew_picture_def).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_picture_def_init(def: *mut sinew_picture_def, struct_size: usize) -> sinew_status {
    guard(|| memory::initialise(def, struct_size, sinew_picture_def::defaults()))
}

/// Blue over light gray to red, for signed values.
pub const SINEW_COLOURS_DIVERGING: u32 = 0;
/// Dark violet over green to light yellow.
pub const SINEW_COLOURS_SEQUENTIAL: u32 = 1;

/// Values per node that color a body, such as strain or force.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_body_values {
    /// Body that is colored.
    pub body: sinew_body_id,
    /// node_count finite floats in the caller's order.
    pub values: *const f32,
    /// Number of nodes of the body.
    pub node_count: usize,
    /// Value of the first color; also used below it.
    pub low: f32,
    /// Value of the last color, above low; also used above it.
    pub high: f32,
    /// Color map, a sinew_colours value.
    pub colours: u32,
}

impl sinew_body_values {
    /// # Safety
    /// `values` is NULL or as long as stated.
    unsafe fn values<'a>(&self) -> Result<BodyValues<'a>> {
        Ok(BodyValues {
            body: self.body.id(),
            values: memory::array("values", self.values, self.node_count)?,
            scale: ColourScale {
                colours: match self.colours {
                    SINEW_COLOURS_DIVERGING => Colours::Diverging,
                    SINEW_COLOURS_SEQUENTIAL => Colours::Sequential,
                    other => return Err(Error::invalid(format!("colours is {other}: there are no such colours"))),
                },
                low: self.low,
                high: self.high,
            },
        })
    }
}

/// Draws all bodies and tools into a PNG file, which replaces one that exists.
///
/// A body without surface shows its springs. `def` is nullable: the defaults. `path` is UTF-8.
///
/// Errors: SINEW_STATUS_IO; SINEW_STATUS_UNSUPPORTED if the library was built without pictures.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_save_picture(
    world: *const sinew_world,
    def: *const sinew_picture_def,
    path: *const c_char,
) -> sinew_status {
    with_world(world, |world| {
        let path = memory::text("path", path)?;
        world.picture(&definition(def)?)?.write_png(path)
    })
}

/// Draws like sinew_world_save_picture, with some bodies colored by values.
///
/// `coloured` holds `count` entries, each for another body.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_world_save_picture_of_values(
    world: *const sinew_world,
    def: *const sinew_picture_def,
    coloured: *const sinew_body_values,
    count: usize,
    path: *const c_char,
) -> sinew_status {
    with_world(world, |world| {
        let coloured = memory::array("coloured", coloured, count)?;
        let values = crate::base::memory::try_collected(coloured.iter().map(|of| of.values()))?;
        let picture = world.picture_of_values(&definition(def)?, &values)?;
        picture.write_png(memory::text("path", path)?)
    })
}

/// What `def` asks for; NULL: the defaults.
///
/// # Safety
/// `def` is NULL or a definition of the size that it states.
unsafe fn definition(def: *const sinew_picture_def) -> Result<PictureDefinition> {
    memory::optional_definition("def", def, sinew_picture_def::defaults())?.definition()
}
