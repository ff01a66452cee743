//! What other tissue does to a body at the end of a step that it has tried.

use glam::Vec3;

use super::{Body, Bounds, Vectors};
use crate::contact::Moment;
use crate::error::Result;

/// How far a step that was tried has been led elsewhere.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Deflection {
    /// The furthest that a node was moved, m.
    pub furthest: f32,
    /// The box of all velocities that were given.
    pub velocities: Bounds,
}

impl Body {
    /// Whether it meets other bodies, or itself, and has something to meet with.
    pub(crate) fn meets_tissue(&self) -> bool {
        (self.contact.with_bodies || self.contact.with_itself) && !self.surface.is_empty()
    }

    /// Its surface in its own numbers.
    pub(crate) fn own_surface(&self) -> Result<Vec<[u32; 3]>> {
        self.order.own_triangles(&self.surface)
    }

    /// Makes room for forces of contact.
    pub(crate) fn make_room_for_forces(&mut self) -> Result<()> {
        if self.applied.is_none() {
            self.applied = Some(Vectors::zeros(self.node_count())?);
        }
        Ok(())
    }

    /// Adds `force`, N, to what acts on a node, in its own numbers, over the next step: what acted before.
    pub(crate) fn push_node(&mut self, node: usize, force: Vec3) -> Vec3 {
        let held = self.pins.axes_of(node as u32);
        let Some(applied) = &mut self.applied else {
            return Vec3::ZERO;
        };
        let before = applied.get(node);
        let sum = (before + Vec3::select(held, Vec3::ZERO, force)).clamp(Vec3::MIN, Vec3::MAX);
        applied.set(node, sum);
        self.forces_applied = true;
        before
    }

    /// What acts on a node over the next step is this, N, as before it was pushed.
    pub(crate) fn set_push(&mut self, node: usize, force: Vec3) {
        if let Some(applied) = &mut self.applied {
            applied.set(node, force);
        }
    }

    /// Gives a node this velocity, m/s, in a substep: it has received `impulse`, N s, which a pinned node hands on.
    pub(crate) fn nudge(&mut self, node: usize, velocity: Vec3, impulse: Vec3, moment: &Moment) {
        let held = self.pins.axes_of(node as u32);
        if let Some(pin) = self.pins.get_mut(node as u32) {
            pin.force_sum -= pin.held(impulse).as_dvec3() / f64::from(moment.duration);
        }
        if self.inverse_masses[node] == 0.0 {
            return;
        }
        let state = self.state.substep();
        let was = state.velocities.get(node);
        state.velocities.set(node, Vec3::select(held, was, velocity));
        if moment.drifts {
            let led = state.next_positions.get(node);
            let moved = state.positions.get(node) + velocity * moment.duration;
            state.next_positions.set(node, Vec3::select(held, led, moved));
        }
    }

    /// Moves a node at the end of a substep, without giving it speed.
    pub(crate) fn part_substep(&mut self, node: usize, way: Vec3) {
        let next_positions = self.state.substep().next_positions;
        let place = next_positions.get(node) + way;
        next_positions.set(node, place);
    }

    /// A box about it, in its own coordinates.
    pub(crate) fn bounds(&self) -> Bounds {
        self.boxes.iter().fold(Bounds::EMPTY, Bounds::and)
    }

    /// Has these nodes go through the step of `dt` seconds that was tried with these mean velocities, m/s.
    pub(crate) fn deflect(&mut self, nodes: &[u32], means: &Vectors, dt: f32) {
        for &node in nodes {
            let node = node as usize;
            if self.inverse_masses[node] == 0.0 {
                continue;
            }
            let start = self.state.positions().get(node);
            let (positions, velocities) = self.state.newest_mut();
            let was = positions.get(node);
            // As it was worked out for the nodes that are left alone.
            let given = means.get(node) - (was - start) / dt;
            if given == Vec3::ZERO {
                continue;
            }
            let held = self.pins.partial_axes_of(node as u32);
            let place = Vec3::select(held, was, start + means.get(node) * dt);
            let velocity = velocities.get(node) + Vec3::select(held, Vec3::ZERO, given);
            velocities.set(node, velocity);
            // What is moved at the end of a step of many substeps stores energy in springs that nobody has put in.
            let Some(implicit) = &mut self.implicit else {
                self.note_deflection(0.0, velocity);
                continue;
            };
            positions.set(node, place);
            implicit.deflect(node, given);
            self.note_deflection(place.distance(was), velocity);
        }
    }

    /// Moves a node at the end of the step that was tried, without giving it speed.
    pub(crate) fn part(&mut self, node: usize, way: Vec3) {
        if way == Vec3::ZERO {
            return;
        }
        let (positions, velocities) = self.state.newest_mut();
        let (place, velocity) = (positions.get(node) + way, velocities.get(node));
        positions.set(node, place);
        self.note_deflection(way.length(), velocity);
    }

    fn note_deflection(&mut self, way: f32, velocity: Vec3) {
        let deflection = self.deflection.get_or_insert(Deflection {
            furthest: 0.0,
            velocities: Bounds::EMPTY,
        });
        deflection.furthest = deflection.furthest.max(way);
        deflection.velocities = deflection.velocities.with(velocity);
    }
}
