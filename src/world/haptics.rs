//! The simulation side of haptic handles: poses received from device threads, and local force models sent to them.

use glam::{DQuat, DVec3, Vec3};

use super::World;
use crate::base::{BodyId, Error, Result, ToolId};
use crate::contact::{Pose, ToolShape};
use crate::geometry::rotation;
use crate::haptics::{
    Cone, Coupling, HapticContact, HapticDefinition, HapticHandle, MAX_CONTACTS, Secant, Sent, Vector6, WrenchModel,
    ZERO, about, along, difference, expanded, inverse, joined, product, scaled, sum,
};
use crate::sync::triple_buffer::{BufferReader, BufferWriter, triple_buffer};

/// A force too small to be felt, N.
const NEGLIGIBLE: f64 = 1e-3;

/// The mass of the touched nodes decays by this factor per step: a bouncing tool touches them again.
const MASS_DECAY: f64 = 0.95;

/// The largest fraction of the prediction error that is adopted in a step while the tool holds tissue, whose
/// oscillation lags.
const MAX_SHARE_HELD: f64 = 0.5;

/// The lever arm of a plane, m.
const LEVER_OF_PLANE: f64 = 0.1;

/// Contacts hold a tool from both sides if the sum of their magnitudes exceeds their resultant by this factor.
const OPPOSED: f64 = 3.0;

/// The factor by which the allowed inclination of the force, and the allowed torque, exceed those of the contacts.
const CONE_MARGIN: f64 = 1.2;

/// The least allowed inclination of the force, as a tangent, and the least allowed torque over force and lever arm.
const MIN_INCLINATION: f64 = 0.3;

/// The simulation side of a haptic handle.
#[derive(Debug)]
pub(super) struct HapticLink {
    tool: ToolId,
    coupling: Coupling,
    poses: BufferReader<Sent>,
    models: BufferWriter<WrenchModel>,
    secant: Secant,
    /// The wrench that was last sent to the device, and the pose that it is valid at.
    reported_wrench: Vector6,
    middle: (DVec3, DQuat),
    /// The mass of the touched nodes, kg.
    mass: f64,
    /// The pose of the tool at the start of the step.
    before: Pose,
    /// The work of the tool on tissue, J.
    work: f64,
    version: u64,
}

impl HapticLink {
    /// Adopts the mean wrench of a step, which applies at its middle. `inertia` is the mass of the touched nodes over
    /// the square of the step, N/m. Where this exceeds the stiffness of the coupling, a change of the tool's speed
    /// gives a jolt from which the massless proxy would rebound. Therefore only a fraction of the prediction error is
    /// adopted in each step, and at most `max_share`.
    fn adopt(&mut self, middle: (DVec3, DQuat), wrench: &Vector6, (inertia, max_share): (f64, f64)) -> Vector6 {
        let turned = rotation::rotation_between(self.middle.1, middle.1) * self.coupling.lever;
        let displacement = joined(middle.0 - self.middle.0, turned);
        let predicted = difference(&self.reported_wrench, &product(self.secant.stiffness(), &displacement));
        let part = (1.5 / (1.0 + 4.0 * inertia / self.coupling.stiffness[0])).min(max_share);
        let new = difference(wrench, &predicted);
        self.reported_wrench = sum(&predicted, &scaled(&new, part));
        self.middle = middle;
        if *wrench == ZERO && (part == 1.0 || self.reported_wrench.iter().all(|part| part.abs() < NEGLIGIBLE)) {
            self.reported_wrench = ZERO;
        }
        self.reported_wrench
    }
}

impl World {
    /// Creates a haptic handle for a tool, to be used on the thread of the device. The tool should be at the device's
    /// pose: the first step moves it there. While the handle exists, [`World::set_pose`] of the tool is refused. Each
    /// step moves the tool to the last pose of the handle's proxy ([`World::tool_target`]). The handle costs a few
    /// microseconds per step.
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::InvalidArgument`]: a value of the definition is out of range, another handle moves
    /// the tool, or the tool is dynamic. [`Error::OutOfMemory`].
    pub fn create_haptic(&mut self, definition: &HapticDefinition) -> Result<HapticHandle> {
        self.check_kinematic(definition.tool)?;
        let tool = self.tools.get(definition.tool.0)?;
        let pose = tool.pose;
        let coupling = definition.coupling(lever_of(&tool.shape))?;
        self.haptics.retain(|link| !link.poses.is_alone());
        self.check_not_led(definition.tool)?;
        self.haptics.try_reserve(1)?;
        let spring = expanded(coupling.stiffness);
        let free = WrenchModel::free(pose.position.as_dvec3(), orientation_of(pose), &spring);
        let (models, seen) = triple_buffer([free; 3]);
        let sent = Sent {
            pose,
            time: 0.0,
            work: 0.0,
        };
        let (to_send, poses) = triple_buffer([sent; 3]);
        self.haptics.push(HapticLink {
            tool: definition.tool,
            coupling,
            poses,
            models,
            secant: Secant::new(),
            reported_wrench: ZERO,
            middle: (pose.position.as_dvec3(), orientation_of(pose)),
            mass: 0.0,
            before: pose,
            work: 0.0,
            version: 0,
        });
        Ok(HapticHandle::new(coupling, seen, to_send))
    }

    /// Refuses a tool that a haptic handle moves.
    pub(super) fn check_not_led(&self, tool: ToolId) -> Result<()> {
        let leads = |link: &HapticLink| link.tool == tool && !link.poses.is_alone();
        if self.haptics.iter().any(leads) {
            return Err(Error::invalid(format!("tool is {}: a haptic handle leads it", tool.0)));
        }
        Ok(())
    }

    /// One of the tools that haptic handles move, if there is one.
    pub(super) fn haptic_tool(&self) -> Option<ToolId> {
        let link = self.haptics.iter().find(|link| !link.poses.is_alone())?;
        Some(link.tool)
    }

    /// Removes the link of a destroyed tool.
    pub(super) fn remove_haptics_of(&mut self, tool: ToolId) {
        self.haptics.retain(|link| link.tool != tool);
    }

    /// Sets the targets of tools to the poses of their handles' proxies.
    pub(super) fn apply_haptic_poses(&mut self) {
        for link in &mut self.haptics {
            let Ok(tool) = self.tools.get_mut(link.tool.0) else {
                continue;
            };
            link.before = tool.pose;
            // The last pose of a destroyed handle is ignored.
            if !link.poses.is_alone() && link.poses.take() {
                // The handle has already checked the pose.
                tool.target = link.poses.read(|sent| sent.pose).checked().ok().or(tool.target);
            }
        }
    }

    /// True if a handle moves the tool in this slot.
    pub(super) fn is_in_hand(&self, slot: usize) -> bool {
        let mut leading = self.haptics.iter().filter(|link| !link.poses.is_alone());
        leading.any(|link| self.tools.slot(link.tool.0).is_ok_and(|of_hand| of_hand == slot))
    }

    /// Sends each handle a local model of the wrench in the last step of `dt` seconds.
    pub(super) fn publish_haptics(&mut self, dt: f32) {
        let mut haptics = std::mem::take(&mut self.haptics);
        for link in haptics.iter_mut().filter(|link| !link.poses.is_alone()) {
            self.publish_to(link, f64::from(dt));
        }
        self.haptics = haptics;
    }

    fn publish_to(&self, link: &mut HapticLink, dt: f64) {
        let (Ok(tool), Ok(slot)) = (self.tools.get(link.tool.0), self.tools.slot(link.tool.0)) else {
            return;
        };
        let HapticLink { coupling, before, .. } = *link;
        let lever = coupling.lever;
        let (start, end) = (before.position.as_dvec3(), tool.pose.position.as_dvec3());
        let turn = rotation::rotation_between(orientation_of(before), orientation_of(tool.pose));
        let wrench = joined(tool.force.as_dvec3(), tool.torque.as_dvec3() / lever);
        let displacement = joined(end - start, turn * lever);
        link.work -= wrench
            .iter()
            .zip(displacement)
            .map(|(part, displacement)| part * displacement)
            .sum::<f64>();
        // A mean wrench is valid at the middle of the step.
        let middle = (
            0.5 * (start + end),
            rotation::rotated(orientation_of(before), 0.5 * turn),
        );
        // A bouncing tool touches the nodes again.
        link.mass = self.touched_mass(slot).max(MASS_DECAY * link.mass);
        let holds = self.is_holding(slot);
        let max_share = if holds { MAX_SHARE_HELD } else { 1.0 };
        let reported_wrench = link.adopt(middle, &wrench, (link.mass / (dt * dt), max_share));
        link.secant
            .update(middle, &wrench, dt, lever, (coupling.stiffness[0], holds));
        link.version += 1;
        let (version, work) = (link.version, link.work);
        let (sent_at, sent_work) = link.poses.read(|sent| (sent.time, sent.work));
        let stiffness = *link.secant.stiffness();
        let spring = expanded(coupling.stiffness);
        link.models.write(|model| {
            model.version = version;
            (model.position, model.orientation) = middle;
            model.wrench = reported_wrench;
            model.stiffness = stiffness;
            let mut both = stiffness;
            (0..6).for_each(|k| both[k][k] += spring[k]);
            model.compliance = inverse(&both);
            self.gather_contacts(slot, model);
            model.work = work;
            (model.sent_at, model.sent_work) = (sent_at, sent_work);
            model.cone = cone_of(model, end, lever).filter(|_| !holds);
        });
    }

    /// The mass of the nodes that the tool in this slot touches, kg.
    fn touched_mass(&self, slot: usize) -> f64 {
        let bodies = self.bodies.iter_ids();
        let masses = bodies.flat_map(|(id, body)| {
            let contacts = body.contacts_with(slot, BodyId(id));
            contacts.map(|contact| body.effective_mass_at(&contact))
        });
        masses.sum()
    }

    /// True if a node is attached to the tool in this slot.
    pub(super) fn is_holding(&self, slot: usize) -> bool {
        self.bodies
            .iter()
            .any(|(_, body)| body.system().has_attachments_to(slot))
    }

    /// Copies the contacts of the tool in this slot with the largest forces to the model.
    fn gather_contacts(&self, slot: usize, model: &mut WrenchModel) {
        model.contact_count = 0;
        for (id, body) in self.bodies.iter_ids() {
            for contact in body.contacts_with(slot, BodyId(id)) {
                let found = HapticContact {
                    body: contact.body,
                    point: contact.point,
                    normal: contact.normal,
                    velocity: body.velocity_at(&contact),
                    force: contact.force,
                };
                let pressed = |contact: &HapticContact| contact.force.length_squared();
                if model.contact_count < MAX_CONTACTS {
                    model.contacts[model.contact_count] = found;
                    model.contact_count += 1;
                } else if let Some(least) = model
                    .contacts
                    .iter_mut()
                    .min_by(|a, b| pressed(a).total_cmp(&pressed(b)))
                    .filter(|least| pressed(least) < pressed(&found))
                {
                    *least = found;
                }
            }
        }
    }
}

/// The cone of wrenches that the contacts of a model can exert on a tool; `None` if they hold it from both sides.
fn cone_of(model: &WrenchModel, position: DVec3, lever: f64) -> Option<Cone> {
    let force = along(&model.wrench);
    let contacts = || model.contacts[..model.contact_count].iter();
    let pressed: f64 = contacts().map(|contact| f64::from(contact.force.length())).sum();
    let mean: Vec3 = contacts().map(|contact| contact.force).sum();
    if pressed > OPPOSED * f64::from(mean.length()) {
        return None;
    }
    let axis = force.try_normalize().or(mean.as_dvec3().try_normalize())?;
    let tangent_of = |force: DVec3| {
        let along = force.dot(axis);
        (force - axis * along).length() / along.max(1e-3 * force.length()).max(f64::MIN_POSITIVE)
    };
    let (mut max_tangent, mut max_torque_ratio) = (MIN_INCLINATION, MIN_INCLINATION);
    for contact in contacts() {
        max_tangent = max_tangent.max(CONE_MARGIN * tangent_of(contact.force.as_dvec3()).min(OPPOSED));
        max_torque_ratio = max_torque_ratio.max(CONE_MARGIN * (contact.point.as_dvec3() - position).length() / lever);
    }
    // The current wrench must be possible.
    max_torque_ratio =
        max_torque_ratio.max(CONE_MARGIN * about(&model.wrench).length() / force.length().max(f64::MIN_POSITIVE));
    Some(Cone {
        axis,
        max_tangent,
        max_torque_ratio,
    })
}

/// Half of a tool's length, m: the lever arm that turns torques into forces.
fn lever_of(form: &ToolShape) -> f64 {
    match form {
        ToolShape::Rounded { radius, half_length } => f64::from(*radius) + f64::from(*half_length),
        ToolShape::HalfSpace => LEVER_OF_PLANE,
        ToolShape::Mesh(solid) => f64::from(solid.reach()),
    }
}

fn orientation_of(pose: Pose) -> DQuat {
    pose.orientation.as_dquat().normalize()
}
