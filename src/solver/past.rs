//! What a body remembers of how it was deformed: elements and terms that are viscous, or set.

use super::System;
use super::substep::write_records;
use crate::def::{Course, Viscosity};
use crate::elements::Elements;
use crate::terms::Terms;
use crate::threads::Team;

impl System {
    /// Whether it remembers anything.
    pub(crate) fn remembers(&self) -> bool {
        self.elements.as_deref().is_some_and(Elements::remember) || self.terms.as_deref().is_some_and(Terms::remember)
    }

    /// A step begins, from what is current.
    pub(crate) fn recall(&mut self) {
        if let Some(elements) = &mut self.elements {
            elements.recall();
        }
        if let Some(terms) = &mut self.terms {
            terms.recall();
        }
    }

    /// The step in progress is the current state.
    pub(crate) fn keep(&mut self) {
        if let Some(elements) = &mut self.elements {
            elements.keep();
        }
        if let Some(terms) = &mut self.terms {
            terms.keep();
        }
    }

    /// What cuts left of how rings were deformed fades, over so many seconds.
    pub(crate) fn fade(&mut self, time: f32, team: &Team) {
        if let (Some(elements), Some(records)) = (&mut self.elements, &mut self.records)
            && elements.wait(f64::from(time))
        {
            write_records(self.kernel, self.state.positions(), records, team);
            elements.fade(self.kernel, records.as_slice(), team);
            self.forces_current = false;
            self.forget_energy();
        }
    }

    /// An equation is to be solved for the end of so many seconds.
    pub(crate) fn foresee(&mut self, time: f64) {
        if let Some(elements) = &mut self.elements {
            elements.foresee(time);
        }
        if let Some(terms) = &mut self.terms {
            terms.foresee(time);
        }
    }

    /// The substep in progress, of so many seconds, has put nodes where they are next.
    pub(crate) fn age(&mut self, time: f64, team: &Team) {
        if self.remembers() {
            self.lapse(|viscosity| viscosity.over(time), true, team);
        }
    }

    /// What is elastic has changed where nodes are: arms hold what they held.
    pub(crate) fn measure_anew(&mut self) {
        if self.remembers() {
            self.lapse(|_| Course::NOTHING, false, &Team::alone());
            self.keep();
        }
    }

    /// Nothing that is viscous holds anything with the nodes where they are.
    pub(crate) fn relax(&mut self) {
        self.release();
        self.keep();
    }

    /// The same until [`Self::recall`].
    pub(crate) fn release(&mut self) {
        if let Some(elements) = &mut self.elements {
            elements.release_rings();
        }
        if self.remembers() {
            self.lapse(|_| Course::FOREVER, false, &Team::alone());
        }
    }

    fn lapse(&mut self, course: impl Fn(Viscosity) -> Course, is_next: bool, team: &Team) {
        let positions = if is_next {
            self.state.next_positions()
        } else {
            self.state.positions()
        };
        if let (Some(elements), Some(records)) = (&mut self.elements, &mut self.records)
            && elements.remember()
        {
            write_records(self.kernel, positions, records, team);
            elements.age(self.kernel, records.as_slice(), &course, team);
        }
        if let Some(terms) = &mut self.terms {
            terms.age(positions, course, team);
        }
    }
}
