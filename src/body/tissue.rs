//! What other tissue does to a body at the end of a step that it has tried.

use glam::Vec3;

use super::Body;
use crate::contact::Moment;
use crate::error::Result;

impl Body {
    /// Whether it meets other bodies, or itself, and has something to meet with.
    pub(crate) fn meets_tissue(&self) -> bool {
        (self.contact.with_bodies || self.contact.with_itself) && !self.surface.is_empty()
    }

    /// Its surface in its own numbers.
    pub(crate) fn own_surface(&self) -> Result<Vec<[u32; 3]>> {
        self.order.own_triangles(&self.surface)
    }

    /// Gives a node this mean velocity, m/s, in a substep: it has received `impulse`, N s, which a pinned node hands on.
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
        let now = match &mut self.implicit {
            None => velocity,
            Some(implicit) => was + implicit.deflect(node, Vec3::select(held, implicit.mean(node), velocity)),
        };
        state.velocities.set(node, Vec3::select(held, was, now));
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
}
