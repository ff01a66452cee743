//! One substep of VERLET, tile by tile: forces, kick, drift and pins of a tile while it is in the nearest cache.

use std::ops::Range;

use glam::Vec3;

use super::System;
use super::closing::{Closed, ClosingKick};
use super::gravity::GravityKicks;
use super::kick::{Drift, Inertia, Kick, Survey, TileKick, look};
use super::step_request::StepRequest;
use crate::forces::Sum;
use crate::nodes::{NodeDamping, Pin};
use crate::simd::ChosenKernel;
use crate::soa::{TileForces, Vectors, View, copy_axes, tile_count, tile_nodes};
use crate::springs::Motion;
use crate::threads::{Items, Team};

/// Where a kick's velocities come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum VelocityTime {
    /// The current state, at the time of the positions.
    Current,
    /// The current state, half a substep before the positions.
    CurrentOpen,
    /// The step in progress, at the time of the positions.
    Closed,
    /// The step in progress, half a substep before the positions.
    Open,
}

/// One pass over a body: a kick, and the drift that follows it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Part {
    pub(super) before: VelocityTime,
    /// Whether it is the last of the step.
    pub last: bool,
    /// Whether the nodes drift after the kick; where they do not, the spring forces are kept.
    pub drifts: bool,
    /// Whether the kick is half of one.
    pub half: bool,
    /// How long forces act on nodes without damping, s.
    pub duration: f32,
    /// How much of that belongs to this step, in substeps.
    pub share: f64,
    /// What gravity gives to them, m/s.
    pub fall: Vec3,
    /// Fractions of the step at which the drift starts and ends.
    pub start: f64,
    pub end: f64,
    /// s
    pub substep: f32,
}

impl Part {
    /// The half kick that opens a step.
    pub fn opening(substep: f32) -> Self {
        Self {
            before: VelocityTime::Current,
            last: false,
            drifts: true,
            half: true,
            duration: 0.5 * substep,
            share: 0.5,
            fall: Vec3::ZERO,
            start: 0.0,
            end: 0.0,
            substep,
        }
    }

    /// The kick, without forces from outside.
    pub(super) fn kick<'a>(&self, gravity: Vec3, inertia: Inertia<'a>, damping: Option<&'a NodeDamping>) -> Kick<'a> {
        Kick {
            duration: self.duration,
            substep: self.substep,
            half: self.half,
            gravity,
            fall: self.fall,
            inertia,
            applied: None,
            damping,
        }
    }

    /// The kick that closes the last step becomes part of this one.
    pub fn join(&mut self, closing: &ClosingKick) {
        self.before = VelocityTime::CurrentOpen;
        self.half = false;
        self.duration += 0.5 * closing.substep;
    }

    /// The full kick of a later substep, in this gravity.
    pub fn go_on(&mut self, gravity: Vec3, kicks: &mut GravityKicks) {
        self.before = VelocityTime::Open;
        self.half = false;
        self.duration = self.substep;
        self.share = 1.0;
        self.fall = kicks.next(gravity.as_dvec3() * f64::from(self.substep));
    }

    /// The half kick that closes the step, in this gravity.
    pub fn close(&mut self, gravity: Vec3, kicks: &mut GravityKicks) {
        *self = Self {
            before: VelocityTime::Open,
            last: true,
            drifts: false,
            fall: kicks.next(gravity.as_dvec3() * f64::from(0.5 * self.substep)),
            start: 1.0,
            end: 1.0,
            ..Self::opening(self.substep)
        };
    }
}

/// s: in shorter substeps what positions lack is carried on. A tenth of a metre from a body's origin coordinates are rounded by up to 4 nm: over
/// substeps so long that is 0.015 mm/s, over a hundredth of them 1.5 mm/s.
const SHORT: f32 = 2.5e-4;

/// Changes the velocities by the forces at the latest positions, moves the nodes by them, and puts the pinned ones where
/// they are led, along the axes that they are held along.
pub(super) fn kick_and_drift(body: &mut System, request: &StepRequest, part: &Part, team: &Team) -> Survey {
    let node_count = body.node_count();
    let inertia = Inertia::of(body.uniform_inverse_mass, &body.inverse_masses, body.scaling.as_deref());
    if part.drifts && part.substep < SHORT {
        body.state.carry();
    }
    let state = body.state.substep();
    let kick = Kick {
        applied: body.applied.as_ref().filter(|_| body.forces_applied),
        ..part.kick(request.gravity, inertia, body.damping.as_ref())
    };
    let tiles = tile_count(node_count);
    let sleeper = body.sleeper.as_deref();
    let is_asleep = |tile: usize| sleeper.is_some_and(|sleeper| sleeper.is_asleep(tile));
    let forces_known = part.before == VelocityTime::Current && body.forces_current;
    if !forces_known {
        body.forces.write_awake_records(state.positions, is_asleep, team);
        body.forces.find(state.positions, team);
    }
    let forces = body.forces.sum();
    if part.before == VelocityTime::Open
        && let Some(predicted) = &mut body.predicted_velocities
    {
        let closed = Closed {
            forces,
            kernel: body.kernel,
            kick: Kick {
                duration: 0.5 * part.substep,
                half: true,
                fall: part.fall * (0.5 * part.substep / part.duration),
                ..kick
            },
            positions: state.positions,
            velocities: state.velocities,
        };
        let written = (predicted.tiles_mut(), body.pins.tiles_mut());
        team.pass(tiles, written, |tile, (mut predicted, pins)| {
            if is_asleep(tile) {
                predicted.iter_mut().for_each(|axis| axis.fill(0.0));
                return;
            }
            closed.write(tile, tile_nodes(tile, node_count), &mut predicted, pins);
        });
    }
    let (first_remainders, remainders) = match state.remainders {
        None => (None, None),
        Some([first, newest]) => (Some(&*first), Some(newest)),
    };
    let pass = Pass {
        forces,
        kernel: body.kernel,
        masses: &body.masses,
        request,
        part,
        kick,
        positions: body.forces.view(state.positions),
        first_velocities: (part.before != VelocityTime::Open && part.before != VelocityTime::Closed)
            .then_some(state.first_velocities),
        first_forces: forces_known.then_some(state.first_forces),
        damped_velocities: match part.before {
            VelocityTime::Open => body.predicted_velocities.as_ref(),
            _ => body.forces.springs.damped().then_some(state.first_velocities),
        },
        first_remainders: first_remainders.filter(|_| part.before != VelocityTime::Open),
    };
    let written = (
        state.velocities.tiles_mut(),
        state.next_positions.tiles_mut(),
        state.forces.tiles_mut(),
        remainders
            .filter(|_| part.drifts)
            .map(|remainders| remainders.tiles_mut()),
        body.pins.tiles_mut(),
        Items::new(&mut body.surveys),
    );
    team.pass(
        tiles,
        written,
        |tile, (velocities, next_positions, forces, remainders, pins, survey): (_, _, _, _, _, &mut Survey)| {
            if is_asleep(tile) {
                *survey = Survey::NOTHING;
                return;
            }
            let mut written = Written {
                velocities,
                next_positions,
                forces,
                remainders,
                pins,
            };
            let mut sums = TileForces::ZERO;
            *survey = pass.take(tile, tile_nodes(tile, node_count), &mut written, &mut sums);
        },
    );
    body.surveys.iter().copied().fold(Survey::NOTHING, Survey::and)
}

/// What all tiles of a substep read.
#[derive(Clone, Copy)]
pub(super) struct Pass<'a> {
    pub forces: Sum<'a>,
    pub kernel: ChosenKernel,
    pub masses: &'a [f32],
    pub request: &'a StepRequest<'a>,
    pub part: &'a Part,
    pub kick: Kick<'a>,
    pub positions: View<'a>,
    /// What the velocities are before the kick, where it is not what they are now.
    pub first_velocities: Option<&'a Vectors>,
    /// The spring forces, where they are known.
    pub first_forces: Option<&'a Vectors>,
    /// The velocities at the time of the positions, where springs are damped.
    pub damped_velocities: Option<&'a Vectors>,
    /// What positions lack before the drift, where it is not what they lack now.
    pub first_remainders: Option<&'a Vectors>,
}

/// What a tile of a substep writes.
pub(super) struct Written<'a> {
    pub velocities: [&'a mut [f32]; 3],
    pub next_positions: [&'a mut [f32]; 3],
    /// Where spring forces are kept; nothing where the nodes drift.
    pub forces: [&'a mut [f32]; 3],
    /// What positions lack, where that is carried on.
    pub remainders: Option<[&'a mut [f32]; 3]>,
    pub pins: &'a mut [Pin],
}

impl Pass<'_> {
    /// Takes it for a tile; `forces` are for its use.
    pub fn take(&self, tile: usize, nodes: Range<usize>, written: &mut Written, forces: &mut TileForces) -> Survey {
        if let Some(first_forces) = self.first_forces {
            for (forces, first) in forces.axes_mut().into_iter().zip(first_forces.slices(nodes.clone())) {
                forces[..nodes.len()].copy_from_slice(first);
            }
        } else {
            let [vx, vy, vz] = match self.first_velocities {
                Some(velocities) => velocities.slices(nodes.clone()),
                None => written.velocities.each_ref().map(|axis| &**axis),
            };
            let [x, y, z] = written.next_positions.each_ref().map(|axis| &**axis);
            let motion = Motion {
                positions: self.positions,
                velocities: self.damped_velocities,
                soon: [vx, vy, vz, x, y, z],
            };
            self.forces.write(tile, nodes.clone(), &motion, forces);
        }
        if let Some(first_velocities) = self.first_velocities {
            copy_axes(&mut written.velocities, first_velocities.slices(nodes.clone()));
        }
        if let (Some(first), Some(remainders)) = (self.first_remainders, &mut written.remainders) {
            copy_axes(remainders, first.slices(nodes.clone()));
        }
        if !self.part.drifts {
            copy_axes(&mut written.forces, forces.axes().map(|axis| &axis[..nodes.len()]));
        }
        self.feel_pins(&nodes, forces, written.pins);
        self.kernel.run(TileKick {
            kick: &self.kick,
            nodes: nodes.clone(),
            forces,
            velocities: written.velocities.each_mut().map(|axis| &mut **axis),
            drift: self.part.drifts.then(|| Drift {
                positions: self.positions.slices(nodes.clone()),
                next_positions: written.next_positions.each_mut().map(|axis| &mut **axis),
                remainders: (written.remainders.as_mut()).map(|axes| axes.each_mut().map(|axis| &mut **axis)),
            }),
        });
        self.lead_pins(&nodes, written);
        let positions = self.part.last.then(|| {
            if self.part.drifts {
                written.next_positions.each_ref().map(|axis| &**axis)
            } else {
                self.positions.slices(nodes)
            }
        });
        look(
            self.kernel,
            written.velocities.each_ref().map(|axis| &**axis),
            positions,
        )
    }

    /// Adds up what holds the pinned nodes.
    fn feel_pins(&self, nodes: &Range<usize>, forces: &TileForces, pins: &mut [Pin]) {
        for pin in pins {
            let node = pin.node as usize;
            let weight = self.request.gravity * self.masses[node];
            pin.force_sum -= (forces.get(node - nodes.start) + weight).as_dvec3() * self.part.share;
        }
    }

    /// Puts the pinned nodes where they are led.
    fn lead_pins(&self, nodes: &Range<usize>, written: &mut Written) {
        for pin in &*written.pins {
            let place = pin.node as usize - nodes.start;
            let velocity = pin.travel / self.request.dt;
            pin.put(&mut written.velocities, place, velocity);
            if self.part.drifts {
                pin.put(&mut written.next_positions, place, pin.place(self.part.end));
                if let Some(remainders) = &mut written.remainders {
                    pin.put(remainders, place, Vec3::ZERO);
                }
            }
        }
    }
}
