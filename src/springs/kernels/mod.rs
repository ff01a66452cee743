//! SIMD kernels of springs, compiled once per SIMD level.
#![allow(unsafe_code)]

mod accumulators;
mod columns;
mod forces;
mod layout;
mod strays;
mod validate;

pub(super) use columns::Columns;
pub(super) use layout::{Column, ColumnParameters, F32x16, Neighbors, SpringParameters};
