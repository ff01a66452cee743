//! The closing half kick of a step, deferred to the next step.
//!
//! It uses the forces at the end of the step, which the next step begins with. There both half kicks become one, and
//! the springs are visited once per substep. Until then the velocities lag the positions by half a substep. Reading
//! velocities computes the missing half kick into a separate buffer; the state does not change.

use std::ops::Range;

use glam::{DVec3, Vec3};

use super::System;
use super::gravity::GravityKicks;
use super::kick::{Inertia, Kick, TileKick, TileStats, tile_stats};
use crate::base::{Result, memory};
use crate::codec::saved;
use crate::forces::ForceSum;
use crate::nodes::{NodeDamping, Pin};
use crate::simd::ChosenKernel;
use crate::soa::{TILE, TileForces, Vectors, copy_axes, tile_count, tile_nodes};
use crate::springs::ForceInput;
use crate::threads::{Items, Team};

/// A half kick that the velocities lack.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct DeferredHalfKick {
    /// The substep that it closes, s.
    pub substep: f32,
    pub gravity: Vec3,
}

saved! { DeferredHalfKick { substep, gravity } }

impl DeferredHalfKick {
    /// The velocity change by gravity, m/s.
    pub fn gravity_change(&self) -> DVec3 {
        self.gravity.as_dvec3() * (0.5 * f64::from(self.substep))
    }

    /// True if it can be merged with the half kick that opens a step with this `substep`, s. Applied forces belong to
    /// one step only. Damping has a different factor for each substep.
    pub fn can_merge(&self, body: &System, substep: f32, gravity: Vec3) -> bool {
        let same = Self { substep, gravity } == *self;
        !body.forces_applied && (same || body.damping.is_none())
    }

    /// Returns the kick for nodes with this inertia. Damping factors must be prepared for its substep.
    pub(super) fn kick<'a>(
        &self,
        gravity_change: Vec3,
        inertia: Inertia<'a>,
        damping: Option<&'a NodeDamping>,
    ) -> Kick<'a> {
        Kick {
            duration: 0.5 * self.substep,
            substep: self.substep,
            half: true,
            gravity: self.gravity,
            gravity_change,
            inertia,
            applied: None,
            damping,
        }
    }
}

/// True if a step of `body` may defer its closing half kick.
///
/// Spring damping, step doubling and tool attachments need the velocities at the end of the step, and applied forces
/// end with the step. Reading velocities does not evaluate elements, terms and cavities.
pub(super) fn can_defer_half_kick(body: &System) -> bool {
    !body.forces.has_non_spring_forces()
        && body.predicted_velocities.is_none()
        && body.coarse.is_none()
        && !body.forces_applied
        && !body.has_tool_attachments()
}

/// Computes velocities at the time of the positions in a separate buffer.
pub(super) struct HalfKickFlush<'a> {
    /// The forces at `positions`.
    pub forces: ForceSum<'a>,
    pub kernel: ChosenKernel,
    /// The half kick.
    pub kick: Kick<'a>,
    pub positions: &'a Vectors,
    pub velocities: &'a Vectors,
}

impl HalfKickFlush<'_> {
    /// Writes the velocities of a tile. Pinned axes keep their velocity.
    pub fn write(&self, tile: usize, nodes: Range<usize>, output: &mut [&mut [f32]; 3], pins: &[Pin]) {
        let mut forces = TileForces::ZERO;
        let forces = &mut forces;
        let damped = self.forces.springs.damped().then_some(self.velocities);
        let motion = ForceInput::at(self.positions, damped);
        self.forces.write(tile, nodes.clone(), &motion, forces);
        let velocities = self.velocities.slices(nodes.clone());
        copy_axes(output, velocities);
        let first = nodes.start;
        self.kernel.run(TileKick {
            kick: &self.kick,
            nodes,
            forces,
            velocities: output.each_mut().map(|axis| &mut **axis),
            drift: None,
        });
        for pin in pins {
            let slot = pin.node as usize - first;
            let velocity = velocities.map(|axis| axis[slot]);
            pin.write_held(output, slot, velocity.into());
        }
    }
}

/// Writes the velocities at the time of the current positions to the step in progress and advances `gravity`. If one of
/// them is not finite, all of them keep the time of the deferred kick.
pub(super) fn flush_into(body: &mut System, deferred: &DeferredHalfKick, gravity: &mut GravityKicks, team: &Team) {
    if let Some(damping) = &mut body.damping {
        damping.prepare(deferred.substep);
    }
    let inertia = Inertia::of(body.uniform_inverse_mass, &body.inverse_masses, body.scaling.as_deref());
    let state = body.state.substep();
    let flush = HalfKickFlush {
        forces: body.forces.sum(),
        kernel: body.kernel,
        kick: deferred.kick(gravity.next(deferred.gravity_change()), inertia, body.damping.as_ref()),
        positions: state.positions,
        velocities: state.first_velocities,
    };
    let node_count = state.positions.len();
    let written = (
        state.velocities.tiles_mut(),
        body.pins.tiles_mut(),
        Items::new(&mut body.tile_stats),
    );
    team.pass(
        tile_count(node_count),
        written,
        |tile, (mut velocities, pins, stats)| {
            flush.write(tile, tile_nodes(tile, node_count), &mut velocities, pins);
            let velocities = velocities.each_ref().map(|axis| &**axis);
            *stats = tile_stats(flush.kernel, velocities, Some(velocities));
        },
    );
    let stats = body.tile_stats.iter().copied().fold(TileStats::EMPTY, TileStats::merge);
    if stats.finite {
        gravity.velocities = stats.velocities;
    } else {
        state.velocities.copy_from(state.first_velocities);
    }
}

/// Applies the deferred half kick of `body`, if there is one.
pub(crate) fn flush_half_kick(body: &mut System) {
    if let Some(preview) = preview_flush(body) {
        let mut pins = std::mem::take(&mut body.pins);
        pins.iter_mut().for_each(|pin| pin.force = body.mean_force(pin));
        body.pins = pins;
        preview.commit(body);
    }
}

/// Velocities at the time of the positions, beside the current ones. Dropping the preview changes nothing.
pub(crate) struct FlushPreview {
    gravity: GravityKicks,
}

/// Computes the preview, if a half kick is deferred.
pub(crate) fn preview_flush(body: &mut System) -> Option<FlushPreview> {
    let deferred = body.carry.deferred_kick?;
    let mut gravity = body.carry.gravity;
    body.state.begin();
    flush_into(body, &deferred, &mut gravity, &Team::alone());
    Some(FlushPreview { gravity })
}

impl FlushPreview {
    /// The mean reaction of each pin over the last step, N. Springs and masses must still be those of the step.
    pub fn forces(&self, body: &System) -> Result<Vec<Vec3>> {
        let mut forces = memory::reserved(body.pins.iter().count())?;
        forces.extend(body.pins.iter().map(|pin| body.mean_force(pin)));
        Ok(forces)
    }

    /// Makes the velocities current. No step may have begun since the preview.
    pub fn commit(self, body: &mut System) {
        body.state.commit();
        for pin in body.pins.iter_mut() {
            pin.deferred_share = 0.0;
        }
        body.carry.gravity = self.gravity;
        body.carry.deferred_kick = None;
    }
}

/// A callback that receives nodes and their velocities along each axis.
type Visit<'a> = dyn FnMut(Range<usize>, [&[f32]; 3]) + 'a;

/// Visits the velocities of `body` at the time of its positions, tile by tile. Returns whether they are finite. Stops
/// at the first tile that is not.
pub(crate) fn visit_flushed(body: &System, deferred: &DeferredHalfKick, visit: &mut Visit) -> bool {
    let inertia = Inertia::of(body.uniform_inverse_mass, &body.inverse_masses, body.scaling.as_deref());
    let gravity_change = { body.carry.gravity }.next(deferred.gravity_change());
    let flush = HalfKickFlush {
        forces: body.forces.sum(),
        kernel: body.kernel,
        kick: deferred.kick(gravity_change, inertia, body.damping.as_ref()),
        positions: body.state.positions(),
        velocities: body.state.velocities(),
    };
    let node_count = body.node_count();
    let mut axes = [[0.0_f32; TILE]; 3];
    (0..tile_count(node_count)).all(|tile| {
        let nodes = tile_nodes(tile, node_count);
        let mut axes = axes.each_mut().map(|axis| &mut axis[..nodes.len()]);
        axes.iter_mut().for_each(|axis| axis.fill(0.0));
        if !body
            .sleep_state
            .as_ref()
            .is_some_and(|sleep_state| sleep_state.is_asleep(tile))
        {
            flush.write(tile, nodes.clone(), &mut axes, body.pins.of_tile(tile));
        }
        let axes = axes.map(|axis| &*axis);
        let finite = tile_stats(flush.kernel, axes, Some(axes)).finite;
        if finite {
            visit(nodes, axes);
        }
        finite
    })
}

/// Corrects the velocity of `node` so that the deferred half kick gives the same result as with an additional `force`
/// (N). Pass the force of a removed spring, or the negated force of an added one.
pub(crate) fn correct_deferred_kick(body: &mut System, node: u32, mut force: Vec3) {
    let Some(deferred) = body.carry.deferred_kick else {
        return;
    };
    if let Some(pin) = body.pins.get_mut(node) {
        pin.force -= pin.held(force) * pin.deferred_share;
        force -= pin.held(force);
        if !pin.is_partial() {
            return;
        }
    }
    let node = node as usize;
    // If damping removes nearly all velocity within the half kick, no correction is needed.
    const LEFT: f32 = 1e-3;
    let duration = match &body.damping {
        None => 0.5 * deferred.substep,
        Some(damping) => damping.gain[node] / (1.0 - damping.loss[node]).max(LEFT),
    };
    let velocity = body.state.velocities().get(node) + force * (body.inverse_masses[node] * duration);
    if velocity.length_squared().is_finite() {
        body.state.velocities_mut().set(node, velocity);
    }
}

impl System {
    /// The mean reaction of a pin over the last step, N.
    pub(crate) fn mean_force(&self, pin: &Pin) -> Vec3 {
        let Some(deferred) = self.carry.deferred_kick.filter(|_| pin.deferred_share > 0.0) else {
            return pin.force;
        };
        let node = pin.node as usize;
        let mut force = deferred.gravity * self.masses[node];
        self.forces.add_spring_forces(node, self.state.positions(), &mut force);
        let force = pin.force - pin.held(force) * pin.deferred_share;
        if force.is_finite() { force } else { pin.force }
    }
}
