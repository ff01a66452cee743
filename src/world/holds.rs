//! What holds tissue to blades: threads from points of proxies to their true edges.

use glam::{DVec3, Vec3};

use super::attachments::Which;
use super::blade::{MOST_HOLDS, Proxy, Snag, Stand};
use super::{World, make_walks};
use crate::base::{Result, memory};
use crate::body::{Body, HoldAt};
use crate::cutting::Met;
use crate::deformable_contact::{Lead, Thread};

/// Where a proxy is to be held: a point of the tissue, and that of the proxy next to it.
pub(super) type Held = (HoldAt, DVec3);

pub(super) const NOWHERE: [Option<Held>; MOST_HOLDS] = [None; MOST_HOLDS];

impl World {
    /// Makes room for a blade to be held at so many points more of the body at this place, if it can be cut.
    pub(super) fn make_room_for_holds(&mut self, place: usize, count: usize) -> Result<()> {
        let Some(body) = self.bodies.at_mut(place).filter(|body| body.toughness().is_some()) else {
            return Ok(());
        };
        body.system_mut().reserve_bonds()?;
        make_walks(&mut self.walks, place)?;
        let tissue = memory::get_or_box(&mut self.tissue)?;
        tissue.bonds.reserve_rebinding(place)?;
        tissue.reserve_bonds([place; 2], count)
    }

    /// Holds a proxy at these points, where there are any, else where it was held, on a spring of this stiffness between all of them that pulls no
    /// harder than this, N/m and N.
    pub(super) fn hold_blade(
        &mut self,
        proxy: &mut Proxy,
        points: &[Option<Held>; MOST_HOLDS],
        edge: [Vec3; 2],
        (stiffness, most): (f64, f64),
    ) -> Result<()> {
        let place = self.bodies.place(proxy.body.0)?;
        let count = points.iter().flatten().count();
        self.make_room_for_holds(place, if count > proxy.holds.len() { count } else { 0 })?;
        let mut bounds = [None; MOST_HOLDS];
        for (bound, (anchor, _)) in bounds.iter_mut().zip(points.iter().flatten()) {
            *bound = Some(match anchor {
                HoldAt::Anchor(anchor) => self.bound(proxy.body, Which::ONLY, anchor)?,
                HoldAt::Inside(nodes, weights) => self.bound_inside(proxy.body, *nodes, *weights)?,
            });
        }
        if proxy.holds.is_empty() && bounds[0].is_some() {
            self.bodies.get_mut(proxy.body.0)?.system_mut().begin_bonds();
        }
        let Self {
            bodies,
            tissue,
            holds_made,
            ..
        } = self;
        let Some(bonds) = tissue.as_mut().map(|tissue| &mut tissue.bonds) else {
            return Ok(());
        };
        if count > 0 {
            for hold in proxy.holds.drain(count.min(proxy.holds.len())..) {
                bonds.end(bodies, hold.id);
            }
        }
        for (index, (bound, held)) in bounds.into_iter().zip(points).enumerate() {
            let (Some(bound), Some((_, point))) = (bound, held) else {
                break;
            };
            if index == proxy.holds.len() {
                *holds_made = holds_made.wrapping_add(1);
                proxy.holds.push(Snag::new(*holds_made));
            }
            let hold = &mut proxy.holds[index];
            bonds.hold(hold.id, bound)?;
            hold.offset = bonds.place_of(bodies, hold.id).unwrap_or(*point) - *point;
        }
        let share = proxy.holds.len() as f64;
        for hold in &mut proxy.holds {
            let place = bonds.place_of(bodies, hold.id).unwrap_or_default();
            let foot = Stand::next_to(place - hold.offset, edge).foot();
            hold.way = Lead { from: foot, to: foot };
            let thread = Thread::led(hold.way.moved(hold.offset), share / stiffness, most / share);
            bonds.pull(hold.id, thread);
        }
        bonds.settle();
        Ok(())
    }

    /// Nothing is in the way of a blade any more in a body.
    pub(super) fn let_go_of_blade(&mut self, proxy: &mut Proxy) {
        let Self { bodies, tissue, .. } = self;
        for hold in proxy.holds.drain(..) {
            if let Some(tissue) = tissue {
                tissue.bonds.end(bodies, hold.id);
            }
        }
        proxy.last = None;
        proxy.uncut = 0.0;
        proxy.behind = DVec3::ZERO;
    }
}

/// The points of a body in which the edge stands when it has gone a part of its way.
pub(super) fn points_at<'a>(body: &'a Body, met: &'a [Met], time: f64) -> impl Iterator<Item = Held> + Clone + 'a {
    let is_there = move |part: &&Met| part.times[0] <= time && time <= part.times[1];
    met.iter().filter(is_there).filter_map(move |part| {
        let [from, to] = part.times;
        let along = if to > from { (time - from) / (to - from) } else { 0.0 };
        let weights = [0, 1, 2, 3].map(|k| {
            let [a, b] = part.weights.map(|weights| weights[k]);
            a + (b - a) * along
        });
        Some((body.hold_in(part, weights)?, part.places[0].lerp(part.places[1], along)))
    })
}

/// Takes as many of these as there may be, of all parts of the edge.
pub(super) fn fill(points: &mut [Option<Held>; MOST_HOLDS], held: impl Iterator<Item = Held> + Clone) {
    let count = held.clone().count();
    let taken = count.min(MOST_HOLDS);
    let mut held = held.enumerate();
    for (at, place) in points.iter_mut().enumerate().take(taken) {
        let next = (2 * at + 1) * count / (2 * taken);
        *place = held.find(|(index, _)| *index == next).map(|(_, held)| held);
    }
}
