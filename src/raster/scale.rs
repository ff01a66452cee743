//! Colours for numbers.
//!
//! They lie on straight lines in OKLab (Ottosson, "A perceptual color space for image processing", 2020), so that equal steps of a
//! number look equally far apart, and lightness alone tells which of two is larger, in print and to those who see few colours.

use glam::{Mat3, Vec3};

use crate::base::{Result, all_finite, ensure};

/// Which colours numbers have.
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
    /// From blue by a light grey, in the middle, to red: for what has a sign.
    #[default]
    Diverging,
    /// From a dark violet by green to a light yellow: for what has none.
    Sequential,
}

/// The colours of numbers between two.
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
/// // A value above the last one has its colour.
/// assert_eq!(drawn(0.9, scale)?, drawn(0.3, scale)?);
/// assert_ne!(drawn(0.1, scale)?, drawn(0.3, scale)?);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColourScale {
    /// Which.
    pub colours: Colours,
    /// What has the first colour, as has what is below.
    pub low: f32,
    /// What has the last colour, as has what is above.
    pub high: f32,
}

/// Numbers that a thing is coloured by.
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
    /// One for each position; between them they are interpolated.
    pub values: &'a [f32],
    /// What colours they have.
    pub scale: ColourScale,
}

impl ColourScale {
    /// The colour of a number: red, green and blue as light, 0 to 1.
    pub(super) fn colour(&self, value: f32) -> Vec3 {
        let (low, high) = (f64::from(self.low), f64::from(self.high));
        let part = ((f64::from(value) - low) / (high - low)).clamp(0.0, 1.0) as f32;
        match self.colours {
            Colours::Diverging => {
                let side = 2.0 * part - 1.0;
                let end = if side < 0.0 { BLUE } else { RED };
                light(GREY.lerp(end, side.abs()))
            }
            Colours::Sequential => {
                let along = part * (STOPS.len() - 1) as f32;
                let stop = (along as usize).min(STOPS.len() - 2);
                light(STOPS[stop].lerp(STOPS[stop + 1], along - stop as f32))
            }
        }
    }
}

impl Coloured<'_> {
    /// Refuses what cannot be drawn.
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

/// Lightness, from green to red, from blue to yellow: all that lies between is a colour of screens, and not so dark that light and
/// shadow are lost.
const GREY: Vec3 = Vec3::new(0.93, 0.0, 0.0);
const BLUE: Vec3 = Vec3::new(0.45, -0.03, -0.16);
const RED: Vec3 = Vec3::new(0.48, 0.17, 0.08);
const STOPS: [Vec3; 4] = [
    Vec3::new(0.38, 0.06, -0.13),
    Vec3::new(0.57, -0.05, -0.06),
    Vec3::new(0.76, -0.12, 0.07),
    Vec3::new(0.94, -0.04, 0.16),
];

/// A colour of OKLab as light.
fn light(lab: Vec3) -> Vec3 {
    const CONES: Mat3 = Mat3::from_cols(
        Vec3::new(1.0, 1.0, 1.0),
        Vec3::new(0.396_337_78, -0.105_561_346, -0.089_484_18),
        Vec3::new(0.215_803_76, -0.063_854_17, -1.291_485_5),
    );
    const LIGHT: Mat3 = Mat3::from_cols(
        Vec3::new(4.076_741_7, -1.268_438, -0.004_196_086_3),
        Vec3::new(-3.307_711_6, 2.609_757_4, -0.703_418_6),
        Vec3::new(0.230_969_94, -0.341_319_38, 1.707_614_7),
    );
    let cones = CONES * lab;
    (LIGHT * (cones * cones * cones)).clamp(Vec3::ZERO, Vec3::ONE)
}
