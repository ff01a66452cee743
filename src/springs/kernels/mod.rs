//! Kernels of springs, compiled once for each kind of processor.
#![allow(unsafe_code)]

mod columns;
mod forces;
mod quantities;
mod sound;
mod strays;

pub(super) use columns::{Column, Columns, Line, Material, Neighbours, Parameters};
