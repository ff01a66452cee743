//! Steps of bodies that touch each other, or themselves: they take their substeps together.
//!
//! All bodies of an island take the number of substeps of the one that needs most. VERLET must be stable. Other solvers
//! take substeps of 1 ms, as near a tool, and shorter ones where stiff bodies press each other.

use super::DeformableContact;
use crate::solver::{
    CoupledBody, CoupledStep, Energies, EnergyAccount, EnergyMonitor, Outcome, RESERVE, StepRequest, StepResult,
    StepStart, SubstepSpan, SubstepTooLong, System, Systems, outcome_of, remove_kinetic_energy, scale_for_compression,
    substeps_needed,
};
use crate::threads::Team;

/// Maximum number of attempts with shorter substeps, which the motion of the step itself requires.
const ATTEMPTS: u32 = 6;

/// The islands of a step in progress. `coupled_bodies` has an entry for each body.
pub(crate) struct CoupledGroup<'a> {
    pub contact: &'a mut DeformableContact,
    pub coupled_bodies: &'a mut [Option<CoupledBody>],
    pub request: &'a StepRequest<'a>,
    pub team: &'a Team<'a>,
}

impl CoupledGroup<'_> {
    /// Attempts the step of all islands. It does not commit.
    pub fn attempt(&mut self, bodies: &mut impl Systems, outcomes: &mut [Option<Outcome>]) {
        self.contact.warm_start.begin();
        self.contact.contact_reports.begin();
        self.contact.touching_pairs.begin();
        for island in 0..self.contact.islands.count() {
            if self.contact.is_asleep(island, bodies) {
                for &body_index in self.contact.islands.members(island) {
                    outcomes[body_index as usize] = Some(Outcome::Asleep);
                }
                continue;
            }
            self.attempt_island(island, bodies, outcomes);
        }
    }

    fn attempt_island(&mut self, island: usize, bodies: &mut impl Systems, outcomes: &mut [Option<Outcome>]) {
        let request = self.request;
        let [mut substeps, needed] = self.prepare_island(island, bodies);
        if substeps == 0 {
            return;
        }
        let CoupledGroup {
            contact,
            coupled_bodies,
            ..
        } = self;
        contact.attachments.begin_group(bodies, |body_index| {
            coupled_bodies.get(body_index).is_some_and(Option::is_some)
        });
        substeps = substeps.max(contact.attachments.min_substeps(request.dt));
        let max_attempt = if request.substeps > 0 { 0 } else { ATTEMPTS };
        let mut stable_substep = f32::INFINITY;
        let mut has_succeeded = false;
        let exceeds_limit = if request.substeps == 0 && needed > request.max_substeps {
            stable_substep = stable_substep_for(request, needed);
            true
        } else if substeps > request.max_parts() {
            stable_substep = stable_substep_for(request, substeps);
            true
        } else {
            false
        };
        for attempt in (0..=max_attempt).filter(|_| !exceeds_limit) {
            match self.step_island(island, bodies, substeps, attempt == max_attempt) {
                Ok(()) => {
                    has_succeeded = true;
                    break;
                }
                Err(too_long) => {
                    stable_substep = stable_substep.min(too_long.stable_substep);
                    let mut wanted = substeps_needed(request, stable_substep).min(f64::from(u32::MAX)) as u32;
                    if let Some(relieved_substeps) =
                        self.update_squeezed_masses(island, bodies, too_long.stable_substep)
                    {
                        wanted = relieved_substeps;
                        stable_substep = stable_substep_for(request, relieved_substeps);
                    }
                    substeps = wanted.max(substeps.saturating_add(substeps / 4 + 1));
                    if request.substeps == 0 && substeps > request.max_substeps {
                        break;
                    }
                }
            }
        }
        self.contact.attachments.remove_predicted_forces(bodies);
        if has_succeeded {
            self.settle_energy(island, bodies, substeps);
        }
        let mut all_done = has_succeeded;
        let members = self.contact.islands.members(island).iter();
        let wanted = members
            .filter_map(|&body_index| Some(self.coupled_bodies[body_index as usize].as_ref()?.uncoupled_substeps));
        let max_wanted = wanted.max();
        for &body_index in self.contact.islands.members(island) {
            let body_index = body_index as usize;
            let (Some(coupled_body), Some(body)) = (self.coupled_bodies[body_index].take(), bodies.at(body_index))
            else {
                continue;
            };
            outcomes[body_index] = Some(if has_succeeded {
                let result = StepResult {
                    start: StepStart::new(coupled_body.start, substeps),
                    carry: coupled_body.carry,
                    finite: body.state.newest_is_finite(),
                };
                outcome_of(body, &result, 0.0)
            } else {
                // The limit is reported for the body that needs the most substeps.
                let is_limiting = Some(coupled_body.uncoupled_substeps) == max_wanted;
                Outcome::Unstable {
                    stable_substep: if is_limiting { stable_substep } else { f32::INFINITY },
                    error: 0.0,
                }
            });
            all_done &= matches!(outcomes[body_index], Some(Outcome::Done { .. }));
        }
        if all_done {
            self.contact.end_island();
        }
    }

    /// Updates the common energy account of VERLET bodies after a step. Contacts and attachments must not add energy.
    fn settle_energy(&mut self, island: usize, bodies: &mut impl Systems, substeps: u32) {
        let Self {
            contact,
            coupled_bodies,
            request,
            team,
        } = self;
        let members = contact.islands.members(island);
        let (mut common_account, mut island_energy) = (None::<EnergyAccount>, Energies::default());
        let attachment_energy = contact.attachments.energy();
        let [mut work, stored] = attachment_energy.unwrap_or_default();
        for &body_index in members {
            let body_index = body_index as usize;
            let (Some(coupled_body), Some(body)) = (&mut coupled_bodies[body_index], bodies.at_mut(body_index)) else {
                continue;
            };
            let request = &request.for_body(body).with_scaled_gravity(body);
            let account = EnergyMonitor::new(body, &coupled_body.carry, request, substeps);
            let energies = account.record_step(body, &mut coupled_body.carry, coupled_body.sums, team);
            coupled_body.carry.energy.gain(std::mem::take(&mut work));
            if attachment_energy.is_none() || !body.integrator.takes_half_kicks() {
                coupled_body.carry.energy.forget();
            }
            if let Some(energies) = energies {
                coupled_body.internal_kinetic = energies.internal_kinetic;
                island_energy = island_energy.plus(&energies);
                match &mut common_account {
                    Some(common_account) => common_account.join(&coupled_body.carry.energy),
                    None => common_account = Some(coupled_body.carry.energy),
                }
            }
        }
        let Some(mut common_account) = common_account else {
            return;
        };
        island_energy.all += stored;
        let excess = common_account.compare(&island_energy);
        let mut removed = 0.0;
        for &body_index in members.iter().filter(|_| excess > 0.0) {
            if let (Some(coupled_body), Some(body)) =
                (&coupled_bodies[body_index as usize], bodies.at_mut(body_index as usize))
            {
                removed += remove_kinetic_energy(
                    body,
                    excess * coupled_body.internal_kinetic / island_energy.internal_kinetic,
                    false,
                );
            }
        }
        common_account.refine(removed);
        for &body_index in members {
            if let Some(coupled_body) = &mut coupled_bodies[body_index as usize] {
                coupled_body.carry.energy.adopt_common(&common_account);
            }
        }
    }

    /// Prepares each body of an island. Returns the number of substeps, 0 if no body takes any, and the number that
    /// VERLET needs.
    fn prepare_island(&mut self, island: usize, bodies: &mut impl Systems) -> [u32; 2] {
        let [mut substeps, mut needed] = [0; 2];
        let group = match self.contact.islands.members(island) {
            [_] => 0,
            members => members.iter().fold(1, |group: u64, &body_index| {
                (group ^ u64::from(body_index)).wrapping_mul(0x0100_0000_01b3)
            }),
        };
        for &body_index in self.contact.islands.members(island) {
            let body_index = body_index as usize;
            if let Some(body) = bodies.at_mut(body_index) {
                let request = &self.request.for_body(body);
                let coupled_body = CoupledBody::of(body, request, group, self.team);
                substeps = substeps.max(coupled_body.uncoupled_substeps);
                if body.integrator.is_limited_by_stability() {
                    needed = needed.max(coupled_body.uncoupled_substeps);
                }
                body.integrator.rollback();
                self.coupled_bodies[body_index] = Some(coupled_body);
            }
        }
        if substeps > 0 && self.request.substeps == 0 {
            // Contact prefers this number of substeps. Stability does not require it.
            let wanted_substeps = self.contact.wanted_substeps(island, bodies, self.request.dt);
            substeps = substeps.max(wanted_substeps.min(self.request.max_substeps));
        }
        [substeps, needed]
    }

    /// Scales masses of elements as deformed by the last attempt, if that saves substeps. Returns the number of
    /// substeps then needed.
    fn update_squeezed_masses(&mut self, island: usize, bodies: &mut impl Systems, stable_substep: f32) -> Option<u32> {
        let mut relieved_substeps = None;
        for &body_index in self.contact.islands.members(island) {
            let body_index = body_index as usize;
            if let (Some(coupled_body), Some(body)) = (&mut self.coupled_bodies[body_index], bodies.at_mut(body_index))
                && let Some((substeps, scaling_substep)) =
                    scale_for_compression(body, &self.request.for_body(body), stable_substep, self.team)
            {
                coupled_body.scaling_substep = scaling_substep;
                relieved_substeps = relieved_substeps.max(Some(substeps));
            }
        }
        relieved_substeps
    }

    /// Steps an island in this number of substeps. `is_last` marks the last attempt.
    fn step_island(
        &mut self,
        island: usize,
        bodies: &mut impl Systems,
        substeps: u32,
        is_last: bool,
    ) -> Result<(), SubstepTooLong> {
        let Self {
            contact,
            coupled_bodies,
            request,
            team,
        } = self;
        let members = contact.islands.members(island);
        let request = &StepRequest {
            neighbor_speed: Some(contact.max_speed(island, bodies, request.gravity, request.dt)),
            ..**request
        };
        let step = &CoupledStep {
            request,
            substeps,
            compares: needs_energy_comparison(members, coupled_bodies, bodies, request, substeps),
            is_last,
            team,
        };
        contact.attachments.begin_step(request.dt);
        for_each_body(bodies, coupled_bodies, members, |_, body, coupled_body| {
            (coupled_body.carry, coupled_body.sums) = (coupled_body.start, None);
            body.with_integrator(|integrator, body| integrator.begin(body, coupled_body, step))
        })?;
        let mut span = SubstepSpan {
            duration: step.substep(),
            drifts: true,
            begins: true,
            profile: request.profile,
        };
        for index in 0..substeps {
            span.begins = index == 0;
            contact.attachments.apply_predicted_forces(bodies);
            for_each_body(
                bodies,
                coupled_bodies,
                contact.islands.members(island),
                |_, body, coupled_body| {
                    body.with_integrator(|integrator, body| integrator.substep(body, coupled_body, step, index))
                },
            )?;
            contact.resolve_contacts(island, bodies, &span);
            for_each_body(
                bodies,
                coupled_bodies,
                contact.islands.members(island),
                |body_index, body, coupled_body| {
                    let velocities = contact.velocity_bounds(body_index, coupled_body.carry.gravity.velocities);
                    body.with_integrator(|integrator, body| integrator.end(body, coupled_body, step, velocities))
                },
            )?;
            if request.substeps == 0 && !is_last {
                // Contacts that begin in this step may need more substeps.
                let wanted_substeps = contact.substeps_for_current_contacts(island, bodies, request.dt);
                let wanted_substeps = wanted_substeps.min(request.max_substeps.saturating_sub(1));
                if wanted_substeps > substeps + substeps / 2 {
                    return Err(SubstepTooLong {
                        stable_substep: stable_substep_for(request, wanted_substeps),
                    });
                }
            }
        }
        contact.show_early_velocities(bodies);
        span.drifts = false;
        span.begins = false;
        contact.attachments.apply_predicted_forces(bodies);
        for_each_body(
            bodies,
            coupled_bodies,
            contact.islands.members(island),
            |_, body, coupled_body| {
                body.with_integrator(|integrator, body| integrator.closing_half_kick(body, coupled_body, step))
            },
        )?;
        contact.resolve_contacts(island, bodies, &span);
        for_each_body(bodies, coupled_bodies, contact.islands.members(island), |_, body, _| {
            body.accumulate_pair_reactions(request.tools);
            Ok(())
        })
    }
}

/// Returns the stable substep that corresponds to this number of substeps, s.
fn stable_substep_for(request: &StepRequest, substeps: u32) -> f32 {
    request.dt / (RESERVE * substeps as f32)
}

/// True if the step of these bodies ends with a comparison of their common energy.
fn needs_energy_comparison(
    members: &[u32],
    coupled_bodies: &[Option<CoupledBody>],
    bodies: &impl Systems,
    request: &StepRequest,
    substeps: u32,
) -> bool {
    let mut is_due = false;
    for &body_index in members {
        if let (Some(coupled_body), Some(body)) = (&coupled_bodies[body_index as usize], bodies.at(body_index as usize))
        {
            let account = EnergyMonitor::new(body, &coupled_body.start, request, substeps);
            if !account.is_monitored || !body.integrator.takes_half_kicks() {
                return false;
            }
            is_due |= account.compares;
        }
    }
    is_due
}

/// Calls `f` with each body of an island that takes the step.
fn for_each_body(
    bodies: &mut impl Systems,
    coupled_bodies: &mut [Option<CoupledBody>],
    members: &[u32],
    mut f: impl FnMut(usize, &mut System, &mut CoupledBody) -> Result<(), SubstepTooLong>,
) -> Result<(), SubstepTooLong> {
    for &body_index in members {
        let body_index = body_index as usize;
        if let (Some(coupled_body), Some(body)) = (&mut coupled_bodies[body_index], bodies.at_mut(body_index)) {
            f(body_index, body, coupled_body)?;
        }
    }
    Ok(())
}
