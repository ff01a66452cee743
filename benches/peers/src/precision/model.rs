//! What every engine simulates: nodes, tetrahedra or springs, and their material, as a file that players in any language
//! read.

use std::fmt::Write;

use crate::precision::law::Law;
use crate::scenes::Block;

/// Frames are of this length, s.
pub const FRAME: f64 = 1.0 / 60.0;

/// The skin of bodies that meet others, m.
pub const SKIN: f64 = 1e-3;

/// A rigid ball without friction that goes down and then stays where it is.
#[derive(Clone, Copy, Debug)]
pub struct Ball {
    /// As it begins.
    pub center: [f64; 3],
    pub radius: f64,
    /// m/s along -y, over the first two thirds of the frames.
    pub speed: f64,
}

impl Ball {
    /// Its centre once so many of `frames` frames have passed.
    pub fn center_after(&self, passed: usize, frames: usize) -> [f64; 3] {
        let [x, y, z] = self.center;
        [x, y - self.speed * FRAME * passed.min(2 * frames / 3) as f64, z]
    }
}

/// A scene's bodies and what acts on them. Numbers are `f64`; engines round them as they must.
#[derive(Clone, Debug, Default)]
pub struct Model {
    /// Metres.
    pub positions: Vec<[f64; 3]>,
    /// Kilograms.
    pub masses: Vec<f64>,
    /// Nodes that stay where they are, in order.
    pub pinned: Vec<usize>,
    pub tetrahedra: Vec<[usize; 4]>,
    pub springs: Vec<[usize; 2]>,
    /// The surface of what meets something.
    pub triangles: Vec<[usize; 3]>,
    /// All of the above is of so many equal bodies, one after the other; 0 is 1. They meet each other.
    pub bodies: usize,
    /// What stands in the way.
    pub ball: Option<Ball>,
    /// Whether the ground y = 0 does too.
    pub has_floor: bool,
    /// Of bodies with each other and with the ground.
    pub friction: f64,
    /// N/m, of every spring. Springs are at rest where they begin.
    pub stiffness: f64,
    /// Pa.
    pub young: f64,
    pub poisson: f64,
    /// m/s² along -y.
    pub gravity: f64,
    /// A node's damping for each kilogram of its mass, 1/s.
    pub damping: f64,
    /// How many frames are simulated.
    pub frames: usize,
}

impl Model {
    /// Lamé's parameters mu and lambda.
    pub fn lame(&self) -> (f64, f64) {
        let Self { young, poisson, .. } = *self;
        let mu = young / (2.0 * (1.0 + poisson));
        (mu, young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson)))
    }

    /// Tetrahedra of a soft solid under its own weight for a second, with these nodes held: Pa, kg/m³.
    pub fn solid(block: Block, pinned: Vec<usize>, young: f64, density: f64) -> Self {
        let mut model = Self {
            positions: block.positions,
            tetrahedra: block.tetrahedra,
            pinned,
            young,
            poisson: 0.3,
            gravity: 9.81,
            frames: 60,
            ..Self::default()
        };
        model.fill(density);
        model
    }

    /// Gives each node its share of the mass of tetrahedra of so many kg/m³.
    fn fill(&mut self, density: f64) {
        self.masses = vec![0.0; self.positions.len()];
        for corners in &self.tetrahedra {
            let [a, b, c, d] = corners.map(|node| glam::DVec3::from(self.positions[node]));
            let volume = (b - a).cross(c - a).dot(d - a) / 6.0;
            assert!(volume > 0.0, "tetrahedra are the right way out");
            for &node in corners {
                self.masses[node] += 0.25 * density * volume;
            }
        }
    }

    /// The same body once for each of these places.
    pub fn copied(self, places: &[[f64; 3]]) -> Self {
        let count = self.positions.len();
        let moved = |place: &[f64; 3]| {
            let place = *place;
            let positions = self.positions.iter();
            positions.map(move |start| std::array::from_fn(|axis| start[axis] + place[axis]))
        };
        fn shifted<const N: usize>(elements: &[[usize; N]], count: usize, bodies: usize) -> Vec<[usize; N]> {
            let of_body = |body| elements.iter().map(move |nodes| nodes.map(|node| node + body * count));
            (0..bodies).flat_map(of_body).collect()
        }
        Self {
            positions: places.iter().flat_map(moved).collect(),
            masses: self.masses.repeat(places.len()),
            tetrahedra: shifted(&self.tetrahedra, count, places.len()),
            triangles: shifted(&self.triangles, count, places.len()),
            bodies: places.len(),
            ..self
        }
    }

    /// How many bodies there are.
    pub fn body_count(&self) -> usize {
        self.bodies.max(1)
    }

    /// One of its bodies alone.
    pub fn body(&self, index: usize) -> Self {
        fn part<T>(all: &[T], index: usize, count: usize) -> &[T] {
            let size = all.len() / count;
            &all[index * size..(index + 1) * size]
        }
        let count = self.body_count();
        let first = index * self.positions.len() / count;
        Self {
            positions: part(&self.positions, index, count).to_vec(),
            masses: part(&self.masses, index, count).to_vec(),
            tetrahedra: part(&self.tetrahedra, index, count)
                .iter()
                .map(|nodes| nodes.map(|node| node - first))
                .collect(),
            triangles: part(&self.triangles, index, count)
                .iter()
                .map(|nodes| nodes.map(|node| node - first))
                .collect(),
            bodies: 1,
            ..self.clone()
        }
    }

    /// The file: words and numbers, each section with its name and count first.
    pub fn text(&self) -> String {
        let mut text = String::new();
        let _ = writeln!(
            text,
            "frame {FRAME} frames {} gravity {} damping {} young {} poisson {} stiffness {}",
            self.frames, self.gravity, self.damping, self.young, self.poisson, self.stiffness
        );
        let _ = writeln!(text, "nodes {}", self.positions.len());
        for ([x, y, z], mass) in self.positions.iter().zip(&self.masses) {
            let _ = writeln!(text, "{x} {y} {z} {mass}");
        }
        let _ = writeln!(text, "pinned {}", self.pinned.len());
        for node in &self.pinned {
            let _ = writeln!(text, "{node}");
        }
        let _ = writeln!(text, "tetrahedra {}", self.tetrahedra.len());
        for [a, b, c, d] in &self.tetrahedra {
            let _ = writeln!(text, "{a} {b} {c} {d}");
        }
        let _ = writeln!(text, "springs {}", self.springs.len());
        for [a, b] in &self.springs {
            let _ = writeln!(text, "{a} {b}");
        }
        if self.has_contact() {
            let _ = writeln!(text, "triangles {}", self.triangles.len());
            for [a, b, c] in &self.triangles {
                let _ = writeln!(text, "{a} {b} {c}");
            }
            let _ = writeln!(text, "friction {} bodies {}", self.friction, self.body_count());
        }
        if self.has_floor {
            text += "floor 1\n";
        }
        if let Some(Ball {
            center: [x, y, z],
            radius,
            speed,
        }) = self.ball
        {
            let _ = writeln!(text, "ball 1\n{x} {y} {z} {radius} {speed}");
        }
        text
    }

    /// What [`Model::text`] wrote.
    pub fn from_text(text: &str) -> Self {
        let mut words = text.split_ascii_whitespace();
        let mut model = Self::default();
        while let Some(name) = words.next() {
            let mut number = || {
                words
                    .next()
                    .and_then(|word| word.parse::<f64>().ok())
                    .expect("a number")
            };
            let value = number();
            let count = value as usize;
            match name {
                "frame" => assert_eq!(value, FRAME),
                "frames" => model.frames = count,
                "gravity" => model.gravity = value,
                "damping" => model.damping = value,
                "young" => model.young = value,
                "poisson" => model.poisson = value,
                "stiffness" => model.stiffness = value,
                "nodes" => {
                    for _ in 0..count {
                        model.positions.push([number(), number(), number()]);
                        model.masses.push(number());
                    }
                }
                "pinned" => model.pinned = (0..count).map(|_| number() as usize).collect(),
                "tetrahedra" => {
                    model.tetrahedra = (0..count)
                        .map(|_| {
                            [
                                number() as usize,
                                number() as usize,
                                number() as usize,
                                number() as usize,
                            ]
                        })
                        .collect()
                }
                "triangles" => {
                    model.triangles = (0..count)
                        .map(|_| [number() as usize, number() as usize, number() as usize])
                        .collect()
                }
                "ball" => {
                    model.ball = Some(Ball {
                        center: [number(), number(), number()],
                        radius: number(),
                        speed: number(),
                    });
                }
                "floor" => model.has_floor = true,
                "friction" => model.friction = value,
                "bodies" => model.bodies = count,
                "springs" => model.springs = (0..count).map(|_| [number() as usize, number() as usize]).collect(),
                other => panic!("{other} is no section of a model"),
            }
        }
        model
    }

    /// Whether there is anything to meet.
    pub fn has_contact(&self) -> bool {
        self.ball.is_some() || self.has_floor || self.body_count() > 1
    }

    /// Whether a law is one that this model can have.
    pub fn has(&self, law: Law) -> bool {
        self.tetrahedra.is_empty() == (law == Law::Springs)
    }
}
