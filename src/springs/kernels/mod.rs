//! Kernels of springs, compiled once for each kind of processor.
#![allow(unsafe_code)]

mod columns;
mod forces;
mod layout;
mod quantities;
mod sound;
mod strays;

pub(super) use columns::Columns;
pub(super) use layout::{Column, Line, Neighbours, Parameters, SpringMaterial};
