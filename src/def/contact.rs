//! What meets what, and what a body asks of contact.

use crate::base::{Error, Result, StateHasher, ensure, not_negative};
use crate::codec::{saved, saved_enum};
use crate::mesh::FURTHEST;

/// How a tool finds what it touches.
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
    /// Virtual rays cast through a depth buffer (CInDeR; Halic et al., section 2.1).
    ImageSpace,
    /// A sampled signed distance; for meshes alone.
    DistanceField,
}

saved_enum!(Detection { 0 => Exact, 1 => ImageSpace, 2 => DistanceField });

/// Which tools and bodies meet: two do where each has a category that the other's mask has.
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
    /// The categories that it belongs to, a bit for each.
    pub category: u32,
    /// The categories that it meets, a bit for each.
    pub mask: u32,
}

saved! { CollisionFilter { category, mask } }

impl Default for CollisionFilter {
    fn default() -> Self {
        Self::ALL
    }
}

impl CollisionFilter {
    /// Of the first category; meets all.
    pub const ALL: Self = Self {
        category: 1,
        mask: u32::MAX,
    };

    pub(crate) fn hash(self, hasher: &mut StateHasher) {
        for bits in [self.category, self.mask] {
            hasher.write_u64(u64::from(bits));
        }
    }

    /// Whether both meet each other.
    pub(crate) fn meets(self, other: Self) -> bool {
        self.category & other.mask != 0 && other.category & self.mask != 0
    }
}

/// What a body asks of contact.
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
    /// What tools and other tissue keep off its surface, m, 0 to 1e9: the thickness of a cloth on either side.
    pub thickness: f32,
    /// The Coulomb coefficient of friction with other tissue and with itself, at least 0; of two bodies that meet, the larger holds. A
    /// tool's own holds with tools.
    pub friction: f32,
    /// Whether it meets other bodies that want it too.
    pub with_bodies: bool,
    /// Whether it meets itself.
    ///
    /// The two sides of a cut meet from then on, at no distance: they part freely, and where they are pressed together again they rest against each
    /// other as before the cut, whatever the thickness. A solid's sides are told by their faces. The rims of a sheet lie in one place, and may slide
    /// over each other until they have parted by a ten-thousandth of a short edge.
    pub with_itself: bool,
    /// How it and other bodies find each other: [`Detection::Exact`], or [`Detection::ImageSpace`], which one of two has to ask for; itself
    /// it always meets exactly. [`Detection::DistanceField`] is for rigid tools and refused.
    ///
    /// In image space both are drawn in each substep along three axes where their boxes overlap; the triangles of one that are seen
    /// within the thicknesses of the other's nodes and edges, over the way that they go, are compared exactly, so that a pixel does not
    /// show in where bodies come to rest. Each triangle is seen by one ray at least; of one that is many pixels long and thinner than a pixel
    /// the ends may not be. (Halic et al., section 2.1; Shade et al. 1998.)
    pub detection: Detection,
    /// [`Detection::ImageSpace`]: the side of a pixel, m, at least 0; 0: half of the surface's mean edge. An image of a body has
    /// at most 2^24 pixels, else it is refused. A body that grows to twice its size may be drawn in pixels twice as large.
    pub resolution: f32,
    /// Which tools and bodies it meets.
    pub filter: CollisionFilter,
}

saved! { BodyContact { thickness, friction, with_bodies, with_itself, detection, resolution, filter } }

impl Default for BodyContact {
    fn default() -> Self {
        Self::NOTHING
    }
}

impl BodyContact {
    /// It meets tools alone, and nothing keeps off its surface.
    pub const NOTHING: Self = Self {
        thickness: 0.0,
        friction: 0.0,
        with_bodies: false,
        with_itself: false,
        detection: Detection::Exact,
        resolution: 0.0,
        filter: CollisionFilter::ALL,
    };

    /// Adds the bits that the next step depends on.
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

/// Refuses a length with which squares of distances would not stay finite.
pub(crate) fn check_reach(name: &str, value: f32) -> Result<()> {
    ensure!(value <= FURTHEST, "{name} is {value}: must be at most {FURTHEST:e} m");
    Ok(())
}
