//! Assigns indices to vertices of the render mesh: one vertex at a node has its index, any other has its own index
//! among nodes.

use super::cell_complex::{NONE, Node};
use super::changes::BoundPoint;
use super::cut::Cut;
use super::node_indices::FreeIndices;
use super::surface::SurfaceVertex;
use crate::base::{Result, memory};

impl Cut<'_> {
    /// Assigns indices to new vertices, and lists the changes.
    pub(crate) fn assign_points(&mut self) -> Result<()> {
        let before = self.surface.vertices.before()?;
        let left_node = |&(vertex, was): &(u32, SurfaceVertex)| {
            let now = self.surface.vertices[vertex];
            (was.point == was.nodes[0] && now.nodes[0] != was.point).then_some(was.point)
        };
        let new_nodes = self.surface.nodes.count_before()..self.surface.nodes.count();
        let mut free = FreeIndices::new(before.iter().filter_map(left_node), new_nodes)?;
        let touched = self.surface.vertices.changed_indices()?;
        let mut at_nodes = memory::reserved(touched.len())?;
        for vertex in touched {
            let it = self.surface.vertices[vertex];
            let is_at_node = it.weights[0] == 1.0;
            let has_own_index = it.point != NONE && self.surface.nodes[it.point].is_bound();
            let point = if has_own_index || is_at_node && it.point == it.nodes[0] {
                it.point
            } else if is_at_node && free.take(it.nodes[0]) {
                it.nodes[0]
            } else {
                self.limits
                    .check("nodes", self.surface.nodes.count(), self.limits.nodes)?;
                self.surface.nodes.push(Node::BOUND)?
            };
            if point != it.point {
                self.surface.vertices.edit(vertex, |vertex| vertex.point = point)?;
                let ring = self.ring(vertex)?;
                memory::extend(&mut self.changes.triangles, ring.iter().map(|&(triangle, _)| triangle))?;
            }
            if is_at_node && point == it.nodes[0] {
                at_nodes.push(point);
            } else {
                let ([a, b, c], [u, v, w]) = (it.nodes, it.weights);
                let bound = BoundPoint {
                    point,
                    nodes: [a, b, c, a],
                    weights: [u, v, w, 0.0],
                };
                memory::push(&mut self.changes.bound, bound)?;
            }
        }
        memory::sort_once(&mut self.changes.triangles);
        self.changes.bound.sort_unstable_by_key(|bound| bound.point);
        memory::sort_once(&mut at_nodes);
        self.changes.list_copies(&at_nodes)?;
        // For a vertex that is now at a copy, the index of the original node is lower.
        let vertices = &self.surface.vertices;
        let point_before = |vertex: u32| match before.binary_search_by_key(&vertex, |&(at, _)| at) {
            Ok(index) => before[index].1.point,
            Err(_) => vertices[vertex].point,
        };
        let at = |vertex: u32| [vertices[vertex].point, vertices[vertex].nodes[0]];
        self.changes.list_sources(vertices.count_before(), at, point_before)
    }
}
