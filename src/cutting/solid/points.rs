//! Numbers for the material's vertices, drawn or not: of those at a node one has that of the node, any other has one of its own among nodes.

use super::body::SolidVertex;
use super::cut::SolidCut;
use crate::base::{Result, memory};
use crate::cutting::changes::BoundPoint;
use crate::cutting::divided::{NONE, Node};
use crate::cutting::numbers::FreeNodes;

impl SolidCut<'_> {
    /// Numbers what is new, and lists it.
    pub(crate) fn number_points(&mut self) -> Result<()> {
        let before = self.solid.vertices.before()?;
        let has_left = |&(vertex, was): &(u32, SolidVertex)| {
            let is = self.solid.vertices[vertex];
            (was.point == was.nodes[0] && is.nodes[0] != was.point).then_some(was.point)
        };
        let made = self.solid.nodes.count_before()..self.solid.nodes.count();
        let mut free = FreeNodes::new(before.iter().filter_map(has_left), made)?;
        let touched = self.solid.vertices.touched()?;
        let mut at_nodes = memory::reserved(touched.len())?;
        let mut star = Vec::new();
        for vertex in touched {
            let it = self.solid.vertices[vertex];
            let is_at_node = it.weights[0] == 1.0;
            let has_own = it.point != NONE && self.solid.nodes[it.point].is_bound();
            let point = if has_own || is_at_node && it.point == it.nodes[0] {
                it.point
            } else if is_at_node && free.take(it.nodes[0]) {
                it.nodes[0]
            } else {
                self.limits
                    .check("nodes", self.solid.nodes.count(), self.limits.nodes)?;
                self.solid.nodes.push(Node::BOUND)?
            };
            if point != it.point {
                self.solid.vertices.edit(vertex, |vertex| vertex.point = point)?;
                self.solid.star(vertex, &mut star)?;
                let drawn = star.iter().flat_map(|&(at, _)| self.solid.tetrahedra[at].drawn);
                for triangle in drawn.filter(|&triangle| triangle != NONE) {
                    if self.solid.triangles[triangle].corners.contains(&vertex) {
                        memory::push(&mut self.changes.triangles, triangle)?;
                    }
                }
            }
            if is_at_node && point == it.nodes[0] {
                at_nodes.push(point);
                continue;
            }
            let known = before.binary_search_by_key(&vertex, |&(at, _)| at);
            let nodes_before = known.ok().map(|place| before[place].1.nodes);
            if nodes_before != Some(it.nodes) {
                let (nodes, weights) = (it.nodes, it.weights);
                memory::push(&mut self.changes.bound, BoundPoint { point, nodes, weights })?;
            }
        }
        memory::sort_once(&mut self.changes.triangles);
        self.changes.bound.sort_unstable_by_key(|bound| bound.point);
        memory::sort_once(&mut at_nodes);
        self.changes.list_copies(&at_nodes)?;
        // Of a vertex that is at a copy now what it was at has the lower number.
        let vertices = &self.solid.vertices;
        let point_before = |vertex: u32| match before.binary_search_by_key(&vertex, |&(at, _)| at) {
            Ok(place) => before[place].1.point,
            Err(_) => vertices[vertex].point,
        };
        let at = |vertex: u32| [vertices[vertex].point, vertices[vertex].nodes[0]];
        self.changes.list_sources(vertices.count_before(), at, point_before)
    }
}
