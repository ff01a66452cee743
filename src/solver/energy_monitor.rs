//! Keeps a body with VERLET from gaining energy without work.
//!
//! Leapfrog conserves the energy of a linear oscillator at any substep below the limit. It does not conserve the energy
//! of a spring that turns by a large part of a radian within a substep. Compressed springs do so when their ends pass
//! each other. Such a body gains a little energy each time, and without damping the gain is unbounded. The monitor
//! compares the energy with a reference about every 80 substeps. The reference is the energy at the first comparison,
//! plus the work of forces, pins and tools since. Excess energy is removed from the velocities. A body with frequent
//! excess takes shorter substeps. Bodies that take their substeps together share one account: contacts and attachments
//! transfer energy between them without gain.
//!
//! Kinetic plus elastic energy is not suitable: it oscillates by `(h omega)²/4` in a linear mode that leapfrog follows
//! exactly. The monitor measures the shadow energy of leapfrog, to order 4 in the substep `h`. Let `v⁻⁻`, `v⁻` and `v⁺`
//! be three successive half-step velocities, and let the positions lie between the last two. Then the shadow energy is
//!
//! `V + Σ m/2 (v⁻·v⁺ + (v⁻·v⁻ - v⁻⁻·v⁺) / 6) = K + V + h² (v·V''·v / 12 - f·f / 24m) + O(h⁴)`.
//!
//! It needs no forces except those of the closing kick. It is exactly constant in every linear mode, where it is `S +
//! (h omega)² S / 6` with `S = V + Σ m/2 v⁻·v⁺`. If nonlinear forces move energy between slow and fast modes, it is
//! constant up to order 4.
//!
//! The mean of `K + V` is smaller by about `h² f·f / 24m`, so one reference bounds the energy at any substep. (Only the
//! mean of modes with `h omega` above 1 is greater, by up to a third at 1.6, and few modes of a body are that fast.)

use glam::DVec3;

use super::System;
use super::energy_sums::{Energies, TileSums};
use super::step_request::{IntegratorState, StepRequest};
use super::substep::{SubstepKick, VelocityTime};
use crate::threads::Team;

/// Energy monitoring during one step.
#[derive(Clone, Copy)]
pub(crate) struct EnergyMonitor<'a> {
    request: &'a StepRequest<'a>,
    substeps: u32,
    /// True if the body is monitored.
    pub is_monitored: bool,
    /// True if the step ends with a comparison.
    pub compares: bool,
}

impl<'a> EnergyMonitor<'a> {
    pub fn new(body: &System, carry: &IntegratorState, request: &'a StepRequest<'a>, substeps: u32) -> Self {
        // Partly sleeping bodies exchange energy with sleeping tiles. Fixed substeps are not monitored.
        let is_monitored = request.substeps == 0 && !body.any_tile_asleep();
        Self {
            request,
            substeps,
            is_monitored,
            compares: is_monitored && carry.energy.is_due(substeps),
        }
    }

    /// Starts a new account with the initial energy of the body. The energy that leapfrog adds in fast modes is thus
    /// included from the first substep on.
    pub fn start(&self, body: &mut System, carry: &mut IntegratorState, substep_kick: &SubstepKick, team: &Team) {
        let are_synchronized = matches!(
            substep_kick.velocity_time,
            VelocityTime::Current | VelocityTime::InProgress
        );
        // Energy removed from a body that is attached to a tool would falsify the tool's wrench.
        if !(self.is_monitored && are_synchronized && carry.energy.is_new()) || body.has_tool_attachments() {
            return;
        }
        let gravity = self.request.gravity;
        if let Some(energy) = TileSums::at_start(body, substep_kick, carry, gravity, team) {
            carry.energy.start(gravity, energy);
        }
    }

    /// Stores the velocities before the last kick in the buffer of the end-of-step forces.
    pub fn store_previous_velocities(body: &mut System, last: &SubstepKick) {
        let state = body.state.substep();
        state.forces.copy_from(match last.velocity_time {
            VelocityTime::Current | VelocityTime::CurrentLagging => state.first_velocities,
            VelocityTime::InProgress | VelocityTime::InProgressLagging => state.velocities,
        });
    }

    /// Adds the step to the account. Returns the energies if the step ends with a comparison. `sums` are those of the
    /// velocities before the closing half kick.
    pub fn record_step(
        &self,
        body: &mut System,
        carry: &mut IntegratorState,
        sums: Option<TileSums>,
        team: &Team,
    ) -> Option<Energies> {
        if !self.is_monitored {
            carry.energy.forget();
            return None;
        }
        let StepRequest { gravity, dt, .. } = *self.request;
        carry.energy.record_step(gravity, self.substeps, dt, self.work(body));
        let substep = f64::from(dt) / f64::from(self.substeps);
        sums.map(|sums| sums.after_flush(body, carry, substep, team))
    }

    /// The work of applied forces, moving pins and moving tools, J.
    fn work(&self, body: &System) -> f64 {
        let mut work = 0.0;
        let (first, (last, _)) = (body.state.positions(), body.state.newest());
        if let Some(applied) = body.applied.as_ref().filter(|_| body.forces_applied) {
            for node in (0..body.node_count()).filter(|&node| body.inverse_masses[node] > 0.0) {
                let displacement = last.get(node).as_dvec3() - first.get(node).as_dvec3();
                work += applied.get(node).as_dvec3().dot(displacement);
            }
        }
        for pin in body.pins.iter() {
            // Tools move the nodes attached to them.
            let displacement = if body.is_attached_node(pin.node) {
                let node = pin.node as usize;
                last.get(node).as_dvec3() - first.get(node).as_dvec3()
            } else {
                pin.travel.as_dvec3()
            };
            if displacement != DVec3::ZERO {
                let force = pin.force_sum / f64::from(self.substeps);
                work += DVec3::select(pin.axes, force, DVec3::ZERO).dot(displacement);
            }
        }
        let contacts = body.contacts.as_deref();
        work + contacts.map_or(0.0, |contacts| {
            contacts.work_of_tools(self.request.tools, self.request.dt)
        })
    }
}
