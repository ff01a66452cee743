//! One substep of VERLET, tile by tile: forces, kick, drift and pins of a tile while it is in the nearest cache.

use std::ops::Range;

use glam::Vec3;

use super::attempt::StepRequest;
use super::kick::{Drift, Kick, Survey, TileKick, look};
use crate::body::{Body, InverseMasses, Pin, Vectors};
use crate::springs::{ChosenKernel, Motion, Springs, TileForces, tile_count, tile_nodes};
use crate::threads::{Items, Team};

/// Which part of a step a substep is.
pub(super) struct Part {
    /// The first kick: half of one, with the forces that the last step ended with.
    pub begins: bool,
    /// The last kick: half of one, without a drift.
    pub ends: bool,
    /// Fractions of the step at which the substep starts and ends.
    pub start: f64,
    pub end: f64,
    /// s
    pub substep: f32,
}

impl Part {
    /// Whether its kick is half of one.
    pub fn is_half(&self) -> bool {
        self.begins || self.ends
    }
}

/// Changes the velocities by the forces at the latest positions, moves the nodes by them, and puts the pinned ones where
/// they are led; `fall` is what gravity gives in this kick, m/s.
pub(super) fn kick_and_drift(body: &mut Body, request: &StepRequest, part: &Part, fall: Vec3, team: &Team) -> Survey {
    let node_count = body.node_count();
    let inverse_masses = InverseMasses::of(body.uniform_inverse_mass, &body.inverse_masses);
    let state = body.state.substep();
    let kick = Kick {
        substep: part.substep,
        half: part.is_half(),
        gravity: request.gravity,
        fall,
        inverse_masses,
        applied: body.applied.as_ref(),
        damping: body.damping.as_ref(),
    };
    let tiles = tile_count(node_count);
    if !part.begins
        && let Some(predicted) = &mut body.predicted_velocities
    {
        let prediction = Prediction {
            springs: &*body.springs,
            kernel: body.kernel,
            kick: Kick { half: true, ..kick },
            positions: state.positions,
            velocities: state.velocities,
        };
        team.pass(
            tiles,
            (predicted.tiles_mut(), body.pins.tiles_mut()),
            |tile, (predicted, pins)| {
                prediction.take(tile, tile_nodes(tile, node_count), predicted, pins);
            },
        );
    }
    let pass = Pass {
        springs: &*body.springs,
        kernel: body.kernel,
        masses: &body.masses,
        request,
        part,
        kick,
        positions: state.positions,
        predicted_velocities: body.predicted_velocities.as_ref(),
        first_velocities: state.first_velocities,
        first_forces: state.first_forces,
    };
    let written = (
        state.velocities.tiles_mut(),
        state.next_positions.tiles_mut(),
        state.forces.tiles_mut(),
        body.pins.tiles_mut(),
        Items::new(&mut body.surveys),
    );
    team.pass(
        tiles,
        written,
        |tile, (velocities, next_positions, forces, pins, survey)| {
            let mut written = Written {
                velocities,
                next_positions,
                forces,
                pins,
            };
            *survey = pass.take(tile, tile_nodes(tile, node_count), &mut written);
        },
    );
    body.surveys.iter().copied().fold(Survey::NOTHING, Survey::and)
}

/// What a first visit of damped springs reads: it finds the velocities at the time of the positions.
struct Prediction<'a> {
    springs: &'a dyn Springs,
    kernel: ChosenKernel,
    kick: Kick<'a>,
    positions: &'a Vectors,
    velocities: &'a Vectors,
}

impl Prediction<'_> {
    fn take(&self, tile: usize, nodes: Range<usize>, mut predicted: [&mut [f32]; 3], pins: &[Pin]) {
        let mut forces = TileForces::ZERO;
        let forces = &mut forces;
        let motion = Motion::at(self.positions, Some(self.velocities));
        self.springs.forces(tile, &motion, forces);
        let velocities = self.velocities.slices(nodes.clone());
        copy(&mut predicted, velocities);
        let first = nodes.start;
        self.kernel.run(TileKick {
            kick: &self.kick,
            nodes,
            forces,
            velocities: predicted.each_mut().map(|axis| &mut **axis),
            drift: None,
        });
        for pin in pins {
            let place = pin.node as usize - first;
            for (predicted, velocities) in predicted.iter_mut().zip(velocities) {
                predicted[place] = velocities[place];
            }
        }
    }
}

/// What all tiles of a substep read.
struct Pass<'a> {
    springs: &'a dyn Springs,
    kernel: ChosenKernel,
    masses: &'a [f32],
    request: &'a StepRequest<'a>,
    part: &'a Part,
    kick: Kick<'a>,
    positions: &'a Vectors,
    predicted_velocities: Option<&'a Vectors>,
    first_velocities: &'a Vectors,
    first_forces: &'a Vectors,
}

/// What a tile of a substep writes.
struct Written<'a> {
    velocities: [&'a mut [f32]; 3],
    next_positions: [&'a mut [f32]; 3],
    forces: [&'a mut [f32]; 3],
    pins: &'a mut [Pin],
}

impl Pass<'_> {
    fn take(&self, tile: usize, nodes: Range<usize>, written: &mut Written) -> Survey {
        let mut forces = TileForces::ZERO;
        let forces = &mut forces;
        if self.part.begins {
            for (forces, first) in forces
                .axes_mut()
                .into_iter()
                .zip(self.first_forces.slices(nodes.clone()))
            {
                forces[..nodes.len()].copy_from_slice(first);
            }
            copy(&mut written.velocities, self.first_velocities.slices(nodes.clone()));
        } else {
            let [vx, vy, vz] = written.velocities.each_ref().map(|axis| &**axis);
            let [x, y, z] = written.next_positions.each_ref().map(|axis| &**axis);
            let motion = Motion {
                positions: self.positions,
                velocities: self.predicted_velocities,
                soon: [vx, vy, vz, x, y, z],
            };
            self.springs.forces(tile, &motion, forces);
        }
        if self.part.ends {
            copy(&mut written.forces, forces.axes().map(|axis| &axis[..nodes.len()]));
        }
        self.feel_pins(&nodes, forces, written.pins);
        self.kernel.run(TileKick {
            kick: &self.kick,
            nodes: nodes.clone(),
            forces,
            velocities: written.velocities.each_mut().map(|axis| &mut **axis),
            drift: (!self.part.ends).then(|| Drift {
                positions: self.positions.slices(nodes.clone()),
                next_positions: written.next_positions.each_mut().map(|axis| &mut **axis),
            }),
        });
        self.lead_pins(&nodes, written);
        let positions = self.part.ends.then(|| self.positions.slices(nodes));
        look(
            self.kernel,
            written.velocities.each_ref().map(|axis| &**axis),
            positions,
        )
    }

    /// Adds up what holds the pinned nodes.
    fn feel_pins(&self, nodes: &Range<usize>, forces: &TileForces, pins: &mut [Pin]) {
        let share = if self.part.is_half() { 0.5 } else { 1.0 };
        for pin in pins {
            let node = pin.node as usize;
            let weight = self.request.gravity * self.masses[node];
            pin.force_sum -= (forces.get(node - nodes.start) + weight).as_dvec3() * share;
        }
    }

    /// Puts the pinned nodes where they are led.
    fn lead_pins(&self, nodes: &Range<usize>, written: &mut Written) {
        for pin in &*written.pins {
            let place = pin.node as usize - nodes.start;
            let velocity = pin.travel / self.request.dt;
            set(&mut written.velocities, place, velocity);
            if !self.part.ends {
                // From the start of the step, so that roundings do not add up.
                let position = pin.goal - pin.travel * (1.0 - self.part.end) as f32;
                set(&mut written.next_positions, place, position);
            }
        }
    }
}

fn copy(to: &mut [&mut [f32]; 3], from: [&[f32]; 3]) {
    for (to, from) in to.iter_mut().zip(from) {
        to.copy_from_slice(from);
    }
}

fn set(axes: &mut [&mut [f32]; 3], place: usize, value: Vec3) {
    for (axis, value) in axes.iter_mut().zip(value.to_array()) {
        axis[place] = value;
    }
}
