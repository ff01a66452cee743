//! One substep of VERLET, tile by tile: forces, kick, drift and pins of a tile while it is in the L1 cache.

use std::ops::Range;

use glam::Vec3;

use super::System;
use super::deferred_half_kick::{DeferredHalfKick, HalfKickFlush};
use super::gravity::GravityKicks;
use super::kick::{Drift, Inertia, Kick, TileKick, TileStats, tile_stats};
use super::step_request::StepRequest;
use crate::forces::ForceSum;
use crate::nodes::{NodeDamping, Pin};
use crate::simd::ChosenKernel;
use crate::soa::{TileForces, Vectors, View, copy_axes, tile_count, tile_nodes};
use crate::springs::ForceInput;
use crate::threads::{Items, Team};

/// The source and time of the velocities before a kick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum VelocityTime {
    /// The current state, at the time of the positions.
    Current,
    /// The current state, half a substep before the positions.
    CurrentLagging,
    /// The step in progress, at the time of the positions.
    InProgress,
    /// The step in progress, half a substep before the positions.
    InProgressLagging,
}

/// One pass over a body: a kick and the drift that follows it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SubstepKick {
    pub(super) velocity_time: VelocityTime,
    /// True for the last pass of the step.
    pub last: bool,
    /// True if the nodes drift after the kick. Otherwise the spring forces are stored.
    pub drifts: bool,
    /// True for a half kick.
    pub half: bool,
    /// The time that forces act on nodes without damping, s.
    pub duration: f32,
    /// The part of `duration` that belongs to this step, in substeps.
    pub step_share: f64,
    /// The velocity change by gravity, m/s.
    pub gravity_change: Vec3,
    /// Fractions of the step at which the drift starts and ends.
    pub start: f64,
    pub end: f64,
    /// The length of the substep, s.
    pub substep: f32,
}

impl SubstepKick {
    /// The half kick that opens a step.
    pub fn opening(substep: f32) -> Self {
        Self {
            velocity_time: VelocityTime::Current,
            last: false,
            drifts: true,
            half: true,
            duration: 0.5 * substep,
            step_share: 0.5,
            gravity_change: Vec3::ZERO,
            start: 0.0,
            end: 0.0,
            substep,
        }
    }

    /// The kick without applied forces.
    pub(super) fn kick<'a>(&self, gravity: Vec3, inertia: Inertia<'a>, damping: Option<&'a NodeDamping>) -> Kick<'a> {
        Kick {
            duration: self.duration,
            substep: self.substep,
            half: self.half,
            gravity,
            gravity_change: self.gravity_change,
            inertia,
            applied: None,
            damping,
        }
    }

    /// Merges the deferred half kick of the last step into this kick.
    pub fn merge_deferred(&mut self, deferred: &DeferredHalfKick) {
        self.velocity_time = VelocityTime::CurrentLagging;
        self.half = false;
        self.duration += 0.5 * deferred.substep;
    }

    /// Changes to the full kick of a later substep.
    pub fn set_full_kick(&mut self, gravity: Vec3, kicks: &mut GravityKicks) {
        self.velocity_time = VelocityTime::InProgressLagging;
        self.half = false;
        self.duration = self.substep;
        self.step_share = 1.0;
        self.gravity_change = kicks.next(gravity.as_dvec3() * f64::from(self.substep));
    }

    /// Changes to the closing half kick of the step.
    pub fn set_closing(&mut self, gravity: Vec3, kicks: &mut GravityKicks) {
        *self = Self {
            velocity_time: VelocityTime::InProgressLagging,
            last: true,
            drifts: false,
            gravity_change: kicks.next(gravity.as_dvec3() * f64::from(0.5 * self.substep)),
            start: 1.0,
            end: 1.0,
            ..Self::opening(self.substep)
        };
    }
}

/// Rounding remainders of positions are tracked in shorter substeps, s. At 0.1 m from a body's origin, coordinates are
/// rounded by up to 4 nm. That is 0.015 mm/s over this substep and 1.5 mm/s over a hundredth of it.
const REMAINDER_SUBSTEP: f32 = 2.5e-4;

/// Updates velocities by the forces at the latest positions, moves the nodes, and moves pinned nodes to their targets
/// along their constrained axes.
pub(super) fn kick_and_drift(
    body: &mut System,
    request: &StepRequest,
    substep_kick: &SubstepKick,
    team: &Team,
) -> TileStats {
    let node_count = body.node_count();
    let inertia = Inertia::of(body.uniform_inverse_mass, &body.inverse_masses, body.scaling.as_deref());
    if substep_kick.drifts && substep_kick.substep < REMAINDER_SUBSTEP {
        body.state.enable_remainders();
    }
    let state = body.state.substep();
    let kick = Kick {
        applied: body.applied.as_ref().filter(|_| body.forces_applied),
        ..substep_kick.kick(request.gravity, inertia, body.damping.as_ref())
    };
    let tiles = tile_count(node_count);
    let sleep_state = body.sleep_state.as_deref();
    let is_asleep = |tile: usize| sleep_state.is_some_and(|sleep_state| sleep_state.is_asleep(tile));
    let are_forces_current = substep_kick.velocity_time == VelocityTime::Current && body.forces_current;
    if !are_forces_current {
        body.forces.write_awake_records(state.positions, is_asleep, team);
        body.forces.compute(state.positions, team);
    }
    let forces = body.forces.sum();
    if substep_kick.velocity_time == VelocityTime::InProgressLagging
        && let Some(predicted) = &mut body.predicted_velocities
    {
        let flush = HalfKickFlush {
            forces,
            kernel: body.kernel,
            kick: Kick {
                duration: 0.5 * substep_kick.substep,
                half: true,
                gravity_change: substep_kick.gravity_change * (0.5 * substep_kick.substep / substep_kick.duration),
                ..kick
            },
            positions: state.positions,
            velocities: state.velocities,
        };
        let output = (predicted.tiles_mut(), body.pins.tiles_mut());
        team.pass(tiles, output, |tile, (mut predicted, pins)| {
            if is_asleep(tile) {
                predicted.iter_mut().for_each(|axis| axis.fill(0.0));
                return;
            }
            flush.write(tile, tile_nodes(tile, node_count), &mut predicted, pins);
        });
    }
    let (first_remainders, remainders) = match state.remainders {
        None => (None, None),
        Some([first, newest]) => (Some(&*first), Some(newest)),
    };
    let input = SubstepInput {
        forces,
        kernel: body.kernel,
        masses: &body.masses,
        request,
        substep_kick,
        kick,
        positions: body.forces.view(state.positions),
        first_velocities: (substep_kick.velocity_time != VelocityTime::InProgressLagging
            && substep_kick.velocity_time != VelocityTime::InProgress)
            .then_some(state.first_velocities),
        first_forces: are_forces_current.then_some(state.first_forces),
        damped_velocities: match substep_kick.velocity_time {
            VelocityTime::InProgressLagging => body.predicted_velocities.as_ref(),
            _ => body.forces.springs.damped().then_some(state.first_velocities),
        },
        first_remainders: first_remainders.filter(|_| substep_kick.velocity_time != VelocityTime::InProgressLagging),
    };
    let output = (
        state.velocities.tiles_mut(),
        state.next_positions.tiles_mut(),
        state.forces.tiles_mut(),
        remainders
            .filter(|_| substep_kick.drifts)
            .map(|remainders| remainders.tiles_mut()),
        body.pins.tiles_mut(),
        Items::new(&mut body.tile_stats),
    );
    team.pass(
        tiles,
        output,
        |tile, (velocities, next_positions, forces, remainders, pins, stats): (_, _, _, _, _, &mut TileStats)| {
            if is_asleep(tile) {
                *stats = TileStats::EMPTY;
                return;
            }
            let mut output = TileOutput {
                velocities,
                next_positions,
                forces,
                remainders,
                pins,
            };
            let mut sums = TileForces::ZERO;
            *stats = input.run_tile(tile, tile_nodes(tile, node_count), &mut output, &mut sums);
        },
    );
    body.tile_stats.iter().copied().fold(TileStats::EMPTY, TileStats::merge)
}

/// The input of all tiles of a substep.
#[derive(Clone, Copy)]
pub(super) struct SubstepInput<'a> {
    pub forces: ForceSum<'a>,
    pub kernel: ChosenKernel,
    pub masses: &'a [f32],
    pub request: &'a StepRequest<'a>,
    pub substep_kick: &'a SubstepKick,
    pub kick: Kick<'a>,
    pub positions: View<'a>,
    /// The velocities before the kick, if they are not in the buffer of the step in progress.
    pub first_velocities: Option<&'a Vectors>,
    /// The spring forces, if they are current.
    pub first_forces: Option<&'a Vectors>,
    /// The velocities at the time of the positions, if springs have damping.
    pub damped_velocities: Option<&'a Vectors>,
    /// The remainders before the drift, if they are not in the buffer of the step in progress.
    pub first_remainders: Option<&'a Vectors>,
}

/// The output of a tile of a substep.
pub(super) struct TileOutput<'a> {
    pub velocities: [&'a mut [f32]; 3],
    pub next_positions: [&'a mut [f32]; 3],
    /// The spring forces. Empty if the nodes drift.
    pub forces: [&'a mut [f32]; 3],
    /// The rounding remainders of positions, if they are tracked.
    pub remainders: Option<[&'a mut [f32]; 3]>,
    pub pins: &'a mut [Pin],
}

impl SubstepInput<'_> {
    /// Takes the substep of a tile. `forces` is scratch memory.
    pub fn run_tile(
        &self,
        tile: usize,
        nodes: Range<usize>,
        output: &mut TileOutput,
        forces: &mut TileForces,
    ) -> TileStats {
        if let Some(first_forces) = self.first_forces {
            for (forces, first) in forces.axes_mut().into_iter().zip(first_forces.slices(nodes.clone())) {
                forces[..nodes.len()].copy_from_slice(first);
            }
        } else {
            let [vx, vy, vz] = match self.first_velocities {
                Some(velocities) => velocities.slices(nodes.clone()),
                None => output.velocities.each_ref().map(|axis| &**axis),
            };
            let [x, y, z] = output.next_positions.each_ref().map(|axis| &**axis);
            let motion = ForceInput {
                positions: self.positions,
                velocities: self.damped_velocities,
                prefetched: [vx, vy, vz, x, y, z],
            };
            self.forces.write(tile, nodes.clone(), &motion, forces);
        }
        if let Some(first_velocities) = self.first_velocities {
            copy_axes(&mut output.velocities, first_velocities.slices(nodes.clone()));
        }
        if let (Some(first), Some(remainders)) = (self.first_remainders, &mut output.remainders) {
            copy_axes(remainders, first.slices(nodes.clone()));
        }
        if !self.substep_kick.drifts {
            copy_axes(&mut output.forces, forces.axes().map(|axis| &axis[..nodes.len()]));
        }
        self.accumulate_pin_reactions(&nodes, forces, output.pins);
        self.kernel.run(TileKick {
            kick: &self.kick,
            nodes: nodes.clone(),
            forces,
            velocities: output.velocities.each_mut().map(|axis| &mut **axis),
            drift: self.substep_kick.drifts.then(|| Drift {
                positions: self.positions.slices(nodes.clone()),
                next_positions: output.next_positions.each_mut().map(|axis| &mut **axis),
                remainders: (output.remainders.as_mut()).map(|axes| axes.each_mut().map(|axis| &mut **axis)),
            }),
        });
        self.apply_prescribed_motion(&nodes, output);
        let positions = self.substep_kick.last.then(|| {
            if self.substep_kick.drifts {
                output.next_positions.each_ref().map(|axis| &**axis)
            } else {
                self.positions.slices(nodes)
            }
        });
        tile_stats(self.kernel, output.velocities.each_ref().map(|axis| &**axis), positions)
    }

    /// Accumulates the reactions of pins.
    fn accumulate_pin_reactions(&self, nodes: &Range<usize>, forces: &TileForces, pins: &mut [Pin]) {
        for pin in pins {
            let node = pin.node as usize;
            let weight = self.request.gravity * self.masses[node];
            pin.force_sum -= (forces.get(node - nodes.start) + weight).as_dvec3() * self.substep_kick.step_share;
        }
    }

    /// Moves pinned nodes to their targets.
    fn apply_prescribed_motion(&self, nodes: &Range<usize>, output: &mut TileOutput) {
        for pin in &*output.pins {
            let index = pin.node as usize - nodes.start;
            let velocity = pin.travel / self.request.dt;
            pin.write_held(&mut output.velocities, index, velocity);
            if self.substep_kick.drifts {
                pin.write_held(
                    &mut output.next_positions,
                    index,
                    pin.position_at(self.substep_kick.end),
                );
                if let Some(remainders) = &mut output.remainders {
                    pin.write_held(remainders, index, Vec3::ZERO);
                }
            }
        }
    }
}
