//! The coupling of tissue and blade: constraints from points of a proxy to the true edge.

use glam::{DVec3, Vec3};

use super::attachments::Which;
use super::blade::{BladeHold, EdgePoint, MAX_HOLDS, Proxy};
use super::{World, reserve_coupling};
use crate::base::{Result, memory};
use crate::body::{Body, TissuePoint};
use crate::cutting::BladeContact;
use crate::deformable_contact::{LinearPath, SutureThread};

/// A hold to be created: a point of the tissue and the nearest point of the proxy.
pub(super) type Held = (TissuePoint, DVec3);

pub(super) const NOWHERE: [Option<Held>; MAX_HOLDS] = [None; MAX_HOLDS];

impl World {
    /// Reserves room for `count` more holds in the body at this slot, if the body can be cut.
    pub(super) fn reserve_holds(&mut self, slot: usize, count: usize) -> Result<()> {
        let Some(body) = self.bodies.at_mut(slot).filter(|body| body.toughness().is_some()) else {
            return Ok(());
        };
        body.system_mut().reserve_tissue_attachments()?;
        reserve_coupling(&mut self.coupled, slot)?;
        let deformable_contact = memory::get_or_box(&mut self.deformable_contact)?;
        deformable_contact.attachments.reserve_rebinding(slot)?;
        deformable_contact.reserve_attachments([slot; 2], count)
    }

    /// Holds a proxy at these points, or at its previous holds if there are none. All holds together act as a spring of
    /// this stiffness and largest force, N/m and N.
    pub(super) fn hold_blade(
        &mut self,
        proxy: &mut Proxy,
        points: &[Option<Held>; MAX_HOLDS],
        edge: [Vec3; 2],
        (stiffness, max_force): (f64, f64),
    ) -> Result<()> {
        let slot = self.bodies.slot(proxy.body.0)?;
        let count = points.iter().flatten().count();
        self.reserve_holds(slot, if count > proxy.holds.len() { count } else { 0 })?;
        let mut bounds = [None; MAX_HOLDS];
        for (bound, (anchor, _)) in bounds.iter_mut().zip(points.iter().flatten()) {
            *bound = Some(match anchor {
                TissuePoint::Anchor(anchor) => self.bound(proxy.body, Which::ONLY, anchor)?,
                TissuePoint::Inside(nodes, weights) => self.bound_inside(proxy.body, *nodes, *weights)?,
            });
        }
        if proxy.holds.is_empty() && bounds[0].is_some() {
            self.bodies
                .get_mut(proxy.body.0)?
                .system_mut()
                .begin_tissue_attachments();
        }
        let Self {
            bodies,
            deformable_contact,
            holds_made,
            ..
        } = self;
        let Some(point_attachments) = deformable_contact
            .as_mut()
            .map(|deformable_contact| &mut deformable_contact.attachments)
        else {
            return Ok(());
        };
        if count > 0 {
            for hold in proxy.holds.drain(count.min(proxy.holds.len())..) {
                point_attachments.remove(bodies, hold.id);
            }
        }
        for (index, (bound, held)) in bounds.into_iter().zip(points).enumerate() {
            let (Some(bound), Some((_, point))) = (bound, held) else {
                break;
            };
            if index == proxy.holds.len() {
                *holds_made = holds_made.wrapping_add(1);
                proxy.holds.push(BladeHold::new(*holds_made));
            }
            let hold = &mut proxy.holds[index];
            point_attachments.attach_blade(hold.id, bound)?;
            hold.offset = point_attachments
                .first_point_position(bodies, hold.id)
                .unwrap_or(*point)
                - *point;
        }
        let share = proxy.holds.len() as f64;
        for hold in &mut proxy.holds {
            let position = point_attachments
                .first_point_position(bodies, hold.id)
                .unwrap_or_default();
            let nearest = EdgePoint::next_to(position - hold.offset, edge).nearest();
            hold.motion = LinearPath {
                from: nearest,
                to: nearest,
            };
            let thread = SutureThread::to_path(hold.motion.moved(hold.offset), share / stiffness, max_force / share);
            point_attachments.set_thread(hold.id, thread);
        }
        point_attachments.rebuild_nodes();
        Ok(())
    }

    /// Removes all holds of a proxy: no tissue resists any more.
    pub(super) fn remove_holds(&mut self, proxy: &mut Proxy) {
        let Self {
            bodies,
            deformable_contact,
            ..
        } = self;
        for hold in proxy.holds.drain(..) {
            if let Some(deformable_contact) = deformable_contact {
                deformable_contact.attachments.remove(bodies, hold.id);
            }
        }
        proxy.last = None;
        proxy.uncut = 0.0;
        proxy.behind = DVec3::ZERO;
    }
}

/// The points at which the edge is in the body at this fraction of its path.
pub(super) fn points_at<'a>(
    body: &'a Body,
    met: &'a [BladeContact],
    time: f64,
) -> impl Iterator<Item = Held> + Clone + 'a {
    let is_there = move |part: &&BladeContact| part.times[0] <= time && time <= part.times[1];
    met.iter().filter(is_there).filter_map(move |part| {
        let [from, to] = part.times;
        let along = if to > from { (time - from) / (to - from) } else { 0.0 };
        let weights = [0, 1, 2, 3].map(|k| {
            let [a, b] = part.weights.map(|weights| weights[k]);
            a + (b - a) * along
        });
        Some((
            body.point_in_item(part, weights)?,
            part.positions[0].lerp(part.positions[1], along),
        ))
    })
}

/// Fills `points` with evenly chosen points of `held`.
pub(super) fn fill(points: &mut [Option<Held>; MAX_HOLDS], held: impl Iterator<Item = Held> + Clone) {
    let count = held.clone().count();
    let taken = count.min(MAX_HOLDS);
    let mut held = held.enumerate();
    for (at, point) in points.iter_mut().enumerate().take(taken) {
        let next = (2 * at + 1) * count / (2 * taken);
        *point = held.find(|(index, _)| *index == next).map(|(_, held)| held);
    }
}
