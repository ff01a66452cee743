//! What bonds do in the substeps of a group of bodies.

use glam::{DVec3, Vec3};

use super::super::link::Link;
use super::super::skin::Skin;
use super::{Bond, BondCorner, BondEnd, Bonds, CLOSING_SPEED};
use crate::solver::{Span, System, Systems};

/// What is apart comes together within so many seconds, but for an e-th; at most by `LARGEST_PART` in a substep.
const CLOSING_TIME: f64 = 0.02;
const LARGEST_PART: f64 = 0.2;

/// The part of the way by which points may miss where they are to be, after `SWEEPS`.
const MISSED: f64 = 0.2;

/// What is apart by more than this part of the smaller body's extent takes work to close.
const SEEN: f64 = 1e-4;

/// Sweeps over what is apart.
const SWEEPS: u32 = 8;

/// The longest substep where an implicit solver moves a body, s. One length whatever the load: how far its equation leaves a point off
/// goes with the square of it, and a change would be a jolt.
const LONGEST: f64 = 0.25e-3;

/// Steps of 1 ms are a little longer than that in `f32`.
const ROUNDED: f64 = 1e-3;

/// Velocities that differ by less than this part of themselves are equal.
const ROUNDING: f32 = 2e-7;

impl Bonds {
    /// Begins to attempt the step of a group, of which these bodies are, which may be taken several times, until [`Self::unload`].
    pub fn attempt(&mut self, bodies: &mut impl Systems, is_of_group: impl Fn(usize) -> bool) {
        for end in &mut self.ends {
            end.is_in_turn = is_of_group(end.body);
            if let Some(body) = bodies.at_mut(end.body).filter(|_| end.is_in_turn) {
                body.attach();
                end.is_pending = body.forces_applied;
                end.pending = match &body.applied {
                    Some(applied) if body.forces_applied => applied.get(end.node as usize),
                    _ => Vec3::ZERO,
                };
            }
        }
        for bond in &mut self.bonds {
            let solution = |corner: BondCorner| bodies.at(corner.body)?.integrator.solution();
            bond.has_equation = bond.used().any(|corner| solution(corner).is_some());
            bond.is_in_turn = bond.used().all(|corner| is_of_group(corner.body));
        }
    }

    /// Begins the step over, of `dt` seconds, from what is current.
    pub fn begin(&mut self, dt: f32) {
        self.is_opening = true;
        for bond in self.bonds.iter_mut().filter(|bond| bond.is_in_turn) {
            bond.load = bond.foreseen;
            (bond.sum, bond.work) = (DVec3::ZERO, 0.0);
            if let Some(thread) = &mut bond.thread {
                thread.begin(dt);
            }
        }
    }

    /// How many substeps a step of `dt` seconds takes at least.
    pub fn substeps(&self, dt: f32) -> u32 {
        if self.bonds.iter().any(|bond| bond.is_in_turn && bond.has_equation) {
            (f64::from(dt) / LONGEST - ROUNDED)
                .ceil()
                .clamp(1.0, f64::from(u32::MAX / 4)) as u32
        } else {
            1
        }
    }

    /// What bonds of the group have put in in the step, and what their threads store as it ends, J; `None` where that is not known: a thread
    /// becomes shorter, is led or gives way.
    pub(in crate::deformable_contact) fn energy(&self) -> Option<[f64; 2]> {
        let mut sums = [0.0; 2];
        for bond in self.bonds.iter().filter(|bond| bond.is_in_turn) {
            let stored = bond.thread.as_ref().map_or(Some(0.0), |thread| {
                let distance = bond.apart(&self.ends).length();
                thread.is_elastic().then(|| thread.energy(distance))
            });
            sums = [sums[0] + bond.work, sums[1] + stored?];
        }
        Some(sums)
    }

    /// Has the forces that are foreseen act in what follows.
    pub fn load(&mut self, bodies: &mut impl Systems) {
        self.ends.iter_mut().for_each(|end| end.given = Vec3::ZERO);
        let Self { bonds, ends, .. } = self;
        for bond in bonds.iter().filter(|bond| bond.is_in_turn && !bond.has_equation) {
            for corner in bond.used() {
                ends[corner.end].given += bond.load * corner.weight;
            }
        }
        for end in ends.iter().filter(|end| end.is_in_turn) {
            if let Some(body) = bodies.at_mut(end.body) {
                let free = Vec3::select(body.answer_of(end.node).cmpgt(Vec3::ZERO), Vec3::ONE, Vec3::ZERO);
                let force = (end.pending + end.given * free).clamp(Vec3::MIN, Vec3::MAX);
                body.load(end.node as usize, force);
            }
        }
    }

    /// Takes the forces off again that were foreseen: only what the caller applied is left.
    pub fn unload(&self, bodies: &mut impl Systems) {
        for end in self.ends.iter().filter(|end| end.is_in_turn) {
            if let Some(body) = bodies.at_mut(end.body) {
                body.load(end.node as usize, end.pending);
                body.forces_applied = end.is_pending;
            }
        }
    }

    /// Takes a substep as it is to be, after the skins.
    pub(in crate::deformable_contact) fn follow(
        &mut self,
        bodies: &mut impl Systems,
        skins: &[Option<Skin>],
        moment: &Span,
    ) {
        for end in self.ends.iter_mut().filter(|end| end.is_in_turn) {
            let Some(body) = bodies.at_mut(end.body) else { continue };
            let skin = skins.get(end.body).and_then(Option::as_ref);
            end.is_on_skin = moment.concerns(body) && skin.is_some_and(|skin| skin.has(end.node));
            end.velocity = body.mean_velocity(end.node as usize);
            end.answer = body.answer_of(end.node) * body.left_by_damping(end.node, moment);
            end.place = body.state.newest().0.get(end.node as usize).as_dvec3() + body.origin;
            end.shift = DVec3::ZERO;
        }
        for bond in &mut self.bonds {
            bond.acts = bond.is_in_turn && (moment.drifts || !bond.has_equation);
            if !bond.acts {
                continue;
            }
            bond.impulse = Vec3::ZERO;
            let corners = bond.used();
            let whole: Vec3 = corners
                .map(|corner| self.ends[corner.end].answer * (corner.weight * corner.weight))
                .sum();
            bond.masses = Vec3::select(whole.cmpgt(Vec3::ZERO), whole.recip(), Vec3::ZERO);
            if bond.thread.is_some() {
                let (apart, duration) = (bond.apart(&self.ends), bond.duration(moment, self.is_opening));
                let [velocity, _] = bond.velocity(&self.ends, skins);
                if let Some(thread) = &mut bond.thread {
                    thread.follow(apart, velocity.as_dvec3(), whole.as_dvec3(), duration, moment);
                }
            }
        }
    }

    /// Has threads between bodies that keep each other apart by these contacts give way to them.
    pub(in crate::deformable_contact) fn loosen(&mut self, links: &[Link], moment: &Span) {
        for bond in self.bonds.iter_mut().filter(|bond| bond.acts) {
            let [a, b] = bond.points.map(|point| point.body);
            if let Some(thread) = &mut bond.thread {
                let mut pairs = links.iter().map(|link| link.sides.map(|side| side.body));
                if pairs.any(|pair| pair == [a, b] || pair == [b, a]) {
                    thread.loosen(moment);
                }
            }
        }
    }

    /// Makes the velocities of the points of each bond equal, or those that its thread asks for, one after the other: the largest difference
    /// that there was, m/s.
    pub(in crate::deformable_contact) fn sweep(&mut self, skins: &mut [Option<Skin>], moment: &Span) -> f32 {
        let mut largest = 0.0_f32;
        for bond in self.bonds.iter_mut().filter(|bond| bond.acts) {
            let [velocity, size] = bond.velocity(&self.ends, skins);
            let (given, change) = match &bond.thread {
                None => {
                    let counts = velocity.abs().cmpgt(size * ROUNDING) & bond.masses.cmpgt(Vec3::ZERO);
                    let change = Vec3::select(counts, velocity, Vec3::ZERO);
                    (-change * bond.masses, change)
                }
                Some(thread) => {
                    let before = bond.load * bond.duration(moment, self.is_opening) + bond.impulse;
                    let all = thread.impulse(velocity.as_dvec3(), before.as_dvec3());
                    let given = all.as_vec3().clamp(Vec3::MIN, Vec3::MAX) - before;
                    let answer = bond.masses.recip();
                    let change = given * answer;
                    let rounded = size.max(before.abs() * answer) * ROUNDING;
                    let counts = bond.masses.cmpgt(Vec3::ZERO) & change.abs().cmpgt(rounded);
                    (given, Vec3::select(counts, change, Vec3::ZERO))
                }
            };
            if given == Vec3::ZERO {
                continue;
            }
            bond.impulse += given;
            for corner in bond.used() {
                self.ends[corner.end].quicken(given * corner.weight, skins);
            }
            largest = largest.max(change.length());
        }
        largest
    }

    /// Gives bodies what was found, and foresees the same for the next substep.
    pub(in crate::deformable_contact) fn give(
        &mut self,
        bodies: &mut impl Systems,
        skins: &[Option<Skin>],
        moment: &Span,
    ) {
        self.ends.iter_mut().for_each(|end| end.given = Vec3::ZERO);
        for bond in self.bonds.iter_mut().filter(|bond| bond.acts) {
            let duration = bond.duration(moment, self.is_opening);
            let all = bond.load * duration + bond.impulse;
            if !bond.has_equation {
                bond.load += bond.impulse / duration;
            }
            for corner in bond.used() {
                self.ends[corner.end].given += all * corner.weight;
            }
            bond.sum += all.as_dvec3();
            if let Some(thread) = &mut bond.thread {
                thread.go_on(moment);
            }
        }
        for end in self.ends.iter_mut().filter(|end| end.is_in_turn) {
            if let Some(body) = bodies.at_mut(end.body)
                && moment.concerns(body)
            {
                end.velocity = end.velocity(skins);
                body.draw(end.node as usize, end.velocity, end.given, moment);
            }
        }
        self.is_opening = false;
    }

    /// Moves what is apart at the end of a substep of `duration` seconds together, without giving it speed.
    pub(in crate::deformable_contact) fn part(&mut self, bodies: &mut impl Systems, duration: f32) {
        let Self { bonds, ends, .. } = self;
        for end in ends.iter_mut().filter(|end| end.is_in_turn) {
            if let Some(body) = bodies.at(end.body) {
                let place = body.state.next_positions().get(end.node as usize);
                end.place = place.as_dvec3() + body.origin;
                end.shift = DVec3::ZERO;
            }
        }
        let duration = f64::from(duration);
        let closed = (duration / CLOSING_TIME).min(LARGEST_PART);
        let holds = |bond: &Bond| bond.is_in_turn && bond.thread.is_none();
        for bond in bonds.iter_mut().filter(|bond| holds(bond)) {
            let apart = bond.apart(ends);
            let way = (apart * closed).clamp_length_max(CLOSING_SPEED * duration);
            bond.gap = apart - way;
            // Gaps that rounding opens and closes take no work.
            let extents = bond
                .points
                .iter()
                .filter_map(|point| bodies.at(point.body))
                .map(System::extent);
            if apart.length() > SEEN * f64::from(extents.fold(f32::INFINITY, f32::min)) {
                bond.work -= bond.load.as_dvec3().dot(way);
            }
            bond.miss = MISSED * way.abs().max_element();
        }
        for _ in 0..SWEEPS {
            let mut is_done = true;
            for bond in bonds.iter().filter(|bond| holds(bond)) {
                let off = bond.apart(ends) - bond.gap;
                is_done &= off.abs().max_element() <= bond.miss;
                let off = off * bond.masses.as_dvec3();
                for corner in bond.used() {
                    let end = &mut ends[corner.end];
                    end.shift -= off * (end.answer.as_dvec3() * f64::from(corner.weight));
                }
            }
            if is_done {
                break;
            }
        }
        for end in ends {
            if end.is_in_turn
                && end.shift != DVec3::ZERO
                && let Some(body) = bodies.at_mut(end.body)
            {
                body.part_substep(end.node as usize, end.shift.as_vec3());
            }
        }
    }
}

impl Bond {
    /// How far its points are apart as ends are placed, m.
    fn apart(&self, ends: &[BondEnd]) -> DVec3 {
        let place = |end: &BondEnd| end.place + end.shift;
        let parts = self
            .used()
            .map(|corner| place(&ends[corner.end]) * f64::from(corner.weight));
        parts.sum()
    }

    /// The velocity of its first point against the second, and the largest that a corner adds to it along each axis, m/s.
    fn velocity(&self, ends: &[BondEnd], skins: &[Option<Skin>]) -> [Vec3; 2] {
        let (mut velocity, mut size) = (Vec3::ZERO, Vec3::ZERO);
        for corner in self.used() {
            let part = ends[corner.end].velocity(skins) * corner.weight;
            velocity += part;
            size = size.max(part.abs());
        }
        [velocity, size]
    }

    /// How long forces act in this moment, s.
    fn duration(&self, moment: &Span, is_opening: bool) -> f32 {
        let is_half = !self.has_equation && (is_opening || !moment.drifts);
        if is_half {
            0.5 * moment.duration
        } else {
            moment.duration
        }
    }
}

impl BondEnd {
    fn velocity(&self, skins: &[Option<Skin>]) -> Vec3 {
        match skins.get(self.body) {
            Some(Some(skin)) if self.is_on_skin => skin.velocities[self.node as usize].into(),
            _ => self.velocity,
        }
    }

    fn quicken(&mut self, impulse: Vec3, skins: &mut [Option<Skin>]) {
        let velocity = self.velocity(skins) + impulse * self.answer;
        match skins.get_mut(self.body) {
            Some(Some(skin)) if self.is_on_skin => skin.velocities[self.node as usize] = velocity.into(),
            _ => self.velocity = velocity,
        }
    }
}
