//! Contact of cut bodies with themselves and with other tissue.
#![allow(clippy::unwrap_used)]

mod blade;
mod blade_meets;
mod meetings;
mod scene;
mod wounds;
