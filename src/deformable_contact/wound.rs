//! The two sides of a cut through a solid: faces that lie in one place when they are bared, and are to meet from then on without a thickness.
//!
//! What lies in one place has no distance to tell the sides by. Their faces do: tissue is behind them. So a corner of one side is to stay
//! before the faces of the other that look at it, at no distance at all: nothing is pushed apart when it is cut, and a wound that closes is as
//! it was before it was cut.

use glam::{Vec3, Vec3A};

use super::link::ContactSide;
use super::search::{PairSearch, PairTouch};
use super::skin::{Clearance, NONE, NodeWay, Skin};
use crate::base::{Result, memory};
use crate::codec::saved;
use crate::contact::sweep::{Corners, Segment, Separation};
use crate::geometry::Bounds;
use crate::soa::Vectors;
use crate::solver::System;

/// Edges meet that both look across the gap by this much at least, as the cosine of an angle.
const SQUARELY: f32 = 0.5;

/// Then they do not look the same way: the cosine of the angle between where they look is no more than this.
const ONE_WAY: f32 = 1.0 - 2.0 * SQUARELY * SQUARELY;

/// A corner is behind a face where it is no deeper than this part of a short edge, and no deeper than what is bared is large there: what many
/// cuts have left in crumbs would else be compared with all others.
const DEPTH: f32 = 1.0;

/// The border of a wound holds corners that are beside it and behind it by no more than this part of a short edge: at first they lie on it.
const BORDER: f32 = 0.05;

/// What was behind a face at first, within so many times that depth, belongs to it.
const BELONGS: f32 = 4.0;

/// Two that were further apart at first than this part of the least thickness were not parted by a cut: what lies between is tissue.
const APART: f32 = 0.1;

/// How deep behind a face is nothing yet, as a part of the least thickness.
const NOTHING: f32 = 0.01;

/// What cuts have bared of a solid's surface.
#[derive(Debug)]
pub(super) struct Wound {
    /// The bared triangles, and by their numbers whether they are.
    faces: Vec<u32>,
    is_bared: Vec<bool>,
    /// Their corners, and by their numbers whether they are.
    nodes: Vec<u32>,
    is_corner: Vec<bool>,
    /// Which way is out at each, the sum of its bared triangles.
    normals: Vectors,
    /// How long the longest edge of these is, m.
    longest: Vec<f32>,
}

saved! { Wound { faces, is_bared, nodes, is_corner, normals, longest } }

impl Wound {
    /// None yet, of a body with so many triangles.
    pub fn new(body: &System, triangles: usize) -> Result<Self> {
        let spare = body.spare_nodes();
        let mut is_bared = memory::reserved(triangles + 2 * spare)?;
        is_bared.resize(triangles, false);
        let mut is_corner = memory::reserved(body.node_count() + spare)?;
        is_corner.resize(body.node_count(), false);
        Ok(Self {
            faces: memory::reserved(2 * spare)?,
            is_bared,
            nodes: memory::reserved(spare)?,
            is_corner,
            normals: body.zeros()?,
            longest: memory::reserved(body.node_count() + spare)?,
        })
    }

    /// Makes room for so many triangles more, and so many that are bared.
    pub fn reserve(&mut self, triangles: usize, bared: usize) -> Result<()> {
        self.is_bared.try_reserve(triangles)?;
        self.faces.try_reserve(bared)?;
        Ok(self.nodes.try_reserve(3 * bared)?)
    }

    /// These triangles are bared, of those that there are now, with so many nodes.
    pub fn bare(&mut self, bared: &[u32], triangles: &[[u32; 3]], node_count: usize) {
        self.is_bared.resize(triangles.len(), false);
        self.is_corner.resize(node_count.max(self.is_corner.len()), false);
        self.normals.grow(node_count);
        self.longest.resize(node_count.max(self.longest.len()), 0.0);
        for &triangle in bared {
            if !std::mem::replace(&mut self.is_bared[triangle as usize], true) {
                self.faces.push(triangle);
            }
            for corner in triangles[triangle as usize] {
                if !std::mem::replace(&mut self.is_corner[corner as usize], true) {
                    self.nodes.push(corner);
                }
            }
        }
    }

    /// Finds which way is out, with nodes where they start.
    pub fn turn(&mut self, triangles: &[[u32; 3]], start: impl Fn(u32) -> Vec3) {
        for &node in &self.nodes {
            self.normals.set(node as usize, Vec3::ZERO);
            self.longest[node as usize] = 0.0;
        }
        for &face in &self.faces {
            let corners = triangles[face as usize];
            let [a, b, c] = corners.map(&start);
            let normal = normal([a, b, c]);
            let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
            for corner in corners {
                let sum = self.normals.get(corner as usize) + normal;
                self.normals.set(corner as usize, sum);
                self.longest[corner as usize] = longest.max(self.longest[corner as usize]);
            }
        }
    }

    /// Whether anything is bared.
    pub fn is_open(&self) -> bool {
        !self.faces.is_empty()
    }

    /// Whether a triangle is bared.
    pub fn is_bared(&self, triangle: usize) -> bool {
        self.is_bared[triangle]
    }

    /// Whether all these are corners of what was bared.
    pub fn has(&self, mut numbers: impl Iterator<Item = u32>) -> bool {
        numbers.all(|number| self.is_corner[number as usize])
    }
}

impl PairSearch<'_> {
    /// Shows the corners of a wound that come behind faces of its other side.
    pub fn across_wounds(&self, see: &mut impl FnMut(PairTouch)) {
        let party = self.parties[0];
        let skin = party.skin;
        let Some(wound) = skin.wound().filter(|_| self.is_of_one()) else {
            return;
        };
        for &node in &wound.nodes {
            let border = skin.wound_border();
            let depth = (DEPTH * skin.short).min(wound.longest[node as usize]).max(border);
            let outward = wound.normals.get(node as usize);
            let NodeWay { start, step } = skin.own_way(node);
            let [start, end] = [start, start + step].map(Vec3::from);
            let around = Bounds::of([start, end].into_iter());
            let mut nearest: Option<((bool, f32), Over, usize, Vec3)> = None;
            // How far a face may be from what it is to have behind it or before it.
            let mut reach = depth;
            skin.forest.nearest(&around, depth + skin.spread, |triangle| {
                let nodes = skin.triangles[triangle];
                let further = |reach: f32| reach + skin.least_thickness() + skin.spread;
                if !wound.is_bared(triangle) || nodes.contains(&node) {
                    return further(reach);
                }
                let places = skin.corners(&nodes).at(1.0).map(Vec3::from);
                let across = normal(places);
                let height = across.dot(end - places[0]);
                let is_far = height * height > reach * reach * across.length_squared();
                if is_far || !(across.dot(outward) < 0.0) {
                    return further(reach);
                }
                let normal = across.normalize_or_zero();
                let over = Over::new(end, places, normal);
                let is_beside = over.beside > skin.least_thickness();
                let within = if is_beside { border } else { depth };
                // What lies on a face counts before what is beside one.
                let key = (is_beside, over.height.abs());
                if over.height.abs() < within
                    && over.beside < border
                    && nearest.is_none_or(|(least, ..)| key < least)
                    && !skin.was_behind(node, nodes, BELONGS * depth)
                {
                    nearest = Some((key, over, triangle, normal));
                    if !is_beside {
                        reach = over.height.abs();
                    }
                }
                further(reach)
            });
            if let Some((_, over, triangle, normal)) = nearest
                && over.height < -NOTHING * skin.least_thickness()
            {
                let sides = [
                    ContactSide::of_node(party.place, node),
                    ContactSide {
                        body: party.place,
                        nodes: skin.triangles[triangle],
                        weights: over.weights,
                    },
                ];
                self.show(sides, (normal, false), (Clearance::of(0.0), Vec3::ZERO), see);
            }
        }
    }
}

impl PairSearch<'_> {
    /// Shows the edges of a wound that pass behind edges of its other side.
    pub fn edges_across_wounds(&self, see: &mut impl FnMut(PairTouch)) {
        let party = self.parties[0];
        let skin = party.skin;
        let Some(wound) = skin.wound().filter(|wound| !wound.faces.is_empty()) else {
            return;
        };
        let border = skin.wound_border();
        let outward = |[a, b]: [u32; 2]| wound.normals.get(a as usize) + wound.normals.get(b as usize);
        for &edge in &skin.edges {
            if edge[0] == NONE || !wound.has(edge.into_iter()) {
                continue;
            }
            let ways = edge.map(|node| skin.own_way(node));
            let segment = Segment::still(ways.map(|way| way.start + way.step));
            let around = Bounds::of(segment.ends.into_iter().map(Vec3::from));
            let within = around.extended(border);
            let away = outward(edge);
            let mut deepest: Option<(f32, [u32; 2], Separation, Vec3)> = None;
            skin.near(&around, border + skin.spread, |triangle| {
                for other in skin.owned(triangle).into_iter().filter(|&other| other != NONE) {
                    let other = skin.edges[other as usize];
                    let is_other = other > edge && !other.iter().any(|node| edge.contains(node));
                    if !(is_other && wound.has(other.into_iter())) {
                        continue;
                    }
                    let mut corners = skin.corners(&other);
                    corners.points = corners.at(1.0);
                    corners.steps = [Vec3A::ZERO; 3];
                    // Most of what is near a long edge's box is not near the edge: what is easily told is told first.
                    let out = outward(other);
                    let along = out.dot(away);
                    let of_both = out.length_squared() * away.length_squared();
                    let look_one_way = along > 0.0 && along * along > ONE_WAY * ONE_WAY * of_both;
                    if look_one_way
                        || !Bounds::of(corners.points[..2].iter().map(|&point| point.into())).overlaps(&within)
                    {
                        continue;
                    }
                    let found = corners.separation(&segment, 0.0);
                    let is_inside = found.inside && found.along > 0.0 && found.along < 1.0;
                    let depth = found.offset.length();
                    if !is_inside || depth > border || depth < NOTHING * skin.least_thickness() {
                        continue;
                    }
                    // From the first edge to the other is out of the other, where the first is behind it.
                    let normal = Vec3::from(found.offset) / depth;
                    let looks = |along: Vec3| normal.dot(along.normalize_or_zero());
                    let is_behind = looks(out) > SQUARELY && looks(away) < -SQUARELY;
                    let is_deeper = |most: f32, known: [u32; 2]| depth > most || depth == most && other < known;
                    if is_behind
                        && deepest.is_none_or(|(most, known, ..)| is_deeper(most, known))
                        && !skin.were_apart(edge, other, normal)
                    {
                        deepest = Some((depth, other, found, normal));
                    }
                }
            });
            if let Some((_, other, found, normal)) = deepest {
                let sides = [
                    ContactSide::of_edge(party.place, edge, found.along),
                    ContactSide {
                        body: party.place,
                        nodes: [other[0], other[1], other[1]],
                        weights: found.weights,
                    },
                ];
                self.show(sides, (normal, false), (Clearance::of(0.0), Vec3::ZERO), see);
            }
        }
    }
}

impl Skin {
    /// How far beside the border of a wound, or behind it, corners and edges are held by it, m.
    pub fn wound_border(&self) -> f32 {
        BORDER * self.short
    }

    /// Whether two edges of the same body were apart at first along a direction from the one to the other: the tissue between them is their own, as
    /// in a thin wedge between two cuts.
    fn were_apart(&self, edge: [u32; 2], other: [u32; 2], along: Vec3) -> bool {
        self.firsts.as_ref().is_some_and(|firsts| {
            let at = |number: u32| Vec3A::from(firsts.get(number as usize));
            let separation = Corners::still(other.into_iter().map(at)).separation(&Segment::still(edge.map(at)), 0.0);
            separation.offset.dot(along.into()) > APART * self.least_thickness()
        })
    }

    /// Whether a number was behind a triangle of the same body at first, as near as this, m: the tissue behind it is its own.
    fn was_behind(&self, number: u32, triangle: [u32; 3], near: f32) -> bool {
        self.firsts.as_ref().is_some_and(|firsts| {
            let at = |number: u32| firsts.get(number as usize);
            let places = triangle.map(at);
            let normal = normal(places).normalize_or_zero();
            let from = at(number) - places[0];
            let separation = separation(at(number), places);
            from.dot(normal) < -APART * self.least_thickness() && separation.0.length_squared() < near * near
        })
    }
}

/// Where a point is, as a triangle sees it.
#[derive(Clone, Copy)]
struct Over {
    /// How far above it, m.
    height: f32,
    /// How far beside it, m.
    beside: f32,
    /// The triangle's closest point.
    weights: [f32; 3],
}

impl Over {
    fn new(point: Vec3, triangle: [Vec3; 3], normal: Vec3) -> Self {
        let (offset, weights) = separation(point, triangle);
        let height = offset.dot(normal);
        Self {
            height,
            beside: (offset - normal * height).length(),
            weights,
        }
    }
}

/// From the closest point of a triangle to a point, and the parts of its corners in it.
fn separation(point: Vec3, triangle: [Vec3; 3]) -> (Vec3, [f32; 3]) {
    let corners = Corners::still(triangle.into_iter().map(Vec3A::from));
    let found = corners.separation(&Segment::still([point.into(); 2]), 0.0);
    ((-found.offset).into(), found.weights)
}

/// As long as twice the area.
fn normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    (b - a).cross(c - a)
}
