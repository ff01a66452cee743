//! Maps each kind of change between steps to the cached data that it invalidates.

use super::{EnergyAccount, Stability, System};

/// A change of a body between steps.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Changed {
    /// Node positions were set.
    Positions,
    /// The velocity of a node was set.
    Velocity,
    /// The last step no longer predicts the motion of the nodes.
    Trajectory,
    /// The origin of the coordinates has moved.
    Origin,
    /// A pin was added or removed. The region around its node is already awake.
    Pin,
    /// Masses or attached nodes have changed.
    Masses,
    /// The damping of nodes has changed.
    Damping,
    /// Springs, elements or terms were added, removed or changed.
    Stiffness,
    /// Springs that may have set the longest stable substep were softened or removed.
    SpringsSoftened,
    /// The pressure of cavities has changed.
    Pressure,
    /// The rest shape of elements has changed.
    RestShape,
    /// A cut has split nodes. Rates and stability are updated for these nodes alone.
    Topology,
}

/// Data derived from the state or from earlier steps.
#[derive(Clone, Copy)]
pub(crate) enum Cached {
    /// The set of sleeping tiles.
    Sleep,
    /// The forces at the current positions.
    Forces,
    /// The forces, if springs have damping.
    DampingForces,
    /// The longest stable substep of springs.
    Stability,
    /// The frequency bounds of all forces except springs.
    Rates,
    /// The energy account and the substep history.
    Energy,
    /// The refinement of substeps by the energy account.
    Refinement,
    /// The energy that the equation solver expects at the end of the last step.
    EquationEnergy,
    /// The rounding remainders of positions.
    Remainders,
    /// The history that the equation solver uses from the last step.
    History,
    /// The preconditioner of the equation solver.
    Preconditioner,
    /// The broad-phase list of features near tools.
    Candidates,
    /// The multipliers of contacts within equations.
    ContactMultipliers,
}

impl Changed {
    /// Lists the cached data that the change invalidates.
    const fn invalidates(self) -> &'static [Cached] {
        use Cached::*;
        match self {
            Self::Positions => &[
                Sleep,
                Forces,
                Stability,
                Energy,
                Refinement,
                Remainders,
                History,
                Preconditioner,
                Candidates,
                ContactMultipliers,
            ],
            // `EnergyAccount::gain` accounts for the energy of the change.
            Self::Velocity => &[DampingForces, EquationEnergy],
            Self::Trajectory => &[History],
            Self::Origin => &[Sleep, Candidates],
            Self::Pin => &[Stability, Rates, Energy, Preconditioner],
            Self::Masses => &[Sleep, Stability, Rates, Energy, Preconditioner],
            Self::Damping => &[Sleep, Stability, Rates, EquationEnergy, Preconditioner],
            Self::Stiffness => &[Sleep, Forces, Rates, Energy, Preconditioner],
            Self::SpringsSoftened => &[Stability],
            Self::Pressure => &[Sleep, Forces, Energy],
            Self::RestShape => &[Forces, Energy],
            Self::Topology => &[Sleep, Forces, Energy, Preconditioner],
        }
    }
}

impl System {
    /// Invalidates the cached data that depends on the change.
    pub fn changed(&mut self, changed: Changed) {
        for &cached in changed.invalidates() {
            self.forget(cached);
        }
    }

    fn forget(&mut self, cached: Cached) {
        self.integrator.forget(cached);
        match cached {
            Cached::Sleep => self.wake(),
            Cached::Forces => self.forces_current = false,
            Cached::DampingForces => {
                if self.forces.springs.damped() {
                    self.forces_current = false;
                    self.wake();
                }
            }
            Cached::Stability => self.carry.stability = Stability::UNKNOWN,
            Cached::Rates => self.forces.forget_rates(),
            Cached::Energy => self.carry.forget(),
            // The new motion may need no refined substeps.
            Cached::Refinement => self.carry.energy = EnergyAccount::UNKNOWN,
            Cached::Remainders => self.state.forget_remainders(),
            Cached::Candidates => self
                .contacts
                .iter_mut()
                .for_each(|contacts| contacts.invalidate_candidates()),
            Cached::ContactMultipliers => self
                .contacts
                .iter_mut()
                .for_each(|contacts| contacts.multipliers.reset_warm_starts()),
            Cached::EquationEnergy | Cached::History | Cached::Preconditioner => {}
        }
    }
}
