//! How bodies move: the solvers and what they share.

mod attempt;
mod changed;
mod closing;
mod coarse_step;
mod early;
mod energy_account;
mod energy_monitor;
mod energy_sums;
mod grasp;
mod gravity;
mod grow;
mod held;
mod implicit;
mod kick;
mod mass_scaling;
mod newton;
mod pace;
mod pipeline;
mod relief;
mod sleep;
mod slow_down;
mod sound;
mod stability;
mod subnormal;
mod substep;
mod system;
mod tissue_impulses;
mod verlet;
mod watched;

pub(crate) use attempt::{
    Carry, Outcome, RESERVE, StepRequest, attempt, finish, needed, relieve_squeezed, substeps_needed,
};
pub(crate) use changed::Changed;
pub(crate) use closing::{close, close_beside, make_up_for, show_closed};
pub(crate) use coarse_step::CoarseStep;
pub(crate) use energy_account::EnergyAccount;
pub(crate) use energy_monitor::Account;
pub(crate) use energy_sums::{Energies, TileSums};
pub(crate) use grasp::Grip;
pub(crate) use gravity::GravityKicks;
pub(crate) use implicit::{begin_parts, end_part, next_part, parts_near};
pub(crate) use newton::rest_state;
pub use newton::{RestStateDefinition, RestStateReport};
pub(crate) use slow_down::slow_down;
pub(crate) use stability::Stability;
pub(crate) use substep::Part;
pub(crate) use system::{MayBeCut, System, Systems};
pub(crate) use tissue_impulses::Span;
pub(crate) use verlet::{Step, StepResult, TooLong, begin, check, check_beside_springs, pass};
pub(crate) use watched::Candidate;
