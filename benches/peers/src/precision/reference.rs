//! The engine-independent reference: leapfrog in double precision, with its step halved until the motion converges.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::Path;

use glam::{DMat3, DVec3};

use crate::precision::law::Law;
use crate::precision::model::{FRAME, Model};
use crate::precision::motion::{Motion, relative_difference};

/// The largest relative difference of a reference from the motion with twice the step.
const SURE: f64 = 3e-5;

/// The maximum number of substeps per frame.
const MOST_SUBSTEPS: usize = 2048;

/// A converged motion.
pub struct Reference {
    pub motion: Motion,
    /// Its relative difference from the motion with twice the step. Its own error is about a third of that, as the
    /// method is second-order accurate.
    pub doubt: f64,
    pub substeps: usize,
}

/// The converged motion of a model under a law; `None` if no step is short enough. It is cached in `folder`.
pub fn converged(model: &Model, law: Law, folder: &Path) -> Option<Reference> {
    let mut hasher = DefaultHasher::new();
    (model.text(), law, SURE.to_bits()).hash(&mut hasher);
    let file = folder.join(format!("{:016x}.reference", hasher.finish()));
    if let Some(cached) = read(&file, model) {
        return Some(cached);
    }
    let mut coarse: Option<Motion> = None;
    let mut substeps = 16;
    while substeps <= MOST_SUBSTEPS {
        let fine = System::new(model, law).motion(substeps);
        if let (Some(coarse), Some(fine)) = (&coarse, &fine) {
            let doubt = relative_difference(coarse, fine);
            if doubt < SURE || 2 * substeps > MOST_SUBSTEPS {
                let reference = Reference {
                    motion: fine.clone(),
                    doubt,
                    substeps,
                };
                write(&file, &reference);
                return Some(reference);
            }
        }
        coarse = fine;
        substeps *= 2;
    }
    None
}

fn read(file: &Path, model: &Model) -> Option<Reference> {
    let bytes = std::fs::read(file).ok()?;
    let numbers: Vec<f64> = bytes
        .chunks_exact(8)
        .map(|chunk| f64::from_le_bytes(chunk.try_into().expect("eight bytes")))
        .collect();
    let (head, positions) = numbers.split_at_checked(2)?;
    let motion = Motion::from_numbers(positions, model);
    (motion.frames.len() == model.frames).then(|| Reference {
        motion,
        doubt: head[0],
        substeps: head[1] as usize,
    })
}

fn write(file: &Path, reference: &Reference) {
    let head = [reference.doubt, reference.substeps as f64];
    let positions = reference.motion.frames.iter().flatten().flatten();
    let bytes: Vec<u8> = head
        .iter()
        .chain(positions)
        .flat_map(|number| number.to_le_bytes())
        .collect();
    if let Err(error) = std::fs::write(file, bytes) {
        eprintln!("{}: {error}", file.display());
    }
}

/// A model in the form that its forces need.
pub struct System {
    law: Law,
    mu: f64,
    lambda: f64,
    tetrahedra: Vec<Tetrahedron>,
    springs: Vec<([usize; 2], f64)>,
    stiffness: f64,
    gravity: DVec3,
    damping: f64,
    masses: Vec<f64>,
    start: Vec<DVec3>,
    is_free: Vec<bool>,
    frames: usize,
}

struct Tetrahedron {
    corners: [usize; 4],
    /// The inverse of the edge matrix at rest.
    inverse: DMat3,
    volume: f64,
}

impl System {
    pub fn new(model: &Model, law: Law) -> Self {
        let (mu, lambda) = model.lame();
        let start: Vec<DVec3> = model.positions.iter().copied().map(DVec3::from).collect();
        let tetrahedra = model.tetrahedra.iter().map(|&corners| {
            let edges = edges(&start, corners);
            Tetrahedron {
                corners,
                inverse: edges.inverse(),
                volume: edges.determinant() / 6.0,
            }
        });
        let length = |&[a, b]: &[usize; 2]| ([a, b], start[a].distance(start[b]));
        let mut is_free = vec![true; start.len()];
        for &node in &model.pinned {
            is_free[node] = false;
        }
        Self {
            law,
            mu,
            lambda,
            tetrahedra: tetrahedra.collect(),
            springs: model.springs.iter().map(length).collect(),
            stiffness: model.stiffness,
            gravity: DVec3::new(0.0, -model.gravity, 0.0),
            damping: model.damping,
            masses: model.masses.clone(),
            is_free,
            frames: model.frames,
            start,
        }
    }

    /// The mass of each node.
    pub fn masses(&self) -> &[f64] {
        &self.masses
    }

    /// True if a node is not pinned.
    pub fn is_free(&self, node: usize) -> bool {
        self.is_free[node]
    }

    /// The weight of all nodes [N].
    pub fn weight(&self) -> f64 {
        self.masses.iter().sum::<f64>() * self.gravity.length()
    }

    /// Computes elastic forces and weight.
    pub fn forces(&self, positions: &[DVec3], forces: &mut [DVec3]) {
        for (force, mass) in forces.iter_mut().zip(&self.masses) {
            *force = self.gravity * *mass;
        }
        for &([a, b], rest) in &self.springs {
            let offset = positions[b] - positions[a];
            let pull = offset * (self.stiffness * (1.0 - rest / offset.length()));
            forces[a] += pull;
            forces[b] -= pull;
        }
        for Tetrahedron {
            corners,
            inverse,
            volume,
        } in &self.tetrahedra
        {
            let deformation = edges(positions, *corners) * *inverse;
            let stress = self.law.stress(deformation, self.mu, self.lambda);
            let force = stress * inverse.transpose() * -*volume;
            let [a, b, c, d] = *corners;
            forces[b] += force.x_axis;
            forces[c] += force.y_axis;
            forces[d] += force.z_axis;
            forces[a] -= force.x_axis + force.y_axis + force.z_axis;
        }
    }

    /// All frames with this many substeps each: half a kick, damping, drift, half a kick. `None` if it diverges.
    fn motion(&self, substeps: usize) -> Option<Motion> {
        let step = FRAME / substeps as f64;
        let damping_factor = (-0.5 * self.damping * step).exp();
        let mut positions = self.start.clone();
        let mut velocities = vec![DVec3::ZERO; positions.len()];
        let mut forces = velocities.clone();
        let mut frames = Vec::with_capacity(self.frames);
        self.forces(&positions, &mut forces);
        for _ in 0..self.frames {
            for _ in 0..substeps {
                for node in 0..positions.len() {
                    if self.is_free[node] {
                        velocities[node] += forces[node] * (0.5 * step / self.masses[node]);
                        velocities[node] *= damping_factor;
                        positions[node] += velocities[node] * step;
                    }
                }
                self.forces(&positions, &mut forces);
                for node in 0..positions.len() {
                    velocities[node] *= damping_factor;
                    velocities[node] += forces[node] * (0.5 * step / self.masses[node]);
                }
            }
            let reach = positions.iter().map(|position| position.length()).sum::<f64>();
            if reach.is_nan() || reach >= 1e3 * positions.len() as f64 {
                return None;
            }
            frames.push(positions.iter().map(DVec3::to_array).collect());
        }
        Some(Motion::new(self.start.iter().map(DVec3::to_array).collect(), frames))
    }
}

fn edges(positions: &[DVec3], [a, b, c, d]: [usize; 4]) -> DMat3 {
    let origin = positions[a];
    DMat3::from_cols(positions[b] - origin, positions[c] - origin, positions[d] - origin)
}
