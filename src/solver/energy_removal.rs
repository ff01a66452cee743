//! Removes kinetic energy from a body without changing its rigid motion.

use glam::{BVec3, DMat3, DVec3, Vec3};

use super::System;
use super::energy_account::EnergyAccount;
use crate::base::{outer, trace};
use crate::soa::Vectors;

/// Removes `energy` from the kinetic energy of deformation, at the newest velocities, J. Returns the removed energy
/// (J), which is at most all of it. An unconstrained body keeps its linear and angular momentum. `at_next`: the
/// velocities belong to the next positions.
pub(crate) fn remove_kinetic_energy(body: &mut System, energy: f64, at_next: bool) -> f64 {
    if energy <= 0.0 {
        return 0.0;
    }
    let held = body.held_axes();
    let state = body.state.substep();
    let positions = if at_next {
        &*state.next_positions
    } else {
        state.positions
    };
    let velocities = state.velocities;
    let inverse_masses = &body.inverse_masses;
    let rigid = RigidMotion::of(positions, velocities, inverse_masses, held);
    let mut available = 0.0;
    for node in (0..inverse_masses.len()).filter(|&node| inverse_masses[node] > 0.0) {
        let held = body.pins.partial_axes_of(node as u32);
        let velocity = velocities.get(node).as_dvec3() - rigid.at(positions.get(node));
        available +=
            0.5 * DVec3::select(held, DVec3::ZERO, velocity).length_squared() / f64::from(inverse_masses[node]);
    }
    if available <= 0.0 {
        return 0.0;
    }
    let factor = (1.0 - energy / available).max(0.0).sqrt();
    for node in (0..inverse_masses.len()).filter(|&node| inverse_masses[node] > 0.0) {
        let held = body.pins.partial_axes_of(node as u32);
        let velocity = velocities.get(node);
        let common = rigid.at(positions.get(node));
        let slower = common + (velocity.as_dvec3() - common) * factor;
        velocities.set(node, Vec3::select(held, velocity, slower.as_vec3()));
    }
    energy.min(available)
}

/// Removes the kinetic energy that a change of masses has added, at the beginning of a step. The velocities are those
/// at the time of the positions. The rigid motion of an unconstrained body does not change.
pub(super) fn remove_added_energy(body: &mut System, account: &mut EnergyAccount) {
    let state = body.state.substep();
    state.velocities.copy_from(state.first_velocities);
    let held = body.held_axes();
    let state = body.state.substep();
    let rigid = RigidMotion::of(state.positions, state.velocities, &body.inverse_masses, held);
    let mut added = 0.0;
    for candidate in body.scaling.iter().flat_map(|scaling| scaling.candidates()) {
        let node = candidate.node as usize;
        let held = body.pins.partial_axes_of(candidate.node);
        let velocity = state.velocities.get(node).as_dvec3() - rigid.at(state.positions.get(node));
        added += 0.5 * f64::from(candidate.change()) * DVec3::select(held, DVec3::ZERO, velocity).length_squared();
    }
    remove_kinetic_energy(body, added, false);
    account.lose((held == BVec3::TRUE).then_some((-added).max(0.0)));
}

/// The rigid motion of an unconstrained body. It is zero along and about constrained axes.
struct RigidMotion {
    center: DVec3,
    velocity: DVec3,
    spin: DVec3,
}

impl RigidMotion {
    fn of(positions: &Vectors, velocities: &Vectors, inverse_masses: &[f32], held: BVec3) -> Self {
        let nodes = || (0..inverse_masses.len()).filter(|&node| inverse_masses[node] > 0.0);
        let mass_of = |node: usize| 1.0 / f64::from(inverse_masses[node]);
        let (mut mass, mut moment, mut momentum) = (0.0, DVec3::ZERO, DVec3::ZERO);
        for node in nodes() {
            mass += mass_of(node);
            moment += mass_of(node) * positions.get(node).as_dvec3();
            momentum += mass_of(node) * velocities.get(node).as_dvec3();
        }
        let center = moment / mass;
        let velocity = DVec3::select(held, DVec3::ZERO, momentum / mass);
        let mut spin = DVec3::ZERO;
        // A body that is constrained along one axis can rotate about that axis.
        let turns = match held.bitmask() {
            0 => DVec3::ONE,
            1 | 2 | 4 => DVec3::select(held, DVec3::ONE, DVec3::ZERO),
            _ => DVec3::ZERO,
        };
        if turns != DVec3::ZERO {
            let (mut inertia, mut angular) = (DMat3::ZERO, DVec3::ZERO);
            for node in nodes() {
                let arm = positions.get(node).as_dvec3() - center;
                angular += mass_of(node) * arm.cross(velocities.get(node).as_dvec3());
                inertia += (DMat3::from_diagonal(DVec3::splat(arm.length_squared())) - outer(arm, arm)) * mass_of(node);
            }
            // Collinear nodes have no inertia about their axis and do not rotate about it.
            let trace = trace(&inertia);
            let inertia = DMat3::from_diagonal(turns) * inertia * DMat3::from_diagonal(turns);
            let rest = DMat3::from_diagonal(DVec3::ONE - turns + 1e-9);
            spin = (inertia + rest * trace).inverse() * (angular * turns);
        }
        let or_none = |vector: DVec3| if vector.is_finite() { vector } else { DVec3::ZERO };
        Self {
            center: or_none(center),
            velocity: or_none(velocity),
            spin: or_none(spin),
        }
    }

    fn at(&self, position: Vec3) -> DVec3 {
        self.velocity + self.spin.cross(position.as_dvec3() - self.center)
    }
}
