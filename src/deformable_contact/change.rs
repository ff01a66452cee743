//! A skin that follows its body as that is cut: what a change costs does not depend on the rest of it.

use glam::{Vec3, Vec3A};

use super::skin::{ELSEWHERE, NONE, NodeWay, Skin, number_of};
use super::wound::Wound;
use crate::base::{Result, memory};
use crate::codec::saved;
use crate::contact::SurfaceChange;
use crate::geometry::forest::Later;
use crate::mesh::ends_of;
use crate::nodes::{self, Bound, NewNode};
use crate::soa::Vectors;
use crate::solver::System;

/// An edge that is none.
const HOLE: [u32; 2] = [NONE; 2];

/// A number is that of a corner.
const CORNER: u8 = 1;
/// It is that of a corner, or of a node that moves one.
const TAKEN: u8 = 2;

/// What a skin that may be cut keeps beside what others do.
#[derive(Debug)]
pub(super) struct Changing {
    /// Nodes that are no corners, but move some.
    pub movers: Vec<u32>,
    /// For each of the body's numbers what it is to the skin.
    roles: Vec<u8>,
    /// The triangles of each edge: the first one is that which it is looked at with.
    triangles: Vec<[u32; 2]>,
    /// Numbers of the body as it was made are below.
    pub first_later: u32,
    /// What cuts have bared of solids.
    pub wound: Option<Wound>,
}

saved! { Changing { movers, roles, triangles, first_later, wound } }

/// A body's surface as it is to be, and what moves it.
pub(crate) struct SurfaceToBe<'a> {
    /// In the caller's numbers.
    pub change: &'a SurfaceChange<'a>,
    /// Of each triangle that changes, and then of those that are added, whether it was bared.
    pub bared: &'a [bool],
    /// The nodes that are to come.
    pub nodes: &'a [NewNode],
    /// All points that are new, or bound to other nodes than they were.
    pub bound: &'a [Bound],
    /// Whether there is a rim where there was none, so that it encloses nothing.
    pub is_open: bool,
}

/// What becomes of a skin, with all the memory that it takes.
pub(crate) struct SkinChange {
    node_count: usize,
    /// The triangles, by their numbers, with the edges of each.
    triangles: Vec<(usize, [u32; 3], [u32; 3])>,
    /// The numbers of edges, the edges, and the triangles of each.
    edges: Vec<(usize, [u32; 2], [u32; 2])>,
    edge_count: usize,
    tree: Option<Later>,
    movers: Vec<u32>,
    /// Where new numbers were at first.
    firsts: Vec<Vec3>,
    bared: Vec<u32>,
    is_open: bool,
}

impl Changing {
    /// For a body's skin with so many edges and these of each triangle, marked.
    pub fn new(body: &System, nodes: &[u32], edges: usize, sides: &[[u32; 3]]) -> Result<Self> {
        let spare = body.spare_nodes();
        let mut of_edge = memory::reserved(edges + 3 * spare)?;
        of_edge.resize(edges, HOLE);
        for (number, &own) in (0..).zip(sides) {
            for side in own.into_iter().filter(|&side| side != NONE) {
                join(&mut of_edge[number_of(side) as usize], number);
            }
        }
        let mut roles = memory::reserved(body.node_count() + spare)?;
        roles.resize(body.node_count(), 0);
        for &node in nodes {
            roles[node as usize] = CORNER | TAKEN;
        }
        let wound = body.contact.with_itself && body.may_be_cut.is_some_and(|cut| cut.is_solid);
        Ok(Self {
            movers: Vec::new(),
            roles,
            triangles: of_edge,
            first_later: body.node_count() as u32,
            wound: wound.then(|| Wound::new(body, sides.len())).transpose()?,
        })
    }

    /// Whether a number is that of a corner, or of a node that moves one.
    pub fn has(&self, number: u32) -> bool {
        self.roles.get(number as usize).is_some_and(|role| role & TAKEN != 0)
    }

    /// An edge of a triangle, marked where it is looked at with another.
    fn marked(&self, triangle: u32, edge: u32) -> u32 {
        match self.triangles.get(edge as usize) {
            Some(of_edge) if of_edge[0] == triangle => edge,
            _ => edge | ELSEWHERE,
        }
    }
}

impl Skin {
    /// What the skin of a body is to become. Changes nothing but the room that there is.
    pub fn prepare(&mut self, body: &System, to_be: &SurfaceToBe) -> Result<Option<SkinChange>> {
        let Some(changing) = &self.changing else {
            return Ok(None);
        };
        let known = body.node_count();
        let own = |corners: [u32; 3]| corners.map(|corner| body.order.own(corner));
        let (changed, added) = (to_be.change.changed, to_be.change.added);
        let mut triangles = memory::reserved(changed.len() + added.len())?;
        triangles.extend(changed.iter().map(|&(number, corners)| (number as usize, own(corners))));
        triangles.extend((self.triangles.len()..).zip(added.iter().map(|&corners| own(corners))));
        let (triangles, edges, edge_count) = self.edges_to_be(changing, &triangles, changed.len())?;
        // Where it is does not matter much to the shape of a tree.
        let corners_of =
            |triangle: u32| match triangles.binary_search_by_key(&(triangle as usize), |&(number, ..)| number) {
                Ok(place) => triangles[place].1,
                Err(_) => self.triangles[triangle as usize],
            };
        let places = body.state.positions();
        let tree = self.forest.with_more(added.len(), |triangle| {
            corners_of(triangle).map(|corner| place_of(places, body, to_be.nodes, corner))
        })?;
        let mut firsts = Vec::new();
        if let Some(of_known) = &self.firsts {
            firsts.try_reserve(to_be.nodes.len())?;
            let new = (known as u32..).take(to_be.nodes.len());
            firsts.extend(new.map(|number| place_of(of_known, body, to_be.nodes, number)));
        }
        let mut movers = memory::reserved(4 * to_be.bound.len())?;
        movers.extend(to_be.bound.iter().flat_map(Bound::parts).map(|(node, _)| node));
        memory::sort_once(&mut movers);
        let mut bared = memory::reserved(triangles.len())?;
        let is_bared = triangles.iter().zip(to_be.bared).filter(|&(_, &bared)| bared);
        bared.extend(is_bared.map(|(&(number, ..), _)| number as u32));
        let change = SkinChange {
            node_count: known + to_be.nodes.len(),
            triangles,
            edges,
            edge_count,
            tree,
            movers,
            firsts,
            bared,
            is_open: to_be.is_open,
        };
        self.reserve(&change)?;
        Ok(Some(change))
    }

    fn reserve(&mut self, change: &SkinChange) -> Result<()> {
        let corners = 3 * change.triangles.len();
        self.nodes.try_reserve(corners)?;
        let edges = change.edge_count.saturating_sub(self.edges.len());
        self.edges.try_reserve(edges)?;
        self.pierces.try_reserve(edges)?;
        self.flatness.reserve(change.node_count, self.edges.len() + edges)?;
        let triangles = change.triangles.len();
        self.triangles.try_reserve(triangles)?;
        self.sides.try_reserve(triangles)?;
        if let Some(changing) = &mut self.changing {
            changing.movers.try_reserve(change.movers.len())?;
            changing
                .roles
                .try_reserve(change.node_count.saturating_sub(changing.roles.len()))?;
            changing.triangles.try_reserve(edges)?;
            if let Some(wound) = &mut changing.wound {
                wound.reserve(triangles, change.bared.len())?;
            }
        }
        Ok(())
    }

    /// Finds the edges of triangles that change, of which there are so many, and of those that are added: the triangles with their edges, the
    /// edges that are other than they were, and how many there are.
    ///
    /// What a triangle that changes has in common with one that does not it had before, or the other had nothing there.
    #[expect(clippy::type_complexity, reason = "parts of one answer")]
    fn edges_to_be(
        &self,
        changing: &Changing,
        triangles: &[(usize, [u32; 3])],
        changed: usize,
    ) -> Result<(
        Vec<(usize, [u32; 3], [u32; 3])>,
        Vec<(usize, [u32; 2], [u32; 2])>,
        usize,
    )> {
        let changed = &triangles[..changed];
        let changes = |triangle: u32| {
            changed
                .binary_search_by_key(&(triangle as usize), |&(number, _)| number)
                .is_ok()
        };
        // The edges that there were.
        let mut old = memory::reserved(3 * changed.len())?;
        for &(number, _) in changed {
            let edges = self.sides(number).into_iter().filter(|&edge| edge != NONE);
            old.extend(edges.map(|edge| (self.edges[edge as usize], edge)));
        }
        memory::sort_once(&mut old);
        let mut sides = memory::reserved(3 * triangles.len())?;
        let mut known = memory::reserved(triangles.len())?;
        for (place, &(number, corners)) in triangles.iter().enumerate() {
            known.push((number, corners, [NONE; 3]));
            let ends = ends_of(corners).into_iter().enumerate();
            sides.extend(
                ends.filter(|(_, [a, b])| a != b)
                    .map(|(side, ends)| (ends, place, side)),
            );
        }
        sides.sort_unstable();
        let mut edges = memory::reserved(sides.len() + old.len())?;
        let mut gone = memory::reserved(old.len())?;
        for &(ends, number) in &old {
            let mut of_edge = changing.triangles[number as usize].map(|of| if changes(of) { NONE } else { of });
            if of_edge[0] == NONE {
                of_edge.swap(0, 1);
            }
            let first = sides.partition_point(|&(side, ..)| side < ends);
            if of_edge[0] == NONE && sides.get(first).is_none_or(|&(side, ..)| side != ends) {
                gone.push(number as usize);
                continue;
            }
            edges.push((number as usize, ends, of_edge));
        }
        let kept = edges.len();
        let mut count = self.edges.len();
        let mut free = gone.iter().copied();
        for of_side in sides.chunk_by(|a, b| a.0 == b.0) {
            let ends = of_side[0].0;
            let place = match edges[..kept].binary_search_by_key(&ends, |&(_, ends, _)| ends) {
                Ok(place) => place,
                Err(_) => {
                    let number = free.next().unwrap_or_else(|| {
                        count += 1;
                        count - 1
                    });
                    edges.push((number, ends, HOLE));
                    edges.len() - 1
                }
            };
            let (number, _, of_edge) = &mut edges[place];
            for &(_, place, side) in of_side {
                known[place].2[side] = *number as u32;
                join(of_edge, known[place].0 as u32);
            }
        }
        edges.extend(free.map(|number| (number, HOLE, HOLE)));
        Ok((known, edges, count))
    }

    /// Becomes what it is to be, now that its body has.
    pub fn change(&mut self, change: SkinChange) {
        let Some(changing) = &mut self.changing else {
            return;
        };
        changing.roles.resize(change.node_count, 0);
        for values in [&mut self.velocities, &mut self.expected, &mut self.changes] {
            values.resize(change.node_count, Vec3A::ZERO);
        }
        self.strays.resize(change.node_count, 0.0);
        self.ways.resize(change.node_count, NodeWay::default());
        if let Some(firsts) = &mut self.firsts {
            firsts.grow(change.node_count);
            let first = change.node_count - change.firsts.len();
            for (number, &place) in (first..).zip(&change.firsts) {
                firsts.set(number, place);
            }
        }
        for &mover in &change.movers {
            let role = &mut changing.roles[mover as usize];
            if *role & TAKEN == 0 {
                *role |= TAKEN;
                changing.movers.push(mover);
            }
        }
        self.edges.resize(change.edge_count, HOLE);
        self.pierces.resize(change.edge_count, false);
        changing.triangles.resize(change.edge_count, HOLE);
        for &(number, ends, of_edge) in &change.edges {
            self.edges[number] = ends;
            self.pierces[number] = false;
            changing.triangles[number] = of_edge;
        }
        for &(number, corners, sides) in &change.triangles {
            if number < self.triangles.len() {
                self.triangles[number] = corners;
                self.sides[number] = sides;
            } else {
                self.triangles.push(corners);
                self.sides.push(sides);
            }
            for corner in corners {
                let role = &mut changing.roles[corner as usize];
                if *role & CORNER == 0 {
                    // A node that moves others is taken twice, which does not matter.
                    *role |= CORNER | TAKEN;
                    self.nodes.push(corner);
                }
            }
        }
        let whose = change.edges.iter().flat_map(|&(_, _, of_edge)| of_edge);
        let changed = change.triangles.iter().map(|&(number, ..)| number as u32);
        for triangle in whose.filter(|&triangle| triangle != NONE).chain(changed) {
            let sides = self.sides[triangle as usize].map(number_of);
            self.sides[triangle as usize] = sides.map(|edge| changing.marked(triangle, edge));
        }
        if let Some(wound) = &mut changing.wound {
            wound.bare(&change.bared, &self.triangles, change.node_count);
        }
        if let Some(tree) = change.tree {
            self.forest.add(tree);
        }
        self.is_closed &= !change.is_open;
    }
}

/// A triangle has come to an edge; more than two do not.
fn join(of_edge: &mut [u32; 2], triangle: u32) {
    if let Some(place) = of_edge.iter_mut().find(|of| **of == NONE) {
        *place = triangle;
    }
}

/// Where a number is, of those that there are and then these, if nodes are at `places`.
fn place_of(places: &Vectors, body: &System, new: &[NewNode], number: u32) -> Vec3 {
    let Some(new_number) = (number as usize).checked_sub(body.node_count()) else {
        return nodes::vector(body.bindings.as_ref(), places, number as usize);
    };
    match &new[new_number] {
        NewNode::Copy(source) => places.get(*source as usize),
        NewNode::Bound(bound) => bound.of(|node| place_of(places, body, new, node as u32)),
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::cutting::Sweep;
    use crate::mesh::{self, Mesh};
    use crate::random::Random;
    use crate::{Body, BodyContact, BodyDefinition, Values, World, WorldDefinition};

    /// A body of springs that meets itself, with room for cuts.
    pub fn meets_itself(mesh: &Mesh) -> BodyDefinition<'_> {
        BodyDefinition {
            masses: Values::Uniform(1e-3),
            stiffnesses: Values::Uniform(10.0),
            spare_nodes: 20_000,
            contact: BodyContact {
                with_itself: true,
                ..BodyContact::NOTHING
            },
            ..BodyDefinition::of(mesh)
        }
    }

    /// Whether it is what the skin of the body would be if it were made now, in some order.
    fn check(body: &Body, skin: &Skin) {
        let surface = body.system().own_surface().expect("memory");
        assert_eq!(skin.triangles, surface);
        let mut edges: Vec<[u32; 2]> = skin.edges.iter().copied().filter(|&edge| edge != HOLE).collect();
        edges.sort_unstable();
        assert_eq!(edges, mesh::edges(&surface, &[]).expect("memory"));
        let mut times = vec![0; skin.edges.len()];
        for (triangle, corners) in surface.iter().enumerate() {
            for edge in skin.owned(triangle).into_iter().filter(|&edge| edge != NONE) {
                times[edge as usize] += 1;
                assert!(skin.edges[edge as usize].iter().all(|end| corners.contains(end)));
            }
        }
        assert!(
            times
                .iter()
                .zip(&skin.edges)
                .all(|(&times, &edge)| times == i32::from(edge != HOLE))
        );
        let mut corners = surface.concat();
        memory::sort_once(&mut corners);
        let mut nodes = skin.nodes.clone();
        nodes.sort_unstable();
        assert_eq!(nodes, corners);
        let positions = body.system().state.positions();
        for corner in corners {
            assert!(body.system().movers(corner).all(|(node, _)| skin.has(node)));
            let first = skin.firsts.as_ref().expect("it meets itself").get(corner as usize);
            assert!(first.distance(positions.get(corner as usize)) < 1e-6);
        }
        let mut found = Vec::new();
        skin.forest
            .near(&skin.forest.bounds(), 1.0, |triangle| found.push(triangle));
        found.sort_unstable();
        assert_eq!(found, (0..surface.len()).collect::<Vec<_>>());
        if let Some(wound) = skin.wound() {
            assert!(
                (0..)
                    .zip(body.bared())
                    .all(|(triangle, bared)| wound.is_bared(triangle) == bared)
            );
        }
    }

    #[test]
    fn a_skin_that_has_followed_cuts_is_that_of_the_body() {
        let sheet = Mesh::cloth([0.1; 2], [10; 2]).expect("a cloth");
        let block = Mesh::block([0.05; 3], [5; 3]).expect("a block");
        for mesh in [sheet, block] {
            let mut world = World::new(WorldDefinition::default()).expect("a world");
            let id = world.create_body(&meets_itself(&mesh)).expect("a body");
            let body = world.body_mut(id).expect("a body");
            let mut skin = Skin::new(body.system()).expect("memory");
            check(body, &skin);
            let mut random = Random(5);
            let mut within = |most: usize| (random.below(2 * most) as f32 - most as f32) * 1e-4;
            for _ in 0..25 {
                let [from, to] = [0, 1].map(|_| Vec3::new(within(600), within(600), within(600)));
                let along = Vec3::new(within(100), within(100), within(100));
                let sweep = Sweep {
                    start: [from - along, from + along],
                    end: [to - along, to + along],
                };
                body.cut(&sweep, Some(&mut skin)).expect("a cut");
                check(body, &skin);
            }
            assert!(skin.triangles.len() > mesh.triangles.len() + 100);
        }
    }
}
