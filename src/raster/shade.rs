//! Lighting of surfaces. Colors are linear RGB, where 1 is the white of the screen.

use super::geometry::Ground;
use super::scene::Look;
use glam::{Vec2, Vec3};

/// The key light: warm, from the upper left of the camera.
const KEY: Vec3 = Vec3::new(0.90, 0.86, 0.80);
/// The fill light: cool, from the lower right.
const FILL: Vec3 = Vec3::new(0.13, 0.16, 0.20);
/// The ambient light from above and from below.
const SKY: Vec3 = Vec3::new(0.36, 0.38, 0.41);
const BOUNCE: Vec3 = Vec3::new(0.20, 0.18, 0.17);
/// The reflection of wet surfaces at their silhouette.
const RIM: Vec3 = Vec3::new(0.50, 0.55, 0.62);
/// The background at the upper and the lower edge of the image.
const TOP: Vec3 = Vec3::new(0.90, 0.92, 0.94);
const BOTTOM: Vec3 = Vec3::new(0.62, 0.66, 0.71);

/// The lights of an image.
pub(crate) struct Lights {
    /// The unit vector to the key light.
    pub key: Vec3,
    fill: Vec3,
    up: Vec3,
}

/// A point on a surface as seen from the eye.
pub(crate) struct ShadingPoint {
    pub normal: Vec3,
    pub to_eye: Vec3,
    /// True if the outside is visible.
    pub front: bool,
    /// The fraction of the key light that arrives, 0 to 1.
    pub lit: f32,
    /// The visible fraction of the sky, 0 to 1.
    pub sky: f32,
}

impl Lights {
    /// Creates lights that move with the camera, so that every view is well lit. `right`, `up` and `back` are the
    /// camera's axes.
    pub fn new([right, up, back]: [Vec3; 3]) -> Self {
        Lights {
            key: (up * 1.0 - right * 0.55 + back * 0.75).normalize_or_zero(),
            fill: (right * 0.9 - up * 0.15 + back * 0.6).normalize_or_zero(),
            up,
        }
    }

    /// The color of a point with this look and linear color.
    pub fn shade(&self, look: &Look, colour: Vec3, point: &ShadingPoint) -> Vec3 {
        let is_inside = !point.front && !look.two_sided;
        let lit = point.lit * (0.6 + 0.4 * point.sky);
        let albedo = if is_inside { colour * 0.6 } else { colour };
        let normal = point.normal;
        // Subsurface scattering: colored light also leaves beyond the edge of the shadow.
        let wrap = albedo * 0.35;
        let diffuse = ((Vec3::splat(normal.dot(self.key)) + wrap) / (Vec3::ONE + wrap)).max(Vec3::ZERO)
            * (Vec3::splat(lit) + (1.0 - lit) * 0.25 * wrap);
        let fill = (normal.dot(self.fill) * 0.5 + 0.5) * point.sky;
        let height = normal.dot(self.up) * 0.5 + 0.5;
        // Interreflection has the color of the neighborhood: folds are deeper red, not gray.
        let sky = Vec3::splat(point.sky).lerp(Vec3::splat(point.sky) / (Vec3::ONE - albedo * (1.0 - point.sky)), 0.7);
        let ambient = BOUNCE.lerp(SKY, height) * sky;
        let reflected = albedo * (KEY * diffuse + FILL * fill + ambient);

        let facing = normal.dot(point.to_eye).max(0.0);
        let gloss = if is_inside { 0.3 * look.gloss } else { look.gloss };
        let wetness = gloss * gloss;
        let rim = RIM * (wetness * (1.0 - facing).powi(4) * height * point.sky);
        let highlight = if gloss > 0.0 {
            0.6 * gloss * self.highlight(point, 0.62 - 0.2 * gloss)
                + 0.9 * wetness * self.highlight(point, 0.40 - 0.22 * gloss)
        } else {
            0.0
        };
        reflected * (1.0 - 0.1 * wetness) + rim + KEY * (highlight * point.lit)
    }

    /// The specular reflection of the key light: the GGX distribution (Walter et al., "Microfacet models for
    /// refraction", 2007) with the visibility term of Kelemen and Szirmay-Kalos (2001).
    fn highlight(&self, point: &ShadingPoint, roughness: f32) -> f32 {
        let toward_light = point.normal.dot(self.key);
        if toward_light <= 0.0 || point.lit == 0.0 {
            return 0.0;
        }
        let half = (self.key + point.to_eye).normalize_or_zero();
        let squared = roughness.powi(4);
        let cosine = point.normal.dot(half).max(0.0);
        let spread = cosine * cosine * (squared - 1.0) + 1.0;
        let along = self.key.dot(half).max(0.0);
        let fresnel = 0.04 + 0.96 * (1.0 - along).powi(5);
        let masking = 4.0 * (along * along).max(0.05);
        // A distant light has no size; without a limit, a smooth surface would have an overexposed dot.
        (squared * fresnel * toward_light / (spread * spread * masking)).min(4.0)
    }
}

/// The brightness of a plane's checkerboard at a point, averaged over `footprint` meters (Quilez, "Filtering the
/// checkerboard pattern"), and its opacity, which fades to 0 at the rim.
pub(crate) fn ground(pattern: &Ground, position: Vec3, footprint: f32) -> (f32, f32) {
    let offset = position - pattern.centre;
    let point = Vec2::from_array(pattern.axes.map(|axis| offset.dot(axis))) / pattern.cell;
    let width = (footprint / pattern.cell).max(1e-4);
    let saw = |value: f32| (value / 2.0 - (value / 2.0).floor() - 0.5).abs();
    let [across, along] = point
        .to_array()
        .map(|value| 2.0 * (saw(value - width / 2.0) - saw(value + width / 2.0)) / width);
    let dark = 0.5 - 0.5 * across * along;
    let distance = offset.length() / pattern.radius;
    (1.0 - 0.13 * dark, 1.0 - smoothstep(0.35, 1.0, distance))
}

/// The background at this height in the image, from 0 at the upper edge to 1 at the lower.
pub(crate) fn background(height: f32) -> Vec3 {
    TOP.lerp(BOTTOM, smoothstep(0.0, 1.0, height))
}

/// A smooth transition from 0 below `low` to 1 above `high`.
pub(crate) fn smoothstep(low: f32, high: f32, value: f32) -> f32 {
    let t = ((value - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Converts an sRGB color (IEC 61966-2-1), 0 to 1, to linear RGB.
pub(crate) fn linear(colour: [f32; 3]) -> Vec3 {
    Vec3::from_array(colour.map(|value| {
        let value = value.clamp(0.0, 1.0);
        if value <= 0.04045 {
            value / 12.92
        } else {
            ((value + 0.055) / 1.055).powf(2.4)
        }
    }))
}

/// Conversion of linear RGB to the bytes of an image: bright light is compressed instead of clipped, then encoded as
/// sRGB.
pub(crate) struct Encoder {
    table: Vec<u8>,
}

impl Encoder {
    const STEPS: usize = 8192;
    /// Light above this value is compressed.
    const SHOULDER: f32 = 0.75;

    pub fn new() -> Self {
        let encode = |step: usize| {
            let value = step as f32 / Self::STEPS as f32;
            let encoded = if value <= 0.003_130_8 {
                12.92 * value
            } else {
                1.055 * value.powf(1.0 / 2.4) - 0.055
            };
            (encoded * 255.0 + 0.5) as u8
        };
        Encoder {
            table: (0..=Self::STEPS).map(encode).collect(),
        }
    }

    pub fn encode(&self, colour: Vec3) -> [u8; 4] {
        let [red, green, blue] = colour.to_array().map(|value| {
            let room = 1.0 - Self::SHOULDER;
            let over = value - Self::SHOULDER;
            let value = if over > 0.0 {
                Self::SHOULDER + room * over / (over + room)
            } else {
                value
            };
            let step = (value * Self::STEPS as f32) as usize;
            self.table[step.min(Self::STEPS)]
        });
        [red, green, blue, 255]
    }
}
