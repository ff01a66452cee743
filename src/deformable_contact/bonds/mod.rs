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
//!
//! Where there is a thread between the points the impulse is its own (`thread.rs`): one number along a line, never a push.

mod bond;
mod substep;
mod thread;

use glam::{DVec3, Vec3};

use crate::base::{Result, SlotId, StateHasher, memory};
use crate::codec::saved;
use crate::geometry::Bounds;
use crate::solver::{Outcome, System, Systems};

use self::bond::{Bond, BondCorner, BondEnd, CORNERS, OF_POINT, corners_of, place, place_of};
pub(crate) use self::bond::{BondPoint, distance};
pub(crate) use self::thread::{Lead, Thread};

/// What is apart comes together no faster than this, m/s, so that bodies that are far apart follow their points.
const CLOSING_SPEED: f64 = 0.25;

/// All bonds of a world.
#[derive(Debug, Default)]
pub(crate) struct Bonds {
    /// In the order in which they came.
    bonds: Vec<Bond>,
    /// In the order of their bodies and nodes.
    ends: Vec<BondEnd>,
    /// Whether the first substep is to come, which VERLET begins with half a kick.
    is_opening: bool,
}

saved! { Bonds { bonds, ends, is_opening } }

/// Whether two points are one, of one body.
pub(crate) fn are_one(points: &[BondPoint; 2]) -> bool {
    corners_of(points).iter().all(|corner| corner.weight == 0.0)
}

impl Bonds {
    /// Whether any acts in this moment.
    pub(super) fn act(&self) -> bool {
        self.bonds.iter().any(|bond| bond.acts)
    }

    /// Whether there are none.
    pub(super) fn are_none(&self) -> bool {
        self.bonds.is_empty()
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

    /// Keeps two points together, for which there is room, or a thread between them, once [`Self::settle`] has seen to all that were added.
    pub fn add(&mut self, id: SlotId, points: [BondPoint; 2], limit: f32, thread: Option<Thread>) -> Result<()> {
        let bond = Bond {
            id,
            points,
            corners: corners_of(&points),
            thread,
            limit: if limit > 0.0 { limit } else { f32::INFINITY },
            ..Bond::default()
        };
        memory::push(&mut self.bonds, bond)
    }

    /// Has a thread to a blade begin at a point from now on, for which there is room: that of this name, which goes on with what it did, or a new
    /// one. To be followed by [`Self::pull`] and [`Self::settle`].
    pub fn hold(&mut self, id: SlotId, point: BondPoint) -> Result<()> {
        let nowhere = BondPoint {
            nodes: [(0, 0.0); OF_POINT],
            ..point
        };
        let points = [point, nowhere];
        match self.bonds.iter_mut().find(|bond| bond.id == id) {
            Some(bond) => {
                bond.corners = corners_of(&points);
                bond.points = points;
                Ok(())
            }
            None => self.add(id, points, 0.0, Some(Thread::new(0.0, 0.0, 0.0))),
        }
    }

    /// Has this be the thread of a bond to a blade.
    pub fn pull(&mut self, id: SlotId, mut thread: Thread) {
        if let Some(bond) = self.bonds.iter_mut().find(|bond| bond.id == id) {
            let whole = bond.points[0].weight();
            thread.lead = thread.lead.map(|lead| lead.scaled(whole));
            bond.thread = Some(thread);
        }
    }

    /// Leads what the thread of a bond ends at along this way in the next step.
    pub fn lead(&mut self, id: SlotId, lead: Lead) {
        if let Some(bond) = self.bonds.iter_mut().find(|bond| bond.id == id) {
            let whole = bond.points[0].weight();
            if let Some(thread) = &mut bond.thread {
                thread.lead = Some(lead.scaled(whole));
            }
        }
    }

    /// Where the first point of a bond is now, m.
    pub fn place_of(&self, bodies: &impl Systems, id: SlotId) -> Option<DVec3> {
        let bond = self.bonds.iter().find(|bond| bond.id == id)?;
        place(&bond.points[0], bodies)
    }

    /// Shows both points of each bond between points of tissue, where they are now, m.
    pub fn show_ends(&self, bodies: &impl Systems, mut see: impl FnMut([DVec3; 2])) {
        for bond in self
            .bonds
            .iter()
            .filter(|bond| bond.points.iter().all(|point| point.weight() > 0.0))
        {
            if let [Some(first), Some(second)] = bond.points.each_ref().map(|point| place(point, bodies)) {
                see([first, second]);
            }
        }
    }

    /// Makes room for points of a body to be bound to others.
    pub fn reserve_rebinding(&mut self, body: usize) -> Result<()> {
        let count = self.bonds.iter().filter(|bond| bond.concerns(body)).count();
        Ok(self.ends.try_reserve(count.saturating_mul(CORNERS))?)
    }

    /// The points of a body.
    pub fn points_of(&self, body: usize) -> impl Iterator<Item = &BondPoint> {
        let points = self.bonds.iter().flat_map(|bond| &bond.points);
        points.filter(move |point| point.body == body && point.weight() > 0.0)
    }

    /// Has points of a body that `carried` knows be bound to what it says from now on: their triangles were cut, or copied. No point
    /// moves with that, as far as the new nodes are where they should be. There is room for it.
    pub fn rebind(&mut self, body: usize, mut carried: impl FnMut(&BondPoint) -> Option<BondPoint>) {
        for bond in &mut self.bonds {
            let is_its = |point: &&mut BondPoint| point.body == body && point.weight() > 0.0;
            for point in bond.points.iter_mut().filter(is_its) {
                *point = carried(point).unwrap_or(*point);
            }
            bond.corners = corners_of(&bond.points);
        }
        self.settle();
    }

    /// Ends some bonds. Needs no memory.
    fn end_where(&mut self, bodies: &mut impl Systems, mut ends: impl FnMut(&Bond) -> bool) {
        let count = self.bonds.len();
        self.bonds.retain(|bond| {
            let stays = !ends(bond);
            if !stays {
                // What it did is no gain that goes on.
                let bodies_of = bond.used().map(|corner| corner.body);
                bodies_of.for_each(|place| bodies.at_mut(place).into_iter().for_each(System::end_bonds));
            }
            stays
        });
        if self.bonds.len() != count {
            self.settle();
        }
    }

    /// Has ends where bonds are and nowhere else, for which there is room, and tells corners which are theirs.
    pub fn settle(&mut self) {
        let Self { bonds, ends, .. } = self;
        ends.iter_mut().for_each(|end| end.is_used = false);
        for corner in bonds.iter().flat_map(Bond::used) {
            match place_of(ends, corner.body, corner.node) {
                Ok(place) => ends[place].is_used = true,
                Err(place) => ends.insert(place, BondEnd::new(&corner)),
            }
        }
        ends.retain(|end| end.is_used);
        for corner in bonds.iter_mut().flat_map(|bond| &mut bond.corners) {
            corner.end = place_of(ends, corner.body, corner.node).unwrap_or_default();
        }
    }

    /// Ends a bond.
    pub fn end(&mut self, bodies: &mut impl Systems, id: SlotId) {
        self.end_where(bodies, |bond| bond.id == id);
    }

    /// Ends the bonds of a body that is gone.
    pub(super) fn leave(&mut self, bodies: &mut impl Systems, body: usize) {
        self.end_where(bodies, |bond| bond.concerns(body));
    }

    /// Ends the bonds whose limit the last step went beyond, and shows them.
    pub fn slip(&mut self, bodies: &mut impl Systems, mut see: impl FnMut(SlotId)) {
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

    /// The thread of a bond.
    pub fn thread_mut(&mut self, id: SlotId) -> Option<&mut Thread> {
        let bond = self.bonds.iter_mut().find(|bond| bond.id == id);
        bond.and_then(|bond| bond.thread.as_mut())
    }

    /// The thread of a bond, and how far its points are apart now, m.
    pub fn thread(&self, bodies: &impl Systems, id: SlotId) -> Option<(&Thread, f64)> {
        let bond = self.bonds.iter().find(|bond| bond.id == id)?;
        Some((bond.thread.as_ref()?, distance(bodies, &bond.points)))
    }

    /// Whether the body at this place has bonds.
    pub fn concern(&self, body: usize) -> bool {
        let first = self.ends.partition_point(|end| end.body < body);
        self.ends.get(first).is_some_and(|end| end.body == body)
    }

    /// Whether a bond makes one point of nodes of both bodies, of these.
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
        // What threads pull together is to meet.
        self.bonds.iter().any(|bond| bond.thread.is_none() && joins(bond))
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
            if let Some(thread) = &bond.thread {
                hasher.write_doubles(&[thread.length, thread.target, thread.compliance, thread.most]);
                for place in thread.lead.iter().flat_map(|lead| [lead.from, lead.to]) {
                    hasher.write_doubles(&place.to_array());
                }
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
                if let Some(thread) = &mut bond.thread {
                    thread.commit(dt);
                }
            } else {
                bond.mean = Vec3::ZERO;
            }
        }
    }

    fn find(&self, body: usize, node: u32) -> std::result::Result<usize, usize> {
        place_of(&self.ends, body, node)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::WorldTag;
    use crate::def::Anchor;
    use crate::def::SurfacePoint;
    use crate::slots::Slots;

    fn bound(body: usize, triangle: u32, nodes: &[(u32, f32)]) -> BondPoint {
        let mut all = [(0, 0.0); OF_POINT];
        all[..nodes.len()].copy_from_slice(nodes);
        let anchor = Some(Anchor::Point(SurfacePoint {
            triangle,
            weights: [0.5, 0.25, 0.25],
        }));
        BondPoint {
            body,
            anchor,
            nodes: all,
        }
    }

    fn ids(count: usize) -> Vec<SlotId> {
        let mut slots = Slots::new("attachment", WorldTag::next());
        (0..count).map(|_| slots.insert(()).expect("a place")).collect()
    }

    /// The corners of a bond in order, each found again by its end.
    fn corners(bonds: &Bonds, index: usize) -> Vec<(usize, u32, f32)> {
        let found = bonds.bonds[index].used().map(|corner| {
            let end = &bonds.ends[corner.end];
            assert_eq!((end.body, end.node), (corner.body, corner.node));
            (corner.body, corner.node, corner.weight)
        });
        let mut corners: Vec<_> = found.collect();
        corners.sort_by_key(|corner| (corner.0, corner.1));
        corners
    }

    #[test]
    fn points_of_triangles_that_were_cut_are_carried_over() {
        let mut bonds = Bonds::default();
        let on = |triangle, first| bound(2, triangle, &[(first, 0.5), (first + 1, 0.25), (first + 2, 0.25)]);
        let other = bound(5, 7, &[(3, 1.0)]);
        // Between two bodies, within one, and where nothing was cut.
        let pairs = [[on(4, 10), other], [on(4, 10), on(9, 11)], [other, on(9, 11)]];
        let thread = Some(Thread::new(1.0, 1.0, 0.0));
        bonds.reserve(pairs.len()).expect("memory");
        for ((id, pair), thread) in ids(3).into_iter().zip(pairs).zip([None, thread, thread]) {
            bonds.add(id, pair, 0.0, thread).expect("memory");
        }
        bonds.settle();
        assert_eq!(
            corners(&bonds, 0),
            [(2, 10, 0.5), (2, 11, 0.25), (2, 12, 0.25), (5, 3, -1.0)]
        );
        assert_eq!(corners(&bonds, 1), [(2, 10, 0.5), (2, 11, -0.25), (2, 13, -0.25)]);
        // The cell of triangle 4 is a copy now, of which a triangle has another number; the point lies in a tetrahedron.
        let cut = bound(2, 40, &[(30, 0.5), (11, 0.25), (31, 0.125), (1, 0.125)]);
        let is_cut = |point: &BondPoint| matches!(point.anchor, Some(Anchor::Point(SurfacePoint { triangle: 4, .. })));
        bonds.reserve_rebinding(2).expect("memory");
        bonds.rebind(5, |point| is_cut(point).then_some(cut));
        assert_eq!(
            corners(&bonds, 0),
            [(2, 10, 0.5), (2, 11, 0.25), (2, 12, 0.25), (5, 3, -1.0)]
        );
        bonds.rebind(2, |point| is_cut(point).then_some(cut));
        let four = [(2, 1, 0.125), (2, 11, 0.25), (2, 30, 0.5), (2, 31, 0.125)];
        assert_eq!(corners(&bonds, 0), [&four[..], &[(5, 3, -1.0)]].concat());
        let both = [
            (2, 1, 0.125),
            (2, 11, -0.25),
            (2, 12, -0.25),
            (2, 13, -0.25),
            (2, 30, 0.5),
            (2, 31, 0.125),
        ];
        assert_eq!(corners(&bonds, 1), both);
        assert_eq!(
            corners(&bonds, 2),
            [(2, 11, -0.5), (2, 12, -0.25), (2, 13, -0.25), (5, 3, 1.0)]
        );
        // No end is left where no bond is.
        let ends: Vec<(usize, u32)> = bonds.ends.iter().map(|end| (end.body, end.node)).collect();
        assert_eq!(ends, [(2, 1), (2, 11), (2, 12), (2, 13), (2, 30), (2, 31), (5, 3)]);
        assert!(matches!(
            bonds.bonds[0].points[0].anchor,
            Some(Anchor::Point(SurfacePoint { triangle: 40, .. }))
        ));
    }
}
