//! The trait that integrators implement, and the coupled step of several bodies.

use std::fmt::Debug;

use super::System;
use super::changed::Cached;
use super::energy_sums::TileSums;
use super::implicit::{Implicit, Solution};
use super::leapfrog::Leapfrog;
use super::step_request::{IntegratorState, StepRequest, StepStart};
use super::substep::SubstepKick;
use super::substep_count::StepPlan;
use super::verlet::Stepped;
use crate::base::{Result, StateHasher, memory};
use crate::codec::{Reader, Saved, Writer, shape_with};
use crate::contact::Contacts;
use crate::def::{BodyDefinition, Solver, SolverReport};
use crate::forces::Forces;
use crate::geometry::Aabb;
use crate::soa::{PerNode, Vectors};
use crate::threads::Team;

/// The tag of each integrator in a snapshot.
pub(super) const LEAPFROG: u8 = 0;
pub(super) const IMPLICIT: u8 = 1;

/// Integrates a body in time. Methods without effect by default concern integrators with data beside the state.
pub(crate) trait Integrator: PerNode + Debug + Send + Sync {
    /// Takes an uncoupled step. The number of substeps is the requested one, the required one, or that of `retry`.
    fn step(&mut self, body: &mut System, request: &StepRequest, retry: Option<StepStart>, team: &Team) -> Stepped;

    /// Computes the substeps that the body needs in a coupled step.
    fn plan_step(&mut self, body: &mut System, request: &StepRequest, team: &Team) -> StepPlan;

    /// Begins a coupled step.
    fn begin(&mut self, body: &mut System, coupled: &mut CoupledBody, step: &CoupledStep) -> Stepped<()>;

    /// Takes a substep up to the point where other tissue may change its result.
    fn substep(&mut self, body: &mut System, coupled: &mut CoupledBody, step: &CoupledStep, index: u32) -> Stepped<()>;

    /// Ends the substep. `velocities` is the bounding box of velocities after contact with other tissue.
    fn end(
        &mut self,
        body: &mut System,
        coupled: &mut CoupledBody,
        step: &CoupledStep,
        velocities: Aabb,
    ) -> Stepped<()>;

    /// Takes the closing half kick of the step, if the integrator has one.
    fn closing_half_kick(
        &mut self,
        _body: &mut System,
        _coupled: &mut CoupledBody,
        _step: &CoupledStep,
    ) -> Stepped<()> {
        Ok(())
    }

    /// True if half kicks open and close a step. The last one leaves the forces at the end of the step. Only these
    /// steps use the energy account.
    fn takes_half_kicks(&self) -> bool {
        false
    }

    /// True if stability limits the substeps.
    fn is_limited_by_stability(&self) -> bool {
        false
    }

    /// The solution for all nodes, if the integrator solves a system of equations. Contacts with other tissue are
    /// solved later and change it.
    fn solution(&self) -> Option<&Solution> {
        None
    }

    fn solution_mut(&mut self) -> Option<&mut Solution> {
        None
    }

    /// Rolls back an attempted step.
    fn rollback(&mut self) {}

    /// Makes the data that the attempted step passes to the next one current.
    fn commit(&mut self) {}

    /// Invalidates cached data.
    fn forget(&mut self, _cached: Cached) {}

    /// Reports how it took the last step.
    fn last_report(&self) -> SolverReport {
        SolverReport::default()
    }

    /// Adds the data that the next step depends on, except the state.
    fn hash(&self, _hasher: &mut StateHasher) {}

    /// Writes the tag of the integrator and its data.
    fn save(&self, to: &mut Writer);

    /// Reserves memory for `count` springs in total.
    fn reserve_springs(&mut self, _count: usize) -> Result<()> {
        Ok(())
    }

    /// Reserves memory for these contacts, if they are part of the equations.
    fn reserve_contacts(&mut self, _contacts: &mut Contacts) -> Result<()> {
        Ok(())
    }

    /// Reserves memory for a cut that keeps the present nodes of these forces and adds `more` springs. Nothing else
    /// changes before nodes are added.
    fn prepare_cut(&mut self, _forces: &Forces, _more: usize) -> Result<()> {
        Ok(())
    }

    /// Copies the motion of node `source` to the new node.
    fn copy_motion(&mut self, _source: usize, _node: usize) {}
}

/// Creates the integrator that a definition selects.
pub(super) fn create(
    definition: &BodyDefinition,
    positions: &Vectors,
    forces: &mut Forces,
) -> Result<Box<dyn Integrator>> {
    Ok(match definition.solver {
        Solver::Verlet | Solver::Auto => memory::boxed(Leapfrog::new(forces)?)?,
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

/// A step that several bodies take together.
#[derive(Clone, Copy)]
pub(crate) struct CoupledStep<'a> {
    pub request: &'a StepRequest<'a>,
    pub substeps: u32,
    /// True if it ends with an energy comparison.
    pub compares: bool,
    /// True if it is not retried with shorter substeps.
    pub is_last: bool,
    pub team: &'a Team<'a>,
}

impl CoupledStep<'_> {
    /// The length of a substep, s.
    pub fn substep(&self) -> f32 {
        (f64::from(self.request.dt) / f64::from(self.substeps)) as f32
    }
}

/// A body in a coupled step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CoupledBody {
    pub start: IntegratorState,
    pub scaling_substep: f32,
    pub carry: IntegratorState,
    pub(super) substep_kick: SubstepKick,
    /// The energy sums before the closing half kick, if the step ends with an energy comparison.
    pub sums: Option<TileSums>,
    /// The kinetic energy that can be removed, J.
    pub internal_kinetic: f64,
    /// The number of substeps that it would take on its own.
    pub uncoupled_substeps: u32,
}

impl CoupledBody {
    /// Prepares a body of a group for a step.
    pub fn of(body: &mut System, request: &StepRequest, group: u64, team: &Team) -> Self {
        let StepPlan {
            mut start,
            scaling_substep,
            substeps,
        } = body.with_integrator(|integrator, body| integrator.plan_step(body, request, team));
        start.energy.set_group(group);
        Self {
            start,
            scaling_substep,
            carry: start,
            substep_kick: SubstepKick::opening(0.0),
            sums: None,
            internal_kinetic: 0.0,
            uncoupled_substeps: substeps,
        }
    }
}

impl System {
    /// Calls `f` with the integrator. A leapfrog replaces the integrator during the call.
    pub fn with_integrator<R>(&mut self, f: impl FnOnce(&mut dyn Integrator, &mut Self) -> R) -> R {
        // Leapfrog has no size: nothing is allocated.
        let mut integrator = std::mem::replace(&mut self.integrator, Box::new(Leapfrog));
        let result = f(&mut *integrator, self);
        self.integrator = integrator;
        result
    }
}
