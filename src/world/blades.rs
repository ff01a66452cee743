//! Blades: edges that cut what they are moved through, and feel it.
//!
//! A blade's *proxy* in a body is the edge that its tissue is cut to; the true edge is ahead of it on a spring (Mahvash, Hayward 2001). Through a step
//! the spring is a thread between the tissue where the proxy stands and the true edge, which is led along its way: an impulse of each substep, found
//! implicitly, so that neither the spring nor the step can be too much for the tissue. It pulls no harder than the tissue resists. With the step
//! the proxy goes on, and what is between its places is cut.

use glam::{DVec3, Quat, Vec3};

use super::World;
use super::blade::{Blade, BladeDefinition, BladeReport, MOST_HOLDS, Stand};
use crate::base::{BladeId, BodyId, Result, SlotId};
use crate::def::CollisionFilter;
use crate::deformable_contact::Lead;
use crate::slots::Slots;

impl World {
    /// Adds a blade: an edge that is moved by its pose, as tools are, cuts the bodies made for it ([`BodyDefinition::spare_nodes`]) as
    /// [`World::cut`] does, and feels their [`toughness`](crate::BodyDefinition::toughness). It is an edge alone: what has a body needs a tool beside it.
    ///
    /// Tissue that the edge meets gives way until the edge is so far ahead, on the spring of [`BladeDefinition::stiffness`], that this pulls as hard
    /// as the tissue resists: by its toughness for each metre that is cut, in the rest shape. From then on its proxy follows, at the end of each
    /// step, as far as keeps both equal; so the work of the blade is the toughness times the length that is cut, and what the spring stores
    /// (Mahvash, Hayward 2001), or the area in solids. What pulls at the tissue through a step is what the blade feels: momentum is kept. An edge that goes along itself
    /// meets nothing, nor does one that goes back through its cut.
    ///
    /// The cut is made where the proxy went, by a fifth of a triangle's shortest edge at a time and to its end where it leaves the tissue; so a triangle
    /// that is passed through takes some ten [`spare_nodes`](crate::BodyDefinition::spare_nodes). Tissue of toughness 0 is cut with each step,
    /// just where the edge went. Where a cut fails the proxy stays and pulls on, as hard as the tissue resisted: [`BladeReport::refused`].
    ///
    /// Tissue that moves onto an edge is cut as if that had moved; a turn is followed in parts of half a radian.
    ///
    /// A body that a blade stands in takes its substeps as one that is attached does. A step in which a blade goes through tissue may allocate.
    ///
    /// [`BodyDefinition::spare_nodes`]: crate::BodyDefinition::spare_nodes
    ///
    /// # Errors
    /// [`Error::InvalidArgument`](crate::Error::InvalidArgument): something in the definition is out of its range.
    /// [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub fn create_blade(&mut self, definition: &BladeDefinition) -> Result<BladeId> {
        let mut blade = Blade::new(definition)?;
        for place in 0..self.bodies.places() {
            self.make_room_for_holds(place, MOST_HOLDS)?;
            if let Some(id) = self.bodies.id_at(place) {
                blade.proxy(BodyId(id))?;
            }
        }
        Ok(BladeId(self.blades.insert(blade)?))
    }

    /// Removes a blade. What it has cut stays.
    ///
    /// # Errors
    /// [`Error::StaleId`](crate::Error::StaleId).
    pub fn destroy_blade(&mut self, blade: BladeId) -> Result<()> {
        let mut blade = self.blades.remove(blade.0)?;
        for proxy in &mut blade.proxies {
            self.let_go_of_blade(proxy);
        }
        Ok(())
    }

    /// Moves a blade to `position`, m, over the next step, straight and evenly, and turns it to `orientation`, `None`: it stays as it is.
    ///
    /// # Errors
    /// [`Error::StaleId`](crate::Error::StaleId). [`Error::InvalidArgument`](crate::Error::InvalidArgument): a number is not finite, a coordinate is
    /// further than 1e9 m from 0, or the orientation is zero.
    pub fn set_blade_pose(&mut self, blade: BladeId, position: Vec3, orientation: Option<Quat>) -> Result<()> {
        let blade = self.blades.get_mut(blade.0)?;
        let pose = blade.target.unwrap_or(blade.pose);
        blade.target = Some(pose.moved(position, orientation)?);
        Ok(())
    }

    /// Has a blade meet what this filter says, from the next step on. A body that it no longer meets lets go of it.
    ///
    /// # Errors
    /// [`Error::StaleId`](crate::Error::StaleId).
    pub fn set_blade_collision_filter(&mut self, blade: BladeId, filter: CollisionFilter) -> Result<()> {
        self.blades.get_mut(blade.0)?.filter = filter;
        Ok(())
    }

    /// What a blade meets.
    ///
    /// # Errors
    /// [`Error::StaleId`](crate::Error::StaleId).
    pub fn blade_collision_filter(&self, blade: BladeId) -> Result<CollisionFilter> {
        Ok(self.blades.get(blade.0)?.filter)
    }

    /// What a blade did and felt in the last step.
    ///
    /// # Errors
    /// [`Error::StaleId`](crate::Error::StaleId).
    pub fn blade_report(&self, blade: BladeId) -> Result<&BladeReport> {
        Ok(&self.blades.get(blade.0)?.report)
    }

    /// Lets blades stand in a new body.
    pub(super) fn meet_blades(&mut self, id: SlotId) -> Result<()> {
        if self.blades.count() == 0 {
            return Ok(());
        }
        self.make_room_for_holds(self.bodies.place(id)?, MOST_HOLDS)?;
        for (_, blade) in self.blades.iter_mut() {
            blade.proxy(BodyId(id))?;
        }
        Ok(())
    }

    /// A body is gone.
    pub(super) fn leave_blades(&mut self, body: BodyId) {
        for (_, blade) in self.blades.iter_mut() {
            blade.proxies.retain(|proxy| proxy.body != body);
        }
    }

    /// Leads what holds tissue to blades along their ways in the next step.
    pub(super) fn lead_blades(&mut self) {
        let Some(bonds) = self.tissue.as_mut().map(|tissue| &mut tissue.bonds) else {
            return;
        };
        for (_, blade) in self.blades.iter_mut() {
            let edges = blade.edges();
            for hold in blade.proxies.iter_mut().flat_map(|proxy| &mut proxy.holds) {
                let Some(place) = bonds.place_of(&self.bodies, hold.id) else {
                    continue;
                };
                let point = place - hold.offset;
                let [from, to] = edges.map(|edge| Stand::next_to(point, edge));
                // One that goes back beyond the proxy leaves it behind.
                let to = if from.lag.dot(to.lag) < 0.0 { point } else { to.foot() };
                hold.way = Lead { from: from.foot(), to };
                if hold.way.from.is_finite() && hold.way.to.is_finite() {
                    bonds.lead(hold.id, hold.way.moved(hold.offset));
                }
            }
        }
    }

    /// Has blades be where the step led them, feel what it did to them, and cut.
    pub(super) fn move_blades(&mut self, dt: f32) {
        if self.blades.count() == 0 {
            return;
        }
        let mut blades = std::mem::replace(&mut self.blades, Slots::new("blade", self.tag));
        for (_, blade) in blades.iter_mut() {
            let (count, edge_at) = blade.ways();
            self.feel(blade);
            for place in 0..self.bodies.places() {
                let Some(id) = self.bodies.id_at(place).map(BodyId) else {
                    continue;
                };
                for part in 0..count {
                    let edges = [part, part + 1].map(&edge_at);
                    if let Err(error) = self.follow_blade(blade, id, edges, dt) {
                        blade.report.refused = Some(error);
                    }
                }
            }
        }
        self.blades = blades;
    }

    /// Reports what the step did to a blade, which is at its end from now on.
    fn feel(&self, blade: &mut Blade) {
        let before = blade.pose.position.as_dvec3();
        blade.pose = blade.target.take().unwrap_or(blade.pose);
        let middle = 0.5 * (before + blade.pose.position.as_dvec3());
        let (mut force, mut torque, mut work) = (DVec3::ZERO, DVec3::ZERO, 0.0);
        for proxy in &mut blade.proxies {
            (proxy.felt, proxy.felt_at) = (DVec3::ZERO, DVec3::ZERO);
            for hold in &proxy.holds {
                let bonds = self.tissue.as_ref().map(|tissue| &tissue.bonds);
                let on_tissue = bonds.map_or(Vec3::ZERO, |bonds| bonds.force_of(hold.id)).as_dvec3();
                let Lead { from, to } = hold.way;
                proxy.felt -= on_tissue;
                proxy.felt_at += (to + hold.offset) / proxy.holds.len() as f64;
                torque -= (0.5 * (from + to) - middle).cross(on_tissue);
                work += on_tissue.dot(to - from);
            }
            proxy.touched = [proxy.felt != DVec3::ZERO, proxy.touched[0]];
            force += proxy.felt;
        }
        // Finite, whatever the step's length.
        let finite = |sum: DVec3| sum.as_vec3().clamp(Vec3::MIN, Vec3::MAX);
        blade.report = BladeReport {
            force: finite(force),
            torque: finite(torque),
            work,
            ..BladeReport::default()
        };
    }
}
