//! Energies, second derivatives and reports of cavities, computed in `f64` from the positions.

use glam::{DMat3, DVec3};

use super::{Cavities, Cavity, cavity_pressure};
use crate::base::{cross_matrix, outer};
use crate::def::EnclosedReport;

/// A vector for each node: its position or its displacement.
pub(crate) type PositionVectors<'a> = &'a dyn Fn(usize) -> DVec3;

/// Nodes, and the parts of triangles in the derivative of a volume with respect to their positions, m².
pub(crate) type VolumeGradients<'a> = &'a mut dyn Iterator<Item = (usize, DVec3)>;

impl Cavities {
    /// The cavities that are closed.
    fn closed_cavities(&self) -> impl Iterator<Item = &Cavity> {
        self.cavities.iter().filter(|cavity| !cavity.is_open)
    }

    fn triangles(&self, cavity: &Cavity) -> &[[u32; 3]] {
        &self.surface.triangles[cavity.triangles[0] as usize..cavity.triangles[1] as usize]
    }

    /// The volume stiffness: kappa over the rest volume, Pa/m³.
    fn volume_stiffness(&self, cavity: &Cavity) -> f64 {
        f64::from(self.stiffness) / cavity.rest_volume
    }

    fn volume(&self, cavity: &Cavity, at: PositionVectors) -> f64 {
        let triangles = self.triangles(cavity);
        let apex = at(triangles[0][0] as usize);
        let volumes = triangles.iter().map(|corners| {
            let [a, b, c] = corners.map(|node| at(node as usize));
            (a - apex).dot((b - a).cross(c - a))
        });
        volumes.sum::<f64>() / 6.0
    }

    /// The pressure of a cavity, Pa.
    fn pressure_in(&self, cavity: &Cavity, at: PositionVectors) -> f64 {
        cavity_pressure(self.stiffness, self.pressure, cavity, self.volume(cavity, at))
    }

    /// The elastic energy of volume changes, and the work that the constant pressure has done, J.
    pub fn energy(&self, at: PositionVectors) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for cavity in self.closed_cavities() {
            let volume_change = self.volume(cavity, at) - cavity.rest_volume;
            sums[0] += 0.5 * self.volume_stiffness(cavity) * volume_change * volume_change;
            sums[1] += f64::from(self.pressure) * volume_change;
        }
        sums
    }

    /// The total volumes, and the mean pressure weighted by rest volume.
    pub fn report(&self, at: PositionVectors) -> EnclosedReport {
        let mut report = EnclosedReport::default();
        for cavity in self.closed_cavities() {
            report.cavity_count += 1;
            report.volume += self.volume(cavity, at);
            report.rest_volume += cavity.rest_volume;
            report.pressure += self.pressure_in(cavity, at) * cavity.rest_volume;
        }
        if report.cavity_count > 0 {
            report.pressure /= report.rest_volume;
        }
        report
    }

    /// Calls `f` with each triangle of the closed cavities.
    pub fn visit_triangles(&self, f: &mut dyn FnMut([u32; 3])) {
        for cavity in self.closed_cavities() {
            self.triangles(cavity).iter().for_each(|&corners| f(corners));
        }
    }

    /// Calls `f` with the force of each triangle on each of its nodes, N.
    pub fn visit_forces(&self, at: PositionVectors, f: &mut dyn FnMut(usize, DVec3)) {
        for cavity in self.closed_cavities() {
            let pressure = self.pressure_in(cavity, at);
            self.gradients(cavity, at)
                .for_each(|(node, gradient)| f(node, gradient * pressure));
        }
    }

    /// The parts of each triangle in the gradient of a cavity's volume, m².
    fn gradients(&self, cavity: &Cavity, at: PositionVectors) -> impl Iterator<Item = (usize, DVec3)> {
        self.triangles(cavity).iter().flat_map(move |corners| {
            let nodes = corners.map(|node| node as usize);
            let [a, b, c] = nodes.map(at);
            let gradient = (b - a).cross(c - a) / 6.0;
            nodes.map(|node| (node, gradient))
        })
    }

    /// Calls `f` with the exact changes of energy for the displacements `displacement`, J. Computed without
    /// cancellation.
    pub fn visit_changes(&self, at: PositionVectors, displacement: PositionVectors, f: &mut dyn FnMut(f64)) {
        for cavity in self.closed_cavities() {
            let first = self.triangles(cavity)[0][0] as usize;
            let (apex, apex_displacement) = (at(first), displacement(first));
            let mut change = 0.0;
            for &corners in self.triangles(cavity) {
                let nodes = corners.map(|node| node as usize);
                let ([a, b, c], [da, db, dc]) = (nodes.map(at), nodes.map(displacement));
                let ([ab, ac], [dab, dac]) = ([b - a, c - a], [db - da, dc - da]);
                let vector_change = dab.cross(ac) + ab.cross(dac) + dab.cross(dac);
                change += (da - apex_displacement).dot(ab.cross(ac) + vector_change) + (a - apex).dot(vector_change);
            }
            change /= 6.0;
            // Two calls, because the two changes can nearly cancel at rest.
            let volume_change = self.volume(cavity, at) - cavity.rest_volume;
            f(self.volume_stiffness(cavity) * change * (volume_change + 0.5 * change));
            f(-f64::from(self.pressure) * change);
        }
    }

    /// Calls `f` with the stiffness block of pressure for each pair of nodes of each triangle, N/m. Diagonal blocks
    /// are 0.
    pub fn visit_blocks(&self, at: PositionVectors, f: &mut dyn FnMut([u32; 2], DMat3)) {
        for cavity in self.closed_cavities() {
            let pressure = self.pressure_in(cavity, at);
            for &[a, b, c] in self.triangles(cavity) {
                for [a, b, c] in [[a, b, c], [b, c, a], [c, a, b]] {
                    let [from, to, opposite] = [a, b, c].map(|node| at(node as usize));
                    // The midpoint of the edge cancels with that of the adjacent triangle.
                    let arm = (opposite - (from + to) * 0.5) * (pressure / 6.0);
                    let block = cross_matrix(arm);
                    f([a, b], block);
                }
            }
        }
    }

    /// Calls `f` with the product of `kappa/V0 g g^T` and `vectors` at each node.
    pub fn visit_products(&self, at: PositionVectors, vectors: &[DVec3], f: &mut dyn FnMut(usize, DVec3)) {
        for cavity in self.closed_cavities().filter(|_| self.stiffness > 0.0) {
            let volume_changes = self
                .gradients(cavity, at)
                .map(|(node, gradient)| gradient.dot(vectors[node]));
            let change = self.volume_stiffness(cavity) * volume_changes.sum::<f64>();
            self.gradients(cavity, at)
                .for_each(|(node, gradient)| f(node, gradient * change));
        }
    }

    /// Calls `f` with the diagonal blocks of `kappa/V0 g g^T`, N/m.
    pub fn visit_diagonal(&self, at: PositionVectors, f: &mut dyn FnMut(usize, DMat3)) {
        if self.stiffness == 0.0 {
            return;
        }
        self.surface.visit(&mut |node, cavity, triangles| {
            let cavity = &self.cavities[cavity];
            if !cavity.is_open {
                let g = self.surface.gradient(triangles, at);
                let scaled = g * self.volume_stiffness(cavity);
                f(node, outer(scaled, g));
            }
        });
    }

    /// Calls `f` with kappa over the rest volume, Pa/m³, and the gradient g, for each cavity.
    pub fn visit_factors(&self, at: PositionVectors, f: &mut dyn FnMut(f64, VolumeGradients)) {
        for cavity in self.closed_cavities().filter(|_| self.stiffness > 0.0) {
            f(self.volume_stiffness(cavity), &mut self.gradients(cavity, at));
        }
    }
}
