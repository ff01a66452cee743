//! Tetrahedra that yield: stresses that are left where they are deformed beyond a strain, and stay.
//!
//! Perfect plasticity of von Mises: with sigma the stress of a rod at the yield strain, the part of S that only changes shape is at most
//! sqrt(2/3) sigma long; what is beyond it is taken off for good, along itself (Simo, Hughes 1998, section 3.3, with S and E for small
//! strains). Volume does not yield.

use glam::{DMat3, DVec3};

use super::law::Law;
use super::tetrahedra::{GROUP, Stresses};
use crate::base::{Result, memory, trace};
use crate::codec::saved;
use crate::def::Yielding;
use crate::simd::{ChosenKernel, Loops};

/// What is left of stresses in the tetrahedra of a part.
#[derive(Debug)]
pub(super) struct PlasticSet {
    stresses: Vec<Stresses>,
    kept: Vec<Stresses>,
    /// With those of arms.
    pub loads: Vec<Stresses>,
}

saved! { PlasticSet { stresses, kept, loads } }

/// The lengths of stresses, Pa: that at which they yield, and the longest that may be left.
#[derive(Clone, Copy, Debug)]
pub(super) struct YieldBounds {
    yields: f32,
    longest: f32,
}

saved! { YieldBounds { yields, longest } }

impl YieldBounds {
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

impl PlasticSet {
    pub fn new(count: usize) -> Result<Self> {
        let zeros = || memory::filled(Stresses::ZERO, count);
        Ok(Self {
            stresses: zeros()?,
            kept: zeros()?,
            loads: zeros()?,
        })
    }

    /// All that is left.
    pub fn fields_mut(&mut self) -> [&mut [Stresses]; 3] {
        [&mut self.stresses, &mut self.kept, &mut self.loads]
    }

    /// What is elastic has become this without anything left.
    pub fn flow(&mut self, kernel: ChosenKernel, bounds: YieldBounds, elastic: &[Stresses]) {
        let left = &mut self.stresses;
        kernel.run(Flow { bounds, left, elastic });
    }

    /// Whether a tetrahedron would yield where this is elastic, by more than rounding makes of it.
    pub fn yields(&self, bounds: YieldBounds, [group, lane]: [usize; 2], elastic: DMat3) -> bool {
        const ROUNDING: f64 = 1e-5;
        let mut left = [[0.0; GROUP]; 6];
        shapes(&self.stresses[group].0, &mut left);
        let [xx, xy, xz, yy, yz, zz] = left.map(|entries| f64::from(entries[lane]));
        let left = DMat3::from_cols_array(&[xx, xy, xz, xy, yy, yz, xz, yz, zz]);
        let mean = trace(&elastic) / 3.0;
        let whole = elastic + left - DMat3::from_diagonal(DVec3::splat(mean));
        let square: f64 = whole.to_cols_array().iter().map(|entry| entry * entry).sum();
        square.sqrt() > f64::from(bounds.yields) * (1.0 + ROUNDING)
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
        let mut left = [[0.0; GROUP]; 6];
        shapes(&self.stresses[group].0, &mut left);
        let [xx, xy, xz, yy, yz, zz] = left.map(|entries| f64::from(entries[lane]));
        let (x, y, z) = (elastic.x_axis, elastic.y_axis, elastic.z_axis);
        let along = xx * (2.0 * x.x + xx) + yy * (2.0 * y.y + yy) + zz * (2.0 * z.z + zz);
        let across = xy * (2.0 * x.y + xy) + xz * (2.0 * x.z + xz) + yz * (2.0 * y.z + yz);
        (along + 2.0 * across) / (4.0 * f64::from(law.mu))
    }
}

/// Takes off for good what is beyond the yield stress.
struct Flow<'a> {
    bounds: YieldBounds,
    left: &'a mut [Stresses],
    elastic: &'a [Stresses],
}

impl Loops for Flow<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let YieldBounds { yields, longest } = self.bounds;
        for (Stresses(left), Stresses(elastic)) in self.left.iter_mut().zip(self.elastic) {
            let (mut before, mut whole) = ([[0.0; GROUP]; 6], [[0.0; GROUP]; 6]);
            shapes(left, &mut before);
            shapes(elastic, &mut whole);
            for (whole, before) in whole.as_flattened_mut().iter_mut().zip(before.as_flattened()) {
                *whole += before;
            }
            let mut beyond = [0.0; GROUP];
            lengths(&whole, &mut beyond);
            let mut most = 0.0_f32;
            for beyond in &mut beyond {
                // Nothing where it is not a number.
                *beyond = if *beyond > yields && *beyond < f32::INFINITY {
                    1.0 - yields / *beyond
                } else {
                    0.0
                };
                most = most.max(*beyond);
            }
            if most == 0.0 {
                continue;
            }
            for (before, whole) in before.iter_mut().zip(&whole) {
                for lane in 0..GROUP {
                    before[lane] -= beyond[lane] * whole[lane];
                }
            }
            let mut shortened = [0.0; GROUP];
            lengths(&before, &mut shortened);
            for shortened in &mut shortened {
                *shortened = (longest / *shortened).min(1.0);
            }
            for (left, after) in left.iter_mut().zip(&before) {
                for lane in 0..GROUP {
                    left[lane] = if beyond[lane] > 0.0 {
                        after[lane] * shortened[lane]
                    } else {
                        left[lane]
                    };
                }
            }
        }
    }
}

/// The parts of stresses that change shape alone.
#[inline(always)]
fn shapes(stresses: &[[f32; GROUP]; 7], shapes: &mut [[f32; GROUP]; 6]) {
    let [xx, xy, xz, yy, yz, zz, _] = stresses;
    for lane in 0..GROUP {
        let mean = (xx[lane] + yy[lane] + zz[lane]) / 3.0;
        shapes[0][lane] = xx[lane] - mean;
        shapes[1][lane] = xy[lane];
        shapes[2][lane] = xz[lane];
        shapes[3][lane] = yy[lane] - mean;
        shapes[4][lane] = yz[lane];
        shapes[5][lane] = zz[lane] - mean;
    }
}

#[inline(always)]
fn lengths([xx, xy, xz, yy, yz, zz]: &[[f32; GROUP]; 6], lengths: &mut [f32; GROUP]) {
    for lane in 0..GROUP {
        let along = xx[lane] * xx[lane] + yy[lane] * yy[lane] + zz[lane] * zz[lane];
        let across = xy[lane] * xy[lane] + xz[lane] * xz[lane] + yz[lane] * yz[lane];
        lengths[lane] = (along + 2.0 * across).sqrt();
    }
}
