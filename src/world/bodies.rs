//! The bodies of a world.

use super::attachments::Which;
use super::{FRAME, World, reserve_coupling};
#[cfg(doc)]
use crate::base::Error;
use crate::base::{BodyId, Result, SlotId, memory};
use crate::body::{BladeStroke, Body, BodyContext, CutReport, MaterialPoint, StepSettings};
use crate::cutting::Sweep;
use crate::def::{Anchor, BodyDefinition};
use crate::deformable_contact::CollisionSurface;
use crate::solver::{RestStateDefinition, RestStateReport};

impl World {
    /// Adds a body.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: a value of the definition is out of range. [`Error::Unsupported`]: this version
    /// does not offer its storage or solver. [`Error::OutOfMemory`].
    pub fn create_body(&mut self, definition: &BodyDefinition) -> Result<BodyId> {
        let needs = BodyContext {
            tolerance: self.definition.tolerance > 0.0 && self.definition.substeps == 0,
            tools: self.tool_places(),
            kernel: self.kernel,
            steps: StepSettings {
                length: self.clock.mean_step().unwrap_or(FRAME),
                substeps: self.definition.substeps,
                max_substeps: self.definition.max_substeps,
            },
        };
        let mut body = Body::new(definition, needs)?;
        if let Some(contacts) = &mut body.system_mut().contacts {
            contacts.reserve_dynamic(self.tools.slot_count(), self.dynamic_count())?;
        }
        self.outcomes.try_reserve(self.bodies.slot_count() + 1)?;
        let id = self.bodies.insert(body)?;
        match self.join_tissue(id).and_then(|()| self.add_to_blades(id)) {
            Ok(()) => Ok(BodyId(id)),
            Err(error) => {
                self.remove_from_blades(BodyId(id));
                self.bodies.undo_insert(id)?;
                Err(error)
            }
        }
    }

    /// Adds a body to deformable contact, if its definition enables it.
    pub(super) fn join_tissue(&mut self, id: SlotId) -> Result<()> {
        let slot = self.bodies.slot(id)?;
        let body = self.bodies.get_mut(id)?;
        if !body.system().collides_with_tissue() {
            return Ok(());
        }
        body.system_mut().reserve_contact_history()?;
        reserve_coupling(&mut self.coupled, slot)?;
        memory::get_or_box(&mut self.deformable_contact)?.add_body(slot, body.system())
    }

    /// Removes a body and its attachments.
    ///
    /// # Errors
    /// [`Error::StaleId`].
    pub fn destroy_body(&mut self, body: BodyId) -> Result<()> {
        let slot = self.bodies.slot(body.0)?;
        self.bodies.remove(body.0)?;
        if let Some(deformable_contact) = &mut self.deformable_contact {
            deformable_contact.remove_body(&mut self.bodies, slot);
        }
        self.forget_attachments_of(body);
        self.remove_from_blades(body);
        Ok(())
    }

    /// Cuts a body along the surface swept by a blade's edge, at the current positions of the nodes.
    ///
    /// The render surface gets a new point wherever the blade crosses one of its edges or ends within a triangle, and
    /// opens between these points. An existing point or edge is used if it lies within 5 % of the shortest edge of the
    /// simulated triangle, in the rest shape. The simulation mesh keeps its shape (virtual node algorithm: Molino, Bao,
    /// Fedkiw 2004). A triangle whose material has separated is copied for each piece, with its share of masses and
    /// stiffnesses. Beyond the cut the copies have nodes that are not drawn; copies share nodes where their material is
    /// connected. Springs that lie along no triangle edge are removed where the blade passes through them.
    ///
    /// In tetrahedral bodies the crossed edges are divided in the same way. The faces between the new points open when
    /// one of their corners separates, at the latest when the last edge of a tetrahedron is crossed. The inner surfaces
    /// are drawn from then on. A body of springs alone loses the springs that the blade passes through.
    ///
    /// A sweep that begins exactly where the body's last sweep ended continues it: it begins at the current position of
    /// the tissue in which the blade stopped. A blade that rests in moving tissue therefore leaves no bridges.
    ///
    /// Nodes keep their numbers; new nodes are appended. They are copies, which move as their original did, and points
    /// of the surface between nodes, which have no mass and follow their nodes. Mass, momentum and energy are
    /// conserved. A pin or an attachment holds a node where it is drawn; copies beyond the cut are free. Copies of a
    /// massless node get the mean mass of their material.
    ///
    /// Other forces are divided too: anchor springs by the masses of their nodes, forces along springs with those,
    /// fibers with the tetrahedra, and bending hinges by area where both triangles still share the edge. A hinge is
    /// removed if its edge is cut; an opened cavity loses its pressure.
    ///
    /// Positions and triangles that were borrowed before are stale. [`Body::changes_since`] lists the changes for a
    /// renderer.
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::Unsupported`]: the body has no [`BodyDefinition::spare_nodes`].
    /// [`Error::InvalidArgument`]: an end of the blade is not finite. [`Error::Capacity`]: too few spare nodes are
    /// left, or a node has no free slot in a row of fixed length. [`Error::OutOfMemory`]. After an error nothing has
    /// changed.
    pub fn cut(&mut self, body: BodyId, sweep: &Sweep) -> Result<CutReport> {
        let report = self.change_topology(body, |content, skin| content.cut(sweep, skin))?;
        self.bodies.get_mut(body.0)?.publish_topology();
        Ok(report)
    }

    /// Cuts as [`World::cut`] does, but continues `stroke` instead of the body's own last sweep.
    pub(super) fn cut_along(&mut self, body: BodyId, sweep: &Sweep, stroke: &mut BladeStroke) -> Result<CutReport> {
        let report = self.change_topology(body, |content, skin| {
            content.swap_stroke(stroke);
            let report = content.cut(sweep, skin);
            content.swap_stroke(stroke);
            report
        })?;
        self.bodies.get_mut(body.0)?.publish_topology();
        Ok(report)
    }

    /// Changes the topology of a body, and binds its attachments to the new topology.
    pub(super) fn change_topology<T>(
        &mut self,
        body: BodyId,
        change: impl FnOnce(&mut Body, Option<&mut CollisionSurface>) -> Result<T>,
    ) -> Result<T> {
        let slot = self.bodies.slot(body.0)?;
        let carried = self.attached_points(body, slot)?;
        let mut moved = crate::base::memory::reserved(carried.len())?;
        let content = self.bodies.get_mut(body.0)?;
        let before = content.topology_version();
        let skin = self
            .deformable_contact
            .as_mut()
            .and_then(|deformable_contact| deformable_contact.surface_mut(slot));
        let changed = change(content, skin)?;
        if content.topology_version() == before {
            return Ok(changed);
        }
        for (anchor, point) in carried {
            let content = self.bodies.get(body.0)?;
            let now = point.and_then(|point| content.surface_point(&point, before));
            let now = now.map_or(anchor, Anchor::Point);
            // A point that cannot be bound again stays bound as it was.
            if let Ok(bound) = self.bound(body, Which::ONLY, &now) {
                moved.push((anchor, bound));
            }
        }
        if let Some(point_attachments) = self.point_attachments_mut() {
            point_attachments.rebind(slot, |bound| {
                let of = moved.iter().find(|(anchor, _)| Some(*anchor) == bound.anchor);
                of.map(|(_, now)| *now)
            });
        }
        Ok(changed)
    }

    /// The attached points of a body, with their material points. It reserves room to bind them again.
    fn attached_points(&mut self, body: BodyId, slot: usize) -> Result<Vec<(Anchor, Option<MaterialPoint>)>> {
        let mut points = Vec::new();
        let content = self.bodies.get(body.0)?;
        let Some(deformable_contact) = &mut self.deformable_contact else {
            return Ok(points);
        };
        deformable_contact.attachments.reserve_rebinding(slot)?;
        for bound in deformable_contact.attachments.points_of(slot) {
            let Some(anchor) = bound.anchor else { continue };
            let at = match &anchor {
                Anchor::Point(point) => content.material_point(point),
                Anchor::Node(_) => None,
            };
            crate::base::memory::push(&mut points, (anchor, at))?;
        }
        Ok(points)
    }

    /// A body, for reading.
    ///
    /// # Errors
    /// [`Error::StaleId`].
    pub fn body(&self, body: BodyId) -> Result<&Body> {
        self.bodies.get(body.0)
    }

    /// A body, for changing.
    ///
    /// # Errors
    /// [`Error::StaleId`].
    pub fn body_mut(&mut self, body: BodyId) -> Result<&mut Body> {
        self.bodies.get_mut(body.0)
    }

    /// Moves the free nodes of a body to static equilibrium under gravity, pins and the forces applied since the last
    /// step, with every solver.
    ///
    /// It finds the nearest minimum of the energy that lies downhill. Velocities become zero, and the pin forces are
    /// known afterwards. The applied forces stay pending. It is not a step: it allocates and can take long. It ignores
    /// tools.
    ///
    /// A connected component without pins is moved too if the net force on it is zero. Its rigid-body position and
    /// orientation are then unspecified.
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::InvalidArgument`]: the tolerance is out of range, a net force acts on a component
    /// along an axis without pins, or the body is attached to a body. [`Error::NotConverged`]: no equilibrium within
    /// the allowed iterations. [`Error::OutOfMemory`]. After an error nothing has changed.
    pub fn rest_state(&mut self, body: BodyId, definition: &RestStateDefinition) -> Result<RestStateReport> {
        self.check_not_attached(body)?;
        let gravity = self.definition.gravity;
        let body = self.bodies.get_mut(body.0)?;
        let gravity = body.system().body_acceleration(gravity);
        body.rest_state(gravity, definition)
    }

    /// All bodies.
    pub fn bodies(&self) -> impl Iterator<Item = &Body> {
        self.bodies.iter().map(|(_, body)| body)
    }

    /// All bodies, with their ids.
    pub(crate) fn bodies_by_id(&self) -> impl Iterator<Item = (BodyId, &Body)> {
        self.bodies.iter_ids().map(|(id, body)| (BodyId(id), body))
    }
}
