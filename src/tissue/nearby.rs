//! What of a surface is near itself, kept until something may have come near that was not: most of what a substep would find is what the one before
//! found (Verlet 1967).
//!
//! What is met is told by distances alone, not by what is kept: a world that finds it anew would go on as one that does not.

use glam::Vec3;

use super::skin::{NONE, Skin};
use crate::base::{Result, memory};
use crate::codec::saved;
use crate::contact::sweep::{Corners, Segment};
use crate::geometry::Bounds;
use crate::geometry::predicates::crosses;

/// It reaches this part of a short edge further than it has to, at most: it holds the longer, and there is the more of it.
const MARGIN: f32 = 0.25;

/// Triangles that there is room for, for each corner and edge.
const ROOM: usize = 4;

/// Without room it reaches half as far the next time, after so many times that it is not tried.
const WAIT: u32 = 32;

/// What rounding may take from how long it holds, as a part of that.
const ROUNDING: f32 = 1e-3;

/// The triangles near each corner and edge of a surface.
#[derive(Debug)]
pub(super) struct Nearby {
    is_found: bool,
    /// What was no further apart than this is in it, m; and triangles that edges were this near to, whether or not they may meet.
    within: f32,
    margin: f32,
    /// What the margin is to be, as a part of a short edge, and how often it is not to be tried yet.
    share: f32,
    waits: u32,
    /// Where the corners were.
    places: Vec<Vec3>,
    /// Where the triangles of each corner, and then of each edge, begin, and where the last ones end.
    firsts: Vec<u32>,
    triangles: Vec<u32>,
}

saved! { Nearby { is_found, within, margin, share, waits, places, firsts, triangles } }

impl Nearby {
    /// Nothing yet, with room for a surface of so many corners and edges.
    pub fn new(corners: usize, edges: usize) -> Result<Self> {
        let mut nearby = Self {
            is_found: false,
            within: 0.0,
            margin: 0.0,
            share: MARGIN,
            waits: 0,
            places: Vec::new(),
            firsts: Vec::new(),
            triangles: Vec::new(),
        };
        nearby.reserve(corners, edges)?;
        Ok(nearby)
    }

    /// Makes room for a surface of so many corners and edges.
    pub fn reserve(&mut self, corners: usize, edges: usize) -> Result<()> {
        memory::reserve(&mut self.places, corners)?;
        memory::reserve(&mut self.firsts, corners + edges + 1)?;
        memory::reserve(&mut self.triangles, ROOM * (corners + edges))
    }

    /// The surface is another.
    pub fn forget(&mut self) {
        self.is_found = false;
        self.waits = 0;
    }

    /// The triangles near a corner, or near the edge whose number follows those of corners; `None` where they are not known.
    pub fn of(&self, number: usize) -> Option<&[u32]> {
        let [first, end] = [number, number + 1].map(|number| self.firsts.get(number));
        let of_it = *first? as usize..*end? as usize;
        self.triangles.get(of_it).filter(|_| self.is_found)
    }

    /// Whether everything is in it that is no further apart by now than this, m, and that edges pass through.
    pub fn holds(&self, skin: &Skin, apart: f32) -> bool {
        if !self.is_found {
            return false;
        }
        let ways = skin.nodes.iter().zip(&self.places);
        let ways = Bounds::of(ways.map(|(&node, &place)| skin.starts.get(node as usize) - place));
        let moved = (ways.max - ways.min).length();
        let may_move = self.margin.min(self.within - apart) * (1.0 - ROUNDING);
        moved <= may_move
    }

    /// Finds what is no further apart than `apart`, m, and some more, by the surface's trees, which are where it is, of what keeps `radius` apart.
    /// Without room it knows nothing.
    pub fn find(&mut self, skin: &Skin, apart: f32, radius: f32) {
        self.is_found = false;
        if self.waits > 0 {
            self.waits -= 1;
            return;
        }
        self.margin = self.share * skin.short;
        self.within = apart + self.margin;
        self.is_found = self.try_find(skin, radius).is_some();
        if !self.is_found {
            (self.share, self.waits) = (0.5 * self.share, WAIT);
        } else if self.triangles.len() < self.triangles.capacity() / 8 {
            self.share = MARGIN.min(2.0 * self.share);
        }
    }

    fn try_find(&mut self, skin: &Skin, radius: f32) -> Option<()> {
        self.places.clear();
        self.firsts.clear();
        self.triangles.clear();
        for &node in &skin.nodes {
            let place = skin.starts.get(node as usize);
            put(&mut self.places, place)?;
            let segment = Segment {
                ends: [place; 2],
                steps: [Vec3::ZERO; 2],
                radius: 0.0,
            };
            self.gather(skin, &segment, |triangle, within, _| {
                let nodes = skin.triangles[triangle];
                !nodes.contains(&node)
                    && distance(skin, &segment, &nodes) <= within
                    && !skin.are_of_wound([node; 2], &nodes)
                    && !skin.are_neighbours([node; 2], &nodes, radius)
            })?;
        }
        for &edge in &skin.edges {
            let ends = edge.map(|node| {
                if edge[0] == NONE {
                    Vec3::INFINITY
                } else {
                    skin.starts.get(node as usize)
                }
            });
            let segment = Segment {
                ends,
                steps: [Vec3::ZERO; 2],
                radius: 0.0,
            };
            self.gather(skin, &segment, |triangle, within, margin| {
                let nodes = skin.triangles[triangle];
                let mut sides = skin.owned(triangle).into_iter().filter(|&side| side != NONE);
                sides.any(|side| {
                    let side = skin.edges[side as usize];
                    side > edge
                        && !side.iter().any(|node| edge.contains(node))
                        && distance(skin, &segment, &side) <= within
                        && !skin.are_neighbours(edge, &side, radius)
                }) || !edge.iter().any(|node| nodes.contains(node)) && is_near(skin, &segment, nodes, margin)
            })?;
        }
        put(&mut self.firsts, self.triangles.len() as u32)
    }

    /// The triangles of one more corner or edge, in ascending order.
    fn gather(&mut self, skin: &Skin, segment: &Segment, is_of_it: impl Fn(usize, f32, f32) -> bool) -> Option<()> {
        let first = self.triangles.len();
        put(&mut self.firsts, first as u32)?;
        if !segment.ends[0].is_finite() {
            return Some(());
        }
        let mut has_room = true;
        let (within, margin, triangles) = (self.within, self.margin, &mut self.triangles);
        skin.near(&Bounds::of(segment.ends.into_iter()), within, |triangle| {
            if has_room && is_of_it(triangle, within, margin) {
                has_room = put(triangles, triangle as u32).is_some();
            }
        });
        self.triangles[first..].sort_unstable();
        has_room.then_some(())
    }
}

/// Adds a value where there is room for it.
fn put<T>(values: &mut Vec<T>, value: T) -> Option<()> {
    let has_room = values.len() < values.capacity();
    has_room.then(|| values.push(value))
}

/// From a corner or an edge to an edge, or from a corner to a triangle.
fn distance(skin: &Skin, segment: &Segment, others: &[u32]) -> f32 {
    let mut corners = Corners {
        points: [Vec3::ZERO; 3],
        steps: [Vec3::ZERO; 3],
        count: others.len(),
    };
    for (point, &other) in corners.points.iter_mut().zip(others) {
        *point = skin.starts.get(other as usize);
    }
    corners.separation(segment, 0.0).offset.length()
}

/// Whether an edge is no further from a triangle than `margin`.
fn is_near(skin: &Skin, edge: &Segment, [a, b, c]: [u32; 3], margin: f32) -> bool {
    let end = |index: usize| distance(skin, &edge.end(index), &[a, b, c]);
    let side = |of: [u32; 2]| distance(skin, edge, &of);
    let corners = [a, b, c].map(|node| skin.starts.get(node as usize));
    end(0) <= margin
        || end(1) <= margin
        || [[a, b], [b, c], [c, a]].into_iter().any(|of| side(of) <= margin)
        || crosses(edge.ends[0], edge.ends[1], corners, 0.0)
}

#[cfg(test)]
mod tests {
    use super::super::change::tests::meets_itself;
    use super::*;
    use crate::cutting::Sweep;
    use crate::mesh::Mesh;
    use crate::random::Random;
    use crate::{BodyId, Solver, World, WorldDefinition};

    fn world(mesh: &Mesh, solver: Solver, thickness: f32) -> (World, BodyId) {
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

    fn skin(world: &mut World) -> &mut Skin {
        world
            .tissue
            .as_mut()
            .and_then(|tissue| tissue.skin_mut(0))
            .expect("it meets itself")
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
                    let none = Nearby::new(0, 0).expect("memory");
                    **skin(&mut other).nearby.as_mut().expect("it meets itself") = none;
                    one.step(1e-3).expect("a step");
                    other.step(1e-3).expect("a step");
                    let [found, searched] =
                        [(&one, id), (&other, same)].map(|(world, id)| world.body(id).expect("a body"));
                    let what = format!("{solver:?}, {thickness} m, step {step}");
                    assert_eq!(found.positions(), searched.positions(), "{what}");
                    assert_eq!(found.velocities(), searched.velocities(), "{what}");
                    let [nearby, none] =
                        [&mut one, &mut other].map(|world| skin(world).nearby.as_ref().expect("it meets itself"));
                    assert!(!none.is_found);
                    kept += usize::from(nearby.is_found);
                    met += usize::from(nearby.is_found && !nearby.triangles.is_empty());
                }
            }
        }
        assert!(kept > 250 && met > 150, "{kept} {met}");
    }
}
