//! Figures of tissues.

use std::ffi::c_char;

use super::guard::guard;
use super::memory::{self, versioned};
use super::status::sinew_status;
use crate::base::Error;
use crate::material::presets::PRESETS;

/// Healthy liver, E = 5.4 kPa.
pub const SINEW_PRESET_LIVER: u32 = 0;
/// Fibrotic liver, E = 59.4 kPa.
pub const SINEW_PRESET_FIBROTIC_LIVER: u32 = 1;
/// Hepatocellular carcinoma, E = 70.2 kPa.
pub const SINEW_PRESET_LIVER_TUMOUR: u32 = 2;
/// Stomach, E = 1.9 kPa.
pub const SINEW_PRESET_STOMACH: u32 = 3;
/// Gallbladder, E = 255 kPa.
pub const SINEW_PRESET_GALLBLADDER: u32 = 4;
/// Bile duct, E = 498 kPa.
pub const SINEW_PRESET_BILE_DUCT: u32 = 5;
/// Hepatic artery, E = 630 kPa.
pub const SINEW_PRESET_HEPATIC_ARTERY: u32 = 6;

/// Material values of a tissue from the literature, for young_modulus and density of a body.
///
/// Organs of individual patients vary more than the digits suggest.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct sinew_material_preset {
    /// Set to sizeof(sinew_material_preset) before the call.
    pub struct_size: usize,
    /// English name of the tissue; static string.
    pub name: *const c_char,
    /// Source of the values; static string.
    pub source: *const c_char,
    /// [Pa] Shear modulus as the source gives it.
    pub shear_modulus: f32,
    /// [Pa] Young's modulus: 3 times the shear modulus (incompressible).
    pub young_modulus: f32,
    /// [kg/m^3] Mass density.
    pub density: f32,
}

versioned! { sinew_material_preset }

/// Writes the material values of a tissue.
///
/// `preset` is a sinew_preset value; presets are numbered from 0 without a gap.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_material_get_preset(preset: u32, out: *mut sinew_material_preset) -> sinew_status {
    guard(|| {
        let out = memory::report("out", out)?;
        let found = PRESETS
            .get(preset as usize)
            .ok_or_else(|| Error::invalid(format!("preset is {preset}: no SINEW_PRESET_...")))?;
        out.fill(sinew_material_preset {
            struct_size: size_of::<sinew_material_preset>(),
            name: found.name.as_ptr(),
            source: found.source.as_ptr(),
            shear_modulus: found.shear_modulus,
            young_modulus: found.young_modulus(),
            density: found.density,
        });
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::presets;

    #[test]
    fn numbers_and_presets_agree() {
        for (number, preset) in [
            (SINEW_PRESET_LIVER, presets::LIVER),
            (SINEW_PRESET_FIBROTIC_LIVER, presets::FIBROTIC_LIVER),
            (SINEW_PRESET_LIVER_TUMOUR, presets::LIVER_TUMOUR),
            (SINEW_PRESET_STOMACH, presets::STOMACH),
            (SINEW_PRESET_GALLBLADDER, presets::GALLBLADDER),
            (SINEW_PRESET_BILE_DUCT, presets::BILE_DUCT),
            (SINEW_PRESET_HEPATIC_ARTERY, presets::HEPATIC_ARTERY),
        ] {
            assert_eq!(PRESETS[number as usize], preset);
        }
        assert_eq!(PRESETS.len(), 7);
    }
}
