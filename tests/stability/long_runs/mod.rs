//! Long runs from good states: ten minutes of hanging, spinning and being pressed, in which energy and momentum are kept.
//!
//! `tests/stability.rs` takes a few seconds of some rows, `benches/stability.rs` all of them. A row is a body (`subject.rs`) and what is
//! done to it (`activity.rs`, `press.rs`); it is judged by its energy and momentum (`account.rs`), or by the frequency of its first
//! mode (`pluck.rs`). No step may be refused, and no body restored.

mod account;
mod activity;
#[path = "../../../benches/storage/clock.rs"]
#[allow(dead_code, reason = "the wall's clock is for benches")]
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
