//! Internal variables of viscous and plastic elements and terms.

use glam::DVec3;

use super::Forces;
use crate::def::{RelaxationStep, Viscosity};
use crate::elements::Elements;
use crate::soa::Vectors;
use crate::terms::HistoryEvent;
use crate::threads::Team;

impl Forces {
    /// True if there are internal variables.
    pub fn has_history(&self) -> bool {
        self.elements().is_some_and(Elements::has_history) || self.auxiliary.laws().any(|law| law.has_history())
    }

    /// Restores the committed state at the start of a step.
    pub fn restore(&mut self) {
        self.elements.iter_mut().for_each(|elements| elements.restore());
        self.auxiliary
            .laws_mut()
            .for_each(|law| law.apply_event(HistoryEvent::Restore));
    }

    /// Commits the state of the step in progress.
    pub fn commit(&mut self) {
        self.elements.iter_mut().for_each(|elements| elements.commit());
        self.auxiliary
            .laws_mut()
            .for_each(|law| law.apply_event(HistoryEvent::Commit));
    }

    /// Prepares an implicit equation for the end of a step of this length, s.
    pub fn predict(&mut self, time: f64) {
        self.elements.iter_mut().for_each(|elements| elements.predict(time));
        self.auxiliary
            .laws_mut()
            .for_each(|law| law.apply_event(HistoryEvent::Predict(time)));
    }

    /// Advances by `time` seconds the decay of pressure offsets that cuts left, with nodes at `positions`. Returns true
    /// if there were any.
    pub fn decay_offsets(&mut self, time: f32, positions: &Vectors, team: &Team) -> bool {
        let elements = self.elements.as_mut();
        if !elements.is_some_and(|elements| elements.add_fade_time(f64::from(time))) {
            return false;
        }
        self.write_records(positions, team);
        if let (Some(elements), Some(records)) = (&mut self.elements, &self.records) {
            elements.fade(self.kernel, records.as_slice(), team);
        }
        true
    }

    /// Advances the internal variables by a substep of `time` seconds that ends at `positions`.
    pub fn advance(&mut self, time: f64, positions: &Vectors, team: &Team) {
        self.advance_by(positions, |viscosity| viscosity.over(time), team);
    }

    /// Recomputes the elastic state at `positions` after parameters have changed. Maxwell branches keep their stress.
    pub fn recompute_elastic_state(&mut self, positions: &Vectors) {
        if self.has_history() {
            self.advance_by(positions, |_| RelaxationStep::IDENTITY, &Team::alone());
            self.commit();
        }
    }

    /// Commits a fully relaxed viscous state at `positions`.
    pub fn commit_relaxed(&mut self, positions: &Vectors) {
        self.set_relaxed(positions);
        self.commit();
    }

    /// Sets a fully relaxed viscous state at `positions` until [`Self::restore`].
    pub fn set_relaxed(&mut self, positions: &Vectors) {
        self.elements
            .iter_mut()
            .for_each(|elements| elements.disable_pressure_offsets());
        self.advance_by(positions, |_| RelaxationStep::RELAXED, &Team::alone());
    }

    /// True if any element would yield at these positions.
    pub fn would_yield(&self, at: impl Fn(usize) -> DVec3) -> bool {
        self.elements().is_some_and(|elements| elements.yield_at(at))
    }

    /// Advances the internal variables to `positions` by this relaxation.
    fn advance_by(&mut self, positions: &Vectors, relaxation: impl Fn(Viscosity) -> RelaxationStep, team: &Team) {
        if !self.has_history() {
            return;
        }
        if self.elements().is_some_and(Elements::has_history) {
            self.write_records(positions, team);
        }
        if let (Some(elements), Some(records)) = (&mut self.elements, &self.records) {
            elements.advance(self.kernel, records.as_slice(), &relaxation, team);
        }
        if let Some(terms) = &mut self.auxiliary.terms {
            terms.advance(positions, relaxation, team);
        }
    }
}
