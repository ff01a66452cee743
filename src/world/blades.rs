//! Blades: edges that cut the tissue they are moved through, with force feedback.
//!
//! The *proxy* of a blade in a body is the edge up to which tissue is cut. A spring couples it to the true edge, which
//! is ahead of it (Mahvash, Hayward 2001). During a step the spring is a constraint between the tissue at the proxy and
//! the moving true edge. Each substep solves its impulse implicitly, so that it is stable for any stiffness and step.
//! Its force never exceeds the resistance of the tissue. At the end of the step the proxy advances, and the tissue
//! between its two positions is cut.

use glam::{DVec3, Quat, Vec3};

use super::World;
use super::blade::{Blade, BladeDefinition, BladeReport, EdgePoint, MAX_HOLDS};
use crate::base::{BladeId, BodyId, Result, SlotId};
use crate::def::CollisionFilter;
use crate::deformable_contact::LinearPath;
use crate::slots::Slots;

impl World {
    /// Adds a blade: an edge that is moved by its pose, as a tool is. It cuts bodies with
    /// [`BodyDefinition::spare_nodes`] as [`World::cut`] does, against their
    /// [`toughness`](crate::BodyDefinition::toughness). A blade is an edge without volume; add a tool for the body of
    /// the instrument.
    ///
    /// The edge first deforms the tissue, until the spring of [`BladeDefinition::stiffness`] pulls as hard as the
    /// tissue resists: by its toughness for each meter cut in the rest shape. From then on the proxy advances at the
    /// end of each step until both forces are equal again. The work of the blade is therefore the toughness times the
    /// length of the cut (in solids its area), plus the energy stored in the spring (Mahvash, Hayward 2001). The force
    /// on the tissue is the force on the blade: momentum is conserved. An edge that moves along itself, or back through
    /// its own cut, meets no resistance.
    ///
    /// The cut follows the path of the proxy, in steps of a fifth of a triangle's shortest edge, and to its end where
    /// the blade leaves the tissue. Passing through a triangle takes about ten
    /// [`spare_nodes`](crate::BodyDefinition::spare_nodes). Tissue of toughness 0 is cut in each step exactly along the
    /// edge's path. If a cut fails, the proxy stays and the spring keeps pulling with the resistance of the tissue
    /// ([`BladeReport::refused`]).
    ///
    /// Tissue that moves onto a resting edge is cut as if the edge had moved. Rotations are divided into parts of half
    /// a radian.
    ///
    /// A body that holds a blade takes its substeps as an attached body does. A step in which a blade moves through
    /// tissue can allocate.
    ///
    /// [`BodyDefinition::spare_nodes`]: crate::BodyDefinition::spare_nodes
    ///
    /// # Errors
    /// [`Error::InvalidArgument`](crate::Error::InvalidArgument): a value of the definition is out of range.
    /// [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub fn create_blade(&mut self, definition: &BladeDefinition) -> Result<BladeId> {
        let mut blade = Blade::new(definition)?;
        for slot in 0..self.bodies.slot_count() {
            self.reserve_holds(slot, MAX_HOLDS)?;
            if let Some(id) = self.bodies.id_at(slot) {
                blade.proxy(BodyId(id))?;
            }
        }
        Ok(BladeId(self.blades.insert(blade)?))
    }

    /// Removes a blade. Its cuts stay.
    ///
    /// # Errors
    /// [`Error::StaleId`](crate::Error::StaleId).
    pub fn destroy_blade(&mut self, blade: BladeId) -> Result<()> {
        let mut blade = self.blades.remove(blade.0)?;
        for proxy in &mut blade.proxies {
            self.remove_holds(proxy);
        }
        Ok(())
    }

    /// Moves a blade to `position`, m, over the next step, at constant velocity, and rotates it to `orientation`;
    /// `None` keeps its orientation.
    ///
    /// # Errors
    /// [`Error::StaleId`](crate::Error::StaleId). [`Error::InvalidArgument`](crate::Error::InvalidArgument): a number
    /// is not finite, a coordinate is further than 1e9 m from 0, or the orientation is zero.
    pub fn set_blade_pose(&mut self, blade: BladeId, position: Vec3, orientation: Option<Quat>) -> Result<()> {
        let blade = self.blades.get_mut(blade.0)?;
        let pose = blade.target.unwrap_or(blade.pose);
        blade.target = Some(pose.moved(position, orientation)?);
        Ok(())
    }

    /// Sets which bodies a blade cuts, from the next step on. A body that it no longer cuts releases it.
    ///
    /// # Errors
    /// [`Error::StaleId`](crate::Error::StaleId).
    pub fn set_blade_collision_filter(&mut self, blade: BladeId, filter: CollisionFilter) -> Result<()> {
        self.blades.get_mut(blade.0)?.filter = filter;
        Ok(())
    }

    /// Which bodies a blade cuts.
    ///
    /// # Errors
    /// [`Error::StaleId`](crate::Error::StaleId).
    pub fn blade_collision_filter(&self, blade: BladeId) -> Result<CollisionFilter> {
        Ok(self.blades.get(blade.0)?.filter)
    }

    /// The cuts of a blade in the last step, and the force on it.
    ///
    /// # Errors
    /// [`Error::StaleId`](crate::Error::StaleId).
    pub fn blade_report(&self, blade: BladeId) -> Result<&BladeReport> {
        Ok(&self.blades.get(blade.0)?.report)
    }

    /// Reserves proxies and holds of all blades in a new body.
    pub(super) fn add_to_blades(&mut self, id: SlotId) -> Result<()> {
        if self.blades.count() == 0 {
            return Ok(());
        }
        self.reserve_holds(self.bodies.slot(id)?, MAX_HOLDS)?;
        for (_, blade) in self.blades.iter_mut() {
            blade.proxy(BodyId(id))?;
        }
        Ok(())
    }

    /// Removes the proxies in a destroyed body.
    pub(super) fn remove_from_blades(&mut self, body: BodyId) {
        for (_, blade) in self.blades.iter_mut() {
            blade.proxies.retain(|proxy| proxy.body != body);
        }
    }

    /// Sets the motion of all holds over the next step.
    pub(super) fn move_holds(&mut self) {
        let Some(point_attachments) = self
            .deformable_contact
            .as_mut()
            .map(|deformable_contact| &mut deformable_contact.attachments)
        else {
            return;
        };
        for (_, blade) in self.blades.iter_mut() {
            let edges = blade.edges();
            for hold in blade.proxies.iter_mut().flat_map(|proxy| &mut proxy.holds) {
                let Some(position) = point_attachments.first_point_position(&self.bodies, hold.id) else {
                    continue;
                };
                let point = position - hold.offset;
                let [from, to] = edges.map(|edge| EdgePoint::next_to(point, edge));
                // An edge that moves back beyond the proxy no longer pulls at it.
                let to = if from.lag.dot(to.lag) < 0.0 {
                    point
                } else {
                    to.nearest()
                };
                hold.motion = LinearPath {
                    from: from.nearest(),
                    to,
                };
                if hold.motion.from.is_finite() && hold.motion.to.is_finite() {
                    point_attachments.set_end_path(hold.id, hold.motion.moved(hold.offset));
                }
            }
        }
    }

    /// Moves blades to the end of the step, reports the forces on them, and cuts.
    pub(super) fn move_blades(&mut self, dt: f32) {
        if self.blades.count() == 0 {
            return;
        }
        let mut blades = std::mem::replace(&mut self.blades, Slots::new("blade", self.tag));
        for (_, blade) in blades.iter_mut() {
            let (count, edge_at) = blade.edge_positions();
            self.report_force(blade);
            for slot in 0..self.bodies.slot_count() {
                let Some(id) = self.bodies.id_at(slot).map(BodyId) else {
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

    /// Reports the force on a blade over the step, and moves the blade to the end of the step.
    fn report_force(&self, blade: &mut Blade) {
        let before = blade.pose.position.as_dvec3();
        blade.pose = blade.target.take().unwrap_or(blade.pose);
        let middle = 0.5 * (before + blade.pose.position.as_dvec3());
        let (mut force, mut torque, mut work) = (DVec3::ZERO, DVec3::ZERO, 0.0);
        for proxy in &mut blade.proxies {
            (proxy.force_on_blade, proxy.force_point) = (DVec3::ZERO, DVec3::ZERO);
            for hold in &proxy.holds {
                let point_attachments = self
                    .deformable_contact
                    .as_ref()
                    .map(|deformable_contact| &deformable_contact.attachments);
                let on_tissue = point_attachments
                    .map_or(Vec3::ZERO, |point_attachments| point_attachments.force_of(hold.id))
                    .as_dvec3();
                let LinearPath { from, to } = hold.motion;
                proxy.force_on_blade -= on_tissue;
                proxy.force_point += (to + hold.offset) / proxy.holds.len() as f64;
                torque -= (0.5 * (from + to) - middle).cross(on_tissue);
                work += on_tissue.dot(to - from);
            }
            proxy.touched = [proxy.force_on_blade != DVec3::ZERO, proxy.touched[0]];
            force += proxy.force_on_blade;
        }
        // A very short step must not make the force infinite.
        let finite = |sum: DVec3| sum.as_vec3().clamp(Vec3::MIN, Vec3::MAX);
        blade.report = BladeReport {
            force: finite(force),
            torque: finite(torque),
            work,
            ..BladeReport::default()
        };
    }
}
