//! The parts of a tile's columns.

use crate::codec::saved;
use crate::order::LANES;

/// Of a column whose springs bring their own parameters.
pub(super) const OWN: u16 = u16::MAX;

/// Parameters that many springs of a body share.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct SpringMaterial {
    /// N/m
    pub stiffness: f32,
    /// m
    pub rest_length: f32,
    /// N s/m
    pub damping: f32,
}

saved! { SpringMaterial { stiffness, rest_length, damping } }

impl SpringMaterial {
    /// Half the force with which a spring would be pressed to length 0, N.
    #[inline(always)]
    pub fn half_tension(&self) -> f32 {
        0.5 * self.stiffness * self.rest_length
    }
}

/// Sixteen numbers in a cache line of their own.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Line(pub [f32; LANES]);

saved! { Line { 0 } }

impl Line {
    pub const ZERO: Self = Self([0.0; LANES]);
}

/// What the springs of a column are like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Parameters {
    /// All like this entry of the body's table.
    Shared(u16),
    /// Each its own; 0 in lanes without a link.
    Own {
        stiffnesses: Line,
        rest_lengths: Line,
        dampings: Line,
    },
}

/// Where the other ends of a column's links are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Neighbours {
    /// As far from each node as this.
    Run(i32),
    /// These; any node in lanes without a link.
    Gather([u32; LANES]),
}

/// A column to be put in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Column {
    pub neighbours: Neighbours,
    /// Bit i: whether the node in lane i has a link here.
    pub lanes: u16,
    pub parameters: Parameters,
}

/// A column of neighbours that lie side by side, of springs that share their parameters.
#[derive(Clone, Copy, Debug)]
pub(super) struct RunColumn {
    pub offset: i32,
    pub lanes: u16,
    /// Its place in the table of materials: what follows is a copy from there.
    pub material: u16,
    pub stiffness: f32,
    pub half_tension: f32,
}

saved! { RunColumn { offset, lanes, material, stiffness, half_tension } }

/// A column of neighbours that lie side by side, of springs that bring their own parameters.
#[derive(Clone, Copy, Debug)]
pub(super) struct OwnRun {
    pub offset: i32,
    pub lanes: u16,
}

saved! { OwnRun { offset, lanes } }

/// What there is to know of a gather beside its neighbours.
#[derive(Clone, Copy, Debug)]
pub(super) struct GatherColumn {
    pub lanes: u16,
    /// Its place in the table of materials; [`OWN`].
    pub material: u16,
}

saved! { GatherColumn { lanes, material } }

impl GatherColumn {
    /// Its place in the table of materials, where its springs share their parameters.
    #[inline(always)]
    pub fn material(self) -> Option<usize> {
        (self.material != OWN).then_some(usize::from(self.material))
    }
}

/// Where the columns of sixteen nodes end in each list.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ColumnEnds {
    pub runs: u32,
    pub own_runs: u32,
    pub near: u32,
    pub far: u32,
    pub own: u32,
}

saved! { ColumnEnds { runs, own_runs, near, far, own } }

/// Small indices of a column.
#[repr(C, align(32))]
#[derive(Clone, Copy, Debug)]
pub(super) struct NearIndices(pub [u16; LANES]);

saved! { NearIndices { 0 } }

/// Indices of a column.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug)]
pub(super) struct FarIndices(pub [u32; LANES]);

saved! { FarIndices { 0 } }

/// A link's place.
#[derive(Clone, Copy)]
pub(super) enum LinkPlace {
    Run(usize),
    OwnRun(usize),
    Near(usize),
    Far(usize),
}
