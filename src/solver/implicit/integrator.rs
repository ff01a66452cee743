//! IMPLICIT and NEWTON as integrators.

use super::parts::{parts_near, run, take_part};
use super::pressed::Pressed;
use super::solution::History;
use super::{End, Implicit, Partial, Solution};
use crate::base::{Result, StateHasher, memory};
use crate::codec::{Saved, Writer};
use crate::contact::Contacts;
use crate::def::SolverReport;
use crate::forces::Forces;
use crate::geometry::Bounds;
use crate::soa::{Vectors, tile_count};
use crate::solver::System;
use crate::solver::changed::Cached;
use crate::solver::integrator::{CoupledBody, CoupledStep, IMPLICIT, Integrator, Stepped};
use crate::solver::needs::Need;
use crate::solver::newton::Newton;
use crate::solver::step_request::{StepRequest, StepStart};
use crate::solver::verlet::{StepResult, TooLong, begin};
use crate::threads::Team;

/// The energy that a solved equation has gained is taken off where there are so many, rather than that the step is taken in more.
const PARTS: u32 = 256;

impl Integrator for Implicit {
    fn step(
        &mut self,
        body: &mut System,
        request: &StepRequest,
        again: Option<StepStart>,
        team: &Team,
    ) -> Stepped<StepResult> {
        self.allowed = request.work;
        let start = again.unwrap_or_else(|| StepStart::new(body.carry, request.substeps.max(1)));
        run(body, self, request, start, team)
    }

    fn need(&mut self, body: &mut System, request: &StepRequest, _team: &Team) -> Need {
        Need {
            start: body.carry,
            substeps: parts_near(request.dt).max(request.substeps),
            masses_for: 0.0,
        }
    }

    fn begin(&mut self, body: &mut System, _walk: &mut CoupledBody, step: &CoupledStep) -> Stepped<()> {
        begin(body, &step.request.of(body));
        self.report = SolverReport::BEFORE;
        self.allowed = step.request.work;
        self.left = self.budget.min(self.allowed);
        self.grant(step.substeps);
        self.begin_anew();
        Ok(())
    }

    fn substep(&mut self, body: &mut System, _walk: &mut CoupledBody, step: &CoupledStep, index: u32) -> Stepped<()> {
        let request = &step.request.of(body);
        // There may be no more parts to try it in.
        let is_last_resort = step.is_last || step.substeps >= PARTS;
        let part_of = [index, step.substeps];
        match take_part(body, self, request, part_of, [is_last_resort, false], step.team) {
            End::Fine => Ok(()),
            _ => Err(TooLong {
                stable_substep: 0.25 * step.substep(),
            }),
        }
    }

    fn end(
        &mut self,
        body: &mut System,
        _walk: &mut CoupledBody,
        _step: &CoupledStep,
        _velocities: Bounds,
    ) -> Stepped<()> {
        self.solution.settle_deflection();
        body.state.advance();
        Ok(())
    }

    fn solution(&self) -> Option<&Solution> {
        Some(&self.solution)
    }

    fn solution_mut(&mut self) -> Option<&mut Solution> {
        Some(&mut self.solution)
    }

    fn put_back(&mut self) {
        self.stale = self.was_stale;
    }

    fn commit(&mut self) {
        self.solution.settled = 1 - self.solution.settled;
        self.told = self.report;
        self.kept = self.memory;
        self.kept.smallest = self.spectrum.known_smallest();
        self.stale |= self.kept.worn;
        self.was_stale = self.stale;
    }

    fn forget(&mut self, known: Cached) {
        let history = self.solution.current_mut();
        match known {
            Cached::Energy | Cached::EquationEnergy => history.energy = None,
            Cached::Matrix => (self.stale, self.was_stale) = (true, true),
            Cached::History => {
                (history.step, history.energy) = (0.0, None);
                history.remainders.clear();
                history.pressed.iter_mut().for_each(Pressed::forget);
                if let Some(newton) = &mut self.newton {
                    newton.forget_remainders(self.solution.settled);
                }
            }
            _ => {}
        }
    }

    fn told(&self) -> SolverReport {
        self.told
    }

    fn hash(&self, hasher: &mut StateHasher) {
        let history = self.solution.current();
        let History {
            ways,
            gains,
            remainders,
            step,
            energy,
            credit,
            pressed: _,
        } = history;
        for vectors in [ways, gains, remainders] {
            hasher.write_vectors(vectors.iter());
        }
        hasher.write_floats(&[*step, self.accuracy]);
        let [energy, size] = energy.map_or([f64::NAN; 2], |total| [total.energy, total.size]);
        hasher.write_doubles(&[energy, size, *credit]);
        hasher.write_vectors(history.pressing().into_iter().flat_map(Vectors::iter));
        hasher.write_u64(u64::from(self.order) << 32 | u64::from(self.budget));
        if let Some(newton) = &self.newton {
            newton.hash(self.solution.settled, hasher);
        }
        hasher.write_u64(u64::from(self.stale));
        if !self.stale {
            hasher.write_u64(self.kept.smallest.to_bits());
            hasher.write_u64(u64::from(self.kept.fresh_products));
            self.blocks.hash(hasher);
            self.coarse.hash(hasher);
        }
    }

    fn save(&self, to: &mut Writer) {
        to.put(&[IMPLICIT]);
        Saved::save(self, to);
    }

    fn reserve_nodes(&mut self, count: usize) -> Result<()> {
        self.vectors_mut().try_for_each(|vectors| vectors.reserve(count))?;
        if self.newton.is_some() {
            return Ok(());
        }
        memory::reserve(&mut self.inertia, count)?;
        self.spectrum.reserve(count)?;
        self.blocks.reserve(count)?;
        self.coarse.reserve(count)?;
        memory::reserve(&mut self.loads, self.coarse.size() * tile_count(count))?;
        memory::reserve(&mut self.partials, tile_count(count))
    }

    fn reserve_springs(&mut self, count: usize) -> Result<()> {
        self.newton.as_mut().map_or(Ok(()), |newton| newton.make_room(count))
    }

    fn reserve_contacts(&mut self, contacts: &mut Contacts) -> Result<()> {
        let count = contacts.reserve_holds()?;
        if self.means.is_none() {
            self.means = Some(Vectors::zeros(self.pushes.len())?);
        }
        // Up to four nodes move what a contact presses.
        let nodes = (4 * count).min(self.inertia.len());
        Ok(self.stiffened.try_reserve(nodes)?)
    }

    fn prepare_cut(&mut self, forces: &Forces, more: usize) -> Result<()> {
        let roomier = |newton: &Newton| memory::boxed(newton.roomier(forces, more)?);
        self.roomier = self.newton.as_deref().map(roomier).transpose()?;
        Ok(())
    }

    fn grow(&mut self, count: usize) {
        if let Some(roomier) = self.roomier.take() {
            self.newton = Some(roomier);
        }
        self.vectors_mut().for_each(|vectors| vectors.grow(count));
        self.prepared = 0.0;
        if self.newton.is_some() {
            return;
        }
        self.inertia.resize(count, 0.0);
        self.blocks.grow(count);
        self.coarse.grow(count);
        self.loads.resize(self.coarse.size() * tile_count(count), 0.0);
        self.partials.resize(tile_count(count), Partial::default());
    }

    fn copy_motion(&mut self, source: usize, node: usize) {
        let history = self.solution.current_mut();
        for vectors in [&mut history.ways, &mut history.gains, &mut history.remainders] {
            if node < vectors.len() {
                vectors.set(node, vectors.get(source));
            }
        }
        if let Some(newton) = &mut self.newton {
            newton.copy_remainder(self.solution.settled, source, node);
        }
    }
}
