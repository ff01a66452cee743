//! Color scales for values.
//!
//! Scales are straight lines in OKLab (Ottosson, "A perceptual color space for image processing", 2020). Equal steps
//! of a value look equally large. Lightness alone shows which of two values is larger, also in print and for
//! color-blind readers.

use glam::{Mat3, Vec3};

use crate::base::{Result, all_finite, ensure};

/// The colors of a scale.
///
/// ```
/// # use glam::Vec3;
/// # use sinew::raster::{ColourScale, Coloured, Colours, Look, Scene, Surface};
/// # let (positions, triangles) = (&[Vec3::ZERO, Vec3::X, Vec3::Z][..], &[[0, 2, 1]][..]);
/// let drawn = |colours| {
///     let coloured = Some(Coloured { values: &[0.2; 3], scale: ColourScale { colours, low: 0.0, high: 1.0 } });
///     let surface = Surface { positions, triangles, look: Look::CHART, coloured };
///     let scene = Scene { surfaces: vec![surface], ..Scene::default() };
///     scene.draw(&scene.camera(Vec3::Y, Vec3::NEG_Z, 0.6, 1.0)?, 32, 32)
/// };
/// assert_ne!(drawn(Colours::Diverging)?, drawn(Colours::Sequential)?);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Colours {
    /// From blue over a light gray in the middle to red, for signed values.
    #[default]
    Diverging,
    /// From a dark violet over green to a light yellow, for unsigned values.
    Sequential,
}

/// A color scale over a range of values.
///
/// ```
/// # use glam::Vec3;
/// # use sinew::raster::{ColourScale, Coloured, Colours, Look, Scene, Surface};
/// # let (positions, triangles) = (&[Vec3::ZERO, Vec3::X, Vec3::Z][..], &[[0, 2, 1]][..]);
/// # let drawn = |value: f32, scale| {
/// #     let surface = Surface { positions, triangles, look: Look::CHART, coloured: Some(Coloured { values: &[value; 3], scale }) };
/// #     let scene = Scene { surfaces: vec![surface], ..Scene::default() };
/// #     scene.draw(&scene.camera(Vec3::Y, Vec3::NEG_Z, 0.6, 1.0)?, 32, 32)
/// # };
/// let scale = ColourScale { colours: Colours::Sequential, low: 0.0, high: 0.3 };
/// // A value above the range has the last color.
/// assert_eq!(drawn(0.9, scale)?, drawn(0.3, scale)?);
/// assert_ne!(drawn(0.1, scale)?, drawn(0.3, scale)?);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColourScale {
    /// The colors.
    pub colours: Colours,
    /// The value of the first color. Values below have it too.
    pub low: f32,
    /// The value of the last color. Values above have it too.
    pub high: f32,
}

/// Values that color an object.
///
/// ```
/// # use glam::Vec3;
/// # use sinew::raster::{ColourScale, Coloured, Colours, Look, Scene, Surface};
/// # let (positions, triangles) = (&[Vec3::ZERO, Vec3::X, Vec3::Z][..], &[[0, 2, 1]][..]);
/// let scale = ColourScale { colours: Colours::Sequential, low: 0.0, high: 1.0 };
/// let coloured = Some(Coloured { values: &[0.0, 0.5, 1.0], scale });
/// let surface = Surface { positions, triangles, look: Look::CHART, coloured };
/// let scene = Scene { surfaces: vec![surface], ..Scene::default() };
/// # let plain = Scene { surfaces: vec![Surface { coloured: None, ..surface }], ..Scene::default() };
/// # let camera = scene.camera(Vec3::Y, Vec3::NEG_Z, 0.6, 1.0)?;
/// assert_ne!(scene.draw(&camera, 32, 32)?, plain.draw(&camera, 32, 32)?);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coloured<'a> {
    /// A value for each position, interpolated in between.
    pub values: &'a [f32],
    /// The color scale.
    pub scale: ColourScale,
}

impl ColourScale {
    /// The color of a value in linear RGB, 0 to 1.
    pub(super) fn colour(&self, value: f32) -> Vec3 {
        let (low, high) = (f64::from(self.low), f64::from(self.high));
        let t = ((f64::from(value) - low) / (high - low)).clamp(0.0, 1.0) as f32;
        match self.colours {
            Colours::Diverging => {
                let signed = 2.0 * t - 1.0;
                let end = if signed < 0.0 { BLUE } else { RED };
                oklab_to_linear(GREY.lerp(end, signed.abs()))
            }
            Colours::Sequential => {
                let position = t * (STOPS.len() - 1) as f32;
                let stop = (position as usize).min(STOPS.len() - 2);
                oklab_to_linear(STOPS[stop].lerp(STOPS[stop + 1], position - stop as f32))
            }
        }
    }
}

impl Coloured<'_> {
    /// Returns an error for an invalid scale or invalid values.
    pub(super) fn check(&self, count: usize) -> Result<()> {
        let ColourScale { low, high, .. } = self.scale;
        ensure!(
            low < high && low.is_finite() && high.is_finite(),
            "low is {low} and high {high}: low must be below high, and both finite"
        );
        let given = self.values.len();
        ensure!(given == count, "values has {given} entries: must have {count}");
        all_finite("values", self.values)
    }
}

/// OKLab lightness, and the axes from green to red and from blue to yellow. All colors in between are in the sRGB
/// gamut, and light enough to leave shading visible.
const GREY: Vec3 = Vec3::new(0.93, 0.0, 0.0);
const BLUE: Vec3 = Vec3::new(0.45, -0.03, -0.16);
const RED: Vec3 = Vec3::new(0.48, 0.17, 0.08);
const STOPS: [Vec3; 4] = [
    Vec3::new(0.38, 0.06, -0.13),
    Vec3::new(0.57, -0.05, -0.06),
    Vec3::new(0.76, -0.12, 0.07),
    Vec3::new(0.94, -0.04, 0.16),
];

/// Converts an OKLab color to linear RGB.
fn oklab_to_linear(lab: Vec3) -> Vec3 {
    const LMS_FROM_OKLAB: Mat3 = Mat3::from_cols(
        Vec3::new(1.0, 1.0, 1.0),
        Vec3::new(0.396_337_78, -0.105_561_346, -0.089_484_18),
        Vec3::new(0.215_803_76, -0.063_854_17, -1.291_485_5),
    );
    const RGB_FROM_LMS: Mat3 = Mat3::from_cols(
        Vec3::new(4.076_741_7, -1.268_438, -0.004_196_086_3),
        Vec3::new(-3.307_711_6, 2.609_757_4, -0.703_418_6),
        Vec3::new(0.230_969_94, -0.341_319_38, 1.707_614_7),
    );
    let lms = LMS_FROM_OKLAB * lab;
    (RGB_FROM_LMS * (lms * lms * lms)).clamp(Vec3::ZERO, Vec3::ONE)
}
