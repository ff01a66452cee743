//! What a world tells of itself: where the time of a step goes, and how its contacts, springs and pins are.

mod draw;
mod profile;
