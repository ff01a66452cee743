//! Contact settings of bodies, collision filters and detection methods.

use crate::base::{Error, Result, StateHasher, ensure, not_negative};
use crate::codec::{saved, saved_enum};
use crate::mesh::MAX_COORDINATE;

/// The contact detection method of a tool.
///
/// ```
/// # use glam::Vec3;
#[doc = include_str!("../doctest/block.txt")]
/// # let mut world = World::new(WorldDefinition { gravity: Vec3::ZERO, ..WorldDefinition::default() })?;
/// # world.create_body(&block)?;
/// # let (positions, triangles) = (&mesh.positions[..], &mesh.surface()?[..]);
/// let mut press = ToolDefinition::new(Shape::Mesh { positions, triangles });
/// press.detection = Detection::DistanceField;
/// press.pose.position = 0.04 * Vec3::Y;
/// let press = world.create_tool(&press)?;
/// world.set_pose(press, 0.039 * Vec3::Y, None)?;
/// world.step(1.0 / 60.0)?;
/// assert!(world.wrench(press)?.0.y > 0.0);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Detection {
    /// Exact distances, swept over the step.
    #[default]
    Exact,
    /// Virtual rays through a depth buffer (CInDeR; Halic et al., section 2.1).
    ImageSpace,
    /// A sampled signed distance field; for meshes only.
    DistanceField,
}

saved_enum!(Detection { 0 => Exact, 1 => ImageSpace, 2 => DistanceField });

/// The categories of tools and bodies that collide. Two objects collide if each has a category that is in the other's
/// mask.
///
/// ```
/// # use glam::Vec3;
#[doc = include_str!("../doctest/block.txt")]
/// # let mut world = World::new(WorldDefinition { gravity: Vec3::ZERO, ..WorldDefinition::default() })?;
/// # world.create_body(&block)?;
/// # let mut ball = ToolDefinition::new(Shape::Sphere { radius: 0.01 });
/// # ball.pose.position = 0.03 * Vec3::Y;
/// # let ball = world.create_tool(&ball)?;
/// // Bodies are of category 1 unless their definition says otherwise.
/// world.set_collision_filter(ball, CollisionFilter { category: 1, mask: 2 })?;
/// world.set_pose(ball, 0.025 * Vec3::Y, None)?;
/// world.step(1.0 / 60.0)?;
/// assert_eq!(world.contacts(ball)?.count(), 0);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CollisionFilter {
    /// The categories of the object, one bit each.
    pub category: u32,
    /// The categories that the object collides with, one bit each.
    pub mask: u32,
}

saved! { CollisionFilter { category, mask } }

impl Default for CollisionFilter {
    fn default() -> Self {
        Self::ALL
    }
}

impl CollisionFilter {
    /// The first category, colliding with all.
    pub const ALL: Self = Self {
        category: 1,
        mask: u32::MAX,
    };

    pub(crate) fn hash(self, hasher: &mut StateHasher) {
        for bits in [self.category, self.mask] {
            hasher.write_u64(u64::from(bits));
        }
    }

    /// True if both filters accept each other.
    pub(crate) fn meets(self, other: Self) -> bool {
        self.category & other.mask != 0 && other.category & self.mask != 0
    }
}

/// The contact settings of a body.
///
/// ```
/// # use glam::{Quat, Vec3, vec3};
#[doc = include_str!("../doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition::default())?;
/// let contact = BodyContact { thickness: 0.001, friction: 0.4, with_bodies: true, ..BodyContact::default() };
/// let body = world.create_body(&BodyDefinition { contact, ..cloth })?;
/// # let other = world.create_body(&BodyDefinition { contact, ..cloth })?;
/// # world.body_mut(body)?.transform(0.004 * Vec3::Y, Quat::IDENTITY, None)?;
/// # world.body_mut(other)?.pin_box(vec3(-1.0, -1.0, -1.0), vec3(1.0, 1.0, 1.0))?;
/// for _ in 0..30 {
///     world.step(1.0 / 60.0)?;
/// }
/// // It lies on another cloth at y = 0, two thicknesses above it.
/// assert!((world.body(body)?.positions()[12].y - 0.002).abs() < 1e-4);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyContact {
    /// The distance that tools and other tissue keep from the surface (m), from 0 to 1e9: the thickness of a cloth on
    /// either side.
    pub thickness: f32,
    /// The Coulomb friction coefficient with other tissue and with itself, at least 0. Between two bodies the larger
    /// value applies. Contact with a tool uses the tool's coefficient.
    pub friction: f32,
    /// True if the body collides with other bodies that have this setting too.
    pub with_bodies: bool,
    /// True if the body collides with itself.
    ///
    /// The two sides of a cut then collide at distance 0, whatever the thickness. They separate freely, and if pressed
    /// together they rest against each other as before the cut. Faces tell the two sides of a solid apart. The
    /// cut-boundary edges of a sheet coincide, and may slide over each other until they are a ten-thousandth of a short
    /// edge apart.
    pub with_itself: bool,
    /// The contact detection with other bodies: [`Detection::Exact`], or [`Detection::ImageSpace`] if at least one of
    /// two bodies sets it. Self-contact is always exact. [`Detection::DistanceField`] is for rigid tools and is
    /// refused.
    ///
    /// In image space both bodies are rendered in each substep along three axes where their boxes overlap. Triangles of
    /// one body within the thickness of the other's swept nodes and edges are then tested exactly, so resting positions
    /// do not depend on the pixel size. Each triangle is hit by at least one ray. The ends of a triangle that is many
    /// pixels long and thinner than a pixel may be missed. (Halic et al., section 2.1; Shade et al. 1998.)
    pub detection: Detection,
    /// The pixel size of [`Detection::ImageSpace`] (m), at least 0. 0: half of the surface's mean edge length. An image
    /// of a body may have at most 2^24 pixels, otherwise the body is refused. A body that grows to twice its size may
    /// be rendered with pixels of twice the size.
    pub resolution: f32,
    /// The collision filter for tools and bodies.
    pub filter: CollisionFilter,
}

saved! { BodyContact { thickness, friction, with_bodies, with_itself, detection, resolution, filter } }

impl Default for BodyContact {
    fn default() -> Self {
        Self::NOTHING
    }
}

impl BodyContact {
    /// Collides with tools only, without thickness.
    pub const NOTHING: Self = Self {
        thickness: 0.0,
        friction: 0.0,
        with_bodies: false,
        with_itself: false,
        detection: Detection::Exact,
        resolution: 0.0,
        filter: CollisionFilter::ALL,
    };

    /// Hashes the settings that the next step depends on.
    pub(crate) fn hash(&self, hasher: &mut StateHasher) {
        hasher.write_floats(&[self.thickness, self.friction, self.resolution]);
        for choice in [self.with_bodies as u64, self.with_itself as u64, self.detection as u64] {
            hasher.write_u64(choice);
        }
        self.filter.hash(hasher);
    }

    pub(crate) fn check(&self) -> Result<()> {
        not_negative("contact_thickness", self.thickness)?;
        check_reach("contact_thickness", self.thickness)?;
        not_negative("contact_friction", self.friction)?;
        not_negative("contact_resolution", self.resolution)?;
        ensure!(
            self.detection != Detection::DistanceField,
            Error::Unsupported(
                "contact_detection is DistanceField: a distance that is sampled once is for rigid tools, tissue changes its shape".into(),
            )
        );
        Ok(())
    }
}

/// Returns an error for a length with which squared distances could overflow.
pub(crate) fn check_reach(name: &str, value: f32) -> Result<()> {
    ensure!(
        value <= MAX_COORDINATE,
        "{name} is {value}: must be at most {MAX_COORDINATE:e} m"
    );
    Ok(())
}
