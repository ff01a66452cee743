//! The model that every engine simulates: nodes, tetrahedra or springs, and material. It is written to a file that
//! players in any language read.

use std::fmt::Write;

use crate::precision::law::Law;
use crate::scenes::Block;

/// Duration of a frame [s].
pub const FRAME: f64 = 1.0 / 60.0;

/// The collision margin of bodies [m].
pub const SKIN: f64 = 1e-3;

/// A rigid frictionless ball that moves down and then stops.
#[derive(Clone, Copy, Debug)]
pub struct Ball {
    /// Initial center [m].
    pub center: [f64; 3],
    pub radius: f64,
    /// Speed along -y over the first two thirds of the frames [m/s].
    pub speed: f64,
}

impl Ball {
    /// Its center after `passed` of `frames` frames.
    pub fn center_after(&self, passed: usize, frames: usize) -> [f64; 3] {
        let [x, y, z] = self.center;
        [x, y - self.speed * FRAME * passed.min(2 * frames / 3) as f64, z]
    }
}

/// The bodies of a scene, and their loads. Numbers are `f64`; engines round them as necessary.
#[derive(Clone, Debug, Default)]
pub struct Model {
    /// Initial positions [m].
    pub positions: Vec<[f64; 3]>,
    /// Masses [kg].
    pub masses: Vec<f64>,
    /// Pinned nodes, in ascending order.
    pub pinned: Vec<usize>,
    pub tetrahedra: Vec<[usize; 4]>,
    pub springs: Vec<[usize; 2]>,
    /// The surface of bodies with contact.
    pub triangles: Vec<[usize; 3]>,
    /// Number of equal bodies, stored one after the other; 0 means 1. They collide with each other.
    pub bodies: usize,
    /// A ball that is an obstacle.
    pub ball: Option<Ball>,
    /// True if the ground y = 0 is an obstacle.
    pub has_floor: bool,
    /// Friction of bodies with each other and with the ground.
    pub friction: f64,
    /// Stiffness of every spring [N/m]. Springs are at rest at the start.
    pub stiffness: f64,
    /// Young's modulus [Pa].
    pub young: f64,
    pub poisson: f64,
    /// Gravity along -y [m/s²].
    pub gravity: f64,
    /// Damping of a node over its mass [1/s].
    pub damping: f64,
    /// Number of simulated frames.
    pub frames: usize,
}

impl Model {
    /// Lamé's parameters mu and lambda.
    pub fn lame(&self) -> (f64, f64) {
        let Self { young, poisson, .. } = *self;
        let mu = young / (2.0 * (1.0 + poisson));
        (mu, young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson)))
    }

    /// A soft solid under its own weight for a second, with these pinned nodes, Young's modulus [Pa] and density
    /// [kg/m³].
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

    /// Distributes the mass of tetrahedra of this density [kg/m³] to the nodes.
    fn fill(&mut self, density: f64) {
        self.masses = vec![0.0; self.positions.len()];
        for corners in &self.tetrahedra {
            let [a, b, c, d] = corners.map(|node| glam::DVec3::from(self.positions[node]));
            let volume = (b - a).cross(c - a).dot(d - a) / 6.0;
            assert!(volume > 0.0, "tetrahedra are positively oriented");
            for &node in corners {
                self.masses[node] += 0.25 * density * volume;
            }
        }
    }

    /// Copies the body to each of these offsets.
    pub fn copied(self, offsets: &[[f64; 3]]) -> Self {
        let count = self.positions.len();
        let moved = |offset: &[f64; 3]| {
            let offset = *offset;
            let positions = self.positions.iter();
            positions.map(move |start| std::array::from_fn(|axis| start[axis] + offset[axis]))
        };
        fn shifted<const N: usize>(elements: &[[usize; N]], count: usize, bodies: usize) -> Vec<[usize; N]> {
            let of_body = |body| elements.iter().map(move |nodes| nodes.map(|node| node + body * count));
            (0..bodies).flat_map(of_body).collect()
        }
        Self {
            positions: offsets.iter().flat_map(moved).collect(),
            masses: self.masses.repeat(offsets.len()),
            tetrahedra: shifted(&self.tetrahedra, count, offsets.len()),
            triangles: shifted(&self.triangles, count, offsets.len()),
            bodies: offsets.len(),
            ..self
        }
    }

    /// Number of bodies.
    pub fn body_count(&self) -> usize {
        self.bodies.max(1)
    }

    /// One of the bodies.
    pub fn body(&self, index: usize) -> Self {
        fn slice<T>(all: &[T], index: usize, count: usize) -> &[T] {
            let size = all.len() / count;
            &all[index * size..(index + 1) * size]
        }
        let count = self.body_count();
        let first = index * self.positions.len() / count;
        Self {
            positions: slice(&self.positions, index, count).to_vec(),
            masses: slice(&self.masses, index, count).to_vec(),
            tetrahedra: slice(&self.tetrahedra, index, count)
                .iter()
                .map(|nodes| nodes.map(|node| node - first))
                .collect(),
            triangles: slice(&self.triangles, index, count)
                .iter()
                .map(|nodes| nodes.map(|node| node - first))
                .collect(),
            bodies: 1,
            ..self.clone()
        }
    }

    /// The text of the file: words and numbers, each section preceded by its name and count.
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

    /// Parses the text of [`Model::text`].
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

    /// True if there is any contact.
    pub fn has_contact(&self) -> bool {
        self.ball.is_some() || self.has_floor || self.body_count() > 1
    }

    /// True if this model supports the law.
    pub fn has(&self, law: Law) -> bool {
        self.tetrahedra.is_empty() == (law == Law::Springs)
    }
}
