//! Sutures: threads between two points, which pull only.

use super::World;
use super::attachments::{Which, check_limit, refuse_one_point};
use crate::base::{AttachmentId, BodyId, Error, Result, ensure};
use crate::def::Anchor;
use crate::deformable_contact::{Thread, distance};

/// What a suture is like.
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
    /// How long the thread is between its points while nothing pulls, m, at least 0; `None`: as long as they are apart.
    pub length: Option<f32>,
    /// By what force it is longer, N/m, above 0; infinite, the default: it does not stretch.
    pub stiffness: f32,
    /// The force at which it is pulled through the tissue, N, at least 0; 0, the default, or infinite: it holds whatever comes.
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

/// How a suture is now.
///
/// ```
/// # use glam::{Quat, Vec3};
#[doc = include_str!("../doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition { gravity: Vec3::ZERO, ..WorldDefinition::default() })?;
/// # let [left, right] = [0, 1].map(|_| world.create_body(&cloth));
/// # let (left, right) = (left?, right?);
/// # world.body_mut(right)?.transform(0.11 * Vec3::X, Quat::IDENTITY, None)?;
/// # let suture = world.suture(left, &Anchor::Node(4), right, &Anchor::Node(0), &SutureDefinition::default())?;
/// // The points are 1 cm apart, and the thread is just as long.
/// let report = world.suture_report(suture)?;
/// assert!((report.distance - 0.01).abs() < 1e-6);
/// assert_eq!(report.length, report.distance);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SutureReport {
    /// How long its thread is while nothing pulls, m.
    pub length: f32,
    /// How far apart its points are, m: further than that where it pulls.
    pub distance: f32,
    /// What the thread stores, J; 0 where it does not stretch. That of bodies is without it.
    pub energy: f64,
}

impl World {
    /// Sutures a point of a body to one of another, or of the same: a thread between them, which pulls them together where they are further apart
    /// than it is long, and never pushes. Each may turn about its point as it likes. What the thread joins still touches.
    ///
    /// It is one of the attachments: [`World::release`] cuts it, [`World::attachment_force`] has the force on `body`, and one that is
    /// pulled through the tissue is among those that have [slipped](World::slipped): with the step in which its mean force was larger than
    /// [`SutureDefinition::force_limit`]. It ends with either body. The bodies take their substeps together, as with
    /// [`World::attach_to_body`]; no stiffness makes them shorter.
    ///
    /// A thread that is to be shorter than its points are apart is drawn in as with [`World::set_suture_length`]. No momentum is made; nor
    /// is any angular momentum, unless points of a thread of next to no length pass each other. Nor is energy, but by drawing it in; what takes
    /// up a thread that becomes taut within a substep is lost, as is some of what sways along a stiff one.
    ///
    /// A compliant constraint by implicit Euler steps (Macklin, Müller, Chentanez 2016) along the thread.
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::InvalidArgument`]: there is no such node or triangle, weights are negative, not finite or not 1 in sum,
    /// the two are one point, or a number of the definition is out of its range. [`Error::OutOfMemory`]. Nothing is sutured then.
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
        let apart = distance(&self.bodies, &pair);
        let target = length.map_or(apart, f64::from);
        let thread = Thread::new(apart.max(target), target, 1.0 / f64::from(stiffness));
        let ids = self.bind([body, other], &[pair], force_limit, Some(thread))?;
        Ok(ids[0])
    }

    /// Tightens a suture, or gives it slack: its thread becomes so long, m, at least 0, evenly over the next step; where it is to become
    /// shorter no faster than by 0.25 m/s, over as many steps as that takes.
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::InvalidArgument`]: it is no suture, or `length` is out of its range.
    pub fn set_suture_length(&mut self, suture: AttachmentId, length: f32) -> Result<()> {
        self.attachments.get(suture.0)?;
        check_length(length)?;
        let thread = self.bonds_mut().and_then(|bonds| bonds.thread_mut(suture.0));
        thread.ok_or_else(no_suture)?.target = f64::from(length);
        Ok(())
    }

    /// How a suture is now.
    ///
    /// # Errors
    /// [`Error::StaleId`]. [`Error::InvalidArgument`]: it is no suture.
    pub fn suture_report(&self, suture: AttachmentId) -> Result<SutureReport> {
        self.attachments.get(suture.0)?;
        let bonds = self.tissue.as_ref().map(|tissue| &tissue.bonds);
        let found = bonds.and_then(|bonds| bonds.thread(&self.bodies, suture.0));
        let (thread, distance) = found.ok_or_else(no_suture)?;
        Ok(SutureReport {
            length: thread.length as f32,
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
