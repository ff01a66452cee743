//! The input of contact for a substep of a body, and the slices of the substep.

use glam::{BVec3, DVec3, Vec3};

use super::corner_weights::{FeatureNodes, MAX_FEATURE_NODES};
use super::path::ToolPath;
use super::sweep_control::SWEEPS;
use crate::base::Profile;
use crate::geometry::Aabb;
use crate::nodes::{self, Bindings, Mobility, Pins};
use crate::simd::ChosenKernel;
use crate::soa::Vectors;

/// A substep of a body near tools.
pub(crate) struct ContactInput<'a> {
    pub kernel: ChosenKernel,
    pub tools: &'a [ToolPath],
    /// The world position of the origin of the body's coordinates.
    pub origin: DVec3,
    /// Duration of the step, s.
    pub dt: f32,
    /// Fractions of the step at which the substep starts and ends.
    pub start: f64,
    pub end: f64,
    /// s
    pub substep: f32,
    /// True if positions change, that is, except in the last half kick of a step.
    pub drifts: bool,
    /// Contacts with a gap below this value are included, m.
    pub slack: f32,
    /// Maximum speed of nodes of bodies that take the substep together with this one, m/s. Their effect on this body is
    /// found later, and then contacts with tools are [swept again](Contacts::sweep).
    pub neighbor_speed: Option<f32>,
    /// Contact thickness: distance that tools keep from the surface, m.
    pub thickness: f32,
    /// Bound on the speed of all nodes, m/s.
    pub fastest: f32,
    pub mobility: Mobility<'a>,
    pub positions: &'a Vectors,
    pub velocities: &'a mut Vectors,
    pub next_positions: &'a mut Vectors,
    pub pins: &'a mut Pins,
    /// Corners that are bound to nodes. Their own vectors are not read.
    pub bindings: Option<&'a Bindings>,
    /// Receives the times of the stages, if they are measured.
    pub profile: Option<&'a Profile>,
}

/// A part of a substep in which no tool moves further relative to the body than half its radius. Springs act once per
/// substep, contact acts in each slice. So a fast tip carries along what it touches.
#[derive(Clone, Copy, Debug)]
pub(super) struct SubSlice {
    /// Time from the start of the slice to the end of the substep, s.
    pub time_left: f32,
    /// s
    pub duration: f32,
    pub is_first: bool,
    pub sweeps: u32,
    /// True if contacts are found before the substep is taken.
    pub is_predictive: bool,
}

impl SubSlice {
    /// The whole substep, before it is taken.
    pub fn ahead(input: &ContactInput) -> Self {
        Self {
            time_left: input.substep,
            duration: input.substep,
            is_first: true,
            sweeps: SWEEPS,
            is_predictive: true,
        }
    }
}

impl ContactInput<'_> {
    /// Returns the input with tools on these paths, or with its own tools if `paths` is empty.
    pub(super) fn with_paths<'a>(&'a mut self, paths: &'a [ToolPath]) -> ContactInput<'a> {
        ContactInput {
            tools: if paths.is_empty() { self.tools } else { paths },
            velocities: self.velocities,
            next_positions: self.next_positions,
            pins: self.pins,
            ..*self
        }
    }

    /// True if the slice is a whole substep in which every node moves by its mass alone. Then no node is held along
    /// some axes, asleep, or bound to others.
    pub(super) fn is_uniform(&self, slice: &SubSlice) -> bool {
        let is_whole = slice.is_first && slice.duration == self.substep && self.drifts && !self.mobility.half;
        is_whole && !self.pins.are_partial() && self.mobility.asleep.is_none() && self.bindings.is_none()
    }

    /// The axes along which nodes of a feature are held, for nodes that are free along other axes.
    pub(super) fn held_axes(&self, feature_nodes: &FeatureNodes) -> [BVec3; MAX_FEATURE_NODES] {
        let mut held = [BVec3::FALSE; MAX_FEATURE_NODES];
        for (held, &node) in held.iter_mut().zip(feature_nodes.nodes()) {
            *held = self.pins.partial_axes_of(node);
        }
        held
    }

    /// Duration of the kick, s.
    pub(super) fn kick_duration(&self) -> f32 {
        if self.mobility.half {
            0.5 * self.substep
        } else {
            self.substep
        }
    }

    /// Position of a corner when the slice begins.
    pub(super) fn position(&self, slice: &SubSlice, corner: usize) -> Vec3 {
        if slice.is_first {
            self.vector(self.positions, corner)
        } else {
            self.vector(self.next_positions, corner) - self.vector(self.velocities, corner) * slice.time_left
        }
    }

    /// Position of a corner when the slice begins, and its displacement in the slice without contact. In the last half
    /// kick of a step nodes are at the end of their paths. The next step handles contacts that are open there.
    pub(super) fn corner_motion(&self, slice: &SubSlice, corner: usize) -> (Vec3, Vec3) {
        let step = if self.drifts {
            self.vector(self.velocities, corner) * slice.duration
        } else {
            Vec3::ZERO
        };
        (self.position(slice, corner), step)
    }

    /// The vector of a corner: its own, or the weighted mean of the vectors of its nodes.
    #[inline]
    pub(super) fn vector(&self, vectors: &Vectors, corner: usize) -> Vec3 {
        nodes::vector(self.bindings, vectors, corner)
    }

    /// Bounding box of all nodes. It contains the bound points.
    pub(super) fn bounds(&self) -> Aabb {
        let Some(bindings) = self.bindings else {
            return Aabb::of(self.positions.iter());
        };
        let nodes = (0..).zip(self.positions.iter());
        Aabb::of(
            nodes
                .filter(|&(node, _)| bindings.get(node).is_none())
                .map(|(_, position)| position),
        )
    }
}
