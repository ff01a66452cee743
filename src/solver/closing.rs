//! The half kick that closes a step, left to the next one.
//!
//! It is made of the forces at the end of the step, with which the next step begins: there both halves are one kick, and
//! the springs are visited once per substep. Until then the velocities are half a substep older than the positions. Who
//! asks for them gets them closed, to the side, so that reading changes nothing.

use std::ops::Range;

use glam::{DVec3, Vec3};

use super::System;
use super::gravity::GravityKicks;
use super::kick::{Inertia, Kick, Survey, TileKick, look};
use crate::base::{Result, memory};
use crate::codec::saved;
use crate::forces::Sum;
use crate::nodes::{NodeDamping, Pin};
use crate::simd::ChosenKernel;
use crate::soa::{TILE, TileForces, Vectors, copy_axes, tile_count, tile_nodes};
use crate::springs::Motion;
use crate::threads::{Items, Team};

/// A half kick that the velocities lack.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ClosingKick {
    /// The substep it is half of, s.
    pub substep: f32,
    pub gravity: Vec3,
}

saved! { ClosingKick { substep, gravity } }

impl ClosingKick {
    /// What gravity gives in it, m/s.
    pub fn fall(&self) -> DVec3 {
        self.gravity.as_dvec3() * (0.5 * f64::from(self.substep))
    }

    /// Whether it can be one kick with the half kick that opens a step of `substep` seconds each: forces from outside
    /// are not for both, and damping takes a different part of either.
    pub fn joins(&self, body: &System, substep: f32, gravity: Vec3) -> bool {
        let same = Self { substep, gravity } == *self;
        !body.forces_applied && (same || body.damping.is_none())
    }

    /// It as a kick of nodes with these masses; the factors of damping were prepared for its substep.
    pub(super) fn kick<'a>(&self, fall: Vec3, inertia: Inertia<'a>, damping: Option<&'a NodeDamping>) -> Kick<'a> {
        Kick {
            duration: 0.5 * self.substep,
            substep: self.substep,
            half: true,
            gravity: self.gravity,
            fall,
            inertia,
            applied: None,
            damping,
        }
    }
}

/// Whether a step of `body` may be left open. Damping along springs, comparisons and tools that hold it need velocities at its end, and
/// forces from outside end with it; those of elements, terms and cavities are not worked out by who only reads.
pub(super) fn may_stay_open(body: &System) -> bool {
    !body.forces.are_more_than_springs()
        && body.predicted_velocities.is_none()
        && body.coarse.is_none()
        && !body.forces_applied
        && !body.is_grasped()
}

/// Velocities brought up to the time of the positions, to the side.
pub(super) struct Closed<'a> {
    /// Forces at these positions.
    pub forces: Sum<'a>,
    pub kernel: ChosenKernel,
    /// Half of one.
    pub kick: Kick<'a>,
    pub positions: &'a Vectors,
    pub velocities: &'a Vectors,
}

impl Closed<'_> {
    /// Those of a tile; what is pinned keeps its own.
    pub fn write(&self, tile: usize, nodes: Range<usize>, closed: &mut [&mut [f32]; 3], pins: &[Pin]) {
        let mut forces = TileForces::ZERO;
        let forces = &mut forces;
        let damped = self.forces.springs.damped().then_some(self.velocities);
        let motion = Motion::at(self.positions, damped);
        self.forces.write(tile, nodes.clone(), &motion, forces);
        let velocities = self.velocities.slices(nodes.clone());
        copy_axes(closed, velocities);
        let first = nodes.start;
        self.kernel.run(TileKick {
            kick: &self.kick,
            nodes,
            forces,
            velocities: closed.each_mut().map(|axis| &mut **axis),
            drift: None,
        });
        for pin in pins {
            let place = pin.node as usize - first;
            let kept = velocities.map(|axis| axis[place]);
            pin.put(closed, place, kept.into());
        }
    }
}

/// Writes the closed velocities of the current state to those of the step in progress; `gravity` goes on. Where they would
/// not be finite all stay as old as they are.
pub(super) fn close_aside(body: &mut System, closing: &ClosingKick, gravity: &mut GravityKicks, team: &Team) {
    if let Some(damping) = &mut body.damping {
        damping.prepare(closing.substep);
    }
    let inertia = Inertia::of(body.uniform_inverse_mass, &body.inverse_masses, body.scaling.as_deref());
    let state = body.state.substep();
    let closed = Closed {
        forces: body.forces.sum(),
        kernel: body.kernel,
        kick: closing.kick(gravity.next(closing.fall()), inertia, body.damping.as_ref()),
        positions: state.positions,
        velocities: state.first_velocities,
    };
    let node_count = state.positions.len();
    let written = (
        state.velocities.tiles_mut(),
        body.pins.tiles_mut(),
        Items::new(&mut body.surveys),
    );
    team.pass(
        tile_count(node_count),
        written,
        |tile, (mut velocities, pins, survey)| {
            closed.write(tile, tile_nodes(tile, node_count), &mut velocities, pins);
            let velocities = velocities.each_ref().map(|axis| &**axis);
            *survey = look(closed.kernel, velocities, Some(velocities));
        },
    );
    let survey = body.surveys.iter().copied().fold(Survey::NOTHING, Survey::and);
    if survey.finite {
        gravity.velocities = survey.velocities;
    } else {
        state.velocities.copy_from(state.first_velocities);
    }
}

/// Brings the velocities of `body` up to the time of its positions, where they are older.
pub(crate) fn close(body: &mut System) {
    if let Some(closed) = close_beside(body) {
        let mut pins = std::mem::take(&mut body.pins);
        pins.iter_mut().for_each(|pin| pin.force = body.mean_force(pin));
        body.pins = pins;
        closed.commit(body);
    }
}

/// Velocities that were brought up to the time of the positions beside those that there are, until they are committed. What follows does not have to
/// be: then nothing has changed.
pub(crate) struct ClosedBeside {
    gravity: GravityKicks,
}

/// Makes them, where velocities are older.
pub(crate) fn close_beside(body: &mut System) -> Option<ClosedBeside> {
    let closing = body.carry.closing?;
    let mut gravity = body.carry.gravity;
    body.state.begin();
    close_aside(body, &closing, &mut gravity, &Team::alone());
    Some(ClosedBeside { gravity })
}

impl ClosedBeside {
    /// What holds each pin, mean over the last step, N; to be asked for while springs and masses are those of the step.
    pub fn forces(&self, body: &System) -> Result<Vec<Vec3>> {
        let mut forces = memory::reserved(body.pins.iter().count())?;
        forces.extend(body.pins.iter().map(|pin| body.mean_force(pin)));
        Ok(forces)
    }

    /// Has them be those of the body, of which no step was begun since.
    pub fn commit(self, body: &mut System) {
        body.state.commit();
        for pin in body.pins.iter_mut() {
            pin.closing_share = 0.0;
        }
        body.carry.gravity = self.gravity;
        body.carry.closing = None;
    }
}

/// What is shown some nodes and their velocities along each axis.
type See<'a> = dyn FnMut(Range<usize>, [&[f32]; 3]) + 'a;

/// Shows the velocities of `body` at the time of its positions, tile by tile; whether they are finite. Where they are not,
/// the rest is not shown.
pub(crate) fn show_closed(body: &System, closing: &ClosingKick, see: &mut See) -> bool {
    let inertia = Inertia::of(body.uniform_inverse_mass, &body.inverse_masses, body.scaling.as_deref());
    let fall = { body.carry.gravity }.next(closing.fall());
    let closed = Closed {
        forces: body.forces.sum(),
        kernel: body.kernel,
        kick: closing.kick(fall, inertia, body.damping.as_ref()),
        positions: body.state.positions(),
        velocities: body.state.velocities(),
    };
    let node_count = body.node_count();
    let mut axes = [[0.0_f32; TILE]; 3];
    (0..tile_count(node_count)).all(|tile| {
        let nodes = tile_nodes(tile, node_count);
        let mut axes = axes.each_mut().map(|axis| &mut axis[..nodes.len()]);
        axes.iter_mut().for_each(|axis| axis.fill(0.0));
        if !body.sleeper.as_ref().is_some_and(|sleeper| sleeper.is_asleep(tile)) {
            closed.write(tile, nodes.clone(), &mut axes, body.pins.of_tile(tile));
        }
        let axes = axes.map(|axis| &*axis);
        let finite = look(closed.kernel, axes, Some(axes)).finite;
        if finite {
            see(nodes, axes);
        }
        finite
    })
}

/// Changes the velocity of `node` so that closing it gives what it would give with `force` on top, N: for a spring that has
/// just been removed, or with its force turned round for one that has just been added.
pub(crate) fn make_up_for(body: &mut System, node: u32, mut force: Vec3) {
    let Some(closing) = body.carry.closing else {
        return;
    };
    if let Some(pin) = body.pins.get_mut(node) {
        pin.force -= pin.held(force) * pin.closing_share;
        force -= pin.held(force);
        if !pin.is_partial() {
            return;
        }
    }
    let node = node as usize;
    // Where damping takes nearly all of it within the half kick, there is nothing to make up for.
    const LEFT: f32 = 1e-3;
    let duration = match &body.damping {
        None => 0.5 * closing.substep,
        Some(damping) => damping.gain[node] / (1.0 - damping.loss[node]).max(LEFT),
    };
    let velocity = body.state.velocities().get(node) + force * (body.inverse_masses[node] * duration);
    if velocity.length_squared().is_finite() {
        body.state.velocities_mut().set(node, velocity);
    }
}

impl System {
    /// What holds a pinned node, mean over the last step, N.
    pub(crate) fn mean_force(&self, pin: &Pin) -> Vec3 {
        let Some(closing) = self.carry.closing.filter(|_| pin.closing_share > 0.0) else {
            return pin.force;
        };
        let node = pin.node as usize;
        let mut force = closing.gravity * self.masses[node];
        self.forces.add_spring_forces(node, self.state.positions(), &mut force);
        let force = pin.force - pin.held(force) * pin.closing_share;
        if force.is_finite() { force } else { pin.force }
    }
}
