//! Data layout of a tile's columns.

use crate::codec::saved;
use crate::order::LANES;

/// Marks a column with per-spring parameters.
pub(super) const OWN_PARAMETERS: u16 = u16::MAX;

/// Spring parameters: an entry of the body's table, or those of one spring.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct SpringParameters {
    /// N/m
    pub stiffness: f32,
    /// m
    pub rest_length: f32,
    /// N s/m
    pub damping: f32,
}

saved! { SpringParameters { stiffness, rest_length, damping } }

impl SpringParameters {
    /// Half the force that compresses a spring to length 0, N.
    #[inline(always)]
    pub fn half_tension(&self) -> f32 {
        0.5 * self.stiffness * self.rest_length
    }
}

/// Sixteen numbers in one cache line.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct F32x16(pub [f32; LANES]);

saved! { F32x16 { 0 } }

impl F32x16 {
    pub const ZERO: Self = Self([0.0; LANES]);
}

/// The parameters of a column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum ColumnParameters {
    /// All springs have the parameters of this entry in the body's table.
    Shared(u16),
    /// Each spring has its own; 0 in unused lanes.
    Own {
        stiffnesses: F32x16,
        rest_lengths: F32x16,
        dampings: F32x16,
    },
}

/// The neighbors of a column's links.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Neighbors {
    /// Each node's neighbor has this index offset.
    Run(i32),
    /// These nodes; any node in unused lanes.
    Gather([u32; LANES]),
}

/// A column to be added.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Column {
    pub neighbors: Neighbors,
    /// Bit i is set if the node in lane i has a link here.
    pub lanes: u16,
    pub parameters: ColumnParameters,
}

/// A column of consecutive neighbors with shared parameters.
#[derive(Clone, Copy, Debug)]
pub(super) struct RunColumn {
    pub offset: i32,
    pub lanes: u16,
    /// The index in the parameter table. The stiffness and half tension are copies from there.
    pub entry: u16,
    pub stiffness: f32,
    pub half_tension: f32,
}

saved! { RunColumn { offset, lanes, entry, stiffness, half_tension } }

/// A column of consecutive neighbors with per-spring parameters.
#[derive(Clone, Copy, Debug)]
pub(super) struct OwnRun {
    pub offset: i32,
    pub lanes: u16,
}

saved! { OwnRun { offset, lanes } }

/// The header of a gather; its neighbors are stored separately.
#[derive(Clone, Copy, Debug)]
pub(super) struct GatherColumn {
    pub lanes: u16,
    /// The index in the parameter table, or [`OWN_PARAMETERS`].
    pub entry: u16,
}

saved! { GatherColumn { lanes, entry } }

impl GatherColumn {
    /// The index in the parameter table if the springs share their parameters.
    #[inline(always)]
    pub fn entry(self) -> Option<usize> {
        (self.entry != OWN_PARAMETERS).then_some(usize::from(self.entry))
    }
}

/// The end of a block's columns in each list.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ColumnEnds {
    pub runs: u32,
    pub own_runs: u32,
    pub near: u32,
    pub far: u32,
    pub own: u32,
}

saved! { ColumnEnds { runs, own_runs, near, far, own } }

/// 16-bit neighbor indices of a column, relative to the window.
#[repr(C, align(32))]
#[derive(Clone, Copy, Debug)]
pub(super) struct NearIndices(pub [u16; LANES]);

saved! { NearIndices { 0 } }

/// 32-bit neighbor indices of a column.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug)]
pub(super) struct FarIndices(pub [u32; LANES]);

saved! { FarIndices { 0 } }

/// The column that contains a link.
#[derive(Clone, Copy)]
pub(super) enum LinkLocation {
    Run(usize),
    OwnRun(usize),
    Near(usize),
    Far(usize),
}
