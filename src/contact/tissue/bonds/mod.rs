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

mod substep;

use glam::{DVec3, Vec3};

use crate::body::{Body, Bounds};
use crate::diagnostics::StateHasher;
use crate::error::Result;
use crate::memory;
use crate::slots::{SlotId, Slots};
use crate::solver::Outcome;

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

    fn concerns(&self, body: usize) -> bool {
        self.used().any(|corner| corner.body == body)
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
