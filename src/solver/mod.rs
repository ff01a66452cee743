//! How bodies move: the solvers and what they share.

mod attempt;
mod closing;
mod energy_monitor;
mod gravity;
mod held;
mod implicit;
mod kick;
mod lockstep;
mod mass_scaling;
mod newton;
mod pace;
mod pipeline;
mod stability;
mod subnormal;
mod substep;
mod verlet;
mod watched;

pub(crate) use attempt::{Carry, Outcome, RESERVE, StepRequest, attempt, fewer_substeps, substeps_alone};
pub(crate) use closing::{close, close_beside, make_up_for, mean_force, show_closed};
pub(crate) use energy_monitor::{EnergyAccount, Sums};
pub(crate) use gravity::GravityKicks;
pub(crate) use implicit::Implicit;
pub(crate) use kick::Survey;
pub(crate) use lockstep::{Together, Walk};
pub(crate) use mass_scaling::{Heavier, MassScaling};
pub(crate) use newton::rest_state;
pub use newton::{RestStateDefinition, RestStateReport};
pub(crate) use pace::Pace;
pub(crate) use stability::Stability;
pub(crate) use substep::write_records;
pub(crate) use verlet::begin;
pub(crate) use watched::{Candidate, Watched};
