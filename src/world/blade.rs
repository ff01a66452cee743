//! A blade: an edge that the caller moves, with one proxy in each body that it cuts.

use glam::{DVec3, Vec3};

use super::blade_resistance::Knot;
use crate::base::{BodyId, Error, Result, SlotId, StateHasher, above_zero, ensure, memory};
use crate::body::{BladeStroke, CutReport};
use crate::codec::saved;
use crate::contact::Pose;
use crate::cutting::BladeContact;
use crate::def::{CollisionFilter, finite_vector};
use crate::deformable_contact::LinearPath;
use crate::geometry::rotation::{rotated, rotation_between};
use crate::mesh::MAX_COORDINATE;

/// The most points at which tissue holds a proxy. A blade through more layers of a body is held at some of them.
pub(super) const MAX_HOLDS: usize = 8;

/// The number of triangles near a blade for which room is reserved at creation.
const ROOM: usize = 256;

/// Points closer together than this fraction of the edge do not determine its rotation.
const SPREAD: f64 = 0.05;

/// A step in which a blade turns by more than this angle is divided, rad.
const MAX_ROTATION: f64 = 0.5;

/// The definition of a blade. Plain data, used only during [`World::create_blade`](crate::World::create_blade).
///
/// ```
/// # use glam::{Vec3, vec3};
#[doc = include_str!("../doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition { gravity: Vec3::ZERO, ..WorldDefinition::default() })?;
/// # let sheet = world.create_body(&BodyDefinition { spare_nodes: 200, ..cloth })?;
/// let mut blade = BladeDefinition::new([0.01 * Vec3::NEG_Y, 0.01 * Vec3::Y]);
/// blade.pose.position = vec3(0.003, 0.0, -0.06);
/// let blade = world.create_blade(&blade)?;
/// world.set_blade_pose(blade, vec3(0.003, 0.0, 0.06), None)?;
/// world.step(1.0 / 60.0)?;
/// assert_eq!(world.body(sheet)?.pieces()?.count, 2);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BladeDefinition {
    /// Both ends of the cutting edge, relative to the blade's origin, m. Each coordinate is within 1e9 of 0, and the
    /// ends differ.
    pub edge: [Vec3; 2],
    /// The stiffness of the coupling between the blade and its proxy in each body, N/m; above 0 and finite. Before
    /// cutting, tissue of toughness T deforms by about T / `stiffness`: a lower value is a blunter blade.
    pub stiffness: f32,
    /// Which bodies the blade cuts.
    pub filter: CollisionFilter,
    /// The initial pose.
    pub pose: Pose,
}

impl BladeDefinition {
    /// A blade with this edge at the origin and a stiffness of 1000 N/m that cuts all bodies.
    pub fn new(edge: [Vec3; 2]) -> Self {
        Self {
            edge,
            stiffness: 1000.0,
            filter: CollisionFilter::default(),
            pose: Pose::IDENTITY,
        }
    }
}

/// The cuts of a blade in the last step, and the force on it.
///
/// ```
/// # use glam::{Vec3, vec3};
#[doc = include_str!("../doctest/cloth.txt")]
/// # let mut world = World::new(WorldDefinition { gravity: Vec3::ZERO, ..WorldDefinition::default() })?;
/// # world.create_body(&BodyDefinition { spare_nodes: 200, ..cloth })?;
/// # let mut blade = BladeDefinition::new([0.01 * Vec3::NEG_Y, 0.01 * Vec3::Y]);
/// # blade.pose.position = vec3(0.003, 0.0, -0.06);
/// # let blade = world.create_blade(&blade)?;
/// world.set_blade_pose(blade, vec3(0.003, 0.0, 0.0), None)?;
/// world.step(1.0 / 60.0)?;
/// let report = world.blade_report(blade)?;
/// // Half of the sheet is cut.
/// assert!((report.length - 0.05).abs() < 1e-3);
/// assert_eq!(report.refused, None);
/// # Ok::<(), sinew::Error>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BladeReport {
    /// The force on it, world axes, mean over the step, N.
    pub force: Vec3,
    /// The torque on it about its position, world axes, mean over the step, N m.
    pub torque: Vec3,
    /// The work that moving the blade has done on tissue in the step, J.
    pub work: f64,
    /// The length of the cuts made at the end of the step, in the rest shape, m. For solids it is measured on the
    /// surface.
    pub length: f64,
    /// The distance from the proxy to the blade, m; 0 where no tissue resists.
    pub lag: f64,
    /// Why tissue on the path was not cut: [`Error::Capacity`] or [`Error::OutOfMemory`]. The next step tries again.
    pub refused: Option<Error>,
    /// The area of the faces that have opened in solids, in the rest shape, m².
    /// A cell that contains the end of the edge does not open and does not resist.
    pub area: f64,
}

saved! { BladeReport { force, torque, work, length, lag, refused, area } }

impl BladeReport {
    /// Adds a cut to the report.
    pub(super) fn add(&mut self, cut: &CutReport) {
        self.length += cut.length;
        self.area += cut.area;
    }
}

/// A blade of a world.
#[derive(Debug)]
pub(super) struct Blade {
    edge: [Vec3; 2],
    pub stiffness: f64,
    pub filter: CollisionFilter,
    pub pose: Pose,
    /// The pose at the end of the next step.
    pub target: Option<Pose>,
    pub proxies: Vec<Proxy>,
    pub report: BladeReport,
    // For use within a step.
    pub near: Vec<u32>,
    pub met: Vec<BladeContact>,
    pub knots: Vec<Knot>,
}

saved! { Blade { edge, stiffness, filter, pose, target, proxies, report, near, met, knots } }

/// The proxy of a blade in a body: the edge up to which tissue is cut.
#[derive(Debug, Default)]
pub(super) struct Proxy {
    pub body: BodyId,
    /// Where the next cut continues.
    pub stroke: BladeStroke,
    /// The edge at which the last cut ended, while the blade is held there.
    pub last: Option<[Vec3; 2]>,
    /// The displacement through tissue since the last cut or the first contact: its length and its vector, m.
    pub uncut: f64,
    pub behind: DVec3,
    /// The holds in tissue; without any, nothing resists.
    pub holds: Vec<BladeHold>,
    /// The shortest edge of the cells that the blade is in, m.
    pub size: f64,
    /// The resistance, N, and the direction of the cut.
    pub force: f64,
    pub forward: DVec3,
    /// True if the true edge was outside the tissue at the end of the last step; `None` if unknown.
    pub was_outside: Option<bool>,
    /// The force on the blade in the last step, N, and its point of application, m.
    pub force_on_blade: DVec3,
    pub force_point: DVec3,
    /// True if tissue pressed the blade in the last step, and in the one before.
    pub touched: [bool; 2],
}

saved! { Proxy { body, stroke, last, uncut, behind, holds, size, force, forward, was_outside, force_on_blade, force_point, touched } }

/// A hold: a suture-like constraint between tissue and the true edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct BladeHold {
    /// The id of the constraint.
    pub id: SlotId,
    /// From the proxy's point to the tissue's point, m.
    pub offset: DVec3,
    /// The motion of the nearest point of the true edge, in the last step or the next.
    pub motion: LinearPath,
}

saved! { BladeHold { id, offset, motion } }

/// A point of the proxy, and the nearest point of the true edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct EdgePoint {
    /// m.
    pub point: DVec3,
    /// The position along the edge, 0 to 1. Outside this range the nearest point is beyond an end of the edge.
    pub along: f64,
    /// From the point to the true edge, m.
    pub lag: DVec3,
}

impl Blade {
    pub fn new(definition: &BladeDefinition) -> Result<Self> {
        let BladeDefinition {
            edge,
            stiffness,
            filter,
            pose,
        } = *definition;
        for (name, end) in ["edge[0]", "edge[1]"].into_iter().zip(edge) {
            finite_vector(name, end)?;
            ensure!(
                end.abs().max_element() <= MAX_COORDINATE,
                "{name} is {end}: must be within {MAX_COORDINATE:e} m of the origin along each axis"
            );
        }
        ensure!(edge[0] != edge[1], "edge has both ends at {}", edge[0]);
        above_zero("stiffness", stiffness)?;
        Ok(Self {
            edge,
            stiffness: f64::from(stiffness),
            filter,
            pose: pose.checked()?,
            target: None,
            proxies: memory::reserved(1)?,
            report: BladeReport::default(),
            near: memory::reserved(ROOM)?,
            met: memory::reserved(ROOM)?,
            knots: memory::reserved(2 * ROOM)?,
        })
    }

    /// The edge before the next step and after it.
    pub fn edges(&self) -> [[Vec3; 2]; 2] {
        let poses = [self.pose, self.target.unwrap_or(self.pose)];
        poses.map(|pose| self.edge.map(|end| pose.position + pose.orientation * end))
    }

    /// Positions of the edge over the next step, from start to end. The blade translates and rotates uniformly; the
    /// number of positions keeps the rotation between two of them small.
    pub fn edge_positions(&self) -> (usize, impl Fn(usize) -> [Vec3; 2] + use<>) {
        let (edge, from, to) = (self.edge, self.pose, self.target.unwrap_or(self.pose));
        let [start, end] = [from, to].map(|pose| pose.orientation.as_dquat().normalize());
        let turn = rotation_between(start, end);
        // NaN becomes 1.
        let count = ((turn.length() / MAX_ROTATION).ceil() as usize).max(1);
        let [first, last] = self.edges();
        let at = move |index: usize| {
            if index == 0 {
                return first;
            }
            if index == count {
                return last;
            }
            let part = index as f32 / count as f32;
            let orientation = rotated(start, turn * f64::from(part)).as_quat();
            edge.map(|end| from.position.lerp(to.position, part) + orientation * end)
        };
        (count, at)
    }

    /// The proxy of a body. It is created if the body has none, with room for its holds.
    pub fn proxy(&mut self, body: BodyId) -> Result<usize> {
        if let Some(known) = self.proxies.iter().position(|proxy| proxy.body == body) {
            return Ok(known);
        }
        let proxy = Proxy {
            body,
            holds: memory::reserved(MAX_HOLDS)?,
            ..Proxy::default()
        };
        memory::push(&mut self.proxies, proxy)?;
        Ok(self.proxies.len() - 1)
    }

    pub fn hash(&self, hasher: &mut StateHasher) {
        hasher.write_doubles(&[self.stiffness]);
        self.filter.hash(hasher);
        hasher.write_vectors(self.edge);
        self.pose.hash(self.target, hasher);
        for proxy in &self.proxies {
            hasher.write_u64(proxy.body.0.index1.into());
            proxy.stroke.hash(hasher);
            hasher.write_vectors(proxy.last.into_iter().flatten());
            let offsets = proxy.holds.iter().map(|hold| hold.offset);
            for vector in offsets.chain([proxy.forward, proxy.behind]) {
                hasher.write_doubles(&vector.to_array());
            }
            hasher.write_u64(proxy.was_outside.map_or(2, u64::from));
            hasher.write_doubles(&[proxy.force, proxy.uncut, proxy.size]);
        }
    }
}

impl BladeHold {
    /// A hold with this number and without a position yet. Slot 0 keeps its id distinct from those of attachments.
    pub fn new(number: u32) -> Self {
        Self {
            id: SlotId {
                index1: 0,
                generation: number,
            },
            offset: DVec3::ZERO,
            motion: LinearPath {
                from: DVec3::ZERO,
                to: DVec3::ZERO,
            },
        }
    }
}

impl Proxy {
    /// The vector along which the proxy reached its position, m.
    pub fn travel(&self) -> DVec3 {
        if self.uncut > 0.0 { self.behind } else { self.forward }
    }
}

impl EdgePoint {
    /// The point of an edge's line nearest to `point`.
    pub fn next_to(point: DVec3, edge: [Vec3; 2]) -> Self {
        let [from, to] = edge.map(|end| end.as_dvec3());
        let edge = to - from;
        let along = (point - from).dot(edge) / edge.length_squared();
        Self {
            point,
            along,
            lag: from + along * edge - point,
        }
    }

    /// True if the nearest point lies on the edge itself.
    pub fn is_on_edge(&self) -> bool {
        (0.0..=1.0).contains(&self.along)
    }

    /// The nearest point of the true edge, m.
    pub fn nearest(&self) -> DVec3 {
        self.point + self.lag
    }
}

/// The edge whose lag behind the true edge fits these points, linear along the edge (least squares).
pub(super) fn lagging_edge(points: &[EdgePoint], edge: [Vec3; 2]) -> [Vec3; 2] {
    let count = points.len() as f64;
    let along = points.iter().map(|stand| stand.along).sum::<f64>() / count;
    let lag = points.iter().map(|stand| stand.lag).sum::<DVec3>() / count;
    let spread = points.iter().map(|stand| (stand.along - along).powi(2)).sum::<f64>();
    let turn = if spread > SPREAD * SPREAD * count {
        let products = points.iter().map(|stand| (stand.along - along) * (stand.lag - lag));
        products.sum::<DVec3>() / spread
    } else {
        DVec3::ZERO
    };
    let behind = |end: Vec3, at: f64| (end.as_dvec3() - lag - turn * (at - along)).as_vec3();
    [behind(edge[0], 0.0), behind(edge[1], 1.0)]
}
