//! Tetrahedra that yield: stresses that are left where they are deformed beyond a strain, and stay.
//!
//! Perfect plasticity of von Mises: with sigma the stress of a rod at the yield strain, the part of S that only changes shape is at most
//! sqrt(2/3) sigma long; what is beyond it is taken off for good, along itself (Simo, Hughes 1998, section 3.3, with S and E for small
//! strains). Volume does not yield.

use glam::DMat3;

use super::law::Law;
use crate::error::Result;
use crate::material::Yielding;
use crate::memory;
use crate::springs::{GROUP, Stresses};

/// What is left of stresses in the tetrahedra of a part.
#[derive(Debug)]
pub(super) struct Set {
    stresses: Vec<Stresses>,
    kept: Vec<Stresses>,
    /// With those of arms.
    pub loads: Vec<Stresses>,
}

/// The lengths of stresses, Pa: that at which they yield, and the longest that may be left.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    yields: f32,
    longest: f32,
}

impl Bounds {
    pub fn new(law: Law, yielding: Yielding) -> Self {
        let (mu, lambda) = (f64::from(law.mu), f64::from(law.lambda) + f64::from(law.kappa));
        let young_modulus = mu * (3.0 * lambda + 2.0 * mu) / (lambda + mu);
        let part = (2.0_f64 / 3.0).sqrt();
        Self {
            yields: (part * young_modulus * f64::from(yielding.strain)) as f32,
            // A rod that is longer by some strain for good, of the same volume, has sqrt(3/2) of it in all.
            longest: (2.0 * mu * f64::from(yielding.largest) / part) as f32,
        }
    }
}

impl Set {
    pub fn new(count: usize) -> Result<Self> {
        let zeros = || memory::filled(Stresses::ZERO, count);
        Ok(Self {
            stresses: zeros()?,
            kept: zeros()?,
            loads: zeros()?,
        })
    }

    /// What is elastic has become this without anything left.
    pub fn flow(&mut self, bounds: Bounds, elastic: &[Stresses]) {
        for (Stresses(left), Stresses(elastic)) in self.stresses.iter_mut().zip(elastic) {
            for lane in 0..GROUP {
                let left_there = shape(left, lane);
                let elastic_there = shape(elastic, lane);
                let mut whole = left_there;
                whole.iter_mut().zip(elastic_there).for_each(|(sum, more)| *sum += more);
                let length = length(whole);
                // Not so where it is not a number.
                if !(length > bounds.yields && length.is_finite()) {
                    continue;
                }
                let excess = 1.0 - bounds.yields / length;
                let mut next = left_there;
                next.iter_mut()
                    .zip(whole)
                    .for_each(|(left, whole)| *left -= excess * whole);
                let longest = (bounds.longest / self::length(next)).min(1.0);
                for (left, next) in left.iter_mut().zip(next) {
                    left[lane] = next * longest;
                }
            }
        }
    }

    /// Adds to the loads of arms, of which there may be none, what is left.
    pub fn combine(&mut self, arms: &[Stresses]) {
        self.loads.copy_from_slice(&self.stresses);
        for (Stresses(load), Stresses(arm)) in self.loads.iter_mut().zip(arms) {
            let numbers = load.as_flattened_mut().iter_mut().zip(arm.as_flattened());
            numbers.for_each(|(load, arm)| *load += arm);
        }
    }

    pub fn recall(&mut self) {
        self.stresses.copy_from_slice(&self.kept);
    }

    pub fn keep(&mut self) {
        self.kept.copy_from_slice(&self.stresses);
    }

    pub fn kept(&self) -> &[Stresses] {
        &self.kept
    }

    /// What the energy of a tetrahedron per volume differs by because of what is left, given what is elastic without it, Pa.
    pub fn energy(&self, law: Law, [group, lane]: [usize; 2], elastic: DMat3) -> f64 {
        let [xx, xy, xz, yy, yz, zz] = shape(&self.stresses[group].0, lane).map(f64::from);
        let (x, y, z) = (elastic.x_axis, elastic.y_axis, elastic.z_axis);
        let along = xx * (2.0 * x.x + xx) + yy * (2.0 * y.y + yy) + zz * (2.0 * z.z + zz);
        let across = xy * (2.0 * x.y + xy) + xz * (2.0 * x.z + xz) + yz * (2.0 * y.z + yz);
        (along + 2.0 * across) / (4.0 * f64::from(law.mu))
    }
}

/// The part of a lane's stress that changes shape alone.
fn shape(stresses: &[[f32; GROUP]; 7], lane: usize) -> [f32; 6] {
    let [xx, xy, xz, yy, yz, zz, _] = stresses.map(|entries| entries[lane]);
    let mean = (xx + yy + zz) / 3.0;
    [xx - mean, xy, xz, yy - mean, yz, zz - mean]
}

fn length([xx, xy, xz, yy, yz, zz]: [f32; 6]) -> f32 {
    (xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + xz * xz + yz * yz)).sqrt()
}
