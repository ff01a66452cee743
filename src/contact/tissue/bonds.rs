//! Tissue that is attached to tissue: a point of one body kept at a point of another, or of the same.
//!
//! The bodies take their substeps together. In each, impulses make the mean velocities of both points equal (sequential impulses, Catto 2005).
//!
//! Between bodies of VERLET that is SHAKE (Ryckaert, Ciccotti, Berendsen 1977), and as stable as they are by themselves. What the impulses
//! came to in the last substep is foreseen: it acts as a force in the next kick, so that velocities at the time of the positions, which
//! damping along springs needs, are those of nodes that are held. Where that force entered the equation of an implicit solver its lag would
//! be fed by stiff tissue, and grow; there substeps are of order 1, and the impulses a projection of what was found (Chorin 1968). Such an
//! equation does not know what the point is to carry, and leaves it off by `force time^2 / mass` until the projection: so substeps
//! are short.

use glam::{DVec3, Vec3};

use super::Moment;
use super::skin::Skin;
use crate::body::{Body, Bounds};
use crate::diagnostics::StateHasher;
use crate::error::Result;
use crate::memory;
use crate::slots::{SlotId, Slots};
use crate::solver::Outcome;

/// What is apart comes together within so many seconds, but for an e-th; at most by `LARGEST_PART` in a substep, and no faster than this,
/// m/s, so that bodies that are far apart follow their points.
const CLOSING_TIME: f64 = 0.02;
const LARGEST_PART: f64 = 0.2;
const CLOSING_SPEED: f64 = 0.25;

/// The part of the way by which points may miss where they are to be, after `SWEEPS`.
const MISSED: f64 = 0.2;

/// Sweeps over what is apart.
const SWEEPS: u32 = 8;

/// The longest substep where an implicit solver moves a body, s. One length whatever the load: how far its equation leaves a point off
/// goes with the square of it, and a change would be a jolt.
const LONGEST: f64 = 0.25e-3;

/// Steps of 1 ms are a little longer than that in `f32`.
const ROUNDED: f64 = 1e-3;

/// Velocities that differ by less than this part of themselves are equal.
const ROUNDING: f32 = 2e-7;

/// Corners of both points of a bond.
const CORNERS: usize = 6;

/// A corner of one of the points of a bond.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Corner {
    /// By its place in the world.
    pub body: usize,
    pub node: u32,
    /// Its part of the point; below 0 where it is one of the second point's, 0 where there is none.
    pub weight: f32,
    /// Which of the ends it is; the bonds see to that.
    pub end: usize,
}

/// Two points that are kept together.
#[derive(Clone, Copy, Debug)]
struct Bond {
    /// Its name among the world's attachments.
    id: SlotId,
    corners: [Corner; CORNERS],
    /// The mean force over a step with which it just holds, N.
    limit: f32,
    /// The force on the first point that the next step foresees, N.
    foreseen: Vec3,
    /// The mean force on it over the last step, N.
    mean: Vec3,
    // The step in progress.
    /// Whether it is the turn of the group of its bodies.
    is_in_turn: bool,
    /// The force that this substep foresees, N; none where a body is not moved by VERLET.
    load: Vec3,
    /// What was given beside that in this substep, N s, and all in the step.
    impulse: Vec3,
    sum: DVec3,
    /// How much impulse makes the points faster against each other, along each axis, kg; 0 where neither moves.
    masses: Vec3,
    /// How far the points are to be apart at the end of the substep, and how far they may miss that, m.
    gap: DVec3,
    miss: f64,
    /// Whether it acts in this moment.
    acts: bool,
    /// Whether a body at it is not moved by VERLET.
    is_implicit: bool,
}

/// A node at which bonds are.
#[derive(Clone, Copy, Debug)]
struct End {
    body: usize,
    node: u32,
    /// Whether a bond is there still.
    is_used: bool,
    /// Whether its velocity is that of a skin.
    is_on_skin: bool,
    /// Whether it is the turn of the group of its body.
    is_in_turn: bool,
    velocity: Vec3,
    /// 1/kg; 0 along axes along which it is held.
    answer: Vec3,
    /// What was given to it in this substep, N s, or what is foreseen, N.
    given: Vec3,
    place: DVec3,
    shift: DVec3,
    /// What acts on it from outside in this step, N, and whether anything does on its body.
    pending: Vec3,
    is_pending: bool,
}

/// All bonds of a world.
#[derive(Debug, Default)]
pub(crate) struct Bonds {
    /// In the order in which they came.
    bonds: Vec<Bond>,
    /// In the order of their bodies and nodes.
    ends: Vec<End>,
    /// Whether the first substep is to come, which VERLET begins with half a kick.
    is_opening: bool,
}

impl Bond {
    fn used(&self) -> impl Iterator<Item = Corner> + use<> {
        self.corners.into_iter().filter(|corner| corner.weight != 0.0)
    }

    /// How far its points are apart as ends are placed, m.
    fn apart(&self, ends: &[End]) -> DVec3 {
        let place = |end: &End| end.place + end.shift;
        let parts = self
            .used()
            .map(|corner| place(&ends[corner.end]) * f64::from(corner.weight));
        parts.sum()
    }

    fn concerns(&self, body: usize) -> bool {
        self.used().any(|corner| corner.body == body)
    }

    /// How long forces act in this moment, s.
    fn duration(&self, moment: &Moment, is_opening: bool) -> f32 {
        let is_half = !self.is_implicit && (is_opening || !moment.drifts);
        if is_half {
            0.5 * moment.duration
        } else {
            moment.duration
        }
    }
}

impl Bonds {
    /// Whether any acts in this moment.
    pub(super) fn act(&self) -> bool {
        self.bonds.iter().any(|bond| bond.acts)
    }

    /// The two bodies of each, by their places, or one twice.
    pub(super) fn bodies(&self) -> impl Iterator<Item = [usize; 2]> {
        self.bonds.iter().filter_map(|bond| {
            let mut bodies = bond.used().map(|corner| corner.body);
            let first = bodies.next()?;
            Some([first, bodies.last().unwrap_or(first)])
        })
    }

    /// Makes room for so many bonds more.
    pub fn reserve(&mut self, count: usize) -> Result<()> {
        self.bonds.try_reserve(count)?;
        Ok(self.ends.try_reserve(count.saturating_mul(CORNERS))?)
    }

    /// Keeps the two points of these corners together, for which there is room, once [`Self::name_ends`] has seen to all that were added.
    pub fn add(&mut self, id: SlotId, corners: &[Corner], limit: f32) -> Result<()> {
        let mut all = [Corner::default(); CORNERS];
        all[..corners.len()].copy_from_slice(corners);
        let bond = Bond {
            id,
            corners: all,
            limit: if limit > 0.0 { limit } else { f32::INFINITY },
            foreseen: Vec3::ZERO,
            mean: Vec3::ZERO,
            is_in_turn: false,
            load: Vec3::ZERO,
            impulse: Vec3::ZERO,
            sum: DVec3::ZERO,
            masses: Vec3::ZERO,
            gap: DVec3::ZERO,
            miss: 0.0,
            acts: false,
            is_implicit: false,
        };
        memory::push(&mut self.bonds, bond)?;
        for corner in bond.used() {
            if let Err(place) = self.find(corner.body, corner.node) {
                self.ends.try_reserve(1)?;
                self.ends.insert(place, End::new(&corner));
            }
        }
        Ok(())
    }

    /// Ends some bonds. Needs no memory.
    fn end_where(&mut self, bodies: &mut Slots<Body>, mut ends: impl FnMut(&Bond) -> bool) {
        let count = self.bonds.len();
        self.bonds.retain(|bond| {
            let stays = !ends(bond);
            if !stays {
                // What it did is no gain that goes on.
                bond.used().for_each(|corner| forget(bodies, corner.body));
            }
            stays
        });
        if self.bonds.len() == count {
            return;
        }
        let Self { bonds, ends, .. } = self;
        ends.iter_mut().for_each(|end| end.is_used = false);
        for corner in bonds.iter().flat_map(Bond::used) {
            ends[corner.end].is_used = true;
        }
        ends.retain(|end| end.is_used);
        self.name_ends();
    }

    /// Ends a bond.
    pub fn end(&mut self, bodies: &mut Slots<Body>, id: SlotId) {
        self.end_where(bodies, |bond| bond.id == id);
    }

    /// Ends the bonds of a body that is gone.
    pub(super) fn leave(&mut self, bodies: &mut Slots<Body>, body: usize) {
        self.end_where(bodies, |bond| bond.concerns(body));
    }

    /// Ends the bonds whose limit the last step went beyond, and shows them.
    pub fn slip(&mut self, bodies: &mut Slots<Body>, mut see: impl FnMut(SlotId)) {
        self.end_where(bodies, |bond| {
            let slips = bond.mean.length() > bond.limit;
            if slips {
                see(bond.id);
            }
            slips
        });
    }

    /// The mean force on the first point of a bond over the last step, N.
    pub fn force_of(&self, id: SlotId) -> Vec3 {
        let bond = self.bonds.iter().find(|bond| bond.id == id);
        bond.map_or(Vec3::ZERO, |bond| bond.mean)
    }

    /// Whether the body at this place has bonds.
    pub fn concern(&self, body: usize) -> bool {
        let first = self.ends.partition_point(|end| end.body < body);
        self.ends.get(first).is_some_and(|end| end.body == body)
    }

    /// Whether a bond joins a node of one body with a node of the other, of these.
    pub(super) fn join(&self, bodies: [usize; 2], nodes: [&[u32]; 2]) -> bool {
        let is_at_end = |side: usize| nodes[side].iter().any(|&node| self.find(bodies[side], node).is_ok());
        if self.bonds.is_empty() || !(is_at_end(0) && is_at_end(1)) {
            return false;
        }
        let has = |bond: &Bond, side: usize, sign: f32| {
            let mut corners = bond.used().filter(|corner| corner.weight * sign > 0.0);
            corners.any(|corner| corner.body == bodies[side] && nodes[side].contains(&corner.node))
        };
        let joins = |bond: &Bond| has(bond, 0, 1.0) && has(bond, 1, -1.0) || has(bond, 0, -1.0) && has(bond, 1, 1.0);
        self.bonds.iter().any(joins)
    }

    /// The box of all velocities of a body, given that of those before.
    pub(super) fn velocities(&self, body: usize, before: Bounds) -> Bounds {
        let first = self.ends.partition_point(|end| end.body < body);
        let own = self.ends[first..].iter().take_while(|end| end.body == body);
        own.fold(before, |bounds, end| bounds.with(end.velocity))
    }

    pub fn hash(&self, hasher: &mut StateHasher) {
        for bond in &self.bonds {
            for corner in bond.used() {
                hasher.write_u64((corner.body as u64) << 32 | u64::from(corner.node));
                hasher.write_floats(&[corner.weight]);
            }
            hasher.write_floats(&[bond.limit]);
            hasher.write_floats(&bond.foreseen.to_array());
        }
    }

    /// Begins to attempt the step of a group, of which these bodies are, which may be taken several times, until [`Self::unload`].
    pub fn attempt(&mut self, bodies: &mut Slots<Body>, is_of_group: impl Fn(usize) -> bool) {
        for end in &mut self.ends {
            end.is_in_turn = is_of_group(end.body);
            if let Some(body) = bodies.at_mut(end.body).filter(|_| end.is_in_turn) {
                if let Some(implicit) = &mut body.implicit {
                    implicit.is_attached = true;
                }
                end.is_pending = body.forces_applied;
                end.pending = match &body.applied {
                    Some(applied) if body.forces_applied => applied.get(end.node as usize),
                    _ => Vec3::ZERO,
                };
            }
        }
        for bond in &mut self.bonds {
            let is_implicit = |corner: Corner| bodies.at(corner.body).is_some_and(|body| body.implicit.is_some());
            bond.is_implicit = bond.used().any(is_implicit);
            bond.is_in_turn = bond.used().all(|corner| is_of_group(corner.body));
        }
    }

    /// Begins the step over, from what is current.
    pub fn begin(&mut self) {
        self.is_opening = true;
        for bond in self.bonds.iter_mut().filter(|bond| bond.is_in_turn) {
            bond.load = bond.foreseen;
            bond.sum = DVec3::ZERO;
        }
    }

    /// How many substeps a step of `dt` seconds takes at least.
    pub fn substeps(&self, dt: f32) -> u32 {
        if self.bonds.iter().any(|bond| bond.is_in_turn && bond.is_implicit) {
            (f64::from(dt) / LONGEST - ROUNDED)
                .ceil()
                .clamp(1.0, f64::from(u32::MAX / 4)) as u32
        } else {
            1
        }
    }

    /// Has the forces that are foreseen act in what follows.
    pub fn load(&mut self, bodies: &mut Slots<Body>) {
        self.ends.iter_mut().for_each(|end| end.given = Vec3::ZERO);
        let Self { bonds, ends, .. } = self;
        for bond in bonds.iter().filter(|bond| bond.is_in_turn && !bond.is_implicit) {
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
    pub fn unload(&self, bodies: &mut Slots<Body>) {
        for end in self.ends.iter().filter(|end| end.is_in_turn) {
            if let Some(body) = bodies.at_mut(end.body) {
                body.load(end.node as usize, end.pending);
                body.forces_applied = end.is_pending;
            }
        }
    }

    /// Takes a substep as it is to be, after the skins.
    pub(super) fn follow(&mut self, bodies: &mut Slots<Body>, skins: &[Option<Skin>], moment: &Moment) {
        for end in self.ends.iter_mut().filter(|end| end.is_in_turn) {
            let Some(body) = bodies.at_mut(end.body) else { continue };
            let skin = skins.get(end.body).and_then(Option::as_ref);
            end.is_on_skin =
                moment.concerns(body) && skin.is_some_and(|skin| skin.nodes.binary_search(&end.node).is_ok());
            end.velocity = body.mean_velocity(end.node as usize);
            end.answer = body.answer_of(end.node) * body.left_by_damping(end.node, moment);
        }
        for bond in &mut self.bonds {
            bond.acts = bond.is_in_turn && (moment.drifts || !bond.is_implicit);
            if !bond.acts {
                continue;
            }
            bond.impulse = Vec3::ZERO;
            let corners = bond.used();
            let whole: Vec3 = corners
                .map(|corner| self.ends[corner.end].answer * (corner.weight * corner.weight))
                .sum();
            bond.masses = Vec3::select(whole.cmpgt(Vec3::ZERO), whole.recip(), Vec3::ZERO);
        }
    }

    /// Makes the velocities of the points of each bond equal, one after the other: the largest difference that there was, m/s.
    pub(super) fn sweep(&mut self, skins: &mut [Option<Skin>]) -> f32 {
        let Self { bonds, ends, .. } = self;
        let mut largest = 0.0_f32;
        for bond in bonds.iter_mut().filter(|bond| bond.acts) {
            let (mut apart, mut size) = (Vec3::ZERO, Vec3::ZERO);
            for corner in bond.used() {
                let velocity = ends[corner.end].velocity(skins) * corner.weight;
                apart += velocity;
                size = size.max(velocity.abs());
            }
            let counts = apart.abs().cmpgt(size * ROUNDING) & bond.masses.cmpgt(Vec3::ZERO);
            if !counts.any() {
                continue;
            }
            let apart = Vec3::select(counts, apart, Vec3::ZERO);
            let given = -apart * bond.masses;
            bond.impulse += given;
            for corner in bond.used() {
                ends[corner.end].quicken(given * corner.weight, skins);
            }
            largest = largest.max(apart.length());
        }
        largest
    }

    /// Gives bodies what was found, and foresees the same for the next substep.
    pub(super) fn give(&mut self, bodies: &mut Slots<Body>, skins: &[Option<Skin>], moment: &Moment) {
        let Self {
            bonds,
            ends,
            is_opening,
        } = self;
        ends.iter_mut().for_each(|end| end.given = Vec3::ZERO);
        for bond in bonds.iter_mut().filter(|bond| bond.acts) {
            let duration = bond.duration(moment, *is_opening);
            let all = bond.load * duration + bond.impulse;
            if !bond.is_implicit {
                bond.load += bond.impulse / duration;
            }
            for corner in bond.used() {
                ends[corner.end].given += all * corner.weight;
            }
            bond.sum += all.as_dvec3();
        }
        for end in ends.iter_mut().filter(|end| end.is_in_turn) {
            if let Some(body) = bodies.at_mut(end.body)
                && moment.concerns(body)
            {
                end.velocity = end.velocity(skins);
                body.draw(end.node as usize, end.velocity, end.given, moment);
            }
        }
        *is_opening = false;
    }

    /// Moves what is apart at the end of a substep of `duration` seconds together, without giving it speed.
    pub(super) fn part(&mut self, bodies: &mut Slots<Body>, duration: f32) {
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
        for bond in bonds.iter_mut().filter(|bond| bond.is_in_turn) {
            let apart = bond.apart(ends);
            let way = (apart * closed).clamp_length_max(CLOSING_SPEED * duration);
            bond.gap = apart - way;
            bond.miss = MISSED * way.abs().max_element();
        }
        for _ in 0..SWEEPS {
            let mut is_done = true;
            for bond in bonds.iter().filter(|bond| bond.is_in_turn) {
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

    /// The step in progress, of `dt` seconds, is the current state of the bodies that took it.
    pub fn commit(&mut self, outcomes: &[Option<Outcome>], dt: f32) {
        let took = |place: usize| matches!(outcomes.get(place), Some(Some(Outcome::Done { .. })));
        for bond in &mut self.bonds {
            if bond.used().all(|corner| took(corner.body)) {
                bond.foreseen = bond.load.clamp(Vec3::MIN, Vec3::MAX);
                bond.mean = (bond.sum / f64::from(dt)).as_vec3().clamp(Vec3::MIN, Vec3::MAX);
            } else {
                bond.mean = Vec3::ZERO;
            }
        }
    }

    fn find(&self, body: usize, node: u32) -> std::result::Result<usize, usize> {
        self.ends
            .binary_search_by_key(&(body, node), |end| (end.body, end.node))
    }

    /// Tells corners where their ends are now.
    pub fn name_ends(&mut self) {
        let Self { bonds, ends, .. } = self;
        for corner in bonds.iter_mut().flat_map(|bond| &mut bond.corners) {
            let found = ends.binary_search_by_key(&(corner.body, corner.node), |end| (end.body, end.node));
            corner.end = found.unwrap_or_default();
        }
    }
}

impl End {
    fn new(corner: &Corner) -> Self {
        Self {
            body: corner.body,
            node: corner.node,
            is_used: true,
            is_on_skin: false,
            is_in_turn: false,
            velocity: Vec3::ZERO,
            answer: Vec3::ZERO,
            given: Vec3::ZERO,
            place: DVec3::ZERO,
            shift: DVec3::ZERO,
            pending: Vec3::ZERO,
            is_pending: false,
        }
    }

    fn velocity(&self, skins: &[Option<Skin>]) -> Vec3 {
        match skins.get(self.body) {
            Some(Some(skin)) if self.is_on_skin => skin.velocities.get(self.node as usize),
            _ => self.velocity,
        }
    }

    fn quicken(&mut self, impulse: Vec3, skins: &mut [Option<Skin>]) {
        let velocity = self.velocity(skins) + impulse * self.answer;
        match skins.get_mut(self.body) {
            Some(Some(skin)) if self.is_on_skin => skin.velocities.set(self.node as usize, velocity),
            _ => self.velocity = velocity,
        }
    }
}

/// A body goes on with nothing of the last step but positions and velocities.
fn forget(bodies: &mut Slots<Body>, place: usize) {
    if let Some(Body {
        implicit: Some(implicit),
        ..
    }) = bodies.at_mut(place)
    {
        implicit.is_attached = false;
        implicit.forget_history();
    }
}
