//! Long runs from good states: ten minutes of hanging, spinning and being pressed, in which energy and momentum are kept.
//!
//! `tests/stability.rs` takes a few seconds of some rows, `benches/stability.rs` all of them. How each is judged stands in
//! `account.rs`.

mod account;
#[path = "../../../benches/storage/clock.rs"]
mod clock;
mod run;
mod subject;
mod table;

pub use run::Outcome;
pub use table::{Row, full, quick};
