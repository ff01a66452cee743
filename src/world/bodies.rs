//! The bodies of a world.

use super::attachments::Which;
use super::{FRAME, World, make_walks};
#[cfg(doc)]
use crate::base::Error;
use crate::base::{BodyId, Result, SlotId, memory};
use crate::body::{Body, CutReport, MaterialPoint, Needs, Steps, Stroke};
use crate::cutting::Sweep;
use crate::def::{Anchor, BodyDefinition};
use crate::deformable_contact::Skin;
use crate::solver::{RestStateDefinition, RestStateReport};

impl World {
    /// Adds a body.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`]: something in the definition is out of its range. [`Error::Unsupported`]: this version
    /// does not offer its storage or solver. [`Error::OutOfMemory`].
    pub fn create_body(&mut self, definition: &BodyDefinition) -> Result<BodyId> {
        let needs = Needs {
            tolerance: self.definition.tolerance > 0.0 && self.definition.substeps == 0,
            tools: self.tool_places(),
            kernel: self.kernel,
            steps: Steps {
                length: self.clock.mean_step().unwrap_or(FRAME),
                substeps: self.definition.substeps,
                max_substeps: self.definition.max_substeps,
            },
        };
        let mut body = Body::new(definition, needs)?;
        if let Some(contacts) = &mut body.system_mut().contacts {
            contacts.reserve_dynamic(self.tools.places(), self.dynamic_count())?;
        }
        self.outcomes.try_reserve(self.bodies.places() + 1)?;
        let id = self.bodies.insert(body)?;
        match self.join_tissue(id).and_then(|()| self.meet_blades(id)) {
            Ok(()) => Ok(BodyId(id)),
            Err(error) => {
                self.leave_blades(BodyId(id));
                self.bodies.take_back(id)?;
                Err(error)
            }
        }
    }

    /// Lets a body that asks for it meet tissue.
    pub(super) fn join_tissue(&mut self, id: SlotId) -> Result<()> {
        let place = self.bodies.place(id)?;
        let body = self.bodies.get_mut(id)?;
        if !body.system().meets_tissue() {
            return Ok(());
        }
        body.system_mut().reserve_pressed()?;
        make_walks(&mut self.walks, place)?;
        memory::get_or_box(&mut self.tissue)?.join(place, body.system())
    }

    /// Removes a body, and with it what is attached of it.
    ///
    /// # Errors
    /// [`Error::StaleId`].
    pub fn destroy_body(&mut self, body: BodyId) -> Result<()> {
        let place = self.bodies.place(body.0)?;
        self.bodies.remove(body.0)?;
        if let Some(tissue) = &mut self.tissue {
            tissue.leave(&mut self.bodies, place);
        }
        self.forget_attachments_of(body);
        self.leave_blades(body);
        Ok(())
    }

    /// Cuts a body where a blade's edge passed from one place to another, while its nodes are where they are.
    ///
    /// Where the blade crosses an edge of the surface, or ends within a triangle, there is a point of the surface from then on: one that is there, or
    /// on an edge that is there, if it lies within 5 % of the shortest edge of the triangle that is simulated there, in the rest shape. Between them
    /// the surface is open. What is simulated stays as well shaped as it was: a triangle whose material fell apart is copied for each piece, with nodes
    /// that are not drawn where its material is beyond the cut, and with its part of masses and stiffnesses; copies share nodes where their
    /// material hangs together (Molino, Bao, Fedkiw 2004). Springs along no edge of a triangle are taken away where the blade passed through them.
    ///
    /// Of tetrahedra the edges that the blade crosses are divided in the same way, and faces between points on its way open once one of their
    /// corners parts: at the latest when a tetrahedron's last edge is crossed. What was inside is drawn from then on. A body of springs alone loses
    /// those that the blade passed through.
    ///
    /// A sweep that begins just where the last of the body ended goes on with it: it begins where the tissue that the blade stood in has gone
    /// meanwhile. A blade that stays in tissue that moves so leaves no bridges.
    ///
    /// Nodes keep their numbers, and new ones are numbered on: copies, which move as what they copied moved, and points of the surface between nodes,
    /// which have no mass and go where their nodes go. Mass, momentum and energy stay what they were. What holds a node holds it where
    /// it is drawn; copies of it beyond the cut are free, and have the mass of their material in the mean where it had none.
    ///
    /// Terms beside springs go on in parts: home springs with those of the nodes' masses, what goes by springs with those, fibres with the tetrahedra, and hinges of
    /// bending by area, where pieces of both triangles still share the edge. A hinge whose edge is cut along is gone, with its energy, and so is what a cavity had that is cut open.
    ///
    /// Positions and triangles that were lent before are stale. [`Body::changes_since`] tells a renderer what has changed.
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::Unsupported`]: the body was made without [`BodyDefinition::spare_nodes`]. [`Error::InvalidArgument`]: an end of
    /// the blade is not finite. [`Error::Capacity`]: there are not as many spare nodes left, or a node has no free place in a row of fixed
    /// length. [`Error::OutOfMemory`]. Then nothing has changed.
    pub fn cut(&mut self, body: BodyId, sweep: &Sweep) -> Result<CutReport> {
        let report = self.change_topology(body, |it, skin| it.cut(sweep, skin))?;
        self.bodies.get_mut(body.0)?.show_topology();
        Ok(report)
    }

    /// The same along a stroke of its own.
    pub(super) fn cut_along(&mut self, body: BodyId, sweep: &Sweep, stroke: &mut Stroke) -> Result<CutReport> {
        let report = self.change_topology(body, |it, skin| {
            it.swap_stroke(stroke);
            let report = it.cut(sweep, skin);
            it.swap_stroke(stroke);
            report
        })?;
        self.bodies.get_mut(body.0)?.show_topology();
        Ok(report)
    }

    /// Lets a body change its topology, and what is attached of it follow.
    pub(super) fn change_topology<T>(
        &mut self,
        body: BodyId,
        change: impl FnOnce(&mut Body, Option<&mut Skin>) -> Result<T>,
    ) -> Result<T> {
        let place = self.bodies.place(body.0)?;
        let carried = self.attached_points(body, place)?;
        let mut moved = crate::base::memory::reserved(carried.len())?;
        let it = self.bodies.get_mut(body.0)?;
        let before = it.topology_version();
        let skin = self.tissue.as_mut().and_then(|tissue| tissue.skin_mut(place));
        let changed = change(it, skin)?;
        if it.topology_version() == before {
            return Ok(changed);
        }
        for (anchor, point) in carried {
            let it = self.bodies.get(body.0)?;
            let now = point.and_then(|point| it.surface_point(&point, before));
            let now = now.map_or(anchor, Anchor::Point);
            // What cannot be bound anew stays bound as it was.
            if let Ok(bound) = self.bound(body, Which::ONLY, &now) {
                moved.push((anchor, bound));
            }
        }
        if let Some(bonds) = self.bonds_mut() {
            bonds.rebind(place, |bound| {
                let of = moved.iter().find(|(anchor, _)| Some(*anchor) == bound.anchor);
                of.map(|(_, now)| *now)
            });
        }
        Ok(changed)
    }

    /// What others are attached to of a body, points with their places in its material; there is room to bind them anew.
    fn attached_points(&mut self, body: BodyId, place: usize) -> Result<Vec<(Anchor, Option<MaterialPoint>)>> {
        let mut points = Vec::new();
        let it = self.bodies.get(body.0)?;
        let Some(tissue) = &mut self.tissue else {
            return Ok(points);
        };
        tissue.bonds.reserve_rebinding(place)?;
        for bound in tissue.bonds.points_of(place) {
            let Some(anchor) = bound.anchor else { continue };
            let at = match &anchor {
                Anchor::Point(point) => it.material_point(point),
                Anchor::Node(_) => None,
            };
            crate::base::memory::push(&mut points, (anchor, at))?;
        }
        Ok(points)
    }

    /// A body, to look at.
    ///
    /// # Errors
    /// [`Error::StaleId`].
    pub fn body(&self, body: BodyId) -> Result<&Body> {
        self.bodies.get(body.0)
    }

    /// A body, to change.
    ///
    /// # Errors
    /// [`Error::StaleId`].
    pub fn body_mut(&mut self, body: BodyId) -> Result<&mut Body> {
        self.bodies.get_mut(body.0)
    }

    /// Moves the free nodes of a body, whatever its solver, to the nearest place downhill where it is at rest under gravity,
    /// its pins where they are, and the forces applied since the last step, which stay pending. Velocities become zero and what
    /// holds the pins is known. It is no step: it allocates and may take long. Tools are not taken into account.
    ///
    /// A part of a body that hangs on no pin is moved too where the forces on it cancel; how it lies and is turned as a whole is
    /// then as it happens to be.
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::InvalidArgument`]: the tolerance is out of its range, or a part is pulled by a net force
    /// along an axis along which no pin holds it, or the body is attached to a body. [`Error::NotConverged`]: not found in the iterations allowed. [`Error::OutOfMemory`]. Nothing has changed then.
    pub fn rest_state(&mut self, body: BodyId, definition: &RestStateDefinition) -> Result<RestStateReport> {
        self.check_not_attached(body)?;
        let gravity = self.definition.gravity;
        let body = self.bodies.get_mut(body.0)?;
        let gravity = body.system().pull(gravity);
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
