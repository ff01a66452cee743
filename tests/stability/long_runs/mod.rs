//! Long runs from good states: bodies hang, spin and are pressed for ten simulated minutes.
//!
//! `quick.rs` beside this folder runs some rows for a few seconds, `benches/stability.rs` runs all of them. A row names
//! a body (`subject.rs`), an activity (`activity.rs`, `press.rs`), a solver and a step. A row fails if energy grows or
//! momentum is lost (`account.rs`), if the frequency of the first mode is wrong (`pluck.rs`), if a step is refused, or
//! if a body is restored.

mod account;
mod activity;
#[path = "../../../benches/storage/clock.rs"]
#[allow(dead_code, reason = "long runs need processor time alone")]
mod clock;
mod figures;
mod full;
mod planted;
mod pluck;
mod press;
mod quick;
mod rest;
mod run;
mod scene;
mod subject;
mod table;

pub use quick::quick;
#[allow(unused_imports, reason = "the bench takes all rows, the test plants faults")]
pub use {activity::Activity, figures::Outcome, full::full, planted::found, table::Row};
