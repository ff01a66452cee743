//! How surfaces answer light. Colours are linear here, on a scale where 1 is the screen's white.

use super::geometry::Ground;
use super::scene::Look;
use glam::{Vec2, Vec3};

/// The key light, warm and from the upper left of the camera.
const KEY: Vec3 = Vec3::new(0.90, 0.86, 0.80);
/// The fill light, cool and from the lower right.
const FILL: Vec3 = Vec3::new(0.13, 0.16, 0.20);
/// Light from above and from below.
const SKY: Vec3 = Vec3::new(0.36, 0.38, 0.41);
const BOUNCE: Vec3 = Vec3::new(0.20, 0.18, 0.17);
/// What wet surfaces reflect at their outlines.
const RIM: Vec3 = Vec3::new(0.50, 0.55, 0.62);
/// The background, at the upper and the lower edge of the picture.
const TOP: Vec3 = Vec3::new(0.90, 0.92, 0.94);
const BOTTOM: Vec3 = Vec3::new(0.62, 0.66, 0.71);

/// The lights of a picture.
pub(crate) struct Lights {
    /// Towards the key light, length one.
    pub key: Vec3,
    fill: Vec3,
    up: Vec3,
}

/// A place on a surface, as the eye sees it.
pub(crate) struct SurfacePlace {
    pub normal: Vec3,
    pub to_eye: Vec3,
    /// Whether the eye sees the outside.
    pub front: bool,
    /// The share of the key light that arrives, 0 to 1.
    pub lit: f32,
    /// The share of the sky that is open, 0 to 1.
    pub open: f32,
}

impl Lights {
    /// Lights that go with the camera, so that every view is well lit: `right`, `up` and `back` are its axes.
    pub fn new([right, up, back]: [Vec3; 3]) -> Self {
        Lights {
            key: (up * 1.0 - right * 0.55 + back * 0.75).normalize_or_zero(),
            fill: (right * 0.9 - up * 0.15 + back * 0.6).normalize_or_zero(),
            up,
        }
    }

    /// The colour of a place with this look and (linear) colour.
    pub fn shade(&self, look: &Look, colour: Vec3, place: &SurfacePlace) -> Vec3 {
        let inside = !place.front && !look.two_sided;
        let lit = place.lit * (0.6 + 0.4 * place.open);
        let albedo = if inside { colour * 0.6 } else { colour };
        let normal = place.normal;
        // Where some colour is scattered inside, it also leaves past the edge of the shadow.
        let wrap = albedo * 0.35;
        let diffuse = ((Vec3::splat(normal.dot(self.key)) + wrap) / (Vec3::ONE + wrap)).max(Vec3::ZERO)
            * (Vec3::splat(lit) + (1.0 - lit) * 0.25 * wrap);
        let fill = (normal.dot(self.fill) * 0.5 + 0.5) * place.open;
        let height = normal.dot(self.up) * 0.5 + 0.5;
        // Light that was reflected by the neighbours takes their colour: folds are deeper red, not grey.
        let open =
            Vec3::splat(place.open).lerp(Vec3::splat(place.open) / (Vec3::ONE - albedo * (1.0 - place.open)), 0.7);
        let ambient = BOUNCE.lerp(SKY, height) * open;
        let body = albedo * (KEY * diffuse + FILL * fill + ambient);

        let facing = normal.dot(place.to_eye).max(0.0);
        let gloss = if inside { 0.3 * look.gloss } else { look.gloss };
        let wet = gloss * gloss;
        let rim = RIM * (wet * (1.0 - facing).powi(4) * height * place.open);
        let highlight = if gloss > 0.0 {
            0.6 * gloss * self.highlight(place, 0.62 - 0.2 * gloss)
                + 0.9 * wet * self.highlight(place, 0.40 - 0.22 * gloss)
        } else {
            0.0
        };
        body * (1.0 - 0.1 * wet) + rim + KEY * (highlight * place.lit)
    }

    /// The reflection of the key light (Walter et al., "Microfacet models for refraction", 2007: GGX), with the masking
    /// of Kelemen and Szirmay-Kalos (2001).
    fn highlight(&self, place: &SurfacePlace, roughness: f32) -> f32 {
        let toward_light = place.normal.dot(self.key);
        if toward_light <= 0.0 || place.lit == 0.0 {
            return 0.0;
        }
        let half = (self.key + place.to_eye).normalize_or_zero();
        let squared = roughness.powi(4);
        let cosine = place.normal.dot(half).max(0.0);
        let spread = cosine * cosine * (squared - 1.0) + 1.0;
        let along = self.key.dot(half).max(0.0);
        let fresnel = 0.04 + 0.96 * (1.0 - along).powi(5);
        let masking = 4.0 * (along * along).max(0.05);
        // Distant lights have no size; without a limit a smooth surface would show a burnt-out dot.
        (squared * fresnel * toward_light / (spread * spread * masking)).min(4.0)
    }
}

/// The share of a plane's colour at a place: its squares, averaged over `footprint` metres (Quilez, "Filtering the
/// checkerboard pattern"), and how much of it is left of the fading towards its rim, 0 to 1.
pub(crate) fn ground(pattern: &Ground, position: Vec3, footprint: f32) -> (f32, f32) {
    let offset = position - pattern.centre;
    let place = Vec2::from_array(pattern.axes.map(|axis| offset.dot(axis))) / pattern.cell;
    let width = (footprint / pattern.cell).max(1e-4);
    let saw = |value: f32| (value / 2.0 - (value / 2.0).floor() - 0.5).abs();
    let [across, along] = place
        .to_array()
        .map(|value| 2.0 * (saw(value - width / 2.0) - saw(value + width / 2.0)) / width);
    let dark = 0.5 - 0.5 * across * along;
    let distance = offset.length() / pattern.radius;
    (1.0 - 0.13 * dark, 1.0 - smoothstep(0.35, 1.0, distance))
}

/// The background at this height in the picture, 0 at the upper edge and 1 at the lower.
pub(crate) fn background(height: f32) -> Vec3 {
    TOP.lerp(BOTTOM, smoothstep(0.0, 1.0, height))
}

/// From 0 below `low` to 1 above `high`, smooth.
pub(crate) fn smoothstep(low: f32, high: f32, value: f32) -> f32 {
    let t = ((value - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// A screen colour (sRGB, IEC 61966-2-1), 0 to 1, as light.
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

/// Light to the bytes of a picture: bright light is compressed instead of cut off, then encoded as sRGB.
pub(crate) struct Encoder {
    table: Vec<u8>,
}

impl Encoder {
    const STEPS: usize = 8192;
    /// From here on light is compressed.
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
