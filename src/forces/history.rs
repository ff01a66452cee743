//! What a body remembers of how it was deformed: elements and terms that are viscous, or set.

use glam::DVec3;

use super::Forces;
use crate::def::{RelaxationStep, Viscosity};
use crate::elements::Elements;
use crate::soa::Vectors;
use crate::terms::Event;
use crate::threads::Team;

impl Forces {
    /// Whether anything is remembered.
    pub fn remember(&self) -> bool {
        self.elements().is_some_and(Elements::remember) || self.beside.laws().any(|law| law.remembers())
    }

    /// A step begins, from what is current.
    pub fn recall(&mut self) {
        self.elements.iter_mut().for_each(|elements| elements.recall());
        self.beside.laws_mut().for_each(|law| law.pass(Event::Recall));
    }

    /// The step in progress is the current state.
    pub fn keep(&mut self) {
        self.elements.iter_mut().for_each(|elements| elements.keep());
        self.beside.laws_mut().for_each(|law| law.pass(Event::Keep));
    }

    /// An equation is to be solved for the end of so many seconds.
    pub fn foresee(&mut self, time: f64) {
        self.elements.iter_mut().for_each(|elements| elements.foresee(time));
        self.beside.laws_mut().for_each(|law| law.pass(Event::Foresee(time)));
    }

    /// What cuts left of how rings were deformed fades, over so many seconds, with nodes at `positions`: whether there was any.
    pub fn fade(&mut self, time: f32, positions: &Vectors, team: &Team) -> bool {
        let elements = self.elements.as_mut();
        if !elements.is_some_and(|elements| elements.wait(f64::from(time))) {
            return false;
        }
        self.write_records(positions, team);
        if let (Some(elements), Some(records)) = (&mut self.elements, &self.records) {
            elements.fade(self.kernel, records.as_slice(), team);
        }
        true
    }

    /// The substep in progress, of so many seconds, has put nodes at `positions`.
    pub fn age(&mut self, time: f64, positions: &Vectors, team: &Team) {
        self.follow(positions, |viscosity| viscosity.over(time), team);
    }

    /// What is elastic has changed where nodes are, at `positions`: arms hold what they held.
    pub fn measure_anew(&mut self, positions: &Vectors) {
        if self.remember() {
            self.follow(positions, |_| RelaxationStep::NOTHING, &Team::alone());
            self.keep();
        }
    }

    /// Nothing that is viscous holds anything with nodes at `positions`.
    pub fn relax(&mut self, positions: &Vectors) {
        self.release(positions);
        self.keep();
    }

    /// The same until [`Self::recall`].
    pub fn release(&mut self, positions: &Vectors) {
        self.elements.iter_mut().for_each(|elements| elements.release_rings());
        self.follow(positions, |_| RelaxationStep::FOREVER, &Team::alone());
    }

    /// Whether any element would yield with nodes at these places.
    pub fn yield_at(&self, at: impl Fn(usize) -> DVec3) -> bool {
        self.elements().is_some_and(|elements| elements.yield_at(at))
    }

    /// What remembers follows nodes to `positions`, along this course.
    fn follow(&mut self, positions: &Vectors, course: impl Fn(Viscosity) -> RelaxationStep, team: &Team) {
        if !self.remember() {
            return;
        }
        if self.elements().is_some_and(Elements::remember) {
            self.write_records(positions, team);
        }
        if let (Some(elements), Some(records)) = (&mut self.elements, &self.records) {
            elements.age(self.kernel, records.as_slice(), &course, team);
        }
        if let Some(terms) = &mut self.beside.terms {
            terms.age(positions, course, team);
        }
    }
}
