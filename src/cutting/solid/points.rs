//! Assigns indices to vertices of the material: one vertex at a node has its index, any other has its own index among
//! nodes.

use super::body::SolidVertex;
use super::cut::SolidCut;
use crate::base::{Result, memory};
use crate::cutting::cell_complex::{NONE, Node};
use crate::cutting::changes::BoundPoint;
use crate::cutting::node_indices::FreeIndices;

impl SolidCut<'_> {
    /// Assigns indices to new vertices, and lists the changes.
    pub(crate) fn assign_points(&mut self) -> Result<()> {
        let before = self.solid.vertices.before()?;
        let left_node = |&(vertex, was): &(u32, SolidVertex)| {
            let now = self.solid.vertices[vertex];
            (was.point == was.nodes[0] && now.nodes[0] != was.point).then_some(was.point)
        };
        let new_nodes = self.solid.nodes.count_before()..self.solid.nodes.count();
        let mut free = FreeIndices::new(before.iter().filter_map(left_node), new_nodes)?;
        let touched = self.solid.vertices.changed_indices()?;
        let mut at_nodes = memory::reserved(touched.len())?;
        let mut star = Vec::new();
        for vertex in touched {
            let it = self.solid.vertices[vertex];
            let is_at_node = it.weights[0] == 1.0;
            let has_own_index = it.point != NONE && self.solid.nodes[it.point].is_bound();
            let point = if has_own_index || is_at_node && it.point == it.nodes[0] {
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
                self.solid.vertex_star(vertex, &mut star)?;
                let render_triangles = star
                    .iter()
                    .flat_map(|&(at, _)| self.solid.tetrahedra[at].render_triangles);
                for triangle in render_triangles.filter(|&triangle| triangle != NONE) {
                    if self.solid.triangles[triangle].corners.contains(&vertex) {
                        memory::push(&mut self.changes.triangles, triangle)?;
                    }
                }
            }
            if is_at_node && point == it.nodes[0] {
                at_nodes.push(point);
                continue;
            }
            let entry = before.binary_search_by_key(&vertex, |&(at, _)| at);
            let nodes_before = entry.ok().map(|index| before[index].1.nodes);
            if nodes_before != Some(it.nodes) {
                let (nodes, weights) = (it.nodes, it.weights);
                memory::push(&mut self.changes.bound, BoundPoint { point, nodes, weights })?;
            }
        }
        memory::sort_once(&mut self.changes.triangles);
        self.changes.bound.sort_unstable_by_key(|bound| bound.point);
        memory::sort_once(&mut at_nodes);
        self.changes.list_copies(&at_nodes)?;
        // For a vertex that is now at a copy, the index of the original node is lower.
        let vertices = &self.solid.vertices;
        let point_before = |vertex: u32| match before.binary_search_by_key(&vertex, |&(at, _)| at) {
            Ok(index) => before[index].1.point,
            Err(_) => vertices[vertex].point,
        };
        let at = |vertex: u32| [vertices[vertex].point, vertices[vertex].nodes[0]];
        self.changes.list_sources(vertices.count_before(), at, point_before)
    }
}
