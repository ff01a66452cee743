//! What a change between steps makes invalid. Callers name the change, and the table here says what it concerns.

use super::{EnergyAccount, Stability, System};

/// A change of a body between steps.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Changed {
    /// Nodes were put elsewhere.
    Positions,
    /// A node has another velocity.
    Velocity,
    /// The last step does not tell how nodes go on.
    Course,
    /// The coordinates begin elsewhere.
    Origin,
    /// A pin has come or gone, and what is about its node has been woken.
    Pin,
    /// Nodes have other masses, or other nodes are held.
    Masses,
    /// Nodes have other damping.
    Damping,
    /// Springs, elements or terms have come, gone or changed.
    Stiffness,
    /// Springs that may have set the longest stable substep are softer or gone.
    Softer,
    /// Cavities have another pressure.
    Pressure,
    /// Elements have another shape at rest.
    RestShape,
    /// A cut has parted nodes. Rates and the stability are updated for these nodes alone.
    Topology,
}

/// What is known from the state or from earlier steps.
#[derive(Clone, Copy)]
pub(crate) enum Cached {
    /// Which parts sleep.
    Sleep,
    /// The forces at the positions.
    Forces,
    /// The forces, where springs have damping.
    DampingForces,
    /// The longest stable substep of springs.
    Stability,
    /// The bounds on frequencies of all but springs.
    Rates,
    /// The energy account, and how many substeps the last steps took.
    Energy,
    /// How much shorter the energy account made substeps.
    Refinement,
    /// The energy that equations took the last step to end with.
    EquationEnergy,
    /// What positions lack of where the nodes are.
    Remainders,
    /// What equations take from the last step.
    History,
    /// The preconditioner of equations.
    Matrix,
    /// The list of what is near tools.
    Candidates,
    /// What contacts within equations did.
    Holds,
}

impl Changed {
    /// What it makes invalid.
    const fn concerns(self) -> &'static [Cached] {
        use Cached::*;
        match self {
            Self::Positions => &[
                Sleep, Forces, Stability, Energy, Refinement, Remainders, History, Matrix, Candidates, Holds,
            ],
            // The energy account is told what the change puts in.
            Self::Velocity => &[DampingForces, EquationEnergy],
            Self::Course => &[History],
            Self::Origin => &[Sleep, Candidates],
            Self::Pin => &[Stability, Rates, Energy, Matrix],
            Self::Masses => &[Sleep, Stability, Rates, Energy, Matrix],
            Self::Damping => &[Sleep, Stability, Rates, EquationEnergy, Matrix],
            Self::Stiffness => &[Sleep, Forces, Rates, Energy, Matrix],
            Self::Softer => &[Stability],
            Self::Pressure => &[Sleep, Forces, Energy],
            Self::RestShape => &[Forces, Energy],
            Self::Topology => &[Sleep, Forces, Energy, Matrix],
        }
    }
}

impl System {
    /// Forgets what a change has made invalid.
    pub fn changed(&mut self, changed: Changed) {
        for &known in changed.concerns() {
            self.forget(known);
        }
    }

    fn forget(&mut self, known: Cached) {
        self.integrator.forget(known);
        match known {
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
            // Another motion begins, which may need no shorter substeps.
            Cached::Refinement => self.carry.energy = EnergyAccount::UNKNOWN,
            Cached::Remainders => self.state.forget_remainders(),
            Cached::Candidates => self.contacts.iter_mut().for_each(|contacts| contacts.look_again()),
            Cached::Holds => self.contacts.iter_mut().for_each(|contacts| contacts.holds.forget()),
            Cached::EquationEnergy | Cached::History | Cached::Matrix => {}
        }
    }
}
