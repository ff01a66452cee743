//! A substep of a body near tools, and the slices that it is cut into.

use glam::{BVec3, DVec3, Vec3};

use super::impulses::SWEEPS;
use super::path::ToolPath;
use super::supports::{MOST, Supports};
use crate::base::Profile;
use crate::geometry::Bounds;
use crate::nodes::{self, Bindings, Mobility, Pins};
use crate::simd::ChosenKernel;
use crate::soa::Vectors;

/// One substep of a body near tools.
pub(crate) struct Meeting<'a> {
    pub kernel: ChosenKernel,
    pub tools: &'a [ToolPath],
    /// Where the body's coordinates begin.
    pub origin: DVec3,
    /// The step, s.
    pub dt: f32,
    /// Fractions of the step at which the substep starts and ends.
    pub start: f64,
    pub end: f64,
    /// s
    pub substep: f32,
    /// Whether positions change: not with the last half kick of a step.
    pub drifts: bool,
    /// Contacts that are open by less count, m.
    pub slack: f32,
    /// How fast nodes of bodies are that take the substep together with this one, m/s: what those do to it is found after this, and then
    /// tools act [again](Contacts::sweep).
    pub neighbor_speed: Option<f32>,
    /// What tools keep off the surface, m.
    pub thickness: f32,
    /// No node is faster, m/s.
    pub fastest: f32,
    pub mobility: Mobility<'a>,
    pub positions: &'a Vectors,
    pub velocities: &'a mut Vectors,
    pub next_positions: &'a mut Vectors,
    pub pins: &'a mut Pins,
    /// Corners that are bound to nodes: their own vectors are not read.
    pub bindings: Option<&'a Bindings>,
    /// Where the stages are timed, if they are.
    pub profile: Option<&'a Profile>,
}

/// A part of a substep in which no tool moves further against the body than half its radius. Springs act once in a substep,
/// contact in each slice: a tip that goes far takes along what it meets, however far that is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slice {
    /// Seconds from its start to the end of the substep.
    pub remains: f32,
    /// s
    pub duration: f32,
    pub first: bool,
    pub sweeps: u32,
    /// Whether contacts are only looked for.
    pub foresees: bool,
}

impl Slice {
    /// The whole substep, looked at before it is taken.
    pub fn ahead(meeting: &Meeting) -> Self {
        Self {
            remains: meeting.substep,
            duration: meeting.substep,
            first: true,
            sweeps: SWEEPS,
            foresees: true,
        }
    }
}

impl Meeting<'_> {
    /// The same with tools on these ways; without any those that it has.
    pub(super) fn along<'a>(&'a mut self, paths: &'a [ToolPath]) -> Meeting<'a> {
        Meeting {
            tools: if paths.is_empty() { self.tools } else { paths },
            velocities: self.velocities,
            next_positions: self.next_positions,
            pins: self.pins,
            ..*self
        }
    }

    /// Whether the slice is the whole of a substep in which every node moves by its mass alone: none is held along some axes, asleep, or bound to others.
    pub(super) fn is_even(&self, slice: &Slice) -> bool {
        let is_whole = slice.first && slice.duration == self.substep && self.drifts && !self.mobility.half;
        is_whole && !self.pins.are_partial() && self.mobility.asleep.is_none() && self.bindings.is_none()
    }

    /// The axes along which nodes of a feature are held that are free along others.
    pub(super) fn held_axes(&self, supports: &Supports) -> [BVec3; MOST] {
        let mut held = [BVec3::FALSE; MOST];
        for (held, &node) in held.iter_mut().zip(supports.nodes()) {
            *held = self.pins.partial_axes_of(node);
        }
        held
    }

    /// What the kick that was given stands for, s.
    pub(super) fn kick(&self) -> f32 {
        if self.mobility.half {
            0.5 * self.substep
        } else {
            self.substep
        }
    }

    /// Where a corner is when the slice begins.
    pub(super) fn position(&self, slice: &Slice, corner: usize) -> Vec3 {
        if slice.first {
            self.vector(self.positions, corner)
        } else {
            self.vector(self.next_positions, corner) - self.vector(self.velocities, corner) * slice.remains
        }
    }

    /// Where a corner is when the slice begins, and how far it goes in it if nothing touches it; with the last half kick of a step it has come
    /// to its end, and what is not touched there is a matter of the next.
    pub(super) fn way(&self, slice: &Slice, corner: usize) -> (Vec3, Vec3) {
        let step = if self.drifts {
            self.vector(self.velocities, corner) * slice.duration
        } else {
            Vec3::ZERO
        };
        (self.position(slice, corner), step)
    }

    /// That of these vectors which a corner has: its own, or what its nodes make of theirs.
    #[inline]
    pub(super) fn vector(&self, vectors: &Vectors, corner: usize) -> Vec3 {
        nodes::vector(self.bindings, vectors, corner)
    }

    /// The box of all nodes, in which bound points are.
    pub(super) fn bounds(&self) -> Bounds {
        let Some(bindings) = self.bindings else {
            return Bounds::of(self.positions.iter());
        };
        let nodes = (0..).zip(self.positions.iter());
        Bounds::of(
            nodes
                .filter(|&(node, _)| bindings.get(node).is_none())
                .map(|(_, place)| place),
        )
    }
}
