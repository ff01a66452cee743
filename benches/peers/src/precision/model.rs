//! What every engine simulates: nodes, tetrahedra or springs, and their material, as a file that players in any language
//! read.

use std::fmt::Write;

use crate::precision::law::Law;
use crate::scenes::Block;

/// Frames are of this length, s.
pub const FRAME: f64 = 1.0 / 60.0;

/// A rigid ball that stays where it is, without friction.
#[derive(Clone, Copy, Debug)]
pub struct Ball {
    pub center: [f64; 3],
    pub radius: f64,
}

impl Ball {
    /// How deep a point is inside, m; below 0 outside.
    pub fn depth(&self, point: [f64; 3]) -> f64 {
        self.radius - glam::DVec3::from(point).distance(self.center.into())
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
    /// The surface of what meets the ball.
    pub triangles: Vec<[usize; 3]>,
    /// What stands in the way.
    pub ball: Option<Ball>,
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
        if let Some(Ball {
            center: [x, y, z],
            radius,
        }) = self.ball
        {
            let _ = writeln!(text, "triangles {}", self.triangles.len());
            for [a, b, c] in &self.triangles {
                let _ = writeln!(text, "{a} {b} {c}");
            }
            let _ = writeln!(text, "ball 1\n{x} {y} {z} {radius}");
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
                    });
                }
                "springs" => model.springs = (0..count).map(|_| [number() as usize, number() as usize]).collect(),
                other => panic!("{other} is no section of a model"),
            }
        }
        model
    }

    /// Whether a law is one that this model can have.
    pub fn has(&self, law: Law) -> bool {
        self.tetrahedra.is_empty() == (law == Law::Springs)
    }
}
