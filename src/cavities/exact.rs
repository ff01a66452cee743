//! Cavities one at a time and in `f64`: energies, second derivatives, and what there is to tell.

use glam::{DMat3, DVec3};

use super::{Cavity, Enclosed, pressure_of};
use crate::base::{cross_matrix, outer};
use crate::def::EnclosedReport;

/// Where each node is, or how far it goes.
pub(crate) type At<'a> = &'a dyn Fn(usize) -> DVec3;

/// Nodes, and what triangles have of the gradient of a volume by their places, m².
pub(crate) type Gradients<'a> = &'a mut dyn Iterator<Item = (usize, DVec3)>;

impl Enclosed {
    /// The cavities that are closed.
    fn closed(&self) -> impl Iterator<Item = &Cavity> {
        self.cavities.iter().filter(|cavity| !cavity.is_open)
    }

    fn triangles(&self, cavity: &Cavity) -> &[[u32; 3]] {
        &self.surface.triangles[cavity.triangles[0] as usize..cavity.triangles[1] as usize]
    }

    /// kappa over the volume at rest, Pa/m³.
    fn stiffness_of(&self, cavity: &Cavity) -> f64 {
        f64::from(self.stiffness) / cavity.rest_volume
    }

    fn volume(&self, cavity: &Cavity, at: At) -> f64 {
        let triangles = self.triangles(cavity);
        let apex = at(triangles[0][0] as usize);
        let volumes = triangles.iter().map(|corners| {
            let [a, b, c] = corners.map(|node| at(node as usize));
            (a - apex).dot((b - a).cross(c - a))
        });
        volumes.sum::<f64>() / 6.0
    }

    /// The pressure of a cavity, Pa.
    fn pressure_in(&self, cavity: &Cavity, at: At) -> f64 {
        pressure_of(self.stiffness, self.pressure, cavity, self.volume(cavity, at))
    }

    /// The energy that is stored as volumes are not those at rest, J, and the work that the constant pressure has done on them.
    pub fn energy(&self, at: At) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for cavity in self.closed() {
            let growth = self.volume(cavity, at) - cavity.rest_volume;
            sums[0] += 0.5 * self.stiffness_of(cavity) * growth * growth;
            sums[1] += f64::from(self.pressure) * growth;
        }
        sums
    }

    /// Volumes and pressure.
    pub fn report(&self, at: At) -> EnclosedReport {
        let mut report = EnclosedReport::default();
        for cavity in self.closed() {
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

    /// Shows the triangles of the cavities that are closed.
    pub fn show_triangles(&self, see: &mut dyn FnMut([u32; 3])) {
        for cavity in self.closed() {
            self.triangles(cavity).iter().for_each(|&corners| see(corners));
        }
    }

    /// Shows the force of each triangle on each of its nodes, N.
    pub fn show_forces(&self, at: At, see: &mut dyn FnMut(usize, DVec3)) {
        for cavity in self.closed() {
            let pressure = self.pressure_in(cavity, at);
            self.gradients(cavity, at)
                .for_each(|(node, gradient)| see(node, gradient * pressure));
        }
    }

    /// What each triangle has of the gradient of a cavity's volume by the places of its nodes, m².
    fn gradients(&self, cavity: &Cavity, at: At) -> impl Iterator<Item = (usize, DVec3)> {
        self.triangles(cavity).iter().flat_map(move |corners| {
            let nodes = corners.map(|node| node as usize);
            let [a, b, c] = nodes.map(at);
            let gradient = (b - a).cross(c - a) / 6.0;
            nodes.map(|node| (node, gradient))
        })
    }

    /// Shows how the energy changes where nodes go so much further, J, to the last digits.
    pub fn show_changes(&self, at: At, more: At, see: &mut dyn FnMut(f64)) {
        for cavity in self.closed() {
            let first = self.triangles(cavity)[0][0] as usize;
            let (apex, shift) = (at(first), more(first));
            let mut change = 0.0;
            for &corners in self.triangles(cavity) {
                let nodes = corners.map(|node| node as usize);
                let ([a, b, c], [da, db, dc]) = (nodes.map(at), nodes.map(more));
                let ([ab, ac], [dab, dac]) = ([b - a, c - a], [db - da, dc - da]);
                let turn = dab.cross(ac) + ab.cross(dac) + dab.cross(dac);
                change += (da - shift).dot(ab.cross(ac) + turn) + (a - apex).dot(turn);
            }
            change /= 6.0;
            // Both parts by themselves, as at rest they may cancel.
            let growth = self.volume(cavity, at) - cavity.rest_volume;
            see(self.stiffness_of(cavity) * change * (growth + 0.5 * change));
            see(-f64::from(self.pressure) * change);
        }
    }

    /// Shows for each pair of nodes of each triangle how much what pressure does to one lessens with the place of the other, N/m; the
    /// blocks on the diagonal are 0.
    pub fn show_blocks(&self, at: At, see: &mut dyn FnMut([u32; 2], DMat3)) {
        for cavity in self.closed() {
            let pressure = self.pressure_in(cavity, at);
            for &[a, b, c] in self.triangles(cavity) {
                for [a, b, c] in [[a, b, c], [b, c, a], [c, a, b]] {
                    let [from, to, beside] = [a, b, c].map(|node| at(node as usize));
                    // The middle of the edge is the same for the triangle at its other side, and falls out.
                    let arm = (beside - (from + to) * 0.5) * (pressure / 6.0);
                    let block = cross_matrix(arm);
                    see([a, b], block);
                }
            }
        }
    }

    /// Shows what `kappa/V0 g g^T` times vectors is at each node.
    pub fn show_products(&self, at: At, vectors: &[DVec3], see: &mut dyn FnMut(usize, DVec3)) {
        for cavity in self.closed().filter(|_| self.stiffness > 0.0) {
            let growths = self
                .gradients(cavity, at)
                .map(|(node, gradient)| gradient.dot(vectors[node]));
            let change = self.stiffness_of(cavity) * growths.sum::<f64>();
            self.gradients(cavity, at)
                .for_each(|(node, gradient)| see(node, gradient * change));
        }
    }

    /// Shows the blocks of `kappa/V0 g g^T` on the diagonal, N/m.
    pub fn show_diagonal(&self, at: At, see: &mut dyn FnMut(usize, DMat3)) {
        if self.stiffness == 0.0 {
            return;
        }
        self.surface.visit(&mut |node, cavity, triangles| {
            let cavity = &self.cavities[cavity];
            if !cavity.is_open {
                let g = self.surface.gradient(triangles, at);
                let scaled = g * self.stiffness_of(cavity);
                see(node, outer(scaled, g));
            }
        });
    }

    /// Shows for each cavity kappa over its volume at rest, Pa/m³, and what its triangles have of g.
    pub fn show_factors(&self, at: At, see: &mut dyn FnMut(f64, Gradients)) {
        for cavity in self.closed().filter(|_| self.stiffness > 0.0) {
            see(self.stiffness_of(cavity), &mut self.gradients(cavity, at));
        }
    }
}
