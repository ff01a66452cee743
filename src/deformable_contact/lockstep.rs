//! Bodies that touch each other, or themselves, take their substeps together: what one does to the other is part of each.
//!
//! All take as many as the one that needs most: one of VERLET what its stability asks for, one of the other solvers substeps of 1 ms as
//! near a tool, and shorter ones where stiff bodies press each other.

use super::DeformableContact;
use crate::solver::{
    Account, CoupledBody, CoupledStep, Energies, EnergyAccount, Outcome, RESERVE, Span, StepRequest, StepResult,
    StepStart, System, Systems, TooLong, finish, relieve_squeezed, slow_down, substeps_needed,
};
use crate::threads::Team;

/// How often a step is begun again with shorter substeps, because its own motion made them necessary.
const ATTEMPTS: u32 = 6;

/// The bodies that go together, in islands, as `tissue` tells; `walks` has a place for each body.
pub(crate) struct CoupledGroup<'a> {
    pub tissue: &'a mut DeformableContact,
    pub walks: &'a mut [Option<CoupledBody>],
    pub request: &'a StepRequest<'a>,
    pub team: &'a Team<'a>,
}

impl CoupledGroup<'_> {
    /// Takes the step of all islands without making it current.
    pub fn attempt(&mut self, bodies: &mut impl Systems, outcomes: &mut [Option<Outcome>]) {
        self.tissue.pushes.begin();
        self.tissue.touches.begin();
        self.tissue.touching.begin();
        for island in 0..self.tissue.islands.count() {
            if self.tissue.is_asleep(island, bodies) {
                for &place in self.tissue.islands.members(island) {
                    outcomes[place as usize] = Some(Outcome::Asleep);
                }
                continue;
            }
            self.attempt_island(island, bodies, outcomes);
        }
    }

    fn attempt_island(&mut self, island: usize, bodies: &mut impl Systems, outcomes: &mut [Option<Outcome>]) {
        let request = self.request;
        let [mut substeps, needed] = self.set_out(island, bodies);
        if substeps == 0 {
            return;
        }
        let CoupledGroup { tissue, walks, .. } = self;
        tissue
            .bonds
            .attempt(bodies, |place| walks.get(place).is_some_and(Option::is_some));
        substeps = substeps.max(tissue.bonds.substeps(request.dt));
        let allowed = if request.substeps > 0 { 0 } else { ATTEMPTS };
        let mut stable_substep = f32::INFINITY;
        let mut is_taken = false;
        let is_beyond = if request.substeps == 0 && needed > request.max_substeps {
            stable_substep = stable_for(request, needed);
            true
        } else if substeps > request.most_parts() {
            stable_substep = stable_for(request, substeps);
            true
        } else {
            false
        };
        for attempt in (0..=allowed).filter(|_| !is_beyond) {
            match self.go(island, bodies, substeps, attempt == allowed) {
                Ok(()) => {
                    is_taken = true;
                    break;
                }
                Err(found) => {
                    stable_substep = stable_substep.min(found.stable_substep);
                    let mut wanted = substeps_needed(request, stable_substep).min(f64::from(u32::MAX)) as u32;
                    if let Some(relieved) = self.relieve(island, bodies, found.stable_substep) {
                        wanted = relieved;
                        stable_substep = stable_for(request, relieved);
                    }
                    substeps = wanted.max(substeps.saturating_add(substeps / 4 + 1));
                    if request.substeps == 0 && substeps > request.max_substeps {
                        break;
                    }
                }
            }
        }
        self.tissue.bonds.unload(bodies);
        if is_taken {
            self.settle_energy(island, bodies, substeps);
        }
        let mut is_whole = is_taken;
        let members = self.tissue.islands.members(island).iter();
        let wanted = members.filter_map(|&place| Some(self.walks[place as usize].as_ref()?.wanted));
        let most_wanted = wanted.max();
        for &place in self.tissue.islands.members(island) {
            let place = place as usize;
            let (Some(walk), Some(body)) = (self.walks[place].take(), bodies.at(place)) else {
                continue;
            };
            outcomes[place] = Some(if is_taken {
                let taken = StepResult {
                    start: StepStart::new(walk.start, substeps),
                    carry: walk.carry,
                    finite: body.state.newest_is_finite(),
                };
                finish(body, &taken, 0.0)
            } else {
                // What limits all is told of the body that asked for most.
                let limits = Some(walk.wanted) == most_wanted;
                Outcome::Unstable {
                    stable_substep: if limits { stable_substep } else { f32::INFINITY },
                    error: 0.0,
                }
            });
            is_whole &= matches!(outcomes[place], Some(Outcome::Done { .. }));
        }
        if is_whole {
            self.tissue.end_island();
        }
    }

    /// Takes a step that was taken into the account of the energy that bodies of VERLET have together: contacts and attachments give
    /// none.
    fn settle_energy(&mut self, island: usize, bodies: &mut impl Systems, substeps: u32) {
        let Self {
            tissue,
            walks,
            request,
            team,
        } = self;
        let members = tissue.islands.members(island);
        let (mut common, mut found) = (None::<EnergyAccount>, Energies::default());
        let of_bonds = tissue.bonds.energy();
        let [mut work, stored] = of_bonds.unwrap_or_default();
        for &place in members {
            let place = place as usize;
            let (Some(walk), Some(body)) = (&mut walks[place], bodies.at_mut(place)) else {
                continue;
            };
            let request = &request.of(body).weighed(body);
            let account = Account::new(body, &walk.carry, request, substeps);
            let energies = account.settle(body, &mut walk.carry, walk.sums, team);
            walk.carry.energy.gain(std::mem::take(&mut work));
            if of_bonds.is_none() || !body.integrator.takes_half_kicks() {
                walk.carry.energy.forget();
            }
            if let Some(energies) = energies {
                walk.own = energies.own;
                found = found.plus(&energies);
                match &mut common {
                    Some(common) => common.join(&walk.carry.energy),
                    None => common = Some(walk.carry.energy),
                }
            }
        }
        let Some(mut common) = common else { return };
        found.all += stored;
        let excess = common.compare(&found);
        let mut removed = 0.0;
        for &place in members.iter().filter(|_| excess > 0.0) {
            if let (Some(walk), Some(body)) = (&walks[place as usize], bodies.at_mut(place as usize)) {
                removed += slow_down(body, excess * walk.own / found.own, false);
            }
        }
        common.refine(removed);
        for &place in members {
            if let Some(walk) = &mut walks[place as usize] {
                walk.carry.energy.go_on_with(&common);
            }
        }
    }

    /// Makes a way for each body of an island: in how many substeps, 0: it has none, and how many of them VERLET needs.
    fn set_out(&mut self, island: usize, bodies: &mut impl Systems) -> [u32; 2] {
        let [mut substeps, mut needed] = [0; 2];
        let group = match self.tissue.islands.members(island) {
            [_] => 0,
            members => members.iter().fold(1, |group: u64, &place| {
                (group ^ u64::from(place)).wrapping_mul(0x0100_0000_01b3)
            }),
        };
        for &place in self.tissue.islands.members(island) {
            let place = place as usize;
            if let Some(body) = bodies.at_mut(place) {
                let request = &self.request.of(body);
                let begun = CoupledBody::of(body, request, group, self.team);
                substeps = substeps.max(begun.wanted);
                if body.integrator.is_limited_by_stability() {
                    needed = needed.max(begun.wanted);
                }
                body.integrator.put_back();
                self.walks[place] = Some(begun);
            }
        }
        if substeps > 0 && self.request.substeps == 0 {
            // A wish, where stability is a need.
            let wished = self.tissue.substeps_wished(island, bodies, self.request.dt);
            substeps = substeps.max(wished.min(self.request.max_substeps));
        }
        [substeps, needed]
    }

    /// Makes masses for elements as the step that was tried has deformed them, where that spares substeps: how many are needed then.
    fn relieve(&mut self, island: usize, bodies: &mut impl Systems, stable_substep: f32) -> Option<u32> {
        let mut relieved = None;
        for &place in self.tissue.islands.members(island) {
            let place = place as usize;
            if let (Some(walk), Some(body)) = (&mut self.walks[place], bodies.at_mut(place))
                && let Some((substeps, masses_for)) =
                    relieve_squeezed(body, &self.request.of(body), stable_substep, self.team)
            {
                walk.masses_for = masses_for;
                relieved = relieved.max(Some(substeps));
            }
        }
        relieved
    }

    /// Takes it in so many substeps, the last time that it is tried or not.
    fn go(&mut self, island: usize, bodies: &mut impl Systems, substeps: u32, is_last: bool) -> Result<(), TooLong> {
        let Self {
            tissue,
            walks,
            request,
            team,
        } = self;
        let members = tissue.islands.members(island);
        let request = &StepRequest {
            neighbor_speed: Some(tissue.fastest(island, bodies, request.gravity, request.dt)),
            ..**request
        };
        let step = &CoupledStep {
            request,
            substeps,
            compares: compares(members, walks, bodies, request, substeps),
            is_last,
            team,
        };
        tissue.bonds.begin(request.dt);
        each(bodies, walks, members, |_, body, walk| {
            (walk.carry, walk.sums) = (walk.start, None);
            body.lend(|integrator, body| integrator.begin(body, walk, step))
        })?;
        let mut moment = Span {
            duration: step.substep(),
            drifts: true,
            begins: true,
            profile: request.profile,
        };
        for index in 0..substeps {
            moment.begins = index == 0;
            tissue.bonds.load(bodies);
            each(bodies, walks, tissue.islands.members(island), |_, body, walk| {
                body.lend(|integrator, body| integrator.substep(body, walk, step, index))
            })?;
            tissue.meet(island, bodies, &moment);
            each(bodies, walks, tissue.islands.members(island), |place, body, walk| {
                let velocities = tissue.velocities(place, walk.carry.gravity.velocities);
                body.lend(|integrator, body| integrator.end(body, walk, step, velocities))
            })?;
            if request.substeps == 0 && !is_last {
                // What meets in this step was not known as it began.
                let wished = tissue.substeps_pressed_now(island, bodies, request.dt);
                let wished = wished.min(request.max_substeps.saturating_sub(1));
                if wished > substeps + substeps / 2 {
                    return Err(TooLong {
                        stable_substep: stable_for(request, wished),
                    });
                }
            }
        }
        tissue.show_early(bodies);
        moment.drifts = false;
        moment.begins = false;
        tissue.bonds.load(bodies);
        each(bodies, walks, tissue.islands.members(island), |_, body, walk| {
            body.lend(|integrator, body| integrator.close(body, walk, step))
        })?;
        tissue.meet(island, bodies, &moment);
        each(bodies, walks, tissue.islands.members(island), |_, body, _| {
            body.feel_what_grasps_handed_on(request.tools);
            Ok(())
        })
    }
}

/// The longest stable substep of what needs so many, s.
fn stable_for(request: &StepRequest, substeps: u32) -> f32 {
    request.dt / (RESERVE * substeps as f32)
}

/// Whether a step of these bodies ends with a comparison of what energy they have together.
fn compares(
    members: &[u32],
    walks: &[Option<CoupledBody>],
    bodies: &impl Systems,
    request: &StepRequest,
    substeps: u32,
) -> bool {
    let mut is_due = false;
    for &place in members {
        if let (Some(walk), Some(body)) = (&walks[place as usize], bodies.at(place as usize)) {
            let account = Account::new(body, &walk.start, request, substeps);
            if !account.watches || !body.integrator.takes_half_kicks() {
                return false;
            }
            is_due |= account.compares;
        }
    }
    is_due
}

/// Does something with each body that is on its way.
fn each(
    bodies: &mut impl Systems,
    walks: &mut [Option<CoupledBody>],
    members: &[u32],
    mut act: impl FnMut(usize, &mut System, &mut CoupledBody) -> Result<(), TooLong>,
) -> Result<(), TooLong> {
    for &place in members {
        let place = place as usize;
        if let (Some(walk), Some(body)) = (&mut walks[place], bodies.at_mut(place)) {
            act(place, body, walk)?;
        }
    }
    Ok(())
}
