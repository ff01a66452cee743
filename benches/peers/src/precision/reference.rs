//! The reference that belongs to no engine: leapfrog in double precision, its step halved until the motion stays.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::Path;

use glam::{DMat3, DVec3};

use crate::precision::law::Law;
use crate::precision::model::{FRAME, Model};
use crate::precision::motion::{Motion, relative_difference};

/// A reference may differ by this part of the motion from the one of twice its step.
const SURE: f64 = 3e-5;

/// No more substeps per frame are tried.
const MOST_SUBSTEPS: usize = 2048;

/// A converged motion.
pub struct Reference {
    pub motion: Motion,
    /// Its difference from the motion with twice the step, as a part of the motion. Its own error is some third of that, as
    /// the method is of second order.
    pub doubt: f64,
    pub substeps: usize,
}

/// The motion of a model under a law; `None` where no step is short enough. It is kept in `folder` for the next run.
pub fn converged(model: &Model, law: Law, folder: &Path) -> Option<Reference> {
    let mut hasher = DefaultHasher::new();
    (model.text(), law, SURE.to_bits()).hash(&mut hasher);
    let file = folder.join(format!("{:016x}.reference", hasher.finish()));
    if let Some(kept) = read(&file, model) {
        return Some(kept);
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

/// A model as its forces need it.
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
    /// The inverse of the matrix of its edges at rest.
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

    /// Of each node.
    pub fn masses(&self) -> &[f64] {
        &self.masses
    }

    /// Whether nothing holds a node.
    pub fn is_free(&self, node: usize) -> bool {
        self.is_free[node]
    }

    /// Of all nodes, N.
    pub fn weight(&self) -> f64 {
        self.masses.iter().sum::<f64>() * self.gravity.length()
    }

    /// Elastic forces and weight.
    pub fn forces(&self, positions: &[DVec3], forces: &mut [DVec3]) {
        for (force, mass) in forces.iter_mut().zip(&self.masses) {
            *force = self.gravity * *mass;
        }
        for &([a, b], rest) in &self.springs {
            let way = positions[b] - positions[a];
            let pull = way * (self.stiffness * (1.0 - rest / way.length()));
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

    /// All frames with so many substeps each: half a kick, damping, drift, half a kick. `None` where it leaves the numbers.
    fn motion(&self, substeps: usize) -> Option<Motion> {
        let step = FRAME / substeps as f64;
        let kept = (-0.5 * self.damping * step).exp();
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
                        velocities[node] *= kept;
                        positions[node] += velocities[node] * step;
                    }
                }
                self.forces(&positions, &mut forces);
                for node in 0..positions.len() {
                    velocities[node] *= kept;
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
