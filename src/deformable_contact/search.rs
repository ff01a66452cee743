//! Which parts of two surfaces, or of one, meet within a step: the first touch of each node with a face and of each edge with an edge, both
//! moving, by conservative advancement.

use glam::{Vec3, Vec3A};

use super::clearances::{Clearances, SurfaceFeature};
use super::link::ContactSide;
use super::pairs::{Known, Near};
use super::skin::{Clearance, NONE, NodeWay, PARTED, Skin};
use super::wound::Wound;
use crate::contact::sweep::{Corners, Extent, Segment, Separation};
use crate::geometry::Bounds;

/// Distances that are the same but for this part are those of faces that share the closest point: which side it is on says the one that is
/// seen most squarely.
const SAME: f32 = 1e-4;

/// Faces of another body that meet a corner in points, and from directions, less than this part of the distance from each other hold it alike: the
/// closest one does. A surface that crumples needs them all.
const ALIKE: f32 = 0.05;

/// Edges of two bodies need not meet that come closest nearer than this part of what they keep apart to an end of one of them: its corner meets faces
/// there. With a quarter what lies on a tip trembles.
const NEAR_END: f32 = 0.05;

/// A corner meets so many faces at most. With the closest alone, a corner in a fold would be pushed out of one face into the next, and tremble; with
/// three, so would a tip in a hole of its shape, where eight triangles meet.
const FACES: usize = 8;

/// An edge meets so many edges at most. With the closest alone, an edge that lies across several would be held up by each in turn, and tremble.
const EDGES: usize = 8;

/// A face that a corner meets, or an edge that an edge meets: whether it only comes near, how far away it is, which it is, where they meet and how far
/// they keep apart.
type FeatureMet<Feature> = (bool, f32, Feature, (Separation, Clearance));

/// A body in a search, by its place in the world.
#[derive(Clone, Copy)]
pub(super) struct Party<'a> {
    pub place: usize,
    pub skin: &'a Skin,
}

/// What was found.
#[derive(Clone, Copy, Debug)]
pub(super) struct PairTouch {
    pub sides: [ContactSide; 2],
    /// From the second side to the first.
    pub normal: Vec3,
    /// How far apart they are along it when the step begins, less what they keep off, m.
    pub gap: f32,
    /// Whether they were one until a cut parted them.
    pub is_parted: bool,
    /// Whether they only come near.
    pub is_ahead: bool,
}

/// Where those features come from that may be near a corner or an edge.
enum From<'a> {
    /// Trees or images.
    Search,
    /// They are known: triangles near a corner, edges near an edge; how far the bodies have moved since these were listed, and how far away anything is
    /// at most that it can meet, m.
    Known(&'a mut [Near], [f32; 2]),
}

/// A search over a step of `dt` seconds for what comes closer than `radius`, m, and for what comes within `ahead` of that, m: impulses may lead it there.
pub(super) struct PairSearch<'a> {
    pub parties: [Party<'a>; 2],
    pub dt: f32,
    pub radius: f32,
    pub ahead: f32,
    /// How far anything of one party goes against anything of the other at most, m.
    pub motion: f32,
    /// Whether they find each other in images.
    pub in_images: bool,
    /// Whether it is not the first of the substep: what impulses have led nowhere else is passed over.
    pub again: bool,
    pub measures: Measure,
    /// Whether corners of one body may have been inside the other as the step began.
    pub may_be_inside: bool,
}

/// What of two bodies that are near each other is remembered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Measure {
    Nothing,
    /// How near they are.
    Distances,
    /// That they were made so near.
    Reductions,
}

impl PairSearch<'_> {
    /// Shows all that meets. `kept` are the clearances of the two parties; a surface with itself has none. What of two bodies is near may be known.
    pub fn run(&self, kept: [&mut Option<Clearances>; 2], known: Option<Known>, mut see: impl FnMut(PairTouch)) {
        let [first, second] = self.parties;
        let [mut of_first, of_second] = kept.map(Option::as_mut);
        if let Some(Known { runs, features, moved }) = known {
            let [corners, others, edges] = runs;
            for (runs, [of_nodes, of_faces], mut kept) in [
                (corners, [first, second], of_first.as_deref_mut()),
                (others, [second, first], of_second),
            ] {
                for run in runs {
                    let reach = run.reach(self, moved);
                    if !(run.apart - moved <= reach) {
                        continue;
                    }
                    let corner = run.number as usize;
                    let near = run.of(features);
                    let (parties, node) = ([of_nodes, of_faces], [of_nodes.skin.nodes[corner]]);
                    let face = |near: &Near| &of_faces.skin.triangles[near.feature as usize];
                    if !near.iter().any(|near| self.may_find(parties, &node, face(near))) {
                        continue;
                    }
                    let from = From::Known(near, [moved, reach]);
                    let least;
                    (least, run.is_outside) =
                        self.node_with_faces(parties, corner, from, kept.as_deref_mut(), &mut see);
                    run.apart = moved + least;
                }
            }
            let reach = self.reach_of_edges();
            for run in edges.iter_mut().filter(|run| run.apart - moved <= reach) {
                let edge = run.number as usize;
                let near = run.of(features);
                let ends = &first.skin.edges[edge];
                let other = |near: &Near| &second.skin.edges[near.feature as usize];
                if !near.iter().any(|near| self.may_find_edges(ends, other(near))) {
                    continue;
                }
                let from = From::Known(near, [moved, reach]);
                run.apart = moved + self.edge_with_edges(edge, from, of_first.as_deref_mut(), &mut see);
            }
        } else {
            self.nodes_with_faces([first, second], of_first.as_deref_mut(), &mut see);
            if !self.is_of_one() {
                self.nodes_with_faces([second, first], of_second, &mut see);
            }
            for edge in 0..first.skin.edges.len() {
                self.edge_with_edges(edge, From::Search, of_first.as_deref_mut(), &mut see);
            }
        }
        if self.is_of_one() {
            self.across_wounds(&mut see);
            self.edges_across_wounds(&mut see);
        }
    }

    /// Whether all that may meet now, as impulses have led the nodes, was found before they acted. Wounds turn as these lead them.
    pub fn has_foreseen(&self) -> bool {
        let strayed: f32 = self.parties.iter().map(|party| party.skin.strayed).sum();
        let is_open = self.is_of_one() && self.parties[0].skin.wound().is_some_and(Wound::is_open);
        !is_open && !self.have_bent() && strayed <= self.ahead
    }

    /// Whether edges that met nothing, as they were flat, may meet now.
    fn have_bent(&self) -> bool {
        self.parties.iter().any(|party| party.skin.has_bent)
    }

    /// The same of two edges as [`Self::may_find`].
    fn may_find_edges(&self, edge: &[u32], other: &[u32]) -> bool {
        self.have_bent() || self.may_find(self.parties, edge, other)
    }

    /// Whether two features of these nodes may meet where the searches before it in the substep have not found that they do: impulses have led them
    /// further than was looked.
    fn may_find(&self, [a, b]: [Party; 2], nodes: &[u32], others: &[u32]) -> bool {
        !self.again || a.skin.strayed_of(nodes) + b.skin.strayed_of(others) > self.ahead
    }

    /// How deep what lies within one of the bodies may be to be led out of it, m.
    pub(super) fn depth_in(&self, party: Party) -> f32 {
        if self.may_be_inside && party.skin.is_closed {
            party.skin.depth()
        } else {
            0.0
        }
    }

    pub(super) fn is_of_one(&self) -> bool {
        self.parties[0].place == self.parties[1].place
    }

    /// Shows the triangles that a corner comes within `reach` of on its way through a box; those that are
    /// seen there where they are to be found in images. Answers how far any of them is, m, at least, as `see` tells of each.
    fn near_corner(
        &self,
        from: From,
        skin: &Skin,
        bounds: &Bounds,
        reach: f32,
        mut see: impl FnMut(usize) -> f32,
    ) -> f32 {
        if let From::Known(triangles, [moved, reach]) = from {
            return nearest_of(triangles, (moved, reach), |triangle| see(triangle as usize));
        }
        let mut least = f32::INFINITY;
        let see = |triangle| least = least.min(see(triangle));
        match &skin.images {
            Some(images) if self.in_images => images.near(skin, bounds, reach, see),
            _ => skin.near(bounds, reach, see),
        }
        least
    }

    /// How far a part of a surface keeps from another body, m.
    fn radius_of(&self, kept: Option<&Clearances>, part: SurfaceFeature) -> f32 {
        let allowed = kept.map_or(f32::INFINITY, |kept| kept.allowed(part));
        let [first, second] = self.parties.map(|party| party.skin.least_thickness());
        self.radius.min(allowed.max(first.min(second)))
    }

    /// Remembers how near to a part of a surface another body is where the step begins.
    fn measure(&self, kept: Option<&mut Clearances>, part: SurfaceFeature, nearest: f32) {
        if let Some(kept) = kept.filter(|_| nearest < self.radius) {
            match self.measures {
                Measure::Nothing => {}
                Measure::Distances => kept.see(part, nearest),
                Measure::Reductions => kept.reduce(part, nearest),
            }
        }
    }

    fn nodes_with_faces(
        &self,
        parties: [Party; 2],
        mut kept: Option<&mut Clearances>,
        see: &mut impl FnMut(PairTouch),
    ) {
        for corner in 0..parties[0].skin.nodes.len() {
            self.node_with_faces(parties, corner, From::Search, kept.as_deref_mut(), see);
        }
    }

    /// Shows where a corner of the first surface meets the second: how far anything that it was compared with is from it at first, m, and whether it is
    /// outside.
    fn node_with_faces(
        &self,
        [of_nodes, of_faces]: [Party; 2],
        corner: usize,
        from: From,
        kept: Option<&mut Clearances>,
        see: &mut impl FnMut(PairTouch),
    ) -> (f32, bool) {
        let shift = shift(of_nodes.skin, of_faces.skin);
        let node = of_nodes.skin.nodes[corner];
        let NodeWay { start: place, step } = of_nodes.skin.way(node, (shift, of_faces.skin.drift), self.dt);
        let radius = self.radius_of(kept.as_deref(), SurfaceFeature::Corner(corner));
        let segment = Segment {
            ends: [place; 2],
            steps: [step; 2],
            radius,
        };
        let mut front = f32::INFINITY;
        let mut touched: [Option<FeatureMet<usize>>; FACES] = [None; FACES];
        // Of a closed surface: how far the nearest face is, how squarely it is seen, and whether from behind.
        let mut nearest = (f32::INFINITY, 0.0_f32);
        let mut behind: Option<(usize, Separation)> = None;
        let around = Bounds::of([place, place + step].map(Vec3::from).into_iter());
        let is_solid = of_faces.skin.is_closed && !self.is_of_one();
        let depth = self.depth_in(of_faces);
        // Of a crushed solid a face may come from its inner side at what is outside. What lies flush on one may seem to by rounding.
        let flush = of_nodes.skin.least_thickness().min(of_faces.skin.least_thickness());
        let within_behind = if self.may_be_inside { f32::INFINITY } else { flush };
        let reach = (self.radius + self.ahead).max(depth) + of_faces.skin.spread;
        let far = match from {
            From::Search => self.reach(),
            From::Known(_, [_, reach]) => reach,
        };
        let near_it = self.worth_comparing(&segment, far);
        let anywhere = |_: &Separation| true;
        let least = self.near_corner(from, of_faces.skin, &around, reach, |triangle| {
            let nodes = of_faces.skin.triangles[triangle];
            if self.is_of_one() && (nodes.contains(&node) || of_faces.skin.are_of_wound([node; 2], &nodes)) {
                return f32::INFINITY;
            }
            let corners = of_faces.skin.corners(&nodes);
            let (start, distance) = match self.separation(&corners, &segment, &near_it) {
                Ok(found) => found,
                Err(apart) => return apart,
            };
            if distance > far {
                return distance;
            }
            let height = if is_solid { height(&corners, &start) } else { 0.0 };
            let is_before = !(height < 0.0 && distance <= within_behind);
            if is_before {
                front = front.min(distance);
            }
            let is_nearer =
                distance < nearest.0 * (1.0 - SAME) || distance < nearest.0 * (1.0 + SAME) && height.abs() > nearest.1;
            if is_solid && is_nearer {
                nearest = (distance, height.abs());
                behind = (!is_before).then_some((triangle, start));
            }
            if self.may_find([of_nodes, of_faces], &[node], &nodes)
                && let Some((found, is_ahead)) = self.approach(
                    of_faces.skin,
                    ([node; 2], &segment),
                    (&nodes, &corners),
                    start,
                    anywhere,
                )
            {
                keep_closest(&mut touched, (is_ahead, distance, triangle, found));
            }
            distance
        });
        // What was made within another is led out as far as its thickness asks for; what lies flush on it by rounding touches it.
        let nearest_there = match behind {
            Some(_) if self.measures == Measure::Reductions && nearest.0 > flush => f32::INFINITY,
            Some(_) => 0.0,
            None => front,
        };
        self.measure(kept, SurfaceFeature::Corner(corner), nearest_there);
        // On the wrong side it is led out, or let out where it is deep.
        let is_behind = behind.is_some();
        if let Some((triangle, start)) = behind {
            let is_near = nearest.0 < self.radius.max(depth);
            touched = [None; FACES];
            touched[0] = is_near.then_some((false, nearest.0, triangle, (start, Clearance::of(radius))));
        }
        let side_of = |triangle: usize, found: &Separation| ContactSide {
            body: of_faces.place,
            nodes: of_faces.skin.triangles[triangle],
            weights: found.weights,
        };
        let place_of = |side: &ContactSide| side.weighted(|node| of_faces.skin.start(node));
        let alike = if self.is_of_one() { SAME } else { ALIKE };
        for place in 0..FACES {
            let Some((is_ahead, _, triangle, (found, clearance))) = touched[place] else {
                break;
            };
            let side = side_of(triangle, &found);
            let is_alike = |(_, _, closer, (other, _)): &FeatureMet<usize>| {
                let most = alike * found.offset.length();
                (other.offset - found.offset).length() <= most
                    && place_of(&side_of(*closer, other)).distance(place_of(&side)) <= most
            };
            if touched[..place].iter().flatten().any(is_alike) {
                continue;
            }
            let mut offset = Vec3::from(if is_behind { found.offset } else { -found.offset });
            if is_solid && offset == Vec3::ZERO {
                offset = outwards(&of_faces.skin.corners(&side.nodes)).into();
            }
            let sides = [ContactSide::of_node(of_nodes.place, node), side];
            self.show(sides, (offset, is_ahead), (clearance, shift), see);
        }
        (least, !is_behind)
    }

    /// The same of an edge of the first surface and edges of the second.
    fn edge_with_edges(
        &self,
        index: usize,
        from: From,
        kept: Option<&mut Clearances>,
        see: &mut impl FnMut(PairTouch),
    ) -> f32 {
        let [first, second] = self.parties;
        let shift = shift(first.skin, second.skin);
        let edge = first.skin.edges[index];
        if first.skin.pierces[index] || edge[0] == NONE {
            return f32::INFINITY;
        }
        let ridge = first.skin.flatness.of(index);
        let is_measured = self.is_measured(kept.as_deref(), index);
        let ways = edge.map(|node| first.skin.way(node, (shift, second.skin.drift), self.dt));
        let segment = Segment {
            ends: ways.map(|way| way.start),
            steps: ways.map(|way| way.step),
            radius: self.radius_of(kept.as_deref(), SurfaceFeature::Edge(index)),
        };
        let near_end = if self.is_of_one() {
            0.0
        } else {
            NEAR_END * segment.radius
        };
        let far = self.reach_of_edges();
        let way = Bounds::of(
            ways.into_iter()
                .flat_map(|way| [way.start(), (way.start + way.step).into()]),
        );
        let near_it = self.worth_comparing(&segment, far);
        let mut least = f32::INFINITY;
        let mut nearest = f32::INFINITY;
        let mut touched: [Option<FeatureMet<[u32; 2]>>; EDGES] = [None; EDGES];
        let mut see_edge = |number: u32| {
            let Some((other, pierces, other_ridge)) = second.skin.edge(number) else {
                return f32::INFINITY;
            };
            // Of what passes through tissue there is no telling which side it belongs to; it is near all the same.
            let meets = !pierces && !ridge.is_flat_beside(&other_ridge, self.radius);
            if !meets && !is_measured {
                return f32::INFINITY;
            }
            if self.is_of_one()
                && (other <= edge
                    || other.iter().any(|node| edge.contains(node))
                    || first.skin.are_of_wound(edge, &other))
            {
                return f32::INFINITY;
            }
            let corners = second.skin.corners(&other);
            let (from_start, start) = match self.separation(&corners, &segment, &near_it) {
                Ok(found) => found,
                Err(apart) => return apart,
            };
            nearest = nearest.min(start);
            if !meets || start > far || !self.may_find_edges(&edge, &other) {
                return start;
            }
            // At an end of either it is a corner that meets.
            let edges = [segment.ends[1] - segment.ends[0], corners.points[1] - corners.points[0]];
            let is_across = |found: &Separation| found.is_across_beyond(near_end, edges);
            let met = self.approach(second.skin, (edge, &segment), (&other, &corners), from_start, is_across);
            if let Some((met, is_ahead)) = met
                && !touched.iter().flatten().any(|(_, _, edge, _)| *edge == other)
            {
                keep_closest(&mut touched, (is_ahead, start, other, met));
            }
            start
        };

        let reach = self.radius + self.ahead + second.skin.spread;
        match &second.skin.images {
            _ if let From::Known(others, of) = from => {
                least = nearest_of(others, of.into(), see_edge);
            }
            Some(images) if self.in_images => {
                // The box about all of a long edge is mostly beside it.
                let [from, to] = segment.ends;
                let pieces = images.pieces((to - from).into());
                for piece in 0..pieces {
                    let shares = [piece, piece + 1].map(|end| end as f32 / pieces as f32);
                    let places = shares
                        .map(|share| segment.at(share).map(Vec3::from))
                        .into_iter()
                        .flatten();
                    let (skin, around) = (second.skin, Bounds::of(places));
                    images.near(skin, &around, reach, |triangle| {
                        let edges = images.edges_near(skin, triangle, &around, reach);
                        least = edges.into_iter().map(&mut see_edge).fold(least, f32::min);
                    });
                }
            }
            _ => {
                let skin = second.skin;
                skin.near(&way, reach, |triangle| {
                    least = skin
                        .owned(triangle)
                        .into_iter()
                        .map(&mut see_edge)
                        .fold(least, f32::min);
                });
            }
        }
        self.measure(kept, SurfaceFeature::Edge(index), nearest);
        for (is_ahead, _, other, (found, clearance)) in touched.into_iter().flatten() {
            let sides = [
                ContactSide::of_edge(first.place, edge, found.along),
                ContactSide {
                    body: second.place,
                    nodes: [other[0], other[1], other[1]],
                    weights: found.weights,
                },
            ];
            self.show(sides, ((-found.offset).into(), is_ahead), (clearance, shift), see);
        }
        least
    }

    /// How near the box about a part of a surface others are to be compared with it, m, and that box. Of other bodies how far they are is remembered for
    /// the next substeps, so that it is worth knowing; of the same surface most moves too much for that, and only what its way leads near is compared.
    fn worth_comparing(&self, segment: &Segment, far: f32) -> (f32, Extent) {
        let Segment { ends, steps, .. } = segment;
        if self.is_of_one() {
            let way = [ends[0], ends[1], ends[0] + steps[0], ends[1] + steps[1]];
            (self.radius + self.ahead, Extent::of(way.into_iter()))
        } else {
            (far, Extent::of(ends.iter().copied()))
        }
    }

    /// Where a feature and a segment are closest as the substep begins, and how far apart, m; `Err`: how far at least, where their boxes are further apart
    /// than is worth comparing.
    #[inline]
    fn separation(
        &self,
        corners: &Corners,
        segment: &Segment,
        (within, around): &(f32, Extent),
    ) -> Result<(Separation, f32), f32> {
        let others = if self.is_of_one() {
            corners.way()
        } else {
            corners.bounds()
        };
        let apart = around.distance_squared(&others);
        if apart > within * within {
            return Err(apart.sqrt());
        }
        let start = corners.separation(segment, 0.0);
        Ok((start, start.offset.length()))
    }

    /// Whether it counts how near others are to an edge that it does not meet.
    fn is_measured(&self, kept: Option<&Clearances>, edge: usize) -> bool {
        match self.measures {
            Measure::Nothing => false,
            Measure::Distances => kept.is_some_and(|kept| kept.allowed(SurfaceFeature::Edge(edge)) < f32::INFINITY),
            Measure::Reductions => true,
        }
    }

    /// Where a node or an edge comes too close to a face or an edge, if it counts there: how far they keep apart, and whether it only comes near.
    #[inline(always)]
    fn approach(
        &self,
        skin: &Skin,
        (nodes, segment): ([u32; 2], &Segment),
        (others, corners): (&[u32], &Corners),
        start: Separation,
        counts: impl Fn(&Separation) -> bool,
    ) -> Option<((Separation, Clearance), bool)> {
        let (found, is_ahead) = corners.meet(start, segment, self.ahead)?;
        let (whole, is_counted) = (Clearance::of(segment.radius), counts(&found));
        // What a cut has parted may keep less apart, and so count.
        if !is_counted && !skin.may_be_parted() {
            return None;
        }
        let clearance = if self.is_of_one() {
            skin.keeps(nodes, (others, found.weights), self.radius)?
        } else {
            whole
        };
        // Without a thickness what a cut has parted keeps as far apart as all else does.
        if clearance == whole {
            return is_counted.then_some(((found, clearance), is_ahead));
        }
        // What was one place has no side yet.
        let radius = clearance.radius;
        if start.offset.length_squared() < (PARTED * radius) * (PARTED * radius) {
            return None;
        }
        let segment = Segment { radius, ..*segment };
        let (found, is_ahead) = corners.meet(start, &segment, self.ahead)?;
        counts(&found).then_some(((found, clearance), is_ahead))
    }

    /// Shows what meets in this direction, or only comes near, of sides that keep so far apart, and in coordinates so far apart.
    pub(super) fn show(
        &self,
        sides: [ContactSide; 2],
        (offset, is_ahead): (Vec3, bool),
        (clearance, shift): (Clearance, Vec3),
        see: &mut impl FnMut(PairTouch),
    ) {
        if let Some(normal) = offset.try_normalize() {
            let apart = self.apart(&sides, shift);
            see(PairTouch {
                sides,
                normal,
                gap: apart.dot(normal) - clearance.radius,
                is_parted: clearance.is_parted,
                is_ahead,
            });
        }
    }

    /// From the second side to the first when the step begins.
    fn apart(&self, sides: &[ContactSide; 2], shift: Vec3) -> Vec3 {
        let [first, second] = [0, 1].map(|index| {
            let party = if self.parties[0].place == sides[index].body {
                self.parties[0]
            } else {
                self.parties[1]
            };
            sides[index].weighted(|node| party.skin.start(node))
        });
        first + shift - second
    }
}

/// Shows those features that may be within `reach` after bodies have moved so far, m, and remembers how far they are: how far any is, at least.
fn nearest_of(all: &mut [Near], (moved, reach): (f32, f32), mut see: impl FnMut(u32) -> f32) -> f32 {
    let mut least = f32::INFINITY;
    for near in all {
        if near.apart - moved <= reach {
            near.apart = moved + see(near.feature);
        }
        least = least.min(near.apart - moved);
    }
    least
}

/// Has what is met be among the closest, if it is one of them: what comes near after what meets.
fn keep_closest<Feature: Copy + PartialOrd>(closest: &mut [Option<FeatureMet<Feature>>], met: FeatureMet<Feature>) {
    let order = |(is_ahead, distance, feature, _): FeatureMet<Feature>| (is_ahead, distance, feature);
    let is_closer = |known: FeatureMet<Feature>| order(met) < order(known);
    if let Some(place) = closest.iter().position(|known| known.is_none_or(is_closer)) {
        closest[place..].rotate_right(1);
        closest[place] = Some(met);
    }
}

/// How far above a face what is compared with it begins, m; below 0 on its inner side.
fn height(face: &Corners, start: &Separation) -> f32 {
    -start.offset.dot(outwards(face))
}

/// The normal of a face as the substep begins.
fn outwards(face: &Corners) -> Vec3A {
    let [a, b, c] = face.points;
    (b - a).cross(c - a).normalize_or_zero()
}

/// From the coordinates of one body to those of another.
pub(super) fn shift(from: &Skin, to: &Skin) -> Vec3 {
    (from.origin - to.origin).as_vec3()
}
