//! Candidate features for contact between two bodies, or of a body with itself. They are kept over substeps, until
//! features may have come nearer than was searched for (Verlet 1967).
//!
//! Each corner, edge and candidate has a lower bound of its distance. It is skipped until the bodies may have moved by
//! that distance, so a substep tests few features that do not touch. The results are the same as those of a tree
//! search.

use glam::{Vec3, Vec3A};

use super::collision_surface::{CollisionSurface, NONE};
use super::search::{PairSearch, SearchSide};
use crate::base::{Result, memory};
use crate::codec::saved;
use crate::contact::time_of_impact::{Corners, Extent, Segment};
use crate::geometry::Aabb;

/// Minimum and maximum margin of a list, as a fraction of a short edge. In between, the margin covers the motion of
/// this number of substeps.
const MIN_MARGIN: f32 = 0.05;
const MAX_MARGIN: f32 = 0.5;
const MARGIN_SUBSTEPS: f32 = 16.0;

/// Fraction of the margin that is tried if memory is short.
const REDUCED_MARGIN: f32 = 0.25;

/// Capacity for candidates per corner and edge: of other bodies, and of the same body.
const CANDIDATES_PER_FEATURE: usize = 4;
const SELF_CANDIDATES_PER_FEATURE: usize = 24;

/// Relative rounding error of distances.
const ROUNDING: f32 = 1e-3;

/// A feature of the other body near a corner or edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct CandidateFeature {
    /// A triangle near a corner, or an edge near an edge.
    pub feature: u32,
    /// Distance of the features, or of their bounds, when last compared, plus the accumulated motion by then, m.
    pub distance_bound: f32,
}

saved! { CandidateFeature { feature, distance_bound } }

/// A corner or edge, and its candidates.
#[derive(Clone, Copy, Debug)]
pub(super) struct CandidateRun {
    /// Index among the corners or edges of its surface.
    pub index: u32,
    first: u32,
    end: u32,
    /// Smallest [`CandidateFeature::distance_bound`] of the candidates, m.
    pub distance_bound: f32,
    /// True if the corner was outside the other body when last tested.
    pub was_outside: bool,
}

saved! { CandidateRun { index, first, end, distance_bound, was_outside } }

/// Candidates of a pair of bodies: corners of the first with triangles of the second, the reverse, and edges with
/// edges.
#[derive(Clone, Copy, Debug)]
struct CandidateList {
    first: u32,
    ends: [u32; 3],
    /// Distances within which corners with faces, and edges with edges, are listed completely, m.
    within: [f32; 2],
    /// Upper bound of the relative motion of the bodies since then, m.
    accumulated_motion: f32,
}

saved! { CandidateList { first, ends, within, accumulated_motion } }

/// Candidate lists of the near pairs of an island, in their order.
#[derive(Debug, Default)]
pub(super) struct CandidatePairs {
    is_valid: bool,
    /// Fraction of the margin for which memory suffices in this step; 0 disables the lists.
    margin_fraction: f32,
    lists: Vec<CandidateList>,
    runs: Vec<CandidateRun>,
    features: Vec<CandidateFeature>,
}

saved! { CandidatePairs { is_valid, margin_fraction, lists, runs, features } }

/// The candidate list of a pair.
pub(super) struct CandidateView<'a> {
    pub runs: [&'a mut [CandidateRun]; 3],
    pub features: &'a mut [CandidateFeature],
    pub accumulated_motion: f32,
}

impl CandidateRun {
    /// Returns the candidates of this run.
    pub fn slice<'a>(&self, features: &'a mut [CandidateFeature]) -> &'a mut [CandidateFeature] {
        &mut features[self.first as usize..self.end as usize]
    }

    /// Makes edges due again that were skipped because they were flat.
    fn reset_flat_edges(&mut self, features: &mut [CandidateFeature], accumulated_motion: f32) {
        for candidate in self.slice(features) {
            if candidate.distance_bound == f32::INFINITY {
                (candidate.distance_bound, self.distance_bound) =
                    (accumulated_motion, self.distance_bound.min(accumulated_motion));
            }
        }
    }

    /// Returns the distance within which contact is possible, m. Only a corner that may be inside the other body is
    /// pushed out.
    pub fn contact_reach(&self, search: &PairSearch, accumulated_motion: f32) -> f32 {
        if self.was_outside && self.distance_bound > accumulated_motion {
            search.edge_reach()
        } else {
            search.contact_reach()
        }
    }
}

impl CandidatePairs {
    /// Reserves memory for this number of lists, and for the corners and edges with contact between bodies and with
    /// self-contact.
    pub fn reserve(&mut self, lists: usize, [with_bodies, with_itself]: [usize; 2]) -> Result<()> {
        memory::reserve_in_steps(&mut self.lists, lists)?;
        memory::reserve_in_steps(&mut self.runs, with_bodies + with_itself)?;
        memory::reserve_in_steps(
            &mut self.features,
            CANDIDATES_PER_FEATURE * with_bodies + SELF_CANDIDATES_PER_FEATURE * with_itself,
        )
    }

    /// Begins a step of an island.
    pub fn reset(&mut self) {
        (self.is_valid, self.margin_fraction) = (false, 1.0);
    }

    /// Adds the motion of bodies since the last update, if `have_moved`, and makes flat edges of bent surfaces due
    /// again.
    pub fn advance_motion(
        &mut self,
        pairs: impl Iterator<Item = [usize; 2]>,
        surfaces: &[Option<CollisionSurface>],
        have_moved: bool,
    ) {
        if !self.is_valid {
            return;
        }
        for (list, [a, b]) in self.lists.iter_mut().zip(pairs) {
            if let (Some(Some(first)), Some(Some(second))) = (surfaces.get(a), surfaces.get(b)) {
                if have_moved {
                    let (a, b) = (&first.motion_bounds, &second.motion_bounds);
                    let max_motion = (a.max - b.min).abs().max((b.max - a.min).abs()).length();
                    list.accumulated_motion += max_motion * (1.0 + ROUNDING);
                }
                if first.was_remeasured || second.was_remeasured {
                    let edges = &mut self.runs[list.ends[1] as usize..list.ends[2] as usize];
                    for run in edges {
                        run.reset_flat_edges(&mut self.features, list.accumulated_motion);
                    }
                }
            }
        }
    }

    /// True if the list of a pair contains all that can touch in this search.
    pub fn covers(&self, pair: usize, search: &PairSearch) -> bool {
        let list = self.lists.get(pair).filter(|_| self.is_valid);
        list.is_some_and(|list| {
            let mut all_ranges = search.reaches().into_iter().zip(list.within);
            all_ranges.all(|(reach, within)| reach * (1.0 + ROUNDING) + list.accumulated_motion <= within)
        })
    }

    /// Lists the candidates of one pair again, with refitted trees. Returns true if memory sufficed.
    pub fn relist(&mut self, pair: usize, search: &PairSearch) -> bool {
        let list = self.is_valid.then(|| self.list_pair(Some(search))).flatten();
        let slot = self.lists.get_mut(pair);
        list.zip(slot).map(|(list, slot)| *slot = list).is_some()
    }

    /// Lists the candidates of all searches, with refitted trees. `None` is a pair that does not collide. If memory is
    /// short, the lists are off in this step.
    pub fn list_all<'a>(&mut self, searches: impl Iterator<Item = Option<PairSearch<'a>>> + Clone) {
        while self.margin_fraction > 0.0 {
            self.lists.clear();
            self.runs.clear();
            self.features.clear();
            let mut lists = searches.clone().map(|search| {
                let list = self.list_pair(search.as_ref())?;
                push_within_capacity(&mut self.lists, list)
            });
            self.is_valid = lists.all(|list| list.is_some());
            if self.is_valid {
                return;
            }
            self.margin_fraction = if self.margin_fraction == 1.0 {
                REDUCED_MARGIN
            } else {
                0.0
            };
        }
        self.is_valid = false;
    }

    fn list_pair(&mut self, search: Option<&PairSearch>) -> Option<CandidateList> {
        let first = self.runs.len() as u32;
        let mut list = CandidateList {
            first,
            ends: [first; 3],
            within: [0.0; 2],
            accumulated_motion: 0.0,
        };
        if let Some(search) = search {
            list.within = search
                .reaches()
                .map(|reach| reach + self.margin_fraction * search.list_margin());
            let ([a, b], [corner_reach, edge_reach]) = (search.search_sides, list.within);
            self.list_corners(search, [a, b], corner_reach)?;
            list.ends[0] = self.runs.len() as u32;
            if !search.is_self_contact() {
                self.list_corners(search, [b, a], corner_reach)?;
            }
            list.ends[1] = self.runs.len() as u32;
            self.list_edges(search, edge_reach)?;
            list.ends[2] = self.runs.len() as u32;
        }
        Some(list)
    }

    /// Returns the candidate list of a pair.
    pub fn view(&mut self, pair: usize) -> Option<CandidateView<'_>> {
        let list = self.lists.get(pair).filter(|_| self.is_valid)?;
        let [a, b, c] = list.ends.map(|end| (end - list.first) as usize);
        let runs = self.runs.get_mut(list.first as usize..list.ends[2] as usize)?;
        let (corners, edges) = runs[..c].split_at_mut(b);
        let (first_corners, second_corners) = corners.split_at_mut(a);
        Some(CandidateView {
            runs: [first_corners, second_corners, edges],
            features: &mut self.features,
            accumulated_motion: list.accumulated_motion,
        })
    }

    fn list_corners(
        &mut self,
        search: &PairSearch,
        [corner_side, face_side]: [SearchSide; 2],
        within: f32,
    ) -> Option<()> {
        let surface = face_side.surface;
        let shift = super::search::shift(corner_side.surface, surface);
        let around = surface.forest.bounds().extended(within);
        for (index, &node) in corner_side.surface.nodes.iter().enumerate() {
            let position = corner_side.surface.start(node) + shift;
            let here = Aabb::of([position].into_iter());
            if !around.overlaps(&here) {
                continue;
            }
            self.push_run(index, |visit| {
                surface.visit_near(&here, within, |triangle| {
                    let nodes = surface.triangles[triangle];
                    let distance_bound = search.listing_distance([position; 2], face_side, &nodes);
                    if distance_bound <= within && !search.are_neighbors([node; 2], &nodes, distance_bound) {
                        visit(triangle as u32, distance_bound);
                    }
                });
            })?;
        }
        Some(())
    }

    fn list_edges(&mut self, search: &PairSearch, within: f32) -> Option<()> {
        let [first, second] = search.search_sides;
        let shift = super::search::shift(first.surface, second.surface);
        let around = second.surface.forest.bounds().extended(within);
        for (index, &edge) in first.surface.edges.iter().enumerate() {
            if first.surface.is_crossing[index] || edge[0] == NONE {
                continue;
            }
            let ends = edge.map(|node| first.surface.start(node) + shift);
            let here = Aabb::of(ends.into_iter());
            if !around.overlaps(&here) {
                continue;
            }
            self.push_run(index, |visit| {
                second.surface.visit_near(&here, within, |triangle| {
                    for other in second
                        .surface
                        .owned_edges(triangle)
                        .into_iter()
                        .filter(|&other| other != NONE)
                    {
                        let nodes = second.surface.edges[other as usize];
                        let distance_bound = search.listing_distance(ends, second, &nodes);
                        let is_other = !search.is_self_contact() || nodes > edge;
                        if distance_bound <= within && is_other && !search.are_neighbors(edge, &nodes, distance_bound) {
                            visit(other, distance_bound);
                        }
                    }
                });
            })?;
        }
        Some(())
    }

    /// Adds the run of a corner or edge, if it has candidates.
    fn push_run(&mut self, index: usize, find_candidates: impl FnOnce(&mut dyn FnMut(u32, f32))) -> Option<()> {
        let first = self.features.len();
        let mut has_room = true;
        let mut nearest = f32::INFINITY;
        let features = &mut self.features;
        find_candidates(&mut |feature, distance_bound| {
            nearest = nearest.min(distance_bound);
            has_room = has_room
                && push_within_capacity(
                    features,
                    CandidateFeature {
                        feature,
                        distance_bound,
                    },
                )
                .is_some();
        });
        if !has_room {
            return None;
        }
        if self.features.len() > first {
            self.features[first..].sort_unstable_by_key(|candidate| candidate.feature);
            let run = CandidateRun {
                index: index as u32,
                first: first as u32,
                end: self.features.len() as u32,
                distance_bound: nearest,
                was_outside: false,
            };
            push_within_capacity(&mut self.runs, run)?;
        }
        Some(())
    }
}

impl PairSearch<'_> {
    /// Returns the distance within which any contact is possible, m.
    pub fn contact_reach(&self) -> f32 {
        if self.is_self_contact() {
            return self.edge_reach();
        }
        let [a, b] = self.search_sides.map(|search_side| self.ejection_depth_in(search_side));
        (self.radius + self.speculative_margin).max(a).max(b) + self.motion
    }

    /// Returns the distance within which contact of edges is possible, m. Edges are not pushed out of bodies.
    pub fn edge_reach(&self) -> f32 {
        self.radius + self.speculative_margin + self.motion
    }

    /// Returns the distances within which contact of corners with faces, and of edges, is possible, m.
    fn reaches(&self) -> [f32; 2] {
        [self.contact_reach(), self.edge_reach()]
    }

    /// Returns the additional distance within which candidates are listed, m.
    fn list_margin(&self) -> f32 {
        let [a, b] = self.search_sides.map(|search_side| search_side.surface.short_edge);
        let short_edge = a.min(b);
        (MARGIN_SUBSTEPS * self.motion).clamp(MIN_MARGIN * short_edge, MAX_MARGIN * short_edge)
    }

    /// Returns the distance of a corner or edge from another feature, m. Self-contact uses the distance of their
    /// bounds, because most candidates are skipped before they are compared.
    fn listing_distance(&self, ends: [Vec3; 2], search_side: SearchSide, nodes: &[u32]) -> f32 {
        let corners = Corners::still(nodes.iter().map(|&node| search_side.surface.node_motion(node).start));
        let ends = ends.map(Vec3A::from);
        if self.is_self_contact() {
            return Extent::of(ends.into_iter()).distance_squared(&corners.bounds()).sqrt();
        }
        corners.separation(&Segment::still(ends), 0.0).offset.length()
    }

    /// True if two features of one surface never collide. `distance_bound` is the distance of their bounds, m.
    fn are_neighbors(&self, nodes: [u32; 2], others: &[u32], distance_bound: f32) -> bool {
        let surface = self.search_sides[0].surface;
        self.is_self_contact()
            && (others.iter().any(|node| nodes.contains(node))
                || surface.are_in_wound(nodes, others)
                // For features that are further apart now, this test costs more than it saves.
                || distance_bound <= self.radius && surface.are_neighbors(nodes, others, self.radius))
    }
}

/// Appends a value if the capacity allows it.
fn push_within_capacity<T>(values: &mut Vec<T>, value: T) -> Option<()> {
    let has_room = values.len() < values.capacity();
    has_room.then(|| values.push(value))
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::topology_change::tests::self_colliding_body;
    use super::*;
    use crate::cutting::Sweep;
    use crate::mesh::Mesh;
    use crate::random::Random;
    use crate::{BodyId, Solver, World, WorldDefinition};

    pub fn world(mesh: &Mesh, solver: Solver, thickness: f32) -> (World, BodyId) {
        let mut world = World::new(WorldDefinition::default()).expect("a world");
        let mut definition = self_colliding_body(mesh);
        definition.contact.thickness = thickness;
        definition.solver = solver;
        let id = world.create_body(&definition).expect("a body");
        // Velocities toward the middle crumple the body.
        let mut random = Random(9);
        let velocities: Vec<Vec3> = mesh
            .positions
            .iter()
            .map(|position| Vec3::new(-40.0 * position.x, random.below(1000) as f32 * 1e-3, -30.0 * position.z))
            .collect();
        world
            .body_mut(id)
            .expect("a body")
            .set_velocities(&velocities)
            .expect("velocities");
        (world, id)
    }

    fn candidate_pairs(world: &mut World) -> &mut CandidatePairs {
        &mut world
            .deformable_contact
            .as_mut()
            .expect("it meets itself")
            .candidate_pairs
    }

    #[test]
    fn stored_candidates_change_no_bit() {
        let sheet = Mesh::cloth([0.1; 2], [8; 2]).expect("a cloth");
        let block = Mesh::block([0.05; 3], [3; 3]).expect("a block");
        let mut kept = 0;
        let mut met = 0;
        for (mesh, thickness) in [(&sheet, 0.0), (&sheet, 0.002), (&block, 0.0), (&block, 0.001)] {
            for solver in [Solver::Verlet, Solver::Implicit] {
                let [(mut one, id), (mut other, same)] = [0, 1].map(|_| world(mesh, solver, thickness));
                for step in 0..40 {
                    if step % 15 == 5 {
                        let at = step as f32 * 1e-3 - 0.015;
                        let sweep = Sweep {
                            start: [Vec3::new(at, -0.2, -0.2), Vec3::new(at, -0.2, 0.01)],
                            end: [Vec3::new(at, 0.2, -0.2), Vec3::new(at, 0.2, 0.01)],
                        };
                        one.cut(id, &sweep).expect("a cut");
                        other.cut(same, &sweep).expect("a cut");
                    }
                    // Without capacity only the tree search remains.
                    *candidate_pairs(&mut other) = CandidatePairs::default();
                    one.step(1e-3).expect("a step");
                    other.step(1e-3).expect("a step");
                    let [found, searched] =
                        [(&one, id), (&other, same)].map(|(world, id)| world.body(id).expect("a body"));
                    let what = format!("{solver:?}, {thickness} m, step {step}");
                    assert_eq!(found.positions(), searched.positions(), "{what}");
                    assert_eq!(found.velocities(), searched.velocities(), "{what}");
                    assert!(!candidate_pairs(&mut other).is_valid);
                    let listed = candidate_pairs(&mut one);
                    kept += usize::from(listed.is_valid);
                    met += usize::from(listed.is_valid && !listed.features.is_empty());
                }
            }
        }
        assert!(kept > 250 && met > 150, "{kept} {met}");
    }
}
