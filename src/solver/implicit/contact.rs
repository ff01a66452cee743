//! Tools and an implicit step: the springs' equation is solved as if there were none, and then the nodes that would enter them
//! are stopped.
//!
//! What the tools give is not known to the springs before the next step, so near them steps are short.

use super::step::Substep;
use super::{End, Implicit};
use crate::body::{Body, Bounds, Mobility, Vectors};
use crate::contact::Meeting;
use crate::solver::kick::look;
use crate::springs::{tile_count, tile_nodes};

/// The longest step near a tool, s.
pub(super) const LONGEST: f64 = 1e-3;

/// Whether a tool was near when the body was last looked at.
pub(super) fn is_near(body: &Body) -> bool {
    body.contacts.as_ref().is_some_and(|contacts| !contacts.are_far())
}

impl Substep<'_> {
    /// Lets tools stop the nodes that would enter them.
    pub(super) fn meet(&self, body: &mut Body, implicit: &mut Implicit) -> End {
        let Some(contacts) = &mut body.contacts else {
            return End::Fine;
        };
        let next = 1 - implicit.settled;
        let (per_step, step) = ((1.0 / self.step) as f32, self.step as f32);
        let means = &mut implicit.products;
        scaled(&implicit.histories[next].ways, per_step, means);
        let velocities = (0..tile_count(means.len()))
            .map(|tile| look(body.kernel, means.slices(tile_nodes(tile, means.len())), None).velocities)
            .fold(Bounds::EMPTY, |bounds, other| bounds.and(&other));
        let state = body.state.substep();
        contacts.resolve(Meeting {
            tools: self.request.tools,
            origin: body.origin,
            dt: self.request.dt,
            start: self.start,
            end: self.end,
            substep: step,
            drifts: true,
            fastest: velocities.min.abs().max(velocities.max.abs()).length(),
            mobility: Mobility {
                inverse_masses: &body.inverse_masses,
                damping: None,
                substep: step,
                half: false,
            },
            positions: state.positions,
            velocities: means,
            next_positions: state.next_positions,
            pins: &mut body.pins,
        });
        if contacts.are_far() {
            return End::Fine;
        }
        if self.step > LONGEST {
            return End::Near;
        }
        // What a tool gives belongs to the whole step and the one before: it is no gain that will go on.
        let history = &mut implicit.histories[next];
        let axes = state
            .velocities
            .axes_mut()
            .into_iter()
            .zip(history.ways.axes_mut())
            .zip(means.axes());
        for ((velocities, ways), means) in axes {
            for ((velocity, way), mean) in velocities.iter_mut().zip(ways).zip(means) {
                let given = mean - *way * per_step;
                if given != 0.0 {
                    *velocity += given;
                    *way = mean * step;
                }
            }
        }
        history.energy = None;
        if body.state.next_is_finite() {
            End::Fine
        } else {
            End::NotFinite
        }
    }
}

fn scaled(from: &Vectors, factor: f32, to: &mut Vectors) {
    for (to, from) in to.axes_mut().into_iter().zip(from.axes()) {
        for (to, from) in to.iter_mut().zip(from) {
            *to = from * factor;
        }
    }
}
