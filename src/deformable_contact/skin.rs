//! The surface of a body that meets other tissue.

use glam::{DVec3, Vec3, Vec3A};

use super::change::Changing;
use super::flatness::{Flatness, Ridge};
use super::images::Images;
use super::narrow_phase::LEAST_THICKNESS;
use super::wound::Wound;
use crate::base::{Result, memory};
use crate::codec::saved;
use crate::contact::sweep::{Corners, Segment};
use crate::def::{BodyContact, Detection};
use crate::geometry::{Bounds, Forest};
use crate::mesh;
use crate::nodes::Bindings;
use crate::soa::Vectors;
use crate::solver::System;

/// Where the nodes of a body may go in a step, and the tree of its triangles as the step begins.
#[derive(Debug)]
pub(crate) struct Skin {
    /// The corners of the surface, in the body's own numbers: nodes, and points that are bound to nodes. In order where it does not change.
    pub nodes: Vec<u32>,
    pub edges: Vec<[u32; 2]>,
    pub triangles: Vec<[u32; 3]>,
    /// The edges of each triangle, marked with [`ELSEWHERE`] where they are looked at with another.
    pub(super) sides: Vec<[u32; 3]>,
    pub(super) forest: Forest,
    /// How many nodes, edges and triangles it has, and cuts may add to it.
    pub room: usize,
    /// Whether it encloses something.
    pub is_closed: bool,
    /// The edges that pass through other tissue, or the body's own, as the step begins.
    pub pierces: Vec<bool>,
    /// Where they need not meet others, as the step begins.
    pub(super) flatness: Flatness,
    /// How far nodes have gone against each other since it was measured, at most, m.
    bent: f32,
    /// Whether it is measured anew in this substep.
    pub(super) has_bent: bool,
    /// How many times edges pass through tissue, as that was looked for last.
    pub crossings: u32,
    /// Where the body's coordinates begin.
    pub origin: DVec3,
    /// Where nodes are as a step or substep begins, in the body's coordinates, and how far they go in it, seen from what goes with the drift, m.
    pub(super) ways: Vec<NodeWay>,
    /// How fast they go through it, m/s.
    pub velocities: Vec<Vec3A>,
    /// How fast they are expected to go once contacts have acted, m/s: where they meet is searched for with these velocities.
    pub expected: Vec<Vec3A>,
    /// How much faster contacts made them in the last substep of the same step, m/s.
    pub(super) changes: Vec<Vec3A>,
    /// The middle of the expected velocities, m/s, and how far any node leaves that, m.
    pub drift: Vec3,
    pub spread: f32,
    /// The box of all ways that nodes have gone since they were looked at last, m.
    pub moved: Bounds,
    /// The box of all velocities that were given.
    pub given: Bounds,
    /// How far impulses have led each node from where it was expected in the substep, m, one time after the other, and the furthest of them.
    pub strays: Vec<f32>,
    pub strayed: f32,
    /// How long its short edges were at first, m: but for a twentieth all are longer. Those without length do not count.
    pub short: f32,
    /// How far it reached along an axis at first, m.
    pub extent: f32,
    /// Where nodes were at first, in the body's coordinates, where it meets itself.
    pub(super) firsts: Option<Vectors>,
    /// How far any node goes, m.
    pub travel: f32,
    /// Whether it meets other bodies, and asks to find them in images.
    pub meets_bodies: bool,
    pub asks_for_images: bool,
    /// The side of a pixel of its images, m.
    pub resolution: f32,
    /// Where others find it, or it others, in images.
    pub(super) images: Option<Images>,
    /// What it takes to change, where its body may be cut.
    pub(super) changing: Option<Box<Changing>>,
    /// Whether the trees are where the triangles are.
    is_fitted: bool,
}

saved! { Skin {
    nodes, edges, triangles, sides, forest, room, is_closed, pierces, flatness, bent, has_bent, crossings, origin, ways, velocities,
    expected, changes, drift, spread, moved, given, strays, strayed, short, extent, firsts, travel, meets_bodies,
    asks_for_images, resolution, images, changing, is_fitted,
} }

/// Where a node begins in a substep, and how far it goes, m.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct NodeWay {
    pub start: Vec3A,
    pub step: Vec3A,
}

saved! { NodeWay { start, step } }

impl NodeWay {
    #[inline]
    pub fn start(&self) -> Vec3 {
        self.start.into()
    }
}

/// Features that were no further apart at first than this part of the least thickness were one, and are parted.
pub(super) const PARTED: f32 = 0.1;

/// Sides of a cut pass through each other where edges do by more than this part of a short edge.
const CROSSING: f32 = 0.01;

/// A node that lies within another body is led out through a face that is no further than this part of a short edge.
const LED_OUT: f32 = 0.5;

/// With itself a surface keeps off no further than this part of its short edges, or neighbours would meet.
const WITH_ITSELF: f32 = 0.5;

/// What comes this part of a short edge nearer than it may touch is found too: impulses of the same substep may lead it there.
const AHEAD: f32 = 0.02;

/// How far two features keep apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Clearance {
    /// m
    pub radius: f32,
    /// Whether they were one until a cut parted them: they begin closer than this without anything that presses them.
    pub is_parted: bool,
}

impl Clearance {
    /// That of features which were never one.
    pub fn of(radius: f32) -> Self {
        Self {
            radius,
            is_parted: false,
        }
    }
}

/// No edge.
pub(super) const NONE: u32 = u32::MAX;

/// An edge of a triangle that is looked at with another.
pub(super) const ELSEWHERE: u32 = 1 << 31;

/// How many pixels a mean edge is long, where it is not said how fine images are; and the longest extent at most.
const PIXELS_OF_EDGE: f32 = 2.0;
const PIXELS: f32 = 1024.0;

impl Skin {
    /// That of a body, which has triangles.
    pub fn new(body: &System) -> Result<Self> {
        let triangles = body.own_surface()?;
        let edges = mesh::edges(&triangles, &[])?;
        let mut sides = memory::filled([NONE; 3], triangles.len())?;
        let mut is_taken = memory::filled(false, edges.len())?;
        for (sides, &triangle) in sides.iter_mut().zip(&triangles) {
            for (side, ends) in sides.iter_mut().zip(mesh::ends_of(triangle)) {
                if let Ok(edge) = edges.binary_search(&ends) {
                    let mark = if is_taken[edge] { ELSEWHERE } else { 0 };
                    *side = edge as u32 | mark;
                    is_taken[edge] = true;
                }
            }
        }
        let pierces = memory::filled(false, edges.len())?;
        let spare = body.spare_nodes();
        let mut nodes = memory::copied(triangles.as_flattened())?;
        memory::sort_once(&mut nodes);
        let positions = body.state.positions();
        let at = |node: u32| positions.get(node as usize);
        let forest = Forest::new(triangles.len(), |triangle| triangles[triangle as usize].map(at))?;
        let lengths = || edges.iter().map(|&[a, b]| at(a).distance(at(b)));
        let contact = &body.contact;
        let mut firsts = None;
        if contact.with_itself {
            let firsts = firsts.insert(body.zeros()?);
            if body.may_be_cut.is_some() {
                // What is inside may come to the surface.
                (0..body.node_count()).for_each(|node| firsts.set(node, positions.get(node)));
            } else {
                nodes.iter().for_each(|&node| firsts.set(node as usize, at(node)));
            }
        }
        let changing = match &body.may_be_cut {
            Some(_) => Some(memory::boxed(Changing::new(body, &nodes, edges.len(), &sides)?)?),
            None => None,
        };
        let bounds = forest.bounds();
        let extent = (bounds.max - bounds.min).max_element();
        let asks_for_images = contact.with_bodies && contact.detection == Detection::ImageSpace;
        let resolution = if asks_for_images && contact.resolution > 0.0 {
            contact.resolution
        } else {
            let chosen = lengths().sum::<f32>() / (edges.len() as f32 * PIXELS_OF_EDGE);
            chosen.max(extent / PIXELS).max(f32::MIN_POSITIVE)
        };
        let mut skin = Self {
            extent,
            room: nodes.len() + edges.len() + triangles.len(),
            short: short_of(lengths(), edges.len())?,
            firsts,
            travel: 0.0,
            meets_bodies: contact.with_bodies,
            asks_for_images,
            resolution,
            images: None,
            nodes,
            flatness: Flatness::new(body.node_count() + spare, edges.len() + 3 * spare)?,
            bent: 0.0,
            has_bent: false,
            edges,
            sides,
            forest,
            is_closed: mesh::is_closed(&triangles)?,
            pierces,
            crossings: 0,
            origin: body.origin,
            ways: memory::filled(NodeWay::default(), body.node_count())?,
            velocities: memory::filled(Vec3A::ZERO, body.node_count())?,
            expected: memory::filled(Vec3A::ZERO, body.node_count())?,
            changes: memory::filled(Vec3A::ZERO, body.node_count())?,
            drift: Vec3::ZERO,
            spread: 0.0,
            moved: Bounds::EMPTY,
            given: Bounds::EMPTY,
            strays: memory::filled(0.0, body.node_count())?,
            strayed: 0.0,
            triangles,
            changing,
            is_fitted: true,
        };
        skin.nodes.try_reserve_exact(spare)?;
        skin.strays.try_reserve_exact(spare)?;
        skin.ways.try_reserve_exact(spare)?;
        for values in [&mut skin.velocities, &mut skin.expected, &mut skin.changes] {
            values.try_reserve_exact(spare)?;
        }
        for values in [&mut skin.triangles, &mut skin.sides] {
            values.try_reserve_exact(2 * spare)?;
        }
        skin.edges.try_reserve_exact(3 * spare)?;
        skin.pierces.try_reserve_exact(3 * spare)?;
        skin.room += 6 * spare;
        Ok(skin)
    }

    /// How far it keeps from itself, m, if it does.
    pub fn radius_with_itself(&self, contact: &BodyContact) -> Option<f32> {
        let apart = (2.0 * contact.thickness).max(self.least_thickness());
        contact.with_itself.then_some(apart.min(WITH_ITSELF * self.short))
    }

    /// Whether it knows of a node: of a corner, or of one that moves some.
    pub fn has(&self, node: u32) -> bool {
        match &self.changing {
            Some(changing) => changing.has(node),
            None => self.nodes.binary_search(&node).is_ok(),
        }
    }

    /// Whether cuts may part it.
    pub fn may_be_parted(&self) -> bool {
        self.changing.is_some()
    }

    /// What cuts have bared, where it is a solid that meets itself.
    pub(super) fn wound(&self) -> Option<&Wound> {
        self.changing.as_ref()?.wound.as_ref()
    }

    /// How far a node or an edge, and the point of an edge or a face of the same body with these weights, keep apart that would keep apart
    /// `radius`, m; `None`: they do not meet. What was as near as that at first is exempt, or neighbours would meet; but what is there since a cut
    /// meets as a surface without thickness, as what was parted has nothing between it.
    pub(super) fn keeps(
        &self,
        nodes: [u32; 2],
        (others, weights): (&[u32], [f32; 3]),
        radius: f32,
    ) -> Option<Clearance> {
        let apart = self.first_distance(nodes, others)?;
        let whole = Clearance::of(radius);
        let Some(changing) = &self.changing else {
            return (apart > radius).then_some(whole);
        };
        let mut used = others.iter().zip(weights).filter(|(_, weight)| *weight > 0.0);
        if let Some(wound) = &changing.wound
            && wound.has(nodes.into_iter().chain(used.clone().map(|(&other, _)| other)))
        {
            return None;
        }
        if apart > radius {
            return Some(whole);
        }
        let is_later = |node: u32| node >= changing.first_later;
        if !nodes.into_iter().any(is_later) && !used.any(|(&other, _)| is_later(other)) {
            return None;
        }
        let least = self.least_thickness();
        let is_parted = apart <= PARTED * least;
        Some(Clearance {
            radius: if is_parted { least } else { least.min(0.5 * apart) },
            is_parted,
        })
    }

    /// Whether a node or an edge and others of the same body lie in what cuts have bared: they meet there, and not here.
    pub fn are_of_wound(&self, nodes: [u32; 2], others: &[u32]) -> bool {
        let wound = self.wound();
        wound.is_some_and(|wound| wound.has(nodes.into_iter().chain(others.iter().copied())))
    }

    /// Whether a corner or an edge and others of the same body were so near at first that they never meet, if they keep apart `radius`, m.
    pub fn are_neighbours(&self, nodes: [u32; 2], others: &[u32], radius: f32) -> bool {
        let may_meet = match &self.changing {
            Some(changing) => {
                let later = |node: &u32| *node >= changing.first_later;
                nodes.iter().chain(others).any(later) || self.are_of_wound(nodes, others)
            }
            None => false,
        };
        !may_meet && self.first_distance(nodes, others).is_some_and(|apart| apart <= radius)
    }

    /// How deep a node that lies within it may be to be led out through a face, m.
    pub fn depth(&self) -> f32 {
        LED_OUT * self.short
    }

    /// What keeps off it where it has no thickness, m.
    pub fn least_thickness(&self) -> f32 {
        LEAST_THICKNESS * self.short
    }

    /// How near what meets it is found in a substep, m beyond what it keeps off: with another surface the less of both.
    pub fn ahead(&self) -> f32 {
        AHEAD * self.short
    }

    /// How deep an edge is to pass through a triangle of the same body to be on its other side, m: where a cut has parted them they touch.
    pub fn crossing_depth(&self, edge: [u32; 2], triangle: &[u32]) -> f64 {
        let is_parted = |first: u32| edge.iter().chain(triangle).any(|&node| node >= first);
        match &self.changing {
            Some(changing) if is_parted(changing.first_later) => f64::from(CROSSING * self.short),
            _ => 0.0,
        }
    }

    /// How far a node or an edge, and an edge or a face of the same body, were from each other at first, m; `None` where it does not meet itself.
    fn first_distance(&self, nodes: [u32; 2], others: &[u32]) -> Option<f32> {
        self.firsts.as_ref().map(|firsts| {
            let at = |node: u32| Vec3A::from(firsts.get(node as usize));
            let corners = Corners::still(others.iter().map(|&other| at(other)));
            corners.separation(&Segment::still(nodes.map(at)), 0.0).offset.length()
        })
    }

    /// Takes a substep of `duration` seconds, the first one of a step or not, as it is to be.
    pub fn follow(&mut self, body: &mut System, duration: f32, begins: bool) {
        if begins {
            self.changes.fill(Vec3A::ZERO);
        }
        let origin = body.origin;
        self.is_closed &= !body.is_cut_open;
        let (bindings, motion_of) = body.motion();
        self.take(origin, bindings, duration, motion_of);
        if let Some(wound) = self.changing.as_mut().and_then(|changing| changing.wound.as_mut()) {
            let ways = &self.ways;
            wound.turn(&self.triangles, |node| ways[node as usize].start());
        }
        self.bend(self.moved, &body.contact, begins);
    }

    /// Measures where it is flat once nodes have gone far against each other, of ways in this box, or as a step begins. As the substep begins and as it
    /// ends: what bends the other way in it may be flat then or now.
    fn bend(&mut self, ways: Bounds, contact: &BodyContact, begins: bool) {
        // Edges that were flat let others in by up to half of this: they are not passed over once that is a quarter of what is kept apart.
        self.bent += (ways.max - ways.min).length();
        let thickness = contact.thickness.min(0.5 * WITH_ITSELF * self.short);
        self.has_bent = self.bent > thickness.max(self.least_thickness());
        if !begins && !self.has_bent {
            return;
        }
        self.bent = 0.0;
        self.flatness.clear();
        for time in [0.0, 1.0] {
            let ways = &self.ways;
            let at = |node: u32| Vec3::from(ways[node as usize].start + ways[node as usize].step * time);
            self.flatness.measure(ways.len(), &self.triangles, &self.edges, at);
        }
    }

    /// Where a node begins and how far it goes in a substep of `duration` seconds, as seen from a body that goes with `drift` and whose coordinates begin
    /// `shift` before its own.
    pub fn way(&self, node: u32, (shift, drift): (Vec3, Vec3), duration: f32) -> NodeWay {
        let own = self.own_way(node);
        NodeWay {
            start: own.start + Vec3A::from(shift),
            step: own.step + Vec3A::from((self.drift - drift) * duration),
        }
    }

    /// The same in its own coordinates, seen from itself.
    #[inline]
    pub fn own_way(&self, node: u32) -> NodeWay {
        self.ways[node as usize]
    }

    /// The corners of an edge or a face so.
    #[inline]
    pub fn corners(&self, nodes: &[u32]) -> Corners {
        let ways = nodes.iter().map(|&node| self.own_way(node));
        Corners::of(ways.map(|way| (way.start, way.step)))
    }

    /// Where a node begins, in the body's coordinates.
    #[inline]
    pub fn start(&self, node: u32) -> Vec3 {
        self.own_way(node).start()
    }

    /// How far impulses have led any of these nodes from where it was expected in the substep, m.
    pub fn strayed_of(&self, nodes: &[u32]) -> f32 {
        nodes
            .iter()
            .fold(0.0, |strayed, &node| self.strays[node as usize].max(strayed))
    }

    /// Takes nodes to go as impulses have them go by now, and points that are bound to them with those.
    pub fn go_on(&mut self, body: &System, duration: f32) {
        let bindings = body.bindings.as_ref().filter(|_| self.changing.is_some());
        for bound in bindings
            .into_iter()
            .flat_map(|bindings| self.nodes.iter().filter_map(|&node| bindings.get(node)))
        {
            let velocity = bound.of(|node| self.velocities[node].into());
            self.velocities[bound.node as usize] = velocity.into();
        }
        let (mut all, mut strays) = (Bounds::EMPTY, Bounds::EMPTY);
        let drift = Vec3A::from(self.drift);
        for &node in &self.nodes {
            let node = node as usize;
            let velocity = self.velocities[node];
            let stray = (velocity - self.expected[node]) * duration;
            self.strays[node] += stray.length();
            self.strayed = self.strayed.max(self.strays[node]);
            strays = strays.with(stray.into());
            self.expected[node] = velocity;
            self.ways[node].step = (velocity - drift) * duration;
            all = all.with((velocity - drift).into());
        }
        self.spread = self.spread.max(duration * all.magnitudes().length());
        self.bend(strays, &body.contact, false);
    }

    /// Remembers what contacts have changed in a substep, before the body knows of it.
    pub fn remember(&mut self, body: &mut System) {
        let movers = self.changing.iter().flat_map(|changing| &changing.movers);
        let (bindings, motion_of) = body.motion();
        let bindings = bindings.filter(|_| self.changing.is_some());
        for &node in self.nodes.iter().chain(movers) {
            if bindings.is_none_or(|bindings| bindings.get(node).is_none()) {
                let node = node as usize;
                self.changes[node] = self.velocities[node] - Vec3A::from(motion_of(node).1);
            }
        }
    }

    /// Takes the trees to where the triangles are, if they are not there.
    pub fn fit(&mut self) {
        if !self.is_fitted {
            let (triangles, ways) = (&self.triangles, &self.ways);
            self.forest
                .refit(|triangle| triangles[triangle as usize].map(|node| ways[node as usize].start()));
            self.is_fitted = true;
        }
    }

    /// Takes the body as it stands when a step that was tried begins, or as it ends.
    pub fn stand(&mut self, body: &System, at_end: bool) {
        let positions = if at_end {
            body.state.newest().0
        } else {
            body.state.positions()
        };
        self.take(body.origin, body.bindings.as_ref(), 0.0, |node| {
            (positions.get(node), Vec3::ZERO)
        });
        self.fit();
    }

    fn take(
        &mut self,
        origin: DVec3,
        bindings: Option<&Bindings>,
        duration: f32,
        motion_of: impl Fn(usize) -> (Vec3, Vec3),
    ) {
        self.origin = origin;
        self.given = Bounds::EMPTY;
        self.strayed = 0.0;
        let (mut all, mut moved) = (Bounds::EMPTY, Bounds::EMPTY);
        for &node in self.changing.iter().flat_map(|changing| &changing.movers) {
            let (start, velocity) = motion_of(node as usize);
            moved = moved.with(start - self.start(node));
            self.ways[node as usize].start = start.into();
            self.velocities[node as usize] = velocity.into();
        }
        let changes = &self.changes;
        let bindings = bindings.filter(|_| self.changing.is_some());
        let bound = |node: u32| bindings.and_then(|bindings| bindings.get(node));
        for &node in &self.nodes {
            let ((start, velocity), change) = match bound(node) {
                None => (motion_of(node as usize), changes[node as usize].into()),
                Some(bound) => (
                    (bound.of(|node| motion_of(node).0), bound.of(|node| motion_of(node).1)),
                    bound.of(|node| changes[node].into()),
                ),
            };
            let expected = velocity + change;
            moved = moved.with(start - self.start(node));
            self.ways[node as usize].start = start.into();
            self.velocities[node as usize] = velocity.into();
            self.expected[node as usize] = expected.into();
            self.strays[node as usize] = 0.0;
            all = all.with(expected);
        }
        self.moved = moved;
        self.drift = 0.5 * (all.min + all.max);
        let drift = Vec3A::from(self.drift);
        for &node in &self.nodes {
            self.ways[node as usize].step = (self.expected[node as usize] - drift) * duration;
        }
        self.travel = duration * all.magnitudes().length();
        self.spread = 0.5 * duration * (all.max - all.min).length();
        self.is_fitted = false;
        if self.images.is_some() || self.wound().is_some_and(Wound::is_open) {
            self.fit();
        }
    }

    /// Has images of the surface, if it has none.
    pub fn add_images(&mut self) -> Result<()> {
        if self.images.is_none() {
            self.images = Some(Images::new(self)?);
        }
        Ok(())
    }

    /// Draws what of the surface lies within `part`.
    pub fn draw(&mut self, part: &Bounds) {
        if let Some(mut images) = self.images.take() {
            images.draw(self, part);
            self.images = Some(images);
        }
    }

    /// Shows the triangles that a box comes within `reach` of.
    pub fn near(&self, bounds: &Bounds, reach: f32, see: impl FnMut(usize)) {
        self.forest.near(bounds, reach, see);
    }

    /// The edges of a triangle, as numbers.
    pub fn sides(&self, triangle: usize) -> [u32; 3] {
        self.sides[triangle].map(number_of)
    }

    /// Those that are looked at with it: each edge is with one.
    pub fn owned(&self, triangle: usize) -> [u32; 3] {
        self.sides[triangle].map(|side| if side & ELSEWHERE == 0 { side } else { NONE })
    }

    /// An edge, whether it passes through tissue, and how the surface turns there; `None` of no edge.
    #[inline]
    pub(super) fn edge(&self, number: u32) -> Option<([u32; 2], bool, Ridge)> {
        let number = number as usize;
        let edge = *self.edges.get(number)?;
        Some((edge, self.pierces[number], self.flatness.of(number)))
    }
}

/// The number of an edge of a triangle, marked or not.
pub(super) fn number_of(side: u32) -> u32 {
    if side == NONE { NONE } else { side & !ELSEWHERE }
}

/// The length that all but a twentieth are longer than, of those that are above 0.
fn short_of(lengths: impl Iterator<Item = f32>, count: usize) -> Result<f32> {
    let mut sorted = memory::reserved(count)?;
    sorted.extend(lengths.filter(|&length| length > 0.0));
    if sorted.is_empty() {
        return Ok(f32::MIN_POSITIVE);
    }
    let place = sorted.len() / 20;
    Ok(*sorted.select_nth_unstable_by(place, f32::total_cmp).1)
}
