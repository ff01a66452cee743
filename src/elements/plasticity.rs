//! Plasticity of tetrahedra: permanent stresses that remain after a deformation beyond the yield strain.
//!
//! Perfect von Mises plasticity (Simo, Hughes 1998, section 3.3, with S and E instead of small strains): with sigma
//! the yield stress of a rod, the deviatoric part of S has a norm of at most sqrt(2/3) sigma. Radial return removes
//! the excess permanently. Volume does not yield.

use glam::{DMat3, DVec3};

use super::law::ElasticLaw;
use super::tetrahedra::{GROUP, Stresses};
use crate::base::{Result, memory, trace};
use crate::codec::saved;
use crate::def::Yielding;
use crate::simd::{ChosenKernel, Loops};

/// The plastic stresses of the tetrahedra of a part; they are added to the elastic stresses.
#[derive(Debug)]
pub(super) struct PlasticStresses {
    stresses: Vec<Stresses>,
    committed: Vec<Stresses>,
    /// The plastic plus the branch stresses.
    pub extra: Vec<Stresses>,
}

saved! { PlasticStresses { stresses, committed, extra } }

/// Norms of deviatoric stresses, Pa: at yield, and the largest plastic stress.
#[derive(Clone, Copy, Debug)]
pub(super) struct YieldLimits {
    yield_norm: f32,
    largest_norm: f32,
}

saved! { YieldLimits { yield_norm, largest_norm } }

impl YieldLimits {
    pub fn new(law: ElasticLaw, yielding: Yielding) -> Self {
        let (mu, lambda) = (f64::from(law.mu), f64::from(law.lambda) + f64::from(law.kappa));
        let young_modulus = mu * (3.0 * lambda + 2.0 * mu) / (lambda + mu);
        let factor = (2.0_f64 / 3.0).sqrt();
        Self {
            yield_norm: (factor * young_modulus * f64::from(yielding.strain)) as f32,
            // A rod with a plastic elongation e of constant volume has a deviatoric strain of norm sqrt(3/2) e.
            largest_norm: (2.0 * mu * f64::from(yielding.largest) / factor) as f32,
        }
    }
}

impl PlasticStresses {
    pub fn new(count: usize) -> Result<Self> {
        let zeros = || memory::filled(Stresses::ZERO, count);
        Ok(Self {
            stresses: zeros()?,
            committed: zeros()?,
            extra: zeros()?,
        })
    }

    /// All stored stresses.
    pub fn fields_mut(&mut self) -> [&mut [Stresses]; 3] {
        [&mut self.stresses, &mut self.committed, &mut self.extra]
    }

    /// Updates the plastic stresses for these elastic stresses.
    pub fn flow(&mut self, kernel: ChosenKernel, limits: YieldLimits, elastic: &[Stresses]) {
        let plastic = &mut self.stresses;
        kernel.run(Flow {
            limits,
            plastic,
            elastic,
        });
    }

    /// True if a tetrahedron with this elastic stress would yield, by more than rounding errors.
    pub fn yields(&self, limits: YieldLimits, [group, lane]: [usize; 2], elastic: DMat3) -> bool {
        const ROUNDING: f64 = 1e-5;
        let mut plastic = [[0.0; GROUP]; 6];
        deviators(&self.stresses[group].0, &mut plastic);
        let [xx, xy, xz, yy, yz, zz] = plastic.map(|entries| f64::from(entries[lane]));
        let plastic = DMat3::from_cols_array(&[xx, xy, xz, xy, yy, yz, xz, yz, zz]);
        let mean = trace(&elastic) / 3.0;
        let total = elastic + plastic - DMat3::from_diagonal(DVec3::splat(mean));
        let square: f64 = total.to_cols_array().iter().map(|entry| entry * entry).sum();
        square.sqrt() > f64::from(limits.yield_norm) * (1.0 + ROUNDING)
    }

    /// Sets the extra stresses to the plastic plus the branch stresses; `branches` may be empty.
    pub fn combine(&mut self, branches: &[Stresses]) {
        self.extra.copy_from_slice(&self.stresses);
        for (Stresses(extra), Stresses(branch)) in self.extra.iter_mut().zip(branches) {
            let values = extra.as_flattened_mut().iter_mut().zip(branch.as_flattened());
            values.for_each(|(extra, branch)| *extra += branch);
        }
    }

    pub fn restore(&mut self) {
        self.stresses.copy_from_slice(&self.committed);
    }

    pub fn commit(&mut self) {
        self.committed.copy_from_slice(&self.stresses);
    }

    pub fn committed(&self) -> &[Stresses] {
        &self.committed
    }

    /// The change of a tetrahedron's energy density by its plastic stress, for its elastic stress, Pa.
    pub fn energy(&self, law: ElasticLaw, [group, lane]: [usize; 2], elastic: DMat3) -> f64 {
        let mut plastic = [[0.0; GROUP]; 6];
        deviators(&self.stresses[group].0, &mut plastic);
        let [xx, xy, xz, yy, yz, zz] = plastic.map(|entries| f64::from(entries[lane]));
        let (x, y, z) = (elastic.x_axis, elastic.y_axis, elastic.z_axis);
        let diagonal = xx * (2.0 * x.x + xx) + yy * (2.0 * y.y + yy) + zz * (2.0 * z.z + zz);
        let off_diagonal = xy * (2.0 * x.y + xy) + xz * (2.0 * x.z + xz) + yz * (2.0 * y.z + yz);
        (diagonal + 2.0 * off_diagonal) / (4.0 * f64::from(law.mu))
    }
}

/// The radial return of stresses beyond the yield surface.
struct Flow<'a> {
    limits: YieldLimits,
    plastic: &'a mut [Stresses],
    elastic: &'a [Stresses],
}

impl Loops for Flow<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let YieldLimits {
            yield_norm,
            largest_norm,
        } = self.limits;
        for (Stresses(plastic), Stresses(elastic)) in self.plastic.iter_mut().zip(self.elastic) {
            let (mut plastic_deviator, mut total) = ([[0.0; GROUP]; 6], [[0.0; GROUP]; 6]);
            deviators(plastic, &mut plastic_deviator);
            deviators(elastic, &mut total);
            for (total, plastic_deviator) in total.as_flattened_mut().iter_mut().zip(plastic_deviator.as_flattened()) {
                *total += plastic_deviator;
            }
            let mut excess = [0.0; GROUP];
            norms(&total, &mut excess);
            let mut max_excess = 0.0_f32;
            for excess in &mut excess {
                // Not for infinity or NaN.
                *excess = if *excess > yield_norm && *excess < f32::INFINITY {
                    1.0 - yield_norm / *excess
                } else {
                    0.0
                };
                max_excess = max_excess.max(*excess);
            }
            if max_excess == 0.0 {
                continue;
            }
            for (plastic_deviator, total) in plastic_deviator.iter_mut().zip(&total) {
                for lane in 0..GROUP {
                    plastic_deviator[lane] -= excess[lane] * total[lane];
                }
            }
            let mut scales = [0.0; GROUP];
            norms(&plastic_deviator, &mut scales);
            for scale in &mut scales {
                *scale = (largest_norm / *scale).min(1.0);
            }
            for (plastic, after) in plastic.iter_mut().zip(&plastic_deviator) {
                for lane in 0..GROUP {
                    plastic[lane] = if excess[lane] > 0.0 {
                        after[lane] * scales[lane]
                    } else {
                        plastic[lane]
                    };
                }
            }
        }
    }
}

/// Computes the deviatoric stresses.
#[inline(always)]
fn deviators(stresses: &[[f32; GROUP]; 7], deviators: &mut [[f32; GROUP]; 6]) {
    let [xx, xy, xz, yy, yz, zz, _] = stresses;
    for lane in 0..GROUP {
        let mean = (xx[lane] + yy[lane] + zz[lane]) / 3.0;
        deviators[0][lane] = xx[lane] - mean;
        deviators[1][lane] = xy[lane];
        deviators[2][lane] = xz[lane];
        deviators[3][lane] = yy[lane] - mean;
        deviators[4][lane] = yz[lane];
        deviators[5][lane] = zz[lane] - mean;
    }
}

#[inline(always)]
fn norms([xx, xy, xz, yy, yz, zz]: &[[f32; GROUP]; 6], norms: &mut [f32; GROUP]) {
    for lane in 0..GROUP {
        let diagonal = xx[lane] * xx[lane] + yy[lane] * yy[lane] + zz[lane] * zz[lane];
        let off_diagonal = xy[lane] * xy[lane] + xz[lane] * xz[lane] + yz[lane] * yz[lane];
        norms[lane] = (diagonal + 2.0 * off_diagonal).sqrt();
    }
}
