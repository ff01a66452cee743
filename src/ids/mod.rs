//! Generational ids, and lists of what they name.

mod slots;

pub(crate) use slots::{SlotId, Slots};
