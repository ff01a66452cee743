//! Keeps a body that VERLET moves from gaining energy that nobody put in.
//!
//! Leapfrog conserves the energy of a linear oscillator at any substep below the limit, but not that of a spring that turns by a good
//! part of a radian within a substep, as compressed springs do when their ends pass each other. Such a body gains a little energy each
//! time, and without damping it gains without end. So every 80 substeps or so the energy is compared with a reference: the energy at the
//! first comparison, plus the work of forces, pins and tools since. Excess energy is taken off the velocities. A body that often has
//! some takes shorter substeps. Bodies that take their substeps together share one account: contacts and attachments hand energy on between
//! them, and gain none.
//!
//! Kinetic plus elastic energy would not do: it oscillates by `(h omega)²/4` in a linear mode that leapfrog follows without a fault. The
//! monitor measures the shadow energy of leapfrog, to order 4 in the substep `h`. Let `v⁻⁻`, `v⁻` and `v⁺` be three successive half-step
//! velocities, and let the positions lie between the last two. Then the shadow energy is
//!
//! `V + Σ m/2 (v⁻·v⁺ + (v⁻·v⁻ - v⁻⁻·v⁺) / 6) = K + V + h² (v·V''·v / 12 - f·f / 24m) + O(h⁴)`.
//!
//! It needs no forces beside those of the closing kick, and it is exactly constant in every linear mode: the mode has `S = V + Σ m/2 v⁻·v⁺`
//! and `(h omega)² S / 6` of it. Where nonlinear forces move energy between slow and fast modes, it is constant up to order 4.
//!
//! The mean of `K + V` is smaller by about `h² f·f / 24m`, so one reference bounds the energy at any substep. (Only the mean of modes whose
//! `h omega` is above 1 is greater, by up to a third at 1.6, and few modes of a body are so fast.)

use glam::DVec3;

use super::System;
use super::energy_sums::{Energies, TileSums};
use super::step_request::{Carry, StepRequest};
use super::substep::{Part, VelocityTime};
use crate::threads::Team;

/// The account of one step.
#[derive(Clone, Copy)]
pub(crate) struct Account<'a> {
    request: &'a StepRequest<'a>,
    substeps: u32,
    /// Whether the body is watched.
    pub watches: bool,
    /// Whether the step ends with a comparison.
    pub compares: bool,
}

impl<'a> Account<'a> {
    pub fn new(body: &System, carry: &Carry, request: &'a StepRequest<'a>, substeps: u32) -> Self {
        // What sleeps in part is not alone; fixed substeps are taken as they are.
        let watches = request.substeps == 0 && !body.sleeps();
        Self {
            request,
            substeps,
            watches,
            compares: watches && carry.energy.is_due(substeps),
        }
    }

    /// Has a new account begin with the energy with which the body is set in motion. What leapfrog adds to that
    /// in fast modes is there from the first substep on.
    pub fn open(&self, body: &mut System, carry: &mut Carry, part: &Part, team: &Team) {
        let are_closed = matches!(part.before, VelocityTime::Current | VelocityTime::Closed);
        // What is taken off a body that a tool holds would be missing in what that feels.
        if !(self.watches && are_closed && carry.energy.is_new()) || body.is_grasped() {
            return;
        }
        let gravity = self.request.gravity;
        if let Some(energy) = TileSums::at_start(body, part, carry, gravity, team) {
            carry.energy.open(gravity, energy);
        }
    }

    /// Keeps the velocities before the last kick, where forces are kept at the end of a step.
    pub fn keep_velocities(body: &mut System, last: &Part) {
        let state = body.state.substep();
        state.forces.copy_from(match last.before {
            VelocityTime::Current | VelocityTime::CurrentOpen => state.first_velocities,
            VelocityTime::Closed | VelocityTime::Open => state.velocities,
        });
    }

    /// Takes the step into account: what energy there is, if it ends with a comparison. `sums` are those of the open velocities.
    pub fn settle(
        &self,
        body: &mut System,
        carry: &mut Carry,
        sums: Option<TileSums>,
        team: &Team,
    ) -> Option<Energies> {
        if !self.watches {
            carry.energy.forget();
            return None;
        }
        let StepRequest { gravity, dt, .. } = *self.request;
        carry.energy.take_step(gravity, self.substeps, dt, self.work(body));
        let substep = f64::from(dt) / f64::from(self.substeps);
        sums.map(|sums| sums.close(body, carry, substep, team))
    }

    /// What forces, pins that are led and tools that move put in, J.
    fn work(&self, body: &System) -> f64 {
        let mut work = 0.0;
        let (first, (last, _)) = (body.state.positions(), body.state.newest());
        if let Some(applied) = body.applied.as_ref().filter(|_| body.forces_applied) {
            for node in (0..body.node_count()).filter(|&node| body.inverse_masses[node] > 0.0) {
                let way = last.get(node).as_dvec3() - first.get(node).as_dvec3();
                work += applied.get(node).as_dvec3().dot(way);
            }
        }
        for pin in body.pins.iter() {
            // Tools lead what they hold.
            let way = if body.is_held_by_tool(pin.node) {
                let node = pin.node as usize;
                last.get(node).as_dvec3() - first.get(node).as_dvec3()
            } else {
                pin.travel.as_dvec3()
            };
            if way != DVec3::ZERO {
                let force = pin.force_sum / f64::from(self.substeps);
                work += DVec3::select(pin.axes, force, DVec3::ZERO).dot(way);
            }
        }
        let loads = body.contacts.iter().flat_map(|contacts| contacts.loads());
        let tools = self.request.tools.iter().zip(loads).enumerate();
        for (index, (tool, load)) in tools.filter(|(_, (tool, _))| tool.moves()) {
            let received = body.contacts.as_ref().and_then(|contacts| contacts.received(index));
            if let Some(received) = received {
                work -= received;
                continue;
            }
            // Where tissue meets a tool faster than that goes, the rest is lost.
            let [way, turn] = tool.travel();
            work -= (load.impulse.dot(way) + load.angular_impulse.dot(turn)) / f64::from(self.request.dt);
        }
        work
    }
}
