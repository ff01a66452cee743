//! The world's side of haptic handles: where their proxies lead tools, and the models that steps leave them.

use glam::{DQuat, DVec3, Vec3};

use super::World;
use crate::base::{BodyId, Error, Result, ToolId};
use crate::contact::{Form, Pose};
use crate::geometry::rotation;
use crate::haptics::{
    Cone, Coupling, HapticContact, HapticDefinition, HapticHandle, MOST_CONTACTS, Secant, Sent, Vector6, WrenchModel,
    ZERO, about, along, difference, inverse, joined, product, scaled, spread, sum,
};
use crate::sync::triple_buffer::{BufferReader, BufferWriter, triple_buffer};

/// What nobody feels, N.
const UNFELT: f64 = 1e-3;

/// What was touched is touched again, in so far.
const SURE_TO_MEET: f64 = 0.95;

/// Of what the model did not foretell of what a tool holds so much is taken over at a time: tissue that swings with it answers late.
const MOST_HELD: f64 = 0.5;

/// The lever of a plane, m.
const LEVER_OF_PLANE: f64 = 0.1;

/// Contacts that press against each other with so many times what is left of them hold a tool from both sides.
const HELD_BETWEEN: f64 = 3.0;

/// A force may lean so much further from the mean than any contact did, and a torque be so much larger.
const ROOMY: f64 = 1.2;

/// The least that a force may lean, as a tangent, and the least torque beside it, at the lever.
const LEAST_LEAN: f64 = 0.3;

/// A haptic handle as the world has it.
#[derive(Debug)]
pub(super) struct HapticLink {
    tool: ToolId,
    coupling: Coupling,
    poses: BufferReader<Sent>,
    models: BufferWriter<WrenchModel>,
    secant: Secant,
    /// What the tool felt where, as it is told.
    felt: Vector6,
    middle: (DVec3, DQuat),
    /// Of the nodes that it touches, kg.
    mass: f64,
    /// Where the tool was when the step began.
    before: Pose,
    /// What it did to tissue, J.
    work: f64,
    version: u64,
}

impl HapticLink {
    /// Takes over what a tool felt in the middle of its way, N, of nodes whose mass, by the square of the step, is so many N/m. What that is more than the
    /// coupling is felt as a jolt when the tool changes its speed, and a proxy without mass would rebound from it: of what the model did not foretell
    /// only so much is taken over at a time that it does not, and `most` of all.
    fn take_over(&mut self, middle: (DVec3, DQuat), wrench: &Vector6, (inertia, most): (f64, f64)) -> Vector6 {
        let turned = rotation::turn_between(self.middle.1, middle.1) * self.coupling.lever;
        let way = joined(middle.0 - self.middle.0, turned);
        let foretold = difference(&self.felt, &product(self.secant.stiffness(), &way));
        let part = (1.5 / (1.0 + 4.0 * inertia / self.coupling.stiffness[0])).min(most);
        let new = difference(wrench, &foretold);
        self.felt = sum(&foretold, &scaled(&new, part));
        self.middle = middle;
        if *wrench == ZERO && (part == 1.0 || self.felt.iter().all(|part| part.abs() < UNFELT)) {
            self.felt = ZERO;
        }
        self.felt
    }
}

impl World {
    /// Lets a device lead a tool through a handle, which is for the device's own thread. The tool should be where the device is: the first step leads it
    /// there. As long as there is the handle, [`World::set_pose`] of the tool is
    /// refused: each step leads it to where the handle's proxy was last, as [`World::tool_target`] tells. Each step costs the handle some microseconds.
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::InvalidArgument`]: something in the definition is out of its range, another handle leads the tool, or it is
    /// dynamic.
    /// [`Error::OutOfMemory`].
    pub fn create_haptic(&mut self, definition: &HapticDefinition) -> Result<HapticHandle> {
        self.check_kinematic(definition.tool)?;
        let tool = self.tools.get(definition.tool.0)?;
        let pose = tool.pose;
        let coupling = definition.coupling(lever_of(&tool.form))?;
        self.haptics.retain(|link| !link.poses.is_alone());
        self.check_not_led(definition.tool)?;
        self.haptics.try_reserve(1)?;
        let spring = spread(coupling.stiffness);
        let free = WrenchModel::free(pose.position.as_dvec3(), exact(pose), &spring);
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
            felt: ZERO,
            middle: (pose.position.as_dvec3(), exact(pose)),
            mass: 0.0,
            before: pose,
            work: 0.0,
            version: 0,
        });
        Ok(HapticHandle::new(coupling, seen, to_send))
    }

    /// Refuses a tool that a haptic handle leads.
    pub(super) fn check_not_led(&self, tool: ToolId) -> Result<()> {
        let leads = |link: &HapticLink| link.tool == tool && !link.poses.is_alone();
        if self.haptics.iter().any(leads) {
            return Err(Error::invalid(format!("tool is {}: a haptic handle leads it", tool.0)));
        }
        Ok(())
    }

    /// A tool that a handle leads, if any is led.
    pub(super) fn led_by_hand(&self) -> Option<ToolId> {
        let link = self.haptics.iter().find(|link| !link.poses.is_alone())?;
        Some(link.tool)
    }

    /// A tool is gone.
    pub(super) fn leave_haptics(&mut self, tool: ToolId) {
        self.haptics.retain(|link| link.tool != tool);
    }

    /// Sends tools where their handles' proxies are.
    pub(super) fn lead_by_hand(&mut self) {
        for link in &mut self.haptics {
            let Ok(tool) = self.tools.get_mut(link.tool.0) else {
                continue;
            };
            link.before = tool.pose;
            // What a handle that is gone has sent last is nobody's will.
            if !link.poses.is_alone() && link.poses.take() {
                // What a handle has checked is a pose.
                tool.target = link.poses.read(|sent| sent.pose).checked().ok().or(tool.target);
            }
        }
    }

    /// Whether a handle leads the tool at this place.
    pub(super) fn is_in_hand(&self, place: usize) -> bool {
        let mut leading = self.haptics.iter().filter(|link| !link.poses.is_alone());
        leading.any(|link| self.tools.place(link.tool.0).is_ok_and(|of_hand| of_hand == place))
    }

    /// Leaves each handle a model of what its tool has met in the step of `dt` seconds.
    pub(super) fn publish_to_hands(&mut self, dt: f32) {
        let mut haptics = std::mem::take(&mut self.haptics);
        for link in haptics.iter_mut().filter(|link| !link.poses.is_alone()) {
            self.publish_to(link, f64::from(dt));
        }
        self.haptics = haptics;
    }

    fn publish_to(&self, link: &mut HapticLink, dt: f64) {
        let (Ok(tool), Ok(place)) = (self.tools.get(link.tool.0), self.tools.place(link.tool.0)) else {
            return;
        };
        let HapticLink { coupling, before, .. } = *link;
        let lever = coupling.lever;
        let (start, end) = (before.position.as_dvec3(), tool.pose.position.as_dvec3());
        let turn = rotation::turn_between(exact(before), exact(tool.pose));
        let wrench = joined(tool.force.as_dvec3(), tool.torque.as_dvec3() / lever);
        let way = joined(end - start, turn * lever);
        link.work -= wrench.iter().zip(way).map(|(part, way)| part * way).sum::<f64>();
        // A mean wrench stands for the middle of the step.
        let middle = (0.5 * (start + end), rotation::turned(exact(before), 0.5 * turn));
        // What bounces is met again.
        link.mass = self.mass_under(place).max(SURE_TO_MEET * link.mass);
        let holds = self.is_holding(place);
        let most = if holds { MOST_HELD } else { 1.0 };
        let felt = link.take_over(middle, &wrench, (link.mass / (dt * dt), most));
        link.secant
            .learn(middle, &wrench, dt, lever, (coupling.stiffness[0], holds));
        link.version += 1;
        let (version, work) = (link.version, link.work);
        let (sent_at, sent_work) = link.poses.read(|sent| (sent.time, sent.work));
        let stiffness = *link.secant.stiffness();
        let spring = spread(coupling.stiffness);
        link.models.write(|model| {
            model.version = version;
            (model.position, model.orientation) = middle;
            model.wrench = felt;
            model.stiffness = stiffness;
            let mut both = stiffness;
            (0..6).for_each(|k| both[k][k] += spring[k]);
            model.answer = inverse(&both);
            self.gather_contacts(place, model);
            model.work = work;
            (model.sent_at, model.sent_work) = (sent_at, sent_work);
            model.cone = cone_of(model, end, lever).filter(|_| !holds);
        });
    }

    /// The mass of the nodes under the tool at this place, kg.
    fn mass_under(&self, place: usize) -> f64 {
        let bodies = self.bodies.iter_ids();
        let masses = bodies.flat_map(|(id, body)| {
            let contacts = body.contacts_with(place, BodyId(id));
            contacts.map(|contact| body.mass_at(&contact))
        });
        masses.sum()
    }

    /// Whether the tool at this place holds something.
    pub(super) fn is_holding(&self, place: usize) -> bool {
        self.bodies.iter().any(|(_, body)| body.system().is_held_by(place))
    }

    /// Takes over the most pressed contacts of the tool at this place.
    fn gather_contacts(&self, place: usize, model: &mut WrenchModel) {
        model.contact_count = 0;
        for (id, body) in self.bodies.iter_ids() {
            for contact in body.contacts_with(place, BodyId(id)) {
                let found = HapticContact {
                    body: contact.body,
                    point: contact.point,
                    normal: contact.normal,
                    velocity: body.velocity_at(&contact),
                    force: contact.force,
                };
                let pressed = |contact: &HapticContact| contact.force.length_squared();
                if model.contact_count < MOST_CONTACTS {
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

/// The wrenches that the contacts of a model can make about a tool's position; `None`: any, where they hold it from all sides.
fn cone_of(model: &WrenchModel, position: DVec3, lever: f64) -> Option<Cone> {
    let force = along(&model.wrench);
    let contacts = || model.contacts[..model.contact_count].iter();
    let pressed: f64 = contacts().map(|contact| f64::from(contact.force.length())).sum();
    let mean: Vec3 = contacts().map(|contact| contact.force).sum();
    if pressed > HELD_BETWEEN * f64::from(mean.length()) {
        return None;
    }
    let axis = force.try_normalize().or(mean.as_dvec3().try_normalize())?;
    let lean_of = |force: DVec3| {
        let along = force.dot(axis);
        (force - axis * along).length() / along.max(1e-3 * force.length()).max(f64::MIN_POSITIVE)
    };
    let (mut lean, mut arm) = (LEAST_LEAN, LEAST_LEAN);
    for contact in contacts() {
        lean = lean.max(ROOMY * lean_of(contact.force.as_dvec3()).min(HELD_BETWEEN));
        arm = arm.max(ROOMY * (contact.point.as_dvec3() - position).length() / lever);
    }
    // What is felt now is possible.
    arm = arm.max(ROOMY * about(&model.wrench).length() / force.length().max(f64::MIN_POSITIVE));
    Some(Cone { axis, lean, arm })
}

/// Half of a tool's length, m.
fn lever_of(form: &Form) -> f64 {
    match form {
        Form::Rounded { radius, half_length } => f64::from(*radius) + f64::from(*half_length),
        Form::HalfSpace => LEVER_OF_PLANE,
        Form::Mesh(solid) => f64::from(solid.reach()),
    }
}

fn exact(pose: Pose) -> DQuat {
    pose.orientation.as_dquat().normalize()
}
