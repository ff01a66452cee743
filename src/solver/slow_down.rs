//! Takes kinetic energy off a body, and leaves its motion as a whole.

use glam::{BVec3, DMat3, DVec3, Vec3};

use super::System;
use super::energy_account::EnergyAccount;
use crate::base::{outer, trace};
use crate::soa::Vectors;

/// Takes this much kinetic energy off the newest velocities, J, or all there is that nothing conserves: how much it was. A body that nothing
/// holds keeps its momentum and its angular momentum: it is its deformation that becomes slower.
/// `at_next`: the nodes are at the next positions.
pub(crate) fn slow_down(body: &mut System, energy: f64, at_next: bool) -> f64 {
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
    let mut own = 0.0;
    for node in (0..inverse_masses.len()).filter(|&node| inverse_masses[node] > 0.0) {
        let held = body.pins.partial_axes_of(node as u32);
        let velocity = velocities.get(node).as_dvec3() - rigid.at(positions.get(node));
        own += 0.5 * DVec3::select(held, DVec3::ZERO, velocity).length_squared() / f64::from(inverse_masses[node]);
    }
    if own <= 0.0 {
        return 0.0;
    }
    let factor = (1.0 - energy / own).max(0.0).sqrt();
    for node in (0..inverse_masses.len()).filter(|&node| inverse_masses[node] > 0.0) {
        let held = body.pins.partial_axes_of(node as u32);
        let velocity = velocities.get(node);
        let common = rigid.at(positions.get(node));
        let slower = common + (velocity.as_dvec3() - common) * factor;
        velocities.set(node, Vec3::select(held, velocity, slower.as_vec3()));
    }
    energy.min(own)
}

/// Sees that motion has no more kinetic energy after masses have changed than before, as a step begins with velocities at the time of its
/// positions. The motion as a whole of a body that nothing holds stays as it is.
pub(super) fn keep_energy(body: &mut System, account: &mut EnergyAccount) {
    let state = body.state.substep();
    state.velocities.copy_from(state.first_velocities);
    let held = body.held_axes();
    let state = body.state.substep();
    let rigid = RigidMotion::of(state.positions, state.velocities, &body.inverse_masses, held);
    let mut added = 0.0;
    for sliver in body.scaling.iter().flat_map(|scaling| scaling.slivers()) {
        let node = sliver.node as usize;
        let held = body.pins.partial_axes_of(sliver.node);
        let velocity = state.velocities.get(node).as_dvec3() - rigid.at(state.positions.get(node));
        added += 0.5 * f64::from(sliver.change()) * DVec3::select(held, DVec3::ZERO, velocity).length_squared();
    }
    slow_down(body, added, false);
    account.lose((held == BVec3::TRUE).then_some((-added).max(0.0)));
}

/// How a body moves as a whole; not at all where something holds it.
struct RigidMotion {
    centre: DVec3,
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
        let centre = moment / mass;
        let velocity = DVec3::select(held, DVec3::ZERO, momentum / mass);
        let mut spin = DVec3::ZERO;
        // What is held along one axis turns about it.
        let turns = match held.bitmask() {
            0 => DVec3::ONE,
            1 | 2 | 4 => DVec3::select(held, DVec3::ONE, DVec3::ZERO),
            _ => DVec3::ZERO,
        };
        if turns != DVec3::ZERO {
            let (mut inertia, mut angular) = (DMat3::ZERO, DVec3::ZERO);
            for node in nodes() {
                let arm = positions.get(node).as_dvec3() - centre;
                angular += mass_of(node) * arm.cross(velocities.get(node).as_dvec3());
                inertia += (DMat3::from_diagonal(DVec3::splat(arm.length_squared())) - outer(arm, arm)) * mass_of(node);
            }
            // A row of nodes has no inertia about its axis, and does not turn about it.
            let trace = trace(&inertia);
            let inertia = DMat3::from_diagonal(turns) * inertia * DMat3::from_diagonal(turns);
            let rest = DMat3::from_diagonal(DVec3::ONE - turns + 1e-9);
            spin = (inertia + rest * trace).inverse() * (angular * turns);
        }
        let or_none = |vector: DVec3| if vector.is_finite() { vector } else { DVec3::ZERO };
        Self {
            centre: or_none(centre),
            velocity: or_none(velocity),
            spin: or_none(spin),
        }
    }

    fn at(&self, position: Vec3) -> DVec3 {
        self.velocity + self.spin.cross(position.as_dvec3() - self.centre)
    }
}
