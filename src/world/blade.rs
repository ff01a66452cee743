//! A blade: an edge that the caller moves, and the proxies of it that stand in tissue.

use glam::{DVec3, Vec3};

use super::resistance::Knot;
use crate::base::{BodyId, Error, Result, SlotId, StateHasher, above_zero, ensure, memory};
use crate::body::{CutReport, Stroke};
use crate::codec::saved;
use crate::contact::Pose;
use crate::cutting::Met;
use crate::def::{CollisionFilter, finite_vector};
use crate::deformable_contact::Lead;
use crate::geometry::rotation::{turn_between, turned};
use crate::mesh::FURTHEST;

/// A proxy is held at no more points: a blade through more layers of a body is held at some.
pub(super) const MOST_HOLDS: usize = 8;

/// Room for so many triangles near a blade from the beginning.
const ROOM: usize = 256;

/// Points that lie closer to each other along an edge, as a part of it, do not tell how it is turned.
const SPREAD: f64 = 0.05;

/// A blade that turns by more than this in a step, rad, is followed in parts of it.
const MOST_TURN: f64 = 0.5;

/// What a blade is. Plain data, used only during [`World::create_blade`](crate::World::create_blade).
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
    /// Both ends of the cutting edge about the blade's own origin, m, each coordinate within 1e9 of 0; not at one place.
    pub edge: [Vec3; 2],
    /// The force, N, for each metre by which it is ahead of where tissue is cut, in each body; above 0 and finite. How blunt it is: tissue of
    /// toughness T resists with some T, and gives way by T / `stiffness` first.
    pub stiffness: f32,
    /// Which bodies it meets.
    pub filter: CollisionFilter,
    /// Where it is at first.
    pub pose: Pose,
}

impl BladeDefinition {
    /// A blade with this edge at the origin, of 1000 N/m, that meets everything.
    pub fn new(edge: [Vec3; 2]) -> Self {
        Self {
            edge,
            stiffness: 1000.0,
            filter: CollisionFilter::default(),
            pose: Pose::IDENTITY,
        }
    }
}

/// What a blade did in the last step, and what was done to it.
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
    /// What whoever moves it has spent on tissue in the step, J.
    pub work: f64,
    /// How long the cuts are that it made at the end of the step, in the rest shape, m; of solids on their skin.
    pub length: f64,
    /// How far it is ahead of where tissue is cut, m: 0 where nothing is in its way.
    pub lag: f64,
    /// Why what it went through was not cut: [`Error::Capacity`] or [`Error::OutOfMemory`]. It is tried again with the next step.
    pub refused: Option<Error>,
    /// Of solids: how large the faces are that have opened, in the rest shape, m².
    /// A cell in which the end of the edge passes holds: it does not open, and does not resist.
    pub area: f64,
}

saved! { BladeReport { force, torque, work, length, lag, refused, area } }

impl BladeReport {
    /// It has made a cut.
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
    /// Where the next step moves it.
    pub target: Option<Pose>,
    pub proxies: Vec<Proxy>,
    pub report: BladeReport,
    // For use within a step.
    pub near: Vec<u32>,
    pub met: Vec<Met>,
    pub knots: Vec<Knot>,
}

saved! { Blade { edge, stiffness, filter, pose, target, proxies, report, near, met, knots } }

/// Where a blade stands in a body: the edge that tissue is cut to.
#[derive(Debug, Default)]
pub(super) struct Proxy {
    pub body: BodyId,
    /// Where cuts go on.
    pub stroke: Stroke,
    /// The edge that the last cut came to, while it stands there.
    pub last: Option<[Vec3; 2]>,
    /// How far it has gone through tissue since that, or since it met the tissue, m, and from where.
    pub uncut: f64,
    pub behind: DVec3,
    /// What it is held by; none: nothing resists.
    pub holds: Vec<Snag>,
    /// The shortest edge of what it stands in, m.
    pub size: f64,
    /// What resists, N, and where to.
    pub force: f64,
    pub forward: DVec3,
    /// Whether the true edge was outside of the tissue as the last step ended; `None`: it is not known.
    pub was_outside: Option<bool>,
    /// What it did to the blade in the last step, N, and where, m.
    pub felt: DVec3,
    pub felt_at: DVec3,
    /// Whether it did anything to it then, and in the step before.
    pub touched: [bool; 2],
}

saved! { Proxy { body, stroke, last, uncut, behind, holds, size, force, forward, was_outside, felt, felt_at, touched } }

/// A thread between tissue and the true edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct Snag {
    /// The thread's name.
    pub id: SlotId,
    /// From the point of the proxy to that of the tissue, m.
    pub offset: DVec3,
    /// The way of the point of the true edge that is next to it, in the last step or the next.
    pub way: Lead,
}

saved! { Snag { id, offset, way } }

/// A point of the proxy, and the true edge next to it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stand {
    /// m.
    pub point: DVec3,
    /// How far along the edge, 0 to 1; beyond that it is not next to the edge any more.
    pub along: f64,
    /// From there to the true edge, m.
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
                end.abs().max_element() <= FURTHEST,
                "{name} is {end}: must be within {FURTHEST:e} m of the origin along each axis"
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

    /// Its edge before the next step and after it.
    pub fn edges(&self) -> [[Vec3; 2]; 2] {
        let poses = [self.pose, self.target.unwrap_or(self.pose)];
        poses.map(|pose| self.edge.map(|end| pose.position + pose.orientation * end))
    }

    /// Its edge at places of the next step, which goes straight and turns evenly, from its beginning to its end: so many that it turns little
    /// from each to the next.
    pub fn ways(&self) -> (usize, impl Fn(usize) -> [Vec3; 2] + use<>) {
        let (edge, from, to) = (self.edge, self.pose, self.target.unwrap_or(self.pose));
        let [start, end] = [from, to].map(|pose| pose.orientation.as_dquat().normalize());
        let turn = turn_between(start, end);
        // Of what is no number none is more.
        let count = ((turn.length() / MOST_TURN).ceil() as usize).max(1);
        let [first, last] = self.edges();
        let at = move |index: usize| {
            if index == 0 {
                return first;
            }
            if index == count {
                return last;
            }
            let part = index as f32 / count as f32;
            let orientation = turned(start, turn * f64::from(part)).as_quat();
            edge.map(|end| from.position.lerp(to.position, part) + orientation * end)
        };
        (count, at)
    }

    /// The proxy of a body, made where there is none; what it is held by has room.
    pub fn proxy(&mut self, body: BodyId) -> Result<usize> {
        if let Some(known) = self.proxies.iter().position(|proxy| proxy.body == body) {
            return Ok(known);
        }
        let proxy = Proxy {
            body,
            holds: memory::reserved(MOST_HOLDS)?,
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

impl Snag {
    /// One of this number, which is nowhere yet. No attachment has place 0.
    pub fn new(number: u32) -> Self {
        Self {
            id: SlotId {
                index1: 0,
                generation: number,
            },
            offset: DVec3::ZERO,
            way: Lead {
                from: DVec3::ZERO,
                to: DVec3::ZERO,
            },
        }
    }
}

impl Proxy {
    /// The direction that it came from where it is, m.
    pub fn came_along(&self) -> DVec3 {
        if self.uncut > 0.0 { self.behind } else { self.forward }
    }
}

impl Stand {
    /// The point next to another on the line of an edge.
    pub fn next_to(point: DVec3, edge: [Vec3; 2]) -> Self {
        let [from, to] = edge.map(|end| end.as_dvec3());
        let way = to - from;
        let along = (point - from).dot(way) / way.length_squared();
        Self {
            point,
            along,
            lag: from + along * way - point,
        }
    }

    /// Whether it is next to the edge itself.
    pub fn is_beside(&self) -> bool {
        (0.0..=1.0).contains(&self.along)
    }

    /// Where the true edge is next to it, m.
    pub fn foot(&self) -> DVec3 {
        self.point + self.lag
    }
}

/// The edge that lags behind the true one as it does at these points: linear along it (least squares).
pub(super) fn edge_behind(stands: &[Stand], edge: [Vec3; 2]) -> [Vec3; 2] {
    let count = stands.len() as f64;
    let along = stands.iter().map(|stand| stand.along).sum::<f64>() / count;
    let lag = stands.iter().map(|stand| stand.lag).sum::<DVec3>() / count;
    let spread = stands.iter().map(|stand| (stand.along - along).powi(2)).sum::<f64>();
    let turn = if spread > SPREAD * SPREAD * count {
        let products = stands.iter().map(|stand| (stand.along - along) * (stand.lag - lag));
        products.sum::<DVec3>() / spread
    } else {
        DVec3::ZERO
    };
    let behind = |end: Vec3, at: f64| (end.as_dvec3() - lag - turn * (at - along)).as_vec3();
    [behind(edge[0], 0.0), behind(edge[1], 1.0)]
}
