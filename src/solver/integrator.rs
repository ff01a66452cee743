//! The trait that solvers implement, and the table of those that there are: how each moves a body, alone or with others, and what it keeps.

use std::fmt::Debug;

use super::System;
use super::changed::Cached;
use super::energy_sums::TileSums;
use super::implicit::{Implicit, Solution};
use super::leapfrog::Leapfrog;
use super::needs::Need;
use super::step_request::{Carry, StepRequest, StepStart};
use super::substep::Part;
use super::verlet::Stepped;
use crate::base::{Result, StateHasher, memory};
use crate::codec::{Reader, Saved, Writer, shape_with};
use crate::contact::Contacts;
use crate::def::{BodyDefinition, Solver, SolverReport};
use crate::forces::Forces;
use crate::geometry::Bounds;
use crate::soa::{PerNode, Vectors};
use crate::threads::Team;

/// What each is saved as.
pub(super) const LEAPFROG: u8 = 0;
pub(super) const IMPLICIT: u8 = 1;

/// How a body is moved. The functions that do nothing by default are for integrators that keep something beside the state.
pub(crate) trait Integrator: PerNode + Debug + Send + Sync {
    /// Takes a step that the body takes alone: in as many substeps as are asked for, or as it needs, or `again` in so many.
    fn step(&mut self, body: &mut System, request: &StepRequest, again: Option<StepStart>, team: &Team) -> Stepped;

    /// What a step needs that the body takes together with others.
    fn need(&mut self, body: &mut System, request: &StepRequest, team: &Team) -> Need;

    /// Begins such a step.
    fn begin(&mut self, body: &mut System, walk: &mut CoupledBody, step: &CoupledStep) -> Stepped<()>;

    /// Takes a substep of it, up to where other tissue may change where that leads.
    fn substep(&mut self, body: &mut System, walk: &mut CoupledBody, step: &CoupledStep, index: u32) -> Stepped<()>;

    /// Ends the substep, after which other tissue leaves velocities in this box.
    fn end(&mut self, body: &mut System, walk: &mut CoupledBody, step: &CoupledStep, given: Bounds) -> Stepped<()>;

    /// Takes the half kick that closes the step, where there is one.
    fn close(&mut self, _body: &mut System, _walk: &mut CoupledBody, _step: &CoupledStep) -> Stepped<()> {
        Ok(())
    }

    /// Whether half kicks open and close a step: the last leaves the forces at its end, and the energy account compares such steps alone.
    fn takes_half_kicks(&self) -> bool {
        false
    }

    /// Whether stability limits its substeps.
    fn is_limited_by_stability(&self) -> bool {
        false
    }

    /// Where its equations have led all nodes at once, if it solves such. Contacts with other tissue are solved after them, and change this.
    fn solution(&self) -> Option<&Solution> {
        None
    }

    fn solution_mut(&mut self) -> Option<&mut Solution> {
        None
    }

    /// The step that was tried is not to be: what was known before is known again.
    fn put_back(&mut self) {}

    /// Makes what the step in progress leaves to the next that of the current state.
    fn commit(&mut self) {}

    /// Forgets what a change has made invalid.
    fn forget(&mut self, _known: Cached) {}

    /// How it took the last step.
    fn told(&self) -> SolverReport {
        SolverReport::default()
    }

    /// Adds what the next step depends on beside the state.
    fn hash(&self, _hasher: &mut StateHasher) {}

    /// Writes which integrator it is, and what it keeps.
    fn save(&self, to: &mut Writer);

    /// Makes room for so many springs in all.
    fn reserve_springs(&mut self, _count: usize) -> Result<()> {
        Ok(())
    }

    /// Makes room for these contacts, where they are part of its equation.
    fn reserve_contacts(&mut self, _contacts: &mut Contacts) -> Result<()> {
        Ok(())
    }

    /// Makes room for a cut that leaves the nodes that these forces have now, with so many springs more. Changes nothing before nodes are added.
    fn prepare_cut(&mut self, _forces: &Forces, _more: usize) -> Result<()> {
        Ok(())
    }

    /// Has a new node go on as another does.
    fn copy_motion(&mut self, _source: usize, _node: usize) {}
}

/// The integrator that a definition asks for, for nodes at these positions that these forces move.
pub(super) fn make(
    definition: &BodyDefinition,
    positions: &Vectors,
    forces: &mut Forces,
) -> Result<Box<dyn Integrator>> {
    Ok(match definition.solver {
        Solver::Verlet | Solver::Auto => memory::boxed(Leapfrog)?,
        Solver::Implicit | Solver::Newton => memory::boxed(Implicit::new(definition, positions, forces)?)?,
    })
}

impl Saved for Box<dyn Integrator> {
    const SHAPE: u64 = shape_with(Leapfrog::SHAPE, Implicit::SHAPE);
    const LEAST: usize = 1;

    fn save(&self, to: &mut Writer) {
        Integrator::save(&**self, to);
    }

    fn load(from: &mut Reader) -> Result<Self> {
        let [kind] = from.take_array()?;
        Ok(match kind {
            LEAPFROG => memory::boxed(Leapfrog)?,
            IMPLICIT => memory::boxed(Implicit::load(from)?)?,
            _ => return Err(from.refusal("no integrator")),
        })
    }
}

/// A step that bodies take together.
#[derive(Clone, Copy)]
pub(crate) struct CoupledStep<'a> {
    pub request: &'a StepRequest<'a>,
    pub substeps: u32,
    /// Whether it ends with a comparison of energies.
    pub compares: bool,
    /// Whether it is not tried again in shorter substeps.
    pub is_last: bool,
    pub team: &'a Team<'a>,
}

impl CoupledStep<'_> {
    /// How long a substep is, s.
    pub fn substep(&self) -> f32 {
        (f64::from(self.request.dt) / f64::from(self.substeps)) as f32
    }
}

/// A body on its way through such a step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CoupledBody {
    pub start: Carry,
    pub masses_for: f32,
    pub carry: Carry,
    pub(super) part: Part,
    /// Of the open velocities, where the step ends with a comparison of energies.
    pub sums: Option<TileSums>,
    /// What can be taken off its motion, J.
    pub own: f64,
    /// In how many substeps it would go by itself.
    pub wanted: u32,
}

impl CoupledBody {
    /// A body's way through a step that is to begin, of a group of bodies.
    pub fn of(body: &mut System, request: &StepRequest, group: u64, team: &Team) -> Self {
        let Need {
            mut start,
            masses_for,
            substeps,
        } = body.lend(|integrator, body| integrator.need(body, request, team));
        start.energy.share(group);
        Self {
            start,
            masses_for,
            carry: start,
            part: Part::opening(0.0),
            sums: None,
            own: 0.0,
            wanted: substeps,
        }
    }
}

impl System {
    /// Has its integrator do something with it. A leapfrog stands in its place meanwhile.
    pub fn lend<R>(&mut self, act: impl FnOnce(&mut dyn Integrator, &mut Self) -> R) -> R {
        // Leapfrog has no size: nothing is allocated.
        let mut integrator = std::mem::replace(&mut self.integrator, Box::new(Leapfrog));
        let result = act(&mut *integrator, self);
        self.integrator = integrator;
        result
    }
}
