//! The motion of a collision surface in a substep.

use glam::{DVec3, Vec3, Vec3A};

use super::{CollisionSurface, SELF_CONTACT_DISTANCE};
use crate::codec::saved;
use crate::contact::time_of_impact::Corners;
use crate::def::BodyContact;
use crate::deformable_contact::wound::Wound;
use crate::geometry::Aabb;
use crate::nodes::Bindings;
use crate::solver::System;

/// Position of a node at the start of a substep, and its displacement, m.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct NodeMotion {
    pub start: Vec3A,
    pub displacement: Vec3A,
}

saved! { NodeMotion { start, displacement } }

impl NodeMotion {
    #[inline]
    pub fn start(&self) -> Vec3 {
        self.start.into()
    }
}

impl CollisionSurface {
    /// Begins a substep of `duration` seconds. `begins` marks the first one of a step.
    pub fn begin_substep(&mut self, body: &mut System, duration: f32, begins: bool) {
        if begins {
            self.velocity_changes.fill(Vec3A::ZERO);
        }
        let origin = body.origin;
        self.is_closed &= !body.is_cut_open;
        let (bindings, motion_of) = body.motion();
        self.set_motion(origin, bindings, duration, motion_of);
        if let Some(wound) = self.topology.as_mut().and_then(|topology| topology.wound.as_mut()) {
            let motions = &self.motions;
            wound.update_normals(&self.triangles, |node| motions[node as usize].start());
        }
        self.update_curvature(self.motion_bounds, &body.contact, begins);
    }

    /// Measures the curvature at the start and end of a substep, if a step begins or nodes have moved far.
    /// `displacements` are bounds of the new motion.
    fn update_curvature(&mut self, displacements: Aabb, contact: &BodyContact, begins: bool) {
        // Flat edges let others penetrate by up to half of this motion. They must be measured again when that reaches a
        // quarter of the distance.
        self.motion_since_measured += (displacements.max - displacements.min).length();
        let thickness = contact.thickness.min(0.5 * SELF_CONTACT_DISTANCE * self.short_edge);
        self.was_remeasured = self.motion_since_measured > thickness.max(self.min_thickness());
        if !begins && !self.was_remeasured {
            return;
        }
        self.motion_since_measured = 0.0;
        self.edge_curvatures.clear();
        for time in [0.0, 1.0] {
            let motions = &self.motions;
            let at = |node: u32| Vec3::from(motions[node as usize].start + motions[node as usize].displacement * time);
            self.edge_curvatures
                .measure(motions.len(), &self.triangles, &self.edges, at);
        }
    }

    /// Returns the motion of a node in a substep of `duration` seconds, in the coordinates of another body. Its origin
    /// lies `shift` before this one, and it moves with `other_velocity`.
    pub fn relative_motion(&self, node: u32, (shift, other_velocity): (Vec3, Vec3), duration: f32) -> NodeMotion {
        let own = self.node_motion(node);
        NodeMotion {
            start: own.start + Vec3A::from(shift),
            displacement: own.displacement + Vec3A::from((self.center_velocity - other_velocity) * duration),
        }
    }

    /// Returns the motion of a node in this surface's coordinates, relative to its center velocity.
    #[inline]
    pub fn node_motion(&self, node: u32) -> NodeMotion {
        self.motions[node as usize]
    }

    /// Returns the moving corners of an edge or face.
    #[inline]
    pub fn corners(&self, nodes: &[u32]) -> Corners {
        let motions = nodes.iter().map(|&node| self.node_motion(node));
        Corners::moving(motions.map(|motion| (motion.start, motion.displacement)))
    }

    /// Returns the position of a node at the start of the substep.
    #[inline]
    pub fn start(&self, node: u32) -> Vec3 {
        self.node_motion(node).start()
    }

    /// Returns the largest deviation of these nodes from their predicted motion, m.
    pub fn deviation_of(&self, nodes: &[u32]) -> f32 {
        nodes.iter().fold(0.0, |max_deviation, &node| {
            self.deviations[node as usize].max(max_deviation)
        })
    }

    /// Updates motions and bound points to the velocities that impulses have caused.
    pub fn update_motion(&mut self, body: &System, duration: f32) {
        let bindings = body.bindings.as_ref().filter(|_| self.topology.is_some());
        for bound in bindings
            .into_iter()
            .flat_map(|bindings| self.nodes.iter().filter_map(|&node| bindings.get(node)))
        {
            let velocity = bound.interpolate(|node| self.velocities[node].into());
            self.velocities[bound.node as usize] = velocity.into();
        }
        let (mut relative_bounds, mut deviation_bounds) = (Aabb::EMPTY, Aabb::EMPTY);
        let center_velocity = Vec3A::from(self.center_velocity);
        for &node in &self.nodes {
            let node = node as usize;
            let velocity = self.velocities[node];
            let deviation = (velocity - self.predicted_velocities[node]) * duration;
            self.deviations[node] += deviation.length();
            self.max_deviation = self.max_deviation.max(self.deviations[node]);
            deviation_bounds = deviation_bounds.with(deviation.into());
            self.predicted_velocities[node] = velocity;
            self.motions[node].displacement = (velocity - center_velocity) * duration;
            relative_bounds = relative_bounds.with((velocity - center_velocity).into());
        }
        self.displacement_spread = self
            .displacement_spread
            .max(duration * relative_bounds.magnitudes().length());
        self.update_curvature(deviation_bounds, &body.contact, false);
    }

    /// Stores the changes of velocity by contact in a substep. Call it before they are applied to the body.
    pub fn record_velocity_changes(&mut self, body: &mut System) {
        let movers = self.topology.iter().flat_map(|topology| &topology.movers);
        let (bindings, motion_of) = body.motion();
        let bindings = bindings.filter(|_| self.topology.is_some());
        for &node in self.nodes.iter().chain(movers) {
            if bindings.is_none_or(|bindings| bindings.get(node).is_none()) {
                let node = node as usize;
                self.velocity_changes[node] = self.velocities[node] - Vec3A::from(motion_of(node).1);
            }
        }
    }

    /// Refits the trees to the current positions, if needed.
    pub fn refit_trees(&mut self) {
        if !self.trees_are_current {
            let (triangles, motions) = (&self.triangles, &self.motions);
            self.forest
                .refit(|triangle| triangles[triangle as usize].map(|node| motions[node as usize].start()));
            self.trees_are_current = true;
        }
    }

    /// Sets the positions to those at the start or end of an attempted step, without motion.
    pub fn set_static(&mut self, body: &System, at_end: bool) {
        let positions = if at_end {
            body.state.newest().0
        } else {
            body.state.positions()
        };
        self.set_motion(body.origin, body.bindings.as_ref(), 0.0, |node| {
            (positions.get(node), Vec3::ZERO)
        });
        self.refit_trees();
    }

    fn set_motion(
        &mut self,
        origin: DVec3,
        bindings: Option<&Bindings>,
        duration: f32,
        motion_of: impl Fn(usize) -> (Vec3, Vec3),
    ) {
        self.origin = origin;
        self.velocity_bounds = Aabb::EMPTY;
        self.max_deviation = 0.0;
        let (mut velocity_bounds, mut motion_bounds) = (Aabb::EMPTY, Aabb::EMPTY);
        for &node in self.topology.iter().flat_map(|topology| &topology.movers) {
            let (start, velocity) = motion_of(node as usize);
            motion_bounds = motion_bounds.with(start - self.start(node));
            self.motions[node as usize].start = start.into();
            self.velocities[node as usize] = velocity.into();
        }
        let velocity_changes = &self.velocity_changes;
        let bindings = bindings.filter(|_| self.topology.is_some());
        let bound = |node: u32| bindings.and_then(|bindings| bindings.get(node));
        for &node in &self.nodes {
            let ((start, velocity), velocity_change) = match bound(node) {
                None => (motion_of(node as usize), velocity_changes[node as usize].into()),
                Some(bound) => (
                    (
                        bound.interpolate(|node| motion_of(node).0),
                        bound.interpolate(|node| motion_of(node).1),
                    ),
                    bound.interpolate(|node| velocity_changes[node].into()),
                ),
            };
            let predicted_velocity = velocity + velocity_change;
            motion_bounds = motion_bounds.with(start - self.start(node));
            self.motions[node as usize].start = start.into();
            self.velocities[node as usize] = velocity.into();
            self.predicted_velocities[node as usize] = predicted_velocity.into();
            self.deviations[node as usize] = 0.0;
            velocity_bounds = velocity_bounds.with(predicted_velocity);
        }
        self.motion_bounds = motion_bounds;
        self.center_velocity = 0.5 * (velocity_bounds.min + velocity_bounds.max);
        let center_velocity = Vec3A::from(self.center_velocity);
        for &node in &self.nodes {
            self.motions[node as usize].displacement =
                (self.predicted_velocities[node as usize] - center_velocity) * duration;
        }
        self.max_displacement = duration * velocity_bounds.magnitudes().length();
        self.displacement_spread = 0.5 * duration * (velocity_bounds.max - velocity_bounds.min).length();
        self.trees_are_current = false;
        if self.images.is_some() || self.wound().is_some_and(Wound::is_open) {
            self.refit_trees();
        }
    }
}
