//! Tools and an implicit step: contacts that can be foreseen belong to its equation, and then the nodes that would still enter
//! a tool are stopped.
//!
//! What is not foreseen is not known to the springs before the next step, so near tools steps are short, or taken again where much was
//! not foreseen.

use glam::Vec3;

use super::parts::parts_near;
use super::step::Substep;
use super::{End, Implicit};
use crate::base::{Stage, Stopwatch};
use crate::contact::{Contacts, Meeting};
use crate::geometry::Bounds;
use crate::nodes::Mobility;
use crate::soa::{Vectors, tile_count, tile_nodes};
use crate::solver::System;
use crate::solver::kick::look;
use crate::solver::step_request::StepRequest;

/// The longest step near a tool, s.
pub(super) const LONGEST: f64 = 1e-3;

/// With a smaller budget than this short parts would have too few products each to be solved.
const SMALL: u32 = 256;

/// What a part of a step costs beside its products, in products.
pub(super) const COST_OF_A_PART: u32 = 10;

/// Whether a part longer than that may be tried. What comes near on the way ends up to some micrometres inside, so a budget that is enough
/// for short parts is used for them, unless the caller allows less work than those take.
pub(super) fn may_be_long(body: &System, implicit: &Implicit, request: &StepRequest) -> bool {
    let is_alone = request.dynamic.is_empty() && request.neighbor_speed.is_none() && body.bindings.is_none();
    let is_bounded = || implicit.newton.is_none() && implicit.is_bounded();
    let too_little_work = COST_OF_A_PART.saturating_mul(parts_near(request.dt));
    let is_short_of_work = implicit.has_small_budget() || is_bounded() && implicit.allowed < too_little_work;
    is_short_of_work && !implicit.solution.is_attached && is_alone && body.contacts.is_some()
}

/// How far an open contact may be to belong to an equation, as a part of the body's extent.
const SLACK: f32 = 0.002;

/// The same for a long step: what it does not foresee is stopped as far as a straight way tells, and may end a little inside.
const LONG_SLACK: f32 = 0.01;

/// Whether a tool was near when the body was last looked at.
pub(super) fn is_near(body: &System) -> bool {
    body.contacts.as_ref().is_some_and(|contacts| !contacts.are_far())
}

impl Substep<'_> {
    /// Finds the contacts that belong to the equation. What they do begins and ends within a step, so that it is one of order 1
    /// where there are some. `None`: they are too far from their places for a long one.
    pub(super) fn foreseeing(&self, body: &mut System, implicit: &mut Implicit) -> Option<Self> {
        if !is_near(body) || self.is_long() && !may_be_long(body, implicit, self.request) {
            if let Some(contacts) = &mut body.contacts {
                contacts.holds.clear();
            }
            return Some(*self);
        }
        let Some(means) = &mut implicit.means else {
            return Some(*self);
        };
        let state = body.state.substep();
        let velocities = if self.is_first {
            state.first_velocities
        } else {
            &*state.velocities
        };
        means.copy_from(velocities);
        let carried = self.carried() as f32;
        if carried != 0.0 && self.is_long() {
            // Where a formula of order 2 has nodes without a push, as velocities that lead there.
            let history = implicit.solution.last(self.is_first);
            let [part, rate] = [self.time() / self.step, 1.0 / self.step].map(|factor| factor as f32);
            let of_history = history.ways.axes().into_iter().zip(history.gains.axes());
            for (means, (ways, gains)) in means.axes_mut().into_iter().zip(of_history) {
                for (mean, (way, gain)) in means.iter_mut().zip(ways.iter().zip(gains)) {
                    *mean = carried * rate * way + part * (*mean + carried * gain);
                }
            }
        }
        for pin in body.pins.iter() {
            pin.put_among(means, pin.travel / self.request.dt);
        }
        let per_mass = 1.0 / (self.step * self.step);
        let is_long = self.is_long();
        let mut is_told = true;
        self.contact(body, means, |contacts, meeting, stiffness_of| {
            let inverse_masses = meeting.mobility.inverse_masses;
            is_told = contacts.foresee(meeting, is_long, |node| {
                if inverse_masses[node] == 0.0 {
                    return f32::INFINITY;
                }
                stiffness_of(node, per_mass)
            });
        });
        // Nor is a dynamic tool's impulse on a node one that goes on.
        let is_of_order_1 = |contacts: &Contacts| !contacts.holds.is_empty() || contacts.has_dynamic();
        if self.is_long() {
            return (is_told || self.stands).then_some(*self);
        }
        if body.contacts.as_deref().is_some_and(is_of_order_1) {
            Some(self.of_order_1())
        } else {
            Some(*self)
        }
    }

    /// Whether the equation of a long part did what contacts had to do, so that tissue knew of it all along.
    fn is_foreseen(&self, contacts: &Contacts, pushes: &Vectors, residuals: &Vectors) -> bool {
        /// What may be given after the equation, and what its contacts may lack, as a part of what they do.
        const BEYOND: f64 = 0.05;
        const MISSING: f64 = 0.2;
        let push = |node: usize| pushes.get(node).as_dvec3();
        let residual = |node: usize| residuals.get(node).as_dvec3();
        let [beyond, all] = contacts.beyond_holds(self.step);
        beyond <= BEYOND * all
            && contacts.holds.missing(push) <= MISSING
            && contacts.holds.imbalance(residual) <= MISSING
    }

    /// Whether it is longer than a step that contacts need not know of.
    pub(super) fn is_long(&self) -> bool {
        self.step > LONGEST
    }

    /// Whether contacts do what the nodes at them need, as far as is asked for, and in a long step what their multipliers ask for, but for this
    /// part.
    pub(super) fn is_balanced(&self, body: &System, implicit: &Implicit, lacking: f64) -> bool {
        let Some(contacts) = body.contacts.as_deref().filter(|contacts| !contacts.holds.is_empty()) else {
            return true;
        };
        let residual = |node: usize| implicit.residuals.get(node).as_dvec3();
        let push = |node: usize| implicit.pushes.get(node).as_dvec3();
        contacts.holds.imbalance(residual) <= f64::from(implicit.accuracy)
            && !(self.is_long() && contacts.holds.missing(push) > lacking)
    }

    /// Has contacts take up by how much the forces on tools are off where the equation is off by so much in the squared norm of its matrix, J.
    pub(super) fn bound_tool_forces(&self, body: &mut System, implicit: &Implicit, square: f64) {
        let per_mass = (1.0 / (self.step * self.step)) as f32;
        let (forces, masses) = (&body.forces, &body.masses);
        let grasps = body.grasps.as_deref();
        let stiffness_held = |slot: usize| {
            let held = grasps.into_iter().flat_map(|grasps| grasps.held_nodes());
            let held = held.filter(|(_, tool)| *tool == slot);
            held.map(|(node, _)| f64::from(forces.stiffness_at(node, masses[node] * per_mass)))
                .sum()
        };
        let push = |node: usize| implicit.pushes.get(node).as_dvec3();
        if let Some(contacts) = &mut body.contacts {
            contacts.bound_force_errors(self.request.tools, square, push, stiffness_held);
        }
    }

    /// Makes the preconditioner one of the pressed contacts too: their stiffness is part of the blocks, and the coarse level, which
    /// knows nothing of it, leaves their nodes alone.
    pub(super) fn stiffen(&self, body: &System, implicit: &mut Implicit) {
        implicit.soften();
        let Some(contacts) = &body.contacts else {
            return;
        };
        contacts.holds.show_blocks(|node, block| {
            if implicit.stiffened.len() < implicit.stiffened.capacity() {
                implicit.stiffened.push((node as u32, implicit.coarse.part(node)));
                implicit.coarse.set_part(node, [0.0; 4]);
                implicit
                    .blocks
                    .invert_one(node, implicit.inertia[node], block.map(|entry| entry as f32));
            }
        });
    }

    /// Has the contacts of `body` do something about nodes that move with these velocities; also given what resists the moving of a node
    /// with so much inertia per mass, 1/s², N/m.
    fn contact(
        &self,
        body: &mut System,
        velocities: &mut Vectors,
        act: impl FnOnce(&mut Contacts, Meeting, &dyn Fn(usize, f64) -> f32),
    ) {
        let profile = self.request.profile;
        let watch = Stopwatch::start(profile);
        let neighbor_speed = self.request.neighbor_speed;
        let part = if self.is_long() { LONG_SLACK } else { SLACK };
        let slack = part * body.extent() + self.step as f32 * neighbor_speed.unwrap_or(0.0);
        let Some(contacts) = &mut body.contacts else {
            return;
        };
        let node_count = velocities.len();
        let bounds = (0..tile_count(node_count))
            .map(|tile| look(body.kernel, velocities.slices(tile_nodes(tile, node_count)), None).velocities)
            .fold(Bounds::EMPTY, |bounds, other| bounds.and(&other));
        let state = body.state.substep();
        let meeting = Meeting {
            kernel: body.kernel,
            tools: self.request.tools,
            origin: body.origin,
            dt: self.request.dt,
            start: self.start,
            end: self.end,
            substep: self.step as f32,
            drifts: true,
            slack,
            neighbor_speed,
            thickness: contacts.thickness,
            fastest: bounds.magnitudes().length(),
            mobility: Mobility {
                inverse_masses: &body.inverse_masses,
                damping: None,
                substep: self.step as f32,
                half: false,
                asleep: None,
            },
            positions: state.positions,
            velocities,
            next_positions: state.next_positions,
            pins: &mut body.pins,
            bindings: body.bindings.as_ref(),
            profile,
        };
        let (forces, masses) = (&body.forces, &body.masses);
        act(contacts, meeting, &|node, per_mass| {
            forces.stiffness_at(node, (f64::from(masses[node]) * per_mass) as f32)
        });
        watch.take_off(profile, Stage::Solver);
    }

    /// Lets tools stop the nodes that would enter them.
    pub(super) fn meet(&self, body: &mut System, implicit: &mut Implicit) -> End {
        let may_stand = may_be_long(body, implicit, self.request);
        let Some(means) = &mut implicit.means else {
            return End::Fine;
        };
        let (per_step, step) = ((1.0 / self.step) as f32, self.step as f32);
        scaled(&implicit.solution.next().ways, per_step, means);
        let may_forgo = self.stands && self.is_long();
        self.contact(body, means, |contacts, meeting, _| {
            if may_forgo {
                contacts.forgo_holds(&meeting);
            }
            contacts.resolve(meeting);
        });
        let Some(contacts) = &body.contacts else {
            return End::Fine;
        };
        if contacts.are_far() {
            return End::Fine;
        }
        let is_foreseen = || may_stand && self.is_foreseen(contacts, &implicit.pushes, &implicit.residuals);
        if self.is_long() && !self.stands && !is_foreseen() {
            return End::Near;
        }
        let history = implicit.solution.next_mut();
        let axes = body
            .state
            .substep()
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
        // What a tool gives is no gain that will go on, unless it gave it before: then motion is smooth.
        let is_smooth = self.is_long() && implicit.taken.carried != 0.0;
        let state = body.state.substep();
        contacts.show_touched(is_smooth, |node, normal| {
            let along = |vector: Vec3| normal.map_or(vector, |normal| vector.project_onto_normalized(normal));
            let gain = history.gains.get(node);
            history.gains.set(node, gain - along(gain));
            if is_smooth {
                // Who is stopped goes on as the tool does; order 2 would have it rebound.
                let velocity = state.velocities.get(node);
                let more = history.ways.get(node) * per_step - velocity;
                state.velocities.set(node, velocity + along(more));
            }
        });
        for pin in body.pins.partial() {
            pin.put_among(&mut history.gains, Vec3::ZERO);
        }
        history.energy = None;
        if self.is_long()
            && let Some(contacts) = &mut body.contacts
        {
            contacts.average_loads(self.request.tools, self.step);
            contacts.take_beyond_holds(self.step);
        }
        if body.state.next_is_finite() {
            End::Fine
        } else {
            End::NotFinite
        }
    }
}

impl Implicit {
    /// Whether it takes long steps beside tools whatever is allowed.
    fn has_small_budget(&self) -> bool {
        self.newton.is_none() && self.budget < SMALL
    }

    /// Whether the caller allows less work than the definition.
    pub(super) fn is_bounded(&self) -> bool {
        self.allowed < self.budget
    }

    /// Makes the preconditioner what it is without contacts.
    pub(super) fn soften(&mut self) {
        while let Some((node, part)) = self.stiffened.pop() {
            let node = node as usize;
            self.coarse.set_part(node, part);
            self.blocks.invert_one(node, self.inertia[node], [0.0; 6]);
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
