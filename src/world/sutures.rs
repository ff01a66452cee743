//! Sutures: threads that pull two points together and never push.

use super::World;
use super::attachments::{Which, check_limit, refuse_one_point};
use crate::base::{AttachmentId, BodyId, Error, Result, ensure};
use crate::def::Anchor;
use crate::deformable_contact::{SutureThread, distance};

/// The definition of a suture.
///
/// ```
/// # use glam::{Quat, Vec3};
#[doc = include_str!("../doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition { gravity: Vec3::ZERO, ..WorldDefinition::default() })?;
/// # let [left, right] = [0, 1].map(|_| world.create_body(&cloth));
/// # let (left, right) = (left?, right?);
/// # world.body_mut(right)?.transform(0.11 * Vec3::X, Quat::IDENTITY, None)?;
/// let definition = SutureDefinition { length: Some(0.002), ..SutureDefinition::default() };
/// let suture = world.suture(left, &Anchor::Node(4), right, &Anchor::Node(0), &definition)?;
/// for _ in 0..30 {
///     world.step(1.0 / 60.0)?;
/// }
/// assert!(world.suture_report(suture)?.distance < 0.0021);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SutureDefinition {
    /// The rest length of the thread, m, at least 0; `None` for the distance between its points.
    pub length: Option<f32>,
    /// The stiffness of the thread, N/m, above 0. With the default, infinity, it does not stretch.
    pub stiffness: f32,
    /// The force at which the suture breaks out of the tissue, N, at least 0. With 0, the default, or infinity it never
    /// breaks.
    pub force_limit: f32,
}

impl Default for SutureDefinition {
    fn default() -> Self {
        Self {
            length: None,
            stiffness: f32::INFINITY,
            force_limit: 0.0,
        }
    }
}

/// The current state of a suture.
///
/// ```
/// # use glam::{Quat, Vec3};
#[doc = include_str!("../doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition { gravity: Vec3::ZERO, ..WorldDefinition::default() })?;
/// # let [left, right] = [0, 1].map(|_| world.create_body(&cloth));
/// # let (left, right) = (left?, right?);
/// # world.body_mut(right)?.transform(0.11 * Vec3::X, Quat::IDENTITY, None)?;
/// # let suture = world.suture(left, &Anchor::Node(4), right, &Anchor::Node(0), &SutureDefinition::default())?;
/// // The points are 1 cm separation, and the thread is just as long.
/// let report = world.suture_report(suture)?;
/// assert!((report.distance - 0.01).abs() < 1e-6);
/// assert_eq!(report.length, report.distance);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SutureReport {
    /// The rest length of the thread, m.
    pub length: f32,
    /// The distance between its points, m. The suture pulls if this exceeds `length`.
    pub distance: f32,
    /// The elastic energy of the thread, J; 0 if it cannot stretch. The energy of bodies does not include it.
    pub energy: f64,
}

impl World {
    /// Creates a suture between a point of a body and a point of another body, or of the same one. The thread pulls the
    /// points together while their distance exceeds its length, and never pushes. Each body can rotate about its point.
    /// The joined surfaces still collide.
    ///
    /// A suture is an attachment: [`World::release`] cuts it, and [`World::attachment_force`] returns the force on
    /// `body`. It breaks in a step whose mean force exceeds [`SutureDefinition::force_limit`], and is then listed by
    /// [`World::slipped`]. Destroying either body destroys it. The bodies take their substeps together, as with
    /// [`World::attach_to_body`]; the stiffness does not shorten them.
    ///
    /// A thread shorter than the distance of its points is drawn in as by [`World::set_suture_length`]. Momentum is
    /// conserved. So is angular momentum, unless the points of a very short thread pass each other. Energy grows only
    /// by drawing a thread in. A thread that becomes taut within a substep dissipates energy, and so do oscillations
    /// along a stiff thread.
    ///
    /// The method is a compliant constraint along the thread, by implicit Euler steps (Macklin, Müller, Chentanez
    /// 2016).
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::InvalidArgument`]: a node or triangle does not exist, weights are negative, not
    /// finite or do not sum to 1, the two points are the same, or a number of the definition is out of range.
    /// [`Error::OutOfMemory`]. After an error there is no suture.
    pub fn suture(
        &mut self,
        body: BodyId,
        anchor: &Anchor,
        other: BodyId,
        other_anchor: &Anchor,
        definition: &SutureDefinition,
    ) -> Result<AttachmentId> {
        self.bodies.get(body.0)?;
        self.bodies.get(other.0)?;
        let SutureDefinition {
            length,
            stiffness,
            force_limit,
        } = *definition;
        length.map_or(Ok(()), check_length)?;
        ensure!(stiffness > 0.0, "stiffness is {stiffness}: must be above 0");
        check_limit(force_limit)?;
        let [own, others] = ["", "other_"].map(|prefix| Which { prefix, index: None });
        let pair = [self.bound(body, own, anchor)?, self.bound(other, others, other_anchor)?];
        refuse_one_point(&pair, [own, others])?;
        let separation = distance(&self.bodies, &pair);
        let target = length.map_or(separation, f64::from);
        let thread = SutureThread::new(separation.max(target), target, 1.0 / f64::from(stiffness));
        let ids = self.bind([body, other], &[pair], force_limit, Some(thread))?;
        Ok(ids[0])
    }

    /// Tightens or loosens a suture: its rest length becomes `length`, m, at least 0, uniformly over the next step. It
    /// shortens by 0.25 m/s at most, over several steps if necessary.
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::InvalidArgument`]: the attachment is not a suture, or `length` is out of range.
    pub fn set_suture_length(&mut self, suture: AttachmentId, length: f32) -> Result<()> {
        self.attachments.get(suture.0)?;
        check_length(length)?;
        let thread = self
            .point_attachments_mut()
            .and_then(|point_attachments| point_attachments.thread_mut(suture.0));
        thread.ok_or_else(no_suture)?.target_length = f64::from(length);
        Ok(())
    }

    /// The current state of a suture.
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::InvalidArgument`]: the attachment is not a suture.
    pub fn suture_report(&self, suture: AttachmentId) -> Result<SutureReport> {
        self.attachments.get(suture.0)?;
        let point_attachments = self
            .deformable_contact
            .as_ref()
            .map(|deformable_contact| &deformable_contact.attachments);
        let found = point_attachments.and_then(|point_attachments| point_attachments.thread(&self.bodies, suture.0));
        let (thread, distance) = found.ok_or_else(no_suture)?;
        Ok(SutureReport {
            length: thread.rest_length as f32,
            distance: distance.min(f64::from(f32::MAX)) as f32,
            energy: thread.energy(distance),
        })
    }
}

fn check_length(length: f32) -> Result<()> {
    ensure!(
        length >= 0.0 && length.is_finite(),
        "length is {length}: must be at least 0 and finite"
    );
    Ok(())
}

fn no_suture() -> Error {
    Error::invalid("suture is an attachment of another kind")
}
