//! Topology changes of a collision surface by cuts. The cost of a change does not depend on the size of the rest.

use glam::{Vec3, Vec3A};

use super::collision_surface::{CollisionSurface, NONE, NodeMotion, OWNED_ELSEWHERE, edge_index};
use super::wound::Wound;
use crate::base::{Result, memory};
use crate::codec::saved;
use crate::contact::SurfaceChange;
use crate::geometry::forest::AddedTree;
use crate::mesh::ends_of;
use crate::nodes::{self, NewNode, NodeBinding};
use crate::soa::Vectors;
use crate::solver::System;

/// Marks an unused edge.
const NO_EDGE: [u32; 2] = [NONE; 2];

/// Role of a node or point that is a corner.
const CORNER: u8 = 1;
/// Role of a node or point that is a corner, or moves one.
const USED: u8 = 2;

/// Additional data of a surface whose topology can change.
#[derive(Debug)]
pub(super) struct SurfaceTopology {
    /// Nodes that move corners and are bound to none.
    pub movers: Vec<u32>,
    /// Role of each of the body's nodes and points.
    roles: Vec<u8>,
    /// Triangles of each edge. The first one owns the edge in contact tests.
    triangles: Vec<[u32; 2]>,
    /// Number of nodes and points that the body was created with.
    pub first_added_node: u32,
    /// Surface that cuts through solids exposed.
    pub wound: Option<Wound>,
}

saved! { SurfaceTopology { movers, roles, triangles, first_added_node, wound } }

/// The new surface of a body, and the nodes that move it.
pub(crate) struct NewCollisionSurface<'a> {
    /// Changed triangles, in the caller's numbers.
    pub change: &'a SurfaceChange<'a>,
    /// True for exposed triangles: first those that change, then those that are added.
    pub exposed: &'a [bool],
    /// New nodes.
    pub nodes: &'a [NewNode],
    /// Points that are new, or bound to other nodes than before.
    pub bound: &'a [NodeBinding],
    /// True if the surface has a new cut boundary and so is no longer closed.
    pub is_open: bool,
}

/// A prepared change of a surface, with all the memory it needs.
pub(crate) struct PreparedSurfaceChange {
    node_count: usize,
    /// Index, corners and edges of each triangle.
    triangles: Vec<(usize, [u32; 3], [u32; 3])>,
    /// Index, ends and triangles of each edge.
    edges: Vec<(usize, [u32; 2], [u32; 2])>,
    edge_count: usize,
    tree: Option<AddedTree>,
    movers: Vec<u32>,
    /// Initial positions of new nodes and points.
    initial_positions: Vec<Vec3>,
    exposed: Vec<u32>,
    is_open: bool,
}

impl SurfaceTopology {
    /// Creates the data for a surface with this number of edges, and with the marked edges of each triangle.
    pub fn new(body: &System, nodes: &[u32], edges: usize, triangle_edges: &[[u32; 3]]) -> Result<Self> {
        let spare = body.spare_nodes();
        let mut edge_triangles = memory::reserved(edges + 3 * spare)?;
        edge_triangles.resize(edges, NO_EDGE);
        for (index, &edges_of_triangle) in (0..).zip(triangle_edges) {
            for edge in edges_of_triangle.into_iter().filter(|&edge| edge != NONE) {
                add_triangle(&mut edge_triangles[edge_index(edge) as usize], index);
            }
        }
        let mut roles = memory::reserved(body.node_count() + spare)?;
        roles.resize(body.node_count(), 0);
        for &node in nodes {
            roles[node as usize] = CORNER | USED;
        }
        let wound = body.contact.with_itself && body.cut_properties.is_some_and(|cut| cut.is_solid);
        Ok(Self {
            movers: Vec::new(),
            roles,
            triangles: edge_triangles,
            first_added_node: body.node_count() as u32,
            wound: wound.then(|| Wound::new(body, triangle_edges.len())).transpose()?,
        })
    }

    /// True if a node or point is a corner, or moves one.
    pub fn contains(&self, index: u32) -> bool {
        self.roles.get(index as usize).is_some_and(|role| role & USED != 0)
    }

    /// Marks an edge of a triangle if another triangle owns it.
    fn mark_edge(&self, triangle: u32, edge: u32) -> u32 {
        match self.triangles.get(edge as usize) {
            Some(edge_triangles) if edge_triangles[0] == triangle => edge,
            _ => edge | OWNED_ELSEWHERE,
        }
    }
}

impl CollisionSurface {
    /// Prepares a change of the surface. It changes nothing but the reserved memory.
    pub fn prepare(
        &mut self,
        body: &System,
        new_surface: &NewCollisionSurface,
    ) -> Result<Option<PreparedSurfaceChange>> {
        let Some(topology) = &self.topology else {
            return Ok(None);
        };
        let node_count = body.node_count();
        let to_own_order = |corners: [u32; 3]| corners.map(|corner| body.order.own(corner));
        let (changed, added) = (new_surface.change.changed, new_surface.change.added);
        let mut triangles = memory::reserved(changed.len() + added.len())?;
        triangles.extend(
            changed
                .iter()
                .map(|&(index, corners)| (index as usize, to_own_order(corners))),
        );
        triangles.extend((self.triangles.len()..).zip(added.iter().map(|&corners| to_own_order(corners))));
        let (triangles, edges, edge_count) = self.find_new_edges(topology, &triangles, changed.len())?;
        // Positions affect only the quality of the trees.
        let corners_of =
            |triangle: u32| match triangles.binary_search_by_key(&(triangle as usize), |&(index, ..)| index) {
                Ok(index) => triangles[index].1,
                Err(_) => self.triangles[triangle as usize],
            };
        let positions = body.state.positions();
        let tree = self.forest.build_added(added.len(), |triangle| {
            corners_of(triangle).map(|corner| position_of(positions, body, new_surface.nodes, corner))
        })?;
        let mut initial_positions = Vec::new();
        if let Some(known_positions) = &self.initial_positions {
            initial_positions.try_reserve(new_surface.nodes.len())?;
            let new = (node_count as u32..).take(new_surface.nodes.len());
            initial_positions.extend(new.map(|index| position_of(known_positions, body, new_surface.nodes, index)));
        }
        let mut movers = memory::reserved(4 * new_surface.bound.len())?;
        movers.extend(
            new_surface
                .bound
                .iter()
                .flat_map(NodeBinding::weighted_nodes)
                .map(|(node, _)| node),
        );
        memory::sort_once(&mut movers);
        let mut exposed = memory::reserved(triangles.len())?;
        let exposed_triangles = triangles
            .iter()
            .zip(new_surface.exposed)
            .filter(|&(_, &is_exposed)| is_exposed);
        exposed.extend(exposed_triangles.map(|(&(index, ..), _)| index as u32));
        let change = PreparedSurfaceChange {
            node_count: node_count + new_surface.nodes.len(),
            triangles,
            edges,
            edge_count,
            tree,
            movers,
            initial_positions,
            exposed,
            is_open: new_surface.is_open,
        };
        self.reserve(&change)?;
        Ok(Some(change))
    }

    fn reserve(&mut self, change: &PreparedSurfaceChange) -> Result<()> {
        let corners = 3 * change.triangles.len();
        self.nodes.try_reserve(corners)?;
        let edges = change.edge_count.saturating_sub(self.edges.len());
        self.edges.try_reserve(edges)?;
        self.is_crossing.try_reserve(edges)?;
        self.edge_curvatures
            .reserve(change.node_count, self.edges.len() + edges)?;
        let triangles = change.triangles.len();
        self.triangles.try_reserve(triangles)?;
        self.triangle_edges.try_reserve(triangles)?;
        if let Some(topology) = &mut self.topology {
            topology.movers.try_reserve(change.movers.len())?;
            topology
                .roles
                .try_reserve(change.node_count.saturating_sub(topology.roles.len()))?;
            topology.triangles.try_reserve(edges)?;
            if let Some(wound) = &mut topology.wound {
                wound.reserve(triangles, change.exposed.len())?;
            }
        }
        Ok(())
    }

    /// Finds the edges of the triangles, of which the first `changed` replace others and the rest are added. Returns
    /// the triangles with their edges, all edges that change, and the number of edges.
    ///
    /// An edge between a changed and an unchanged triangle is either an edge of the changed triangle before, or had one
    /// triangle.
    #[expect(clippy::type_complexity, reason = "parts of one answer")]
    fn find_new_edges(
        &self,
        topology: &SurfaceTopology,
        triangles: &[(usize, [u32; 3])],
        changed: usize,
    ) -> Result<(
        Vec<(usize, [u32; 3], [u32; 3])>,
        Vec<(usize, [u32; 2], [u32; 2])>,
        usize,
    )> {
        let changed = &triangles[..changed];
        let is_changed = |triangle: u32| {
            changed
                .binary_search_by_key(&(triangle as usize), |&(index, _)| index)
                .is_ok()
        };
        // Edges of the changed triangles before the change.
        let mut old_edges = memory::reserved(3 * changed.len())?;
        for &(index, _) in changed {
            let edges = self.edges_of(index).into_iter().filter(|&edge| edge != NONE);
            old_edges.extend(edges.map(|edge| (self.edges[edge as usize], edge)));
        }
        memory::sort_once(&mut old_edges);
        let mut edge_uses = memory::reserved(3 * triangles.len())?;
        let mut updated = memory::reserved(triangles.len())?;
        for (entry, &(index, corners)) in triangles.iter().enumerate() {
            updated.push((index, corners, [NONE; 3]));
            let ends = ends_of(corners).into_iter().enumerate();
            edge_uses.extend(
                ends.filter(|(_, [a, b])| a != b)
                    .map(|(side, ends)| (ends, entry, side)),
            );
        }
        edge_uses.sort_unstable();
        let mut edges = memory::reserved(edge_uses.len() + old_edges.len())?;
        let mut freed = memory::reserved(old_edges.len())?;
        for &(ends, index) in &old_edges {
            let mut edge_triangles = topology.triangles[index as usize]
                .map(|edge_triangle| if is_changed(edge_triangle) { NONE } else { edge_triangle });
            if edge_triangles[0] == NONE {
                edge_triangles.swap(0, 1);
            }
            let first = edge_uses.partition_point(|&(side, ..)| side < ends);
            if edge_triangles[0] == NONE && edge_uses.get(first).is_none_or(|&(side, ..)| side != ends) {
                freed.push(index as usize);
                continue;
            }
            edges.push((index as usize, ends, edge_triangles));
        }
        let existing_count = edges.len();
        let mut count = self.edges.len();
        let mut free = freed.iter().copied();
        for uses_of_edge in edge_uses.chunk_by(|a, b| a.0 == b.0) {
            let ends = uses_of_edge[0].0;
            let entry = match edges[..existing_count].binary_search_by_key(&ends, |&(_, ends, _)| ends) {
                Ok(entry) => entry,
                Err(_) => {
                    let index = free.next().unwrap_or_else(|| {
                        count += 1;
                        count - 1
                    });
                    edges.push((index, ends, NO_EDGE));
                    edges.len() - 1
                }
            };
            let (index, _, edge_triangles) = &mut edges[entry];
            for &(_, entry, side) in uses_of_edge {
                updated[entry].2[side] = *index as u32;
                add_triangle(edge_triangles, updated[entry].0 as u32);
            }
        }
        edges.extend(free.map(|index| (index, NO_EDGE, NO_EDGE)));
        Ok((updated, edges, count))
    }

    /// Applies a prepared change, after the change of the body.
    pub fn apply_change(&mut self, change: PreparedSurfaceChange) {
        let Some(topology) = &mut self.topology else {
            return;
        };
        topology.roles.resize(change.node_count, 0);
        for values in [
            &mut self.velocities,
            &mut self.predicted_velocities,
            &mut self.velocity_changes,
        ] {
            values.resize(change.node_count, Vec3A::ZERO);
        }
        self.deviations.resize(change.node_count, 0.0);
        self.motions.resize(change.node_count, NodeMotion::default());
        if let Some(initial_positions) = &mut self.initial_positions {
            initial_positions.grow(change.node_count);
            let first = change.node_count - change.initial_positions.len();
            for (index, &position) in (first..).zip(&change.initial_positions) {
                initial_positions.set(index, position);
            }
        }
        for &mover in &change.movers {
            let role = &mut topology.roles[mover as usize];
            if *role & USED == 0 {
                *role |= USED;
                topology.movers.push(mover);
            }
        }
        self.edges.resize(change.edge_count, NO_EDGE);
        self.is_crossing.resize(change.edge_count, false);
        topology.triangles.resize(change.edge_count, NO_EDGE);
        for &(index, ends, edge_triangles) in &change.edges {
            self.edges[index] = ends;
            self.is_crossing[index] = false;
            topology.triangles[index] = edge_triangles;
        }
        for &(index, corners, sides) in &change.triangles {
            if index < self.triangles.len() {
                self.triangles[index] = corners;
                self.triangle_edges[index] = sides;
            } else {
                self.triangles.push(corners);
                self.triangle_edges.push(sides);
            }
            for corner in corners {
                let role = &mut topology.roles[corner as usize];
                if *role & CORNER == 0 {
                    // A corner that also moves others is in both lists, which is harmless.
                    *role |= CORNER | USED;
                    self.nodes.push(corner);
                }
            }
        }
        let affected = change.edges.iter().flat_map(|&(_, _, edge_triangles)| edge_triangles);
        let changed = change.triangles.iter().map(|&(index, ..)| index as u32);
        for triangle in affected.filter(|&triangle| triangle != NONE).chain(changed) {
            let sides = self.triangle_edges[triangle as usize].map(edge_index);
            self.triangle_edges[triangle as usize] = sides.map(|edge| topology.mark_edge(triangle, edge));
        }
        if let Some(wound) = &mut topology.wound {
            wound.expose(&change.exposed, &self.triangles, change.node_count);
        }
        if let Some(tree) = change.tree {
            self.forest.add(tree);
        }
        self.is_closed &= !change.is_open;
    }
}

/// Adds a triangle to an edge, which has at most two.
fn add_triangle(edge_triangles: &mut [u32; 2], triangle: u32) {
    if let Some(slot) = edge_triangles.iter_mut().find(|slot| **slot == NONE) {
        *slot = triangle;
    }
}

/// Returns the position of a node or point, old or new, for nodes at `positions`.
fn position_of(positions: &Vectors, body: &System, new: &[NewNode], index: u32) -> Vec3 {
    let Some(new_index) = (index as usize).checked_sub(body.node_count()) else {
        return nodes::vector(body.bindings.as_ref(), positions, index as usize);
    };
    match &new[new_index] {
        NewNode::Copy(source) => positions.get(*source as usize),
        NewNode::Bound(bound) => bound.interpolate(|node| position_of(positions, body, new, node as u32)),
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::cutting::Sweep;
    use crate::mesh::{self, Mesh};
    use crate::random::Random;
    use crate::{Body, BodyContact, BodyDefinition, Values, World, WorldDefinition};

    /// Returns a body of springs with self-contact and capacity for cuts.
    pub fn self_colliding_body(mesh: &Mesh) -> BodyDefinition<'_> {
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

    /// Compares the surface with a new one of the same body, except for the order.
    fn check(body: &Body, surface: &CollisionSurface) {
        let triangles_of_body = body.system().own_surface().expect("memory");
        assert_eq!(surface.triangles, triangles_of_body);
        let mut edges: Vec<[u32; 2]> = surface.edges.iter().copied().filter(|&edge| edge != NO_EDGE).collect();
        edges.sort_unstable();
        assert_eq!(edges, mesh::edges(&triangles_of_body, &[]).expect("memory"));
        let mut counts = vec![0; surface.edges.len()];
        for (triangle, corners) in triangles_of_body.iter().enumerate() {
            for edge in surface.owned_edges(triangle).into_iter().filter(|&edge| edge != NONE) {
                counts[edge as usize] += 1;
                assert!(surface.edges[edge as usize].iter().all(|end| corners.contains(end)));
            }
        }
        assert!(
            counts
                .iter()
                .zip(&surface.edges)
                .all(|(&counts, &edge)| counts == i32::from(edge != NO_EDGE))
        );
        let mut corners = triangles_of_body.concat();
        memory::sort_once(&mut corners);
        let mut nodes = surface.nodes.clone();
        nodes.sort_unstable();
        assert_eq!(nodes, corners);
        let positions = body.system().state.positions();
        for corner in corners {
            assert!(body.system().movers(corner).all(|(node, _)| surface.contains(node)));
            let first = surface
                .initial_positions
                .as_ref()
                .expect("it meets itself")
                .get(corner as usize);
            assert!(first.distance(positions.get(corner as usize)) < 1e-6);
        }
        let mut found = Vec::new();
        surface
            .forest
            .near(&surface.forest.bounds(), 1.0, |triangle| found.push(triangle));
        found.sort_unstable();
        assert_eq!(found, (0..triangles_of_body.len()).collect::<Vec<_>>());
        if let Some(wound) = surface.wound() {
            assert!(
                (0..)
                    .zip(body.exposed())
                    .all(|(triangle, exposed)| wound.is_exposed(triangle) == exposed)
            );
        }
    }

    #[test]
    fn a_surface_changed_by_cuts_equals_a_new_one() {
        let sheet = Mesh::cloth([0.1; 2], [10; 2]).expect("a cloth");
        let block = Mesh::block([0.05; 3], [5; 3]).expect("a block");
        for mesh in [sheet, block] {
            let mut world = World::new(WorldDefinition::default()).expect("a world");
            let id = world.create_body(&self_colliding_body(&mesh)).expect("a body");
            let body = world.body_mut(id).expect("a body");
            let mut surface = CollisionSurface::new(body.system()).expect("memory");
            check(body, &surface);
            let mut random = Random(5);
            let mut within = |most: usize| (random.below(2 * most) as f32 - most as f32) * 1e-4;
            for _ in 0..25 {
                let [from, to] = [0, 1].map(|_| Vec3::new(within(600), within(600), within(600)));
                let along = Vec3::new(within(100), within(100), within(100));
                let sweep = Sweep {
                    start: [from - along, from + along],
                    end: [to - along, to + along],
                };
                body.cut(&sweep, Some(&mut surface)).expect("a cut");
                check(body, &surface);
            }
            assert!(surface.triangles.len() > mesh.triangles.len() + 100);
        }
    }
}
