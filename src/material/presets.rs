//! Properties of tissues from the literature, with sources.

use std::ffi::CStr;

/// The properties of a tissue. Organs differ from one another by more than the precision of these numbers.
///
/// ```
/// use sinew::material::{Material, Model, presets::LIVER};
/// let material = Material {
///     model: Model::Tetrahedra,
///     young_modulus: LIVER.young_modulus(),
///     poisson_ratio: 0.45,
///     density: LIVER.density,
///     ..Material::default()
/// };
/// // Soft tissue is nearly incompressible: E is three times G.
/// assert_eq!(material.young_modulus, 3.0 * LIVER.shear_modulus);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Preset {
    /// A `CStr`, because the C API returns it too.
    pub(crate) name: &'static CStr,
    pub(crate) source: &'static CStr,
    /// The shear modulus, from slow measurements at small strains, Pa.
    pub shear_modulus: f32,
    /// The density, kg/m³.
    pub density: f32,
}

impl Preset {
    /// The name of the tissue.
    pub fn name(&self) -> &'static str {
        self.name.to_str().unwrap_or_default()
    }

    /// The source of the numbers.
    pub fn source(&self) -> &'static str {
        self.source.to_str().unwrap_or_default()
    }

    /// Young's modulus, three times the shear modulus because tissue is nearly incompressible, Pa.
    pub fn young_modulus(&self) -> f32 {
        3.0 * self.shear_modulus
    }
}

const fn tissue(name: &'static CStr, source: &'static CStr, shear_modulus: f32, density: f32) -> Preset {
    Preset {
        name,
        source,
        shear_modulus,
        density,
    }
}

/// All presets, in the order of the C API. All numbers are from one review: table 1 of Phys. Med. Biol. 64 (2019)
/// 225001, doi 10.1088/1361-6560/ab5010, PMC6925591. Skin is missing: published values range from 5 kPa to 140 MPa,
/// depending on the method (Kalra et al., *Mechanical behaviour of skin: a review*, 2016).
pub const PRESETS: [Preset; 7] = [
    LIVER,
    FIBROTIC_LIVER,
    LIVER_TUMOUR,
    STOMACH,
    GALLBLADDER,
    BILE_DUCT,
    HEPATIC_ARTERY,
];

/// Healthy liver, G = 1.8 ± 0.4 kPa, E 5.4 kPa.
pub const LIVER: Preset = tissue(
    c"liver",
    c"Phys. Med. Biol. 64 (2019) 225001, table 1, PMC6925591: liver, 1.8 +- 0.4 kPa \
     (from Bamber and Hill 1981, Palmeri et al. 2008, Webb et al. 2011, Honjo et al. 2014)",
    1800.0,
    1060.0,
);

/// Diseased liver, G = 19.8 kPa.
pub const FIBROTIC_LIVER: Preset = tissue(
    c"fibrotic liver",
    c"Phys. Med. Biol. 64 (2019) 225001, table 1, PMC6925591: diseased liver \
     (from Bamber and Hill 1981, Palmeri et al. 2008, Webb et al. 2011, Honjo et al. 2014)",
    19_800.0,
    1060.0,
);

/// Hepatocellular carcinoma, G = 23.4 kPa.
pub const LIVER_TUMOUR: Preset = tissue(
    c"liver tumour",
    c"Phys. Med. Biol. 64 (2019) 225001, table 1, PMC6925591: HCC \
     (from Bamber and Hill 1981, Palmeri et al. 2008, Webb et al. 2011, Honjo et al. 2014)",
    23_400.0,
    1060.0,
);

/// Stomach, G = 0.637 kPa.
pub const STOMACH: Preset = tissue(
    c"stomach",
    c"Phys. Med. Biol. 64 (2019) 225001, table 1, PMC6925591: stomach \
     (from Saijo et al. 1991, Lim et al. 2009)",
    637.0,
    1058.0,
);

/// Gallbladder, G = 85 ± 8.2 kPa.
pub const GALLBLADDER: Preset = tissue(
    c"gallbladder",
    c"Phys. Med. Biol. 64 (2019) 225001, table 1, PMC6925591: gallbladder, 85 +- 8.2 kPa \
     (from Karimi et al. 2017)",
    85_000.0,
    1060.0,
);

/// Bile duct, G = 166 ± 67 kPa.
pub const BILE_DUCT: Preset = tissue(
    c"bile duct",
    c"Phys. Med. Biol. 64 (2019) 225001, table 1, PMC6925591: bile duct, 166 +- 67 kPa \
     (from Duch et al. 2004)",
    166_000.0,
    1060.0,
);

/// Hepatic artery, G = 210 ± 47 kPa.
pub const HEPATIC_ARTERY: Preset = tissue(
    c"hepatic artery",
    c"Phys. Med. Biol. 64 (2019) 225001, table 1, PMC6925591: hepatic artery, 210 +- 47 kPa \
     (from Deng et al. 1994, Holzapfel et al. 2005)",
    210_000.0,
    1050.0,
);
