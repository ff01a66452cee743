//! What other tissue does to a body at the end of a step that it has tried.

use glam::{BVec3, Vec3};

use super::closing::close;
use super::{Changed, System};
use crate::base::{Profile, Result};
use crate::nodes::{Bindings, parts};

/// What of a step is looked at.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Span<'a> {
    /// Of the substep or step, s.
    pub duration: f32,
    /// Whether positions change: not with the last half kick of a step.
    pub drifts: bool,
    /// Whether it begins a step.
    pub begins: bool,
    /// Where the stages are timed, if they are.
    pub profile: Option<&'a Profile>,
}

impl Span<'_> {
    /// Whether a body has a part in it: that which closes a step is VERLET's.
    pub fn concerns(&self, body: &System) -> bool {
        self.drifts || body.integrator.takes_half_kicks()
    }
}

impl System {
    /// Whether it meets other bodies, or itself, and has something to meet with.
    pub fn meets_tissue(&self) -> bool {
        (self.contact.with_bodies || self.contact.with_itself) && !self.surface.is_empty()
    }

    /// Its surface in its own numbers.
    pub fn own_surface(&self) -> Result<Vec<[u32; 3]>> {
        self.order.own_triangles(&self.surface)
    }

    /// How many nodes may come that there is room for.
    pub fn spare_nodes(&self) -> usize {
        self.node_room.saturating_sub(self.node_count())
    }

    /// The nodes that move one of its own numbers, with their parts: itself where it is bound to none.
    pub fn movers(&self, own: u32) -> impl Iterator<Item = (u32, f32)> + use<> {
        parts(self.bindings.as_ref(), own)
    }

    /// Has what holds a node take its part of an impulse, N s: along which axes that is, unless nothing moves the node.
    fn hand_on(&mut self, node: usize, impulse: Vec3, moment: &Span) -> Option<BVec3> {
        let held = self.pins.axes_of(node as u32);
        if let Some(pin) = self.pins.get_mut(node as u32) {
            pin.force_sum -= pin.held(impulse).as_dvec3() / f64::from(moment.duration);
        }
        (self.inverse_masses[node] > 0.0).then_some(held)
    }

    /// Gives a node this mean velocity, m/s, in a substep: it has received `impulse`, N s, which a pinned node hands on.
    pub fn nudge(&mut self, node: usize, velocity: Vec3, impulse: Vec3, moment: &Span) {
        let Some(held) = self.hand_on(node, impulse, moment) else {
            return;
        };
        let state = self.state.substep();
        let was = state.velocities.get(node);
        let now = match self.integrator.solution_mut() {
            None => velocity,
            Some(solution) => was + solution.deflect(node, Vec3::select(held, solution.mean(node), velocity)),
        };
        state.velocities.set(node, Vec3::select(held, was, now));
        if moment.drifts {
            let led = state.next_positions.get(node);
            let moved = state.positions.get(node) + velocity * moment.duration;
            state.next_positions.set(node, Vec3::select(held, led, moved));
        }
    }

    /// Makes room for forces on nodes that are attached.
    pub fn reserve_bonds(&mut self) -> Result<()> {
        if self.applied.is_none() {
            self.applied = Some(self.zeros()?);
        }
        Ok(())
    }

    /// It is attached in the step in progress.
    pub fn attach(&mut self) {
        if let Some(solution) = self.integrator.solution_mut() {
            solution.is_attached = true;
        }
    }

    /// Goes on with nothing of the last step but positions and velocities, now that it is attached.
    pub fn begin_bonds(&mut self) {
        close(self);
        self.changed(Changed::Course);
    }

    /// The same, now that it is attached no more.
    pub fn end_bonds(&mut self) {
        if let Some(solution) = self.integrator.solution_mut() {
            solution.is_attached = false;
        }
        self.changed(Changed::Course);
    }

    /// Its own numbers of the nodes that move one of the caller's, with their parts: itself where it is bound to none.
    pub fn parts_of(&self, node: u32) -> impl Iterator<Item = (u32, f32)> {
        parts(self.bindings.as_ref(), self.order.own(node))
    }

    /// How much faster a node becomes for an impulse, along each axis, 1/kg.
    pub fn answer_of(&self, node: u32) -> Vec3 {
        let held = self.pins.axes_of(node);
        Vec3::select(held, Vec3::ZERO, Vec3::splat(self.inverse_masses[node as usize]))
    }

    /// What damping leaves of the speed that an impulse gives to a node, so that the impulse is what the force behind it
    /// would have given undamped.
    pub fn left_by_damping(&self, node: u32, moment: &Span) -> f32 {
        match (self.integrator.solution(), &self.damping) {
            (Some(_), Some(damping)) => 1.0 / (1.0 + damping.rates()[node as usize] * moment.duration),
            // A kick of VERLET gives (1 - exp(-x)) / x of what its forces would undamped: 1 - x / 2 but for terms of order 2.
            (None, Some(damping)) => 1.0 / (1.0 + 0.5 * damping.rates()[node as usize] * moment.duration),
            _ => 1.0,
        }
    }

    /// How fast a node goes on its way in a substep, m/s.
    pub fn mean_velocity(&mut self, node: usize) -> Vec3 {
        match self.integrator.solution() {
            None => self.state.substep().velocities.get(node),
            Some(solution) => solution.mean(node),
        }
    }

    /// What its points are bound to, and where each node begins a substep and how fast it goes on its way, m/s.
    pub fn motion(&mut self) -> (Option<&Bindings>, impl Fn(usize) -> (Vec3, Vec3)) {
        let (state, solution) = (self.state.substep(), self.integrator.solution());
        let motion_of = move |node| {
            let mean = solution.map_or_else(|| state.velocities.get(node), |solution| solution.mean(node));
            (state.positions.get(node), mean)
        };
        (self.bindings.as_ref(), motion_of)
    }

    /// Has this force act on a node, N, instead of what was applied to it.
    pub fn load(&mut self, node: usize, force: Vec3) {
        if let Some(applied) = &mut self.applied {
            applied.set(node, force);
            self.forces_applied = true;
        }
    }

    /// Gives a node that is attached this mean velocity, m/s, in a substep: it has received `impulse` in all, N s, which a pinned node hands on.
    pub fn draw(&mut self, node: usize, velocity: Vec3, impulse: Vec3, moment: &Span) {
        let Some(held) = self.hand_on(node, impulse, moment) else {
            return;
        };
        let given = Vec3::select(held, Vec3::ZERO, velocity - self.mean_velocity(node));
        if given == Vec3::ZERO {
            return;
        }
        if let Some(solution) = self.integrator.solution_mut() {
            solution.draw(node, given, moment.duration);
        }
        let state = self.state.substep();
        state.velocities.set(node, state.velocities.get(node) + given);
        if moment.drifts {
            let way = given * moment.duration;
            state.next_positions.set(node, state.next_positions.get(node) + way);
        }
    }

    /// Makes room for what it keeps of contacts with other tissue.
    pub fn reserve_pressed(&mut self) -> Result<()> {
        if self.integrator.solution().is_none() {
            return self.reserve_early();
        }
        let none = [self.zeros()?, self.zeros()?];
        if let Some(solution) = self.integrator.solution_mut() {
            solution.add_pressed(none);
        }
        Ok(())
    }

    /// Takes from an implicit body again what an equation took to press it, before contacts give what they have to.
    pub fn release_pressed(&mut self, duration: f32) {
        let Some(solution) = self.integrator.solution_mut() else {
            return;
        };
        let state = self.state.substep();
        let rates = self.damping.as_ref().map(|damping| damping.rates());
        solution.release_pressed(&self.inverse_masses, rates, |node, given| {
            state.velocities.set(node, state.velocities.get(node) - given);
            let place = state.next_positions.get(node) - given * duration;
            state.next_positions.set(node, place);
        });
    }

    /// Has the next equation of an implicit body know what a contact gave to a node, N s.
    pub fn press(&mut self, node: u32, impulse: Vec3) {
        let free = self.answer_of(node).cmpgt(Vec3::ZERO);
        if let Some(solution) = self.integrator.solution_mut() {
            let impulse = Vec3::select(free, impulse, Vec3::ZERO);
            let rates = self.damping.as_ref().map(|damping| damping.rates());
            solution.press(node as usize, impulse, rates);
        }
    }

    /// Moves a node at the end of a substep, without giving it speed.
    pub fn part_substep(&mut self, node: usize, way: Vec3) {
        let next_positions = self.state.substep().next_positions;
        let place = next_positions.get(node) + way;
        next_positions.set(node, place);
        if let Some(solution) = self.integrator.solution_mut() {
            solution.part();
        }
    }
}
