//! What of two bodies is near each other, or of one near itself, kept from substep to substep of a step, until they may have come nearer than was
//! looked for (Verlet 1967).
//!
//! Beside each corner and edge, and each feature near it, stands how far the bodies may move against each other before these can touch: until then they
//! are passed over. A substep so examines what touches and next to nothing else. What is found is a matter of distances alone: a search by the trees
//! finds the same.

use glam::{Vec3, Vec3A};

use super::search::{PairSearch, Party};
use super::skin::{NONE, Skin};
use crate::base::{Result, memory};
use crate::codec::saved;
use crate::contact::sweep::{Corners, Extent, Segment};
use crate::geometry::Bounds;

/// What is listed may come this part of a short edge nearer before all is looked for again, at least and at most, and in between as far as in so
/// many substeps.
const LEAST_MARGIN: f32 = 0.05;
const MOST_MARGIN: f32 = 0.5;
const SUBSTEPS: f32 = 16.0;

/// Where there is no room for what such a margin lists, this part of it is tried.
const SHORTER: f32 = 0.25;

/// Features near corners and edges that there is room for, for each of those: of other bodies, and of the same one.
const ROOM: usize = 4;
const ROOM_WITH_ITSELF: usize = 24;

/// What rounding may take from distances, as a part of them.
const ROUNDING: f32 = 1e-3;

/// A feature of the other body near a corner or an edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct Near {
    /// A triangle near a corner, an edge near an edge.
    pub feature: u32,
    /// How far apart they or the boxes about them were when last compared, together with how far the bodies had moved by then, m.
    pub apart: f32,
}

saved! { Near { feature, apart } }

/// A corner or an edge, and what of the other body is near it.
#[derive(Clone, Copy, Debug)]
pub(super) struct NearRun {
    /// Its place among those of its surface.
    pub number: u32,
    first: u32,
    end: u32,
    /// How far apart it and they were, together with how far the bodies had moved by then, m.
    pub apart: f32,
    /// Whether it was outside the other body when that was seen last.
    pub is_outside: bool,
}

saved! { NearRun { number, first, end, apart, is_outside } }

/// What of two bodies is near: corners of the first with triangles of the second, the other way round, and edges with edges.
#[derive(Clone, Copy, Debug)]
struct List {
    first: u32,
    ends: [u32; 3],
    /// All corners and faces, and all edges, that were no further apart than this are listed, m.
    within: [f32; 2],
    /// How far the bodies have moved against each other since, at most, m.
    moved: f32,
}

saved! { List { first, ends, within, moved } }

/// The lists of the near pairs of an island, in their order.
#[derive(Debug, Default)]
pub(super) struct Pairs {
    is_known: bool,
    /// What part of their margins there is room for in this step; 0: for none.
    room: f32,
    lists: Vec<List>,
    runs: Vec<NearRun>,
    features: Vec<Near>,
}

saved! { Pairs { is_known, room, lists, runs, features } }

/// The list of one pair, to be gone through.
pub(super) struct Known<'a> {
    pub runs: [&'a mut [NearRun]; 3],
    pub features: &'a mut [Near],
    pub moved: f32,
}

impl NearRun {
    /// What is near it, of all features that are listed.
    pub fn of<'a>(&self, features: &'a mut [Near]) -> &'a mut [Near] {
        &mut features[self.first as usize..self.end as usize]
    }

    /// Has edges that met nothing, as they were flat, be compared again after bodies have moved so far.
    fn compare_flat(&mut self, features: &mut [Near], moved: f32) {
        for near in self.of(features) {
            if near.apart == f32::INFINITY {
                (near.apart, self.apart) = (moved, self.apart.min(moved));
            }
        }
    }

    /// How far away anything is at most that it can meet, m, after bodies have moved so far: only what may be inside another is led out of it.
    pub fn reach(&self, search: &PairSearch, moved: f32) -> f32 {
        if self.is_outside && self.apart > moved {
            search.reach_of_edges()
        } else {
            search.reach()
        }
    }
}

impl Pairs {
    /// Makes room for so many lists of surfaces: of so many corners and edges that may meet other bodies, and that may meet their own.
    pub fn reserve(&mut self, lists: usize, [with_bodies, with_itself]: [usize; 2]) -> Result<()> {
        memory::reserve_in_steps(&mut self.lists, lists)?;
        memory::reserve_in_steps(&mut self.runs, with_bodies + with_itself)?;
        memory::reserve_in_steps(&mut self.features, ROOM * with_bodies + ROOM_WITH_ITSELF * with_itself)
    }

    /// A step of an island begins.
    pub fn forget(&mut self) {
        (self.is_known, self.room) = (false, 1.0);
    }

    /// Takes into account how far bodies went since they were looked at last, and which have bent; within a substep the latter alone.
    pub fn advance(&mut self, pairs: impl Iterator<Item = [usize; 2]>, skins: &[Option<Skin>], have_moved: bool) {
        if !self.is_known {
            return;
        }
        for (list, [a, b]) in self.lists.iter_mut().zip(pairs) {
            if let (Some(Some(first)), Some(Some(second))) = (skins.get(a), skins.get(b)) {
                if have_moved {
                    let (a, b) = (&first.moved, &second.moved);
                    let most = (a.max - b.min).abs().max((b.max - a.min).abs()).length();
                    list.moved += most * (1.0 + ROUNDING);
                }
                if first.has_bent || second.has_bent {
                    let edges = &mut self.runs[list.ends[1] as usize..list.ends[2] as usize];
                    for run in edges {
                        run.compare_flat(&mut self.features, list.moved);
                    }
                }
            }
        }
    }

    /// Whether everything that can meet in this search is in the list of the pair.
    pub fn holds(&self, pair: usize, search: &PairSearch) -> bool {
        let list = self.lists.get(pair).filter(|_| self.is_known);
        list.is_some_and(|list| {
            let mut all = search.reaches().into_iter().zip(list.within);
            all.all(|(reach, within)| reach * (1.0 + ROUNDING) + list.moved <= within)
        })
    }

    /// Lists anew what is near in the search of one pair, by trees that are where the surfaces are: whether there was room.
    pub fn renew(&mut self, pair: usize, search: &PairSearch) -> bool {
        let list = self.is_known.then(|| self.list(Some(search))).flatten();
        let place = self.lists.get_mut(pair);
        list.zip(place).map(|(list, place)| *place = list).is_some()
    }

    /// Lists what is near in each of these searches, by trees that are where the surfaces are; `None`: one that does not meet. Without room nothing is
    /// known in this step.
    pub fn find<'a>(&mut self, searches: impl Iterator<Item = Option<PairSearch<'a>>> + Clone) {
        while self.room > 0.0 {
            self.lists.clear();
            self.runs.clear();
            self.features.clear();
            let mut lists = searches.clone().map(|search| {
                let list = self.list(search.as_ref())?;
                put(&mut self.lists, list)
            });
            self.is_known = lists.all(|list| list.is_some());
            if self.is_known {
                return;
            }
            self.room = if self.room == 1.0 { SHORTER } else { 0.0 };
        }
        self.is_known = false;
    }

    fn list(&mut self, search: Option<&PairSearch>) -> Option<List> {
        let first = self.runs.len() as u32;
        let mut list = List {
            first,
            ends: [first; 3],
            within: [0.0; 2],
            moved: 0.0,
        };
        if let Some(search) = search {
            list.within = search.reaches().map(|reach| reach + self.room * search.margin());
            let ([a, b], [of_corners, of_edges]) = (search.parties, list.within);
            self.corners(search, [a, b], of_corners)?;
            list.ends[0] = self.runs.len() as u32;
            if !search.is_of_one() {
                self.corners(search, [b, a], of_corners)?;
            }
            list.ends[1] = self.runs.len() as u32;
            self.edges(search, of_edges)?;
            list.ends[2] = self.runs.len() as u32;
        }
        Some(list)
    }

    /// The list of a pair.
    pub fn of(&mut self, pair: usize) -> Option<Known<'_>> {
        let list = self.lists.get(pair).filter(|_| self.is_known)?;
        let [a, b, c] = list.ends.map(|end| (end - list.first) as usize);
        let runs = self.runs.get_mut(list.first as usize..list.ends[2] as usize)?;
        let (corners, edges) = runs[..c].split_at_mut(b);
        let (of_first, of_second) = corners.split_at_mut(a);
        Some(Known {
            runs: [of_first, of_second, edges],
            features: &mut self.features,
            moved: list.moved,
        })
    }

    fn corners(&mut self, search: &PairSearch, [of_nodes, of_faces]: [Party; 2], within: f32) -> Option<()> {
        let skin = of_faces.skin;
        let shift = super::search::shift(of_nodes.skin, skin);
        let around = skin.forest.bounds().extended(within);
        for (number, &node) in of_nodes.skin.nodes.iter().enumerate() {
            let place = of_nodes.skin.start(node) + shift;
            let here = Bounds::of([place].into_iter());
            if !around.overlaps(&here) {
                continue;
            }
            self.gather(number, |see| {
                skin.near(&here, within, |triangle| {
                    let nodes = skin.triangles[triangle];
                    let apart = search.apart_in_list([place; 2], of_faces, &nodes);
                    if apart <= within && !search.are_neighbours([node; 2], &nodes, apart) {
                        see(triangle as u32, apart);
                    }
                });
            })?;
        }
        Some(())
    }

    fn edges(&mut self, search: &PairSearch, within: f32) -> Option<()> {
        let [first, second] = search.parties;
        let shift = super::search::shift(first.skin, second.skin);
        let around = second.skin.forest.bounds().extended(within);
        for (number, &edge) in first.skin.edges.iter().enumerate() {
            if first.skin.pierces[number] || edge[0] == NONE {
                continue;
            }
            let ends = edge.map(|node| first.skin.start(node) + shift);
            let here = Bounds::of(ends.into_iter());
            if !around.overlaps(&here) {
                continue;
            }
            self.gather(number, |see| {
                second.skin.near(&here, within, |triangle| {
                    for other in second.skin.owned(triangle).into_iter().filter(|&other| other != NONE) {
                        let nodes = second.skin.edges[other as usize];
                        let apart = search.apart_in_list(ends, second, &nodes);
                        let is_later = !search.is_of_one() || nodes > edge;
                        if apart <= within && is_later && !search.are_neighbours(edge, &nodes, apart) {
                            see(other, apart);
                        }
                    }
                });
            })?;
        }
        Some(())
    }

    /// The run of one more corner or edge, if anything is near it.
    fn gather(&mut self, number: usize, near: impl FnOnce(&mut dyn FnMut(u32, f32))) -> Option<()> {
        let first = self.features.len();
        let mut has_room = true;
        let mut nearest = f32::INFINITY;
        let features = &mut self.features;
        near(&mut |feature, apart| {
            nearest = nearest.min(apart);
            has_room = has_room && put(features, Near { feature, apart }).is_some();
        });
        if !has_room {
            return None;
        }
        if self.features.len() > first {
            self.features[first..].sort_unstable_by_key(|near| near.feature);
            let run = NearRun {
                number: number as u32,
                first: first as u32,
                end: self.features.len() as u32,
                apart: nearest,
                is_outside: false,
            };
            put(&mut self.runs, run)?;
        }
        Some(())
    }
}

impl PairSearch<'_> {
    /// How far apart anything is at most that can meet, m.
    pub fn reach(&self) -> f32 {
        if self.is_of_one() {
            return self.reach_of_edges();
        }
        let [a, b] = self.parties.map(|party| self.depth_in(party));
        (self.radius + self.ahead).max(a).max(b) + self.motion
    }

    /// The same of edges: none is led out of a body.
    pub fn reach_of_edges(&self) -> f32 {
        self.radius + self.ahead + self.motion
    }

    /// How far apart corners and faces, and edges, are at most that can meet, m.
    fn reaches(&self) -> [f32; 2] {
        [self.reach(), self.reach_of_edges()]
    }

    /// How much further away than that is listed, m.
    fn margin(&self) -> f32 {
        let [a, b] = self.parties.map(|party| party.skin.short);
        let short = a.min(b);
        (SUBSTEPS * self.motion).clamp(LEAST_MARGIN * short, MOST_MARGIN * short)
    }

    /// How far a corner or an edge is from others, m, or how far the boxes about them are: a surface near itself is near much of itself, and most of that
    /// goes by before it is compared.
    fn apart_in_list(&self, ends: [Vec3; 2], party: Party, nodes: &[u32]) -> f32 {
        let corners = Corners::still(nodes.iter().map(|&node| party.skin.own_way(node).start));
        let ends = ends.map(Vec3A::from);
        if self.is_of_one() {
            return Extent::of(ends.into_iter()).distance_squared(&corners.bounds()).sqrt();
        }
        corners.separation(&Segment::still(ends), 0.0).offset.length()
    }

    /// Whether a corner or an edge and others, whose boxes are so far apart, m, are of one surface and never meet.
    fn are_neighbours(&self, nodes: [u32; 2], others: &[u32], apart: f32) -> bool {
        let skin = self.parties[0].skin;
        self.is_of_one()
            && (others.iter().any(|node| nodes.contains(node))
                || skin.are_of_wound(nodes, others)
                // What is further away now is not worth the question.
                || apart <= self.radius && skin.are_neighbours(nodes, others, self.radius))
    }
}

/// Adds a value where there is room for it.
fn put<T>(values: &mut Vec<T>, value: T) -> Option<()> {
    let has_room = values.len() < values.capacity();
    has_room.then(|| values.push(value))
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::change::tests::meets_itself;
    use super::*;
    use crate::cutting::Sweep;
    use crate::mesh::Mesh;
    use crate::random::Random;
    use crate::{BodyId, Solver, World, WorldDefinition};

    pub fn world(mesh: &Mesh, solver: Solver, thickness: f32) -> (World, BodyId) {
        let mut world = World::new(WorldDefinition::default()).expect("a world");
        let mut definition = meets_itself(mesh);
        definition.contact.thickness = thickness;
        definition.solver = solver;
        let id = world.create_body(&definition).expect("a body");
        // What is thrown together from both ends is crumpled.
        let mut random = Random(9);
        let velocities: Vec<Vec3> = mesh
            .positions
            .iter()
            .map(|place| Vec3::new(-40.0 * place.x, random.below(1000) as f32 * 1e-3, -30.0 * place.z))
            .collect();
        world
            .body_mut(id)
            .expect("a body")
            .set_velocities(&velocities)
            .expect("velocities");
        (world, id)
    }

    fn pairs(world: &mut World) -> &mut Pairs {
        &mut world.tissue.as_mut().expect("it meets itself").pairs
    }

    #[test]
    fn what_is_kept_changes_no_bit() {
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
                    // Without room there is but the search.
                    *pairs(&mut other) = Pairs::default();
                    one.step(1e-3).expect("a step");
                    other.step(1e-3).expect("a step");
                    let [found, searched] =
                        [(&one, id), (&other, same)].map(|(world, id)| world.body(id).expect("a body"));
                    let what = format!("{solver:?}, {thickness} m, step {step}");
                    assert_eq!(found.positions(), searched.positions(), "{what}");
                    assert_eq!(found.velocities(), searched.velocities(), "{what}");
                    assert!(!pairs(&mut other).is_known);
                    let listed = pairs(&mut one);
                    kept += usize::from(listed.is_known);
                    met += usize::from(listed.is_known && !listed.features.is_empty());
                }
            }
        }
        assert!(kept > 250 && met > 150, "{kept} {met}");
    }
}
